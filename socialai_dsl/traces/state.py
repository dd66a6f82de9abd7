"""The values of `describe` by address, and the members in the room."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

from socialai_dsl.program import Program
from socialai_dsl.semantics.plans import CheckedScenario
from socialai_dsl.semantics.terms import Const

_NOT_STATE: Final = ("t", "heard", "pending", "last")
"""What `describe` says beside what the room is like."""


def cast_of(program: Program) -> tuple[str, ...]:
    """The agent and the NPCs, by name."""
    return tuple(str(entity) for entity in program.entities if entity.role != "object")


def names_of(scenario: CheckedScenario, described: dict[str, Any]) -> dict[str, str]:
    """The names by which the members of the cast are heard, by what the file calls them."""
    names = {}
    for entity in scenario.entities:
        if entity.role == "object":
            continue
        term, key = entity.name, entity.key if entity.index is None else f"{entity.key}[{entity.index}]"
        fixed = term.type.words[term.value - term.type.low] if isinstance(term, Const) else key
        names[key] = (found(described, key) or {}).get("name", fixed)
    return names


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


def present(cast: Sequence[str], state: dict[str, Any]) -> list[str]:
    """Where everybody of the cast is, where they look, the state of their frames, their colour, and what they show."""
    width = max(map(len, cast), default=0)
    lines = []
    for name in cast:
        one = found(state, name)
        if one is None:
            continue
        place = "gone" if one.get("at") is None else f"{one['at'][0]},{one['at'][1]}"
        told = [str(one["state"])] if "state" in one else []
        told += [one["color"]] if name != "agent" else []
        told += [f"points {one['pointing']}"] if "pointing" in one else []
        told += [f"carries {one['carries']}"] if "carries" in one else []
        told += [f"{look} {word}" for look, word in one.get("looks", {}).items()]
        told += [f"did {one['last']}"] if one.get("last") not in (None, "none") else []
        lines.append(f"{name:<{width}}  {place:<5} {one.get('facing', ''):<5}  {', '.join(told)}".rstrip())
    return lines


def found(state: dict[str, Any], name: str) -> dict[str, Any] | None:
    """What is known about an inhabitant; `peers[1]` is the second of a group."""
    key, _, index = name.rstrip("]").partition("[")
    one = state.get(key)
    if isinstance(one, list):
        one = one[int(index)] if index else None
    return one if isinstance(one, dict) else None
