"""Data to models, and what pydantic finds wrong with it in words for authors, at the place in the file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from socialai_dsl.diagnostics import DiagnosticBag, did_you_mean
from socialai_dsl.schema.annotations import (
    CALLED,
    annotation_at,
    expectation,
    home_of,
    keys_of,
    literals,
    model_at,
)
from socialai_dsl.schema.behaviour import Npc, Ranged, State, ThenRule
from socialai_dsl.schema.indentation import mend_indentation
from socialai_dsl.schema.repair import MovedPlaces, Repaired, copied, fill_gaps, part_at
from socialai_dsl.schema.scenario import Scenario
from socialai_dsl.source import DataPath, Positions, Span

M = TypeVar("M", bound=BaseModel)


@dataclass(frozen=True)
class Shaped(Generic[M]):
    """A document as models.

    Attributes:
        model: None if not even the rest of the file can be used.
        data: the document the model was made from, with mistakes of shape repaired.
        places: where its parts stand.
        lost: whether something was left out that other parts of the file may name.
    """

    model: M | None
    data: Any
    places: Positions
    lost: bool


def model_of(
    model: type[M],
    data: object,
    places: Positions,
    bag: DiagnosticBag,
    *,
    partial: bool = False,
    parameters: bool = True,
) -> Shaped[M]:
    """The model of a document; `bag` says what is wrong with its shape.

    After mistakes that leave no doubt the model is made of what was meant, so that the rest can be checked.

    Args:
        model: what it should be.
        data: plain data of a document.
        places: where its parts stand.
        bag: takes the findings.
        partial: missing keys are fine, as in a base that others build on; the model is then None.
        parameters: `$name` that is left may stand for anything: that there is no such parameter has been said, or a
            scenario will give it.
    """
    repaired = Repaired(copied(data))
    known = len(bag)
    made = _tried(model, repaired.data)
    if made is None:
        mend_indentation(model, repaired, places, bag)
    found: Positions = MovedPlaces(places, repaired.moved)
    fill_gaps(repaired, found, bag)
    if made is not None and len(bag) == known:
        return Shaped(made, repaired.data, places, False)
    try:
        made = _made(model, repaired.data)
    except ValidationError as error:
        _Report(model, repaired, found, bag, partial, parameters).add_all(error)
        made = _tried(model, repaired.data)
    lost = any(_matters(path) for path in repaired.lost)
    kept = found if repaired.moved else places
    return Shaped(made, repaired.data, kept, lost)


def _made(model: type[M], data: object) -> M:
    """The model of data; a field that has an alias (`for`, `with`) is known by that alone."""
    return model.model_validate(data, by_alias=True, by_name=False)


def _tried(model: type[M], data: object) -> M | None:
    """The model of data; None if the data has mistakes."""
    with suppress(ValidationError):
        return _made(model, data)
    return None


_INDIFFERENT: Final = frozenset(
    "about notes skills horizon earshot view kind kind_code audible color facing reward id after chance once npcs "
    "image names own_voice canvas actions do".split()
)
"""Keys whose loss makes nothing else in the file wrong."""

_BUILDING: Final = (Scenario, Npc)
"""What can build on another file."""

PARAMETER: Final = re.compile(r"\$[A-Za-z_]\w*")
"""A parameter that is a whole value; known ones of scenarios have been put in before."""


def _matters(path: DataPath) -> bool:
    return str(path[-1]) not in _INDIFFERENT


@dataclass(frozen=True)
class _Finding:
    """One of pydantic's errors with its place in the data."""

    path: DataPath
    kind: str
    value: object
    context: Mapping[str, Any]
    about_key: bool


class _Report:
    """Words one validation's errors."""

    def __init__(
        self,
        model: type[BaseModel],
        repaired: Repaired,
        places: Positions,
        bag: DiagnosticBag,
        partial: bool,
        parameters: bool,
    ) -> None:
        self._model = model
        self._repaired = repaired
        self._data = copied(repaired.data)
        self._places = places
        self._bag = bag
        self._partial = partial
        self._parameters = parameters
        self._extra: dict[DataPath, list[str]] = {}

    def add_all(self, error: ValidationError) -> None:
        """Report everything, one finding for each place."""
        found = [self._placed(e) for e in error.errors(include_url=False)]
        by_path: dict[tuple[DataPath, bool], list[_Finding]] = {}
        for finding in found:
            by_path.setdefault((finding.path, finding.about_key), []).append(finding)
            if finding.kind == "extra_forbidden":
                self._extra.setdefault(finding.path[:-1], []).append(str(finding.path[-1]))
        deeper = {finding.path[:i] for finding in found for i in range(len(finding.path))}
        for (path, about_key), findings in by_path.items():
            if path in deeper and isinstance(findings[0].value, dict) and not about_key:
                continue  # a mapping was meant, and the findings in it say what is wrong with it
            if path in deeper and all(_counts_only_right_items(finding) for finding in findings):
                continue
            self._add(findings)

    def _placed(self, error: Any) -> _Finding:
        """The error at a path that exists: names of union branches are no part of the file."""
        path: list[str | int] = []
        part: Any = self._data
        location = list(error["loc"])
        about_key = location[-1:] == ["[key]"]
        if about_key:
            location.pop()
        missing = location.pop() if error["type"] == "missing" else None
        for step in location:
            if _has(part, step):
                part = part[step]
                path.append(step)
        if missing is not None:
            path.append(missing)
        return _Finding(tuple(path), error["type"], part, error.get("ctx", {}), about_key)

    def _add(self, findings: list[_Finding]) -> None:
        first = findings[0]
        if first.kind == "extra_forbidden":
            self._unknown_key(first)
        elif first.kind == "missing":
            self._missing_key(first)
        elif first.about_key:
            self._bad_name(first)
        else:
            self._wrong_value(findings)
            self._repaired.leave_out(first.path)

    # -- keys ------------------------------------------------------------------------------------------------

    def _unknown_key(self, finding: _Finding) -> None:
        key = str(finding.path[-1])
        span = self._places.key_span(finding.path)
        owner = model_at(self._model, finding.path[:-1])
        known = keys_of(owner) if owner is not None else []
        if owner in _BUILDING:
            known = [*known, "extends"]  # which is gone when the models see a file
        called = CALLED.get(owner, "this mapping") if owner is not None else "this mapping"
        if owner is ThenRule and key == "do":
            message = "the body has already moved when `then` is read: put `do` in the state or in `first`"
            self._bag.error("S307", message, span)
            near = None
        else:
            near = did_you_mean(key, known)
            if near is None and owner is Ranged:
                near = self._left_over(finding.path[:-1], key, known)
            self._unknown_word(key, owner, called, known, near, span)
        if owner is Ranged and near == "range" and ".." not in str(finding.value):
            near = None  # `max: 9` is not a range under another name
        if near is None or near == "extends" or not self._repaired.rename(finding.path, near):
            self._repaired.leave_out(finding.path)

    def _left_over(self, parent: DataPath, key: str, known: list[str]) -> str | None:
        """Where a mapping needs all its keys, an unknown one stands for one that is missing."""
        given = set(part_at(self._data, parent))
        extra = [word for word in self._extra[parent] if did_you_mean(word, known) is None]
        missing = [word for word in known if word not in given]
        return dict(zip(extra, missing, strict=False)).get(key)

    def _unknown_word(
        self, key: str, owner: type | None, called: str, known: list[str], near: str | None, span: Span
    ) -> None:
        elsewhere = None if near else home_of(key, owner)
        listed = ", ".join(f"`{word}`" for word in known)
        if owner is State and near is None:
            hint = f"`{key}` belongs to {elsewhere}" if elsewhere else None
            message = f"`{key}` is not a word of the language; a state has {listed}"
            if elsewhere:
                message = f"a state has no `{key}`; it has {listed}"
            self._bag.error("S103", message, span, hint=hint)
            return
        hint = None if near else f"`{key}` belongs to {elsewhere}" if elsewhere else f"its keys are {listed}"
        self._bag.error("S101", f"unknown key `{key}` in {called}", span, suggestion=near, hint=hint)

    def _missing_key(self, finding: _Finding) -> None:
        key, parent = str(finding.path[-1]), finding.path[:-1]
        extra = self._extra.get(parent, ())
        if self._partial or any(did_you_mean(word, [key]) for word in extra):
            return
        if finding.path in self._repaired.lost:
            return  # it is there without a value, which has been reported
        if any(did_you_mean(word, ["extends"]) for word in self._extra.get((), ())):
            return  # the file it builds on may have it
        owner = model_at(self._model, parent)
        if owner is Ranged and extra:
            return  # which stand for it
        called = CALLED.get(owner, "this mapping") if owner is not None else "this mapping"
        if parent:
            called = f"`{parent[-1]}`" if isinstance(parent[-1], str) else called
        self._bag.error("S105", f"{called} needs a key `{key}`", self._places.key_span(parent))

    def _bad_name(self, finding: _Finding) -> None:
        key = str(finding.path[-1])
        span = self._places.key_span(finding.path)
        hint = "a name has letters, digits and `_`, and does not begin with a digit; 40 characters at most"
        self._bag.error("S104", f"`{key}` is not a name", span, hint=hint)
        self._repaired.leave_out(finding.path)

    # -- values ----------------------------------------------------------------------------------------------

    def _wrong_value(self, findings: list[_Finding]) -> None:
        finding = findings[0]
        if self._parameters and isinstance(finding.value, str) and PARAMETER.fullmatch(finding.value):
            return
        span = self._places.value_span(finding.path)
        for finding in findings:
            if finding.kind in ("greater_than_equal", "less_than_equal", "greater_than", "less_than"):
                hint = _as_share(finding.value, finding.context.get("le"))
                self._bag.error("S106", f"`{finding.value}` is {_bound(finding)}", span, hint=hint)
                return
            if finding.kind in ("too_short", "too_long", "string_too_short", "string_too_long"):
                self._bag.error("S106", _length(finding), span)
                return
            if finding.kind == "literal_error":
                self._literal(finding, span)
                return
            if finding.kind == "string_pattern_mismatch":
                hint = "a name has letters, digits and `_`, and does not begin with a digit"
                self._bag.error("S104", f"`{finding.value}` is not a name", span, hint=hint)
                return
        expected = expectation(annotation_at(self._model, finding.path))
        got = _kind_of(finding.value)
        key = next((str(part) for part in reversed(finding.path) if isinstance(part, str)), "")
        what = f"`{key}` is {expected}" if key else f"{expected} is expected"
        self._bag.error("S104", f"{what}, here is {got}", span, hint=_cure(key, expected, finding.value))

    def _literal(self, finding: _Finding, span: Span) -> None:
        annotation = annotation_at(self._model, finding.path)
        words = [str(word) for word in literals(annotation)]
        if not isinstance(finding.value, str):
            message = f"one of {', '.join(words)} is expected, here is {_kind_of(finding.value)}"
            self._bag.error("S104", message, span)
            return
        near = did_you_mean(finding.value, words)
        hint = None if near else "one of " + ", ".join(words)
        key = next((str(part) for part in reversed(finding.path) if isinstance(part, str)), "")
        self._bag.error(
            "S103", f"`{finding.value}` is not a word for `{key}`", span, suggestion=near, hint=hint
        )


def _has(part: object, step: object) -> bool:
    """Whether a mapping has a key or a list an item."""
    if isinstance(part, dict):
        return step in part
    return isinstance(part, list) and isinstance(step, int) and step < len(part)


def _counts_only_right_items(finding: _Finding) -> bool:
    """Whether a list is said to be too short only because pydantic does not count items that are wrong."""
    long_enough = isinstance(finding.value, list) and len(finding.value) >= finding.context.get(
        "min_length", 0
    )
    return finding.kind == "too_short" and long_enough


def _bound(finding: _Finding) -> str:
    context = finding.context
    if "ge" in context:
        return f"too small; at least {context['ge']} is expected"
    if "gt" in context:
        return f"too small; more than {context['gt']} is expected"
    return f"too large; at most {context.get('le', context.get('lt'))} is expected"


def _as_share(value: object, most: object) -> str | None:
    """What a number in per cent is where a share is expected."""
    if most != 1 or not isinstance(value, int | float) or not 2 <= value <= 100:
        return None
    return f"it is a share, not per cent: write {value / 100:g}"


def _length(finding: _Finding) -> str:
    context = finding.context
    key = next((str(part) for part in reversed(finding.path) if isinstance(part, str)), "this")
    many = "characters" if isinstance(finding.value, str) else "entries"
    if "max_length" in context:
        return f"`{key}` has more than {context['max_length']} {many}"
    if context["min_length"] > 1:
        return f"`{key}` has fewer than {context['min_length']} {many}"
    return f"`{key}` is empty"


_RANGES: Final = ("size", "width", "height", "range")
_ASSIGNMENT: Final = re.compile(r"\s*(\w+)\s*=\s*([^=].*)")


def _cure(key: str, expected: str, value: object) -> str | None:
    """What to write in place of a value of a wrong kind."""
    if isinstance(value, list) and len(value) == 2 and all(type(item) is int for item in value):
        interval = f"{value[0]}..{value[1]}"
        return f"a range is written {interval}" if key in _RANGES else f"`pick({interval})` draws one of them"
    if isinstance(value, list) and expected == "a text":
        return "a text in brackets has to be quoted"
    if isinstance(value, list) and expected == "an expression":
        return "conditions are joined with `and` or `or`, alternatives are written a | b"
    if isinstance(value, str) and (assigned := _ASSIGNMENT.fullmatch(value)):
        return f"write `{key}: {{{assigned[1]}: {assigned[2]}}}`" if "mapping" in expected else None
    if isinstance(value, dict):
        return "a value with `{ }` or a colon in it has to be quoted"
    return None


def _kind_of(value: object) -> str:
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, str):
        return f"the text `{value}`" if len(value) <= 40 else "a text"
    if isinstance(value, int | float):
        return f"the number {value}"
    return "a list" if isinstance(value, list) else "a mapping" if isinstance(value, dict) else "nothing"
