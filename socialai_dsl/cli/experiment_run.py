"""`socialai experiment run`: works on an experiment's runs until all have ended."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from socialai_dsl.cli.arguments import refuse
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.experiment_progress import RunsProgress
from socialai_dsl.cli.experiment_tables import status_text
from socialai_dsl.cli.terminal import json_text
from socialai_dsl.episodes.players import Player, require_trainer
from socialai_dsl.experiments.driver import drive, stopped_by_signals
from socialai_dsl.experiments.engines import Engine
from socialai_dsl.experiments.engines.choice import engine_named
from socialai_dsl.experiments.figures import status_figures
from socialai_dsl.experiments.folder import PlannedRun, runs_of
from socialai_dsl.experiments.request import prepare, requested
from socialai_dsl.runs.folder import only_writer


def run(arguments: argparse.Namespace) -> Exit:
    """Make the folder, or go on in it, and do the runs that are left."""
    document, folder = requested(arguments.file, arguments.profile, arguments.out)
    if any(Player(condition["agent"]).is_trained for condition in document["conditions"]):
        require_trainer("matplotlib", "tensorboard")
    if arguments.engine != "ray":
        refuse(arguments, ("address",), "only the engine `ray` has one")
    if arguments.engine != "slurm":
        refuse(arguments, ("slurm",), "only the engine `slurm` has jobs")
    with only_writer(folder):  # the runs have locks of their own, so that several commands may work on them
        prepare(folder, document, arguments.runs, arguments.update)
    parameters = dict(arguments.slurm or ())
    engine = engine_named(
        arguments.engine, folder, document, arguments.workers, arguments.address, parameters
    )
    return work_on(folder, document, runs_of(folder, document), engine, arguments.json)


def work_on(
    folder: Path, document: Mapping[str, Any], runs: Sequence[PlannedRun], engine: Engine, as_json: bool
) -> Exit:
    """Work on the runs that are left, and report their results.

    Raises:
        KeyboardInterrupt: it was interrupted; all runs are left so that the same command goes on with them.
    """
    # With --json, standard output belongs to the result alone.
    stream = sys.stderr if as_json else sys.stdout
    with (
        stopped_by_signals(),
        RunsProgress(runs, stream) as shown,
        closing(drive(folder, runs, engine, shown.ended)) as rounds,
    ):
        for _ in rounds:
            shown.look()
    figures = status_figures(document, folder, runs)
    print(json_text(figures) if as_json else "\n" + status_text(figures, each=False))
    return Exit.FINDINGS if shown.ends["failed"] else Exit.GOOD
