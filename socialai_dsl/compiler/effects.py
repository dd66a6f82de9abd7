"""What a rule or step does to the world: count, set, cause, say; all values are computed before anything changes."""

from __future__ import annotations

from collections.abc import Callable

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.lines import Lines
from socialai_dsl.compiler.registers import Registers
from socialai_dsl.program import Field, Op
from socialai_dsl.semantics.terms import Const, Effect, Entity, RulePlan, Sited, StepPlan, Term

_TARGETS = {"open": "open", "close": "closed", "lock": "locked", "unlock": "closed"}


class Effects:
    """Emits effects through `to`."""

    def __init__(self, to: Expressions, lines: Lines) -> None:
        self.to, self.lines = to, lines
        self.checked, self.registers = to.checked, to.registers

    def emit(
        self,
        what: RulePlan | StepPlan,
        counter: int,
        failed: Label,
        speaker: Entity | None = None,
        body: Callable[[], None] | None = None,
    ) -> None:
        """Compute all values first (a pick that finds nothing skips to `failed`), then act: `body`, set, cause, say."""
        to, block = self.to, self.to.block
        to.failed = failed
        values = [(path, self._kept(sited)) for path, sited in what.sets]
        entities = [self._targets(effect) for effect in what.causes]
        line = None
        if what.say is not None:
            assert speaker is not None, "internal: nobody is there to say it"
            line = self.lines.say(to, speaker, what.say)
        to.failed = None
        block.span = what.span
        block.emit(Op.COUNT, counter)
        if body is not None:
            body()
            block.span = what.span
        for path, value in values:
            store(to.registers, block.emit, path, value)
        for effect, targets in zip(what.causes, entities, strict=True):
            for term, entity in zip(effect.entities, targets, strict=True):
                self._cause(effect, term, entity)
        if line is not None and speaker is not None:
            block.emit(Op.SAY, constant(speaker.number), line)

    def _targets(self, effect: Effect) -> list[int]:
        self.to.site = effect.site
        return [self.to.value(entity) for entity in effect.entities]

    def _kept(self, sited: Sited) -> int:
        """A value in a temporary, so that no later effect of the same rule can change it."""
        return self.to.into_temporary(Op.LOAD, self.to.sited_value(sited))

    def _cause(self, effect: Effect, term: Term, entity: int) -> None:
        block = self.to.block
        block.span = effect.span
        if effect.name == "vanish":
            block.emit(Op.VANISH, entity)
        elif effect.name == "become":
            assert effect.value is not None
            block.emit(Op.BECOME, entity, self.to.value(effect.value))
        elif effect.name == "reset":
            self._reset(term, entity)
        else:
            self._change(effect, term, entity)

    def _change(self, effect: Effect, term: Term, entity: int) -> None:
        """Open, close, lock; unlock only what is locked."""
        block = self.to.block
        thing = self.checked.entities[_numbers(term)[0]]
        assert thing.type is not None, "internal: only objects have a status"
        states = thing.type.states
        done = Label()
        if effect.name == "unlock":
            status = self.to.into_temporary(Op.FIELD, entity, Field.STATUS)
            block.test(Op.IF_EQ, status, constant(states.index("locked")), done)
        block.emit(Op.BECOME, entity, constant(states.index(_TARGETS[effect.name])))
        block.bind(done)

    def _reset(self, term: Term, entity: int) -> None:
        """Back to the initial status, which may differ from one object of a group to the next."""
        block = self.to.block
        numbers = _numbers(term)
        statuses = {number: self._initial(self.checked.entities[number]) for number in numbers}
        done = Label()
        for number in numbers[:-1]:
            if len(set(statuses.values())) == 1:
                break
            following = Label()
            block.test(Op.IF_EQ, entity, constant(number), following)
            block.emit(Op.BECOME, entity, statuses[number])
            block.skip(done)
            block.bind(following)
        block.emit(Op.BECOME, entity, statuses[numbers[-1]])
        block.bind(done)

    def _initial(self, thing: Entity) -> int:
        return constant(thing.status) if thing.initial is None else self.to.value(thing.initial)


def store(registers: Registers, emit: Callable[..., None], path: str, value: int) -> None:
    """Put a temporary into a register; those that hold plain integers saturate."""
    name = next(name for name in registers.names if name.path == path)
    if not name.values:
        emit(Op.MAX, value, value, constant(name.low))
        emit(Op.MIN, value, value, constant(name.high))
    emit(Op.LOAD, name.register, value)


def _numbers(term: Term) -> list[int]:
    """The entities that a term may name."""
    return [term.value] if isinstance(term, Const) else list(range(term.type.low, term.type.high + 1))
