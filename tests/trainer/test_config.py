"""Configurations are checked, survive JSON, and the presets are the published ones."""

from pathlib import Path

import pytest
import yaml

import trainer
from trainer.config import RESUMABLE_FIELDS, TrainConfig, paper_preset, paper_tuned_preset


def test_the_defaults_are_the_settings_that_worked() -> None:
    config = TrainConfig()
    assert (config.num_envs, config.horizon, config.epochs, config.minibatches) == (256, 32, 4, 4)
    assert (config.lr, config.gamma, config.gae_lambda, config.clip) == (7e-4, 0.99, 0.95, 0.2)
    assert (config.entropy_coef, config.max_grad_norm, config.normalize_advantages) == (0.01, 0.5, True)
    assert not config.bootstrap_timeouts


def test_the_paper_s_preset() -> None:
    config = paper_preset(seed=3)
    assert (config.lr, config.adam_eps, config.gae_lambda, config.bptt) == (1e-4, 1e-5, 0.99, 10)
    assert config.frames_per_update == 640
    assert config.updates == 46_875
    assert (config.loss, config.clip_value, config.seed) == ("per_head", True, 3)
    tuned = paper_tuned_preset()
    assert (tuned.bptt, tuned.adam_eps) == (5, 1e-8)


def test_updates_are_rounded_up() -> None:
    assert TrainConfig(frames=8193).updates == 2
    assert TrainConfig(frames=8192).updates == 1


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"num_envs": 2}, "minibatches: got 4, expected at most num_envs = 2"),
        ({"bptt": 5}, "bptt: got 5, expected a divisor of horizon = 32"),
        ({"lr": float("nan")}, "lr"),
        ({"lr": 0}, "lr"),
        ({"seed": -1}, "seed"),
        ({"explo": "rnd"}, "explo"),
        ({"learning_rate": 1e-3}, "learning_rate"),
        ({"frames": "many"}, "frames"),
    ],
)
def test_nonsense_is_a_value_error(values: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        TrainConfig(**values)  # type: ignore[arg-type]


def test_json_gives_it_back() -> None:
    config = paper_preset(explo="cell", explo_c=2.0, device="cuda:1")
    assert TrainConfig.model_validate_json(config.model_dump_json()) == config


def test_every_field_says_what_it_is() -> None:
    assert all(field.description for field in TrainConfig.model_fields.values())
    assert set(TrainConfig.model_fields) >= RESUMABLE_FIELDS


def test_the_exploration_table_is_well_formed() -> None:
    table = yaml.safe_load(Path(trainer.__file__).with_name("exploration.yaml").read_text())
    assert len(table) == 11
    for settings in table.values():
        assert set(settings) == {"kind", "c"}
        assert TrainConfig(explo=settings["kind"], explo_c=float(settings["c"])).explo_t == 0.6
