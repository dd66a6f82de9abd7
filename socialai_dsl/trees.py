"""The one visitor of trees of frozen dataclasses: syntax trees, terms, and the plans that are made of terms."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from functools import cache
from typing import Any, TypeVar

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
