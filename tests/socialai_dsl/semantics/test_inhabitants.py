"""Entities: their numbers, kinds, voices and statuses."""

from __future__ import annotations

import pytest

from socialai_dsl.frontend import load


def test_numbers_are_agent_npcs_objects():
    entities = load("talkitout").checked.entities
    assert [(e.key, e.index) for e in entities] == [
        ("agent", None), ("wizard", None), ("honest", None), ("liar", None),
        ("doors", 0), ("doors", 1), ("doors", 2), ("doors", 3),
    ]  # fmt: skip
    assert [e.number for e in entities] == list(range(8))


def test_kinds_are_numbered_by_first_appearance():
    assert [e.kind_code for e in load("talkitout").checked.entities[1:4]] == [0, 1, 1]


def test_doors_are_in_the_wall_and_closed():
    doors = load("talkitout").checked.entities[4:]
    assert {d.type.states[d.status] for d in doors} == {"closed"}


@pytest.mark.parametrize(("earshot", "heard"), [("next_to", (1, 1)), (3, (0, 3)), ("room", (0, 16))])
def test_earshot(meaning, earshot, heard):
    entity = meaning(earshot=earshot).entities[1]
    assert (entity.near, entity.far) == heard


def test_a_member_has_a_voice_of_its_own(meaning):
    checked = meaning(cast={"guide": {"earshot": "room", "audible": "always"}})
    assert (checked.entities[1].far, checked.entities[1].audible) == (16, True)
    assert checked.entities[0].far == 1


def test_a_variant_as_the_code_has_it():
    loaded = load("talkitout_no_liar+as_coded+unsocial")
    checked = loaded.checked
    assert (checked.sentences.templates[2], checked.sentences.nouns[10]) == ("Close <noun>", "the floor")
    assert (checked.npcs_hidden, checked.picture_before_npcs) == (True, True)
    assert [e.audible for e in checked.entities[:3]] == [False, False, True]
    assert loaded.name == "talkitout_no_liar+as_coded+unsocial"
