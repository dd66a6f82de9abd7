"""The names that a document declares, and the one that a word at a place means."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from socialai_dsl.schema.holds import Holds
from socialai_dsl.source import Data, DataPath

_SECTIONS: Final = {
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

_OTHERS: Final = {
    "frames": "a frame",
    "roles": "a role",
    "rivals": "a strategy without the skill",
    "profiles": "a size of the experiment",
    "params": "a parameter",
    "types": "an object type",
    "grammars": "a grammar",
}
"""The same for those that only some keys may name."""

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


def visible(data: Data, path: DataPath) -> list[Name]:
    """The names that an expression at a path may use: those of its frame, then those of the scenario."""
    frame = path[:2] if _in_a_frame(path) else ()
    found = [
        name
        for section, kind in _OF_FRAMES.items()
        if frame
        for name in declared(data, (*frame, section), kind)
    ]
    return found + [name for section, kind in _SECTIONS.items() for name in declared(data, (section,), kind)]


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


def meant(data: Data, path: DataPath, held: Holds | None, before: str) -> list[Name]:
    """The names among which a word at a place is, which holds something, with what stands before it in its text."""
    if before.endswith("$"):
        return _named(data, path, "params")
    match held:
        case Holds("state"):
            return _states(data, path)
        case Holds("name", of):
            return [name for section in of for name in _named(data, path, section)]
        case Holds("new name" | "file" | "number" | "truth" | "word"):
            return []
    if before.endswith("is("):
        subject = before.removesuffix(".is(").split()[-1] if before.strip() else ""
        followed = frame_of(data, subject.strip("("))
        return states(data, ("frames", followed)) if followed is not None else _states(data, path)
    return visible(data, path)


def _states(data: Data, path: DataPath) -> list[Name]:
    """The states of the frame that a path leads into, or that a test asks of a member of the cast."""
    if path[:1] == ("tests",):
        frame = frame_of(data, str(path[-1]).partition("[")[0])
        return states(data, ("frames", frame)) if frame else []
    return states(data, path[:2]) if _in_a_frame(path) else []


def _named(data: Data, path: DataPath, section: str) -> list[Name]:
    """The names that a section declares: that of the frame that the path leads into first, then that of the file."""
    if section == "slots":
        frame = _frame_with_slots(data, path)
        return declared(data, ("frames", frame, "slots"), f"a slot of `{frame}`") if frame else []
    own = declared(data, (*path[:2], section), _OF_FRAMES.get(section, "")) if _in_a_frame(path) else []
    return own + declared(data, (section,), {**_SECTIONS, **_OTHERS}[section])


def _frame_with_slots(data: Data, path: DataPath) -> str | None:
    """The frame whose slots are filled at a path: of a member of the cast, or of a whole file of one."""
    if path[:1] == ("cast",):
        return frame_of(data, str(path[1]))
    frame = part_at(data, (*path[: path.index("with")], "frame"))
    return frame if isinstance(frame, str) else None
