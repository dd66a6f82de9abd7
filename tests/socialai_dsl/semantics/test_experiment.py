"""What an experiment's file means: its conditions, one by one."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest

from socialai_dsl import frontend
from socialai_dsl.semantics.experiment import Cell, with_variants

PAPER = """\
experiment: e
set: {frames: 100, net: paper}
"""


def cells(tmp_path: Path, text: str, profile: str | None = None) -> dict[str, Cell]:
    file = tmp_path / "e.yaml"
    file.write_text(PAPER + dedent(text), encoding="utf-8")
    return {cell.name: cell for cell in frontend.load_experiment(file).cells[profile]}


def test_a_condition_by_itself(tmp_path):
    (cell,) = cells(tmp_path, "conditions: [{name: one, scenario: dance}]").values()
    assert (cell.name, cell.row, cell.column, cell.group) == ("one", "one", "ppo", None)
    assert (cell.scenario, cell.agent, cell.frames, cell.seeds) == ("dance", "ppo", 100, (0,))
    assert cell.options == {"net": "paper"}
    assert (cell.tests, cell.reference) == ({}, None)


def test_a_grid_is_every_combination(tmp_path):
    found = cells(
        tmp_path,
        """\
        conditions:
          - group: table
            grid:
              scenario: [dance, help]
              bonus: {PPO: none, PPO+Explo: auto}
              envs: [8, 16]
        """,
    )
    assert list(found)[:3] == ["dance / PPO / 8", "dance / PPO / 16", "dance / PPO+Explo / 8"]
    assert len(found) == 8
    cell = found["help / PPO+Explo / 16"]
    assert (cell.row, cell.column, cell.group) == ("help", "PPO+Explo 16", "table")
    assert cell.options == {"net": "paper", "bonus": "auto", "envs": 16}


def test_an_axis_whose_values_are_several_settings(tmp_path):
    found = cells(
        tmp_path,
        """\
        conditions:
          - set: {tests: [help_as_helper]}
            grid:
              row: {Help: {scenario: help, frames: 7}, Dance: {scenario: dance, tests: []}}
              column: {PPO: {}, Unsocial: {variants: [unsocial], seeds: [4, 2]}}
        """,
    )
    assert found["Help / Unsocial"].scenario == "help+unsocial"
    assert found["Help / Unsocial"].tests == {"help_as_helper+unsocial": None}
    assert found["Help / Unsocial"].seeds == (4, 2)
    assert (found["Help / PPO"].frames, found["Dance / PPO"].frames) == (7, 100)
    assert found["Dance / PPO"].tests == {}


OVERRIDDEN = """\
conditions:
  - grid: {scenario: [dance, help], envs: [8, 16]}
  - {name: alone, scenario: showme, envs: 4}
overrides:
  - {where: {scenario: help}, set: {frames: 200, seeds: 2}}
  - {where: {row: [help, alone], envs: "16"}, set: {frames: 300}}
  - {where: {name: alone}, set: {frames: 400, reference: {mean: 0.5, source: somewhere}}}
profile: none_but_this
profiles:
  none_but_this: {}
  small:
    set: {net: fast, frames: 10, envs: 2}
    overrides: [{where: {name: alone}, set: {envs: 3}}]
    conditions: [{name: more, scenario: dance, frames: 20}]
"""


def test_overrides_hold_where_everything_agrees_and_the_last_wins(tmp_path):
    found = cells(tmp_path, OVERRIDDEN)
    frames = {name: cell.frames for name, cell in found.items()}
    assert frames == {
        "dance / 8": 100,
        "dance / 16": 100,
        "help / 8": 200,
        "help / 16": 300,
        "alone": 400,
    }
    assert found["help / 16"].seeds == (0, 1)
    assert found["alone"].reference.mean == 0.5


def test_a_profile_wins_over_everything_but_its_own_conditions(tmp_path):
    found = cells(tmp_path, OVERRIDDEN, "small")
    assert {cell.frames for name, cell in found.items() if name != "more"} == {10}
    assert {cell.options["net"] for cell in found.values()} == {"fast"}
    assert found["alone"].options["envs"] == 3
    assert (found["more"].frames, found["more"].options["envs"]) == (20, 2)
    assert found["help / 8"].seeds == (0, 1), "what the profile does not speak of stays"


def test_a_script_plays_in_one_way_only(tmp_path):
    found = cells(
        tmp_path,
        """\
        conditions:
          - set: {scenario: dance, seeds: 3}
            grid: {agent: [random, oracle]}
        """,
    )
    assert (found["random"].seeds, found["oracle"].seeds) == ((0, 1, 2), (0,))
    assert not found["random"].trains


def test_agents_and_scenarios_of_an_author_s_own(tmp_path):
    (tmp_path / "agents").mkdir()
    (tmp_path / "agents" / "best.safetensors").touch()
    (tmp_path / "mine.yaml").write_text("scenario: mine\nextends: dance.yaml\n")
    found = cells(
        tmp_path, "conditions: [{name: one, scenario: mine.yaml+unsocial, agent: agents/best.safetensors}]"
    )
    assert found["one"].scenario == "mine.yaml+unsocial"
    assert found["one"].agent == "agents/best.safetensors"


def test_built_on_another_experiment(tmp_path):
    (tmp_path / "base.yaml").write_text(PAPER + "conditions: [{name: one, scenario: dance}]\n")
    (tmp_path / "e.yaml").write_text("experiment: f\nextends: base.yaml\nset: {frames: 7}\n")
    loaded = frontend.load_experiment(tmp_path / "e.yaml")
    assert loaded.experiment.experiment == "f"
    (cell,) = loaded.cells[None]
    assert (cell.frames, cell.options) == (7, {"net": "paper"})


@pytest.mark.parametrize(
    ("scenario", "variants", "name"),
    [
        ("dance", (), "dance"),
        ("dance?length=2", ("a", "b"), "dance+a+b?length=2"),
        ("x.yaml+a", ("b",), "x.yaml+a+b"),
    ],
)
def test_variants_come_before_parameters(scenario, variants, name):
    assert with_variants(scenario, variants) == name
