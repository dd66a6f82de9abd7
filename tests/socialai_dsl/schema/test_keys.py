"""Lists of keys that are kept apart from the models say what the models say."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from socialai_dsl.authoring.assist import complete
from socialai_dsl.authoring.language_schema import FILES
from socialai_dsl.checking import scenarios
from socialai_dsl.frontend import check
from socialai_dsl.library import GrammarLibrary, ObjectLibrary
from socialai_dsl.loader.reader import value_at
from socialai_dsl.schema import shape
from socialai_dsl.schema.annotations import CALLED, holds_expressions, keys_of, literals, sections_of
from socialai_dsl.schema.experiment import Hyper
from socialai_dsl.schema.files import VariantFile
from socialai_dsl.schema.scenario import (
    CastGroup,
    CastMember,
    Prose,
    Scenario,
    StateName,
    TextLine,
    Texts,
    WrittenCast,
)
from socialai_dsl.schema.suite import Suite
from socialai_dsl.semantics.words import VALUES

WRITTEN_OTHERWISE = {CastGroup, WrittenCast, VariantFile, GrammarLibrary, ObjectLibrary, Hyper}
"""Models of what the loader takes apart, of libraries, and of options of the trainer, which have their own pages."""


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """All models that an annotation is made of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from models_in(part)


def reached() -> set[type[BaseModel]]:
    """Every model of a file or of a part of one."""
    found: set[type[BaseModel]] = set()
    waiting = [model for models in FILES.values() for model in models]
    while waiting:
        model = waiting.pop()
        if model not in found:
            found.add(model)
            waiting += [one for field in model.model_fields.values() for one in models_in(field.annotation)]
    return found


def test_every_model_has_a_name_in_messages_and_its_keys_in_the_reference() -> None:
    """A file that may build on another has the keys of what it is, and one more."""
    own = {model.__base__ if "extends" in model.model_fields else model for model in reached()}
    of_libraries = set(models_in(ObjectLibrary.model_fields["types"].annotation))
    assert own - CALLED.keys() - WRITTEN_OTHERWISE - of_libraries == set()
    reference = (Path(__file__).parents[3] / "docs" / "reference.md").read_text(encoding="utf-8")
    for model, called in CALLED.items():
        heading = called.removeprefix("a ").removeprefix("an ").removeprefix("the ").replace("`", "")
        part = reference.partition(f"### {heading[0].upper()}{heading[1:]}\n")[2].partition("\n### ")[0]
        assert all(f"| `{key}` |" in part for key in keys_of(model)), called


BARE = """\
scenario: bare
grammar: {templates: [Hello <noun>], nouns: [there]}
room: {size: 6}
cast: {agent: {}}
outcome: [{success: t == 9}]
"""


@pytest.mark.parametrize("key", [key for keys in sections_of(Scenario) for key in keys])
def test_a_variant_can_add_to_every_section(tmp_path: Path, key: str) -> None:
    (tmp_path / "bare.yaml").write_text(BARE, encoding="utf-8")
    entries = "{}" if key in sections_of(Scenario)[0] else "[]"
    text = f"variant: more\nof: bare.yaml\nadd: {{{key}: {entries}}}\n"
    (tmp_path / "more.yaml").write_text(text, encoding="utf-8")
    assert not {d.code for d in check(tmp_path / "more.yaml").diagnostics} & {"S501", "S502"}


def test_every_section_is_a_mapping_or_a_list_of_the_model() -> None:
    mappings, lists = sections_of(Scenario)
    assert {"probes", "looks", "objects", "npc_defaults", "grammar"} <= {*mappings}
    assert {"rules", "outcome", "check", "require", "order"} <= {*lists}
    assert not {"horizon", "earshot", "actions", "abstract"} & {*mappings, *lists}, (
        "these have a value if left out"
    )
    assert {"splits", "sweep", "members"} <= {*sections_of(Suite)[0], *sections_of(Suite)[1]}


def fields_of(*annotations: Any) -> Iterator[str]:
    """The keys of fields that hold one of these, alone, optional, or in a list."""
    wanted = {str(annotation) for annotation in annotations}
    for model in CALLED:
        for name, field in model.model_fields.items():
            made = str(field.annotation)
            if any(one in made for one in wanted):
                yield field.alias or name


def test_a_text_is_a_text_whatever_yaml_takes_it_for() -> None:
    """`say: No` says "No"."""
    texts = {"ask", *fields_of(TextLine, Prose, StateName, Texts)} - {"nouns", "slots", "templates"}
    assert {"say", "hears", "goto", "about", "ask"} <= texts
    places = {
        "start": ("frames", "f", "start"),
        "ask": ("probes", "p", "ask"),
        "answers": ("probes", "p", "answers", 0),
        "do": ("tests", "t", "play", 0, "do"),
    }
    for key in texts:
        assert value_at(places.get(key, ("x", key)), "No") == "No", key


@pytest.mark.parametrize(
    ("line", "some", "others"),
    [
        ("cast: {ada: {accepts: ^}, agent: {}}", {"t", "next_to"}, set()),
        ("cast: {ada: {earshot: ^}, agent: {}}", {"next_to", "room"}, {"t", "sees"}),
        ("earshot: ^", {"next_to", "room"}, {"t", "sees"}),
        ("state: {n: {start: ^}}", {"t", "W"}, set()),
        ("cast: {ada: {beliefs: {x: {forget: ^}}}, agent: {}}", {"t", "sees"}, set()),
        ("frames: {f: {let: {n: {start: ^}}}}", {"t", "W"}, set()),
        ("frames: {f: {start: ^, states: {a: {}}}}", {"a"}, {"t"}),
        ("require: [^]", {"t", "can_reach"}, set()),
        ("looks: {size: {for: x, words: [a, b], start: ^}}", {"W"}, set()),
    ],
)
def test_values_are_offered_where_a_place_takes_an_expression(
    line: str, some: set[str], others: set[str]
) -> None:
    before, _, after = line.partition("^")
    text = f"scenario: a\n{before}{after}\n"
    offered = {offer.text for offer in complete(text, None, None, 2, len(before) + 1)}
    assert some <= offered
    assert not others & offered


def test_a_place_takes_an_expression_by_its_annotation() -> None:
    member = CastMember.model_fields
    assert holds_expressions(member["accepts"].annotation)
    assert literals(member["earshot"].annotation) == ["next_to", "room"]
    assert not holds_expressions(member["view"].annotation)
    assert VALUES


def test_keys_whose_loss_is_indifferent_are_keys() -> None:
    known = {key for model in CALLED for key in keys_of(model)}
    assert known >= shape._INDIFFERENT
    assert {*scenarios._ONE_EACH} == set(CastGroup.__annotations__) - {"count"}
