"""`socialai explain`: the page of a finding's code, or the data sheet of a scenario."""

import argparse
import re
from pathlib import Path
from typing import Final

from socialai_dsl.cli.errors import Exit
from socialai_dsl.diagnostics import CODES
from socialai_dsl.loader.pages import page_of

SUMMARY: Final = "explain the code of a finding, or describe a scenario"

EXAMPLES: Final = (
    ("socialai explain S301", "explains a finding"),
    ("socialai explain talkitout", "describes a scenario in words"),
)

_CODE: Final = re.compile(r"[A-Za-z]\d{3}")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "subject",
        nargs="?",
        metavar="CODE|SCENARIO",
        help="a code such as S101, or a scenario's path or name (default: list all codes)",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Print the page of a code, the data sheet of a scenario, or the list of codes."""
    subject = arguments.subject
    if subject is None:
        print("\n".join(f"{code}  {title}" for code, title in CODES.items()))
    elif _CODE.fullmatch(subject) and not Path(subject).exists():
        print(page_of(subject), end="")
    else:
        import socialai_dsl
        from socialai_dsl.analysis.data_sheet import sheet

        print(sheet(subject, socialai_dsl.load(subject)), end="")
    return Exit.GOOD
