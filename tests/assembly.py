"""Builds tiny programs word by word, so that the engine is tested without the compiler."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from socialai_dsl import draws
from socialai_dsl.engine.batch import Batch, LinkedProgram
from socialai_dsl.engine.calls import Task
from socialai_dsl.engine.state import Key
from socialai_dsl.program import (
    CONSTANT,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    TEMPORARY,
    Body,
    EntityColumn,
    EntityName,
    Field,
    Flag,
    FrameColumn,
    Header,
    Op,
    Outcome,
    Program,
    TypeColumn,
    pack_cell,
)
from socialai_dsl.vocabulary import Sentences, Slot

EMPTY, WALL, DOOR, LAVA, NPC = 1, 2, 4, 9, 11
GENERATOR, MARBLE, PLATFORM = 15, 16, 17
OPEN, CLOSED, LOCKED = 0, 1, 2
IDLE, PRESSED = 0, 1
STILL, ROLLING = 0, 1
_FIRST_ROW = {"agent": 0, "npc": 1, "door": 2, "lava": 5, "marble": 6, "generator": 8, "platform": 10}

CLASSES = (1, 2, 3, 1, 1, 4)
HEARD_SIZE, INBOX_REGISTERS = 4, 5

Instruction = tuple[int, ...]


def constant(number: int) -> int:
    """The operand that stands for a number."""
    return CONSTANT + number


def temporary(number: int) -> int:
    """The operand that stands for a temporary."""
    return TEMPORARY + number


def entity_register(entity: int, which: Field) -> int:
    """The register of a field of an entity."""
    return FIRST_ENTITY + ENTITY_FIELDS * entity + which


@dataclass
class FrameSpec:
    """A frame of an entity: for each state its activity, and its `first` and `then` by what was heard.

    Keys of `first` and `then` are utterance classes; -1 stands for all of them.
    """

    entity: int
    activities: Sequence[Sequence[Instruction]]
    first: Sequence[dict[int, Sequence[Instruction]]] = ()
    then: Sequence[dict[int, Sequence[Instruction]]] = ()
    perceive: Sequence[Instruction] = ()
    deferred: Sequence[Instruction] = ()


@dataclass
class Assembly:
    """A room of `size` on a canvas of `canvas`, entities put where `at` says, and code.

    Entities are numbered agent, NPCs, objects. Object types: door (open, closed, locked), lava, marble (still, rolling:
    it rolls when pushed), generator (idle, pressed: when pushed) and platform. Doors that are not open are the only
    things one cannot look through; open doors, lava and platforms can be walked on.
    Templates x nouns are 2 x 3, in the utterance classes `CLASSES`.
    """

    at: Sequence[tuple[int, int] | None] = ((2, 2),)
    facing: Sequence[int] = ()
    npcs: int = 0
    objects: Sequence[str] = ()
    size: tuple[int, int] = (5, 5)
    canvas: tuple[int, int] = (6, 7)
    registers: int = 8
    reset: Sequence[Instruction] = ()
    settle: Sequence[Instruction] = ()
    rules: Sequence[Instruction] = ()
    outcomes: dict[tuple[int, int], Sequence[Instruction]] = field(default_factory=dict)
    frames: Sequence[FrameSpec] = ()
    horizon: int = 10
    flags: int = 0
    earshot: tuple[int, int] = (0, 1)
    lines: Sequence[tuple[str, Sequence[int], int]] = ()  # text, token ids, class
    tokens: int = 8
    log: int = 4
    deadly: bool = False
    sites: Sequence[tuple[int, int]] = ((draws.site("a"), 0), (draws.site("b"), 3))
    agent_says: int = 0
    view: int = 7
    before: Sequence[Instruction] = ()
    links: Sequence[Instruction] = ()
    require: Sequence[Instruction] = ()
    channels: int = 4

    def __post_init__(self) -> None:
        self.code: list[Instruction] = [(Op.HALT, 0, 0, 0)]
        self.own = FIRST_ENTITY + ENTITY_FIELDS * len(self.at)

    def add(self, block: Sequence[Instruction]) -> int:
        """Append code; its pc, 0 for no code."""
        if not block:
            return 0
        pc = len(self.code)
        for op, *operands in block:
            self.code.append((op, *operands, *[0] * (3 - len(operands))))
        self.code.append((Op.HALT, 0, 0, 0))
        return pc

    def program(self) -> Program:
        """The program, with all tables."""
        classes = max(CLASSES) + 1
        width, height = self.canvas
        entities = len(self.at)
        frame_registers = self.own + self.registers
        heard = frame_registers + 2 * len(self.frames)
        inbox = heard + HEARD_SIZE
        log = inbox + INBOX_REGISTERS * entities
        header = np.zeros(Header.END, np.int64)
        tables: list[tuple[Header, list[int]]] = [
            (Header.ACTION_AT, [*range(7), Body.NONE]),
            (Header.CLASS_AT, list(CLASSES)),
            (Header.ENTITY_AT, self._entities()),
            (Header.TYPE_AT, self._types()),
            (Header.ROOM_AT, self._room()),
            (Header.FRAME_AT, self._frames(frame_registers, inbox)),
            (Header.STATE_AT, self._states(classes)),
            (Header.OUTCOME_AT, self._outcomes(classes)),
            (Header.LINE_AT, self._lines()),
            (Header.TOKEN_AT, [token for _, tokens, _ in self.lines for token in tokens]),
            (Header.SITE_AT, [number for site in self.sites for number in site]),
            (Header.CLASS_SET_AT, []),
        ]
        header[Header.RESET_PC] = self.add(self._reset())
        header[Header.SETTLE_PC] = self.add(self.settle)
        header[Header.RULES_PC] = self.add(self.rules)
        header[Header.BEFORE_PC] = self.add(self.before)
        header[Header.LINKS_PC] = self.add(self.links)
        header[Header.REQUIRE_PC] = self.add(self.require)
        tables.append((Header.CODE_AT, [word for instruction in self.code for word in instruction]))
        words = [0] * Header.END
        for at, table in tables:
            header[at] = len(words)
            words += table
        outcomes = 4
        for name, number in {
            Header.SIZE: len(words),
            Header.REGISTERS: log + self.log,
            Header.CANVAS_WIDTH: width,
            Header.CANVAS_HEIGHT: height,
            Header.ENTITIES: entities,
            Header.NPCS: self.npcs,
            Header.PRIMITIVES: 7,
            Header.TEMPLATES: 2,
            Header.NOUNS: 3,
            Header.CLASSES: classes,
            Header.HORIZON: self.horizon,
            Header.FLAGS: self.flags,
            Header.TOKENS: self.tokens,
            Header.LOG: log,
            Header.LOG_SIZE: self.log,
            Header.HEARD: heard,
            Header.HEARD_SIZE: HEARD_SIZE,
            Header.INBOX: inbox,
            Header.INBOX_SIZE: INBOX_REGISTERS - 1,
            Header.FRAMES: len(self.frames),
            Header.DEADLY: 1 << LAVA if self.deadly else 0,
            Header.MIN_WIDTH: self.size[0],
            Header.MIN_HEIGHT: self.size[1],
            Header.HEIGHTS: 1,
            Header.OUTSIDE: pack_cell(WALL, 5),
            Header.INSTRUCTIONS: len(self.code),
            Header.LINES: len(self.lines),
            Header.STATES: sum(len(frame.activities) for frame in self.frames),
            Header.SITES: len(self.sites),
            Header.TYPE_ROWS: 11,
            Header.COUNTERS: 1 + outcomes + 1,
            Header.AGENT_SAYS: self.agent_says,
            Header.SLOPE: 900,
            Header.CHANNELS: self.channels,
            Header.CLASS_SET_WORDS: classes // 32 + 1,
        }.items():
            header[name] = number
        words[: Header.END] = header.tolist()
        return Program(
            words=np.array(words, np.int32),
            name="assembled",
            actions=("left", "right", "forward", "pickup", "drop", "toggle", "done"),
            sentences=Sentences.of(
                ("Where is <noun>", "Open <noun>"), (Slot("noun", ("you", "sesame", "the exit")),)
            ),
            entities=self._names(),
            registers=(),
            lines=tuple(text for text, _, _ in self.lines),
            line_speakers=(1,) * len(self.lines),
            outcome_table=tuple(
                Outcome(name, name == "won") for name in ("won", "lost", "deadly", "timeout")
            ),
            rules=("rule0",),
            vocabulary=("<pad>", "<unk>", *(f"word{i}" for i in range(20))),
            source_map=[None] * len(self.code),
            labels={},
        )

    def _names(self) -> tuple[EntityName, ...]:
        npcs = [EntityName(f"npc{i}", None, "npc", "peer") for i in range(self.npcs)]
        statuses = {
            "door": ("open", "closed", "locked"),
            "lava": ("",),
            "marble": ("still", "rolling"),
            "generator": ("idle", "pressed"),
            "platform": ("",),
        }
        objects = [
            EntityName(f"{kind}{i}", None, "object", kind, statuses[kind])
            for i, kind in enumerate(self.objects)
        ]
        return (EntityName("agent", None, "agent", "agent"), *npcs, *objects)

    def _reset(self) -> list[Instruction]:
        block: list[Instruction] = [(Op.MAKE_ROOM, constant(self.size[0]), constant(self.size[1]))]
        for entity, cell in enumerate(self.at):
            x, y = cell if cell is not None else (-1, -1)
            block += [
                (Op.IF_UNPINNED, entity_register(entity, Field.X), 0, 3),
                (Op.LOAD, temporary(0), constant(x)),
                (Op.LOAD, temporary(1), constant(y)),
                (Op.PUT, constant(entity), temporary(0)),
            ]
        for entity, direction in enumerate(self.facing):
            block.append((Op.LOAD, entity_register(entity, Field.DIR), constant(direction)))
        for entity in range(1 + self.npcs, len(self.at)):
            status = CLOSED if self.objects[entity - 1 - self.npcs] == "door" else 0
            block.append((Op.LOAD, entity_register(entity, Field.STATUS), constant(status)))
        return [*block, *self.reset]

    def _entities(self) -> list[int]:
        rows: list[int] = []
        for entity in range(len(self.at)):
            kind = "agent" if entity == 0 else "npc"
            if entity > self.npcs:
                kind = self.objects[entity - 1 - self.npcs]
            row = [0] * EntityColumn.COLUMNS
            row[EntityColumn.TYPE] = _FIRST_ROW[kind]
            row[EntityColumn.KIND] = entity if kind == "npc" else 0
            row[EntityColumn.NEAR], row[EntityColumn.FAR] = self.earshot
            row[EntityColumn.VIEW] = self.view
            rows += row
        return rows

    @staticmethod
    def _types() -> list[int]:
        def row(
            code: int, status: int, walkable: int, toggled: int, pushed: int | None = None, rolls: int = 0
        ) -> list[int]:
            columns = [0] * TypeColumn.COLUMNS
            columns[TypeColumn.TRANSPARENT] = int(walkable or code in (GENERATOR, MARBLE))
            columns[TypeColumn.PUSHED] = status if pushed is None else pushed
            columns[TypeColumn.ROLLS] = rolls
            columns[TypeColumn.CODE], columns[TypeColumn.STATUS] = code, status
            columns[TypeColumn.WALKABLE], columns[TypeColumn.TOGGLED] = walkable, toggled
            return columns

        door = [row(DOOR, OPEN, 1, CLOSED), row(DOOR, CLOSED, 0, OPEN), row(DOOR, LOCKED, 0, LOCKED)]
        marble = [row(MARBLE, STILL, 0, 0, pushed=ROLLING), row(MARBLE, ROLLING, 0, 1, rolls=1 + STILL)]
        generator = [row(GENERATOR, IDLE, 0, 0, pushed=PRESSED), row(GENERATOR, PRESSED, 0, 1)]
        rows = [row(10, 0, 1, 0), row(NPC, 0, 0, 0), *door, row(LAVA, 0, 1, 0)]
        rows += [*marble, *generator, row(PLATFORM, 0, 1, 0)]
        return [word for one in rows for word in one]

    def _room(self) -> list[int]:
        (width, height), (across, down) = self.canvas, self.size
        cells, solid, floor, opaque = [], [0] * height, [0] * height, [0] * height
        for y in range(height):
            for x in range(width):
                inside = x < across and y < down
                wall = inside and (x in (0, across - 1) or y in (0, down - 1))
                opaque[y] |= wall << x
                cells.append(pack_cell(WALL, 5) if wall else pack_cell(EMPTY))
                if wall or not inside:
                    solid[y] |= 1 << x
                else:
                    floor[y] |= 1 << x
        columns = [sum((line >> x & 1) << y for y, line in enumerate(opaque)) for x in range(width)]
        return [*cells, pack_cell(WALL, 5), *solid, *floor, *opaque, *columns]

    def _frames(self, registers: int, inbox: int) -> list[int]:
        rows: list[int] = []
        first = 0
        for number, frame in enumerate(self.frames):
            row = [0] * FrameColumn.COLUMNS
            row[FrameColumn.ENTITY] = frame.entity
            row[FrameColumn.STATE] = registers + 2 * number
            row[FrameColumn.CLOCK] = registers + 2 * number + 1
            row[FrameColumn.ROWS], row[FrameColumn.STATES] = first, len(frame.activities)
            row[FrameColumn.INBOX] = inbox + INBOX_REGISTERS * frame.entity
            row[FrameColumn.PERCEIVE] = self.add(frame.perceive)
            row[FrameColumn.DEFERRED] = self.add(frame.deferred)
            rows += row
            first += len(frame.activities)
        return rows

    def _states(self, classes: int) -> list[int]:
        rows: list[int] = []
        for frame in self.frames:
            for state, activity in enumerate(frame.activities):
                rows.append(self.add(activity))
                for table in (frame.first, frame.then):
                    known = table[state] if state < len(table) else {}
                    default = self.add(known.get(-1, ()))
                    rows += [
                        self.add(known[heard]) if heard in known else default for heard in range(classes + 1)
                    ]
        return rows

    def _outcomes(self, classes: int) -> list[int]:
        table = [0] * (8 * classes)
        for (heard, body), block in self.outcomes.items():
            pc = self.add(block)
            for c in range(classes) if heard < 0 else [heard]:
                for b in range(8) if body < 0 else [body]:
                    table[8 * c + b] = pc
        return table

    def _lines(self) -> list[int]:
        rows: list[int] = []
        first = 0
        for _, tokens, heard in self.lines:
            rows += [first, len(tokens), heard, -1]
            first += len(tokens)
        return rows


HIDDEN = int(Flag.NPCS_HIDDEN)


def part_of(program: Program, first_outcome: int = 0) -> LinkedProgram:
    """A program with its links into a batch of programs like it, in which its outcomes are numbered from the first."""
    return LinkedProgram(
        program,
        outcomes=range(first_outcome, first_outcome + len(program.outcome_table)),
        actions=[*range(7), Body.NONE],
        templates=range(2),
        slots=[range(3)],
        strides=[[0, 1], [0, 1]],
        tokens=range(len(program.vocabulary)),
    )


def batch_of(program: Program, rows: int = 1, seed: int = 7) -> Batch:
    """A batch of one program, row i at (seed, i), reset."""
    batch = Batch([part_of(program)], [[0]], [0] * rows, program.header(Header.TOKENS))
    batch.state.keys[:, Key.SEED] = seed
    batch.state.keys[:, Key.INDEX] = np.arange(rows)
    batch.reset()
    return batch


def step(batch: Batch, action: tuple[int, ...] = (7, 0, 0, 0)) -> None:
    """One step of all rows, by default without a movement or word."""
    batch.ports.actions[:] = action
    assert batch.step(Task.STEP_ONLY) >= 0


def play(batch: Batch, *actions: tuple[int, ...]) -> None:
    """A step of all rows for each action."""
    for action in actions:
        step(batch, action)


def result_of(block: Sequence[Instruction], register: int | None = None, **room: object) -> int:
    """Value of a register, by default the program's first own one, after the rules `block` ran in one step."""
    assembly = Assembly(rules=block, **room)  # type: ignore[arg-type]
    batch = batch_of(assembly.program())
    step(batch)
    return int(batch.state.registers[0, assembly.own if register is None else register])


def holds(test: Instruction, **room: object) -> bool:
    """Whether a test holds in a room; it must skip exactly what follows it."""
    own = Assembly(**room).own  # type: ignore[arg-type]
    block = [
        (*test, *[0] * (3 - len(test)), 2) if len(test) < 4 else test,
        (Op.LOAD, own, constant(1)),
        (Op.SKIP, 0, 0, 1),
        (Op.LOAD, own, constant(2)),
    ]
    value = result_of(block, own, **room)
    assert value in (1, 2), "neither branch of the test was taken"
    return value == 1
