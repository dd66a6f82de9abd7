"""How wide registers, constants and tokens are: the checks refuse files that need more, the verifier programs."""

from __future__ import annotations

from typing import Final

REGISTER: Final = "int32"
"""The type of a register."""

UNPINNED: Final = -(1 << (int(REGISTER.removeprefix("int")) - 1))
"""In a row of pins: no layout gives this register. No register ever holds it."""

WHOLE_REGISTER: Final = (UNPINNED + 1, -UNPINNED - 1)
"""What a register can hold."""

LARGEST_NUMBER: Final = 1_000_000_000
"""Greatest magnitude of a number that is kept from one step to the next, paid, or a constant of an instruction.

A register holds more than twice that: there is room for a value that stands for nothing, and a sum of two fits.
"""

TOKEN: Final = "int16"
"""The type of the number of a word in the observation."""

UNSPOKEN: Final = ("<pad>", "<unk>")
"""The first words of every vocabulary: padding, and a word that is unknown."""

MOST_WORDS: Final = 1 << (int(TOKEN.removeprefix("int")) - 1)
"""How many words a vocabulary can have, those two among them."""

MOST_SEATS: Final = 8
"""How many members of a cast players can play."""
