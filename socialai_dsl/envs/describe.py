"""The state of an environment in the scenario's own names: plain data that can be put back as a layout."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

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


def describe(program: Program, registers: NDArray[np.int16]) -> dict[str, Any]:
    """Everything that decides how the episode goes on, from the registers, int16 (R,), of one environment.

    Keys: `t`, `room`, one for each cast member and object, `let`, `heard` (lines since the reset), and `pending`: for
    NPCs, what was said near them since their last turn, as utterance classes.
    """
    state: dict[str, Any] = {
        "t": int(registers[Register.T]),
        "room": {"width": int(registers[Register.WIDTH]), "height": int(registers[Register.HEIGHT])},
    }
    for number, entity in enumerate(program.entities):
        described = _entity(program, registers, number)
        if entity.index is None:
            state[entity.key] = described
        else:
            state.setdefault(entity.key, []).append(described)
    state["let"] = {}
    for name in program.registers:
        _place(state, name, register_value(program, name, int(registers[name.register])))
    log = program.header(Header.LOG)
    state["heard"] = [program.lines[line] for line in registers[log : log + int(registers[Register.LOGGED])]]
    state["pending"] = _pending(program, registers)
    return state


def _entity(program: Program, registers: NDArray[np.int16], number: int) -> dict[str, Any]:
    base = FIRST_ENTITY + ENTITY_FIELDS * number
    field = {name: int(registers[base + name]) for name in Field}
    entity = program.entities[number]
    gone = bool(field[Field.GONE]) or field[Field.X] < 0
    described: dict[str, Any] = {
        "at": None if gone else [field[Field.X], field[Field.Y]],
        "color": COLORS[field[Field.COLOR]],
    }
    if gone:
        described["gone"] = True
    if entity.role == "object":
        described["state"] = entity.states[field[Field.STATUS]]
    else:
        described["facing"] = DIRECTIONS[field[Field.DIR]]
    if entity.role == "npc":
        described["poked"] = bool(field[Field.POKED])
    return described


def _place(state: dict[str, Any], name: RegisterName, value: Any) -> None:
    """`let.exit` under `let`, `wizard.name` with the wizard, where `frame` is called `state`."""
    owner, _, rest = name.path.partition(".")
    if owner == "let":
        state["let"][rest] = value
    elif rest in ("name", "clock"):
        state[owner][rest] = value
    elif rest == "frame":
        state[owner]["state"] = value
    else:
        state["let"][name.path] = value


def register_value(program: Program, name: RegisterName, value: int) -> Any:
    """What a number in a register stands for."""
    if name.kind == "entity":
        return str(program.entities[value])
    if name.kind == "bool":
        return bool(value)
    return name.values[value - name.low] if name.values else value


def _pending(program: Program, registers: NDArray[np.int16]) -> dict[str, list[int]]:
    start, rows = program.header(Header.FRAME_AT), program.header(Header.FRAMES)
    table = program.words[start : start + rows * FrameColumn.COLUMNS].reshape(rows, FrameColumn.COLUMNS)
    pending = {}
    for row in table.tolist():
        inbox = row[FrameColumn.INBOX]
        if count := int(registers[inbox]):
            heard = registers[inbox + 1 : inbox + 1 + count]
            pending[str(program.entities[row[FrameColumn.ENTITY]])] = [int(number) for number in heard]
    return pending
