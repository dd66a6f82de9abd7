"""A program as text: one instruction a line, with the place in the scenario file it comes from."""

from __future__ import annotations

from socialai_dsl.program import (
    BODY_WORDS,
    CELL,
    CONSTANT,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    TEMPORARY,
    Field,
    FrameColumn,
    Header,
    Op,
    Program,
    Register,
)
from socialai_dsl.program.instructions import TABLE, Kind, OpClass, Operand

_AS_WRITTEN = frozenset((Kind.LITERAL, Kind.SITE, Kind.BOARD, Kind.FILLED, Kind.CHANGED))
"""Operands whose word is shown as it is."""

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
        entry = TABLE[op]
        shown = [
            self._operand(op, position, word, words[1])
            for position, word in enumerate(words)
            if entry.operands[position].kind not in (Kind.UNUSED, Kind.SKIP)
        ]
        if entry.skips:
            shown.append(f"-> {pc + 1 + words[2]}")
        return ", ".join(shown)

    def _operand(self, op: Op, position: int, word: int, count: int) -> str:
        operand = TABLE[op].operands[position]
        match operand.meaning:
            case "rule":
                return self.program.rules[word]
            case "outcome":
                return self.program.outcomes[word]
            case "goal":
                return _goal(word)
            case "field":
                return Field(word).name.lower()
            case "first and last entity":
                return f"{self._place(word >> 8)}..{self._place(word & 255)}"
            case "packed":
                return f"{word >> 16 & 255}..{(word >> 16 & 255) + (word >> 24) - 1}, {word & 65535}"
            case "actions":
                return "|".join(BODY_WORDS[word >> 4 * k & 15] for k in range(count))
        if operand.kind in _AS_WRITTEN:
            return str(word)
        if word >= CONSTANT // 2:
            value = word - CONSTANT
            is_place = operand.kind in (Kind.ENTITY, Kind.PLACE)
            return self._place(value) if is_place else f"#{value}"
        if word >= TEMPORARY:
            return f"%{word - TEMPORARY}"
        return self.registers.get(word, f"r{word}")

    def _place(self, number: int) -> str:
        """An entity by its name, a cell by its coordinates."""
        if number < CELL:
            return str(self.program.entities[number])
        return f"({(number - CELL) % 32}, {(number - CELL) // 32})"


def _goal(word: int) -> str:
    """Where an answer goes: frame and state, as a GOTO shows them."""
    return f"{word >> 8}, {(word & 255) - 1}" if word else "0"


def instructions_page() -> str:
    """The page of the documentation that lists all instructions."""
    rows = [
        "# Instructions",
        "",
        "What a compiled scenario is made of: `socialai show FILE --program` prints a program with these instructions,",
        "and [constructs](constructs.md) says what becomes which. An instruction is four words, an op and its operands",
        "a, b, c; v(x) is the value of an operand: a constant, a register, or a temporary. This page is made from the",
        "table in `socialai_dsl/program/instructions.py`, with which programs are checked before they run.",
    ]
    for op_class in OpClass:
        rows += ["", f"## {_CLASSES[op_class][0]}", "", _CLASSES[op_class][1], ""]
        rows += ["| op | number | a | b | c | |", "|---|---|---|---|---|---|"]
        for entry in TABLE.values():
            if entry.op_class is op_class:
                operands = " | ".join(map(_described, entry.operands))
                says = entry.says + (" Reset code only." if entry.setup else "")
                rows.append(
                    f"| `{entry.op.name}` | {int(entry.op)} | {operands} | {says} |".replace("|  |", "| |")
                )
    return "\n".join(rows) + "\n"


_CLASSES = {
    OpClass.CONTROL: (
        "Control",
        "Where code goes on. Nothing ever jumps backward but the loop over the cells of a board.",
    ),
    OpClass.TEST: (
        "Tests",
        "Code goes on with the next instruction if they hold, else c instructions later. A test of places is false "
        "unless both are in the room.",
    ),
    OpClass.VALUE: ("Values", "They compute a number and write it to a."),
    OpClass.EFFECT: ("Effects", "They change the world, what is said, or how the episode ends."),
    OpClass.ACTIVITY: ("Activities", "They choose the body action of the entity on turn."),
    OpClass.BOARD: ("Boards", "Sets of cells, what is found in them, and the room that a reset makes."),
}


def _described(operand: Operand) -> str:
    if operand.kind is Kind.UNUSED:
        return ""
    return operand.meaning if operand.kind is Kind.LITERAL else operand.kind.value
