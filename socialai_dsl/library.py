"""The prelude: object types and utterance grammars that every scenario can use."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from socialai_dsl.loader.reader import read_document
from socialai_dsl.schema.library import GrammarLibrary, ObjectLibrary, ObjectTypeModel
from socialai_dsl.semantics.entities import Prelude
from socialai_dsl.semantics.terms import COLOR, ObjectType
from socialai_dsl.source import Data

_FOLDER = Path(__file__).parent / "prelude"


def compiled(name: str, model: ObjectTypeModel) -> ObjectType:
    """The type with statuses as numbers."""
    number = model.states.index
    return ObjectType(
        name=name,
        code=model.code,
        states=model.states,
        initial=number(model.initial) if model.initial else 0,
        walkable=frozenset(map(number, model.walkable)),
        transparent=frozenset(map(number, model.transparent)),
        toggled={number(before): number(after) for before, after in model.toggled.items()},
        deadly=model.deadly,
        color=COLOR.words.index(model.color) if model.color in COLOR.words else 0,
        active=frozenset(map(number, model.active)),
        pushed={number(before): number(after) for before, after in model.pushed.items()},
        rolls=frozenset(map(number, model.rolls)),
        expired={number(before): number(after) for before, after in model.expired.items()},
        shown={number(status): channels for status, channels in model.shown.items()},
        look=model.look or name,
        letters=model.letters,
        mark=model.mark,
    )


@cache
def prelude() -> Prelude:
    """The object types that come with the language."""
    library = ObjectLibrary.model_validate(read_document(_FOLDER / "objects.yaml").data)
    return Prelude(
        {name: compiled(name, model) for name, model in library.types.items()},
        {name: model.color for name, model in library.types.items()},
    )


@cache
def types_by_code() -> dict[int, ObjectType]:
    """The object types by their number in the type channel."""
    return {type_.code: type_ for type_ in prelude().types.values()}


@cache
def shared_grammars() -> dict[str, Data]:
    """The grammars that a scenario can name, as plain data."""
    document = read_document(_FOLDER / "grammars.yaml")
    GrammarLibrary.model_validate(document.data)
    return {str(name): grammar.data for name, grammar in document.at(("grammars",)).items()}
