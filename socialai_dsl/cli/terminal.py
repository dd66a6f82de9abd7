"""This module knows what a stream that is written to can show."""

import os
from typing import IO, Any


def shows_color(stream: IO[Any]) -> bool:
    """Whether to colour: a terminal that is not dumb, unless NO_COLOR is set to anything (no-color.org)."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
