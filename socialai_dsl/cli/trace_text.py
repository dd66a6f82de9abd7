"""A trace as text: about 100 columns, the picture beside the action, then the rules."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.diagnostics import printable
from socialai_dsl.envs.seats import SeatMoment
from socialai_dsl.episodes.play import AGENT, Observer, Rooms, Seat, Step
from socialai_dsl.episodes.traces import TracedEpisode
from socialai_dsl.program_suite import outcome_name
from socialai_dsl.traces.state import cast_of, changes, found, present
from socialai_dsl.traces.steps import describe_step
from socialai_dsl.vocabulary import spelt

_WIDTH: Final = 100
_GAP: Final = "    "
_BOLD, _DIM, _GREEN, _RESET = "\x1b[1m", "\x1b[2m", "\x1b[32m", "\x1b[0m"
_QUIET: Final = ("facing", "at", "clock", "poked", "last")
"""Ends of addresses that the picture or the list of those present shows already, or that only count."""


class Steps(Observer):
    """Counts the steps of an episode.

    Attributes:
        t: how many were played.
    """

    t = 0

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        self.t += 1


@dataclass(frozen=True)
class _StepFacts:
    """What is printed of a step: the state after it, and the rules, as `explain` gives them."""

    state: dict[str, Any]
    fired: list[dict[str, Any]]
    others: list[dict[str, Any]]


class Text(Steps):
    """Prints an episode while it is played.

    Args:
        played: the episode.
        names: the members whose rules are shown, with every reason; none: all, with what an author asks for most.
        color: whether the output is a terminal.
        first: the first step that is shown.
    """

    def __init__(self, played: TracedEpisode, names: Sequence[str], color: bool, first: int = 1) -> None:
        self._played, self._names, self._color, self._first = played, names, color, first
        self._told: dict[tuple[str, str], str] = {}
        self._state: dict[str, Any] = {}
        self._rewards: dict[Seat, float] = {}
        self._ends: dict[Seat, str] = {}

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """Print the scenario, and the room before the first step."""
        env, self._state = rooms.env, rooms.env.describe()
        member = f": {rooms.info['member']}" if "member" in rooms.info else ""
        played = self._played
        sitting = "".join(f", {seat} {player}" for seat, player in played.players.items())
        title = printable(
            f"{played.scenario}, {played.origin()}, {rooms.own} {played.agent}{sitting}{member}"
        )
        seen = _beside(env.plain_text(), present(cast_of(env.playing), self._state))
        print("\n".join([self._paint(title, _BOLD), "", *seen, ""]), flush=True)

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """Print a step."""
        super().stepped(rooms, step)
        self._moments = _moments(rooms, step)
        for seat, moment in self._moments.items():
            self._rewards[seat] = self._rewards.get(seat, 0.0) + moment.reward
            if step.ended[0]:
                verdict = "success" if moment.success else "no success"
                self._ends[seat] = f"{verdict} ({printable(outcome_name(step.info))})"
        before, self._state = self._state, rooms.env.describe()
        if self.t >= self._first:
            print("\n".join(self._lines(rooms.env, step, before)), flush=True)

    def end(self) -> list[str]:
        """How it ended for each seat, or that it has not."""
        several = len(self._rewards) > 1
        return [
            f"{f'{seat:<7} ' if several else ''}{self._ends.get(seat, 'not ended')} after {self.t} steps, "
            f"reward {reward:.3f}"
            for seat, reward in (self._rewards or {AGENT: 0.0}).items()
        ]

    def _lines(self, env: Any, step: Step, before: dict[str, Any]) -> list[str]:
        explained, after = env.explain(), self._state
        facts = [line for seat, moment in self._moments.items() for line in _done(env, seat, moment)]
        facts += [
            f"changed {address}: {spelt(old)} -> {spelt(new)}"
            for address, (old, new) in changes(before, after).items()
            if address.rpartition(".")[2] not in _QUIET
        ]
        several = len(self._moments) > 1
        facts += [
            f"reward  {f'{seat} ' if several else ''}{moment.reward:.3f}"
            for seat, moment in self._moments.items()
            if moment.reward
        ]
        facts += ["", *present(cast_of(env.playing), after)]
        title = f"-- step {self.t} "
        lines = [
            self._paint(title + "-" * (_WIDTH - len(title)), _BOLD),
            *_beside(env.plain_text(), facts),
            "",
        ]
        told = _StepFacts(after, explained["fired"], explained["others"])
        return [*lines, *self._fired(told), *self._others(told), *self._idle(told), ""]

    def _fired(self, step: _StepFacts) -> Iterator[str]:
        for rule in step.fired:
            if not self._names or _is_among(rule["who"], self._names):
                yield from self._rule("fired  ", rule, _GREEN)

    def _others(self, step: _StepFacts) -> Iterator[str]:
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

    def _idle(self, step: _StepFacts) -> Iterator[str]:
        """Whoever was named and had no rule to be asked, as in a state without rules."""
        for name in self._names:
            if not any(_is_among(rule["who"], [name]) for rule in (*step.fired, *step.others)):
                known = found(step.state, name) or {}
                state = f" in {known['state']}" if "state" in known else ""
                yield printable(f"none   {name}{state}: no rule was asked")

    def _is_asked_for(self, rule: dict[str, Any]) -> bool:
        """Without names: what those in the room did not do, as far as it was asked."""
        if self._names:
            return _is_among(rule["who"], self._names)
        return rule["who"] not in ("agent", "outcome") and "part" in rule

    def _rule(self, mark: str, rule: dict[str, Any], style: str) -> Iterator[str]:
        yield self._paint(f"{mark}{self._place(rule)}", style)
        yield from _folded(rule["words"], " " * 9)

    def _place(self, rule: dict[str, Any]) -> str:
        state = f" in {rule['state']}" if "state" in rule else ""
        return printable(f"{rule['who']}{state}  {rule['at']}")

    def _paint(self, text: str, style: str) -> str:
        return f"{style}{text}{_RESET}" if self._color and style else text


def _moments(rooms: Rooms, step: Step) -> dict[Seat, SeatMoment]:
    """What each seat did and got in a step."""
    env = rooms.env
    if len(env.seats) > 1:
        return {seat: env.seat_moment(seat) for seat in env.seats}
    done = env.describe().get("last", {"action": "none"})  # gone where another act has begun
    action, success = step.actions[rooms.own][0], bool(step.success[0])
    return {
        rooms.own: SeatMoment({}, dict(step.info), action, done["action"], float(step.reward[0]), success)
    }


def _done(env: Any, seat: Seat, moment: SeatMoment) -> Iterator[str]:
    """What a seat did, said and heard."""
    nothing = np.zeros(len(env.action_space.nvec), np.int64)
    action = nothing if moment.action is None else moment.action
    words = describe_step(env.program, action, 0, moment.info["utterance"])
    said = "" if words.said is None else f', says "{words.said}"'
    yield f"{seat:<7} {moment.did}{said}"
    yield from (f"heard   {line}" for line in words.heard)


def _is_among(who: str, names: Sequence[str]) -> bool:
    """Whether a member is named, or its group is."""
    return who in names or who.partition("[")[0] in names


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
