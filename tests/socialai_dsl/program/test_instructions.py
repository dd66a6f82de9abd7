"""The instruction table: complete, true of the interpreter, and the page that is made of it."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.compiler.assembler import Block
from socialai_dsl.compiler.instruction_checks import PathFacts, problem_of
from socialai_dsl.compiler.tables import InvalidProgramError, verify
from socialai_dsl.engine.calls import Task
from socialai_dsl.envs.table import Table
from socialai_dsl.program import (
    CELL,
    CLASS_BITS,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    MAX_SIDE,
    TEMPORARIES,
    TEMPORARY,
    Field,
    Header,
    Op,
    Program,
    Register,
)
from socialai_dsl.program.instructions import ANYTHING, TABLE, Bounds, Instruction, Interval, Kind, Operand
from socialai_dsl.program.instructions_page import instructions_page
from socialai_dsl.program.program import bounds_of

DOCS = Path(__file__).parents[3] / "docs"
TOWN = Path(__file__).parents[2] / "diagnostics" / "town.yaml"
TRIALS = 40
TRIED_BOARDS = 8
EDGES = sorted(
    {sign * (1 << power) + off for power in (31, 32, 33, 61, 62) for sign in (1, -1) for off in (-1, 0, 1)}
    | {*ANYTHING, ANYTHING[0] + 1, ANYTHING[1] - 1, 32767, -32768}
)
FIRST_READ, FIRST_WRITTEN = 10, 40
NOT_RUN_ALONE = {
    *(Op.HALT, Op.SKIP, Op.EACH_CELL, Op.DROP_CELL, Op.END_EACH),
    *(op for op, entry in TABLE.items() if entry.setup),
}


def test_every_op_has_its_entry_in_its_class() -> None:
    assert set(TABLE) == set(Op)
    assert all(op >> CLASS_BITS == entry.op_class and op == entry.op for op, entry in TABLE.items())


def test_what_writes_says_what() -> None:
    for entry in TABLE.values():
        assert (entry.writes is None) == (not entry.results), entry.op


def test_an_op_without_an_entry_is_not_assembled() -> None:
    with pytest.raises(AssertionError, match="instruction table"):
        Block().emit(999)  # type: ignore[arg-type]


def test_an_op_without_an_entry_is_not_verified(town: Program) -> None:
    words = town.words.copy()
    words[town.header(Header.CODE_AT) + 4 * town.header(Header.RULES_PC)] = 999
    with pytest.raises(InvalidProgramError, match="instruction table"):
        verify(replace(town, words=words))


def test_the_page_is_made_of_the_table(update_goldens: bool) -> None:
    page = DOCS / "instructions.md"
    if update_goldens:
        page.write_text(instructions_page(), encoding="utf-8")
    assert page.read_text(encoding="utf-8") == instructions_page(), "run pytest --update-goldens"


@pytest.fixture(scope="module")
def town() -> Program:
    program = sd.compile(sd.load(str(TOWN)))
    assert isinstance(program, Program)
    return program


@pytest.fixture(scope="module")
def lonely(town: Program) -> Table:
    """A room of the town, where nothing happens in a step but one instruction, which is put where the reset was."""
    words = town.words.copy()
    h = town.header
    for entry in (Header.BEFORE_PC, Header.LINKS_PC, Header.SETTLE_PC, Header.TICK_PC):
        words[entry] = 0
    words[Header.FRAMES] = words[Header.FLAGS] = 0
    words[h(Header.OUTCOME_AT) :][: 8 * h(Header.CLASSES)] = 0
    words[Header.REQUIRE_PC], words[Header.RULES_PC] = 0, 1
    table = Table([replace(town, words=words)], 1)
    table.reset(0, None)
    table.batch.tables.words[h(Header.CODE_AT) + 8] = Op.HALT
    return table


class Trial:
    """One instruction with random operands, run from a random state."""

    def __init__(self, town: Program, ranges: Bounds, table: Table, entry: Instruction, seed: int) -> None:
        self.random = random.Random(seed)
        self.town, self.table, self.entry = town, table, entry
        self.ranges = ranges
        self.known = PathFacts(self.ranges, has_room=True)
        self.known.boards = set(range(TRIED_BOARDS))
        self.next = FIRST_READ
        self.words = [self._word(operand) for operand in entry.operands]
        self.given = dict(self.known.temporaries)

    def _word(self, operand: Operand) -> int:
        h, pick = self.town.header, self.random.randint
        match operand.kind:
            case Kind.VALUE if self.entry.operands[1].kind is Kind.REGISTER:
                return self._temporary(self._between(-9, 9))
            case Kind.VALUE if self.entry.op is Op.POINT:
                ends = self.random.choice([(0, 3), (CELL - 1, self.ranges.last_cell)])
                return self._temporary(self._between(*ends))
            case Kind.VALUE | Kind.UPDATED:
                return self._temporary(self._interval(operand.low, operand.high))
            case Kind.ENTITY:
                return self._temporary(self._between(0, h(Header.ENTITIES) - 1))
            case Kind.PLACE:
                cell = self.random.random() < 0.5
                low, high = (CELL - 1, self.ranges.last_cell) if cell else (0, h(Header.ENTITIES) - 1)
                return self._temporary(self._between(low, high))
            case Kind.COORDINATES:
                pairs = [self._temporary(self._between(-1, 10)) for _ in range(operand.count)]
                return pairs[0]
            case Kind.TARGET | Kind.TEMPORARIES:
                return TEMPORARY + FIRST_WRITTEN
            case Kind.BOARD | Kind.FILLED | Kind.CHANGED:
                return pick(0, TRIED_BOARDS - 1)
            case Kind.SITE:
                site = pick(0, h(Header.SITES) - 1)
                return site | pick(0, 90) << 16 | pick(2, 127) << 24 if operand.meaning == "packed" else site
            case Kind.INBOX:
                return h(Header.INBOX)
            case Kind.REGISTER:
                return pick(0, h(Header.REGISTERS) - 1)
            case Kind.LITERAL:
                if operand.meaning == "first and last entity":
                    first, last = self._between(0, h(Header.ENTITIES) - 1)
                    return first << 8 | last
                return pick(operand.low, min(operand.high, operand.low + 9))
            case _:
                return 0

    def _between(self, low: int, high: int) -> Interval:
        first, last = sorted(self.random.randint(low, high) for _ in range(2))
        return (first, first) if self.random.random() < 0.3 else (first, last)

    def _interval(self, low: int, high: int) -> Interval:
        """Any interval, often one with ends where arithmetic is odd."""
        ends = [
            self.random.choice(
                (self.random.randint(-9, 70), self.random.choice(EDGES), self.random.getrandbits(63))
            )
            for _ in range(2)
        ]
        first, last = sorted(min(max(end, low), high) for end in ends)
        return (first, first) if self.random.random() < 0.3 else (first, last)

    def _temporary(self, interval: Interval) -> int:
        self.known.temporaries[self.next] = interval
        self.next += 1
        return TEMPORARY + self.next - 1

    def is_fine(self) -> bool:
        instruction = (int(self.entry.op), self.words[0], self.words[1], self.words[2])
        named = frozenset(name.register for name in self.town.registers)
        writable = named if self.entry.op == Op.STORE_AT else frozenset()
        return problem_of(instruction, self.town, self.known, writable) is None

    def run(self) -> None:
        """Run it, and compare what is there afterwards with what is known."""
        batch = self.table.batch
        at = self.town.header(Header.CODE_AT) + 4
        batch.tables.words[at : at + 4] = [self.entry.op, *self.words]
        registers = self._randomize()
        for temporary, (low, high) in self.given.items():
            value = self.random.choice((low, high, self.random.randint(low, high)))
            batch.ports.scratch[temporary] = value
        before = batch.ports.scratch.copy()
        batch.ports.actions[:] = (7, 0, 0, 0)
        batch.step(Task.STEP_ONLY)
        after = batch.ports.scratch
        what = f"{self.entry.op.name} {self.words} of {[before[k] for k in self.given]} within {self.given}"
        written = {word - TEMPORARY for word in self.entry.written(self.words)}
        for temporary in (word for word in written if 0 <= word < TEMPORARIES):
            low, high = self.known.temporaries[temporary]
            assert low <= after[temporary] <= high, f"{what}: {after[temporary]} is not in {low}..{high}"
        changed = set(np.flatnonzero(after != before).tolist())
        assert changed <= written, f"{what}: temporaries {changed - written} were written"
        for register, (low, high) in enumerate(self.ranges.of_register):
            assert low <= registers[register] <= high, f"{what}: register {register} is {registers[register]}"

    def _randomize(self) -> np.ndarray:
        """Give every entity and every register of the program any value that it may have."""
        registers = self.table.batch.state.registers[0]
        registers[Register.T] = 0
        registers[Register.ENDED] = 0
        registers[Register.OUTCOME] = -1
        for name in self.town.registers:
            registers[name.register] = self.random.randint(name.low, name.high)
        for entity in range(self.town.header(Header.ENTITIES)):
            first = FIRST_ENTITY + ENTITY_FIELDS * entity
            for register in range(first, first + ENTITY_FIELDS):
                registers[register] = self.random.randint(*self.ranges.of_register[register])
            if min(registers[first + Field.X], registers[first + Field.Y]) < 0:
                registers[first + Field.X] = registers[first + Field.Y] = -1
        h = self.town.header
        sets = self.table.batch.ports.sets
        for board in range(TRIED_BOARDS):
            for y in range(h(Header.CANVAS_HEIGHT)):
                full = self.random.getrandbits(h(Header.CANVAS_WIDTH))
                sets[board * MAX_SIDE + y] = full if self.random.random() < 0.7 else 0
        return registers


@pytest.mark.parametrize("op", [op for op in Op if op not in NOT_RUN_ALONE], ids=lambda op: op.name)
@pytest.mark.parametrize(
    "trials",
    [TRIALS, pytest.param(5 * TRIALS, marks=pytest.mark.thorough("tries every instruction often"))],
)
def test_what_the_verifier_knows_is_so(op: Op, trials: int, town: Program, lonely: Table) -> None:
    tried, ranges = 0, bounds_of(town)
    for seed in range(20 * trials):
        trial = Trial(town, ranges, lonely, TABLE[op], seed)
        if trial.is_fine():
            trial.run()
            tried += 1
        if tried == trials:
            break
    assert tried >= trials // 20, f"{op.name} was hardly ever accepted"
