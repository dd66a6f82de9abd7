"""The page's own words in each of its languages; what a study says itself stands in its file."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path


@cache
def words_of(language: str) -> dict[str, str]:
    """Name of a text -> the text, in `en`, `de` or `fr`."""
    found: dict[str, str] = json.loads(Path(__file__).with_name("words.json").read_text(encoding="utf-8"))[
        language
    ]
    return found
