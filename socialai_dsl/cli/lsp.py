"""`socialai lsp`: a language server on standard input and output."""

import argparse
from typing import Final

from socialai_dsl.cli.errors import Exit
from socialai_dsl.errors import UsageError

SUMMARY: Final = "run the language server for editors, on standard input and output"

EXAMPLES: Final = (("socialai lsp", "is what an editor starts"),)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "--stdio", action="store_true", help="accepted because editors send it; there is no other way"
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Serve until the editor says goodbye."""
    del arguments
    try:
        from socialai_dsl.authoring.server import make_server
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in ("pygls", "lsprotocol"):
            raise
        raise UsageError("the language server needs pygls: pip install 'socialai-dsl[lsp]'") from None
    make_server().start_io()
    return Exit.GOOD
