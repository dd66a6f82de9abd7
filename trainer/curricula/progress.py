"""A curriculum that prefers the members of a suite on which the agent's success changes most."""

from __future__ import annotations

from typing import Any

from socialai_dsl.trainer.curricula.base import Leaves

WINDOW = 100
FLOOR = 0.1
_ONE = 1 << 16


class LearningProgress:
    """Weights a member by its natural weight times its absolute learning progress, and a floor.

    Progress is the difference of the rates of success in the two halves of the member's last `2 * WINDOW` episodes;
    while a member has fewer, it counts as full progress, so that everything is tried. The floor keeps every member in
    play, so that what was forgotten is noticed.
    """

    def __init__(self, leaves: Leaves) -> None:
        self._natural = leaves.weights
        self._last: list[list[int]] = [[] for _ in leaves.names]

    def observe(self, member: int, success: bool, steps: int) -> None:
        """See `Curriculum.observe`; how long the episode was does not count."""
        del steps
        last = self._last[member]
        last.append(int(success))
        del last[: -2 * WINDOW]

    def weights(self) -> list[int]:
        """See `Curriculum.weights`."""
        whole = sum(self._natural)
        return [
            max(1, int(_ONE * natural * (FLOOR + (1 - FLOOR) * self.progress(member)) / whole))
            for member, natural in enumerate(self._natural)
        ]

    def progress(self, member: int) -> float:
        """How much the rate of success has changed lately, 0 to 1."""
        last = self._last[member]
        if len(last) < 2 * WINDOW:
            return 1.0
        return abs(sum(last[WINDOW:]) - sum(last[:WINDOW])) / WINDOW

    def state(self) -> dict[str, Any]:
        """See `Curriculum.state`."""
        return {"last": ["".join(map(str, last)) for last in self._last]}

    def load_state(self, state: dict[str, Any]) -> None:
        """See `Curriculum.load_state`."""
        last = [[int(digit) for digit in text] for text in state["last"]]
        if len(last) != len(self._last) or any(set(own) - {0, 1} or len(own) > 2 * WINDOW for own in last):
            raise ValueError("curriculum: the state is of another suite, or damaged")
        self._last = last
