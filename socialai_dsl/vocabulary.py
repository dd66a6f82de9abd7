"""The words of the language with their numbers, the normalisation of texts, and the sentences of an agent.

A word's number is its place: `COLORS[2]` is `blue`, and 2 in registers and in the colour channel of the picture.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product, takewhile
from math import prod
from typing import Final, Literal, get_args

COLORS: Final = ("red", "green", "blue", "purple", "yellow", "grey")
DIRECTIONS: Final = ("right", "down", "left", "up")
TURNS: Final = ("left", "none", "right")

Side = Literal["top", "bottom", "left", "right"]
SIDES: Final[tuple[Side, ...]] = get_args(Side)
"""The walls of a room."""

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

YOU: Final = "You"
"""How texts and pages call whoever reads them, also before the lines that are its own."""
SURFACES: Final = ("wall", "fence", "lava", "floor", "platform")
"""What usually covers many cells, which texts tell of by its extent."""
OUT_OF_SIGHT: Final = "cells out of sight"
_OWN_WORDS: Final = re.compile(
    # What is seen, heard and told: `You see:`, `Your reply was not understood:`, `2 steps ahead: ...`, `a wall: ...`.
    rf"you\b|your reply\b|\d+ steps?\b|an? (?:.* )?(?:{'|'.join(SURFACES)})\Z|{OUT_OF_SIGHT}\Z"
    # Questions, and what marks a reply: `A question, apart from your turns:`, `Act: left`.
    r"|a question\b|the answer is one of\Z|answer\Z|act(?:ion)?\Z"
)
"""What stands before a colon in texts for language models, beside the names of who speaks."""
_WORD: Final = re.compile(r"[a-z0-9']+")
_FINAL: Final = ".!?\u3002"
"""Marks that may end a sentence, the ideographic full stop among them; wide forms of the others are folded."""

_UNSPACED: Final = re.compile(
    "[\u0e00-\u0eff\u1000-\u109f\ua9e0-\ua9ff\uaa60-\uaa7f\u1780-\u17ff\u3041-\u30ff\u31f0-\u31ff\U0001b000-\U0001b16f"
    "\u3005-\u3007\u3021-\u3029\u3038-\u303b\u3400-\u4dbf\u4e00-\u9fff\uf900-\ufaff\U00020000-\U0003ffff]"
)
"""Letters of scripts that put no blanks between words: Thai, Lao, Myanmar, Khmer, Hiragana, Katakana, Han."""

_LETTERS: Final = "'\u0345"
"""What counts as a letter beside letters and digits; the latter is a mark that becomes a letter without case."""


def composed(text: str) -> str:
    """A text as it looks: its letters composed and in plain forms (NFKC), without what cannot be seen."""
    if text.isascii():
        return text
    return "".join(c for c in unicodedata.normalize("NFKC", text) if not _is_unseen(c)).replace("\u2019", "'")


def folded(text: str) -> str:
    """A text as it is compared: as it looks, without case."""
    return text.lower() if text.isascii() else composed(composed(text).casefold())


def _is_unseen(character: str) -> bool:
    """Whether a character only tells how others are to be shown: joiners, soft hyphens, directions, selectors."""
    return unicodedata.category(character) == "Cf" or "\ufe00" <= character <= "\ufe0f"


def normal(text: str) -> str:
    """A text as hearing compares it: folded, without final full stops, `!` or `?`, and how many blanks there are."""
    text = " ".join(folded(text).split())
    return text.rstrip(_FINAL).rstrip() or text


def is_own_word(name: str) -> bool:
    """Whether a line of somebody so called, `NAME: text`, reads as one of what language models are told themselves."""
    return _OWN_WORDS.match(" ".join(folded(name).split())) is not None


def first_alike(text: str, known: dict[str, str]) -> str | None:
    """The first of the known texts that is heard as this one, which is known from now on; None if there is none."""
    first = known.setdefault(normal(text), text)
    return None if first is text else first


def words(text: str) -> list[str]:
    """The folded maximal runs of letters, digits and apostrophes; each letter of a script without blanks by itself."""
    text = folded(text)
    return _WORD.findall(text) if text.isascii() else [piece for piece in _cut(text) if _is_letter(piece[0])]


def pieces(text: str) -> list[str]:
    """The text as it looks, cut into its words as they are spelt, its other marks one by one, and single blanks."""
    return _cut(" ".join(composed(text).split()))


def telling_pieces(texts: Iterable[str]) -> list[str]:
    """The pieces that tell texts apart which have the same words, in the order in which they appear.

    Of the texts with the same words these are the pieces between what all of them begin and end with. So two texts that
    do not look alike, blanks aside, have different `tokens`.
    """
    alike: dict[tuple[str, ...], list[str]] = {}
    for text in dict.fromkeys(texts):
        alike.setdefault(tuple(words(text)), []).append(text)
    found: dict[str, None] = {}
    for group in (list(map(pieces, some)) for some in alike.values() if len(some) > 1):
        begun = _shared(group)
        rest = [one[begun:] for one in group]
        ended = _shared([one[::-1] for one in rest])
        found |= dict.fromkeys(piece for one in rest for piece in one[: len(one) - ended])
    return list(found)


def tokens(text: str, telling: Container[str]) -> list[str]:
    """The words of a text, the `telling` pieces among them as they are written."""
    return [token for piece in pieces(text) for token in ([piece] if piece in telling else words(piece))]


def mark_of(speaker: str | None) -> str:
    """What a marked line begins with: whose line it is, None where names are hidden. No word of a text looks so."""
    return f"<{'line' if speaker is None else speaker}>"


def _shared(rows: Iterable[Sequence[str]]) -> int:
    """How many entries all rows begin with."""
    columns = (set(column) for column in zip(*rows, strict=False))
    return sum(1 for _ in takewhile(lambda column: len(column) == 1, columns))


def _cut(text: str) -> list[str]:
    found: list[str] = []
    open_ = False
    for character in text:
        letter = _is_letter(character)
        mark = not letter and unicodedata.category(character)[0] == "M"
        if open_ and (
            mark or (letter and not _UNSPACED.match(character) and not _UNSPACED.match(found[-1][0]))
        ):
            found[-1] += character
        else:
            found.append(character)
        open_ = letter or (open_ and mark)
    return found


def _is_letter(character: str) -> bool:
    return character.isalnum() or character in _LETTERS


def spelt(value: object) -> str:
    """A plain value as YAML and people write it."""
    if value is None:
        return "nothing"
    return str(value).lower() if isinstance(value, bool) else str(value)


def is_plain(text: str, marks: str = "'-.") -> bool:
    """Whether a text is words alone: letters and digits, with blanks and these marks around them."""
    return "".join(text.translate(dict.fromkeys(map(ord, marks))).split()).isalnum()


def is_number(word: str) -> bool:
    """Whether a word is a whole number."""
    return word.removeprefix("-").isdecimal()


# -- what an agent can say -----------------------------------------------------------------------------------


NOUN: Final = "noun"
"""The slot of a grammar that has `nouns`, and no other."""


@dataclass(frozen=True, slots=True)
class Slot:
    """What can stand in place of `<name>` in a template."""

    name: str
    words: tuple[str, ...]

    @property
    def place(self) -> str:
        """How templates write it."""
        return f"<{self.name}>"


@dataclass(frozen=True)
class Sentences:
    """Everything that can be said: templates, and what stands in their slots.

    Choices are indices into the words of each slot. A filling is one number for all of them, with a digit for each
    slot, the last slot's the least; the digit of a slot that a template lacks is one more than its last word's. Of a
    grammar with `nouns`, all of whose templates have `<noun>`, the filling is the noun.

    Attributes:
        templates: each with its slots. slots: in the order of the heads.
        used: for each template, whether it takes notice of each slot.
    """

    templates: tuple[str, ...]
    slots: tuple[Slot, ...]
    used: tuple[tuple[bool, ...], ...]

    @classmethod
    def of(cls, templates: Sequence[str], slots: Sequence[Slot]) -> Sentences:
        """The sentences of a grammar."""
        used = (tuple(slot.place in template for slot in slots) for template in templates)
        return cls(tuple(templates), tuple(slots), tuple(used))

    @classmethod
    def shared(
        cls,
        templates: Sequence[str],
        slots: Sequence[Slot],
        parts: Sequence[tuple[Sentences, Sequence[int]]],
    ) -> Sentences:
        """The sentences of several grammars: a template takes notice of a slot if it does so in one of them.

        Args:
            templates: of all of them.
            slots: of all of them.
            parts: each grammar with its own index of each template, -1 if it has no such.
        """
        used = []
        for place in range(len(templates)):
            names = {
                slot.name
                for own, template_map in parts
                if template_map[place] >= 0
                for slot, is_used in zip(own.slots, own.used[template_map[place]], strict=True)
                if is_used
            }
            used.append(tuple(slot.name in names for slot in slots))
        return cls(tuple(templates), tuple(slots), tuple(used))

    def text(self, template: int, choices: Sequence[int]) -> str:
        """A sentence; the choice for a slot that the template lacks does not count."""
        text = self.templates[template]
        for slot, choice in zip(self.slots, choices, strict=True):
            text = text.replace(slot.place, slot.words[choice])
        return text

    def each(self) -> Iterator[tuple[int, tuple[int, ...]]]:
        """Every template with all choices for its slots, 0 for the others."""
        for template, used in enumerate(self.used):
            ranges = (
                range(len(slot.words) if is_used else 1)
                for slot, is_used in zip(self.slots, used, strict=True)
            )
            for choices in product(*ranges):
                yield template, choices

    @property
    def nouns(self) -> tuple[str, ...]:
        """What `<noun>` can be; nothing of a grammar with other slots alone."""
        return next((slot.words for slot in self.slots if slot.name == NOUN), ())

    @cached_property
    def radices(self) -> tuple[int, ...]:
        """How many digits each slot has in a filling."""
        everywhere = (all(used[place] for used in self.used) for place in range(len(self.slots)))
        return tuple(
            len(slot.words) + (slot.name != NOUN or not in_all)
            for slot, in_all in zip(self.slots, everywhere, strict=True)
        )

    @cached_property
    def strides(self) -> tuple[int, ...]:
        """What the digit of each slot counts in a filling."""
        return tuple(prod(self.radices[i + 1 :]) for i in range(len(self.radices)))

    @property
    def fillings(self) -> int:
        """How many fillings there are."""
        return prod(self.radices)

    def filling(self, choices: Sequence[int | None]) -> int:
        """The number of some choices; None is a slot that the template lacks."""
        digits = (
            len(slot.words) if choice is None else choice
            for slot, choice in zip(self.slots, choices, strict=True)
        )
        return sum(digit * stride for digit, stride in zip(digits, self.strides, strict=True))

    def choices(self, filling: int) -> tuple[int | None, ...]:
        """The choices of a filling, None for a slot that the template lacks; of -1, which is silence, None for all."""
        digits = (filling // stride % radix for stride, radix in zip(self.strides, self.radices, strict=True))
        return tuple(
            digit if filling >= 0 and digit < len(slot.words) else None
            for digit, slot in zip(digits, self.slots, strict=True)
        )

    def both(self, filling: int, other: int) -> int:
        """What two fillings of one text say together; where they differ, what the other says."""
        found = zip(self.choices(filling), self.choices(other), strict=True)
        return self.filling([a if b is None else b for a, b in found])

    def pairs(self) -> Iterator[tuple[int, int]]:
        """Template and filling of every sentence, in the order of `each`."""
        for template, choices in self.each():
            used = self.used[template]
            yield (
                template,
                self.filling([c if is_used else None for c, is_used in zip(choices, used, strict=True)]),
            )

    def said(self, template: int, filling: int) -> str | None:
        """The sentence of a template and a filling; None where the filling is not one of the template's."""
        choices = self.choices(filling)
        if tuple(choice is not None for choice in choices) != self.used[template]:
            return None
        return self.text(template, [choice or 0 for choice in choices])

    def heads(self, template: int, filling: int) -> tuple[int, ...]:
        """A sentence as the last heads of an action: template, then a word for each slot, 0 for those it lacks."""
        return template, *(choice or 0 for choice in self.choices(filling))

    def by_number(self) -> tuple[str, ...]:
        """The sentence of each template and filling, row by row; empty where the two do not go together."""
        numbers = product(range(len(self.templates)), range(self.fillings))
        return tuple(self.said(template, filling) or "" for template, filling in numbers)
