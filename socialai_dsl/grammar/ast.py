"""Syntax trees of the strings inside a scenario file, each node with its offset, and the one visitor of trees."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any, Literal, TypeVar

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
    for node in _nodes(tree):
        yield node
        yield from walk(tuple(children(node)))


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
    return change(value) if _is_node(value) else value


def _nodes(value: object) -> Iterator[Any]:
    if isinstance(value, tuple | list):
        for part in value:
            yield from _nodes(part)
    elif _is_node(value):
        yield value


def _is_node(value: object) -> bool:
    return hasattr(type(value), "__dataclass_fields__") and not isinstance(value, Leaf)


@cache
def _names(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind)) if hasattr(kind, "__dataclass_fields__") else ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A piece of an expression."""

    at: int = 0

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
class Placed(Node):
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
    | Placed
)


def moved(node: Expr, place: Callable[[int], int]) -> Expr:
    """The same tree with every offset changed."""
    offsets: dict[str, Any] = {
        name: place(getattr(node, name)) for name in ("at", "name_at") if hasattr(node, name)
    }
    found: Expr = replace(rebuilt(node, lambda part: moved(part, place)), **offsets)
    return found
