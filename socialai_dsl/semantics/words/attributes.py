"""Words for what somebody or something is like."""

from __future__ import annotations

from typing import Final

from socialai_dsl.semantics import hands, object_facts
from socialai_dsl.semantics.groups import check_points
from socialai_dsl.semantics.resolver import Resolver, text_value
from socialai_dsl.semantics.scope import of_each, select
from socialai_dsl.semantics.terms import (
    BOOL,
    CELL,
    COLOR,
    DIRECTION,
    CellOf,
    Compare,
    Const,
    FieldOf,
    Here,
    Term,
    Type,
    arithmetic,
    as_number,
    number,
    numbers_of,
)
from socialai_dsl.semantics.words.use import Use, Value

_POINTING: Final = Type("int", 0, 4)


def coordinate(resolver: Resolver, name: str, who: Term | None) -> Term:
    """The column or row of somebody or something, -1 where that is in no room; None: of the candidate cell."""
    (_, width), (_, height) = resolver.symbols.width, resolver.symbols.height
    high = (width if name == "x" else height) - 1
    if who is None:
        return Here(Type("int", 0, high), "x" if name == "x" else "y")
    return FieldOf(Type("int", -1, high), who, "x" if name == "x" else "y")


def _coordinate(use: Use) -> Term:
    return coordinate(use.resolver, use.signature.name, use.subject_or_candidate())


def _color(use: Use) -> Term:
    return FieldOf(COLOR, use.about(), "color")


def _facing(use: Use) -> Term:
    return FieldOf(DIRECTION, use.about(), "dir")


def _gone(use: Use) -> Term:
    return FieldOf(BOOL, use.about(), "gone")


def _cell(use: Use) -> Term:
    return CellOf(CELL, use.about())


def _pointing(use: Use) -> Term:
    who = use.about()
    check_points(use.resolver, use.signature.name, who, use.node, use.scope)
    return Compare("!=", FieldOf(_POINTING, who, "pointing"), Const(_POINTING, 0))


def _inside(use: Use) -> Term:
    return object_facts.container(use.resolver, use.about(), use.node, use.scope)


def _unlocked_by(use: Use) -> Term:
    return object_facts.unlocker(use.resolver, use.about(), use.node, use.scope)


def _carried(use: Use) -> Term:
    return hands.carried(use.resolver, use.about(), use.node, use.scope)


def _empty_handed(use: Use) -> Term:
    return hands.empty_handed(use.resolver, use.about(), use.node, use.scope)


def _name(use: Use) -> Term:
    who = use.about()
    members = use.resolver.symbols.members_of(numbers_of(who))
    names = [use.resolver.registers.read(f"{member}.name") for member in members if member is not None]
    if len(names) < len(members):
        raise use.fail("S204", "only a member of the cast has a name")
    return of_each(who, names)


def _kind(use: Use) -> Term:
    who = use.about()
    return of_each(who, [_kind_of(use.resolver, each) for each in numbers_of(who)])


def _kind_of(resolver: Resolver, entity: int) -> Term:
    objects = resolver.symbols.object_of(entity)
    if objects is not None:
        return text_value(objects.type.name)
    member = resolver.symbols.member_of(entity)
    assert member is not None, "internal: an entity is an object or in the cast"
    cases = resolver.symbols.cast[member].cases("kind")
    return select(cases, [text_value(case.raw or "peer") for case in cases])


def _index(use: Use) -> Term:
    who, symbols = use.about(), use.resolver.symbols
    members = symbols.members_of((who.type.low, who.type.high))
    groups = [symbols.group_of(member) for member in members if member is not None]
    if len(groups) == 2 and groups[0] is not None and groups[1] is not None and groups[0][0] == groups[1][0]:
        first = who.type.low - groups[0][1]
    else:
        objects = symbols.object_of(who.type.low)
        if objects is None or who.type.high not in objects.numbers:
            raise use.fail("S204", "only one of a group has an `index`, its place in it")
        first = objects.numbers[0]
    if isinstance(who, Const):
        return number(who.value - first)
    return arithmetic("-", as_number(who), number(first))


ATTRIBUTES: Final = (
    Value("color", "entity", (), "color", "its colour", also=("colour",), meaning=_color),
    Value("facing", "entity", (), "direction", "the direction that it faces", also=("direction", "dir"),
          meaning=_facing),
    Value("x", "entity", (), "number", "its column, 0 at the left; -1 while it is out of the room",
          candidate=True, cell=True, meaning=_coordinate),
    Value("y", "entity", (), "number", "its row, 0 at the top; -1 while it is out of the room",
          candidate=True, cell=True, meaning=_coordinate),
    Value("cell", "entity", (), "cell", "the cell that it is on, as a value", meaning=_cell),
    Value("gone", "entity", (), "condition",
          "it is out of the room: it has vanished, lies in something, or is carried", momentary=True,
          also=("disappeared", "vanished"), meaning=_gone),
    Value("name", "member", (), "text", "its name, which stands before its lines", meaning=_name),
    Value("kind", "entity", (), "text", "its `kind`; of an object, its type", also=("type",), meaning=_kind),
    Value("index", "entity", (), "number", "its number in its group, from 0", also=("number",), meaning=_index),
    Value("inside", "object", (), "object", "the object that it lies in, or lay in last, if any",
          also=("content", "contains", "in"), meaning=_inside),
    Value("unlocked_by", "object", (), "object", "the object that unlocks it", meaning=_unlocked_by),
    Value("carried", "member", (), "object", "the object in its hands, if any", momentary=True,
          also=("carrying",), meaning=_carried),
    Value("empty_handed", "member", (), "condition", "its hands are empty", momentary=True, meaning=_empty_handed),
    Value("pointing", "member", (), "condition", "its arm points", momentary=True, meaning=_pointing),
)  # fmt: skip
