"""Choices between values: what they are worth, and that they stay short."""

from __future__ import annotations

from typing import Any

import pytest

from socialai_dsl.compiler.folding import Classes, Facts, fold
from socialai_dsl.semantics.terms import (
    BOOL,
    Compare,
    Const,
    Logic,
    Not,
    Operation,
    Quantification,
    Select,
    Term,
    Type,
    Variable,
    World,
)
from tests.socialai_dsl.compiler.workbench import (
    DIE,
    NUMBER,
    code,
    compiled,
    number,
    with_let,
    workbench,
    worth,
)

TRUE, FALSE = Const(BOOL, 1), Const(BOOL, 0)


def is_(value: int) -> Compare:
    return Compare("==", DIE, number(value))


def select(*values: int | Term, default: int | Term, type_: Type = NUMBER) -> Select:
    terms = [number(value) if isinstance(value, int) else value for value in (*values, default)]
    return Select(type_, tuple(is_(i) for i in range(len(values))), tuple(terms[:-1]), terms[-1])


def die(term: Term) -> list[int]:
    """What a term is worth for each number of the die."""
    return [worth(term, {"let": {"die": value}}) for value in range(4)]


def length(term: Term) -> int:
    """How many instructions a term adds to the reset."""
    long = compiled(with_let(workbench(), "let.answer", term, BOOL if term.type.kind == "bool" else NUMBER))
    return len(code(long, "reset")) - len(code(compiled(workbench()), "reset"))


VALUES: list[tuple[Term, list[int]]] = [
    (select(7, 8, 9, default=10), [7, 8, 9, 10]),
    (select(5, 5, 9, default=5), [5, 5, 9, 5]),
    (select(0, 1, 2, default=3), [0, 1, 2, 3]),
    (select(4, default=6), [4, 6, 6, 6]),
    (select(World(NUMBER, "width"), 1, default=2), [7, 1, 2, 2]),
    (select(select(1, 2, default=3), select(1, 20, default=3), default=9), [1, 20, 9, 9]),
]


@pytest.mark.parametrize(("term", "expected"), VALUES)
def test_the_value_of_the_first_condition_that_holds(term: Term, expected: list[int]) -> None:
    assert die(term) == expected


def test_the_first_of_two_conditions_that_hold_counts() -> None:
    term = Select(NUMBER, (is_(1), Compare("<=", DIE, number(2))), (number(5), number(6)), number(7))
    assert die(term) == [6, 5, 6, 7]
    twice = Select(NUMBER, (is_(1), is_(1)), (number(5), number(6)), number(7))
    assert die(twice) == [7, 5, 7, 7]


def test_conditions() -> None:
    term = select(TRUE, FALSE, TRUE, default=FALSE, type_=BOOL)
    assert die(term) == [True, False, True, False]
    assert die(Not(term)) == [False, True, False, True]
    mixed = select(is_(0), Compare("<", DIE, number(1)), default=is_(3), type_=BOOL)
    assert die(mixed) == [True, False, False, True]
    assert die(Logic("or", (is_(1), is_(3)))) == [False, True, False, True]


def test_a_compared_choice_is_a_choice_of_truths() -> None:
    term = Compare("<", select(7, 8, 9, default=10), number(9))
    assert die(term) == [True, True, False, False]
    folded = fold(term, Facts(), Classes(workbench()))
    assert isinstance(folded, Select)
    assert folded.type == BOOL


def test_what_is_known_is_decided_before() -> None:
    classes = Classes(workbench())
    known = Select(NUMBER, (FALSE, is_(2), TRUE, is_(3)), tuple(map(number, (1, 2, 3, 4))), number(5))
    assert fold(known, Facts(), classes) == Select(NUMBER, (is_(2),), (number(2),), number(3))
    assert fold(Select(NUMBER, (TRUE,), (number(1),), number(5)), Facts(), classes) == number(1)
    assert fold(select(5, 5, default=5), Facts(), classes) == number(5)


def test_arithmetic_of_known_numbers_is_known() -> None:
    classes = Classes(workbench())

    def folded(op: Any, *args: int) -> Term:
        return fold(Operation(NUMBER, op, tuple(map(number, args))), Facts(), classes)

    known = {"+": 13, "-": 7, "*": 30, "//": 3, "%": 1, "min": 3, "max": 10}
    assert {op: folded(op, 10, 3) for op in known} == {op: number(value) for op, value in known.items()}
    assert (folded("//", -7, 2), folded("%", -7, 2)) == (number(-4), number(1)), "rounded down"
    assert (folded("//", 7, 0), folded("%", 7, 0)) == (number(0), number(0)), "as the engine divides"
    assert folded("+", 1, 2, 3) == number(6)
    assert isinstance(folded("*", 100, 100), Operation), "its type would cut it"


def test_what_a_group_makes_known_is_decided_for_each_of_it() -> None:
    """A table of what is known of each: 0, 1 and 4 of 2, 3 and 4."""
    place = Operation(NUMBER, "-", (Variable(NUMBER, "n"), number(2)))
    shares = Select(
        NUMBER, (Compare("==", place, number(1)),), (number(1),), Operation(NUMBER, "*", (place, place))
    )
    condition = Compare("==", DIE, shares)
    group = Quantification(BOOL, "any", "n", tuple(map(number, (2, 3, 4))), condition)
    expected = Logic("or", tuple(Compare("==", DIE, number(n)) for n in (0, 1, 4)))
    assert fold(group, Facts(), Classes(workbench())) == expected
    assert die(group) == [True, True, False, False]


def test_choices_are_short() -> None:
    # Test whether a layout gives the register, then write it: two instructions around what is measured.
    assert length(select(0, 1, 2, default=3)) == 4, "the register itself, cut to its type"
    assert length(select(5, 6, 7, default=8)) == 5, "the register and 5"
    two_of_four = select(TRUE, FALSE, TRUE, default=FALSE, type_=BOOL)
    assert length(two_of_four) == length(is_(1)), "one look at a set"
    assert length(Logic("or", (is_(1), is_(3)))) == length(is_(1))


def test_arithmetic_on_choices() -> None:
    term = Operation(NUMBER, "+", (select(1, 2, default=3), select(10, 20, default=30)))
    assert die(term) == [11, 22, 33, 33]
