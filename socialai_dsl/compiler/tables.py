"""All tables of a program put one behind the other, with the header in front."""

from __future__ import annotations

from itertools import product

import numpy as np

from socialai_dsl.compiler.assembler import state_names
from socialai_dsl.compiler.lowering import Allocation, FrameCode, Lowered
from socialai_dsl.program import (
    EntityColumn,
    EntityName,
    Flag,
    FrameColumn,
    Header,
    LineColumn,
    Outcome,
    Program,
    TypeColumn,
    pack_cell,
)
from socialai_dsl.semantics.free_cells import interior_cells
from socialai_dsl.semantics.plans import Checked, Entity, RoomPlan
from socialai_dsl.semantics.terms import ObjectType
from socialai_dsl.vocabulary import ACTIONS, COLORS, EMPTY, NPC, WALL


class Tables:
    """The tables of one scenario, laid out in the words of a program.

    Registers of what is heard and of the log are reserved here, since only now it is known how many there are.
    """

    def __init__(self, allocation: Allocation, lowered: Lowered) -> None:
        self.allocation, self.lowered = allocation, lowered
        self.checked, self.registers, self.classes = (
            allocation.checked,
            allocation.registers,
            allocation.classes,
        )
        self.sites, self.lines, self.code = allocation.sites, allocation.lines, allocation.code

    def program(self) -> Program:
        """Lay out everything; see program.Header for the order."""
        frames, outcomes = self.lowered.frames, self.lowered.outcomes
        rules = tuple(self.allocation.rules)
        checked, lines = self.checked, self.lines
        length = lines.history_length
        heard_size = max(1, len(lines.speakers))
        heard = self.registers.reserve(heard_size)
        log_size = length // min((len(tokens) for tokens in lines.tokens), default=length)
        log = self.registers.reserve(log_size)

        header = dict.fromkeys(Header, 0)
        body: list[int] = []

        def table(offset: Header, words: list[int]) -> None:
            header[offset] = Header.END + len(body)
            body.extend(words)

        types = _TypeTable(checked)
        table(Header.CODE_AT, [word for row in self.code.instructions for word in row])
        table(Header.ACTION_AT, [*(ACTIONS.index(action) for action in checked.actions), len(ACTIONS) - 1])
        table(Header.CLASS_AT, self.classes.of_pair)
        table(Header.ENTITY_AT, [word for entity in checked.entities for word in _entity_row(entity, types)])
        table(Header.TYPE_AT, [word for row in types.rows for word in row])
        table(Header.ROOM_AT, room_templates(checked.room))
        table(Header.FRAME_AT, self._frame_rows(frames))
        table(Header.STATE_AT, [word for frame in frames for row in frame.rows for word in row])
        table(Header.OUTCOME_AT, outcomes)
        table(Header.LINE_AT, self._line_rows())
        table(Header.TOKEN_AT, [token for tokens in lines.tokens for token in tokens])
        table(Header.SITE_AT, self.sites.words())
        table(Header.CLASS_SET_AT, self.classes.set_words())

        header |= self.lowered.entries | {
            Header.SIZE: Header.END + len(body),
            Header.REGISTERS: max(self.registers.next_free, self.registers.end),
            Header.CANVAS_WIDTH: checked.room.canvas[0],
            Header.CANVAS_HEIGHT: checked.room.canvas[1],
            Header.ENTITIES: len(checked.entities),
            Header.NPCS: sum(entity.role == "npc" for entity in checked.entities),
            Header.PRIMITIVES: len(checked.actions),
            Header.TEMPLATES: len(checked.templates),
            Header.NOUNS: len(checked.nouns),
            Header.CLASSES: self.classes.count,
            Header.HORIZON: checked.horizon,
            Header.FLAGS: self._flags(),
            Header.TOKENS: length,
            Header.LOG: log,
            Header.LOG_SIZE: log_size,
            Header.HEARD: heard,
            Header.HEARD_SIZE: heard_size,
            Header.INBOX: self.allocation.inbox,
            Header.INBOX_SIZE: self.allocation.inbox_size,
            Header.FRAMES: len(frames),
            Header.DEADLY: types.deadly,
            Header.MIN_WIDTH: checked.room.width[0],
            Header.MIN_HEIGHT: checked.room.height[0],
            Header.HEIGHTS: checked.room.height[1] - checked.room.height[0] + 1,
            Header.OUTSIDE: WALL_CELL,
            Header.INSTRUCTIONS: len(self.code.instructions),
            Header.LINES: len(lines.texts),
            Header.STATES: sum(len(frame.rows) for frame in frames),
            Header.SITES: len(self.sites.rows),
            Header.TYPE_ROWS: len(types.rows),
            Header.COUNTERS: len(rules) + len(checked.outcomes) + 3,
            Header.AGENT_SAYS: lines.agent_says,
            Header.SLOPE: checked.slope,
            Header.EACH_STEP: checked.each_step,
            Header.CLASS_SETS: len(self.classes.sets),
            Header.CLASS_SET_WORDS: self.classes.words_of_a_set,
            Header.CHANNELS: checked.channels,
        }
        words = np.array([*(header[word] for word in Header if word != Header.END), *body], dtype=np.int64)
        # Boards are sets of bits, so a word may use the sign bit.
        return Program(
            words=words.astype(np.uint64).astype(np.uint32).view(np.int32),
            name=checked.name,
            actions=checked.actions,
            templates=checked.templates,
            nouns=checked.nouns,
            entities=tuple(_entity_name(entity) for entity in checked.entities),
            registers=tuple(self.registers.names),
            lines=tuple(lines.texts),
            outcome_table=(
                *(Outcome(o.name, o.success, o.condition.span) for o in checked.outcomes),
                Outcome("deadly", False),
                Outcome("timeout", False),
            ),
            rules=rules,
            vocabulary=lines.vocabulary,
            source_map=tuple(self.code.spans),
            labels=dict(self.code.labels),
        )

    def _flags(self) -> int:
        checked = self.checked
        flags = {
            Flag.NPCS_HIDDEN: checked.npcs_hidden,
            Flag.PICTURE_BEFORE_NPCS: checked.picture_before_npcs,
            Flag.AGENT_FRAME: any(frame.entity == 0 for frame in checked.frames),
            Flag.OWN_VOICE: checked.own_voice,
            Flag.EGOCENTRIC: checked.egocentric,
            Flag.OCCLUSION: checked.room.occlusion,
            Flag.ROLLS: any(entity.type and entity.type.rolls for entity in checked.entities),
            Flag.HEARD_BY: self.classes.speakers_matter,
            Flag.SETTLE_ALWAYS: self.allocation.computed.settle_always,
        }
        return sum(flag for flag, on in flags.items() if on)

    def _frame_rows(self, frames: list[FrameCode]) -> list[int]:
        words = []
        first_row = 0
        for made, frame in zip(frames, self.checked.frames, strict=True):
            row = dict.fromkeys(FrameColumn, 0) | {
                FrameColumn.ENTITY: frame.entity,
                FrameColumn.STATE: self.registers.by_path[f"{frame.member}.frame"],
                FrameColumn.CLOCK: self.registers.by_path[f"{frame.member}.clock"],
                FrameColumn.ROWS: first_row,
                FrameColumn.STATES: len(state_names(frame)),
                FrameColumn.INBOX: self.allocation.inbox_of[frame.member],
                FrameColumn.PERCEIVE: made.perceive,
                FrameColumn.DEFERRED: made.deferred,
            }
            first_row += len(made.rows)
            words += [row[column] for column in FrameColumn if column != FrameColumn.COLUMNS]
        return words

    def _line_rows(self) -> list[int]:
        words = []
        first_token = 0
        lines = self.lines
        for tokens, number, noun in zip(lines.tokens, lines.classes, lines.nouns, strict=True):
            row = {
                LineColumn.FIRST_TOKEN: first_token,
                LineColumn.TOKENS: len(tokens),
                LineColumn.CLASS: number,
                LineColumn.NOUN: noun,
            }
            words += [row[column] for column in LineColumn if column != LineColumn.COLUMNS]
            first_token += len(tokens)
        return words


class _TypeTable:
    """One row for each status of each object type in the scenario, one for NPCs, one for the agent."""

    def __init__(self, checked: Checked) -> None:
        self.rows: list[list[int]] = []
        self.deadly = 0
        self.agent = self._add(code=EMPTY, status=0, toggled=0)
        self.npc = self._add(code=NPC, status=0, toggled=0, transparent=1)
        self._first: dict[ObjectType, int] = {}
        for kind in [
            *(e.type for e in checked.entities if e.type),
            *(kind for kind, _, _ in checked.room.build),
        ]:
            if kind not in self._first:
                self._first[kind] = self._object(kind)

    def _add(
        self,
        code: int,
        status: int,
        toggled: int,
        orientation: int = 0,
        walkable: int = 0,
        transparent: int = 0,
        pushed: int = 0,
        rolls: int = 0,
    ) -> int:
        row = {
            TypeColumn.CODE: code,
            TypeColumn.STATUS: status,
            TypeColumn.ORIENTATION: orientation,
            TypeColumn.WALKABLE: walkable,
            TypeColumn.TRANSPARENT: transparent,
            TypeColumn.TOGGLED: toggled,
            TypeColumn.PUSHED: pushed,
            TypeColumn.ROLLS: rolls,
        }
        self.rows.append([row[column] for column in TypeColumn if column != TypeColumn.COLUMNS])
        return len(self.rows) - 1

    def _object(self, kind: ObjectType) -> int:
        self.deadly |= int(kind.deadly) << kind.code
        rows = [
            self._add(
                code=kind.code,
                status=kind.shown.get(status, (status, 0))[0],
                orientation=kind.shown.get(status, (status, 0))[1],
                toggled=kind.toggled.get(status, status),
                walkable=int(status in kind.walkable),
                transparent=int(status in kind.transparent),
                pushed=kind.pushed.get(status, status),
                rolls=1 + kind.initial if status in kind.rolls else 0,
            )
            for status in range(len(kind.states))
        ]
        return rows[0]

    def of(self, entity: Entity) -> int:
        """First row of an entity's type."""
        if entity.type is not None:
            return self._first[entity.type]
        return self.npc if entity.role == "npc" else self.agent


def _entity_row(entity: Entity, types: _TypeTable) -> list[int]:
    row = {
        EntityColumn.TYPE: types.of(entity),
        EntityColumn.KIND: entity.kind_code,
        EntityColumn.NEAR: entity.near,
        EntityColumn.FAR: entity.far,
        EntityColumn.AUDIBLE: int(entity.audible),
        EntityColumn.VIEW: entity.view,
        EntityColumn.PUSHED_BY: int(entity.pushed_by_rolling),
    }
    return [row[column] for column in EntityColumn if column != EntityColumn.COLUMNS]


def _entity_name(entity: Entity) -> EntityName:
    kind = entity.type.name if entity.type else entity.kind
    states = entity.type.states if entity.type else ()
    return EntityName(entity.key, entity.index, entity.role, kind, states)


# -- room templates --------------------------------------------------------------------------------------------


EMPTY_CELL = pack_cell(EMPTY)
WALL_CELL = pack_cell(WALL, COLORS.index("grey"))


def room_templates(room: RoomPlan) -> list[int]:
    """The room table, row by row: sizes by width, then height."""
    (low_width, high_width), (low_height, high_height) = room.width, room.height
    return [
        word
        for width in range(low_width, high_width + 1)
        for height in range(low_height, high_height + 1)
        for word in _template(room, width, height)
    ]


def _template(room: RoomPlan, width: int, height: int) -> list[int]:
    columns, rows = room.canvas
    cells = [[EMPTY_CELL] * columns for _ in range(rows)]
    solid = [(1 << columns) - 1] * rows
    floor, opaque = [0] * rows, [0] * rows
    for x, y in product(range(width), range(height)):
        if x in (0, width - 1) or y in (0, height - 1):
            cells[y][x] = WALL_CELL
            opaque[y] |= 1 << x
        else:
            solid[y] &= ~(1 << x)
            floor[y] |= 1 << x
    for kind, region, _span in room.build:
        for x, y in interior_cells(region, (width, height)):
            _build(kind, x, y, cells, solid, floor, opaque)
    columns_too = [sum((row >> x & 1) << y for y, row in enumerate(opaque)) for x in range(columns)]
    return [*(cell for row in cells for cell in row), WALL_CELL, *solid, *floor, *opaque, *columns_too]


def _build(
    kind: ObjectType,
    x: int,
    y: int,
    cells: list[list[int]],
    solid: list[int],
    floor: list[int],
    opaque: list[int],
) -> None:
    shown = kind.shown.get(kind.initial, (kind.initial, 0))
    cells[y][x] = pack_cell(kind.code, kind.color, *shown)
    floor[y] &= ~(1 << x)
    for rows, here in (
        (solid, kind.initial not in kind.walkable),
        (opaque, kind.initial not in kind.transparent),
    ):
        rows[y] = rows[y] | 1 << x if here else rows[y] & ~(1 << x)
