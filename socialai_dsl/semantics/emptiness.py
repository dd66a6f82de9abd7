"""Placements for which a room can have no free cell: certain ones, and those that the least favourable room lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

from socialai_dsl.semantics import terms
from socialai_dsl.semantics.build import walk
from socialai_dsl.semantics.findings import Findings
from socialai_dsl.semantics.geometry import EXACT, Cell, Size, UnknownError, interior_cells, value
from socialai_dsl.semantics.terms import Checked, Const, Placing, Region, Term

_AROUND: Final = ((0, -1), (0, 1), (-1, 0), (1, 0))
_TAKES_AWAY: Final = {"at": 1, "in_front_of": 1, "next_to": 4}
"""How many cells at most `not here.TEST(x)` excludes for each x."""


def check_placements(checked: Checked, findings: Findings) -> None:
    """Report S601: an error where no room of a size has a cell for something, a warning where some may have none."""
    certain: dict[str, tuple[Placing, Size, Sequence[int]]] = {}
    possible: dict[str, tuple[Placing, Size, Sequence[int]]] = {}
    for size in product(_sizes(checked.room.width), _sizes(checked.room.height)):
        room = _Room(checked, size)
        crowded = False
        for number, placing in enumerate(room.placings):
            key = checked.entities[placing.entity].key
            if key in certain or _is_sure(placing):
                continue
            most, least = room.cells_for(number)
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
    before = ", ".join(f"`{key}`" for key in dict.fromkeys(checked.entities[number].key for number in rivals))
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


def _called(checked: Checked, number: int) -> str:
    entity = checked.entities[number]
    return entity.key if entity.index is None else f"{entity.key}[{entity.index}]"


@dataclass(frozen=True)
class _Room:
    """The rooms of one size."""

    checked: Checked
    size: Size

    @property
    def placings(self) -> list[Placing]:
        """What is put into the room, in order."""
        return [item for item in self.checked.setup if isinstance(item, Placing)]

    def cells_for(self, number: int) -> tuple[int, int]:
        """The most cells that a placement can have, and the fewest it has in the least favourable room.

        Where the fewest cannot be told, it is taken to be 1.
        """
        placing = self.placings[number]
        try:
            cells, least = self._region_cells(placing)
            kept, excluded = self._conditions(placing.where, cells)
        except UnknownError:
            return 1, 1
        if cells is not None:
            least = len(kept)
        if least == 0:
            return 0, 0
        rivals = self.rivals(number)
        if cells is None:
            return least, least - excluded - len(rivals)
        most = len(kept) - (self._surely_taken(number, kept) if len(rivals) >= len(kept) else 0)
        return max(0, most), least - excluded - len(rivals)

    def _surely_taken(self, number: int, cells: set[Cell]) -> int:
        """How many of these cells are taken in every room: what must be on one of them is on one of its own."""
        return sum(
            self._is_within(other, cells) and self.cells_for(earlier)[1] > 0
            for earlier, other in enumerate(self.placings[:number])
            if not (_is_sure(other) or other.overlap)
        )

    def _is_within(self, placing: Placing, cells: set[Cell]) -> bool:
        try:
            return self._homes(placing) <= cells
        except UnknownError:
            return False

    def has_cells(self, number: int) -> bool:
        """Whether an empty room has a cell for a placement."""
        placing = self.placings[number]
        cells, least = self._region_cells(placing)
        return least > 0 and (cells is None or bool(self._conditions(placing.where, cells)[0]))

    def rivals(self, number: int) -> list[int]:
        """The entities that are put down before and may lie on a cell of this placement."""
        placing = self.placings[number]
        if placing.overlap:
            return []
        cells, _ = self._region_cells(placing)
        kept = self._conditions(placing.where, cells)[0] if cells is not None else None
        # What a place lies around is not in it.
        around = {arg.value for region in placing.regions for arg in region.args if isinstance(arg, Const)}
        return [
            other.entity
            for other in self.placings[:number]
            if other.entity != placing.entity
            and not (cells is None and other.entity in around)
            and self._may_share(other, kept)
        ]

    # -- regions ---------------------------------------------------------------------------------------------------

    def floor(self) -> set[Cell]:
        """Cells inside the walls on which nothing is built."""
        return self._inside(Region("anywhere")) - self._built()

    def _inside(self, region: Region) -> set[Cell]:
        """Cells inside the walls that a region covers which only the size decides."""
        return set(interior_cells(region, self.size))

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
        return inside if overlap and region.name in EXACT else inside - self._built()

    def _wall(self, region: Region) -> set[Cell]:
        width, height = self.size
        along = {"top": width, "bottom": width, "left": height, "right": height}
        # Of a wall that is drawn, the shorter is looked at.
        side = region.side or ("top" if width <= height else "left")
        places = range(region.margin, along[side] - region.margin)
        at = {"top": 0, "bottom": height - 1, "left": 0, "right": width - 1}[side]
        return {(k, at) if side in ("top", "bottom") else (at, k) for k in places}

    def _least_around(self, region: Region) -> int:
        """How many floor cells there are at least next to, or in front of, something."""
        if region.name == "in_front_of":
            return 1
        floor = self.floor()
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
            return self.floor()
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
                kept = {cell for cell in kept if value(part, self.size, cell)}
            else:
                excluded += _taken_away(part)
        return kept, excluded

    def _may_share(self, other: Placing, cells: set[Cell] | None) -> bool:
        """Whether something that was put down before may lie on one of these cells (None: any floor cell)."""
        if other.nowhere or other.inside is not None:
            return False
        try:
            homes = self._homes(other)
        except UnknownError:
            return True
        return bool(homes & (self.floor() if cells is None else cells))


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
