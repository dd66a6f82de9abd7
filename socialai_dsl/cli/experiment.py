"""`socialai experiment`: many runs from one file, on one machine or many."""

import argparse
from importlib import import_module
from pathlib import Path
from typing import Final

from socialai_dsl.cli import report
from socialai_dsl.cli.arguments import positive
from socialai_dsl.cli.errors import Exit
from socialai_dsl.experiments.engines import ENGINES

SUMMARY: Final = "plan, run and watch the runs that an experiment file declares"

EXAMPLES: Final = (
    ("socialai experiment plan paper --profile small", "lists the runs, and how long they will take"),
    ("socialai experiment run paper --profile small", "does the runs"),
    ("socialai experiment status runs/experiments/paper-small", "shows the progress"),
)


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
    for name, command in (("status", status), ("retry", retry), ("cancel", cancel)):
        command.add_argument("folder", type=Path, metavar="DIR", help="the experiment's folder")
        command.add_argument("--json", action="store_true", help="print a JSON object")
        command.set_defaults(act=("experiment_status", name))
    page = commands.add_parser("report", help=report.SUMMARY)
    report.add_arguments(page)
    page.set_defaults(act=("report", "execute"))
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
        "--out",
        type=Path,
        metavar="DIR",
        help="the experiment's folder (default: runs/experiments/NAME, or NAME-PROFILE)",
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
    parser.set_defaults(act=("experiment_status", "plan"))


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
    parser.set_defaults(act=("experiment_run", "run"))


def execute(arguments: argparse.Namespace) -> Exit:
    """Do what was asked for; the modules of the other actions are not loaded."""
    module, function = arguments.act
    end: Exit = getattr(import_module(f"socialai_dsl.cli.{module}"), function)(arguments)
    return end


def _parameter(text: str) -> tuple[str, str | int]:
    """`timeout_min=600` as a pair."""
    name, equals, value = text.partition("=")
    if not equals or not name.isidentifier():
        raise argparse.ArgumentTypeError(f"expected NAME=VALUE, got {text!r}")
    return name, int(value) if value.isdigit() else value
