"""Instructions, labels and registers: blocks of position-independent code, and the code table they are put into."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from socialai_dsl.draws import site as site_number
from socialai_dsl.program import (
    BOARDS,
    CELL,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    TEMPORARIES,
    TEMPORARY,
    TESTS,
    Field,
    Op,
    RegisterName,
    SeatRegister,
)
from socialai_dsl.program.instructions import TABLE
from socialai_dsl.semantics.plans import CheckedScenario, Drawn, Entity, FramePlan, MemoryPlan
from socialai_dsl.semantics.terms import ACTION, BOOL, Type, may_find_nothing
from socialai_dsl.source import Span
from socialai_dsl.vocabulary import FINISHED

_STATES_OF_AN_ANSWER = 255
"""States that `Op.ANSWER` has room for."""


@dataclass(eq=False)
class Label:
    """A place further down in a block; `uses` are the instructions that skip to it."""

    uses: list[int] = field(default_factory=list)
    position: int | None = None


@dataclass
class Sites:
    """The table of draw sites.

    Attributes:
        rows: (path, number) -> row.
        kept: paths of values whose draws stay the same in a session. session: the number of its episodes.
    """

    kept: tuple[str, ...] = ()
    session: int = 1
    rows: dict[tuple[str, int], int] = field(default_factory=dict)

    def row(self, path: str, number: int = 0) -> int:
        """The row of this site, made on first use."""
        return self.rows.setdefault((path, number), len(self.rows))

    def words(self) -> list[int]:
        """The table as int32 words."""
        paths = {path for path, _ in self.rows}
        numbers = {site_number(path) for path in paths}
        assert len(paths) == len(numbers), "internal: two draw sites share a hash; rename one of their owners"
        return [
            word for path, number in self.rows for word in (site_number(path), number | self._lasts(path))
        ]

    def _lasts(self, path: str) -> int:
        """The episodes for which a draw stays the same, as the upper half of its number; 0 if it does not."""
        return self.session << 16 if path.partition("[")[0] in self.kept else 0


class Block:
    """A piece of code under construction; falls through top-down and ends with HALT.

    Attributes:
        taken, boards_taken: how many temporaries and boards are in use; they are given back like a stack.
    """

    def __init__(self) -> None:
        self.instructions: list[list[int]] = []
        self.spans: list[Span | None] = []
        self.span: Span | None = None
        self.taken = 0
        self.boards_taken = 0

    def emit(self, op: Op, a: int = 0, b: int = 0, c: int = 0) -> None:
        """Append an instruction, attributed to `self.span`."""
        assert op in TABLE, f"internal: the instruction table has no {op!r}"
        self.instructions.append([int(op), a, b, c])
        self.spans.append(self.span)

    def test(self, op: Op, a: int, b: int, otherwise: Label) -> None:
        """Append a test that skips to `otherwise` if false."""
        otherwise.uses.append(len(self.instructions))
        self.emit(op, a, b)

    def skip(self, to: Label) -> None:
        """Append an unconditional skip."""
        to.uses.append(len(self.instructions))
        self.emit(Op.SKIP)

    def bind(self, label: Label) -> None:
        """Say that `label` is here, and fill in the skips to it."""
        assert label.position is None, "internal: a label is bound twice"
        label.position = len(self.instructions)
        for use in label.uses:
            self.instructions[use][3] = label.position - use - 1

    def unless(self, op: Op, a: int, b: int, then: Label) -> None:
        """Append a test that skips to `then` if true."""
        with self.when(op, a, b, then):
            pass

    @contextmanager
    def when(self, op: Op, a: int, b: int, then: Label | None = None) -> Iterator[None]:
        """What is emitted within runs only if a test holds, and then goes on to `then`, if that is given."""
        following = Label()
        self.test(op, a, b, following)
        yield
        if then is not None:
            self.skip(then)
        self.bind(following)

    def fuse_answer(self, start: int) -> None:
        """Put what begins at `start` into one instruction, if all of it is to count, to say and perhaps to go on."""
        ops = [Op(instruction[0]) for instruction in self.instructions[start:]]
        if ops not in ([Op.COUNT, Op.SAY, Op.HALT], [Op.COUNT, Op.SAY, Op.GOTO, Op.HALT]):
            return
        (_, counter, _, _), (_, _, line, _), (_, frame, state, _) = self.instructions[start : start + 3]
        if Op.GOTO in ops and state >= _STATES_OF_AN_ANSWER:
            return
        goal = frame << 8 | state + 1 if Op.GOTO in ops else 0
        self.instructions[start:-1] = [[int(Op.ANSWER), counter, line, goal]]
        del self.spans[start + 1 : -1]

    def shorten(self) -> None:
        """Let skips that lead to others go to where these lead, and those that lead to the end be the end."""
        for at, instruction in reversed(list(enumerate(self.instructions))):
            if instruction[0] != Op.SKIP and instruction[0] not in TESTS:
                continue
            goal = self.instructions[at + 1 + instruction[3]]
            if goal[0] == Op.SKIP:
                instruction[3] += 1 + goal[3]
            elif goal[0] == Op.HALT and instruction[0] == Op.SKIP:
                instruction[:] = goal

    def halt(self) -> None:
        """End of this path."""
        self.emit(Op.HALT)

    def temporary(self, count: int = 1) -> int:
        """The first of `count` fresh temporaries, as an operand."""
        first = self.taken
        self.taken += count
        assert self.taken <= TEMPORARIES, "internal: an expression needs more temporaries than the engine has"
        return TEMPORARY + first

    @contextmanager
    def scratch(self) -> Iterator[None]:
        """The temporaries that are taken within are given back."""
        mark = self.taken
        yield
        self.taken = mark

    def board(self) -> int:
        """A fresh board."""
        self.boards_taken += 1
        assert self.boards_taken <= BOARDS, "internal: a set of cells needs more boards than the engine has"
        return self.boards_taken - 1

    def release_boards(self, mark: int) -> None:
        """Give back the boards from number `mark` on."""
        self.boards_taken = mark


class CodeTable:
    """All blocks of a program, equal ones stored once. Address 0 is a HALT."""

    def __init__(self) -> None:
        self.instructions: list[list[int]] = [[int(Op.HALT), 0, 0, 0]]
        self.spans: list[Span | None] = [None]
        self.labels: dict[int, str] = {}
        self._known: dict[tuple[tuple[int, ...], ...], int] = {}

    def add(self, block: Block, label: str) -> int:
        """Store a block, return its address; 0 if it does nothing."""
        if not block.instructions or block.instructions[0][0] == Op.HALT:
            return 0
        if block.instructions[-1][0] != Op.HALT:
            block.halt()
        block.shorten()
        key = tuple(tuple(row) for row in block.instructions)
        if key not in self._known:
            self._known[key] = len(self.instructions)
            self.labels[len(self.instructions)] = label
            self.instructions.extend(block.instructions)
            self.spans.extend(block.spans)
        return self._known[key]


# -- registers: one row per environment ----------------------------------------------------------------------


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
    def of(cls, checked: CheckedScenario) -> Registers:
        """Entities, draws in the order of the setup, states and clocks of the frames, then what is remembered."""
        registers = cls(FIRST_ENTITY + ENTITY_FIELDS * len(checked.entities), checked.room.canvas)
        for item in checked.setup:
            if isinstance(item, Drawn):
                registers.add(item.path, item.type, nothing=item.nothing)
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
        for path, lasts in {item.path: item.lasts for item in checked.beliefs if item.lasts}.items():
            registers.add(age_path(path), Type("int", 0, lasts))
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

    def add(self, path: str, type_: Type, fleeting: bool = False, nothing: int | None = None) -> int:
        """A named register. One of a cell may hold any cell of the canvas, and none."""
        type_ = self.cut(type_)
        register = self.reserve(1)
        self.by_path[path] = register
        low, words = type_.low, type_.words
        if nothing is not None:
            low, words = min(low, nothing), ("none", *words) if words else ()
        self.names.append(RegisterName(path, register, words, low, type_.high, type_.kind, fleeting, nothing))
        return register

    def cut(self, type_: Type) -> Type:
        """The type with the cells that there are."""
        if type_.kind != "cell":
            return type_
        width, height = self.canvas
        return replace(type_, low=NOWHERE, high=CELL + 32 * (height - 1) + width - 1)

    def named(self, path: str) -> RegisterName:
        """The register of a path, with its range."""
        return next(name for name in self.names if name.path == path)

    def reserve(self, count: int) -> int:
        """The first of `count` registers without a name."""
        first = self.next_free
        self.next_free += count
        return first


def label(entity: Entity) -> str:
    """The name of an entity in the paths of its registers."""
    return entity.key if entity.index is None else f"{entity.key}[{entity.index}]"


def found_path(path: str) -> str:
    """The register of whether there was a value for another register."""
    return f"{path}.found"


def age_path(belief: str) -> str:
    """The register of for how many turns a belief that is forgotten has had no source."""
    return f"{belief}.age"


def said_path(speaker: Entity) -> str:
    """The register of what an NPC has said in this step: 1 + the line, 0 nothing."""
    return f"{label(speaker)}.said"


def seat_path(member: Entity, which: SeatRegister) -> str:
    """A register of a seat other than the agent's."""
    return f"{label(member)}.seat.{which.name.lower()}"


def state_names(frame: FramePlan) -> tuple[str, ...]:
    """Names of a frame's states in the order of their numbers; nameless entries of `steps` are step0, step1.0, ..."""
    if frame.states:
        return tuple(state.name for state in frame.states)
    return (*(step.state or f"step{step.place or i}" for i, step in enumerate(frame.steps)), FINISHED)
