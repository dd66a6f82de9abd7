"""A person is tested beside others: on the seat that is left, and what all did is played again."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

import socialai_dsl as sd
from socialai_dsl.play.screen import PlayApp

HELP = "together/help_together"
HORIZON = 20


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
        ({"jill": "random"}, "agent"),
        ({"agent": "script"}, "jill"),
        ({"agent": "random"}, "jill"),
    ],
)
def test_a_person_has_the_seat_that_is_left(seats: dict[str, str], own: str, tmp_path: Path) -> None:
    found = sd.evaluate("human", HELP, 2, out=tmp_path, seats=seats, record=0)
    assert found.seat == own
    assert found.result.episodes == 2
    (session,) = tmp_path.iterdir()
    traces = sd.replay(session / "help_together", test_episodes=[0, 1])
    for number, trace in enumerate(traces):
        assert (trace.own, len(trace.moments) - 1) == (own, found.result.lengths[number])
        assert trace.players.keys() == {"agent", "jill"} - {own}
        moment = trace.moments[1]
        assert (moment.did if own == "agent" else moment.seats[0].did) == "left"
        assert trace.moments[-1].ended is not None
