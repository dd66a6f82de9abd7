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


_ONE_EACH: Final = ("name", "color", "place", "facing", "at")
"""What a group in the cast may give as a list."""

_FILES: Final = {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}


def _as_written(definitions: dict[str, Any]) -> None:
    """What authors write and the models never see: groups in the cast, files to draw from, names of grammars."""
    member = definitions["CastMember"]["properties"]
    member["count"] = {"type": "integer", "minimum": 1, "maximum": 16, "description": "a group of so many"}
    for key in _ONE_EACH:
        given = member[key]
        member[key] = {"anyOf": [given, {"type": "array", "items": {}}]}
        if "description" in given:
            member[key]["description"] = given["description"]
    description = member["one_of"].get("description")
    member["one_of"] = {**_FILES, **({"description": description} if description else {})}
    scenario = definitions["Scenario"]["properties"]
    scenario["grammar"] = {"anyOf": [scenario["grammar"], {"type": "string"}]}


def language_schema() -> dict[str, Any]:
    """One schema for the kinds of file that have models; the key that says the kind chooses."""
    from pydantic.json_schema import models_json_schema

    from socialai_dsl.schema import Npc, Scenario
    from socialai_dsl.schema.suite import Suite

    kinds: dict[str, type[BaseModel]] = {"scenario": Scenario, "npc": Npc, "suite": Suite}
    places, definitions = models_json_schema([(model, "validation") for model in kinds.values()])
    _as_written(definitions["$defs"])
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A file of the scenario language",
        "allOf": [
            {"if": {"required": [kind]}, "then": places[model, "validation"]} for kind, model in kinds.items()
        ],
        **definitions,
    }
