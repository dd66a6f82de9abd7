"""Files of a `one_of`: whatever differs between them depends on which was drawn."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.plans import Coloring, Drawn, Facing, Placing
from socialai_dsl.semantics.terms import Compare, Const, Quantification, Read, Select

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
THREE = ONE.replace("one", "three").replace("steps: 1", "steps: 5")


@pytest.fixture
def files(tmp_path):
    """Write the npc files; the name of each is its number."""

    def written(*texts):
        (tmp_path / "base.yaml").write_text(BASE)
        for i, text in enumerate(texts):
            (tmp_path / f"npc_{i}.yaml").write_text(text)
        return {"cast": {"guide": {"one_of": "npc_*.yaml"}}}

    return written


def of_guide(checked, kind):
    return [item for item in checked.setup if isinstance(item, kind) and getattr(item, "entity", 1) == 1]


def drawn(checked):
    return {item.path: item.value for item in checked.setup if isinstance(item, Drawn)}


def asks_for(term):
    """The number of the file that a condition asks for."""
    assert isinstance(term, Compare)
    assert term.left == Read(term.left.type, "guide.one_of")
    return term.right.value


def test_the_file_is_drawn_first_of_all_that_depends_on_it(meaning, files):
    checked = meaning(**files(ONE, TWO))
    value = drawn(checked)["guide.one_of"]
    assert isinstance(value.term, Quantification)
    assert (value.site, value.term.op, value.term.type.words) == ("cast.guide.one_of", "pick", ("one", "two"))


def test_what_is_alike_depends_on_nothing(meaning, files):
    checked = meaning(**files(ONE, ONE.replace("one", "two")))
    assert [placing.when for placing in of_guide(checked, Placing)] == [None]
    assert [coloring.when for coloring in of_guide(checked, Coloring)] == [None]
    guide = checked.entities[1]
    assert guide.kind_drawn is None
    assert isinstance(guide.name, Const)


def test_where_files_differ_there_is_one_for_each_of_them(meaning, files):
    checked = meaning(**files(ONE, TWO))
    assert [asks_for(placing.when) for placing in of_guide(checked, Placing)] == [0, 1]
    assert [asks_for(coloring.when) for coloring in of_guide(checked, Coloring)] == [0, 1]
    assert [asks_for(facing.when) for facing in of_guide(checked, Facing)] == [0, 1]


def test_files_that_are_alike_share_theirs(meaning, files):
    placings = of_guide(meaning(**files(ONE, TWO, THREE)), Placing)
    either, only = (placing.when for placing in placings)
    assert [asks_for(term) for term in either.args] == [0, 2]
    assert asks_for(only) == 1


def test_names_and_kinds_are_selected(meaning, files):
    checked = meaning(**files(ONE, TWO))
    guide = checked.entities[1]
    name = drawn(checked)["guide.name"].term
    assert isinstance(name, Select)
    assert name.type.words == ("Guide", "Tim")
    assert guide.name == Read(name.type, "guide.name")
    assert guide.kind == "teacher or liar"
    assert isinstance(guide.kind_drawn, Select)
    assert guide.kind_code == 1


def test_a_slot_is_a_register_that_selects_among_what_fills_it(meaning, files):
    found = drawn(meaning(**files(ONE, TWO)))
    goal = found["guide.goal"].term
    assert isinstance(goal, Select)
    assert {type(value) for value in (*goal.values, goal.default)} == {Read, Quantification}


def test_a_slot_filled_alike_is_not_selected(meaning, files):
    alike = drawn(meaning(**files(ONE, TWO)))["guide.steps"].term
    assert (type(alike), alike.value) == (Const, 1)
    steps = drawn(meaning(**files(ONE, TWO, THREE)))["guide.steps"].term
    assert [value.value for value in (*steps.values, steps.default)] == [5, 1]


def test_a_condition_holds_if_it_does_in_the_file_that_was_drawn(meaning, files):
    checked = meaning(**files(ONE, TWO))
    when = checked.frames[0].states[0].then[0].when.term
    near, _ = when.args
    assert asks_for(near.right) == 0


def test_a_text_is_the_one_of_the_file_that_was_drawn(meaning, files):
    (rule,) = meaning(**files(ONE, TWO)).frames[0].states[0].then
    (text,) = rule.say.parts
    assert text.type.words == ("That way", "This way") or text.type.words == ("This way", "That way")


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (TWO + "earshot: 3\n", "S315 what is drawn by `one_of` has one and the same `earshot`"),
        (TWO + "view: 3\n", "S315 what is drawn by `one_of` has one and the same `view`"),
        (TWO + "audible: always\n", "S315 what is drawn by `one_of` has one and the same `audible`"),
        ("npc: two\n",
         "S315 `two` follows no frame, `one` follows the frame `teach`; what is drawn by `one_of` shares one"),
        ("npc: two\nframe: teach\nframes: {teach: {steps: [{say: Hi}]}}\n",
         "S315 `two` and `one` follow different frames; what is drawn by `one_of` shares one"),
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
