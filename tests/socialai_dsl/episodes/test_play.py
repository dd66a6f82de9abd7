"""The loop: who is asked and told what, when players forget, and what is said of those that cannot play."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.episodes import (
    AGENT,
    Actions,
    EachRoom,
    EpisodeOver,
    EpisodesInARow,
    FunctionPolicy,
    Observer,
    OneEpisode,
    PolicyDone,
    PredictingPolicy,
    RandomPolicy,
    ReplayedPolicy,
    Results,
    Rooms,
    RoomSet,
    Stage,
    play,
)
from socialai_dsl.evaluation import evaluate_policy

STILL = [3, 0, 0, 0]


def envs(count: int, scenario: str = "dance") -> Any:
    return sd.make_vec(scenario, num_envs=count, autoreset_mode="Disabled")


class Log(Observer):
    """Notes what it sees."""

    def __init__(self) -> None:
        self.begun: list[list[int]] = []
        self.steps = 0

    def began(self, rooms: Rooms, begun: Any) -> None:
        self.begun.append(rooms.numbers[begun].tolist())

    def stepped(self, rooms: Rooms, step: Any) -> None:
        self.steps += int(np.count_nonzero(step.running))


class Still:
    """Does nothing, and notes before which episodes it forgets."""

    def __init__(self) -> None:
        self.forgotten: list[int] = []

    def reset(self, mask: Any, episodes: Any = None) -> None:
        self.forgotten += episodes[mask].tolist()

    def act(self, observation: Any) -> Any:
        return np.tile(STILL, (len(observation["tokens"]), 1))


@pytest.mark.parametrize("together", [1, 2, 3])
def test_each_episode_is_played_once_however_many_are_played_together(together: int) -> None:
    rooms = Rooms(envs(together), [log := Log(), results := Results(envs(1).outcomes, 6)])
    play(rooms, {AGENT: Still()}, EachRoom(6))
    assert sorted(number for numbers in log.begun for number in numbers) == list(range(6))
    assert results.result().lengths.tolist() == [20] * 6
    assert log.steps == 120


def test_a_player_forgets_before_each_session() -> None:
    policy, log = Still(), Log()
    play(Rooms(envs(2), [log]), {AGENT: policy}, EachRoom(6, trials=3))
    assert policy.forgotten == [0, 3]
    assert sorted(number for numbers in log.begun for number in numbers) == list(range(6))
    policy = Still()
    assert evaluate_policy(policy, envs(1), 4, trials=2).by_trial(2) == [(0, 2), (0, 2)]
    assert policy.forgotten == [0, 2]
    with pytest.raises(ValueError, match="trials: got 3, expected a divisor of the 4 episodes"):
        evaluate_policy(policy, envs(1), 4, trials=3)


def test_a_player_is_told_of_each_episode_of_a_session() -> None:
    class Maps(Still):
        """Notes which episodes it enters without forgetting."""

        def enter(self, mask: Any) -> None:
            self.entered = [*getattr(self, "entered", []), mask.tolist()]

    policy = Maps()
    play(Rooms(envs(2)), {AGENT: policy}, EachRoom(6, trials=3))
    assert policy.forgotten == [0, 3]
    assert np.sum(policy.entered, axis=0).tolist() == [2, 2]
    play(Rooms(envs(2)), {AGENT: (alone := Maps())}, EachRoom(4))
    assert not hasattr(alone, "entered")


def test_the_first_episodes_of_each_room_are_numbered_room_by_room() -> None:
    play(Rooms(envs(2), [log := Log()]), {AGENT: Still()}, EpisodesInARow(seed=1, each=2))
    assert log.begun == [[0, 2], [1, 3]]


def test_a_policy_may_answer_later() -> None:
    class Later(Still):
        async def act(self, observation: Any) -> Any:
            await asyncio.sleep(0)
            return super().act(observation)

    play(Rooms(envs(2), [log := Log()]), {AGENT: Later()}, EachRoom(2))
    assert log.steps == 40


def test_a_policy_may_end_an_episode_and_is_told_of_every_end() -> None:
    class Leaves(Still):
        """Ends episode 1 before its third step."""

        def __init__(self) -> None:
            super().__init__()
            self.steps, self.left = [0], 0

        def act(self, observation: Any) -> Any:
            if len(self.steps) == 2 and self.steps[-1] == 2:
                raise EpisodeOver
            self.steps[-1] += 1
            return super().act(observation)

        async def leave(self) -> None:
            self.left += 1
            self.steps.append(0)

    policy = Leaves()
    play(Rooms(envs(1), [log := Log()]), {AGENT: policy}, EachRoom(3))
    assert policy.steps == [20, 2, 20, 0]
    assert (policy.left, log.begun) == (3, [[0], [1], [2]])
    with pytest.raises(ValueError, match="cut: got 2 rooms, expected one"):
        Rooms(envs(2)).cut()


def test_a_policy_that_does_not_answer_is_not_waited_for() -> None:
    class Silent(Still):
        async def act(self, observation: Any) -> Any:
            await asyncio.Event().wait()

    with pytest.raises(ValueError, match=r"agent: Silent did not answer within 0\.05 s"):
        play(Rooms(envs(1)), {AGENT: Silent()}, EachRoom(1), wait=0.05)


def test_play_stops_where_a_policy_has_nothing_more_to_do() -> None:
    env: Any = sd.make("dance")
    rooms = Rooms(env, [log := Log(), kept := Actions()])
    play(rooms, {AGENT: ReplayedPolicy([np.array(STILL)] * 3)}, OneEpisode({"seed": 1}))
    assert (log.steps, len(kept.played[0]), rooms.running.tolist()) == (3, 3, [True])


def test_results_are_those_of_episodes_that_ended() -> None:
    """A policy that stops playing has no result, rather than a failure for what it left."""

    class Stops(Still):
        def __init__(self, how: type[Exception]) -> None:
            super().__init__()
            self.how = how

        def act(self, observation: Any) -> Any:
            if self.forgotten[-1] == 1:
                raise self.how
            return super().act(observation)

    for how, left in ((EpisodeOver, 1), (PolicyDone, 2)):
        with pytest.raises(
            ValueError, match=f"it stopped playing before the end of {left} of the 3 episodes"
        ):
            evaluate_policy(Stops(how), envs(1), 3)


def test_play_stops_when_it_is_told() -> None:
    log = Log()
    play(Rooms(envs(2), [log]), {AGENT: Still()}, EachRoom(2), lambda: log.steps >= 10)
    assert log.steps == 10


class Model:
    """As a recurrent model of Stable-Baselines3 plays."""

    def __init__(self) -> None:
        self.starts: list[list[bool]] = []
        self.states: list[Any] = []

    def predict(self, observation: Any, state: Any, episode_start: Any, deterministic: bool) -> Any:
        self.starts.append(episode_start.tolist())
        self.states.append(state)
        return np.tile(STILL, (len(observation["tokens"]), 1)), len(self.starts)


def test_a_model_of_stable_baselines_is_told_where_episodes_start() -> None:
    model = Model()
    evaluate_policy(PredictingPolicy(model), envs(2), 4)
    assert [row for row, starts in enumerate(model.starts) if all(starts)] == [0, 20]
    assert not any(any(starts) for starts in (*model.starts[1:20], *model.starts[21:]))
    assert model.states == [None, *range(1, 40)]
    assert sd.evaluate(Model(), "dance", 2).player.kind == "policy"


@pytest.mark.parametrize(
    ("act", "said"),
    [
        (lambda seen: np.zeros(4, int), r"agent: got actions of the shape \(4,\) .* shape \(2, 4\)"),
        (lambda seen: np.zeros((2, 4)), "the type float64, expected whole numbers"),
        (lambda seen: [["left"] * 4] * 2, "the type <U4, expected whole numbers"),
        (lambda seen: None, "expected whole numbers"),
        (lambda seen: np.full((2, 4), 99), "expected"),
    ],
)
def test_actions_that_are_none_are_refused(act: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        play(Rooms(envs(2)), {AGENT: FunctionPolicy(act)}, EachRoom(2))


def test_what_a_policy_raises_says_where_it_was() -> None:
    def fails(observation: Any) -> Any:
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine") as raised:
        play(Rooms(envs(1)), {AGENT: FunctionPolicy(fails)}, EachRoom(1))
    assert raised.value.__notes__ == ["while FunctionPolicy played the seat 'agent' of episode 0"]


def test_seats_rooms_and_episodes_have_to_fit() -> None:
    with pytest.raises(ValueError, match=r"players: got \['ann'\], expected one for each of \['agent'\]"):
        play(Rooms(envs(1)), {"ann": Still()}, EachRoom(1))
    with pytest.raises(ValueError, match="envs: got 3 of them for 2 episodes, expected at most as many"):
        play(Rooms(envs(3)), {AGENT: Still()}, EachRoom(2))
    with pytest.raises(ValueError, match=r"auto-reset mode .*, expected Disabled"):
        Rooms(sd.make_vec("dance", num_envs=2))
    with pytest.raises(PolicyDone):
        ReplayedPolicy([]).act({})


def test_steps_are_taken_back_chance_included() -> None:
    """What follows then is what followed before, as often as one likes."""

    def following(stage: Stage, count: int) -> list[bytes]:
        seen = []
        for _ in range(count):
            stage.step({AGENT: np.array([[2, 0, 0, 0]])})
            seen.append(stage.observations[AGENT]["image"].tobytes())
        return seen

    stage = Stage(sd.make("talkitout"))
    stage.begin({"seed": 4})
    before = stage.info
    first = following(stage, 3)
    while stage.back():
        pass
    assert stage.info is before
    assert (stage.steps, following(stage, 3)) == (0, first)


def test_a_step_that_cannot_be_played_leaves_everything_as_it_was() -> None:
    stage = Stage(sd.make("dance"))
    stage.begin({"seed": 4})
    before = stage.env.snapshot()
    with pytest.raises(ValueError, match="expected one of"):
        stage.step({AGENT: np.array([[99, 0, 0, 0]])})
    assert (stage.steps, stage.env.snapshot()) == (0, before)


def test_chance_draws_the_same_in_one_room_as_in_many(tmp_path: Path) -> None:
    """A traced episode is the evaluated one."""
    played = sd.evaluate("random", "dance", 3)
    seen = sd.trace("dance", RandomPolicy((4, 2, 2, 2)), test_episode=2)
    assert len(seen.moments) - 1 == len(played.actions[2])
    assert len(sd.replay("dance", tmp_path / "page.html", agent="random", test_episodes=[1])) == 1
    assert (tmp_path / "page.html").stat().st_size < 400_000


def test_rooms_of_a_seed_are_numbered_as_environments_of_a_batch_are() -> None:
    batch: Any = envs(3)
    expected = batch.reset(seed=5)[0]["image"].copy()
    found: dict[int, Any] = {}

    class First(Observer):
        def began(self, rooms: Rooms, begun: Any) -> None:
            for room in np.flatnonzero(begun).tolist():
                found[int(rooms.numbers[room])] = rooms.observations[AGENT]["image"][room].copy()

    play(Rooms(envs(1), [First()]), {AGENT: Still()}, EachRoom(3, rooms=RoomSet.of_seed(5)))
    assert all((found[number] == expected[number]).all() for number in range(3))
