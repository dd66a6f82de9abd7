"""`socialai new`: writes a commented scenario to start from, with a script that solves it."""

import argparse
from typing import Final

from socialai_dsl.authoring.templates import TEMPLATES, write_template
from socialai_dsl.cli.arguments import refuse
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import columns
from socialai_dsl.errors import UsageError

SUMMARY: Final = "write a commented scenario to start from, with a script that solves it"

EXAMPLES: Final = (
    ("socialai new gate", "writes a scenario in which the agent asks a guide, with its script and tests"),
    ("socialai new dance_floor --template imitate", "writes one in which the agent repeats a dance"),
)

_LISTED: Final = "--list lists the templates and writes nothing"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "name",
        metavar="NAME",
        nargs="?",
        help="name of the scenario; writes NAME.yaml and its variants into this folder",
    )
    parser.add_argument(
        "--template",
        choices=TEMPLATES,
        help="template to start from (default: ask-a-guide)",
    )
    parser.add_argument("--list", action="store_true", help="list the templates and exit")


def execute(arguments: argparse.Namespace) -> Exit:
    """Write the files, and the schema for editors beside them; nothing is written if one of them exists."""
    if arguments.list:
        refuse(arguments, ("template",), _LISTED)
        if arguments.name is not None:
            raise UsageError(f"NAME: {_LISTED}")
        print("\n".join(columns(list(TEMPLATES.items()))))
        return Exit.GOOD
    if arguments.name is None:
        raise UsageError("expected a NAME, or --list")
    files = write_template(arguments.template or "ask-a-guide", arguments.name)
    print(f"wrote {', '.join(map(str, files))}; check with: socialai validate {files[0]}")
    print(f"play with: socialai play {files[0]}")
    print(f"see it while you write: socialai studio {files[0]}")
    return Exit.GOOD
