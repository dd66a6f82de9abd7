"""This module is `socialai schema`: it prints the JSON Schema of the language, for editors."""

import argparse
import json
from typing import Final

from socialai_dsl.cli.errors import Exit

SUMMARY: Final = "print the JSON Schema of the scenario language"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command: none."""
    del parser


def execute(arguments: argparse.Namespace) -> Exit:
    """Print the schema."""
    del arguments
    from socialai_dsl.schema import Scenario

    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scenario.model_json_schema()}
    print(json.dumps(schema, indent=2, ensure_ascii=False))
    return Exit.GOOD
