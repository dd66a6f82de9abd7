"""Keys that stand one level too far left or right: moved to where they belong, and reported once."""

from __future__ import annotations

from typing import Any, get_args, get_origin

from pydantic import BaseModel

from socialai_dsl.diagnostics import DiagnosticBag, did_you_mean
from socialai_dsl.schema.annotations import CALLED, annotation_at, branches, keys_of, model_at
from socialai_dsl.schema.positions import DataPath, Positions
from socialai_dsl.schema.repair import MovedPlaces, Repaired, part_at

_BUILDING = "extends"
"""A key that is gone when the models see a file."""


def mend_indentation(
    model: type[BaseModel], repaired: Repaired, places: Positions, bag: DiagnosticBag
) -> None:
    """Move keys that are indented one level too little or too much; reports S101 once for keys that follow each other.

    Args:
        model: what the document should be.
        repaired: the document; changed.
        places: where its parts stand.
        bag: takes the findings.
    """
    _Mender(model, repaired, places, bag).mend(())


class _Mender:
    def __init__(
        self, model: type[BaseModel], repaired: Repaired, places: Positions, bag: DiagnosticBag
    ) -> None:
        self._model = model
        self._repaired = repaired
        self._places = MovedPlaces(places, repaired.moved)
        self._bag = bag

    def mend(self, path: DataPath) -> None:
        """Mend what stands at and below a path, the deepest first."""
        part = part_at(self._repaired.data, path)
        if isinstance(part, list):
            for i in range(len(part)):
                self.mend((*path, i))
        if not isinstance(part, dict):
            return
        for key in list(part):
            self.mend((*path, key))
        if self._places.in_flow((*path, next(iter(part), ""))):
            return
        self._indent(path, part)
        self._dedent(path, part)

    def _indent(self, path: DataPath, part: dict[str, Any]) -> None:
        """Move keys that belong into the entry above them."""
        above: str | None = None
        moving = False
        for key in list(part):
            if self._fits(path, key, part[key]):
                above, moving = key, False
            elif above is not None and self._takes((*path, above), part[above], key, part[key]):
                if not moving:
                    message = f"`{key}` belongs to `{above}`, but is not indented further than it"
                    self._report((*path, key), message, "indent it one level further")
                moving = True
                part[above] = {} if part[above] is None else part[above]
                self._repaired.move((*path, key), (*path, above, key))

    def _dedent(self, path: DataPath, part: dict[str, Any]) -> None:
        """Move keys that belong beside the entry that they stand in, or further out."""
        known = model_at(self._model, path)
        moving = False
        for key in list(part):
            home = None if self._fits(path, key, part[key]) else self._home(path, known, key, part[key])
            if home is None:
                moving = False
                continue
            if not moving:
                owner = model_at(self._model, home)
                where = CALLED[owner] if owner in CALLED else f"`{home[-1]}`"
                inside = f"`{path[-1]}`" if isinstance(path[-1], str) else "an item of a list"
                message = f"`{key}` stands in {inside}, but belongs to {where}"
                self._report((*path, key), message, "indent it less")
            moving = True
            self._repaired.move((*path, key), (*home, key))
            self.mend((*home, key))

    def _home(self, path: DataPath, known: type[BaseModel] | None, key: str, value: Any) -> DataPath | None:
        """The mapping further out that lacks a key which does not fit at `path`."""
        for length in range(len(path) - 1, -1, -1):
            outer = path[:length]
            around = part_at(self._repaired.data, outer)
            if not isinstance(around, dict) or key in around:
                continue
            owner = model_at(self._model, outer)
            if owner is not None and key in keys_of(owner) and (known is not None or _needs(owner, key)):
                return outer
            element = _element(annotation_at(self._model, outer))
            if owner is None and element is not None and element is known and _looks_like(value, element):
                return outer
        return None

    def _fits(self, path: DataPath, key: str, value: Any) -> bool:
        """Whether a key may stand where it stands, also if it is misspelt."""
        known = model_at(self._model, path)
        if known is not None:
            keys = [*keys_of(known), *([_BUILDING] if not path else [])]
            return key in keys or did_you_mean(key, keys) is not None
        element = _element(annotation_at(self._model, path))
        if element is None:
            return True
        return value == {} or _looks_like(value, element) or not self._is_word_of(path, element, key)

    def _is_word_of(self, path: DataPath, element: type[BaseModel], key: str) -> bool:
        """Whether a key is a word of what is in a mapping of names, or of what is around it."""
        owners = [element, *(model_at(self._model, path[:length]) for length in range(len(path)))]
        return any(owner is not None and key in keys_of(owner) for owner in owners)

    def _takes(self, above: DataPath, value: Any, key: str, given: Any) -> bool:
        """Whether the entry above can have the key."""
        if value is not None and (not isinstance(value, dict) or key in value or self._closed(above, value)):
            return False
        owner = model_at(self._model, above)
        if owner is not None:
            return key in keys_of(owner)
        annotation = annotation_at(self._model, above)
        if _names(annotation) is None:
            return False
        element = _element(annotation)
        return value is None if element is None else _looks_like(given, element)

    def _closed(self, path: DataPath, value: dict[str, Any]) -> bool:
        """Whether a mapping is written in braces, so that nothing on other lines can belong to it."""
        return not value or self._places.in_flow((*path, next(iter(value))))

    def _report(self, path: DataPath, message: str, hint: str) -> None:
        self._bag.error("S101", message, self._places.key_span(path), hint=hint)


def _names(annotation: Any) -> Any:
    """What a mapping of names holds; None for anything else."""
    return next((get_args(part)[1] for part in branches(annotation) if get_origin(part) is dict), None)


def _element(annotation: Any) -> type[BaseModel] | None:
    """The model of each entry of a mapping of names, if that is all an entry can be."""
    held = list(branches(_names(annotation)))
    return (
        held[0] if len(held) == 1 and isinstance(held[0], type) and issubclass(held[0], BaseModel) else None
    )


def _looks_like(value: Any, model: type[BaseModel]) -> bool:
    """Whether a mapping has keys of a model."""
    return isinstance(value, dict) and any(key in keys_of(model) for key in value)


def _needs(owner: type[BaseModel], key: str) -> bool:
    return any(
        (field.alias or name) == key and field.is_required() for name, field in owner.model_fields.items()
    )
