"""Finds the files of a scenario and reads each once, as a positioned tree, within fixed limits."""

from __future__ import annotations

import math
import os
import re
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import IO, Any, Final, NamedTuple

import yaml
from pydantic import BaseModel

from socialai_dsl import cures
from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, ScenarioError, did_you_mean
from socialai_dsl.loader.yaml_errors import explain
from socialai_dsl.schema.annotations import has_unknown_key, held_at, texts_by_key
from socialai_dsl.schema.files import FILES, model_of_file
from socialai_dsl.schema.holds import TEXTS
from socialai_dsl.source import DataPath, Node, NodeSpan, Scalar, Source, Span, Style, TextEdit

MAX_FILE_BYTES: Final = 1 << 20
MAX_DEPTH: Final = 32
MAX_EVENTS: Final = 50_000
MAX_SCALAR: Final = 10_000
MAX_INT_DIGITS: Final = 10
MAX_FLOAT_LENGTH: Final = 30

MAX_FILES: Final = 512
MAX_MATCHES: Final = 64
MAX_TOTAL_BYTES: Final = 4 << 20
MAX_CHAIN: Final = 8
MAX_NAME: Final = 4_000
MAX_PATCH_PATH: Final = 500


FORBIDDEN: Final = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f"
    "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufeff\ufffe\uffff"
    "\u00ad\u034f\u115f\u1160\u17b4\u17b5\u180e\u200b\u2060-\u2065\u206a-\u206f"
    "\u3164\uffa0\ufff9-\ufffb\U000e0000-\U000e0fff]"
)
"""Characters no text may hold: control, line separators, bidirectional, surrogates, byte order marks, and others that
cannot be seen. Joiners, which some scripts and emoji need, are text.
"""

_MOST_REPORTED: Final = 20


def display_name(path: Path) -> str:
    """How messages call a file: relative to the working directory if it is in there, else absolute."""
    absolute = Path(os.path.abspath(path))
    try:
        return str(absolute.relative_to(Path.cwd()))
    except (ValueError, OSError):
        return str(absolute)


def is_file(path: Path) -> bool:
    """Whether there is a regular file that may be looked at; links are followed."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def followed(path: Path) -> Path:
    """The path without links; where they lead in a circle, a path at which there is nothing to read.

    `Path.resolve` raises there.
    """
    return Path(os.path.realpath(path))


def read_source(path: Path, name: str | None = None) -> Source:
    """The text of a file, called `name` (by default its path) in messages.

    Raises:
        ScenarioError: S007 if it cannot be read (missing, a folder, a device, binary), S004 if it is too
            large, S006 if it is not UTF-8 or holds control characters.
    """
    name = str(path) if name is None else name
    return decoded(_read_bytes(path, name), name)


def read_stream(stream: IO[bytes], name: str) -> Source:
    """The text of a stream, called `name` in messages.

    Raises:
        ScenarioError: S004 if it is too large, S006 and S007 if it is no text.
    """
    content = stream.read(MAX_FILE_BYTES + 1)
    if len(content) > MAX_FILE_BYTES:
        raise ScenarioError([_too_large(name)])
    return decoded(content, name)


def _read_bytes(path: Path, name: str) -> bytes:
    start = Span(name, 1, 1)
    try:
        # Opening a pipe would wait for a writer for ever, but for O_NONBLOCK.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0))
    except FileNotFoundError:
        raise ScenarioError([Diagnostic("S007", "there is no such file", start)]) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        message = f"the file cannot be opened: {reason[:1].lower()}{reason[1:]}"
        raise ScenarioError([Diagnostic("S007", message, start)]) from None
    try:
        mode = os.fstat(descriptor).st_mode
        if not stat.S_ISREG(mode):
            raise ScenarioError([Diagnostic("S007", f"this is {_kind(mode)}, not a file", start)])
        with os.fdopen(descriptor, "rb", closefd=False) as file:
            content = file.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        message = f"the file cannot be read: {error.strerror}"
        raise ScenarioError([Diagnostic("S007", message, start)]) from None
    finally:
        os.close(descriptor)
    if len(content) > MAX_FILE_BYTES:
        raise ScenarioError([_too_large(name)])
    return content


def _too_large(name: str) -> Diagnostic:
    return Diagnostic("S004", f"the file is larger than {MAX_FILE_BYTES // 1024} KiB", Span(name, 1, 1))


def _kind(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "a folder"
    if stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode):
        return "a pipe"
    return "a device"


def decoded(content: bytes, name: str) -> Source:
    """UTF-8 bytes as a source, without a leading byte order mark.

    Raises:
        ScenarioError: S006 or, for what is no text at all, S007.
    """
    start = Span(name, 1, 1)
    if content[:2] in (b"\xff\xfe", b"\xfe\xff") or content.count(0) * 3 > len(content) > 0:
        message = "the file is UTF-16 or UTF-32; save it as UTF-8"
        raise ScenarioError([Diagnostic("S006", message, start)])
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        if b"\0" in content:
            raise ScenarioError([Diagnostic("S007", "this is a binary file, not text", start)]) from None
        before = Source(name, content[: error.start].decode("utf-8"))
        *_, last = enumerate(before.lines(), 1)
        span = Span(name, last[0], len(last[1]) + 1)
        message = f"the byte 0x{content[error.start]:02x} is not UTF-8; save the file as UTF-8"
        raise ScenarioError([Diagnostic("S006", message, span)], {name: before}) from None
    return checked(Source(name, text.removeprefix("\ufeff")))


def checked(source: Source) -> Source:
    """The source itself, if it is small enough and holds no forbidden character.

    Raises:
        ScenarioError: S004 or S006.
    """
    if len(source.text) > MAX_FILE_BYTES:
        message = f"the text is longer than {MAX_FILE_BYTES} characters"
        raise ScenarioError([Diagnostic("S004", message, source.span(1, 1))])
    if not FORBIDDEN.search(source.text):
        return source
    found = DiagnosticBag()
    for number, line in enumerate(source.lines(), 1):
        for match in FORBIDDEN.finditer(line):
            if len(found) == _MOST_REPORTED:
                break
            found.add(forbidden_character(match.group(), source.span(number, match.start() + 1)))
    raise ScenarioError(found, {source.name: source})


def forbidden_character(character: str, span: Span) -> Diagnostic:
    """The finding for a character that no text may hold."""
    message = f"the invisible character U+{ord(character):04X} may not be used"
    return Diagnostic("S006", message, span, hint=cures.propose("delete it", TextEdit(span, "")))


class Plain(NamedTuple):
    """The value of a plain word and, if it is refused, the code, message and help line."""

    value: Scalar
    code: str | None = None
    message: str = ""
    instead: str | None = None
    also: str = ""


_INT: Final = re.compile(r"[-+]?(0|[1-9][0-9]*)")
_FLOAT: Final = re.compile(r"[-+]?((0|[1-9][0-9]*)\.[0-9]+([eE][-+][0-9]+)?|\.[0-9]+)")

_TRUE: Final = frozenset({"y", "yes", "true", "on"})
_FALSE: Final = frozenset({"n", "no", "false", "off"})
_NUMBER_LIKE: Final = re.compile(
    r"""[-+]?(?:
          0[0-9_]+                                          # octal for some
        | 0x[0-9a-fA-F_]+ | 0o[0-7_]+ | 0b[01_]+
        | [0-9][0-9_]*(?::[0-5]?[0-9])+(?:\.[0-9_]*)?       # base 60
        | (?:[0-9][0-9_]*(?:\.[0-9_]*)?|\.[0-9][0-9_]*)(?:[eE][-+]?[0-9]+)?
        | \.(?:inf|Inf|INF)
        ) | \.(?:nan|NaN|NAN)""",
    re.VERBOSE,
)
_DATE: Final = re.compile(r"[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}(?:[Tt \t].*)?", re.DOTALL)
_MAY_BE_SPECIAL: Final = frozenset("-+.0123456789~=<ynotfYNOTF")


def read_plain(text: str) -> Plain:
    """The value of a plain word.

    Only the readings on which YAML 1.1 and YAML 1.2 tools agree are accepted; words that some tools take
    for something else (`yes`, `010`, `1:30`, `~`, dates) are refused with S003, so that a file means the
    same everywhere.
    """
    if text in ("", "null"):
        return Plain(None)
    if text == "true":
        return Plain(True)
    if text == "false":
        return Plain(False)
    if text[0] not in _MAY_BE_SPECIAL:
        return Plain(text)
    if _INT.fullmatch(text):
        return _int(text)
    if _FLOAT.fullmatch(text):
        return _float(text)
    return _ambiguous(text) or Plain(text)


def _int(text: str) -> Plain:
    if len(text.lstrip("+-")) > MAX_INT_DIGITS:
        return Plain(text, "S004", f"a whole number has at most {MAX_INT_DIGITS} digits")
    return Plain(int(text))


def _float(text: str) -> Plain:
    value = float(text) if len(text) <= MAX_FLOAT_LENGTH else math.inf
    if not math.isfinite(value):
        return Plain(text, "S004", f"a number is finite and has at most {MAX_FLOAT_LENGTH} characters")
    return Plain(value)


def _ambiguous(text: str) -> Plain | None:
    folded = text.lower()
    if folded in _TRUE | _FALSE and text in (folded, folded.capitalize(), folded.upper()):
        truth = "true" if folded in _TRUE else "false"
        return _refused(text, f"`{truth}` for some YAML tools and text for others", truth)
    if text == "~" or folded == "null":
        return _refused(
            text, "nothing for some YAML tools and text for others", otherwise="leave the value out"
        )
    if text in ("=", "<<"):
        return _refused(text, "a special word for some YAML tools")
    if _NUMBER_LIKE.fullmatch(text):
        digits = re.fullmatch("([-+]?)0+([1-9][0-9]*)", text)
        plain = digits[1].strip("+") + digits[2] if digits is not None else None
        return _refused(
            text, "not the same number for all YAML tools", plain, otherwise="write a plain decimal number"
        )
    if _DATE.fullmatch(text):
        return _refused(text, "a date for some YAML tools and text for others")
    return None


def _refused(text: str, reading: str, instead: str | None = None, otherwise: str | None = None) -> Plain:
    also = f'if you mean the text, quote it: "{text}"'
    if instead is None and otherwise is not None:
        also = f"{otherwise}; {also}"
    return Plain(text, "S003", f"`{text}` is {reading}", instead, also)


_NOTHING: Final = ("", "~")


def models_of(root: Node) -> list[type[BaseModel]]:
    """The models that a document may be one of: one, where its first keys say what kind of file it is."""
    keys = root.children if isinstance(root.children, dict) else {}
    known = model_of_file({key: part.value for key, part in keys.items()})
    return [known] if known is not None else [model for models in FILES.values() for model in models]


def read_in_place(models: Sequence[type[BaseModel]], path: DataPath, plain: Plain, text: str) -> Plain:
    """The value of a plain word at its place in a document: where a text may stand, the text itself.

    Args:
        models: those that the document may be one of.
        path: where in it the word stands.
        plain: what YAML takes it for.
        text: the word as it is written.
    """
    if text in _NOTHING:
        return plain
    if plain.code == "S003" and len(models) == 1 and has_unknown_key(models[0], path):
        return Plain(text)  # the key is what is reported
    held = next(filter(None, (held_at(model, path) for model in models)), None)
    held = held or texts_by_key().get(next((s for s in reversed(path) if isinstance(s, str)), ""))
    if held is None or held.kind not in TEXTS or (held.kind in ("prose", "label") and text == "null"):
        return plain
    return Plain(plain.value if type(plain.value) in held.beside else text)


# Only the event stream of libyaml is used: its composer and PyYAML's are recursive and can be made to crash.
YAML: Final[Any] = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader
"""The parser of every file; where tokens and events come from different ones, they disagree about tabs."""

_TAG_DIRECTIVE = re.compile(r"^%TAG\b", re.MULTILINE)

_STYLES = {None: Style.PLAIN, "": Style.PLAIN} | {s.value: s for s in Style if len(s.value) == 1}


def read_document(file: Path | str | Source, name: str | None = None) -> Node:
    """One YAML document as plain data with positions.

    Args:
        file: a path, or text that is there already.
        name: how messages call the file; by default its path relative to the working directory.

    Raises:
        ScenarioError: everything that is wrong with the file as YAML (S001 to S007), in one go as far as
            the text can be followed.
    """
    if isinstance(file, Source):
        return _parse(checked(file))
    path = Path(file)
    return _parse(replace(read_source(path, name or display_name(path)), path=path.resolve()))


def _parse(source: Source) -> Node:
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
    builder.read_plain_words()
    builder.found.raise_errors({source.name: source})
    return builder.root


def _events(text: str) -> Iterator[Any]:
    parser = YAML(text)
    try:
        while parser.check_event():
            yield parser.get_event()
    finally:
        parser.dispose()


class _LimitError(Exception):
    """Reading stops here; the reason is among the findings."""


@dataclass(slots=True)
class _Frame:
    """A mapping or list that is being filled."""

    node: Node
    container: dict[str, Node] | list[Node]
    path: DataPath
    flow: bool
    is_key: bool
    key: str | None = None
    key_span: Span | None = None
    first_lines: dict[str, int] = field(default_factory=dict)

    @property
    def expects_key(self) -> bool:
        return self.key is None and isinstance(self.container, dict)


class _Builder:
    """Takes events one by one; nothing in here is recursive.

    Attributes:
        found: what is wrong with the document.
        root: its tree.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.found = DiagnosticBag()
        self.root = Node(NodeSpan(source, None, source.span(1, 1), Style.PLAIN, False, 0, 0))
        self._stack: list[_Frame] = []
        self._events = 0
        self._documents = 0
        self._unread: list[tuple[DataPath, Node, Plain]] = []
        self._take: dict[type, Callable[[Any], None]] = {
            yaml.ScalarEvent: self._scalar,
            yaml.MappingStartEvent: lambda event: self._open({}, event, Style.MAPPING),
            yaml.SequenceStartEvent: lambda event: self._open([], event, Style.SEQUENCE),
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

    def _span(self, event: Any) -> Span:
        start, end = event.start_mark, event.end_mark
        width = end.column - start.column if end.line == start.line else 1
        return Span(self.source.name, start.line + 1, start.column + 1, max(1, width))

    def _error(self, code: str, message: str, span: Span, hint: cures.Hint = None) -> None:
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
        plain, path = read_plain(text), self._path()
        node = self._value(text, event, style)
        if plain != Plain(text):
            self._unread.append((path, node, plain))

    def read_plain_words(self) -> None:
        """Give each plain word its value, now that it is known what kind of file it is."""
        models = models_of(self.root)
        for path, node, plain in self._unread:
            span = node.span
            read = read_in_place(models, path, plain, str(node.value))
            node.value, node.span = read.value, replace(span, read=read.value)
            if read.code:
                place = self.source.edit(span.start, span.end, read.instead or "")
                hint = (
                    cures.write(read.instead, place, read.also)
                    if read.instead is not None
                    else read.also or None
                )
                self._error(read.code, read.message, span.value, hint)

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

    def _value(self, value: Scalar, event: Any, style: Style) -> Node:
        """Put a scalar where the next value belongs."""
        node = self._node(self._span(event), event, style, value)
        self._put(node)
        return node

    def _node(self, place: Span, event: Any, style: Style, value: Scalar = None) -> Node:
        """What an event begins, for the place where the next value belongs."""
        key, flow = (self._stack[-1].key_span, self._stack[-1].flow) if self._stack else (None, False)
        start, end = event.start_mark.index, event.end_mark.index
        return Node(NodeSpan(self.source, key, place, style, flow, start, end, value), value)

    def _put(self, node: Node) -> None:
        """Put a part where the next value belongs."""
        if not self._stack:
            self.root = node
            return
        frame = self._stack[-1]
        if isinstance(frame.container, list):
            frame.container.append(node)
        else:
            frame.container[str(frame.key)] = node
        frame.key = frame.key_span = None

    def _start(self, event: Any) -> Span:
        mark = event.start_mark
        return Span(self.source.name, mark.line + 1, mark.column + 1)

    def _open(self, container: dict[str, Node] | list[Node], event: Any, style: Style) -> None:
        self._refuse_properties(event)
        if len(self._stack) == MAX_DEPTH:
            self._stop(f"the file is nested more than {MAX_DEPTH} levels deep", self._start(event))
        frame = self._stack[-1] if self._stack else None
        is_key = frame is not None and frame.expects_key
        if frame is not None and is_key:
            self._error("S001", "not YAML: a key is a word, not a list or a mapping", self._start(event))
            frame.key, frame.key_span = "", None
        path, node = self._path(), self._node(self._start(event), event, style)
        node.children = container
        self._put(node)
        self._stack.append(_Frame(node, container, path, bool(event.flow_style), is_key))

    def _end(self, event: Any) -> None:
        closed = self._stack.pop()
        if closed.flow:
            closed.node.span = replace(closed.node.span, end=event.end_mark.index)
        if closed.is_key:
            self._stack[-1].key = ""


# -- the files that one scenario may be made of ----------------------------------------------------------------


SUFFIXES: Final = (".yaml", ".yml")


def shipped_folder() -> Path:
    """The folder of the scenarios that come with the product, in a checkout as well as installed."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "scenarios"
    return installed if installed.is_dir() else package.parent / "scenarios"


def shipped_experiments() -> dict[str, Path]:
    """The files of the experiments that come with the product, by name."""
    return {path.stem: path for path in sorted(_experiments().glob("*.yaml"))}


def shipped_studies() -> dict[str, Path]:
    """The files of the studies that come with the product, by name."""
    return {path.stem: path for path in sorted((_experiments() / "studies").glob("*.yaml"))}


def _experiments() -> Path:
    package = Path(__file__).resolve().parent.parent
    installed = package / "experiments" / "shipped"
    return installed if installed.is_dir() else package.parent / "experiments"


class Library:
    """Reads the files of one scenario; none outside `roots` and the shipped folder is ever opened.

    `texts` (resolved path -> text) replace files, as an editor does whose text is not saved yet.

    Attributes:
        shipped: the folder of the shipped scenarios, resolved.
        sources: name -> source, of all files read and of names that findings may point into.
    """

    def __init__(self, roots: Iterable[Path], texts: Mapping[Path, Source] | None = None) -> None:
        self.shipped = shipped_folder().resolve()
        self._roots = [*(root.resolve() for root in roots), self.shipped]
        self.sources: dict[str, Source] = {}
        self._texts = texts or {}
        self._documents: dict[Path, Node] = {}
        self._bytes = 0

    def error(
        self, code: str, message: str, span: Span, hint: str | None = None, suggestion: str | None = None
    ) -> ScenarioError:
        """The exception for one finding, with the sources read so far."""
        finding = Diagnostic(code, message, span, hint=hint, suggestion=suggestion)
        return ScenarioError([finding], self.sources)

    def resolved(self, path: Path, asked: Span) -> Path:
        """The file itself, links followed, if it may be read.

        Raises:
            ScenarioError: S505 at `asked` if it lies outside the folders.
        """
        try:
            real = path.resolve()
        except (OSError, RuntimeError, ValueError):
            raise self.error("S505", f"`{path.name}` cannot be followed to a file", asked) from None
        if not any(real.is_relative_to(root) for root in self._roots):
            inside = display_name(self._roots[0])
            hint = f"files may be taken from {inside}, folders in it, and the shipped scenarios"
            raise self.error("S505", f"`{path.name}` lies outside the scenario's folder", asked, hint=hint)
        return real

    def find(self, text: str, folder: Path, asked: Span) -> Path:
        """The file that a scenario file names: beside it, else among the shipped ones; `.yaml` may be left out.

        Raises:
            ScenarioError: S504 at `asked` if there is none, S505 if it may not be read.
        """
        if not text.strip() or not text.isprintable() or "\\" in text:
            raise self.error(
                "S504", "this is not the name of a file", asked, hint="folders are divided by `/`"
            )
        spellings = [text] if text.endswith(SUFFIXES) else [text + ".yaml", text]
        for place in dict.fromkeys((folder, self.shipped)):
            for spelling in spellings:
                real = self.resolved(place / spelling, asked)
                if real in self._texts or is_file(real):
                    return real
        near = did_you_mean(text, self._names_in((folder / text).parent, text, asked))
        raise self.error(
            "S504", f"there is no file `{text}` in {display_name(folder)}", asked, suggestion=near
        )

    def _names_in(self, folder: Path, text: str, asked: Span) -> list[str]:
        """Names of the scenario files in a folder, written as `text` is."""
        prefix = text[: text.rfind("/") + 1]
        names = yaml_files(self.resolved(folder, asked))
        return [prefix + (name if text.endswith(SUFFIXES) else name.rsplit(".", 1)[0]) for name in names]

    def matching(self, text: str, folder: Path, asked: Span) -> list[Path]:
        """The files that a name with `*` in its last part stands for, sorted by name.

        Raises:
            ScenarioError: S504 at `asked` if there is none, S505 if one may not be read, S507 if there are too many.
        """
        head, _, pattern = text.rpartition("/")
        if "\\" in text or not text.isprintable() or "*" in head:
            raise self.error(
                "S504", "this is not the name of files", asked, hint="`*` may stand in the last part"
            )
        place = self.resolved(folder / head, asked)
        names = [name for name in yaml_files(place) if _fits(name, pattern)]
        if not names:
            raise self.error("S504", f"no file matches `{text}`", asked)
        if len(names) > MAX_MATCHES:
            raise self.error("S507", f"`{text}` matches more than {MAX_MATCHES} files", asked)
        return [self.resolved(place / name, asked) for name in names]

    def read(self, path: Path, asked: Span | None = None) -> Node:
        """A file as a tree of its own, free to be changed; each is read once.

        Args:
            path: the file, resolved.
            asked: where its name is written; None for the file that was named from outside.

        Raises:
            ScenarioError: what is wrong with the file; S505 and S507 at `asked`.
        """
        if path in self._documents:
            return self._documents[path].copy()
        start = asked or Span(display_name(path), 1, 1)
        if asked is not None:
            self.resolved(path, asked)
        if len(self._documents) == MAX_FILES:
            raise self.error("S507", f"a scenario or suite is made of at most {MAX_FILES} files", start)
        source = replace(self._texts.get(path) or read_source(path, display_name(path)), path=path)
        self._bytes += len(source.text)
        if self._bytes > MAX_TOTAL_BYTES:
            message = f"the files of a scenario have more than {MAX_TOTAL_BYTES >> 20} MiB together"
            raise self.error("S507", message, start)
        self.sources[source.name] = source
        self._documents[path] = read_document(source)
        return self._documents[path].copy()


def _fits(name: str, pattern: str) -> bool:
    """Whether a name is the pattern with something in the place of each `*`, in time proportional to both.

    Each piece between two stars is taken where it first stands: a later place would leave less for the rest.
    """
    first, *middle, last = pattern.split("*") if "*" in pattern else (pattern, "")
    if not (name.startswith(first) and name.endswith(last)) or len(name) < len(first) + len(last):
        return False
    at, end = len(first), len(name) - len(last)
    for piece in middle:
        at = name.find(piece, at, end) + len(piece)
        if at < len(piece):
            return False
    return "*" in pattern or name == pattern


def yaml_files(folder: Path) -> list[str]:
    """The names of the YAML files in a folder, sorted; none if it cannot be listed."""
    try:
        return sorted(name for name in os.listdir(folder) if name.endswith(SUFFIXES))
    except OSError:
        return []


def yaml_files_below(folder: Path) -> list[str]:
    """The paths of the YAML files in a folder and those in it, sorted."""
    return sorted(str(path) for path in folder.rglob("*") if path.suffix in SUFFIXES and path.is_file())
