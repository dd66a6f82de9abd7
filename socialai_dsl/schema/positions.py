"""Where the parts of a document stand: what the layers below the loader know of it."""

from __future__ import annotations

from typing import Protocol, TypeAlias

from socialai_dsl.source import Span

DataPath: TypeAlias = tuple[str | int, ...]
"""Keys and list indices from the root of a document to one of its parts."""


class Positions(Protocol):
    """Path -> place; what does not exist is where its nearest ancestor is."""

    def locate(self, path: DataPath, offset: int = 0, width: int = 1) -> Span:
        """The place of the character `offset` (from 0) of the text at `path`."""

    def value_span(self, path: DataPath) -> Span:
        """The place of the value at `path`."""

    def key_span(self, path: DataPath) -> Span:
        """The place of the key at `path`; of the value, for an item of a list."""

    def in_flow(self, path: DataPath) -> bool:
        """Whether the part at `path` stands inside { } or [ ]."""
