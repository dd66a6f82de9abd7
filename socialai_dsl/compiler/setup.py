"""Reset code: the room, then every draw and placement in order, except those that a layout pins; computed statuses."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import Label, entity_register, state_names
from socialai_dsl.compiler.cells import (
    EVERYWHERE,
    conjuncts,
    fill_rectangle,
    is_about_cell,
    keep_each,
    keep_shape,
)
from socialai_dsl.compiler.effects import Homes
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.folding import fold, mentions
from socialai_dsl.compiler.hands import into_hands
from socialai_dsl.compiler.step_order import first_entry
from socialai_dsl.grammar.ast import every
from socialai_dsl.program import Counting, Field, Op, Register, Side, constant
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.facts import TermFacts, When
from socialai_dsl.semantics.free_cells import EXACT
from socialai_dsl.semantics.plans import (
    CheckedScenario,
    Coloring,
    ComputedStatus,
    Drawn,
    Entity,
    Facing,
    FramePlan,
    Placing,
    Region,
    RoomPlan,
)
from socialai_dsl.semantics.terms import Term
from socialai_dsl.vocabulary import COLORS

# -- placements: a set of cells, one of them drawn --------------------------------------------------------------


def _put(to: Expressions, placing: Placing) -> None:
    """The draw of a cell and the putting of the entity there, or that it lies in something."""
    block = to.block
    block.span, to.site = placing.span, placing.where_site
    if placing.inside is not None:
        put_in = _in_hands if placing.in_hands else _inside
        put_in(to, placing.entity, placing.inside)
        return
    cell = block.temporary(2)
    if placing.at is not None:
        for i, coordinate in enumerate(placing.at):
            _coordinate(to, cell + i, coordinate, to.checked.room.canvas[i])
    elif placing.nowhere:
        for target in (cell, cell + 1):
            block.emit(Op.LOAD, target, constant(-1))
    else:
        boards = block.boards_taken
        board = _union(to, placing.regions, placing.overlap)
        if not placing.overlap:
            block.emit(Op.B_FREE, board)
        if placing.where is not None:
            _keep(to, board, placing.where)
        block.emit(Op.PICK_CELL, cell, board, to.sites.row(placing.site, placing.number))
        block.release_boards(boards)
    block.emit(Op.PUT, constant(placing.entity), cell)


def _inside(to: Expressions, content: int, holder: Term) -> None:
    """On the cell of what it lies in, but not in the room."""
    block = to.block
    cell = block.temporary(2)
    number = to.value(holder)
    block.emit(Op.FIELD, cell, number, Field.X)
    block.emit(Op.FIELD, cell + 1, number, Field.Y)
    block.emit(Op.PUT, constant(content), cell)
    block.emit(Op.VANISH, constant(content))
    block.emit(Op.SET_FIELD, constant(content), Field.INSIDE, number)


def _in_hands(to: Expressions, content: int, carrier: Term) -> None:
    """Not in the room, and carried, unless these hands are full already."""
    block = to.block
    nowhere = block.temporary(2)
    for target in (nowhere, nowhere + 1):
        block.emit(Op.LOAD, target, constant(-1))
    block.emit(Op.PUT, constant(content), nowhere)
    into_hands(to, constant(content), to.value(carrier))


def _coordinate(to: Expressions, target: int, coordinate: Term, size: int) -> None:
    """A coordinate, kept on the canvas where it comes from something that may be anywhere."""
    block = to.block
    block.emit(Op.LOAD, target, to.value(coordinate))
    somewhere = any(
        mentions(coordinate, kind) for kind in (terms.FieldOf, terms.Measure, terms.Quantification)
    )
    if somewhere or coordinate.type.low < -1 or coordinate.type.high >= size:
        block.emit(Op.MAX, target, target, constant(-1))
        block.emit(Op.MIN, target, target, constant(size - 1))


def _union(to: Expressions, regions: tuple[Region, ...], overlap: bool) -> int:
    board = _region(to, regions[0], overlap)
    for region in regions[1:]:
        to.block.emit(Op.B_OR, board, _region(to, region, overlap))
        to.block.release_boards(board + 1)
    return board


def _region(to: Expressions, region: Region, overlap: bool) -> int:
    block = to.block
    board = block.board()
    match region.name:
        case "anywhere":
            block.emit(Op.B_FLOOR, board)
        case "wall":
            _wall(to, board, region)
        case "next_to":
            block.emit(Op.B_NEXT_TO, board, to.value(region.args[0]))
            _only_floor(to, board)
        case "in_front_of":
            block.emit(Op.B_IN_FRONT_OF, board, to.value(region.args[0]))
            _only_floor(to, board)
        case _:
            _rectangle(to, board, region, overlap and region.name in EXACT)
    return board


def _wall(to: Expressions, board: int, region: Region) -> None:
    """One side of the room, known or drawn (then `region.args` holds it as a number, like Side)."""
    block = to.block
    if region.side is not None:
        block.emit(Op.B_WALL, board, Side[region.side.upper()], region.margin)
        return
    drawn = to.value(region.args[0])
    done = Label()
    *others, last = Side
    for side in others:
        with block.when(Op.IF_EQ, drawn, constant(side), then=done):
            block.emit(Op.B_WALL, board, side, region.margin)
    block.emit(Op.B_WALL, board, last, region.margin)
    block.bind(done)


def _only_floor(to: Expressions, board: int) -> None:
    floor = to.block.board()
    to.block.emit(Op.B_FLOOR, floor)
    to.block.emit(Op.B_AND, board, floor)
    to.block.release_boards(floor)


def _rectangle(to: Expressions, board: int, region: Region, built: bool) -> None:
    """Halves, rows, columns and rectangles; with `built` also where something is built."""
    block = to.block
    with block.scratch():
        bounds = list(EVERYWHERE)
        if region.name in ("column", "row"):
            at = 0 if region.name == "column" else 2
            bounds[at] = bounds[at + 1] = to.value(region.args[0])
        elif region.name == "rect":
            x0, y0, x1, y1 = (to.value(arg) for arg in region.args)
            bounds = [x0, x1, y0, y1]
        else:
            _half(to, region.name, bounds)
        fill_rectangle(block, board, bounds, Counting.BUILT if built else Counting.FLOOR)


def _half(to: Expressions, name: str, bounds: list[int]) -> None:
    """left_half is x < W // 2, right_half x > W // 2; top and bottom likewise: the middle line is in neither."""
    block = to.block
    middle, beyond = block.temporary(), block.temporary()
    size = Register.WIDTH if name in ("left_half", "right_half") else Register.HEIGHT
    block.emit(Op.DIV, middle, size, constant(2))
    lower = name in ("left_half", "top_half")
    block.emit(Op.SUB if lower else Op.ADD, beyond, middle, constant(1))
    bounds[(0 if size == Register.WIDTH else 2) + (1 if lower else 0)] = beyond


def _keep(to: Expressions, board: int, where: Term) -> None:
    """Take out of `board` the cells for which `where` is false."""
    for part in conjuncts(to, where):
        if not is_about_cell(part):
            _keep_all(to, board, part)
        elif not keep_shape(to, board, part):
            _keep_other(to, board, part)


def _keep_other(to: Expressions, board: int, where: Term) -> None:
    match where:
        case terms.Not():
            held = _copy(to, board)
            _keep(to, held, where.arg)
            to.block.emit(Op.B_WITHOUT, board, held)
            to.block.release_boards(held)
        case terms.Logic():
            _keep_either(to, board, where.args)
        case terms.Quantification(op="any", cells=False):
            _keep_either(to, board, tuple(to.instance(where, item) for item in where.items))
        case _:
            keep_each(to, board, where)


def _keep_all(to: Expressions, board: int, condition: Term) -> None:
    """Take out every cell if the condition, which is the same for all, is false."""
    block = to.block
    drop, done = Label(), Label()
    to.condition(condition, drop)
    block.skip(done)
    block.bind(drop)
    block.emit(Op.B_WITHOUT, board, board)
    block.bind(done)


def _copy(to: Expressions, board: int) -> int:
    copy = to.block.board()
    to.block.emit(Op.B_COPY, copy, board)
    return copy


def _keep_either(to: Expressions, board: int, args: tuple[Term, ...]) -> None:
    rest = _copy(to, board)
    for arg in args:
        held = _copy(to, rest)
        _keep(to, held, arg)
        to.block.emit(Op.B_WITHOUT, rest, held)
        to.block.release_boards(held)
    to.block.emit(Op.B_WITHOUT, board, rest)
    to.block.release_boards(rest)


# -- the reset -----------------------------------------------------------------------------------------------


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
        with to.block.scratch():
            _item(to, item)
    for entity in checked.entities:
        _drawn_status(to, entity)
    for frame in checked.frames:
        if start := first_state(frame):
            to.block.emit(Op.LOAD, registers.by_path[f"{frame.member}.frame"], constant(start))
    for item in checked.remembered:
        _not_yet(to, item.path)
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
    register = entity_register(entity.number, Field.STATUS)
    with to.block.scratch():
        to.block.span = entity.span
        with to.block.when(Op.IF_UNPINNED, register, 0):
            to.block.emit(Op.LOAD, register, to.value(drawn))


def _not_yet(to: Expressions, path: str) -> None:
    """A value that nothing was remembered for yet, where 0 is no value of it."""
    name = to.registers.named(path)
    if name.low <= 0 <= name.high:
        return
    with to.block.when(Op.IF_UNPINNED, name.register, 0):
        to.block.emit(Op.LOAD, name.register, constant(name.low))


def first_state(frame: FramePlan) -> int:
    """The number of the state a frame begins in: entries of `steps` with `for: 0` are left out."""
    if frame.states:
        return state_names(frame).index(frame.start)
    return first_entry(frame.order[0]) if frame.order else len(frame.steps)


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
    done = Label()
    with block.when(Op.IF_UNPINNED, register, 0, then=done):
        if low == high:
            block.emit(Op.LOAD, result, constant(low))
        else:
            block.emit(Op.DRAW, result, constant(high - low + 1), to.sites.row(path))
            block.emit(Op.ADD, result, result, constant(low))
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
            _put(to, item)
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


def _distinct_later(checked: CheckedScenario, item: Coloring) -> list[int]:
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


# -- statuses that follow from conditions ----------------------------------------------------------------------


class ComputedStatuses:
    """The computed statuses of a scenario: those that a reset decides for good, and those that are settled.

    Attributes:
        read: paths of registers on whose change statuses are settled again; none where that is done all the time.
    """

    def __init__(self, checked: CheckedScenario) -> None:
        facts = TermFacts(checked)
        whens = [(item, facts.when(item.condition.term)) for item in checked.computed]
        for_good = [when == When.NEVER and not facts.touched(item.entity) for item, when in whens]
        self.fixed = tuple(item for (item, _), fixed in zip(whens, for_good, strict=True) if fixed)
        self.settled = tuple(item for (item, _), fixed in zip(whens, for_good, strict=True) if not fixed)
        self.settle_always = any(when == When.ANY_TIME for _, when in whens)
        conditions = () if self.settle_always else [item.condition.term for item in self.settled]
        self.read = frozenset(read.path for read in every(terms.Read, conditions))

    def fix(self, to: Expressions) -> None:
        """Emit those that never change, each unless a layout gives the status."""
        for item in self.fixed:
            to.block.span = item.condition.span
            with to.block.when(Op.IF_UNPINNED, entity_register(item.entity, Field.STATUS), 0):
                _settle(to, item)

    def settle(self, to: Expressions) -> None:
        """Emit those that can change, each after those it reads."""
        for item in self.settled:
            _settle(to, item)


def _settle(to: Expressions, item: ComputedStatus) -> None:
    """On while the condition holds; off where it was on and the condition does not hold; else left alone."""
    block = to.block
    status = entity_register(item.entity, Field.STATUS)
    entity, on, off = (constant(number) for number in (item.entity, item.on, item.off))
    false, done = Label(), Label()
    to.sited_condition(item.condition, false)
    block.test(Op.IF_NE, status, on, done)
    block.emit(Op.BECOME, entity, on)
    block.skip(done)
    block.bind(false)
    block.test(Op.IF_EQ, status, on, done)
    block.emit(Op.BECOME, entity, off)
    block.bind(done)
