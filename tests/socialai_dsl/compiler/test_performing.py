"""Sequences that a cast member performs: one move and one utterance a turn."""

from __future__ import annotations

from dataclasses import replace

from socialai_dsl.program import Header, LineColumn
from socialai_dsl.semantics.plans import Assignment, CheckedScenario, RulePlan
from socialai_dsl.semantics.terms import ACTION, Compare, Const, Pattern, Select, Term, Type
from tests.socialai_dsl.compiler.workbench import (
    DIE,
    GUIDE,
    SPAN,
    STATUE,
    activity,
    compiled,
    listed,
    sited,
    start,
    state,
    step,
    with_guide,
    workbench,
)

TEXTS = ("Go up", "Go down", "Look up", "Look down")
UTTERANCE = Type("utterance", 0, 4, ("", *TEXTS))
LEFT, RIGHT, FORWARD = (Const(ACTION, value) for value in (0, 1, 2))


def say(value: int) -> Const:
    return Const(UTTERANCE, value)


DANCE: tuple[Term, ...] = (LEFT, say(0), FORWARD, say(4), RIGHT, say(1))


def dancing(*args: Term) -> CheckedScenario:
    return with_guide(workbench(), state("waiting", activity("perform", *args)))


def turns(checked: CheckedScenario, count: int) -> list[tuple[list[int], str, str]]:
    """Where the guide is, where it looks, and what is heard, after each turn."""
    env = start(checked)
    seen = []
    for _ in range(count):
        heard = step(env)["utterance"]
        guide = env.describe()["guide"]
        seen.append((guide["at"], guide["facing"], heard))
    return seen


def test_without_names_only_the_text_is_heard() -> None:
    assert [turn[2] for turn in turns(replace(dancing(*DANCE), names_shown=False), 2)] == ["NA", "Look down"]


def test_a_drawn_name() -> None:
    words = ("Ann", "Bob")
    text = Type("text", 0, 1, words)
    name = Select(text, (Compare("<", DIE, Const(DIE.type, 2)),), (Const(text, 0),), Const(text, 1))
    named = dancing(*DANCE)
    named = replace(
        named, entities=tuple(replace(e, name=name) if e.number == GUIDE else e for e in named.entities)
    )
    for die in range(4):
        env = start(named, {"let": {"die": die}})
        step(env)
        assert step(env)["utterance"] == f"{words[die // 2]}: Look down"


def test_a_rule_of_first_performs_by_the_clock_of_its_state() -> None:
    rule = RulePlan("dance", "guide/rule", SPAN, do=activity("perform", *DANCE))
    checked = with_guide(workbench(), state("waiting", activity("stay"), first=(rule,)))
    assert turns(checked, 4) == turns(dancing(*DANCE), 4)


def test_who_hears_a_performance_hears_the_class_of_the_text() -> None:
    look_down = Pattern(frozenset({(1, 1)}), "Look down")
    rule = RulePlan(
        "heard",
        "statue/rule",
        SPAN,
        hears=(look_down,),
        sets=(Assignment("let.die", sited(Const(DIE.type, 3))),),
    )
    base = dancing(*DANCE)
    listening = replace(
        base.frames[0],
        member="statue",
        entity=STATUE,
        start="waiting",
        states=(state("waiting", activity("stay"), rule),),
    )
    near = tuple(replace(e, far=9) for e in base.entities)
    env = start(replace(base, entities=near, frames=(*base.frames, listening)), {"let": {"die": 0}})
    heard = []
    for _ in range(3):
        step(env)
        heard.append(env.describe()["let"]["die"])
    assert heard == [0, 3, 3], "the statue has its turn after the guide"
    assert env.counters()["rules"]["heard"] == 1


def test_the_history_holds_what_is_performed() -> None:
    silent, loud = compiled(workbench()), compiled(dancing(*DANCE))
    assert loud.header(Header.TOKENS) > silent.header(Header.TOKENS)
    assert set(loud.lines) >= {f"Guide: {text}" for text in TEXTS}
    at = loud.header(Header.LINE_AT)
    classes = loud.words[at : at + LineColumn.COLUMNS * len(loud.lines)].reshape(-1, LineColumn.COLUMNS)
    assert set(classes[:, LineColumn.CLASS].tolist()) == {1}, "no rule waits for any of it"


def test_a_performance_is_short() -> None:
    listing = listed(compiled(dancing(LEFT, say(0), RIGHT, say(2))), "guide.idle.waiting.do")
    assert [line.split()[1] for line in listing] == [
        "IF_EQ", "BODY", "HALT", "IF_EQ", "BODY", "ADD", "SAY", "HALT", "BODY", "HALT",
    ]  # fmt: skip
