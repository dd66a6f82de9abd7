"""A minibatch computes what plain re-encoding of every frame computes, in values and gradients, shared or not."""

from collections.abc import Iterator

import numpy as np
import pytest
import torch
from torch import Tensor

from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.frames import Batch
from socialai_dsl.trainer.minibatch import cut_out
from socialai_dsl.trainer.nets import ActorCritic
from socialai_dsl.trainer.nets.memory import emptied
from socialai_dsl.trainer.rollout import Rollout, collect
from socialai_dsl.trainer.session import Session
from tests.quick import one_in
from tests.trainer.fake_envs import EchoEnvs
from tests.trainer.plain import encode

STEPS, ENVS, STRETCH = 12, 6, 4


@pytest.fixture(autouse=True)
def double() -> Iterator[None]:
    torch.set_default_dtype(torch.float64)
    yield
    torch.set_default_dtype(torch.float32)


def play(net_name: str, distinct: bool) -> tuple[Session, Rollout, list[dict[str, np.ndarray]]]:
    """A rollout with a network of doubles, and what was observed (T items)."""
    envs = EchoEnvs(ENVS, length=12, chatter=0.7, pictures=3, lethal=False, limit=9)
    config = RunConfig(envs=ENVS, horizon=STEPS, bptt=STRETCH, minibatches=1, net=net_name, threads=1)
    session = Session.start(config, envs)
    session.actor.net.distinct = distinct
    collect(session)  # so that the next one begins in the middle of episodes
    state = session.state
    seen = [{"image": state.image.copy(), "tokens": state.tokens.copy()}]
    step = envs.step

    def note(actions: np.ndarray) -> object:
        result = step(actions)
        seen.append({key: value.copy() for key, value in result[0].items()})
        return result

    envs.step = note  # type: ignore[method-assign]
    return session, collect(session), seen[:-1]


def reference(net: ActorCritic, rollout: Rollout, seen: list[dict[str, np.ndarray]]) -> tuple[Tensor, Tensor]:
    """Logits (T, E, ...) and values (T, E), one frame after the other."""
    only = torch.tensor([0])
    logits, values = [], []
    for t, observation in enumerate(seen):
        if t % STRETCH == 0:
            memory = rollout.memories[t // STRETCH]
        memory = emptied(memory, rollout.forgets[t])
        features = [
            net.perceive(
                net.prepare(torch.from_numpy(image[None])), encode(net.dialogue, tokens)[None], only, only
            )
            for image, tokens in zip(observation["image"], observation["tokens"], strict=True)
        ]
        output, memory = net.memory.step(torch.cat(features), memory)
        for results, result in zip((logits, values), net.heads(output), strict=True):
            results.append(result)
    return torch.stack(logits), torch.stack(values)


def by_stretch(array: Tensor) -> Tensor:
    """(T, E, ...) in the order of a minibatch's frames."""
    return array.view(-1, STRETCH, *array.shape[1:]).transpose(0, 1).flatten(0, 2)


def furthest(one: Tensor, other: Tensor) -> float:
    """Largest difference in parts of the largest value."""
    return float((one - other).detach().abs().max() / other.detach().abs().max())


@pytest.mark.parametrize("distinct", [True, False], ids=["duplicates removed", "duplicates kept"])
@pytest.mark.parametrize("net_name", one_in(2, ["fast", "paper"], "computes convolutions"))
def test_agrees_with_reencoding_every_frame(net_name: str, distinct: bool) -> None:
    session, rollout, seen = play(net_name, distinct)
    net = session.actor.net
    assert rollout.forgets.any(), "episodes must begin within the rollout"
    assert max(np.count_nonzero(o["tokens"], axis=1).max() for o in seen) > 8, "histories must be long"
    zeros = torch.zeros(STEPS, ENVS)
    batch = Batch(rollout.actions, rollout.log_probs, rollout.values, zeros, zeros)
    minibatch = cut_out(session, rollout, batch, torch.arange(ENVS))
    shared = len(minibatch.stretches.image_index) < STEPS * ENVS
    assert shared == distinct, "duplicates must be removed exactly where that was asked for"

    expected = [by_stretch(array) for array in reference(net, rollout, seen)]
    ((_, (*got, _, _)),) = minibatch.evaluate(net)
    for one, other in zip(got, expected, strict=True):
        assert one.dtype == torch.float64
        assert furthest(one, other) < 1e-12
    assert furthest(by_stretch(rollout.values), expected[1]) < 1e-12, "acting streams the same values"

    weights = [torch.randn_like(array) for array in expected]
    parameters = dict(net.named_parameters())
    gradients = [
        torch.autograd.grad(
            sum(
                ((array * weight).sum() for array, weight in zip(outputs, weights, strict=True)), zeros.sum()
            ),
            list(parameters.values()),
            allow_unused=True,
        )
        for outputs in (got, expected)
    ]
    largest = max(float(gradient.abs().max()) for gradient in gradients[1] if gradient is not None)
    for name, one, other in zip(parameters, *gradients, strict=True):
        assert (one is None) == (other is None), name
        if one is not None:
            assert float((one - other).abs().max()) < 1e-12 * largest, name
