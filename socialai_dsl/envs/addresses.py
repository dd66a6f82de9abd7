"""Where a program's own registers stand in a layout: which are elements of sequences, which belong to an entity."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

from socialai_dsl.program import Program, RegisterName

_ELEMENT: Final = re.compile(r"(let|memory)\.(\w+)\[(\d+)\]\.(move|utterance)")
_FILLED: Final = re.compile(r"memory\.(\w+)\.filled")
_BELIEF: Final = re.compile(r"(.+)\.believes\.(\w+)")
_OF_ENTITY: Final = {
    "name": "name",
    "clock": "clock",
    "frame": "state",
    "initial": "initial",
    "timer": "timer",
}


@dataclass
class Acts:
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
    """

    def __init__(self, program: Program) -> None:
        self.sequences: dict[str, Acts] = {}
        self.memories: dict[str, Acts] = {}
        self.filled: dict[str, RegisterName] = {}
        self.one_of: dict[str, RegisterName] = {}
        self.owned: dict[tuple[str, str], RegisterName] = {}
        self.world: dict[str, RegisterName] = {}
        self.beliefs: dict[str, dict[str, RegisterName]] = {}
        self.plain: dict[str, RegisterName] = {}
        entities = {str(entity) for entity in program.entities}
        for name in program.registers:
            self._add(name, entities)

    def _add(self, name: RegisterName, entities: set[str]) -> None:
        if name.fleeting:
            return
        owner, _, rest = name.path.rpartition(".")
        if element := _ELEMENT.fullmatch(name.path):
            group, key, index, part = element.groups()
            acts = (self.sequences if group == "let" else self.memories).setdefault(key, Acts())
            (acts.moves if part == "move" else acts.utterances)[int(index)] = name
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
