"""Searching rooms: what is walled off cannot be solved, what is open can, and a plan that is found succeeds."""

from pathlib import Path
from typing import Any

import pytest

import socialai_dsl
from socialai_dsl.analysis.search import Finding, Search, SearchVerdict, search_rooms

# The right-hand door is the one; the agent in the upper left corner cannot pass two NPCs.
WALLED_OFF = {
    "room": {"width": 5, "height": 5},
    "doors": [{"at": [2, 0]}, {"at": [2, 4]}, {"at": [0, 2]}, {"at": [4, 2]}],
    "agent": {"at": [1, 1], "facing": "up"},
    "wizard": {"at": [2, 1]},
    "honest": {"at": [1, 2]},
    "liar": {"at": [3, 3]},
    "let": {"exit": "doors[3]"},
}
OPEN = WALLED_OFF | {"honest": {"at": [1, 3]}}
AT_THE_EXIT = OPEN | {"agent": {"at": [3, 1], "facing": "down"}}


def findings(scenario: str, layouts: list[dict[str, Any]], **options: Any) -> list[Finding]:
    envs = socialai_dsl.make_vec(scenario, num_envs=len(layouts))
    envs.reset(seed=3, options={"layout": layouts})
    try:
        return list(search_rooms(envs, list(range(len(layouts))), **options))
    finally:
        envs.close()


def test_a_walled_off_exit_is_proven_to_be_one() -> None:
    walled_off, with_a_way = findings("talkitout", [WALLED_OFF, OPEN])
    assert walled_off.verdict is SearchVerdict.UNSOLVABLE
    assert walled_off.exact
    assert walled_off.plan is None
    assert walled_off.states % 4 == 0, "four directions of one cell, times what the NPCs know"
    assert with_a_way.verdict is SearchVerdict.SOLVABLE


def test_the_plan_that_was_found_succeeds() -> None:
    (finding,) = findings("talkitout", [OPEN])
    assert finding.plan is not None
    env = socialai_dsl.make("talkitout")
    env.reset(seed=3, options={"layout": OPEN})
    *_, before = [env.step(action) for action in finding.plan[:-1]]
    assert not before[2], "no step is superfluous"
    *_, terminated, _, info = env.step(finding.plan[-1])
    assert terminated
    assert info["success"]
    assert len(finding.plan) == 6, "turn twice, go down, turn, go right twice and say the word on arrival"


def test_nobody_is_in_the_way_of_an_agent_that_does_not_see_them() -> None:
    (finding,) = findings("talkitout+unsocial", [WALLED_OFF])
    assert finding.verdict is SearchVerdict.SOLVABLE


def test_a_search_that_would_take_too_long_is_undecided() -> None:
    (finding,) = findings("talkitout", [OPEN | {"honest": {"at": [3, 2]}}], states=3)
    assert finding.verdict is SearchVerdict.UNDECIDED
    assert not finding.exact


def test_the_environments_stay_as_they_are() -> None:
    envs = socialai_dsl.make_vec("talkitout", num_envs=2)
    envs.reset(seed=3)
    before = envs.snapshot()
    list(search_rooms(envs, [0, 1]))
    assert envs.snapshot() == before


SCENARIO = """
scenario: waiting
horizon: {horizon}
grammar: {{templates: [Say <noun>], nouns: [it, that]}}
actions: [left]
room: {{size: 5}}
objects:
  gate: {{type: door, state: locked, at: [4, 2]}}
frames:
  keep:
    start: keeping
    states:
      keeping: {{then: [{{{rule}, cause: [gate.open], goto: free}}]}}
      free: {{}}
cast:
  keeper: {{at: [3, 3], facing: up, frame: keep}}
  agent: {{at: [1, 1], facing: right}}
outcome:
  - failure: agent.said("Say that")
  - success: gate.open
"""


def searched(folder: Path, rule: str, horizon: int) -> Finding:
    file = folder / "waiting.yaml"
    file.write_text(SCENARIO.format(rule=rule, horizon=horizon))
    (finding,) = findings(str(file), [{}])
    return finding


@pytest.mark.parametrize(("horizon", "verdict"), [(3, SearchVerdict.UNSOLVABLE), (4, SearchVerdict.SOLVABLE)])
def test_waiting_is_something_to_do(tmp_path: Path, horizon: int, verdict: SearchVerdict) -> None:
    """Standing still changes nothing but the clock that the keeper waits for."""
    finding = searched(tmp_path, "after: 4", horizon)
    assert finding.verdict is verdict
    assert finding.exact


def test_time_is_part_of_a_state_only_where_it_matters(tmp_path: Path) -> None:
    """What is never said leaves four directions, and no more however long one may try."""
    finding = searched(tmp_path, "hears: Say that", 60)
    assert finding.verdict is SearchVerdict.UNSOLVABLE
    assert finding.states == 4


def test_chance_may_open_a_way(tmp_path: Path) -> None:
    finding = searched(tmp_path, "chance: 0.4", 20)
    assert finding.verdict is SearchVerdict.SOLVABLE


def test_what_chance_decides_is_not_proven(tmp_path: Path) -> None:
    """The search tries some draws of a rare event, not all."""
    finding = searched(tmp_path, "chance: 0.0001", 3)
    assert finding.verdict is SearchVerdict.UNSOLVABLE
    assert not finding.exact


def test_a_search_is_repeatable() -> None:
    envs = socialai_dsl.make_vec("talkitout", num_envs=1)
    envs.reset(seed=3, options={"layout": [OPEN]})
    state = envs._table.state
    search = Search(envs.program)
    one, other = (search.solve(state.registers[0], state.boards[0], state.keys[0]) for _ in range(2))
    assert one.states == other.states
    assert one.plan is not None
    assert other.plan is not None
    assert [action.tolist() for action in one.plan] == [action.tolist() for action in other.plan]


@pytest.mark.parametrize(("layout", "succeeds"), [(AT_THE_EXIT, True), (WALLED_OFF, False)])
def test_walks_at_random_succeed_only_where_there_is_a_way(layout: dict[str, Any], succeeds: bool) -> None:
    envs = socialai_dsl.make_vec("talkitout", num_envs=1)
    envs.reset(seed=3, options={"layout": layout})
    state = envs._table.state
    search = Search(envs._table.program(0))
    assert search.stumbles(state.registers[0], state.boards[0], state.keys[0]) is succeeds
    envs.close()
