"""`socialai experiment`: many runs from one file, on one machine or many."""

import argparse
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.cli import report
from socialai_dsl.cli.arguments import positive
from socialai_dsl.cli.errors import Exit
from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.errors import UsageError

if TYPE_CHECKING:
    from socialai_dsl.checking.experiments import LoadedExperiment
    from socialai_dsl.experiments.engines import Engine
    from socialai_dsl.experiments.folder import Run

SUMMARY: Final = "plan, run and watch the runs that an experiment file declares"

ENGINES: Final = ("local", "ray", "slurm")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command's commands."""
    commands = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    _add_plan(commands.add_parser("plan", help="list the runs, the time they need and their progress"))
    _add_run(commands.add_parser("run", help="do the runs that are left; repeat the command to continue"))
    status = commands.add_parser("status", help="show the progress of an experiment")
    status.add_argument(
        "--each", action="store_true", help="show a line for each run, not for each condition"
    )
    retry = commands.add_parser("retry", help="let the next `run` repeat failed and cancelled runs")
    cancel = commands.add_parser("cancel", help="give up runs, also those in progress")
    for command, execute in ((status, _status), (retry, _retry), (cancel, _cancel)):
        command.add_argument("folder", type=Path, metavar="DIR", help="the experiment's folder")
        command.add_argument("--json", action="store_true", help="print a JSON object")
        command.set_defaults(act=execute)
    page = commands.add_parser("report", help=report.SUMMARY)
    report.add_arguments(page)
    page.set_defaults(act=report.execute)
    for command in (retry, cancel):
        command.add_argument(
            "runs", nargs="*", metavar="RUN", help="id of a run or name of a condition (default: all)"
        )


def _add_file(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "file",
        metavar="FILE",
        help="the file of an experiment, the name of one that ships, or the folder of one that was started",
    )
    parser.add_argument("--profile", metavar="NAME", help="profile of the file (default: the file's)")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="the experiment's folder (default: runs/experiments/NAME)"
    )
    parser.add_argument(
        "--workers", type=positive, metavar="N", help="number of runs at once (default: one for each core)"
    )


def _add_plan(parser: argparse.ArgumentParser) -> None:
    _add_file(parser)
    parser.add_argument(
        "--each", action="store_true", help="show a line for each run, not for each condition"
    )
    parser.add_argument(
        "--measure", action="store_true", help="measure the speed of networks whose speed is not known"
    )
    parser.add_argument("--json", action="store_true", help="print a JSON object")
    parser.set_defaults(act=_plan)


def _add_run(parser: argparse.ArgumentParser) -> None:
    _add_file(parser)
    parser.add_argument(
        "--engine", choices=ENGINES, default="local", help="what does the runs (default: local)"
    )
    parser.add_argument(
        "--address", metavar="ADDRESS", help="address of the Ray cluster (default: a cluster of this machine)"
    )
    parser.add_argument(
        "--slurm",
        type=_parameter,
        action="append",
        metavar="NAME=VALUE",
        help="parameter of the Slurm jobs, such as timeout_min=600 or slurm_partition=cpu (repeatable)",
    )
    parser.add_argument(
        "--runs",
        type=Path,
        metavar="DIR",
        help="folder of the runs, which other experiments may share (default: `runs` in the experiment's folder)",
    )
    parser.add_argument(
        "--update",
        action="store_true",
        help="update the folder to a changed file; runs that did not change are kept",
    )
    parser.add_argument("--json", action="store_true", help="print only a JSON object, at the end")
    parser.set_defaults(act=_run)


def execute(arguments: argparse.Namespace) -> Exit:
    """Do what was asked for."""
    act: Callable[[argparse.Namespace], Exit] = arguments.act
    return act(arguments)


# -- plan and run ------------------------------------------------------------------------------------------------------


def _plan(arguments: argparse.Namespace) -> Exit:
    from socialai_dsl.cli.experiment_measure import measure_unknown
    from socialai_dsl.cli.experiment_tables import plan_figures, plan_text
    from socialai_dsl.experiments.estimate import Speeds
    from socialai_dsl.experiments.folder import runs_of

    document, folder = _document(arguments)
    runs = runs_of(folder, document)
    speeds = Speeds(runs)
    if arguments.measure:
        measure_unknown(runs, speeds, sys.stderr)
    figures = plan_figures(document, folder, runs, speeds, arguments.workers or _workers(document))
    print(
        json.dumps(figures, indent=2, ensure_ascii=False)
        if arguments.json
        else plan_text(figures, arguments.each)
    )
    return Exit.GOOD


def _run(arguments: argparse.Namespace) -> Exit:
    from socialai_dsl.evaluation.players import require_trainer
    from socialai_dsl.experiments.folder import runs_of

    require_trainer()
    from socialai_dsl.cli.experiment_run import work_on

    document, folder = _document(arguments)
    if arguments.address is not None and arguments.engine != "ray":
        raise UsageError("--address: only the engine `ray` has one")
    if arguments.slurm and arguments.engine != "slurm":
        raise UsageError("--slurm: only the engine `slurm` has jobs")
    _prepare(folder, document, arguments)
    engine = _engine(arguments, document, folder)
    return work_on(folder, document, runs_of(folder, document), engine, arguments.json)


def _document(arguments: argparse.Namespace) -> tuple[dict[str, Any], Path]:
    """What is to be run, and the folder for it."""
    from socialai_dsl.experiments.document import document_of
    from socialai_dsl.frontend import load_experiment
    from socialai_dsl.loader.library import looks_like_path, shipped_experiments

    given = Path(arguments.file)
    if given.is_dir():
        if arguments.out is not None or arguments.profile is not None:
            raise UsageError(
                f"{given} is a folder, which says itself what is run; --out and --profile are for files"
            )
        return _kept(given), given
    if not given.exists() and not looks_like_path(arguments.file):
        shipped = shipped_experiments()
        if arguments.file not in shipped:
            near = did_you_mean(arguments.file, shipped)
            hint = f"did you mean {near}?" if near else f"those that are shipped are {', '.join(shipped)}"
            raise UsageError(f"there is no experiment {arguments.file!r}; {hint}")
        given = shipped[arguments.file]
    loaded = load_experiment(given)
    profile = _profile(loaded, arguments.profile)
    document = document_of(loaded, profile)
    name = document["name"]
    if profile is not None and profile != loaded.experiment.profile:
        name += f"-{profile}"
    return document, arguments.out or Path("runs") / "experiments" / name


def _profile(loaded: "LoadedExperiment", asked: str | None) -> str | None:
    if asked is None:
        return loaded.experiment.profile
    if asked not in loaded.cells:
        near = did_you_mean(asked, loaded.experiment.profiles)
        listed = ", ".join(loaded.experiment.profiles) or "none"
        hint = f"did you mean {near}?" if near else f"the file's profiles are {listed}"
        raise UsageError(f"--profile: there is no {asked!r}; {hint}")
    return asked


def _prepare(folder: Path, document: dict[str, Any], arguments: argparse.Namespace) -> None:
    """Make the experiment's folder, or see that it is one of the same experiment."""
    from socialai_dsl.atomic import write_json
    from socialai_dsl.experiments.document import differences
    from socialai_dsl.experiments.folder import EXPERIMENT, RUNS

    if (folder / EXPERIMENT).exists():
        changed = differences(_kept(folder), document)
        if changed and not arguments.update:
            shown = changed[:10] + ([f"and {len(changed) - 10} more"] if len(changed) > 10 else [])
            listed = "".join(f"\n  {line}" for line in shown)
            raise UsageError(
                f"{folder} is of another experiment or of an earlier state of this one:{listed}\n"
                "Choose another --out; or let the folder follow with --update, which keeps the runs that are the same"
            )
    folder.mkdir(parents=True, exist_ok=True)
    runs = folder / RUNS
    if arguments.runs is not None and runs.resolve() != arguments.runs.resolve():
        if runs.exists() or runs.is_symlink():
            raise UsageError(f"--runs: {runs} exists already, so its runs stay there")
        arguments.runs.mkdir(parents=True, exist_ok=True)
        runs.symlink_to(arguments.runs.resolve(), target_is_directory=True)
    runs.mkdir(exist_ok=True)
    write_json(folder / EXPERIMENT, document)


def _engine(arguments: argparse.Namespace, document: dict[str, Any], folder: Path) -> "Engine":
    from socialai_dsl.experiments.engines import MissingEngineError
    from socialai_dsl.experiments.engines.local import LocalEngine
    from socialai_dsl.experiments.engines.ray import RayEngine
    from socialai_dsl.experiments.engines.slurm import SlurmEngine

    threads = _threads(document)
    workers = arguments.workers or _workers(document)
    try:
        match arguments.engine:
            case "ray":
                return RayEngine(arguments.address, threads, workers)
            case "slurm":
                # A cluster has more cores than this machine: all jobs at once, unless somebody says how many.
                at_once = arguments.workers or len(document["runs"])
                return SlurmEngine(folder, threads, at_once, dict(arguments.slurm or ()))
    except (MissingEngineError, ValueError) as error:
        raise UsageError(str(error)) from None
    return LocalEngine(workers)


def _parameter(text: str) -> tuple[str, str | int]:
    """`timeout_min=600` as a pair."""
    name, equals, value = text.partition("=")
    if not equals or not name.isidentifier():
        raise argparse.ArgumentTypeError(f"expected NAME=VALUE, got {text!r}")
    return name, int(value) if value.isdigit() else value


def _threads(document: dict[str, Any]) -> int:
    """The cores that a run needs, whichever it is."""
    return max(int(condition["options"].get("threads", 1)) for condition in document["conditions"])


def _workers(document: dict[str, Any]) -> int:
    """As many runs at once as this machine has cores for."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores // _threads(document))


# -- status, retry, cancel ---------------------------------------------------------------------------------------------


def _status(arguments: argparse.Namespace) -> Exit:
    from socialai_dsl.cli.experiment_tables import status_figures, status_text
    from socialai_dsl.experiments.folder import runs_of

    document = _kept(arguments.folder)
    figures = status_figures(document, arguments.folder, runs_of(arguments.folder, document))
    text = (
        json.dumps(figures, indent=2, ensure_ascii=False)
        if arguments.json
        else status_text(figures, arguments.each)
    )
    print(text)
    return Exit.GOOD


def _retry(arguments: argparse.Namespace) -> Exit:
    from socialai_dsl.experiments.work import retry

    chosen = _chosen(arguments)
    wanted = [run for run in chosen if run.shown_status().state in ("failed", "cancelled")]
    return _tell(arguments, "waiting", wanted, {run.id for run in wanted if retry(run)})


def _cancel(arguments: argparse.Namespace) -> Exit:
    from socialai_dsl.experiments.work import cancel

    wanted = [run for run in _chosen(arguments) if run.shown_status().state in ("waiting", "running")]
    for run in wanted:
        cancel(run)
    return _tell(arguments, "cancelled", wanted, {run.id for run in wanted})


def _tell(arguments: argparse.Namespace, state: str, wanted: "list[Run]", changed: set[str]) -> Exit:
    """Say what became of wishes for runs."""
    missed = [run for run in wanted if run.id not in changed]
    if arguments.json:
        print(json.dumps({state: sorted(changed), "busy": [run.id for run in missed]}, indent=2))
    else:
        print(f"{len(changed)} runs {state}" if len(changed) != 1 else f"1 run {state}")
        for run in missed:
            print(f"{run.label} ({run.id}): somebody works on it just now", file=sys.stderr)
    return Exit.FINDINGS if missed else Exit.GOOD


def _chosen(arguments: argparse.Namespace) -> "list[Run]":
    from socialai_dsl.experiments.folder import runs_of

    document = _kept(arguments.folder)
    runs = runs_of(arguments.folder, document)
    if not arguments.runs:
        return runs
    names: dict[str, set[str]] = {}
    for entry in document["runs"]:
        names.setdefault(entry["condition"], set()).add(entry["id"])
        names.setdefault(entry["id"], set()).add(entry["id"])
    for word in arguments.runs:
        if word not in names:
            near = did_you_mean(word, names)
            hint = f"; did you mean {near}?" if near else ""
            raise UsageError(f"RUN: {arguments.folder} has no run and no condition {word!r}{hint}")
    wanted = set().union(*(names[word] for word in arguments.runs))
    return [run for run in runs if run.id in wanted]


def _kept(folder: Path) -> dict[str, Any]:
    """What an experiment's folder says is run."""
    from socialai_dsl.experiments.folder import EXPERIMENT, UnreadableError, read_experiment

    try:
        document = read_experiment(folder)
    except UnreadableError as error:
        raise UsageError(str(error)) from None
    if document is None:
        raise UsageError(f"{folder} is no experiment's folder, it has no {EXPERIMENT}")
    return document
