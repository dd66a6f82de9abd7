"""Expressions: names found, words read as what is expected, types checked."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.terms import (
    BOOL,
    COLOR,
    DIRECTION,
    TURN,
    Compare,
    Const,
    FieldOf,
    Logic,
    Measure,
    Not,
    Operation,
    Quantification,
    Read,
    Select,
    Type,
    Variable,
    World,
)
from socialai_dsl.semantics.terms import Test as Relation

AGENT = Const(Type("entity", 0, 0), 0)
DOORS = Type("entity", 2, 5)


def test_a_let_is_a_register(outcome_term):
    assert outcome_term("agent.at(exit)") == Relation("at", AGENT, Read(DOORS, "let.exit"))


def test_a_relation_to_a_group_asks_for_any_member(outcome_term):
    items = tuple(Const(DOORS, n) for n in range(2, 6))
    condition = Relation("next_to", AGENT, Variable(DOORS, "each"))
    assert outcome_term("agent.next_to(doors)") == Quantification(BOOL, "any", "each", items, condition)


def test_a_bare_word_is_what_the_other_side_is(outcome_term):
    red = outcome_term("exit.color == red")
    assert red == Compare("==", FieldOf(COLOR, Read(DOORS, "let.exit"), "color"), Const(COLOR, 0))
    assert outcome_term("red == exit.color").right == Const(COLOR, 0) or red


def test_left_is_an_action_a_direction_or_a_turn(outcome_term):
    assert outcome_term("agent.did(left)").right.type.kind == "action"
    assert outcome_term("agent.facing == left").right == Const(DIRECTION, 2)
    assert outcome_term("agent.facing == up + left").right == Const(DIRECTION, 2)


def test_a_let_of_bare_words_takes_its_type_from_its_use(meaning):
    frames = {"look": {"states": {"a": {"do": "turn(glance)"}}}}
    checked = meaning(let={"glance": "pick(left | right)"}, frames=frames, cast={"guide": {"frame": "look"}})
    (glance,) = [s for s in checked.setup if getattr(s, "path", "") == "let.glance"]
    assert glance.type == TURN
    assert [item.value for item in glance.value.term.items] == [-1, 1]


def test_a_use_that_says_nothing_does_not_settle_the_type(meaning):
    frames = {"look": {"states": {"a": {"do": "turn_to(way)"}}}}
    checked = meaning(
        let={"way": "pick(left | right)", "same": "way == way"},
        frames=frames,
        cast={"guide": {"frame": "look"}},
    )
    assert checked.frames[0].states[0].activity.args == (Read(DIRECTION, "let.way"),)


def test_uses_that_disagree_are_a_mistake(mistakes):
    frames = {"look": {"states": {"a": {"do": "turn(glance)"}}}}
    found = mistakes(
        let={"glance": "pick(left | right)"},
        frames=frames,
        cast={"guide": {"frame": "look"}},
        outcome=[{"success": "agent.did(glance)"}],
    )
    assert [line[:4] for line in found] == ["S209"]


def test_a_direction_plus_a_turn_stays_a_direction(outcome_term):
    term = outcome_term("guide.facing + right == up")
    assert term.left == Operation(
        DIRECTION, "turn", (FieldOf(DIRECTION, Const(Type("entity", 1, 1), 1), "dir"), Const(TURN, 1))
    )


def test_a_direction_plus_a_number_is_a_mistake(mistakes):
    assert "S204" in mistakes(outcome=[{"success": "guide.facing + 1 == up"}])[0]


def test_alternatives_stand_for_any_of_them(outcome_term):
    term = outcome_term("agent.action in toggle | done")
    assert isinstance(term, Logic)
    assert [c.right.value for c in term.args] == [5, 6]
    assert isinstance(outcome_term("agent.action not in toggle | done"), Not)


def test_ranges_compare(outcome_term):
    term = outcome_term("agent.x in 1..3")
    assert [type(c) for c in term.args] == [Compare, Compare]
    assert [c.op for c in term.args] == ["<=", "<="]


@pytest.mark.parametrize(("written", "op", "first"), [("t > 3", "<", 3), ("t >= 3", "<=", 3)])
def test_greater_is_less_the_other_way_round(outcome_term, written, op, first):
    term = outcome_term(written)
    assert (term.op, term.left.value, term.right.name) == (op, first, "t")


def test_arithmetic_knows_its_range(outcome_term):
    term = outcome_term("W // 2 - 1 == H % 3")
    assert (term.left.type.low, term.left.type.high) == (1, 3)
    assert (term.right.type.low, term.right.type.high) == (0, 2)


def test_known_numbers_are_computed(outcome_term):
    assert outcome_term("t == 2 * (7 - 3) // 3 % 2").right.value == 0


def test_a_room_of_one_size_has_known_width(outcome_term):
    assert outcome_term("agent.x == W - 1", room={"size": 8}).right.value == 7


def test_colours_fit_nouns_by_their_name(outcome_term):
    term = outcome_term("agent.noun == exit.color")
    pairs = {(c.args[0].right.value, c.args[1].right.value) for c in term.args}
    assert pairs == {(3, 0), (4, 2)}, "nouns red and blue are 3 and 4, colours red and blue are 0 and 2"


def test_numbers_fit_nouns_by_their_name(outcome_term):
    assert outcome_term("agent.noun == 2").right.value == 7


def test_texts_compare_by_what_they_say(meaning):
    cast = {
        "guide": {"name": 'pick("Jo" | "Al")'},
        "other": {"name": 'pick(n in "Al" | "Bo" where n != guide.name)'},
    }
    checked = meaning(cast={**cast, "agent": {}})
    (other,) = [s for s in checked.setup if getattr(s, "path", "") == "other.name"]
    both = other.value.term.condition.arg
    assert [c.right.value for c in both.args] == [0, 1], (
        "Al is the first of one list and the second of the other"
    )


def test_a_definition_is_expanded_where_it_is_used(outcome_term):
    define = {"close_to(x)": "agent.distance(x) <= 2"}
    term = outcome_term("close_to(exit)", define=define)
    assert term.left == Measure(Type("int", 0, 16), "distance", (AGENT, Read(DOORS, "let.exit")))


def test_variables_of_a_definition_do_not_catch_its_arguments(outcome_term):
    define = {"has_neighbour(x)": "any(d in doors where d.next_to(x))"}
    term = outcome_term("all(d in doors where has_neighbour(d))", define=define)
    inner = term.condition
    assert inner.variable != term.variable
    assert inner.condition == Relation(
        "next_to", Variable(DOORS, inner.variable), Variable(DOORS, term.variable)
    )


def test_a_weight_repeats_an_alternative(meaning):
    checked = meaning(let={"way": "pick(2 * up | down)"})
    (way,) = [s for s in checked.setup if getattr(s, "path", "") == "let.way"]
    assert [item.value for item in way.value.term.items] == [3, 3, 1]


def test_a_range_whose_end_is_drawn_is_narrowed_by_a_condition(meaning):
    checked = meaning(let={"column_": "pick(1..W - 2)"})
    (drawn,) = [s for s in checked.setup if getattr(s, "path", "") == "let.column_"]
    assert [item.value for item in drawn.value.term.items] == [1, 2, 3, 4, 5, 6]
    assert drawn.value.term.condition.args[1].right.args[0] == World(Type("int", 5, 8), "width")


def test_picks_are_numbered_in_source_order(outcome_term):
    term = outcome_term("pick(doors).x == pick(d in doors where d != pick(doors)).x")
    outer = term.right.entity
    assert (term.left.entity.ordinal, outer.ordinal, outer.condition.right.ordinal) == (0, 1, 2)


def test_a_status_is_a_word_after_the_dot(outcome_term):
    term = outcome_term("exit.closed")
    assert (term.left.name, term.right.value, term.left.type.words) == (
        "status",
        1,
        ("open", "closed", "locked"),
    )


def test_both_mistakes_of_a_condition_are_found(mistakes):
    found = mistakes(outcome=[{"success": "agent.at(exitt) and agent.color == crimson"}])
    assert [line[:4] for line in found] == ["S201", "S201"]


# -- conditional values


def chosen(outcome_term, text, **sections):
    """The term of a conditional value that is compared with something."""
    return outcome_term(text, **sections).left


def test_a_conditional_value_has_room_for_both(outcome_term):
    number = chosen(outcome_term, "(5 if t > 2 else 8) == t")
    assert number == Select(
        Type("int", 5, 8),
        (outcome_term("t > 2"),),
        (Const(Type("int", 5, 5), 5),),
        Const(Type("int", 8, 8), 8),
    )
    thing = chosen(outcome_term, "(agent if t > 2 else exit) == agent")
    assert thing.type == Type("entity", 0, 5)


def test_a_chain_of_else_is_one_choice(outcome_term):
    number = chosen(outcome_term, "(1 if t == 0 else 2 if t == 1 else 3) == t")
    assert [value.value for value in (*number.values, number.default)] == [1, 2, 3]


def test_what_is_known_is_taken(outcome_term):
    assert outcome_term("(5 if true else 8) == t").left == Const(Type("int", 5, 5), 5)
    known = outcome_term("(1 if false else 2 if t == 1 else 3 if true else 4) == t").left
    assert [value.value for value in (*known.values, known.default)] == [2, 3]


def test_a_bare_word_is_what_the_other_value_is(outcome_term):
    for text in ("exit.color if t > 2 else red", "red if t > 2 else exit.color"):
        assert chosen(outcome_term, f"({text}) == guide.color").type == COLOR
    assert outcome_term("exit.color == (red if t > 2 else blue)").right.type == COLOR
    assert outcome_term("agent.facing == (left if t > 2 else up)").right.type == DIRECTION


def test_a_text_beside_a_colour_or_a_number_makes_both_texts(outcome_term):
    mixed = chosen(outcome_term, '(exit.color if t > 2 else "none") == "red"')
    assert mixed.type == Type("text", 0, 6, (*COLOR.words, "none"))
    assert chosen(outcome_term, '(3 if t > 2 else "none") == "none"').type.words == ("3", "none")


def test_a_noun_beside_a_number_is_a_number_if_every_noun_is(outcome_term, mistakes):
    grammar = {"templates": ["Take <noun>"], "nouns": [3, 5]}
    assert chosen(outcome_term, "(agent.noun if t > 2 else 8) == 8", grammar=grammar).type == Type(
        "int", 3, 8
    )
    (found,) = mistakes(outcome=[{"success": "(agent.noun if t > 2 else 8) == 8"}])
    assert found.startswith("S204 `agent.noun` is a noun, but a number is expected here")


def test_picks_of_a_conditional_value_are_numbered_in_source_order(outcome_term):
    term = outcome_term("(pick(1 | 2) if pick(doors) == exit else pick(3 | 4)) == t").left
    assert (term.values[0].ordinal, term.conditions[0].left.ordinal, term.default.ordinal) == (0, 1, 2)


def test_both_sides_of_a_conditional_value_are_looked_at(mistakes):
    found = mistakes(outcome=[{"success": "agent.at(exitt if t > 2 else exi)"}])
    assert [text[:22] for text in found] == ["S201 unknown name `exi", "S201 unknown name `exi"]
