"""Entries of `check`: what they are about, and that no program is another for them."""

from __future__ import annotations

from socialai_dsl.compilation import compile_scenario

EXIT = ("let.exit", (2, 3, 4, 5))


def test_names_of_outcomes_come_before_conditions(meaning):
    checked = meaning(
        outcome=[{"success": "agent.at(exit)", "id": "out"}, {"failure": "agent.spoke"}],
        check=[{"reachable": word} for word in ("success", "out", "failure", "deadly", "agent.spoke")],
    )
    out, failure = (outcome.name for outcome in checked.outcomes)
    goals = [plan.goals for plan in checked.properties]
    assert goals == [(out,), (out,), (failure, "deadly"), ("deadly",), ()]
    assert [plan.condition is None for plan in checked.properties] == [True, True, True, True, False]


def test_draws_that_can_be_guessed_are_free_choices(meaning):
    checked = meaning(
        let={
            "other": "pick(d in doors where d != exit)",
            "number": "pick(1..3)",
            "odd": "pick(n in 1..4 where n != 2 and (n < 4 or n == 9))",
            "even": "pick(n in 1..4 where n % 2 == 0)",
            "sum": "number + 1",
        },
        check=[{"needs": "guide"}, {"needs": ["guide"], "draw": "number"}],
    )
    every, one = checked.properties
    numbers = (("let.number", (1, 2, 3)), ("let.odd", (1, 3)), ("let.even", (2, 4)))
    assert every.draws == (EXIT, *numbers)
    assert one.draws == (("let.number", (1, 2, 3)),)


def test_groups_stand_for_their_members(meaning):
    checked = meaning(
        cast={"peers": {"count": 2}},
        check=[{"only_through": {"draw": "exit", "by": ["peers", "guide", "peers[0]"]}}],
    )
    assert checked.properties[0].members == ("peers[0]", "peers[1]", "guide")
    assert checked.properties[0].draws[0][0] == "let.exit"


def test_programs_do_not_contain_what_is_checked(meaning):
    plain = meaning()
    claiming = meaning(
        check=[{"never": 'agent.said("Where is sesame") and prev(agent.at(exit))'}, {"reachable": "success"}]
    )
    assert claiming.properties[0].remembered, "what the step before was like is asked by the property alone"
    assert claiming.remembered == plain.remembered == ()
    assert compile_scenario(claiming).sha256 == compile_scenario(plain).sha256
