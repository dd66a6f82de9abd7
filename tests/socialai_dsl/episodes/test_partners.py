"""Who sits on which seats: partners of a player that is tested, or that plays alone."""

from __future__ import annotations

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.envs.factory import compiled
from socialai_dsl.episodes.partners import own_seat, partners_of, seating
from socialai_dsl.episodes.players import Player
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.crossplay import cross_play
from socialai_dsl.evaluation.test_set import trace_test_episodes
from socialai_dsl.frontend import load

LEVERS = "together/levers_together"
HERE = {"agent": ["random", "script"], "partner": ["random", "script"]}


def test_the_first_seat_that_is_left_is_the_players() -> None:
    program = compiled(load(LEVERS))
    for named, seat in (
        ((), "agent"),
        ([("partner", "script")], "agent"),
        ([("agent", "random")], "partner"),
    ):
        assert own_seat(partners_of(named, LEVERS, program), program) == seat


@pytest.mark.parametrize(("seat", "partner"), [(s, p) for s, names in HERE.items() for p in names])
@pytest.mark.parametrize("agent", ["random", "oracle"])
def test_what_is_recorded_goes_as_what_was_counted(agent: str, seat: str, partner: str) -> None:
    """A script that nobody replaces acts by itself, so playing an episode again must not put a player there."""
    played = sd.evaluate(agent, LEVERS, episodes=6, seats={seat: partner})
    assert played.seat != seat
    assert played.result.success.any() == (agent == "oracle" and partner == "script")
    for number, trace in enumerate(played.traces(range(6))):
        assert trace.succeeded == played.result.success[number]
        assert len(trace.moments) - 1 == played.result.lengths[number]
    picked, _ = trace_test_episodes(
        played.player, LEVERS, played.loaded, played.program, [4], partners=played.partners
    )
    assert picked == played.traces([4])


def test_cross_play_says_what_each_would_be_told_alone() -> None:
    players = [Player("oracle"), Player("random")]
    found = cross_play(players, LEVERS, load(LEVERS), 20)
    as_agent = sd.evaluate("oracle", LEVERS, episodes=20, seats={"partner": "random"}).result
    as_partner = sd.evaluate("random", LEVERS, episodes=20, seats={"agent": "script"}).result
    assert np.array_equal(found.results[0, 1].success, as_agent.success)
    assert np.array_equal(found.results[0, 1].others["partner"][0], as_partner.success)


def test_a_rival_plays_the_agent_as_in_the_variant_of_its_name() -> None:
    rival = sd.evaluate("rival:hurries", LEVERS, episodes=20)
    variant = sd.evaluate("oracle", f"{LEVERS}+hurries", episodes=20, seats={"partner": "script"})
    assert 0 < rival.result.success_rate < 1
    assert np.array_equal(rival.result.success, variant.result.success)
    for trace, won in zip(rival.traces(range(20)), rival.result.success, strict=True):
        assert trace.succeeded == won
    beside = sd.evaluate("oracle", LEVERS, episodes=20, seats={"agent": "rival:hurries"})
    assert beside.seat == "partner"
    assert np.array_equal(beside.result.success, rival.result.others["partner"][0])


def test_rivals_are_rows_of_cross_play_alone() -> None:
    players = [Player("oracle"), Player("rival:hurries"), Player("random")]
    found = cross_play(players, LEVERS, load(LEVERS), 20)
    assert (found.agents, found.others) == ([0, 1, 2], [0, 2])
    alone = sd.evaluate("rival:hurries", LEVERS, episodes=20, seats={"partner": "random"}).result
    assert np.array_equal(found.results[1, 2].success, alone.success)
    rates = [found.rate(pair, "agent").success for pair in ((0, 2), (1, 0), (1, 2), (2, 0))]
    others = found.with_others("agent")
    assert others is not None
    assert others.success == pytest.approx(np.mean(rates))


@pytest.mark.parametrize(
    ("players", "said"),
    [
        (["oracle", "rival:hurry"], "has no rival 'hurry'; it has hurries"),
        (["rival:hurries"], "got rivals alone, who play agent"),
    ],
)
def test_rivals_that_cannot_play_are_refused_before_anybody_plays(players: list[str], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        cross_play([Player(name) for name in players], LEVERS, load(LEVERS), 10**9)


def test_one_who_plays_alone_meets_the_same_partner() -> None:
    loaded, seats = seating({"agent": Player("oracle")}, LEVERS, load(LEVERS))
    env = sd.make(compiled(loaded), seats=seats)
    assert env.unwrapped.seat_names == ("partner",)
    env.reset(options={"test_episode": 0})
    ended, info = False, {}
    while not ended:
        _, _, terminated, truncated, info = env.step(env.unwrapped.scripted_action())
        ended = terminated or truncated
    assert info["success"]


@pytest.mark.parametrize(
    ("named", "said"),
    [
        (
            [("partnr", "script")],
            "--seat: got 'partnr', expected one of agent, partner; did you mean 'partner'?",
        ),
        (
            [("partner", "rival:hurries")],
            "--seat: got 'rival:hurries' for partner, but a rival is a frame for the seat 'agent' alone",
        ),
        ([("partner", "script"), ("partner", "random")], "--seat: got 2 players for partner, expected one"),
        (
            [("agent", "random"), ("partner", "script")],
            "--seat: got a player for agent, partner, expected one seat left for who plays",
        ),
    ],
)
def test_seats_that_cannot_be_filled(named: list[tuple[str, str]], said: str) -> None:
    with pytest.raises(UsageError) as caught:
        partners_of(named, LEVERS, compiled(load(LEVERS)))
    assert str(caught.value).removeprefix("seat") == said.removeprefix("--seat")


def test_a_partner_that_cannot_be_asked_here() -> None:
    with pytest.raises(
        UsageError, match="got 'human' for partner, expected script, random, nobody or a trained agent"
    ):
        seating({"partner": Player("human")}, LEVERS, load(LEVERS))
