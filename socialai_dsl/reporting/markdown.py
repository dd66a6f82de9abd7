"""A report as Markdown, its figures in files beside it; everything from files escaped."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator, Sequence
from typing import Final

from socialai_dsl.reporting.document import Block, Cell, Document, Figure, Folded, Heading, Items, Table, Text

_SPECIAL: Final = re.compile(r"([\\`*_\[\]|~$])")


def render_markdown(document: Document, figures: str) -> str:
    """The report.

    Args:
        document: what it says.
        figures: folder of its figures, as seen from the file.
    """
    lines = [f"# {_escaped(document.title)}", ""]
    if document.subtitle:
        lines += [_escaped(document.subtitle), ""]
    for block in document.blocks:
        lines += [*_block(block, figures), ""]
    return "\n".join(lines).rstrip() + "\n"


def _block(block: Block, figures: str) -> Iterator[str]:
    match block:
        case Heading(level=level, text=text):
            yield f"{'#' * level} {_escaped(text)}"
        case Text(text=text):
            yield _escaped(text)
        case Items(items=items):
            yield from (f"* {_escaped(item)}" for item in items)
        case Table():
            yield from _table(block)
        case Figure(name=name, alt=alt, caption=caption):
            yield f"![{_escaped(alt)}]({figures}/{name}.svg)"
            yield ""
            yield _escaped(caption)
        case Folded(title=title, blocks=blocks):
            yield f"<details><summary>{_in_html(title)}</summary>"
            for inner in blocks:
                yield ""
                yield from _block(inner, figures)
            yield ""
            yield "</details>"


def _table(table: Table) -> Iterator[str]:
    yield _row([_escaped(head.removeprefix(">")) for head in table.columns])
    yield _row(["--:" if head.startswith(">") else "---" for head in table.columns])
    yield from (_row([_cell(cell) for cell in row]) for row in table.rows)
    if table.caption:
        yield ""
        yield _escaped(table.caption)


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(cell: Cell) -> str:
    text = _escaped(cell.text)
    if cell.link:
        text = f"[{text}]({cell.link})"
    if cell.tone == "strong":
        text = f"**{text}**"
    return "<br>".join([text, *map(_escaped, cell.lines)])


def _escaped(text: str) -> str:
    """Text that Markdown shows as it is, on one line."""
    return _SPECIAL.sub(r"\\\1", html.escape(_line(text), quote=False))


def _in_html(text: str) -> str:
    """The same within a line of HTML, where readers of Markdown may look for Markdown or not."""
    return _SPECIAL.sub(lambda found: f"&#{ord(found.group(1))};", html.escape(_line(text), quote=False))


def _line(text: str) -> str:
    return " ".join(text.split())
