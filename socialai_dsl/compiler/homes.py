"""What the effect `reset` puts back: where things were, which way and in what they lay, when the episode began."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from socialai_dsl.compiler.assembler import Block, Label, constant
from socialai_dsl.compiler.cells import ROW
from socialai_dsl.compiler.changes import Mobility, numbers_of, plans
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.registers import NOWHERE, Registers, entity_register, label
from socialai_dsl.program import CELL, Field, Op
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.plans import Checked, Entity
from socialai_dsl.semantics.terms import BOOL, Type


@dataclass(frozen=True, slots=True)
class Home:
    """Registers that hold how a thing was at first; None of what cannot change."""

    cell: int | None
    gone: int | None
    facing: int | None
    inside: int | None


class Homes:
    """Makes room for what a `reset` may put back: `NAME.reset.home`, the cell, then `.gone`, `.facing`, `.inside`."""

    def __init__(self, checked: Checked, registers: Registers) -> None:
        self.checked = checked
        mobility = Mobility(checked)
        self.pointing = mobility.pointing
        self.of = {
            number: _reserve(checked.entities[number], mobility, registers, len(checked.entities))
            for number in sorted(set(_named(checked)))
        }

    def save(self, to: Expressions) -> None:
        """Emit, at the end of a reset, that everything is remembered as it is."""
        block = to.block
        for number, home in self.of.items():
            if home.cell is not None:
                _save_cell(block, number, home.cell)
            for register, field in (
                (home.gone, Field.GONE),
                (home.facing, Field.DIR),
                (home.inside, Field.INSIDE),
            ):
                if register is not None:
                    block.emit(Op.LOAD, register, entity_register(number, field))

    def is_fixed(self, thing: Entity) -> bool:
        """Whether nothing but its status can change."""
        points = thing.role == "npc" and self.pointing
        return self.of[thing.number] == Home(None, None, None, None) and not thing.contains and not points

    def put_back(self, block: Block, number: int) -> None:
        """Emit that a thing is where and as it was, and what lay in it lies in it again; its status is left alone."""
        thing, home = self.checked.entities[number], self.of[number]
        own = constant(number)
        if home.cell is not None:
            block.emit(Op.PLACE, own, home.cell)
        if home.gone is not None:
            stays = Label()
            block.test(Op.IF_NE, home.gone, constant(0), stays)
            block.emit(Op.VANISH, own)
            block.bind(stays)
        if home.facing is not None:
            block.emit(Op.SET_FIELD, own, Field.DIR, home.facing)
        if home.inside is not None:
            block.emit(Op.SET_FIELD, own, Field.INSIDE, home.inside)
        if thing.role == "npc" and self.pointing:
            block.emit(Op.SET_FIELD, own, Field.POINTING, constant(0))
        for content in thing.contains:
            self._put_back_into(block, content, number)

    def _put_back_into(self, block: Block, number: int, holder: int) -> None:
        """What lay in a thing at first lies in it again."""
        home = self.of[number]
        assert home.cell is not None, "internal: contents can move"
        assert home.gone is not None, "internal: contents can vanish"
        assert home.inside is not None, "internal: contents lie in something"
        elsewhere = Label()
        block.test(Op.IF_NE, home.gone, constant(0), elsewhere)
        block.test(Op.IF_EQ, home.inside, constant(holder), elsewhere)
        block.emit(Op.PLACE, constant(number), home.cell)
        block.emit(Op.VANISH, constant(number))
        block.emit(Op.SET_FIELD, constant(number), Field.INSIDE, constant(holder))
        block.bind(elsewhere)


def _named(checked: Checked) -> Iterator[int]:
    """What a `reset` names, and what may lie in that."""
    for plan in plans(checked):
        for effect in plan.causes:
            if effect.name == "reset":
                for target in effect.entities:
                    for number in numbers_of(target):
                        yield number
                        yield from checked.entities[number].contains


def _reserve(thing: Entity, mobility: Mobility, registers: Registers, entities: int) -> Home:
    number, path = thing.number, f"{label(thing)}.reset.home"

    def room(suffix: str, type_: Type, changes: bool) -> int | None:
        return registers.add(path + suffix, type_) if changes else None

    return Home(
        cell=room("", terms.CELL, number in mobility.walking | mobility.vanishing),
        gone=room(".gone", BOOL, number in mobility.vanishing),
        facing=room(".facing", terms.DIRECTION, number in mobility.turning),
        inside=room(".inside", Type("entity", 0, entities - 1), number in mobility.contents),
    )


def _save_cell(block: Block, number: int, register: int) -> None:
    """The cell, also of what is not in the room because it lies in something."""
    mark = block.taken
    cell = block.temporary()
    block.emit(Op.MUL, cell, entity_register(number, Field.Y), constant(ROW))
    block.emit(Op.ADD, cell, cell, entity_register(number, Field.X))
    block.emit(Op.ADD, cell, cell, constant(CELL))
    block.emit(Op.MAX, register, cell, constant(NOWHERE))
    block.release(mark)
