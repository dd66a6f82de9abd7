"""What emits the code of expressions, as the parts of the language see it; `expressions` is the whole."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

from socialai_dsl.compiler.assembler import LARGEST, Block, Label, Sites, constant
from socialai_dsl.compiler.changes import leaving
from socialai_dsl.compiler.classes import Classes
from socialai_dsl.compiler.folding import TRUE, Facts, fold, substitute
from socialai_dsl.compiler.registers import Registers
from socialai_dsl.program import Op
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.plans import Checked
from socialai_dsl.semantics.terms import Const, Term


@dataclass(frozen=True, slots=True)
class LoopCell:
    """The cell that a loop is at: operands of its x, its y and itself. `name` is its variable; empty for `here`."""

    name: str
    x: int
    y: int
    cell: int


class Emitter(ABC):
    """Emits code into one block: what each kind of expression is emitted with; `Expressions` knows them all.

    Attributes:
        block: where to. site: path of the picks of the value being emitted. facts: what is known. inbox: first register
        of the inbox of the member whose frame this is, or -1.
        loop: the cell that the loop over cells is at, outside of loops None.
        failed: label to skip to when a pick finds nothing; None: it takes the first item.
        is_bare: whether the board does not show what stands in the room, as while a room is set up.
        has_drawn: whether some of the code had to have it shown.
    """

    def __init__(
        self,
        block: Block,
        checked: Checked,
        registers: Registers,
        classes: Classes,
        sites: Sites,
        inbox: int = -1,
    ) -> None:
        self.block, self.checked, self.registers = block, checked, registers
        self.classes, self.sites, self.inbox = classes, sites, inbox
        self.site = ""
        self.facts = Facts()
        self.loop: LoopCell | None = None
        self.failed: Label | None = None
        self.is_bare = False
        self.has_drawn = False

    @abstractmethod
    def test(self, term: Term, otherwise: Label) -> None:
        """Emit a condition; `condition` also gives back the temporaries that this takes."""

    @abstractmethod
    def value(self, term: Term) -> int:
        """Emit what computes the term; the operand it is in afterwards."""

    @cached_property
    def leaving(self) -> frozenset[int]:
        """The entities of which it is still written down where they were when they are out of the room."""
        return leaving(self.checked)

    def condition(self, term: Term, otherwise: Label) -> None:
        """Fall through if `term` holds, else skip to `otherwise`."""
        mark = self.block.taken
        self.test(term, otherwise)
        self.block.release(mark)

    def one_of(self, op: Op, left: int, numbers: frozenset[int], otherwise: Label) -> None:
        """Whether a class (or state) is among these numbers."""
        if not numbers:
            self.block.skip(otherwise)
            return
        found = Label()
        *rest, last = (
            n if op == Op.IF_HEARD else constant(n) for n in sorted(numbers)
        )  # IF_HEARD takes the class itself
        for number in rest:
            following = Label()
            self.block.test(op, left, number, following)
            self.block.skip(found)
            self.block.bind(following)
        self.block.test(op, left, last, otherwise)
        self.block.bind(found)

    def saturated(self, term: Term) -> int:
        """The operand of a value that is cut to its type: of things that are gone, places and distances are odd."""
        value = self.value(term)
        if term.type.kind != "int" or isinstance(term, Const | terms.Read | terms.World):
            return value
        value = self.into_temporary(Op.MAX, value, self.number(term.type.low))
        return self.into_temporary(Op.MIN, value, self.number(term.type.high))

    def number(self, value: int) -> int:
        """The operand of a known value: a constant, or computed where it is too large for one."""
        if -LARGEST <= value <= LARGEST:
            return constant(value)
        quotient, rest = divmod(value, LARGEST)
        product = self.into_temporary(Op.MUL, self.number(quotient), constant(LARGEST))
        return self.into_temporary(Op.ADD, product, constant(rest))

    def into_temporary(self, op: Op, b: int, c: int = 0) -> int:
        """A fresh temporary with the result of an instruction."""
        result = self.block.temporary()
        self.block.emit(op, result, b, c)
        return result

    def instance(self, term: terms.Quantified, item: Const) -> Term:
        """The condition of a quantifier for one of its items."""
        return fold(substitute(term.condition or TRUE, term.variable, item), self.facts, self.classes)
