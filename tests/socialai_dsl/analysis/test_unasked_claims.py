"""Claims about what a patch fixed or took away: nothing asks them, and nothing is kept from playing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import socialai_dsl
from socialai_dsl.analysis.check import check_scenario, scenarios_of
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.reports import Verdict
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.frontend import check
from socialai_dsl.studio.judging import judge_claims

BASE = """\
scenario: asking
params: {which: {default: drawn, values: {drawn: pick(doors), fixed: first(doors)}}}
room: {size: 5}
actions: [left, right, forward]
horizon: 6
grammar: {templates: [Where is the exit]}
objects:
  doors: {type: door, count: 4, place: each_wall(2), color: distinct}
let:
  exit: $which
frames:
  answer: {states: {waiting: {then: [{hears: Where is the exit, say: The <exit.color> door, goto: done}]}, done: {}}}
  own: {states: {s: {do: go_next_to(exit), then: [{after: 3, goto: tired}]}, tired: {}}}
rivals:
  idle: {states: {s: {}}}
cast:
  porter: {frame: answer}
  agent: {frame: own}
outcome:
  - {success: agent.next_to(exit), id: out}
check:
  - {reachable: agent.is(tired)}
  - {only_through: {draw: exit, by: [porter]}}
"""
FIXED = "`exit` is no free choice of several values"
TIRED, EXIT = "reachable: agent.is(tired)", "only_through: exit by porter"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "asking.yaml").write_text(BASE, encoding="utf-8")
    return tmp_path


def unasked(name: str) -> dict[str, str]:
    (case,) = scenarios_of(name)
    return {plan.text: plan.unasked for plan in case.loaded.checked.properties}


@pytest.mark.parametrize(
    ("patch", "found"),
    [
        ("set: {let.exit: first(doors)}", {TIRED: "", EXIT: FIXED}),
        ("remove: [cast.porter, frames.answer]", {TIRED: "", EXIT: "`porter` is no NPC of the cast"}),
    ],
)
def test_a_variant_may_take_away_what_a_claim_asks_about(
    folder: Path, patch: str, found: dict[str, str]
) -> None:
    (folder / "asking_changed.yaml").write_text(
        f"variant: changed\nof: asking.yaml\n{patch}\n", encoding="utf-8"
    )
    assert unasked(f"{folder}/asking+changed") == found
    assert not [d for d in check(f"{folder}/asking+changed").diagnostics if d.code.startswith("S")]


def test_a_parameter_and_a_rival_may_take_it_away_too(folder: Path) -> None:
    assert unasked(f"{folder}/asking") == {TIRED: "", EXIT: ""}
    assert unasked(f"{folder}/asking?which=fixed") == {TIRED: "", EXIT: FIXED}
    (tired, exit_) = unasked(f"{folder}/asking+idle").values()
    assert ("no state `tired`" in tired, exit_) == (True, "")
    assert not check(f"{folder}/asking").has_errors, (
        "every value and rival is tried where the file is validated"
    )


def test_a_claim_that_the_patch_wrote_is_a_mistake(folder: Path) -> None:
    text = "variant: wrong\nof: asking.yaml\nset: {'check[1].only_through.by': [nobody]}\n"
    (folder / "asking_wrong.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"asking_wrong.yaml:3(?s:.*)`nobody` is no NPC"):
        socialai_dsl.load(f"{folder}/asking+wrong")


def test_what_is_wrong_as_written_stays_a_mistake(folder: Path) -> None:
    (folder / "asking.yaml").write_text(BASE.replace("default: drawn", "default: fixed"), encoding="utf-8")
    with pytest.raises(ScenarioError, match=FIXED):
        socialai_dsl.load(f"{folder}/asking")


def test_members_of_a_suite_are_checked_as_the_suite_changes_them(folder: Path) -> None:
    members = "[{scenario: asking.yaml, name: fixed, set: {let.exit: first(doors)}}, asking.yaml]"
    (folder / "both.yaml").write_text(f"suite: both\nmembers: {members}\n", encoding="utf-8")
    found = {}
    for case in scenarios_of(f"{folder}/both.yaml"):
        report = check_scenario(case.loaded, case.called, Effort(4), script=case.script, named=case.named)
        found[case.called] = {plan.text: one.verdict for plan, one in report.tried}
        assert all("not asked" in line for line in report.lines() if FIXED in line)
        assert not any("time for 0" in line for line in report.lines())
        # A member that the suite changed has no name that a command would play.
        assert ("to see it" in "".join(report.lines())) <= case.named
    assert found["fixed"][EXIT] is Verdict.UNASKED
    assert found["asking"][EXIT] is not Verdict.UNASKED
    path = folder / "both.yaml"
    claims = judge_claims(str(path), path.read_text(encoding="utf-8"))["claims"]
    assert [one["verdict"] for one in claims if one["claim"] == f"fixed: {EXIT}"] == ["not asked"]
    assert [one["verdict"] != "not asked" for one in claims if one["claim"] == f"asking: {EXIT}"] == [True]
    # And it is played, though its sentences have no slots.
    envs = socialai_dsl.make_vec(path, 8)
    envs.reset(seed=0)
    envs.step(np.array([envs.single_action_space.sample() for _ in range(8)]))


def test_the_script_of_a_changed_member_plays_that_member(folder: Path) -> None:
    """What a suite changes is changed where the script is looked for, too."""
    text = BASE.replace("  agent: {frame: own}", "  agent: {}").replace(f"  - {{{TIRED}}}\n", "")
    (folder / "asking.yaml").write_text(text, encoding="utf-8")
    (folder / "asking_oracle.yaml").write_text(
        "variant: oracle\nof: asking.yaml\nset: {cast.agent.frame: own}\n", encoding="utf-8"
    )
    members = "[{scenario: asking.yaml, name: large, set: {room.size: 9}}]"
    (folder / "both.yaml").write_text(f"suite: both\nmembers: {members}\n", encoding="utf-8")
    (case,) = scenarios_of(f"{folder}/both.yaml")
    assert case.script is not None
    assert case.script.scenario.room == case.loaded.scenario.room
    assert case.script.scenario.room != socialai_dsl.load(f"{folder}/asking").scenario.room  # type: ignore[union-attr]
