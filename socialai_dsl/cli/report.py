"""`socialai report`: writes a page about an experiment or single runs, with figures and tables."""

import argparse
import sys
from pathlib import Path
from typing import Final

from socialai_dsl.cli.arguments import refuse
from socialai_dsl.cli.curves import draw_curves
from socialai_dsl.cli.errors import Exit

SUMMARY: Final = "write a page with figures and tables about runs, finished or not"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "folders", nargs="+", type=Path, metavar="DIR", help="the folder of an experiment, or folders of runs"
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
    from socialai_dsl.runs.report import report, require_libraries

    require_libraries()
    if arguments.curves is not None:
        refuse(arguments, ("out", "no_baselines"), "--curves draws the curves alone, into its own FILE")
        return draw_curves(arguments.folders, arguments.curves)
    page = report(
        arguments.folders,
        arguments.out,
        baselines=not arguments.no_baselines,
        tell=lambda line: print(line, file=sys.stderr, flush=True),
    )
    print(f"written to {page}")
    return Exit.GOOD
