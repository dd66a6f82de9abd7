"""In which order entries of `steps` follow each other, where some are nested."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from socialai_dsl.semantics.plans import NestedSteps

Node = int | NestedSteps
"""The number of an entry, or nested entries."""


@dataclass(frozen=True, slots=True)
class Enter:
    """The first round of nested steps would begin."""

    nested: NestedSteps


@dataclass(frozen=True, slots=True)
class Again:
    """A round of nested steps is over."""

    nested: NestedSteps


@dataclass(frozen=True, slots=True)
class Leave:
    """Nested steps are over, or left out: where `Enter` and `Again` lead when no round begins."""

    nested: NestedSteps


Way = Enter | Again | Leave | int


@dataclass(frozen=True, slots=True)
class NestingLevel:
    """Where an entry stands among the steps that it is nested in.

    Attributes:
        nested: these steps; None: those of the frame. index: which of their body it is, or is in.
        body: of `nested`.
    """

    nested: NestedSteps | None
    body: tuple[Node, ...]
    index: int


def first_entry(node: Node) -> int:
    """The number of the entry that nested steps begin with."""
    return node if isinstance(node, int) else first_entry(node.body[0])


def entries_of(order: Sequence[Node]) -> Iterator[int]:
    """The numbers of entries, nested ones in their place."""
    for node in order:
        yield from (node,) if isinstance(node, int) else entries_of(node.body)


def levels(order: tuple[Node, ...], k: int, nested: NestedSteps | None = None) -> list[NestingLevel]:
    """Where entry k stands, from the outermost level inwards; empty if it is left out for good."""
    for index, node in enumerate(order):
        level = NestingLevel(nested, order, index)
        if node == k:
            return [level]
        if isinstance(node, NestedSteps) and (found := levels(node.body, k, node)):
            return [level, *found]
    return []


def begun_with(found: Sequence[NestingLevel]) -> list[NestedSteps]:
    """The nested steps that begin with an entry, from the outermost inwards."""
    begun: list[NestedSteps] = []
    for level in reversed(found):
        if level.index > 0 or level.nested is None:
            break
        begun.insert(0, level.nested)
    return begun


def way_after(found: Sequence[NestingLevel]) -> Iterator[Way]:
    """All that may be left out in one turn, after an entry, before another begins.

    A round of nested steps goes once round at most: where all of it is left out, so is all of the rounds to come.
    """
    for level in reversed(found):
        yield from _whole(level.body[level.index + 1 :])
        if level.nested is not None:
            if level.nested.rounds > 1:
                yield Again(level.nested)
                yield from _whole(level.body)
            yield Leave(level.nested)


def _whole(nodes: Sequence[Node]) -> Iterator[Way]:
    for node in nodes:
        if isinstance(node, int):
            yield node
        else:
            yield Enter(node)
            yield from _whole(node.body)
            yield Leave(node)
