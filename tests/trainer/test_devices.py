"""On a graphics card the same code runs: nothing mixes tensors of the computer with those of the card.

Where there is no card, one is pretended; its arithmetic is tested where there is one.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from gymnasium.vector import AutoresetMode

from socialai_dsl.evaluation import evaluate_policy
from socialai_dsl.trainer.checkpoint import read
from socialai_dsl.trainer.play import CheckpointPolicy
from socialai_dsl.trainer.training import train
from tests.quick import one_in
from tests.trainer.fake_envs import EchoEnvs
from tests.trainer.pretend import DevicesMixed, PretendedCard


@pytest.mark.parametrize("net", one_in(3, ["fast", "paper", "paper-reference"], "computes convolutions"))
def test_training_on_a_card_moves_everything_there(net: str, tmp_path: Path, small_config: Any) -> None:
    """It also does the same arithmetic as on the CPU, because the pretended card computes there."""
    settings = {
        "net": net,
        "bonus": "lang",
        "guide": "script",
        "bptt": 4,
        "frames": 64 * 3,
        "checkpoint_every": 1,
    }

    def stop(seen: Mapping[str, Any]) -> None:
        if seen["update"] == 2:
            raise KeyboardInterrupt

    here = read(train(small_config(**settings), EchoEnvs(8, chatter=0.3), tmp_path / "here"))
    # PyTorch for CPUs has no cuDNN, which it would look for.
    with torch.backends.cudnn.flags(enabled=False), PretendedCard() as card:
        config = small_config(**settings, device="cuda")
        with pytest.raises(KeyboardInterrupt):
            train(config, EchoEnvs(8, chatter=0.3), tmp_path / "there", stop)
        path = train(config, EchoEnvs(8, chatter=0.3), tmp_path / "there", resume=True)
        envs = EchoEnvs(8, mode=AutoresetMode.DISABLED)
        evaluate_policy(CheckpointPolicy.load(path, envs, device="cuda"), envs, 8)
    assert card.moved["there"] > 0
    there = read(path)
    for name, value in here.tensors.items():
        assert torch.equal(there.tensors[name], value), name


def test_the_pretended_card_refuses_what_a_real_one_does() -> None:
    with PretendedCard():
        here, there = torch.ones(3), torch.ones(3).to("cuda")
        assert there.device.type == "cuda"
        assert (there + there).device.type == "cuda"
        assert torch.zeros_like(there).device.type == "cuda"
        assert there.cpu().device.type == "cpu"
        with pytest.raises(DevicesMixed):
            here + there
        with pytest.raises(DevicesMixed):
            here[there.long()]
        with pytest.raises(TypeError, match="numpy"):
            there.numpy()
        assert np.array_equal(there.cpu().numpy(), [1, 1, 1])


@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no graphics card here")
@pytest.mark.parametrize("net", ["fast", "paper", "paper-reference"])
def test_a_real_card_learns_what_the_cpu_does(net: str, tmp_path: Path, small_config: Any) -> None:
    """A card rounds otherwise, so the first update's figures are close, and later ones drift apart."""
    figures = {}
    for device in ("cpu", "cuda"):
        config = small_config(net=net, bonus="lang", guide="script", frames=64 * 3, device=device)
        path = train(config, EchoEnvs(8, chatter=0.3), tmp_path / device)
        first = json.loads((tmp_path / device / "metrics.jsonl").read_text().splitlines()[0])
        figures[device] = {name: first[name] for name in ("loss", "value_loss", "entropy", "imitation_loss")}
        envs = EchoEnvs(8, mode=AutoresetMode.DISABLED)
        assert evaluate_policy(CheckpointPolicy.load(path, envs, device=device), envs, 8).episodes == 8
    assert figures["cuda"] == pytest.approx(figures["cpu"], rel=1e-3, abs=1e-4)
