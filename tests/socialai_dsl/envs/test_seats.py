"""Several seats in the environments: rows for each, partners that fill them, and PettingZoo's parallel environment."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pettingzoo.test import parallel_api_test, parallel_seed_test

import socialai_dsl as sd
from tests.test_seats import NAMES, SHIPPED
from tests.tiny import Folder

TWO = """
horizon: 6
grammar: {templates: [Say <noun>], nouns: [hello, bye]}
room: {size: 7}
cast:
  agent: {name: Ann, at: [1, 1], facing: right}
  bob: {name: Bob, at: [3, 1], facing: left, seat: open, frame: greet}
frames:
  greet: {states: {greeting: {do: toggle, then: [{say: Say hello}]}}}
rules: [{when: bob.did(forward), reward: {bob: -10}}]
outcome:
  - {success: bob.said("Say bye"), for: bob}
  - {success: agent.said("Say bye"), reward: {agent: 100, bob: 50}}
"""


@pytest.fixture
def two(tmp_path: Path) -> str:
    return str(Folder(tmp_path).write("two", TWO))


def actions(envs: Any, *written: tuple[str | None, str | None]) -> NDArray[np.int64]:
    single = sd.make(envs.program)
    return np.stack([single.encode_action(one) for one in written])


def test_a_batch_of_all_seats_has_a_row_for_each(two: str) -> None:
    envs = sd.make_vec(two, 2, seats="all", autoreset_mode="Disabled")
    observation, _ = envs.reset(seed=1)
    assert (envs.num_envs, envs.num_games, envs.seat.tolist()) == (4, 2, [0, 1, 0, 1])
    assert envs.seat_names == ("agent", "bob")
    assert observation["image"].shape[0] == observation["tokens"].shape[0] == 4
    assert observation["image"][:, 3, 6, 3].tolist() == [0, 1, 0, 1], "the own cell tells the seat"
    played = actions(envs, (None, "Say hello"), ("forward", None), (None, None), (None, "Say bye"))
    _, reward, terminated, truncated, infos = envs.step(played)
    assert envs.utterances() == ["NA", "Ann: Say hello", "Bob: Say bye", "NA"]
    assert reward.round(3).tolist() == [0, -0.1, 0, 0.85], "a success for Bob alone in the second game"
    assert terminated.tolist() == [False, False, True, True]
    assert not truncated.any()
    assert infos["success"].tolist() == [False, False, False, True]


def test_a_seat_that_nobody_sits_on_is_played_by_its_frame(two: str) -> None:
    envs = sd.make_vec(two, 1, seats="all", autoreset_mode="Disabled")
    envs.reset(seed=1)
    still = actions(envs, (None, None), (None, None))
    envs.step(still)
    assert envs.utterances()[0] == "NA"
    envs.set_taken(np.array([True, False]))
    envs.step(still)
    assert envs.utterances()[0] == "Bob: Say hello"
    with pytest.raises(ValueError, match="agent's seat, which is always taken"):
        envs.set_taken(np.array([False, True]))
    with pytest.raises(ValueError, match="expected 2 booleans"):
        envs.set_taken(np.array([True]))


@pytest.mark.parametrize("name", NAMES, ids=lambda name: Path(name).stem)
def test_seats_that_are_left_are_those_of_a_scenario_with_one_player(name: str) -> None:
    """All seats but the agent's untaken, or none of them open to the caller: the same."""
    alone = sd.make_vec(name, 3, autoreset_mode="SameStep")
    together = sd.make_vec(name, 3, seats="all", autoreset_mode="SameStep")
    taken = together.seat == 0
    together.set_taken(taken)
    alone.reset(seed=5)
    together.reset(seed=5)
    rng = np.random.default_rng(0)
    for _ in range(40):
        played = rng.integers(
            0, together.single_action_space.nvec, (together.num_envs, *together.single_action_space.shape)
        )
        mine, yours = alone.step(played[taken]), together.step(played)
        for key, image in mine[0].items():
            np.testing.assert_array_equal(image, yours[0][key][taken])
        for one, other in zip(mine[1:4], yours[1:4], strict=True):
            np.testing.assert_array_equal(one, other[taken])
        assert alone.histories() == together.histories()[:: len(together.seat_names)]


class Greeter:
    """A policy that says hello, and notes when it begins anew."""

    def __init__(self, action: NDArray[np.int64]) -> None:
        self.action, self.begun = action, 0

    def reset(self, mask: NDArray[np.bool_], episodes: Any = None) -> None:
        self.begun += int(mask.sum())

    def act(self, observation: Any) -> NDArray[np.int64]:
        return np.tile(self.action, (len(observation["tokens"]), 1))


def test_a_policy_fills_a_seat(two: str) -> None:
    policy = Greeter(sd.make(two).unwrapped.encode_action((None, "Say hello")))
    envs = sd.make_vec(two, 3, seats={"bob": policy})
    envs.reset(seed=0)
    still = np.tile([7, 0, 0, 0], (3, 1))
    envs.step(still)
    assert envs.num_envs == 3
    assert envs.utterances() == ["Bob: Say hello"] * 3
    for _ in range(6):  # the horizon, and the step that begins again
        envs.step(still)
    assert policy.begun == 6


class Noting(Greeter):
    """Notes in which games it forgets, and in which it enters a room without forgetting."""

    def __init__(self, action: NDArray[np.int64]) -> None:
        super().__init__(action)
        self.notes: list[tuple[str, list[bool]]] = []

    def reset(self, mask: NDArray[np.bool_], episodes: Any = None) -> None:
        self.notes.append(("forgets", mask.tolist()))

    def enter(self, mask: NDArray[np.bool_]) -> None:
        self.notes.append(("enters", mask.tolist()))


@pytest.fixture
def in_sessions(tmp_path: Path) -> tuple[str, Noting]:
    text = TWO + 'let: {word: pick("hello" | "bye")}\nsession: {episodes: 3, same: word}\n'
    file = str(Folder(tmp_path).write("sessions", text))
    return file, Noting(sd.make(file).unwrapped.encode_action((None, "Say hello")))


def test_a_policy_on_a_seat_remembers_a_session(in_sessions: tuple[str, Noting]) -> None:
    file, policy = in_sessions
    env = sd.make(file, seats={"bob": policy})
    for reset in (
        {"seed": 4},  # a session begins
        {},  # and goes on
        {},
        {},  # the next one
        {},
        {"options": {"test_episode": 4}},  # the middle of another
        {"options": {"test_episode": 5}},  # which goes on
        {"options": {"test_episode": 5}},  # the same room again
        {"options": {"test_episode": 6}},
        {"seed": 4},
    ):
        env.reset(**reset)  # type: ignore[arg-type]
    told = [word for word, _ in policy.notes]
    first, second, middle = ["forgets", "enters", "enters"], ["forgets", "enters"], ["forgets", "enters"]
    assert told == [*first, *second, *middle, *["forgets"] * 3]


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_a_policy_in_many_games_remembers_the_session_of_each(
    in_sessions: tuple[str, Noting], mode: str
) -> None:
    file, policy = in_sessions
    envs = sd.make_vec(file, 2, seats={"bob": policy}, autoreset_mode=mode)
    envs.reset(seed=0)
    still, leaving = actions(envs, (None, None), (None, "Say bye"))
    for step in range(40):  # the second game ends at once now and then
        envs.step(np.stack([still, leaving if step % 5 == 0 else still]))
    for game in range(2):
        told = [word for word, mask in policy.notes if mask[game]]
        assert len(told) > 5
        assert told == (["forgets", "enters", "enters"] * len(told))[: len(told)]


@pytest.mark.parametrize("many", [True, False])
def test_a_policy_remembers_the_session_in_whose_middle_others_are_restored(
    in_sessions: tuple[str, Noting], many: bool
) -> None:
    """As a resumed run is: in other environments, which have begun with other episodes."""
    file, policy = in_sessions

    def made() -> Any:
        if many:
            return sd.make_vec(file, 2, seats={"bob": policy}, autoreset_mode="SameStep")
        return sd.make(file, seats={"bob": policy})

    def told_of_the_next(envs: Any) -> list[tuple[str, list[bool]]]:
        policy.notes = []
        while many and len(policy.notes) < 4:
            envs.step(np.tile([7, 0, 0, 0], (2, 1)))
        for _ in range(0 if many else 4):
            envs.reset()
        return policy.notes

    before, after = made(), made()
    before.reset(seed=4)
    told_of_the_next(before)  # until the middle of a session
    moment = before.snapshot()
    after.reset(seed=4)
    after.restore(moment)
    assert told_of_the_next(after) == told_of_the_next(before)


def test_nobody_on_a_seat_stays_and_is_silent(two: str) -> None:
    env = sd.make(two, seats={"bob": "nobody"}).unwrapped
    env.reset(seed=1)
    before = env.describe()["bob"]  # type: ignore[attr-defined]
    still = env.encode_action((None, None))  # type: ignore[attr-defined]
    scripted = sd.make(two, seats={"bob": "script"})
    scripted.reset(seed=1)
    assert scripted.step(still)[4]["utterance"] == "Bob: Say hello"
    for _ in range(3):
        *_, info = env.step(still)
        moment = env.seat_moment("bob")  # type: ignore[attr-defined]
        assert (info["utterance"], moment.did) == ("NA", "none")
    after = env.describe()["bob"]  # type: ignore[attr-defined]
    assert (after["at"], after["facing"]) == (before["at"], before["facing"])


def test_chance_on_a_seat_depends_on_the_episode_alone(two: str) -> None:
    heard = {}
    for count in (1, 3):
        envs = sd.make_vec(two, count, seats={"bob": "random"})
        envs.reset(seed=4)
        heard[count] = []
        for _ in range(12):
            envs.step(np.tile([7, 0, 0, 0], (count, 1)))
            heard[count].append(envs.utterances()[0])
    assert heard[1] == heard[3]
    assert len(set(heard[1])) > 1


def test_one_plays_another_member(two: str) -> None:
    env = sd.make(two, seats={"agent": "random"})
    env.reset(seed=2)
    *_, reward, terminated, _, info = env.step(env.unwrapped.encode_action((None, "Say bye")))
    assert (round(reward, 3), terminated, info["success"]) == (0.85, True, True)
    assert env.unwrapped.explain()["fired"], "the step is played again with all players"


def test_players_take_turns_from_game_to_game(two: str) -> None:
    """Of K players number g modulo K plays in game g, and meets nobody else's games."""
    single = sd.make(two).unwrapped
    one, other = (Greeter(single.encode_action((None, f"Say {word}"))) for word in ("hello", "bye"))
    envs = sd.make_vec(two, 7, seats={"bob": [one, "script", other]}, autoreset_mode="SameStep")
    envs.reset(seed=0)
    assert (one.begun, other.begun) == (3, 2)
    assert envs.partners == {"bob.0": one, "bob.2": other}
    still = np.tile([7, 0, 0, 0], (7, 1))
    *_, terminated, _, _ = envs.step(still)
    assert np.flatnonzero(terminated).tolist() == [2, 5], (
        "his own word ends the episode with a success for him"
    )
    assert (one.begun, other.begun) == (3, 4)
    assert [envs.utterances()[game] for game in (0, 1, 3, 4, 6)] == ["Bob: Say hello"] * 5
    with pytest.raises(ValueError, match="got 3 players that take turns; expected at most 2 games"):
        sd.make_vec(two, 2, seats={"bob": [one, "script", other]})


def test_the_caller_may_have_several_seats_beside_partners(tmp_path: Path) -> None:
    """The rows are those of all seats, without the partner's."""
    name = "together/commons_together"
    whole = sd.make_vec(name, 3, seats="all", autoreset_mode="SameStep")
    own = sd.make_vec(
        name, 3, seats={"agent": "caller", "cat": "caller", "bob": "script"}, autoreset_mode="SameStep"
    )
    kept = whole.seat != 1
    whole.set_taken(kept)
    assert own.seat_names == ("agent", "cat")
    assert own.seat.tolist() == whole.seat[kept].tolist() == [0, 2] * 3
    first, second = whole.reset(seed=3)[0], own.reset(seed=3)[0]
    rng = np.random.default_rng(0)
    for _ in range(50):
        for key, value in second.items():
            np.testing.assert_array_equal(value, first[key][kept])
        played = rng.integers(0, whole.single_action_space.nvec, (9, len(whole.single_action_space.nvec)))
        first, *theirs, infos = whole.step(played)
        second, *mine, own_infos = own.step(played[kept])
        for one, other in zip(theirs, mine, strict=True):
            np.testing.assert_array_equal(one[kept], other)
        assert infos.keys() == own_infos.keys()
        assert own.histories() == [
            text for text, is_own in zip(whole.histories(), kept, strict=True) if is_own
        ]
    with pytest.raises(ValueError, match="got agent, cat for the caller; expected one"):
        sd.make(name, seats={"agent": "caller", "cat": "caller"})


@pytest.mark.parametrize(
    ("seats", "message"),
    [
        ("each", "expected 'agent', 'all', or a mapping"),
        ({"rob": "script"}, "expected one of agent, bob; did you mean 'bob'"),
        ({"bob": "scirpt"}, "expected 'script', 'random', 'nobody' or a policy"),
        ({"bob": 3}, "a policy with `reset` and `act`"),
        ({"agent": "script"}, "the agent of two follows no frame"),
        ({"bob": "caller"}, "the agent of two follows no frame"),
        ({"bob": []}, "expected at least one player"),
        ({"bob": ["caller", "random"]}, "expected 'script', 'random', 'nobody' or a policy"),
        ({"agent": "random", "bob": "random"}, "expected one left for the actions of `step`"),
    ],
)
def test_a_seating_that_cannot_be(two: str, seats: Any, message: str) -> None:
    with pytest.raises(ValueError, match="seats") as raised:
        sd.make_vec(two, 2, seats=seats)
    assert message in str(raised.value)


def test_scenarios_with_different_seats_are_not_played_side_by_side(two: str) -> None:
    with pytest.raises(ValueError, match="different numbers"):
        sd.make_vec([two, "talkitout"], 2, seats="all")


def test_the_scripts_of_all_seats_solve_what_they_solve_alone() -> None:
    """What the frame of a member chose in its last turn, its player does in the next step."""
    envs = sd.make_vec("together/help_together+oracle", 20, seats="all", autoreset_mode="SameStep")
    envs.reset(seed=3)
    won = ended = 0
    for _ in range(60):
        *_, infos = envs.step(envs.scripted_actions())
        won, ended = (
            won + int(infos.get("success", np.zeros(1)).sum()),
            ended + int(infos.get("_success", np.zeros(1)).sum()),
        )
    assert ended > 40
    assert won > 0.95 * ended


def test_a_member_without_a_frame_has_no_script(tmp_path: Path) -> None:
    path = Folder(tmp_path).write("free", "cast: {bob: {at: [3, 3], seat: open}}")
    envs = sd.make_vec(str(path), 1, seats="all")
    envs.reset(seed=0)
    with pytest.raises(ValueError, match="of free follows no frame"):
        envs.scripted_actions()


@pytest.mark.parametrize("way", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_copies_play_on_alike(two: str, way: Any) -> None:
    for made in (
        sd.make_vec(two, 2, seats="all"),
        sd.make_vec(two, 2, seats={"bob": "random"}),
        sd.make_vec(two, 2, seats={"agent": "random"}),
    ):
        made.reset(seed=1)
        made.action_space.seed(0)
        made.step(made.action_space.sample())
        other = way(made)
        data = made.snapshot()
        for _ in range(9):
            played = made.action_space.sample()
            mine, yours = made.step(played), other.step(played)
            np.testing.assert_array_equal(mine[0]["image"], yours[0]["image"])
            assert made.histories() == other.histories()
        made.restore(data)


# -- PettingZoo ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES, ids=lambda name: Path(name).stem)
def test_pettingzoos_own_tests(name: str) -> None:
    parallel_api_test(sd.make_parallel(name), num_cycles=100)
    parallel_seed_test(lambda: sd.make_parallel(name), num_cycles=40)


def test_a_parallel_environment_is_what_a_batch_is(two: str) -> None:
    env, envs = sd.make_parallel(two), sd.make_vec(two, 1, seats="all", autoreset_mode="Disabled")
    observations, _ = env.reset(seed=9)
    batch, _ = envs.reset(seed=9)
    rng = np.random.default_rng(1)
    while env.agents:
        played = rng.integers(0, envs.single_action_space.nvec, (2, 4))
        found = env.step(dict(zip(env.agents, played, strict=True)))
        observations, rewards = found[:2]
        batch, reward, *_ = envs.step(played)
        for seat, name in enumerate(env.possible_agents):
            np.testing.assert_array_equal(observations[name]["image"], batch["image"][seat])
            assert rewards[name] == reward[seat]
    with pytest.raises(ValueError, match="outside of an episode"):
        env.step({})


def test_a_reset_of_no_game_begins_none_in_a_parallel_environment(two: str) -> None:
    """As in a single environment: an episode that has ended, or that there is not yet, cannot be played."""
    nobody = {"reset_mask": [False]}
    env, alone = sd.make_parallel(two), sd.make(two)
    done = np.array([7, 0, 0, 0])
    for steps in (0, 2, 6):
        for one in (env, alone) if steps else ():
            one.reset(seed=1)
        for _ in range(steps):
            env.step(dict.fromkeys(env.possible_agents, done))
            alone.step(done)
        env.reset(options=nobody)
        alone.reset(options=nobody)
        assert env.agents == (env.possible_agents if steps == 2 else [])
        if steps != 2:
            with pytest.raises(ValueError, match="outside of an episode"):
                env.step(dict.fromkeys(env.possible_agents, done))
            with pytest.raises(ValueError, match="outside of an episode"):
                alone.step(done)


def test_a_parallel_environment_asks_for_all_actions(two: str) -> None:
    env = sd.make_parallel(two)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="got actions of agent; expected actions of agent, bob"):
        env.step({"agent": np.zeros(4, np.int64)})
    for given in (None, 3, np.zeros((2, 4), np.int64)):
        with pytest.raises(ValueError, match="; expected actions of agent, bob"):
            env.step(given)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="a scenario"):
        sd.make_parallel("social_env")


def test_shipped_scenarios_have_several_seats() -> None:
    assert SHIPPED
    for name in SHIPPED:
        assert len(sd.make_parallel(name).possible_agents) > 1
