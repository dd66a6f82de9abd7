"""This module is `socialai-run`: check a scenario, train an agent on it, evaluate it, leave a folder of results."""

import argparse
import contextlib
import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

from socialai_dsl.cli.arguments import natural, positive
from socialai_dsl.cli.errors import Exit, UsageError
from socialai_dsl.cli.run_folder import (
    RESULT,
    SETTINGS,
    create_run_folder,
    scenario_folder_name,
    versions,
    write_json,
    write_text,
)
from socialai_dsl.cli.settings import Settings, read_settings

if TYPE_CHECKING:
    from socialai_dsl.checking import Loaded
    from socialai_dsl.cli.evaluation import Evaluation
    from socialai_dsl.program_suite import Playable
    from trainer.team import Team

SUMMARY: Final = "train an agent on a scenario, evaluate it and write pictures and figures"

# About two minutes of training with the fast network on two cores of a server.
DEFAULT_FRAMES: Final = 600_000
BUILT_IN_AGENTS: Final = ("ppo", "random", "oracle", "human")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenario", nargs="?", metavar="SCENARIO", help="a path or a name, with +variants and ?parameters"
    )
    parser.add_argument(
        "--agent",
        default="ppo",
        help="ppo (default), random, oracle, human, or a checkpoint or run folder; all but ppo skip training",
    )
    parser.add_argument(
        "--frames", type=positive, metavar="N", help=f"frames to train for (default: {DEFAULT_FRAMES:,})"
    )
    parser.add_argument("--seed", type=natural, default=0, metavar="N", help="default: 0")
    parser.add_argument(
        "--envs",
        type=positive,
        metavar="N",
        help="environments at once (default: 256, or the preset's number)",
    )
    parser.add_argument(
        "--net",
        default="fast",
        help="fast (default), paper, or my.module:MyNet; paper-reference and paper-reference-tuned are presets: the "
        "paper's network with its update and all of its numbers",
    )
    parser.add_argument(
        "--explo",
        choices=("none", "auto", "lang", "cell"),
        default="none",
        help="exploration bonus (default: none); auto: the paper's choice for this scenario",
    )
    parser.add_argument(
        "--curriculum",
        default="none",
        metavar="NAME",
        help="who chooses the members of a suite while training: expert, progress, reverse, a .yaml file of phases, or "
        "my.module:MyCurriculum (default: none)",
    )
    parser.add_argument(
        "--precision",
        choices=("auto", "float32", "bfloat16"),
        default="auto",
        help="numbers the convolutions of `paper` compute with (default: auto, bfloat16 where the device has it)",
    )
    parser.add_argument(
        "--hyper",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a hyper-parameter of the trainer, such as lr=1e-4 or entropy_coef=0.02; may be given again",
    )
    parser.add_argument(
        "--compile",
        action="store_true",
        help="let torch.compile make the part of the network that reads images and dialogue; meant for GPUs",
    )
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto", help="default: auto")
    parser.add_argument(
        "--threads",
        type=natural,
        default=0,
        metavar="N",
        help="CPU threads that train, in each process (default: one per core, at most 4)",
    )
    parser.add_argument(
        "--checkpoint-every",
        type=positive,
        default=50,
        metavar="N",
        help="updates between checkpoints (default: 50)",
    )
    parser.add_argument(
        "--eval-episodes", type=positive, default=500, metavar="N", help="of the test set (default: 500)"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of this run (default: runs/<scenario>/<time>-s<seed>)"
    )
    parser.add_argument(
        "--wandb",
        metavar="PROJECT",
        help="also send the figures to this project of Weights & Biases (needs the extra `wandb`)",
    )
    parser.add_argument("--resume", type=Path, metavar="RUN_DIR", help="go on with a run that was stopped")
    parser.add_argument("--json", action="store_true", help="print only the result, as one JSON object")


def execute(arguments: argparse.Namespace) -> Exit:
    """Do the whole run."""
    import socialai_dsl
    from socialai_dsl.cli.agents import joined_team, require_trainer
    from socialai_dsl.cli.evaluation import Player, evaluate_agent

    require_trainer()
    settings = _resumed(arguments) if arguments.resume else _started(arguments)
    loaded = socialai_dsl.load(settings.scenario)
    program = socialai_dsl.compile(loaded)
    written = _written(settings)
    # With --json, standard output belongs to the result alone.
    stream = sys.stderr if arguments.json else sys.stdout
    agent, training = settings.agent, _NOT_TRAINED
    with joined_team(settings) as team:
        folder = arguments.resume
        if team.writes:
            folder = folder or create_run_folder(arguments.out, settings.scenario, settings.seed)
            write_json(folder / SETTINGS, written)
            print(f"{settings.scenario}: {_size(program)}; writing to {folder}", file=stream, flush=True)
        folder = Path(team.tell(str(folder)))
        if settings.agent == "ppo":
            agent = _train(settings, folder, bool(arguments.resume), stream, team)
    if not team.writes:
        return Exit.GOOD
    if settings.agent == "ppo":
        training = _training_figures(folder)
    # What is trained differs by its training; what is not, by what it draws.
    drawn = 0 if settings.agent == "ppo" else settings.seed
    player = Player(agent, settings.device, seed=drawn, net=settings.net)
    evaluation = evaluate_agent(player, settings.scenario, settings.eval_episodes)
    for warning in evaluation.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    result = {
        "scenario": settings.scenario,
        "agent": settings.agent,
        "seed": settings.seed,
        **training,
        "eval": evaluation.figures(),
        "program_sha256": program.sha256,
        "versions": versions(),
    }
    episode = evaluation.record(_shown(evaluation), f"agent {settings.agent}, seed {settings.seed}")
    write_text(folder / "transcript.txt", episode.transcript())
    episode.save_film(folder / "episode.gif")
    if settings.agent == "ppo":
        _draw_curve(settings, program, folder, result)
        _write_card(settings, loaded, folder, Path(agent), result)
    write_json(folder / RESULT, result)  # last, so that its presence means a complete run
    print(json.dumps(result, indent=2, ensure_ascii=False) if arguments.json else _table(result, folder))
    return Exit.GOOD


def _train(settings: Settings, folder: Path, resume: bool, stream: IO[str], team: "Team") -> str:
    """Train in the run's folder and return the path of the final checkpoint."""
    from socialai_dsl.cli.agents import train_agent

    try:
        return str(train_agent(settings, folder, resume, stream, team))
    except UsageError:
        if team.writes:
            _discard_unstarted(folder)
        raise


_NOT_TRAINED: Final = {"frames": 0, "train_seconds": 0.0, "frames_per_second": None}


def _discard_unstarted(folder: Path) -> None:
    """Take back the folder of a run that could not even begin, so that the same command can be given again."""
    from trainer.checkpoint import FOLDER

    checkpoints = folder / FOLDER
    if not any(checkpoints.glob("*.safetensors")):
        (folder / SETTINGS).unlink(missing_ok=True)
        for empty in (checkpoints, folder):
            with contextlib.suppress(OSError):  # it is not there, or holds files of the user's
                empty.rmdir()


def _written(settings: Settings) -> dict[str, Any]:
    """The settings as their file holds them, with every number of the trainer for readers."""
    from socialai_dsl.cli.agents import train_config

    if settings.agent != "ppo":
        return asdict(settings)
    return asdict(settings) | {"trainer": train_config(settings).model_dump()}


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


def _started(arguments: argparse.Namespace) -> Settings:
    """The settings of a new run."""
    from socialai_dsl.cli.agents import (
        default_envs,
        resolve_device,
        resolve_exploration,
        resolve_hyper,
        resolve_precision,
        resolve_threads,
    )

    if arguments.scenario is None:
        raise UsageError("expected a scenario (a path or a name), or --resume RUN_DIR")
    trains = arguments.agent == "ppo"
    if arguments.agent not in BUILT_IN_AGENTS and not Path(arguments.agent).exists():
        known = ", ".join(BUILT_IN_AGENTS)
        raise UsageError(f"--agent: expected {known} or the path of a checkpoint, got {arguments.agent!r}")
    if not trains and arguments.frames is not None:
        raise UsageError(f"--frames: the agent {arguments.agent!r} is not trained")
    if not trains and arguments.wandb is not None:
        raise UsageError(f"--wandb: the agent {arguments.agent!r} is not trained")
    if not trains and arguments.curriculum != "none":
        raise UsageError(f"--curriculum: the agent {arguments.agent!r} is not trained")
    if arguments.agent == "human" and arguments.json:
        raise UsageError("--json: the agent 'human' plays on standard output")
    if not trains and arguments.hyper:
        raise UsageError(f"--hyper: the agent {arguments.agent!r} is not trained")
    if not trains and arguments.compile:
        raise UsageError(f"--compile: the agent {arguments.agent!r} is not trained")
    device = resolve_device(arguments.device)
    explo, explo_c = resolve_exploration(arguments.explo, arguments.scenario)
    return Settings(
        scenario=arguments.scenario,
        agent=arguments.agent,
        seed=arguments.seed,
        frames=(arguments.frames or DEFAULT_FRAMES) if trains else 0,
        envs=arguments.envs or default_envs(arguments.net),
        net=arguments.net,
        explo=explo,
        explo_c=explo_c,
        device=device,
        eval_episodes=arguments.eval_episodes,
        precision=resolve_precision(arguments.precision, arguments.net, device),
        compile=arguments.compile,
        hyper=resolve_hyper(arguments.hyper),
        curriculum=arguments.curriculum,
        threads=resolve_threads(arguments.threads) if trains else 0,
        checkpoint_every=arguments.checkpoint_every,
        wandb=arguments.wandb,
    )


def _resumed(arguments: argparse.Namespace) -> Settings:
    """The settings of a run that was stopped; `--frames` may be raised, and W&B be told from now on."""
    folder: Path = arguments.resume
    if arguments.scenario is not None or arguments.out is not None:
        raise UsageError(
            "--resume: the run's folder says which scenario it is; give neither SCENARIO nor --out"
        )
    try:
        settings = read_settings(folder)
    except UsageError as error:
        raise UsageError(f"--resume: {error}") from None
    if settings.agent != "ppo":
        raise UsageError(f"--resume: the agent {settings.agent!r} of {folder} is not trained")
    return replace(
        settings, frames=arguments.frames or settings.frames, wandb=arguments.wandb or settings.wandb
    )


def _draw_curve(settings: Settings, program: "Playable", folder: Path, result: dict[str, Any]) -> None:
    from socialai_dsl.reporting.curve import draw_learning_curve, read_curve

    test = (result["frames"], result["eval"]["success_rate"], *result["eval"]["success_interval"])
    successes = frozenset(outcome.name for outcome in program.outcome_table if outcome.success)
    curve = read_curve(folder / "metrics.jsonl", successes, test)
    title = f"{scenario_folder_name(settings.scenario)}, {settings.agent}, seed {settings.seed}"
    draw_learning_curve(curve, title, folder / "learning_curve.png")


def _write_card(
    settings: Settings, loaded: "Loaded", folder: Path, weights: Path, result: dict[str, Any]
) -> None:
    from socialai_dsl.cli.agents import train_config
    from socialai_dsl.cli.model_card import FILE, model_card

    data = loaded.resolved.data
    about = str(data.get("about", "")) if isinstance(data, dict) else ""
    hyper = train_config(settings).model_dump()
    write_text(folder / FILE, model_card(settings, hyper, result, about, folder, weights))


def _size(program: "Playable") -> str:
    """The size of the agent's choices, in one phrase."""
    said = len(program.templates) * len(program.nouns)
    return f"{len(program.actions)} actions, {said} utterances, {len(program.vocabulary)} words"


def _shown(evaluation: "Evaluation") -> int:
    """The episode whose film is made: the first success, or the first of all if there is none."""
    return int(evaluation.result.success.argmax())


def _table(result: dict[str, Any], folder: Path) -> str:
    from socialai_dsl.cli.evaluation_report import aligned, ending_lines, summary_rows

    rows = summary_rows(result["eval"])
    if result["frames"]:
        seconds, speed = result["train_seconds"], result["frames_per_second"]
        rows.append(("training", f"{result['frames']:,} frames in {seconds:.0f} s, {speed:,.0f} frames/s"))
    rows.append(("written to", str(folder)))
    return "\n".join(["", *aligned(rows), "", *ending_lines(result["eval"])])
