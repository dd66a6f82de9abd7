"""Conditions of a rule that compare a number with the turns that the frame has been in its state."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

CONDITIONS: Final[dict[str, Callable[[int, int], bool]]] = {
    "after": lambda turns, number: turns >= number,
    "before": lambda turns, number: turns < number,
}
"""Key -> whether it holds after so many turns, with its number."""
