"""Groups in the cast: `peers: {count: 3, ...}` as three members `peers[0]`, `peers[1]`, `peers[2]`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from socialai_dsl.diagnostics import DiagnosticBag, did_you_mean
from socialai_dsl.schema import CastMember
from socialai_dsl.schema.shape import PARAMETER
from socialai_dsl.source import DataPath, Positions, Span

MOST: Final = 16
_AGENT: Final = "agent"
_KEYS: Final = frozenset(field.alias or name for name, field in CastMember.model_fields.items())
_ONE_EACH: Final = ("name", "color", "place", "facing", "at")
"""Keys of a group whose lists give one value each."""


@dataclass(frozen=True)
class Spread:
    """A document whose groups of the cast are written out.

    Attributes:
        data: the document.
        places: where its parts stand; those of a member of a group, where the group is written.
        paths: the paths that were given, in the document as it is now.
    """

    data: Mapping[str, object]
    places: Positions
    paths: frozenset[DataPath]


def spread(
    data: Mapping[str, object], places: Positions, paths: frozenset[DataPath], bag: DiagnosticBag
) -> Spread:
    """Write out the groups; reports counts that are none, and lists of another length.

    Args:
        data: a scenario as plain data.
        places: where its parts stand.
        paths: of values that were a parameter.
        bag: takes the findings.
    """
    cast = data.get("cast")
    if not isinstance(cast, dict):
        return Spread(data, places, paths)
    written: dict[str, object] = {}
    origins: dict[DataPath, DataPath] = {}
    for name, member in cast.items():
        if "[" in str(name):
            message = f"`{name}` is not a name"
            hint = "a group is written once, with `count:`"
            bag.error("S104", message, places.key_span(("cast", name)), hint=hint)
        member = _with_one_frame(name, member, places, bag)
        if not isinstance(member, dict) or "count" not in member or name == _AGENT:
            written[name] = _alone(name, member, places, bag)
            continue
        count = _count(name, member["count"], places, bag)
        for i in range(count or 1):
            written[f"{name}[{i}]"] = _one(name, member, i, count, places, bag, origins)
            origins[("cast", f"{name}[{i}]")] = ("cast", name)
    if written == cast:
        return Spread(data, places, paths)
    spread_places = _SpreadPlaces(places, origins)
    moved = {copy for copy in _all_paths(written) if spread_places.written(copy) in paths}
    return Spread({**data, "cast": written}, spread_places, paths | moved)


def _with_one_frame(name: str, member: object, places: Positions, bag: DiagnosticBag) -> object:
    """A member that is given several frames with the first of them only."""
    if not isinstance(member, dict):
        return member
    for key in ("frames", "frame"):
        given = member.get(key)
        if not isinstance(given, list):
            continue
        made = {other: value for other, value in member.items() if other != key}
        words = [str(word) for word in given]
        if len(words) > 1:
            message = f"`{words[0]}` and `{words[1]}` would both move `{name}`: a member follows one frame"
            hint = "join them in one frame, or let two members follow them"
            bag.error("S313", message, places.value_span(("cast", name, key, 1)), hint=hint)
        else:
            hint = f"write `frame: {words[0]}`" if words else "leave it out: without a frame it stays"
            message = "`frame` names one frame, here is a list"
            bag.error("S104", message, places.value_span(("cast", name, key)), hint=hint)
        return {**made, "frame": words[0]} if words else made
    return member


def _alone(name: str, member: object, places: Positions, bag: DiagnosticBag) -> object:
    """A member that is no group: it has no `count`, and no lists of one value for each."""
    if not isinstance(member, dict):
        return member
    if "count" in member:
        message = "there is one agent, so it has no `count`"
        bag.error("S101", message, places.key_span(("cast", name, "count")))
    made = {key: value for key, value in member.items() if key != "count"}
    for key in [key for key in made if did_you_mean(str(key), [*_KEYS, "count"]) == "count"]:
        message = f"unknown key `{key}` in a member of the cast"
        bag.error("S101", message, places.key_span(("cast", name, key)), suggestion="count")
        del made[key]
    for key in _ONE_EACH[:-1]:
        if isinstance(made.get(key), list):
            message = f"a list gives one `{key}` to each of a group; `{name}` is only one"
            hint = None if name == _AGENT else "a group has a `count`; alternatives are drawn by pick(a | b)"
            bag.error("S104", message, places.value_span(("cast", name, key)), hint=hint)
            del made[key]
    return made


def _count(name: str, count: object, places: Positions, bag: DiagnosticBag) -> int | None:
    """How many a group has; None if that is not known."""
    if isinstance(count, int) and not isinstance(count, bool) and 1 <= count <= MOST:
        return count
    if isinstance(count, str) and PARAMETER.fullmatch(count):
        return None  # there is no such parameter, which has been said
    message = f"`count` is a number of members from 1 to {MOST}"
    bag.error("S106", message, places.value_span(("cast", name, "count")))
    return None


def _one(
    name: str,
    member: Mapping[str, Any],
    index: int,
    count: int | None,
    places: Positions,
    bag: DiagnosticBag,
    origins: dict[DataPath, DataPath],
) -> dict[str, object]:
    """One member of a group."""
    made: dict[str, object] = {}
    for key, value in member.items():
        if key == "count":
            continue
        if key not in _ONE_EACH or not isinstance(value, list):
            made[key] = value
            continue
        one_cell = key == "at" and not any(isinstance(cell, list) for cell in value)
        given = [value] if one_cell else value
        if len(given) != count:
            if index == 0 and count is not None:
                message = f"{len(given)} given for {count}: a list has one for each member of the group"
                bag.error("S106", message, places.value_span(("cast", name, key)))
            continue
        made[key] = given[index]
        if not one_cell:
            origins[("cast", f"{name}[{index}]", key)] = ("cast", name, key, index)
    return made


def _all_paths(cast: Mapping[str, object]) -> list[DataPath]:
    found: list[DataPath] = []

    def walk(part: object, path: DataPath) -> None:
        found.append(path)
        if isinstance(part, dict):
            for key, value in part.items():
                walk(value, (*path, key))
        elif isinstance(part, list):
            for i, value in enumerate(part):
                walk(value, (*path, i))

    walk(cast, ("cast",))
    return found


@dataclass(frozen=True)
class _SpreadPlaces:
    """Positions of a document whose groups are written out."""

    places: Positions
    origins: Mapping[DataPath, DataPath]

    def written(self, path: DataPath) -> DataPath:
        """Where the author wrote the part at a path."""
        for length in (3, 2):
            origin = self.origins.get(path[:length])
            if origin is not None:
                return (*origin, *path[length:])
        return path

    def locate(self, path: DataPath, offset: int = 0, width: int = 1) -> Span:
        """The place of a character of the text at `path`."""
        return self.places.locate(self.written(path), offset, width)

    def value_span(self, path: DataPath) -> Span:
        """The place of the value at `path`."""
        return self.places.value_span(self.written(path))

    def key_span(self, path: DataPath) -> Span:
        """The place of the key at `path`."""
        return self.places.key_span(self.written(path))

    def in_flow(self, path: DataPath) -> bool:
        """Whether the part at `path` stands inside { } or [ ]."""
        return self.places.in_flow(self.written(path))
