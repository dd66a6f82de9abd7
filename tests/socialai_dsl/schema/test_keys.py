"""Lists of keys that are kept apart from the models say what the models say."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_origin

import pytest
from pydantic import BaseModel

from socialai_dsl.authoring.assist import complete
from socialai_dsl.authoring.names import meant
from socialai_dsl.checking import scenarios
from socialai_dsl.frontend import check
from socialai_dsl.grammar.ast import Name, parse_expression
from socialai_dsl.loader.reader import read_document
from socialai_dsl.schema import shape
from socialai_dsl.schema.annotations import (
    CALLED,
    conditions_of,
    fields_of,
    holds_of,
    keys_of,
    keys_that_hold,
    may_hide,
    sections_of,
)
from socialai_dsl.schema.experiment import Hyper
from socialai_dsl.schema.files import (
    FILES,
    CurriculumFile,
    ExperimentFile,
    GrammarLibraryFile,
    NpcFile,
    ScenarioFile,
    StudyFile,
    SuiteFile,
    TestsFile,
    VariantFile,
)
from socialai_dsl.schema.holds import TEXTS, branches
from socialai_dsl.schema.library import GrammarLibrary, ObjectLibrary
from socialai_dsl.schema.scenario import (
    DOES,
    CastGroup,
    Effects,
    FirstRule,
    Observe,
    Property,
    Room,
    Scenario,
    Step,
    WorldRule,
    WrittenCast,
)
from socialai_dsl.schema.suite import Suite
from socialai_dsl.semantics.check import _WITH, KINDS
from socialai_dsl.source import DataPath, Source

WRITTEN_OTHERWISE = {CastGroup, WrittenCast, VariantFile, GrammarLibrary, ObjectLibrary, Hyper}
"""Models of what the loader takes apart, of libraries, and of options of the trainer, which have their own pages."""


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """All models that an annotation is made of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from models_in(part)


@cache
def models() -> tuple[type[BaseModel], ...]:
    """The model of every file and of every part of one."""
    found: dict[type[BaseModel], None] = {}
    waiting = [model for files in FILES.values() for model in files]
    while waiting:
        model = waiting.pop()
        if model not in found:
            found[model] = None
            waiting += [part for annotation in fields_of(model).values() for part in models_in(annotation)]
    return tuple(found)


def test_every_model_has_a_name_in_messages_and_its_keys_in_the_reference() -> None:
    """A file that may build on another has the keys of what it is, and one more."""
    own = {model.__base__ if [*model.__annotations__] == ["extends"] else model for model in models()}
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


def test_every_key_of_every_model_says_what_it_holds() -> None:
    """By a word on its type where that leaves open what a text is."""
    silent = [
        (model.__name__, key)
        for model in models()
        for key, annotation in fields_of(model).items()
        if holds_of(annotation) is None
    ]
    assert silent == []


def places(model: type[BaseModel]) -> Iterator[tuple[DataPath, Any]]:
    """A place in a file for each key of each model, with a word of the author wherever one can stand."""
    waiting: list[tuple[Any, DataPath]] = [(model, ())]
    known = set[object]()
    while waiting:
        annotation, path = waiting.pop(0)
        yield path, annotation
        for part in branches(annotation):
            origin, arguments = get_origin(part), get_args(part)
            if isinstance(part, type) and issubclass(part, BaseModel) and part not in known:
                known.add(part)
                waiting += [(held, (*path, key)) for key, held in fields_of(part).items()]
            elif origin is dict:  # the author's words may be keys of the language, too
                waiting += [(arguments[1], (*path, word)) for word in ("name", "state", "say", "mine")]
            elif origin in (tuple, list):
                waiting.append((arguments[0], (*path, 0)))


def read_at(root: str, path: DataPath, word: str) -> object:
    """What a plain word at a path of a document is read as, whose first key is `root`."""
    written = f"{word}"
    for step in reversed(path):
        written = f"[{written}]" if isinstance(step, int) else f"{{{step}: {written}}}"
    text = f"{{{root}, {written[1:]}"
    return read_document(Source("x.yaml", text)).at(path).value


@pytest.mark.parametrize(
    ("root", "model"),
    [
        ("scenario: a", ScenarioFile),
        ("suite: a", SuiteFile),
        ("experiment: a", ExperimentFile),
        ("npc: a", NpcFile),
        ("tests_of: a", TestsFile),
        ("library: grammars", GrammarLibraryFile),
        ("variant: a", VariantFile),
        ("curriculum: a", CurriculumFile),
        ("study: a", StudyFile),
    ],
)
def test_a_text_is_a_text_whatever_yaml_takes_it_for(root: str, model: type[BaseModel]) -> None:
    """`say: 5` says "5", wherever `say` is a key of the language, and `let: {say: 5}` is a number."""
    seen = set[object]()
    for path, annotation in places(model):
        if path[:1] in ((), (root.partition(":")[0],)) or (held := holds_of(annotation)) is None:
            continue
        if held.kind in TEXTS:
            assert read_at(root, path, "5") == (5 if int in held.beside else "5"), path
            assert read_at(root, path, "No") == "No", path
        elif held.kind in ("expression", "value", "number", "section"):
            assert read_at(root, path, "5") == 5, path
        seen.add(held.kind)
    assert seen & TEXTS


@pytest.mark.parametrize("verb", ["set", "add"])
def test_a_patch_reads_a_value_as_the_place_that_it_changes(verb: str) -> None:
    for path, read in {
        "about": "5",
        "horizon": 5,
        "cast.ann.name": "5",
        "cast.ann.with.name": 5,
        "outcome[0].reward": 5,
        "frames.f.states.one.then[greeting].say": "5",
        "instructions": "5",
    }.items():
        document = read_document(Source("x.yaml", f"variant: v\n{verb}:\n  {path}: 5\n"))
        assert document.at((verb, path)).value == read, path
    tests = "variant: v\nof: any\nadd: {tests: {t: {play: [{do: 5}]}}}\n"
    assert read_document(Source("x.yaml", tests)).at(("add", "tests", "t", "play", 0, "do")).value == "5"


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


@pytest.mark.parametrize(
    "file",
    [
        BARE + "instructions: Take #1\n",
        BARE + "tests: {t: {play: [\n{do: Take #1\n}]}}\n",
        BARE + "published: [{share: 0.5, n: 9, who: a, did: b,\nsource: Study #1\n}]\n",
        "suite: s\nmembers: [bare.yaml]\ngrammar:\n  templates: [Hello <a>]\n  slots:\n    a: Take #1\n",
        "library: grammars\ngrammars:\n  g:\n    templates: [Hello <a>]\n    slots:\n      a: Take #1\n",
    ],
)
def test_a_text_that_a_comment_cuts_off_is_found_in_every_file(tmp_path: Path, file: str) -> None:
    (tmp_path / "bare.yaml").write_text(BARE, encoding="utf-8")
    (tmp_path / "cut.yaml").write_text(file, encoding="utf-8")
    assert [d.code for d in check(tmp_path / "cut.yaml").diagnostics].count("W009") == 1


@pytest.mark.parametrize("key", ["place", "do", "cause"])
def test_a_text_is_proposed_under_a_name_of_the_author(tmp_path: Path, key: str) -> None:
    """Such as `let: {place: ...}`, which is no place."""
    (tmp_path / "bare.yaml").write_text(f"{BARE}let: {{{key}: Hello out there}}\n", encoding="utf-8")
    (found,) = check(tmp_path / "bare.yaml").diagnostics
    assert "a text is quoted" in str(found.hint)


def kept_alone() -> Iterator[DataPath]:
    """Keys on which nothing else in a scenario depends, and that take no mapping."""
    for path, model in (((), Scenario), (("observe",), Observe), (("room",), Room)):
        for key in keys_that_hold(model, "word", "number", "truth"):
            if not may_hide(Scenario, (*path, key)):
                yield (*path, key)


@pytest.mark.parametrize("path", [*kept_alone()], ids=".".join)
def test_a_mistake_in_a_value_that_stands_alone_hides_no_other(tmp_path: Path, path: DataPath) -> None:
    written: Any = {"any": "thing"}
    for step in reversed(path):
        written = {step: written}
    room = {"size": 6} | written.pop("room", {})
    text = BARE.replace("room: {size: 6}", f"room: {json.dumps(room)}").replace(
        "t == 9", "nobody.sees(agent)"
    )
    lines = [f"{key}: {json.dumps(value)}\n" for key, value in written.items()]
    (tmp_path / "bare.yaml").write_text(text + "".join(lines), encoding="utf-8")
    found = check(tmp_path / "bare.yaml").diagnostics
    assert [d.code for d in found if "nobody" in d.message] == ["S201"]
    assert {d.code for d in found} - {"S201"}


def test_a_key_of_an_entry_is_refused_beside_nested_steps(tmp_path: Path) -> None:
    for key in {*keys_of(Step)} - {"steps", "repeat", "while", "when", "until"}:
        frame = f"frames: {{f: {{steps: [{{steps: [{{do: stay, for: 1}}], {key}: 1}}]}}}}\n"
        text = BARE.replace("agent: {}", "agent: {}, ann: {frame: f}") + frame
        (tmp_path / "bare.yaml").write_text(text, encoding="utf-8")
        assert {d.code for d in check(tmp_path / "bare.yaml").diagnostics} & {"S104", "S107"}, key


def test_what_a_claim_is_about_and_what_it_says_more_are_its_keys() -> None:
    assert [*KINDS, *_WITH] == sorted(keys_of(Property), key=[*KINDS, *_WITH].index)


def test_every_name_that_a_key_holds_is_looked_for_where_it_is_declared() -> None:
    """In a section of a file, whose names editors offer."""
    held = [(key, annotation) for model in models() for key, annotation in fields_of(model).items()]
    for key, annotation in held:
        for part in (
            annotation,
            *(get_args(one)[0] for one in branches(annotation) if get_origin(one) is dict),
        ):
            holds = holds_of(part)
            if holds is not None and holds.kind == "name" and holds.of != ("slots",):
                for section in holds.of:
                    path = ("frames", "f", "x", key)
                    assert [name.word for name in meant({section: {"mine": {}}}, path, holds, "")] == [
                        "mine"
                    ], key


def test_every_word_that_authors_write_for_a_key_means_a_key() -> None:
    assert {*shape._MEANT.values()} <= {key for model in models() for key in keys_of(model)}


def test_what_stands_for_missing_parts_is_what_every_scenario_needs() -> None:
    needed = {field.alias or name for name, field in Scenario.model_fields.items() if field.is_required()}
    assert {*shape._STAND_INS} == needed


def test_what_a_rule_does_are_keys_of_rules() -> None:
    assert {*DOES} <= {key for model in (FirstRule, WorldRule, Step) for key in keys_of(model)}
    assert {*keys_of(Effects)} <= {*DOES}


def test_what_a_key_means_is_about_its_value() -> None:
    meant = [(key, means) for model in models() for key, means in conditions_of(model).items()]
    assert meant
    for key, means in meant:
        assert key in [part.id for part in parse_expression(means.condition).walk() if isinstance(part, Name)]


def test_keys_of_groups() -> None:
    assert {*scenarios._ONE_EACH} == set(CastGroup.__annotations__) - {"count"}
