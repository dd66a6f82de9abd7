"""Whether the agent's script acts on its perceptions alone, by play in twins that look alike so far."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from socialai_dsl.analysis.advance import advance, begin, compiled
from socialai_dsl.analysis.alike import Division, divided, without_unsaid
from socialai_dsl.analysis.twins import pairs_alike
from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.envs.table import Table
from socialai_dsl.program import Program, Register
from socialai_dsl.semantics.plans import CheckedScenario, Placing
from socialai_dsl.semantics.terms import Quantification, walk

_HAPPENING: Final = ("t", "memory", "last", "heard", "pending")
_ATTEMPTS: Final = 4
"""How often a draw is repeated in search of another value."""
_LATER: Final = "what is drawn during the episode"

Path = tuple[str | int, ...]
"""Where a value stands in a layout: ("doors", 1, "color")."""


@dataclass(frozen=True)
class Peek:
    """Two rooms in which the script acts otherwise although all that was perceived is alike.

    Attributes:
        index: of the first room. step: in which the script acts otherwise, from 1.
        draw: what was drawn otherwise, in words. values: in either room; empty for what is drawn during the episode.
    """

    index: int
    step: int
    draw: str
    values: tuple[Any, ...]

    def __str__(self) -> str:
        """In words: "in room 7 `let.exit`, doors[0] or doors[2], decides what it does in step 3, unperceived"."""
        values = f", {' or '.join(map(_shown, self.values))}," if self.values else ""
        draw = f"`{self.draw}`" if self.values else self.draw
        return f"in room {self.index} {draw}{values} decides what it does in step {self.step}, unperceived"


@dataclass(frozen=True)
class PerceptionResult:
    """The result of playing twins.

    Attributes:
        pairs: how many of them looked alike at first. peeks: those in which the script peeked.
        groups: how many groups of rooms that look alike were compared, whatever they differ in.
        divisions: those in which the script did not act alike.
    """

    pairs: int
    peeks: tuple[Peek, ...]
    groups: int = 0
    divisions: tuple[Division, ...] = ()


@dataclass(frozen=True)
class _Pair:
    """A room and its twin: layouts of both, None for a room as it is drawn, and the number of the twin's draws."""

    index: int
    layout: dict[str, Any] | None
    twin: dict[str, Any]
    twin_index: int
    draw: str
    values: tuple[Any, ...]


def perceived(scripted: LoadedScenario, rooms: int, seed: int) -> PerceptionResult:
    """Play the script in rooms 0 to rooms - 1 of a seed and in a twin for each draw of each room.

    In the twin that draw, and what follows from it, has another value. The script's actions for the first room are done
    in both until the two look or sound different or one of them ends. Then it plays many rooms, which may differ in any
    number of draws, and has to act alike in those that look and sound alike; not if it draws something itself.

    Args:
        scripted: a scenario with a frame for the agent.
        rooms: how many rooms.
        seed: of the rooms.
    """
    program = compiled(scripted)
    pairs, peeks = _in_twins(program, scripted.checked, rooms, seed)
    groups, divisions = (0, []) if _draws_itself(scripted.checked) else divided(program, rooms, seed)
    divisions.sort(key=lambda one: (one.rooms, one.step))
    return PerceptionResult(pairs, tuple(peeks), groups, tuple(divisions))


def _in_twins(program: Program, checked: CheckedScenario, rooms: int, seed: int) -> tuple[int, list[Peek]]:
    """How many twins look alike at first, and where the script peeks in them."""
    pairs = list(_pairs(program, checked, rooms, seed))
    if not pairs:
        return 0, []
    table = Table([program], 2 * len(pairs))
    index = [number for pair in pairs for number in (pair.index, pair.twin_index)]
    given = [layout for pair in pairs for layout in (pair.layout, pair.twin)]
    begin(table, seed, {"index": np.array(index), "layout": given})
    running = pairs_alike(table)
    alike, peeks, step = int(running.sum()), list[Peek](), 0
    while running.any():
        step += 1
        actions = without_unsaid(table.scripted_actions())
        otherwise = running & (actions[0::2] != actions[1::2]).any(axis=1)
        for k in np.flatnonzero(otherwise).tolist():
            peeks.append(Peek(pairs[k].index, step, pairs[k].draw, pairs[k].values))
        running &= ~otherwise
        actions[1::2] = actions[0::2]
        table.batch.ports.actions[:] = actions
        advance(table)
        running &= (table.state.registers[:, Register.ENDED] == 0).reshape(-1, 2).all(axis=1)
        running &= pairs_alike(table)
    return alike, sorted(peeks, key=lambda peek: (peek.index, peek.step))


# --- twins ---


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
        copied = deepcopy(layout)
        inner = _at(copied, self.where)
        for key in self._keys:
            inner.pop(key, None)
        return copied

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


def _pairs(program: Program, checked: CheckedScenario, rooms: int, seed: int) -> Iterator[_Pair]:
    """For each room and each draw a twin, where the draw has another value that is possible."""
    table = Table([program], 1)
    drawn = {k: room for k in range(rooms) if (room := _redrawn(table, seed, k, {})) is not None}
    if not drawn:
        return
    first, *others = drawn.values()
    order = _order_of_places(checked)
    for part in _parts(first):
        if all(part.value(room) == part.value(first) for room in others):
            continue
        for k, room in drawn.items():
            other = _other(part, table, drawn, k, rooms, seed)
            if other is None:
                continue
            twin = part.alone(other, room)
            followed = _redrawn(table, seed, k, twin)
            if followed is None or part.value(followed) != other:
                continue
            if part.is_place and _moved(part, room, followed, order):
                continue
            yield _Pair(k, None, twin, k, part.name, (_only(part.value(room)), _only(other)))
    if not _draws_itself(checked):
        for k, room in drawn.items():
            yield _Pair(k, room, room, k + rooms, _LATER, ())


def _other(
    part: _Part, table: Table, drawn: Mapping[int, dict[str, Any]], k: int, rooms: int, seed: int
) -> dict[str, Any] | None:
    """Another value of a part of room k, as one of the `rooms` has it or as drawn anew; None if none was found."""
    own = part.value(drawn[k])
    for attempt in range(1, _ATTEMPTS + 1):
        room = (
            drawn.get((k + attempt) % rooms)
            if part.free
            else _redrawn(table, seed, k + attempt * rooms, part.without(drawn[k]))
        )
        if room is not None and part.value(room) not in ({}, own):
            return part.value(room)
    return None


def _redrawn(table: Table, seed: int, index: int, layout: Mapping[str, Any]) -> dict[str, Any] | None:
    """A room of this number, drawn around a layout; None if nothing can be drawn around it."""
    try:
        begin(table, seed, {"index": index, "layout": layout})
    except (ValueError, RuntimeError):
        return None
    return _kept(table.describe(0))


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


def _shown(value: Any) -> str:
    """A value as one line of text."""
    if isinstance(value, dict):
        return " x ".join(map(_shown, value.values()))
    return f"[{', '.join(map(_shown, value))}]" if isinstance(value, list) else str(value)


def _only(value: Mapping[str, Any]) -> Any:
    """The one value of a part, or all of them."""
    return next(iter(value.values())) if len(value) == 1 else dict(value)


def _draws_itself(checked: CheckedScenario) -> bool:
    """Whether the script itself draws something, which then also differs when later draws do."""
    for frame in checked.frames:
        if frame.entity == 0 and (
            any(rule.chance is not None for rule in frame.rules)
            or any(activity.name == "choose" for activity in frame.activities)
            or any(isinstance(part, Quantification) and part.op == "pick" for part in walk(frame))
        ):
            return True
    return False
