"""What is known when a rule is looked at, and terms simplified by it: the heart of bucketing rules by trigger."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from socialai_dsl.compiler.classes import SILENCE, Classes
from socialai_dsl.program import Body
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.terms import BOOL, Const, Term, may_find_nothing
from socialai_dsl.trees import every, rebuilt

TRUE = Const(BOOL, 1)
FALSE = Const(BOOL, 0)
SEVERAL = -1
"""Stands for "several classes were heard at once", where each rule has to look for itself."""


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known at compile time; None means unknown.

    Attributes:
        said: utterance class of the agent this step. action: its body action.
        heard: the class in the inbox, or SEVERAL.
    """

    said: int | None = None
    action: int | None = None
    heard: int | None = None


def fold(term: Term, facts: Facts, classes: Classes) -> Term:
    """An equal term with everything decided that the facts decide."""
    if isinstance(term, terms.Said) and facts.said is not None:
        return _truth(facts.said in classes.matching(term.pattern))
    if isinstance(term, terms.Spoke) and facts.said is not None:
        return _truth(facts.said != SILENCE)
    if isinstance(term, terms.Heard) and facts.heard not in (None, SEVERAL):
        return _truth(any(facts.heard in classes.matching(pattern) for pattern in term.patterns))
    if isinstance(term, terms.World) and term.name == "action" and facts.action is not None:
        return Const(term.type, facts.action)
    if isinstance(term, terms.PokedNow) and _toggles_nothing(facts) and not may_find_nothing(term.entity):
        return FALSE
    return _decide(rebuilt(term, lambda part: fold(part, facts, classes)))


def _toggles_nothing(facts: Facts) -> bool:
    """Whether the agent's action is known to be another one."""
    return facts.action not in (None, Body.TOGGLE)


def fold_whole(term: Term, facts: Facts, classes: Classes) -> Term:
    """As `fold`, for a condition as a whole, which is false as well if something in it finds nothing."""
    folded = fold(term, facts, classes)
    return FALSE if _never_true(folded) else folded


def _never_true(term: Term) -> bool:
    if isinstance(term, terms.Logic):
        return (any if term.op == "and" else all)(map(_never_true, term.args))
    return term == FALSE


def substitute(term: Term, name: str, value: Const) -> Term:
    """The term with the quantifier's variable replaced by one of its items."""
    if isinstance(term, terms.Variable):
        return value if term.name == name else term
    if isinstance(term, terms.Quantified) and term.variable == name:
        return term
    found: Term = rebuilt(term, lambda part: substitute(part, name, value))
    return found


def mentions(term: Any, kind: type, such: Callable[[Any], bool] = lambda _: True) -> bool:
    """Whether a term of this kind, and such a one, stands anywhere in the tree."""
    return any(map(such, every(kind, term)))


def _truth(value: bool) -> Const:
    return TRUE if value else FALSE


def _decide(term: Term) -> Term:
    if isinstance(term, terms.Not) and isinstance(term.arg, Const):
        return _truth(not term.arg.value)
    if isinstance(term, terms.Compare) and isinstance(term.left, Const) and isinstance(term.right, Const):
        left, right = term.left.value, term.right.value
        return _truth(
            {"==": left == right, "!=": left != right, "<": left < right, "<=": left <= right}[term.op]
        )
    if isinstance(term, terms.Logic):
        return _decide_logic(term)
    if isinstance(term, terms.Compare) and isinstance(term.left, terms.Select):
        return _decide_compared(term, term.left)
    if isinstance(term, terms.Select):
        return _decide_select(term)
    if isinstance(term, terms.Quantified) and term.op in ("any", "all") and not term.cells:
        return _decide_quantified(term)
    return term


def _decide_logic(term: terms.Logic) -> Term:
    decisive = 0 if term.op == "and" else 1
    rest: list[Term] = []
    for arg in term.args:
        if not isinstance(arg, Const):
            rest.append(arg)
        elif bool(arg.value) == bool(decisive):
            if not any(map(may_find_nothing, rest)):
                return _truth(bool(decisive))
            rest.append(arg)  # what stands before it is still asked: if it finds nothing, all of it is false
            break
    if not rest:
        return _truth(not decisive)
    return rest[0] if len(rest) == 1 else replace(term, args=tuple(rest))


def _decide_select(term: terms.Select) -> Term:
    """Without conditions that never hold, and without what stands after one that always does."""
    kept = []
    default = term.default
    for condition, value in zip(term.conditions, term.values, strict=True):
        if not isinstance(condition, Const):
            kept.append((condition, value))
        elif condition.value:
            default = value
            break
    if all(value == default for _, value in kept) and (not kept or isinstance(default, Const)):
        return default
    conditions, values = zip(*kept, strict=True)
    return replace(term, conditions=conditions, values=values, default=default)


def _decide_compared(term: terms.Compare, left: terms.Select) -> Term:
    """Known values compared with a known value: which conditions make it true is known as well."""
    if not all(isinstance(part, Const) for part in (term.right, left.default, *left.values)):
        return term
    values = tuple(_decide(replace(term, left=value)) for value in left.values)
    default = _decide(replace(term, left=left.default))
    return _decide_select(terms.Select(BOOL, left.conditions, values, default))


def _decide_quantified(term: terms.Quantified) -> Term:
    """Any and all are an `or` and an `and` over the items."""
    parts = tuple(substitute(term.condition or TRUE, term.variable, item) for item in term.items)
    if not parts:
        return _truth(term.op == "all")
    op: Any = "or" if term.op == "any" else "and"
    return _decide(terms.Logic(op, tuple(_decide(part) for part in parts)))
