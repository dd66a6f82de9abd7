"""What the options of a run stand for: a configuration in which nothing is automatic any more."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path
from reprlib import repr as shortened
from typing import Any, Final

import yaml
from pydantic import ValidationError

from socialai_dsl.checking.loaded import Loaded, LoadedSuite, unscripted
from socialai_dsl.diagnostics import suggested
from socialai_dsl.errors import OptionError, first_mistake
from socialai_dsl.frontend import closest_script, load_curriculum
from socialai_dsl.trainer.config import (
    BONUS_SCALES,
    FLAGS,
    HYPER,
    NET_PRESETS,
    RECIPES,
    UNTRAINED,
    RunConfig,
    configure,
    scenario_file,
)

AUTOMATIC: Final[Mapping[str, str]] = {
    "device": "a graphics card where there is one",
    "threads": "one per core, at most 4",
    "envs": "256, or the preset's number",
    "frames": "what the recipe needs for this scenario, or the preset's number",
    "guide": "the recipe's",
    "curriculum": "none; even where the recipe guided trains a suite that draws its members",
}
"""Options without one default -> what stands in its place, in words."""

OPTIONS: Final = (*FLAGS, *HYPER, "recipe", "seats")
"""The names of all options that a user may give."""

_OF_ANY_AGENT: Final = ("agent", "seed", "device", "eval_episodes", "net", "algorithm")
"""Options that matter to agents that are not trained."""

_OF_PART: Final = {
    "guide": ("guide_share", "imitation_coef"),
    "bonus": ("bonus_c", "bonus_m", "bonus_t", "bonus_formula"),
    "aux": ("aux_coef",),
}
"""Options that mean nothing where a run has no guide, no bonus or no auxiliary loss."""

_MOST_THREADS: Final = 4
"""More threads than this wait for Python's interpreter lock rather than compute."""

_PLAIN_FRAMES: Final = 600_000
_GUIDED_FRAMES: Final = 500_000
_GUIDED_FRAMES_OF_A_SUITE: Final = 6_000_000
_PAPER_BONUS: Final = Path(__file__).with_name("paper_bonus.yaml")


def new_config(scenario: str, options: Mapping[str, Any], loaded: Loaded) -> RunConfig:
    """The configuration of a new run.

    Args:
        scenario: a path or a name.
        options: those that are given, by name; `device` and `bonus` may be `auto`.
        loaded: the scenario.

    Raises:
        OptionError: an option is unknown, out of bounds or without use, or options contradict each other.
        ScenarioError: a curriculum's file, or the scenario's script, has mistakes.
    """
    _refuse_unknown(options)
    given = {**options, "scenario": scenario}
    if "seats" in given:
        given["seats"] = _lists_of_players(given["seats"])
    given["device"] = resolved_device(given.get("device", "auto"))
    if given.get("agent", "ppo") != "ppo":
        _refuse_training_options(options)
        return resolved_config(given | {"frames": 0})
    given.setdefault("threads", automatic_threads())
    recipe = given["recipe"] = given.get("recipe") or _usual_recipe(given, scenario, loaded)
    usual = usual_options(recipe, loaded) if given.get("net") not in NET_PRESETS else {}
    config = resolved_config(usual | given)
    _refuse_idle(given, config)
    if config.curriculum.endswith((".yaml", ".yml")):
        load_curriculum(config.curriculum)  # what is wrong with it is said before a folder is made
    return config


def continued_config(config: RunConfig, options: Mapping[str, Any], folder: Path) -> RunConfig:
    """The configuration with which a run goes on that was stopped.

    Args:
        config: with which it began.
        options: what is to be different, such as `frames` and `threads`; not what the run computes.
        folder: the run's.

    Raises:
        OptionError: an option is unknown or out of bounds, or the run cannot go on with it.
    """
    _refuse_unknown(options)
    asked = resolved_config({**config.model_dump(), **options})
    asked = asked.model_copy(update={"device": resolved_device(asked.device)}).within(folder)
    if changed := config.differences(asked):
        name, reason = changed[0], "because a run goes on with the options it began with"
        if name == "frames":
            reason = (
                "because a guide, a schedule, or your own bonus or algorithm depends on the number of frames"
            )
        raise OptionError(name, f"got {getattr(asked, name)}, expected {getattr(config, name)}, {reason}")
    return asked


def resolved_config(given: Mapping[str, Any]) -> RunConfig:
    """The configuration of a run from its options, `scenario` and `recipe` among them.

    `bonus` may be `auto`, and its scale is the paper's unless it is given. Other options are not automatic here: an
    experiment says them all, so that its runs do not depend on the machine.

    Raises:
        OptionError: an option is unknown or out of bounds, or options contradict each other.
    """
    bonus = _resolved_bonus(str(given.get("bonus", "none")), str(given.get("scenario", "")))
    try:
        return configure(**(bonus | {name: value for name, value in given.items() if name != "bonus"}))
    except ValidationError as error:
        place, said = first_mistake(error.errors())
        name = place.partition(".")[0]
        if not name:  # of options that contradict each other, the message begins with one
            name, _, said = said.partition(": ")
        raise OptionError(name, said) from None


# -- values that are not given ------------------------------------------------------------------------------------


def _has_cuda() -> bool:
    """Whether there is a graphics card; without PyTorch nobody plays who could use it."""
    if find_spec("torch") is None:
        return False
    import torch

    return torch.cuda.is_available()


def resolved_device(device: str) -> str:
    """`auto` is a graphics card where there is one.

    Raises:
        OptionError: `cuda` was asked for and is not there, or something else was.
    """
    if device not in ("auto", "cpu", "cuda"):
        raise OptionError("device", f"got {device!r}, expected auto, cpu or cuda")
    available = _has_cuda()
    if device == "cuda" and not available:
        raise OptionError("device", "got cuda, and PyTorch finds no CUDA device on this machine")
    return "cuda" if device == "cuda" or (device == "auto" and available) else "cpu"


def automatic_threads() -> int:
    """Threads where nobody says how many."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(cores, _MOST_THREADS))


def usual_options(recipe: str, loaded: Loaded) -> dict[str, Any]:
    """Defaults that depend on the recipe and on what is learnt.

    `guided` trains for the frames that the file says, measured to be enough (docs/mastery.md), and gives a suite that
    draws its members a curriculum.
    """
    if recipe != "guided":
        return {"frames": _PLAIN_FRAMES}
    if not isinstance(loaded, LoadedSuite):
        return {"frames": loaded.scenario.training_frames or _GUIDED_FRAMES}
    options: dict[str, Any] = {"frames": loaded.suite.training_frames or _GUIDED_FRAMES_OF_A_SUITE}
    return options | ({"curriculum": "even"} if loaded.suite.draw == "uniform" else {})


def _usual_recipe(given: Mapping[str, Any], scenario: str, loaded: Loaded) -> str:
    """`guided` where the scenario has a script and nothing is asked for that excludes a guide, else `plain`."""
    if given.get("net") in NET_PRESETS or given.get("update") == "chunks":
        return "paper"
    if given.get("guide", "script") != "script" or given.get("curriculum", "none") not in ("none", "even"):
        return "plain"
    return "plain" if unscripted(closest_script(scenario, loaded).loaded) else "guided"


def _resolved_bonus(kind: str, scenario: str) -> dict[str, Any]:
    """Kind and scale of an exploration bonus; `auto` is the kind that the paper gives the scenario, if any."""
    name = scenario_file(scenario).name.removesuffix(".yaml").removesuffix(".yml")
    table = yaml.safe_load(_PAPER_BONUS.read_text(encoding="utf-8"))
    listed = table.get(name, {"kind": "none"})
    if kind == "auto":
        kind = listed["kind"]
    if kind not in BONUS_SCALES:
        return {"bonus": kind}
    scale = listed["c"] if kind == listed["kind"] else BONUS_SCALES[kind]
    return {"bonus": kind, "bonus_c": float(scale)}


# -- what is refused ----------------------------------------------------------------------------------------------


def _refuse_unknown(options: Mapping[str, Any]) -> None:
    """Refuse names and values that are none, of whatever type; bounds are `RunConfig`'s to say."""
    for name, value in options.items():
        if name not in OPTIONS:
            hint = suggested(name, OPTIONS, f"; expected one of {', '.join(OPTIONS)}")
            raise OptionError(name, f"there is no such option{hint}")
        if name != "seats" and not isinstance(value, bool | int | float | str | None):
            raise OptionError(
                name, f"got {shortened(value)}, expected a number, a word, a truth value or nothing"
            )
    recipe = options.get("recipe")
    if recipe is not None and recipe not in RECIPES:
        raise OptionError("recipe", f"got {recipe!r}, expected one of {', '.join(RECIPES)}")


def _lists_of_players(given: Any) -> dict[str, list[str]]:
    """The players of each seat, which may be one or several. Raises OptionError for what is none."""
    if not isinstance(given, Mapping):
        raise OptionError("seat", f"got {shortened(given)}, expected players by member of the cast")
    found = {}
    for seat, players in given.items():
        names = [players] if isinstance(players, str) else players
        if not isinstance(seat, str) or not _is_list_of_words(names):
            raise OptionError(
                "seat",
                f"got {shortened(players)} for {shortened(seat)}, expected the name of a player, or several",
            )
        found[seat] = list(names)
    return found


def _is_list_of_words(names: Any) -> bool:
    return isinstance(names, list | tuple) and bool(names) and all(isinstance(n, str) and n for n in names)


def _refuse_idle(given: Iterable[str], config: RunConfig) -> None:
    """Refuse what belongs to something that this run does not have."""
    for name in given:
        for part, options in _OF_PART.items():
            if name.removesuffix("_end") in options and getattr(config, part) == "none":
                raise OptionError(name, f"it is for --{part}, and this run has none")
        if config.bonus == "lines" and name in _OF_PART["bonus"][1:]:
            raise OptionError(name, "it is for the paper's bonuses, lang and cell")


def _refuse_training_options(options: Mapping[str, Any]) -> None:
    agent = options["agent"]
    for name in options:
        if name not in _OF_ANY_AGENT:
            raise OptionError(name, f"the agent {agent!r} is not trained")
        if agent in UNTRAINED and name in ("device", "net", "algorithm"):
            raise OptionError(name, f"the agent {agent!r} has no network")
