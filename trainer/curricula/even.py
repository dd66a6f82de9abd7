"""Shares of the frames, not of the episodes, among the members of a suite."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from socialai_dsl.trainer.curricula.base import Leaves

WINDOW = 100
_ONE = 1 << 16


class Lengths:
    """The mean length of the latest episodes of each member: of all up to `WINDOW`, then exponential."""

    def __init__(self, members: int) -> None:
        self._episodes = [0] * members
        self._steps = [0.0] * members

    def observe(self, member: int, steps: int) -> None:
        """Take in that an episode of a member has ended after a number of steps."""
        self._episodes[member] = min(self._episodes[member] + 1, WINDOW)
        self._steps[member] += (steps - self._steps[member]) / self._episodes[member]

    def episodes_for(self, frames: Sequence[float]) -> list[int]:
        """Probabilities of episodes, of at least 1, by which members get such shares of the frames.

        A member without episodes counts as long as the others are on average. A share of 0 stays 0.
        """
        known = [steps for steps in self._steps if steps]
        usual = sum(known) / len(known) if known else 1.0
        shares = [share / (steps or usual) for share, steps in zip(frames, self._steps, strict=True)]
        largest = max(shares)
        return [max(1, round(_ONE * share / largest)) if share else 0 for share in shares]

    def state(self) -> dict[str, Any]:
        """Its whole state, as JSON data."""
        return {"episodes": [*self._episodes], "steps": [*self._steps]}

    def load_state(self, state: dict[str, Any]) -> None:
        """Continue from what `state()` returned; ValueError (KeyError, TypeError) for any other."""
        episodes, steps = list(state["episodes"]), list(state["steps"])
        if not len(episodes) == len(steps) == len(self._steps) or min(episodes) < 0 or min(steps) < 0:
            raise ValueError("curriculum: the state is of another suite, or damaged")
        self._episodes, self._steps = episodes, steps


class EvenFrames:
    """Gives each member a share of the frames equal to its chance in the suite.

    The suite draws episodes, but the agent learns from steps: members with short episodes would teach little.
    """

    def __init__(self, leaves: Leaves) -> None:
        self._natural = leaves.weights
        self._lengths = Lengths(len(leaves.names))

    def observe(self, member: int, success: bool, steps: int) -> None:
        """See `Curriculum.observe`; success does not count."""
        del success
        self._lengths.observe(member, steps)

    def weights(self) -> list[int]:
        """See `Curriculum.weights`."""
        return self._lengths.episodes_for(self._natural)

    def state(self) -> dict[str, Any]:
        """See `Curriculum.state`."""
        return self._lengths.state()

    def load_state(self, state: dict[str, Any]) -> None:
        """See `Curriculum.load_state`."""
        self._lengths.load_state(state)
