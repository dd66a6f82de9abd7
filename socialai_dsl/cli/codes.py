"""`socialai codes`: lists the codes of findings, or prints the page of one."""

import argparse
from pathlib import Path
from typing import Final

from socialai_dsl.cli.errors import Exit, UsageError
from socialai_dsl.diagnostics import CODES, did_you_mean

SUMMARY: Final = "list the codes of findings, or explain one of them"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "code", nargs="?", metavar="CODE", help="a code such as S101; without it all are listed"
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Print the list, or the page of one code."""
    if arguments.code is None:
        print("\n".join(f"{code}  {title}" for code, title in CODES.items()))
        return Exit.GOOD
    code = arguments.code.upper()
    if code not in CODES:
        near = did_you_mean(code, CODES)
        hint = f"did you mean {near}?" if near else "without a code this command lists them all"
        raise UsageError(f"CODE: there is no {arguments.code!r}; {hint}")
    print((pages_folder() / f"{code}.md").read_text(encoding="utf-8"), end="")
    return Exit.GOOD


def pages_folder() -> Path:
    """The folder with a page for each code, in a checkout as well as installed."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "pages"
    return installed if installed.is_dir() else package.parent / "docs" / "diagnostics"
