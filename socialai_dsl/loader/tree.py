"""Documents as trees whose parts can move between files and still know where they were written."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

from socialai_dsl.loader.document import Data, Document
from socialai_dsl.source import DataPath, Span

Children: TypeAlias = "dict[str, Node] | list[Node] | None"


class Node:
    """A part of a document.

    Attributes:
        document: the file it was written in.
        path: where in that file.
        children: the entries of a mapping or list; None for a scalar.
        value: the scalar's value; None for a mapping or list.
    """

    __slots__ = ("children", "document", "path", "value")

    def __init__(self, document: Document, path: DataPath, data: Data) -> None:
        self.document = document
        self.path = path
        self.value: str | int | float | bool | None = None
        self.children: Children = None
        if isinstance(data, dict):
            self.children = {key: Node(document, (*path, key), part) for key, part in data.items()}
        elif isinstance(data, list):
            self.children = [Node(document, (*path, i), part) for i, part in enumerate(data)]
        else:
            self.value = data

    @property
    def file(self) -> str:
        """How messages call the file this part was written in."""
        return self.document.source.name

    @property
    def kind(self) -> str:
        """What this part is, for messages."""
        if isinstance(self.children, dict):
            return "a mapping"
        if isinstance(self.children, list):
            return "a list"
        if self.value is None:
            return "empty"
        if isinstance(self.value, bool):
            return "`true` or `false`"
        return "a text" if isinstance(self.value, str) else "a number"

    def value_span(self) -> Span:
        """Where the part stands."""
        return self.document.value_span(self.path)

    def key_span(self) -> Span:
        """Where its key stands."""
        return self.document.key_span(self.path)

    def items(self) -> Iterator[tuple[str | int, Node]]:
        """Key or index and part, for each child."""
        if isinstance(self.children, dict):
            yield from self.children.items()
        elif self.children is not None:
            yield from enumerate(self.children)

    def entry(self, key: str) -> Node | None:
        """The entry of a mapping; None if there is none or this is no mapping."""
        return self.children.get(key) if isinstance(self.children, dict) else None

    def at(self, path: DataPath) -> Node:
        """The part at a path below this one, which must exist."""
        part = self
        for step in path:
            assert part.children is not None, "internal: the path leads into a scalar"
            part = part.children[step]  # type: ignore[index]
        return part

    def text(self, key: str) -> str | None:
        """The text at a key of a mapping; None for anything else."""
        entry = self.entry(key)
        return entry.value if entry is not None and isinstance(entry.value, str) else None

    def data(self) -> Data:
        """The part as plain data."""
        if isinstance(self.children, dict):
            return {key: part.data() for key, part in self.children.items()}
        if isinstance(self.children, list):
            return [part.data() for part in self.children]
        return self.value

    def copy(self) -> Node:
        """This part with all below it, free to be changed."""
        copied = Node(self.document, self.path, self.value)
        if isinstance(self.children, dict):
            copied.children = {key: part.copy() for key, part in self.children.items()}
        elif isinstance(self.children, list):
            copied.children = [part.copy() for part in self.children]
        return copied

    def walk(self, path: DataPath = ()) -> Iterator[tuple[DataPath, Node]]:
        """This part and all below it with their paths, parents first."""
        yield path, self
        for key, part in self.items():
            yield from part.walk((*path, key))


def tree_of(document: Document) -> Node:
    """A document as a tree of its own, free to be changed."""
    return Node(document, (), document.data)


def merge(base: Node, over: Node) -> Node:
    """`base` overlaid with `over`: mappings are merged key by key, all else is replaced.

    Keys of the base keep their place, those that only `over` has follow in its order. Both trees are used up.
    """
    if not isinstance(base.children, dict) or not isinstance(over.children, dict):
        return over
    for key, part in over.children.items():
        below = base.children.get(key)
        base.children[key] = part if below is None else merge(below, part)
    over.children = base.children
    return over
