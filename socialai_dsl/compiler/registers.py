"""Which register holds what: one row of int16 per environment."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from socialai_dsl.program import CELL, ENTITY_FIELDS, FIRST_ENTITY, Field, RegisterName
from socialai_dsl.semantics.plans import Checked, Drawn, Entity, FramePlan, MemoryPlan
from socialai_dsl.semantics.terms import ACTION, BOOL, Type, may_find_nothing
from socialai_dsl.vocabulary import FINISHED

NOWHERE = CELL - 1
"""The cell of what is in no cell."""


def entity_register(entity: int, which: Field) -> int:
    """The register of a field of an entity."""
    return FIRST_ENTITY + ENTITY_FIELDS * entity + which


@dataclass
class Registers:
    """Allocates registers in order of need and remembers their names and ranges.

    Attributes:
        end: registers up to this number belong to the program, even if none of the others reaches so far.
    """

    next_free: int
    canvas: tuple[int, int]
    by_path: dict[str, int] = field(default_factory=dict)
    names: list[RegisterName] = field(default_factory=list)
    end: int = 0

    @classmethod
    def of(cls, checked: Checked) -> Registers:
        """Entities, draws in the order of the setup, states and clocks of the frames, then what is remembered."""
        registers = cls(FIRST_ENTITY + ENTITY_FIELDS * len(checked.entities), checked.room.canvas)
        for item in checked.setup:
            if isinstance(item, Drawn):
                registers.add(item.path, item.type)
        for frame in checked.frames:
            states = Type("status", 0, len(state_names(frame)) - 1, state_names(frame))
            registers.add(f"{frame.member}.frame", states, fleeting=not frame.written)
            registers.add(
                f"{frame.member}.clock", Type("int", 0, checked.horizon), fleeting=not frame.written
            )
        for item in checked.remembered:
            registers.add(item.path, item.type, fleeting=True)
            if may_find_nothing(item.value.term):
                registers.add(found_path(item.path), BOOL, fleeting=True)
        for memory in checked.memories:
            registers._add_memory(memory)
        for entity in checked.entities:
            if entity.timer:
                registers.add(f"{label(entity)}.timer", Type("int", 0, entity.timer))
        return registers

    def _add_memory(self, memory: MemoryPlan) -> None:
        for k in range(memory.length):
            self.add(f"{memory.path}[{k}].move", ACTION)
            self.add(f"{memory.path}[{k}].utterance", memory.utterances)
        self.add(f"{memory.path}.filled", Type("int", 0, memory.length))
        if memory.open is not None:
            self.add(f"{memory.path}.open", BOOL, fleeting=True)

    def add(self, path: str, type_: Type, fleeting: bool = False) -> int:
        """A named register. One of a cell may hold any cell of the canvas, and none."""
        type_ = self.cut(type_)
        register = self.reserve(1)
        self.by_path[path] = register
        name = RegisterName(path, register, type_.words, type_.low, type_.high, type_.kind, fleeting)
        self.names.append(name)
        return register

    def cut(self, type_: Type) -> Type:
        """The type with the cells that there are."""
        if type_.kind != "cell":
            return type_
        width, height = self.canvas
        return replace(type_, low=NOWHERE, high=CELL + 32 * (height - 1) + width - 1)

    def reserve(self, count: int) -> int:
        """The first of `count` registers without a name."""
        first = self.next_free
        self.next_free += count
        return first


def label(entity: Entity) -> str:
    """What an entity is called in the path of a register of its own."""
    return entity.key if entity.index is None else f"{entity.key}[{entity.index}]"


def found_path(path: str) -> str:
    """The register of whether there was a value for another register."""
    return f"{path}.found"


def said_path(speaker: Entity) -> str:
    """The register of what an NPC has said in this step: 1 + the line, 0 nothing."""
    return f"{label(speaker)}.said"


def state_names(frame: FramePlan) -> tuple[str, ...]:
    """Names of a frame's states in the order of their numbers; nameless entries of `steps` are step0, step1, ..."""
    if frame.states:
        return tuple(state.name for state in frame.states)
    return (*(step.state or f"step{i}" for i, step in enumerate(frame.steps)), FINISHED)
