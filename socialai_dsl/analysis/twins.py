"""Twins of drawn rooms: rooms in which one draw, and what follows from it, has another value that is possible."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, Final

from socialai_dsl.analysis.rooms import DrawnRooms
from socialai_dsl.program import Program
from socialai_dsl.semantics.plans import CheckedScenario, Placing
from socialai_dsl.semantics.terms import Quantification, walk

_HAPPENING: Final = ("t", "memory", "last", "heard", "pending")
_ATTEMPTS: Final = 4
"""How often a draw is repeated in search of another value."""
_LATER: Final = "what is drawn during the episode"

Path = tuple[str | int, ...]
"""Where a value stands in a layout: ("doors", 1, "color")."""


@dataclass(frozen=True)
class Pair:
    """A room and its twin: layouts of both, None for a room as it is drawn, and the number of the twin's draws."""

    index: int
    layout: dict[str, Any] | None
    twin: dict[str, Any]
    twin_index: int
    draw: str
    values: tuple[Any, ...]


class _Part:
    """What one draw decides of a room: some keys of one place in a layout.

    Attributes:
        name: of the draw, as an author would say it.
        where: the place in a layout.
        free: whether nothing limits it, so that any room's value does in any other.
    """

    def __init__(self, name: str, where: Path, keys: Sequence[str], free: bool = False) -> None:
        self.name, self.where, self.free = name, where, free
        self._keys = keys

    def value(self, layout: Mapping[str, Any]) -> dict[str, Any]:
        """Its keys and their values in a layout."""
        inner = _at(layout, self.where)
        return {key: inner[key] for key in self._keys if inner.get(key) is not None}

    def without(self, layout: dict[str, Any]) -> dict[str, Any]:
        """A copy of a layout that leaves it open."""
        return _without(layout, self.where, self._keys)  # type: ignore[no-any-return]

    def alone(self, value: Any, room: Mapping[str, Any]) -> dict[str, Any]:
        """A layout that gives this value, and nothing else of a room."""
        layout: Any = dict(value)
        for key in reversed(self.where):
            layout = [{}] * key + [layout] if isinstance(key, int) else {key: layout}
        return layout  # type: ignore[no-any-return]

    @property
    def is_place(self) -> bool:
        """Whether it says where something is."""
        return "at" in self._keys


class _Move(_Part):
    """One move of a sequence that was drawn, without its words, which are heard."""

    def __init__(self, key: str, number: int) -> None:
        super().__init__(f"let.{key}[{number}].move", ("let",), (key,), free=True)
        self._key, self._number = key, number

    def value(self, layout: Mapping[str, Any]) -> dict[str, Any]:
        """The move in a layout."""
        return {self._key: layout["let"][self._key][self._number][0]}

    def alone(self, value: Any, room: Mapping[str, Any]) -> dict[str, Any]:
        """A layout that gives the room's sequence with this move."""
        acts = deepcopy(room["let"][self._key])
        acts[self._number][0] = value[self._key]
        return {"let": {self._key: acts}}


def _parts(layout: Mapping[str, Any]) -> list[_Part]:
    """What is drawn of a room, or follows from what is drawn."""
    parts = [_Part("room.size", ("room",), ("width", "height"), free=True)]
    for key, value in layout.items():
        if key in ("let", "state"):
            names: dict[str, list[str]] = {}
            for inner in value:
                names.setdefault(inner.partition("[")[0], []).append(inner)
            parts += [_Part(f"{key}.{name}", (key,), keys) for name, keys in names.items()]
            parts += [
                _Move(inner, k)
                for inner, held in value.items()
                if isinstance(held, list) and held and isinstance(held[0], list)
                for k in range(len(held))
            ]
        elif key == "one_of":
            parts += [_Part(f"cast.{name}.one_of", (key,), (name,), free=True) for name in value]
        elif isinstance(value, dict) and "color" in value:
            parts += _parts_of(key, (key,), value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            for k, one in enumerate(value):
                parts += _parts_of(f"{key}[{k}]", (key, k), one)
    return parts


def _parts_of(name: str, where: Path, entity: Mapping[str, Any]) -> list[_Part]:
    keys = [
        ("place", ("at", "inside", "gone")),
        ("color", ("color",)),
        ("facing", ("facing",)),
        ("name", ("name",)),
    ]
    if "clock" not in entity and "poked" not in entity:
        keys.append(("state", ("state", "initial")))  # of an object
    return [_Part(f"{name}.{said}", where, own) for said, own in keys if any(key in entity for key in own)]


def pairs_of_rooms(program: Program, checked: CheckedScenario, rooms: int, seed: int) -> Iterator[Pair]:
    """For each room and each draw a twin, where the draw has another value that is possible."""
    single = DrawnRooms([program])
    drawn = {k: room for k in range(rooms) if (room := _redrawn(single, seed, k, {})) is not None}
    if not drawn:
        return
    first, *others = drawn.values()
    order = _order_of_places(checked)
    for part in _parts(first):
        if all(part.value(room) == part.value(first) for room in others):
            continue
        for k, room in drawn.items():
            other = _other(part, single, drawn, k, rooms, seed)
            if other is None:
                continue
            twin = part.alone(other, room)
            followed = _redrawn(single, seed, k, twin)
            if followed is None or part.value(followed) != other:
                continue
            if part.is_place and _moved(part, room, followed, order):
                continue
            yield Pair(k, None, twin, k, part.name, (_only(part.value(room)), _only(other)))
    if not draws_itself(checked):
        for k, room in drawn.items():
            yield Pair(k, room, room, k + rooms, _LATER, ())


def _other(
    part: _Part, single: DrawnRooms, drawn: Mapping[int, dict[str, Any]], k: int, rooms: int, seed: int
) -> dict[str, Any] | None:
    """Another value of a part of room k, as one of the `rooms` has it or as drawn anew; None if none was found."""
    own = part.value(drawn[k])
    for attempt in range(1, _ATTEMPTS + 1):
        room = (
            drawn.get((k + attempt) % rooms)
            if part.free
            else _redrawn(single, seed, k + attempt * rooms, part.without(drawn[k]))
        )
        if room is not None and part.value(room) not in ({}, own):
            return part.value(room)
    return None


def _redrawn(single: DrawnRooms, seed: int, index: int, layout: Mapping[str, Any]) -> dict[str, Any] | None:
    """A room of this number, drawn in a table of one row around a layout; None if nothing can be drawn around it."""
    try:
        single.draw(seed, index, layout)
    except (ValueError, RuntimeError):
        return None
    return _kept(single.table.describe(0))


def _kept(described: dict[str, Any]) -> dict[str, Any]:
    """What was drawn, without what happens later."""
    return {key: value for key, value in described.items() if key not in _HAPPENING}


def _order_of_places(checked: CheckedScenario) -> list[Path]:
    """Where each entity stands in a layout, in the order in which they are put down."""
    entities = [checked.entities[item.entity] for item in checked.setup if isinstance(item, Placing)]
    return [(one.key,) if one.index is None else (one.key, one.index) for one in entities]


def _moved(part: _Part, room: dict[str, Any], twin: dict[str, Any], order: Sequence[Path]) -> bool:
    """Whether something that is put down before it had to make room for what the twin pins.

    Then its new place need not be one that is possible.
    """
    before = order[: order.index(part.where)] if part.where in order else order
    return any(_at(room, one).get("at") != _at(twin, one).get("at") for one in before)


def _at(layout: Mapping[str, Any], where: Path) -> Any:
    inner: Any = layout
    for key in where:
        inner = inner[key]
    return inner


def _without(layout: Any, where: Path, keys: Sequence[str]) -> Any:
    """A layout in which one place lacks keys; all other places are those of the layout itself."""
    if not where:
        return {key: value for key, value in layout.items() if key not in keys}
    changed = layout.copy()
    changed[where[0]] = _without(layout[where[0]], where[1:], keys)
    return changed


def _only(value: Mapping[str, Any]) -> Any:
    """The one value of a part, or all of them."""
    return next(iter(value.values())) if len(value) == 1 else dict(value)


def draws_itself(checked: CheckedScenario) -> bool:
    """Whether the script itself draws something, which then also differs when later draws do."""
    for frame in checked.frames:
        if frame.entity == 0 and (
            any(rule.chance is not None for rule in frame.rules)
            or any(activity.name == "choose" for activity in frame.activities)
            or any(isinstance(part, Quantification) and part.op == "pick" for part in walk(frame))
        ):
            return True
    return False
