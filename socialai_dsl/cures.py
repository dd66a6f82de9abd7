"""What is proposed against a finding: a change of the file, and the sentence that is made of it."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import TypeAlias

from socialai_dsl.source import DataPath, Node, Source, Style, TextEdit, source_indices


@dataclass(frozen=True)
class Cure:
    """A proposal that a machine can follow, and its sentence.

    Attributes:
        title: "write `true`".
        edits: the changes that do it.
        also: what else may have been meant, or why.
    """

    title: str
    edits: tuple[TextEdit, ...]
    also: str = ""

    def __str__(self) -> str:
        """The help line."""
        goes_on = self.title and self.also.startswith(("or ", "which ", "so ", "then "))
        return (", " if goes_on else "; ").join(filter(None, (self.title, self.also)))


Hint: TypeAlias = "Cure | str | None"
"""What a finding proposes: a cure, a sentence of advice, or nothing."""


def propose(title: str, *edits: TextEdit | None, also: str = "") -> Cure | str:
    """A cure; advice where the file has no place for its changes, such as a value that a parameter gives."""
    placed = tuple(edit for edit in edits if edit is not None)
    return Cure(title, placed, also) if len(placed) == len(edits) else str(Cure(title, (), also))


def write(text: str, edit: TextEdit | None, also: str = "") -> Cure | str:
    """The proposal to write something else."""
    return propose(f"write `{text}`", edit, also=also)


def add(text: str, edit: TextEdit | None, to: str = "", also: str = "") -> Cure | str:
    """The proposal to add something, perhaps to what it says."""
    return propose(f"add `{text}`{f' to {to}' if to else ''}", edit, also=also)


def noted(hint: Hint, note: str) -> Hint:
    """A proposal with a remark behind it."""
    if isinstance(hint, Cure):
        return Cure(hint.title, hint.edits, "; ".join(filter(None, (hint.also, note))))
    return f"{hint}; {note}" if hint else note


# -- edits ---------------------------------------------------------------------------------------------------


def over_value(tree: Node, path: DataPath, text: str) -> TextEdit | None:
    """The edit that writes YAML in the place of the value at a path."""
    part = tree.get(path)
    if part is None or part.substituted:
        return None
    return part.source.edit(part.span.start, part.end, text)


def over_part(tree: Node, path: DataPath, start: int, end: int | None, text: str) -> TextEdit | None:
    """The edit that writes a text in the place of the characters `start` to `end`, or the last, of that at a path.

    What is not quoted and could not go on without is quoted. None for a text of several lines.
    """
    part = tree.get(path)
    if part is None or part.substituted or part.children is not None:
        return None
    span, source = part.span, part.source
    raw = source.text[span.start : span.end]
    if "\n" in raw or "\r" in raw:
        return None
    if span.style is Style.PLAIN:
        end = len(raw) if end is None else end
        whole = raw[:start] + text + raw[end:]
        if needs_quotes(whole, span.flow):
            return source.edit(span.start, span.end, in_quotes(whole))
        return source.edit(span.start + start, span.start + end, text)
    assert isinstance(span.read, str), "internal: what is written as a text is read as one"
    indices = source_indices(source.text, span.start, span.end, span.style, span.read)
    escaped = text.replace("'", "''") if span.style is Style.SINGLE else _escaped(text)[1:-1]
    return source.edit(indices[start], indices[-1 if end is None else end], escaped)


def added(tree: Node, path: DataPath, text: str) -> TextEdit | None:
    """The edit that adds a last entry, `key: value`, to the mapping at a path, or an item to the list."""
    part = tree.get(path)
    if part is None or part.children is None or part.substituted:
        return None
    source, own = part.source, part.own
    if part.is_braced and not own:
        blank = not source.text[part.span.start + 1 : part.span.end - 1].strip()
        return source.edit(part.span.start + 1, part.span.start + 1, text) if blank else None
    if not own:
        return None
    last = own[-1]
    place = last.end
    if part.is_braced:
        return source.edit(place, place, f", {text}")
    if last.span.key is not None:
        return source.edit(place, place, f"\n{' ' * (last.span.key.column - 1)}{text}")
    dash = _before(source.text, last.span.start, "-")
    if dash is None:
        return None
    indent = dash - source.text.rfind("\n", 0, dash) - 1
    return source.edit(place, place, f"\n{' ' * indent}- {text}")


def deleted(tree: Node, path: DataPath) -> TextEdit | None:
    """The edit that takes the entry of a mapping away, and what would be empty without it; None for the whole tree."""
    if not path:
        return None
    part, around = tree.get(path), tree.get(path[:-1])
    if part is None or around is None or part.span.key is None or part not in around.own:
        return None
    if any(len(inner.own) != inner.size for _, inner in part.walk()):
        return None  # a patch is in it
    if around.size == 1:
        return deleted(tree, path[:-1])
    source, start, end = part.source, part.source.index(part.span.key), part.end
    if around.is_braced:
        behind = re.compile(r"\s*,\s*").match(source.text, end)
        if behind is not None:
            return source.edit(start, behind.end(), "")
        comma = _before(source.text, start, ",")
        return source.edit(_back_over_space(source.text, comma), end, "") if comma is not None else None
    return _lines_away(source, start, end)


def _before(text: str, index: int, mark: str) -> int | None:
    """Where the mark stands that nothing but white space separates from the character at an index."""
    place = _back_over_space(text, index) - 1
    return place if place >= 0 and text[place] == mark else None


def _back_over_space(text: str, index: int) -> int:
    while index > 0 and text[index - 1].isspace():
        index -= 1
    return index


def _lines_away(source: Source, start: int, end: int) -> TextEdit | None:
    """The edit that deletes lines, of which the first has nothing before `start`."""
    begin = source.text.rfind("\n", 0, start) + 1
    if source.text[begin:start].strip():
        return None
    behind = source.text.find("\n", end)
    return source.edit(begin, len(source.text) if behind < 0 else behind + 1, "")


_UNSAFE_START = re.compile(r"[-?:](?= |$)|[\[\]{}#&*!|>'\"%@`,]| |$")


def needs_quotes(text: str, flow: bool) -> bool:
    """Whether a text would not be read as itself without quotes; inside of brackets or braces if `flow`."""
    inside = r": |:$| #|[\n\r]| $" + (r"|[\[\]{},]" if flow else "")
    return _UNSAFE_START.match(text) is not None or re.search(inside, text) is not None


def in_quotes(text: str) -> str:
    """A text as YAML, in the quotes in which it stays readable."""
    return f"'{text}'" if '"' in text and "'" not in text else _escaped(text)


def _escaped(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
