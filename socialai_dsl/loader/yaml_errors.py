"""The YAML parser's errors in words for authors."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final

from socialai_dsl import cures
from socialai_dsl.diagnostics import Diagnostic
from socialai_dsl.source import Source, TextEdit

_TEXT_QUOTES: Final = {"'": "'", '"': '"'}
_GROUP_BEFORE: Final = re.compile(r"\(\s*\w+ in [\w.]+$")
"""What stands before the colon of `any(d in doors: ...)`."""

_COLON_IN_TEXT: Final = "not YAML: a colon followed by a space starts a new key; quote the text"


def explain(error: Exception, source: Source) -> Diagnostic:
    """The finding for whatever libyaml or PyYAML raised over this source."""
    problem = str(getattr(error, "problem", None) or "the text cannot be read")
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    place = _Place.of(source, mark)
    context = _Place.of(source, getattr(error, "context_mark", None) or mark)
    for explanation in (_ternary, _swallowed, _unclosed, _colon, _first_character, _after_quote, _layout):
        found = explanation(problem, place, context)
        if found:
            return found
    return place.finding(f"not YAML: {problem}")


@dataclass(frozen=True)
class _Place:
    """A mark of the parser, looked at in the text."""

    source: Source
    line_number: int = 1
    column: int = 1

    @classmethod
    def of(cls, source: Source, mark: Any) -> _Place:
        """Where a mark is; the beginning if there is none."""
        return cls(source, int(mark.line) + 1, int(mark.column) + 1) if mark else cls(source)

    @property
    def line(self) -> str:
        return self.source.line(self.line_number)

    @property
    def before(self) -> str:
        return self.line[: self.column - 1]

    @property
    def character(self) -> str:
        return self.line[self.column - 1 : self.column]

    @property
    def at_end(self) -> bool:
        return not self.character and not self.source.line(self.line_number + 1)

    def line_above(self) -> _Place:
        """The first character of the line above."""
        number = max(1, self.line_number - 1)
        above = self.source.line(number)
        return _Place(self.source, number, len(above) - len(above.lstrip()) + 1)

    def run_together(self) -> Diagnostic | None:
        """The finding for a `key:value` that starts here, without a space."""
        match = re.match(r"(?:- )?([\w.]+):([^\s:].*)", self.line[self.column - 1 :])
        if not match:
            return None
        text = f"{match[1]}: {match[2]}"
        place = self.source.span(
            self.line_number, self.column + match.start(1), len(match[0]) - match.start(1)
        )
        return self.finding(
            "not YAML: a space is missing after the colon", cures.write(text, TextEdit(place, text))
        )

    def finding(self, message: str, hint: cures.Hint = None) -> Diagnostic:
        return Diagnostic("S001", message, self.source.span(self.line_number, self.column), hint=hint)


def _ternary(problem: str, place: _Place, context: _Place) -> Diagnostic | None:
    """A choice as other languages write it, whose colon YAML takes for that of a key."""
    found = re.search(r"\S \? [^?:]* : ", place.line)
    if found is None or not found.start() < place.column:
        return None
    mark = _Place(place.source, place.line_number, place.line.index("?", found.start()) + 1)
    return mark.finding(
        "not YAML: `? :` is not used here", "a value that depends is written `a if condition else b`"
    )


def _swallowed(problem: str, place: _Place, context: _Place) -> Diagnostic | None:
    """A bracket that stands behind a `#`, where it is part of a comment."""
    closing = {"{": "}", "[": "]"}.get(context.character)
    if closing is None:
        return None
    for number in range(context.line_number, place.line_number + 1):
        line = context.source.line(number)
        start = comment_in(line)
        if start is not None and closing in line[start:]:
            comment = _Place(context.source, number, start + 1)
            message = f"not YAML: a `#` behind a blank begins a comment, which takes the `{closing}` along"
            return comment.finding(message, "quote the text that the `#` belongs to")
    return None


def comment_in(line: str) -> int | None:
    """Where the comment of a line begins."""
    quote, before = "", ":"
    for i, character in enumerate(line):
        if quote:
            quote = "" if character == quote else quote
        elif character in _TEXT_QUOTES and before in "[{,:-":
            quote = character
        elif character == "#" and line[i - 1 : i] in ("", " ", "\t"):
            return i
        before = before if character.isspace() else character
    return None


def _unclosed(problem: str, place: _Place, context: _Place) -> Diagnostic | None:
    if "end of stream" in problem and context.character in _TEXT_QUOTES:
        return context.finding(f"not YAML: the quote {context.character} is not closed")
    if not re.search(r"',' or '[}\]]'", problem):
        return None
    closing = {"{": "}", "[": "]"}.get(context.character)
    if closing and (place.at_end or (place.character == ":" and not _has_key(place.before))):
        return context.finding(f"not YAML: the `{context.character}` is not closed with `{closing}`")
    if place.character and place.character in "[]{}":
        message = f"not YAML: `{place.character}` in a text inside {{ }} or [ ]; quote the text"
        indexed = re.search(r"(\w+)$", place.before) if place.character == "[" else None
        hint = f"one of a group is `first(d in {indexed[1]} where d.index == 0)`" if indexed else None
        return place.finding(message, hint)
    return None


def _has_key(text: str) -> bool:
    return re.search(r":(\s|$)", text) is not None


def _colon(problem: str, place: _Place, context: _Place) -> Diagnostic | None:
    if "could not find expected ':'" in problem:
        return context.run_together() or context.finding(
            "not YAML: a key without its colon", "write `key: value`"
        )
    if place.character != ":":
        return None
    if "not allowed" in problem and not _has_key(place.before):
        missing_space = place.line_above().run_together()
        if missing_space:
            return missing_space
        return place.finding(
            "not YAML: this line is indented further than the key above, which has its value already",
            "give keys of one mapping the same indentation",
        )
    if not place.before.strip(" -{,"):
        return place.finding("not YAML: there is no key before this colon")
    if _GROUP_BEFORE.search(place.before) is not None:
        where = place.source.span(place.line_number, place.column)
        message = "not YAML: a colon followed by a space starts a new key"
        return place.finding(message, cures.write("where", TextEdit(where, " where")))
    return place.finding(_COLON_IN_TEXT, _in_quotes(place))


def _in_quotes(place: _Place) -> cures.Hint:
    """The proposal to quote the text that a colon stands in, as far as one line shows where it begins and ends."""
    keys = list(re.finditer(r"(?:^\s*|- |[{,]\s*)([\w.]+): +(?=\S)", place.before))
    if not keys:
        return None
    begin = keys[-1]
    rest = place.line[begin.end() :]
    is_flow = place.before.count("{") > place.before.count("}")
    end = re.search(r",\s*[\w.]+:(?:\s|$)|\s*[}\]]*\s*$" if is_flow else r"\s+#|\s*$", rest)
    assert end is not None, "internal: a line has an end"
    text = cures.in_quotes(rest[: end.start()])
    start = place.source.index(place.source.span(place.line_number, begin.end() + 1))
    return cures.write(f"{begin[1]}: {text}", place.source.edit(start, start + end.start(), text))


def _first_character(problem: str, place: _Place, context: _Place) -> Diagnostic | None:
    if place.character == "\t":
        return place.finding("not YAML: a tab cannot indent; use spaces")
    if "start any token" in problem:
        character = "a backquote" if place.character == "`" else f"`{place.character}`"
        return place.finding(f"not YAML: a text cannot begin with {character}; quote the text")
    if context.character and context.character in "&*" and "alphabetic" in problem:
        doubled = context.line[context.column - 1 :].startswith("&&")
        hint = "write `and` for `&&`" if doubled else None
        message = f"not YAML: a text cannot begin with `{context.character}`; quote the text"
        return context.finding(message, hint)
    if context.character and context.character in "|>" and "comment" in problem:
        return context.finding(
            f"not YAML: a leading `{context.character}` starts a text on the lines below; quote the text"
        )
    if "escape" in problem:
        hint = "in double quotes a backslash starts an escape; use single quotes"
        return place.finding("not YAML: an unknown escape sequence", hint)
    return None


def _after_quote(problem: str, place: _Place, context: _Place) -> Diagnostic | None:
    if not place.character:
        return None
    if place.before.rstrip()[-1:] in _TEXT_QUOTES:
        message = "not YAML: there is something behind the closing quote"
        return place.finding(message, "quote the whole value, or nothing of it")
    if place.character in "}]":
        return place.finding(f"not YAML: there is nothing for this `{place.character}` to close")
    if place.character == "," and place.before.rstrip()[-1:] in (",", "[", "{"):
        return place.finding("not YAML: a value is missing here")
    if place.character == ",":
        return place.finding("not YAML: a text cannot begin with `,`; quote the text")
    return None


def _layout(problem: str, place: _Place, context: _Place) -> Diagnostic | None:
    if place.character == "-" and "not allowed" in problem:
        return place.finding("not YAML: a list starts on a line of its own", "or write it as [a, b]")
    if place.character == "?" and "not allowed" in problem:
        return place.finding("not YAML: a text cannot begin with `? `; quote the text")
    if context.line.startswith("%"):
        return context.finding("not YAML: a text cannot begin with `%`; quote the text")
    if re.search(r"',' or '[}\]]'", problem):
        message = f"not YAML: a comma is missing before this, or the `{context.character}` is not closed"
        return place.finding(message, f"it was opened at line {context.line_number}")
    if "node content" in problem:
        return place.finding("not YAML: a value is missing here")
    if "document start" in problem:
        return place.finding("not YAML: the document has ended before this", "a file is one mapping of keys")
    if re.search(r"expected key|block end|'-' indicator", problem):
        return place.finding(
            "not YAML: this line fits neither the list or mapping above nor one around it",
            "give keys of one mapping, and the dashes of one list, the same indentation",
        )
    return None
