"""`socialai report`: writes a page about an experiment, single runs and studies, with figures and tables."""

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.cli.arguments import refuse
from socialai_dsl.cli.errors import Exit

if TYPE_CHECKING:  # it loads pandas, which is only there if reports were asked for
    from socialai_dsl.reporting.analysis import Summary

SUMMARY: Final = "write a page with figures and tables about runs, finished or not"

EXAMPLES: Final = (
    ("socialai report runs/gate --no-baselines", "reports one run; several folders may be given"),
    ("socialai report runs/minds studies/asking --out report", "joins the people of a study with the runs"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "folders",
        nargs="+",
        type=Path,
        metavar="DIR",
        help="the folder of an experiment, or folders of runs; also those of studies, and of what `crossplay --out`, "
        "`words --out` and `check --pictures` wrote",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder to write (default: `report` in the experiment's folder, or here for runs)",
    )
    parser.add_argument(
        "--curves",
        type=Path,
        metavar="FILE",
        help="draw only the learning curves, seeds of one condition together, and print them as a table",
    )
    parser.add_argument(
        "--no-baselines",
        action="store_true",
        help="do not measure script, chance and success without NPCs; show only what is known",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Write the page, or the curves alone."""
    from socialai_dsl.runs.report import curves, report

    if arguments.curves is not None:
        refuse(arguments, ("out", "no_baselines"), "--curves draws the curves alone, into its own FILE")
        for summary in curves(arguments.folders, arguments.curves):
            print(_curves_text(summary))
        print(f"written to {arguments.curves}")
        return Exit.GOOD
    page = report(
        arguments.folders,
        arguments.out,
        baselines=not arguments.no_baselines,
        tell=lambda line: print(line, file=sys.stderr, flush=True),
    )
    print(f"written to {page}")
    return Exit.GOOD


def _curves_text(summary: "Summary") -> str:
    """Success of each seed, and the mean rates of outcomes and rules, at a few moments, as Markdown."""
    assert summary.seeds is not None, "internal: every run has a curve"
    names, moments = summary.seeds.table()
    rows = [["frames", *names]]
    for frames, values in moments:
        shown = ["" if math.isnan(value) else f"{value:.2f}" for value in values]
        rows.append([f"{frames / 1e6:.2f} M", *shown])
    head, *lines = (f"| {' | '.join(row)} |" for row in rows)
    test = ", ".join(f"{rate:.3f}" for rate in summary.success)
    rule = "|---" * len(rows[0]) + "|"
    return "\n".join([f"\n{summary.name}\n", head, rule, *lines, "", f"test set: {test}"])
