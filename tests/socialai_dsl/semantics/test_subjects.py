"""A verb without its subject, or with the subject in its brackets: what is proposed works."""

from __future__ import annotations

from pathlib import Path

import pytest

from socialai_dsl.frontend import check

SCENARIO = """\
scenario: short
room: {size: 5}
grammar: {templates: [Hi]}
objects:
  gate: {type: door, place: wall(top)}
  lamp: {type: switch, place: wall(left)}
cast:
  ann: {}
  agent: {}
outcome:
  - success: CONDITION
"""


@pytest.mark.parametrize(
    ("condition", "cured"),
    [
        ("dir_to(gate) == up", "agent.dir_to(gate) == up"),
        ("dir_to(gate) == up and ann.x == 2", "ann.dir_to(gate) == up and ann.x == 2"),
        ("gate.x == 2 and next_to(gate)", "gate.x == 2 and agent.next_to(gate)"),
        ("distance(ann, gate) < 2", "ann.distance(gate) < 2"),
        ("dir_to(gate, agent) == up", "gate.dir_to(agent) == up"),
    ],
)
def test_what_is_proposed_works(tmp_path: Path, condition: str, cured: str) -> None:
    path = tmp_path / "short.yaml"
    path.write_text(SCENARIO.replace("CONDITION", condition), encoding="utf-8")
    result = check(path)
    (found,) = [d for d in result.diagnostics if d.code == "S211"]
    (source,) = (source for source in result.sources.values() if source.name == found.span.file)
    path.write_text(source.edited(found.edits), encoding="utf-8")
    assert path.read_text(encoding="utf-8") == SCENARIO.replace("CONDITION", cured)
    assert not check(path).has_errors
