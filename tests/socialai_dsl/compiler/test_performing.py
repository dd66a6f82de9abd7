"""Sequences that a cast member performs: one move and one utterance a turn."""

from __future__ import annotations

from dataclasses import replace

from socialai_dsl.program import Header, LineColumn
from socialai_dsl.semantics.plans import Assignment, CheckedScenario, Effect, RulePlan, StepPlan
from socialai_dsl.semantics.terms import ACTION, Compare, Const, Pattern, Read, Select, Term, Type
from tests.socialai_dsl.compiler.workbench import (
    BOX,
    DIE,
    GUIDE,
    SPAN,
    STATUE,
    activity,
    compiled,
    entity,
    listed,
    sited,
    start,
    state,
    step,
    with_guide,
    with_let,
    workbench,
)

TEXTS = ("Go up", "Go down", "Look up", "Look down")
UTTERANCE = Type("utterance", 0, 4, ("", *TEXTS))
LEFT, RIGHT, FORWARD, NONE = (Const(ACTION, value) for value in (0, 1, 2, 7))


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


def test_moves_and_utterances_in_turn_and_then_nothing() -> None:
    assert turns(dancing(*DANCE), 5) == [
        ([4, 3], "down", "NA"),
        ([4, 4], "down", "Guide: Look down"),
        ([4, 4], "left", "Guide: Go up"),
        ([4, 4], "left", "NA"),
        ([4, 4], "left", "NA"),
    ]


def test_drawn_elements() -> None:
    checked = with_let(
        dancing(Read(ACTION, "let.d[0].move"), Read(UTTERANCE, "let.d[0].utterance")), "let.d[0].move", RIGHT
    )
    for number, heard in enumerate(("NA", *(f"Guide: {text}" for text in TEXTS))):
        drawn = with_let(checked, "let.d[0].utterance", say(number))
        assert turns(drawn, 1) == [([4, 3], "up", heard)]


def test_a_blocked_move_counts_all_the_same() -> None:
    args = (LEFT, say(0), FORWARD, say(0), FORWARD, say(2), FORWARD, say(3))
    assert [turn[0] for turn in turns(dancing(*args), 4)] == [[4, 3], [4, 4], [4, 4], [4, 4]], (
        "the statue is in the way"
    )
    assert [turn[2] for turn in turns(dancing(*args), 4)][2:] == ["Guide: Go down", "Guide: Look up"]


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


def test_a_step_ends_with_its_sequence() -> None:
    base = workbench()
    gone = Effect("vanish", (entity(BOX),), SPAN)
    steps = (
        StepPlan("first", None, activity("perform", *DANCE), SPAN),
        StepPlan("second", None, activity("stay"), SPAN, duration=1, causes=(gone,)),
    )
    frame = replace(base.frames[0], states=(), steps=steps)
    env = start(replace(base, frames=(frame,)))
    states = []
    for _ in range(4):
        step(env)
        states.append(env.describe()["guide"]["state"])
    assert states == ["step0", "step0", "step1", "finished"]
    assert env.describe()["box"].get("gone") is True


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
