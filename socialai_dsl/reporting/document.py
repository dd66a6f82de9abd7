"""A report as blocks, before it is HTML or Markdown: headings, text, tables, figures, folded parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Union


@dataclass(frozen=True)
class Meter:
    """A bar from 0 to 1 beside a figure.

    Attributes:
        value: where the bar ends. spread: half the width of the line around it. reference: where a mark stands.
    """

    value: float
    spread: float | None = None
    reference: float | None = None


@dataclass(frozen=True)
class Cell:
    """A cell of a table.

    Attributes:
        text: what it says. lines: smaller lines below it.
        tone: how it is meant. code: whether it is written as code. meter: a picture of it.
        link: where the text leads, as seen from the page.
    """

    text: str
    lines: tuple[str, ...] = ()
    tone: Literal["", "warning", "muted", "strong"] = ""
    code: bool = False
    meter: Meter | None = None
    link: str | None = None


@dataclass(frozen=True)
class Heading:
    """A heading, 2 or 3, with the name that links lead to."""

    level: int
    text: str
    anchor: str


@dataclass(frozen=True)
class Text:
    """A paragraph; a `note` explains what the figures beside it are."""

    text: str
    kind: Literal["plain", "lead", "note", "warning"] = "plain"


@dataclass(frozen=True)
class Items:
    """A list."""

    items: Sequence[str]


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        columns: their heads; one beginning with `>` holds numbers, aligned at the right.
        rows: as many cells each.
        caption: what its figures are, in short sentences.
        grid: whether its cells are results, which narrow screens show below one another.
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    grid: bool = False


@dataclass(frozen=True)
class Figure:
    """A drawing.

    Attributes:
        name: of its files, without ending. alt: what it shows, for who does not see it. caption: how to read it.
    """

    name: str
    alt: str
    caption: str


@dataclass(frozen=True)
class Image:
    """A drawing's files: as SVG and PNG, and as SVG for screens as narrow as a telephone's."""

    svg: bytes
    png: bytes
    narrow: bytes


@dataclass(frozen=True)
class Folded:
    """Blocks that open at a click."""

    title: str
    blocks: Sequence[Block]


Block = Union[Heading, Text, Items, Table, Figure, Folded]  # noqa: UP007 - names itself


@dataclass(frozen=True)
class Document:
    """A report.

    Attributes:
        title, subtitle: at its head. blocks: the rest. images: of its figures, by name.
    """

    title: str
    subtitle: str
    blocks: Sequence[Block]
    images: Mapping[str, Image]
