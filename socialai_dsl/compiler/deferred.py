"""Rules of `first` with a body action of their own: the rest of them waits, with its values, until that is done."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from socialai_dsl.compiler.assembler import constant
from socialai_dsl.compiler.effects import Operands
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.lines import Lines
from socialai_dsl.compiler.registers import Registers
from socialai_dsl.program import Op
from socialai_dsl.semantics.plans import Entity, FramePlan, RulePlan
from socialai_dsl.semantics.terms import Const, Term, Type


@dataclass(frozen=True, slots=True)
class _Kept:
    """A register that keeps a value, and the range of the value; a known value needs no register (None)."""

    register: int | None
    low: int
    high: int


@dataclass(frozen=True, slots=True)
class _KeptRule:
    sets: tuple[_Kept, ...]
    targets: tuple[tuple[_Kept, ...], ...]
    values: tuple[_Kept | None, ...]
    line: _Kept | None

    def registers(self) -> Iterator[int]:
        """Those that are in use."""
        every = [*self.sets, *(kept for targets in self.targets for kept in targets), *self.values, self.line]
        return (kept.register for kept in every if kept is not None and kept.register is not None)


class Deferred:
    """The rules of a frame that are done in two parts; `MEMBER.kept[k]` hold values, `MEMBER.pending` which rule.

    Attributes:
        rules: they, in the order of their numbers in `MEMBER.pending`, from 1; 0: none.
    """

    def __init__(self, frame: FramePlan, speaker: Entity, registers: Registers, lines: Lines) -> None:
        self.member, self.speaker, self.registers, self.lines = frame.member, speaker, registers, lines
        self.rules = [rule for state in frame.states for rule in state.first if _has_more(rule)]
        self._count = 0
        self._kept = [self._room(rule) for rule in self.rules]
        self._pending = (
            registers.add(f"{frame.member}.pending", Type("int", 0, len(self.rules)), fleeting=True)
            if self.rules
            else 0
        )

    def note(self, to: Expressions, rule: RulePlan, operands: Operands) -> None:
        """Emit that the rest of a rule is to be carried out later, with these values."""
        kept = self._kept[self.rules.index(rule)]
        for part, operand in _pairs(kept, operands):
            if part.register is not None:
                _keep(to, part, operand)
        to.block.emit(Op.LOAD, self._pending, constant(1 + self.rules.index(rule)))

    def is_pending(self, rule: RulePlan) -> tuple[int, int]:
        """The operands that are equal if this rule is to be carried out."""
        return self._pending, constant(1 + self.rules.index(rule))

    def recall(self, to: Expressions, rule: RulePlan) -> Operands:
        """Emit that the values are fetched and forgotten."""
        kept = self._kept[self.rules.index(rule)]

        def fetched(parts: Sequence[_Kept]) -> tuple[int, ...]:
            return tuple(_fetch(to, part) for part in parts)

        operands = Operands(
            tuple(to.into_temporary(Op.LOAD, operand) for operand in fetched(kept.sets)),
            tuple(map(fetched, kept.targets)),
            tuple(None if part is None else _fetch(to, part) for part in kept.values),
            None if kept.line is None else _fetch(to, kept.line),
        )
        for register in (*kept.registers(), self._pending):
            to.block.emit(Op.LOAD, register, constant(0))
        return operands

    def _room(self, rule: RulePlan) -> _KeptRule:
        sets = []
        for path, _ in rule.sets:
            name = next(name for name in self.registers.names if name.path == path)
            sets.append(self._kept_range(name.low, name.high))
        line = None if rule.say is None else self._kept_range(*self.lines.bounds(self.speaker, rule.say))
        return _KeptRule(
            tuple(sets),
            tuple(tuple(self._kept_term(entity) for entity in effect.entities) for effect in rule.causes),
            tuple(None if e.value is None else self._kept_term(e.value) for e in rule.causes),
            line,
        )

    def _kept_term(self, term: Term) -> _Kept:
        if isinstance(term, Const):
            return _Kept(None, term.value, term.value)
        type_ = self.registers.cut(term.type)
        return self._kept_range(type_.low, type_.high)

    def _kept_range(self, low: int, high: int) -> _Kept:
        if low == high:
            return _Kept(None, low, high)
        path = f"{self.member}.kept[{self._count}]"
        self._count += 1
        return _Kept(
            self.registers.add(path, Type("int", min(0, low), max(0, high)), fleeting=True), low, high
        )


def _has_more(rule: RulePlan) -> bool:
    more = rule.sets or rule.causes or rule.say is not None or rule.goto or rule.goto_now
    return rule.do is not None and bool(more)


def _pairs(kept: _KeptRule, operands: Operands) -> Iterator[tuple[_Kept, int]]:
    yield from zip(kept.sets, operands.sets, strict=True)
    for parts, targets in zip(kept.targets, operands.targets, strict=True):
        yield from zip(parts, targets, strict=True)
    for part, value in zip(kept.values, operands.values, strict=True):
        if part is not None and value is not None:
            yield part, value
    if kept.line is not None and operands.line is not None:
        yield kept.line, operands.line


def _keep(to: Expressions, kept: _Kept, operand: int) -> None:
    assert kept.register is not None, "internal: a known value is not kept"
    mark = to.block.taken
    to.block.emit(Op.LOAD, kept.register, _cut(to, operand, kept))
    to.block.release(mark)


def _fetch(to: Expressions, kept: _Kept) -> int:
    return constant(kept.low) if kept.register is None else _cut(to, kept.register, kept)


def _cut(to: Expressions, operand: int, kept: _Kept) -> int:
    """A value within its range, also where a layout has written the register."""
    least = to.into_temporary(Op.MAX, operand, constant(kept.low))
    return to.into_temporary(Op.MIN, least, constant(kept.high))
