"""This module is `socialai new`: it writes a commented scenario to start from."""

import argparse
import re
from pathlib import Path
from typing import Final

from socialai_dsl.cli.errors import Exit, UsageError

SUMMARY: Final = "write a commented scenario file to start from"

_TEMPLATE: Final = Path(__file__).with_name("starting_scenario.yaml")
_WORD: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,39}")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument("name", metavar="NAME", help="the scenario's name; NAME.yaml is written here")


def execute(arguments: argparse.Namespace) -> Exit:
    """Write the file; one that exists stays as it is."""
    name = arguments.name.removesuffix(".yaml")
    if not _WORD.fullmatch(name):
        raise UsageError(
            f"NAME: expected letters, digits and underscores (at most 40), got {arguments.name!r}"
        )
    path = Path(f"{name}.yaml")
    text = _TEMPLATE.read_text(encoding="utf-8").replace("my_scenario", name, 1)
    try:
        with open(path, "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise UsageError(f"{path} exists already") from None
    print(f"wrote {path}; check it with: socialai validate {path}")
    return Exit.GOOD
