"""The peers of `socialai bench --train` are the same networks as ours, written plainly, and they learn."""

from collections.abc import Iterator
from importlib.util import find_spec
from types import SimpleNamespace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium import spaces
from torch import Tensor, nn

from benchmarks.training import LongDialogue, clean_loop, plain_loop
from benchmarks.training.networks import SIZE, Agent, CellTrunk, PaperTrunk
from benchmarks.training.settings import Settings, advantages, observe, padded
from socialai_dsl.trainer.nets import ActorCritic, NetSpec, build_net
from socialai_dsl.trainer.nets.dialogue import prefix_tree
from socialai_dsl.trainer.ppo import compute_gae

SPEC = NetSpec((8, 2, 4, 16), (7, 7, 4), (12, 5, 3, 3), tuple(map(str, range(40))))
NEEDS_SB3 = pytest.mark.skipif(find_spec("sb3_contrib") is None, reason="sb3-contrib is not installed")


class RaisedHand(gym.vector.VectorEnv):
    """Primitive 2 is worth 1, all others nothing; episodes last three steps, and "go on" is heard in the second."""

    def __init__(self, num_envs: int) -> None:
        self.num_envs, self.earned = num_envs, [0.0]
        high = np.broadcast_to(np.array([12, 5, 3, 3], np.uint8), (7, 7, 4))
        self.single_observation_space = spaces.Dict(
            image=spaces.Box(np.zeros((7, 7, 4), np.uint8), high, dtype=np.uint8),
            tokens=spaces.Box(0, 3, (8,), np.int16),
        )
        self.single_action_space = spaces.MultiDiscrete([4, 2, 2, 3])
        self.program = SimpleNamespace(vocabulary=["<pad>", "<unk>", "go", "on"])
        self._clock = np.arange(num_envs) % 3

    def _observe(self) -> dict[str, Any]:
        tokens = np.zeros((self.num_envs, 8), np.int16)
        tokens[self._clock == 1, :2] = (2, 3)
        image = np.zeros((self.num_envs, 7, 7, 4), np.uint8)
        image[:, 3, 5] = (4, 1, 0, 2)
        return {"image": image, "tokens": tokens}

    def reset(self, **options: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        return self._observe(), {}

    def step(self, actions: Any) -> tuple[Any, ...]:
        assert actions.shape == (self.num_envs, 4)
        reward = (actions[:, 0] == 2).astype(np.float64)
        self.earned.append(float(reward.mean()))
        self._clock = (self._clock + 1) % 3
        ended = self._clock == 0
        return self._observe(), reward, ended, np.zeros_like(ended), {}


class SmallTrunk(nn.Module):
    """A perception that costs next to nothing."""

    def __init__(self, *_: Any, **__: Any) -> None:
        super().__init__()
        self.layer = nn.Linear(2, SIZE)

    def forward(self, images: Tensor, tokens: Tensor) -> Tensor:
        return torch.tanh(
            self.layer(torch.stack((images.float().mean((1, 2, 3)), tokens.float().mean(1)), 1))
        )


def recurrent_ppo(envs: Any, settings: Settings, trunk: Any) -> Iterator[None]:
    from benchmarks.training.recurrent_ppo import train

    return train(envs, settings, trunk)


def plain(envs: Any, settings: Settings, trunk: Any) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plain_loop, "PaperTrunk", trunk)
        training = plain_loop.train(envs, settings)
        next(training)  # a generator runs its first lines with the first update
    return training


LOOPS = [
    pytest.param(plain, 0, id="plain"),
    pytest.param(clean_loop.train, 8, id="clean"),
    pytest.param(recurrent_ppo, 8, id="recurrent_ppo", marks=NEEDS_SB3),
]


@pytest.mark.parametrize(("train", "words"), LOOPS)
@pytest.mark.thorough("trains each peer")
def test_learns_what_pays(train: Any, words: int) -> None:
    torch.manual_seed(0)
    envs = RaisedHand(16)
    training = train(envs, Settings(16, 20, 2, words), SmallTrunk)
    next(training)
    before = np.mean(envs.earned[-20:])
    for _ in range(60):
        next(training)
        if np.mean(envs.earned[-20:]) > 0.6:
            break
    assert before < 0.5
    assert np.mean(envs.earned[-20:]) > 0.6


@pytest.mark.parametrize(("train", "words"), LOOPS)
@pytest.mark.parametrize("trunk", [PaperTrunk, CellTrunk])
@pytest.mark.thorough("trains each peer")
def test_gradients_reach_every_weight(train: Any, words: int, trunk: type[nn.Module]) -> None:
    made: list[tuple[nn.Module, dict[str, Tensor]]] = []

    def make(*arguments: Any, **keywords: Any) -> nn.Module:
        if trunk is CellTrunk:
            keywords.pop("batch_norm", None)
        module = trunk(*arguments, **keywords)
        made.append((module, {name: value.clone() for name, value in module.named_parameters()}))
        return module

    torch.manual_seed(0)
    training = train(RaisedHand(4), Settings(4, 20, 1, words), make)
    next(training)
    ((module, before),) = made
    for name, value in module.named_parameters():
        assert torch.isfinite(value).all(), name
        assert not torch.equal(value, before[name]), f"{name} has not moved"


def parameters(module: nn.Module) -> int:
    return sum(parameter.numel() for parameter in module.parameters())


def test_the_networks_have_the_sizes_of_ours() -> None:
    paper = Agent(PaperTrunk(SPEC.vocabulary_size, SPEC.image_shape, batch_norm=True), SPEC.action_sizes)
    assert parameters(paper) == parameters(build_net("paper-reference", SPEC, 0)) == 1_097_503
    fast = Agent(CellTrunk(SPEC.vocabulary_size, SPEC.image_shape), SPEC.action_sizes)
    assert parameters(fast) == parameters(build_net("fast", SPEC, 0))


def frames(count: int) -> tuple[Tensor, np.ndarray]:
    rng = np.random.default_rng(0)
    images = rng.integers(0, np.array(SPEC.image_high) + 1, (count, 7, 7, 4)).astype(np.uint8)
    tokens = np.zeros((count, 9), np.int16)
    for row, length in zip(tokens, rng.integers(0, 9, count), strict=True):
        row[:length] = rng.integers(1, SPEC.vocabulary_size, length)
    return torch.from_numpy(images), tokens


def ours(net: ActorCritic, images: Tensor, tokens: np.ndarray) -> Tensor:
    tree = prefix_tree(tokens)
    return net.perceive(
        net.prepare(images), net.dialogue(tree), torch.arange(len(images)), torch.arange(len(images))
    )


def copy(targets: dict[str, Tensor], sources: list[Tensor]) -> None:
    with torch.no_grad():
        for (name, target), source in zip(targets.items(), sources, strict=True):
            assert target.shape == source.shape, name
            target.copy_(source)


def test_the_paper_s_network_sees_what_ours_sees() -> None:
    net = build_net("paper", SPEC, 0).double()
    plain_net = PaperTrunk(SPEC.vocabulary_size, SPEC.image_shape).double()
    target = dict(plain_net.named_parameters())
    source = [value for name, value in net.named_parameters() if not name.startswith(("memory", "heads"))]
    copy(target, source)
    images, tokens = frames(6)
    got = plain_net(images, torch.from_numpy(tokens.astype(np.int64)))
    assert torch.allclose(got, ours(net, images, tokens), rtol=0, atol=1e-10)


def test_the_fast_network_sees_what_ours_sees() -> None:
    net: Any = build_net("fast", SPEC, 0).double()
    plain_net = CellTrunk(SPEC.vocabulary_size, SPEC.image_shape).double()
    dialogue = list(net.dialogue.parameters())
    with torch.no_grad():
        net.mentions.normal_()
    rest = [*net.film.parameters(), *net.cells.parameters(), *net.words.parameters()]
    copy(dict(plain_net.named_parameters()), [net.mentions, *dialogue, *net.channels, *rest])
    images, tokens = frames(6)
    got = plain_net(images, torch.from_numpy(tokens.astype(np.int64)))
    assert torch.allclose(got, ours(net, images, tokens), rtol=0, atol=1e-10)


def test_the_newest_words_are_kept() -> None:
    rows = np.array([[1, 2, 3, 4, 5, 0], [1, 2, 0, 0, 0, 0]], np.int16)
    assert padded(rows, 3).tolist() == [[3, 4, 5], [1, 2, 0]]
    assert padded(rows, 8).tolist() == [[1, 2, 3, 4, 5, 0, 0, 0], [1, 2, 0, 0, 0, 0, 0, 0]]
    images = np.zeros((2, 7, 7, 4), np.uint8)
    assert observe({"image": images, "tokens": rows}, 0)[1].tolist() == [[1, 2, 3, 4, 5], [1, 2, 0, 0, 0]]


def test_advantages_are_those_of_the_trainer() -> None:
    rewards, values, last = torch.rand(5, 3), torch.rand(5, 3), torch.rand(3)
    ends = torch.rand(5, 3) < 0.3
    expected = compute_gae(rewards, values, last, ends, torch.zeros(5, 3), 0.99, 0.9)
    assert torch.allclose(advantages(rewards, values, ends.float(), last, 0.9), expected, atol=1e-6)


def test_long_dialogue_grows_line_by_line_and_begins_anew() -> None:
    envs = LongDialogue(RaisedHand(64), words=16)
    tokens = envs.reset()[0]["tokens"]
    assert envs.single_observation_space["tokens"].shape == (16,)
    lengths = []
    for _ in range(200):
        ids = envs.history_ids()
        before, tokens = tokens, envs.step(np.zeros((64, 4), np.int64))[0]["tokens"]
        grew = np.count_nonzero(tokens, axis=1) - np.count_nonzero(before, axis=1)
        assert set(grew.tolist()) <= {0, 4, -12}, (
            "a line is four words, and after sixteen the first is the only one"
        )
        kept = (before == tokens) | (before == 0)
        assert kept[grew >= 0].all(), "what was heard stays"
        assert ((envs.history_ids() == ids) == (grew == 0)).all()
        lengths.append(np.count_nonzero(tokens, axis=1).mean())
    assert len(set(envs.history_ids().tolist())) == 64
    assert 8 <= np.mean(lengths) <= 12
