"""Analyses stop when their time is over, whatever they are doing."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from socialai_dsl.analysis import advance as advancing
from socialai_dsl.analysis import effort
from socialai_dsl.analysis.advance import advance, begin
from socialai_dsl.analysis.check import check_scenario, scenarios_of
from socialai_dsl.analysis.effort import Clock, Effort, OutOfTimeError
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
from socialai_dsl.envs.table import Table

# Nobody ever succeeds, and nothing ends before the horizon, the script neither.
ENDLESS = """
scenario: endless
horizon: 10000
earshot: room
grammar: {templates: [Hello <noun>], nouns: [there]}
room: {size: 9}
state: {n: {start: 0, range: 0..9999}}
let: {d: pick(1..4)}
frames:
  solve: {states: {s: {do: wander}}}
  tell: {states: {s: {do: wander, then: [{chance: 0.1, say: "Number <d>"}]}}}
cast:
  ada: {frame: tell}
  agent: {frame: solve}
rules: [{when: t > 0, set: {n: n + 1}}]
outcome: [{success: agent.next_to(ada) and n > 9990}]
check:
  - {oracle: 1.0}
  - {reachable: success}
  - {within: 10000}
  - {never: agent.at(ada)}
  - {needs: ada}
  - {only_through: {draw: d, by: ada}}
  - {script: perceives}
"""


@pytest.fixture
def endless(tmp_path: Path) -> Any:
    (tmp_path / "endless.yaml").write_text(ENDLESS, encoding="utf-8")
    (case,) = scenarios_of(str(tmp_path / "endless.yaml"))
    return case.loaded, case.called


def test_a_check_ends_with_its_time(endless: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a clock that goes on by a hundredth of a second whenever it is looked at."""
    now, steps, step = count(), count(), Batch.step

    def counted(self: Batch, task: Task, *more: Any) -> int:
        next(steps)
        return step(self, task, *more)

    monkeypatch.setattr(effort, "time", SimpleNamespace(monotonic=lambda: next(now) / 100))
    monkeypatch.setattr(Batch, "step", counted)
    report = check_scenario(*endless, Effort(3, clock=Clock(10)), deep=True)
    assert next(steps) < 3_000, "an episode has 10,000 steps"
    assert next(now) < 100 * 12, "the time was looked at much later than it was over"
    assert report.complete
    assert {finding.code for finding in report.findings()} <= {"W802"}, "nothing is known to fail"


def table_of(endless: Any, rows: int) -> Table:
    table = Table([compile_loaded(endless[0])], rows)
    begin(table, 5, None)
    table.batch.ports.actions[:] = 0
    return table


def test_portions_come_to_the_same(endless: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    at_once, portions = table_of(endless, 40), table_of(endless, 40)
    monkeypatch.setattr(advancing, "_FIRST", 3)
    monkeypatch.setattr(advancing, "_PORTION", 0.0)
    for _ in range(4):
        at_once.batch.step(Task.STEP_ONLY)
        advance(portions)
    begin(portions, 5, None)
    at_once.reset(5, None)
    for mine, other in zip(at_once.state, portions.state, strict=True):
        np.testing.assert_array_equal(mine, other)


def test_what_cannot_be_done_is_told_at_once(endless: Any) -> None:
    table = table_of(endless, 4)
    table.batch.ports.actions[2, 0] = 99
    with pytest.raises(ValueError, match=r"got the action \[99, 0, 0, 0\] in row 2"):
        advance(table)


def test_no_step_is_made_when_the_time_is_over(endless: Any) -> None:
    table = table_of(endless, 4)
    before = table.state.registers.copy()
    with Clock(0).limiting(), pytest.raises(OutOfTimeError):
        advance(table)
    np.testing.assert_array_equal(table.state.registers, before)
