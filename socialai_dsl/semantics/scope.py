"""The symbol table of a scenario, and what a name can mean at one place of it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from socialai_dsl.grammar import ast
from socialai_dsl.schema import CastMember, Frame, Scenario
from socialai_dsl.schema.base import Expression
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.findings import dotted
from socialai_dsl.semantics.terms import Const, ObjectType, Term, Type

DEFINE = re.compile(r"\s*([A-Za-z_]\w*)\s*(?:\(\s*([A-Za-z_]\w*(?:\s*,\s*[A-Za-z_]\w*)*)\s*\))?\s*")


@dataclass(frozen=True)
class Objects:
    """An object, or a group of them: numbers of its entities, in order."""

    name: str
    type: ObjectType
    numbers: range
    single: bool

    def called(self, index: int) -> str:
        """How one of them is called: `doors[0]`."""
        return self.name if self.single else f"{self.name}[{index}]"


@dataclass(frozen=True)
class Define:
    """A definition: its parameters, and where its expression stands."""

    name: str
    parameters: tuple[str, ...]
    raw: Expression
    path: DataPath


@dataclass(frozen=True)
class Symbols:
    """Everything a scenario declares, by name.

    Attributes:
        cast: member -> its description with defaults filled in, the agent too, in the order written.
        alternatives: member -> everything it can be: one for each file of its `one_of`, else only `cast[member]`.
        numbers: member -> number of its entity.
        roles: role -> the member that plays it.
        groups: name of a group in the cast -> its members.
        objects: name -> its entities.
        types: the object types of the prelude. default_colors: type -> its colour where none is given.
        width, height: least and largest size of the room.
    """

    scenario: Scenario
    cast: Mapping[str, CastMember]
    alternatives: Mapping[str, tuple[CastMember, ...]]
    numbers: Mapping[str, int]
    roles: Mapping[str, str]
    groups: Mapping[str, tuple[str, ...]]
    objects: Mapping[str, Objects]
    types: Mapping[str, ObjectType]
    defines: Mapping[str, Define]
    width: tuple[int, int]
    height: tuple[int, int]
    default_colors: Mapping[str, str]

    @property
    def entities(self) -> int:
        """How many entities there are."""
        return len(self.numbers) + sum(len(o.numbers) for o in self.objects.values())

    @property
    def nouns(self) -> Type:
        """The nouns of the grammar as a type."""
        words = tuple(str(noun) for noun in self.scenario.grammar.nouns)
        return Type("noun", 0, len(words) - 1, words)

    def object_of(self, number: int) -> Objects | None:
        """The group an entity belongs to; None for the cast."""
        return next((o for o in self.objects.values() if number in o.numbers), None)

    def member_of(self, number: int) -> str | None:
        """The cast member with this number; None for objects."""
        return next((name for name, n in self.numbers.items() if n == number), None)

    def member_path(self, name: str, key: str, which: int = 0) -> DataPath:
        """Where a key of a cast member, as alternative `which`, was written: there, in the file that was drawn, in its
        role, or in `npc_defaults`.
        """
        attribute = {"with": "with_"}.get(key, key)
        own = self.scenario.cast[name]
        if attribute in own.model_fields_set:
            return ("cast", name, key)
        if own.one_of and attribute in own.one_of[which].model_fields_set:
            return ("cast", name, "one_of", which, key)
        role = self.scenario.roles.get(own.role) if own.role is not None else None
        if role is not None and attribute in role.model_fields_set:
            return ("roles", str(own.role), key)
        if attribute in self.scenario.npc_defaults.model_fields_set and name != "agent":
            return ("npc_defaults", key)
        return ("cast", name, key)

    def with_path(self, name: str, slot: str, which: int = 0) -> DataPath:
        """Where the value of a member's slot was written."""
        own = self.scenario.cast[name]
        if slot in own.with_:
            return ("cast", name, "with", slot)
        if own.one_of and slot in own.one_of[which].with_:
            return ("cast", name, "one_of", which, "with", slot)
        return ("npc_defaults", "with", slot)

    def frame_of(self, name: str, which: int = 0) -> tuple[Frame, DataPath] | None:
        """The frame that a member follows and where it is written; None if it follows none, or an unknown one."""
        called = self.alternatives[name][which].frame
        own = self.scenario.cast[name]
        if called is None:
            return None
        if own.one_of and called in own.one_of[which].frames:
            return own.one_of[which].frames[called], ("cast", name, "one_of", which, "frames", called)
        if called in self.scenario.frames:
            return self.scenario.frames[called], ("frames", called)
        return None

    @cached_property
    def declared(self) -> dict[str, str]:
        """Every name of the scenario and what it is: let, object, cast, define, memory, roles."""
        found = dict.fromkeys(self.scenario.let, "let")
        found |= dict.fromkeys(self.defines, "define")
        found |= dict.fromkeys(self.scenario.memory, "memory")
        found |= dict.fromkeys(self.scenario.state, "state")
        found |= dict.fromkeys(self.scenario.tables, "tables")
        found |= dict.fromkeys(self.scenario.roles, "roles")
        found |= {name: "object" if o.single else "objects" for name, o in self.objects.items()}
        return found | dict.fromkeys((*self.cast, *self.groups), "cast")

    def group_of(self, member: str) -> tuple[str, int] | None:
        """The group that a member of the cast belongs to and its place in it; None if it stands for itself."""
        for name, members in self.groups.items():
            if member in members:
                return name, members.index(member)
        return None


@dataclass(frozen=True)
class PlayedFrame:
    """A frame as one member plays it.

    Attributes:
        member: who; `number` is its entity.
        name, model: the frame.
        defines: its definitions.
        path: where it is written.
        texts: slots that are substituted wherever they are used (text, utterance, bool) -> where each alternative of
            the member fills them; None if nobody does, as when a frame is only looked at.
        looked_at: nobody plays it; it is checked all the same.
    """

    member: str
    number: int
    name: str
    model: Frame
    path: DataPath
    defines: Mapping[str, Define]
    texts: Mapping[str, tuple[DataPath, ...] | None]
    looked_at: bool = False

    def register(self, name: str) -> str:
        """The path of one of its registers."""
        return f"{self.name} of nobody.{name}" if self.looked_at else f"{self.member}.{name}"

    @property
    def address(self) -> DataPath:
        """What its draw sites are named by, wherever it is written."""
        return ("frames", self.name)


class Draws:
    """Numbers the picks of one value, in source order; `site` names the value (see draws.py)."""

    def __init__(self, site: str) -> None:
        self.site = site
        self._next = 0

    def number(self) -> int:
        """The next ordinal."""
        self._next += 1
        return self._next - 1


@dataclass(frozen=True)
class Macro:
    """An argument of a definition: an expression that is resolved where it is used, in its own scope."""

    node: ast.Expr
    scope: Scope


@dataclass(frozen=True)
class Scope:
    """Where an expression stands and what its names can mean there.

    Attributes:
        path: of the expression's text in the document.
        draws: numbers its picks; `outer` is the value that this one is part of, if its site differs.
        member: whose attribute or frame it is (`self`).
        frame: the frame it stands in.
        variables: variables of quantifiers, and arguments of definitions.
        at_reset: computed once, before the first step.
        here: it is the `where` of a place, so `here` means the candidate cell.
        it: the entity whose attribute is being computed.
        hearing: it belongs to a rule with `hears`, so there is a `speaker`.
        within: names of the definitions it stands in, to find circles. nested: how many quantifiers it stands in.
    """

    path: DataPath
    draws: Draws
    member: str | None = None
    frame: PlayedFrame | None = None
    variables: Mapping[str, Term | Macro] = field(default_factory=dict)
    at_reset: bool = False
    here: bool = False
    it: Const | None = None
    hearing: bool = False
    outer: Draws | None = None
    within: tuple[str, ...] = ()
    nested: int = 0

    def at(self, path: DataPath, site: str) -> Scope:
        """The same names for another value."""
        return replace(self, path=path, draws=Draws(site), outer=None)

    def binding(self, name: str, term: Term | Macro) -> Scope:
        """With one more variable."""
        return replace(self, variables={**self.variables, name: term})

    @property
    def pick_site(self) -> str:
        """The site a pick has to name itself: empty where it is the site of the whole value."""
        return self.draws.site if self.outer is not None else ""


def reset_scope(path: DataPath, site: str | None = None, member: str | None = None) -> Scope:
    """The scope of a value computed at reset."""
    return Scope(path, Draws(site or dotted(path)), member=member, at_reset=True)


def object_scope(objects: Objects, index: int, path: DataPath, key: str, *, at_reset: bool) -> Scope:
    """The scope of a value of one member of a group of objects, which is `it`."""
    number = objects.numbers[index]
    it = Const(Type("entity", number, number), number)
    return Scope(path, Draws(f"objects.{objects.called(index)}.{key}"), at_reset=at_reset, it=it)


def at_every_step(scope: Scope) -> Scope:
    """The same names for a value that is computed anew in every step."""
    return replace(scope, at_reset=False)


def parse_define(key: str) -> tuple[str, tuple[str, ...]] | None:
    """`near(a, b)` as its name and parameters; None if it is not of this form."""
    match = DEFINE.fullmatch(key)
    if match is None:
        return None
    parameters = match.group(2)
    return match.group(1), tuple(p.strip() for p in parameters.split(",")) if parameters else ()


def frames_of(scenario: Scenario) -> Iterator[tuple[DataPath, Frame]]:
    """Every frame with the place where it is written; of the files of a `one_of`, which share theirs, the first's."""
    for name, frame in scenario.frames.items():
        yield ("frames", name), frame
    for member, described in scenario.cast.items():
        for name, frame in described.one_of[0].frames.items() if described.one_of else ():
            yield ("cast", member, "one_of", 0, "frames", name), frame
