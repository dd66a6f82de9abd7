"""The cast as it is meant: for every key of a member the value that counts, from wherever it is written.

A `one_of` is a draw, and what its files give differently are cases of a value that depends on the draw. What follows
asks for values and their cases, and knows of no files.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeAlias

from socialai_dsl.schema.scenario import CastMember, Character, Role, Scenario
from socialai_dsl.semantics.terms import Const, Read, Term, Type, one_of
from socialai_dsl.source import DataPath

AGENT = "agent"

FOLLOWED = "frames"
"""The key of the frame that a member follows, as a model, beside `frame`, which names it."""


class Written(NamedTuple):
    """A value, None for one that is left out, and where it is written."""

    raw: Any
    path: DataPath


Version: TypeAlias = Mapping[str, Written]
"""Key -> what counts there; of `with` the key of each slot, `with.near`; at `npc` how the version is called."""


def fillings(version: Version) -> dict[str, Any]:
    """Slot -> what fills it."""
    return {key.removeprefix("with."): one.raw for key, one in version.items() if key.startswith("with.")}


@dataclass(frozen=True)
class Case:
    """A value as it is written, and the condition that it is this one of several.

    Attributes:
        raw, path: the value, None for one that is left out, and where it is written.
        drawn: the register that the value depends on; None if it depends on nothing.
        numbers: what is in that register when it is this one.
    """

    raw: Any
    path: DataPath
    drawn: Read | None
    numbers: tuple[int, ...]

    @property
    def when(self) -> Term | None:
        """The condition; None if it is certain."""
        if self.drawn is None or len(self.numbers) == self.drawn.type.size:
            return None
        return one_of(self.drawn, [Const(self.drawn.type, number) for number in self.numbers])


Cases: TypeAlias = tuple[Case, ...]
"""All that a value can be."""


def grouped(cases: Cases) -> Cases:
    """The same with cases of equal values as one, which is written where the first is."""
    found: list[Case] = []
    for case in cases:
        same = (i for i, one in enumerate(found) if one.raw == case.raw and type(one.raw) is type(case.raw))
        if (place := next(same, None)) is None:
            found.append(case)
        else:
            found[place] = replace(found[place], numbers=(*found[place].numbers, *case.numbers))
    return tuple(found)


@dataclass(frozen=True)
class Member:
    """A member of the cast.

    Attributes:
        key: its name there.
        drawn: the register that says which of its versions it is; None if there is only one.
        versions: all that it can be.
    """

    key: str
    drawn: Read | None
    versions: tuple[Version, ...]

    def each(self, *keys: str) -> Cases:
        """What is given for a key in each version; of several keys, for the first that is given."""
        nothing = Written(None, ("cast", self.key, *keys[-1].split(".")))
        values = (next((one[key] for key in keys if key in one), nothing) for one in self.versions)
        return tuple(Case(*value, self.drawn, (number,)) for number, value in enumerate(values))

    def cases(self, *keys: str) -> Cases:
        """What differs among these."""
        return grouped(self.each(*keys))

    def value(self, key: str) -> Any:
        """The value of a key that all versions share; None if it is left out."""
        return self.each(key)[0].raw

    def filling(self, slot: str) -> Cases | None:
        """What fills a slot of the member's frame in each version; None if one leaves it empty."""
        return self.each(f"with.{slot}") if all(f"with.{slot}" in one for one in self.versions) else None


def members(scenario: Scenario) -> dict[str, Member]:
    """The cast, in the order written."""
    return {name: _member(scenario, name) for name in scenario.cast}


def _member(scenario: Scenario, name: str) -> Member:
    words = tuple(file.npc for file in scenario.cast[name].one_of or ())
    drawn = Read(Type("text", 0, len(words) - 1, words), f"{name}.one_of") if words else None
    versions = (_version(scenario, name, number) for number in range(len(words) or 1))
    return Member(name, drawn, tuple(versions))


def _version(scenario: Scenario, name: str, number: int) -> dict[str, Written]:
    """What counts if a file of this number is drawn: what is written nearer covers what is farther away."""
    own, npc = scenario.cast[name], name != AGENT
    file = own.one_of[number] if own.one_of else None
    role = scenario.roles.get(own.role) if own.role is not None else None
    layers: list[tuple[DataPath, Character | Role | None]] = [
        (("npc_defaults",), scenario.npc_defaults if npc else None),
        (("roles", str(own.role)), role),
        (("cast", name, "one_of", number), file),
        (("cast", name), own),
    ]
    found = {"npc": Written(name, ("cast", name))}
    for path, part in layers:
        given = dict(_given(path, part)) if part is not None else {}
        if part is role and not npc:
            given.pop("frame", None)  # it drives NPCs only
        if given.keys() & {"place", "at"}:
            found.pop("place", None), found.pop("at", None)
        found |= given
    called = found["frame"].raw if "frame" in found else None
    own_frames: DataPath = ("cast", name, "one_of", number, "frames")
    for path, frames in (("frames",), scenario.frames), (own_frames, file.frames if file is not None else {}):
        if called in frames:
            found[FOLLOWED] = Written(frames[called], (*path, called))
    return found


def _given(path: DataPath, part: Character | Role) -> Iterator[tuple[str, Written]]:
    """What is written in one part of the file, by key."""
    for name in part.model_fields_set & (CastMember.model_fields.keys() - {"role", "one_of"} | {"npc"}):
        value = getattr(part, name)
        if name == "with_":
            yield from ((f"with.{slot}", Written(raw, (*path, "with", slot))) for slot, raw in value.items())
        else:
            yield name, Written(value, (*path, name))
