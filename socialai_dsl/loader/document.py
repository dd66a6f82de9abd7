"""Plain data with, beside it, the place of every part in its file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from socialai_dsl.loader.offsets import Style, source_indices
from socialai_dsl.source import DataPath, Source, Span

Data: TypeAlias = "str | int | float | bool | list[Data] | dict[str, Data] | None"


@dataclass(frozen=True, slots=True)
class NodeSpan:
    """Where one part of a document stands.

    Attributes:
        key: place of the key, for an entry of a mapping.
        value: place of the value; as wide as a scalar on one line, else of width 1.
        style: how the value is written.
        flow: whether the value stands inside `{ }` or `[ ]`.
        start: index in the source's text of a scalar's first character, quotes and block header included.
        end: index behind its last character.
    """

    key: Span | None
    value: Span
    style: Style
    flow: bool
    start: int
    end: int


class PositionedData(ABC):
    """Data whose parts know where they come from; what does not exist is where its nearest ancestor is."""

    data: Data

    @abstractmethod
    def find(self, path: DataPath) -> tuple[Document, DataPath]:
        """The document in which the part at `path` was written, and its path there."""

    def part(self, path: DataPath) -> Data:
        """The part of the data at `path`, which exists."""
        part: Data = self.data
        for step in path:
            part = part[step]  # type: ignore[index]
        return part

    def locate(self, path: DataPath, offset: int = 0, width: int = 1) -> Span:
        """The place of the character `offset` (from 0) of the text at `path`."""
        document, there = self.find(path)
        return document.place_in_scalar(there, offset, width)

    def value_span(self, path: DataPath) -> Span:
        """The place of the value at `path`."""
        document, there = self.find(path)
        return document.node(there).value

    def key_span(self, path: DataPath) -> Span:
        """The place of the key at `path`; of the value, for an item of a list and for the root."""
        document, there = self.find(path)
        node = document.node(there)
        return node.key or node.value

    def in_flow(self, path: DataPath) -> bool:
        """Whether the part at `path` stands inside { } or [ ]."""
        return self.node_span(path).flow

    def node_span(self, path: DataPath) -> NodeSpan:
        """All that is known about the place of the part at `path`."""
        document, there = self.find(path)
        return document.node(there)


@dataclass(frozen=True, eq=False)
class Document(PositionedData):
    """One YAML file as plain data.

    Attributes:
        source: its text.
        data: dicts (keys are always text), lists, str, int, float, bool and None.
        spans: path -> place, for every part.
        path: the file itself, resolved; None if the text did not come from a file.
    """

    source: Source
    data: Data
    spans: dict[DataPath, NodeSpan] = field(repr=False)
    path: Path | None = None

    def find(self, path: DataPath) -> tuple[Document, DataPath]:
        """This document and `path`, shortened until it exists."""
        path = tuple(path)
        while path and path not in self.spans:
            path = path[:-1]
        return self, path

    def node(self, path: DataPath) -> NodeSpan:
        """The place of an existing part."""
        return self.spans[path]

    def place_in_scalar(self, path: DataPath, offset: int, width: int) -> Span:
        """The place of one character of an existing scalar; the start of anything else."""
        node = self.node(path)
        place = node.value
        if node.style in (Style.MAPPING, Style.SEQUENCE):
            return place.shifted(0, width)
        text = self.source.text
        raw = text[node.start : node.end]
        if node.style is Style.PLAIN and "\n" not in raw and "\r" not in raw:
            return place.shifted(min(max(offset, 0), len(raw)), width)
        value = self.part(path)
        assert isinstance(value, str), "internal: what is written as a text is read as one"
        indices = source_indices(text, node.start, node.end, node.style, value)
        index = indices[min(max(offset, 0), len(indices) - 1)]
        return self._span_of(node, index, width)

    def _span_of(self, node: NodeSpan, index: int, width: int) -> Span:
        before = Source("", self.source.text[node.start : index])
        *_, (breaks, last) = enumerate(before.lines())
        column = len(last) + (1 if breaks else node.value.column)
        return Span(node.value.file, node.value.line + breaks, column, width)
