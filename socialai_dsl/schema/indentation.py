"""Keys that stand one level too far left or right: moved to where they belong, and reported once."""

from __future__ import annotations

from typing import Any, get_args, get_origin

from pydantic import BaseModel

from socialai_dsl.diagnostics import DiagnosticBag, did_you_mean
from socialai_dsl.schema.annotations import CALLED, annotation_at, branches, keys_of, model_at
from socialai_dsl.schema.repair import MovedPlaces, Repaired, part_at
from socialai_dsl.source import DataPath, Positions

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
        self._quiet = False

    def mend(self, path: DataPath) -> None:
        """Mend what stands at and below a path, the outermost first."""
        part = part_at(self._repaired.data, path)
        if isinstance(part, list):
            for i in range(len(part)):
                self.mend((*path, i))
        if not isinstance(part, dict) or self._places.in_flow((*path, next(iter(part), ""))):
            return
        self._indent(path, part)
        self._dedent(path, part)
        for key in list(part):
            if key in part:
                self.mend((*path, key))

    def _indent(self, path: DataPath, part: dict[str, Any]) -> None:
        """Move keys that belong into the entry above them."""
        above: str | None = None
        moving = False
        for key in list(part):
            emptied = above is not None and part[above] is None and key in self._words_of((*path, above))
            if self._fits(path, key, part[key]) and not emptied:
                above, moving = key, False
            elif above is not None and self._takes((*path, above), part[above], key, part[key]):
                if not moving:
                    message = f"`{key}` belongs to `{above}`, but is not indented further than it"
                    self._report((*path, key), message, "indent it one level further")
                moving = True
                part[above] = {} if part[above] is None else part[above]
                self._move((*path, key), (*path, above, key))

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
            self._move((*path, key), (*home, key))

    def _move(self, path: DataPath, to: DataPath) -> None:
        """Move an entry; what stands wrong in it does so for the same reason."""
        self._repaired.move(path, to)
        quiet, self._quiet = self._quiet, True
        self.mend(to)
        self._quiet = quiet

    def _home(self, path: DataPath, known: type[BaseModel] | None, key: str, value: Any) -> DataPath | None:
        """The mapping further out that lacks a key which does not fit at `path`."""
        for length in range(len(path) - 1, -1, -1):
            outer = path[:length]
            around = part_at(self._repaired.data, outer)
            if not isinstance(around, dict) or key in around:
                continue
            owner = model_at(self._model, outer)
            if owner is not None and key in keys_of(owner):
                return outer
            elements = _elements(annotation_at(self._model, outer))
            if owner is None and known in elements and (value == {} or _looks_like(value, elements)):
                return outer
        return None

    def _fits(self, path: DataPath, key: str, value: Any) -> bool:
        """Whether a key may stand where it stands, also if it is misspelt."""
        known = model_at(self._model, path)
        if known is not None:
            keys = [*keys_of(known), *([_BUILDING] if not path else [])]
            return key in keys or did_you_mean(key, keys) is not None
        annotation = annotation_at(self._model, path)
        elements = _elements(annotation)
        held = _held(annotation)
        if value == {} or _looks_like(value, elements) or any(get_origin(part) is dict for part in held):
            return True
        if not isinstance(value, dict | list) and len(elements) < len(held):
            return True  # an expression, say
        return not held or not self._is_word_of(path, elements, key)

    def _is_word_of(self, path: DataPath, elements: list[type[BaseModel]], key: str) -> bool:
        """Whether a key is a word of what is in a mapping of names, or of what is around it."""
        owners = [*elements, *(model_at(self._model, path[:length]) for length in range(len(path)))]
        return any(owner is not None and key in keys_of(owner) for owner in owners)

    def _words_of(self, path: DataPath) -> list[str]:
        """The keys of the model at a path, if there is one."""
        owner = model_at(self._model, path)
        return keys_of(owner) if owner is not None else []

    def _takes(self, above: DataPath, value: Any, key: str, given: Any) -> bool:
        """Whether the entry above can have the key."""
        if value is not None and (not isinstance(value, dict) or key in value or self._closed(above, value)):
            return False
        owner = model_at(self._model, above)
        if owner is not None:
            return key in keys_of(owner)
        annotation = annotation_at(self._model, above)
        return _looks_like(given, _elements(annotation)) or (value is None and bool(_held(annotation)))

    def _closed(self, path: DataPath, value: dict[str, Any]) -> bool:
        """Whether a mapping is written in braces, so that nothing on other lines can belong to it."""
        return not value or self._places.in_flow((*path, next(iter(value))))

    def _report(self, path: DataPath, message: str, hint: str) -> None:
        if not self._quiet:
            self._bag.error("S101", message, self._places.key_span(path), hint=hint)


def _held(annotation: Any) -> list[Any]:
    """What an entry of a mapping of names can be; nothing for anything else."""
    names = (get_args(part)[1] for part in branches(annotation) if get_origin(part) is dict)
    return [held for entry in names for held in branches(entry)]


def _elements(annotation: Any) -> list[type[BaseModel]]:
    """The models that an entry of a mapping of names can be."""
    return [held for held in _held(annotation) if isinstance(held, type) and issubclass(held, BaseModel)]


def _looks_like(value: Any, models: list[type[BaseModel]]) -> bool:
    """Whether a mapping has keys of one of some models."""
    return isinstance(value, dict) and any(key in keys_of(model) for model in models for key in value)
