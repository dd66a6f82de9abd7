"""What code begins with is done here where calling the interpreter would take longer than that."""

from socialai_dsl.engine.conditions import compares
from socialai_dsl.engine.jit import inline
from socialai_dsl.engine.operands import value
from socialai_dsl.engine.state import ZERO, Row
from socialai_dsl.program import Header, Op


@inline
def past_tests(row: Row, pc: int) -> int:
    """Where code goes on after the comparisons that it begins with; 0 if nothing is left to be done."""
    start = row.program[Header.CODE_AT]
    code = start + 4 * pc
    op = row.program[code]
    while op >= Op.IF_EQ and op <= Op.IF_LE:
        left = value(row, row.program[code + 1])
        right = value(row, row.program[code + 2])
        if not compares(op, left, right):
            code += 4 * row.program[code + 3]
        code += 4
        op = row.program[code]
    return ZERO if op == Op.HALT else (code - start) >> 2
