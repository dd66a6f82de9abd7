"""A trace as text: about 100 columns, the picture beside the action, then the rules."""

import textwrap
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import Any, Final

from socialai_dsl.diagnostics import printable
from socialai_dsl.evaluation.episode_trace import Trace, TraceStep, is_among
from socialai_dsl.replay.state import found, present
from socialai_dsl.vocabulary import spelt

_WIDTH: Final = 100
_GAP: Final = "    "
_BOLD, _DIM, _GREEN, _RESET = "\x1b[1m", "\x1b[2m", "\x1b[32m", "\x1b[0m"
_QUIET: Final = ("facing", "at", "clock", "poked", "last")
"""Ends of addresses that the picture or the list of those present shows already, or that only count."""


class Text:
    """Writes lines.

    Args:
        names: the members whose rules are shown, with every reason; none: all, with what an author asks for most.
        color: whether the output is a terminal.
    """

    def __init__(self, names: Sequence[str], color: bool) -> None:
        self._names, self._color = names, color
        self._cast: tuple[str, ...] = ()
        self._told: dict[tuple[str, str], str] = {}

    def head(self, trace: Trace) -> list[str]:
        """The scenario, and the room before the first step."""
        self._cast = trace.cast
        member = f": {trace.member}" if trace.member is not None else ""
        title = printable(f"{trace.scenario}, {trace.origin}, agent {trace.agent}{member}")
        return [
            *(self._paint(title, _BOLD), ""),
            *_beside(trace.picture, present(self._cast, trace.state)),
            "",
        ]

    def step(self, step: TraceStep) -> list[str]:
        """One step."""
        self._cast = step.cast
        said = f', says "{step.said}"' if step.said is not None else ""
        facts = [f"agent   {step.action}{said}", *(f"heard   {line}" for line in step.heard)]
        facts += [
            f"changed {address}: {spelt(old)} -> {spelt(new)}"
            for address, (old, new) in step.changed.items()
            if address.rpartition(".")[2] not in _QUIET
        ]
        if step.reward:
            facts.append(f"reward  {step.reward:.3f}")
        facts += ["", *present(self._cast, step.state)]
        title = f"-- step {step.t} "
        lines = [self._paint(title + "-" * (_WIDTH - len(title)), _BOLD), *_beside(step.picture, facts), ""]
        return [*lines, *self._fired(step), *self._others(step), *self._idle(step), ""]

    def end(self, trace: Trace) -> list[str]:
        """How it ended, or that it has not."""
        if trace.outcome is None:
            return [f"not ended after {trace.length} steps, reward {trace.reward:.3f}"]
        verdict = "success" if trace.success else "no success"
        outcome = printable(trace.outcome)
        return [f"{verdict} ({outcome}) after {trace.length} steps, reward {trace.reward:.3f}"]

    def _fired(self, step: TraceStep) -> Iterator[str]:
        for rule in step.fired:
            if not self._names or is_among(rule["who"], self._names):
                yield from self._rule("fired  ", rule, _GREEN)

    def _others(self, step: TraceStep) -> Iterator[str]:
        for rule in step.others:
            if not self._is_asked_for(rule):
                continue
            key = rule["who"], rule["at"]
            again = self._told.get(key) == rule["why"]
            self._told[key] = rule["why"]
            if again and not self._names:
                yield self._paint(f"not    {self._place(rule)}  as before", _DIM)
                continue
            yield from self._rule("not    ", rule, "")
            yield from _folded(f"-> {rule['why']}", " " * 9)

    def _idle(self, step: TraceStep) -> Iterator[str]:
        """Whoever was named and had no rule to be asked, as in a state without rules."""
        for name in self._names:
            if not any(is_among(rule["who"], [name]) for rule in (*step.fired, *step.others)):
                known = found(step.state, name) or {}
                state = f" in {known['state']}" if "state" in known else ""
                yield printable(f"none   {name}{state}: no rule was asked")

    def _is_asked_for(self, rule: dict[str, Any]) -> bool:
        """Without names: what those in the room did not do, as far as it was asked."""
        if self._names:
            return is_among(rule["who"], self._names)
        return rule["who"] not in ("agent", "outcome") and "part" in rule

    def _rule(self, mark: str, rule: dict[str, Any], style: str) -> Iterator[str]:
        yield self._paint(f"{mark}{self._place(rule)}", style)
        yield from _folded(rule["words"], " " * 9)

    def _place(self, rule: dict[str, Any]) -> str:
        state = f" in {rule['state']}" if "state" in rule else ""
        return printable(f"{rule['who']}{state}  {rule['at']}")

    def _paint(self, text: str, style: str) -> str:
        return f"{style}{text}{_RESET}" if self._color and style else text


def _beside(picture: str, facts: list[str]) -> list[str]:
    """Picture and facts side by side."""
    rows = picture.split("\n")
    width = max(map(len, rows))
    room = max(30, _WIDTH - width - len(_GAP))
    told = [line for fact in facts for line in _folded(fact, "") or [""]]
    told = [part for line in told for part in (textwrap.wrap(line, room, subsequent_indent=" " * 8) or [""])]
    return [f"{row:<{width}}{_GAP}{fact}".rstrip() for row, fact in zip_longest(rows, told, fillvalue="")]


def _folded(text: str, indent: str) -> list[str]:
    return textwrap.wrap(printable(text), _WIDTH, initial_indent=indent, subsequent_indent=indent + "  ")
