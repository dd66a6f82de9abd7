"""Random documents of the language, right and wrong, made from its JSON Schema."""

from __future__ import annotations

import re
from copy import deepcopy
from random import Random
from typing import Any

from socialai_dsl.authoring.language_schema import language_schema

SCHEMA = language_schema()
_FORMS = {
    "scenario": "ScenarioFileWithParameters",
    "abstract": "ScenarioFileWithParametersPartial",
    "npc": "NpcFileWithParameters",
    "suite": "SuiteFile",
    "variant": "VariantFile",
    "objects": "ObjectLibraryFile",
    "grammars": "GrammarLibraryFile",
}
_WORDS = "agent door color exit wizard peer duty waiting on left jump a1 _x x".split()
_TEXTS = [
    "pick(doors)",
    "anywhere",
    "a text, with a comma",
    "Where is <noun>",
    "5..8",
    "yes",
    "$unset",
    "# no",
    "é",
]
_WRONG: list[Any] = [
    None, True, -1, 3, 70_000, 0.5, "word", "two words", "x" * 41, "x" * 501, [], {}, ["a"], [[1, 2]], [None],
    {"a": 1}, {"a b": 1}, {"count": 2}, [{"when": "t > 1"}],
]  # fmt: skip
_MOST_DEEP = 7


def document(random: Random) -> dict[str, Any]:
    """A document that the schema accepts, as far as chance hits upon it, then with up to three mistakes."""
    form = random.choice(list(_FORMS))
    made = _instance(SCHEMA["definitions"][_FORMS[form]], random, 0)
    assert isinstance(made, dict)
    if form == "abstract":
        made["abstract"] = True
    else:
        made.pop("abstract", None)
    made.pop("extends", None)  # what a file builds on is not known to the schema
    for _ in range(random.choice((0, 0, 1, 1, 2, 3))):
        _mistake(made, random)
    if form == "variant":
        made = {**made, "of": "any"} if isinstance(made.get("of"), str) else made
    return _possible(made)


def _instance(schema: dict[str, Any], random: Random, depth: int) -> Any:
    if "$ref" in schema:
        return _instance(SCHEMA["definitions"][schema["$ref"].rpartition("/")[2]], random, depth)
    for word in ("anyOf", "oneOf"):
        if word in schema:
            return _instance(random.choice(schema[word]), random, depth)
    if "enum" in schema or "const" in schema:
        return random.choice(schema.get("enum", [schema.get("const")]))
    kind = schema["type"]
    match random.choice(kind) if isinstance(kind, list) else kind:
        case "object":
            return _mapping(schema, random, depth)
        case "array":
            least = schema.get("minItems", 0)
            many = min(
                least + (0 if depth >= _MOST_DEEP else random.choice((0, 1, 2))), schema.get("maxItems", 9)
            )
            return [_instance(schema["items"], random, depth + 1) for _ in range(many)]
        case "integer":
            return random.randint(schema.get("minimum", -5), min(schema.get("maximum", 99), 99))
        case "number":
            return random.choice((0, 1, 0.25, 0.5))
        case "boolean":
            return random.random() < 0.5
        case _:
            texts = _WORDS + _TEXTS if "pattern" not in schema else _WORDS
            fitting = [t for t in texts if re.search(schema.get("pattern", ""), t)]
            return random.choice(fitting or ["$unset"])


def _mapping(schema: dict[str, Any], random: Random, depth: int) -> dict[str, Any]:
    made: dict[str, Any] = {}
    likely = 0.35 if depth == 0 else 0.3 if depth < 4 else 0.1
    for key, part in schema.get("properties", {}).items():
        if key in schema.get("required", ()) or random.random() < likely:
            made[key] = _instance(part, random, depth + 1)
    free = [*schema.get("patternProperties", {}).values()]
    if isinstance(schema.get("additionalProperties"), dict):
        free.append(schema["additionalProperties"])
    for part in free:
        for _ in range(schema.get("minProperties", 0) + (depth < _MOST_DEEP and random.random() < 0.5)):
            made[random.choice(_WORDS)] = _instance(part, random, depth + 1)
    return made


def _mistake(made: dict[str, Any], random: Random) -> None:
    """Change one part, at a place that is drawn; the key that says the kind stays."""
    holders: list[Any] = []

    def walk(part: Any) -> None:
        if isinstance(part, dict | list) and part:
            holders.append(part)
            for child in part.values() if isinstance(part, dict) else part:
                walk(child)

    walk(made)
    holder = random.choice(holders)
    kept = ("scenario", "npc", "suite", "variant", "library", "abstract") if holder is made else ()
    keys = [key for key in (holder if isinstance(holder, dict) else range(len(holder))) if key not in kept]
    if not keys:
        return
    key = random.choice(keys)
    match random.choice(("replace", "replace", "remove", "add", "rename")):
        case "replace":
            holder[key] = deepcopy(random.choice(_WRONG))
        case "remove":
            del holder[key]
        case "add" if isinstance(holder, dict):
            holder[random.choice((*_WORDS, "for_", "with_", "when", "do", "two words", "1st"))] = deepcopy(
                random.choice(_WRONG)
            )
        case "rename" if isinstance(holder, dict):
            holder[random.choice((*_WORDS, "goto", "say", "x" * 41))] = holder.pop(key)


def _possible(made: dict[str, Any]) -> dict[str, Any]:
    """Without what a schema cannot say: lists that are as long as a number, and names of files and grammars."""
    cast = made.get("cast")
    for name, member in cast.items() if isinstance(cast, dict) and "scenario" in made else ():
        if not isinstance(member, dict):
            continue
        if name == "agent":
            member.pop("count", None)
        count = member.get("count")
        for key in ("name", "color", "place", "facing", "at"):
            given = member.get(key)
            one_cell = key == "at" and isinstance(given, list) and not any(isinstance(c, list) for c in given)
            if one_cell and "count" in member:
                given = [given]
            if type(count) is int and isinstance(given, list):
                member[key] = [deepcopy(item) for item in (given * 16)[:count]] if given else ["x"] * count
            if isinstance(count, str) and isinstance(given, list):
                member[key] = "x"  # how many there are is not known, so what each has is not looked at
            if count is None and isinstance(given, list) and made.get("abstract") is True and not one_cell:
                member[key] = "x"  # a file that builds on this one might say how many they are
    for part in _mappings(made):
        if isinstance(part.get("one_of"), str):
            part["one_of"] = "someone.yaml"
        elif isinstance(part.get("one_of"), list):
            part["one_of"] = ["someone.yaml" if isinstance(name, str) else name for name in part["one_of"]]
    if isinstance(made.get("grammar"), str) and "scenario" in made:
        made["grammar"] = "body" if re.fullmatch(r"[A-Za-z_]\w{0,39}", made["grammar"]) else {}
    room = made.get("room")
    if isinstance(room, dict) and isinstance(room.get("canvas"), list):
        room["canvas"] = [9 if item == "$unset" else item for item in room["canvas"]]
    return made


def _mappings(part: Any) -> list[dict[str, Any]]:
    if isinstance(part, dict):
        return [part, *(found for child in part.values() for found in _mappings(child))]
    return [found for child in part for found in _mappings(child)] if isinstance(part, list) else []
