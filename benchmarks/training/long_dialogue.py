"""Real environments whose dialogue is replaced by a line in every second step, for long histories."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

LINE = 4
TALKATIVE = 0.5


class LongDialogue:
    """Environments in which a line of four random words is heard in every second step.

    Histories grow to `words` words and then begin anew, without regard to episodes; hardly two are ever equal. So
    the trainer meets histories of half that length on average, and none of them twice.
    """

    def __init__(self, envs: Any, words: int = 64, seed: int = 0) -> None:
        self._envs, self._words = envs, words
        self._vocabulary = len(envs.program.vocabulary)
        self._random = np.random.default_rng(seed)
        self._tokens = np.zeros((envs.num_envs, words), np.int16)
        # Neighbours begin at different lengths, so that not all histories grow and end together.
        self._lengths = LINE * (np.arange(envs.num_envs) % (words // LINE))
        for row, length in zip(self._tokens, self._lengths, strict=True):
            row[:length] = self._random.integers(2, self._vocabulary, length)
        self._ids = np.arange(envs.num_envs, dtype=np.int64)
        tokens = spaces.Box(0, self._vocabulary - 1, (words,), np.int16)
        self.single_observation_space = spaces.Dict(
            image=envs.single_observation_space["image"], tokens=tokens
        )

    def __getattr__(self, name: str) -> Any:
        return getattr(self._envs, name)

    def reset(self, **options: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start all episodes; what was said before stays."""
        observation, infos = self._envs.reset(**options)
        return {"image": observation["image"], "tokens": self._tokens.copy()}, infos

    def step(self, actions: Any) -> tuple[Any, ...]:
        """One step of the environments, and of the talking."""
        observation, *rest = self._envs.step(actions)
        self._talk()
        return {"image": observation["image"], "tokens": self._tokens.copy()}, *rest

    def history_ids(self) -> NDArray[np.int64]:
        """Equal for equal histories, int64 (E,)."""
        return self._ids.copy()

    def _talk(self) -> None:
        heard = np.flatnonzero(self._random.random(len(self._tokens)) < TALKATIVE)
        full = heard[self._lengths[heard] + LINE > self._words]
        self._tokens[full], self._lengths[full] = 0, 0
        columns = self._lengths[heard, None] + np.arange(LINE)
        self._tokens[heard[:, None], columns] = self._random.integers(2, self._vocabulary, columns.shape)
        self._lengths[heard] += LINE
        self._ids[heard] += len(self._tokens)
