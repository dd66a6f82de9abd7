"""Finds states, rules and outcomes that no action of the agent brings about."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.advance import compiled
from socialai_dsl.analysis.effort import Effort, OutOfTimeError, keep_time
from socialai_dsl.analysis.rooms import DrawnRooms, random_actions
from socialai_dsl.analysis.search import Search, SearchVerdict
from socialai_dsl.analysis.tally import Part, parts_of
from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.engine.calls import Task
from socialai_dsl.program import Program

_STEPS: Final = 200
"""How long rooms are played with random actions."""


@dataclass
class Coverage:
    """The parts of a scenario that were tried, and those that did not happen.

    Attributes:
        parts: how many states, rules and outcomes there are, as they are written.
        missing: those that nothing brought about. proven: whether every room was searched to its end.
    """

    parts: int
    missing: tuple[Part, ...]
    proven: bool


@dataclass
class _Seen:
    """What has happened so far."""

    program: Program
    counted: set[tuple[str, str]] = field(default_factory=set)
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
        for counter in ("rules", "outcomes"):
            self.counted |= {(counter, name) for name, times in counters[counter].items() if times}


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
    parts, seen = list(parts_of(loaded.checked)), _Seen(program)
    _play_at_random(program, seen, effort)
    if scripted is not None:
        _play_script(compiled(scripted), seen, effort)
    proven = False
    with suppress(OutOfTimeError):
        proven = bool(_missing(parts, seen)) and _search(program, parts, seen, effort)
    missing = _missing(parts, seen)
    return Coverage(len({part.span for part in parts}), tuple(missing), proven)


def _missing(parts: list[Part], seen: _Seen) -> list[Part]:
    """What has not happened; what several members have in common has happened if it did with one of them."""
    happened = {part.span for part in parts if _has_happened(part, seen)}
    missing = {part.span: part for part in reversed(parts) if part.span not in happened}
    return sorted(missing.values(), key=lambda part: (part.span.file, part.span.line, part.span.column))


def _has_happened(part: Part, seen: _Seen) -> bool:
    if part.number is None:
        return ("outcomes" if part.kind == "outcome" else "rules", part.address) in seen.counted
    states = seen.states.get(part.frame, set())
    # Entries of `steps` follow each other, and one that ends in the turn in which it begins is not seen in between.
    return max(states, default=-1) >= part.number if part.kind == "step" else part.number in states


def _play_at_random(program: Program, seen: _Seen, effort: Effort) -> None:
    table = DrawnRooms.numbered(program, effort.rooms, effort.seed).table
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
    drawn = DrawnRooms.numbered(program, effort.rooms, effort.seed)
    watching = _Seen(program, seen.counted, seen.states)
    while not drawn.ended.all():
        drawn.do(drawn.table.scripted_actions())
        watching.watch(drawn.table.state.registers)
    watching.count(drawn.table.counters())


def _search(program: Program, parts: list[Part], seen: _Seen, effort: Effort) -> bool:
    """Go through all that can be done in room after room; whether nothing was left out."""
    drawn = DrawnRooms.numbered(program, effort.rooms, effort.seed)
    search = Search(program, (), seen.watch)

    def find(room: int) -> bool:
        finding = search.solve(*drawn.start(room), effort.states, effort.clock)
        seen.count(search.counters())
        return finding.verdict is SearchVerdict.UNSOLVABLE and finding.exact

    ends = []
    for ended in effort.each_room("whether everything can happen", find, bool):
        ends.append(ended)
        if not _missing(parts, seen):
            break
    return len(ends) == effort.rooms and all(ends)
