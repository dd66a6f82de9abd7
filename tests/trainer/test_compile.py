"""`compile` changes how the network reads images and dialogue, and not what it makes of them."""

import functools
from pathlib import Path
from typing import Any

import pytest
import torch

from tests.trainer.fake_envs import EchoEnvs
from trainer.checkpoint import read
from trainer.config import TrainConfig
from trainer.nets import NetSpec, best_precision, build_net
from trainer.train import train

pytestmark = pytest.mark.filterwarnings("ignore:The .grad attribute of a Tensor that is not a leaf")
"""PyTorch's own, where a compiled function goes on behind a part that was not compiled."""

SPEC = NetSpec((8, 2, 4, 16), (7, 7, 4), (12, 5, 3, 3), ("<pad>", "<unk>", *"abcdefgh"))
NETS = (("fast", "float32"), ("paper", "float32"), ("paper", "bfloat16"), ("paper-reference", "float32"))


@pytest.fixture
def traced(monkeypatch: pytest.MonkeyPatch) -> None:
    """torch.compile as it traces and differentiates, without the compiler behind it, which takes half a minute."""
    monkeypatch.setattr(torch, "compile", functools.partial(torch.compile, backend="aot_eager"))


def features(net: Any, count: int) -> tuple[torch.Tensor, dict[str, torch.Tensor]]:
    """What a network makes of some pairs, and the gradients of their sum of squares."""
    high = torch.tensor(SPEC.image_high) + 1
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(count)
        images = (torch.rand(count, 7, 7, 4) * high).to(torch.uint8)
        text = torch.randn(3, net.dialogue.size)
    index = torch.arange(count)
    net.zero_grad()
    found: torch.Tensor = net.perceive(net.prepare(images), text, index, index % 3)
    found.square().sum().backward()
    return found.detach(), {name: p.grad for name, p in net.named_parameters() if p.grad is not None}


@pytest.mark.usefixtures("traced")
@pytest.mark.parametrize(("name", "precision"), NETS)
def test_features_and_gradients_are_the_same(name: str, precision: Any) -> None:
    if precision == "bfloat16" and best_precision(name, "cpu") != "bfloat16":
        pytest.skip("this processor has no bfloat16")
    plain, compiled = (build_net(name, SPEC, 0, precision) for _ in range(2))
    compiled.compile_perception()
    for count in (5, 9, 4):
        (one, slopes), (other, others) = features(plain, count), features(compiled, count)
        assert torch.allclose(one, other, rtol=1e-4, atol=1e-5), count
        assert slopes.keys() == others.keys()
        for part, slope in slopes.items():
            assert torch.allclose(slope, others[part], rtol=1e-3, atol=1e-4 * float(slope.abs().max())), part


def difference(one: Path, other: Path) -> float:
    """How far the weights of two checkpoints are apart, in parts of their length.

    Single weights tell little: Adam takes a whole step where a gradient is nothing but rounding.
    """
    first, second = (
        torch.cat(
            [
                t.double().flatten()
                for name, t in sorted(read(path).tensors.items())
                if name.startswith("net.")
            ]
        )
        for path in (one, other)
    )
    return float((first - second).norm() / first.norm())


@pytest.mark.usefixtures("traced")
def test_training_is_the_same_to_rounding(tmp_path: Path, small_config: Any) -> None:
    plain, compiled = (
        train(small_config(frames=64 * 3, compile=c), EchoEnvs(8, chatter=0.3), tmp_path / str(c))
        for c in (False, True)
    )
    assert difference(plain, compiled) < 1e-4


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.filterwarnings(
    "ignore:.*script_method:DeprecationWarning"
)  # PyTorch's own, when its compiler is loaded
@pytest.mark.parametrize("threads", [1, 2])
def test_training_with_the_compiler_is_the_same_to_rounding(
    tmp_path: Path, small_config: Any, threads: int
) -> None:
    plain, compiled = (
        train(
            small_config(frames=64 * 3, compile=c, threads=threads),
            EchoEnvs(8, chatter=0.3),
            tmp_path / str(c),
        )
        for c in (False, True)
    )
    assert difference(plain, compiled) < 1e-4


def test_where_nothing_can_be_compiled_it_is_refused_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_function: Any) -> Any:
        def fail(_tensor: Any) -> Any:
            raise RuntimeError("no C++ compiler found\nand a long story")

        return fail

    monkeypatch.setattr(torch, "compile", broken)
    config = TrainConfig(frames=64, num_envs=8, horizon=8, compile=True, threads=1)
    with pytest.raises(
        ValueError, match=r"^compile: torch.compile does not work here: no C\+\+ compiler found$"
    ):
        train(config, EchoEnvs(8), tmp_path)
