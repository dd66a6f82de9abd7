"""Placements that may find no free cell, in all rooms of a size or in drawn ones.

In drawn rooms, what cannot be told without the engine, such as what can be reached, counts as favourable, so that
a member that is found missing really is.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import replace
from functools import cache, cached_property
from itertools import product
from random import Random
from typing import Final

from socialai_dsl.semantics import plans, terms
from socialai_dsl.semantics.facts import needs, relation
from socialai_dsl.semantics.plans import CheckedScenario, Placing, Region
from socialai_dsl.semantics.scope import Findings
from socialai_dsl.semantics.terms import Const, Term, compute, walk
from socialai_dsl.semantics.words.relations import Cell
from socialai_dsl.vocabulary import SIDES

EXACT: Final = frozenset({"column", "row", "rect"})
"""Regions that name their cells: what may overlap can be put there where the room builds something, too."""

Size = tuple[int, int]


class UnknownError(Exception):
    """What decides this is only known in a drawn room."""


def interior_cells(region: Region, size: Size) -> list[Cell]:
    """Cells inside the walls that a region covers whose arguments read only the size, row by row."""
    args = [value(arg, size) for arg in region.args]
    cells = ((x, y) for y, x in product(range(1, size[1] - 1), range(1, size[0] - 1)))
    inside = [cell for cell in cells if _lies_in(region.name, args, cell, size)]
    return inside if region.where is None else [cell for cell in inside if value(region.where, size, cell)]


def wall_cells(region: Region, size: Size, side: str) -> set[Cell]:
    """The cells of one wall, `margin` away from its corners."""
    width, height = size
    along = {"top": width, "bottom": width, "left": height, "right": height}
    places = range(region.margin, along[side] - region.margin)
    at = {"top": 0, "bottom": height - 1, "left": 0, "right": width - 1}[side]
    return {(k, at) if side in ("top", "bottom") else (at, k) for k in places}


def _lies_in(name: str, args: Sequence[int], cell: Cell, size: Size) -> bool:
    (x, y), (width, height) = cell, size
    match name:
        case "left_half":
            return x < width // 2
        case "right_half":
            return x > width // 2
        case "top_half":
            return y < height // 2
        case "bottom_half":
            return y > height // 2
        case "column":
            return x == args[0]
        case "row":
            return y == args[0]
        case "rect":
            return args[0] <= x <= args[2] and args[1] <= y <= args[3]
        case "anywhere":
            return True
    raise AssertionError(f"internal: the size does not decide `{name}`")


def value(term: Term, size: Size, here: Cell = (0, 0)) -> int:
    """The value of a term that reads only the size of the room and the cell; raises UnknownError for others."""
    found = PartialEvaluation(size, here).value(term)
    if found is None:
        raise UnknownError(str(term))
    return found


class PartialEvaluation:
    """What is known when a term is asked for its value; None stands for what is not.

    Attributes:
        size: of the room. here: the candidate cell. variables: those of quantifiers.
    """

    def __init__(
        self,
        size: Size | None = None,
        here: Cell | None = None,
        variables: Mapping[str, int] | None = None,
    ) -> None:
        self.size, self.here = size, here
        self.variables = dict(variables or {})

    def value(self, term: Term) -> int | None:
        """The value of a term; None if it is not known here."""
        match term:
            case Const(value=value):
                return value
            case terms.Variable(name=name):
                return self.variables.get(name)
            case terms.Here(name="x" | "y" as name) if self.here is not None:
                return self.here["xy".index(name)]
            case terms.World(name="width" | "height" as name) if self.size is not None:
                return self.size[("width", "height").index(name)]
            case terms.Operation(op=op, args=args) if op != "turn":
                known = [value for value in map(self.value, args) if value is not None]
                return compute(op, *known) if len(known) == len(args) else None
            case terms.Compare(op=op, left=left, right=right):
                a, b = self.value(left), self.value(right)
                return None if a is None or b is None else int(terms.COMPARISONS[op](a, b))
            case terms.Not(arg=arg):
                truth = self.value(arg)
                return None if truth is None else int(not truth)
            case terms.Logic(op=op, args=args):
                return _joined(op == "and", map(self.value, args))
            case terms.Select():
                return self._selected(term)
        return None

    def _selected(self, term: terms.Select) -> int | None:
        for condition, chosen in zip(term.conditions, term.values, strict=True):
            truth = self.value(condition)
            if truth is None:
                return None
            if truth:
                return self.value(chosen)
        return self.value(term.default)


# -- rooms of each size: what can be proven ------------------------------------------------------------------


_AROUND: Final = ((0, -1), (0, 1), (-1, 0), (1, 0))
_NAMED: Final = 5
"""How many of those are named that are in the way."""


def check_placements(checked: CheckedScenario, findings: Findings) -> frozenset[int]:
    """Report S601: an error where no room of a size has a cell for something, a warning where some may have none.

    Sizes are looked at from the smallest on, as far as a fixed effort goes. Returns the entities whose cells depend on
    more than that.
    """
    certain: dict[str, tuple[Placing, Size, Sequence[int]]] = {}
    possible: dict[str, tuple[Placing, Size, Sequence[int]]] = {}
    effort, undecided = _Effort(), set[int]()
    for size in _sizes(checked):
        room = _Room(checked, size, effort)
        crowded = False
        for number, placing in enumerate(room.placings):
            key = checked.entities[placing.entity].key
            if key in certain or _is_sure(placing):
                continue
            most, least = room.cells_for(number)
            if number in room.unknown:
                undecided.add(placing.entity)
            if least > 0:
                continue
            rivals: Sequence[int] = room.rivals(number) if room.has_cells(number) else ()
            if rivals and crowded:
                continue  # for want of the same cells
            if most == 0:
                certain[key] = (placing, size, rivals)
                crowded = crowded or bool(rivals)
            else:
                possible.setdefault(key, (placing, size, rivals))
    # Once for a group, of which the last ones lack a cell.
    for key, (placing, size, rivals) in (possible | certain).items():
        _report(checked, findings, placing, size, rivals, key in certain)
    reported = possible | certain
    return frozenset(number for number in undecided if checked.entities[number].key not in reported)


def _is_sure(placing: Placing) -> bool:
    """Whether nothing can be in its way."""
    return placing.nowhere or placing.at is not None or placing.inside is not None


def _report(
    checked: CheckedScenario,
    findings: Findings,
    placing: Placing,
    size: Size,
    rivals: Sequence[int],
    certain: bool,
) -> None:
    """`rivals` may take its cells, or are certain to."""
    name = _called(checked, placing.entity)
    where = f"a room of {size[0]}x{size[1]}"
    before = _named(list(dict.fromkeys(checked.entities[number].key for number in rivals)))
    if certain:
        taken = f"; {before} take all there are" if before else ""
        message = f"`{name}` has no free cell in {where}{taken}"
        hint = "widen its place, or the room"
        rects = [region for region in placing.regions if region.name == "rect" and not region.side]
        if not before and rects and len(rects) == len(placing.regions):
            with suppress(UnknownError):
                if not any(interior_cells(region, size) for region in rects):
                    hint = _sizes_of(checked)
        if not before and checked.room.build and any(region.name in EXACT for region in placing.regions):
            hint = "with `overlap: true` it can stand where the room builds something"
        report = findings.warning if before else findings.error
        report("S601", message, placing.span, hint=hint)
        return
    message = f"`{name}` can be left without a free cell in {where}"
    hint = f"{before} may take all of its place; place it earlier (`order:`), or widen its place"
    findings.warning("S601", message, placing.span, hint=hint)


def _named(keys: Sequence[str]) -> str:
    more = len(keys) - _NAMED if len(keys) > _NAMED + 1 else 0
    names = ", ".join(f"`{key}`" for key in (keys[:_NAMED] if more else keys))
    return f"{names} and {more} more" if more else names


def _called(checked: CheckedScenario, number: int) -> str:
    entity = checked.entities[number]
    return entity.key if entity.index is None else f"{entity.key}[{entity.index}]"


class _Effort:
    """How much may still be computed: parts of conditions, each for one cell."""

    def __init__(self) -> None:
        self._left = 500_000

    def spend(self, amount: int) -> None:
        """Raises UnknownError when nothing is left."""
        self._left -= amount
        if self._left < 0:
            raise UnknownError("too much to compute")


class _Room:
    """The rooms of one size; all that is found out is remembered, by the place where many things share one."""

    def __init__(self, checked: CheckedScenario, size: Size, effort: _Effort) -> None:
        self.checked = checked
        self.size = size
        self._effort = effort
        self.placings = [item for item in checked.setup if isinstance(item, Placing)]
        numbers: dict[object, int] = {}
        self._kinds = [numbers.setdefault(_place_of(placing), len(numbers)) for placing in self.placings]
        self._examples = [self.placings[self._kinds.index(kind)] for kind in numbers.values()]
        self.unknown: set[int] = set()
        self._counted = 0
        self._put_down: Counter[int] = Counter()
        self.cells_for = cache(self._cells_for)
        self.rivals = cache(self._rivals)
        self._room_of = cache(self._room_of_kind)
        self._known_homes = cache(self._homes_of_kind)
        self._may_share = cache(self._meets)

    def _cells_for(self, number: int) -> tuple[int, int]:
        """The most cells that a placement can have, and the fewest it has in the least favourable room.

        Where the fewest cannot be told, it is taken to be 1.
        """
        try:
            cells, least, kept, excluded = self._room_of(self._kinds[number])
            if cells is not None:
                least = len(kept)
            if least == 0:
                return 0, 0
            rivals = self.rivals(number)
        except UnknownError:
            self.unknown.add(number)
            return 1, 1
        if cells is None:
            return least, least - excluded - len(rivals)
        most = len(kept) - (self._surely_taken(number, kept) if len(rivals) >= len(kept) else 0)
        return max(0, most), least - excluded - len(rivals)

    def _room_of_kind(self, kind: int) -> tuple[set[Cell] | None, int, set[Cell], int]:
        """Of a kind of place: its cells and the fewest it has; those that its conditions leave and the most that they
        take away.
        """
        placing = self._examples[kind]
        cells, least = self._region_cells(placing)
        return cells, least, *self._conditions(placing.where, cells)

    def _surely_taken(self, number: int, cells: set[Cell]) -> int:
        """How many of these cells are taken in every room: what must be on one of them is on one of its own."""
        assert self._counted <= number, "internal: placements are looked at in order"
        while self._counted < number:
            placing = self.placings[self._counted]
            if not (_is_sure(placing) or placing.overlap) and self.cells_for(self._counted)[1] > 0:
                self._put_down[self._kinds[self._counted]] += 1
            self._counted += 1
        homes = ((self._known_homes(kind), count) for kind, count in self._put_down.items())
        return sum(count for known, count in homes if known is not None and known <= cells)

    def _homes_of_kind(self, kind: int) -> set[Cell] | None:
        """Where what has this kind of place can be; None if that is only known in a drawn room."""
        try:
            return self._homes(self._examples[kind])
        except UnknownError:
            return None

    def has_cells(self, number: int) -> bool:
        """Whether an empty room has a cell for a placement."""
        cells, least, kept, _ = self._room_of(self._kinds[number])
        return least > 0 and (cells is None or bool(kept))

    def _rivals(self, number: int) -> list[int]:
        """The entities that are put down before and may lie on a cell of this placement."""
        placing, kinds = self.placings[number], self._kinds
        if placing.overlap:
            return []
        cells, *_ = self._room_of(kinds[number])
        self._effort.spend(number // 8)
        # What a place lies around is not in it.
        around = {arg.value for region in placing.regions for arg in region.args if isinstance(arg, Const)}
        sharing = {kind: self._may_share(kind, kinds[number]) for kind in set(kinds[:number])}
        return [
            other.entity
            for other, kind in zip(self.placings[:number], kinds, strict=False)
            if sharing[kind]
            and other.entity != placing.entity
            and not (cells is None and other.entity in around)
        ]

    # -- regions ---------------------------------------------------------------------------------------------------

    @cached_property
    def _floor(self) -> set[Cell]:
        """Cells inside the walls on which nothing is built."""
        return self._inside(Region("anywhere")) - self._built

    def _inside(self, region: Region) -> set[Cell]:
        """Cells inside the walls that a region covers which only the size decides."""
        self._effort.spend(self.size[0] * self.size[1] // 8)
        return set(interior_cells(region, self.size))

    @cached_property
    def _built(self) -> set[Cell]:
        return {cell for _, region, _ in self.checked.room.build for cell in self._inside(region)}

    def _region_cells(self, placing: Placing) -> tuple[set[Cell] | None, int]:
        """The cells of a place; None for a place around something that is drawn, with how many there are at least."""
        around = [region for region in placing.regions if region.around]
        if around:
            return None, min(self._least_around(region) for region in around)
        found: set[Cell] = set()
        for region in placing.regions:
            found |= self._fixed(region, placing.overlap)
        return found, len(found)

    def _fixed(self, region: Region, overlap: bool) -> set[Cell]:
        """Cells of a region that only the size decides, without those where something built is in the way."""
        if region.name == "wall":
            width, height = self.size
            # Of a wall that is drawn, the shorter is looked at.
            return wall_cells(region, self.size, region.side or ("top" if width <= height else "left"))
        inside = self._inside(region)
        return inside if overlap and region.name in EXACT else inside - self._built

    def _least_around(self, region: Region) -> int:
        """How many floor cells there are at least next to, or in front of, something."""
        if region.name == "in_front_of":
            return 1
        floor = self._floor
        target = region.args[0]
        if not isinstance(target, Const):
            raise UnknownError
        own = next((p for p in self.placings if p.entity == target.value), None)
        if own is None or own.nowhere or own.inside is not None:
            raise UnknownError
        homes = self._homes(own)
        return min((sum((x + dx, y + dy) in floor for dx, dy in _AROUND) for x, y in homes), default=0)

    def _homes(self, placing: Placing) -> set[Cell]:
        """Where something can be at all."""
        if placing.at is not None:
            return {(value(placing.at[0], self.size), value(placing.at[1], self.size))}
        if any(region.around for region in placing.regions):
            return self._floor
        found: set[Cell] = set()
        for region in placing.regions:
            found |= self._fixed(region, placing.overlap)
        return self._conditions(placing.where, found)[0]

    # -- conditions --------------------------------------------------------------------------------------------------

    def _conditions(self, where: Term | None, cells: set[Cell] | None) -> tuple[set[Cell], int]:
        """The cells that conditions on the cell alone leave, and how many the others take away at most."""
        kept, excluded = set(cells or ()), 0
        parts = where.args if isinstance(where, terms.Logic) and where.op == "and" else (where,)
        for part in parts:
            if part is None:
                continue
            if _of_the_cell(part):
                self._effort.spend(len(kept) * sum(1 for _ in walk(part)))
                kept = {cell for cell in kept if value(part, self.size, cell)}
            else:
                excluded += _taken_away(part)
        return kept, excluded

    def _meets(self, other: int, own: int) -> bool:
        """Whether what has one kind of place may lie on the cells of another kind."""
        placing, homes = self._examples[other], self._known_homes(other)
        cells, _, kept, _ = self._room_of(own)
        absent = placing.nowhere or placing.inside is not None
        self._effort.spend(len(homes or ()) // 16 + 1)
        meets = homes is None or bool(homes & (self._floor if cells is None else kept))
        return meets and not absent


def _place_of(placing: Placing) -> object:
    """The kind of place that something is put in."""
    inside = placing.nowhere or placing.inside is not None
    return placing.at, placing.regions, placing.where, inside, placing.overlap


def _of_the_cell(term: Term) -> bool:
    """Whether a condition reads only the cell and the size of the room."""
    return {need.what for need in needs(term)} <= {"candidate", "size"}


def _taken_away(term: Term) -> int:
    """How many cells a condition excludes at most: `not here.at(x)`, `not any(x in group where here.at(x))`."""
    times, asked = 1, term.arg if isinstance(term, terms.Not) else None
    if isinstance(asked, terms.Quantification) and asked.op == "any":
        times, asked = len(asked.items), asked.condition
    if isinstance(asked, terms.Test) and asked.subject is None and (most := relation(asked).most) is not None:
        return most * times
    raise UnknownError


# -- drawn rooms: members and things that are absent unintentionally -----------------------------------------


_ROOMS: Final = 100
_FEWEST: Final = 20
"""With fewer rooms nothing is said."""

_EFFORT: Final = 300_000
"""How many parts of terms are computed, over all rooms."""


def check_absences(checked: CheckedScenario, findings: Findings, undecided: Collection[int]) -> None:
    """Report who is put outside of the room (S602 in all rooms, W603 in some), and who of the `undecided` entities has
    no cell in rooms that are drawn (S601 in all, W603 in some).
    """
    placings = [item for item in checked.setup if isinstance(item, Placing)]
    asked = [item for item in placings if item.entity in undecided and asks_about_cells(item)]
    told: set[str] = set()
    drawn: list[Placing] = []
    for placing in placings:
        share = None if placing.at is None else _outside(placing.at, checked)
        if placing.at is not None and share is None:
            drawn.append(placing)
        if share:
            _report_outside(checked, findings, placing, share)
            told.add(checked.entities[placing.entity].key)
    rooms, absences, outside = _tried(checked) if asked or drawn else (0, Counter[int](), Counter[int]())
    for placing in drawn if rooms >= _FEWEST else ():
        key, share = checked.entities[placing.entity].key, outside[placing.entity] / rooms
        if share and key not in told and (share == 1 or not checked.require):
            told.add(key)
            _report_outside(checked, findings, placing, share)
    for placing in asked if rooms >= _FEWEST else ():
        key, absent = checked.entities[placing.entity].key, absences[placing.entity]
        if key in told or not absent:
            continue
        told.add(key)
        if absent == rooms:
            hint = "its `where` never holds there; widen its place, or the room"
            findings.error("S601", f"`{key}` has no free cell in any room", placing.span, hint=hint)
        elif not checked.require:  # rooms that miss a member may be among those that are drawn again
            message = f"`{key}` has no free cell, and so is absent, in {_percent(absent / rooms)} of rooms"
            hint = "widen its place, place it earlier (`order:`), or draw such rooms again (`require:`)"
            findings.warning("W603", message, placing.span, hint=hint)


def _outside(at: tuple[Term, Term], checked: CheckedScenario) -> float | None:
    """In what share of the sizes of a room a place lies outside of it; None if that is drawn."""
    sizes = _sizes(checked)
    found = [_is_outside([PartialEvaluation(size).value(part) for part in at], size) for size in sizes]
    return None if None in found and not any(found) else sum(map(bool, found)) / len(sizes)


def _is_outside(at: Sequence[int | None], size: Size) -> bool | None:
    """Whether a place lies outside of a room; one coordinate may be enough to know. None: it is not known."""
    known = [None if one is None else not 0 <= one < side for one, side in zip(at, size, strict=True)]
    return True if True in known else None if None in known else False


def _report_outside(checked: CheckedScenario, findings: Findings, placing: Placing, share: float) -> None:
    key = checked.entities[placing.entity].key
    if share == 1:
        findings.error("S602", f"`{key}` is put outside of the room", placing.span, hint=_sizes_of(checked))
        return
    hint = "count from the far side: `W - 2`, `H - 2`"
    message = f"`{key}` is put outside of the room in {_percent(share)} of rooms"
    findings.warning("W603", message, placing.span, hint=hint)


def _percent(share: float) -> str:
    return f"{max(1, round(100 * share))} %"


def _sizes(checked: CheckedScenario) -> list[Size]:
    """The sizes that a room can have."""
    (least_w, most_w), (least_h, most_h) = checked.room.width, checked.room.height
    return list(product(range(least_w, most_w + 1), range(least_h, most_h + 1)))


def _sizes_of(checked: CheckedScenario) -> str:
    """What the coordinates of a room can be."""
    (_, width), (_, height) = checked.room.width, checked.room.height
    return f"x goes from 0 to {width - 1} and y from 0 to {height - 1}, walls included"


def asks_about_cells(placing: Placing) -> bool:
    """Whether a place may be empty without being meant to: a `where` that reads no cell decides who is there."""
    return placing.where is None or any(need.what == "candidate" for need in needs(placing.where))


def _tried(checked: CheckedScenario) -> tuple[int, Counter[int], Counter[int]]:
    """How many rooms were drawn, in how many of them each entity is without a cell, and outside."""
    drawn, generator, left = 0, Random(0), _EFFORT
    absent, outside = Counter[int](), Counter[int]()
    sizes = _sizes(checked)
    generator.shuffle(sizes)
    rooms = _ROOMS // len(sizes) * len(sizes) or _ROOMS  # each size equally often
    known: _CellsOf = cache(lambda region, size, overlap: frozenset(_cells(checked, region, size, overlap)))
    for number in range(rooms):
        room = _DrawnRoom(sizes[number % len(sizes)], generator, known)
        for item in checked.setup:
            room.do(item)
        left -= room.effort
        if left < 0:
            break
        drawn += 1
        absent.update(room.absent)
        outside.update(room.outside)
    return drawn, absent, outside


_CellsOf = Callable[[Region, Size, bool], frozenset[Cell]]


def _cells(checked: CheckedScenario, region: Region, size: Size, overlap: bool) -> Iterator[Cell]:
    """The cells of a region whose arguments are known."""
    if region.name == "wall":
        side = region.side or SIDES[region.args[0].value]  # type: ignore[union-attr]
        yield from wall_cells(region, size, side)
        return
    inside = interior_cells(region, size)
    built = {cell for _, part, _ in checked.room.build for cell in interior_cells(part, size)}
    yield from inside if overlap and region.name in EXACT else (cell for cell in inside if cell not in built)


class _DrawnRoom(PartialEvaluation):
    """A room while it is drawn."""

    def __init__(self, size: Size, generator: Random, cells: _CellsOf) -> None:
        super().__init__(size, (0, 0))
        self._size, self._generator, self._cells = size, generator, cells
        self._places: dict[int, Cell | None] = {}
        self._registers: dict[str, int | None] = {}
        self._taken: set[Cell] = set()
        self.absent: set[int] = set()
        self.outside: set[int] = set()
        self.effort = 0

    def do(self, item: plans.Setup) -> None:
        """Draw one thing."""
        if isinstance(item, plans.Drawn):
            self._registers[item.path] = self.value(item.value.term)
        elif isinstance(item, Placing) and (item.when is None or self.value(item.when)):
            self._place(item)

    def _place(self, placing: Placing) -> None:
        entity = placing.entity
        if placing.nowhere or placing.inside is not None:
            self._places[entity] = None
            return
        if placing.at is not None:
            x, y = (self.value(part) for part in placing.at)
            if _is_outside((x, y), self._size):
                self.outside.add(entity)
            elif x is not None and y is not None:
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
            self.here = free.pop()
            if placing.where is None or self.value(placing.where) != 0:
                self._put(entity, self.here)
                return
        self._places[entity] = None
        self.absent.add(entity)

    def _put(self, entity: int, cell: Cell) -> None:
        self._places[entity] = cell
        self._taken.add(cell)

    def _region(self, region: Region, overlap: bool) -> Set[Cell] | None:
        """The cells of a region; None if they are not known."""
        if region.around:
            target = self.value(region.args[0])
            cell = None if target is None else self._places.get(target)
            if cell is None or region.name == "in_front_of":
                return None
            floor = self._cells(Region("anywhere"), self._size, False)
            return {near for dx, dy in _AROUND if (near := (cell[0] + dx, cell[1] + dy)) in floor}
        args = [self.value(arg) for arg in region.args]
        if None in args:
            return None
        known = tuple(Const(arg.type, value or 0) for arg, value in zip(region.args, args, strict=True))
        return self._cells(replace(region, args=known), self._size, overlap)

    # -- values --

    def value(self, term: Term) -> int | None:
        """The value of a term; None if it is not known here."""
        self.effort += 1
        match term:
            case terms.Read(path=path):
                return self._registers.get(path)
            case terms.FieldOf(entity=entity, name="x" | "y" as name):
                cell = self._cell(entity)
                return None if cell is None else cell["xy".index(name)]
            case terms.Measure(name="distance", args=(one, other)):
                return self._distance(self._cell(one), self._cell(other))
            case terms.Test(subject=subject, object=target):
                return self._related(
                    term, self.here if subject is None else self._cell(subject), self._cell(target)
                )
            case terms.Quantification(cells=False):
                return self._quantified(term)
        return super().value(term)

    def _cell(self, entity: Term) -> Cell | None:
        if isinstance(entity, terms.Here):
            return self.here
        number = self.value(entity)
        return None if number is None else self._places.get(number)

    @staticmethod
    def _distance(one: Cell | None, other: Cell | None) -> int | None:
        return None if one is None or other is None else abs(one[0] - other[0]) + abs(one[1] - other[1])

    @staticmethod
    def _related(term: terms.Test, one: Cell | None, other: Cell | None) -> int | None:
        return None if one is None or other is None else relation(term).known(one, other)

    def _quantified(self, term: terms.Quantification) -> int | None:
        truths = [(item.value, self._holds_for(term, item.value)) for item in term.items]
        if term.op in ("any", "all"):
            return _joined(term.op == "all", (truth for _, truth in truths))
        if any(truth is None for _, truth in truths):
            return None
        if term.op == "count":
            return sum(map(bool, dict(truths).values()))
        fitting = [value for value, truth in truths if truth]
        if not fitting or term.op == "nearest":
            return None
        return fitting[0] if term.op == "first" else self._generator.choice(fitting)

    def _holds_for(self, term: terms.Quantification, value: int) -> int | None:
        if term.condition is None:
            return 1
        outer = self.variables.get(term.variable)
        self.variables[term.variable] = value
        truth = self.value(term.condition)
        if outer is None:
            del self.variables[term.variable]
        else:
            self.variables[term.variable] = outer
        return truth


def _joined(every: bool, truths: Iterator[int | None]) -> int | None:
    """All of them, or any; not known where one that is not known decides."""
    unknown = False
    for truth in truths:
        if truth is not None and bool(truth) is not every:
            return int(not every)
        unknown = unknown or truth is None
    return None if unknown else int(every)
