"""The words of the language with their numbers, and the normalisation of texts: the one home of both.

A word's number is its place: `COLORS[2]` is `blue`, and 2 in registers and in the colour channel of the picture.
"""

from __future__ import annotations

import re
from typing import Final, Literal, get_args

COLORS: Final = ("red", "green", "blue", "purple", "yellow", "grey")
DIRECTIONS: Final = ("right", "down", "left", "up")
TURNS: Final = ("left", "none", "right")
SIDES: Final = ("top", "bottom", "left", "right")

Primitive = Literal["left", "right", "forward", "pickup", "drop", "toggle", "done"]
PRIMITIVES: Final[tuple[Primitive, ...]] = get_args(Primitive)
"""The agent's body actions."""
ACTIONS: Final = (*PRIMITIVES, "none")
TURN_WORDS: Final = (*ACTIONS, "point", "stop pointing")
"""What an NPC may do in a turn."""

UNSEEN, EMPTY, WALL, NPC = 0, 1, 2, 11
"""Codes of the type channel that no object type of the prelude has, but for walls, which rooms are made of."""

FINISHED: Final = "finished"
"""The state of a frame whose `steps` are over."""

TRUTHS: Final = ("no", "yes")
"""How a truth value is answered."""

_WORD: Final = re.compile(r"(?:[^\W_]|')+")


def normal(text: str) -> str:
    """A text as hearing compares it: without case, a final `.`, `!` or `?`, and how many blanks there are."""
    return " ".join(text.casefold().strip().rstrip(".!?").split())


def words(text: str) -> list[str]:
    """The lower-cased maximal runs of letters, digits and apostrophes."""
    return _WORD.findall(text.lower())


def is_plain(text: str, marks: str = "'-.") -> bool:
    """Whether a text is words alone: letters and digits, with blanks and these marks around them."""
    return "".join(text.translate(dict.fromkeys(map(ord, marks))).split()).isalnum()


def is_number(word: str) -> bool:
    """Whether a word is a whole number."""
    return word.removeprefix("-").isdecimal()
