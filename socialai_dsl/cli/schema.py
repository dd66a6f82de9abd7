"""This module is `socialai schema`: it prints the JSON Schema of the language, for editors."""

import argparse
import json
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.cli.errors import Exit

if TYPE_CHECKING:
    from pydantic import BaseModel

SUMMARY: Final = "print the JSON Schema of the scenario language"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command: none."""
    del parser


def execute(arguments: argparse.Namespace) -> Exit:
    """Print the schema."""
    del arguments
    print(json.dumps(language_schema(), indent=2, ensure_ascii=False))
    return Exit.GOOD


def language_schema() -> dict[str, Any]:
    """One schema for the kinds of file that have models; the key that says the kind chooses."""
    from pydantic.json_schema import models_json_schema

    from socialai_dsl.schema import Npc, Scenario
    from socialai_dsl.schema.suite import Suite

    kinds: dict[str, type[BaseModel]] = {"scenario": Scenario, "npc": Npc, "suite": Suite}
    places, definitions = models_json_schema([(model, "validation") for model in kinds.values()])
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A file of the scenario language",
        "allOf": [
            {"if": {"required": [kind]}, "then": places[model, "validation"]} for kind, model in kinds.items()
        ],
        **definitions,
    }
