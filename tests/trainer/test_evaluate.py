"""Evaluation plays each test episode once, whoever plays beside it, and policies do what they say."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from socialai_dsl.episodes import EvalResult, RandomPolicy, ScriptedPolicy, wilson_interval
from socialai_dsl.evaluation import evaluate_policy
from socialai_dsl.trainer.checkpoint import write
from socialai_dsl.trainer.play import CheckpointPolicy
from socialai_dsl.trainer.session import Session
from tests.trainer.fake_envs import EchoEnvs

DISABLED = AutoresetMode.DISABLED
SIZES = (4, 2, 2, 4)


class Log(EchoEnvs):
    """Notes which test episodes were begun."""

    def __init__(self, num_envs: int) -> None:
        super().__init__(num_envs, mode=DISABLED)
        self.begun: list[int] = []

    def reset(self, *, seed: Any = None, options: Any = None) -> Any:
        if options:
            numbers = np.asarray(options["test_episode"])
            self.begun += numbers[options.get("reset_mask", np.ones(self.num_envs, np.bool_))].tolist()
        return super().reset(seed=seed, options=options)


def test_the_script_solves_every_test_episode() -> None:
    envs = EchoEnvs(16, mode=DISABLED)
    result = evaluate_policy(ScriptedPolicy(envs), envs, 40)
    assert (result.episodes, result.success_rate, result.success_rate_se) == (40, 1.0, 0.0)
    assert result.success_interval[1] == 1.0
    assert result.mean_length == 3
    assert result.mean_return == pytest.approx(1 - 0.9 * 3 / 6)
    assert result.outcomes == {"right": 1.0, "left": 0.0, "time_out": 0.0}
    assert result.rules == {"speaks": 1.0}, "the script speaks once an episode"


def test_each_episode_is_played_once() -> None:
    envs = Log(16)
    result = evaluate_policy(RandomPolicy(SIZES), envs, 40)
    assert sorted(envs.begun) == list(range(40))
    assert envs.counters()["episodes"] == 40, "nothing else is played"
    assert len(result.success) == len(result.lengths) == len(result.returns) == 40
    assert (result.lengths >= 1).all()
    assert (result.lengths <= 6).all()
    assert sum(result.outcomes.values()) == pytest.approx(1)
    assert result.success_rate == result.success.mean() == pytest.approx(result.outcomes["right"])
    rate = result.success_rate
    assert result.success_rate_se == pytest.approx((rate * (1 - rate) / 40) ** 0.5)
    assert (result.returns[~result.success] == 0).all()
    assert result.rules["speaks"] == envs.counters()["rules"]["speaks"] / 40


def equal(one: EvalResult, other: EvalResult) -> bool:
    pairs = [(one.success, other.success), (one.outcome, other.outcome), (one.lengths, other.lengths)]
    return all((a == b).all() for a, b in pairs) and (one.rules, one.names) == (other.rules, other.names)


@pytest.mark.parametrize("kind", ["random", "script", "sampled", "greedy", "normalised"])
def test_a_result_does_not_depend_on_how_many_are_played_together(
    kind: str, checkpoint: Path, tmp_path: Path, small_config: Any
) -> None:
    def play(together: int) -> EvalResult:
        envs = EchoEnvs(together, mode=DISABLED, chatter=0.3)
        if kind == "random":
            return evaluate_policy(RandomPolicy(SIZES, seed=5), envs, 40)
        if kind == "script":
            return evaluate_policy(ScriptedPolicy(envs), envs, 40)
        path = checkpoint
        if kind == "normalised":
            config = small_config(net="paper-reference")
            path = write(tmp_path / "normalised", Session.start(config, EchoEnvs(8)).checkpoint())
        policy = CheckpointPolicy.load(path, envs, greedy=kind == "greedy", seed=5)
        return evaluate_policy(policy, envs, 40)

    results = [play(together) for together in (1, 7, 40)]
    assert equal(results[0], results[1])
    assert equal(results[0], results[2])


def test_another_seed_samples_other_actions() -> None:
    def play(seed: int) -> EvalResult:
        return evaluate_policy(RandomPolicy(SIZES, seed), EchoEnvs(8, mode=DISABLED), 40)

    assert equal(play(1), play(1))
    assert not equal(play(1), play(2))


@pytest.mark.parametrize(
    ("envs", "episodes", "message"),
    [
        (EchoEnvs(2, mode=DISABLED), 0, "episodes: got 0"),
        (EchoEnvs(9, mode=DISABLED), 8, "envs: got 9 of them for 8 episodes"),
        (EchoEnvs(2), 8, "expected Disabled"),
    ],
)
def test_what_cannot_be_evaluated_is_refused(envs: EchoEnvs, episodes: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        evaluate_policy(RandomPolicy(SIZES), envs, episodes)


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        # By hand: z² = 3.8415, centre (0 + 3.8415 / 20) / 1.38415, half as much.
        (0, 10, 0.0, 0.27753),
        (10, 10, 0.72247, 1.0),
        # Centre (0.5 + 0.19207) / 1.38415 = 0.5; half sqrt(0.25 * 0.38415 + 0.038415 * 0.96037) / 1.38415 = 0.26341.
        (5, 10, 0.23659, 0.76341),
        # Newcombe 1998, table I: 15 of 148 and 81 of 263.
        (15, 148, 0.0624, 0.1605),
        (81, 263, 0.2553, 0.3662),
    ],
)
def test_wilson_interval(successes: int, trials: int, low: float, high: float) -> None:
    assert wilson_interval(successes, trials) == (
        pytest.approx(low, abs=5e-5),
        pytest.approx(high, abs=5e-5),
    )


@pytest.mark.parametrize(("successes", "trials"), [(0, 0), (3, 2), (-1, 2)])
def test_wilson_interval_needs_trials(successes: int, trials: int) -> None:
    with pytest.raises(ValueError, match="successes of"):
        wilson_interval(successes, trials)


def test_random_actions_cover_the_space() -> None:
    policy = RandomPolicy(SIZES, seed=1)
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
    assert (policy._memory[1] == 0).all()
    assert (policy._memory[[0, 2, 3]] == before[[0, 2, 3]]).all()
    assert (before != 0).any()


def test_one_observation_alone_gets_one_action(checkpoint: Path) -> None:
    envs = EchoEnvs(1)
    observation, _ = envs.reset(seed=0)
    policy = CheckpointPolicy.load(checkpoint, envs, seed=3)
    many = policy.act(observation)
    again = CheckpointPolicy.load(checkpoint, envs, seed=3)
    alone = again.act({name: value[0] for name, value in observation.items()})
    assert (many.shape, alone.shape) == ((1, 4), (4,))
    assert (many[0] == alone).all()


def test_a_policy_without_a_mask_forgets_everything(checkpoint: Path) -> None:
    envs = EchoEnvs(4)
    policy = CheckpointPolicy.load(checkpoint, envs)
    policy.act(envs.reset(seed=0)[0])
    assert (policy._memory != 0).any()
    policy.reset()
    assert len(policy._memory) == 4
    assert (policy._memory == 0).all()


def test_playing_leaves_the_statistics_of_normalisation_alone(tmp_path: Path, small_config: Any) -> None:
    path = write(tmp_path, Session.start(small_config(net="paper-reference"), EchoEnvs(8)).checkpoint())
    envs = EchoEnvs(8, mode=DISABLED)
    policy = CheckpointPolicy.load(path, envs)
    before = {name: value.clone() for name, value in policy.net.state_dict().items()}
    assert any("running_mean" in name for name in before)
    evaluate_policy(policy, envs, 16)
    assert all((value == before[name]).all() for name, value in policy.net.state_dict().items())
