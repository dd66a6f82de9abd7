"""`socialai list`: the scenarios that ship."""

import argparse
from dataclasses import asdict
from typing import Final

from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import json_text
from socialai_dsl.loader.shipped import ShippedScenario, catalogue

SUMMARY: Final = "list the scenarios that ship, with their variants and parameters"

EXAMPLES: Final = (
    ("socialai list", "lists all scenarios that ship"),
    ("socialai list liar", "lists those whose name or description has the word"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "words",
        nargs="*",
        metavar="WORD",
        help="list only scenarios whose name or description has all these words",
    )
    parser.add_argument("--json", action="store_true", help="print the list as a JSON array")


def execute(arguments: argparse.Namespace) -> Exit:
    """Print the list; none that fits is a finding."""
    words = [word.lower() for word in arguments.words]
    chosen = [one for one in catalogue() if all(word in f"{one.name} {one.about}".lower() for word in words)]
    if arguments.json:
        print(json_text([asdict(one) for one in chosen]))
    else:
        print("\n".join(line for one in chosen for line in _lines(one)) or "no scenario mentions all of this")
    return Exit.GOOD if chosen else Exit.FINDINGS


def _lines(one: ShippedScenario) -> list[str]:
    lines = [one.name, f"    {one.about}"]
    if one.variants:
        lines.append("    " + " ".join(f"+{variant}" for variant in one.variants))
    for parameter, (default, *others) in one.parameters.items():
        values = ", ".join([f"{default} (default)", *others])
        lines.append(f"    ?{parameter}={values}")
    return lines
