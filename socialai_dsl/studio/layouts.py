"""Layouts as text: written into a member of a suite, or as a new suite that begins in a known room."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

import yaml

from socialai_dsl.source import Node

_OF_A_MOMENT: Final = ("member", "t", "last", "heard", "pending")
_Parser: Any = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader


def start_layout(described: Mapping[str, Any]) -> dict[str, Any]:
    """The layout from which an episode starts in the room that `describe` tells of."""
    return {name: value for name, value in described.items() if name not in _OF_A_MOMENT}


def suite_text(name: str, scenario: str, layout: Mapping[str, Any]) -> str:
    """A suite of one scenario that starts from a layout.

    Args:
        name: of the suite.
        scenario: its file.
        layout: as `start_layout` returns it.
    """
    return (
        f"suite: {name}\n"
        "about: One known room. What the layout leaves out is drawn, so delete the lines that shall vary.\n"
        f"members:\n  - scenario: {scenario}\n    layout: {_written(layout, 4)}\n"
    )


def with_layout(entry: Node, layout: Mapping[str, Any]) -> str:
    """The text of a suite's file with another layout of a member.

    Args:
        entry: the member in the file's `members`.
        layout: as `start_layout` returns it.
    """
    text, start, end = entry.source.text, entry.span.start, entry.span.end
    if not isinstance(entry.children, dict):
        written = _written(layout, _indent(text, start))
        return f"{text[:start]}{{scenario: {text[start:end]}, layout: {written}}}{text[end:]}"
    if "layout" in entry.children:
        former = entry.children["layout"].span.start
        return text[:former] + _written(layout, _indent(text, start)) + text[_end(text, former) :]
    named = entry.children["scenario"].span
    end = named.end
    if named.flow:
        return f"{text[:end]}, layout: {_written(layout, _indent(text, start))}{text[end:]}"
    column = start - text.rfind("\n", 0, start) - 1
    line_end = end + len(text[end:].partition("\n")[0])
    return f"{text[:line_end]}\n{' ' * column}layout: {_written(layout, column)}{text[line_end:]}"


def _written(layout: Mapping[str, Any], indent: int) -> str:
    """A layout in braces, with a line for each of its keys."""
    lines = ",\n".join(f"{' ' * (indent + 2)}{key}: {_in_a_line(value)}" for key, value in layout.items())
    return f"{{\n{lines}}}"


def _in_a_line(value: Any) -> str:
    text: str = yaml.safe_dump(
        value, default_flow_style=True, width=float("inf"), sort_keys=False, allow_unicode=True
    )
    return re.sub(r"\n\.\.\.\n$", "", text).strip()


def _indent(text: str, index: int) -> int:
    """How far the line of a place is indented."""
    line = text[text.rfind("\n", 0, index) + 1 :]
    return len(line) - len(line.lstrip(" "))


def _end(text: str, start: int) -> int:
    """Where the value ends that starts at a place."""
    events: Iterator[Any] = yaml.parse(text, Loader=_Parser)
    depth, end = 0, start
    for event in events:
        if event.start_mark.index < start:
            continue
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if event.start_mark.index < event.end_mark.index:
            end = event.end_mark.index
        if depth == 0:
            break
    return end
