"""What a rule or step does to the world: count, set, cause, say; all values are computed before anything changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.changes import numbers_of
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.homes import Homes
from socialai_dsl.compiler.lines import Lines
from socialai_dsl.compiler.registers import Registers, label
from socialai_dsl.program import TEMPORARY, Field, Op
from socialai_dsl.semantics.plans import Effect, Entity, RulePlan, StepPlan
from socialai_dsl.semantics.terms import Term

_TARGETS = {"open": "open", "close": "closed", "lock": "locked", "reveal": "opened"}


@dataclass(frozen=True, slots=True)
class Operands:
    """Where the values are that a rule or step needs.

    Attributes:
        sets: of each register that is set. targets: for each effect, of what it is about. values: for each effect, of
        its value, if it has one. line: of what is said, if anything is.
    """

    sets: tuple[int, ...]
    targets: tuple[tuple[int, ...], ...]
    values: tuple[int | None, ...]
    line: int | None


class Effects:
    """Emits effects through `to`."""

    def __init__(self, to: Expressions, lines: Lines, homes: Homes) -> None:
        self.to, self.lines, self.homes = to, lines, homes
        self.checked, self.registers = to.checked, to.registers

    def emit(
        self, what: RulePlan | StepPlan, counter: int, failed: Label, speaker: Entity | None = None
    ) -> None:
        """Compute all values first (a pick that finds nothing skips to `failed`), then act: set, cause, say."""
        operands = self.compute(what, failed, speaker)
        self.to.block.emit(Op.COUNT, counter)
        self.carry_out(what, operands, speaker)

    def compute(self, what: RulePlan | StepPlan, failed: Label, speaker: Entity | None) -> Operands:
        """Compute all values; a pick that finds nothing skips to `failed`."""
        to = self.to
        to.failed = failed
        sets = tuple(to.sited_copy(sited) for _, sited in what.sets)
        targets: list[tuple[int, ...]] = []
        values: list[int | None] = []
        for effect in what.causes:
            to.site = effect.site
            targets.append(tuple(self._steady(to.value(entity), what) for entity in effect.entities))
            values.append(None if effect.value is None else self._steady(to.value(effect.value), what))
        line = None
        if what.say is not None:
            assert speaker is not None, "internal: nobody is there to say it"
            line = self._steady(self.lines.say(to, speaker, what.say), what)
        to.failed = None
        to.block.span = what.span
        return Operands(sets, tuple(targets), tuple(values), line)

    def carry_out(self, what: RulePlan | StepPlan, operands: Operands, speaker: Entity | None) -> None:
        """Set, reward, cause, say."""
        block = self.to.block
        for (path, _), operand in zip(what.sets, operands.sets, strict=True):
            store(self.registers, block.emit, path, operand)
        if isinstance(what, RulePlan) and what.reward:
            block.emit(Op.REWARD, constant(what.reward))
        for effect, targets, value in zip(what.causes, operands.targets, operands.values, strict=True):
            for term, entity in zip(effect.entities, targets, strict=True):
                self._cause(effect, term, entity, value)
        if operands.line is not None and speaker is not None:
            self.lines.speak(self.to, speaker, operands.line)

    def _steady(self, value: int, what: RulePlan | StepPlan) -> int:
        """The operand of a value that nothing the rule sets can change."""
        is_set = value in {self.registers.by_path[path] for path, _ in what.sets}
        return self.to.into_temporary(Op.LOAD, value) if is_set else value

    def _cause(self, effect: Effect, term: Term, entity: int, value: int | None) -> None:
        block = self.to.block
        block.span = effect.span
        if effect.name == "vanish":
            block.emit(Op.VANISH, entity)
        elif effect.name == "reset":
            self._reset(term, entity)
        elif value is None:
            self._change(effect, term, entity)
        elif effect.name == "become":
            block.emit(Op.BECOME, entity, value)
        elif effect.name == "move_into":
            block.emit(Op.PLACE, entity, value)
            block.emit(Op.VANISH, entity)
            block.emit(Op.SET_FIELD, entity, Field.INSIDE, value)
        else:
            block.emit(Op.PLACE, entity, self._cell(effect, value))

    def _cell(self, effect: Effect, value: int) -> int:
        """Where to put something: what has left the room is on no cell any more."""
        assert effect.value is not None, "internal: `put` says where"
        entity = effect.value.type.kind == "entity"
        return self.to.into_temporary(Op.CELL_OF, value) if entity else value

    def _change(self, effect: Effect, term: Term, entity: int) -> None:
        """Open, close, lock, reveal; unlock only what is locked."""
        block = self.to.block
        thing = self.checked.entities[numbers_of(term)[0]]
        assert thing.type is not None, "internal: only objects have a status"
        states = thing.type.states
        if effect.name != "unlock":
            block.emit(Op.BECOME, entity, constant(states.index(_TARGETS[effect.name])))
            return
        done = Label()
        status = self.to.into_temporary(Op.FIELD, entity, Field.STATUS)
        block.test(Op.IF_EQ, status, constant(states.index("locked")), done)
        block.emit(Op.BECOME, entity, constant(thing.type.unlocked))
        block.bind(done)

    def _reset(self, term: Term, entity: int) -> None:
        """Back to what it was at first, which may differ from one object of a group to the next."""
        block = self.to.block
        numbers = numbers_of(term)
        things = [self.checked.entities[number] for number in numbers]
        fixed = all(self.homes.is_fixed(thing) and thing.initial is None for thing in things)
        alike = len({thing.status for thing in things}) == 1 and not any(thing.timer for thing in things)
        if fixed and (alike or len(things) == 1):
            self._become_initial(things[0], entity)
            return
        done = Label()
        for thing in things[:-1]:
            following = Label()
            block.test(Op.IF_EQ, entity, constant(thing.number), following)
            self._put_back(thing, entity)
            block.skip(done)
            block.bind(following)
        self._put_back(things[-1], entity)
        block.bind(done)

    def _restart(self, thing: Entity) -> None:
        """Its timer counts from the beginning."""
        timer = self.registers.by_path.get(f"{label(thing)}.timer")
        if timer is not None:
            self.to.block.emit(Op.LOAD, timer, constant(0))

    def _put_back(self, thing: Entity, entity: int) -> None:
        self._become_initial(thing, entity)
        self.homes.put_back(self.to.block, thing.number)

    def _become_initial(self, thing: Entity, entity: int) -> None:
        self._restart(thing)
        if thing.role == "object":
            status = constant(thing.status) if thing.initial is None else self.to.value(thing.initial)
            self.to.block.emit(Op.BECOME, entity, status)


def store(registers: Registers, emit: Callable[..., None], path: str, value: int) -> None:
    """Put a temporary into a register; those that hold plain integers saturate."""
    name = next(name for name in registers.names if name.path == path)
    assert value >= TEMPORARY, "internal: what is stored is cut to its range in place"
    if not name.values:
        emit(Op.MAX, value, value, constant(name.low))
        emit(Op.MIN, value, value, constant(name.high))
    emit(Op.LOAD, name.register, value)
