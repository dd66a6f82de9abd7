"""Tests as text: an entry of `tests`, and a file of tests with it."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any, Final

from socialai_dsl.authoring.formatting import formatted
from socialai_dsl.errors import UsageError
from socialai_dsl.loader.reader import Plain, read_document, read_plain
from socialai_dsl.source import Node, Source

_WIDTH: Final = 100
_PLAIN: Final = re.compile(r"(?:[A-Za-z+]|\?(?=\w))[A-Za-z0-9_<>.'()=!+/-]*( [A-Za-z0-9_<>.'()=!+/-]+)*")
"""What needs no quotes anywhere."""
_ALONE: Final = re.compile(r"[A-Za-z](?:[^:#]|[:#](?=\w))*(?<! )")
"""What needs none as the value of a key in a line of its own."""


class NameTakenError(UsageError):
    """A file has a test of this name already."""


def test_text(name: str, test: Mapping[str, Any]) -> str:
    """An entry of `tests`, indented by two.

    Args:
        name: of the test.
        test: its keys with plain data, in the order in which they are written.
    """
    return "\n".join([f"  {name}:", *_block(test, 4)]) + "\n"


def file_with(source: Source | None, tests_of: str, name: str, test: Mapping[str, Any], force: bool) -> str:
    """The text of a file of tests with one more, in the place of that of the same name if there is one.

    Args:
        source: the file; None if it is to be made.
        tests_of: the scenario's file.
        name: of the test.
        test: as `test_text` takes it.
        force: whether a test of this name may be replaced.

    Raises:
        NameTakenError: there is a test of this name.
        UsageError: the file is none of tests.
        ScenarioError: the file is not YAML as the language has it.
    """
    if source is None:
        return _in_style(f"tests_of: {_flow(tests_of)}\ntests:\n{test_text(name, test)}")
    document = read_document(source)
    tests = document.entry("tests")
    if document.entry("tests_of") is None or tests is None or tests.span.flow:
        raise UsageError(f"{source.name}: expected a file of tests, with `tests_of` and a mapping `tests`")
    lines = source.text.splitlines(keepends=True)
    written = test_text(name, test).splitlines(keepends=True)
    former = tests.entry(name)
    if former is not None and not force:
        raise NameTakenError(f"{source.name} has a test `{name}` already")
    begins, ends = _lines(document, tests, name)
    if lines and not lines[-1].endswith("\n"):
        lines[-1] += "\n"
    return _in_style("".join([*lines[:begins], *written, *lines[ends:]]))


def _in_style(text: str) -> str:
    return formatted(Source("tests", text))


def _lines(document: Node, tests: Node, name: str) -> tuple[int, int]:
    """The lines, from 0, that a test of a name takes up, or would come between."""
    total = len(document.source.text.splitlines())
    starts = sorted(
        part.key_span().line - 1
        for holder in (document, tests)
        for _, part in holder.items()
        if part.span.key
    )
    last = tests.key_span().line - 1
    own = {key: part.key_span().line - 1 for key, part in tests.items()}
    first = own.get(name, max([last, *own.values()]))
    after = next((line for line in starts if line > first), total)
    return (first, after) if name in own else (after, after)


def _block(mapping: Mapping[str, Any], indent: int) -> list[str]:
    """The entries of a mapping, each in a line, or below each other where they are too long for that."""
    lines = []
    for key, value in mapping.items():
        is_alone = isinstance(value, str) and _is_plain(_ALONE, value)
        line = f"{' ' * indent}{key}: {value if is_alone else _flow(value)}"
        is_steps = key == "play"
        if len(line) <= _WIDTH and not is_steps:
            lines.append(line)
        elif isinstance(value, Mapping):
            lines += [f"{' ' * indent}{key}:", *_block(value, indent + 2)]
        elif is_steps:
            lines.append(f"{' ' * indent}{key}:")
            lines += [line for item in value for line in _item(item, indent + 2)]
        elif isinstance(value, Sequence) and not isinstance(value, str):
            begun = f"{' ' * indent}{key}: ["
            listed = ", ".join(map(_flow, value))
            lines += _folded(f"{begun}{listed}]", "", " " * len(begun))
        elif isinstance(value, str):
            lines.append(f"{' ' * indent}{key}: >-")
            deeper = " " * (indent + 2)
            lines += _folded(value, deeper, deeper)
        else:
            lines.append(line)
    return lines


def _folded(text: str, first: str, others: str) -> list[str]:
    return textwrap.wrap(
        text,
        _WIDTH,
        initial_indent=first,
        subsequent_indent=others,
        break_long_words=False,
        break_on_hyphens=False,
    )


def _item(mapping: Mapping[str, Any], indent: int) -> list[str]:
    line = f"{' ' * indent}- {_flow(mapping)}"
    if len(line) <= _WIDTH:
        return [line]
    first, *others = _block(mapping, indent + 2)
    return [f"{' ' * indent}- {first.lstrip()}", *others]


def _flow(value: Any) -> str:
    """A value in one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_flow(key)}: {_flow(part)}" for key, part in value.items()) + "}"
    if isinstance(value, str):
        is_plain = (
            _PLAIN.fullmatch(value) and read_plain(value).value == value and read_plain(value).code is None
        )
        return value if is_plain else json.dumps(value, ensure_ascii=False)
    if isinstance(value, Sequence):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return json.dumps(value)


def _is_plain(form: re.Pattern[str], text: str) -> bool:
    """Whether a text is read as itself without quotes, where texts of this form can stand."""
    return form.fullmatch(text) is not None and read_plain(text) == Plain(text)
