"""The JSON Schema refuses what the models refuse, and is the one that is shipped."""

import json
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import jsonschema
import pytest
import yaml

from socialai_dsl.authoring.language_schema import (
    language_schema,
    schema_text,
    shipped_schema,
)
from socialai_dsl.checking.scenarios import check_library, check_npc, draft_of
from socialai_dsl.diagnostics import DiagnosticBag, ScenarioError, Severity
from socialai_dsl.loader.reader import read_document
from socialai_dsl.loader.resolved import resolve
from socialai_dsl.schema.shape import model_of
from socialai_dsl.schema.suite import Suite
from socialai_dsl.source import Source
from tests.socialai_dsl.authoring.documents import document

ROOT = Path(__file__).parents[3]
SHIPPED = sorted((ROOT / "scenarios").rglob("*.yaml")) + sorted(
    (ROOT / "socialai_dsl" / "prelude").glob("*.yaml")
)

MEANING = frozenset({"S206"})
"""Codes of `draft_of` that are not about the shape."""


@cache
def validator() -> Any:
    return jsonschema.Draft7Validator(language_schema())


def shape_of(data: Any, folder: Path) -> list[str]:
    """What the loader and the models find wrong with the shape of a document."""
    path = (folder / "made.yaml").resolve()
    bag = DiagnosticBag()
    try:
        text = yaml.dump(data, Dumper=yaml.CSafeDumper, sort_keys=False, allow_unicode=True, width=10_000)
        resolved = resolve(str(path), texts={path: Source("made.yaml", text)})
        match resolved.kind:
            case "scenario":
                draft_of(resolved, bag, resolved.tree.entry("tests"))
            case "npc":
                check_npc(resolved, bag)
            case "library":
                check_library(resolved, bag)
            case "suite":
                model_of(Suite, resolved.tree, bag, parameters=False)
    except ScenarioError as error:
        bag.extend(error.diagnostics)
    return [str(d) for d in bag if d.severity is Severity.ERROR and d.code not in MEANING]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "someone.yaml").write_text("npc: someone\n", encoding="utf-8")
    return tmp_path


def agree(seeds: Iterable[int], folder: Path) -> list[int]:
    """Compare the verdicts on a document for each seed; how many both accept, and how many both refuse."""
    counts = [0, 0]
    for seed in seeds:
        made = document(Random(seed))
        found = shape_of(made, folder)
        by_schema = [e.message for e in validator().iter_errors(made)]
        both = f"seed {seed}\n{yaml.safe_dump(made, sort_keys=False)}\nmodels: {found}\nschema: {by_schema}"
        assert bool(found) == bool(by_schema), both
        counts[bool(found)] += 1
    return counts


def test_the_schema_and_the_models_agree(folder: Path) -> None:
    label_that_is_nothing, too_few_for_any_parameter = 9727, 5890
    right, wrong = agree([*range(300), label_that_is_nothing, too_few_for_any_parameter], folder)
    assert right > 60
    assert wrong > 60, "documents of both kinds are needed to tell anything"


@pytest.mark.slow
def test_the_schema_and_the_models_agree_on_ten_thousand(folder: Path) -> None:
    right, wrong = agree(range(10_000), folder)
    assert min(right, wrong) > 2_000


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_what_ships_is_right(path: Path) -> None:
    assert [error.message for error in validator().iter_errors(read_document(path).data)] == []


def test_the_schema_is_one() -> None:
    jsonschema.Draft7Validator.check_schema(language_schema())
    references = {part.partition('"')[0] for part in schema_text().split('"$ref": "#/definitions/')[1:]}
    assert references == set(language_schema()["definitions"])


def test_the_shipped_schema_is_up_to_date(update_goldens: bool) -> None:
    if update_goldens:
        path = ROOT / "socialai_dsl" / "authoring" / "language.schema.json"
        path.write_text(schema_text(), encoding="utf-8")
    assert shipped_schema() == schema_text(), (
        "the models have changed: pytest --update-goldens, or `socialai schema`"
    )


def described_keys(schema: dict[str, Any]) -> Iterator[tuple[str, str, Any]]:
    """Definition, key and schema of every key that a schema describes."""
    for name, definition in schema["definitions"].items():
        for key, part in definition.get("properties", {}).items():
            yield name, key, part


def test_every_key_is_described() -> None:
    described = list(described_keys(language_schema()))
    assert len(described) > 200
    assert [(name, key) for name, key, part in described if not part.get("description")] == []


def test_examples_are_right() -> None:
    """The examples of a key are values of it."""
    schema = language_schema()
    given = [(name, key, part) for name, key, part in described_keys(schema) if "examples" in part]
    assert len(given) > 20
    for name, key, part in given:
        one = jsonschema.Draft7Validator({**part, "definitions": schema["definitions"]})
        for example in part["examples"]:
            assert list(one.iter_errors(example)) == [], (name, key, example)


SCENARIO = {
    "scenario": "a",
    "grammar": "body",
    "room": {"size": 6},
    "cast": {"agent": {}},
    "outcome": [{"failure": "agent.did(done)"}],
}


@pytest.mark.parametrize(
    ("change", "right"),
    [
        ({}, True),
        ({"horizon": "$steps"}, True),
        ({"horizon": "steps"}, False),
        ({"horizon": None}, False),
        ({"about": None}, False),
        ({"cast": {"agent": {}, "two words": {}}}, False),
        ({"cast": {"agent": {}, "peers": {"count": 2, "color": ["red", "blue"]}}}, True),
        ({"cast": {"agent": {}, "peer": {"color": ["red", "blue"]}}}, False),
        ({"cast": {"agent": {"count": 2}}}, False),
        ({"frames": {"f": {"steps": [{"do": "stay", "for": 3}]}}}, True),
        ({"frames": {"f": {"steps": [{"do": "stay", "for_": 3}]}}}, False),
        ({"frames": {"f": {"states": {"s": {"then": [{"hears": "Hello", "say": "Hi"}]}}}}}, True),
        ({"frames": {"f": {"states": {"s": {"then": [{"hears": ["Hello", "Hi"], "do": "stay"}]}}}}}, False),
        ({"suite": "b"}, False),
    ],
)
def test_scenarios(change: dict[str, Any], right: bool, folder: Path) -> None:
    made = {**SCENARIO, **change}
    assert validator().is_valid(made) is right
    assert (shape_of(made, folder) == []) is right


@pytest.mark.parametrize(
    ("made", "right"),
    [
        ({"scenario": "a", "extends": "b.yaml"}, True),
        ({"scenario": "a", "abstract": True}, True),
        ({"scenario": "a", "abstract": False}, False),
        ({"scenario": "a"}, False),
        ({"scenario": "a", "extends": "b.yaml", "horizn": 3}, False),
        ({"npc": "a", "extends": "b.yaml"}, True),
        ({"variant": "a"}, False),
        ({"variant": "a", "of": "any", "add": {"cast": {"a": {}}}}, True),
        ({"library": "objects", "grammars": {}}, False),
        ({"nothing": 1}, False),
        ([], False),
    ],
)
def test_kinds_of_files(made: Any, right: bool) -> None:
    assert validator().is_valid(made) is right


def test_the_text_is_json() -> None:
    assert json.loads(schema_text()) == language_schema()
