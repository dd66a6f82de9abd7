"""A program as text: one instruction a line, with the place in the scenario file it comes from."""

from __future__ import annotations

from socialai_dsl.program import (
    BODY_WORDS,
    CELL,
    CONSTANT,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    TEMPORARY,
    TESTS,
    Field,
    FrameColumn,
    Header,
    Op,
    Program,
    Register,
)

_ENTITIES = frozenset({*range(Op.IF_SAME_CELL, Op.IF_UNOBSTRUCTED + 1), Op.GO_TO, Op.GO_NEXT_TO, Op.FACE})
_FIRST_IS_ENTITY = _ENTITIES | {
    Op.PUT,
    Op.SAY,
    Op.TURN_TO,
    Op.POINT,
    Op.BECOME,
    Op.VANISH,
    Op.SET_FIELD,
    Op.PLACE,
}
_SECOND_IS_ENTITY = _ENTITIES | {
    Op.FIELD,
    Op.DISTANCE,
    Op.NEAREST,
    Op.QUADRANT,
    Op.SEES,
    Op.CELL_OF,
    Op.CELL_BESIDE,
    Op.PLACE,
    Op.B_NEXT_TO,
    Op.B_IN_FRONT_OF,
}
_THIRD_IS_ENTITY = frozenset({Op.DISTANCE, Op.QUADRANT, Op.SEES, Op.NEAREST_CELL})
_LITERALS: dict[Op, tuple[int, ...]] = {
    Op.IF_UNPINNED: (),
    Op.IF_CHANCE: (0, 1),
    Op.IF_HEARD: (1,),
    Op.FIELD: (2,),
    Op.NEAREST: (2,),
    Op.DRAW: (2,),
    Op.DRAW_OTHER: (2,),
    Op.PICK_BIT: (2,),
    Op.SET_FIELD: (1,),
    Op.GOTO: (0, 1),
    Op.COUNT: (0,),
    Op.ANSWER: (0, 2),
    Op.END: (0, 1),
    Op.END_GRADED: (0,),
    **dict.fromkeys((Op.HEARD_FROM, Op.HEARD_NOUN), (1, 2)),
    Op.CHOOSE: (0, 1, 2),
    Op.TURN_TO: (2,),
    Op.GO_TO: (2,),
    Op.GO_NEXT_TO: (2,),
    Op.FACE: (2,),
    Op.PICK_CELL: (1, 2),
    **dict.fromkeys((Op.FIRST_CELL, Op.NEAREST_CELL, Op.B_COUNT), (1,)),
    **dict.fromkeys(map(Op, range(Op.B_FLOOR, Op.B_FREE + 1)), (0,)),
    Op.B_WALL: (0, 1, 2),
    **dict.fromkeys((Op.B_AND, Op.B_OR, Op.B_WITHOUT, Op.B_COPY), (0, 1)),
    Op.EACH_CELL: (0,),
    Op.DRAW_ROOM: (0,),
}
_ENTRIES = {
    Header.RESET_PC: "reset",
    Header.REQUIRE_PC: "require",
    Header.BEFORE_PC: "before",
    Header.LINKS_PC: "links",
    Header.SETTLE_PC: "settle",
    Header.RULES_PC: "rules",
    Header.TICK_PC: "tick",
}


def listing(program: Program) -> str:
    """The sizes, then the code with a heading for each block, then lines, outcomes and vocabulary."""
    return "\n".join([*_head(program), "", *_code(program), "", *_tables(program)]) + "\n"


def _head(program: Program) -> list[str]:
    h = program.header
    return [
        f"program {program.name}",
        f"  {h(Header.SIZE)} words, {h(Header.REGISTERS)} registers, {h(Header.INSTRUCTIONS)} instructions, "
        f"{h(Header.CLASSES)} utterance classes, {h(Header.LINES)} lines, history of {h(Header.TOKENS)} tokens",
        f"  canvas {h(Header.CANVAS_WIDTH)}x{h(Header.CANVAS_HEIGHT)}, horizon {h(Header.HORIZON)}",
        "  " + ", ".join(f"{name} at {h(word)}" for word, name in _ENTRIES.items() if h(word)),
    ]


def _code(program: Program) -> list[str]:
    names = _Names(program)
    rows = []
    for pc, ((op, *operands), span) in enumerate(zip(program.code.tolist(), program.source_map, strict=True)):
        if pc in program.labels:
            rows += ["", f"{program.labels[pc]}:"]
        text = f"{pc:5d}  {Op(op).name:<16}{names.operands(Op(op), pc, operands)}"
        place = f"{_short(span.file)}:{span.line}" if span else ""
        rows.append(f"{text:<66}  {place}".rstrip())
    return rows


def _short(file: str) -> str:
    return file.rsplit("/", 1)[-1]


def _tables(program: Program) -> list[str]:
    return [
        "frames:",
        *_frames(program),
        "lines:",
        *(f"{number:5d}  {text}" for number, text in enumerate(program.lines)),
        "outcomes:",
        *(f"{number:5d}  {name}" for number, name in enumerate(program.outcomes)),
        "vocabulary:",
        "       " + " ".join(program.vocabulary),
    ]


def _frames(program: Program) -> list[str]:
    """Each state with the addresses of its activity, its `first` and its `then`, by class of utterance heard."""
    h, words = program.header, program.words
    classes = h(Header.CLASSES) + 1
    rows = []
    for number in range(h(Header.FRAMES)):
        at = h(Header.FRAME_AT) + FrameColumn.COLUMNS * number
        entity, first, count = (
            int(words[at + column]) for column in (FrameColumn.ENTITY, FrameColumn.ROWS, FrameColumn.STATES)
        )
        shared = {"perceive": FrameColumn.PERCEIVE, "deferred": FrameColumn.DEFERRED}
        rows += [
            f"       {program.entities[entity]}: {name} {int(words[at + column])}"
            for name, column in shared.items()
            if words[at + column]
        ]
        register = next(n for n in program.registers if n.register == int(words[at + FrameColumn.STATE]))
        for k in range(count):
            row = h(Header.STATE_AT) + (first + k) * (1 + 2 * classes)
            activity, *rest = (int(word) for word in words[row : row + 1 + 2 * classes])
            rows.append(
                f"       {program.entities[entity]}.{register.values[k]}: do {activity}, "
                f"first {rest[:classes]}, then {rest[classes:]}"
            )
    return rows


class _Names:
    """Operands in the scenario's own words."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.registers = {int(register): register.name.lower() for register in Register}
        for number, entity in enumerate(program.entities):
            for field in Field:
                self.registers[FIRST_ENTITY + ENTITY_FIELDS * number + field] = (
                    f"{entity}.{field.name.lower()}"
                )
        self.registers |= {name.register: name.path for name in program.registers}

    def operands(self, op: Op, pc: int, words: list[int]) -> str:
        """The operands of one instruction; skips as the address they lead to."""
        if op in (Op.HALT, Op.DROP_CELL, Op.END_EACH):
            return ""
        skip = op in TESTS or op in (Op.SKIP, Op.EACH_CELL)
        shown = (
            []
            if op == Op.SKIP
            else [self._operand(op, i, word, words[1]) for i, word in enumerate(words[: 2 if skip else 3])]
        )
        while shown and shown[-1] == "0" and len(shown) > _least_operands(op):
            shown.pop()
        if skip:
            shown.append(f"-> {pc + 1 + words[2]}")
        return ", ".join(shown)

    def _operand(self, op: Op, position: int, word: int, count: int) -> str:
        if op == Op.COUNT:
            return self.program.rules[word] if position == 0 else "0"
        if op == Op.ANSWER and position != 1:
            return self.program.rules[word] if position == 0 else _goal(word)
        if op == Op.NEAREST and position == 2:
            return f"{self._place(word >> 8)}..{self._place(word & 255)}"
        if op == Op.DRAW_OTHER and position == 2:
            return f"{word >> 16 & 255}..{(word >> 16 & 255) + (word >> 24) - 1}, {word & 65535}"
        if op in (Op.END, Op.END_GRADED) and position == 0:
            return self.program.outcomes[word]
        if op == Op.CHOOSE and position == 0:
            return "|".join(BODY_WORDS[word >> 4 * k & 15] for k in range(count))
        if position in _LITERALS.get(op, ()):
            return Field(word).name.lower() if op in (Op.FIELD, Op.SET_FIELD) else str(word)
        if word >= CONSTANT // 2:
            value = word - CONSTANT
            entity = (op in _FIRST_IS_ENTITY, op in _SECOND_IS_ENTITY, op in _THIRD_IS_ENTITY)[position]
            return self._place(value) if entity else f"#{value}"
        if word >= TEMPORARY:
            return f"%{word - TEMPORARY}"
        if word == 0 and position >= _least_operands(op):
            return "0"
        return self.registers.get(word, f"r{word}")

    def _place(self, number: int) -> str:
        """An entity by its name, a cell by its coordinates."""
        if number < CELL:
            return str(self.program.entities[number])
        return f"({(number - CELL) % 32}, {(number - CELL) // 32})"


def _goal(word: int) -> str:
    """Where an answer goes: frame and state, as a GOTO shows them."""
    return f"{word >> 8}, {(word & 255) - 1}" if word else "0"


def _least_operands(op: Op) -> int:
    one = (Op.COUNT, Op.BODY, Op.VANISH, Op.REWARD, Op.IF_UNPINNED, Op.B_FLOOR, Op.B_FREE, Op.DRAW_ROOM)
    three = (
        *range(Op.ADD, Op.ABS),
        Op.FIELD,
        Op.DISTANCE,
        Op.NEAREST,
        Op.QUADRANT,
        Op.DRAW,
        Op.DRAW_OTHER,
        Op.PICK_BIT,
        Op.SEES,
        Op.NEAREST_CELL,
        Op.SET_FIELD,
        Op.CELL_BESIDE,
        Op.HEARD_FROM,
        Op.HEARD_NOUN,
    )
    return 1 if op in one else 3 if op in three else 2
