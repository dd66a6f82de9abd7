"""Rules of the world that wait for an object: having found nothing to do, they are asked again when a status changes.

A register for each run of such rules says that they are due: since the reset or the last change of an object's status
or presence they have not been asked, or one of them fired. It only saves work: rules that were asked for nothing would
have done nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.changes import Changes, When
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.registers import Registers
from socialai_dsl.program import Op, Register
from socialai_dsl.semantics.build import may_find_nothing, walk
from socialai_dsl.semantics.terms import BOOL, Checked, Quantified, RulePlan, Term


class Waiting:
    """The rules of a scenario's world in runs, in order.

    Attributes:
        runs: the rules of each, and the register of whether they are due; without one they are asked in every step.
    """

    def __init__(self, checked: Checked, registers: Registers) -> None:
        changes = Changes(checked)
        self.runs: list[tuple[tuple[RulePlan, ...], int | None]] = []
        for waits, run in groupby(checked.rules, lambda rule: _waits(rule, changes)):
            rules = tuple(run)
            due = None
            if waits and any(map(_is_long, rules)):
                due = registers.add(f"world.due[{len(self.runs)}]", BOOL, fleeting=True)
            self.runs.append((rules, due))

    def note_change(self, to: Expressions) -> None:
        """Emit that a status has changed."""
        for _, due in self.runs:
            if due is not None:
                to.block.emit(Op.LOAD, due, constant(1))


def begin_run(to: Expressions, due: int, otherwise: Label, always: bool) -> None:
    """Fall through if the rules are due, or `always`, else skip; from now on they are not due.

    What has changed in this step is not noted yet.
    """
    if not always:
        mark = to.block.taken
        to.block.test(Op.IF_NE, to.into_temporary(Op.ADD, due, Register.CHANGED), constant(0), otherwise)
        to.block.release(mark)
    to.block.emit(Op.LOAD, due, constant(0))


def _waits(rule: RulePlan, changes: Changes) -> bool:
    """Whether a rule that did not fire cannot fire until a status changes."""
    if rule.chance is not None:
        return False
    asked = [] if rule.when is None else [rule.when.term]
    asked += [term for term in _values(rule) if may_find_nothing(term)]
    return all(changes.of(term) <= When.STATUSES for term in asked)


def _values(rule: RulePlan) -> Iterator[Term]:
    yield from (value.term for _, value in rule.sets)
    for effect in rule.causes:
        yield from effect.entities
        if effect.value is not None:
            yield effect.value


def _is_long(rule: RulePlan) -> bool:
    """Whether to ask a rule takes longer than to ask whether it is due: it goes through a group."""
    return any(isinstance(part, Quantified) for part in walk(rule))
