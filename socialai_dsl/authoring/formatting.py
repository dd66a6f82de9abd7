"""Scenario files in one style: only white space changes, so that meaning and comments stay.

Blocks are indented by two, lists as well; one blank stands after `:`, `,` and `-`, none within brackets; comments stand
two blanks behind the text or where they stood, if that is further right, or with the lines they precede; no two empty
lines follow each other. Texts, quotes and line breaks stay as they are written.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import yaml

from socialai_dsl.loader.comments import comments_of
from socialai_dsl.loader.given import STDIN, standard_input
from socialai_dsl.loader.reader import YAML, decoded, display_name, read_document, read_source
from socialai_dsl.source import Node, Source

_INDENT: Final = 2
_BREAK: Final = re.compile(r"\r\n|\r")
_WHITE: Final = " \t"
"""What YAML takes for blanks; other white space is text."""
_SPACE: Final = _WHITE + "\n"


class Formatting(NamedTuple):
    """A file, and its text in the house style; whether that changes it on the disk."""

    source: Source
    text: str
    changes: bool

    def diff(self) -> Iterator[str]:
        """The changes of its lines."""
        old, new = (text.splitlines(keepends=True) for text in (self.source.text, self.text))
        return difflib.unified_diff(old, new, self.source.name, self.source.name)


def formatted_file(name: str) -> Formatting:
    """Format a file, or what is on standard input for the name `-`; nothing is written.

    Raises:
        ScenarioError: it cannot be read, or is not YAML as the language has it.
    """
    if name == STDIN:
        (source,) = standard_input("stdin.yaml").values()
        original = source.text.encode()
    else:
        read_source(Path(name))  # says what is wrong with what is no file, or too large to be one
        original = Path(name).read_bytes()
        source = decoded(original, display_name(Path(name)))
    text = formatted(source)
    return Formatting(source, text, text.encode() != original)


def formatted(source: Source) -> str:
    """The text of a file in the house style.

    Raises:
        ScenarioError: it is not YAML as the language has it.
    """
    before = read_document(source)
    text = _Layout(_BREAK.sub("\n", source.text)).text()
    after = read_document(replace(source, text=text))
    assert _meaning(after) == _meaning(before), f"internal: formatting {source.name} would change it"
    return text


def _meaning(document: Node) -> tuple[Any, ...]:
    """What formatting must keep: the data, how each part is written, the comments."""
    styles = {path: node.span.style for path, node in document.walk()}
    return repr(document.data), styles, [comment.text for comment in comments_of(document)]


@dataclass
class _Block:
    """A mapping or list in block style: the column where it stood and the one where it will stand."""

    old: int
    new: int
    is_list: bool
    indentless: bool = False


@dataclass
class _Flow:
    """A mapping or list in brackets.

    Attributes:
        column: where the bracket will stand.
        base: how far the line of the bracket will be indented.
        hanging: whether nothing follows the bracket on its line; None until that is known.
    """

    column: int
    base: int
    hanging: bool | None = None

    @property
    def inside(self) -> int:
        """How far lines in it are indented."""
        return self.base + _INDENT if self.hanging else self.column + 1


class _Layout:
    """Lays the tokens of a text out anew."""

    def __init__(self, text: str) -> None:
        self._source = text
        self._lines: list[str] = []
        self._line = ""
        self._blocks: list[_Block] = []
        self._flows: list[_Flow] = []
        self._opened_before: list[_Block] = []  # the blocks that were open at the token before
        self._before: Any = None
        self._end = 0
        self._after_break = True
        self._is_key = False

    def text(self) -> str:
        """The text laid out."""
        for token in yaml.scan(self._source, Loader=YAML):
            self._take(token)
        self._gap(len(self._source), None)
        if self._line:
            self._lines.append(self._line)
        while self._lines and not self._lines[-1]:
            self._lines.pop()
        ends_in_text = isinstance(self._before, yaml.ScalarToken) and self._before.style in ("|", ">")
        keeps_end = ends_in_text and not self._source.endswith("\n")
        return "\n".join(self._lines) + ("" if keeps_end or not self._lines else "\n") + self._kept_breaks()

    def _kept_breaks(self) -> str:
        """The empty lines that belong to a text at the end, if its header says so (`|+`)."""
        token = self._before
        if not isinstance(token, yaml.ScalarToken) or token.style not in ("|", ">"):
            return ""
        raw = self._source[token.start_mark.index : token.end_mark.index]
        header, _, content = raw.partition("\n")
        if "+" not in header.partition("#")[0]:
            return ""
        return "\n" * (len(content) - len(content.rstrip("\n")) - 1)

    # -- structure ---------------------------------------------------------------------------------------------

    def _take(self, token: Any) -> None:
        column = token.start_mark.column
        match token:
            case yaml.BlockMappingStartToken() | yaml.BlockSequenceStartToken():
                new = self._blocks[-1].new + _INDENT if self._blocks else 0
                self._blocks.append(_Block(column, new, isinstance(token, yaml.BlockSequenceStartToken)))
            case yaml.BlockEndToken():
                self._close_indentless()
                self._blocks.pop()
            case yaml.KeyToken():
                if not self._flows and self._blocks and column == self._blocks[-1].old:
                    self._close_indentless()
                if token.start_mark.index < token.end_mark.index:
                    self._emit(token)
                else:
                    self._is_key = True
            case yaml.BlockEntryToken():
                if not self._blocks[-1].is_list:
                    self._blocks.append(_Block(column, self._blocks[-1].new + _INDENT, True, True))
                self._emit(token)
            case _ if token.start_mark.index < token.end_mark.index:
                self._emit(token)

    def _close_indentless(self) -> None:
        if self._blocks and self._blocks[-1].indentless:
            self._blocks.pop()

    # -- tokens ------------------------------------------------------------------------------------------------

    def _emit(self, token: Any) -> None:
        start, end = token.start_mark.index, token.end_mark.index
        self._gap(start, token)
        raw = self._source[start:end]
        indent = len(self._line) - len(self._line.lstrip(_WHITE))
        if isinstance(token, yaml.FlowMappingStartToken | yaml.FlowSequenceStartToken):
            self._flows.append(_Flow(len(self._line), indent))
        if isinstance(token, yaml.ScalarToken) and token.style in ("|", ">"):
            self._block_text(raw)
        elif "\n" in raw:
            self._broken_text(raw)
        else:
            self._line += raw
        if isinstance(token, yaml.FlowMappingEndToken | yaml.FlowSequenceEndToken):
            self._flows.pop()
        self._before, self._end, self._is_key = token, end, False
        self._opened_before = [replace(block) for block in self._blocks]

    def _broken_text(self, raw: str) -> None:
        """A plain or quoted text on several lines, whose indentation means nothing."""
        first, *others = raw.split("\n")
        inside = self._flows[-1].inside if self._flows else self._nested()
        self._lines.append(self._line + first)
        self._lines += [
            " " * inside + line.lstrip(_WHITE) if line.strip(_WHITE) else "" for line in others[:-1]
        ]
        self._line = " " * inside + others[-1].lstrip(_WHITE)

    def _block_text(self, raw: str) -> None:
        """A text behind `|` or `>`, whose lines move together."""
        header, *lines = raw.split("\n")
        self._lines.append(self._line + header.rstrip(_WHITE))
        self._line = ""
        number = re.search(r"[1-9]", header.partition("#")[0])
        if number:
            old = (self._blocks[-1].old if self._blocks else 0) + int(number.group())
            new = (self._blocks[-1].new if self._blocks else 0) + int(number.group())
        else:
            blanks = (len(line) - len(line.lstrip(" ")) for line in lines if line.strip(" "))
            old = next(blanks, max(map(len, lines), default=0))
            new = self._nested()
        moved = [" " * new + line[old:] if line[old:] else "" for line in lines]
        while moved and not moved[-1]:
            moved.pop()
        self._lines += moved
        # The line break and the empty lines at its end are part of the token; the gap is to see them.
        self._after_break = True
        trailing = len(lines) - len(moved)
        if trailing > 1:
            keeps = "+" in header.partition("#")[0]
            self._lines += [""] * (trailing - 1 if keeps else 1)

    def _nested(self) -> int:
        return self._blocks[-1].new + _INDENT if self._blocks else _INDENT

    # -- what stands between tokens ----------------------------------------------------------------------------

    def _gap(self, start: int, token: Any) -> None:
        """Bring what is between the token before and `token`, which begins at `start` (None: the end)."""
        gap = self._source[self._end : start]
        flow = self._flows[-1] if self._flows else None
        if self._after_break:
            gap = "\n" + gap
        elif isinstance(self._before, yaml.BlockEntryToken) and token is not None and not gap.strip(_SPACE):
            gap = " "  # what an entry is stands beside its `-`
        if flow is not None and flow.hanging is None:
            flow.hanging = "\n" in gap
        if "\n" not in gap and token is not None:
            # The scanner takes the question mark in `{say: Who?}` for a sign of its own, which the language does not.
            is_mark = isinstance(token, yaml.KeyToken) and not gap
            self._line += "" if is_mark else self._blank(token)
            return
        behind, *lines = gap.split("\n")
        if token is not None:
            lines.pop()  # the blanks before the token
        self._comment_behind(
            behind.strip(_WHITE), start - len(gap) + len(behind) - len(behind.lstrip(_WHITE))
        )
        self._finish_line()
        indent = self._indent_of(token)
        for line in lines:
            stripped = line.strip(_WHITE)
            if stripped:
                self._lines.append(" " * self._comment_indent(line, token, indent) + stripped)
            elif self._lines and self._lines[-1]:
                self._lines.append("")
        self._line = " " * indent
        self._after_break = False

    def _finish_line(self) -> None:
        if not self._after_break:
            self._lines.append(self._line.rstrip(_WHITE))
        self._line = ""

    def _comment_behind(self, comment: str, index: int) -> None:
        if comment:
            column = index - (self._source.rfind("\n", 0, index) + 1)
            self._line = self._line.rstrip(_WHITE)
            self._line += " " * max(2, column - len(self._line)) + comment

    def _blank(self, token: Any) -> str:
        """What stands between two tokens on one line."""
        opens = (yaml.FlowMappingStartToken, yaml.FlowSequenceStartToken)
        closes = (yaml.FlowMappingEndToken, yaml.FlowSequenceEndToken, yaml.FlowEntryToken, yaml.ValueToken)
        if isinstance(self._before, opens) or isinstance(token, closes):
            return ""
        return " "

    def _indent_of(self, token: Any) -> int:
        """How far a line is indented that begins with a token."""
        if token is None:
            return 0
        if self._flows:
            flow = self._flows[-1]
            if isinstance(token, yaml.FlowMappingEndToken | yaml.FlowSequenceEndToken):
                return flow.base if flow.hanging else flow.column
            return flow.inside
        if not self._blocks or isinstance(token, yaml.DocumentStartToken | yaml.DocumentEndToken):
            return 0
        leads = isinstance(token, yaml.BlockEntryToken | yaml.KeyToken | yaml.ValueToken) or self._is_key
        return self._blocks[-1].new if leads else self._nested()

    def _comment_indent(self, line: str, token: Any, following: int) -> int:
        """How far a comment on a line of its own is indented: with what follows, or with the block before it."""
        if self._flows:
            return following
        column = len(line) - len(line.lstrip(_WHITE))
        next_column = token.start_mark.column if token is not None else 0
        candidates = [block for block in self._opened_before if next_column < block.old <= column]
        return candidates[-1].new if candidates else following
