"""What a key holds, said once: on its field in the model, or on the type of the field."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

Kind = Literal[
    # texts
    "text", "told", "prose", "state", "label", "utterance",
    # the language
    "expression", "interval", "activity", "effect", "place", "value",
    # names
    "new name", "name", "file",
    # tests
    "act", "heard", "ending",
    # mappings whose keys are no keys of a model
    "patch", "layout",
    # what the annotation itself says
    "word", "number", "truth", "section", "spelt",
]  # fmt: skip
"""Kinds of values.

Texts: `text` is said, heard or read, with values in < >; `told` is read by players as it stands; `prose` is for people,
and `null` is none; `state` names a state of a frame or the status of an object; `label` is what people call a condition
or a parameter's value; an `utterance` is waited for.

The language: `expression`, of which an `interval` is one of the form a..b; an `activity`, `effect` or `place` is an
expression in words of its own; `value` is a plain value.

Names: a `new name` is declared there; `name` is one of the sections in `of`; `file` names a file.

Tests: an `act` is what is typed, `heard` what is heard, `ending` how the episode ends.

Mappings: `patch` goes from paths in a scenario to values, `layout` is in the words of layouts.

What the annotation says: `word` is one of a few, `section` a mapping, `spelt` a text of a form of its own.
"""

TEXTS: frozenset[Kind] = frozenset({"text", "told", "prose", "state", "label", "utterance", "act", "heard"})
"""Kinds of which nothing but a text can stand there, whatever YAML takes a plain word for."""


Said = TypeVar("Said")


@dataclass(frozen=True)
class Holds:
    """What a key holds.

    Attributes:
        kind: what it is.
        of: of a name, the sections that declare it; of `types` the library of object types, of `grammars` that of
            grammars does.
        beside: of a text, kinds of plain values that stay what they are beside texts.
    """

    kind: Kind
    of: tuple[str, ...] = ()
    beside: tuple[type, ...] = ()

    @property
    def is_alone(self) -> bool:
        """Whether no other part of a file depends on what is written there."""
        return self.kind in _ALONE


_ALONE = frozenset[Kind](
    {"prose", "told", "label", "new name", "activity", "spelt", "word", "number", "truth"}
)


@dataclass(frozen=True)
class Means:
    """What a key of a rule asks for: a condition in the language, in which the key stands for its value, a number."""

    condition: str


@dataclass(frozen=True)
class Hides:
    """Whether a mistake in a value may make other parts look wrong, where its kind says something else."""

    others: bool


def branches(annotation: Any) -> Iterator[Any]:
    """The branches of a union, without annotations around them."""
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from branches(get_args(annotation)[0])
    elif origin in (Union, UnionType):
        for branch in get_args(annotation):
            yield from branches(branch)
    else:
        yield annotation


def said_of(annotation: Any, word: type[Said]) -> Said | None:
    """What a type says in a word: the outermost, of a union the first; None if it says nothing."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        own = [said for said in annotation.__metadata__ if isinstance(said, word)]
        return own[-1] if own else said_of(arguments[0], word)
    if origin in (Union, UnionType):
        return next((said for part in arguments if (said := said_of(part, word)) is not None), None)
    return said_of(arguments[0], word) if origin in (tuple, list) else None
