"""How much of an episode a model is shown: all of it, unless a limit is set."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

WHOLE: Final = None
"""No limit: the default of every way in which a model plays."""


def left_out(earlier: Sequence[str], history: int | None = WHOLE) -> tuple[int, str]:
    """How many of the earlier observations a request leaves out, and what says so in front of the first that it holds.

    Args:
        earlier: the observations before the present one, oldest first.
        history: how many a request holds, the present one included; None: all.

    Raises:
        ValueError: the limit is below 1.
    """
    if history is WHOLE:
        return 0, ""
    if history < 1:
        raise ValueError(
            f"history: got {history}, expected a number of observations from 1 on, or None for all"
        )
    count = max(0, len(earlier) - history + 1)
    lines = sum(text.count("\n") + 1 for text in earlier[:count])
    turns = "1 earlier turn is" if count == 1 else f"{count} earlier turns are"
    return count, f"({turns} left out here, {lines} lines of what you saw and heard.)\n\n" if count else ""
