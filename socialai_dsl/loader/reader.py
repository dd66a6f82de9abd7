"""YAML text to plain data with positions, from the parser's events and within fixed limits."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import yaml

from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag
from socialai_dsl.loader.document import Data, Document, NodeSpan
from socialai_dsl.loader.files import FORBIDDEN, checked, display_name, forbidden_character, read_source
from socialai_dsl.loader.limits import MAX_DEPTH, MAX_EVENTS, MAX_SCALAR
from socialai_dsl.loader.offsets import Style
from socialai_dsl.loader.scalars import read_plain
from socialai_dsl.loader.texts import value_at
from socialai_dsl.loader.yaml_errors import explain
from socialai_dsl.source import DataPath, Source, Span

# Only the event stream of libyaml is used: its composer and PyYAML's are recursive and can be made to crash.
_EventParser: Any = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader

_TAG_DIRECTIVE = re.compile(r"^%TAG\b", re.MULTILINE)

_STYLES = {None: Style.PLAIN, "": Style.PLAIN} | {s.value: s for s in Style if len(s.value) == 1}


def read_document(file: Path | str | Source, name: str | None = None, path: Path | None = None) -> Document:
    """One YAML document as plain data with positions.

    Args:
        file: a path, or text that is there already.
        name: how messages call the file; by default its path relative to the working directory.
        path: the file that text came from, if `file` is a source.

    Raises:
        ScenarioError: everything that is wrong with the file as YAML (S001 to S007), in one go as far as
            the text can be followed.
    """
    if isinstance(file, Source):
        return _parse(checked(file), path)
    path = Path(file)
    return _parse(read_source(path, name or display_name(path)), path.resolve())


def _parse(source: Source, path: Path | None) -> Document:
    builder = _Builder(source)
    try:
        builder.refuse_many_directives()
        for event in _events(source.text):
            builder.take(event)
    except _LimitError:
        pass
    # PyYAML's own parser leaks ValueError and OverflowError for some escapes.
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        builder.found.add(explain(error, source))
    builder.found.raise_errors({source.name: source})
    return builder.document(path)


def _events(text: str) -> Iterator[Any]:
    parser = _EventParser(text)
    try:
        while parser.check_event():
            yield parser.get_event()
    finally:
        parser.dispose()


class _LimitError(Exception):
    """Reading stops here; the reason is among the findings."""


class _Frame:
    """A mapping or list that is being filled."""

    __slots__ = ("container", "first_lines", "flow", "is_key", "key", "key_span", "path")

    def __init__(self, container: dict[str, Data] | list[Data], path: DataPath, flow: bool) -> None:
        self.container = container
        self.path = path
        self.flow = flow
        self.is_key = False
        self.key: str | None = None
        self.key_span: Span | None = None
        self.first_lines: dict[str, int] = {}

    @property
    def expects_key(self) -> bool:
        return self.key is None and isinstance(self.container, dict)


class _Builder:
    """Takes events one by one; nothing in here is recursive."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.found = DiagnosticBag()
        self._spans: dict[DataPath, NodeSpan] = {}
        self._data: Data = None
        self._stack: list[_Frame] = []
        self._events = 0
        self._documents = 0
        self._take = {
            yaml.ScalarEvent: self._scalar,
            yaml.MappingStartEvent: self._mapping,
            yaml.SequenceStartEvent: self._sequence,
            yaml.MappingEndEvent: self._end,
            yaml.SequenceEndEvent: self._end,
            yaml.AliasEvent: self._alias,
            yaml.DocumentStartEvent: self._document_start,
        }

    def take(self, event: Any) -> None:
        self._events += 1
        if self._events > MAX_EVENTS:
            self._stop(f"the file has more than {MAX_EVENTS} parts", self._span(event))
        handler = self._take.get(type(event))
        if handler:
            handler(event)

    def refuse_many_directives(self) -> None:
        """Several `%TAG` lines, of which libyaml compares each with all before it: none may be used anyway."""
        found = list(islice(_TAG_DIRECTIVE.finditer(self.source.text), 2))
        if len(found) == 2:
            line = self.source.text.count("\n", 0, found[0].start()) + 1
            self._refuse_directives(self.source.span(line, 1))
            raise _LimitError

    def document(self, path: Path | None) -> Document:
        if not self._spans:
            start = self.source.span(1, 1)
            self._spans[()] = NodeSpan(None, start, Style.PLAIN, False, 0, 0)
        return Document(self.source, self._data, self._spans, path)

    def _span(self, event: Any) -> Span:
        start, end = event.start_mark, event.end_mark
        width = end.column - start.column if end.line == start.line else 1
        return Span(self.source.name, start.line + 1, start.column + 1, max(1, width))

    def _error(self, code: str, message: str, span: Span, hint: str | None = None) -> None:
        self.found.add(Diagnostic(code, message, span, hint=hint))

    def _stop(self, message: str, span: Span) -> None:
        self._error("S004", message, span)
        raise _LimitError

    def _document_start(self, event: Any) -> None:
        self._documents += 1
        if event.version or event.tags:
            self._refuse_directives(self._span(event))
        if self._documents > 1:
            self._error("S001", "a file holds one document; here a second one begins", self._span(event))
            raise _LimitError

    def _refuse_directives(self, span: Span) -> None:
        self._error("S005", "directives (lines that begin with %) may not be used", span)

    def _alias(self, event: Any) -> None:
        span = self._span(event)
        hint = "quote a text that begins with `*`; to share parts between scenarios use `extends`"
        self._error("S005", "aliases (`*name`) may not be used", span, hint)
        if self._stack and self._stack[-1].expects_key:
            self._stack[-1].key = ""
        else:
            self._value(None, event, Style.PLAIN)

    def _refuse_properties(self, event: Any) -> None:
        if event.anchor is not None:
            hint = "quote a text that begins with `&`"
            self._error("S005", "anchors (`&name`) may not be used", self._span(event), hint)
        if event.tag is not None:
            hint = "for negation write `not`; quote a text that begins with `!`"
            self._error("S005", "tags (`!name`) may not be used", self._span(event), hint)

    def _scalar(self, event: Any) -> None:
        if event.anchor is not None or event.tag is not None:
            self._refuse_properties(event)
        text: str = event.value
        if len(text) > MAX_SCALAR:
            self._stop(f"a text has more than {MAX_SCALAR} characters", self._span(event))
        style = _STYLES[event.style]
        if style is Style.DOUBLE:
            match = FORBIDDEN.search(text)
            if match:
                self.found.add(forbidden_character(match.group(), self._span(event)))
        if self._stack and self._stack[-1].expects_key:
            self._key(text, style, self._span(event))
            self._refuse_glued_question_mark(event.start_mark.index, self._span(event))
            return
        if style is not Style.PLAIN:
            self._value(text, event, style)
            return
        meant = value_at(self._path(), text)
        if meant is not None:
            self._value(meant, event, style)
            return
        plain = read_plain(text)
        if plain.code:
            self._error(plain.code, plain.message, self._span(event), plain.hint)
        self._value(plain.value, event, style)

    def _key(self, text: str, style: Style, span: Span) -> None:
        frame = self._stack[-1]
        if text == "<<" and style is Style.PLAIN:
            hint = "to build on another file use `extends`"
            self._error("S005", "merge keys (`<<`) may not be used", span, hint)
        if not text:
            self._error("S001", "not YAML: there is no key before this colon", span)
        first = frame.first_lines.setdefault(text, span.line)
        if text in frame.container:
            self._error("S002", f"`{text}` is given twice; the first is at line {first}", span)
        frame.key, frame.key_span = text, span

    def _refuse_glued_question_mark(self, start: int, span: Span) -> None:
        """In braces libyaml takes the `?` of `{?a: 1}` for a mark of its own, other readers for a letter."""
        if self._stack[-1].flow and start and self.source.text[start - 1] == "?":
            hint = "quote a key that begins with `?`"
            self._error("S001", "not YAML: a key in braces or brackets cannot begin with `?`", span, hint)

    def _path(self) -> DataPath:
        """The path of the value that comes next."""
        if not self._stack:
            return ()
        frame = self._stack[-1]
        if isinstance(frame.container, list):
            return (*frame.path, len(frame.container))
        assert frame.key is not None, "internal: a value without a key"
        return (*frame.path, frame.key)

    def _value(self, value: Data, event: Any, style: Style) -> DataPath:
        """Put a value where the next one belongs and return its path."""
        start, end = event.start_mark, event.end_mark
        span = self._span(event) if style not in (Style.MAPPING, Style.SEQUENCE) else self._start(event)
        if not self._stack:
            self._data = value
            self._spans[()] = NodeSpan(None, span, style, False, start.index, end.index)
            return ()
        path, frame = self._path(), self._stack[-1]
        if isinstance(frame.container, list):
            frame.container.append(value)
        else:
            frame.container[str(path[-1])] = value
        self._spans[path] = NodeSpan(frame.key_span, span, style, frame.flow, start.index, end.index)
        frame.key = frame.key_span = None
        return path

    def _start(self, event: Any) -> Span:
        mark = event.start_mark
        return Span(self.source.name, mark.line + 1, mark.column + 1)

    def _mapping(self, event: Any) -> None:
        self._open({}, event, Style.MAPPING)

    def _sequence(self, event: Any) -> None:
        self._open([], event, Style.SEQUENCE)

    def _open(self, container: dict[str, Data] | list[Data], event: Any, style: Style) -> None:
        self._refuse_properties(event)
        if len(self._stack) == MAX_DEPTH:
            self._stop(f"the file is nested more than {MAX_DEPTH} levels deep", self._start(event))
        frame = self._stack[-1] if self._stack else None
        is_key = frame is not None and frame.expects_key
        if frame is not None and is_key:
            self._error("S001", "not YAML: a key is a word, not a list or a mapping", self._start(event))
            frame.key, frame.key_span = "", None
        opened = _Frame(container, self._value(container, event, style), bool(event.flow_style))
        opened.is_key = is_key
        self._stack.append(opened)

    def _end(self, event: Any) -> None:
        closed = self._stack.pop()
        if closed.is_key:
            self._stack[-1].key = ""
