"""Exploration bonuses: rewards of the trainer for lines and cells that are new in an episode."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.trainer.config import BONUS_SCALES, RunConfig
from socialai_dsl.trainer.extensions import load_class
from socialai_dsl.trainer.features import Int64
from socialai_dsl.vocabulary import words

SHIPPED = ("none", *BONUS_SCALES)

_CODED_FRAMES = 40
_AGENT = 0  # the number of the agent among speakers
_SILENCE = 0  # what the environments' `utterance_ids` say when nothing was heard


class BatchStep(NamedTuple):
    """The step that E environments have just made.

    Attributes:
        envs: the vector environment after it, which knows what was heard.
        image: uint8 (E, H, W, C), observed after it.
        actions: int64 (E, heads), as played, by the agent or by a guide.
        rewards: float64 (E,), the scenario's.
        ended: bool (E,), true where it ended the episode; what is observed and heard is then of the next episode.
        success: bool (E,), true where it ended the episode in success.
        late: bool (E,), true where it ended the episode because time ran out.
        config: the run's options, with the present values of those that change during the run.
        progress: share of the run's frames made before this rollout, 0 to 1.
    """

    envs: Any
    image: NDArray[np.uint8]
    actions: Int64
    rewards: NDArray[np.float64]
    ended: NDArray[np.bool_]
    success: NDArray[np.bool_]
    late: NDArray[np.bool_]
    config: RunConfig
    progress: float


class Bonus(Protocol):
    """The interface of a bonus on the scenario's reward; `--bonus mine:Bonus` builds `Bonus(config, num_envs)`."""

    def step(self, step: BatchStep) -> NDArray[np.float64]:
        """The bonus of the step just made, float64 (E,)."""

    def state(self) -> dict[str, NDArray[np.generic]]:
        """Its whole state, as arrays by name."""

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Continue from what `state()` of an equal bonus returned. Raises ValueError for any other."""


class EpisodicBonus:
    """A bonus for keys k that were visited N_k times before in the running episode.

    `lang`: the one key of a step is all that was heard in it; several lines together are a key of their own.
    `cell`: the keys are the distinct kinds of cells in the image. The observation a step returns counts, the first one
    after a reset does not; a step that ends the episode pays nothing and clears the counts.

    Text and released code of the paper agree on that, and differ in two things:

    * `as_coded`: `T * tanh(sum over k of (C / 40) / (N_k + 1) ** M)`, 40 being the frames of one environment in a
      rollout; silence is a key like any other, so each episode's first silent step pays as well.
    * `as_printed`: `tanh(sum over k of C / ((N_k + 1) ** M * T))`; silence pays nothing, because the text speaks of
      making the others respond.

    Source: SocialAI 1.0, appendix on the exploration bonus, and its released code.

    Attributes:
        counts: int32 (E, K), visits in the running episodes, by environment and key.
        keys: the key of each column: an utterance's id, or a kind of cell's code.
    """

    def __init__(self, config: RunConfig, num_envs: int) -> None:
        self._kind = config.bonus
        self._power = config.bonus_m
        self._as_coded = config.bonus_formula == "as_coded"
        self._divisor = _CODED_FRAMES if self._as_coded else config.bonus_t
        self._scale = config.bonus_t if self._as_coded else 1.0
        self.counts = np.zeros((num_envs, 0), np.int32)
        self.keys: dict[int, int] = {}

    def step(self, step: BatchStep) -> NDArray[np.float64]:
        """See `Bonus.step`."""
        if self._kind == "lang":
            keys = np.asarray(step.envs.utterance_ids())[:, None]
            new = np.full(keys.shape, True) if self._as_coded else keys != _SILENCE
        else:
            keys = np.sort(cell_codes(step.image), axis=1)
            new = np.ones(keys.shape, np.bool_)
            new[:, 1:] = keys[:, 1:] != keys[:, :-1]
        columns = self._columns(keys)
        rows = np.arange(len(keys))[:, None]
        visits = self.counts[rows, columns]
        unit = step.config.bonus_c / self._divisor
        terms = np.where(new, unit / (visits + 1.0) ** self._power, 0.0)
        bonus: NDArray[np.float64] = np.where(step.ended, 0.0, self._scale * np.tanh(terms.sum(axis=1)))
        self.counts[np.broadcast_to(rows, keys.shape)[new], columns[new]] += 1
        self.counts[step.ended] = 0
        return bonus

    def _columns(self, keys: Int64) -> Int64:
        """Column of each key, adding columns for keys not met before."""
        unique, inverse = np.unique(keys, return_inverse=True)
        columns = np.array([self.keys.setdefault(key, len(self.keys)) for key in unique.tolist()], np.int64)
        missing = len(self.keys) - self.counts.shape[1]
        if missing > 0:
            spare = np.zeros((len(self.counts), max(missing, self.counts.shape[1])), np.int32)
            self.counts = np.concatenate((self.counts, spare), axis=1)
        return columns[inverse].reshape(keys.shape)

    def state(self) -> dict[str, NDArray[np.generic]]:
        """See `Bonus.state`."""
        return {"counts": self.counts.copy(), "keys": np.array(list(self.keys), np.int64)}

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """See `Bonus.load_state`; a ValueError if the counts are of another number of environments."""
        counts, keys = state["counts"], state["keys"]
        if counts.ndim != 2 or len(counts) != len(self.counts) or len(keys) > counts.shape[1]:
            raise ValueError(
                f"bonus: got counts {counts.shape}, expected ({len(self.counts)}, {len(keys)} or more)"
            )
        self.counts = counts.astype(np.int32)
        self.keys = {key: column for column, key in enumerate(keys.tolist())}


class LineBonus:
    """A bonus of `bonus_c` for every line that is new in the running episode.

    A line is new unless the same speaker has said it, or one that differs from it in a single word: a liar who names
    another door each time is paid for once. What the agent says itself, and what is heard as an episode ends, pays
    nothing.

    An agent that lets time run out pays everything back, in the episode's last step. Otherwise it learns to ask without
    end: before it heeds an answer, what follows is worth less to it than an answer that is still to come.

    Attributes:
        heard: for each environment, each speaker's lines, as `heard_lines` numbers them.
        paid: float64 (E,), in the running episodes.
    """

    def __init__(self, config: RunConfig, num_envs: int) -> None:
        self.heard: list[dict[int, set[int]]] = [{} for _ in range(num_envs)]
        self.paid = np.zeros(num_envs)
        self._words: list[list[str]] = []
        self._alike = lru_cache(None)(self._differ_in_a_word_at_most)

    def step(self, step: BatchStep) -> NDArray[np.float64]:
        """See `Bonus.step`."""
        self._words = self._words or [words(line) for line in step.envs.lines]
        speakers, lines = step.envs.heard_lines()
        paid = np.where(step.late, -self.paid, 0.0)
        for env in np.flatnonzero(step.ended).tolist():
            self.heard[env] = {}
        for env, place in np.argwhere((speakers > _AGENT) & ~step.ended[:, None]).tolist():
            line = int(lines[env, place])
            known = self.heard[env].setdefault(int(speakers[env, place]), set())
            if not any(self._alike(line, other) for other in known):
                paid[env] += step.config.bonus_c
            known.add(line)
        self.paid = np.where(step.ended, 0.0, self.paid + paid)
        return paid

    def _differ_in_a_word_at_most(self, line: int, other: int) -> bool:
        one, two = self._words[line], self._words[other]
        return len(one) == len(two) and sum(a != b for a, b in zip(one, two, strict=True)) <= 1

    def state(self) -> dict[str, NDArray[np.generic]]:
        """See `Bonus.state`."""
        rows = [
            (env, speaker, line)
            for env, known in enumerate(self.heard)
            for speaker, lines in known.items()
            for line in sorted(lines)
        ]
        return {"heard": np.array(rows, np.int64).reshape(-1, 3), "paid": self.paid}

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """See `Bonus.load_state`; a ValueError if it is of another number of environments."""
        rows, paid = state["heard"].tolist(), state["paid"]
        if paid.shape != self.paid.shape or any(env >= len(paid) for env, _, _ in rows):
            raise ValueError(f"bonus: got lines of {len(paid)} environments, expected {len(self.heard)}")
        self.heard, self.paid = [{} for _ in self.heard], paid.astype(np.float64)
        for env, speaker, line in rows:
            self.heard[env].setdefault(speaker, set()).add(line)


def cell_codes(image: NDArray[np.uint8]) -> Int64:
    """One integer per cell, int64 (E, H * W), equal where all channels are and, up to about 2**-56, only there."""
    cells = image.reshape(len(image), -1, image.shape[-1]).astype(np.int64)
    codes: Int64 = cells @ _factors(image.shape[-1])  # modulo 2**64
    return codes


@lru_cache
def _factors(channels: int) -> Int64:
    """Odd numbers for `cell_codes`, the same in every run."""
    return np.random.default_rng(0).integers(-(1 << 62), 1 << 62, channels) * 2 + 1


def build_bonus(config: RunConfig, num_envs: int) -> Bonus | None:
    """The bonus that a configuration names, None for `none`. Raises ValueError if it is not there or lacks a method."""
    if config.bonus == "none":
        return None
    if config.bonus in SHIPPED:
        return (LineBonus if config.bonus == "lines" else EpisodicBonus)(config, num_envs)
    own = load_class(config.bonus, "bonus", SHIPPED, Bonus, config.code_folder)
    found: Bonus = own(config, num_envs)
    return found
