"""Choices among things and numbers, in groups that fit into a set of bits and in larger ones."""

from __future__ import annotations

from dataclasses import replace

import pytest

from socialai_dsl.semantics.plans import Assignment, RulePlan
from socialai_dsl.semantics.terms import (
    BOOL,
    Compare,
    Const,
    Logic,
    Operation,
    Quantification,
    Term,
    Type,
    Variable,
)
from tests.socialai_dsl.compiler.workbench import (
    NUMBER,
    SPAN,
    code,
    compiled,
    number,
    sited,
    start,
    step,
    with_let,
    workbench,
    worth,
    worths,
)

SIZES = [5, 32, 33, 62, 63, 200]
ITEM = Variable(NUMBER, "n")


def group(size: int) -> tuple[Const, ...]:
    """The numbers 10, 11, ... in a group of this size."""
    return tuple(Const(NUMBER, 10 + i) for i in range(size))


def remainder(value: int) -> Compare:
    return Compare("==", Operation(NUMBER, "%", (ITEM, number(4))), number(value))


@pytest.mark.parametrize("size", SIZES)
def test_count_first_any_and_all(size: int) -> None:
    numbers = range(10, 10 + size)
    odd = remainder(3)
    fit = [n for n in numbers if n % 4 == 3]
    assert worth(Quantification(NUMBER, "count", "n", group(size), odd)) == len(fit)
    assert worth(Quantification(NUMBER, "first", "n", group(size), odd)) == fit[0]
    assert worth(Quantification(BOOL, "any", "n", group(size), Compare("<", number(8 + size), ITEM))) is True
    assert worth(Quantification(BOOL, "all", "n", group(size), Compare("<", ITEM, number(9 + size)))) is False


@pytest.mark.parametrize("size", SIZES)
def test_a_pick_takes_every_one_that_fits_and_no_other(size: int) -> None:
    few = Logic("or", tuple(Compare("==", ITEM, number(n)) for n in (10, 12, 9 + size)))
    pick = Quantification(NUMBER, "pick", "n", group(size), few)
    assert set(worths(pick, range(30))) == {10, 12, 9 + size}


@pytest.mark.parametrize(
    ("first", "size", "instruction"),
    [
        (0, 2, "DRAW_OTHER"),
        (4, 5, "DRAW_OTHER"),
        (129, 127, "DRAW_OTHER"),
        (5, 1, "PICK_BIT"),
        (-1, 5, "PICK_BIT"),
        (252, 5, "PICK_BIT"),
        (1, 128, "DRAW"),
    ],
)
def test_a_pick_of_all_but_one_draws_what_any_pick_does(first: int, size: int, instruction: str) -> None:
    """One instruction where the numbers fit into it, and the same number as where the others are named."""
    numbers = range(first, first + size)
    items = tuple(Const(NUMBER, n) for n in numbers)
    for one in {first, first + size // 2, first + size - 1} if size < 9 else {first + size // 2}:
        but_one = Compare("!=", ITEM, Const(Type("int", one, one), one))
        pick = Quantification(NUMBER, "pick", "n", items, but_one)
        program = compiled(with_let(workbench(), "let.answer", pick))
        assert instruction in code(program, "reset")
        named = Logic("or", tuple(Compare("==", ITEM, number(n)) for n in numbers if n != one))
        if size > 1:
            same = Quantification(NUMBER, "pick", "n", items, named)
            drawn = worths(pick, range(12))
            assert drawn == worths(same, range(12))
            assert one not in drawn


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("op", ["first", "pick"])
def test_none_that_fits(size: int, op: str) -> None:
    nothing: Term = Quantification(NUMBER, op, "n", group(size), remainder(9))  # type: ignore[arg-type]
    assert worth(nothing) == 10, "a value of the reset takes the first"
    rule = RulePlan("law", "rules[0]", SPAN, sets=(Assignment("let.n", sited(nothing, "rules[0].set")),))
    env = start(replace(with_let(workbench(), "let.n", number(0), Type("int", 0, 300)), rules=(rule,)))
    step(env)
    assert env.counters()["rules"] == {"law": 0}
