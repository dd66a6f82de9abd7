"""Trains agents from the command line: from typed options to a configuration, from that to an agent."""

import argparse
import json
import os
import traceback
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final, get_args

from pydantic import ValidationError

from socialai_dsl.cli.errors import RunFailed, UsageError
from socialai_dsl.cli.run_folder import SETTINGS, read_json
from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.experiments.settings import resolved_config
from trainer.config import FLAGS, HYPER, NET_PRESETS, RECIPES, RunConfig
from trainer.shipped import PREFIX, located, shipped_agents

if TYPE_CHECKING:
    from socialai_dsl.checking.loaded import Loaded
    from socialai_dsl.program_suite import Playable
    from trainer.logging import WandbTracker

_AUTOMATIC: Final = {
    "device": "a graphics card where there is one",
    "threads": "one per core, at most 4",
    "envs": "256, or the preset's number",
    "frames": "what the recipe needs for this scenario, or the preset's number",
    "guide": "the recipe's",
}
"""Options without one default: what stands in its place in the help."""

_OF_ANY_AGENT: Final = ("agent", "seed", "device", "eval_episodes", "net")
"""Options that matter to agents that are not trained."""

_MOST_THREADS: Final = 4
"""More threads than this wait for Python's interpreter lock rather than compute."""

PLAIN_FRAMES: Final = 600_000


def require_trainer() -> None:
    """Say how to install the trainer if it is missing.

    Raises:
        UsageError: it is.
    """
    if find_spec("torch") is None:
        raise UsageError("training and evaluating need PyTorch: pip install 'socialai-dsl[train]'")


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
        kind: Any = _whole_number if number else str
        parser.add_argument(
            *words, dest=name, type=kind, choices=choices, metavar=metavar, help=_escaped(about)
        )
    parser.add_argument(
        "--recipe",
        choices=tuple(RECIPES),
        help="how the agent learns; guided: the scenario's script shows it first; plain and paper: from the reward "
        "alone (default: guided where the scenario has a script)",
    )
    parser.add_argument(
        "--hyper",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="any other option of the trainer, such as lr=1e-4 or entropy_coef=0.02; may be given again",
    )


def _choices(annotation: Any) -> tuple[str, ...] | None:
    words = tuple(word for word in get_args(annotation) if isinstance(word, str))
    return words or None


def _escaped(text: str | None) -> str:
    return (text or "").replace("%", "%%")


def _whole_number(text: str) -> int:
    """`1_000` and `1,000` are 1000; the bounds are `RunConfig`'s."""
    try:
        return int(text.replace("_", "").replace(",", ""))
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a whole number, got {text!r}") from None


def new_config(arguments: argparse.Namespace) -> RunConfig:
    """The configuration of a new run, with everything resolved.

    Raises:
        UsageError: an option is unknown or out of bounds, or options contradict each other.
    """
    given = {name: getattr(arguments, name) for name in FLAGS if getattr(arguments, name) is not None}
    hyper = _read_hyper(arguments.hyper)
    trains = given.get("agent", "ppo") == "ppo"
    if not trains:
        _refuse_training_options(given, arguments)
    given["device"] = resolve_device(given.get("device", "auto"))
    given["scenario"] = arguments.scenario
    if not trains:
        return checked_config(given | {"frames": 0})
    given.setdefault("threads", automatic_threads())
    recipe = arguments.recipe or _usual_recipe(given | hyper, arguments.scenario)
    if "frames" not in given and given.get("net") not in NET_PRESETS:
        given["frames"] = frames_for(recipe, arguments.scenario)
    return checked_config({"recipe": recipe} | given | hyper)


def checked_config(given: dict[str, Any]) -> RunConfig:
    """`resolved_config`, with what is wrong said as the option was typed.

    Raises:
        UsageError: a value is out of bounds.
    """
    try:
        return resolved_config(given)
    except ValidationError as error:
        first = error.errors()[0]
        said = first["msg"].removeprefix("Value error, ")
        if first["loc"]:
            name, said = str(first["loc"][0]), f"{said}, got {first['input']!r}"
        else:  # of options that contradict each other, the message begins with one
            name, _, said = said.partition(": ")
        typed = f"--{name.replace('_', '-')}" if name in FLAGS else f"--hyper {name}"
        raise UsageError(f"{typed}: {said}") from None


def _refuse_training_options(given: dict[str, Any], arguments: argparse.Namespace) -> None:
    asked = [name for name in given if name not in _OF_ANY_AGENT]
    asked += ["hyper"] * bool(arguments.hyper) + ["recipe"] * bool(arguments.recipe)
    if asked:
        option = asked[0].replace("_", "-")
        raise UsageError(f"--{option}: the agent {given['agent']!r} is not trained")


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
            near = did_you_mean(name, HYPER)
            hint = f"did you mean {near}?" if near else f"expected one of {', '.join(HYPER)}"
            raise UsageError(f"--hyper: got {name!r}; {hint}")
        if name in found:
            raise UsageError(f"--hyper: {name} is given twice")
        found[name] = _plain_value(name, written)
    return found


def _plain_value(name: str, written: str) -> bool | int | float | str | None:
    """A number, true, false or null as JSON writes them; else the word itself."""
    try:
        value = json.loads(written)
    except ValueError:
        return written
    if not isinstance(value, bool | int | float | str | None):
        raise UsageError(f"--hyper: got {name}={written}, expected a number, a word, true, false or null")
    return value


# -- what is not typed --------------------------------------------------------------------------------------------


def resolve_device(device: str) -> str:
    """`auto` is a graphics card where there is one.

    Raises:
        UsageError: `cuda` was asked for and is not there.
    """
    import torch

    available = torch.cuda.is_available()
    if device == "cuda" and not available:
        raise UsageError("--device cuda: PyTorch finds no CUDA device on this machine")
    return "cuda" if device == "cuda" or (device == "auto" and available) else "cpu"


def automatic_threads() -> int:
    """The number of threads by default."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(cores, _MOST_THREADS))


def _usual_recipe(given: dict[str, Any], scenario: str) -> str:
    """`guided` where the scenario has a script and nothing is asked for that excludes a guide, else `plain`."""
    if given.get("net") in NET_PRESETS or given.get("update") == "chunks":
        return "paper"
    if given.get("guide", "script") != "script" or given.get("curriculum", "none") != "none":
        return "plain"
    return "guided" if scripted_name(scenario) is not None else "plain"


GUIDED_FRAMES: Final = 2_000_000
GUIDED_FRAMES_OF_A_SUITE: Final = 6_000_000


def frames_for(recipe: str, scenario: str) -> int:
    """Frames where nobody says how many: measured to be enough for every scenario of the paper (docs/mastery.md)."""
    import socialai_dsl
    from socialai_dsl.program_suite import ProgramSuite

    if recipe != "guided":
        return PLAIN_FRAMES
    is_suite = isinstance(socialai_dsl.compile(socialai_dsl.load(scenario)), ProgramSuite)
    return GUIDED_FRAMES_OF_A_SUITE if is_suite else GUIDED_FRAMES


# -- scripts ------------------------------------------------------------------------------------------------------


def scripted_name(scenario: str) -> str | None:
    """The scenario itself if it scripts the agent, else its variant `oracle`; None if there is no script.

    Raises:
        ScenarioError: the scenario, or its variant, has mistakes.
    """
    name, lacking = _closest_script(scenario)
    return None if lacking else name


def with_script(scenario: str) -> str:
    """`scripted_name`, which there must be.

    Raises:
        UsageError: there is no script.
    """
    name, lacking = _closest_script(scenario)
    if lacking:
        raise UsageError(
            f"{scenario}: the agent of {lacking[0]} has no frame, and there is no variant `oracle`"
        )
    return name


def _closest_script(scenario: str) -> tuple[str, Sequence[str]]:
    """The scenario itself or its variant `oracle`, and which of its members have no script even there."""
    import socialai_dsl
    from socialai_dsl.program_suite import unscripted

    lacking = unscripted(socialai_dsl.compile(socialai_dsl.load(scenario)))
    if not lacking:
        return scenario, ()
    name, mark, parameters = scenario.partition("?")
    scripted = f"{name}+oracle{mark}{parameters}"
    try:
        loaded = socialai_dsl.load(scripted)
    except socialai_dsl.ScenarioError as error:
        if all(diagnostic.code == "S503" for diagnostic in error.diagnostics):
            return scenario, lacking
        raise
    return scripted, unscripted(socialai_dsl.compile(loaded))


# -- agents that are trained already ----------------------------------------------------------------------------


def folder_of(agent: str) -> Path:
    """Where a trained agent is kept: for `shipped:NAME` the folder that comes with the product.

    Raises:
        UsageError: no agent of that name ships.
    """
    try:
        return located(agent)
    except ValueError as error:
        raise UsageError(str(error)) from None


def named_agent(agent: str, scenario: str) -> str:
    """The agent that `--agent` names; `shipped` alone is the one that ships for the scenario, as `shipped:NAME`.

    A variant is played by the agent of what it is a variant of, unless it has one of its own.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: none ships for it.
    """
    import socialai_dsl
    from socialai_dsl.loader.library import shipped_folder

    if agent != "shipped":
        return agent
    path, shipped = socialai_dsl.load(scenario).resolved.path, shipped_folder().resolve()
    _, *variants = scenario.partition("?")[0].split("+")
    known = shipped_agents()
    if path.is_relative_to(shipped):
        base = path.relative_to(shipped).with_suffix("").as_posix()
        for count in range(len(variants), -1, -1):
            name = "_".join([base, *variants[:count]])
            if name in known:
                return PREFIX + name
    raise UsageError(f"{scenario}: no agent ships for it; these scenarios have one: {', '.join(known)}")


# -- training -----------------------------------------------------------------------------------------------------


def read_config(folder: Path) -> RunConfig:
    """The configuration of a run's folder.

    Raises:
        UsageError: it is not a run's folder, or its configuration is damaged.
    """
    if not (folder / SETTINGS).is_file():
        raise UsageError(f"{folder} is not a run's folder, it has no {SETTINGS}")
    try:
        # As JSON, because strict validation takes no lists for tuples from Python.
        return RunConfig.model_validate_json(json.dumps(read_json(folder / SETTINGS)))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise UsageError(f"{folder / SETTINGS}: {place}: {first['msg']}") from None


def train_agent(
    config: RunConfig, loaded: "Loaded", program: "Playable", folder: Path, resume: bool, stream: IO[str]
) -> Path:
    """Train, show the progress on `stream`, and return the path of the final checkpoint.

    Args:
        config: of the run.
        loaded: its scenario.
        program: the same, compiled.
        folder: of the run.
        resume: go on where the run was stopped.
        stream: where the progress is shown.

    Raises:
        UsageError: the run cannot start, or its folder cannot be written.
        RunFailed: training broke down.
        KeyboardInterrupt: with a message that says how to go on.
    """
    import socialai_dsl
    from socialai_dsl.cli.endings import endings_of
    from socialai_dsl.cli.learnt import Learnt
    from socialai_dsl.cli.progress import TrainingProgress
    from trainer.errors import TrainingStopped
    from trainer.ppo import train

    played = _played(config)
    envs = socialai_dsl.make_vec(played, num_envs=config.envs, copy=False, autoreset_mode="SameStep")
    total = config.updates * config.frames_per_update
    learnt = Learnt(loaded, endings_of(loaded, program))
    try:
        with TrainingProgress(total, stream) as shown:

            def report(row: Mapping[str, Any]) -> None:
                shown.update(row["frames"], row["success"], row["frames_per_second"], learnt.sentence(row))

            return train(config, envs, folder, report, resume, _tracker(config, folder), program)
    except TrainingStopped as error:
        if isinstance(error.__cause__, OSError):
            raise UsageError(str(error)) from error
        raise RunFailed(str(error)) from error
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; go on with: socialai-run --resume {folder}") from None
    except Exception as error:
        if (place := _place_in_own_code(config, error)) is not None:
            raise UsageError(f"{place}: {type(error).__name__}: {error}") from error
        if isinstance(
            error, ValueError
        ):  # what the trainer says about options or a checkpoint that do not fit
            raise UsageError(str(error)) from error
        raise
    finally:
        envs.close()


def _played(config: RunConfig) -> str:
    """What is played while training: where a guide leads, the variant with the script that it may follow."""
    if config.guide == "none":
        return config.scenario
    if config.guide == "script":
        return with_script(config.scenario)
    return scripted_name(config.scenario) or config.scenario


def _place_in_own_code(config: RunConfig, error: BaseException) -> str | None:
    """`file:line` where the user's network, bonus, curriculum or guide raised an error; None if none of them did."""
    files = {str(file) for file in config.own_files.values()}
    places = [
        f"{frame.filename}:{frame.lineno}"
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename in files
    ]
    return places[-1] if places else None


def _tracker(config: RunConfig, folder: Path) -> "WandbTracker | None":
    """Where the figures go besides the folder, if anywhere."""
    if config.wandb is None:
        return None
    from socialai_dsl.cli.run_folder import scenario_folder_name
    from trainer.logging import WandbTracker

    name = f"{scenario_folder_name(config.scenario)} {folder.name}"
    return WandbTracker(config.wandb, folder, config.model_dump(), name)
