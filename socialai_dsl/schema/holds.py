"""What a key holds, said once: on its field in the model, or on the type of the field."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

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


def said_of(annotation: Any) -> Holds | None:
    """What a type says that it holds: the outermost word, of a union the first; None if it says nothing."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        own = [word for word in annotation.__metadata__ if isinstance(word, Holds)]
        return own[-1] if own else said_of(arguments[0])
    if origin in (Union, UnionType):
        return next(filter(None, map(said_of, arguments)), None)
    return said_of(arguments[0]) if origin in (tuple, list) else None
