"""One room in which somebody plays step by step, and takes steps back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.episodes.play import AGENT, Bools, Int64, Rooms, Seat, Step
from socialai_dsl.episodes.policies import Observation


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
    """A room with every step back to its start.

    Attributes:
        moments: the start, and one for each step.
    """

    moments: list[StageMoment]

    def begin(
        self, reset: Mapping[str, Any], numbers: Int64 | None = None, begun: Bools | None = None
    ) -> None:
        """See `Rooms.begin`."""
        super().begin(reset, numbers, begun)
        self.moments = [self._now()]

    def step(self, actions: Mapping[Seat, Int64]) -> Step:
        """See `Rooms.step`. A step that cannot be played leaves everything as it was."""
        try:
            step = super().step(actions)
        except Exception:
            self.env.restore(self.moments[-1].snapshot)
            raise
        self.moments.append(self._now())
        return step

    def back(self) -> bool:
        """Take the last step back, chance included; whether there was one."""
        if self.steps == 0:
            return False
        self.moments.pop()
        now = self.moments[-1]
        self.env.restore(now.snapshot)
        self.observations, self.info, self.running = now.observations, now.info, now.running
        for observer in self.observers:
            observer.back(self)
        return True

    def rehearse(self, actions: Mapping[Seat, Int64], look: Callable[[], Any]) -> None:
        """Play a step that nobody sees, `look` at what came of it, and take it back; it prepares the first one."""
        self.env.step(actions[AGENT][0])
        look()
        self.env.restore(self.moments[-1].snapshot)

    @property
    def steps(self) -> int:
        """How many steps were played."""
        return len(self.moments) - 1

    def _now(self) -> StageMoment:
        return StageMoment(self.env.snapshot(), self.observations, self.info, self.running)
