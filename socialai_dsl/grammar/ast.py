"""The small language inside YAML strings: syntax trees, the visitor of trees, the parser, and trees as text again.

`at` is the 0-based offset of the node's first character (of its operator's first character for none of them:
always the leftmost character of the node), so a loader can turn it into file:line:column.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, lru_cache
from itertools import islice, pairwise
from math import gcd
from operator import attrgetter
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple, TypeVar

from lark import Lark, v_args
from lark.exceptions import UnexpectedCharacters, UnexpectedEOF, UnexpectedInput, UnexpectedToken, VisitError
from lark.visitors import Transformer_NonRecursive

from socialai_dsl.widths import LARGEST_NUMBER

Kind = TypeVar("Kind")


class Leaf:
    """Nothing of a tree is in it, though it is a dataclass; visitors pass it by."""

    __slots__ = ()


def children(node: Any) -> Iterator[Any]:
    """The nodes right below one, in the order of its fields; those in tuples, also in tuples of tuples, one by one."""
    for name in _names(node.__class__):
        yield from _nodes(getattr(node, name))


def walk(tree: object) -> Iterator[Any]:
    """Every node of a tree, or of a tuple or list of trees, depth first."""
    waiting: list[Any] = [tree]
    while waiting:
        value = waiting.pop()
        parts = _parts_of(value.__class__)
        if parts is not None:
            if parts is not reversed:  # a node, and no list of nodes
                yield value
            waiting.extend(parts(value))


def every(kind: type[Kind], tree: object) -> Iterator[Kind]:
    """Every node of a kind, depth first."""
    return (node for node in walk(tree) if isinstance(node, kind))


def rebuilt(node: Any, change: Callable[[Any], Any]) -> Any:
    """The same node with `change` applied to each right below it."""
    changes: dict[str, Any] = {}
    for name in _names(node.__class__):
        value = getattr(node, name)
        other = _changed(value, change)
        if other is not value:
            changes[name] = other
    return replace(node, **changes) if changes else node


def _changed(value: Any, change: Callable[[Any], Any]) -> Any:
    if isinstance(value, tuple):
        others = tuple(_changed(part, change) for part in value)
        return others if any(other is not part for other, part in zip(others, value, strict=True)) else value
    return change(value) if _is_node(value.__class__) else value


def _nodes(value: Any) -> Iterator[Any]:
    if isinstance(value, tuple | list):
        for part in value:
            yield from _nodes(part)
    elif _is_node(value.__class__):
        yield value


@cache
def _is_node(kind: type) -> bool:
    return hasattr(kind, "__dataclass_fields__") and not issubclass(kind, Leaf)


_PLAIN: Final = {"str", "int", "bool", "float", "None", "tuple", "list", "frozenset", "DataPath"}
"""The words of the annotations of fields that never hold a node."""


@cache
def _names(kind: type) -> tuple[str, ...]:
    """The fields in which nodes may be."""
    if not hasattr(kind, "__dataclass_fields__"):
        return ()
    return tuple(field.name for field in fields(kind) if {*re.findall(r"\w+", str(field.type))} - _PLAIN)


@cache
def _parts_of(kind: Any) -> Callable[[Any], Iterable[Any]] | None:
    """What gives the parts of a value of a kind, the last one first: its items, or its fields; None if it has none."""
    if issubclass(kind, tuple | list):
        return reversed
    if not _is_node(kind):
        return None
    names = _names(kind)[::-1]
    if len(names) > 1:
        return attrgetter(*names)
    return lambda value: [getattr(value, name) for name in names]


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A piece of an expression.

    Attributes:
        at: where it begins in what was parsed; of a text, behind its quotation mark.
        end: where it ends, a text with its quotation mark.
    """

    at: int = 0
    end: int = 0

    def children(self) -> Iterator[Expr]:
        """The sub-expressions in source order."""
        yield from children(self)

    def walk(self) -> Iterator[Expr]:
        """This node and everything below it, depth first, in source order."""
        yield self  # type: ignore[misc]
        for child in self.children():
            yield from child.walk()


@dataclass(frozen=True, slots=True)
class Number(Node):
    """A whole number: `4`."""

    value: int


@dataclass(frozen=True, slots=True)
class Truth(Node):
    """`true` or `false`."""

    value: bool


@dataclass(frozen=True, slots=True)
class Text(Node):
    """A quoted text, with `<...>` parts: `"Here is <wanted>"`; also a whole YAML text such as a `say:`."""

    parts: tuple[str | Expr, ...]

    @property
    def plain(self) -> str | None:
        """The text if it has no `<...>` part, else None."""
        if any(not isinstance(part, str) for part in self.parts):
            return None
        return "".join(part for part in self.parts if isinstance(part, str))


@dataclass(frozen=True, slots=True)
class Name(Node):
    """A bare word: something declared in the scenario, or a word of the language (`left`, `colors`, `t`)."""

    id: str


@dataclass(frozen=True, slots=True)
class Parameter(Node):
    """`$name`: the value of a parameter of the file."""

    id: str


@dataclass(frozen=True, slots=True)
class Attribute(Node):
    """`subject.name`: `exit.color`."""

    subject: Expr
    name: str
    name_at: int = 0


@dataclass(frozen=True, slots=True)
class Call(Node):
    """`name(args)`, or `subject.name(args)`: `next_to(exit)`, `agent.next_to(exit)`; subject None means one's own."""

    name: str
    args: tuple[Expr, ...]
    subject: Expr | None = None
    name_at: int = 0

    def children(self) -> Iterator[Expr]:
        """The subject, then the arguments: source order."""
        if self.subject is not None:
            yield self.subject
        yield from self.args


@dataclass(frozen=True, slots=True)
class Quantifier(Node):
    """`name(var in group where condition to target)`: any, all, count, first, pick, nearest."""

    name: str
    var: str
    group: Expr
    where: Expr | None = None
    to: Expr | None = None


@dataclass(frozen=True, slots=True)
class Not(Node):
    """`not operand`."""

    operand: Expr


@dataclass(frozen=True, slots=True)
class Logic(Node):
    """`a and b and c`, or the same with `or`, flattened."""

    op: Literal["and", "or"]
    operands: tuple[Expr, ...]


@dataclass(frozen=True, slots=True)
class Compare(Node):
    """`left op right` with one of == != <= >= < >."""

    op: str
    left: Expr
    right: Expr


@dataclass(frozen=True, slots=True)
class Member(Node):
    """`left in right`, or `left not in right`."""

    left: Expr
    right: Expr
    negated: bool = False


@dataclass(frozen=True, slots=True)
class Alternatives(Node):
    """`a | b | 2 * c`."""

    options: tuple[Expr, ...]


@dataclass(frozen=True, slots=True)
class Interval(Node):
    """`low .. high`, both included."""

    low: Expr
    high: Expr


@dataclass(frozen=True, slots=True)
class Arithmetic(Node):
    """`left op right` with one of + - * // %."""

    op: str
    left: Expr
    right: Expr


@dataclass(frozen=True, slots=True)
class Negative(Node):
    """`-operand`."""

    operand: Expr


@dataclass(frozen=True, slots=True)
class Conditional(Node):
    """`value if condition else other`."""

    value: Expr
    condition: Expr
    other: Expr


@dataclass(frozen=True, slots=True)
class FilteredRegion(Node):
    """`region where condition`, in a `place:`."""

    region: Expr
    where: Expr


Expr = (
    Number
    | Truth
    | Text
    | Name
    | Parameter
    | Attribute
    | Call
    | Quantifier
    | Not
    | Logic
    | Compare
    | Member
    | Alternatives
    | Interval
    | Arithmetic
    | Negative
    | Conditional
    | FilteredRegion
)


def options_of(node: Expr) -> tuple[Expr, ...]:
    """The parts of alternatives; anything else is the only one."""
    return node.options if isinstance(node, Alternatives) else (node,)


def moved(node: Expr, place: Callable[[int], int]) -> Expr:
    """The same tree with every offset changed."""
    offsets: dict[str, Any] = {
        name: place(getattr(node, name)) for name in ("at", "end", "name_at") if hasattr(node, name)
    }
    found: Expr = replace(rebuilt(node, lambda part: moved(part, place)), **offsets)
    return found


# -- parser: one lark LALR grammar, and lark's exceptions turned into one message with an offset -------------


MAX_LENGTH = 500
MAX_DEPTH = 24


class Instead(NamedTuple):
    """A text that is to stand in the place of the characters `start` to `end` of what was parsed."""

    start: int
    end: int
    text: str


class ParseProblem(Exception):  # noqa: N818 - a finding on its way to a diagnostic, not a failure
    """A mistake in a string of the language: a code of the catalogue, a message and a place.

    Attributes:
        code, message: of the finding.
        offset: 0-based, into the parsed string.
        hint: advice, or why `instead` is proposed; or None.
        words: several that stand side by side and may be a text; or None.
        instead: what is to be written in the place of some characters; or None.
    """

    def __init__(
        self,
        code: str,
        message: str,
        offset: int,
        hint: str | None = None,
        words: str | None = None,
        instead: Instead | None = None,
    ) -> None:
        super().__init__(message)
        self.code, self.message, self.offset, self.hint, self.words = code, message, offset, hint, words
        self.instead = instead

    def __str__(self) -> str:
        """The message and what is proposed, on one line."""
        proposed = f"write `{self.instead.text.strip()}`" if self.instead is not None else self.hint
        return f"{self.message}: {proposed}" if proposed else self.message

    def moved(self, by: int) -> ParseProblem:
        """The same in a longer string, of which this one begins at an offset."""
        instead = self.instead
        if instead is not None:
            instead = Instead(instead.start + by, instead.end + by, instead.text)
        return ParseProblem(self.code, self.message, self.offset + by, self.hint, self.words, instead)


@lru_cache(maxsize=4096)
def parse_expression(text: str) -> Expr:
    """The tree of an expression, place, activity or effect.

    Raises ParseProblem: S202 for brackets, S203 for a wrong symbol, S207 for chained comparisons,
    S210 for anything else, S004 when the text is too long or too deeply nested.
    """
    if len(text) > MAX_LENGTH:
        raise ParseProblem(
            "S004", f"an expression may have {MAX_LENGTH} characters, this one has {len(text)}", 0
        )
    _check_brackets(text)
    try:
        tree = _ToAst().transform(_parser().parse(text))
    except VisitError as error:
        if isinstance(error.orig_exc, ParseProblem):
            raise error.orig_exc from None
        raise
    except UnexpectedInput as error:
        raise _explain(text, error) from None
    assert isinstance(tree, Node), "internal: lark gave no tree"
    return tree  # type: ignore[return-value]


@lru_cache(maxsize=4096)
def parse_text(text: str) -> Text:
    """A text with `<...>` parts, each an expression; offsets inside count from the start of `text`."""
    parts: list[str | Expr] = []
    rest, stray = 0, None
    for start, end in [*_slots(text), (len(text), len(text))]:
        between = text[rest:start]
        if stray is None and (found := re.search("[<>]", between)) is not None:
            stray = rest + found.start()
        if between:
            parts.append(between)
        if start < end:
            parts.append(_parse_slot(text[start + 1 : end - 1], start + 1))
        rest = end
    if stray is not None:
        raise ParseProblem("S202", "a `<` or `>` without its partner: a slot is written <name>", stray)
    return Text(tuple(parts), at=0)


_MOST_ENDS = 8
"""The most comparisons and ends of slots after a `<` that are tried as the end of its slot."""


def _slots(text: str) -> Iterator[tuple[int, int]]:
    """Where the slots of a text begin and end; only that of a conditional value can have `<` and `>` in it."""
    place = text.find("<")
    while place >= 0:
        ends = [found.end() for found in islice(re.finditer(">", text[place:]), _MOST_ENDS)]
        inner = (text[place + 1 : place + end - 1] for end in ends)
        asks = [end for end, slot in zip(ends, inner, strict=True) if re.search(r"\bif\b", slot)]
        whole = next((end for end in asks if _is_expression(text[place + 1 : place + end - 1])), None)
        if whole is None:
            plain = re.match("<[^<>]*>", text[place:])
            whole = plain.end() if plain is not None else None
        if whole is not None:
            yield place, place + whole
        place = text.find("<", place + (whole or 1))


def _is_expression(text: str) -> bool:
    try:
        parse_expression(text)
    except ParseProblem:
        return False
    return True


def _parse_slot(inner: str, offset: int) -> Expr:
    if not inner.strip():
        raise ParseProblem("S202", "an empty slot `<>`", offset - 1)
    try:
        return moved(parse_expression(inner), lambda at: at + offset)
    except ParseProblem as problem:
        raise problem.moved(offset) from None


@cache
def _parser() -> Lark:
    grammar = Path(__file__).with_name("expression.lark").read_text(encoding="utf-8")
    return Lark(grammar, parser="lalr", lexer="contextual", propagate_positions=True)


_DIGITS = 20
"""Of a number at most; of thousands Python makes no number."""
_CITED = 12
"""Digits of a number that a message repeats."""


@v_args(meta=True)
class _ToAst(Transformer_NonRecursive):  # type: ignore[type-arg]
    """Builds our nodes from lark's tree, bottom-up, so no recursion depends on the input."""

    def _made(self, meta: Any, node: Any) -> Any:
        depth = 1 + max((_depth_of(child) for child in node.children()), default=0)
        if depth > MAX_DEPTH:
            raise ParseProblem("S004", f"an expression may be nested {MAX_DEPTH} deep", meta.start_pos)
        return replace(node, at=meta.start_pos, end=meta.end_pos)

    def number(self, meta: Any, items: list[Any]) -> Any:
        if len(items[0]) > _DIGITS or int(items[0]) > LARGEST_NUMBER:
            cited = items[0] if len(items[0]) <= _CITED else f"{items[0][:_CITED]}..."
            message = f"the number {cited} is too large; numbers go up to {LARGEST_NUMBER:,}"
            raise ParseProblem("S004", message, meta.start_pos)
        return self._made(meta, Number(int(items[0])))

    def text(self, meta: Any, items: list[Any]) -> Any:
        inner = parse_text(str(items[0])[1:-1])
        made = self._made(meta, moved(inner, lambda at: at + meta.start_pos + 1))
        return replace(made, at=meta.start_pos + 1)

    def yes(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Truth(True))

    def no(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Truth(False))

    def parameter(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Parameter(str(items[0])))

    def name(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Name(str(items[0])))

    def binder(self, meta: Any, items: list[Any]) -> Any:
        return tuple(items)

    def args(self, meta: Any, items: list[Any]) -> Any:
        return tuple(items)

    def quantifier(self, meta: Any, items: list[Any]) -> Any:
        name, (var, group, where, to) = items
        return self._made(meta, Quantifier(str(name), str(var), group, where, to))

    def call(self, meta: Any, items: list[Any]) -> Any:
        name, args = items
        return self._made(meta, Call(str(name), args or (), None, name.start_pos))

    def verb(self, meta: Any, items: list[Any]) -> Any:
        subject, name, args = items
        return self._made(meta, Call(str(name), args or (), subject, name.start_pos))

    def attribute(self, meta: Any, items: list[Any]) -> Any:
        subject, name = items
        return self._made(meta, Attribute(subject, str(name), name.start_pos))

    def negative(self, meta: Any, items: list[Any]) -> Any:
        if items[0] != "-":
            sign = Instead(meta.start_pos, meta.start_pos + 1, "")
            raise ParseProblem("S203", "a leading `+` is not needed", meta.start_pos, instead=sign)
        return self._made(meta, Negative(items[1]))

    def arithmetic(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Arithmetic(str(items[1]), items[0], items[2]))

    def interval(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Interval(*items))

    def alternatives(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Alternatives(tuple(items)))

    def comparison(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Compare(str(items[1]), items[0], items[2]))

    def membership(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Member(items[0], items[1]))

    def exclusion(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Member(items[0], items[1], True))

    def negation(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Not(items[0]))

    def all_of(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Logic("and", tuple(items)))

    def any_of(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Logic("or", tuple(items)))

    def conditional(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, Conditional(*items))

    def placed(self, meta: Any, items: list[Any]) -> Any:
        return self._made(meta, FilteredRegion(*items))


def _depth_of(node: Expr) -> int:
    # Children were checked when they were made, so this recursion is bounded by MAX_DEPTH.
    return 1 + max((_depth_of(child) for child in node.children()), default=0)


_CONDITIONAL = "`a if condition else b`"

_SYMBOLS = {
    "&&": "and",
    "&": "and",
    "||": "or",
    "!": "not ",
    "=": "==",
    "/": "//",
}
"""Symbols of other languages, and what is written instead."""

_OTHER_SYMBOLS = {
    "'": 'a text is quoted with "',
    "{": "a slot is written <name>",
    "[": "alternatives are written a | b",
    ";": "one expression at a time",
    "?": f"a value that depends is written {_CONDITIONAL}",
}
"""Those in whose place nothing can be written."""


def _explain(text: str, error: UnexpectedInput) -> ParseProblem:
    """Lark's exception as one sentence of ours."""
    if isinstance(error, UnexpectedCharacters):
        offset = error.pos_in_stream
        return _wrong_symbol(text, offset or 0)
    if isinstance(error, UnexpectedEOF) or (
        isinstance(error, UnexpectedToken) and error.token.type == "$END"
    ):
        if isinstance(error, UnexpectedToken) and "ELSE" in error.expected:
            cure = f"a value that depends is written {_CONDITIONAL}"
            return ParseProblem("S210", "`if` without `else`", len(text), cure)
        return ParseProblem(
            "S210", "the expression ends too early: something is missing at its end", len(text)
        )
    assert isinstance(error, UnexpectedToken), "internal: an unknown kind of lark error"
    token, offset = error.token, error.token.start_pos or 0
    if token.type == "CMP" and "NAME" in error.expected:  # a value is to come first
        return ParseProblem("S210", f"something is missing before `{token}`", offset, _BOTH_SIDES)
    if token.type == "CMP" and "CMP" not in error.expected:
        return ParseProblem("S207", "comparisons do not chain", offset, instead=_unchained(text, offset))
    if text.startswith("||", offset - 1):
        return _wrong_symbol(text, offset - 1)
    if token.type == "RPAR":
        return ParseProblem("S202", "something is missing before this bracket", offset)
    if (problem := _of_numbers(text, offset) or _of_groups(text, offset, token)) is not None:
        return problem
    if token.type == "WHERE":
        return ParseProblem("S210", "`where` belongs in a place or inside pick(d in group where ...)", offset)
    hint: str | None = None
    words = None
    if token.type in ("IF", "ELSE"):
        hint = f"a value that depends is written {_CONDITIONAL}"
    if token.type == "NAME":
        words = next(found[0] for found in _SEVERAL.finditer(text) if found.start() <= offset < found.end())
        hint = "between two names stands a dot, an operator, or a word such as `and`: `agent.next_to(exit)`"
    return ParseProblem("S210", f"did not expect `{token}` here", offset, hint, words)


_BOTH_SIDES = "both sides of a comparison are written out: `t > 3 and t < 5`"

_UNITS = "cells? m steps? turns? rounds? s sec seconds? times? frames? pixels? px episodes?".replace(" ", "|")
_UNIT = re.compile(rf"(?<![\w.])(\d+) *(?:{_UNITS})\b(?!\s*[.(])")
"""A number with what it counts."""

_WEIGHT = re.compile(r"(?<![\w.])(\d*)\.(\d+)(?=\s*\*)")
"""A weight with decimals."""

_WHOLE = "numbers in expressions are whole; what is drawn is `pick(a | b)`, with weights `pick(3 * a | b)`"

_LOOKING = re.compile(r"(\w+)\(\s*(\w+)\s+$")
"""What stands before the second word of `any(d in doors ...)`."""


def _of_numbers(text: str, offset: int) -> ParseProblem | None:
    """The problem of a number with a unit or with decimals."""
    for found in _UNIT.finditer(text):
        if found.start() <= offset < found.end():
            instead = Instead(*found.span(), found[1])
            return ParseProblem(
                "S210", f"`{found[0]}` is not a number", offset, "a number has no unit", instead=instead
            )
    decimal = next((f for f in re.finditer(r"\d*\.\d+", text) if f.start() <= offset < f.end()), None)
    if decimal is None:
        return None
    message, weights = f"`{decimal[0]}` is not a whole number", list(_WEIGHT.finditer(text))
    if not any(weight.start() == decimal.start() for weight in weights):
        return ParseProblem("S210", message, decimal.start(), _WHOLE)
    if len(weights) <= text.count("|"):
        return ParseProblem("S210", message, decimal.start(), "weights are whole, such as `2 * left | right`")
    # The same proportions in whole numbers.
    places = max(len(weight[2]) for weight in weights)
    parts = [int(weight[1] + weight[2].ljust(places, "0")) for weight in weights]
    parts = [part // max(1, gcd(*parts)) for part in parts]
    start, end = weights[0].start(), weights[-1].end()
    weighed = re.compile(r"\s*\*\s*[\w.]*").match(text, end)
    assert weighed is not None, "internal: a weight stands before what it weighs"
    pieces = [text[a.end() : b.start()] for a, b in pairwise(weights)]
    scaled = "".join(f"{part}{piece}" for part, piece in zip(parts, [*pieces, weighed[0]], strict=True))
    end = weighed.end()
    return ParseProblem(
        "S210", message, decimal.start(), "weights are whole", instead=Instead(start, end, scaled)
    )


def _of_groups(text: str, offset: int, token: Any) -> ParseProblem | None:
    """The problem of `any(d of doors ...)`, or of `any(doors where ...)`."""
    looking = _LOOKING.search(text[:offset])
    if looking is None:
        return None
    if str(token) in ("of", "from", "among"):
        instead = Instead(offset, offset + len(token), "in")
        return ParseProblem("S210", f"did not expect `{token}` here", offset, instead=instead)
    if token.type != "WHERE":
        return None
    group, letter = looking[2], looking[2][0]
    hint = f"give one of the group a name: `{looking[1]}({letter} in {group} where {letter}. ...)`"
    return ParseProblem("S210", f"nothing is said about one of `{group}`", offset, hint)


_SEVERAL = re.compile(
    r"\b(?!(?:and|or|not|in|where|to|if|else)\b)[\w']+(?: +(?!(?:and|or|not|in|where|to|if|else)\b)[\w']+)*"
)
"""Words with nothing but blanks between them."""

_WORDS = re.compile(r"\"[^\"]*\"|[<>=!]=|[<>()]|,|\b(?:and|or|not|where|to|if|else)\b|[^<>=!()\",\s]+|\s+|.")
"""The pieces of an expression, as far as they say where a comparison begins and ends."""

_COMPARES = frozenset({"in", "==", "!=", "<=", ">=", "<", ">"})
_BOUNDS = frozenset({"and", "or", "not", "where", "to", "if", "else", ","})


def _unchained(text: str, offset: int) -> Instead:
    """`a < b and b < c` for the chain `a < b < c` whose second comparison stands at `offset`."""
    pieces = [(found.start(), found.group()) for found in _WORDS.finditer(text)]
    second = next(i for i, (start, _) in enumerate(pieces) if start == offset)
    first = _same_level(pieces, second, -1, _COMPARES)
    left = _same_level(pieces, first, -1, _BOUNDS)
    right = _same_level(pieces, second, 1, _BOUNDS | _COMPARES)

    def words(begin: int, end: int) -> str:
        return " ".join("".join(piece for _, piece in pieces[begin:end]).split())

    shared = words(first + 1, second)
    # Blanks around the comparisons stay where they are.
    chain = text[_start(text, pieces, left + 1) : _start(text, pieces, right)]
    start = _start(text, pieces, left + 1) + len(chain) - len(chain.lstrip())
    unchained = f"{words(left + 1, second)} and {shared} {words(second, right)}"
    return Instead(start, start + len(chain.strip()), unchained)


def _start(text: str, pieces: Sequence[tuple[int, str]], number: int) -> int:
    """Where a piece begins, or the text ends."""
    return pieces[number][0] if number < len(pieces) else len(text)


def _same_level(pieces: list[tuple[int, str]], start: int, step: int, ends: frozenset[str]) -> int:
    """The first of `ends` on one side of `start` that is not in brackets; else the bracket around, or the end."""
    opening, closing = ("(", ")") if step > 0 else (")", "(")
    depth, i = 0, start + step
    while 0 <= i < len(pieces):
        piece = pieces[i][1]
        if depth == 0 and (piece in ends or piece == closing):
            return i
        depth += (piece == opening) - (piece == closing)
        i += step
    return i


_NUMBERED = re.compile(r"(?P<group>\w+)\[\s*(?P<index>[^\[\]]+?)\s*\]")
"""`doors[0]`, `doors[turn + 1]`"""


def _wrong_symbol(text: str, offset: int) -> ParseProblem:
    numbered = next((found for found in _NUMBERED.finditer(text) if found.end("group") == offset), None)
    if numbered is not None:
        letter = "o" if numbered["group"] == "d" else "d"
        found = f"first({letter} in {numbered['group']} where {letter}.index == {numbered['index']})"
        return ParseProblem("S203", "`[` is not used here", offset, instead=Instead(*numbered.span(), found))
    if text[offset] == ":" and re.search(r"\(\s*\w+ in [\w.]+$", text[:offset]) is not None:
        instead = Instead(offset, offset + 1, " where")
        return ParseProblem("S203", "`:` is not used here", offset, instead=instead)
    for symbol, meant in _SYMBOLS.items():
        if text.startswith(symbol, offset):
            instead = Instead(offset, offset + len(symbol), meant)
            return ParseProblem("S203", f"`{symbol}` is not used here", offset, instead=instead)
    for symbol, hint in _OTHER_SYMBOLS.items():
        if text.startswith(symbol, offset):
            return ParseProblem("S203", f"`{symbol}` is not used here", offset, hint)
    return ParseProblem("S203", f"`{text[offset]}` means nothing here", offset)


def _check_brackets(text: str) -> None:
    """Unbalanced brackets are the commonest slip and lark reports them far from the cause."""
    opened: list[int] = []
    quote: int | None = None
    for offset, char in enumerate(text):
        if char == '"':
            quote = offset if quote is None else None
        elif quote is not None:
            continue
        elif char == "(":
            opened.append(offset)
            if len(opened) > MAX_DEPTH:
                raise ParseProblem("S004", f"an expression may be nested {MAX_DEPTH} deep", offset)
        elif char == ")":
            if not opened:
                raise ParseProblem("S202", "a bracket is closed that was not opened", offset)
            opened.pop()
    if quote is not None:
        raise ParseProblem("S202", 'a text is not closed: its second `"` is missing', quote)
    if opened:
        raise ParseProblem("S202", "a bracket is not closed", opened[-1])


_IF, _OR, _AND, _NOT, _COMPARED, _CHOICE, _RANGE, _SUM, _PRODUCT, _UNARY, _ATOM = range(11)
_ARITHMETIC: Final = {"+": _SUM, "-": _SUM, "*": _PRODUCT, "//": _PRODUCT, "%": _PRODUCT}


def unparse(node: Expr, shortened: bool = False) -> str:
    """The expression in one line; parsing it gives the same tree again, but for the offsets.

    `shortened`, for messages: what is said about each of a group, or about a place, is `...`.
    """
    return _Writer(shortened).write(node)


class _Writer:
    """Writes expressions, whole or shortened."""

    def __init__(self, shortened: bool) -> None:
        self._shortened = shortened

    def write(self, node: Expr) -> str:
        match node:
            case Number(value=number):
                return str(number)
            case Truth(value=truth):
                return "true" if truth else "false"
            case Text(parts=parts):
                return '"' + "".join(p if isinstance(p, str) else f"<{self.write(p)}>" for p in parts) + '"'
            case Name(id=word):
                return word
            case Parameter(id=word):
                return f"${word}"
            case Attribute(subject=subject, name=word):
                return f"{self._inside(subject, _ATOM)}.{word}"
            case Call(name=word, args=arguments, subject=owner):
                head = f"{self._inside(owner, _ATOM)}.{word}" if owner is not None else word
                return f"{head}({', '.join(map(self.write, arguments))})"
            case Quantifier(name=word, var=var, group=group) if self._shortened:
                return f"{word}({var} in {self._inside(group, _CHOICE)} ...)"
            case FilteredRegion(region=region) if self._shortened:
                return f"{self.write(region)} where ..."
            case Quantifier(name=word, var=var, group=group, where=where, to=to):
                tail = f" where {self.write(where)}" if where is not None else ""
                tail += f" to {self.write(to)}" if to is not None else ""
                return f"{word}({var} in {self._inside(group, _CHOICE)}{tail})"
            case FilteredRegion(region=region, where=where):
                return f"{self.write(region)} where {self.write(where)}"
            case _:
                return self._operation(node)

    def _operation(self, node: Expr) -> str:
        own = _strength(node)
        match node:
            case Not(operand=operand):
                return f"not {self._inside(operand, own)}"
            case Logic(op=op, operands=operands):
                return f" {op} ".join(self._inside(operand, own + 1) for operand in operands)
            case Compare(op=op, left=left, right=right):
                return f"{self._inside(left, own + 1)} {op} {self._inside(right, own + 1)}"
            case Member(left=left, right=right, negated=negated):
                return f"{self._inside(left, own + 1)} {'not in' if negated else 'in'} {self._inside(right, own + 1)}"
            case Alternatives(options=options):
                return " | ".join(self._inside(option, own + 1) for option in options)
            case Interval(low=low, high=high):
                return f"{self._inside(low, own + 1)}..{self._inside(high, own + 1)}"
            case Arithmetic(op=op, left=left, right=right):
                return f"{self._inside(left, own)} {op} {self._inside(right, own + 1)}"
            case Negative(operand=operand):
                return f"-{self._inside(operand, own)}"
            case Conditional(value=value, condition=condition, other=other):
                asked = f"{self._inside(value, _OR)} if {self._inside(condition, _OR)}"
                return f"{asked} else {self._inside(other, own)}"
        raise AssertionError(f"internal: no text for {type(node).__name__}")

    def _inside(self, node: Expr, least: int) -> str:
        """A part of another expression, in brackets where it binds less than that needs."""
        text = self.write(node)
        return text if _strength(node) >= least else f"({text})"


def _strength(node: Expr) -> int:
    match node:
        case Logic(op=op):
            return _OR if op == "or" else _AND
        case Not():
            return _NOT
        case Compare() | Member():
            return _COMPARED
        case Alternatives():
            return _CHOICE
        case Interval():
            return _RANGE
        case Arithmetic(op=op):
            return _ARITHMETIC[op]
        case Negative():
            return _UNARY
        case Conditional():
            return _IF
        case _:
            return _ATOM
