"""Configurations are checked, survive JSON, and the presets are the published ones."""

from pathlib import Path

import pytest

from socialai_dsl.trainer.config import FLAGS, HYPER, NET_PRESETS, RECIPES, SCHEDULED, RunConfig, configure


def test_the_defaults_are_the_settings_that_worked() -> None:
    config = RunConfig()
    assert (config.envs, config.horizon, config.epochs, config.minibatches) == (256, 32, 4, 4)
    assert (config.lr, config.gamma, config.gae_lambda, config.clip) == (7e-4, 0.99, 0.95, 0.2)
    assert (config.entropy_coef, config.max_grad_norm, config.normalize_advantages) == (0.01, 0.5, True)
    assert (config.precision, config.bootstrap_timeouts) == ("float32", False)


# The paper's table of hyper-parameters, with what its released run scripts add.
PUBLISHED = {
    "net": "paper-reference",
    "update": "chunks",
    "loss": "per_head",
    "frames": 30_000_000,
    "envs": 16,
    "horizon": 40,
    "bptt": 10,
    "epochs": 4,
    "minibatches": 1,  # a batch of 1280 holds all 640 frames
    "lr": 1e-4,
    "adam_eps": 1e-5,
    "gamma": 0.99,
    "gae_lambda": 0.99,
    "clip": 0.2,
    "clip_value": True,
    "value_coef": 0.5,
    "entropy_coef": 0.01,
    "max_grad_norm": 0.5,
    "normalize_advantages": False,
    "bootstrap_timeouts": False,
    "bonus": "none",
    "bonus_m": 50.0,
    "bonus_t": 0.6,
    "bonus_formula": "as_coded",
}


def test_the_paper_s_preset() -> None:
    config = configure(net="paper-reference")
    assert {name: getattr(config, name) for name in PUBLISHED} == PUBLISHED
    assert config.frames_per_update == 640
    assert config.updates == 46_875


def test_the_tuned_preset_differs_in_recurrence_and_epsilon_only() -> None:
    paper, tuned = (configure(net=net).model_dump() for net in NET_PRESETS)
    changed = {name: value for name, value in tuned.items() if value != paper[name]}
    assert changed == {"net": "paper-reference-tuned", "bptt": 5, "adam_eps": 1e-8}


def test_what_is_said_overrides_a_preset() -> None:
    config = configure(net="paper-reference", envs=4, frames=100, seed=3, lr=1e-3)
    assert (config.envs, config.frames, config.seed, config.lr, config.horizon) == (4, 100, 3, 1e-3, 40)


def test_other_names_are_networks_with_the_default_numbers() -> None:
    assert configure(net="paper", seed=1) == RunConfig(net="paper", seed=1)
    assert set(NET_PRESETS) == {"paper-reference", "paper-reference-tuned"}


@pytest.mark.parametrize("recipe", ["plain", "paper"])
def test_time_is_up_for_who_learns_from_the_reward_alone(recipe: str) -> None:
    assert not configure(recipe).bootstrap_timeouts


def test_a_recipe_brings_its_numbers_and_what_is_said_overrides_them() -> None:
    guided = configure("guided")
    assert (guided.recipe, guided.guide) == ("guided", "script")
    assert guided.guide_share <= 0.7, "the last part is plain PPO on the task's own reward"
    assert configure("guided", minibatches=2, guide="none").guide == "none"
    assert configure("paper").model_dump() == RunConfig().model_dump() | {"recipe": "paper"}
    with pytest.raises(ValueError, match="recipe: got 'secret', expected one of plain, paper, guided"):
        configure("secret")
    assert all(preset.source for preset in [*RECIPES.values(), *NET_PRESETS.values()])


def test_few_environments_are_few_minibatches() -> None:
    assert configure("guided", envs=8).minibatches == 8
    with pytest.raises(ValueError, match="minibatches: got 16, expected at most envs = 8"):
        configure("guided", envs=8, minibatches=16)


def test_every_coefficient_has_an_end_of_its_own_bounds_and_goes_there_evenly() -> None:
    expected = {
        "lr",
        "clip",
        "value_coef",
        "entropy_coef",
        "imitation_coef",
        "bonus_c",
        "gamma",
        "gae_lambda",
    }
    assert expected | {"aux_coef", "max_grad_norm"} == set(SCHEDULED)
    assert {name for name in RunConfig.model_fields if name.endswith("_end")} == {
        f"{n}_end" for n in SCHEDULED
    }
    for name in SCHEDULED:
        start, end = RunConfig.model_fields[name], RunConfig.model_fields[f"{name}_end"]
        assert end.default is None
        with pytest.raises(ValueError, match=f"{name}_end"):
            RunConfig(**{f"{name}_end": -1.0})
        config = RunConfig(frames=4 * 8192, **{f"{name}_end": 0.5 * start.default})
        values = [getattr(config.at(update), name) for update in range(5)]
        assert values == pytest.approx([start.default * (1 - update / 8) for update in range(5)])
        before, after = config.model_dump(), config.at(3).model_dump()
        assert {option for option in before if after[option] != before[option]} == {name}
    assert RunConfig().at(17) == RunConfig()


def test_more_frames_are_another_run_where_an_update_depends_on_them() -> None:
    plain = [{}, {"bonus": "lang"}, {"net": "mine:Net"}]
    assert not any(RunConfig(**options).depends_on_frames for options in plain)  # type: ignore[arg-type]
    others = [{"guide": "script"}, {"bonus": "mine:Bonus"}, *({f"{name}_end": 0.5} for name in SCHEDULED)]
    assert all(RunConfig(**options).depends_on_frames for options in others)  # type: ignore[arg-type]


def test_updates_are_rounded_up() -> None:
    assert RunConfig(frames=8193).updates == 2
    assert RunConfig(frames=8192).updates == 1


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"envs": 2}, "minibatches: got 4, expected at most envs = 2"),
        ({"bptt": 5}, "bptt: got 5, expected a divisor of horizon = 32"),
        ({"update": "chunks"}, "bptt: got 0, expected less than horizon = 32 and not 0"),
        ({"update": "chunks", "bptt": 32}, "bptt: got 32, expected less than horizon = 32"),
        ({"bonus_t": 0.0}, "bonus_t"),
        ({"lr": float("nan")}, "lr"),
        ({"lr": 0}, "lr"),
        ({"seed": -1}, "seed"),
        ({"precision": "auto"}, "precision"),
        ({"lr_end": 0.0}, "lr_end"),
        ({"target_kl": -1.0}, "target_kl"),
        ({"keep_checkpoints": 0}, "keep_checkpoints"),
        ({"guide_share": 1.5}, "guide_share"),
        ({"update": "chunks", "bptt": 8, "guide": "script"}, "guide: the update `chunks` is the paper's"),
        ({"threads": 65}, "threads"),
        ({"learning_rate": 1e-3}, "learning_rate"),
        ({"frames": "many"}, "frames"),
    ],
)
def test_nonsense_is_a_value_error(values: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        RunConfig(**values)  # type: ignore[arg-type]


def test_json_gives_it_back() -> None:
    config = configure(net="paper-reference", bonus="cell", bonus_c=2.0, device="cuda:1")
    assert RunConfig.model_validate_json(config.model_dump_json()) == config


def test_every_field_says_what_it_is() -> None:
    assert all(field.description for field in RunConfig.model_fields.values())
    kept = {"scenario", "recipe", "seats"}
    assert sorted([*FLAGS, *HYPER, *kept]) == sorted(RunConfig.model_fields), "each is given in one way"


@pytest.mark.parametrize(
    ("scenario", "folder"),
    [
        ("/home/me/mine.yaml+unsocial?doors=3", "/home/me"),
        ("mine.yml", "."),
        ("talkitout+oracle", "."),
    ],
)
def test_code_of_ones_own_is_looked_for_beside_the_scenario_s_file(scenario: str, folder: str) -> None:
    assert RunConfig(scenario=scenario).code_folder == Path(folder)
