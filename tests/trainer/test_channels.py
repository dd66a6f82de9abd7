"""Networks take the number of channels from the space, and checkpoints do not move between numbers."""

from pathlib import Path
from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.trainer.checkpoint import read, restore_net
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.errors import CheckpointError
from socialai_dsl.trainer.nets import NetSpec
from socialai_dsl.trainer.training import train

PLAYROOM = str(Path(__file__).parents[1] / "data" / "playroom.yaml")


def config(net: str) -> RunConfig:
    values: dict[str, Any] = {"frames": 64, "envs": 4, "horizon": 8, "minibatches": 2, "epochs": 1}
    return RunConfig(net=net, tensorboard=False, threads=1, **values)


@pytest.mark.parametrize("net", ["fast", "paper", "paper-reference"])
def test_six_channels_can_be_learned_from(net: str, tmp_path: Path) -> None:
    envs = sd.make_vec(PLAYROOM, 4, autoreset_mode="SameStep")
    spec = NetSpec.of(envs)
    assert spec.image_shape == (7, 7, 6)
    assert spec.image_high[4:] == (255, 255)
    checkpoint = read(train(config(net), envs, tmp_path))
    assert checkpoint.meta.image_shape == (7, 7, 6)
    other = sd.make_vec("talkitout", 4)
    spec_of_sizes = NetSpec.of(other)
    actions = type(spec_of_sizes)(
        spec.action_sizes, spec_of_sizes.image_shape, spec_of_sizes.image_high, spec.vocabulary
    )
    with pytest.raises(CheckpointError, match=r"for images \(7, 7, 6\), but the scenario has \(7, 7, 4\)"):
        restore_net(checkpoint, actions)
