"""Files as text: read without trusting them, decoded strictly."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path
from typing import IO, Final

from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, ScenarioError
from socialai_dsl.loader.limits import MAX_FILE_BYTES
from socialai_dsl.source import Source, Span

FORBIDDEN: Final = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f"
    "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufeff\ufffe\uffff]"
)
"""Characters no text may hold: control, line separators, bidirectional, surrogates, byte order marks."""

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
    message = f"the invisible character U+{ord(character):04X} may not be used; delete it"
    return Diagnostic("S006", message, span)
