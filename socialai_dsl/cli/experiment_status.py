"""`socialai experiment plan`, `status`, `retry` and `cancel`: how far runs are, and wishes for them."""

import argparse
import sys

from socialai_dsl.cli.arguments import refuse
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.experiment_tables import plan_text, status_text
from socialai_dsl.cli.terminal import json_text
from socialai_dsl.diagnostics import counted
from socialai_dsl.experiments import work
from socialai_dsl.experiments.estimate import Speeds
from socialai_dsl.experiments.figures import plan_figures, status_figures
from socialai_dsl.experiments.folder import PlannedRun, read_experiment, runs_of
from socialai_dsl.experiments.measure import measure_unknown
from socialai_dsl.experiments.request import chosen_runs, requested, usual_workers


def plan(arguments: argparse.Namespace) -> Exit:
    """Print the runs, the time they need and their progress."""
    if arguments.json:
        refuse(arguments, ("each",), "the JSON object has every run")
    document, folder = requested(arguments.file, arguments.profile, arguments.out)
    runs = runs_of(folder, document)
    speeds = Speeds(runs)
    if arguments.measure:
        measure_unknown(runs, speeds, lambda line: print(line, file=sys.stderr, flush=True))
    workers = arguments.workers or usual_workers(document)
    figures = plan_figures(document, folder, runs, speeds, workers)
    print(json_text(figures) if arguments.json else plan_text(figures, arguments.each))
    return Exit.GOOD


def status(arguments: argparse.Namespace) -> Exit:
    """Print how far the runs are."""
    if arguments.json:
        refuse(arguments, ("each",), "the JSON object has every run")
    document = read_experiment(arguments.folder)
    figures = status_figures(document, arguments.folder, runs_of(arguments.folder, document))
    print(json_text(figures) if arguments.json else status_text(figures, arguments.each))
    return Exit.GOOD


def retry(arguments: argparse.Namespace) -> Exit:
    """Let the next `run` repeat runs that failed or were cancelled."""
    chosen = chosen_runs(arguments.folder, arguments.runs)
    wanted = [run for run in chosen if run.shown_status.state in ("failed", "cancelled")]
    return _tell(arguments, "waiting", wanted, {run.id for run in wanted if work.retry(run)})


def cancel(arguments: argparse.Namespace) -> Exit:
    """Give up runs that have not ended."""
    wanted = [
        run
        for run in chosen_runs(arguments.folder, arguments.runs)
        if run.shown_status.state in ("waiting", "running")
    ]
    for run in wanted:
        work.cancel(run)
    return _tell(arguments, "cancelled", wanted, {run.id for run in wanted})


def _tell(arguments: argparse.Namespace, state: str, wanted: list[PlannedRun], changed: set[str]) -> Exit:
    """Say what became of wishes for runs."""
    missed = [run for run in wanted if run.id not in changed]
    if arguments.json:
        print(json_text({state: sorted(changed), "busy": [run.id for run in missed]}))
    else:
        print(f"{counted(len(changed), 'run')} {state}")
        for run in missed:
            print(
                f"{run.label} ({run.id}): {run.worker or 'a process'} is working on it",
                file=sys.stderr,
            )
    return Exit.FINDINGS if missed else Exit.GOOD
