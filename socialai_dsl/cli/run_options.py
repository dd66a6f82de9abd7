"""The options of a run: from what is typed to its configuration."""

import argparse
import json
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from reprlib import repr as shortened
from typing import Any, Final, get_args

from pydantic import ValidationError

from socialai_dsl.checking.loaded import Loaded, guided_options
from socialai_dsl.cli.arguments import whole_number
from socialai_dsl.diagnostics import suggested
from socialai_dsl.errors import UsageError, first_mistake
from socialai_dsl.experiments.settings import resolved_config
from socialai_dsl.runs.folder import read_config
from trainer.config import FLAGS, HYPER, NET_PRESETS, RECIPES, RunConfig

_AUTOMATIC: Final = {
    "device": "a graphics card where there is one",
    "threads": "one per core, at most 4",
    "envs": "256, or the preset's number",
    "frames": "what the recipe needs for this scenario, or the preset's number",
    "guide": "the recipe's",
    "curriculum": "none; even where the recipe guided trains a suite that draws its members",
}
"""Options without one default: what stands in its place in the help."""

_OF_ANY_AGENT: Final = ("agent", "seed", "device", "eval_episodes", "net")
"""Options that matter to agents that are not trained."""

_OF_PART: Final = {
    "guide": ("guide_share", "imitation_coef"),
    "bonus": ("bonus_c", "bonus_m", "bonus_t", "bonus_formula"),
}
"""Options that mean nothing where a run has no guide, or no bonus."""

_MOST_THREADS: Final = 4
"""More threads than this wait for Python's interpreter lock rather than compute."""

PLAIN_FRAMES: Final = 600_000


# -- options ------------------------------------------------------------------------------------------------------


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare a flag for each option of `RunConfig` that has one, `--recipe` and `--hyper`."""
    for name in FLAGS:
        field = RunConfig.model_fields[name]
        words = [f"--{name.replace('_', '-')}"] + (["--explo"] if name == "bonus" else [])
        default = _AUTOMATIC.get(name, field.default)
        about = (
            field.description if default in (None, "none") else f"{field.description} (default: {default})"
        )
        choices = ("auto", "cpu", "cuda") if name == "device" else _choices(field.annotation)
        number = field.annotation is int
        metavar = None if choices else "N" if number else "NAME"
        kind: Any = whole_number if number else str
        parser.add_argument(
            *words, dest=name, type=kind, choices=choices, metavar=metavar, help=_escaped(about)
        )
    parser.add_argument(
        "--recipe",
        choices=tuple(RECIPES),
        help="the way of learning: guided (the scenario's script shows the task first), plain or paper (from "
        "the reward alone) (default: guided if the scenario has a script)",
    )
    parser.add_argument(
        "--hyper",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="any other option of the trainer, such as lr=1e-4 or entropy_coef=0.02 (repeatable)",
    )


def _choices(annotation: Any) -> tuple[str, ...] | None:
    words = tuple(word for word in get_args(annotation) if isinstance(word, str))
    return words or None


def _escaped(text: str | None) -> str:
    return (text or "").replace("%", "%%")


BUILT_IN_AGENTS: Final = ("ppo", "random", "oracle", "human")


def started(arguments: argparse.Namespace) -> tuple[RunConfig, Loaded]:
    """The configuration of a new run, and its scenario."""
    if arguments.scenario is None:
        raise UsageError("expected a scenario (a path or a name), or --resume RUN_DIR")
    from socialai_dsl.evaluation.players import folder_of, named_agent

    arguments.agent = agent = named_agent(arguments.agent or "ppo", arguments.scenario)
    if agent not in BUILT_IN_AGENTS and not folder_of(agent).exists():
        known = ", ".join(BUILT_IN_AGENTS)
        raise UsageError(f"--agent: expected {known}, shipped or the path of a checkpoint, got {agent!r}")
    if agent == "human" and arguments.json:
        raise UsageError("--json: the agent 'human' plays on standard output")
    return new_config(arguments)


def check_resumable(arguments: argparse.Namespace) -> RunConfig:
    """The configuration of the run that `--resume` names, as its folder has it.

    Raises:
        UsageError: there is no such run, it is none that trains, or more is named than the folder.
    """
    folder: Path = arguments.resume
    if arguments.scenario is not None or arguments.out is not None:
        raise UsageError(
            "--resume: the run's folder says which scenario it is; give neither SCENARIO nor --out"
        )
    try:
        config = read_config(folder)
    except UsageError as error:
        raise UsageError(f"--resume: {error}") from None
    if not config.trains:
        raise UsageError(f"--resume: the agent {config.agent!r} of {folder} is not trained")
    return config


def resumed(arguments: argparse.Namespace) -> tuple[RunConfig, Loaded]:
    """The configuration of a run that was stopped, and its scenario.

    What is typed may change how it goes on, as `--frames` and `--threads` do, and not what it computes.
    """
    import socialai_dsl
    from socialai_dsl.evaluation.players import resolve_device

    config = check_resumable(arguments)
    resumed = checked_config(config.model_dump() | _typed_options(arguments))
    resumed = resumed.model_copy(update={"device": resolve_device(resumed.device)}).within(arguments.resume)
    if changed := config.differences(resumed):  # before its folder says otherwise
        name, reason = changed[0], "because a run goes on with the options it began with"
        if name == "frames":
            reason = "because guide and schedules of this run reach from its first frame to its last"
        raise UsageError(
            f"{_typed(name)}: got {getattr(resumed, name)}, expected {getattr(config, name)}, {reason}"
        )
    return resumed, socialai_dsl.load(resumed.played)


def new_config(arguments: argparse.Namespace) -> tuple[RunConfig, Loaded]:
    """The configuration of a new run with everything resolved, and its scenario.

    Raises:
        UsageError: an option is unknown or out of bounds, or options contradict each other.
    """
    import socialai_dsl
    from socialai_dsl.evaluation.players import resolve_device

    given = _typed_options(arguments)
    trains = given.get("agent", "ppo") == "ppo"
    if not trains:
        _refuse_training_options(given)
    given["device"] = resolve_device(given.get("device", "auto"))
    given["scenario"] = arguments.scenario
    loaded = socialai_dsl.load(arguments.scenario)
    if not trains:
        return checked_config(given | {"frames": 0}), loaded
    given.setdefault("threads", automatic_threads())
    recipe = given["recipe"] = given.get("recipe") or _usual_recipe(given, arguments.scenario, loaded)
    typed = given
    if given.get("net") not in NET_PRESETS:
        given = usual_for(recipe, loaded) | given
    config = checked_config(given)
    _refuse_what_is_idle(typed, config)
    if config.curriculum.endswith((".yaml", ".yml")):
        socialai_dsl.load_curriculum(
            config.curriculum
        )  # what is wrong with it is said before a folder is made
    return config, loaded


def checked_config(given: dict[str, Any]) -> RunConfig:
    """`resolved_config`, with what is wrong said as the option was typed.

    Raises:
        UsageError: a value is out of bounds.
    """
    try:
        return resolved_config(given)
    except ValidationError as error:
        place, said = first_mistake(error.errors())
        name = place.partition(".")[0]
        if not name:  # of options that contradict each other, the message begins with one
            name, _, said = said.partition(": ")
        raise UsageError(f"{_typed(name)}: {said}") from None


def _refuse_what_is_idle(typed: Iterable[str], config: RunConfig) -> None:
    """Refuse what was typed and belongs to something that this run does not have."""
    for name in typed:
        for part in ("guide", "bonus"):
            if name in _OF_PART[part] and getattr(config, part) == "none":
                raise UsageError(f"{_typed(name)}: it is for a {part}, and this run has none (--{part})")


def _refuse_training_options(given: dict[str, Any]) -> None:
    agent = given["agent"]
    for name in given:
        if name not in _OF_ANY_AGENT:
            raise UsageError(f"{_typed(name)}: the agent {agent!r} is not trained")
        if agent in BUILT_IN_AGENTS and name in ("device", "net"):
            raise UsageError(f"{_typed(name)}: the agent {agent!r} has no network")


def _typed(name: str) -> str:
    """An option as it is typed."""
    return f"--hyper {name}" if name in HYPER else f"--{name.replace('_', '-')}"


def _typed_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options that were typed, by name."""
    given = {name: getattr(arguments, name) for name in (*FLAGS, "recipe")}
    return {name: value for name, value in given.items() if value is not None} | _read_hyper(arguments.hyper)


def _read_hyper(given: Sequence[str]) -> dict[str, Any]:
    """Options given as NAME=VALUE, by name; whether their values are possible is `RunConfig`'s to say."""
    found: dict[str, Any] = {}
    for text in given:
        name, equals, written = text.partition("=")
        if not equals or not written:
            raise UsageError(f"--hyper: got {text!r}, expected NAME=VALUE, such as lr=1e-4")
        if name in FLAGS:
            raise UsageError(f"--hyper: {name} has an option of its own, --{name.replace('_', '-')}")
        if name not in HYPER:
            hint = suggested(name, HYPER, f"; expected one of {', '.join(HYPER)}")
            raise UsageError(f"--hyper: got {name!r}{hint}")
        if name in found:
            raise UsageError(f"--hyper: {name} is given twice")
        found[name] = _plain_value(name, written)
    return found


def _plain_value(name: str, written: str) -> bool | int | float | str | None:
    """A number, true, false or null as JSON writes them; else the word itself."""
    try:
        value = json.loads(written)
    except (ValueError, RecursionError):
        return written
    if not isinstance(value, bool | int | float | str | None):
        raise UsageError(
            f"--hyper {name}: got {shortened(written)}, expected a number, a word, true, false or null"
        )
    return value


# -- what is not typed --------------------------------------------------------------------------------------------


def automatic_threads() -> int:
    """Threads where the command does not say how many."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(cores, _MOST_THREADS))


def _usual_recipe(given: dict[str, Any], scenario: str, loaded: Loaded) -> str:
    """`guided` where the scenario has a script and nothing is asked for that excludes a guide, else `plain`."""
    if given.get("net") in NET_PRESETS or given.get("update") == "chunks":
        return "paper"
    if given.get("guide", "script") != "script" or given.get("curriculum", "none") not in ("none", "even"):
        return "plain"
    from socialai_dsl.evaluation.scripts import script_of

    return "guided" if script_of(scenario, loaded) is not None else "plain"


def usual_for(recipe: str, loaded: Loaded) -> dict[str, Any]:
    """Defaults that depend on the recipe and the scenario."""
    return guided_options(loaded) if recipe == "guided" else {"frames": PLAIN_FRAMES}
