"""A study's blocks to what each group plays: orders that balance each other, rooms, and the group of a newcomer."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

from socialai_dsl.diagnostics import DiagnosticBag
from socialai_dsl.schema.scenario import TEST_SET
from socialai_dsl.schema.study import Block, Study
from socialai_dsl.source import Node


@dataclass(frozen=True)
class Design:
    """Who plays what.

    Attributes:
        orders: of each group, the numbers of the blocks that it plays, from 0.
        rooms: of each block, the numbers of its rooms in the test set.
    """

    orders: tuple[tuple[int, ...], ...]
    rooms: tuple[tuple[int, ...], ...]


def balanced_orders(count: int) -> list[tuple[int, ...]]:
    """A balanced Latin square (Williams, 1949) of the numbers 0 to count - 1.

    Each number stands at each place equally often, and directly behind each other number equally often. There are
    `count` orders where that is even or 1, twice as many where it is odd.
    """
    zigzag = [number // 2 if number % 2 == 0 else count - (number + 1) // 2 for number in range(count)]
    rows = [tuple((number + shift) % count for number in zigzag) for shift in range(count)]
    return rows if count % 2 == 0 or count == 1 else [*rows, *(row[::-1] for row in rows)]


def least_filled(counts: Sequence[int]) -> int:
    """The number of the group that a newcomer gets: the first of those with the fewest participants."""
    return min(range(len(counts)), key=lambda group: (counts[group], group))


def shuffled(rooms: Sequence[int], *about: object) -> tuple[int, ...]:
    """The rooms in an order that follows from what it is about, the same on every machine."""

    def place(room: int) -> bytes:
        return hashlib.sha256(" ".join(map(str, (*about, room))).encode()).digest()

    return tuple(sorted(rooms, key=place))


def design_of(study: Study, places: Node, bag: DiagnosticBag) -> Design | None:
    """What the groups of a study play; None, and `bag` says why, if there is no such design."""
    known = len(bag)
    rooms = _rooms(study.blocks, places, bag)
    orders = _orders(study, places, bag)
    return Design(orders, rooms) if len(bag) == known else None


def _rooms(blocks: Sequence[Block], places: Node, bag: DiagnosticBag) -> tuple[tuple[int, ...], ...]:
    found: list[tuple[int, ...]] = []
    begun: dict[str, int] = {}
    for number, block in enumerate(blocks):
        if isinstance(block.rooms, str):  # the test set
            first = begun.get(block.scenario, 0)
            begun[block.scenario] = first + block.episodes
            if first + block.episodes > TEST_SET:
                before = f" beside the {first} of blocks above" if first else ""
                message = (
                    f"{block.episodes} episodes{before} are more than the {TEST_SET} rooms of the test set"
                )
                bag.error("S901", message, places.value_span(("blocks", number, "episodes")))
            found.append(tuple(range(first, first + block.episodes)))
            continue
        for place, room in enumerate(block.rooms):
            if room in block.rooms[:place]:
                span = places.value_span(("blocks", number, "rooms", place))
                bag.error("S901", f"the room {room} is given twice", span)
        if block.episodes > len(block.rooms):
            message = f"{block.episodes} episodes are more than the {len(block.rooms)} rooms given"
            hint = f"`episodes: {len(block.rooms)}`, or more rooms"
            bag.error("S901", message, places.value_span(("blocks", number, "episodes")), hint=hint)
        found.append(tuple(block.rooms[: block.episodes]))
    return tuple(found)


def _orders(study: Study, places: Node, bag: DiagnosticBag) -> tuple[tuple[int, ...], ...]:
    blocks, assign = study.blocks, study.assign
    named = max((group for block in blocks for group in block.groups or ()), default=1)
    several = len(balanced_orders(len(blocks))) if assign.order == "balanced" else 1
    count = assign.groups if assign.groups is not None else max(named, several)
    for number, block in enumerate(blocks):
        for place, group in enumerate(block.groups or ()):
            if group > count:
                span = places.value_span(("blocks", number, "groups", place))
                hint = f"`assign: {{groups: {group}}}`, or a group from 1 to {count}"
                bag.error("S902", f"there is no group {group}: the study has {count}", span, hint=hint)
    own = [
        tuple(n for n, block in enumerate(blocks) if block.groups is None or group in block.groups)
        for group in range(1, count + 1)
    ]
    for group, plays in enumerate(own, start=1):
        if not plays:
            bag.error("S902", f"group {group} plays no block", places.key_span(("blocks",)))
    if assign.order == "fixed":
        return tuple(own)
    return tuple(_balanced(own, places, bag))


def _balanced(own: Sequence[tuple[int, ...]], places: Node, bag: DiagnosticBag) -> list[tuple[int, ...]]:
    """The blocks of each group by the next order of those that play the same ones; `bag` says where that is unequal."""
    found, met = [], dict[tuple[int, ...], int]()
    for plays in own:
        orders, before = balanced_orders(len(plays)) if plays else [()], met.get(plays, 0)
        found.append(tuple(plays[place] for place in orders[before % len(orders)]))
        met[plays] = before + 1
    for plays, groups in met.items():
        needed = len(balanced_orders(len(plays))) if plays else 1
        if groups % needed:
            span = places.value_span(("assign", "groups")) if len(met) == 1 else places.key_span(("assign",))
            who = "1 group plays them" if groups == 1 else f"{groups} groups play them"
            message = f"{len(plays)} blocks have {needed} balanced orders, and {who}"
            hint = f"let {needed} groups play them, or a multiple, or write `order: fixed`"
            bag.error("S902", message, span, hint=hint)
    return found
