"""`socialai-run`: checks a scenario, trains an agent on it, evaluates it, leaves a folder of results."""

import argparse
import contextlib
import json
import sys
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

from socialai_dsl.cli.errors import Exit, UsageError
from socialai_dsl.cli.run_folder import (
    LOCK,
    REPLAY,
    RESULT,
    SETTINGS,
    create_run_folder,
    only_writer,
    scenario_folder_name,
    versions,
    write_json,
    write_text,
)

if TYPE_CHECKING:
    from socialai_dsl.checking.loaded import Loaded
    from socialai_dsl.cli.evaluation import Evaluation
    from socialai_dsl.program_suite import Playable
    from trainer.config import RunConfig

SUMMARY: Final = "train an agent on a scenario, evaluate it and write pictures and figures"

_REPLAYED: Final = 5
"""So many failures, and so many successes."""

BUILT_IN_AGENTS: Final = ("ppo", "random", "oracle", "human")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    from socialai_dsl.cli.agents import add_options

    parser.add_argument(
        "scenario", nargs="?", metavar="SCENARIO", help="a path or a name, with +variants and ?parameters"
    )
    add_options(parser)
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of this run (default: runs/<scenario>/<time>-s<seed>)"
    )
    parser.add_argument("--resume", type=Path, metavar="RUN_DIR", help="go on with a run that was stopped")
    parser.add_argument("--json", action="store_true", help="print only the result, as one JSON object")


def execute(arguments: argparse.Namespace) -> Exit:
    """Do the whole run."""
    import socialai_dsl
    from socialai_dsl.cli.agents import require_trainer

    require_trainer()
    config = _resumed(arguments) if arguments.resume else _started(arguments)
    loaded = socialai_dsl.load(config.scenario)
    program = socialai_dsl.compile(loaded)
    folder = arguments.resume or create_run_folder(arguments.out, config.scenario, config.seed)
    with only_writer(folder):
        return _run(config, loaded, program, folder, arguments)


def _run(
    config: "RunConfig", loaded: "Loaded", program: "Playable", folder: Path, arguments: argparse.Namespace
) -> Exit:
    """Train if the agent is to be trained, evaluate, write everything down."""
    from socialai_dsl.cli.evaluation import evaluate_agent
    from socialai_dsl.cli.player import Player

    # With --json, standard output belongs to the result alone.
    stream = sys.stderr if arguments.json else sys.stdout
    agent, training = config.agent, _NOT_TRAINED
    write_json(folder / SETTINGS, config.model_dump())
    print(f"{config.scenario}: {_size(program)}; writing to {folder}", file=stream, flush=True)
    if config.trains:
        agent = _train(config, loaded, program, folder, bool(arguments.resume), stream)
        training = _training_figures(folder)
    # What is trained differs by its training; what is not, by what it draws.
    drawn = 0 if config.trains else config.seed
    player = Player(agent, config.device, seed=drawn, net=config.net, folder=config.code_folder)
    evaluation = evaluate_agent(player, config.scenario, config.eval_episodes)
    for warning in evaluation.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    result = {
        "scenario": config.scenario,
        "agent": config.agent,
        "seed": config.seed,
        **({"recipe": config.recipe, "guide": config.guide} if config.trains else {}),
        **training,
        "eval": evaluation.figures(),
        "program_sha256": program.sha256,
        "versions": versions(),
    }
    _record(evaluation, folder, f"agent {config.agent}, seed {config.seed}")
    if config.trains:
        _draw_curve(config, folder, result)
        _write_card(config, loaded, folder, Path(agent), result)
    write_json(folder / RESULT, result)  # last, so that its presence means a complete run
    print(json.dumps(result, indent=2, ensure_ascii=False) if arguments.json else _table(result, folder))
    return Exit.GOOD


def _train(
    config: "RunConfig", loaded: "Loaded", program: "Playable", folder: Path, resume: bool, stream: IO[str]
) -> str:
    """Train in the run's folder and return the path of the final checkpoint."""
    from socialai_dsl.cli.agents import train_agent

    try:
        return str(train_agent(config, loaded, program, folder, resume, stream))
    except UsageError:
        _discard_unstarted(folder)
        raise


_NOT_TRAINED: Final = {"frames": 0, "train_seconds": 0.0, "frames_per_second": None}


def _discard_unstarted(folder: Path) -> None:
    """Take back the folder of a run that could not even begin, so that the same command can be given again."""
    from trainer.checkpoint import FOLDER

    checkpoints = folder / FOLDER
    if not any(checkpoints.glob("*.safetensors")):
        for file in (SETTINGS, LOCK):
            (folder / file).unlink(missing_ok=True)
        for empty in (checkpoints, folder):
            with contextlib.suppress(OSError):  # it is not there, or holds files of the user's
                empty.rmdir()


def _training_figures(folder: Path) -> dict[str, Any]:
    """Frames, seconds and speed of the whole run, all its parts together if it was resumed."""
    lines = (folder / "metrics.jsonl").read_text(encoding="utf-8").splitlines()
    seconds, frames = 0.0, 0
    for row in map(json.loads, lines):
        seconds += (row["frames"] - frames) / row["frames_per_second"]
        frames = row["frames"]
    return {
        "frames": frames,
        "train_seconds": round(seconds, 3),
        "frames_per_second": round(frames / seconds, 1),
    }


def _started(arguments: argparse.Namespace) -> "RunConfig":
    """The configuration of a new run."""
    from socialai_dsl.cli.agents import folder_of, named_agent, new_config

    if arguments.scenario is None:
        raise UsageError("expected a scenario (a path or a name), or --resume RUN_DIR")
    arguments.agent = agent = named_agent(arguments.agent or "ppo", arguments.scenario)
    if agent not in BUILT_IN_AGENTS and not folder_of(agent).exists():
        known = ", ".join(BUILT_IN_AGENTS)
        raise UsageError(f"--agent: expected {known}, shipped or the path of a checkpoint, got {agent!r}")
    if agent == "human" and arguments.json:
        raise UsageError("--json: the agent 'human' plays on standard output")
    return new_config(arguments)


def _resumed(arguments: argparse.Namespace) -> "RunConfig":
    """The configuration of a run that was stopped; `--frames` may be raised, and W&B be told from now on."""
    from socialai_dsl.cli.agents import checked_config, read_config

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
    asked = {"frames": arguments.frames, "wandb": arguments.wandb}
    changes = {name: value for name, value in asked.items() if value is not None}
    resumed = checked_config(config.model_dump() | changes)
    if config.depends_on_frames and resumed.frames != config.frames:  # before its folder says otherwise
        raise UsageError(
            f"--frames: got {resumed.frames}, expected {config.frames}, because guide and schedules of this run "
            "reach from its first frame to its last"
        )
    return resumed


def _draw_curve(config: "RunConfig", folder: Path, result: dict[str, Any]) -> None:
    from socialai_dsl.reporting.curve import draw_learning_curve, read_curve

    test = (result["frames"], result["eval"]["success_rate"], *result["eval"]["success_interval"])
    curve = read_curve(folder / "metrics.jsonl", result["eval"]["endings"], test)
    title = f"{scenario_folder_name(config.scenario)}, {config.agent}, seed {config.seed}"
    draw_learning_curve(curve, title, folder / "learning_curve.png")


def _write_card(
    config: "RunConfig", loaded: "Loaded", folder: Path, weights: Path, result: dict[str, Any]
) -> None:
    from socialai_dsl.cli.evaluation import about_of
    from socialai_dsl.cli.model_card import FILE, model_card

    place = weights.relative_to(folder).as_posix()
    write_text(folder / FILE, model_card(config, result, about_of(loaded), folder.as_posix(), place))


def _size(program: "Playable") -> str:
    """The size of the agent's choices, in one phrase."""
    said = sum(1 for _ in program.sentences.each())
    return f"{len(program.actions)} actions, {said} utterances, {len(program.vocabulary)} words"


def _record(evaluation: "Evaluation", folder: Path, label: str) -> None:
    """Film the first success, or the first episode if there is none, and where there are both, the first failure.

    A page replays some failures and successes.
    """
    from socialai_dsl.replay.page import replay_page

    write_text(folder / REPLAY, replay_page(evaluation.traces(_REPLAYED)))
    success = evaluation.result.success
    shown = {"episode": int(success.argmax())}
    if success.any() and not success.all():
        shown["failure"] = int(success.argmin())
    for name, number in shown.items():
        episode = evaluation.record(number, label)
        write_text(folder / ("transcript.txt" if name == "episode" else f"{name}.txt"), episode.transcript())
        episode.save_film(folder / f"{name}.gif")


def _table(result: dict[str, Any], folder: Path) -> str:
    from socialai_dsl.cli.evaluation_report import aligned, ending_lines, summary_rows

    rows = summary_rows(result["eval"])
    if result["frames"]:
        seconds, speed = result["train_seconds"], result["frames_per_second"]
        rows.append(("training", f"{result['frames']:,} frames in {seconds:.0f} s, {speed:,.0f} frames/s"))
    rows.append(("written to", str(folder)))
    rows.append(("to look at", str(folder / REPLAY)))
    return "\n".join(["", *aligned(rows), "", *ending_lines(result["eval"])])
