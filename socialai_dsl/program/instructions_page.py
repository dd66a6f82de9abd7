"""The page of the documentation that lists all instructions, made from their table."""

from __future__ import annotations

from socialai_dsl.program.instructions import TABLE, Kind, OpClass, Operand


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
