"""`socialai schema`: prints the JSON Schema of the language, for editors."""

import argparse
from typing import Final

from socialai_dsl.cli.errors import Exit

SUMMARY: Final = "print the JSON Schema of the scenario language, for editors"

EXAMPLES: Final = (("socialai schema", "prints the schema; redirect it to a file"),)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command: none."""
    del parser


def execute(arguments: argparse.Namespace) -> Exit:
    """Print the schema."""
    del arguments
    from socialai_dsl.authoring.language_schema import schema_text

    print(schema_text(), end="")
    return Exit.GOOD
