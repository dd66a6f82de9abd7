"""What counts of a text: how texts are compared, and which words they have."""

from __future__ import annotations

import re
from typing import Final

_WORD: Final = re.compile(r"(?:[^\W_]|')+")


def normal(text: str) -> str:
    """A text as hearing compares it: without case, a final `.`, `!` or `?`, and how many blanks there are."""
    return " ".join(text.casefold().strip().rstrip(".!?").split())


def words(text: str) -> list[str]:
    """The lower-cased maximal runs of letters, digits and apostrophes."""
    return _WORD.findall(text.lower())
