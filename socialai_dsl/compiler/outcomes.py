"""The outcome list to code: one block for each pair of utterance class and body action, most of them empty."""

from __future__ import annotations

from itertools import product

from socialai_dsl.compiler.allocation import Allocation
from socialai_dsl.compiler.assembler import Label
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.folding import FALSE, Facts, fold_whole
from socialai_dsl.compiler.probes import Probes
from socialai_dsl.program import Body, Op
from socialai_dsl.semantics.plans import Checked

_BODIES = range(Body.NONE + 1)
"""What the agent can do."""


def outcome_table(allocation: Allocation) -> list[int]:
    """Addresses by (class, action), row by row."""
    checked, probes, code = allocation.checked, allocation.probes, allocation.code
    classes = range(allocation.classes.count)
    if probes.recording:
        to = allocation.expressions()
        _first_that_holds(to, checked, probes)
        return [code.add(to.block, "outcome")] * (len(classes) * len(_BODIES))
    table = []
    for said, action in product(classes, map(Body, _BODIES)):
        to = allocation.expressions(Facts(said=said, action=action))
        _first_that_holds(to, checked, probes)
        table.append(code.add(to.block, f"outcome after class {said}, {action.name.lower()}"))
    return table


def _first_that_holds(to: Expressions, checked: Checked, probes: Probes) -> None:
    block = to.block
    for number, outcome in enumerate(checked.outcomes):
        never = fold_whole(outcome.condition.term, to.facts, to.classes) == FALSE
        if never and not probes.recording:
            continue
        following = Label()
        asked = probes.outcome(to, number, outcome)
        asked.condition(to, "outcome", outcome.condition, following)
        if outcome.graded is not None and outcome.success:
            mark = block.taken
            to.failed = asked.nothing("values", following)
            block.emit(Op.END_GRADED, number, to.sited_value(outcome.graded))
            to.failed = None
            block.release(mark)
        else:
            block.emit(Op.END, number, outcome.percent if outcome.success else 0)
        block.halt()
        asked.report(to, following)
        block.bind(following)
    block.halt()
