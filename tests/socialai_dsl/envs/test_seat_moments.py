"""What every seat of a single environment gets, and who sits there from one step to the next."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.episodes.policies import ReplayedPolicy
from socialai_dsl.render.tiles import NPC

TWO = """\
scenario: two
horizon: 6
earshot: room
grammar: {templates: [Say <noun>], nouns: [hello]}
actions: [left, right, forward]
room: {width: 7, height: 6}
cast:
  agent: {name: Ann, at: [2, 4], facing: up, color: red}
  bob: {name: Bob, at: [4, 4], facing: up, color: blue, seat: open, frame: turns}
frames:
  turns: {states: {on: {do: turn(right), then: [{hears: Say hello, say: Hi.}]}}}
outcome:
  - {success: agent.said("Say hello") and t > 3, for: bob, reward: {bob: 50}}
"""


class Told:
    """A player that does what it is told, and keeps what it saw."""

    def __init__(self) -> None:
        self.action = np.zeros(4, np.int64)
        self.seen: list[Any] = []

    def reset(self, mask: Any, episodes: Any = None) -> None:
        self.seen = []

    def act(self, observation: Any) -> Any:
        self.seen.append(observation)
        return self.action[None]


@pytest.fixture
def two(tmp_path: Path) -> str:
    path = tmp_path / "two.yaml"
    path.write_text(TWO, encoding="utf-8")
    return str(path)


def test_a_moment_of_a_seat_is_what_one_who_plays_there_gets(two: str) -> None:
    """The same game from both sides, in each of which the caller has another seat."""
    told = Told()
    agent, bob = (
        sd.make(two, seats={"bob": told}).unwrapped,
        sd.make(two, seats={"agent": "random"}).unwrapped,
    )
    assert (agent.seats, agent.seat_names, bob.seat_names) == (("agent", "bob"), ("agent",), ("bob",))
    observation, info = bob.reset(seed=3)
    agent.reset(seed=3)
    for t in range(6):
        moment = agent.seat_moment("bob")
        assert all(np.array_equal(moment.observation[name], observation[name]) for name in observation)
        assert moment.info == {name: info[name] for name in ("utterance", "history")}
        assert (moment.did, moment.success) == (None if not t else "right", None)
        told.action = bob.encode_action(("right", "Say hello"))
        observation, reward, ended, truncated, info = bob.step(told.action)
        _, other, *_ = agent.step(bob.seat_moment("agent").action)
        moment = agent.seat_moment("bob")
        assert (moment.reward, agent.seat_moment("agent").reward) == (reward, other)
        if ended or truncated:
            break
    assert moment.success is info["success"]
    assert not agent.seat_moment("agent").success


def test_a_room_is_shown_from_the_own_seat(two: str) -> None:
    env = sd.make(two, seats={"agent": "random"}).unwrapped
    observation, _ = env.reset(seed=1)
    own, agents = env.scene(), env.scene("agent")
    assert (own.agent, agents.agent) == ((4, 4, 3), (2, 4, 3))
    assert own.codes[4, 4, 0] != NPC == own.codes[4, 2, 0]
    assert agents.codes[4, 2, 0] != NPC == agents.codes[4, 4, 0]
    assert (observation["image"][1, 6] == own.codes[4, 2]).all(), "the agent looks as in the picture"
    assert env.view(observation["image"]).held == {}


def test_a_script_takes_a_seat_over_and_gives_it_back(two: str) -> None:
    told = Told()
    env = sd.make(two, seats={"bob": told}).unwrapped
    env.reset(seed=1)
    stay = env.encode_action((None, None))
    told.action = env.encode_action(("left", None))
    env.step(stay)
    assert env.describe()["bob"]["facing"] == "left"
    env.fill_seat("bob", "script")
    env.step(env.encode_action((None, "Say hello")))
    assert env.describe()["bob"]["facing"] == "up"
    assert env.seat_moment("bob").action is None
    assert env.seat_moment("bob").did == "right"
    assert env.seat_moment("agent").info["utterance"] == "Bob: Hi."
    assert [one["name"] for one in env.explain()["fired"]], "its rule has fired"
    env.fill_seat("bob", told)
    env.step(stay)
    assert env.describe()["bob"]["facing"] == "left"
    assert env.explain()["t"] == 3, "explained with the one who sat there in each step"


@pytest.mark.parametrize(
    ("seat", "player", "words"),
    [
        ("bbo", "script", "expected one of agent, bob; did you mean 'bob'"),
        ("agent", "script", "whose actions are those of `step`"),
        ("bob", "somebody", "expected 'script', 'random', 'nobody' or a policy"),
    ],
)
def test_mistakes_about_seats(two: str, seat: str, player: str, words: str) -> None:
    env = sd.make(two, seats={"bob": ReplayedPolicy([])}).unwrapped
    with pytest.raises(ValueError, match=words):
        env.fill_seat(seat, player)
    with pytest.raises(ValueError, match="made with `seats`"):
        sd.make(two).unwrapped.fill_seat("bob", "script")
