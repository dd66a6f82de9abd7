"""What an outcome asks is known in part from what the agent does: only the rest is asked, or nothing at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from socialai_dsl.frontend import load
from socialai_dsl.program import Body, Header
from tests.agreement import Pair
from tests.tiny import Folder

BOXES = """
objects:
  near: {type: box, at: [3, 1]}
  far: {type: box, at: [3, 5]}
cast: {agent: {at: [2, 1], facing: right}}
"""
ALL = frozenset(range(Body.NONE + 1))


@pytest.mark.parametrize(
    ("condition", "asked"),
    [
        pytest.param("near.toggled_by(agent)", {Body.TOGGLE}, id="what it toggles"),
        pytest.param("near.opened or far.toggled_by(agent)", ALL, id="or something else"),
        pytest.param(
            "not near.toggled_by(agent) and agent.did(forward)", {Body.FORWARD}, id="what it does not"
        ),
        pytest.param("t > 5 and agent.did(left)", {Body.LEFT}, id="what it does"),
        pytest.param(
            "not first(b in near | far where b.opened).toggled_by(agent)", ALL, id="what there may not be"
        ),
    ],
)
def test_outcomes_are_asked_after_the_actions_that_may_bring_them(
    tmp_path: Path, condition: str, asked: set[Body]
) -> None:
    source = f"{BOXES}outcome: [{{success: {condition}}}]"
    both = Pair.of(load(str(Folder(tmp_path).write("tiny", source))), number_words=False)
    program = both.env.program
    first = program.header(Header.OUTCOME_AT)
    table = program.words[first : first + 8 * program.header(Header.CLASSES)].reshape(-1, 8)
    assert [set(map(int, row.nonzero()[0])) for row in table] == [asked] * len(table)
    for words in (
        ("left", "left", "forward"),
        ("toggle", None, "toggle"),
        (None, "toggle", "right", "forward"),
    ):
        both.reset(seed=0)
        for word in words:
            if both.step(tuple(map(int, both.env.encode_action((word, None))))):  # type: ignore[arg-type]
                break
