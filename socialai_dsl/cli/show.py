"""`socialai show`: prints a scenario with everything that it builds on."""

import argparse
import json
from typing import Final

from socialai_dsl.cli.arguments import add_scenario
from socialai_dsl.cli.errors import Exit
from socialai_dsl.diagnostics import printable

SUMMARY: Final = "print a scenario after `extends` and variants, or its compiled program"

EXAMPLES: Final = (
    ("socialai show dance+as_coded", "prints a variant as one file"),
    ("socialai show gate.yaml --program", "prints the compiled program"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    add_scenario(parser, "; without --program also any other file of the language")
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--program", action="store_true", help="print the compiled program")
    choice.add_argument("--origin", action="store_true", help="print the file and line of each value")


def execute(arguments: argparse.Namespace) -> Exit:
    """Print the resolved scenario as YAML, its listing, or its values with their origins."""
    if arguments.program:
        import socialai_dsl

        print(socialai_dsl.compile(socialai_dsl.load(arguments.scenario)).listing())
        return Exit.GOOD
    from socialai_dsl.checking.scenarios import as_asked
    from socialai_dsl.frontend import check
    from socialai_dsl.semantics.scope import dotted

    resolved = check(arguments.scenario).read()
    if arguments.origin:
        for span, path, value in resolved.origins():
            print(printable(f"{span}: {dotted(path)} = {json.dumps(value, ensure_ascii=False)}"))
    else:
        import yaml

        print(yaml.safe_dump(as_asked(resolved), sort_keys=False, allow_unicode=True, width=100), end="")
    return Exit.GOOD
