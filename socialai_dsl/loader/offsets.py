"""The place in the file of each character of a scalar's value, for every style of scalar."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum

_WHITE = " \t\n\r"
_ESCAPE_DIGITS = {"x": 2, "u": 4, "U": 8}
_ESCAPED = {
    "0": "\0", "a": "\a", "b": "\b", "t": "\t", "\t": "\t", "n": "\n", "v": "\v", "f": "\f", "r": "\r",
    "e": "\x1b", "N": "\x85", "_": "\xa0", "L": "\u2028", "P": "\u2029",
}  # fmt: skip


class Style(Enum):
    """How a part is written."""

    PLAIN = "plain"
    SINGLE = "'"
    DOUBLE = '"'
    LITERAL = "|"
    FOLDED = ">"
    MAPPING = "mapping"
    SEQUENCE = "sequence"


def source_indices(text: str, start: int, end: int, style: Style, value: str) -> list[int]:
    """For each character of `value`, and for the place behind it, its index in `text`.

    `text[start:end]` is the scalar as written, quotes and block header included. Characters that are not
    blank are found exactly; blanks where lines were folded are placed between their neighbours.
    """
    anchors = list(_anchors(text, start, end, style))
    indices: list[int] = []
    gap_start = anchors[0][0] if anchors else start
    pending = next_anchor = 0
    for character in value:
        if next_anchor < len(anchors) and character == anchors[next_anchor][2]:
            index, length, _ = anchors[next_anchor]
            indices += _blanks(text, gap_start, index, pending)
            indices.append(index)
            gap_start, pending, next_anchor = index + length, 0, next_anchor + 1
        else:
            pending += 1
    indices += _blanks(text, gap_start, end, pending)
    indices.append(gap_start + pending if gap_start + pending <= end else gap_start)
    return indices


def _blanks(text: str, start: int, end: int, count: int) -> list[int]:
    """Places for `count` blanks in the gap `text[start:end]`."""
    if count == end - start or "\n" not in text[start:end]:
        return [min(start + i, end) for i in range(count)]
    # A line break counts where the line ends; kept indentation stands before the next word.
    line_start = max(text.rfind("\n", start, end), text.rfind("\r", start, end)) + 1
    breaks = [start] * max(0, count - (end - line_start))
    return breaks + list(range(end - (count - len(breaks)), end))


def _anchors(text: str, start: int, end: int, style: Style) -> Iterator[tuple[int, int, str]]:
    """(index, length, character) of each character that is not blank, or is written as an escape."""
    if style is Style.DOUBLE:
        yield from _double_quoted(text, start + 1, end - 1)
    elif style is Style.SINGLE:
        yield from _single_quoted(text, start + 1, end - 1)
    else:
        if style in (Style.LITERAL, Style.FOLDED):
            start = _after_header(text, start, end)
        yield from ((i, 1, text[i]) for i in range(start, end) if text[i] not in _WHITE)


def _after_header(text: str, start: int, end: int) -> int:
    while start < end and text[start] not in "\n\r":
        start += 1
    return start


def _single_quoted(text: str, start: int, end: int) -> Iterator[tuple[int, int, str]]:
    i = start
    while i < end:
        length = 2 if text.startswith("''", i) else 1
        if text[i] not in _WHITE:
            yield i, length, text[i]
        i += length


def _double_quoted(text: str, start: int, end: int) -> Iterator[tuple[int, int, str]]:
    i = start
    while i < end:
        if text[i] != "\\":
            if text[i] not in _WHITE:
                yield i, 1, text[i]
            i += 1
            continue
        letter = text[i + 1]
        length = 2 + _ESCAPE_DIGITS.get(letter, 0)
        if letter in _ESCAPE_DIGITS:
            yield i, length, chr(int(text[i + 2 : i + length], 16))
        elif letter not in "\n\r":
            yield i, length, _ESCAPED.get(letter, letter)
        i += length
