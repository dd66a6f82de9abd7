"""Words for what a rule brings about."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from socialai_dsl.grammar import ast
from socialai_dsl.semantics import hands, object_facts
from socialai_dsl.semantics.resolver import ENTITY, Resolver
from socialai_dsl.semantics.scope import ReportedError, Scope, quoted
from socialai_dsl.semantics.signatures import Signature
from socialai_dsl.semantics.terms import Const, Term
from socialai_dsl.semantics.words.statuses import status_of


@dataclass(frozen=True, slots=True)
class Caused:
    """An effect's word where it is written.

    Attributes:
        word: its row of the table. node: all of it, for messages. subject: what it is about, as written.
        entities: what it is about. args: what is written in brackets.
    """

    resolver: Resolver
    word: Change
    node: ast.Expr
    subject: ast.Expr
    entities: tuple[Term, ...]
    args: tuple[ast.Expr, ...]
    scope: Scope

    def fail(
        self, code: str, message: str, node: ast.Expr | None = None, **more: str | None
    ) -> ReportedError:
        """Report what is wrong with it, or with a part of it; raising the result gives it up."""
        return self.resolver.fail(code, message, node or self.node, self.scope, **more)


def _status(caused: Caused) -> None:
    """Whether the objects can have the status that it needs or leads to."""
    fields = [status_of(caused.resolver, each, caused.node, caused.scope) for each in caused.entities]
    words, wanted = fields[0].type.words, caused.word.makes or caused.word.needs
    if wanted not in words:
        message = (
            f"`{caused.word.name}` cannot happen to `{quoted(caused.subject)}`: it is {' or '.join(words)}"
        )
        raise caused.fail("S204", message, hint="`x.become(status)` sets a status")


@dataclass(frozen=True, slots=True, kw_only=True)
class Change(Signature):
    """A word for an effect.

    Attributes:
        meaning: checks what it is about, and gives the value that it needs; None: it needs none.
        makes: the status that it leads to; None: none, or one that depends on more.
        needs: the status that what it is about must be able to have, beside the one that it leads to.
        takes_away: what it is about may leave the room. carries_off: it may come to lie on another cell.
    """

    meaning: Callable[[Caused], Term | None] = _status
    makes: str | None = None
    needs: str | None = None
    takes_away: bool = False
    carries_off: bool = False

    @property
    def sets_status(self) -> bool:
        """Whether what it is about may have another status afterwards."""
        return self.makes is not None or self.needs is not None or "status" in self.takes


def _become(caused: Caused) -> Term:
    fields = [status_of(caused.resolver, each, caused.node, caused.scope) for each in caused.entities]
    return caused.resolver.value(caused.args[0], fields[0].type, caused.scope)


def _vanish(caused: Caused) -> None:
    if _may_be_the_agent(caused.entities):
        raise caused.fail("S204", _not_the_agent(caused, "vanish"))


def _reset(caused: Caused) -> None:
    """The agent cannot be put back to where it started."""
    if _may_be_the_agent(caused.entities):
        raise caused.fail("S211", _not_the_agent(caused, "be reset"), caused.subject)


def _may_be_the_agent(entities: Sequence[Term]) -> bool:
    return any(each.type.low == 0 for each in entities)


def _not_the_agent(caused: Caused, what: str) -> str:
    if all(isinstance(each, Const) for each in caused.entities):
        return f"the agent cannot {what}"
    return f"`{quoted(caused.subject)}` may be the agent, which cannot {what}"


def _put(caused: Caused) -> Term:
    """A cell, or what is on it."""
    (node,) = caused.args
    if isinstance(node, ast.Name) and node.id == "nowhere":
        message = f"what is taken out of the room vanishes: `{quoted(caused.subject)}.vanish`"
        raise caused.fail("S204", message, node)
    return caused.resolver.somewhere(node, caused.scope)


def _move_into(caused: Caused) -> Term:
    """An object that can hold it, or who carries it."""
    resolver, scope, (node,) = caused.resolver, caused.scope, caused.args
    holder = resolver.value(node, ENTITY, scope)
    things = [number for each in caused.entities for number in each.type.values]
    object_facts.check_holder(resolver, holder, node, scope, things)
    for thing in () if hands.is_member(resolver, holder) else caused.entities:
        object_facts.container(resolver, thing, caused.subject, scope)
    return holder


EFFECTS: Final = (
    Change("open", "object", doc="it becomes open", makes="open"),
    Change("close", "object", doc="it becomes closed", makes="closed"),
    Change("lock", "object", doc="it becomes locked", makes="locked"),
    Change("unlock", "object", doc="if it is locked, it becomes closed, a box shut", needs="locked"),
    Change("reset", "entity",
           doc="an object has its first status, place and content again, its timer at 0; an NPC its first "
               "place, if that is free, and direction, and points no longer; who began `gone` is gone again",
           meaning=_reset),
    Change("vanish", "entity", doc="an object or an NPC leaves the room: it is `gone`", takes_away=True,
           meaning=_vanish),
    Change("reveal", "object", doc="it becomes opened, and its content takes its place", makes="opened"),
    Change("put", "entity",
           doc="it comes to the cell x, or the cell of x, also from out of the room; a member only where it "
               "can stand. Without effect if x is out of the room", takes=("entity",), takes_away=True,
           carries_off=True, meaning=_put),
    Change("move_into", "object",
           doc="it lies in the object x from now on, out of the room; if x is a member with empty hands, x "
               "carries it", takes=("entity",), takes_away=True, carries_off=True, meaning=_move_into),
    Change("become", "object", doc="it takes this status", takes=("status",), meaning=_become),
)  # fmt: skip
