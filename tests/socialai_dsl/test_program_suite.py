"""Programs behind one action space: what a suite compiles to, and mixtures of several."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import socialai_dsl as sd
from socialai_dsl.checking.loaded import unscripted
from socialai_dsl.program import Program
from socialai_dsl.program_suite import ProgramSuite, mixture

FOLDER = Path(__file__).parents[1] / "data" / "suites"


def suite(name: str = "pair.yaml") -> ProgramSuite:
    compiled = sd.compile(sd.load(f"{FOLDER}/{name}"))
    assert isinstance(compiled, ProgramSuite)
    return compiled


def program(name: str) -> Program:
    compiled = sd.compile(sd.load(name))
    assert isinstance(compiled, Program)
    return compiled


def test_a_suite_has_what_a_program_has() -> None:
    pair = suite()
    assert pair.members == ("talkitout", "errands")
    first, second = pair.programs
    assert pair.vocabulary[: len(first.vocabulary)] == first.vocabulary
    assert set(pair.vocabulary) == {*first.vocabulary, *second.vocabulary}
    assert len(pair.vocabulary) == len(set(pair.vocabulary))
    assert "talkitout: timeout" in pair.outcomes
    assert {o.name: o.success for o in pair.outcome_table}["errands: sold"]
    assert len(pair.outcomes) == len(first.outcomes) + len(second.outcomes)
    assert "=== errands ===" in pair.listing()


def test_the_digest_tells_suites_apart() -> None:
    digests = [
        suite(name).sha256 for name in ("pair.yaml", "pair.yaml+loud", "pair.yaml?split=test", "written.yaml")
    ]
    assert len(set(digests)) == 4
    assert suite().sha256 == digests[0]


def test_what_means_something_while_a_member_plays() -> None:
    loud = suite("pair.yaml+loud")
    assert loud.live(0) == (frozenset(range(4)), frozenset(range(16)))
    assert loud.live(1) == (frozenset({4, 5}), frozenset({16, 17, 18}))


def test_scripted_only_if_all_are() -> None:
    assert unscripted(sd.load("talkitout+oracle")) == ()
    assert unscripted(sd.load("talkitout")) == ("talkitout",)
    assert unscripted(sd.load(f"{FOLDER}/pair.yaml"))


def test_a_mixture_shares_texts_but_keeps_each_members_own_pairs() -> None:
    alone, loud = program("talkitout_no_liar"), suite("pair.yaml+loud")
    mixed = mixture([alone, loud])
    assert mixed.members == ("talkitout_no_liar", "pair+loud: talkitout", "pair+loud: errands")
    assert len(mixed.templates) == len(set(mixed.templates)) == 5
    open_, give = mixed.templates.index("Open <noun>"), mixed.templates.index("Give me <noun>")
    assert [own[open_] for own in mixed.template_maps] == [1, 1, 1]
    assert [own[give] for own in mixed.template_maps] == [-1, -1, 0]


def test_equal_names_in_a_mixture_are_numbered() -> None:
    one, other = program("talkitout"), program("talkitout")
    assert mixture([one, other]).members == ("talkitout", "talkitout #2")


def test_the_digest_knows_chances_starts_and_acts() -> None:
    school, acts = suite("school.yaml"), suite("acts.yaml")
    alike = replace(school, weights=(1,) * 8)
    drawn = replace(school, starts=(None,) * 8)
    assert len({one.sha256 for one in (school, alike, drawn)}) == 3
    assert replace(alike, weights=()).sha256 == alike.sha256
    assert replace(acts, in_sequence=False).sha256 != acts.sha256


def test_a_suite_keeps_what_its_leaves_are() -> None:
    school = suite("school.yaml")
    assert school.labels[3] == {"problem": "password", "introduction": "ask", "help": "told"}
    assert school.weights == (1, 1, 1, 1, 1, 1, 3, 3)
    assert [start is not None for start in school.starts] == [False, True] * 3 + [False, False]
