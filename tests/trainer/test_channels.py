"""Networks take the number of channels from the space, and checkpoints do not move between numbers."""

from pathlib import Path
from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.trainer.checkpoint import read, restore_net
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.errors import CheckpointError
from socialai_dsl.trainer.nets import NetSpec, build_net
from socialai_dsl.trainer.training import train

DATA = Path(__file__).parents[1] / "data"
PLAYROOM = str(DATA / "playroom.yaml")


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


@pytest.fixture
def shown(tmp_path: Path) -> str:
    """A scenario with all channels that there are, and the suite of it and one whose look has other words."""
    text = (DATA / "looks.yaml").read_text(encoding="utf-8")
    text = text.replace(
        "  hat: {",
        "  shoes: {for: cast, words: [boots, sandals]}\n  coat: {for: cast, words: [worn, folded]}\n  hat: {",
    )
    every = "type, color, status, orientation, pointing, last_act, pointing_right, pointing_ahead, carrying"
    text = text.replace(
        "observe: {", f"observe: {{channels: [{every}, size, pattern, mood, shoes, coat, hat], "
    )
    (tmp_path / "looks.yaml").write_text(text, encoding="utf-8")
    other = text.replace("[cap, hood], start: hood", "[cap, crown], start: crown").replace(
        "looks\n", "other\n"
    )
    (tmp_path / "other.yaml").write_text(other, encoding="utf-8")
    (tmp_path / "both.yaml").write_text("suite: both\nmembers: [looks.yaml, other.yaml]\n", encoding="utf-8")
    return str(tmp_path / "both.yaml")


@pytest.mark.parametrize(("net", "bonus"), [("fast", "cell"), ("paper", "none"), ("paper-reference", "none")])
def test_any_number_of_channels_can_be_learned_from(net: str, bonus: str, shown: str, tmp_path: Path) -> None:
    envs = sd.make_vec(shown, 4, autoreset_mode="SameStep")
    assert NetSpec.of(envs).image_shape == (7, 7, 16)
    settings = config(net).model_copy(update={"bonus": bonus})
    assert read(train(settings, envs, tmp_path / "run")).meta.image_shape == (7, 7, 16)


def test_a_map_of_too_many_channels_is_refused(shown: str) -> None:
    with pytest.raises(ValueError, match=r"net: relations keeps a map.*got 16 channels"):
        build_net("relations", NetSpec.of(sd.make_vec(shown, 4)), 0)
