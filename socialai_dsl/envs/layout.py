"""A known room instead of a drawn one: a layout in the scenario's own names to pinned registers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.engine.state import PIN_NONE
from socialai_dsl.program import (
    COLORS,
    DIRECTIONS,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    Field,
    FrameColumn,
    Header,
    Program,
    Register,
    RegisterName,
)

_WORDS: dict[str, tuple[Field, Sequence[str]]] = {
    "facing": (Field.DIR, DIRECTIONS),
    "color": (Field.COLOR, COLORS),
}
_KEYS = {
    "agent": ("at", "clock", "color", "facing", "gone", "name", "state"),
    "npc": ("at", "clock", "color", "facing", "gone", "name", "poked", "state"),
    "object": ("at", "color", "gone", "state"),
}


def pins_of(program: Program, layout: Mapping[str, Any]) -> NDArray[np.int16]:
    """Pinned registers, int16 (R,): the value of each register that the layout gives, PIN_NONE for the others.

    Only the shape of a layout is checked: things lie on the grid and not on each other, words and lengths are known.

    Raises:
        ValueError: naming the key at fault, what was got and what was expected.
    """
    return _Layout(program).pins(layout)


class _Layout:
    def __init__(self, program: Program) -> None:
        self.program = program
        self.row = np.full(program.header(Header.REGISTERS), PIN_NONE, np.int16)
        self.registers = {name.path: name for name in program.registers}
        self.groups: dict[str, list[int]] = {}
        for number, entity in enumerate(program.entities):
            self.groups.setdefault(entity.key, []).append(number)

    def pins(self, layout: Mapping[str, Any]) -> NDArray[np.int16]:
        self._mapping("layout", layout)
        others = ("t", "room", "let", "heard", "pending")
        for key in layout:
            if key not in self.groups and key not in others:
                raise ValueError(f"layout: there is no {key!r}{_meant(key, [*self.groups, *others])}")
        self.width, self.height = self._room(layout.get("room"))
        if layout.get("t") is not None:
            self.row[Register.T] = _number("t", layout["t"], 0, self.program.header(Header.HORIZON) - 1)
        for key, numbers in self.groups.items():
            self._group(key, numbers, layout.get(key))
        self._let(layout.get("let"))
        self._heard(layout.get("heard"))
        self._pending(layout.get("pending"))
        return self.row

    @staticmethod
    def _mapping(key: str, value: Any) -> None:
        if not isinstance(value, Mapping) or not all(isinstance(k, str) for k in value):
            raise ValueError(f"{key}: got {value!r}; expected a mapping with names as keys")

    def _room(self, room: Any) -> tuple[int, int]:
        """Width and height, or the least there can be where they are drawn."""
        h = self.program.header
        least = h(Header.MIN_WIDTH), h(Header.MIN_HEIGHT)
        most = h(Header.CANVAS_WIDTH), h(Header.MIN_HEIGHT) + h(Header.HEIGHTS) - 1
        if not room:
            return least
        self._mapping("room", room)
        sizes = list(least)
        for i, (name, register) in enumerate((("width", Register.WIDTH), ("height", Register.HEIGHT))):
            if room.get(name) is not None:
                sizes[i] = _number(f"room.{name}", room[name], least[i], most[i])
                self.row[register] = sizes[i]
        _only("room", room, ("width", "height"))
        return sizes[0], sizes[1]

    # --- cast and objects ---

    def _group(self, key: str, numbers: list[int], given: Any) -> None:
        if not given:
            return
        if self.program.entities[numbers[0]].index is None:
            self._entity(key, numbers[0], given)
            return
        if not isinstance(given, Sequence) or isinstance(given, str) or len(given) > len(numbers):
            raise ValueError(f"{key}: got {given!r}; expected a list of at most {len(numbers)}")
        for i, (number, one) in enumerate(zip(numbers, given, strict=False)):
            if one:
                self._entity(f"{key}[{i}]", number, one)

    def _entity(self, key: str, number: int, given: Any) -> None:
        self._mapping(key, given)
        entity = self.program.entities[number]
        _only(key, given, _KEYS[entity.role])
        for name, (field, words) in _WORDS.items():
            if given.get(name) is not None:
                self._set(number, field, _word(f"{key}.{name}", given[name], words))
        if given.get("state") is not None and entity.role == "object":
            self._set(number, Field.STATUS, _word(f"{key}.state", given["state"], entity.states))
        elif given.get("state") is not None:
            self._named(f"{key}.frame", given["state"], f"{key}.state")
        for name in ("name", "clock"):
            if given.get(name) is not None:
                self._named(f"{key}.{name}", given[name], f"{key}.{name}")
        if given.get("poked"):
            self._set(number, Field.POKED, 1)
        if given.get("gone"):
            for field, value in ((Field.X, -1), (Field.Y, -1), (Field.GONE, 1)):
                self._set(number, field, value)
        elif given.get("at") is not None:
            self._at(key, number, given["at"])

    def _set(self, number: int, field: Field, value: int) -> None:
        self.row[FIRST_ENTITY + ENTITY_FIELDS * number + field] = value

    def _at(self, key: str, number: int, given: Any) -> None:
        if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 2:
            raise ValueError(f"{key}.at: got {given!r}; expected [x, y]")
        x = _number(f"{key}.at[0]", given[0], 0, self.width - 1, self._hint())
        y = _number(f"{key}.at[1]", given[1], 0, self.height - 1, self._hint())
        taken = self._taken(number, x, y)
        if taken is not None:
            raise ValueError(f"{key}.at: got [{x}, {y}], where {self.program.entities[taken]} is already")
        self._set(number, Field.X, x)
        self._set(number, Field.Y, y)

    def _hint(self) -> str:
        return (
            ""
            if self.row[Register.WIDTH] != PIN_NONE
            else " (the smallest room; give `room` for a larger one)"
        )

    def _taken(self, number: int, x: int, y: int) -> int | None:
        """Who of the same sort is pinned to this cell: bodies may stand on objects, and objects lie under bodies."""
        own_sort = self.program.entities[number].role == "object"
        for other in range(len(self.program.entities)):
            base = FIRST_ENTITY + ENTITY_FIELDS * other
            if other == number or (self.row[base], self.row[base + 1]) != (x, y):
                continue
            both_may = {0} & {number, other} and not own_sort and self._npcs_are_hidden()
            if (self.program.entities[other].role == "object") == own_sort and not both_may:
                return other
        return None

    def _npcs_are_hidden(self) -> bool:
        return bool(self.program.header(Header.FLAGS) & 1)

    # --- registers ---

    def _let(self, given: Any) -> None:
        if not given:
            return
        self._mapping("let", given)
        names = {path.removeprefix("let."): path for path in self.registers}
        for key, value in given.items():
            if key not in names:
                raise ValueError(f"let: there is no {key!r}{_meant(key, names)}")
            if value is not None:
                self._named(names[key], value, f"let.{key}")

    def _named(self, path: str, value: Any, key: str) -> None:
        name = self.registers.get(path)
        if name is None:
            raise ValueError(f"{key}: got {value!r}, but this scenario does not draw it")
        self.row[name.register] = self._value(name, value, key)

    def _value(self, name: RegisterName, value: Any, key: str) -> int:
        if name.kind == "entity":
            words = [str(entity) for entity in self.program.entities]
            return name.low + _word(key, value, words[name.low : name.high + 1])
        if name.kind == "bool":
            return _word(key, value, (False, True))
        if name.values:
            return name.low + _word(key, value, name.values)
        return _number(key, value, name.low, name.high)

    # --- what was heard ---

    def _heard(self, given: Any) -> None:
        if not given:
            return
        if not isinstance(given, Sequence) or isinstance(given, str):
            raise ValueError(f"heard: got {given!r}; expected a list of lines")
        size = self.program.header(Header.LOG_SIZE)
        log = self.program.header(Header.LOG)
        # Older lines than fit are forgotten, as in an episode.
        for i, line in enumerate(given[-size:]):
            self.row[log + i] = _word(f"heard[{i}]", line, self.program.lines)
        self.row[Register.LOGGED] = min(len(given), size)

    def _pending(self, given: Any) -> None:
        if not given:
            return
        self._mapping("pending", given)
        start, rows = self.program.header(Header.FRAME_AT), self.program.header(Header.FRAMES)
        table = self.program.words[start : start + rows * FrameColumn.COLUMNS].reshape(
            rows, FrameColumn.COLUMNS
        )
        inboxes = {
            str(self.program.entities[row[FrameColumn.ENTITY]]): row[FrameColumn.INBOX]
            for row in table.tolist()
        }
        for key, classes in given.items():
            if key not in inboxes:
                raise ValueError(f"pending: there is no {key!r} who listens{_meant(key, inboxes)}")
            size = self.program.header(Header.INBOX_SIZE)
            if not isinstance(classes, Sequence) or isinstance(classes, str) or len(classes) > size:
                raise ValueError(f"pending.{key}: got {classes!r}; expected a list of at most {size}")
            self.row[inboxes[key]] = len(classes)
            for i, number in enumerate(classes):
                highest = self.program.header(Header.CLASSES) - 1
                self.row[inboxes[key] + 1 + i] = _number(f"pending.{key}[{i}]", number, 1, highest)


def _only(key: str, given: Mapping[str, Any], allowed: Sequence[str]) -> None:
    for name in given:
        if name not in allowed:
            raise ValueError(f"{key}: there is no {name!r}{_meant(name, allowed)}")


def _meant(word: str, among: Any) -> str:
    near = did_you_mean(word, among)
    return f"; did you mean {near!r}?" if near else f"; expected one of {', '.join(sorted(among))}"


def _number(key: str, value: Any, low: int, high: int, hint: str = "") -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not low <= value <= high:
        raise ValueError(f"{key}: got {value!r}; expected a number from {low} to {high}{hint}")
    return int(value)


def _word(key: str, value: Any, words: Sequence[Any]) -> int:
    for i, word in enumerate(words):
        if value == word and isinstance(value, type(word)):
            return i
    if len(words) > 12:
        raise ValueError(f"{key}: got {value!r}{_meant(str(value), map(str, words))[:200]}")
    raise ValueError(f"{key}: got {value!r}; expected one of {', '.join(map(str, words))}")
