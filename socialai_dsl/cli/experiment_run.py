"""`socialai experiment run`: works on an experiment's runs until all have ended."""

import argparse
import contextlib
import signal
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.experiment_progress import RunsProgress
from socialai_dsl.cli.experiment_tables import status_text
from socialai_dsl.cli.terminal import json_text
from socialai_dsl.episodes.players import require_trainer
from socialai_dsl.errors import UsageError
from socialai_dsl.experiments.driver import drive
from socialai_dsl.experiments.engines import Engine, MissingEngineError
from socialai_dsl.experiments.engines.local import LocalEngine
from socialai_dsl.experiments.engines.ray import RayEngine
from socialai_dsl.experiments.engines.slurm import SlurmEngine
from socialai_dsl.experiments.figures import status_figures
from socialai_dsl.experiments.folder import PlannedRun, runs_of
from socialai_dsl.experiments.request import prepare, requested, threads, workers
from socialai_dsl.experiments.work import Outcome
from socialai_dsl.runs.folder import only_writer


def run(arguments: argparse.Namespace) -> Exit:
    """Make the folder, or go on in it, and do the runs that are left."""
    require_trainer()
    document, folder = requested(arguments.file, arguments.profile, arguments.out)
    if arguments.address is not None and arguments.engine != "ray":
        raise UsageError("--address: only the engine `ray` has one")
    if arguments.slurm and arguments.engine != "slurm":
        raise UsageError("--slurm: only the engine `slurm` has jobs")
    with only_writer(folder):  # the runs have locks of their own, so that several commands may work on them
        prepare(folder, document, arguments.runs, arguments.update)
    engine = _engine(arguments, document, folder)
    return work_on(folder, document, runs_of(folder, document), engine, arguments.json)


def _engine(arguments: argparse.Namespace, document: dict[str, Any], folder: Path) -> Engine:
    cores = threads(document)
    at_most = arguments.workers or workers(document)
    try:
        match arguments.engine:
            case "ray":
                return RayEngine(arguments.address, cores, at_most)
            case "slurm":
                # A cluster has more cores than this machine: all jobs are submitted at once unless --workers is given.
                at_once = arguments.workers or len(document["runs"])
                return SlurmEngine(folder, cores, at_once, dict(arguments.slurm or ()))
    except (MissingEngineError, ValueError) as error:
        raise UsageError(str(error)) from None
    return LocalEngine(at_most)


def work_on(
    folder: Path, document: Mapping[str, Any], runs: Sequence[PlannedRun], engine: Engine, as_json: bool
) -> Exit:
    """Work on the runs that are left, and report their results.

    Raises:
        KeyboardInterrupt: it was interrupted; all runs are left so that the same command goes on with them.
    """
    outcomes: Counter[str] = Counter()
    # With --json, standard output belongs to the result alone.
    stream = sys.stderr if as_json else sys.stdout
    with _stopped_by_signals(), RunsProgress(runs, stream) as shown:

        def ended(run: PlannedRun, outcome: Outcome, message: str) -> None:
            outcomes[outcome.value] += 1
            shown.ended(run, outcome.value, message)

        rounds = drive(folder, runs, engine, ended)
        try:
            for _ in rounds:
                shown.look()
        except KeyboardInterrupt:
            rounds.close()
            raise KeyboardInterrupt("stopped; the same command goes on from here") from None
    figures = status_figures(document, folder, runs)
    print(json_text(figures) if as_json else "\n" + status_text(figures, each=False))
    return Exit.GOOD if outcomes["failed"] == 0 else Exit.FINDINGS


@contextlib.contextmanager
def _stopped_by_signals() -> Iterator[None]:
    """Let SIGTERM stop us as Ctrl-C does."""

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
