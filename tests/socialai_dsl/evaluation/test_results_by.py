"""Results told for each value of a draw: the same episodes, counted apart."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import socialai_dsl
from socialai_dsl import evaluate, report
from socialai_dsl.analysis.check import check_scenario
from socialai_dsl.analysis.data_sheet import sheet
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.rooms import DrawnRooms
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.envs.told_apart import rooms_apart
from socialai_dsl.evaluation.summary import summary_rows
from socialai_dsl.frontend import check
from tools.sheets import rival_shares

SCENARIO = """\
scenario: pair
room: {size: 5}
horizon: 5
grammar: {templates: [Yes, No]}
let:
  condition: pick("control" | "test")
  size: pick(2..11)
  even: size % 2 == 0
  unrelated: pick(1..3)
frames:
  own: {steps: [{when: condition == "test", say: Yes}, {do: stay, for: ever}]}
rivals:
  other: {steps: [{when: even, say: Yes}, {do: stay, for: ever}]}
cast:
  agent: {frame: own}
outcome:
  - success: agent.said("Yes")
check:
  - {oracle: 0.1}
  - {rival: other, at_most: 0.2}
  - {reachable: agent.said("Yes") and even}
"""
BY = "results_by: [condition, size, even]\n"


@pytest.fixture
def path(tmp_path: Path) -> str:
    (tmp_path / "pair.yaml").write_text(SCENARIO + BY, encoding="utf-8")
    return str(tmp_path / "pair.yaml")


def lets(path: str, episodes: int) -> list[dict[str, Any]]:
    """What is drawn in the test episodes."""
    env = socialai_dsl.make(path)
    found = []
    for number in range(episodes):
        env.reset(options={"test_episode": number})
        found.append(env.unwrapped.describe()["let"])
    env.close()
    return found


def test_each_value_has_the_episodes_with_it(path: str) -> None:
    figures = evaluate("oracle", path, episodes=60).figures()["results_by"]
    drawn = lets(path, 60)
    assert {
        draw: {value: part["episodes"] for value, part in values.items()} for draw, values in figures.items()
    } == {
        "condition": {
            value: sum(one["condition"] == value for one in drawn) for value in ("control", "test")
        },
        "size": {str(n): sum(one["size"] == n for one in drawn) for n in range(2, 12)},
        "even": {str(so).lower(): sum(one["even"] is so for one in drawn) for so in (False, True)},
    }
    assert list(figures["size"]) == [str(n) for n in range(2, 12)], "numbers stand in their order"
    assert {value: part["success_rate"] for value, part in figures["condition"].items()} == {
        "control": 0,
        "test": 1,
    }
    low, high = figures["condition"]["test"]["success_interval"]
    assert 0.8 < low < high == 1


def test_it_is_shown_and_kept(path: str, tmp_path: Path) -> None:
    played = evaluate("oracle", path, episodes=20, out=tmp_path / "out", record=0)
    rows = dict(summary_rows(played.figures()))
    assert rows["  condition test"].startswith("100.0% of ")
    assert played.folder is not None
    kept = json.loads((played.folder / "result.json").read_text(encoding="utf-8"))["eval"]["results_by"]
    assert kept == json.loads(json.dumps(played.figures()["results_by"]))
    page = report(played.folder, tmp_path / "report", baselines=False)
    table = pd.read_csv(page.with_name("results_by.csv"))
    assert {(row.draw, row.value): row.test_episodes for row in table.itertuples()} == {
        (draw, value): part["episodes"] for draw, values in kept.items() for value, part in values.items()
    }
    shown = "".join(re.sub(r"<[^>]+>", "|", page.read_text(encoding="utf-8")).split())
    assert "condition||test||1.000" in shown
    assert "| results by | [condition, size, even] |" in sheet(path, socialai_dsl.load(path))
    measured = rival_shares(path, rooms=80)["other"]
    assert measured["results_by"]["even"]["true"]["success_rate"] == 1
    assert sum(part["rooms"] for part in measured["results_by"]["size"].values()) == 80


def test_members_of_a_suite_have_their_own(path: str, tmp_path: Path) -> None:
    (tmp_path / "plain.yaml").write_text(
        SCENARIO.replace("scenario: pair", "scenario: plain"), encoding="utf-8"
    )
    (tmp_path / "both.yaml").write_text("suite: both\nmembers: [pair.yaml, plain.yaml]\n", encoding="utf-8")
    figures = evaluate("random", tmp_path / "both.yaml", episodes=40).figures()
    assert set(figures["results_by"]) == {"pair: condition", "pair: size", "pair: even"}
    share = figures["members"]["pair"]["share"]
    assert sum(part["episodes"] for part in figures["results_by"]["pair: even"].values()) == round(40 * share)
    (tmp_path / "acts.yaml").write_text(
        "suite: acts\ndraw: in_sequence\nmembers: [pair.yaml, plain.yaml]\n", encoding="utf-8"
    )
    assert "results_by" not in evaluate("random", tmp_path / "acts.yaml", episodes=4).figures()


def test_claims_have_figures_for_each_value(path: str) -> None:
    loaded = socialai_dsl.load(path)
    assert isinstance(loaded, socialai_dsl.LoadedScenario)
    checked = check_scenario(loaded, path, Effort(40))
    found = {plan.kind: one.apart for plan, one in checked.tried}
    rooms = DrawnRooms.numbered(compile_loaded(loaded), 500, 0).table  # type: ignore[arg-type]
    drawn = [rooms.describe(room)["let"] for room in range(500)]
    test, even = (
        np.array([one[draw] == so for one in drawn]) for draw, so in (("condition", "test"), ("even", True))
    )
    assert found["oracle"]["condition", "test"] == (test[:40].sum(), test[:40].sum())
    assert found["oracle"]["condition", "control"] == (0, 40 - test[:40].sum())
    assert found["rival"]["even", "true"] == (even.sum(), even.sum())
    assert found["rival"]["even", "false"] == (0, 500 - even.sum())
    assert found["reachable"]["even", "false"][0] == 0
    lines = list(checked.lines())
    assert f"    even true: solves {even.sum()} of {even.sum()} rooms" in lines
    assert checked.as_object()["properties"][1]["results_by"]["even"]["false"] == {
        "so": 0,
        "rooms": 500 - even.sum(),
    }


def test_the_program_is_the_same(path: str, tmp_path: Path) -> None:
    (tmp_path / "silent.yaml").write_text(SCENARIO, encoding="utf-8")
    programs = [compile_loaded(socialai_dsl.load(name)) for name in (path, str(tmp_path / "silent.yaml"))]
    assert programs[0].sha256 == programs[1].sha256
    assert "results_by" not in evaluate("oracle", tmp_path / "silent.yaml", episodes=2).figures()


@pytest.mark.parametrize("name", ["sise", "own", "doors"])
def test_what_is_not_drawn_is_a_finding(path: str, name: str) -> None:
    Path(path).write_text(SCENARIO + f"results_by: [condition, {name}]\n", encoding="utf-8")
    (found,) = check(path).diagnostics
    assert (found.code, found.span.line) == ("S201", SCENARIO.count("\n") + 1)
    assert f"`{name}` is not drawn in `let`" in found.message


def test_a_draw_that_only_results_are_told_by_is_used(path: str) -> None:
    text = SCENARIO.replace(" and even", "").replace("when: even, ", "")
    for by, unused in (("unrelated", ["size", "even"]), ("[even, unrelated]", [])):
        Path(path).write_text(text + f"results_by: {by}\n", encoding="utf-8")
        named = [d.message for d in check(path).diagnostics if d.code == "W317"]
        assert all(any(f"`{name}`" in said for said in named) for name in unused[1:]), named
        assert not any("`unrelated`" in said for said in named)


def test_rooms_are_listed_in_the_order_of_values() -> None:
    found = rooms_apart([[("n", "10")], [("n", "9")], [("n", "-3")], [("n", "none")], [("n", "10")]])
    assert [(value, rooms.tolist()) for (_, value), rooms in found.items()] == [
        ("-3", [2]),
        ("9", [1]),
        ("10", [0, 4]),
        ("none", [3]),
    ]
