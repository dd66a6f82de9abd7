"""The tests that stand in files beside the shipped scenarios: all pass, and each scenario has some."""

from functools import cache
from pathlib import Path

import pytest

from socialai_dsl.evaluation.scenario_tests import PlayedTest, play_tests
from socialai_dsl.frontend import check
from socialai_dsl.loader.resolved import TESTS
from tests.scenarios.playing import BEYOND

SCENARIOS = Path(__file__).parents[1] / "scenarios"
FILES = sorted(SCENARIOS.rglob(f"*{TESTS}"))
PAPER = [
    *("talkitout", "talkitout_no_liar", "dance", "cointhief", "diverse_exit", "showme", "showme_no_social"),
    *("help", "help_as_helper"),
]


def name_of(path: Path) -> str:
    return path.relative_to(SCENARIOS).as_posix().removesuffix(TESTS)


@cache
def played(path: Path) -> list[PlayedTest]:
    return play_tests([str(path)])


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_shipped_tests_pass(path: Path) -> None:
    assert [str(finding) for one in played(path) for finding in one.outcome.diagnostics] == []


def test_every_scenario_of_the_paper_and_beyond_has_tests_of_a_success_and_of_something_else() -> None:
    ends = {name_of(path): {one.plan.ends[0] for one in played(path) if one.plan.ends} for path in FILES}
    for name in (*PAPER, *BEYOND):
        assert "success" in ends[name], name
        assert ends[name] - {"success"}, name


@pytest.mark.parametrize("number", range(12))
def test_every_teacher_has_a_right_and_a_wrong_introduction(number: int) -> None:
    heard = {}
    (scenario, *_) = check(SCENARIOS / f"diverse_exit{TESTS}").tested
    for plan in scenario.loaded.checked.tests:
        if plan.name.startswith(f"teacher_{number:02}_"):
            assert isinstance(plan.room.layout, dict)
            assert plan.room.layout["one_of"] == {"teacher": f"teacher_{number:02}"}
            heard[plan.name.rpartition("_")[2]] = {
                line.pieces for step in plan.steps for line in step.hears or ()
            }
    assert len(heard["right"]) == 1
    assert heard["wrong"] == set()
