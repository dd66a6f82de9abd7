"""Files of a `one_of`: whatever differs between them depends on which was drawn."""

from __future__ import annotations

import pytest

from socialai_dsl.schema.scenario import CastMember
from socialai_dsl.semantics.plans import Drawn

BASE = """
npc: base
abstract: true
kind: teacher
frame: teach
frames:
  teach:
    slots: {line: text, near: bool, goal: object, steps: int}
    let: {asked: 0}
    states:
      waiting: {do: face(agent), then: [{when: next_to(agent) == near and steps < 3, say: <line>, goto: leading}]}
      leading: {do: go_to(goal)}
"""
ONE = """
npc: one
extends: base.yaml
with: {line: This way, near: true, goal: exit, steps: 1}
"""
TWO = """
npc: two
extends: base.yaml
kind: liar
name: Tim
color: red
facing: up
place: left_half
with: {line: That way, near: false, goal: pick(doors), steps: 1}
"""


@pytest.fixture
def files(tmp_path):
    """Write the npc files; the name of each is its number."""

    def written(*texts):
        (tmp_path / "base.yaml").write_text(BASE)
        for i, text in enumerate(texts):
            (tmp_path / f"npc_{i}.yaml").write_text(text)
        return {"cast": {"guide": {"one_of": "npc_*.yaml"}}}

    return written


def drawn(checked):
    return {item.path: item.value for item in checked.setup if isinstance(item, Drawn)}


def test_each_key_of_a_member_has_cases_or_is_the_same_in_all_files(mistakes, files):
    values = {
        "kind": "shy", "name": "Pip", "color": "blue", "place": "top_half", "at": "[1, 1]", "facing": "left",
        "view": 5, "earshot": "room", "beliefs": "{d: {of: exit.color}}", "accepts": "agent.spoke",
        "audible": "always", "kind_code": 9, "pushed_by": "anybody",
    }  # fmt: skip
    elsewhere = {"role", "seat", "frame", "with", "one_of"}
    fields = CastMember.model_fields
    assert {fields[name].alias or name for name in fields} == {*values, *elsewhere}
    differ = set()
    for key, value in values.items():
        found = mistakes(**files(ONE, ONE.replace("one", "two") + f"{key}: {value}\n"))
        if found == [f"S315 the files of `one_of` must have the same `{key}`"]:
            differ.add(key)
        else:
            assert found == [], key
    assert differ == {"view", "earshot", "beliefs", "accepts", "audible", "pushed_by"}


def test_a_name_that_is_left_out_in_one_file_leaves_that_of_another_an_expression(meaning, files):
    checked = meaning(**files(ONE, ONE.replace("one", "two") + "name: pick(Sue | Sam)\n"))
    assert set(drawn(checked)["guide.name"].term.type.words) == {"Guide", "Sue", "Sam"}


def test_a_frame_that_nobody_gives_has_no_slots(mistakes, files):
    alone = "npc: N\nwith: {near: true}\n"
    assert mistakes(**files(*(alone.replace("N", name) for name in ("one", "two")))) == [
        "S303 `one` follows no frame, so it has no slot `near`",
        "S303 `two` follows no frame, so it has no slot `near`",
    ]


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (TWO + "earshot: 3\n", "S315 the files of `one_of` must have the same `earshot`"),
        (TWO + "view: 3\n", "S315 the files of `one_of` must have the same `view`"),
        (TWO + "audible: always\n", "S315 the files of `one_of` must have the same `audible`"),
        ("npc: two\n",
         "S315 `two` follows no frame, `one` follows the frame `teach`; the files of `one_of` must share one"),
        ("npc: two\nframe: teach\nframes: {teach: {steps: [{say: Hi}]}}\n",
         "S315 `two` and `one` follow different frames; the files of `one_of` must share one"),
        (TWO + "accepts: agent.spoke\n", "S315 the files of `one_of` must have the same `accepts`"),
        (TWO + "beliefs: {door: {of: exit.color}}\n",
         "S315 the files of `one_of` must have the same `beliefs`"),
        (TWO.replace("two", "one"), "S213 `one` is the name of another of these files"),
        (TWO.replace("steps", "stepps"), "S303 frame `teach` has no slot `stepps`; did you mean `steps`?"),
        (TWO.replace("goal: pick(doors), ", ""),
         "S302 frame `teach` has a slot `goal` (object) that `two` does not fill"),
        (TWO.replace("pick(doors)", "pick(colors)"),
         "S204 `pick(colors)` is a colour, but an object or a member of the cast is expected here"),
        (TWO.replace("That way", "The <exit.color> one"),
         "S315 files of `guide` say different things here, so none may have values in it"),
    ],
)  # fmt: skip
def test_mistakes(mistakes, files, other, said):
    assert mistakes(**files(ONE, other)) == [said]


def test_there_is_room_for_what_a_frame_of_a_file_counts(meaning, files):
    """As in a frame of the scenario itself: by one a turn, over the whole episode."""
    counting = (
        "npc: N\nframe: tick\nframes: {tick: {let: {n: 0}, states: {on: {then: [{set: {n: n + 1}}]}}}}\n"
    )
    checked = meaning(**files(counting.replace("N", "one"), counting.replace("N", "two")))
    (counter,) = [item for item in checked.setup if isinstance(item, Drawn) and item.path == "guide.n"]
    assert counter.type.high >= checked.horizon


def test_a_name_that_reads_as_another_is_shown_in_its_file(examine, files):
    named = TWO.replace("name: Tim", "name: '\"Tim: Bo\"'")
    (found,) = examine(**files(ONE, named)).diagnostics
    assert (found.code, found.span.file.rsplit("/", 1)[-1], found.span.line) == ("S405", "npc_1.yaml", 5)
