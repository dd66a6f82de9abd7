"""`socialai export`: a trained agent as a folder that can be given to others."""

import argparse
from pathlib import Path
from typing import Final

from socialai_dsl.cli.errors import Exit

SUMMARY: Final = "make a folder of a trained agent to give to others"

EXAMPLES: Final = (("socialai export runs/gate --out my_agent", "writes weights, figures and a model card"),)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument("run", metavar="RUN_DIR", help="the folder of a finished run, or shipped:NAME")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder to write (default: exports/<scenario>-<network>-s<seed>)",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Write the folder."""
    from socialai_dsl.runs.export import export

    out = export(arguments.run, arguments.out)
    print(f"written to {out}; try it: socialai evaluate {out}")
    return Exit.GOOD
