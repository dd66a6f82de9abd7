"""Going on after mistakes of shape: what was probably meant, so that the rest of the file is checked as well."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from socialai_dsl.diagnostics import DiagnosticBag
from socialai_dsl.schema.behaviour import FirstRule, Step, ThenRule, WorldRule
from socialai_dsl.source import DataPath, Positions, Span

_KEYS = {key for model in (FirstRule, ThenRule, Step, WorldRule) for key in model.model_fields}
"""Keys of rules, which are mostly written inside { }."""


@dataclass
class Repaired:
    """A document that has been changed into what was probably meant.

    Attributes:
        data: the document, changed.
        moved: path as it is now -> where it is written.
        lost: paths of parts that were left out although they may have meant something.
    """

    data: Any
    moved: dict[DataPath, DataPath] = field(default_factory=dict)
    lost: list[DataPath] = field(default_factory=list)

    def rename(self, path: DataPath, key: str) -> bool:
        """Read the entry at `path` under another key; whether that key was free."""
        parent = self._parent(path)
        if parent is None or key in parent:
            return False
        entries = [(key if k == path[-1] else k, value) for k, value in parent.items()]
        parent.clear()
        parent.update(entries)
        self.moved[(*path[:-1], key)] = written(path, self.moved)
        return True

    def move(self, path: DataPath, to: DataPath) -> None:
        """Read the entry at `path` as if it were written at `to`, in a mapping that has no such key."""
        part_at(self.data, to[:-1])[to[-1]] = part_at(self.data, path[:-1]).pop(path[-1])
        self.moved[to] = written(path, self.moved)

    def leave_out(self, path: DataPath) -> None:
        """Go on without the entry at `path`; an item of a list stays, since the others are known by their number."""
        parent = self._parent(path)
        if parent is not None:
            del parent[path[-1]]
        self.lost.append(path)

    def _parent(self, path: DataPath) -> dict[str | int, Any] | None:
        """The mapping that holds the entry at `path`; None if there is no such entry, or not any more."""
        part = self.data
        for step in path[:-1]:
            known = range(len(part)) if isinstance(part, list) else part if isinstance(part, dict) else ()
            if step not in known:
                return None
            part = part[step]
        return part if isinstance(part, dict) and path[-1] in part else None


def part_at(data: Any, path: DataPath) -> Any:
    """The part of a document at a path that exists."""
    for step in path:
        data = data[step]
    return data


def copied(data: Any) -> Any:
    """A copy whose mappings and lists are free to be changed."""
    if isinstance(data, Mapping):
        return {key: copied(value) for key, value in data.items()}
    return [copied(value) for value in data] if isinstance(data, list) else data


def fill_gaps(repaired: Repaired, places: Positions, bag: DiagnosticBag, path: DataPath = ()) -> None:
    """Report every key and list item without a value, and what a comma inside { } has cut off."""
    part = part_at(repaired.data, path)
    if isinstance(part, list):
        for i, item in enumerate(part):
            if item is None:
                _report_nothing((*path, i), places, bag)
                part[i] = ""
        children: list[str | int] = list(range(len(part)))
    elif isinstance(part, dict):
        _join_cut_values(repaired, part, path, places, bag)
        children = list(part)
    else:
        return
    for child in children:
        fill_gaps(repaired, places, bag, (*path, child))


def _join_cut_values(
    repaired: Repaired, part: dict[str, Any], path: DataPath, places: Positions, bag: DiagnosticBag
) -> None:
    before: str | None = None
    cut: dict[str, list[str]] = {}
    for key, value in list(part.items()):
        if value is not None:
            before = key
        elif (
            before is not None
            and isinstance(part[before], str)
            and _looks_cut(key, part[before], path, places)
        ):
            cut.setdefault(before, []).append(key)
            del part[key]
        else:
            _report_nothing((*path, key), places, bag)
            repaired.leave_out((*path, key))
    for key, pieces in cut.items():
        head = part[key]
        part[key] = ", ".join([head, *pieces])
        hint = f'write `{key}: "{part[key]}"`, or put every key on a line of its own'
        word, space, rest = pieces[0].partition(" ")
        if space and word in _KEYS:
            hint = f"a colon is missing: write `{word}: {rest}`"
        message = (
            f"unknown key `{pieces[0]}`: inside {{ }} a comma ends the value, so `{key}` is only `{head}`"
        )
        bag.error("S102", message, places.key_span((*path, pieces[0])), hint=hint)


def _looks_cut(key: str, before: str, path: DataPath, places: Positions) -> bool:
    """Whether a key without a value is the rest of the value before it."""
    if not places.in_flow((*path, key)):
        return False
    in_text = path[-1:] == ("with",) or (isinstance(path[-1], int) and key not in _KEYS) if path else False
    return in_text or not key.isidentifier() or before.count("(") > before.count(")")


def _report_nothing(path: DataPath, places: Positions, bag: DiagnosticBag) -> None:
    key = path[-1]
    what = "an item of this list is empty" if isinstance(key, int) else f"nothing is given for `{key}`"
    bag.error("S104", what, places.key_span(path), hint="write a value, or leave the key out")


def written(path: DataPath, moved: Mapping[DataPath, DataPath]) -> DataPath:
    """Where the part that is now at a path is written."""
    for length in range(len(path), 0, -1):
        if path[:length] in moved:
            return (*moved[path[:length]], *path[length:])
    return path


@dataclass(frozen=True)
class MovedPlaces:
    """Positions of a document some of whose entries are read as if they were written elsewhere."""

    places: Positions
    moved: Mapping[DataPath, DataPath]

    def locate(self, path: DataPath, offset: int = 0, width: int = 1) -> Span:
        """The place of a character of the text at `path`."""
        return self.places.locate(written(path, self.moved), offset, width)

    def value_span(self, path: DataPath) -> Span:
        """The place of the value at `path`."""
        return self.places.value_span(written(path, self.moved))

    def key_span(self, path: DataPath) -> Span:
        """The place of the key at `path`."""
        return self.places.key_span(written(path, self.moved))

    def in_flow(self, path: DataPath) -> bool:
        """Whether the part at `path` stands inside { } or [ ]."""
        return self.places.in_flow(written(path, self.moved))
