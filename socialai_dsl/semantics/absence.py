"""Who is missing from rooms without being asked to be: rooms are drawn here as far as placements need it.

What cannot be told without the engine, such as what can be reached, counts as favourable, so somebody who is found
missing really is.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Set
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from random import Random
from typing import Final

from socialai_dsl.semantics import plans, terms
from socialai_dsl.semantics.build import compute, walk
from socialai_dsl.semantics.findings import Findings
from socialai_dsl.semantics.geometry import (
    COMPARISONS,
    EXACT,
    Cell,
    Size,
    UnknownError,
    interior_cells,
    value,
    wall_cells,
)
from socialai_dsl.semantics.plans import Checked, Placing, Region
from socialai_dsl.semantics.terms import Const, Term

_ROOMS: Final = 100
_FEWEST: Final = 20
"""With fewer rooms nothing is said."""

_EFFORT: Final = 300_000
"""How many parts of terms are computed, over all rooms."""

_SIDES: Final = ("top", "bottom", "left", "right")
_AROUND: Final = ((0, -1), (0, 1), (-1, 0), (1, 0))


def check_absences(checked: Checked, findings: Findings, undecided: Collection[int]) -> None:
    """Report who is put outside of the room (S602 in all rooms, W603 in some), and who of the `undecided` entities has
    no cell in rooms that are drawn (S601 in all, W603 in some).
    """
    placings = [item for item in checked.setup if isinstance(item, Placing)]
    asked = [item for item in placings if item.entity in undecided and asks_about_cells(item)]
    told: set[str] = set()
    for placing in placings:
        if placing.at is not None and (share := _outside(placing.at, checked)):
            _report_outside(checked, findings, placing, share)
            told.add(checked.entities[placing.entity].key)
    found = _tried(checked) if asked else _Found(0, Counter())
    for placing in asked if found.rooms >= _FEWEST else ():
        key, absent = checked.entities[placing.entity].key, found.absent[placing.entity]
        if key in told or not absent:
            continue
        told.add(key)
        if absent == found.rooms:
            hint = "its `where` never holds there; widen its place, or the room"
            findings.error("S601", f"`{key}` has no free cell in any room", placing.span, hint=hint)
        elif not checked.require:  # rooms that miss somebody may be among those that are drawn again
            message = (
                f"`{key}` has no free cell, and so is absent, in {_percent(absent / found.rooms)} of rooms"
            )
            hint = "widen its place, place it earlier (`order:`), or draw such rooms again (`require:`)"
            findings.warning("W603", message, placing.span, hint=hint)


def _outside(at: tuple[Term, Term], checked: Checked) -> float:
    """In what share of the sizes of a room a place lies outside of it; 0 if that is drawn."""
    sizes = _sizes(checked)
    try:
        spots = [(size, value(at[0], size), value(at[1], size)) for size in sizes]
    except UnknownError:
        return 0
    return sum(not (0 <= x < width and 0 <= y < height) for (width, height), x, y in spots) / len(sizes)


def _report_outside(checked: Checked, findings: Findings, placing: Placing, share: float) -> None:
    key = checked.entities[placing.entity].key
    if share == 1:
        findings.error("S602", f"`{key}` is put outside of the room", placing.span, hint=_sizes_of(checked))
        return
    hint = "count from the far side: `W - 2`, `H - 2`"
    message = f"`{key}` is put outside of the room in {_percent(share)} of rooms"
    findings.warning("W603", message, placing.span, hint=hint)


def _percent(share: float) -> str:
    return f"{max(1, round(100 * share))} %"


def _sizes(checked: Checked) -> list[Size]:
    """The sizes that a room can have."""
    (least_w, most_w), (least_h, most_h) = checked.room.width, checked.room.height
    return list(product(range(least_w, most_w + 1), range(least_h, most_h + 1)))


def _sizes_of(checked: Checked) -> str:
    """What the coordinates of a room can be."""
    (_, width), (_, height) = checked.room.width, checked.room.height
    return f"x goes from 0 to {width - 1} and y from 0 to {height - 1}, walls included"


def asks_about_cells(placing: Placing) -> bool:
    """Whether a place may be empty without being meant to: a `where` that reads no cell decides who is there."""
    return placing.where is None or any(_reads_cell(part) for part in walk(placing.where))


def _reads_cell(part: Term) -> bool:
    return isinstance(part, terms.Here) or (isinstance(part, terms.Test) and part.subject is None)


@dataclass
class _Found:
    """In how many rooms each entity is without a cell."""

    rooms: int
    absent: Counter[int]


def _tried(checked: Checked) -> _Found:
    found, generator, left = _Found(0, Counter()), Random(0), _EFFORT
    sizes = _sizes(checked)
    generator.shuffle(sizes)
    rooms = _ROOMS // len(sizes) * len(sizes) or _ROOMS  # each size equally often
    known: _Known = cache(lambda region, size, overlap: frozenset(_cells(checked, region, size, overlap)))
    for number in range(rooms):
        room = _Room(sizes[number % len(sizes)], generator, known)
        for item in checked.setup:
            room.do(item)
        left -= room.effort
        if left < 0:
            break
        found.rooms += 1
        found.absent.update(room.absent)
    return found


_Known = Callable[[Region, Size, bool], frozenset[Cell]]


def _cells(checked: Checked, region: Region, size: Size, overlap: bool) -> Iterator[Cell]:
    """The cells of a region whose arguments are known."""
    if region.name == "wall":
        side = region.side or _SIDES[region.args[0].value]  # type: ignore[union-attr]
        yield from wall_cells(region, size, side)
        return
    inside = interior_cells(region, size)
    built = {cell for _, part, _ in checked.room.build for cell in interior_cells(part, size)}
    yield from inside if overlap and region.name in EXACT else (cell for cell in inside if cell not in built)


class _Room:
    """A room while it is drawn; None stands for what is not known here."""

    def __init__(self, size: Size, generator: Random, cells: _Known) -> None:
        self._size, self._generator, self._cells = size, generator, cells
        self._places: dict[int, Cell | None] = {}
        self._registers: dict[str, int | None] = {}
        self._taken: set[Cell] = set()
        self._here: Cell = (0, 0)
        self._variables: dict[str, int] = {}
        self.absent: set[int] = set()
        self.effort = 0

    def do(self, item: plans.Setup) -> None:
        """Draw one thing."""
        if isinstance(item, plans.Drawn):
            self._registers[item.path] = self._value(item.value.term)
        elif isinstance(item, Placing) and (item.when is None or self._value(item.when)):
            self._place(item)

    def _place(self, placing: Placing) -> None:
        entity = placing.entity
        if placing.nowhere or placing.inside is not None:
            self._places[entity] = None
            return
        if placing.at is not None:
            x, y = (self._value(part) for part in placing.at)
            if x is not None and y is not None:
                self._put(entity, (x, y))
            return
        candidates: set[Cell] = set()
        for region in placing.regions:
            found = self._region(region, placing.overlap)
            if found is None:
                return
            candidates |= found
        free = list(candidates if placing.overlap else candidates - self._taken)
        while free:
            number = self._generator.randrange(len(free))
            free[number], free[-1] = free[-1], free[number]
            self._here = free.pop()
            if placing.where is None or self._value(placing.where) != 0:
                self._put(entity, self._here)
                return
        self._places[entity] = None
        self.absent.add(entity)

    def _put(self, entity: int, cell: Cell) -> None:
        self._places[entity] = cell
        self._taken.add(cell)

    def _region(self, region: Region, overlap: bool) -> Set[Cell] | None:
        """The cells of a region; None if they are not known."""
        if region.name in ("next_to", "in_front_of"):
            target = self._value(region.args[0])
            cell = None if target is None else self._places.get(target)
            if cell is None or region.name == "in_front_of":
                return None
            floor = self._cells(Region("anywhere"), self._size, False)
            return {near for dx, dy in _AROUND if (near := (cell[0] + dx, cell[1] + dy)) in floor}
        args = [self._value(arg) for arg in region.args]
        if None in args:
            return None
        known = tuple(Const(arg.type, value or 0) for arg, value in zip(region.args, args, strict=True))
        return self._cells(replace(region, args=known), self._size, overlap)

    # -- values --

    def _value(self, term: Term) -> int | None:
        """The value of a term; None if it is not known here."""
        self.effort += 1
        match term:
            case Const(value=value):
                return value
            case terms.Here(name="x" | "y" as name):
                return self._here["xy".index(name)]
            case terms.World(name="width" | "height" as name):
                return self._size[("width", "height").index(name)]
            case terms.Variable(name=name):
                return self._variables.get(name)
            case terms.Read(path=path):
                return self._registers.get(path)
            case terms.FieldOf(entity=entity, name="x" | "y" as name):
                cell = self._cell(entity)
                return None if cell is None else cell["xy".index(name)]
            case terms.Measure(name="distance", args=(one, other)):
                return self._distance(self._cell(one), self._cell(other))
            case terms.Operation(op=op, args=args):
                values = [self._value(arg) for arg in args]
                if op == "turn" or None in values:
                    return None
                known = [value for value in values if value is not None]
                return 0 if op in ("//", "%") and known[1] == 0 else compute(op, *known)
            case terms.Compare(op=op, left=left, right=right):
                a, b = self._value(left), self._value(right)
                return None if a is None or b is None else COMPARISONS[op](a, b)
            case terms.Not(arg=arg):
                truth = self._value(arg)
                return None if truth is None else int(not truth)
            case terms.Logic(op=op, args=args):
                return _joined(op == "and", map(self._value, args))
            case terms.Test(name=name, subject=subject, object=target):
                return self._related(name, self._here if subject is None else self._cell(subject), target)
            case terms.Quantified(cells=False):
                return self._quantified(term)
        return None

    def _cell(self, entity: Term) -> Cell | None:
        if isinstance(entity, terms.Here):
            return self._here
        number = self._value(entity)
        return None if number is None else self._places.get(number)

    @staticmethod
    def _distance(one: Cell | None, other: Cell | None) -> int | None:
        return None if one is None or other is None else abs(one[0] - other[0]) + abs(one[1] - other[1])

    def _related(self, name: str, cell: Cell | None, target: Term) -> int | None:
        other = self._cell(target)
        if cell is None or other is None:
            return None
        match name:
            case "at":
                return int(cell == other)
            case "next_to":
                return int(self._distance(cell, other) == 1)
            case "in_line":
                return None if cell[0] == other[0] or cell[1] == other[1] else 0
        return None

    def _quantified(self, term: terms.Quantified) -> int | None:
        truths = [(item.value, self._holds_for(term, item.value)) for item in term.items]
        match term.op:
            case "any" | "all":
                return _joined(term.op == "all", (truth for _, truth in truths))
            case "count":
                return (
                    None
                    if any(truth is None for _, truth in truths)
                    else sum(map(bool, dict(truths).values()))
                )
            case "first" | "pick":
                fitting = [value for value, truth in truths if truth]
                if not fitting or any(truth is None for _, truth in truths):
                    return None
                return fitting[0] if term.op == "first" else self._generator.choice(fitting)
        return None

    def _holds_for(self, term: terms.Quantified, value: int) -> int | None:
        if term.condition is None:
            return 1
        outer = self._variables.get(term.variable)
        self._variables[term.variable] = value
        truth = self._value(term.condition)
        if outer is None:
            del self._variables[term.variable]
        else:
            self._variables[term.variable] = outer
        return truth


def _joined(every: bool, truths: Iterator[int | None]) -> int | None:
    """All of them, or any; not known where one that is not known decides."""
    unknown = False
    for truth in truths:
        if truth is not None and bool(truth) is not every:
            return int(not every)
        unknown = unknown or truth is None
    return None if unknown else int(every)
