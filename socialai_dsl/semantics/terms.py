"""Typed trees: what an expression means once every name is resolved, how trees are made, and how each was written.

Every value is a whole number at run time. A `Type` says which numbers, and which word each stands for:

=========  =====================================================================================
bool       0, 1
int        low..high
direction  0 right, 1 down, 2 left, 3 up (a turn added to a direction is taken modulo 4)
color      0 red, 1 green, 2 blue, 3 purple, 4 yellow, 5 grey
action     0 left, 1 right, 2 forward, 3 pickup, 4 drop, 5 toggle, 6 done, 7 none
entity     number of the entity: 0 the agent, NPCs in cast order, then objects in file order
text       index into `words`: the finite set of texts that the expression can be (names, kinds)
noun       index into `words`, the nouns of the scenario's grammar, or the words of one of its slots
status     index into `words`, the states of an object type
look       index into `words`, the values of one of the scenario's `looks`
utterance  0 silence, else 1 + template * fillings + filling (`vocabulary.Sentences`); `words` are the texts
cell       CELL + 32 * y + x (program); where an entity is asked for its place, a cell will do
=========  =====================================================================================
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from operator import add, eq, le, lt, mul, ne, neg, sub
from typing import Any, Final, Literal

from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import Leaf
from socialai_dsl.schema.scenario import Outcome, Rule, Step, WorldRule
from socialai_dsl.source import Span
from socialai_dsl.vocabulary import ACTIONS, COLORS, DIRECTIONS, SIDES, TURNS
from socialai_dsl.widths import LARGEST_NUMBER

Kind = Literal[
    "bool", "int", "direction", "color", "action", "entity", "text", "noun", "status", "look", "utterance", "cell"
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Type(Leaf):
    """A kind of value and its range; `words[v - low]` is the word for v where values have words."""

    kind: Kind
    low: int
    high: int
    words: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """How many values there are."""
        return self.high - self.low + 1

    @property
    def farthest(self) -> int:
        """The value that is farthest from zero."""
        return max(self.low, self.high, key=abs)

    def ranging(self, low: int, high: int) -> Type:
        """The same kind of value, from `low` to `high`."""
        return Type(self.kind, low, high, self.words)

    @property
    def is_kept(self) -> bool:
        """Whether a register can hold each of them."""
        return abs(self.farthest) <= LARGEST_NUMBER

    @property
    def values(self) -> range:
        """All of them."""
        return range(self.low, self.high + 1)


BOOL = Type("bool", 0, 1, ("false", "true"))
DIRECTION = Type("direction", 0, len(DIRECTIONS) - 1, DIRECTIONS)
COLOR = Type("color", 0, len(COLORS) - 1, COLORS)
ACTION = Type("action", 0, len(ACTIONS) - 1, ACTIONS)

CELL = Type("cell", 2048, 2048 + 32 * 29 + 31)
"""Any cell: CELL.low + 32 * y + x (`program.CELL`)."""


@dataclass(frozen=True, slots=True)
class Const:
    """A known value."""

    type: Type
    value: int


@dataclass(frozen=True, slots=True)
class Read:
    """A register of the scenario, by its path: `let.exit`, `wizard.name`, `jill.goal` (a frame's `let` or slot),
    `teacher.one_of`, `let.dance[0].move`, `memory.attempt.filled`, `prev.0`, `ann.trust(bob)`.

    `nothing` is the number in a register that may hold nothing when it does; `type` is that of what it holds else.
    `may_miss`: what `prev` noted in it may have found nothing then.
    """

    type: Type
    path: str
    nothing: int | None = None
    may_miss: bool = False


@dataclass(frozen=True, slots=True)
class ReadEach:
    """Of registers that there are for each of a group the one of `key`; what is not in the group has none.

    `keys` are the values of the group, `registers` theirs, one behind the other. As the target of a rule that sets
    one, it is that register.
    """

    type: Type
    key: Term
    keys: tuple[int, ...]
    registers: tuple[Read, ...]

    @property
    def nothing(self) -> int | None:
        """The number that stands for nothing, where they may hold nothing."""
        return self.registers[0].nothing

    @property
    def may_miss(self) -> bool:
        """Whether the key may be something that is not in the group."""
        type_ = self.key.type
        return type_.size > len(self.keys) or not set(self.keys) >= set(type_.values)

    def known(self) -> Read | None:
        """The register itself, if it is known which."""
        if isinstance(self.key, Const) and self.key.value in self.keys:
            return self.registers[self.keys.index(self.key.value)]
        return None


@dataclass(frozen=True, slots=True)
class Digit(Leaf):
    """One slot of a filling: `filling // stride % radix`; radix - 1 is a slot that is not there."""

    stride: int
    radix: int


@dataclass(frozen=True, slots=True)
class World:
    """A fact: t, width, height, action (the agent's this step), noun (the filling of what it says, or a slot of it)."""

    type: Type
    name: Literal["t", "width", "height", "action", "noun"]
    digit: Digit | None = None


@dataclass(frozen=True, slots=True)
class FieldOf:
    """An attribute of an entity: x, y, dir, color, status, gone, poked, last (its last body action), pointing (0, or
    1 + direction), inside (the object it lies in), carrier (0, or 1 + who carries it).

    `may_miss`: of inside, whether it may never have lain in anything.
    """

    type: Type
    entity: Term
    name: Literal[
        "x",
        "y",
        "dir",
        "color",
        "status",
        "gone",
        "poked",
        "last",
        "pointing",
        "inside",
        "toggled",
        "carrier",
    ]
    may_miss: bool = False


@dataclass(frozen=True, slots=True)
class Here:
    """A coordinate of the candidate cell in the `where` of a place, or that cell."""

    type: Type
    name: Literal["x", "y", "cell"]


@dataclass(frozen=True, slots=True)
class Variable:
    """The variable of an enclosing quantifier."""

    type: Type
    name: str


@dataclass(frozen=True, slots=True)
class Operation:
    """Arithmetic on integers: + - * // % min max abs neg; `turn` is + modulo 4 on directions."""

    type: Type
    op: Literal["+", "-", "*", "//", "%", "min", "max", "abs", "neg", "turn"]
    args: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Measure:
    """A number between two entities: distance (Manhattan), dir_to (quadrant direction from the first to the second)."""

    type: Type
    name: Literal["distance", "dir_to"]
    args: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Compare:
    """== != < <= (others are turned round by the resolver)."""

    op: Literal["==", "!=", "<", "<="]
    left: Term
    right: Term
    type: Type = BOOL


@dataclass(frozen=True, slots=True)
class Logic:
    """and / or of conditions, read left to right."""

    op: Literal["and", "or"]
    args: tuple[Term, ...]
    type: Type = BOOL


@dataclass(frozen=True, slots=True)
class Not:
    """Negation."""

    arg: Term
    type: Type = BOOL


RelationName = Literal[
    "at", "next_to", "faces", "faces_toward", "in_front_of", "eye_contact", "in_line", "can_reach", "looks_at",
    "unobstructed",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Test:
    """A relation of two entities (`at`: on the same cell), or of the candidate cell (`subject` is None:
    here.next_to(x), here.at(x), here.in_front_of(x)).
    """

    name: RelationName
    subject: Term | None
    object: Term
    type: Type = BOOL


@dataclass(frozen=True, slots=True)
class Sees:
    """The viewer, a cast member, has the target in its view square, as it faces now or as if it faced `facing`."""

    viewer: Term
    target: Term
    facing: Term | None = None
    type: Type = BOOL


@dataclass(frozen=True, slots=True)
class Chance:
    """True with a probability, drawn when a sequence is; `ordinal` as that of a pick."""

    probability: float
    ordinal: int = 0
    type: Type = BOOL


@dataclass(frozen=True, slots=True)
class Select:
    """The value beside the first condition that holds, else `default`."""

    type: Type
    conditions: tuple[Term, ...]
    values: tuple[Term, ...]
    default: Term


@dataclass(frozen=True, slots=True)
class CellOf:
    """The cell of an entity."""

    type: Type
    entity: Term


@dataclass(frozen=True, slots=True)
class PokedNow:
    """Whether the agent toggled at this entity in this step."""

    entity: Term
    type: Type = BOOL


@dataclass(frozen=True, slots=True)
class Pattern:
    """A set of the agent's utterances: pairs (template, filling); `text` is how it was written."""

    pairs: frozenset[tuple[int, int]]
    text: str
    said_by_npcs: frozenset[str] = frozenset()
    nouns: tuple[tuple[str, int], ...] = ()
    """Plain texts of NPCs (without speaker) that match as well; with slots, the filling in each of them."""
    hearer: int | None = None
    addressed: bool | None = None
    """Where members address each other: whose ears it is for, and if it has to be said to that member, or must not."""


@dataclass(frozen=True, slots=True)
class Said:
    """The agent said one of these in this step, at whatever distance."""

    pattern: Pattern
    type: Type = BOOL


@dataclass(frozen=True, slots=True)
class Spoke:
    """The agent said anything in this step."""

    type: Type = BOOL


@dataclass(frozen=True, slots=True)
class Heard:
    """The member whose frame this is heard one of these since its last turn."""

    patterns: tuple[Pattern, ...]
    type: Type = BOOL


@dataclass(frozen=True, slots=True)
class Speaker:
    """The speaker of the first utterance since the member's last turn that one of these patterns matches."""

    type: Type
    patterns: tuple[Pattern, ...]


@dataclass(frozen=True, slots=True)
class HeardNoun:
    """The noun, or with `digit` what stands in a slot, in what one of these patterns matches: of what the member has
    heard since its last turn, the first.
    """

    type: Type
    patterns: tuple[Pattern, ...]
    digit: Digit | None = None


@dataclass(frozen=True, slots=True)
class SaidBy:
    """An NPC has said in this step something that a pattern matches, at whatever distance; None: anything."""

    entity: int
    pattern: Pattern | None
    type: Type = BOOL


@dataclass(frozen=True, slots=True)
class CellBeside:
    """The cell beside something in a direction; of no place if that is off the canvas."""

    type: Type
    entity: Term
    direction: Term


@dataclass(frozen=True, slots=True)
class InState:
    """The frame of a cast member is in the state of this name."""

    member: str
    frame: str
    state: str
    type: Type = BOOL


Quantifier = Literal["any", "all", "count", "first", "pick", "nearest"]


@dataclass(frozen=True, slots=True)
class Quantification:
    """any, all, count, first, nearest, pick over the constants `items`; `condition` may hold Variable(name).

    pick and first give an item (`type` is the items'); count an int; any and all a bool; nearest the item with
    the least distance to `to`. `ordinal` numbers the picks of one value in source order (draws.py); `site` is empty
    unless the pick comes from a slot that is substituted into a larger value: then it is the site of the slot.
    With `cells` the items are all floor cells, row by row, and the variable is a cell.
    """

    type: Type
    op: Quantifier
    variable: str
    items: tuple[Const, ...]
    condition: Term | None
    to: Term | None = None
    ordinal: int = 0
    site: str = ""
    cells: bool = False


Term = (
    Const
    | Read
    | ReadEach
    | World
    | FieldOf
    | Here
    | Variable
    | Operation
    | Measure
    | Compare
    | Logic
    | Not
    | Test
    | Sees
    | Chance
    | Select
    | CellOf
    | CellBeside
    | Speaker
    | HeardNoun
    | SaidBy
    | PokedNow
    | Said
    | Spoke
    | Heard
    | InState
    | Quantification
)


@dataclass(frozen=True, slots=True)
class SitedTerm:
    """A term together with the site of its picks (a path, see draws.py) and where it was written."""

    term: Term
    site: str
    span: Span


@dataclass(frozen=True, slots=True)
class Line:
    """A line: fixed pieces and values with words, joined; `site` for picks inside. `to`: who is addressed."""

    parts: tuple[str | Term, ...]
    site: str
    span: Span
    to: SitedTerm | None = None
    called: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True, slots=True)
class ObjectType(Leaf):
    """A type of the prelude: what its statuses mean. All mappings are by index of status."""

    name: str
    code: int
    states: tuple[str, ...]
    initial: int
    walkable: frozenset[int]
    transparent: frozenset[int]
    toggled: dict[int, int] = field(hash=False)
    deadly: bool = False
    color: int = 0
    """Of what is built of it; an object has a colour of its own."""
    active: frozenset[int] = frozenset()
    """Statuses in which it works on what it is linked to (`unlocks`, `opens`)."""
    pushed: dict[int, int] = field(default_factory=dict, hash=False)
    """Status -> status after a push; those left out resist it."""
    rolls: frozenset[int] = frozenset()
    """Statuses in which it rolls; when something is in its way it takes the type's initial status."""
    expired: dict[int, int] = field(default_factory=dict, hash=False)
    """Active status -> the status it has when its timer has run out."""
    shown: dict[int, tuple[int, int]] = field(default_factory=dict, hash=False)
    look: str = ""
    """What it is drawn as; its own name unless it borrows the look of another."""
    letters: str = "?"
    """In text pictures: a letter for each status, of which the last serves the rest; what rolls is an arrow instead."""
    mark: str | None = None
    """What stands before its letter where it has the colour of its type, in place of the colour's letter."""

    @property
    def unlocked(self) -> int:
        """Its status after unlocking: closed, if it can be, else its initial one."""
        return self.states.index("closed") if "closed" in self.states else self.initial


TURN = Type("int", -1, 1, TURNS)
"""A quarter turn: -1 left, 1 right; the argument of the activity `turn` and of the operation `turn`."""

SIDE = Type("int", 0, len(SIDES) - 1, SIDES)
"""A wall. A region `wall` whose side is drawn has `side` None and the side as its only argument."""


# -- constructors, which simplify where the result is plain --------------------------------------------------


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


def numbers_of(term: Term) -> Sequence[int]:
    """The values that a term may have: that of a known one, else all of its type."""
    return (term.value,) if isinstance(term, Const) else term.type.values


def constants(type_: Type) -> tuple[Const, ...]:
    """Every value of a type."""
    return tuple(Const(type_, value) for value in type_.values)


def as_number(term: Term) -> Term:
    """An entity's number as a number."""
    return replace(term, type=integer(term.type.low, term.type.high))


def equals(term: Term, value: int) -> Compare:
    """Whether a term is a value of its type."""
    return Compare("==", term, Const(term.type, value))


def chosen(key: Term, numbers: Sequence[int], values: Sequence[Term], type_: Type) -> Select:
    """The value beside the number that a term is; the last one serves the rest."""
    cases = tuple(equals(key, number) for number in numbers[:-1])
    return Select(type_, cases, tuple(values[:-1]), values[-1])


def nothing_of(type_: Type) -> int:
    """The number that stands for nothing in a register of values of a type, none of which it is."""
    return -1 if type_.kind == "entity" else type_.low - 1


def may_be_nothing(term: Term) -> bool:
    """Whether a term is a register that may hold nothing, which can be compared, and no more."""
    if isinstance(term, Select):
        return any(map(may_be_nothing, (*term.values, term.default)))
    return isinstance(term, Read | ReadEach) and term.nothing is not None


def where_there_is(needed: Term, result: Term) -> Term:
    """A value that follows from another: of an empty register, or of what is not found, nothing follows.

    The other is asked for first where the value itself does not ask for it, or compares it alone.
    """
    unasked = may_find_nothing(needed) and needed not in walk(result)
    return _asking_first(needed, result) if may_be_nothing(needed) or unasked else result


def _asking_first(needed: Term, result: Term) -> Term:
    never = Compare("<", needed, Const(needed.type, needed.type.low))
    return Select(result.type, (never,), (Const(result.type, result.type.low),), result)


def holds_nothing(term: Term) -> Term:
    """Whether a register holds nothing."""
    if isinstance(term, Select):
        values = tuple(map(holds_nothing, term.values))
        return Select(BOOL, term.conditions, values, holds_nothing(term.default))
    if isinstance(term, Read | ReadEach) and term.nothing is not None:
        return Compare("==", term, Const(term.type, term.nothing))
    return FALSE


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
    if not may_be_nothing(term) and len(numbers) > 2 and numbers[-1] - numbers[0] == len(numbers) - 1:
        return between(term, Const(term.type, numbers[0]), Const(term.type, numbers[-1]))
    return any_of(Compare("==", term, value) for value in values)


def arithmetic(op: Any, *args: Term) -> Term:
    """An operation on numbers with the range of its result; known values are computed."""
    if all(isinstance(arg, Const) for arg in args):
        return number(compute(op, *(arg.value for arg in args if isinstance(arg, Const))))
    return Operation(range_of(op, *(arg.type for arg in args)), op, args)


COMPARISONS: Final[dict[str, Callable[[int, int], bool]]] = {"==": eq, "!=": ne, "<": lt, "<=": le}
"""How numbers that are known compare."""

_OF_ONE: Final[dict[str, Callable[[int], int]]] = {"abs": abs, "neg": neg}
_OF_TWO: Final[dict[str, Callable[[int, int], int]]] = {
    "+": add,
    "-": sub,
    "*": mul,
    "//": lambda a, b: a // b if b else 0,
    "%": lambda a, b: a % b if b else 0,
    "min": min,
    "max": max,
}


def compute(op: str, *values: int) -> int:
    """The result of an operation on numbers that are known; as in a room, dividing by nothing gives 0."""
    return _OF_ONE[op](*values) if op in _OF_ONE else reduce(_OF_TWO[op], values)


def range_of(op: str, *types: Type) -> Type:
    """The range of the result of an operation on numbers of some ranges."""
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
    return other if other is not None else ast.rebuilt(value, lambda part: changed(part, change))


def walk(tree: Any) -> Iterator[Term]:
    """All terms in a term, a plan or a tuple of them, depth first."""
    return (node for node in ast.walk(tree) if isinstance(node, Term))


def draws(term: Term) -> bool:
    """Whether something is drawn anew wherever a term is evaluated."""
    return any(isinstance(part, Quantification) and part.op == "pick" for part in walk(term))


def may_find_nothing(term: Term) -> bool:
    """Whether a term may need one of a group when none is what is wanted, or the noun of a member that is silent.

    What `prev` noted may have found nothing then, and a register may hold nothing.
    """
    return any(map(is_looked_for, walk(term)))


def is_looked_for(part: object) -> bool:
    """Whether one term, apart from what it is made of, may find nothing."""
    if isinstance(part, HeardNoun) or (isinstance(part, World) and is_own_noun(part)):
        return True
    if isinstance(part, Quantification):
        return part.op in ("first", "pick", "nearest")
    if isinstance(part, Read):
        return part.may_miss or part.nothing is not None
    return isinstance(part, ReadEach | FieldOf) and part.may_miss


def is_own_noun(term: Term) -> bool:
    """Whether a term is `agent.noun`: while the agent is silent, that is unlike any noun."""
    return isinstance(term, World) and term.name == "noun"


# -- how conditions were written, for explanations of why one is false ---------------------------------------


Entry = Rule | Step | WorldRule | Outcome


@dataclass(eq=False)
class Reading:
    """A part of an expression: how it was written, what it means, and the parts it is made of.

    What a definition or a slot stands for is a part of its name.
    """

    node: ast.Expr
    term: Term | None = None
    parts: list[Reading] = field(default_factory=list)

    def walk(self) -> Iterator[Reading]:
        """This part, then those it is made of."""
        yield self
        for part in self.parts:
            yield from part.walk()

    def conjuncts(self) -> Iterator[Reading]:
        """The conditions that must all hold for this one to hold, in the order in which they are asked."""
        operands: tuple[ast.Expr, ...] = ()
        if isinstance(self.node, ast.Logic) and self.node.op == "and":
            operands = self.node.operands
        elif isinstance(self.node, ast.Name | ast.Call) and self._stands_for_its_part():
            yield from self.parts[-1].conjuncts()
            return
        if len(operands) != len(self.parts) or not operands:
            yield self
            return
        for part in self.parts:
            yield from part.conjuncts()

    def _stands_for_its_part(self) -> bool:
        """Whether this is the name of a condition that is written elsewhere."""
        return bool(self.parts) and self.parts[-1].term == self.term and not isinstance(self.term, Const)


class Readings:
    """How the expressions of a scenario were written.

    Attributes:
        roots: site of a value (draws.py) -> its reading. entries: site of a rule, step or outcome -> itself.
    """

    def __init__(self) -> None:
        self.roots: dict[str, Reading] = {}
        self.entries: dict[str, Entry] = {}
        self._open: list[Reading] = []

    def begin(self, node: ast.Expr) -> Reading:
        """A part of an expression is going to be read."""
        reading = Reading(node)
        self._open.append(reading)
        return reading

    def end(self, reading: Reading, term: Term | None, site: str) -> None:
        """It has been read; `term` is None if it means nothing. A whole value is kept by its site."""
        self._open.pop()
        reading.term = term
        if term is None:
            return
        if self._open:
            self._open[-1].parts.append(reading)
        else:
            self.roots[site] = reading

    def join(self, first: str, second: str) -> None:
        """The value of one site has become a part of that of another, which holds if both do."""
        whole, part = self.roots.get(first), self.roots.get(second)
        if whole is not None and part is not None:
            node = ast.Logic("and", (part.node, whole.node), at=part.node.at, end=part.node.end)
            self.roots[first] = Reading(node, None, [part, whole])

    def change(self, site: str, change: Callable[[Term], Term | None]) -> None:
        """Replace terms in what was read for a site, as `changed` does."""
        root = self.roots.get(site)
        for reading in root.walk() if root is not None else ():
            reading.term = changed(reading.term, change)
