"""Programs that also note why rules did not fire.

Such a program has the registers of the program that it explains, and behind them some of its own. Wherever a part of
a condition turns out false, code that the program itself does not have puts the number of that part into a register
and the values that the part was about into others. So what is noted is what the engine computed, at that point of the
step. It does not sort rules by what was heard: each is asked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from socialai_dsl.compiler.assembler import Label, Registers, label, state_names
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.folding import fold, mentions
from socialai_dsl.compiler.lowering import NoteTaker, RuleConditions
from socialai_dsl.grammar.ast import unparse
from socialai_dsl.program import Op, Program, RegisterName, constant
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.plans import CheckedScenario, OutcomePlan, RulePlan, StepPlan
from socialai_dsl.semantics.terms import BOOL, Const, Reading, Readings, Term, Type, all_of
from socialai_dsl.widths import LARGEST_NUMBER

_LEAST, _GREATEST = -LARGEST_NUMBER, LARGEST_NUMBER
_MOST_VALUES = 6
"""The most values of a part that are noted."""
_MOST_HEARD = 3
"""The most entries of an inbox that are noted."""


@dataclass(frozen=True, slots=True)
class Value:
    """Something that a part of a condition is about: how it is written, and the register it is noted in."""

    words: str
    name: RegisterName


@dataclass(frozen=True, slots=True)
class ConditionPart:
    """A part of what must hold for a rule to fire.

    Attributes:
        key: where it is written: hears, once, after, when, chance, for, until, do, outcome; or `values`, those that
            the rule computes.
        words: how it is written; empty where the key says it all.
        values: what is noted if it is false. Of `hears`: how many utterances the member heard, the classes of the first
            three, and how far the agent is; of `after` and `for`: for how many turns the state has lasted.
    """

    key: str
    words: str
    values: tuple[Value, ...] = ()


@dataclass(frozen=True)
class Note:
    """The notes of a rule, an entry of `steps`, or an outcome.

    Attributes:
        register: 0 it was not asked, or it fired; k: part k - 1 was false; -k: something in part k - 1 found nothing.
        plan: itself. parts: by number.
    """

    register: int
    plan: RulePlan | StepPlan | OutcomePlan
    parts: list[ConditionPart] = field(default_factory=list)


@dataclass(frozen=True)
class NotingProgram:
    """A program that notes, its first register that the program explained does not have, and its notes.

    Attributes:
        rules: by counter. outcomes: by index.
    """

    program: Program
    first: int
    rules: dict[int, Note]
    outcomes: dict[int, Note]


class Recorder(NoteTaker):
    """Notes everything, in registers from `first` on."""

    recording = True

    def __init__(self, checked: CheckedScenario, first: int) -> None:
        self.checked, self.readings = checked, checked.readings or Readings()
        self.first = self.next = first
        self.rules: dict[int, Note] = {}
        self.outcomes: dict[int, Note] = {}
        self.names: list[RegisterName] = []

    def rule(
        self, to: Expressions, counter: int, plan: RulePlan | StepPlan, entity: int | None
    ) -> RuleConditions:
        """See `NoteTaker.rule`; a rule that is emitted several times is noted in one place."""
        if counter not in self.rules:
            self.rules[counter] = Note(self.register(), plan)
        return _Noting(self, self.rules[counter], self._aside(to, entity))

    def outcome(self, to: Expressions, number: int, plan: OutcomePlan) -> RuleConditions:
        """See `NoteTaker.outcome`."""
        if number not in self.outcomes:
            self.outcomes[number] = Note(self.register(), plan)
        return _Noting(self, self.outcomes[number], {})

    def register(self) -> int:
        """A fresh register."""
        self.next += 1
        number = self.next - 1
        self.names.append(RegisterName(f"note[{number - self.first}]", number, (), _LEAST, _GREATEST))
        return number

    def declare(self, registers: Registers) -> None:
        """Let a program have the registers."""
        registers.names += self.names
        registers.end = self.next

    def _aside(self, to: Expressions, entity: int | None) -> dict[str, list[_Shown]]:
        """What is noted beside what no condition says."""
        if entity is None:
            return {}
        member = next(frame.member for frame in self.checked.frames if frame.entity == entity)
        clock = to.registers.by_path[f"{member}.clock"]
        size = 3 if to.classes.speakers_matter else 1
        most = min(_MOST_HEARD, 1 + len(self.checked.frames))
        heard = [to.inbox, *(to.inbox + 1 + size * k for k in range(most))]
        return {
            "hears": [
                *(_Shown("", _INT, _known(register)) for register in heard),
                _Shown("", _INT, lambda to: to.into_temporary(Op.DISTANCE, constant(0), constant(entity))),
            ],
            **{key: [_Shown("", _INT, _known(clock))] for key in ("after", "for")},
        }


@dataclass(frozen=True, slots=True)
class _Shown:
    """Something to be noted: how it is written, its type, and what emits it and gives its operand."""

    words: str
    type: Type
    emit: Callable[[Expressions], int]
    nothing: int | None = None


_INT = Type("int", _LEAST, _GREATEST)


def _known(operand: int) -> Callable[[Expressions], int]:
    return lambda to: operand


def _computed(term: Term) -> Callable[[Expressions], int]:
    def emit(to: Expressions) -> int:
        folded = fold(term, to.facts, to.classes)
        return to.held(folded) if isinstance(folded, terms.Read | terms.ReadEach) else to.value(folded)

    return emit


@dataclass
class _Pad:
    """Where a part that is false leads to: its number, negative if it found nothing, and what is noted there."""

    number: int
    shown: Sequence[_Shown]
    label: Label = field(default_factory=Label)


class _Noting(RuleConditions):
    """Notes the parts of one rule."""

    def __init__(self, recorder: Recorder, note: Note, aside: dict[str, list[_Shown]]) -> None:
        self._recorder, self._note, self._aside = recorder, note, aside
        self._pads: list[_Pad] = []
        self._count = 0

    def unless(self, key: str, otherwise: Label) -> Label:
        shown = self._aside.get(key, [])
        return self._pad(self._number(key, "", shown), shown)

    def nothing(self, key: str, otherwise: Label) -> Label:
        return self._pad(-self._number(key, "", ()))

    def condition(self, to: Expressions, key: str, sited: terms.SitedTerm, otherwise: Label) -> None:
        to.site, to.block.span = sited.site, sited.span
        failed = to.failed
        for term, reading in _conjuncts(sited, self._recorder.readings):
            words = "" if reading is None else unparse(reading.node)
            shown = list(_asked_about(term, reading, to.checked))[:_MOST_VALUES]
            # What is heard with values in it has become a part of the condition, which nobody has written there.
            hears = reading is None and key == "when" and mentions(term, terms.Heard)
            shown = self._aside.get("hears", []) if hears else shown
            number = self._number("hears" if hears else key, words, shown)
            to.failed = self._pad(-number)
            with to.block.scratch():
                to.condition(fold(term, to.facts, to.classes), self._pad(number, shown))
        to.failed = failed

    def report(self, to: Expressions, otherwise: Label) -> None:
        block = to.block
        used = [pad for pad in self._pads if pad.label.uses]
        if used:
            block.skip(otherwise)
        for pad in used:
            block.bind(pad.label)
            block.emit(Op.LOAD, self._note.register, constant(pad.number))
            for value, shown in zip(self._note.parts[abs(pad.number) - 1].values, pad.shown, strict=False):
                with block.scratch():
                    least = to.into_temporary(Op.MAX, shown.emit(to), constant(_LEAST))
                    block.emit(Op.MIN, value.name.register, least, constant(_GREATEST))
            block.skip(otherwise)

    def _pad(self, number: int, shown: Sequence[_Shown] = ()) -> Label:
        self._pads.append(_Pad(number, shown))
        return self._pads[-1].label

    def _number(self, key: str, words: str, shown: Sequence[_Shown]) -> int:
        """The number of the next part, from 1; a rule that is emitted again has the same parts in the same order."""
        self._count += 1
        if len(self._note.parts) < self._count:
            values = tuple(self._value(one) for one in shown)
            self._note.parts.append(ConditionPart(key, words, values))
        return self._count

    def _value(self, shown: _Shown) -> Value:
        type_ = shown.type
        register = self._recorder.register()
        low, words = type_.low, type_.words
        if shown.nothing is not None:
            low, words = min(low, shown.nothing), ("none", *words) if words else ()
        name = RegisterName(shown.words, register, words, low, type_.high, type_.kind, nothing=shown.nothing)
        return Value(shown.words, name)


# --- parts of conditions, and what they are about --------------------------------------------------------------------


def _conjuncts(sited: terms.SitedTerm, readings: Readings) -> list[tuple[Term, Reading | None]]:
    """The conditions that must all hold, in order, each with how it was written."""
    root = readings.roots.get(sited.site)
    read = list(root.conjuncts()) if root is not None else []
    if read and all_of(reading.term for reading in read if reading.term is not None) == sited.term:
        return [(reading.term, reading) for reading in read if reading.term is not None]
    is_and = isinstance(sited.term, terms.Logic) and sited.term.op == "and"
    args = sited.term.args if is_and else (sited.term,)  # type: ignore[union-attr]
    known = list(root.walk()) if root is not None else []
    return [(arg, next((one for one in known if one.term == arg), None)) for arg in args]


def _asked_about(term: Term, reading: Reading | None, checked: CheckedScenario) -> Iterator[_Shown]:
    """The values that a condition is about, each once, with how they were written; what is known tells nothing."""
    if reading is None:
        return
    written: dict[Term, str] = {}
    for part in reading.walk():
        if part.term is not None:
            written.setdefault(part.term, unparse(part.node))
    found: dict[Term, None] = {}
    for value in _values(term, True):
        if value not in found and value in written and not _is_free(value):
            found[value] = None
            nothing = value.nothing if isinstance(value, terms.Read | terms.ReadEach) else None
            yield _Shown(written[value], value.type, _computed(value), nothing)
        elif value not in found and (shown := _unwritten(value, checked)) is not None:
            found[value] = None
            yield shown


def _values(term: Term, outermost: bool) -> Iterator[Term]:
    """Values in a condition, from left to right; also whether its parts hold, unless that goes without saying."""
    match term:
        case terms.Logic(op=op, args=args):
            for arg in args:
                yield from _values(arg, outermost and op == "or")
        case terms.Not(arg=arg):
            yield from _values(arg, isinstance(arg, terms.Logic) is False and outermost)
        case terms.Compare(left=left, right=right):
            yield from (side for side in (left, right) if not isinstance(side, Const))
        case terms.InState():
            yield term
        case terms.Test(subject=subject, object=other):
            if not outermost:
                yield term
            yield from (side for side in (subject, other) if side is not None and not isinstance(side, Const))
        case _ if term.type == BOOL and not isinstance(term, Const) and not outermost:
            yield term


def _unwritten(term: Term, checked: CheckedScenario) -> _Shown | None:
    """What `x.is(state)` asks about, of an object or a member of the cast."""
    if isinstance(term, terms.InState):
        return _state_of(term, checked)
    if isinstance(term, terms.FieldOf) and term.name == "status" and isinstance(term.entity, Const):
        return _Shown(label(checked.entities[term.entity.value]), term.type, _computed(term))
    return None


def _state_of(term: terms.InState, checked: CheckedScenario) -> _Shown:
    frame = next(f for f in checked.frames if f.member == term.member and f.frame == term.frame)
    names = state_names(frame)
    return _Shown(
        term.member,
        Type("status", 0, len(names) - 1, names),
        lambda to: to.registers.by_path[f"{term.member}.frame"],
    )


def _is_free(term: Term) -> bool:
    """Whether a term means something only within a choice among things."""
    return mentions(term, terms.Variable) and not isinstance(term, terms.Quantification)
