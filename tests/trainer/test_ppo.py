"""Advantages and losses have the values worked out by hand."""

import copy
from concurrent.futures import ThreadPoolExecutor
from math import exp, log
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.frames import Batch
from socialai_dsl.trainer.minibatch import cut_out
from socialai_dsl.trainer.ppo import compute_gae, estimate_advantages, ppo_loss, update
from socialai_dsl.trainer.rollout import collect
from socialai_dsl.trainer.session import Session
from tests.trainer.fake_envs import EchoEnvs

SIZES = (2, 2, 2, 2)
ENTROPY = 0.01


def column(*numbers: float) -> Tensor:
    return torch.tensor(numbers, dtype=torch.float64)[:, None]


def flags(*marks: int) -> Tensor:
    return torch.tensor(marks, dtype=torch.bool)[:, None]


def gae(rewards: Tensor, values: Tensor, ended: Tensor, bootstrap: Tensor) -> list[float]:
    next_value = torch.tensor([8.0], dtype=torch.float64)
    return compute_gae(rewards, values, next_value, ended, bootstrap, 0.5, 0.5).flatten().tolist()


def test_gae_without_an_end() -> None:
    # deltas: 1 + .5*2 - 4 = -2; 0 + .5*6 - 2 = 1; 2 + .5*8 - 6 = 0; weight of the next one .25
    got = gae(column(1, 0, 2), column(4, 2, 6), flags(0, 0, 0), column(0, 0, 0))
    assert got == [-2 + 0.25 * 1, 1.0, 0.0]


def test_gae_stops_at_an_end() -> None:
    # deltas: -2; 0 + 0 - 2 = -2 (the episode is over); 0
    got = gae(column(1, 0, 2), column(4, 2, 6), flags(0, 1, 0), column(0, 0, 0))
    assert got == [-2 + 0.25 * -2, -2.0, 0.0]


def test_a_bootstrapped_time_out_continues_the_value_but_not_the_sum() -> None:
    # delta of the cut step: 0 + .5*10 - 2 = 3; nothing of the next episode flows back
    got = gae(column(1, 0, 2), column(4, 2, 6), flags(0, 1, 0), column(0, 10, 0))
    assert got == [-2 + 0.25 * 3, 3.0, 0.0]


def one_frame(speaks: bool, advantage: float, acting: float, now: float) -> tuple[Batch, Tensor]:
    """A frame whose every head chose option 1, then with probability `acting`, now with `now`."""
    logits = torch.tensor([[log(1 - now), log(now)] * 4])
    batch = Batch(
        actions=torch.tensor([[1, int(speaks), 1, 1]]),
        log_probs=torch.full((1, 4), log(acting)),
        values=torch.tensor([1.0]),
        advantages=torch.tensor([advantage]),
        returns=torch.tensor([3.0]),
    )
    return batch, logits


def entropy_of(p: float) -> float:
    return -(p * log(p) + (1 - p) * log(1 - p))


def config(**changes: Any) -> RunConfig:
    return RunConfig(**({"value_coef": 0.5, "clip": 0.2} | changes))


def test_joint_loss_of_a_spoken_action() -> None:
    batch, logits = one_frame(True, advantage=-2.0, acting=0.5, now=0.6)
    parts = ppo_loss(batch, logits, torch.tensor([1.5]), SIZES, config())
    ratio = 1.2**4
    assert parts.policy_loss.item() == pytest.approx(2 * ratio, rel=1e-5), (
        "a bad action's growing ratio is not clipped"
    )
    assert parts.value_loss.item() == pytest.approx(1.5**2)
    entropy = (2 + 0.6 * 2) * entropy_of(0.6)  # something is said, a template and a noun, in 0.6 of the cases
    assert parts.entropy.item() == pytest.approx(entropy, rel=1e-5)
    assert parts.loss.item() == pytest.approx(2 * ratio + 0.5 * 2.25 - ENTROPY * entropy, rel=1e-5)
    assert parts.clip_fraction.item() == 1
    assert parts.approx_kl.item() == pytest.approx(ratio - 1 - log(ratio), rel=1e-4)


def test_joint_loss_clips_a_good_action_s_ratio() -> None:
    batch, logits = one_frame(True, advantage=2.0, acting=0.5, now=0.6)
    assert ppo_loss(batch, logits, torch.tensor([1.5]), SIZES, config()).policy_loss.item() == pytest.approx(
        -2 * 1.2
    )


def test_silence_leaves_template_and_noun_out() -> None:
    batch, _ = one_frame(False, advantage=-2.0, acting=0.5, now=0.6)
    logits = torch.tensor([[log(0.4), log(0.6), log(0.6), log(0.4), log(0.2), log(0.8), log(0.9), log(0.1)]])
    logits.requires_grad_()
    parts = ppo_loss(batch, logits, torch.tensor([1.5]), SIZES, config(entropy_coef=0.0))
    assert parts.policy_loss.item() == pytest.approx(2 * (0.6 / 0.5) ** 2, rel=1e-5)
    parts.loss.backward()  # type: ignore[no-untyped-call]
    assert logits.grad is not None
    assert (logits.grad[0, 4:] == 0).all(), "what was not said must not be learnt from"
    assert (logits.grad[0, :4] != 0).all()


@pytest.mark.parametrize("sizes", [(3, 2, 2, 4), (2, 2, 1, 1)])
def test_the_entropy_is_that_of_all_actions(sizes: tuple[int, int, int, int]) -> None:
    """Every action is enumerated; where nothing is said, all templates and nouns are one action.

    So is the gradient, but for one part: that there is much to say does not pay for saying any of it.
    """
    generator = torch.Generator().manual_seed(0)
    logits = torch.randn(5, sum(sizes), generator=generator, dtype=torch.float64).requires_grad_()
    batch = Batch(
        torch.ones(5, 4, dtype=torch.int64).minimum(torch.tensor(sizes) - 1),
        torch.zeros(5, 4, dtype=torch.float64),
        *torch.zeros(3, 5, dtype=torch.float64),
    )
    settings = config(value_coef=0.0, entropy_coef=1.0)
    parts = ppo_loss(batch, logits, torch.zeros(5, dtype=torch.float64), sizes, settings)
    first, speak, template, noun = (part.softmax(1) for part in logits.split(list(sizes), 1))
    silent = first * speak[:, :1]
    spoken = torch.einsum("na,nb,nc->nabc", first * speak[:, 1:], template, noun)
    joint = torch.cat((silent, spoken.flatten(1)), 1)  # (N, actions)
    assert torch.allclose(joint.sum(1), torch.ones(5, dtype=torch.float64))
    expected = -(joint * joint.log()).sum(1).mean()
    assert parts.entropy.item() == pytest.approx(expected.item(), rel=1e-12)
    (got,) = torch.autograd.grad(parts.loss, logits)
    to_say = -(template * template.log()).sum(1) - (noun * noun.log()).sum(1)  # (N,)
    paid = (speak[:, 1] * to_say.detach()).mean()
    (wanted,) = torch.autograd.grad(paid - expected, logits)
    assert torch.allclose(got, wanted, rtol=0, atol=1e-12)


USED = torch.tensor([[1, 1], [1, 0], [0, 0]], dtype=torch.float32)
"""The first template has two slots, the second the first of them, the third none."""


def test_the_entropy_with_several_slots_is_that_of_all_actions_too() -> None:
    """Every action is enumerated: silence, and each template with all words for the slots that it has.

    Neither the words of a slot pay for a template that has it, nor all that can be said for speaking.
    """
    generator = torch.Generator().manual_seed(0)
    sizes = (3, 2, 3, 4, 2)
    logits = torch.randn(5, sum(sizes), generator=generator, dtype=torch.float64).requires_grad_()
    batch = Batch(
        torch.tensor([[0, 1, t % 3, 3, 1] for t in range(5)]),
        torch.zeros(5, 5, dtype=torch.float64),
        *torch.zeros(3, 5, dtype=torch.float64),
    )
    settings = config(value_coef=0.0, entropy_coef=1.0)
    zeros = torch.zeros(5, dtype=torch.float64)
    parts = ppo_loss(batch, logits, zeros, sizes, settings, USED)
    first, speak, template, what, whom = (part.softmax(1) for part in logits.split(list(sizes), 1))
    said = [
        torch.einsum("nb,nc->nbc", what, whom).flatten(1) * template[:, :1],
        what * template[:, 1:2],
        template[:, 2:],
    ]
    spoken = torch.einsum("na,nb->nab", first * speak[:, 1:], torch.cat(said, 1)).flatten(1)
    joint = torch.cat((first * speak[:, :1], spoken), 1)  # (N, 3 + 3 * 13)
    assert joint.shape[1] == 42
    assert torch.allclose(joint.sum(1), torch.ones(5, dtype=torch.float64))
    expected = -(joint * joint.log()).sum(1).mean()
    assert parts.entropy.item() == pytest.approx(expected.item(), rel=1e-12)
    of_template, of_what, of_whom = (-(part * part.log()).sum(1) for part in (template, what, whom))
    words = (template * torch.stack((of_what + of_whom, of_what, torch.zeros_like(of_what)), 1).detach()).sum(
        1
    )
    paid = speak[:, 1].detach() * words + speak[:, 1] * (of_template + words).detach()  # (N,)
    (got,) = torch.autograd.grad(parts.loss, logits)
    (wanted,) = torch.autograd.grad(paid.mean() - expected, logits)
    assert torch.allclose(got, wanted, rtol=0, atol=1e-12)


@pytest.mark.parametrize("loss", ["joint", "per_head"])
def test_a_slot_that_the_template_lacks_is_not_learnt_from(loss: Any) -> None:
    """Whatever the head for it said, the loss is the same, and pushes it nowhere but by its entropy."""
    sizes = (3, 2, 3, 4, 2)
    logits = torch.randn(1, sum(sizes), generator=torch.Generator().manual_seed(0)).requires_grad_()

    def of(word: int) -> torch.Tensor:
        batch = Batch(torch.tensor([[0, 1, 1, 2, word]]), torch.full((1, 5), -1.0), *torch.ones(3, 1) * 2)
        return ppo_loss(batch, logits, torch.ones(1), sizes, config(loss=loss, entropy_coef=0.0), USED).loss

    assert of(0).item() == of(1).item()
    (gradient,) = torch.autograd.grad(of(0), logits)
    assert (gradient[0, -2:] == 0).all()
    assert (gradient[0, :12].abs() > 0).any()


def test_per_head_loss_masks_and_averages_each_head() -> None:
    batch, _ = one_frame(False, advantage=2.0, acting=0.5, now=0.6)
    logits = torch.tensor(
        [[log(0.4), log(0.6), log(0.45), log(0.55), log(0.2), log(0.8), log(0.9), log(0.1)]]
    )
    batch = batch._replace(log_probs=torch.tensor([[log(0.5), log(0.5), log(0.5), log(0.5)]]))
    parts = ppo_loss(batch, logits, torch.tensor([1.5]), SIZES, config(loss="per_head"))
    primitive, speak = -2 * min(1.2, 1.2), -2 * (0.45 / 0.5)
    entropies = entropy_of(0.6) + entropy_of(0.55)
    expected = (primitive + speak) / 4 + 0.5 * 2.25 * 2 / 4 - 0.01 * entropies / 4
    assert parts.loss.item() == pytest.approx(expected, rel=1e-5)


def test_clipped_value_loss_takes_the_worse_of_the_two() -> None:
    batch, logits = one_frame(True, advantage=0.0, acting=0.5, now=0.5)
    parts = ppo_loss(batch, logits, torch.tensor([2.5]), SIZES, config(clip_value=True))
    assert parts.value_loss.item() == pytest.approx((1.2 - 3) ** 2), (
        "acting value 1, change clipped to 0.2, return 3"
    )


def test_per_head_value_loss_weighs_frames_by_the_heads_that_took_part() -> None:
    """A spoken and a silent frame: four and two heads of eight carry their clipped value errors."""
    spoken, logits = one_frame(True, advantage=0.0, acting=0.5, now=0.5)
    silent, _ = one_frame(False, advantage=0.0, acting=0.5, now=0.5)
    batch = Batch(
        torch.cat((spoken.actions, silent.actions)),
        torch.cat((spoken.log_probs, silent.log_probs)),
        values=torch.tensor([1.0, 1.0]),
        advantages=torch.tensor([0.0, 0.0]),
        returns=torch.tensor([3.0, 1.5]),
    )
    settings = config(loss="per_head", clip_value=True)
    parts = ppo_loss(batch, logits.expand(2, -1), torch.tensor([2.5, 0.5]), SIZES, settings)
    clipped = (1.2 - 3) ** 2  # worse than (2.5 - 3) ** 2
    plain = (0.5 - 1.5) ** 2  # worse than (0.8 - 1.5) ** 2
    assert parts.value_loss.item() == pytest.approx((4 * clipped + 2 * plain) / 8)
    entropies = 6 * log(2) / 8
    assert parts.loss.item() == pytest.approx(0.5 * parts.value_loss.item() - 0.01 * entropies)


@pytest.mark.parametrize(
    ("advantage", "now", "expected"),
    [
        (2.0, 0.7, -2 * 1.2),  # ratio 1.4 of a good action: clipped
        (2.0, 0.3, -2 * 0.6),  # ratio 0.6 of a good action: not clipped
        (-2.0, 0.7, 2 * 1.4),  # ratio 1.4 of a bad action: not clipped
        (-2.0, 0.3, 2 * 0.8),  # ratio 0.6 of a bad action: clipped
    ],
)
def test_each_head_clips_its_own_ratio(advantage: float, now: float, expected: float) -> None:
    batch, logits = one_frame(True, advantage, acting=0.5, now=now)
    parts = ppo_loss(batch, logits, torch.tensor([3.0]), SIZES, config(loss="per_head"))
    assert parts.policy_loss.item() == pytest.approx(expected, rel=1e-5), "the mean of four equal heads"


def played(config: RunConfig, voice: str = "voice") -> tuple[Session, Any]:
    envs = EchoEnvs(config.envs, length=8, chatter=0.4, voice=voice)
    session = Session.start(config, envs)
    for _ in range(2):
        rollout = collect(session)
    return session, rollout


@pytest.mark.parametrize("bptt", [0, 4])
@pytest.mark.parametrize("net", ["fast", "paper", "relations"])
def test_the_update_sees_the_policy_that_acted(net: str, bptt: int, small_config: Any) -> None:
    """Before the first step the minibatch gives the log-probabilities and values recorded while acting."""
    config = small_config(net=net, bptt=bptt)
    session, rollout = played(config)
    batch = estimate_advantages(config, rollout)
    for envs in (torch.tensor([0, 3, 5]), torch.tensor([1, 2, 4, 6, 7])):
        minibatch = cut_out(session, rollout, batch, envs)
        ((_, (logits, values, _, _)),) = minibatch.evaluate(session.actor.net)
        assert torch.allclose(values, minibatch.batch.values, atol=1e-5)
        parts = ppo_loss(minibatch.batch, logits, values, session.actor.net.spec.action_sizes, config)
        assert parts.approx_kl.item() == pytest.approx(0, abs=1e-6)
        assert parts.clip_fraction.item() == 0


def test_minibatches_hold_whole_environments_in_time_order(small_config: Any) -> None:
    config = small_config(bptt=4)
    session, rollout = played(config)
    marks = torch.arange(config.horizon)[:, None] * 100.0 + torch.arange(config.envs)
    batch = estimate_advantages(config, rollout)._replace(advantages=marks)
    minibatch = cut_out(session, rollout, batch, torch.tensor([5, 2]))
    got = minibatch.batch.advantages.view(4, 4)
    assert got.tolist() == [
        [t * 100.0 + 5, t * 100.0 + 2, (t + 4) * 100.0 + 5, (t + 4) * 100.0 + 2] for t in range(4)
    ]
    assert torch.equal(minibatch.stretches.memory[:2], rollout.memories[0][[5, 2]])
    assert torch.equal(minibatch.stretches.memory[2:], rollout.memories[1][[5, 2]])


def test_an_update_makes_the_better_action_likelier(small_config: Any) -> None:
    config = small_config(normalize_advantages=False, entropy_coef=0.0, value_coef=0.0, epochs=3)
    session, rollout = played(config)
    favoured = rollout.actions[..., 0] == 2
    rollout.rewards[:] = favoured.float()
    rollout.values.zero_()
    rollout.next_value.zero_()
    rollout.ended[:] = True
    before = rollout.log_probs[..., 0][favoured].mean().item()
    update(session, rollout)
    group = torch.arange(config.envs)
    minibatch = cut_out(session, rollout, estimate_advantages(config, rollout), group)
    ((_, (logits, *_)),) = minibatch.evaluate(session.actor.net)
    chosen = torch.log_softmax(logits[:, :4], 1)[:, 2].view(rollout.values.shape)[favoured]
    assert chosen.mean().item() > before


@pytest.mark.parametrize("net", ["fast", "paper", "relations"])
def test_a_step_is_adam_s_on_the_clipped_gradient(net: str, small_config: Any) -> None:
    """The same step by PyTorch's plain means: backward, clip, unfused Adam."""
    config = small_config(net=net, minibatches=1, epochs=1, max_grad_norm=0.01)
    session, rollout = played(config)
    model = session.actor.net
    twin = copy.deepcopy(model)
    optimizer = torch.optim.Adam(twin.parameters(), lr=config.lr, eps=config.adam_eps, foreach=False)
    statistics = update(session, rollout)

    gains = compute_gae(
        rollout.rewards, rollout.values, rollout.next_value, rollout.ended, rollout.bootstrap, 0.99, 0.95,
    )  # fmt: skip
    scaled = (gains - gains.mean()) / (gains.std(correction=0) + 1e-8)
    batch = Batch(rollout.actions, rollout.log_probs, rollout.values, scaled, gains + rollout.values)
    everything = cut_out(session, rollout, batch, torch.arange(8))
    ((_, (logits, values, _, _)),) = everything.evaluate(twin)
    loss = ppo_loss(everything.batch, logits, values, model.spec.action_sizes, config)
    loss.loss.backward()  # type: ignore[no-untyped-call]
    norm = torch.nn.utils.clip_grad_norm_(twin.parameters(), config.max_grad_norm)
    optimizer.step()
    assert statistics["grad_norm"] == pytest.approx(norm.item(), rel=1e-4)
    for (name, got), expected in zip(model.named_parameters(), twin.parameters(), strict=True):
        assert got.grad is not None
        assert expected.grad is not None
        assert got.grad.stride() == got.stride(), (
            f"{name}: fused Adam needs gradients laid out like the weights"
        )
        scale = expected.grad.norm() + 1e-6
        assert (got.grad - expected.grad).norm() < 1e-3 * scale, f"{name}: gradient"
        assert (got - expected).abs().max() < 2e-5, f"{name}: step"


def test_statistics_are_finite_and_complete(small_config: Any) -> None:
    config = small_config()
    session, rollout = played(config)
    statistics = update(session, rollout)
    assert set(statistics) == {
        "loss", "policy_loss", "value_loss", "entropy", "approx_kl", "clip_fraction", "imitation_loss", "grad_norm",
        "explained_variance", "learning_rate",
    }  # fmt: skip
    assert statistics.pop("imitation_loss") is None, "nobody showed anything"
    assert np.isfinite(list(statistics.values())).all()
    assert 0 < statistics["entropy"] <= log(4) + log(2) + log(2) + log(4) + 1e-6
    assert exp(statistics["approx_kl"]) < 2


@pytest.mark.parametrize(("target", "steps", "scale"), [(None, 6, 1.0), (1e-5, 1, 0.5), (1e6, 6, 1.0)])
def test_the_step_that_leaves_the_trust_region_is_taken_back(
    target: float | None, steps: int, scale: float, small_config: Any
) -> None:
    session, rollout = played(small_config(epochs=3, target_kl=target))
    before = [parameter.detach().clone() for parameter in session.actor.net.parameters()]
    update(session, rollout)
    made = {int(state["step"]) for state in session.optimizer.state.values()}
    assert made == {steps}, "the first step finds the policy as it acted"
    assert session.step_scale == scale
    kept = [torch.equal(*pair) for pair in zip(before, session.actor.net.parameters(), strict=True)]
    assert all(kept) == (steps == 1), "the one step was taken back"


def test_steps_get_longer_again_up_to_the_schedule(small_config: Any) -> None:
    session, rollout = played(small_config(target_kl=1e6, lr=1e-3))
    session.step_scale = 0.7
    rates = [update(session, rollout)["learning_rate"] for _ in range(3)]
    assert rates == pytest.approx([0.7e-3, 0.875e-3, 1e-3])


@pytest.mark.parametrize(
    ("net", "voice"),
    [("fast", "voice"), ("paper", "voice"), ("relations", "voice"), ("relations", "<Voice>")],
)
def test_threads_can_share_a_network(
    net: str, voice: str, small_config: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pass over a minibatch sets no attribute of the network or its parts, which another thread would meet."""
    config = small_config(net=net)
    session, rollout = played(config, voice)
    minibatch = cut_out(session, rollout, estimate_advantages(config, rollout), torch.arange(config.envs))

    def refuse(module: torch.nn.Module, name: str, value: object) -> None:
        raise AssertionError(f"{type(module).__name__}.{name} was set")

    monkeypatch.setattr(torch.nn.Module, "__setattr__", refuse)
    assert len(list(minibatch.evaluate(session.actor.net))) == 1


def test_threads_make_the_step_that_one_makes(small_config: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("socialai_dsl.trainer.nets.ActorCritic.smallest_share", 1)
    nets = []
    for threads in (1, 2):
        session, rollout = played(small_config(minibatches=1, epochs=1, threads=threads))
        with ThreadPoolExecutor(threads) as pool:
            update(session, rollout, pool.map)
        nets.append(session.actor.net)
    for (name, one), other in zip(nets[0].named_parameters(), nets[1].parameters(), strict=True):
        assert one.grad is not None, name
        assert other.grad is not None, name
        assert torch.allclose(one.grad, other.grad, rtol=1e-4, atol=1e-6), f"{name}: the shares do not add up"
