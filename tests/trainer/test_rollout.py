"""Rollouts record what happened, and shared encodings equal those of each frame on its own."""

from math import tanh
from typing import Any

import numpy as np
import pytest
import torch

from socialai_dsl.trainer.bonus import BatchStep
from socialai_dsl.trainer.errors import ObservationError, TrainingStopped
from socialai_dsl.trainer.features import Actor
from socialai_dsl.trainer.nets import NetSpec, build_net
from socialai_dsl.trainer.nets.memory import emptied
from socialai_dsl.trainer.rollout import Rollout, collect
from socialai_dsl.trainer.session import Session
from tests.quick import one_in
from tests.trainer.fake_envs import EchoEnvs
from tests.trainer.plain import encode


class Witness(EchoEnvs):
    """Remembers everything it was asked and gave."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.seen: list[dict[str, np.ndarray]] = []
        self.steps: list[tuple[Any, ...]] = []

    def reset(self, **options: Any) -> Any:
        observation, infos = super().reset(**options)
        self.seen.append({key: value.copy() for key, value in observation.items()})
        return observation, infos

    def step(self, actions: np.ndarray) -> Any:
        result = super().step(actions)
        self.seen.append({key: value.copy() for key, value in result[0].items()})
        self.steps.append((actions.copy(), *result[1:]))
        return result


def play(config: Any, envs: EchoEnvs, rollouts: int = 1) -> tuple[Session, Rollout]:
    session = Session.start(config, envs)
    for _ in range(rollouts):
        rollout = collect(session)
    return session, rollout


@pytest.mark.parametrize("episodes", [1, 2, 3])
@pytest.mark.parametrize("returns", ["session", "episode"])
def test_memory_and_returns_last_a_session(episodes: int, returns: str, small_config: Any) -> None:
    envs = EchoEnvs(8, limit=2)
    envs.program.session = episodes
    session = Session.start(small_config(returns=returns, bootstrap_timeouts=True), envs)
    session.bonus = told = Remembers()  # type: ignore[assignment]
    rollouts = [collect(session) for _ in range(3)]
    forgets, over = (torch.cat([getattr(one, name) for one in rollouts]) for name in ("forgets", "ended"))
    ended = torch.from_numpy(np.stack([step.ended for step in told.steps]))
    assert ended.sum() > 8 * episodes
    before = torch.cat((torch.zeros(1, 8), ended.cumsum(0)[:-1]))  # episodes that have ended
    begins = torch.cat((torch.ones(1, 8, dtype=torch.bool), ended[:-1]))
    assert torch.equal(forgets, begins & (before % episodes == 0))
    assert torch.equal(over, ended & (ended.cumsum(0) % episodes == 0) if returns == "session" else ended)
    bootstrap = torch.cat([one.bootstrap for one in rollouts])
    assert (bootstrap[~over] == 0).all(), "the next episode's value stands for what is to come there"
    assert (bootstrap[over] != 0).any()
    for rollout in rollouts:  # what is remembered is not empty, but where a session begins
        assert torch.equal(rollout.memories[0].flatten(1).abs().sum(1) == 0, rollout.forgets[0])


def test_what_is_recorded_is_what_happened(small_config: Any) -> None:
    envs = Witness(8)
    session, rollout = play(small_config(), envs)
    for t, (actions, reward, terminated, truncated, _) in enumerate(envs.steps):
        assert (rollout.actions[t].numpy() == actions).all()
        assert (rollout.rewards[t].numpy() == reward.astype(np.float32)).all()
        assert (rollout.ended[t].numpy() == (terminated | truncated)).all()
        if t + 1 < len(envs.steps):
            assert torch.equal(rollout.forgets[t + 1], rollout.ended[t])
        pairs = session.actor.pairs.data[rollout.pair_rows[t]]
        assert (session.actor.images.data[pairs[:, 0]] == envs.seen[t]["image"]).all()
        assert (session.actor.histories.data[pairs[:, 1]] == envs.seen[t]["tokens"]).all()
    assert rollout.forgets[0].all()
    assert (session.state.starts == rollout.ended[-1].numpy()).all()
    assert rollout.tally.episodes == rollout.ended.sum() == envs.counters()["episodes"]
    assert rollout.tally.timeouts == sum(step[3].sum() for step in envs.steps)
    assert rollout.tally.successes == envs.counters()["outcomes"]["right"]
    assert rollout.tally.total_length + session.state.lengths.sum() == rollout.ended.numel()
    assert rollout.tally.total_return + session.state.returns.sum() == pytest.approx(
        rollout.rewards.sum().item()
    )


@pytest.mark.parametrize("net", ["fast", "paper", "relations"])
@pytest.mark.parametrize("length", one_in(2, [8, 40], "computes convolutions"))
def test_values_equal_those_of_a_plain_recurrent_loop(net: str, length: int, small_config: Any) -> None:
    """No sharing, no streaming: one frame at a time, histories from the first word, memory emptied at starts."""
    envs = Witness(8, length=length, chatter=0.5, limit=10, lethal=False)
    session, rollout = play(small_config(net=net, horizon=24), envs)
    model = session.actor.net
    memory = model.memory.initial(8)
    seen = np.zeros((8, model.sight.size), np.int64)
    with torch.no_grad():
        for t in range(24):
            seen[rollout.forgets[t].numpy()] = 0
            envs.seen[t]["image"], seen = model.sight.look(
                envs.seen[t]["image"], envs.seen[t]["tokens"], seen
            )
            features = torch.stack([plain_features(model, envs.seen[t], e) for e in range(8)])
            memory = emptied(memory, rollout.forgets[t])
            output, memory = model.memory.step(features, memory)
            logits, values = model.heads(output)
            assert torch.allclose(values, rollout.values[t], atol=1e-5), f"step {t}"
            first = torch.log_softmax(logits[:, :4], 1).gather(1, rollout.actions[t][:, :1])
            assert torch.allclose(first, rollout.log_probs[t][:, :1], atol=1e-5), f"step {t}"


def plain_features(model: Any, observation: dict[str, np.ndarray], e: int) -> torch.Tensor:
    text = encode(model.dialogue, observation["tokens"][e])[None]
    image, only = torch.from_numpy(observation["image"][e : e + 1].copy()), torch.zeros(1, dtype=torch.int64)
    features: torch.Tensor = model.perceive(model.prepare(image), text, only, only)[0]
    return features


def test_time_outs_are_bootstrapped_with_the_value_of_their_last_observation(small_config: Any) -> None:
    envs = Witness(8, limit=4)
    config = small_config(bootstrap_timeouts=True)
    session, rollout = play(config, envs)
    model, memory = session.actor.net, session.actor.net.memory.initial(8)
    checked = 0
    with torch.no_grad():
        for t in range(config.horizon):
            memory = emptied(memory, rollout.forgets[t])
            features = torch.stack([plain_features(model, envs.seen[t], e) for e in range(8)])
            _, memory = model.memory.step(features, memory)
            for e in np.flatnonzero(envs.steps[t][3]):
                final = plain_features(model, envs.steps[t][4]["final_obs"], int(e))
                _, value = model.heads(model.memory.step(final[None], memory[e : e + 1])[0])
                assert rollout.bootstrap[t, e].item() == pytest.approx(value.item(), abs=1e-5)
                checked += 1
    assert checked > 0
    assert (rollout.bootstrap != 0).sum() == checked
    _, terminal = play(small_config(), EchoEnvs(8, limit=4))
    assert terminal.tally.timeouts > 0
    assert (terminal.bootstrap == 0).all()


class Remembers:
    """A bonus that keeps what it is told."""

    def __init__(self) -> None:
        self.steps: list[BatchStep] = []

    def step(self, step: BatchStep) -> np.ndarray:
        copied = [array.copy() for array in step[1:7]]
        self.steps.append(BatchStep(step.envs, *copied, step.config, step.progress))
        return np.full(8, 0.5)


def test_a_bonus_is_told_where_time_ran_out(small_config: Any) -> None:
    session = Session.start(small_config(), EchoEnvs(8, limit=4))
    session.bonus = told = Remembers()  # type: ignore[assignment]
    rollout = collect(session)
    assert sum(step.late.sum() for step in told.steps) == rollout.tally.timeouts > 0
    assert all((step.ended | ~step.late).all() for step in told.steps)


def test_a_bonus_is_told_what_was_played_and_paid_and_when(small_config: Any) -> None:
    """In the third of four updates, with a scale that has gone half the way to its end."""

    config = small_config(frames=8 * 8 * 4, bonus_c=4.0, bonus_c_end=0.0, guide="script", guide_share=1.0)
    envs = EchoEnvs(8)
    session = Session.start(config, envs)
    session.update, session.bonus = 2, Remembers()  # type: ignore[assignment]
    rollout = collect(session)
    steps = session.bonus.steps  # type: ignore[union-attr]
    assert torch.equal(torch.from_numpy(np.stack([step.actions for step in steps])), rollout.actions)
    paid = torch.from_numpy(np.stack([step.rewards for step in steps]).astype(np.float32))
    assert torch.allclose(paid + 0.5, rollout.rewards)
    assert torch.equal(torch.from_numpy(np.stack([step.ended for step in steps])), rollout.ended)
    assert sum(step.success.sum() for step in steps) == envs.counters()["outcomes"]["right"] > 0
    assert {(step.progress, step.config.bonus_c) for step in steps} == {(0.5, 2.0)}
    assert (steps[-1].image == session.state.image).all()


def test_an_end_in_the_last_moment_beats_the_time_out(small_config: Any) -> None:
    class Both(EchoEnvs):
        def step(self, actions: np.ndarray) -> Any:
            observation, reward, terminated, truncated, infos = super().step(actions)
            return observation, reward, terminated | truncated, terminated | truncated, infos

    _, rollout = play(small_config(bootstrap_timeouts=True), Both(8, limit=4))
    assert rollout.ended.any()
    assert (rollout.bootstrap == 0).all()
    assert rollout.tally.timeouts == 0


def test_batch_normalisation_counts_each_observation_once(small_config: Any) -> None:
    """Neither the value after a rollout's last step nor that of a time-out's last observation counts again."""
    config = small_config(net="paper-reference", bootstrap_timeouts=True)
    session, rollout = play(config, EchoEnvs(8, limit=4), rollouts=2)
    assert rollout.bootstrap.any()
    norms = [part for part in session.actor.net.modules() if isinstance(part, torch.nn.BatchNorm2d)]
    assert {int(norm.num_batches_tracked) for norm in norms} == {16}, "two rollouts of eight steps"


def test_the_bonus_is_paid_on_top_and_does_not_count_as_return(small_config: Any) -> None:
    config = small_config(bonus="lang")
    envs = Witness(8)
    session, rollout = play(config, envs)
    paid = rollout.rewards.numpy() - np.array([step[1] for step in envs.steps])
    assert paid.max() == pytest.approx(0.6 * tanh(7 / 40)), "the paper's bonus for a first visit"
    assert rollout.tally.bonus == pytest.approx(paid.mean())
    returns = rollout.tally.total_return + session.state.returns.sum()
    assert returns == pytest.approx(sum(step[1].sum() for step in envs.steps))


@pytest.mark.parametrize("poison", ["image", "tokens"])
def test_observations_outside_their_bounds_are_refused(poison: str, small_config: Any) -> None:
    envs = EchoEnvs(8)
    session = Session.start(small_config(), envs)
    envs.poison = poison
    with pytest.raises(ObservationError, match=poison):
        collect(session)


def test_a_reward_that_is_not_finite_stops_the_run(small_config: Any) -> None:
    envs = EchoEnvs(8)
    session = Session.start(small_config(), envs)
    envs.poison = "reward"
    with pytest.raises(TrainingStopped, match="reward"):
        collect(session)


def test_ids_may_be_left_to_the_actor() -> None:
    envs = EchoEnvs(5, chatter=0.5, length=8)
    net = build_net("fast", NetSpec.of(envs), 0)
    given, own = Actor(net, 8), Actor(net, 8)
    observation, _ = envs.reset(seed=0)
    for _ in range(12):
        ids = (envs.image_ids(), envs.history_ids())
        one, other = (
            given.see(observation["image"], observation["tokens"], ids),
            own.see(**named(observation)),
        )
        assert torch.equal(one[1], other[1])
        observation, *_ = envs.step(np.tile([3, 0, 0, 0], (5, 1)))


def named(observation: dict[str, np.ndarray]) -> dict[str, Any]:
    return {"images": observation["image"], "tokens": observation["tokens"]}
