"""Placements for which a room can have no free cell: certain ones, and those that the least favourable room lacks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cached_property
from itertools import product
from typing import Final

from socialai_dsl.semantics import terms
from socialai_dsl.semantics.build import walk
from socialai_dsl.semantics.findings import Findings
from socialai_dsl.semantics.geometry import EXACT, Cell, Size, UnknownError, interior_cells, value, wall_cells
from socialai_dsl.semantics.plans import Checked, Placing, Region
from socialai_dsl.semantics.terms import Const, Term

_AROUND: Final = ((0, -1), (0, 1), (-1, 0), (1, 0))
_NAMED: Final = 5
"""How many of those are named that are in the way."""

_TAKES_AWAY: Final = {"at": 1, "in_front_of": 1, "next_to": 4}
"""How many cells at most `not here.TEST(x)` excludes for each x."""


def check_placements(checked: Checked, findings: Findings) -> frozenset[int]:
    """Report S601: an error where no room of a size has a cell for something, a warning where some may have none.

    Sizes are looked at from the smallest on, as far as a fixed effort goes. Returns the entities whose cells depend on
    more than that.
    """
    certain: dict[str, tuple[Placing, Size, Sequence[int]]] = {}
    possible: dict[str, tuple[Placing, Size, Sequence[int]]] = {}
    effort, undecided = _Effort(), set[int]()
    for size in product(_sizes(checked.room.width), _sizes(checked.room.height)):
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


def _sizes(bounds: tuple[int, int]) -> range:
    return range(bounds[0], bounds[1] + 1)


def _report(
    checked: Checked,
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


def _called(checked: Checked, number: int) -> str:
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

    def __init__(self, checked: Checked, size: Size, effort: _Effort) -> None:
        self.checked = checked
        self.size = size
        self._effort = effort
        self.placings = [item for item in checked.setup if isinstance(item, Placing)]
        self._places = _Places(self.placings)
        self.unknown: set[int] = set()
        self._cells: dict[int, tuple[int, int]] = {}
        self._counted = 0
        self._put_down: Counter[int] = Counter()
        self._before: dict[int, list[int]] = {}
        self._shared: dict[tuple[int, int], bool] = {}
        self._homes_of: dict[int, set[Cell] | None] = {}
        self._kept: dict[int, tuple[set[Cell] | None, int, set[Cell], int]] = {}

    def cells_for(self, number: int) -> tuple[int, int]:
        """The most cells that a placement can have, and the fewest it has in the least favourable room.

        Where the fewest cannot be told, it is taken to be 1.
        """
        if number not in self._cells:
            self._cells[number] = self._cells_for(number)
        return self._cells[number]

    def _cells_for(self, number: int) -> tuple[int, int]:
        try:
            cells, least, kept, excluded = self._room_for(number)
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

    def _room_for(self, number: int) -> tuple[set[Cell] | None, int, set[Cell], int]:
        """Of a placement's kind of place: its cells and the fewest it has; those that its conditions leave and the most
        that they take away.
        """
        kind = self._places.kinds[number]
        if kind not in self._kept:
            placing = self.placings[number]
            cells, least = self._region_cells(placing)
            self._kept[kind] = (cells, least, *self._conditions(placing.where, cells))
        return self._kept[kind]

    def _surely_taken(self, number: int, cells: set[Cell]) -> int:
        """How many of these cells are taken in every room: what must be on one of them is on one of its own."""
        assert self._counted <= number, "internal: placements are looked at in order"
        while self._counted < number:
            placing = self.placings[self._counted]
            if not (_is_sure(placing) or placing.overlap) and self.cells_for(self._counted)[1] > 0:
                self._put_down[self._places.kinds[self._counted]] += 1
            self._counted += 1
        return sum(count for kind, count in self._put_down.items() if self._is_within(kind, cells))

    def _is_within(self, kind: int, cells: set[Cell]) -> bool:
        homes = self._known_homes(kind)
        return homes is not None and homes <= cells

    def _known_homes(self, kind: int) -> set[Cell] | None:
        """Where what has this place can be; None if that is only known in a drawn room."""
        if kind not in self._homes_of:
            try:
                self._homes_of[kind] = self._homes(self._places.examples[kind])
            except UnknownError:
                self._homes_of[kind] = None
        return self._homes_of[kind]

    def has_cells(self, number: int) -> bool:
        """Whether an empty room has a cell for a placement."""
        cells, least, kept, _ = self._room_for(number)
        return least > 0 and (cells is None or bool(kept))

    def rivals(self, number: int) -> list[int]:
        """The entities that are put down before and may lie on a cell of this placement."""
        if number not in self._before:
            self._before[number] = self._rivals(number)
        return self._before[number]

    def _rivals(self, number: int) -> list[int]:
        placing, kinds = self.placings[number], self._places.kinds
        if placing.overlap:
            return []
        cells, _, kept, _ = self._room_for(number)
        self._effort.spend(number // 8)
        # What a place lies around is not in it.
        around = {arg.value for region in placing.regions for arg in region.args if isinstance(arg, Const)}
        sharing = {
            kind: self._may_share(kind, kinds[number], kept if cells is not None else None)
            for kind in set(kinds[:number])
        }
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
        around = [r for r in placing.regions if r.name in ("next_to", "in_front_of")]
        if around:
            return None, min(self._least_around(region) for region in around)
        found: set[Cell] = set()
        for region in placing.regions:
            found |= self._fixed(region, placing.overlap)
        return found, len(found)

    def _fixed(self, region: Region, overlap: bool) -> set[Cell]:
        """Cells of a region that only the size decides, without those where something built is in the way."""
        if region.name == "wall":
            return self._wall(region)
        inside = self._inside(region)
        return inside if overlap and region.name in EXACT else inside - self._built

    def _wall(self, region: Region) -> set[Cell]:
        width, height = self.size
        # Of a wall that is drawn, the shorter is looked at.
        return wall_cells(region, self.size, region.side or ("top" if width <= height else "left"))

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
        if any(region.name in ("next_to", "in_front_of") for region in placing.regions):
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

    def _may_share(self, other: int, own: int, cells: set[Cell] | None) -> bool:
        """Whether what has one kind of place may lie on the cells of another kind (None: any floor cell)."""
        if (other, own) not in self._shared:
            placing, homes = self._places.examples[other], self._known_homes(other)
            absent = placing.nowhere or placing.inside is not None
            self._effort.spend(len(homes or ()) // 16 + 1)
            meets = homes is None or bool(homes & (self._floor if cells is None else cells))
            self._shared[other, own] = meets and not absent
        return self._shared[other, own]


class _Places:
    """The different places that things are put in.

    Attributes:
        kinds: of each placement, the number of its place. examples: of each place, something that is put there.
    """

    def __init__(self, placings: Sequence[Placing]) -> None:
        numbers: dict[object, int] = {}
        self.kinds = [numbers.setdefault(_place_of(placing), len(numbers)) for placing in placings]
        self.examples = [placings[self.kinds.index(kind)] for kind in range(len(numbers))]


def _place_of(placing: Placing) -> object:
    inside = placing.nowhere or placing.inside is not None
    return placing.at, placing.regions, placing.where, inside, placing.overlap


def _of_the_cell(term: Term) -> bool:
    """Whether a condition reads only the cell and the size of the room."""
    known = (Const, terms.World, terms.Here, terms.Operation, terms.Compare, terms.Logic, terms.Not)
    return all(
        isinstance(part, known)
        and not (isinstance(part, terms.World) and part.name not in ("width", "height"))
        for part in walk(term)
    )


def _taken_away(term: Term) -> int:
    """How many cells a condition excludes at most."""
    match term:
        case terms.Not(arg=terms.Test(subject=None, name=name)) if name in _TAKES_AWAY:
            return _TAKES_AWAY[name]
        case terms.Not(
            arg=terms.Quantified(op="any", items=items, condition=terms.Test(subject=None, name=name))
        ) if name in _TAKES_AWAY:
            return _TAKES_AWAY[name] * len(items)
    raise UnknownError
