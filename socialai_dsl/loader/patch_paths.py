"""Paths of patches, such as `cast.anna.name`, `outcome[1].success`, `states.idle.then[greeting]`."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.loader.library import Node

_INDEX: Final = re.compile(r"\[([^\[\]]*)\]")
_KEY: Final = re.compile(r"[^.\[\]()]+(?:\([^()]*\))?")


@dataclass(frozen=True)
class Place:
    """An existing part, or a key that its mapping does not have yet."""

    parent: Node
    key: str | int
    node: Node | None


@dataclass(frozen=True)
class Miss:
    """A path that leads nowhere: the message, and what was probably meant."""

    message: str
    suggestion: str | None = None
    suggestion_place: str | None = None
    hint: str | None = None


def follow(root: Node, path: str) -> Place | Miss:
    """The part that a path leads to.

    A key with dots or brackets in it is found as it stands. The last key may be missing from its mapping: the
    place then has no node.
    """
    node, begin = root, 0
    while True:
        in_list = isinstance(node.children, list)
        step = _list_step(node, path, begin) if in_list else _key_step(node, path, begin)
        if isinstance(step, Miss):
            return step
        key, end = step
        part = node.children.get(str(key)) if isinstance(node.children, dict) else dict(node.items()).get(key)
        if end == len(path):
            return Place(node, key, part)
        if part is None:
            return missing(node, path[:begin], str(key))
        begin = end + 1 if path[end] == "." else end
        if path[end] not in ".[" or begin == len(path):
            return _no_path(path)
        node = part


def _key_step(node: Node, path: str, begin: int) -> tuple[str, int] | Miss:
    """The key of a mapping that the path goes on with, and where it ends in the path."""
    if not isinstance(node.children, dict):
        return Miss(f"`{_shown(path, begin)}` in {node.file} is {node.kind}, there is nothing below it")
    rest = path[begin:]
    ends = [len(rest), *(end for end in range(len(rest) - 1, -1, -1) if rest[end] in ".[")]
    for end in ends:
        if rest[:end] in node.children:
            return rest[:end], begin + end
    if path.startswith("[", begin):
        hint = f"write `{_shown(path, begin)}.` and the key"
        return Miss(f"`{_shown(path, begin)}` in {node.file} is a mapping, not a list", hint=hint)
    match = _KEY.match(path, begin)
    if not match:
        return _no_path(path)
    return match.group(), match.end()


def _list_step(node: Node, path: str, begin: int) -> tuple[int, int] | Miss:
    """The index in a list that the path goes on with, given as a number or as the `id` of the item."""
    items = [part for _, part in node.items()]
    match = _INDEX.match(path, begin)
    if not match:
        hint = f"write `{_shown(path, begin)}[0]` for its first item"
        return Miss(f"`{_shown(path, begin)}` in {node.file} is a list", hint=hint)
    wanted = match[1]
    ids = {item.text("id"): i for i, item in enumerate(items) if item.text("id") is not None}
    index = ids.get(wanted)
    if index is None and wanted.isascii() and wanted.isdigit() and len(wanted) <= 6:
        index = int(wanted)
    if index is None or index >= len(items):
        return _no_item(node, path, begin, match, {str(i) for i in ids})
    return index, match.end()


def _no_item(node: Node, path: str, begin: int, match: re.Match[str], ids: set[str]) -> Miss:
    count = len(node.children or ())
    items = (
        "is empty" if not count else "has one item, [0]" if count == 1 else f"has items [0] to [{count - 1}]"
    )
    named = did_you_mean(match[1], ids)
    suggestion = f"{path[:begin]}[{named}]" if named else None
    message = f"there is no `{path[: match.end()]}` in {node.file}; `{_shown(path, begin)}` {items}"
    return Miss(message, suggestion)


def _no_path(path: str) -> Miss:
    return Miss(f"`{path}` is not a path", hint="write it like `cast.anna.name` or `outcome[0].success`")


def missing(node: Node, prefix: str, key: str) -> Miss:
    """The message for a key that a mapping does not have; `prefix` is the path to the mapping, with its dot."""
    assert isinstance(node.children, dict), "internal: only a mapping misses a key"
    named = did_you_mean(key, node.children)
    message = f"there is no `{prefix}{key}` in {node.file}"
    if named:
        span = node.children[named].key_span()
        return Miss(message, f"{prefix}{named}", f"{span.file}:{span.line}")
    known = ", ".join(f"`{k}`" for k in list(node.children)[:12])
    return Miss(message, hint=f"`{prefix.rstrip('.')}` has {known}" if prefix and known else None)


def _shown(path: str, end: int) -> str:
    return path[:end].rstrip(".")
