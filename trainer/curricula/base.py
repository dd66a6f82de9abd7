"""The interface of curricula, and the tutor that lets one choose what the environments play."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import index
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Leaves:
    """The members of a suite, in order.

    Attributes:
        names: their names in the suite.
        labels: parameters and values of leaves of a tree and of members that were swept over; else empty.
        weights: relative probability of each in an episode without a curriculum.
    """

    names: tuple[str, ...]
    labels: tuple[Mapping[str, str], ...]
    weights: tuple[int, ...]

    @classmethod
    def of(cls, envs: Any) -> Leaves:
        """The members of the suite that a vector environment plays; ValueError if it plays none."""
        suite = envs.program
        names = tuple(getattr(suite, "members", ()))
        if not names:
            raise ValueError("curriculum: got a scenario, expected a suite, whose members can be chosen")
        labels: tuple[Mapping[str, str], ...] = tuple(suite.labels) or ({},) * len(names)
        return cls(names, labels, tuple(suite.weights) or (1,) * len(names))


@runtime_checkable
class Curriculum(Protocol):
    """Chooses members by the episodes so far alone; `--curriculum mine:Curriculum` builds `Curriculum(leaves)`."""

    def observe(self, member: int, success: bool, steps: int) -> None:
        """Take in that an episode of a member, an index into `Leaves.names`, has ended after a number of steps."""

    def weights(self) -> Sequence[int]:
        """The relative probability of each member in later episodes: whole numbers of at least 0, not all 0."""

    def state(self) -> dict[str, Any]:
        """Its whole state, as JSON data."""

    def load_state(self, state: dict[str, Any]) -> None:
        """Continue from what `state()` of an equal one returned; ValueError (KeyError, TypeError) for any other."""


class Tutor:
    """Tells a curriculum how episodes ended, and the environments what it chooses."""

    def __init__(self, curriculum: Curriculum, envs: Any) -> None:
        """The first episodes are chosen as well, so this comes before the environments' reset.

        Raises:
            ValueError: the environments do not draw members, or the weights are not right.
        """
        self.curriculum, self._envs = curriculum, envs
        self._weights: list[int] = []
        self._choose()

    def begin(self) -> None:
        """Choose, and note what is played; after a reset, or after environments and curriculum have been restored."""
        self._weights = []
        self._choose()
        self._playing: NDArray[np.int64] = self._envs.member_ids()

    def step(self, ended: NDArray[np.bool_], success: NDArray[np.bool_], lengths: NDArray[np.int64]) -> None:
        """Take in the episodes that ended in a step, in the order of the environments; all arrays are (E,)."""
        if not ended.any():
            return
        for environment in np.flatnonzero(ended).tolist():
            member, steps = int(self._playing[environment]), int(lengths[environment])
            self.curriculum.observe(member, bool(success[environment]), steps)
        self._choose()
        self._playing = self._envs.member_ids()

    def _choose(self) -> None:
        given = self.curriculum.weights()
        try:
            weights = [index(weight) for weight in given]
            if weights != self._weights:
                self._envs.set_member_weights(weights)
                self._weights = weights
        except TypeError as error:
            raise ValueError(f"curriculum: got the weights {given}, expected whole numbers") from error
        except ValueError as error:
            raise ValueError(f"curriculum: {error}") from error
