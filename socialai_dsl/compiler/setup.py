"""The code of a reset: the room, then every draw and placement in its order, each left alone if a layout pins it."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.behaviour import FOR_EVER
from socialai_dsl.compiler.consequences import ComputedStatuses
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.folding import fold
from socialai_dsl.compiler.homes import Homes
from socialai_dsl.compiler.places import Places
from socialai_dsl.compiler.registers import entity_register, state_names
from socialai_dsl.program import Field, Op, Register
from socialai_dsl.semantics.plans import (
    Checked,
    Coloring,
    Drawn,
    Entity,
    Facing,
    FramePlan,
    Placing,
    RoomPlan,
)
from socialai_dsl.semantics.terms import Term
from socialai_dsl.vocabulary import COLORS

ALL_COLORS = (1 << len(COLORS)) - 1


def reset(to: Expressions, computed: ComputedStatuses, homes: Homes) -> None:
    """Emit everything that happens at reset."""
    checked, registers = to.checked, to.registers
    to.is_bare = True
    _room(to, checked.room)
    for entity in checked.entities:
        if status := entity.status if entity.role == "object" else entity.kind_code:
            to.block.emit(Op.LOAD, entity_register(entity.number, Field.STATUS), constant(status))
    for item in checked.setup:
        mark = to.block.taken
        _item(to, item)
        to.block.release(mark)
    for entity in checked.entities:
        _drawn_status(to, entity)
    for frame in checked.frames:
        if start := first_state(frame):
            to.block.emit(Op.LOAD, registers.by_path[f"{frame.member}.frame"], constant(start))
    for item in checked.remembered:
        _not_yet(to, registers.by_path[item.path])
    computed.fix(to)
    homes.save(to)
    if to.has_drawn:  # everything is drawn once more when the code has run, into the bare room
        to.block.emit(Op.DRAW_ROOM, 0)


def require(to: Expressions) -> None:
    """Emit whether the room is as required."""
    rejected = Label()
    for sited in to.checked.require:
        to.sited_condition(sited, rejected)
    if to.checked.require:
        to.block.emit(Op.LOAD, Register.ACCEPTED, constant(1))
    to.block.bind(rejected)


def _drawn_status(to: Expressions, entity: Entity) -> None:
    """The drawn status of an object, or the drawn kind of an NPC, once everything else is set up."""
    drawn = entity.initial if entity.role == "object" else entity.kind_drawn
    if drawn is None:
        return
    pinned = Label()
    register = entity_register(entity.number, Field.STATUS)
    mark = to.block.taken
    to.block.span = entity.span
    to.block.test(Op.IF_UNPINNED, register, 0, pinned)
    to.block.emit(Op.LOAD, register, to.value(drawn))
    to.block.bind(pinned)
    to.block.release(mark)


def _not_yet(to: Expressions, register: int) -> None:
    """A value that nothing was remembered for yet, where 0 is no value of it."""
    name = next(name for name in to.registers.names if name.register == register)
    if name.low <= 0 <= name.high:
        return
    pinned = Label()
    to.block.test(Op.IF_UNPINNED, register, 0, pinned)
    to.block.emit(Op.LOAD, register, constant(name.low))
    to.block.bind(pinned)


def first_state(frame: FramePlan) -> int:
    """The number of the state a frame begins in: entries of `steps` with `for: 0` are left out."""
    if frame.states:
        return state_names(frame).index(frame.start)
    durations = [step.duration for step in frame.steps] + [FOR_EVER]
    return next(k for k, duration in enumerate(durations) if duration != 0)


def _room(to: Expressions, room: RoomPlan) -> None:
    sides = [
        _side(to, Register.WIDTH, "room.width", room.width),
        _side(to, Register.HEIGHT, "room.height", room.height),
    ]
    to.block.emit(Op.MAKE_ROOM, *sides)


def _side(to: Expressions, register: Register, path: str, bounds: tuple[int, int]) -> int:
    block = to.block
    low, high = bounds
    result = block.temporary()
    pinned, done = Label(), Label()
    block.test(Op.IF_UNPINNED, register, 0, pinned)
    if low == high:
        block.emit(Op.LOAD, result, constant(low))
    else:
        block.emit(Op.DRAW, result, constant(high - low + 1), to.sites.row(path))
        block.emit(Op.ADD, result, result, constant(low))
    block.skip(done)
    block.bind(pinned)
    block.emit(Op.MAX, result, register, constant(low))
    block.emit(Op.MIN, result, result, constant(high))
    block.bind(done)
    return result


def _item(to: Expressions, item: Drawn | Coloring | Placing | Facing) -> None:
    block = to.block
    pinned = Label()
    match item:
        case Drawn():
            register = to.registers.by_path[item.path]
            block.span = item.value.span
            block.test(Op.IF_UNPINNED, register, 0, pinned)
            block.emit(Op.LOAD, register, to.sited_value(item.value))
        case Coloring():
            _color(to, item, pinned)
        case Placing():
            block.span = item.span
            block.test(Op.IF_UNPINNED, entity_register(item.entity, Field.X), 0, pinned)
            _only_if(to, item.when, item.site, pinned)
            Places(to).put(item)
        case Facing():
            _facing(to, item, pinned)
    block.bind(pinned)


def _only_if(to: Expressions, when: Term | None, site: str, otherwise: Label) -> None:
    """Of several ways to set up a thing, the one whose condition holds."""
    if when is not None:
        to.site = site
        to.condition(fold(when, to.facts, to.classes), otherwise)


def _color(to: Expressions, item: Coloring, pinned: Label) -> None:
    block = to.block
    block.span = item.span
    register = entity_register(item.entity, Field.COLOR)
    block.test(Op.IF_UNPINNED, register, 0, pinned)
    _only_if(to, item.when, item.site, pinned)
    if item.value is not None:
        block.emit(Op.LOAD, register, to.sited_value(item.value))
        return
    site = to.sites.row(item.site, item.number)
    if not item.distinct_from and not _distinct_later(to.checked, item):
        block.emit(Op.DRAW, register, constant(len(COLORS)), site)
        return
    left = block.temporary()
    block.emit(Op.LOAD, left, constant(0))
    for other in item.distinct_from:
        block.emit(Op.SET_BIT, left, entity_register(other, Field.COLOR))
    for other in _distinct_later(to.checked, item):
        # Only a colour that a layout pins is known before its turn.
        given, following = Label(), Label()
        block.test(Op.IF_UNPINNED, entity_register(other, Field.COLOR), 0, given)
        block.skip(following)
        block.bind(given)
        block.emit(Op.SET_BIT, left, entity_register(other, Field.COLOR))
        block.bind(following)
    block.emit(Op.SUB, left, constant(ALL_COLORS), left)
    block.emit(Op.PICK_BIT, register, left, site)


def _distinct_later(checked: Checked, item: Coloring) -> list[int]:
    """Members of the group that get their distinct colours after this one."""
    return [
        other.entity
        for other in checked.setup
        if isinstance(other, Coloring) and item.entity in other.distinct_from
    ]


def _facing(to: Expressions, item: Facing, pinned: Label) -> None:
    block = to.block
    block.span = item.span
    register = entity_register(item.entity, Field.DIR)
    block.test(Op.IF_UNPINNED, register, 0, pinned)
    _only_if(to, item.when, item.site, pinned)
    if item.toward is not None:
        to.site = item.site
        block.emit(Op.QUADRANT, register, constant(item.entity), to.value(item.toward))
    elif item.value is not None:
        block.emit(Op.LOAD, register, to.sited_value(item.value))
    else:
        block.emit(Op.DRAW, register, constant(4), to.sites.row(item.site))
