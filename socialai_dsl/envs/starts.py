"""The layouts from which members of a suite start, and the check that they fit."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import LoadedSuite
from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag
from socialai_dsl.envs.layout import pins_of
from socialai_dsl.program import Program
from socialai_dsl.program_suite import Playable, ProgramSuite
from socialai_dsl.source import Node
from socialai_dsl.widths import REGISTER, UNPINNED

_STEP = re.compile(r"[^.\[\]]+")


class Starts:
    """The pins at the reset of each program.

    Attributes:
        rows: row of `pins` for each program, int32 (programs,); 0 pins nothing.
        pins: int32 (1 + programs with a layout, R + 1), as the engine takes them.
    """

    def __init__(self, playables: Sequence[Playable], programs: Sequence[Program], registers: int) -> None:
        """Look the layouts of all suites up. Raises ValueError for one that does not fit its program."""
        layouts = [layout for playable in playables for layout in _layouts(playable)]
        self.rows = np.zeros(len(programs), np.int32)
        table = [np.full(registers + 1, UNPINNED, REGISTER)]
        for number, (program, layout) in enumerate(zip(programs, layouts, strict=True)):
            if layout is None:
                continue
            pinned = pins_of(program, layout)
            row = np.full(registers + 1, UNPINNED, REGISTER)
            row[: len(pinned)] = pinned
            self.rows[number] = len(table)
            table.append(row)
        self.pins: NDArray[np.int32] = np.stack(table)

    def __bool__(self) -> bool:
        """Whether any program has a layout."""
        return len(self.pins) > 1


def _layouts(playable: Playable) -> Sequence[Mapping[str, Any] | None]:
    if isinstance(playable, ProgramSuite):
        return playable.starts or [None] * len(playable.programs)
    return [None]


def check_starts(loaded: LoadedSuite, suite: ProgramSuite) -> None:
    """Whether the layouts in a suite's file fit.

    Raises:
        ScenarioError: S204 for each that does not, at what is wrong with it.
    """
    found = DiagnosticBag()
    seen = set()
    for start, program in zip(loaded.starts, suite.programs, strict=True):
        if start is None:
            continue
        try:
            pins_of(program, start.layout)
        except ValueError as error:
            misfit = misfit_of(error, start.layout, loaded.resolved.tree.at(start.place))
            if misfit.span not in seen:
                seen.add(misfit.span)
                found.add(misfit)
    found.raise_errors(loaded.resolved.files)


def misfit_of(error: ValueError, layout: Mapping[str, Any], written: Node) -> Diagnostic:
    """What is wrong with a layout that stands in a file, as S204 at what the error names."""
    key, _, message = str(error).partition(": ")
    place, unknown = _place(layout, key), _unknown(message)
    at = place if unknown is None else (*place, unknown)
    named = key if key != "layout" else "the layout"
    return Diagnostic("S204", f"{named}: {message}", written.key_span(at))


def _place(layout: Mapping[str, Any], key: str) -> tuple[str | int, ...]:
    """Where a key such as `doors[0].at` is in a layout, as far as there is such a place."""
    part: Any = layout
    place: list[str | int] = []
    for step in _STEP.findall(key):
        index = int(step) if isinstance(part, list) and step.isdigit() else step
        inside = isinstance(part, Mapping) and index in part
        if not inside and not (isinstance(part, list) and isinstance(index, int) and index < len(part)):
            break
        part = part[index]
        place.append(index)
    return tuple(place)


def _unknown(message: str) -> str | None:
    """The key that a message calls unknown."""
    match = re.match(r"there is no '([^']+)'", message)
    return match.group(1) if match else None
