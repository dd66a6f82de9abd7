"""Sequences that are drawn, memories that are compared with them, and performances."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.plans import Drawn

DANCE = {"dance": {"sequence": 2, "moves": ["left", "forward"], "utterance": {"chance": 0.25}}}


def drawn(checked):
    return {item.path: item.value for item in checked.setup if isinstance(item, Drawn)}


@pytest.mark.parametrize(
    ("expression", "said"),
    [
        ("attempt == 3", "S204 `attempt` is several acts in a row, `3` is not"),
        ("doors == attempt", "S204 `attempt` is several acts in a row, `doors` is not"),
        ("attempt == dence", "S201 unknown name `dence`; did you mean `dance` (let, line 40)?"),
        ("attempt < dance", "S204 `attempt` is a memory; it can only be compared with a sequence"),
        ("attempt == dance", "S106 `attempt` has 3 acts, `dance` has 2"),
    ],
)
def test_what_cannot_be_compared(mistakes, expression, said):
    found = mistakes(let={"exit": "pick(doors)", **DANCE}, memory={"attempt": {"last": 3}},
                     outcome=[{"success": expression}])  # fmt: skip
    assert [text.split(" (let")[0] for text in found] == [said.split(" (let")[0]]
