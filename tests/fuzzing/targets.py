"""What is done with bytes that somebody made up, and what must hold then."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import yaml

from socialai_dsl.diagnostics import CODES, Diagnostic, ScenarioError, Severity, render_text, to_json
from socialai_dsl.frontend import check
from socialai_dsl.grammar.ast import MAX_LENGTH, ParseProblem, parse_expression, parse_text
from socialai_dsl.loader import reader
from socialai_dsl.loader.reader import FORBIDDEN, decoded, read_document
from socialai_dsl.source import Node, Source, Style
from tests.fuzzing.playground import SECRET, Playground, listening

SECONDS = 10
"""What no input may take."""

_COMPOSER: Any = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader

Target = Callable[[bytes, Playground], None]


class Violation(AssertionError):  # noqa: N818 - it says what happened
    """What must hold does not."""


def document(data: bytes, place: Playground) -> None:
    """Bytes are a document, or findings that point into them."""
    try:
        source = decoded(data, "fuzz.yaml")
    except ScenarioError as error:
        return _judge(error.diagnostics, error.sources)
    try:
        read = read_document(source)
    except ScenarioError as error:
        return _judge(error.diagnostics, {source.name: source})
    _judge_positions(read)
    _judge_data(read.data, 0)
    return _judge_keys(source)


def whole(data: bytes, place: Playground) -> None:
    """Bytes are a file of the language, or findings; nothing outside the folder is opened, and nothing executed."""
    try:
        source = decoded(data, "fuzz.yaml")
    except ScenarioError as error:
        return _judge(error.diagnostics, error.sources)
    with listening() as ear:
        result = check(place.file, {place.file: source})
    if outside := place.outside(ear):
        raise Violation(f"opened {outside}")
    if ear.executed:
        raise Violation(f"gave rise to {ear.executed}")
    if not result.diagnostics and result.resolved is None:
        raise Violation("nothing was found, and nothing read")
    return _judge(result.diagnostics, result.sources)


def expression(data: bytes, place: Playground) -> None:
    """A text is a tree, or one problem at a place in it."""
    text = data.decode("utf-8", "replace")
    for parse in (parse_expression, parse_text):
        try:
            parse(text)
        except ParseProblem as problem:
            if problem.code not in CODES or not 0 <= problem.offset <= len(text):
                raise Violation(f"{problem.code} at {problem.offset}") from None
        else:
            if parse is parse_expression and len(text) > MAX_LENGTH:
                raise Violation(f"an expression of {len(text)} characters was read")


TARGETS: dict[str, Target] = {"document": document, "whole": whole, "expression": expression}


@contextmanager
def in_time() -> Iterator[None]:
    """Break off after `SECONDS` seconds."""

    def over(*_: Any) -> None:
        raise Violation(f"took more than {SECONDS} seconds")

    before = signal.signal(signal.SIGALRM, over)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _judge(found: tuple[Diagnostic, ...], sources: dict[str, Source]) -> None:
    """Findings have a code, a place in a text that was read, and nothing but printable text."""
    shown = render_text(found, sources)
    if not shown.replace("\n", "").isprintable():
        raise Violation(f"not printable: {shown!r}")
    json.dumps(to_json(found, sources))
    if SECRET in shown:
        raise Violation("a secret is shown")
    for one in found:
        if one.code not in CODES or not one.message or one.severity not in Severity:
            raise Violation(f"odd finding {one!r}")
        source = sources.get(one.span.file)
        if source is not None:
            _judge_place(one, source)


def _judge_place(one: Diagnostic, source: Source) -> None:
    lines = list(source.lines())
    line = lines[one.span.line - 1] if one.span.line <= len(lines) else ""
    if not 1 <= one.span.line <= len(lines) + 1 or not 1 <= one.span.column <= len(line) + 1:
        raise Violation(f"no such place: {one}")
    if one.code in ("S101", "S002") and (named := re.match(r"`([\w-]+)`", one.message)):
        here = line[one.span.column - 1 :]
        here = re.sub(
            r"^([&!]\S*\s+|[\"'?]\s*)*", "", here
        )  # an anchor, a tag or a quote comes before the word
        if not here.startswith(named[1]) and "\\" not in line:
            raise Violation(f"{one} does not stand at the word, but at {here[:20]!r}")


def _judge_positions(read: Node) -> None:
    """Line and column of every part lead to the character at which it starts."""
    starts = [0]
    for found in re.finditer(r"\r\n|\n|\r", read.source.text):
        starts.append(found.end())
    for path, node in ((path, part.span) for path, part in read.walk()):
        if len(path) > reader.MAX_DEPTH:
            raise Violation(f"nested {len(path)} deep")
        if node.style in (Style.PLAIN, Style.SINGLE, Style.DOUBLE) and node.end > node.start:
            counted = starts[node.value.line - 1] + node.value.column - 1
            if counted != node.start:
                raise Violation(f"{path} at {node.value} is character {node.start}, not {counted}")


def _judge_data(data: Any, depth: int) -> None:
    """Values are within the limits."""
    if isinstance(data, dict):
        for key, value in data.items():
            _judge_data(key, depth)
            _judge_data(value, depth + 1)
    elif isinstance(data, list):
        for value in data:
            _judge_data(value, depth + 1)
    elif isinstance(data, str):
        if FORBIDDEN.search(data) or len(data) > reader.MAX_SCALAR:
            raise Violation(f"the text {data[:40]!r}")
    elif isinstance(data, int) and abs(data) >= 10**reader.MAX_INT_DIGITS:
        raise Violation("a number with too many digits")
    if depth > reader.MAX_DEPTH:
        raise Violation(f"nested {depth} deep")


def _judge_keys(source: Source) -> None:
    """No mapping of what was accepted has a key twice, as another reader of YAML sees it."""
    if len(source.text) > 4_000:
        return
    waiting = [yaml.compose(source.text, Loader=_COMPOSER)]
    while waiting:
        node = waiting.pop()
        if isinstance(node, yaml.MappingNode):
            keys = [key.value for key, _ in node.value]
            if len(set(keys)) < len(keys):
                raise Violation(f"a key given twice was accepted: {keys}")
            waiting += [value for _, value in node.value]
        elif isinstance(node, yaml.SequenceNode):
            waiting += node.value
