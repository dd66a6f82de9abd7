"""Finds states, rules and outcomes that no action of the agent brings about."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.advance import advance, begin, compiled
from socialai_dsl.analysis.effort import Effort, OutOfTimeError, keep_time
from socialai_dsl.analysis.search import Search, SearchVerdict
from socialai_dsl.analysis.twins import random_actions
from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.engine.calls import Task
from socialai_dsl.envs.table import Table
from socialai_dsl.program import Program, Register
from socialai_dsl.semantics.plans import FOR_EVER, CheckedScenario
from socialai_dsl.source import Span

_STEPS: Final = 200
"""How long rooms are played with random actions."""


@dataclass(frozen=True)
class CoverageItem:
    """A state, a rule or an outcome.

    Attributes:
        kind: which of them. name: its address, such as `wizard.courtesy.stranger`. span: where it is written.
    """

    kind: str
    name: str
    span: Span


@dataclass
class Coverage:
    """The parts of a scenario that were tried, and those that did not happen.

    Attributes:
        parts: how many states, rules and outcomes there are, as they are written.
        missing: those that nothing brought about. proven: whether every room was searched to its end.
    """

    parts: int
    missing: tuple[CoverageItem, ...]
    proven: bool


@dataclass
class _Seen:
    """What has happened so far."""

    program: Program
    names: set[str] = field(default_factory=set)
    states: dict[str, set[int]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._frames = {
            name.path: name.register for name in self.program.registers if name.path.endswith(".frame")
        }

    def watch(self, registers: NDArray[np.int32]) -> None:
        """Note which states frames are in, in registers of rows, int32 (S, R)."""
        for path, register in self._frames.items():
            self.states.setdefault(path, set()).update(np.unique(registers[:, register]).tolist())

    def count(self, counters: dict[str, Any]) -> None:
        """Note which rules fired and how episodes ended."""
        for kind in ("rules", "outcomes"):
            self.names |= {f"{kind} {name}" for name, times in counters[kind].items() if times}


def coverage(loaded: LoadedScenario, effort: Effort, scripted: LoadedScenario | None = None) -> Coverage:
    """Play at random, let the script play, then search rooms for what has not happened yet.

    Args:
        loaded: the scenario.
        effort: how much to try.
        scripted: the same scenario with a frame for the agent, if there is one.

    Raises:
        OutOfTimeError: there was no time to play, so that nothing is known.
    """
    with effort.clock.limiting():
        return _coverage(loaded, effort, scripted)


def _coverage(loaded: LoadedScenario, effort: Effort, scripted: LoadedScenario | None) -> Coverage:
    program = compiled(loaded)
    parts, seen = list(_parts(loaded.checked)), _Seen(program)
    _play_at_random(program, seen, effort)
    if scripted is not None:
        _play_script(compiled(scripted), seen, effort)
    proven = False
    with suppress(OutOfTimeError):
        proven = bool(_missing(parts, seen)) and _search(program, parts, seen, effort)
    missing = _missing(parts, seen)
    return Coverage(len({part.span for _, part in parts}), tuple(missing), proven)


_Key = tuple[str, int] | str
"""What tells that a part has happened: a register of a frame with the number of the state, or a counter."""


def _parts(checked: CheckedScenario) -> Iterator[tuple[_Key, CoverageItem]]:
    for frame in checked.frames:
        for number, step in enumerate(frame.steps):
            if step.duration == 0:  # it is left out
                continue
            in_a_row = frame.in_a_row or step.duration == FOR_EVER
            key: _Key = (f"{frame.member}.frame", number) if in_a_row else f"rules {step.name}"
            yield key, CoverageItem("step", step.name, step.span)
        for number, state in enumerate(frame.states):
            name = f"{frame.member}.{frame.frame}.{state.name}"
            yield (f"{frame.member}.frame", number), CoverageItem("state", name, state.span)
    for rule in (*(rule for frame in checked.frames for rule in frame.rules), *checked.rules):
        yield f"rules {rule.name}", CoverageItem("rule", rule.name, rule.span)
    for outcome in checked.outcomes:
        yield f"outcomes {outcome.name}", CoverageItem("outcome", outcome.name, outcome.condition.span)


def _missing(parts: list[tuple[_Key, CoverageItem]], seen: _Seen) -> list[CoverageItem]:
    """What has not happened; what several members have in common has happened if it did with one of them."""
    happened = {part.span for key, part in parts if _has_happened(key, part, seen)}
    missing = {part.span: part for _, part in reversed(parts) if part.span not in happened}
    return sorted(missing.values(), key=lambda part: (part.span.file, part.span.line, part.span.column))


def _has_happened(key: _Key, part: CoverageItem, seen: _Seen) -> bool:
    if isinstance(key, str):
        return key in seen.names
    states = seen.states.get(key[0], set())
    # Entries of `steps` follow each other, and one that ends in the turn in which it begins is not seen in between.
    return max(states, default=-1) >= key[1] if part.kind == "step" else key[1] in states


def _play_at_random(program: Program, seen: _Seen, effort: Effort) -> None:
    table = Table([program], effort.rooms)
    begin(table, effort.seed, None)
    seen.watch(table.state.registers)
    choose = random_actions(program, effort.rooms, effort.seed)
    for step in range(_STEPS):
        keep_time()
        table.batch.ports.actions[:] = choose(step)
        table.batch.step(Task.STEP_NEXT)
        seen.watch(table.state.registers)
    seen.count(table.counters())


def _play_script(program: Program, seen: _Seen, effort: Effort) -> None:
    """Members and their states have the same names and numbers with a frame for the agent."""
    table, watching = Table([program], effort.rooms), _Seen(program, seen.names, seen.states)
    begin(table, effort.seed, None)
    while not table.state.registers[:, Register.ENDED].all():
        table.batch.ports.actions[:] = table.scripted_actions()
        advance(table)
        watching.watch(table.state.registers)
    watching.count(table.counters())


def _search(program: Program, parts: list[tuple[_Key, CoverageItem]], seen: _Seen, effort: Effort) -> bool:
    """Go through all that can be done in room after room; whether nothing was left out."""
    table = Table([program], effort.rooms)
    begin(table, effort.seed, None)
    search = Search(program, (), seen.watch)

    def find(row: int) -> bool:
        finding = search.solve(*table.start(row), effort.states, effort.clock)
        seen.count(search.counters())
        return finding.verdict is SearchVerdict.UNSOLVABLE and finding.exact

    ends = []
    for ended in effort.each_room("whether everything can happen", find, bool):
        ends.append(ended)
        if not _missing(parts, seen):
            break
    return len(ends) == effort.rooms and all(ends)
