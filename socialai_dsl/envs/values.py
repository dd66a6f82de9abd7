"""A program's own registers in layouts: their addresses, and their numbers as plain data and back."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Final

import numpy as np

from socialai_dsl.diagnostics import suggested
from socialai_dsl.program import CELL, Flag, Header, Program, RegisterName, place_of

_ELEMENT: Final = re.compile(r"(let|memory)\.(\w+)\[(\d+)\]\.(move|utterance)")
_FILLED: Final = re.compile(r"memory\.(\w+)\.filled")
_LOOK: Final = re.compile(r"looks\.(\w+)\((.*)\)")
_OF_KEY: Final = re.compile(r"(.+?)\((.*)\)")
_BELIEF: Final = re.compile(r"(.+)\.believes\.(\w+)")
_OF_ENTITY: Final = {
    "name": "name",
    "clock": "clock",
    "frame": "state",
    "initial": "initial",
    "timer": "timer",
}


@dataclass
class ActRegisters:
    """The registers of a sequence or memory, by element."""

    moves: dict[int, RegisterName] = field(default_factory=dict)
    utterances: dict[int, RegisterName] = field(default_factory=dict)

    @property
    def length(self) -> int:
        """How many elements it has."""
        return len(self.moves)


@lru_cache(maxsize=256)
def addresses_of(program: Program) -> Addresses:
    """The registers of a program by their place in a layout."""
    return Addresses(program)


class Addresses:
    """The registers of a program by their place in a layout.

    Attributes:
        sequences: those of `let`. memories: by name, with `filled`, the number of elements each holds.
        world: those of `state`, by name. beliefs: cast member -> key -> register.
        one_of: cast member -> which file it is. owned: (entity, key) -> register, e.g. ("wizard", "state").
        plain: all others by their key under `let`; what tells nothing between steps is left out.
        kept: those that there are for each of a group, by place in a layout (`let.ann.trust`) and key.
        looks: entity -> look -> register.
    """

    def __init__(self, program: Program) -> None:
        self.sequences: dict[str, ActRegisters] = {}
        self.memories: dict[str, ActRegisters] = {}
        self.filled: dict[str, RegisterName] = {}
        self.one_of: dict[str, RegisterName] = {}
        self.owned: dict[tuple[str, str], RegisterName] = {}
        self.world: dict[str, RegisterName] = {}
        self.beliefs: dict[str, dict[str, RegisterName]] = {}
        self.plain: dict[str, RegisterName] = {}
        self.kept: dict[str, dict[str, RegisterName]] = {}
        self.looks: dict[str, dict[str, RegisterName]] = {}
        entities = {str(entity) for entity in program.entities}
        for name in program.registers:
            self._add(name, entities)

    def _add(self, name: RegisterName, entities: set[str]) -> None:
        if name.fleeting:
            return
        owner, _, rest = name.path.rpartition(".")
        if element := _ELEMENT.fullmatch(name.path):
            group, key, index, part = element.groups()
            acts = (self.sequences if group == "let" else self.memories).setdefault(key, ActRegisters())
            (acts.moves if part == "move" else acts.utterances)[int(index)] = name
        elif look := _LOOK.fullmatch(name.path):
            self.looks.setdefault(look[2], {})[look[1]] = name
        elif of_key := _OF_KEY.fullmatch(name.path):
            place = of_key[1] if of_key[1].startswith("state.") else f"let.{of_key[1]}"
            self.kept.setdefault(place, {})[of_key[2]] = name
        elif filled := _FILLED.fullmatch(name.path):
            self.filled[filled.group(1)] = name
        elif name.path.startswith("state."):
            self.world[name.path.removeprefix("state.")] = name
        elif belief := _BELIEF.fullmatch(name.path):
            self.beliefs.setdefault(belief.group(1), {})[belief.group(2)] = name
        elif rest == "one_of":
            self.one_of[owner] = name
        elif owner in entities and rest in _OF_ENTITY:
            self.owned[owner, _OF_ENTITY[rest]] = name
        else:
            self.plain[name.path.removeprefix("let.")] = name


# -- values --------------------------------------------------------------------------------------------------


NOWHERE = "nowhere"
"""The cell of what is not in the room."""

NOTHING = "none"
"""What is in a register that may hold nothing, when it does."""

SILENCE = ""
"""The utterance that stands for silence."""


def entry_words(program: Program) -> int:
    """Registers of an utterance in an inbox: its class, and where rules ask for them its speaker and noun."""
    return 3 if program.header(Header.FLAGS) & Flag.HEARD_BY else 1


def shown(program: Program, name: RegisterName, value: int) -> Any:
    """A register's value as plain data: a word, a number, true or false, a text, or [x, y]; `none` for nothing."""
    if value == name.nothing:
        return NOTHING
    match name.kind:
        case "entity":
            return str(program.entities[value])
        case "bool":
            return bool(value)
        case "cell":
            return NOWHERE if value < CELL else list(place_of(value))
        case "utterance":
            return utterance_text(program, value)
    return name.values[value - name.low] if name.values else value


def read(program: Program, name: RegisterName, given: Any, key: str) -> int:
    """The number for a value as `shown` gives it. Raises ValueError that names the key for any other."""
    if name.nothing is not None and given == NOTHING:
        return name.nothing
    match name.kind:
        case "entity":
            words = [str(entity) for entity in program.entities]
            return name.least + word(key, given, words[name.least : name.high + 1])
        case "bool":
            return word(key, given, (False, True))
        case "cell":
            return _cell(program, given, key)
        case "utterance":
            return utterance_number(program, given, key)
    if name.values:
        return name.low + word(key, given, name.values)
    return whole_number(key, given, name.least, name.high)


def utterance_text(program: Program, value: int) -> str | list[int]:
    """The text of an utterance, "" for silence; [template, noun] if an earlier pair has the same text."""
    if value == 0:
        return SILENCE
    pair = divmod(value - 1, program.sentences.fillings)
    text = program.sentences.said(*pair)
    return text if text is not None and _pair_of(program, text) == pair else list(pair)


def utterance_number(program: Program, given: Any, key: str) -> int:
    """0 for silence, else 1 + template * fillings + filling."""
    if given == SILENCE and isinstance(given, str):
        return 0
    if isinstance(given, str):
        pair = _pair_of(program, given)
        if pair is None:
            sayable = (program.sentences.text(*one) for one in program.sentences.each())
            hint = suggested(given, sayable, quoted=repr)
            raise ValueError(f"{key}: got {given!r}, which the grammar cannot say{hint}")
    elif isinstance(given, Sequence) and len(given) == 2:
        pair = (
            whole_number(f"{key}[0]", given[0], 0, len(program.templates) - 1),
            whole_number(f"{key}[1]", given[1], 0, program.sentences.fillings - 1),
        )
    else:
        raise ValueError(f'{key}: got {given!r}; expected a text, [template, noun], or "" for silence')
    return 1 + pair[0] * program.sentences.fillings + pair[1]


def whole_number(key: str, value: Any, low: int, high: int, hint: str = "") -> int:
    """A whole number in a range. Raises ValueError that names the key for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not low <= value <= high:
        raise ValueError(f"{key}: got {value!r}; expected a whole number from {low} to {high}{hint}")
    return int(value)


def word(key: str, value: Any, words: Sequence[Any]) -> int:
    """The index of a word. Raises ValueError that names the key and what is possible for any other."""
    for i, known in enumerate(words):
        if isinstance(value, type(known)) and value == known:
            return i
    if len(words) > 12:
        raise ValueError(f"{key}: got {value!r}{meant(str(value), map(str, words))[:200]}")
    raise ValueError(f"{key}: got {value!r}; expected one of {', '.join(map(str, words))}")


def meant(given: str, among: Any) -> str:
    """A suggestion for a name that does not exist, to be added to a message."""
    known = list(among)
    return suggested(given, known, f"; expected one of {', '.join(sorted(known))}", repr)


def parts_of(key: str, given: Any, count: int, form: str) -> Sequence[Any]:
    """The parts of a list of a form, such as [x, y]. Raises ValueError that names the key for anything else."""
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != count:
        raise ValueError(f"{key}: got {given!r}; expected {form}")
    return given


def _cell(program: Program, given: Any, key: str) -> int:
    if given == NOWHERE and isinstance(given, str):
        return CELL - 1
    x, y = parts_of(key, given, 2, "[x, y]")
    across = whole_number(f"{key}[0]", x, 0, program.header(Header.CANVAS_WIDTH) - 1)
    return CELL + 32 * whole_number(f"{key}[1]", y, 0, program.header(Header.CANVAS_HEIGHT) - 1) + across


def _pair_of(program: Program, text: str) -> tuple[int, int] | None:
    """The first template and filling that say a text; None if none do."""
    sentences = program.sentences
    spoken = zip(sentences.each(), sentences.pairs(), strict=True)
    return next(
        (pair for (template, choices), pair in spoken if sentences.text(template, choices) == text), None
    )
