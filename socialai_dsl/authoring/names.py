"""The names that a document declares, and the one that a word at a place means."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from socialai_dsl.source import Data, DataPath

KINDS: Final = {
    "cast": "a member of the cast",
    "objects": "an object",
    "let": "drawn or computed once per episode",
    "define": "recomputed at every use",
    "state": "a register of the world",
    "looks": "a look of things or members of the cast",
    "tables": "a table",
    "memory": "a memory",
}
"""Section -> what its names are, for those that any expression may use."""

_OF_FRAMES: Final = {
    "let": "a register of this frame",
    "slots": "a slot of this frame",
    "define": "recomputed at every use",
}


@dataclass(frozen=True)
class Name:
    """A declared name: what it is, in words, and where it is declared."""

    word: str
    kind: str
    path: DataPath


def part_at(data: Data, path: DataPath) -> Any:
    """The part of a document at a path; None if there is none."""
    part: Any = data
    for step in path:
        known: Any = part if isinstance(part, dict) else range(len(part)) if isinstance(part, list) else ()
        if step not in known:
            return None
        part = part[step]
    return part


def last_key(path: DataPath) -> str:
    """The key that a path ends in, or in whose list; empty for a path without one."""
    return next((step for step in reversed(path) if isinstance(step, str)), "")


def visible(data: Data, path: DataPath) -> list[Name]:
    """The names that an expression at a path may use: those of its frame, then those of the scenario."""
    frame = path[:2] if _in_a_frame(path) else ()
    found = [
        name
        for section, kind in _OF_FRAMES.items()
        if frame
        for name in declared(data, (*frame, section), kind)
    ]
    return found + [name for section, kind in KINDS.items() for name in declared(data, (section,), kind)]


def declared(data: Data, path: DataPath, kind: str) -> list[Name]:
    """The names that the mapping at a path declares; `near(c)` declares `near`."""
    section = part_at(data, path)
    if not isinstance(section, dict):
        return []
    return [Name(str(key).partition("(")[0], kind, (*path, key)) for key in section]


def _in_a_frame(path: DataPath) -> bool:
    """Whether a path leads into a frame, of which rivals are some."""
    return path[:1] in (("frames",), ("rivals",))


def states(data: Data, frame: DataPath) -> list[Name]:
    """The states of the frame at a path, and those of its steps that have a name."""
    found = declared(data, (*frame, "states"), f"a state of `{frame[-1]}`")
    named = _named_steps(data, (*frame, "steps"))
    return [*found, *(Name(name, f"a step of `{frame[-1]}`", path) for path, name in named)]


def _named_steps(data: Data, path: DataPath) -> Iterator[tuple[DataPath, str]]:
    """Where the steps at a path, and those nested in them, are given a name."""
    steps = part_at(data, path)
    for number, step in enumerate(steps if isinstance(steps, list) else ()):
        if isinstance(step, dict) and isinstance(step.get("state"), str):
            yield (*path, number, "state"), step["state"]
        elif isinstance(step, dict) and "steps" in step:
            yield from _named_steps(data, (*path, number, "steps"))


def frame_of(data: Data, member: str) -> str | None:
    """The frame that a member of the cast follows, by itself, by its role or by default."""
    own = part_at(data, ("cast", member))
    if not isinstance(own, dict):
        return None
    for holder in (own, part_at(data, ("roles", str(own.get("role")))), part_at(data, ("npc_defaults",))):
        if isinstance(holder, dict) and isinstance(holder.get("frame"), str):
            return str(holder["frame"])
    return None


def meant(data: Data, path: DataPath, is_key: bool, before: str) -> list[Name]:
    """The names among which a word at a place is, with what stands before it in its text."""
    key = last_key(path)
    if before.endswith("$"):
        return declared(data, ("params",), "a parameter")
    if is_key:
        if path[:1] == ("cast",) and path[2:3] == ("with",):
            frame = frame_of(data, str(path[1]))
            return declared(data, ("frames", frame, "slots"), f"a slot of `{frame}`") if frame else []
        return []
    if path[:1] == ("tests",) and path[-2:-1] == ("state",):
        frame = frame_of(data, str(path[-1]).partition("[")[0])
        return states(data, ("frames", frame)) if frame else []
    if _in_a_frame(path) and (key in ("goto", "goto_now") or path[2:] == ("start",)):
        return states(data, path[:2])
    if key == "frame":
        return declared(data, ("frames",), "a frame")
    if key == "role":
        return declared(data, ("roles",), "a role")
    if key == "order":
        return visible(data, ())
    if before.endswith("is("):
        subject = before.removesuffix(".is(").split()[-1] if before.strip() else ""
        followed = frame_of(data, subject.strip("("))
        if followed is not None:
            return states(data, ("frames", followed))
        return states(data, path[:2]) if _in_a_frame(path) else []
    return visible(data, path)
