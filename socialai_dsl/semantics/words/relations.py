"""Words for how two things lie, look and belong to each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from operator import eq
from typing import Final, Literal, cast

from socialai_dsl.semantics import groups, hands
from socialai_dsl.semantics.groups import check_points
from socialai_dsl.semantics.resolver import ENTITY
from socialai_dsl.semantics.terms import (
    BOOL,
    CELL,
    DIRECTION,
    CellOf,
    Compare,
    FieldOf,
    Measure,
    Not,
    RelationName,
    Sees,
    Term,
    Test,
    Type,
    all_of,
    any_of,
    arithmetic,
    entity,
    equals,
    number,
)
from socialai_dsl.semantics.words.use import Use, Value

Cell = tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Relation(Value):
    """A relation for which the engine has a test.

    Attributes:
        turned: whose direction it follows from, besides where both are.
        through: what else: what stands `between` them, or the `way` that is free.
        most: as `here.WORD(x)`, on how many cells it holds at most; None: on any number.
        known: whether it holds between two cells, as far as that decides it; None: it does not.
    """

    turned: tuple[Literal["subject", "object"], ...] = ()
    through: Literal["between", "way"] | None = None
    most: int | None = None
    known: Callable[[Cell, Cell], bool | None] = lambda _one, _other: None


def _related(use: Use) -> Term:
    """Whether a relation of the engine's own holds to an argument, or to any of it."""
    subject = use.subject_or_candidate()
    return use.each(0, lambda other: Test(cast(RelationName, use.signature.name), subject, other))


def _related_bodies(use: Use) -> Term:
    """One to something that can be turned to somewhere, which a cell is not."""
    if groups.is_group(use.resolver, use.args[0], use.scope):
        return _related(use)
    subject = use.subject_or_candidate()
    return Test(cast(RelationName, use.signature.name), subject, use.value(0, ENTITY))


def _viewer(use: Use) -> Term:
    """Who sees; things see nothing."""
    viewer = use.about()
    if viewer.type.high >= len(use.resolver.symbols.numbers):
        raise use.fail("S211", f"only a member of the cast has a view: `agent.{use.signature.name}(...)`")
    return viewer


def _looks_at(use: Use) -> Term:
    viewer = _viewer(use)
    return use.each(0, lambda other: Test("looks_at", viewer, other))


def _sees(use: Use) -> Term:
    """`a.sees(x)`, `a.would_see(x, direction)`; of a group, any of it."""
    viewer = _viewer(use)

    def seen(other: Term) -> Term:
        # After what is seen: picks are numbered in source order.
        return Sees(viewer, other, use.value(1, DIRECTION) if len(use.args) > 1 else None)

    return use.each(0, seen)


def _joint_attention(use: Use) -> Term:
    """`a.joint_attention(b, x)`: both look at x; without x, at the same object."""
    subject, other = use.about(), use.value(0, ENTITY)
    members = len(use.resolver.symbols.numbers)
    if max(subject.type.high, other.type.high) >= members:
        message = "only members of the cast attend to something together"
        at = use.node if subject.type.high > other.type.high else use.args[0]
        hint = "`a.joint_attention(b, x)` is whether a and b both look at x"
        raise use.fail("S204", message, at, hint=hint)

    def both_look(what: Term) -> Term:
        return all_of([Test("looks_at", subject, what), Test("looks_at", other, what)])

    if len(use.args) > 1:
        return use.each(1, both_look)
    return any_of(both_look(entity(each)) for each in range(members, use.resolver.symbols.entities))


def _points_at(use: Use) -> Term:
    """`n.points_at(x)`: the arm is straight and x lies that way, or it is at the cell of x."""
    subject = use.about()
    check_points(use.resolver, use.signature.name, subject, use.node, use.scope)

    def pointed_at(other: Term) -> Term:
        way = replace(Measure(DIRECTION, "dir_to", (subject, other)), type=Type("int", 0, 3))
        arm = FieldOf(Type("int", 0, 4), subject, "pointing")
        straight = all_of(
            [Compare("==", arm, arithmetic("+", way, number(1))), Test("in_line", subject, other)]
        )
        at_it = Compare("==", FieldOf(CELL, subject, "pointing"), CellOf(CELL, other))
        # The arm of an NPC that leaves the room stays as it was, but points at nothing.
        is_there = equals(FieldOf(BOOL, subject, "gone"), 0)
        return all_of([any_of([all_of([at_it, is_there]), straight]), Not(Test("at", subject, other))])

    return use.each(0, pointed_at)


def _carries(use: Use) -> Term:
    return hands.carries(use.resolver, use.about(), use.args[0], use.node, use.scope)


def _distance(use: Use) -> Term:
    subject, other = use.about(), use.resolver.somewhere(use.args[0], use.scope)
    (_, width), (_, height) = use.resolver.symbols.width, use.resolver.symbols.height
    return Measure(Type("int", 0, width + height), "distance", (subject, other))


def _direction(use: Use) -> Term:
    subject = use.about()
    return Measure(DIRECTION, "dir_to", (subject, use.resolver.somewhere(use.args[0], use.scope)))


def _is_next_to(one: Cell, other: Cell) -> bool:
    return abs(one[0] - other[0]) + abs(one[1] - other[1]) == 1


def _may_be_in_line(one: Cell, other: Cell) -> bool | None:
    return None if one[0] == other[0] or one[1] == other[1] else False


_test = partial(Relation, subject="entity", takes=("entities",), gives="condition", meaning=_related)


RELATIONS: Final = (
    _test("at", doc="on the cell of x", candidate=True, also=("reaches", "on", "in_cell"), most=1, known=eq),
    _test("next_to", doc="at a Manhattan distance of 1; facing does not matter", candidate=True, most=4,
          known=_is_next_to, also=("near", "close_to", "beside", "adjacent", "adjacent_to", "by")),
    _test("in_front_of",
          doc="on the cell that x, a member, faces; for x in a wall, on the cell one step into the room; "
              "false of any other object",
          candidate=True, meaning=_related_bodies, most=1, turned=("object",)),
    _test("faces", doc="x is on the cell ahead", turned=("subject",)),
    _test("faces_toward", doc="facing the direction at which face(x) would end", turned=("subject",)),
    Value("joint_attention", "member", ("entity", "entities"), "condition",
          "both look (looks_at) at y; without y, at the same object", optional=1, meaning=_joint_attention),
    Value("points_at", "member", ("entities",), "condition",
          "it points at the cell of x, or in the direction in which x lies straight, and stands on another "
          "cell", also=("points_to",), meaning=_points_at),
    _test("eye_contact",
          doc="same row or column, each facing the other; distance and things between do not matter",
          meaning=_related_bodies, turned=("subject", "object")),
    _test("in_line", doc="same row or column", cell=True, known=_may_be_in_line),
    _test("can_reach",
          doc="a free path leads to x or to a cell next to it; during a reset, around what has been placed "
              "so far", through="way"),
    _test("unobstructed",
          doc="same row or column, and nothing opaque strictly between; members of the cast are not opaque",
          cell=True, through="between"),
    _test("looks_at", subject="member",
          doc="x is straight ahead, 1 to view - 1 cells away, and nothing opaque strictly between",
          also=("looking_at",), meaning=_looks_at, turned=("subject",), through="between"),
    Value("sees", "member", ("entities",), "condition",
          "x is in its view, 0 to view - 1 cells ahead and at most view // 2 to the side, and not hidden by "
          "`occlusion`", also=("can_see", "see"), meaning=_sees),
    Value("would_see", "member", ("entities", "direction"), "condition", "it would see x if it faced this direction",
          meaning=_sees),
    Value("carries", "member", ("entities",), "condition", "x is in its hands; of a group, any of it", momentary=True,
          also=("holds", "has", "holding"), meaning=_carries),
    Value("distance", "entity", ("entity",), "number", "Manhattan distance, in cells", cell=True,
          also=("dist", "distance_to"), meaning=_distance),
    Value("dir_to", "entity", ("entity",), "direction", "the direction in which x lies, as for face(x)", cell=True,
          also=("toward",), meaning=_direction),
)  # fmt: skip
