"""Tables: a value beside each key, as written or in an order that is drawn."""

from __future__ import annotations

import pytest

WORDS = {"red": "ana", "green": "bel", "blue": "ana", "purple": "bel", "yellow": "cor", "grey": "dol"}


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
