"""Evaluation plays each test episode once, and policies do what they say."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.trainer.fake_envs import EchoEnvs
from trainer.checkpoint import write
from trainer.evaluate import evaluate
from trainer.policies import CheckpointPolicy, RandomPolicy, ScriptedPolicy
from trainer.session import Session


class Log(EchoEnvs):
    """Notes which test episodes were asked for."""

    def __init__(self, num_envs: int) -> None:
        super().__init__(num_envs)
        self.asked: list[list[int]] = []

    def reset(self, *, seed: Any = None, options: Any = None) -> Any:
        if options:
            self.asked.append(list(options["test_episode"]))
        return super().reset(seed=seed, options=options)


def test_the_script_solves_every_test_episode() -> None:
    envs = EchoEnvs(16)
    result = evaluate(ScriptedPolicy(envs), envs, 40)
    assert (result.episodes, result.success_rate, result.success_rate_se) == (40, 1.0, 0.0)
    assert result.mean_length == 3
    assert result.mean_return == pytest.approx(1 - 0.9 * 3 / 6)
    assert result.outcomes == {"right": 1.0, "left": 0.0, "time_out": 0.0}


def test_each_episode_is_played_once_in_waves() -> None:
    envs = Log(16)
    result = evaluate(RandomPolicy((4, 2, 2, 4)), envs, 40)
    assert envs.asked == [list(range(16)), list(range(16, 32)), [*range(32, 40), *[0] * 8]]
    assert len(result.success) == len(result.lengths) == len(result.returns) == 40
    assert (result.lengths >= 1).all()
    assert (result.lengths <= 6).all()
    assert sum(result.outcomes.values()) == pytest.approx(1)
    assert result.success_rate == result.success.mean() == pytest.approx(result.outcomes["right"])
    rate = result.success_rate
    assert result.success_rate_se == pytest.approx((rate * (1 - rate) / 40) ** 0.5)
    assert (result.returns[~result.success] == 0).all()


def test_the_number_of_environments_does_not_matter_to_a_script() -> None:
    for count in (1, 7, 64):
        envs = EchoEnvs(count)
        assert evaluate(ScriptedPolicy(envs), envs, 20).mean_length == 3


def test_at_least_one_episode_is_needed() -> None:
    with pytest.raises(ValueError, match="episodes: got 0"):
        evaluate(RandomPolicy((4, 2, 2, 4)), EchoEnvs(2), 0)


def test_random_actions_cover_the_space() -> None:
    policy = RandomPolicy((4, 2, 2, 4), seed=1)
    actions = policy.act({"tokens": np.zeros((500, 4))})
    assert actions.dtype == np.int64
    assert [sorted(set(column.tolist())) for column in actions.T] == [
        [0, 1, 2, 3],
        [0, 1],
        [0, 1],
        [0, 1, 2, 3],
    ]
    assert 0.4 < actions[:, 1].mean() < 0.6


@pytest.fixture
def checkpoint(tmp_path: Path, small_config: Any) -> Path:
    return write(tmp_path, Session.start(small_config(), EchoEnvs(8)).checkpoint())


def actions_of(policy: CheckpointPolicy, envs: EchoEnvs, steps: int) -> np.ndarray:
    observation, _ = envs.reset(seed=0)
    policy.reset(np.ones(envs.num_envs, np.bool_))
    taken = []
    for _ in range(steps):
        taken.append(policy.act(observation))
        observation, _, terminated, truncated, _ = envs.step(taken[-1])
        policy.reset(terminated | truncated)
    return np.stack(taken)


def test_equal_seeds_act_alike_and_greedy_ignores_the_seed(checkpoint: Path) -> None:
    def act(**options: Any) -> np.ndarray:
        envs = EchoEnvs(6)
        return actions_of(CheckpointPolicy.load(checkpoint, envs, **options), envs, 12)

    assert (act(seed=1) == act(seed=1)).all()
    assert (act(seed=1) != act(seed=2)).any()
    assert (act(seed=1, greedy=True) == act(seed=2, greedy=True)).all()


def test_forgetting_an_episode_affects_its_environment_only(checkpoint: Path) -> None:
    envs = EchoEnvs(4)
    observation, _ = envs.reset(seed=0)
    policy = CheckpointPolicy.load(checkpoint, envs, greedy=True)
    policy.reset(np.ones(4, np.bool_))
    policy.act(observation)
    before = policy._memory.clone()
    policy.reset(np.array([False, True, False, False]))
    assert (policy._memory[:, 1] == 0).all()
    assert (policy._memory[:, [0, 2, 3]] == before[:, [0, 2, 3]]).all()
    assert (before != 0).any()
