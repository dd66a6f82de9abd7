"""Code that waits for an object: having had nothing to do, it is run again when a status changes.

A register says that it is due: since the reset or the last change of an object's status or presence it has not been
run, or one of its rules fired. It only saves work: run for nothing, the code would have done nothing. What is
remembered at the start of a step waits, and so do the rules of the world, those among others a run of them at a time.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.changes import Changes, When
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.registers import Registers, said_path
from socialai_dsl.compiler.statuses import ComputedStatuses
from socialai_dsl.program import Op, Register
from socialai_dsl.semantics.build import may_find_nothing, walk
from socialai_dsl.semantics.terms import BOOL, Checked, Quantified, RulePlan, Term


class Waiting:
    """What waits in a scenario.

    Attributes:
        runs: the rules of the world in runs, in order, and the register of whether each is due; without one it is asked
            in every step.
        before: register of whether what is remembered at the start of a step is due; None: it always is.
        rules: register of whether the rules are due, where all of them are one run; None: some always are.
    """

    def __init__(self, checked: Checked, registers: Registers, computed: ComputedStatuses) -> None:
        changes = Changes(checked)
        # Where statuses are computed from more than statuses every step counts as a change, so nobody would wait.
        can_wait = not computed.settle_always
        self.before = self.rules = None
        if can_wait and checked.remembered and _only_remembers(checked, registers, changes):
            self.before = registers.add("before.due", BOOL, fleeting=True)
        self.runs: list[tuple[tuple[RulePlan, ...], int | None]] = []
        for waits, run in groupby(checked.rules, lambda rule: can_wait and _waits(rule, changes)):
            rules = tuple(run)
            are_all = len(rules) == len(checked.rules) and not checked.memories
            due = None
            if waits and (are_all or any(map(_is_long, rules))):
                due = registers.add(f"world.due[{len(self.runs)}]", BOOL, fleeting=True)
            if are_all:
                self.rules = due
            self.runs.append((rules, due))

    def note_change(self, to: Expressions) -> None:
        """Emit that a status has changed."""
        for due in (self.before, *(due for _, due in self.runs)):
            if due is not None:
                to.block.emit(Op.LOAD, due, constant(1))

    def begin_remembering(self, to: Expressions) -> None:
        """Emit that what is remembered is not due from now on."""
        if self.before is not None:
            to.block.emit(Op.LOAD, self.before, constant(0))

    def begin_run(self, to: Expressions, due: int, otherwise: Label, always: bool) -> None:
        """Fall through if the rules are due, or `always`, else skip; from now on they are not due.

        What has changed in this step is not noted yet.
        """
        if not always and due != self.rules:
            mark = to.block.taken
            to.block.test(Op.IF_NE, to.into_temporary(Op.ADD, due, Register.CHANGED), constant(0), otherwise)
            to.block.release(mark)
        to.block.emit(Op.LOAD, due, constant(0))


def _only_remembers(checked: Checked, registers: Registers, changes: Changes) -> bool:
    """Whether what is done at the start of a step is to note what only statuses change."""
    if checked.memories or any(said_path(entity) in registers.by_path for entity in checked.entities):
        return False
    return all(changes.of(item.value.term) <= When.STATUSES for item in checked.remembered)


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
