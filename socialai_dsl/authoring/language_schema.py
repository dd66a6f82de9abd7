"""The language as a JSON Schema (draft 7, which every editor knows), made from the models.

Pydantic says what the models accept. What the loader does before is put in here, once for all models: no value is
empty, a parameter `$name` may stand for a whole value, and a file that builds on another, or that others build on, may
leave keys out.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from socialai_dsl.schema.files import FILES

Schema = dict[str, Any]

_SHIPPED: Final = Path(__file__).with_name("language.schema.json")

_ANY_VALUE: Final = "AnyValue"
_PARAMETER: Final = "WholeParameter"
_REFERENCE: Final = "#/definitions/"
_MADE_BY_PYDANTIC: Final = "#/$defs/"


def language_schema() -> Schema:
    """One schema for all kinds of file; the key that says the kind chooses."""
    models = [model for files in FILES.values() for model in files]
    _, made = models_json_schema([(model, "validation") for model in models])
    plain = {name: _plain(schema) for name, schema in made["$defs"].items() if name != "JsonValue"}
    definitions = _Definitions(plain)
    chosen = [
        {"if": {"required": [kind]}, "then": definitions.kind(kind, files)} for kind, files in FILES.items()
    ]
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "A file of the scenario language",
        "type": "object",
        "oneOf": [{"required": [kind]} for kind in FILES],
        "allOf": chosen,
        "definitions": {**definitions.used, **_VALUES},
    }


def schema_text() -> str:
    """The schema as it is shipped and printed."""
    return json.dumps(language_schema(), indent=1, ensure_ascii=False) + "\n"


def shipped_schema() -> str:
    """The schema that comes with the package, which a test keeps equal to `schema_text`."""
    return _SHIPPED.read_text(encoding="utf-8")


_VALUES: Final[Schema] = {
    _ANY_VALUE: {
        "anyOf": [
            {"type": ["string", "number", "boolean"]},
            {"type": "array", "items": {"$ref": _REFERENCE + _ANY_VALUE}},
            {"type": "object", "additionalProperties": {"$ref": _REFERENCE + _ANY_VALUE}},
        ]
    },
    _PARAMETER: {
        "type": "string",
        "pattern": r"^\$[A-Za-z_][A-Za-z0-9_]*$",
        "description": "a parameter of the file",
    },
}


class _Definitions:
    """The definitions that files use, each in the form that its kind of file needs."""

    def __init__(self, plain: Schema) -> None:
        self._plain = plain
        self.used: Schema = {}

    def kind(self, kind: str, files: tuple[type[BaseModel], ...]) -> Schema:
        """The schema of a kind of file."""
        parameters = kind in ("scenario", "npc")
        if kind == "library":
            chosen = [
                {
                    "if": {"properties": {"library": schema["properties"]["library"]}},
                    "then": self._reference(model.__name__, False, False),
                }
                for model in files
                for schema in [self._plain[model.__name__]]
            ]
            words = [self._plain[model.__name__]["properties"]["library"]["const"] for model in files]
            return {"properties": {"library": {"enum": words}}, "allOf": chosen}
        (model,) = files
        whole = self._reference(model.__name__, parameters, False)
        if "extends" not in model.model_fields:
            return whole
        builds: list[Schema] = [{"required": ["extends"]}]
        if "abstract" in model.model_fields:
            builds.append({"required": ["abstract"], "properties": {"abstract": {"const": True}}})
        part = self._reference(model.__name__, parameters, True)
        return {"if": {"anyOf": builds}, "then": part, "else": whole}

    def _reference(self, name: str, parameters: bool, partial: bool) -> Schema:
        """A reference to a definition in a form: with parameters, with keys left out."""
        if name in _VALUES:
            return {"$ref": _REFERENCE + name}
        form = name + ("WithParameters" if parameters else "") + ("Partial" if partial else "")
        if form not in self.used:
            self.used[form] = {}  # so that a definition may contain itself
            self.used[form] = self._formed(self._plain[name], parameters, partial, top=True)
        return {"$ref": _REFERENCE + form}

    def _formed(self, schema: Schema, parameters: bool, partial: bool, top: bool = False) -> Schema:
        if "$ref" in schema:
            target = schema["$ref"].removeprefix(_MADE_BY_PYDANTIC)
            return {**schema, **self._reference(target, parameters, partial)}

        def deeper(part: Schema) -> Schema:
            return self._formed(part, parameters, partial)

        formed = _mapped(schema, deeper)
        if partial:
            kept = [key for key in formed.get("required", ()) if top and key in FILES]
            formed = {key: value for key, value in formed.items() if key != "required"}
            formed |= {"required": kept} if kept else {}
        if parameters and _is_narrow(formed):
            outer = {key: value for key, value in formed.items() if key in _ANNOTATIONS}
            inner = {key: value for key, value in formed.items() if key not in _ANNOTATIONS}
            return {"anyOf": [inner, {"$ref": _REFERENCE + _PARAMETER}], **outer}
        return formed


_ANNOTATIONS: Final = ("description", "default", "examples")


def _is_narrow(schema: Schema) -> bool:
    """Whether a schema is of a value that is no collection, and does not let every text pass."""
    if schema.get("type") in ("integer", "number", "boolean"):
        return True
    return "enum" in schema or "const" in schema or (schema.get("type") == "string" and "pattern" in schema)


def _plain(schema: Schema) -> Schema:
    """What pydantic made, without what authors cannot write, and closed wherever the models are."""
    if schema.get("$ref") == f"{_MADE_BY_PYDANTIC}JsonValue":
        return {"$ref": _MADE_BY_PYDANTIC + _ANY_VALUE}
    made = {key: value for key, value in _mapped(schema, _plain).items() if key != "title"}
    for word in ("anyOf", "oneOf"):
        if word in made:
            made[word] = [branch for branch in made[word] if branch != {"type": "null"}]
            if len(made[word]) == 1:
                made = {**made.pop(word)[0], **made}
    if "default" in made and made["default"] in (None, [], {}):
        del made["default"]
    if made.get("type") == "array":  # whose length pydantic takes for a text's, depending on who says it
        made = {{"minLength": "minItems", "maxLength": "maxItems"}.get(k, k): v for k, v in made.items()}
    if "patternProperties" in made:
        made.setdefault("additionalProperties", False)
    if "prefixItems" in made:
        items = made.pop("prefixItems")
        assert all(item == items[0] for item in items), "internal: draft 7 writes other tuples differently"
        made["items"] = items[0]
    return made


def _mapped(schema: Schema, change: Callable[[Schema], Schema]) -> Schema:
    """A schema with each schema directly below it changed."""
    made = dict(schema)
    for key, value in schema.items():
        if key in ("properties", "patternProperties"):
            made[key] = {name: change(part) for name, part in value.items()}
        elif key in ("anyOf", "oneOf", "allOf", "prefixItems"):
            made[key] = [change(part) for part in value]
        elif key in ("items", "additionalProperties", "propertyNames") and isinstance(value, dict):
            made[key] = change(value)
    if "propertyNames" in made:
        made["propertyNames"] = schema["propertyNames"]
    return made
