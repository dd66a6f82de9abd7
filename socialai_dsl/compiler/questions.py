"""Programs that also note the values that `probes` ask about.

The code of the probes stands at the start of a step, before time goes on. So one more step, which is then forgotten,
tells what is to be asked at a moment, and what is right. The scenario's own program has none of this.
"""

from __future__ import annotations

from dataclasses import dataclass

from socialai_dsl.compiler.assembler import Label
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.program import Op, Program, RegisterName, constant
from socialai_dsl.semantics.plans import Drawn, ProbePlan
from socialai_dsl.semantics.terms import BOOL

Text = tuple[str | RegisterName, ...]
"""Pieces of a text, and the registers of the values in it."""


@dataclass(frozen=True, slots=True)
class ProbeNotes:
    """Where what a probe asks about is noted.

    Attributes:
        name: of the probe.
        at_end: whether it is asked when the episode has ended, else as soon as `asked` is 1.
        asked: a register: whether its moment is now, and all its values are found.
        question, right: texts. answers: what can be answered, the right answer perhaps not among them.
    """

    name: str
    at_end: bool
    asked: RegisterName
    question: Text
    right: Text
    answers: tuple[Text, ...]


@dataclass(frozen=True)
class Asking:
    """A program that notes what its probes ask about, and where."""

    program: Program
    probes: tuple[ProbeNotes, ...]


def ask(to: Expressions) -> None:
    """Emit for each probe whether it is to be asked now, and the values in its texts."""
    for plan in to.checked.probes:
        _ask(to, plan)


def notes_of(plan: ProbePlan, names: dict[str, RegisterName]) -> ProbeNotes:
    """Where a program with these registers, by path, notes what a probe asks about."""

    def text(pieces: tuple[str | Drawn, ...]) -> Text:
        return tuple(piece if isinstance(piece, str) else names[piece.path] for piece in pieces)

    return ProbeNotes(
        plan.name,
        plan.when is None,
        names[_asked(plan)],
        text(plan.ask),
        text((plan.answer,)),
        tuple(map(text, plan.answers)),
    )


def _asked(plan: ProbePlan) -> str:
    return f"probes.{plan.name}.asked"


def _ask(to: Expressions, plan: ProbePlan) -> None:
    block = to.block
    asked = to.registers.add(_asked(plan), BOOL, fleeting=True)
    not_now = Label()
    block.span = plan.span
    block.emit(Op.LOAD, asked, constant(0))
    if plan.when is not None:
        to.sited_condition(plan.when, not_now)
    texts = (plan.ask, (plan.answer,), *plan.answers)
    for value in (piece for text in texts for piece in text if isinstance(piece, Drawn)):
        _note(to, value, not_now)
    block.emit(Op.LOAD, asked, constant(1))
    block.bind(not_now)


def _note(to: Expressions, value: Drawn, nothing: Label) -> None:
    """Put a value into a register of its own; a condition that finds nothing is false, any other value skips."""
    block = to.block
    register = to.registers.add(value.path, value.type, fleeting=True)
    with block.scratch():
        if value.type.kind == "bool":
            to.note_whether(register, value.value)
        else:
            to.note_value(value.path, value.value, nothing)
