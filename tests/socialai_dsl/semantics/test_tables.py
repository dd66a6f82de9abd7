"""Tables: a value beside each key, as written or in an order that is drawn."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.plans import Drawn
from socialai_dsl.semantics.scope import spoken
from socialai_dsl.semantics.terms import Compare, Const, Select, walk

WORDS = {"red": "ana", "green": "bel", "blue": "ana", "purple": "bel", "yellow": "cor", "grey": "dol"}


@pytest.fixture
def value_of(meaning):
    """The term of a `let` beside some tables."""

    def value(expression, **tables):
        checked = meaning(
            tables={"dar": WORDS, **tables}, let={"looked_up": expression, "exit": "pick(doors)"}
        )
        drawn = {item.path: item.value.term for item in checked.setup if isinstance(item, Drawn)}
        return drawn["let.looked_up"]

    return value


def words_by_key(select):
    """What a chain of cases gives for each value that is compared."""
    given = {
        case.right.value: spoken(value.type, value.value)
        for case, value in zip(select.conditions, select.values, strict=True)
    }
    return given, spoken(select.default.type, select.default.value)


def test_a_known_key_is_its_value(value_of):
    found = value_of("dar(yellow)")
    assert isinstance(found, Const)
    assert spoken(found.type, found.value) == "cor"


def test_what_is_drawn_is_looked_up_among_all_that_it_can_be(value_of):
    found = value_of("dar(exit.color)")
    assert isinstance(found, Select)
    given, default = words_by_key(found)
    assert [*given.values(), default] == [*WORDS.values()]


def test_numbers_are_numbers(value_of):
    found = value_of("nums(exit.index) + 1", nums={"0": 7, "1": 3, "2": -4, "3": 0})
    assert (found.type.kind, found.type.low, found.type.high) == ("int", -3, 8)


def test_a_word_that_names_nothing_is_a_key(value_of):
    found = value_of("far(wonderland)", far={"wonderland": "rabbit"})
    assert spoken(found.type, found.value) == "rabbit"


def test_permuted_values_are_drawn_one_for_each_key(meaning):
    checked = meaning(tables={"dar": WORDS, "opa": "permuted(dar)"})
    drawn = [item for item in checked.setup if isinstance(item, Drawn) and item.path.startswith("tables.")]
    assert [item.path for item in drawn] == [f"tables.opa[{k}]" for k in range(6)]
    for k, item in enumerate(drawn):
        # The k-th place is taken by what none of those before it have.
        unequal = [part for part in walk(item) if isinstance(part, Compare) and part.op == "!="]
        assert len(unequal) == k


@pytest.mark.parametrize(
    ("expression", "code"),
    [
        ("dar(exit)", "S204"),
        ("dar(exit.open)", "S204"),
        ("dar(exit.index)", "S402"),
        ("dar(pink)", "S402"),
        ("dar", "S211"),
    ],
)
def test_what_cannot_be_looked_up(examine, expression, code):
    found = examine(tables={"dar": WORDS}, let={"exit": "pick(doors)", "looked_up": expression}).diagnostics
    assert [d.code for d in found] == [code]


def test_a_table_that_nobody_uses_is_looked_at(examine):
    (found,) = examine(tables={"dar": "permuted(opa)"}).diagnostics
    assert (found.code, found.message) == ("S201", "`opa` is not a table that is written out")
