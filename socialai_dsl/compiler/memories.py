"""What is kept, to code: `prev(...)` and open memories as a step begins, acts as it ends, beliefs at each turn."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.effects import store
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.registers import found_path, said_path
from socialai_dsl.program import Op, Register
from socialai_dsl.semantics.plans import Drawn, MemoryPlan
from socialai_dsl.semantics.terms import Sited


def remember(to: Expressions) -> None:
    """Before anything happens in a step: what rules will want to know about the state that the last step left.

    Then nobody has said anything yet.
    """
    block = to.block
    for item in to.checked.remembered:
        _remember(to, item)
    for memory in to.checked.memories:
        _ask_whether_open(to, memory)
    for entity in to.checked.entities:
        said = to.registers.by_path.get(said_path(entity))
        if said is not None:
            block.emit(Op.LOAD, said, constant(0))


def _remember(to: Expressions, item: Drawn) -> None:
    """One value, and whether there is one, unless there always is."""
    block = to.block
    found, missing = to.registers.by_path.get(found_path(item.path)), Label()
    if found is None and item.type.kind == "bool":
        _note_whether(to, item.path, item.value)
        return
    mark = block.taken
    if found is not None:
        block.emit(Op.LOAD, found, constant(0))
        to.failed = missing
    value = to.sited_copy(item.value)
    to.failed = None
    store(to.registers, block.emit, item.path, value)
    if found is not None:
        block.emit(Op.LOAD, found, constant(1))
    block.bind(missing)
    block.release(mark)


def _ask_whether_open(to: Expressions, memory: MemoryPlan) -> None:
    if memory.open is not None:
        _note_whether(to, f"{memory.path}.open", memory.open)


def _note_whether(to: Expressions, path: str, condition: Sited) -> None:
    """Let a register tell whether a condition holds."""
    register, not_so = to.registers.by_path[path], Label()
    to.block.span = condition.span
    to.block.emit(Op.LOAD, register, constant(0))
    to.sited_condition(condition, not_so)
    to.block.emit(Op.LOAD, register, constant(1))
    to.block.bind(not_so)


def push_acts(to: Expressions) -> None:
    """Each open memory takes in what the agent did in this step and forgets the oldest act."""
    block, by_path = to.block, to.registers.by_path
    for memory in to.checked.memories:
        shut = Label()
        if memory.open is not None:
            block.span = memory.open.span
            block.test(Op.IF_NE, by_path[f"{memory.path}.open"], constant(0), shut)
        for part, newest in (("move", Register.ACTION), ("utterance", Register.UTTERANCE)):
            places = [by_path[f"{memory.path}[{k}].{part}"] for k in range(memory.length)]
            for place, newer in zip(places, (*places[1:], newest), strict=True):
                block.emit(Op.LOAD, place, newer)
        filled = by_path[f"{memory.path}.filled"]
        mark = block.taken
        more = to.into_temporary(Op.ADD, filled, constant(1))
        block.emit(Op.MIN, filled, more, constant(memory.length))
        block.release(mark)
        block.bind(shut)


# -- beliefs ---------------------------------------------------------------------------------------------------


def perceive(to: Expressions, member: str) -> None:
    """Emit the beliefs of a member, in order: each that it can make out takes its value."""
    block = to.block
    for belief in to.checked.beliefs:
        if belief.member != member:
            continue
        unseen = Label()
        mark = block.taken
        if belief.when is not None:
            to.sited_condition(belief.when, unseen)
        to.failed = unseen
        value = to.sited_copy(belief.value)
        to.failed = None
        store(to.registers, block.emit, belief.path, value)
        block.bind(unseen)
        block.release(mark)
