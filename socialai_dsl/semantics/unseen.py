"""Gestures and looks that `observe.channels` leaves out of the picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from socialai_dsl import cures
from socialai_dsl.grammar import ast
from socialai_dsl.semantics.plans import Activity, CheckedScenario, FramePlan, LookPlan
from socialai_dsl.semantics.scope import Findings
from socialai_dsl.semantics.terms import FieldOf, Read, SitedTerm, Term, walk
from socialai_dsl.semantics.words import ACTIVITIES
from socialai_dsl.source import Span

_CHANNELS: Final = ("observe", "channels")

_GESTURES: Final = 4
"""With more channels than these of the four plain ones the picture shows who points where."""

Reads = Callable[[Term], bool]
"""Whether a term asks about a gesture or a look."""


def check_unseen(checked: CheckedScenario, tone: str | None, findings: Findings) -> None:
    """Report W321 where the agent's own frame asks for something that the picture leaves out, or nobody asks for it.

    Args:
        checked: the scenario.
        tone: the look that is heard, if there is one.
        findings: takes what is found.
    """
    if checked.npcs_hidden:
        return
    own = tuple(frame for frame in checked.frames if frame.entity == 0)
    for asks, what, shown_at, hint in _left_out(checked, tone, findings):
        relied_on = _relied_on(own, asks, what, hint, findings)
        if shown_at is not None and not relied_on and not _asked_elsewhere(checked, asks):
            message = f"nobody sees {what}: `channels` leaves it out, and no condition reads it"
            findings.warning("W321", message, shown_at, hint=hint)


def _left_out(
    checked: CheckedScenario, tone: str | None, findings: Findings
) -> Iterator[tuple[Reads, str, Span | None, cures.Hint]]:
    """What asks for each thing that is left out, the thing in words, where it is shown first if it is, and the cure."""
    pointing = next(_pointing(checked), None)
    if checked.channels <= _GESTURES:
        member, span = pointing or ("somebody", None)
        hint = "let the picture show it: `observe: {channels: [type, color, status, orientation, pointing, last_act]}`"
        yield _asks_who_points, f"where {member} points", span, hint
    for look in checked.looks:
        if not look.shown and look.name != tone:
            span = findings.places.key_span(("looks", look.name))
            yield (
                _asks_for(look),
                f"the look `{look.name}`",
                span,
                cures.add(look.name, cures.added(findings.places, _CHANNELS, look.name), "`channels`"),
            )


def _relied_on(
    frames: tuple[FramePlan, ...], asks: Reads, what: str, hint: cures.Hint, findings: Findings
) -> bool:
    """Whether the agent's frame goes by it, which is reported where it does so first."""
    for frame in frames:
        for part in ast.walk(frame):
            if isinstance(part, SitedTerm | Activity) and any(map(asks, walk(part))):
                message = (
                    f"`{frame.frame}` goes by {what}, which the agent does not see: `channels` leaves it out"
                )
                findings.warning("W321", message, part.span, hint=hint)
                return True
    return False


def _asked_elsewhere(checked: CheckedScenario, asks: Reads) -> bool:
    """Whether anything but the agent's own frame asks for it."""
    others = tuple(frame for frame in checked.frames if frame.entity != 0)
    parts = (others, checked.rules, checked.outcomes, checked.setup, checked.memories, checked.remembered)
    return any(any(map(asks, walk(part))) for part in (*parts, checked.require, checked.probes))


def _pointing(checked: CheckedScenario) -> Iterator[tuple[str, Span]]:
    """Members that point, and where that is written."""
    for frame in checked.frames:
        yield from (
            (f"`{frame.member}`", one.span)
            for one in frame.activities
            if ACTIVITIES[one.name].arm == "points"
        )


def _asks_who_points(term: Term) -> bool:
    return isinstance(term, FieldOf) and term.name == "pointing"


def _asks_for(look: LookPlan) -> Reads:
    paths = {path for _, path in look.registers}
    return lambda term: isinstance(term, Read) and term.path in paths
