"""This module is `socialai bench`: how fast the environments, and if asked the trainer, are on this machine."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.cli.errors import Exit, UsageError

if TYPE_CHECKING:
    from socialai_dsl.cli.measure import Report

SUMMARY: Final = "measure the speed of the environments on one core of this machine"


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
    parser.add_argument("--repeat", type=int, default=5, metavar="N", help="repetitions; the median counts")
    parser.add_argument("--seconds", type=float, default=0.3, metavar="S", help="length of one repetition")
    parser.add_argument(
        "--train", type=int, nargs="?", const=200_000, metavar="FRAMES", help="time training too"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of a table")
    parser.add_argument("--out", type=Path, metavar="FILE", help="also write the JSON object to a file")


def execute(arguments: argparse.Namespace) -> Exit:
    """Measure, then print."""
    if arguments.repeat < 1 or arguments.seconds <= 0:
        raise UsageError("--repeat and --seconds: expected positive numbers")
    if arguments.all and arguments.scenarios:
        raise UsageError("--all: expected no SCENARIO beside it")
    from socialai_dsl.cli.measure import measure_all
    from socialai_dsl.cli.shipped import shipped_scenarios

    report = measure_all(
        shipped_scenarios() if arguments.all else arguments.scenarios or ["talkitout"],
        arguments.batch,
        ("walk", "random") if arguments.mix == "both" else (arguments.mix,),
        arguments.repeat,
        arguments.seconds,
        arguments.train,
    )
    text = json.dumps(report.as_json(), indent=2)
    if arguments.out:
        arguments.out.write_text(text + "\n", encoding="utf-8")
    print(text if arguments.json else _table(report))
    return Exit.GOOD


def _batches(text: str) -> list[int]:
    try:
        batches = [int(part) for part in text.split(",")]
    except ValueError:
        batches = []
    if not batches or min(batches) < 1:
        raise argparse.ArgumentTypeError(f"expected numbers such as 1,256, got {text!r}")
    return batches


def _table(report: "Report") -> str:
    lines = [
        f"{report.machine}; one core; medians of {report.repetitions}",
        f"reference loop: {report.reference / 1e6:.0f} M iterations per CPU second",
        "",
        f"{'what':<28} {'mix':<7} {'batch':>6} {'steps/s cpu':>12} {'steps/s wall':>13} "
        f"{'resets/s':>10} {'ratio':>8}",
    ]
    for row in report.rows:
        batch = "Env" if row.batch == 0 else str(row.batch)
        lines.append(
            f"{row.what[:28]:<28} {row.mix:<7} {batch:>6} {row.cpu:>12,.0f} {row.wall:>13,.0f} "
            f"{row.resets:>10,.0f} {1000 * row.cpu / report.reference:>8.2f}"
        )
    lines += ["", "ratio: steps for every 1,000 iterations of the reference loop; compare machines by it"]
    if report.training is not None:
        lines.append(f"training: {report.training:,.0f} frames/s wall, all cores")
    return "\n".join(lines)
