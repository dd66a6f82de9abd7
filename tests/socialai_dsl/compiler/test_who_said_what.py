"""Who said something and with which noun; what NPCs have said in a step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from socialai_dsl.compiler.tables import InvalidProgramError, verify
from socialai_dsl.program import Flag, Header, LineColumn, Op, Program
from socialai_dsl.semantics.plans import Assignment, CheckedScenario, Drawn, FramePlan, RulePlan, StatePlan
from socialai_dsl.semantics.terms import (
    ACTION,
    BOOL,
    Compare,
    Const,
    HeardNoun,
    Line,
    Operation,
    Pattern,
    Read,
    SaidBy,
    Speaker,
    Term,
    Type,
)
from tests.socialai_dsl.compiler.workbench import (
    AGENT,
    GUIDE,
    SPAN,
    STATUE,
    activity,
    code,
    compiled,
    listed,
    number,
    sited,
    start,
    step,
    with_let,
    workbench,
)

SOMEBODY = Type("entity", 0, 2)
NOUN = Type("noun", 0, 1, ("up", "down"))
GO = Pattern(
    frozenset(((0, 0), (0, 1))), "Go <noun>", frozenset(("Go up", "Go down")), (("Go up", 0), ("Go down", 1))
)
LOOK_UP = Pattern(frozenset(((1, 0),)), "Look up", frozenset(("Look up",)))
WHO, WHICH = Speaker(SOMEBODY, (GO, LOOK_UP)), HeardNoun(NOUN, (GO, LOOK_UP))


def said(text: str | Term) -> Line:
    return Line((text,), "say", SPAN)


def rule(member: str, place: str, **what: Any) -> RulePlan:
    return RulePlan(f"{member}.talk.waiting.{place}", f"{member}/{place}", SPAN, **what)


def frame(member: str, number: int, *then: RulePlan) -> FramePlan:
    waiting = StatePlan("waiting", (), activity("stay"), then, SPAN)
    return FramePlan(member, "talk", number, SPAN, "waiting", (waiting,))


def register(path: str, type_: Type, value: int) -> Drawn:
    return Drawn(path, type_, sited(Const(type_, value), path))


def talking(*statues: RulePlan, hears: tuple[Pattern, ...] = (GO, LOOK_UP), **more: Any) -> CheckedScenario:
    """The guide notes who said what it hears; the statue talks."""
    sets = (Assignment("guide.who", sited(WHO)), Assignment("guide.which", sited(WHICH)))
    note = rule("guide", "then[0]", hears=hears, sets=more.pop("sets", sets), **more)
    checked = workbench()
    words = ("go", "up", "down", "look", "guide", "statue")
    return replace(
        checked,
        setup=(*checked.setup, register("guide.who", SOMEBODY, AGENT), register("guide.which", NOUN, 0)),
        frames=(frame("guide", GUIDE, note), frame("statue", STATUE, *statues)),
        words_in_order=tuple(dict.fromkeys((*checked.words_in_order, *words))),
    )


# --- Speaker and HeardNoun ---


def test_inboxes_hold_who_and_what_only_where_somebody_asks() -> None:
    asked, unasked = compiled(talking()), compiled(talking(sets=()))
    for program, flag, size in ((asked, Flag.HEARD_BY, 1 + 3 * 3), (unasked, 0, 1 + 3)):
        h = program.header
        assert h(Header.FLAGS) & Flag.HEARD_BY == flag
        assert h(Header.HEARD) - h(Header.INBOX) == 2 * size
    assert (asked.header(Header.CLASS_SETS), unasked.header(Header.CLASS_SETS)) == (1, 0)


def test_an_inbox_keeps_nothing_of_what_was_heard() -> None:
    env = start(talking(rule("statue", "then[0]", say=said("Go down"), once=True)))
    first = env.program.header(Header.INBOX)
    inbox = env._table.state.registers[0, first : first + 4]
    step(env)
    assert inbox.tolist() == [1, 2, STATUE, 1], (
        "one thing of class 2, which the statue said, with the second noun"
    )
    step(env)
    assert inbox.tolist() == [0, 0, 0, 0]


def nouns_of(program: Program) -> dict[str, int]:
    h = program.header
    rows = program.words[h(Header.LINE_AT) :][: h(Header.LINES) * LineColumn.COLUMNS]
    return dict(
        zip(program.lines, rows.reshape(-1, LineColumn.COLUMNS)[:, LineColumn.NOUN].tolist(), strict=True)
    )


@pytest.mark.parametrize(("position", "value"), [(1, -1), (2, 1), (2, -1), (0, 7000)])
def test_questions_about_nothing_are_refused(position: int, value: int) -> None:
    program = compiled(talking())
    words = program.words.copy()
    row = next(k for k, (op, *_) in enumerate(program.code.tolist()) if op == Op.HEARD_FROM)
    words[program.header(Header.CODE_AT) + 4 * row + 1 + position] = value
    with pytest.raises(InvalidProgramError, match="HEARD_FROM"):
        verify(replace(program, words=words))


@pytest.mark.parametrize(
    ("table", "column", "value"), [(Header.LINE_AT, LineColumn.NOUN, 2), (Header.FLAGS, 0, 0)]
)
def test_tables_about_what_was_said_are_proven(table: Header, column: int, value: int) -> None:
    program = compiled(talking(rule("statue", "then[0]", say=said("Go down"))))
    words = program.words.copy()
    words[program.header(table) + column if table.name.endswith("_AT") else table] = value
    with pytest.raises(InvalidProgramError, match="refused"):
        verify(replace(program, words=words))


def test_lines_have_the_nouns_that_patterns_find_in_them() -> None:
    lines = nouns_of(
        compiled(
            talking(
                rule("statue", "then[0]", say=said("Go down")),
                rule("statue", "then[1]", say=said("Look up")),
            )
        )
    )
    assert lines == {"Statue: Go down": 1, "Statue: Look up": -1}


def test_lines_of_the_agent_have_the_nouns_of_their_pairs() -> None:
    lines = nouns_of(
        compiled(replace(workbench(), own_voice=True, words_in_order=("agent", "go", "look", "up", "down")))
    )
    assert list(lines.values()) == [0, 1, 0, 1]


# --- SaidBy ---


def watching(question: SaidBy, *statues: RulePlan) -> CheckedScenario:
    """A rule of the world notes what the statue says."""
    checked = with_let(talking(*statues, sets=(), hears=()), "let.noticed", number(0), Type("int", 0, 9))
    value = sited(Read(Type("int", 0, 9), "let.noticed"))
    more = replace(value, term=_plus_one(value.term))
    return replace(
        checked,
        rules=(
            RulePlan(
                "watch", "rules[0]", SPAN, when=sited(question), sets=(Assignment("let.noticed", more),)
            ),
        ),
    )


def _plus_one(term: Term) -> Term:
    return Operation(Type("int", 0, 10), "+", (term, number(1)))


GO_DOWN = Pattern(frozenset(((0, 1),)), "Go down", frozenset(("Go down",)))


@pytest.mark.parametrize(("pattern", "text", "times"), [
    (GO_DOWN, "Go down", 1), (GO_DOWN, "Go up", 0), (GO, "Go up", 1), (None, "Go up", 1), (LOOK_UP, "Go up", 0),
])  # fmt: skip
def test_what_an_npc_says_is_noticed_in_the_same_step_only(
    pattern: Pattern | None, text: str, times: int
) -> None:
    env = start(watching(SaidBy(STATUE, pattern), rule("statue", "then[0]", say=said(text), once=True)))
    for _ in range(3):
        step(env)
    assert env.describe()["let"]["noticed"] == times


def test_a_line_with_values_in_it() -> None:
    line = Line(("Go ", Read(NOUN, "let.way")), "say", SPAN)
    talk = rule("statue", "then[0]", say=line)
    way = with_let(watching(SaidBy(STATUE, GO_DOWN), talk), "let.way", Const(NOUN, 1), NOUN)
    env = start(way)
    step(env)
    assert env.describe()["let"]["noticed"] == 1
    env = start(way, {"let": {"way": "up"}})
    step(env)
    assert env.describe()["let"]["noticed"] == 0


def test_who_never_speaks_has_said_nothing() -> None:
    program = compiled(watching(SaidBy(STATUE, None)))
    assert "statue.said" not in [name.path for name in program.registers]
    assert program.header(Header.BEFORE_PC) == 0


def test_what_was_said_is_asked_before_it_is_forgotten() -> None:
    """`prev(statue.said(...))` at the start of a step is about the step before."""
    talk = rule("statue", "then[0]", say=said("Go down"), once=True)
    checked = watching(SaidBy(STATUE, None), talk)
    before = Drawn("prev.0", BOOL, sited(SaidBy(STATUE, GO_DOWN), "prev.0"))
    asked = Compare("==", Read(BOOL, "prev.0"), Const(BOOL, 1))
    checked = replace(checked, remembered=(before,), rules=(replace(checked.rules[0], when=sited(asked)),))
    env = start(checked)
    seen = []
    for _ in range(3):
        step(env)
        seen.append(env.describe()["let"]["noticed"])
    assert seen == [0, 1, 1]
    assert code(compiled(checked), "before")[-2:] == ["LOAD", "HALT"]
    assert "statue.said, #0" in listed(compiled(checked), "before")[-2]


def test_perform_is_heard_as_well() -> None:
    pairs = Type("utterance", 0, 4, ("", "Go up", "Go down", "Look up", "Look down"))
    performing = activity("perform", Const(ACTION, 7), Const(pairs, 2))
    checked = watching(SaidBy(STATUE, GO_DOWN))
    guide, statue = checked.frames
    states = (replace(statue.states[0], activity=performing),)
    env = start(replace(checked, frames=(guide, replace(statue, states=states))))
    for _ in range(3):
        step(env)
    assert env.describe()["let"]["noticed"] == 1
