"""The values of `describe` by address, and the members in the room."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from socialai_dsl.program import Program
from socialai_dsl.program_suite import Playable, ProgramSuite

_NOT_STATE: Final = ("t", "heard", "pending", "last")
"""What `describe` says beside what the room is like."""


def played(program: Playable, info: dict[str, Any]) -> Program:
    """The program of an episode: of a suite the member's that `info` names."""
    if not isinstance(program, ProgramSuite):
        return program
    return program.programs[program.members.index(info["member"])]


def cast_of(program: Program) -> tuple[str, ...]:
    """The agent and the NPCs, by name."""
    return tuple(str(entity) for entity in program.entities if entity.role != "object")


def changes(before: dict[str, Any], after: dict[str, Any]) -> dict[str, tuple[Any, Any]]:
    """The differences between two states, by address: `honest.state`, `doors[1].state`, `let.exit`."""
    old, new = leaves(before), leaves(after)
    return {key: (old.get(key), new.get(key)) for key in {**old, **new} if old.get(key) != new.get(key)}


def leaves(state: dict[str, Any]) -> dict[str, Any]:
    """The values of a state by address; a place counts as one, and so does all of a memory."""
    return dict(_leaves(state, ""))


def _leaves(value: Any, address: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, part in value.items():
            if address or key not in _NOT_STATE:
                yield from _leaves(part, f"{address}.{key}" if address else key)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for index, part in enumerate(value):
            yield from _leaves(part, f"{address}[{index}]")
    else:
        yield address, value
