"""The prelude: object types and shared grammars."""

from __future__ import annotations

from socialai_dsl.frontend import check
from socialai_dsl.library import prelude, shared_grammars
from socialai_dsl.render.tiles import LOOKS


def test_codes_of_the_view():
    codes = {name: type_.code for name, type_ in prelude().types.items()}
    assert codes == {
        "wall": 2, "floor": 3, "door": 4, "ball": 6, "box": 7, "lava": 9, "switch": 12, "apple": 13,
        "lever": 14, "generator": 15, "marble": 16, "platform": 17, "fence": 18, "remote_door": 19,
    }  # fmt: skip


def test_every_type_has_a_look_and_letters_of_its_own():
    types = prelude().types.values()
    assert {type_.look for type_ in types} <= LOOKS.keys()
    first = [type_.letters[0] for type_ in types]
    assert len(set(first)) == len(first)


def test_a_locked_door_ignores_a_toggle():
    door = prelude().types["door"]
    number = door.states.index
    assert door.toggled == {number("closed"): number("open"), number("open"): number("closed")}
    assert (door.initial, door.walkable, door.deadly) == (number("closed"), {number("open")}, False)


def test_a_tagged_ball_shows_itself():
    ball = prelude().types["ball"]
    assert ball.shown == {ball.states.index("tagged"): (1, 1)}


def test_a_scenario_can_name_a_shared_grammar(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text(
        "scenario: a\ngrammar: body\nroom: {size: 5}\ncast: {agent: {}}\n"
        'outcome: [{success: agent.said("Move your head")}]\n'
    )
    checked = check(file).checked
    assert checked is not None
    assert list(checked.sentences.templates) == shared_grammars()["body"]["templates"]
