"""Cells that are asked for need not be on the canvas."""

from __future__ import annotations

import pytest

from socialai_dsl.program import CELL, Body, Op, Register
from tests.assembly import constant, holds, result_of

AGENT = (2, 2)
ROOM = {"at": (AGENT, (1, 1)), "npcs": 1}


def cell(x: int, y: int) -> int:
    """The operand that stands for a cell."""
    return constant(CELL + 32 * y + x)


@pytest.mark.parametrize("canvas", [(6, 7), (9, 9)])
@pytest.mark.parametrize("target", [(31, 2), (2, 31), (9, 8)])
def test_no_way_leads_off_the_canvas(canvas: tuple[int, int], target: tuple[int, int]) -> None:
    room = {**ROOM, "canvas": canvas}
    for op in (Op.GO_TO, Op.GO_NEXT_TO):
        assert result_of([(op, constant(1), cell(*target), 0)], Register.LAST_TURN, **room) == Body.NONE
    assert not holds((Op.IF_REACHES, constant(1), cell(*target)), **room)
