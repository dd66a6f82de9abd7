"""A curriculum that shares the frames, not the episodes, among the members of a suite."""

from __future__ import annotations

from typing import Any

from socialai_dsl.trainer.curricula.base import Leaves

WINDOW = 100
_ONE = 1 << 16


class EvenFrames:
    """Weights a member by its natural weight, divided by the mean length of its latest episodes.

    A member's share of the frames is then its chance in the suite. The suite draws episodes, but the agent learns from
    steps: members with short episodes would teach little. The mean is over all episodes of a member up to `WINDOW`,
    then exponential.
    """

    def __init__(self, leaves: Leaves) -> None:
        self._natural = leaves.weights
        self._episodes = [0] * len(leaves.names)
        self._steps = [0.0] * len(leaves.names)

    def observe(self, member: int, success: bool, steps: int) -> None:
        """See `Curriculum.observe`; success does not count."""
        del success
        self._episodes[member] = min(self._episodes[member] + 1, WINDOW)
        self._steps[member] += (steps - self._steps[member]) / self._episodes[member]

    def weights(self) -> list[int]:
        """See `Curriculum.weights`; a member without episodes counts as long as the others are on average."""
        known = [steps for steps in self._steps if steps]
        usual = sum(known) / len(known) if known else 1.0
        shares = [
            natural / (steps or usual) for natural, steps in zip(self._natural, self._steps, strict=True)
        ]
        largest = max(shares)
        return [max(1, round(_ONE * share / largest)) for share in shares]

    def state(self) -> dict[str, Any]:
        """See `Curriculum.state`."""
        return {"episodes": [*self._episodes], "steps": [*self._steps]}

    def load_state(self, state: dict[str, Any]) -> None:
        """See `Curriculum.load_state`."""
        episodes, steps = list(state["episodes"]), list(state["steps"])
        if not len(episodes) == len(steps) == len(self._natural) or min(episodes) < 0 or min(steps) < 0:
            raise ValueError("curriculum: the state is of another suite, or damaged")
        self._episodes, self._steps = episodes, steps
