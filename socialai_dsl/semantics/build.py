"""Small constructors of terms, simplifying where the result is plain."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from socialai_dsl import trees
from socialai_dsl.semantics.terms import (
    BOOL,
    Compare,
    Const,
    HeardNoun,
    Logic,
    Operation,
    Quantified,
    Read,
    Term,
    Type,
    World,
)

TRUE = Const(BOOL, 1)
FALSE = Const(BOOL, 0)
NOTED = "prev."
"""How the registers begin that `prev` notes values in."""
LARGEST = 1 << 62
"""Greatest magnitude of a number in an expression: what 64 bits hold, with room for things that are out of the room."""


def integer(low: int, high: int | None = None) -> Type:
    """The numbers from low to high."""
    return Type("int", low, low if high is None else high)


def entity(number: int) -> Const:
    """An inhabitant of the room as a known value."""
    return Const(Type("entity", number, number), number)


def number(value: int) -> Const:
    """A known number."""
    return Const(integer(value), value)


def any_of(conditions: Iterable[Term]) -> Term:
    """Whether one of them holds."""
    return _joined("or", FALSE, TRUE, conditions)


def all_of(conditions: Iterable[Term]) -> Term:
    """Whether each of them holds."""
    return _joined("and", TRUE, FALSE, conditions)


def _joined(op: Any, neutral: Const, final: Const, conditions: Iterable[Term]) -> Term:
    kept: list[Term] = []
    for condition in conditions:
        if condition == neutral:
            continue
        if condition == final and not kept:
            return final
        kept += condition.args if isinstance(condition, Logic) and condition.op == op else [condition]
    if not kept:
        return neutral
    return kept[0] if len(kept) == 1 else Logic(op, tuple(kept))


def between(term: Term, low: Term, high: Term) -> Term:
    """Low <= term <= high."""
    return all_of([Compare("<=", low, term), Compare("<=", term, high)])


def one_of(term: Term, values: Sequence[Const]) -> Term:
    """Whether a term is one of some known values of its type."""
    numbers = sorted({v.value for v in values})
    if len(numbers) > 2 and numbers[-1] - numbers[0] == len(numbers) - 1:
        return between(term, Const(term.type, numbers[0]), Const(term.type, numbers[-1]))
    return any_of(Compare("==", term, value) for value in values)


def arithmetic(op: Any, *args: Term) -> Term:
    """An operation on numbers with the range of its result; known values are computed."""
    if all(isinstance(arg, Const) for arg in args):
        return number(compute(op, *(arg.value for arg in args if isinstance(arg, Const))))
    return Operation(_range(op, *(arg.type for arg in args)), op, args)


def compute(op: str, *values: int) -> int:
    """The result of an operation on numbers that are known."""
    a, b = values[0], values[-1]
    match op:
        case "+":
            return a + b
        case "-":
            return a - b
        case "*":
            return a * b
        case "//":
            return a // b
        case "%":
            return a % b
        case "min":
            return min(values)
        case "max":
            return max(values)
        case "abs":
            return abs(a)
        case "neg":
            return -a
    raise AssertionError(f"internal: unknown operation {op}")


def _range(op: str, *types: Type) -> Type:
    a, b = types[0], types[-1]
    if op == "%":
        low, high = (0, b.high - 1) if b.low > 0 else (b.low + 1, 0)
        return integer(low, high)
    if op == "abs":
        return integer(
            0 if a.low <= 0 <= a.high else min(abs(a.low), abs(a.high)), max(abs(a.low), abs(a.high))
        )
    if op == "//":
        divisors = [d for d in (b.low, b.high, -1, 1) if b.low <= d <= b.high and d != 0]
        results = [n // d for n in (a.low, a.high) for d in divisors]
    elif op == "neg":
        results = [-a.low, -a.high]
    else:
        results = [compute(op, x, y) for x in (a.low, a.high) for y in (b.low, b.high)]
    return integer(min(results), max(results))


def changed(value: Any, change: Callable[[Term], Term | None]) -> Any:
    """A copy of a term, plan or tuple with every term replaced for which `change` gives another."""
    if isinstance(value, tuple):
        return tuple(changed(part, change) for part in value)
    other = change(value) if isinstance(value, Term) else None
    return other if other is not None else trees.rebuilt(value, lambda part: changed(part, change))


def walk(tree: Any) -> Iterator[Term]:
    """All terms in a term, a plan or a tuple of them, depth first."""
    return (node for node in trees.walk(tree) if isinstance(node, Term))


def draws(term: Term) -> bool:
    """Whether something is drawn anew wherever a term is evaluated."""
    return any(isinstance(part, Quantified) and part.op == "pick" for part in walk(term))


def may_find_nothing(term: Term) -> bool:
    """Whether a term may need one of a group when none is what is wanted, or the noun of somebody who is silent.

    What `prev` noted may have found nothing then.
    """
    for part in walk(term):
        if isinstance(part, HeardNoun) or is_own_noun(part):
            return True
        if isinstance(part, Quantified) and part.op in ("first", "pick", "nearest"):
            return True
        if isinstance(part, Read) and part.path.startswith(NOTED):
            return True
    return False


def is_own_noun(term: Term) -> bool:
    """Whether a term is `agent.noun`: while the agent is silent, that is unlike any noun."""
    return isinstance(term, World) and term.name == "noun"
