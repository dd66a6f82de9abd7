"""How much messages tell of what they may be about: mutual information, and whether like is called alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

_PERMUTATIONS: Final = 999
_SEED: Final = 0
_CHANCE: Final = 0.95


@dataclass(frozen=True, eq=False)
class Messages:
    """Messages in N episodes, U in all.

    Attributes:
        what: int64 (U,), which message, from 0.
        episodes: int64 (U,). steps: int64 (U,), before which each was said, from 0.
        weights: float64 (U,), what each counts; those of an episode add up to 1.
    """

    what: NDArray[np.int64]
    episodes: NDArray[np.int64]
    steps: NDArray[np.int64]
    weights: NDArray[np.float64]

    def joint(self, values: NDArray[np.int64]) -> NDArray[np.float64]:
        """How often each value goes with each message, in episodes, float64 (values, messages).

        Args:
            values: int64 (N, T), of each step of each episode, from 0.
        """
        shape = int(values.max()) + 1, int(self.what.max()) + 1
        pairs = values[self.episodes, self.steps] * shape[1] + self.what
        counts = np.bincount(pairs, self.weights, shape[0] * shape[1])
        return counts.astype(np.float64, copy=False).reshape(shape)


@dataclass(frozen=True)
class Information:
    """How much messages tell of a value.

    Attributes:
        bits: mutual information, adjusted for chance: 0 where messages say nothing, `possible` where they say all.
        possible: entropy of the value, in bits.
        chance: of messages of other episodes 95 % tell no more than this, adjusted likewise.
        p: how likely messages of other episodes tell at least as much.
    """

    bits: float
    possible: float
    chance: float
    p: float

    def figures(self) -> dict[str, Any]:
        """As a JSON-able object."""
        return vars(self).copy()


def mutual_information(joint: NDArray[np.float64]) -> float:
    """The mutual information of rows and columns in bits, as counted, which is too much where counts are few.

    Args:
        joint: how often, or how likely, each row goes with each column.
    """
    shares = joint / joint.sum()
    apart = shares.sum(axis=1, keepdims=True) * shares.sum(axis=0, keepdims=True)
    there = shares > 0
    return float((shares[there] * np.log2(shares[there] / apart[there])).sum())


def entropy(counts: NDArray[np.float64]) -> float:
    """The entropy of something that was counted, in bits."""
    return mutual_information(np.diag(counts.ravel()))


def information(messages: Messages, values: NDArray[np.int64]) -> Information:
    """How much messages tell of a value.

    The same is computed for messages that are put to the values of other episodes, step by step, which is what chance
    gives. The mean of these is taken off, by the adjustment for chance of Vinh, Epps and Bailey (2010).

    Args:
        messages: in N episodes.
        values: int64 (N, T), of each step of each episode, from 0; two of them at least.
    """
    joint = messages.joint(values)
    found, possible = mutual_information(joint), entropy(joint.sum(axis=1))
    random = np.random.default_rng(_SEED)
    by_chance = np.array(
        [
            mutual_information(messages.joint(values[random.permutation(len(values))]))
            for _ in range(_PERMUTATIONS)
        ]
    )
    mean = float(by_chance.mean())

    def adjusted(bits: float) -> float:
        return possible * (bits - mean) / (possible - mean) if possible > mean else 0.0

    # Equal ones differ in the last digits by the order in which they were added up.
    at_least = int((by_chance >= found - 1e-9).sum())
    return Information(
        adjusted(found),
        possible,
        adjusted(float(np.quantile(by_chance, _CHANCE))),
        (1 + at_least) / (1 + _PERMUTATIONS),
    )


def topographic_similarity(
    meanings: Sequence[Sequence[object]], messages: Sequence[Sequence[object]]
) -> tuple[float, float] | None:
    """Whether what differs little is called alike (Brighton and Kirby 2006).

    That is Spearman's correlation, over all pairs, of the number of parts in which two meanings differ with the number
    of parts in which their messages do.

    Args:
        meanings: each by its parts.
        messages: what each is called, by its parts.

    Returns:
        The correlation, and how likely messages in another order have at least as much of it; None where all pairs of
        meanings, or of messages, differ by the same number of parts.
    """
    apart, called = _differences(meanings), _differences(messages)
    upper = np.triu_indices(len(apart), 1)
    ranks = _ranks(apart[upper])
    if not (np.ptp(ranks) if len(ranks) else 0) or not np.ptp(called[upper]):
        return None
    random = np.random.default_rng(_SEED)

    def correlation(order: NDArray[np.int64]) -> float:
        return float(np.corrcoef(ranks, _ranks(called[np.ix_(order, order)][upper]))[0, 1])

    found = correlation(np.arange(len(called)))
    by_chance = [correlation(random.permutation(len(called))) for _ in range(_PERMUTATIONS)]
    at_least = sum(one >= found - 1e-9 for one in by_chance)
    return found, (1 + at_least) / (1 + _PERMUTATIONS)


def _differences(things: Sequence[Sequence[object]]) -> NDArray[np.int64]:
    """In how many parts each two differ, int64 (things, things)."""
    numbers = [
        np.unique([repr(part) for part in parts], return_inverse=True)[1]
        for parts in zip(*things, strict=True)
    ]
    table = np.array(numbers, np.int64).reshape(len(numbers), -1)
    differing: NDArray[np.int64] = (table[:, :, None] != table[:, None, :]).sum(axis=0)
    return differing


def _ranks(values: NDArray[np.int64]) -> NDArray[np.float64]:
    """Ranks from 1; equal values have the mean of theirs."""
    _, places, counts = np.unique(values, return_inverse=True, return_counts=True)
    ends = np.cumsum(counts)
    return ((ends - counts + 1 + ends) / 2)[places]
