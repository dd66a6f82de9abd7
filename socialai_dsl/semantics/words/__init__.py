"""The table of the language's words: each is a row with its arguments, its line in the reference and its meaning.

A word is named in its row, and nowhere else on the way from a file to a term: resolution, suggestions, completion and
the reference are general cases over the table. What a term of a new kind needs beyond it, `docs/contributing.md` says.
"""

from __future__ import annotations

from typing import Final

from socialai_dsl.semantics.signatures import Signature, Words
from socialai_dsl.semantics.words import (
    activities,
    attributes,
    effects,
    functions,
    happenings,
    places,
    relations,
)
from socialai_dsl.vocabulary import ACTIONS, COLORS, DIRECTIONS, FINISHED, SIDES

_VALUES: Final = (
    *relations.RELATIONS,
    *happenings.HAPPENINGS,
    *attributes.ATTRIBUTES,
    *functions.FUNCTIONS,
    *functions.QUANTIFIERS,
)

SIGNATURES: Final[tuple[Signature, ...]] = (
    *_VALUES,
    *places.PLACES,
    *activities.ACTIVITIES,
    *effects.EFFECTS,
)
"""All words, in the order of the reference."""

VALUES: Final = {word.name: word for word in _VALUES}
PLACES: Final = {word.name: word for word in places.PLACES}
ACTIVITIES: Final = {word.name: word for word in activities.ACTIVITIES}
EFFECTS: Final = {word.name: word for word in effects.EFFECTS}
QUANTIFIERS: Final = frozenset(word.name for word in functions.QUANTIFIERS)

SYNONYMS: Final = {other: word.name for word in activities.ACTIVITIES for other in word.also}
"""What authors write for an activity -> what it is called here."""

VALUE_SYNONYMS: Final = {other: word.name for word in _VALUES for other in word.also}
"""What authors write for a condition or value -> what it is called here."""

RESERVED: Final = frozenset(
    [word.name for word in SIGNATURES if word.name not in ("name", "kind", "index", "cell")]
    + ["speaker", "objects", "believes", "permuted"]
    + ["here", "it", "self", "t", "W", "H", "cells", "colors", "nouns", "toward", "random", "distinct", "ever"]
    + [FINISHED, *COLORS, *DIRECTIONS, *ACTIONS, *SIDES]
    + ["and", "or", "not", "in", "where", "to", "if", "else", "true", "false", "room", "agent"]
)  # fmt: skip
"""Words that mean something already, so that nothing an author declares may be called so."""

WORDS: Final = Words(VALUES, QUANTIFIERS, RESERVED)
