"""Buffers and calls that the hard-wired versions of TalkItOut share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import SimpleNamespace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

HISTORY: Final = 64
"""Words of a history; of the oldest no more is kept."""

WORDS: Final = (
    *("<pad>", "gandalf", "john", "jack", "i", "am", "fine", "ask", "go", "to", "the", "door"),
    *("red", "green", "blue", "purple", "yellow", "grey"),
)
"""Word of each token id."""

ROOM_FIELDS: Final = 18
"""Numbers that say what a room is like: see `Rooms`."""

Rooms = NDArray[np.int32]
"""(E, 18): cell and direction of the agent, 4 cells and 4 colors of doors, which of them is the exit, 3 cells and 3
colors of wizard, honest guide and liar, whether the honest one is called Jack. Cells are 8 y + x."""

Observation = dict[str, NDArray[Any]]


class HardCoded(ABC):
    """Environments in one process that play TalkItOut in rooms of 8 x 8; an ended one is reset by the next step.

    Observation: `image` uint8 (E, 7, 7, 4), `tokens` int16 (E, 64), valid until the next call. Action: int64
    (E, 4), as in the scenario; nobody checks it.

    Attributes:
        num_envs: E.
        state_bytes: bytes of state for each environment, without the observation.
    """

    state_bytes: int
    single_action_space = SimpleNamespace(nvec=np.array([8, 2, 4, 16]))

    def __init__(self, num_envs: int) -> None:
        self.num_envs = num_envs
        self.image = np.zeros((num_envs, 7, 7, 4), np.uint8)
        self.tokens = np.zeros((num_envs, HISTORY), np.int16)
        self.reward = np.zeros(num_envs, np.float64)
        self.terminated = np.zeros(num_envs, np.bool_)
        self.truncated = np.zeros(num_envs, np.bool_)

    def reset(self, *, seed: int = 0) -> tuple[Observation, dict[str, Any]]:
        """Draw a room for every environment."""
        self._start(seed)
        return {"image": self.image, "tokens": self.tokens}, {}

    def enter(self, rooms: Rooms) -> Observation:
        """Begin episodes in the rooms given, after a reset."""
        self._enter(np.ascontiguousarray(rooms, np.int32))
        return {"image": self.image, "tokens": self.tokens}

    def step(
        self, actions: NDArray[np.int64]
    ) -> tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """One step of every environment."""
        self._step(actions)
        return (
            {"image": self.image, "tokens": self.tokens},
            self.reward,
            self.terminated,
            self.truncated,
            {},
        )

    @abstractmethod
    def _start(self, seed: int) -> None: ...

    @abstractmethod
    def _enter(self, rooms: Rooms) -> None: ...

    @abstractmethod
    def _step(self, actions: NDArray[np.int64]) -> None: ...
