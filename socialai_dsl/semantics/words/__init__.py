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
    + ["speaker", "objects", "cast", "believes", "permuted"]
    + ["here", "it", "self", "t", "W", "H", "cells", "colors", "nouns", "toward", "random", "distinct", "ever"]
    + [FINISHED, *COLORS, *DIRECTIONS, *ACTIONS, *SIDES]
    + ["and", "or", "not", "in", "where", "to", "if", "else", "true", "false", "room", "agent"]
)  # fmt: skip
"""Words that mean something already, so that nothing an author declares may be called so."""

NAMES: Final = {
    "agent": "the agent, whom a policy, a language model or a person plays",
    "self": "in a frame: the member of the cast that follows it",
    "speaker": "in a rule with `hears`: the speaker of what was heard",
    "it": "each of a group in turn: in its conditions and initial values, and in the frame that its members follow",
    "here": "in the `where` of a place: the candidate cell",
    "t": "the number of steps since the reset",
    "W": "the width of the room in cells, walls included",
    "H": "the height of the room in cells, walls included",
    "objects": "the group of all objects",
    "cast": "the group of all members of the cast, the agent first",
    "cells": "the group of all floor cells of the room",
    "colors": "the group of the colours: red, green, blue, purple, yellow, grey",
    "nouns": "the group of the nouns of the grammar",
    "believes": "`n.believes.key`: the value of a belief of n",
    "permuted": "`permuted(table)`, `permuted(group)`: the same values in an order that each episode draws",
    "random": "as a colour, a direction or the start of a look: drawn, all alike",
    "distinct": "as a colour: drawn, no two of the group alike",
    "toward": "`toward(x)` in `facing`: the direction in which x lies",
    "ever": "in `for` of an entry of `steps`: without an end",
    "finished": "the state of a frame after its last entry of `steps`",
    "none": "nothing: of a register or belief that is empty, or a body action that is no movement",
    "if": "`a if condition else b`: a where the condition holds, else b",
    "else": "`a if condition else b`: a where the condition holds, else b",
}
"""Names that mean the same in every file, and what."""

WORDS: Final = Words(VALUES, QUANTIFIERS, RESERVED)
