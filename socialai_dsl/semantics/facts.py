"""What is known of a term without playing: what its value follows from, when that can change, what it can be.

The order of placements, the statuses that are computed, conditions that can never hold, cells that a room has for sure:
all ask here. `terms.may_find_nothing` says whether a term may have no value.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, Literal, assert_never

from socialai_dsl.grammar.ast import children
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.changes import Mobility, Statuses
from socialai_dsl.semantics.plans import CheckedScenario
from socialai_dsl.semantics.terms import BOOL, Const, Term, numbers_of
from socialai_dsl.semantics.words import VALUES
from socialai_dsl.semantics.words.relations import Relation

What = Literal[
    "register", "size", "candidate", "cell", "facing", "color", "status", "presence", "container", "body",
    "between", "view", "way", "step", "draw",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Need:
    """One thing that the value of a term follows from.

    Attributes:
        what: `register`, of a path; `size` of the room; `candidate`, the cell that the `where` of a place asks about;
            `cell`, `facing`, `color`, `status`, `presence`, `container` or `body` (all else) of one of some entities;
            `between`, what stands between two things; `view`, the same where there is occlusion; `way`, where one can
            walk; `step`, what is done and said in it; `draw`, what is drawn wherever it is asked for.
        entities: their numbers, at most.
        path: of a register.
    """

    what: What
    entities: Sequence[int] = ()
    path: str = ""


Items = Mapping[str, Sequence[int]]
"""Variable of a quantifier -> what it stands for."""

_FIELDS: Final[dict[str, What]] = {
    "x": "cell",
    "y": "cell",
    "dir": "facing",
    "color": "color",
    "status": "status",
    "gone": "presence",
    "inside": "container",
}


def needs(part: object, items: Items | None = None) -> Iterator[Need]:
    """What the values of all terms in a term, or in a part of a plan, follow from.

    Args:
        part: a term, a plan, or a tuple of them.
        items: what the variables of the quantifiers around it stand for.
    """
    items = items or {}
    if isinstance(part, Term):
        yield from _own(part, items)
    if isinstance(part, terms.Quantification):
        around = items
        items = {**items, part.variable: [item.value for item in part.items]}
        if part.to is not None:
            yield from _entities("cell", part.to, around)
            yield from _entities("cell", terms.Variable(part.type, part.variable), items)
    for child in children(part):
        yield from needs(child, items)


def _own(term: Term, items: Items) -> Iterator[Need]:
    """What a term asks for itself, apart from its parts."""
    match term:
        case terms.Read(path=path):
            yield Need("register", path=path)
        case terms.Here():
            yield Need("candidate")
        case terms.World(name="width" | "height"):
            yield Need("size")
        case terms.FieldOf(entity=entity, name=name):
            yield from _entities(_FIELDS.get(name, "body"), entity, items)
        case terms.CellOf(entity=entity) | terms.CellBeside(entity=entity):
            yield from _entities("cell", entity, items)
        case terms.Measure(args=args):
            for arg in args:
                yield from _entities("cell", arg, items)
        case terms.Sees(viewer=viewer, target=target, facing=facing):
            yield Need("view")
            yield from _entities("cell", viewer, items)
            yield from _entities("cell", target, items)
            if facing is None:
                yield from _entities("facing", viewer, items)
        case terms.Test():
            yield from _related(term, items)
        case terms.Chance() | terms.Quantification(op="pick"):
            yield Need("draw")
        case (
            terms.World()
            | terms.PokedNow()
            | terms.Said()
            | terms.Spoke()
            | terms.Heard()
            | terms.SaidBy()
            | terms.Speaker()
            | terms.HeardNoun()
            | terms.InState()
        ):
            yield Need("step")
        case (
            Const()
            | terms.Variable()
            | terms.ReadEach()
            | terms.Operation()
            | terms.Compare()
            | terms.Logic()
            | terms.Not()
            | terms.Select()
            | terms.Quantification()
        ):
            pass  # they combine others
        case _:
            assert_never(term)


def relation(term: terms.Test) -> Relation:
    """The row of the relation that a term asks about."""
    row = VALUES[term.name]
    assert isinstance(row, Relation), "internal: a test is a relation"
    return row


def _related(term: terms.Test, items: Items) -> Iterator[Need]:
    row = relation(term)
    for role, one in (("subject", term.subject), ("object", term.object)):
        if one is None:
            yield Need("candidate")
            continue
        yield from _entities("cell", one, items)
        if role in row.turned:
            yield from _entities("facing", one, items)
    if row.through is not None:
        yield Need(row.through)


def _entities(what: What, term: Term, items: Items) -> Iterator[Need]:
    """Something of what a term stands for; a cell has nothing that could be otherwise."""
    if numbers := entities_of(term, items):
        yield Need(what, numbers)


def entities_of(term: Term, items: Items | None = None) -> Sequence[int]:
    """Numbers of the entities that a term can stand for; none of a cell."""
    if term.type.kind != "entity":
        return ()
    if isinstance(term, terms.Variable) and items and term.name in items:
        return items[term.name]
    return terms.numbers_of(term)


# -- when values can change, and what they can be --------------------------------------------------------------


class When(IntEnum):
    """When a value can change; of several the greatest counts."""

    NEVER = 0
    MARKED = 1  # only where Register.CHANGED is set: with the status or presence of an object, or by rules
    ANY_TIME = 2


@dataclass(frozen=True, slots=True)
class Contradiction:
    """What keeps conditions from holding together.

    Attributes:
        term: a number that would have to be at least `low` and at most `high`, which is less; None: one of the
            conditions is the opposite of another.
    """

    term: Term | None
    low: int = 0
    high: int = 0


class SaidLater(terms.SaidBy):
    """What a member says in this step that has its turn later, so that it is never said yet."""

    __slots__ = ()


_WIDE: Final = 256
"""Of a value with a wider range than this not each one is looked at."""


class TermFacts:
    """What is known of the terms of one scenario: of values and changes never too few, now and then too many."""

    def __init__(self, checked: CheckedScenario) -> None:
        self._checked = checked
        self._entities = checked.entities
        self._occlusion = checked.room.occlusion
        self._set_by_rules = {path for plan in checked.causing for item in plan.sets for path in item.paths}
        self._affected = {
            number
            for plan in checked.causing
            for effect in plan.causes
            for entity in effect.entities
            for number in numbers_of(entity)
        }
        self._written = {item.path for item in checked.remembered}
        self._written |= {belief.path for belief in checked.beliefs}
        self._written |= {f"{frame.member}.{part}" for frame in checked.frames for part in ("frame", "clock")}
        self._statuses = Statuses(checked)
        self._mobility = Mobility(checked)
        walking = self._mobility.walking
        self._objects_move = any(checked.entities[number].role == "object" for number in walking)

    def touched(self, number: int) -> bool:
        """Whether something else than its own condition can change the status of an object."""
        thing = self._entities[number]
        assert thing.type is not None, "internal: only objects have a status"
        linked = any(number in (*other.unlocks, *other.opens) for other in self._entities)
        return bool(
            thing.type.toggled or thing.type.pushed or thing.timer or linked or number in self._affected
        )

    def when(self, term: Term) -> When:
        """When the value of a term can change."""
        return max(map(self._when, needs(term)), default=When.NEVER)

    def _when(self, need: Need) -> When:
        match need.what:
            case "size" | "candidate" | "color":
                return When.NEVER
            case "register":
                return self._register(need.path)
            case "cell":
                walks = not self._mobility.walking.isdisjoint(need.entities)
                return When.ANY_TIME if walks else self._presence(need.entities)
            case "facing":
                turns = not self._mobility.turning.isdisjoint(need.entities)
                return When.ANY_TIME if turns else When.NEVER
            case "presence":
                return self._presence(need.entities)
            case "status":
                return When.MARKED if any(map(self._is_object, need.entities)) else When.NEVER
            case "view" if not self._occlusion:
                return When.NEVER
            case "view" | "between":
                return When.ANY_TIME if self._objects_move else When.MARKED
        return When.ANY_TIME

    def _register(self, path: str) -> When:
        if path.startswith("memory.") or path in self._written:
            return When.ANY_TIME
        return When.MARKED if path in self._set_by_rules else When.NEVER

    def _presence(self, numbers: Iterable[int]) -> When:
        gone = [number for number in numbers if number in self._mobility.vanishing]
        if not gone:
            return When.NEVER
        return When.MARKED if all(map(self._is_object, gone)) else When.ANY_TIME

    def _is_object(self, number: int) -> bool:
        return self._entities[number].role == "object"

    # -- values --

    def may_be(self, condition: Term, wanted: bool = True) -> bool:
        """Whether a condition may be true, or false."""
        found = self.values(condition)
        return not found or int(wanted) in found

    def values(self, term: Term) -> Sequence[int]:
        """All that a term can be, at most, in ascending order; empty if that is not known.

        A range may have more members than `len` can count.
        """
        match term:
            case Const(value=value):
                return (value,)
            case SaidLater():
                return (0,)
            case terms.FieldOf(entity=entity, name="status"):
                each = (self._statuses.of(number, term.type.size) for number in entity.type.values)
                return sorted(set[int]().union(*each)) or term.type.values
            case terms.Select(values=values, default=default):
                return _union([self.values(part) for part in (*values, default)])
            case terms.Not(arg=arg):
                return _truths(self.may_be(arg), self.may_be(arg, wanted=False))
            case terms.Logic(op=op, args=args):
                return self._joined(op == "and", args)
            case terms.Quantification(op="any" | "all" as op, items=(), cells=False):
                return (int(op == "all"),)
            case terms.Quantification(op="any" | "all", cells=False) if term.condition is not None:
                return self.values(term.condition)
            case terms.Compare():
                return self._compared(term)
        return term.type.values

    def _joined(self, every: bool, conditions: Sequence[Term]) -> Sequence[int]:
        false, true = ([self.may_be(one, wanted) for one in conditions] for wanted in (False, True))
        if not every:
            return _truths(all(false), any(true))
        return _truths(any(false), all(true) and contradiction(conditions) is None)

    def _compared(self, term: terms.Compare) -> Sequence[int]:
        if any(terms.is_own_noun(side) or terms.may_be_nothing(side) for side in (term.left, term.right)):
            return BOOL.values  # a silent member names no noun, and a register may hold nothing
        a, b = self.values(term.left), self.values(term.right)
        if not a or not b:
            return BOOL.values
        match term.op:
            case "==":
                return _truths(not _are_one(a, b), _meet(a, b))
            case "!=":
                return _truths(_meet(a, b), not _are_one(a, b))
            case "<":
                return _truths(b[0] <= a[-1], a[0] < b[-1])
            case "<=":
                return _truths(b[0] < a[-1], a[0] <= b[-1])


def contradiction(conditions: Iterable[Term]) -> Contradiction | None:
    """What of conditions that would have to hold together cannot: a number below and above something, or a condition
    and its opposite.
    """
    together = [one for one in _each(conditions) if not terms.draws(one)]
    bounds: dict[Term, tuple[int, int]] = {}
    for term, low, high in filter(None, map(_bounds, together)):
        known = bounds.get(term, (low, high))
        bounds[term] = low, high = max(low, known[0]), min(high, known[1])
        if low > high:
            return Contradiction(term, low, high)
    return None if set(together).isdisjoint(map(_opposite, together)) else Contradiction(None)


def _each(conditions: Iterable[Term]) -> Iterator[Term]:
    for one in conditions:
        if isinstance(one, terms.Logic) and one.op == "and":
            yield from _each(one.args)
        else:
            yield one


def _opposite(condition: Term) -> Term:
    match condition:
        case terms.Not(arg=arg):
            return arg
        case terms.Compare(op="<" | "<=" as op, left=left, right=right):
            return terms.Compare("<=" if op == "<" else "<", right, left)
        case terms.Compare(op="==" | "!=" as op, left=left, right=right):
            return terms.Compare("!=" if op == "==" else "==", left, right)
    return terms.Not(condition)


def _bounds(condition: Term) -> tuple[Term, int, int] | None:
    """A number that is compared with a known one, and the least and the greatest it is where the condition holds."""
    match condition:
        case terms.Compare(op="<" | "<=" | "==" as op, left=term, right=Const(value=bound)):
            low = bound if op == "==" else min(term.type.low, bound)
            high = bound - (op == "<")
        case terms.Compare(op="<" | "<=" | "==" as op, left=Const(value=bound), right=term):
            low = bound + (op == "<")
            high = bound if op == "==" else max(term.type.high, bound)
        case _:
            return None
    nothing = terms.is_own_noun(term) or terms.may_be_nothing(term)
    return None if isinstance(term, Const) or term.type.kind != "int" or nothing else (term, low, high)


def _truths(false: bool, true: bool) -> Sequence[int]:
    """The values of a condition that may be false, or true."""
    return (0,) * false + (1,) * true


def _are_one(a: Sequence[int], b: Sequence[int]) -> bool:
    """Whether two terms have the same value, whatever happens."""
    return a[0] == a[-1] == b[0] == b[-1]


def _meet(a: Sequence[int], b: Sequence[int]) -> bool:
    """Whether two ascending sequences have a member in common."""
    if isinstance(a, range) and isinstance(b, range):
        return a[0] <= b[-1] and b[0] <= a[-1]
    few, others = (b, a) if isinstance(a, range) else (a, b)
    return any(value in others for value in few)


def _union(parts: Sequence[Sequence[int]]) -> Sequence[int]:
    """All values of some sequences, of wide ones also what lies between; empty if one is not known."""
    if not all(parts):
        return ()
    low, high = min(part[0] for part in parts), max(part[-1] for part in parts)
    if any(part[-1] - part[0] > _WIDE for part in parts):
        return range(low, high + 1)
    return sorted({value for part in parts for value in part})
