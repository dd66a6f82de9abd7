"""Counts of rules, states and outcomes over played episodes.

The engine counts rules and outcomes anyway. How often a state was entered follows from the rules that lead to it; which
entries of `steps` a frame has gone through, from its register before and after each step. Training pays for none of it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine.state import Key
from socialai_dsl.envs.vector_env import ScenarioVectorEnv
from socialai_dsl.program import FrameColumn, Header, Program
from socialai_dsl.semantics.plans import FOR_EVER, CheckedScenario, FramePlan, RulePlan
from socialai_dsl.source import Span


@dataclass(frozen=True, order=True)
class Part:
    """A rule, state, step or outcome by where it is written; members that share a frame share its parts.

    Attributes:
        span: where it is written. kind: which of them it is.
        name: in its frame: `courtesy.stranger`.
        address: with the member in front: `wizard.courtesy.stranger`.
        frame: path of the register with the state of the member's frame; empty without one.
        number: of a state or step in that register; None for what the engine counts.
    """

    span: Span
    kind: str
    name: str
    address: str = field(default="", compare=False)
    frame: str = field(default="", compare=False)
    number: int | None = field(default=None, compare=False)


@dataclass
class Tally:
    """How often what came about.

    Attributes:
        times: how often each rule fired, each state and step was entered, and each outcome ended an episode.
        endings: the same for every way to end, by name, deadly cells and time included.
        episodes: how many were played to their end.
    """

    times: Counter[Part]
    endings: Counter[str]
    episodes: int


def parts_of(checked: CheckedScenario) -> Iterator[Part]:
    """Everything in a scenario that can occur."""
    for frame in checked.frames:
        for number, step in enumerate(frame.steps):
            if step.duration != 0:  # else it is left out
                yield _step(frame, number)
        for number, state in enumerate(frame.states):
            yield _state(frame, number)
            yield from (_rule(frame, rule) for rule in state.rules)
    yield from _of_the_world(checked)


def _of_the_world(checked: CheckedScenario) -> Iterator[Part]:
    yield from (Part(rule.span, "rule", rule.name, rule.name) for rule in checked.rules)
    for outcome in checked.outcomes:
        yield Part(outcome.condition.span, "outcome", outcome.name, outcome.name)


def _step(frame: FramePlan, number: int) -> Part:
    step = frame.steps[number]
    name = f"{frame.frame}.{step.state or f'steps[{number}]'}"
    seen = number if frame.in_a_row or step.duration == FOR_EVER else None
    return Part(step.span, "step", name, step.name, f"{frame.member}.frame", seen)


def _state(frame: FramePlan, number: int) -> Part:
    state = frame.states[number]
    name = f"{frame.frame}.{state.name}"
    return Part(state.span, "state", name, f"{frame.member}.{name}", f"{frame.member}.frame", number)


def _rule(frame: FramePlan, rule: RulePlan) -> Part:
    return Part(rule.span, "rule", rule.name.removeprefix(f"{frame.member}."), rule.name)


class Watch:
    """Looks at the frames of environments while they are played, and at the engine's counters in the end.

    Args:
        envs: environments that nobody has played yet.
        scenarios: what their programs were compiled from.
    """

    def __init__(self, envs: ScenarioVectorEnv, scenarios: Sequence[CheckedScenario]) -> None:
        self._table = envs._table
        self._programs = [
            _Frames(program, checked) for program, checked in zip(envs.programs, scenarios, strict=True)
        ]
        self._registers = self._table.state.registers.copy()
        self._keys = self._table.state.keys.copy()

    def began(self, rows: NDArray[np.bool_]) -> None:
        """Episodes have begun in these rows, bool (E,)."""
        self._entered(rows)
        self._remember()

    def stepped(self, rows: NDArray[np.bool_]) -> None:
        """A step has been taken in these rows, bool (E,)."""
        state, played = self._table.state, self._table.batch.program_numbers()
        turned = rows & (state.keys[:, Key.ACT] != self._keys[:, Key.ACT])
        if turned.any():
            self._entered(turned)
        for number, frames in enumerate(self._programs):
            own = rows & ~turned & (played == number)
            frames.moved(self._registers[own], state.registers[own])
        self._remember()

    def _entered(self, rows: NDArray[np.bool_]) -> None:
        registers, played = self._table.state.registers, self._table.batch.program_numbers()
        for number, frames in enumerate(self._programs):
            frames.entered(registers[rows & (played == number)])

    def _remember(self) -> None:
        """Keep the state, to compare that after the next step with."""
        self._registers[:] = self._table.state.registers
        self._keys[:] = self._table.state.keys

    def tally(self, episodes: int) -> Tally:
        """The counts so far; `episodes` of them are over."""
        times: Counter[Part] = Counter()
        endings: Counter[str] = Counter()
        counters = self._table.batch.counters
        for frames, first in zip(self._programs, self._table.batch.first_counters, strict=True):
            own = counters[first : first + frames.program.header(Header.COUNTERS)].tolist()
            times.update(frames.times(own))
            names = frames.program.outcomes
            endings.update(dict(zip(names, own[len(frames.program.rules) :], strict=False)))
        return Tally(times, +endings, episodes)


class _Frames:
    """The frames of one program: which states they are in, and how often each was entered."""

    def __init__(self, program: Program, checked: CheckedScenario) -> None:
        self.program, self.checked = program, checked
        table = program.table(Header.FRAME_AT)
        self._states = table[:, FrameColumn.STATE]
        self._entered = [np.zeros(count, np.int64) for count in table[:, FrameColumn.STATES].tolist()]

    def entered(self, registers: NDArray[np.int32]) -> None:
        """Count the states that frames are in, in registers of rows, int32 (S, R)."""
        for register, entered in zip(self._states, self._entered, strict=True):
            entered += np.bincount(registers[:, register], minlength=len(entered))

    def moved(self, before: NDArray[np.int32], after: NDArray[np.int32]) -> None:
        """Count the entries of `steps` that frames have gone to.

        In one turn a frame may leave several behind: those that are fulfilled already, and one that ends at once.
        """
        frames = zip(self.checked.frames, self._states, self._entered, strict=True)
        for frame, register, entered in frames:
            if not frame.steps:
                continue
            old, new = before[:, register].astype(np.int64), after[:, register].astype(np.int64)
            first = np.where(new > old, old + 1, new)
            for k in range(len(entered)):
                entered[k] += np.count_nonzero((old != new) & (first <= k) & (k <= new))

    def times(self, counters: list[int]) -> Counter[Part]:
        """How often each part came about, by the engine's counters."""
        times: Counter[Part] = Counter()
        numbers = count()
        for frame, entered in zip(self.checked.frames, self._entered, strict=True):
            for number in range(len(frame.steps)):
                ended = counters[next(numbers)]
                times[_step(frame, number)] += int(entered[number]) if frame.in_a_row else ended
            places = {state.name: _state(frame, number) for number, state in enumerate(frame.states)}
            for number, place in enumerate(places.values()):
                times[place] += int(entered[number])
            for state in frame.states:
                for rule in state.rules:
                    fired = counters[next(numbers)]
                    times[_rule(frame, rule)] += fired
                    if aim := rule.goto or rule.goto_now:
                        times[places[aim]] += fired
        for part, fired in zip(_of_the_world(self.checked), counters[next(numbers) :], strict=False):
            times[part] += fired
        return times
