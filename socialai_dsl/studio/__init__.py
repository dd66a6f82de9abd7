"""The studio: scenarios are written, seen and played in a browser. `server` is what it talks to."""

from typing import Final

MOST_WINDOWS: Final = 32
"""How many windows may be open at once, unless the command says otherwise."""

FIRST_PORT: Final = 8765
"""The first port that is tried where none is asked for."""
