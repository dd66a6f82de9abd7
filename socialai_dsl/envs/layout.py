"""Layouts: from a known room in the scenario's own names to pinned registers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.envs.values import (
    ActRegisters,
    addresses_of,
    entry_words,
    meant,
    parts_of,
    read,
    utterance_number,
    whole_number,
    word,
)
from socialai_dsl.program import (
    CELL,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    EntityColumn,
    Field,
    Flag,
    FrameColumn,
    Header,
    Op,
    Program,
    Register,
    RegisterName,
    TypeColumn,
    constant_of,
)
from socialai_dsl.vocabulary import ACTIONS, COLORS, DIRECTIONS, TURN_WORDS
from socialai_dsl.widths import REGISTER, UNPINNED


@lru_cache(maxsize=256)
def may_lie_over(program: Program) -> frozenset[int]:
    """Numbers of the objects that other objects may lie on or under.

    Those are the ones that can be walked on, what is put where something may be already, and, where things roll or are
    put somewhere in the course of an episode, all of them.
    """
    objects = {number for number, entity in enumerate(program.entities) if entity.role == "object"}
    ops = program.code[:, 0]
    if program.header(Header.FLAGS) & Flag.ROLLS or (ops == Op.PLACE).any():
        return frozenset(objects)
    return frozenset(number for number in objects if _is_walkable(program, number)) | _put_anywhere(program)


def carryable(program: Program) -> dict[str, int]:
    """Names and numbers of the objects that can be carried."""
    pushed_by = program.table(Header.ENTITY_AT)[:, EntityColumn.PUSHED_BY]
    return {
        str(entity): number
        for number, entity in enumerate(program.entities)
        if entity.role == "object" and pushed_by[number] & 2
    }


def _is_walkable(program: Program, number: int) -> bool:
    """Whether an object can be walked on in one of its statuses."""
    first = int(program.table(Header.ENTITY_AT)[number, EntityColumn.TYPE])
    statuses = slice(first, first + len(program.entities[number].states))
    return bool(program.table(Header.TYPE_AT)[statuses, TypeColumn.WALKABLE].any())


def _put_anywhere(program: Program) -> frozenset[int]:
    """What is put on a drawn cell that need not be free."""
    found: set[int] = set()
    drawn = free = False
    for op, entity, _, _ in program.code.tolist():
        if op == Op.B_FREE:
            free = True
        elif op == Op.PICK_CELL:
            drawn = True
        elif op == Op.PUT:
            if drawn and not free and (number := constant_of(entity)) is not None:
                found.add(number)
            drawn = free = False
    return frozenset(found)


_WORDS: dict[str, tuple[Field, Sequence[str]]] = {
    "facing": (Field.DIR, DIRECTIONS),
    "color": (Field.COLOR, COLORS),
}
_KEYS = {
    "agent": ("at", "believes", "carries", "clock", "color", "facing", "gone", "looks", "name", "state"),
    "npc": (
        "at",
        "believes",
        "carries",
        "clock",
        "color",
        "facing",
        "gone",
        "last",
        "looks",
        "name",
        "pointing",
        "poked",
        "state",
        "toggled",
    ),
    "object": ("at", "color", "facing", "gone", "initial", "inside", "looks", "state", "timer"),
}
_OTHER_KEYS = ("t", "room", "one_of", "let", "state", "memory", "last", "heard", "pending")


def pins_of(program: Program, layout: Mapping[str, Any], others: Sequence[str] = ()) -> NDArray[np.int32]:
    """Pinned registers, int32 (R,): the value of each register that the layout gives, UNPINNED for the others.

    Only the shape of a layout is checked: things lie on the grid and not on each other, words and lengths are known.

    Args:
        program: the scenario that is played.
        layout: in the scenario's own names.
        others: keys that the layout may also have, `member` and `spoiled`; what `member` says is the caller's affair.

    Raises:
        ValueError: naming the key at fault, what was got and what was expected.
    """
    return _Layout(program, others).pins(layout)


class _Layout:
    def __init__(self, program: Program, others: Sequence[str]) -> None:
        self.program = program
        self.row = [UNPINNED] * program.header(Header.REGISTERS)
        self.addresses = addresses_of(program)
        self.others = (*others, *_OTHER_KEYS)
        self.names = [str(entity) for entity in program.entities]
        self.groups: dict[str, list[int]] = {}
        self.carried: dict[int, Any] = {}
        for number, entity in enumerate(program.entities):
            self.groups.setdefault(entity.key, []).append(number)

    def pins(self, layout: Mapping[str, Any]) -> NDArray[np.int32]:
        self._mapping("layout", layout)
        for key in layout:
            if key not in self.groups and key not in self.others:
                raise ValueError(f"layout: there is no {key!r}{meant(key, [*self.groups, *self.others])}")
        if layout.get("spoiled") is not None:
            _flag("spoiled", layout["spoiled"])
        self.width, self.height = self._room(layout.get("room"))
        if layout.get("t") is not None:
            self.row[Register.T] = whole_number("t", layout["t"], 0, self.program.header(Header.HORIZON) - 1)
        for key, numbers in self.groups.items():
            self._group(key, numbers, layout.get(key))
        for number, thing in self.carried.items():
            self._carries(number, thing)
        self._one_of(layout.get("one_of"))
        self._values("let", layout.get("let"), self.addresses.plain, self.addresses.sequences)
        self._values("state", layout.get("state"), self.addresses.world)
        self._memory(layout.get("memory"))
        self._last(layout.get("last"))
        self._heard(layout.get("heard"))
        self._pending(layout.get("pending"))
        return np.array(self.row, REGISTER)

    def _entries(self, key: str, given: Any) -> Iterator[tuple[str, Any]]:
        """The entries of a mapping, none where nothing is given."""
        if given is not None:
            self._mapping(key, given)
            yield from given.items()

    @staticmethod
    def _mapping(key: str, value: Any) -> None:
        if not isinstance(value, Mapping) or not all(isinstance(k, str) for k in value):
            raise ValueError(f"{key}: got {value!r}; expected a mapping with names as keys")

    def _room(self, room: Any) -> tuple[int, int]:
        """Width and height, or the least there can be where they are drawn."""
        h = self.program.header
        least = h(Header.MIN_WIDTH), h(Header.MIN_HEIGHT)
        most = h(Header.CANVAS_WIDTH), h(Header.MIN_HEIGHT) + h(Header.HEIGHTS) - 1
        if room is None:
            return least
        self._mapping("room", room)
        sizes = list(least)
        for i, (name, register) in enumerate((("width", Register.WIDTH), ("height", Register.HEIGHT))):
            if room.get(name) is not None:
                sizes[i] = whole_number(f"room.{name}", room[name], least[i], most[i])
                self.row[register] = sizes[i]
        _only("room", room, ("width", "height"))
        return sizes[0], sizes[1]

    # --- cast and objects ---

    def _group(self, key: str, numbers: list[int], given: Any) -> None:
        if given is None:
            return
        if self.program.entities[numbers[0]].index is None:
            self._entity(key, numbers[0], given)
            return
        for i, (number, one) in enumerate(zip(numbers, _listed(key, given, len(numbers)), strict=False)):
            if one is not None:
                self._entity(f"{key}[{i}]", number, one)

    def _entity(self, key: str, number: int, given: Any) -> None:
        self._mapping(key, given)
        entity = self.program.entities[number]
        _only(key, given, _KEYS[entity.role])
        for name, (field, words) in _WORDS.items():
            if given.get(name) is not None:
                self._set(number, field, word(f"{key}.{name}", given[name], words))
        if given.get("state") is not None and entity.role == "object":
            self._set(number, Field.STATUS, word(f"{key}.state", given["state"], entity.states))
            self._start_with(key, given)
        elif given.get("state") is not None:
            self._owned(key, "state", given["state"])
        for name in ("name", "clock", "initial", "timer"):
            if given.get(name) is not None:
                self._owned(key, name, given[name])
        self._gestures(key, number, given)
        self._values(f"{key}.believes", given.get("believes"), self.addresses.beliefs.get(key, {}))
        self._values(f"{key}.looks", given.get("looks"), self.addresses.looks.get(key, {}))
        if given.get("carries") is not None:
            self.carried[number] = given["carries"]
        inside = given.get("inside")
        if inside is not None:
            self._set(number, Field.INSIDE, word(f"{key}.inside", inside, self.names))
        gone = _flag(f"{key}.gone", given.get("gone"))
        if gone and given.get("at") is not None:
            raise ValueError(
                f"{key}.at: got {given['at']!r}, but {key}.gone is True; expected one of the two"
            )
        if gone or (inside is not None and given.get("at") is None):
            for field, value in ((Field.X, -1), (Field.Y, -1), (Field.GONE, 1)):
                self._set(number, field, value)
        elif given.get("at") is not None:
            self._at(key, number, given["at"])

    def _gestures(self, key: str, number: int, given: Mapping[str, Any]) -> None:
        """What an NPC did last, where it points, and whether it was poked."""
        if _flag(f"{key}.poked", given.get("poked")):
            self._set(number, Field.POKED, 1)
        if given.get("last") is not None:
            self._set(number, Field.LAST, word(f"{key}.last", given["last"], TURN_WORDS))
        if given.get("toggled") is not None:
            self._set(number, Field.TOGGLED, word(f"{key}.toggled", given["toggled"], self.names))
        if given.get("pointing") is not None:
            self._set(number, Field.POINTING, self._pointing(f"{key}.pointing", given["pointing"]))

    def _pointing(self, key: str, given: Any) -> int:
        """A direction, or a cell."""
        if isinstance(given, str):
            return 1 + word(key, given, DIRECTIONS)
        x, y = self._cell(key, given)
        return CELL + 32 * y + x

    def _carries(self, number: int, given: Any) -> None:
        """What a member of the cast has in its hands."""
        key = f"{self.program.entities[number]}.carries"
        things = carryable(self.program)
        if not things:
            raise ValueError(f"{key}: got {given!r}, but nothing can be carried in this scenario")
        thing = list(things.values())[word(key, given, list(things))]
        base = FIRST_ENTITY + ENTITY_FIELDS * thing
        if self.row[base] not in (UNPINNED, -1):
            raise ValueError(f"{key}: got {given!r}, which is given a place of its own")
        if self.row[base + Field.CARRIER] != UNPINNED:
            raise ValueError(f"{key}: got {given!r}, which somebody else carries")
        for field, value in ((Field.X, -1), (Field.Y, -1), (Field.GONE, 1), (Field.CARRIER, 1 + number)):
            self._set(thing, field, value)

    def _set(self, number: int, field: Field, value: int) -> None:
        self.row[FIRST_ENTITY + ENTITY_FIELDS * number + field] = value

    def _start_with(self, key: str, given: Mapping[str, Any]) -> None:
        """A status that is given is also the initial one, where that is drawn and could be it."""
        name = self.addresses.owned.get((key, "initial"))
        if name is not None and given.get("initial") is None and given["state"] in name.values:
            self._pin(name, given["state"], f"{key}.state")

    def _at(self, key: str, number: int, given: Any) -> None:
        x, y = self._cell(f"{key}.at", given)
        taken = self._taken(number, x, y)
        if taken is not None:
            raise ValueError(f"{key}.at: got [{x}, {y}], where {self.program.entities[taken]} is already")
        self._set(number, Field.X, x)
        self._set(number, Field.Y, y)

    def _cell(self, key: str, given: Any) -> tuple[int, int]:
        """A cell of the room."""
        is_given = self.row[Register.WIDTH] != UNPINNED
        hint = "" if is_given else " (the smallest room; give `room` for a larger one)"
        across, down = parts_of(key, given, 2, "[x, y]")
        x = whole_number(f"{key}[0]", across, 0, self.width - 1, hint)
        return x, whole_number(f"{key}[1]", down, 0, self.height - 1, hint)

    def _taken(self, number: int, x: int, y: int) -> int | None:
        """Who of the same sort is pinned to this cell: bodies may stand on objects, and objects lie under bodies."""
        own_sort = self.program.entities[number].role == "object"
        for other in range(len(self.program.entities)):
            base = FIRST_ENTITY + ENTITY_FIELDS * other
            if other == number or (self.row[base], self.row[base + 1]) != (x, y):
                continue
            both_may = 0 in (number, other) and not own_sort and bool(self.program.header(Header.FLAGS) & 1)
            over = own_sort and {number, other} & may_lie_over(self.program)
            if (self.program.entities[other].role == "object") == own_sort and not both_may and not over:
                return other
        return None

    # --- registers ---

    def _pin(self, name: RegisterName, value: Any, key: str) -> None:
        self.row[name.register] = read(self.program, name, value, key)

    def _owned(self, owner: str, key: str, value: Any) -> None:
        name = self.addresses.owned.get((owner, key))
        if name is None:
            raise ValueError(f"{owner}.{key}: got {value!r}, but this scenario does not draw it")
        self._pin(name, value, f"{owner}.{key}")

    def _one_of(self, given: Any) -> None:
        """Which of its files a cast member is."""
        for key, value in self._entries("one_of", given):
            name = self.addresses.one_of.get(key)
            if name is None:
                raise ValueError(f"one_of: {key!r} is not drawn{meant(key, self.addresses.one_of)}")
            if value is not None:
                self._pin(name, value, f"one_of.{key}")

    def _values(
        self,
        place: str,
        given: Any,
        known: Mapping[str, RegisterName],
        sequences: Mapping[str, ActRegisters] = MappingProxyType({}),
    ) -> None:
        """Registers that have a name of their own there, and the acts of sequences."""
        for key, value in self._entries(place, given):
            if self._kept(f"{place}.{key}", value):
                continue
            if key not in known and key not in sequences:
                raise ValueError(f"{place}: there is no {key!r}{meant(key, [*known, *sequences])}")
            if value is None:
                continue
            if key in known:
                self._pin(known[key], value, f"{place}.{key}")
                continue
            for k, act in enumerate(_listed(f"{place}.{key}", value, sequences[key].length)):
                if act is not None:
                    self._act(sequences[key], k, act, f"{place}.{key}[{k}]")

    def _kept(self, key: str, given: Any) -> bool:
        """Registers that there are for each of a group: a mapping of keys to values; whether `key` names some."""
        names = self.addresses.kept.get(key)
        if names is None or given is None:
            return names is not None
        if not isinstance(given, Mapping):
            raise ValueError(f"{key}: got {given!r}; expected a mapping of {', '.join(names)} to values")
        known = {str(called): value for called, value in given.items()}
        _only(key, known, list(names))
        for called, value in known.items():
            if value is not None:
                self._pin(names[called], value, f"{key}.{called}")
        return True

    def _memory(self, given: Any) -> None:
        """What memories hold, oldest first; the latest act has the last place."""
        for key, value in self._entries("memory", given):
            acts = self.addresses.memories.get(key)
            if acts is None:
                raise ValueError(f"memory: there is no {key!r}{meant(key, self.addresses.memories)}")
            if value is None:
                continue
            held = _listed(f"memory.{key}", value, acts.length)
            for k, act in enumerate(held):
                self._act(acts, acts.length - len(held) + k, act, f"memory.{key}[{k}]")
            self.row[self.addresses.filled[key].register] = len(held)

    def _act(self, acts: ActRegisters, k: int, given: Any, key: str) -> None:
        """An element of a sequence or memory: [move, utterance], where None is silence, or the move alone."""
        if isinstance(given, str):
            given = (given, None)
        move, said = parts_of(key, given, 2, "[move, utterance]")
        if move is not None:
            self._pin(acts.moves[k], move, f"{key}[0]")
        if k in acts.utterances:
            self._pin(acts.utterances[k], "" if said is None else said, f"{key}[1]")
        elif said is not None:
            raise ValueError(f"{key}[1]: got {said!r}, but this sequence is silent")

    def _last(self, given: Any) -> None:
        """What the agent did in the last step."""
        if given is None:
            return
        self._mapping("last", given)
        _only("last", given, ("action", "said", "poked"))
        if given.get("action") is not None:
            self.row[Register.ACTION] = word("last.action", given["action"], ACTIONS)
            self._set(0, Field.LAST, self.row[Register.ACTION])
        if given.get("said") is not None:
            self._said(utterance_number(self.program, given["said"], "last.said"))
        if given.get("poked") is not None:
            self.row[Register.POKED] = word("last.poked", given["poked"], self.names)

    def _said(self, utterance: int) -> None:
        if utterance == 0:
            return
        pair = utterance - 1
        template, noun = divmod(pair, self.program.sentences.fillings)
        self.row[Register.UTTERANCE] = utterance
        self.row[Register.TEMPLATE], self.row[Register.NOUN] = template, noun
        self.row[Register.CLASS] = int(self.program.table(Header.CLASS_AT)[template, noun])

    # --- what was heard ---

    def _heard(self, given: Any) -> None:
        if given is None:
            return
        if not isinstance(given, Sequence) or isinstance(given, str):
            raise ValueError(f"heard: got {given!r}; expected a list of lines")
        size = self.program.header(Header.LOG_SIZE)
        log = self.program.header(Header.LOG)
        # Older lines than fit are forgotten, as in an episode.
        for i, line in enumerate(given[-size:]):
            self.row[log + i] = word(f"heard[{i}]", line, self.program.lines)
        self.row[Register.LOGGED] = min(len(given), size)

    def _pending(self, given: Any) -> None:
        if given is None:
            return
        inboxes = {
            str(self.program.entities[row[FrameColumn.ENTITY]]): row[FrameColumn.INBOX]
            for row in self.program.table(Header.FRAME_AT).tolist()
        }
        for key, classes in self._entries("pending", given):
            if key not in inboxes:
                raise ValueError(f"pending: there is no {key!r} who listens{meant(key, inboxes)}")
            entries = _listed(f"pending.{key}", classes, self.program.header(Header.INBOX_SIZE))
            self.row[inboxes[key]] = len(entries)
            words = entry_words(self.program)
            for i, entry in enumerate(entries):
                first = inboxes[key] + 1 + words * i
                self.row[first : first + words] = self._entry(f"pending.{key}[{i}]", entry, words)

    def _entry(self, key: str, given: Any, words: int) -> list[int]:
        """An utterance in an inbox: its class, or [class, speaker, noun], where `noun` may be a mapping of slots."""
        highest = self.program.header(Header.CLASSES) - 1
        if words == 1:
            return [whole_number(key, given, 1, highest)]
        number, speaker, noun = parts_of(key, given, words, "[class, speaker, noun]")
        return [
            whole_number(f"{key}[0]", number, 1, highest),
            word(f"{key}[1]", speaker, self.names),
            -1 if noun is None else self._filling(f"{key}[2]", noun),
        ]

    def _filling(self, key: str, given: Any) -> int:
        """The noun that was heard; of a grammar with slots a mapping of these to what stood there."""
        sentences = self.program.sentences
        if sentences.nouns:
            return word(key, given, sentences.nouns)
        self._mapping(key, given)
        _only(key, given, [slot.name for slot in sentences.slots])
        return sentences.filling(
            [
                word(f"{key}.{slot.name}", given[slot.name], slot.words) if slot.name in given else None
                for slot in sentences.slots
            ]
        )


def _only(key: str, given: Mapping[str, Any], allowed: Sequence[str]) -> None:
    for name in given:
        if name not in allowed:
            raise ValueError(f"{key}: there is no {name!r}{meant(name, allowed)}")


def _flag(key: str, given: Any) -> bool:
    """True or False; None is False. Raises ValueError that names the key for anything else."""
    return given is not None and bool(word(key, given, (False, True)))


def _listed(key: str, given: Any, most: int) -> Sequence[Any]:
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) > most:
        raise ValueError(f"{key}: got {given!r}; expected a list of at most {most}")
    return given
