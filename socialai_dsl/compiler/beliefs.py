"""Beliefs to code: the observations of a member of the cast, at the start of each of its turns."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from socialai_dsl.compiler.assembler import Label, age_path
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.program import Op, constant
from socialai_dsl.semantics.plans import BeliefPlan


def perceive(to: Expressions, member: str) -> None:
    """Emit the beliefs of a member, in order: each takes the value of the first of its sources that holds."""
    own = (belief for belief in to.checked.beliefs if belief.member == member)
    for _, sources in groupby(own, lambda belief: belief.path):
        _perceive_one(to, sources)


def _perceive_one(to: Expressions, sources: Iterator[BeliefPlan]) -> None:
    block, done = to.block, Label()
    listed = list(sources)
    age = to.registers.by_path.get(age_path(listed[0].path))
    forgets = age is not None or listed[0].forget is not None
    for belief in listed:
        unseen = Label()
        with block.scratch():
            if belief.when is not None:
                to.sited_condition(belief.when, unseen)
            to.note_value(belief.path, belief.value, unseen)
            if age is not None:
                block.emit(Op.LOAD, age, constant(0))
            if forgets or belief is not listed[-1]:
                block.skip(done)
            block.bind(unseen)
    if forgets:
        _forget(to, listed[0], age, done)
    block.bind(done)


def _forget(to: Expressions, belief: BeliefPlan, age: int | None, done: Label) -> None:
    """Without any source: a belief ends after a number of turns, or on a condition."""
    block = to.block
    with block.scratch():
        if age is not None:
            older = to.into_temporary(Op.ADD, age, constant(1))
            block.emit(Op.MIN, age, older, constant(belief.lasts))
            block.test(Op.IF_EQ, age, constant(belief.lasts), done)
        if belief.forget is not None:
            to.sited_condition(belief.forget, done)
        name = to.registers.named(belief.path)
        assert name.nothing is not None, "internal: what is forgotten can be nothing"
        block.emit(Op.LOAD, name.register, to.number(name.nothing))
