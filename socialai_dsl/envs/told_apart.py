"""The values of the draws by which a scenario has its results told apart (`results_by`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import Loaded, LoadedScenario
from socialai_dsl.envs.scenario_env import ScenarioEnv
from socialai_dsl.program_suite import Playable, ProgramSuite, prefixed

Value = tuple[str, str]
"""A draw and its value: `("condition", "test")`; of a member of a suite `("dance: length", "3")`."""

Begin = Callable[[int], Mapping[str, Any]]
"""Number of a room -> the arguments of `env.reset` that begin an episode there."""

_NOTHING: Final = "none"


def values_apart(described: dict[str, Any], draws: Iterable[str], member: str | None = None) -> list[Value]:
    """The values that the draws have in a room, of which `described` tells all (`describe`)."""
    return [
        (name if member is None else prefixed(member, name), _spelt(described["let"].get(name)))
        for name in draws
    ]


def _spelt(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return _NOTHING if value is None else str(value)


def of_rooms(
    loaded: Loaded, program: Playable, begin: Begin, episodes: int
) -> dict[Value, NDArray[np.int64]]:
    """In which of the rooms 0 to `episodes - 1` each draw has each value: their numbers, by draw and value.

    Nothing where the scenario does not have its results told apart, and of acts in a row, which have a room each.
    """
    if isinstance(loaded, LoadedScenario):
        draws = {"": loaded.checked.results_by}
    elif loaded.in_sequence:
        return {}
    else:
        members = zip(loaded.member_names, loaded.members, strict=True)
        draws = {name: member.checked.results_by for name, member in members}
    return rooms_apart(_values(program, begin, episodes, draws)) if any(draws.values()) else {}


def _values(
    program: Playable, begin: Begin, episodes: int, draws: dict[str, tuple[str, ...]]
) -> Iterator[list[Value]]:
    env = ScenarioEnv(program)
    try:
        for number in range(episodes):
            env.reset(**begin(number))
            described = env.describe()
            member = described["member"] if isinstance(program, ProgramSuite) else None
            yield values_apart(described, draws[member or ""], member)
    finally:
        env.close()


def rooms_apart(rooms: Iterable[Sequence[Value]]) -> dict[Value, NDArray[np.int64]]:
    """The numbers of the rooms with each value, by draw and value in order."""
    numbers: dict[Value, list[int]] = {}
    for number, values in enumerate(rooms):
        for value in values:
            numbers.setdefault(value, []).append(number)
    order = list(dict.fromkeys(draw for draw, _ in numbers))
    ranked = sorted(numbers, key=lambda value: (order.index(value[0]), _rank(value[1])))
    return {value: np.array(numbers[value], np.int64) for value in ranked}


def _rank(text: str) -> tuple[bool, int, str]:
    """Numbers by value, then words."""
    is_number = text.removeprefix("-").isdecimal()
    return not is_number, int(text) if is_number else 0, text
