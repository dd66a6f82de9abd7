"""One room in which somebody plays step by step, and takes steps back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.episodes.play import Bools, Int64, Observer, Rooms, Seat, Step
from socialai_dsl.episodes.policies import Observation, Policy


class Remembering:
    """A policy on a seat of one room that can be taken back to an earlier step, what it draws included.

    Args:
        policy: what plays.

    Attributes:
        episode: a number on which what it draws in the next episode depends.
    """

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self.episode = 0
        self._seen: list[Observation] = []

    def reset(self, mask: Bools, episodes: Int64 | None = None) -> None:
        """See `Policy.reset`."""
        self._policy.reset(np.ones(1, np.bool_), np.array([self.episode]))
        self._seen = []

    def act(self, observation: Observation) -> Any:
        """See `Policy.act`."""
        self._seen.append(observation)
        return self._policy.act(observation)

    def back(self, steps: int) -> None:
        """Be as after this number of steps."""
        if len(self._seen) > steps:
            seen = self._seen[:steps]
            self.reset(np.ones(1, np.bool_))
            for observation in seen:
                self.act(observation)


def remembering(
    seats: Mapping[Seat, Any] | None,
) -> tuple[dict[Seat, Any] | None, list[Remembering]]:
    """Who fills other seats, as `make` takes it, with policies that can be taken back, and these policies."""
    if seats is None:
        return None, []
    filled = {seat: one if isinstance(one, str) else Remembering(one) for seat, one in seats.items()}
    return filled, [one for one in filled.values() if isinstance(one, Remembering)]


@dataclass(frozen=True, eq=False)
class StageMoment:
    """A moment of an episode.

    Attributes:
        snapshot: the environment's exact state.
        observations: of each seat, arrays of 1.
        info: what the environment returned.
        running: bool (1,), whether the episode goes on.
    """

    snapshot: bytes
    observations: dict[Seat, Observation]
    info: Mapping[str, Any]
    running: NDArray[np.bool_]


class Stage(Rooms):
    """One room whose steps can be taken back.

    Args:
        env: what `make` returns.
        observers: are told of all that happens.
        partners: policies that play other seats in it.

    Attributes:
        moments: the start, and one for each step; none before an episode has begun.
    """

    def __init__(
        self, env: Any, observers: Sequence[Observer] = (), partners: Iterable[Remembering] = ()
    ) -> None:
        super().__init__(env, observers)
        self._partners = tuple(partners)
        self.moments: list[StageMoment] = []

    def begin(
        self, reset: Mapping[str, Any], numbers: Int64 | None = None, begun: Bools | None = None
    ) -> None:
        """See `Rooms.begin`."""
        options = reset.get("options") or {}
        for partner in self._partners:
            number = reset.get("seed") or options.get("test_episode") or 0
            partner.episode = int(number) + int(options.get("index") or 0)
        super().begin(reset, numbers, begun)
        self.moments = [self._now()]

    def step(self, actions: Mapping[Seat, Int64]) -> Step:
        """See `Rooms.step`. A step that cannot be played leaves everything as it was."""
        try:
            step = super().step(actions)
        except Exception:
            self._restore()
            raise
        self.moments.append(self._now())
        return step

    def back(self) -> bool:
        """Take the last step back, random numbers included; return whether there was one."""
        if self.steps == 0:
            return False
        self.moments.pop()
        self._restore()
        now = self.moments[-1]
        self.observations, self.info, self.running = now.observations, now.info, now.running
        for observer in self.observers:
            observer.back(self)
        return True

    def rehearse(self, actions: Mapping[Seat, Int64], look: Callable[[], Any]) -> None:
        """Play a step that observers do not see, call `look`, and take the step back. It prepares the first step."""
        self.env.step(actions[self.own][0])
        look()
        self._restore()

    @property
    def steps(self) -> int:
        """How many steps were played."""
        return len(self.moments) - 1

    def _restore(self) -> None:
        """Let the environment and the partners be as they are now on the stage."""
        self.env.restore(self.moments[-1].snapshot)
        for partner in self._partners:
            partner.back(self.steps)

    def _now(self) -> StageMoment:
        return StageMoment(self.env.snapshot(), self.observations, self.info, self.running)
