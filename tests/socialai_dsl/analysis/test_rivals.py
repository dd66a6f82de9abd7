"""Rivals: strategies that lack a skill, written in the scenario's file and played by the agent."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import socialai_dsl
from socialai_dsl.analysis.check import check_scenario
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.reports import Verdict
from socialai_dsl.frontend import check, load, rival_of

HIDDEN = """scenario: hidden
horizon: 20
actions: [left, right, forward]
grammar: {templates: [It is <noun>], nouns: [red, blue]}
room: {size: 7}
objects:
  boxes: {type: box, count: 2, color: [red, blue], place: row(1)}
let: {prize: pick(boxes)}
define: {first_box: first(b in boxes where b.index == 0)}
frames:
  tell: {states: {waiting: {then: [{when: t == 2, say: It is <prize.color>}]}}}
cast:
  ann: {name: Ann, frame: tell, earshot: room}
  agent: {place: row(5)}
outcome:
  - {success: agent.said("It is <prize.color>"), id: told}
  - failure: agent.spoke
"""
RIVALS = """
rivals:
  always_red: {steps: [{say: It is <first_box.color>}]}
  knows: {steps: [{say: It is <prize.color>}]}
"""


def written(tmp_path: Path, text: str) -> str:
    """A scenario's file."""
    path = tmp_path / "hidden.yaml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_rivals_and_claims_about_them_change_nothing_that_is_played(tmp_path: Path) -> None:
    plain = socialai_dsl.compile(load(written(tmp_path, HIDDEN)))
    claims = RIVALS + "check:\n  - {rival: always_red, at_most: 0.7}\n"
    other = socialai_dsl.compile(load(written(tmp_path, HIDDEN + claims)))
    assert (plain.words == other.words).all()
    assert plain.lines == other.lines


def test_a_rival_is_a_variant_of_which_the_agent_follows_that_frame(tmp_path: Path) -> None:
    path = written(tmp_path, HIDDEN + RIVALS)
    asked, made = load(f"{path}+knows"), rival_of(load(path), "knows")
    assert asked.name == made.name == "hidden+knows"
    assert (socialai_dsl.compile(asked).words == socialai_dsl.compile(made).words).all()
    result = socialai_dsl.evaluate("oracle", f"{path}+knows", episodes=20)
    assert result.result.success_rate == 1.0


def test_a_claim_holds_where_the_rival_fails_often_enough_and_fails_where_it_does_not(tmp_path: Path) -> None:
    claims = "check:\n  - {rival: always_red, at_most: 0.7}\n  - {rival: knows, at_most: 0.7}\n"
    path = written(tmp_path, HIDDEN + RIVALS + claims)
    report = check_scenario(load(path), path, Effort(5), deep=True)
    verdicts = {plan.rival: found.verdict for plan, found in report.tried if plan.rival}
    assert verdicts == {"always_red": Verdict.HOLDS, "knows": Verdict.FAILS}
    assert report.depth is not None
    assert report.depth.rivals["knows"] == 1.0
    assert any("the rival `always_red` solves" in line for line in report.lines())


def test_a_success_without_the_agent_says_nothing_of_a_rival(tmp_path: Path) -> None:
    text = HIDDEN.replace('agent.said("It is <prize.color>")', "t == 3")
    path = written(tmp_path, text + RIVALS + "check:\n  - {rival: always_red, at_most: 0.7}\n")
    (_, found), *_ = check_scenario(load(path), path, Effort(5)).tried
    assert found.verdict is Verdict.FAILS
    assert "no room tests it" in found.said


def test_a_rival_that_is_no_worse_than_the_script_says_nothing(tmp_path: Path) -> None:
    text = HIDDEN.replace("place: row(5)", "place: row(5), frame: guess").replace(
        "cast:", "  guess: {steps: [{say: It is <first_box.color>}]}\ncast:"
    )
    path = written(tmp_path, text + RIVALS + "check:\n  - {rival: always_red, at_most: 0.7}\n")
    (_, found), *_ = check_scenario(load(path), path, Effort(5)).tried
    assert found.verdict is Verdict.FAILS
    assert "no room tests it: the script does not solve more" in found.said


@pytest.mark.parametrize(
    ("rivals", "code", "line"),
    [
        ("  oops: {steps: [{say: It is <prise.color>}]}", "S201", 20),
        ("  oops: {steps: [{do: use(prize)}]}", "S320", 20),
        ("  oops: {states: {a: {then: [{goto: b}]}}}", "S301", 20),
        ("  tell: {steps: [{say: It is red}]}", "S213", 20),
        ("  ok: {steps: [{say: It is red}]}\ncheck:\n  - {rival: okay, at_most: 0.5}", "S201", 22),
        ("  ok: {steps: [{say: It is red}]}\ncheck:\n  - {rival: ok}", "S105", 22),
        ("  ok: {steps: [{say: It is red}]}\ncheck:\n  - {needs: ann, at_most: 0.5}", "S107", 22),
    ],
)
def test_mistakes_in_rivals_are_found_where_they_are(
    tmp_path: Path, rivals: str, code: str, line: int
) -> None:
    text = HIDDEN.replace("define: {first_box: first(b in boxes where b.index == 0)}\n", "")
    found = check(written(tmp_path, f"{text}\nrivals:\n{rivals}\n")).diagnostics
    assert [(d.code, d.span.line) for d in found] == [(code, line - 1)]


def test_what_only_a_rival_uses_is_not_idle(tmp_path: Path) -> None:
    assert check(written(tmp_path, HIDDEN + RIVALS)).diagnostics == ()
    assert [d.code for d in check(written(tmp_path, HIDDEN)).diagnostics] == ["W317"]


def test_the_frame_that_the_agent_has_where_no_rival_plays_is_not_idle(tmp_path: Path) -> None:
    text = HIDDEN.replace("place: row(5)", "place: row(5), frame: guess").replace(
        "cast:",
        "  guess: {steps: [{say: It is <first_box.color>}]}\n  idle: {steps: [{say: It is red}]}\ncast:",
    )
    path = written(tmp_path, text + RIVALS)
    assert [d.message for d in check(path).diagnostics] == ["nobody follows the frame `idle`"]
    assert check(f"{path}+always_red").diagnostics == ()


@pytest.mark.parametrize("name", ["talkitout", "help", "novel/gossip", "novel/sally_anne"])
def test_shipped_rivals_begin_in_the_same_rooms_as_the_scenario(name: str) -> None:
    loaded = load(name)
    rivals = loaded.scenario.rivals if isinstance(loaded, socialai_dsl.LoadedScenario) else ()
    for rival in rivals:
        for seed in (0, 1):
            plain, other = (
                socialai_dsl.make_vec(socialai_dsl.compile(one), num_envs=8)
                for one in (loaded, rival_of(loaded, rival))
            )
            for one, two in zip(
                plain.reset(seed=seed)[0].values(), other.reset(seed=seed)[0].values(), strict=True
            ):
                assert np.array_equal(one, two)
