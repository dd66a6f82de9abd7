"""What is found of a text: its mistakes, its claims, its tests. None of it needs a game."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.checking.loaded import LoadedSuite
from socialai_dsl.diagnostics import Diagnostic, ScenarioError, Severity, printable
from socialai_dsl.errors import UsageError
from socialai_dsl.frontend import load
from socialai_dsl.loader.reader import display_name
from socialai_dsl.loader.resolved import taken_apart
from socialai_dsl.semantics.plans import PropertyPlan
from socialai_dsl.source import Source, Span
from socialai_dsl.studio.messages import RefusalError

if TYPE_CHECKING:
    from socialai_dsl.analysis.reports import Report
    from socialai_dsl.evaluation.scenario_tests import PlayedTest

Reply = dict[str, Any]

_CHECK_SECONDS: Final = 20.0


def judge_claims(path: str, text: str) -> Reply:
    """What `socialai check` finds of a text, or the mistakes in it, in its script or its rivals."""
    own = display_name(Path(path))
    try:
        return _claims(path, texts_of(path, text), own)
    except ScenarioError as error:
        return {"claims": [], "findings": [finding(one, own) for one in error.diagnostics], "lines": []}


def _claims(path: str, texts: Mapping[Path, Source], own: str) -> Reply:
    from socialai_dsl.analysis.check import check_scenario, compile_engine, scenarios_of
    from socialai_dsl.analysis.effort import Clock, Effort

    loaded, cases = load(path, texts), scenarios_of(path, texts)
    compile_engine()  # before the time begins
    clock, is_suite = Clock(_CHECK_SECONDS, lambda said: None), isinstance(loaded, LoadedSuite)
    reply: Reply = {"claims": [], "findings": [], "lines": []}
    for number, (member, called, script, named) in enumerate(cases):
        effort = Effort(100, 0, clock=clock.part(len(cases) - number))
        report = check_scenario(member, called, effort, texts=texts, script=script, named=named)
        if not is_suite:
            report.scenario = own
        of = f"{called}: " if is_suite else ""
        claims = (_claim(plan, found, report.seed, own) for plan, found in report.tried)
        # The window plays a suite, which draws what it plays: none of its rooms is that of a member.
        reply["claims"] += [
            {**one, "claim": of + one["claim"], "shown": None} if of else one for one in claims
        ]
        reply["findings"] += [finding(one, own) for one in report.parts()]
        reply["lines"] += report.summary()
    return reply


def judge_tests(path: str, text: str) -> Reply:
    """What `socialai test` finds of a text."""
    from socialai_dsl.evaluation.scenario_tests import play_tests

    own = display_name(Path(path))
    try:
        played = play_tests([path], texts=texts_of(path, text))
    except ScenarioError as error:
        return {"tests": [], "findings": [finding(one, own) for one in error.diagnostics]}
    except UsageError:
        raise RefusalError("there are no tests yet; play, and make one of what was played") from None
    return {"tests": [_test(one, own) for one in played], "findings": []}


JUDGED: Final[Mapping[str, Callable[..., Reply]]] = {"check": judge_claims, "test": judge_tests}
"""What a window may ask about a text, by name."""


def texts_of(path: str | Path, text: str) -> dict[Path, Source]:
    """The text of a file in place of what it holds."""
    return {Path(path): Source(display_name(Path(path)), text)}


def _place(span: Span, own: str) -> Reply:
    return {"file": None if span.file == own else span.file, "line": span.line, "column": span.column}


def _claim(plan: PropertyPlan, found: Report, seed: int, own: str) -> Reply:
    """A claim, with the first room that speaks against it; what is done there, or who plays there."""
    from socialai_dsl.analysis.scenario_report import lines_apart

    shown = None
    if found.against and found.verdict.value != "holds":
        variant = f"+{plan.rival}" if plan.rival else ""
        acts = list(found.acts) or None
        shown = {"room": {"seed": seed, "index": found.against[0]}, "variant": variant, "acts": acts}
    said = "; ".join([found.said, *lines_apart(plan, found)])
    verdict = {"claim": plan.text, "verdict": found.verdict.value, "said": said, "shown": shown}
    return {**_place(plan.span, own), **verdict}


def _test(played: PlayedTest, own: str) -> Reply:
    """A test, with the room and the acts after which something is wrong."""
    result, performed = played.as_object(), played.performed
    shown = None
    if played.fails and performed.reset:
        room = {"seed": performed.reset.get("seed", 0), **(performed.reset["options"] or {})}
        variant = taken_apart(played.called)[1]
        shown = {"room": room, "variant": variant, "acts": list(performed.done)}
    return {
        **_place(played.plan.span, own),
        **{key: result[key] for key in ("test", "scenario", "rooms", "passes")},
        "findings": [finding(one, own) for one in played.outcome.diagnostics],
        "shown": shown,
    }


def finding(found: Diagnostic, own: str) -> Reply:
    """A finding as `messages.Finding` has it; `own` is how the text's file is called."""
    return {
        **_place(found.span, own),
        "message": found.text,
        "help": found.help,
        "notes": [printable(note) for note in found.notes],
        "code": found.code,
        "error": found.severity is Severity.ERROR,
    }
