"""Measure how fast the environments are on this machine, or the trainer beside its peers: `make bench`."""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.main import run_alone
from socialai_dsl.errors import UsageError

SUMMARY: Final = "measure the speed of the environments, or of training, on this machine"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenarios",
        nargs="*",
        metavar="SCENARIO",
        help="default: talkitout; two or more also run as one batch",
    )
    parser.add_argument(
        "--all", action="store_true", help="every shipped scenario, each by itself and all as one batch"
    )
    parser.add_argument(
        "--batch", type=_batches, default="1,16,256,4096", metavar="N,N", help="default: 1,16,256,4096"
    )
    parser.add_argument("--mix", choices=("walk", "random", "both"), default="both", help="default: both")
    parser.add_argument(
        "--repeat", type=int, metavar="N", help="repetitions; the median counts (default: 5; with --train 3)"
    )
    parser.add_argument(
        "--seconds",
        type=float,
        metavar="S",
        help="length of one repetition (default: 0.3), or with --train of all of them (default: 10)",
    )
    training = parser.add_argument_group("training")
    training.add_argument(
        "--train",
        action="store_true",
        help="measure training instead: rollout and update of one SCENARIO, ours beside other trainers",
    )
    training.add_argument("--threads", type=int, metavar="N", help="cores to use (default: 1)")
    parser.add_argument(
        "--only",
        action="append",
        metavar="NAME",
        help="measure only this: ours, rules, programs, start, a peer, a limit; with --train a trainer; "
        "may be given again",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of a table")
    parser.add_argument("--out", type=Path, metavar="FILE", help="also write the JSON object to a file")
    parser.add_argument(
        "--plot", type=Path, metavar="FILE", help="draw steps per second over the number of environments"
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Measure, then print."""
    if (arguments.repeat is not None and arguments.repeat < 1) or (arguments.seconds or 1) <= 0:
        raise UsageError("--repeat and --seconds: expected positive numbers")
    if arguments.all and arguments.scenarios:
        raise UsageError("--all: expected no SCENARIO beside it")
    if not arguments.train and arguments.threads is not None:
        raise UsageError("--threads: expected --train beside it")
    if arguments.train and arguments.plot:
        raise UsageError("--plot: expected no --train beside it")
    content, table = (_training if arguments.train else _environments)(arguments)
    text = json.dumps(content, indent=2)
    if arguments.out:
        arguments.out.write_text(text + "\n", encoding="utf-8")
    print(text if arguments.json else table)
    return Exit.GOOD


def _environments(arguments: argparse.Namespace) -> tuple[dict[str, Any], str]:
    """Report on the environments, as an object and as a table."""
    from benchmarks.engine import Plan, measure_engine, parts
    from socialai_dsl.loader.shipped import shipped_scenarios

    _check_names(arguments.only, parts(), "; for a trainer, expected --train beside it")
    if arguments.plot:
        try:
            from benchmarks.plot import draw_report
        except ImportError as error:
            raise UsageError(f"--plot: {error}; install the extra [train]") from error
    plan = Plan(
        shipped_scenarios() if arguments.all else arguments.scenarios or ["talkitout"],
        arguments.batch,
        ("walk", "random") if arguments.mix == "both" else (arguments.mix,),
        arguments.repeat or 5,
        arguments.seconds or 0.3,
        arguments.only or (),
    )
    report = measure_engine(plan, _note)
    if arguments.plot:
        draw_report(report, arguments.plot)
    return report.as_json(), report.table()


def _check_names(only: list[str] | None, known: list[str], advice: str = "") -> None:
    for name in only or ():
        if name not in known:
            raise UsageError(f"--only: got {name!r}, expected one of {', '.join(known)}{advice}")


def _training(arguments: argparse.Namespace) -> tuple[dict[str, Any], str]:
    """Report on training, as an object and as a table."""
    if arguments.all or len(arguments.scenarios) > 1:
        raise UsageError("--train: expected one SCENARIO")
    try:
        from benchmarks.training_entries import entries
        from benchmarks.training_report import training_table
        from benchmarks.training_speed import measure_training
    except ImportError as error:
        raise UsageError(f"--train: {error}; install the extra [train]") from error

    threads, cores = 1 if arguments.threads is None else arguments.threads, len(os.sched_getaffinity(0))
    if not 1 <= threads <= cores:
        raise UsageError(f"--threads: got {threads}, expected 1 to {cores}, the cores of this machine")
    known = entries()
    _check_names(arguments.only, [entry.name for entry in known])
    chosen = [entry for entry in known if not arguments.only or entry.name in arguments.only]
    scenario = arguments.scenarios[0] if arguments.scenarios else "talkitout"
    report = measure_training(
        scenario, chosen, threads, arguments.seconds or 10.0, arguments.repeat or 3, _note
    )
    return report.as_json(), training_table(report)


def _note(line: str) -> None:
    """Show that it goes on; the report itself comes at the end."""
    print(line, file=sys.stderr, flush=True)


def _batches(text: str) -> list[int]:
    try:
        batches = [int(part) for part in text.split(",")]
    except ValueError:
        batches = []
    if not batches or min(batches) < 1:
        raise argparse.ArgumentTypeError(f"expected numbers such as 1,256, got {text!r}")
    return batches


def main(argv: Sequence[str] | None = None) -> int:
    """Run this script and return its exit code."""
    return run_alone("python -m benchmarks", sys.modules[__name__], argv)


if __name__ == "__main__":
    sys.exit(main())
