"""`socialai-run`: checks a scenario, trains an agent on it, evaluates it, leaves a folder of results."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.atomic import write_json
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import json_text
from socialai_dsl.runs.folder import CONFIG, REPLAY, RESULT, new_run_folder, only_writer
from socialai_dsl.runs.versions import versions

if TYPE_CHECKING:
    from socialai_dsl.checking.loaded import Loaded
    from socialai_dsl.program_suite import Playable
    from trainer.config import RunConfig

SUMMARY: Final = "train an agent on a scenario, test it, and write pictures and figures"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    from socialai_dsl.cli.run_options import add_options

    parser.add_argument(
        "scenario", nargs="?", metavar="SCENARIO", help="a path or a name, with +variants and ?parameters"
    )
    add_options(parser)
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of this run (default: runs/<scenario>/<time>-s<seed>)"
    )
    parser.add_argument("--resume", type=Path, metavar="RUN_DIR", help="continue a run that was stopped")
    parser.add_argument("--json", action="store_true", help="print only the result, as a JSON object")


def execute(arguments: argparse.Namespace) -> Exit:
    """Do the whole run."""
    from socialai_dsl.cli.run_options import check_resumable, resumed, started
    from socialai_dsl.cli.training import discard_unstarted
    from socialai_dsl.diagnostics import ScenarioError
    from socialai_dsl.envs.factory import compiled
    from socialai_dsl.errors import RunFailed, UsageError
    from socialai_dsl.evaluation.export import keep_run
    from socialai_dsl.evaluation.players import require_trainer

    require_trainer()
    folder: Path | None = arguments.resume
    if folder is not None:
        check_resumable(arguments)  # so that no folder is made where there is none
        with only_writer(folder):
            config, loaded = resumed(arguments)
            return _run(config, loaded, compiled(loaded), folder, arguments)
    config, loaded = started(arguments)
    program = compiled(loaded)
    with new_run_folder(arguments.out, config.scenario, config.seed) as folder:
        before = set(folder.iterdir())
        copied: set[Path] = set()
        try:
            try:
                config = keep_run(folder, config, loaded)
            finally:
                copied = set(folder.iterdir()) - before
            return _run(config, loaded, program, folder, arguments)
        except (ScenarioError, UsageError, RunFailed):
            if config.trains:
                discard_unstarted(folder, copied)
            raise


def _run(
    config: "RunConfig",
    loaded: "Loaded",
    program: "Playable",
    folder: Path,
    arguments: argparse.Namespace,
) -> Exit:
    """Train if the agent is to be trained, evaluate, write everything down."""
    from socialai_dsl.cli.training import draw_curve, record_run, train_agent, training_figures, write_card
    from socialai_dsl.evaluation.players import Player
    from socialai_dsl.evaluation.testing import play_test_set
    from socialai_dsl.replay.endings import short_name

    # With --json, standard output belongs to the result alone.
    stream = sys.stderr if arguments.json else sys.stdout
    agent, training = config.agent, _NOT_TRAINED
    write_json(folder / CONFIG, config.model_dump())
    print(
        f"{arguments.scenario or config.scenario}: {_size(program)}; writing to {folder}",
        file=stream,
        flush=True,
    )
    if config.trains:
        agent = str(train_agent(config, loaded, program, folder, bool(arguments.resume), stream))
        training = training_figures(folder)
    # What is trained differs by its training; what is not, by what it draws.
    drawn = 0 if config.trains else config.seed
    player = Player(agent, config.device, seed=drawn, net=config.net, folder=config.code_folder, out=folder)
    evaluation = play_test_set(player, config.played, loaded, program, config.eval_episodes)
    for warning in evaluation.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    result = {
        "scenario": config.scenario,
        "agent": short_name(config.agent),
        "seed": config.seed,
        **({"recipe": config.recipe, "guide": config.guide} if config.trains else {}),
        **training,
        "eval": evaluation.figures(),
        "program_sha256": program.sha256,
        "versions": versions(),
    }
    record_run(evaluation, folder, f"agent {short_name(config.agent)}, seed {config.seed}")
    if config.trains:
        draw_curve(config, folder, result)
        write_card(config, loaded, folder, Path(agent), result)
    write_json(folder / RESULT, result)  # last, so that its presence means a complete run
    print(json_text(result) if arguments.json else _table(result, folder))
    return Exit.GOOD


_NOT_TRAINED: Final = {"frames": 0, "train_seconds": 0.0, "frames_per_second": None}


def _size(program: "Playable") -> str:
    """The size of the agent's choices, in one phrase."""
    said = sum(1 for _ in program.sentences.each())
    return f"{len(program.actions)} actions, {said} utterances, {len(program.vocabulary)} words"


def _table(result: dict[str, Any], folder: Path) -> str:
    from socialai_dsl.evaluation.summary import aligned, ending_lines, summary_rows

    rows = summary_rows(result["eval"])
    if result["frames"]:
        seconds, speed = result["train_seconds"], result["frames_per_second"]
        rows.append(("training", f"{result['frames']:,} frames in {seconds:.0f} s, {speed:,.0f} frames/s"))
    rows.append(("written to", str(folder)))
    rows.append(("to look at", str(folder / REPLAY)))
    return "\n".join(["", *aligned(rows), "", *ending_lines(result["eval"])])
