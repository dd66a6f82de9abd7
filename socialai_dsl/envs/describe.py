"""The state of an environment in the scenario's own names, as a layout."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.envs.values import ActRegisters, Addresses, addresses_of, entry_words, shown, utterance_text
from socialai_dsl.program import (
    CELL,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    Body,
    Field,
    Flag,
    FrameColumn,
    Header,
    Program,
    Register,
    RegisterName,
    SeatColumn,
    SeatRegister,
    place_of,
)
from socialai_dsl.vocabulary import ACTIONS, COLORS, DIRECTIONS, NOUN, TURN_WORDS

Row = NDArray[np.int32]


def describe(program: Program, registers: Row) -> dict[str, Any]:
    """Everything that decides how the episode goes on, from the registers, int32 (R,), of one environment.

    Keys: `t`, `room`, one for each cast member and object, `one_of` (which file was drawn), `let`, `state` (registers
    of the world), `memory` (what it holds, oldest first), `last` (what the agent did in the last step), `heard` (lines
    since the reset), and `pending`: for NPCs, what was said near them since their last turn, as utterance classes, or
    as [class, speaker, noun] where rules ask who spoke.
    """
    addresses, held = addresses_of(program), registers.tolist()
    state: dict[str, Any] = {
        "t": held[Register.T],
        "room": {"width": held[Register.WIDTH], "height": held[Register.HEIGHT]},
    }
    for number, entity in enumerate(program.entities):
        described, name = _entity(program, held, number), str(entity)
        for key in ("name", "state", "clock", "initial", "timer"):
            owned = addresses.owned.get((name, key))
            if owned is not None:
                described[key] = _value(program, held, owned)
        if beliefs := addresses.beliefs.get(name):
            described["believes"] = _values(program, held, beliefs)
        if looks := addresses.looks.get(name):
            described["looks"] = _values(program, held, looks)
        if entity.index is None:
            state[entity.key] = described
        else:
            state.setdefault(entity.key, []).append(described)
    if addresses.one_of:
        state["one_of"] = _values(program, held, addresses.one_of)
    state["let"] = _values(program, held, addresses.plain)
    for key, acts in addresses.sequences.items():
        state["let"][key] = [_act(program, held, acts, k) for k in range(acts.length)]
    if addresses.world:
        state["state"] = _values(program, held, addresses.world)
    for place, keys in addresses.kept.items():
        section, _, key = place.partition(".")
        state.setdefault(section, {})[key] = _values(program, held, keys)
    if addresses.memories:
        state["memory"] = _memories(program, held, addresses)
    if state["t"]:
        state["last"] = _last(program, held)
    state["heard"] = _history(program, held)
    state["pending"] = _pending(program, held)
    return state


def history(program: Program, registers: Row, seat: int = 0) -> list[str]:
    """Lines that the player on a seat heard since the reset, as far as they are kept, oldest first."""
    return _history(program, registers.tolist(), seat)


Held = Sequence[int]
"""The registers as numbers of Python, which are read faster than an array."""


def _history(program: Program, registers: Held, seat: int = 0) -> list[str]:
    log, size = program.header(Header.LOG), max(program.header(Header.LOG_SIZE), 1)
    oldest, logged = registers[Register.OLDEST], registers[Register.LOGGED]
    if seat > 0:
        row = program.seat_table[seat - 1].tolist()
        log, first = row[SeatColumn.LOG], row[SeatColumn.FIRST]
        oldest, logged = registers[first + SeatRegister.OLDEST], registers[first + SeatRegister.LOGGED]
    return [program.lines[registers[log + place % size]] for place in range(oldest, oldest + logged)]


def _value(program: Program, registers: Held, name: RegisterName) -> Any:
    return shown(program, name, registers[name.register])


def _values(program: Program, registers: Held, names: Mapping[str, RegisterName]) -> dict[str, Any]:
    return {key: _value(program, registers, name) for key, name in names.items()}


def _entity(program: Program, registers: Held, number: int) -> dict[str, Any]:
    base = FIRST_ENTITY + ENTITY_FIELDS * number
    field = registers[base : base + ENTITY_FIELDS]
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
    if entity.role != "object" or field[Field.DIR]:
        described["facing"] = DIRECTIONS[field[Field.DIR]]
    if entity.role == "npc":
        described["poked"] = bool(field[Field.POKED])
        if field[Field.LAST] != Body.NONE:
            described["last"] = TURN_WORDS[field[Field.LAST]]
        if field[Field.POINTING]:
            described["pointing"] = _pointing(field[Field.POINTING])
        if field[Field.TOGGLED]:
            described["toggled"] = str(program.entities[field[Field.TOGGLED]])
    elif entity.role == "object" and field[Field.INSIDE]:
        described["inside"] = str(program.entities[field[Field.INSIDE]])
    if entity.role != "object" and program.header(Header.FLAGS) & Flag.CARRYING:
        described |= _carried(program, registers, number)
    return described


def _pointing(value: int) -> str | list[int]:
    """The direction in which an NPC points, or the cell at which it points."""
    return list(place_of(value)) if value >= CELL else DIRECTIONS[value - 1]


def _carried(program: Program, registers: Held, who: int) -> dict[str, Any]:
    """What a member of the cast carries, if anything."""
    for number, entity in enumerate(program.entities):
        carrier = registers[FIRST_ENTITY + ENTITY_FIELDS * number + Field.CARRIER]
        if entity.role == "object" and carrier == 1 + who:
            return {"carries": str(entity)}
    return {}


def _act(program: Program, registers: Held, acts: ActRegisters, k: int) -> list[Any]:
    """One element of a sequence or memory: its move and its utterance, None for silence."""
    utterance = acts.utterances.get(k)
    said = _value(program, registers, utterance) if utterance is not None else None
    return [_value(program, registers, acts.moves[k]), said or None]


def _memories(program: Program, registers: Held, addresses: Addresses) -> dict[str, list[Any]]:
    held = {key: registers[name.register] for key, name in addresses.filled.items()}
    return {
        key: [_act(program, registers, acts, k) for k in range(acts.length - held[key], acts.length)]
        for key, acts in addresses.memories.items()
    }


def _last(program: Program, registers: Held) -> dict[str, Any]:
    """What the agent did in the last step; the next one may still ask for it (`prev`)."""
    template, noun = registers[Register.TEMPLATE], registers[Register.NOUN]
    silent = template < 0 or noun < 0
    poked = registers[Register.POKED]
    return {
        "action": ACTIONS[registers[Register.ACTION]],
        "said": None if silent else utterance_text(program, 1 + template * program.sentences.fillings + noun),
        "poked": str(program.entities[poked]) if poked >= 0 else None,
    }


def _pending(program: Program, registers: Held) -> dict[str, list[Any]]:
    words = entry_words(program)
    pending: dict[str, list[Any]] = {}
    for row in program.table(Header.FRAME_AT).tolist():
        inbox = row[FrameColumn.INBOX]
        if count := registers[inbox]:
            places = range(inbox + 1, inbox + 1 + words * count, words)
            heard = [registers[place : place + words] for place in places]
            entries = [entry[0] if words == 1 else _heard_entry(program, *entry) for entry in heard]
            pending[str(program.entities[row[FrameColumn.ENTITY]])] = entries
    return pending


def _heard_entry(program: Program, number: int, speaker: int, noun: int) -> list[Any]:
    """An utterance in an inbox: its class, who said it, and the noun, or what stood in each slot."""
    sentences = program.sentences
    heard = {
        slot.name: slot.words[choice]
        for slot, choice in zip(sentences.slots, sentences.choices(noun), strict=True)
        if choice is not None
    }
    return [number, str(program.entities[speaker]), heard.get(NOUN, heard or None)]
