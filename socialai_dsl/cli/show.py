"""This module is `socialai show`: it prints what a scenario is once everything it builds on is put together."""

import argparse
from typing import Final

from socialai_dsl.cli.errors import Exit

SUMMARY: Final = "print a scenario after extends and variants, or the program it compiles to"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenario", metavar="SCENARIO", help="a path or a name, with +variants and ?parameters"
    )
    parser.add_argument("--program", action="store_true", help="print the compiled program's listing instead")


def execute(arguments: argparse.Namespace) -> Exit:
    """Print the resolved scenario as YAML, or its listing."""
    import socialai_dsl

    scenario = socialai_dsl.load(arguments.scenario)
    if arguments.program:
        print(socialai_dsl.compile(scenario).listing())
        return Exit.GOOD
    import yaml

    print(yaml.safe_dump(scenario.resolved.data, sort_keys=False, allow_unicode=True, width=100), end="")
    return Exit.GOOD
