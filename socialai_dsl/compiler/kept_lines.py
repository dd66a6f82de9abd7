"""What of a line's number is the same for the whole episode is worked out once, at the end of the reset."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from socialai_dsl.compiler.assembler import constant
from socialai_dsl.compiler.classes import parts
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.mobility import plans
from socialai_dsl.compiler.registers import Registers, label
from socialai_dsl.program import Op
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.terms import Checked, Drawn, Entity, Line, Term, Type


@dataclass(frozen=True, slots=True)
class Kept:
    """What is kept of a line's number, in a register.

    Attributes:
        register: holds `first`, the least number, and the sum of the values of `parts`, each counted from its least
        value, times its factor.
    """

    register: int
    first: int
    parts: tuple[tuple[Term, int], ...]


@dataclass
class KeptLines:
    """What is kept of the numbers of lines, by speaker and pieces of the line.

    A name that was drawn, the colour of the exit: who speaks of such things has less to compute, or nothing at all.
    """

    checked: Checked
    registers: Registers
    of: dict[tuple[int, tuple[str | Term, ...]], Kept] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._drawn = _never_set(self.checked)

    def reserve(self, bounds: Callable[[Entity, Line], tuple[int, int]]) -> None:
        """Make room for every line that an NPC says in its frame and that has such parts.

        Args:
            bounds: the least and the greatest number of a line (`Lines.bounds`).
        """
        for frame in self.checked.frames:
            speaker = self.checked.entities[frame.entity]
            if speaker.number == 0:
                continue
            for line in parts(frame, Line):
                kept = tuple((part, stride) for part, stride in factors(speaker, line) if self.is_fixed(part))
                if kept and (speaker.number, line.parts) not in self.of:
                    first, _ = bounds(speaker, line)
                    self.of[speaker.number, line.parts] = self._reserved(speaker, first, kept)

    def _reserved(self, speaker: Entity, first: int, kept: tuple[tuple[Term, int], ...]) -> Kept:
        most = first + sum(stride * (part.type.size - 1) for part, stride in kept)
        path = f"{label(speaker)}.line[{sum(number == speaker.number for number, _ in self.of)}]"
        return Kept(self.registers.add(path, Type("int", first, most), fleeting=True), first, kept)

    def is_fixed(self, term: Term) -> bool:
        """Whether a value is drawn or known at reset and nothing changes it afterwards."""
        match term:
            case terms.Const():
                return True
            case terms.Read():
                return term.path in self._drawn
            case terms.FieldOf(name="color"):
                return self.is_fixed(term.entity)
            case _:
                return False

    def work_out(self, to: Expressions) -> None:
        """Emit, at the end of a reset, what is kept."""
        for (speaker, _), kept in self.of.items():
            to.block.span = self.checked.entities[speaker].span
            mark = to.block.taken
            total = constant(kept.first)
            for part, stride in kept.parts:
                value = to.saturated(part)
                if part.type.low != 0:
                    value = to.into_temporary(Op.SUB, value, constant(part.type.low))
                if stride != 1:
                    value = to.into_temporary(Op.MUL, value, constant(stride))
                total = to.into_temporary(Op.ADD, total, value)
            to.block.emit(Op.LOAD, kept.register, total)
            to.block.release(mark)


def factors(speaker: Entity, line: Line) -> Iterator[tuple[Term, int]]:
    """What varies in an NPC's line, its name included, each with how many lines apart two values of it are."""
    stride = 1
    for part in reversed((speaker.name or "", *line.parts)):
        if not isinstance(part, str | terms.Const):
            yield part, stride
            stride *= part.type.size


def _never_set(checked: Checked) -> frozenset[str]:
    """Registers that a reset fills and no rule sets."""
    filled = {item.path for item in checked.setup if isinstance(item, Drawn)}
    filled -= {belief.path for belief in checked.beliefs}
    return frozenset(filled - {path for plan in plans(checked) for path, _ in plan.sets})
