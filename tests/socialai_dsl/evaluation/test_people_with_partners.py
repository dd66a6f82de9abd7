"""A person is tested beside others: on the seat that is left, and what all did is played again."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

import socialai_dsl as sd
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.crossplay import Rate
from socialai_dsl.evaluation.people import play_seed
from socialai_dsl.play.screen import PlayApp
from socialai_dsl.reporting.records import CrossPlayRecord
from socialai_dsl.runs.crossplay import crossplay

HORIZON = 4
WAIT = f"""scenario: wait
horizon: {HORIZON}
actions: [left, right, forward]
grammar: {{templates: [<noun>], nouns: [hello]}}
room: {{size: 5}}
cast:
  agent: {{name: Ann, at: [1, 1], frame: stay}}
  bob: {{name: Bob, at: [3, 3], seat: open, frame: stay}}
frames: {{stay: {{states: {{staying: {{}}}}}}}}
rivals: {{turns: {{states: {{turning: {{do: turn_to(right)}}}}}}}}
outcome: [{{success: t == 3, for: agent}}]
"""


@pytest.fixture(autouse=True)
def person(monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody at a terminal who turns left until each episode is over."""

    async def keys(app: PlayApp) -> None:
        async with app.run_test() as pilot:
            await pilot.press(*[*["left"] * HORIZON, "n"] * 2, "q")

    def run(app: PlayApp) -> object:
        asyncio.run(keys(app))
        return app.return_value

    monkeypatch.setattr("socialai_dsl.play._require_terminal", lambda: None)
    monkeypatch.setattr(PlayApp, "run", run)


@pytest.mark.parametrize(
    ("seats", "own"),
    [
        ({}, "agent"),
        ({"bob": "random"}, "agent"),
        ({"agent": "script"}, "bob"),
        ({"agent": "random"}, "bob"),
    ],
)
def test_a_person_has_the_seat_that_is_left(seats: dict[str, str], own: str, tmp_path: Path) -> None:
    scenario = tmp_path / "wait.yaml"
    scenario.write_text(WAIT, encoding="utf-8")
    found = sd.evaluate("human", scenario, 2, out=tmp_path / "human", seats=seats, record=0)
    assert found.seat == own
    assert found.result.episodes == 2
    (session,) = (tmp_path / "human").iterdir()
    traces = sd.replay(session / "wait", test_episodes=[0, 1])
    for number, trace in enumerate(traces):
        assert (trace.own, len(trace.moments) - 1) == (own, found.result.lengths[number])
        assert trace.players.keys() == {"agent", "bob"} - {own}
        moment = trace.moments[1]
        assert (moment.did if own == "agent" else moment.seats[0].did) == "left"
        assert trace.moments[-1].ended is not None


@pytest.mark.parametrize(
    ("seats", "cell", "episodes"),
    [
        ({}, ("person", "script"), 2),
        ({"bob": "random"}, ("person", "random"), 2),
        ({"agent": "script"}, ("script", "person"), 2),
        ({"agent": "rival:turns"}, ("rival:turns", "person"), 1),
    ],
)
def test_what_a_person_has_played_is_a_cell_of_cross_play(
    seats: dict[str, str], cell: tuple[str, str], episodes: int, tmp_path: Path
) -> None:
    """With the success of both seats; it is in no mean, and the person plays with nobody else."""
    scenario = tmp_path / "wait.yaml"
    scenario.write_text(WAIT, encoding="utf-8")
    played = sd.evaluate(
        "human", scenario, 2, out=tmp_path / "human", seats=seats, record=0, participant="p-1"
    )
    (session,) = (tmp_path / "human").iterdir()
    assert played.folder is not None
    players = ["oracle", "random", "rival:turns"]
    found = crossplay([*players, session], str(scenario), max(episodes, 1), out=tmp_path / "with")
    without = crossplay(players, str(scenario), episodes)
    names = ["p-1" if name == "person" else name for name in cell]
    pair = found.names.index(names[0]), found.names.index(names[1])
    assert found.results.keys() - without.results.keys() == {pair}
    assert found.results[pair].episodes == episodes
    assert [found.rate(pair, seat).success for seat in ("agent", "bob")] == [1, 0]
    for seat in found.seats:
        assert found.with_themselves(seat) == without.with_themselves(seat)
        assert found.with_others(seat) == without.with_others(seat)
    record = CrossPlayRecord.model_validate_json((tmp_path / "with" / "crossplay.json").read_text())
    assert {len(one.cells) for one in record.seats.values()} == {len(without.results) + 1}
    again = crossplay([*players, played.folder], str(scenario), episodes)
    assert again.figures() == found.figures()


def test_a_trained_partner_is_known_by_its_network(tmp_path: Path) -> None:
    scenario, run, other = tmp_path / "wait.yaml", tmp_path / "run", tmp_path / "other"
    scenario.write_text(WAIT, encoding="utf-8")
    for seed, folder in enumerate((run, other)):
        options = {"frames": 64, "envs": 4, "horizon": 16, "eval_episodes": 1}
        sd.train(str(scenario), out=folder, seed=seed, device="cpu", recipe="plain", **options)
    sd.evaluate("human", scenario, 2, out=tmp_path / "human", seats={"agent": str(run)}, record=0)
    (session,) = (tmp_path / "human").iterdir()
    found = crossplay([other, run, session], str(scenario), 2)
    assert found.recorded == {(1, 2)}
    assert isinstance(found.with_others("agent"), Rate)
    with pytest.raises(UsageError, match=r"played with .* as agent, expected one of the players named here"):
        crossplay([other, session], str(scenario), 2)


def test_practice_is_no_cell_of_cross_play(tmp_path: Path) -> None:
    scenario = tmp_path / "wait.yaml"
    scenario.write_text(WAIT, encoding="utf-8")
    _, folder = play_seed(str(scenario), out=tmp_path / "human")
    with pytest.raises(UsageError, match="holds what `socialai play` keeps, which is no test"):
        crossplay(["oracle", folder], str(scenario), 2)
