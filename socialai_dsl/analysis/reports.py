"""The report of a claim: a verdict, the rooms it rests on, and the evidence in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.dilemma import Schelling
from socialai_dsl.analysis.leaks import SOMEBODY
from socialai_dsl.envs.told_apart import Value

SHOWN: Final = 5
"""How many rooms a report names at most."""
_NO_TIME: Final = "there was no time to look at a room"


class Verdict(Enum):
    """Whether a property holds."""

    HOLDS = "holds"
    FAILS = "fails"
    UNDECIDED = "undecided"
    UNASKED = "not asked"


@dataclass(frozen=True)
class Report:
    """The result of one property.

    Attributes:
        verdict: undecided where a search gave up, or where rooms can be told apart and more was not tried; not asked of
            a scenario that was changed so that there is nothing to ask about.
        rooms: how many were tried. held: in how many it is so. undecided: in how many nothing was decided.
        against: numbers of the first rooms that speak against it: `reset(seed=..., options={"index": number})`.
        said: what was found, in words.
        rests: how many of the rooms test it.
        pairs: on how many pairs of episodes, where pairs are compared.
        acts: what is done in the first of `against`, as it is typed, where that is known.
        so: of each room that says something, where rooms are looked at one by one: whether it is so there, or whether a
            script or rival solves it. apart: how many are so, of how many, by draws and their values (`results_by`).
        schelling: of `dilemma`, what players are paid.
    """

    verdict: Verdict
    rooms: int
    held: int
    undecided: int
    against: tuple[int, ...]
    said: str
    rests: int
    pairs: int = 0
    acts: tuple[str, ...] = ()
    so: Mapping[int, bool] = field(default_factory=dict, repr=False)
    apart: Mapping[Value, tuple[int, int]] = field(default_factory=dict)
    schelling: Schelling | None = None

    def told_apart(self, rooms: Mapping[Value, NDArray[np.int64]]) -> Report:
        """The same with figures for each value of draws, of which the numbers of the rooms are given."""
        known = {
            value: [self.so[k] for k in numbers.tolist() if k in self.so] for value, numbers in rooms.items()
        }
        return replace(self, apart={value: (sum(so), len(so)) for value, so in known.items() if so})


@dataclass
class Evidence:
    """The evidence room by room: the numbers of the rooms, and the reasons why some are vacuous."""

    held: list[int] = field(default_factory=list)
    against: list[int] = field(default_factory=list)
    undecided: list[int] = field(default_factory=list)
    void: dict[str, list[int]] = field(default_factory=dict)

    @property
    def rests(self) -> int:
        """How many rooms say anything about it."""
        return len(self.held) + len(self.against) + len(self.undecided)

    @property
    def rooms(self) -> int:
        """How many rooms were tried."""
        return self.rests + sum(map(len, self.void.values()))

    def report(self, said: str, share: float | None) -> Report:
        """How it stands with a claim about this share of the rooms that it rests on; None: about one."""
        if not self.rooms:
            return Report(Verdict.UNDECIDED, 0, 0, 0, (), _NO_TIME, 0)
        if not self.rests:
            silent = tuple(sorted(room for rooms in self.void.values() for room in rooms))[:SHOWN]
            return Report(Verdict.FAILS, self.rooms, 0, 0, silent, f"no room tests it: {self._why()}", 0)
        if self.void:
            said += f"; the others do not test it: {self._why()}"
        held, undecided = len(self.held), len(self.undecided)
        verdict = by_share(held, undecided, self.rests, share)
        against = tuple(sorted((*self.against, *self.undecided)))[:SHOWN]
        so = {room: room in self.held for room in (*self.held, *self.against, *self.undecided)}
        return Report(verdict, self.rooms, held, undecided, against, said, self.rests, so=so)

    def _why(self) -> str:
        return ", ".join(f"in {rooms_text(len(rooms))} {why}" for why, rooms in self.void.items())


def by_share(held: int, undecided: int, rooms: int, share: float | None) -> Verdict:
    """Whether enough rooms are as they should be; one at least, and without a share one is enough."""
    needed = 1 if share is None else max(1, share * rooms - 1e-9)
    if held >= needed:
        return Verdict.HOLDS
    return Verdict.UNDECIDED if held + undecided >= needed else Verdict.FAILS


def rooms_text(count: int) -> str:
    """A number of rooms in words."""
    return f"{count} room" if count == 1 else f"{count} rooms"


def steps_text(count: int | None) -> str:
    """A number of steps in words."""
    return f"{count} step" if count == 1 else f"{count} steps"


def names_text(tellers: Sequence[str]) -> str:
    """The sources of a difference, as `Tellers.between` returns them, in words."""
    return ", ".join(name if name == SOMEBODY else f"`{name}`" for name in tellers) or "the walls"
