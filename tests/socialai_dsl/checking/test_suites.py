"""Suites: their members, splits and variants, and the action space that the members share."""

from __future__ import annotations

from pathlib import Path

import pytest

from socialai_dsl.checking.loaded import LoadedSuite
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.frontend import check, load
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Source
from tests.socialai_dsl.checking.suite_files import suite, written

pytestmark = pytest.mark.usefixtures("folder")


def test_union_says_each_text_once_in_the_order_of_the_members() -> None:
    space = suite("pair").space
    talkitout, errands = suite("pair").members
    assert space.sentences.templates == (*talkitout.checked.sentences.templates, "Give me <noun>")
    assert space.sentences.nouns == (*talkitout.checked.sentences.nouns, "bread", "2")
    assert [space.sentences.nouns[i] for i, own in enumerate(space.slot_maps[1][0]) if own >= 0] == [
        "sesame",
        "bread",
        "2",
    ]
    for number, member in enumerate((talkitout, errands)):
        for words, own, at in (
            (space.sentences.templates, member.checked.sentences.templates, space.template_maps[number]),
            (space.sentences.nouns, member.checked.sentences.nouns, space.slot_maps[number][0]),
        ):
            assert {word: own[i] for word, i in zip(words, at, strict=True) if i >= 0} == {w: w for w in own}


def test_concat_keeps_what_is_said_twice_and_its_place() -> None:
    space = suite("pair+loud").space
    assert space.sentences.templates.count("Open <noun>") == space.sentences.nouns.count("sesame") == 2
    assert space.template_maps == ((0, 1, 2, 3, -1, -1), (-1, -1, -1, -1, 0, 1))
    assert space.slot_maps[1][0][-3:] == (0, 1, 2)
    assert set(space.slot_maps[1][0][:-3]) == {-1}


def test_a_grammar_may_be_written_out() -> None:
    space = suite("written").space
    assert space.sentences.templates[-1] == "Fetch <noun>"
    assert space.template_maps == ((-1, -1, 1, 0, -1), (3, 0, 1, -1, -1))
    assert space.slot_maps == (((0, 1, -1, -1, -1),), ((-1, 0, 1, 3, -1),))


def test_all_members_have_the_body_actions_of_all() -> None:
    actions = ("left", "right", "forward", "pickup", "drop", "toggle", "done")
    assert suite("pair").space.actions == actions
    assert [member.checked.actions for member in suite("pair").members] == [actions, actions]
    assert suite("written").members[0].checked.actions == ("left", "right", "forward", "toggle")
    alone = load("errands")
    assert not isinstance(alone, LoadedSuite)
    assert alone.checked.actions == ("left", "right", "forward")


def test_splits_and_variants() -> None:
    assert suite("pair").member_names == suite("pair?split=train").member_names == ("talkitout", "errands")
    test = suite("pair?split=test")
    assert test.member_names == ("talkitout", "errands_open")
    assert test.members[1].checked.horizon == 5
    assert suite("pair?split=alone").member_names == ("errands",)
    hidden = suite("pair+unsocial")
    assert [member.name for member in hidden.members] == ["talkitout+unsocial", "errands+unsocial"]
    assert hidden.member_names == ("talkitout", "errands")
    loud = suite("pair+loud?split=test")
    assert [member.name for member in loud.members] == ["talkitout", "errands_open+loud"]
    assert suite("pair_loud").space == suite("pair+loud").space


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("pair?split=tset", "S206 `pair` has no split `tset`; did you mean `test`?"),
        ("pair?length=2", "S206 `pair` is a suite and has no parameter `length`"),
        ("pair+nothing", "S503 no member of `pair+nothing` has a variant `nothing`"),
    ],
)
def test_names_that_are_wrong(name: str, message: str) -> None:
    with pytest.raises(ScenarioError) as raised:
        load(name)
    assert message in str(raised.value)


@pytest.mark.parametrize(
    ("text", "findings"),
    [
        ("members: [errand.yaml]", ["2:11: S504 there is no file `errand.yaml` in .; did you mean `errands.yaml`?"]),
        ("members: []", ["2:10: S106 `members` is empty"]),
        ("draw: uniform", ["1:1: S105 a suite needs a key `members`"]),
        ("member: [errands]", ["2:1: S101 unknown key `member` in a suite; did you mean `members`?"]),
        ("members: [errands, errands]", ["2:20: S213 `errands` is a member already"]),
        (
            "members: [errands]\ngrammar: unoin",
            ["3:10: S103 `unoin` is not a word for `grammar`; did you mean `union`?"],
        ),
        ("members: [errands]\ngrammar: {templates: [Open <noun>]}", ["3:1: S105 `grammar` needs a key `nouns`"]),
        ("members: [errands]\ndraw: weighted", ["3:7: S103 `weighted` is not a word for `draw`"]),
        ("members: [errands]\nactions: [left, jump]", ["3:17: S103 `jump` is not a word for `actions`"]),
        (
            "members: [errands]\nsplits: {a: {replace: {errand: talkitout}}}",
            ["3:24: S504 `errand` is no member of this suite; did you mean `errands`?"],
        ),
        (
            "members: [errands]\nsplits: {a: {replace: {errands: talkitou}}}",
            ["3:33: S504 there is no file `talkitou` in ."],
        ),
        (
            "members: [errands]\nsplits: {a: {replace: {errands: talkitout}, members: [talkitout]}}",
            ["3:45: S107 the split `a` has only one of `replace` and `members`"],
        ),
        (
            "members: [errands]\ngrammar: {templates: [Open <noun>], nouns: [sesame]}",
            ['3:1: S401 `errands` needs "Give me bread", which the grammar of this suite cannot say'],
        ),
        ("members: [pair]", ["2:11: S108 `pair` is a file of the kind `suite`; the members of a suite are scenarios"]),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_where_it_is(text: str, findings: list[str]) -> None:
    assert written(text) == findings


@pytest.mark.parametrize(
    "grammar",
    [
        "{templates: [Give me <noun>, Open <noun>, Open <what>], nouns: [bread]}",
        "{templates: [Give me <noun>, Open <noun> or <noun>], nouns: [bread]}",
        "{templates: [Give me <noun>, Open > <noun>], nouns: [bread]}",
        "{templates: [Give me <noun>, give me <noun>], nouns: [bread]}",
        "{templates: [Give me <noun>], nouns: [bread, Bread]}",
        "{templates: [Give me <noun>], nouns: [bread, <noun>]}",
        "{templates: [Give me <noun>], nouns: [bread], slots: {food: [bread, cake]}}",
        "{templates: [Give me <noun>]}",
    ],
)
def test_a_suites_grammar_is_judged_as_a_scenarios(grammar: str) -> None:
    own = "grammar:\n  templates: [Give me <noun>, Open <noun>]\n  nouns: [bread, sesame, 2]\n"
    right = Path("errands.yaml").read_text()
    assert own in right
    Path("alone.yaml").write_text(right.replace(own, f"grammar: {grammar}\n"))
    found = [str(finding).removeprefix("alone.yaml:") for finding in check("alone.yaml").diagnostics]
    of_the_grammar = [finding.removeprefix("7:") for finding in found if finding.startswith("7:")]
    assert of_the_grammar
    suites = written(f"grammar: {grammar}\nmembers: [errands]")
    assert [finding.removeprefix("2:") for finding in suites] == of_the_grammar


def test_mistakes_of_members_are_shown_in_their_files() -> None:
    right = Path("errands.yaml").read_text()
    Path("errands.yaml").write_text(right.replace("baker.is(gone)", "baker.is(gon)"))
    found = check("pair").diagnostics
    assert [(d.span.file, d.code) for d in found] == [("errands.yaml", "S310")]
    Path("errands.yaml").write_text(right)
    Path("errands_loud.yaml").write_text(
        "variant: errands_loud\nof: errands.yaml\nset: {cast.baker.frame: trad}\n"
    )
    (found_first, *_) = check("pair+loud").diagnostics
    assert str(found_first).startswith("errands_loud.yaml:3:25: S201 unknown frame `trad`")
    assert found_first.hint == "in `errands+loud`, patched by errands_loud.yaml"


def test_what_a_script_says_must_be_sayable_too() -> None:
    Path("errands_oracle.yaml").write_text(
        "variant: errands_oracle\nof: errands.yaml\n"
        "set: {cast.agent.frame: buy, frames.buy: {steps: [{say: Open 2}, {say: Give me bread}]}}\n"
    )
    text = "members: [errands+oracle]\n"
    said = "{templates: [Open <noun>, Give me <noun>], nouns: [bread, sesame]}"
    assert written(text + f"grammar: {said}") == [
        '3:1: S401 `errands+oracle` needs "Open 2", which the grammar of this suite cannot say'
    ]


def test_the_example_of_the_documentation_is_the_shipped_suite() -> None:
    root = Path(__file__).parents[3]
    text = (root / "docs" / "suites.md").read_text().partition("```yaml\n")[2].partition("```")[0]
    shown = read_document(Source("docs/suites.md", text)).data
    shipped = read_document(root / "scenarios" / "social_env.yaml").data
    assert isinstance(shown, dict)
    assert isinstance(shipped, dict)
    assert shown == {key: value for key, value in shipped.items() if key != "skills"}


@pytest.mark.parametrize(
    "split", ["", "?split=test", "+as_coded", "+as_coded?split=test", "+unsocial", "+oracle"]
)
def test_the_suite_of_the_paper(split: str) -> None:
    loaded = suite(f"social_env{split}")
    assert loaded.warnings == ()
    coded = ("dance", "cointhief", "talkitout", "showme", "diverse_exit", "help")
    paper = ("talkitout", "dance", "cointhief", "diverse_exit", "showme", "help")
    names = [name.replace("help_as_helper", "help") for name in loaded.member_names]
    assert tuple(names) == (coded if "as_coded" in split else paper)
    assert ("help_as_helper" in loaded.member_names) == ("test" in split)
    sizes = (15, 45) if "as_coded" in split else (7, 26)
    assert (len(loaded.space.sentences.templates), len(loaded.space.sentences.nouns)) == sizes
