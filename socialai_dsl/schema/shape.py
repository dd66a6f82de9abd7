"""Data to models, and what pydantic finds wrong with it in words for authors, at the place in the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Final, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from socialai_dsl.diagnostics import DiagnosticBag, did_you_mean
from socialai_dsl.schema.behaviour import CastMember, FirstRule, Frame, State, Step, ThenRule
from socialai_dsl.schema.positions import DataPath, Positions
from socialai_dsl.schema.scenario import Outcome, Parameter, Scenario
from socialai_dsl.schema.world import ObjectGroup, Observe, Room, UtteranceGrammar

M = TypeVar("M", bound=BaseModel)

_CALLED: Final[dict[type, str]] = {
    Scenario: "a scenario",
    Frame: "a frame",
    State: "a state",
    FirstRule: "a rule of `first`",
    ThenRule: "a rule of `then`",
    Step: "a step",
    CastMember: "a member of the cast",
    ObjectGroup: "an object",
    Room: "the room",
    Observe: "`observe`",
    UtteranceGrammar: "a grammar",
    Outcome: "an outcome",
    Parameter: "a parameter",
}


def model_of(
    model: type[M], data: object, places: Positions, bag: DiagnosticBag, *, partial: bool = False
) -> M | None:
    """The model made from `data`; None if its shape is wrong, which `bag` then says.

    Args:
        model: what it should be. data: plain data of a document. places: where its parts stand.
        partial: missing keys are fine, as in a base that others build on; the result is then None as well.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        _Report(model, data, places, bag, partial).add_all(error)
        return None


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
        self, model: type[BaseModel], data: object, places: Positions, bag: DiagnosticBag, partial: bool
    ) -> None:
        self._model = model
        self._data = data
        self._places = places
        self._bag = bag
        self._partial = partial
        self._extra: dict[DataPath, list[str]] = {}

    def add_all(self, error: ValidationError) -> None:
        """Report everything, one finding for each place."""
        found = [self._placed(e) for e in error.errors(include_url=False)]
        by_path: dict[tuple[DataPath, bool], list[_Finding]] = {}
        for finding in found:
            by_path.setdefault((finding.path, finding.about_key), []).append(finding)
            if finding.kind == "extra_forbidden":
                self._extra.setdefault(finding.path[:-1], []).append(str(finding.path[-1]))
        for findings in by_path.values():
            self._add(findings)

    def _placed(self, error: Any) -> _Finding:
        """The error at a path that exists: names of union branches are no part of the file."""
        path: list[str | int] = []
        part: object = self._data
        location = list(error["loc"])
        about_key = location[-1:] == ["[key]"]
        if about_key:
            location.pop()
        missing = location.pop() if error["type"] == "missing" else None
        for step in location:
            if isinstance(part, dict) and step in part:
                part = part[step]
            elif isinstance(part, list) and isinstance(step, int) and step < len(part):
                part = part[step]
            else:
                continue
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
        elif first.value is None:
            self._nothing(first)
        else:
            self._wrong_value(findings)

    # -- keys ------------------------------------------------------------------------------------------------

    def _unknown_key(self, finding: _Finding) -> None:
        key = str(finding.path[-1])
        span = self._places.key_span(finding.path)
        owner = _model_at(self._model, finding.path[:-1])
        known = keys_of(owner) if owner is not None else []
        called = _CALLED.get(owner, "this mapping") if owner is not None else "this mapping"
        if finding.value is None and self._places.in_flow(finding.path) and (" " in key or not key.isidentifier()):
            hint = "quote the text, or write the keys on lines of their own"
            self._bag.error("S102", f"unknown key `{key}`: inside {{ }} a comma ends the value", span, hint=hint)
        elif owner is ThenRule and key == "do":
            message = "the body has already moved when `then` is read: put `do` in the state or in `first`"
            self._bag.error("S307", message, span)
        else:
            self._unknown_word(key, owner, called, known, span)

    def _unknown_word(self, key: str, owner: type | None, called: str, known: list[str], span: Any) -> None:
        near = did_you_mean(key, known)
        elsewhere = None if near else _home_of(key)
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
        if self._partial or any(did_you_mean(extra, [key]) for extra in self._extra.get(parent, ())):
            return
        owner = _model_at(self._model, parent)
        called = _CALLED.get(owner, "this mapping") if owner is not None else "this mapping"
        if parent:
            called = f"`{parent[-1]}`" if isinstance(parent[-1], str) else called
        self._bag.error("S105", f"{called} needs a key `{key}`", self._places.key_span(parent))

    def _bad_name(self, finding: _Finding) -> None:
        key = str(finding.path[-1])
        span = self._places.key_span(finding.path)
        hint = "a name has letters, digits and `_`, and does not begin with a digit; 40 characters at most"
        if finding.value is None and self._places.in_flow(finding.path) and " " in key:
            message = f"unknown key `{key}`: inside {{ }} a comma ends the value"
            self._bag.error("S102", message, span, hint="quote the text, or write the keys on lines of their own")
        else:
            self._bag.error("S104", f"`{key}` is not a name", span, hint=hint)

    # -- values ----------------------------------------------------------------------------------------------

    def _nothing(self, finding: _Finding) -> None:
        key = finding.path[-1] if finding.path else ""
        span = self._places.key_span(finding.path)
        what = "an item of the list is empty" if isinstance(key, int) else f"nothing is given for `{key}`"
        self._bag.error("S104", what, span, hint="write a value, or leave the key out")

    def _wrong_value(self, findings: list[_Finding]) -> None:
        finding = findings[0]
        span = self._places.value_span(finding.path)
        for finding in findings:
            if finding.kind in ("greater_than_equal", "less_than_equal", "greater_than", "less_than"):
                self._bag.error("S106", f"`{finding.value}` is {_bound(finding)}", span)
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
        expected = _described(_annotation_at(self._model, finding.path))
        got = _kind_of(finding.value)
        key = next((str(part) for part in reversed(finding.path) if isinstance(part, str)), "")
        what = f"`{key}` is {expected}" if key else f"{expected} is expected"
        self._bag.error("S104", f"{what}, here is {got}", span, hint=_cure(finding.value))

    def _literal(self, finding: _Finding, span: Any) -> None:
        annotation = _annotation_at(self._model, finding.path)
        words = [str(word) for word in _literals(annotation)]
        if not isinstance(finding.value, str):
            message = f"one of {', '.join(words)} is expected, here is {_kind_of(finding.value)}"
            self._bag.error("S104", message, span)
            return
        near = did_you_mean(finding.value, words)
        hint = None if near else "one of " + ", ".join(words)
        key = next((str(part) for part in reversed(finding.path) if isinstance(part, str)), "")
        self._bag.error("S103", f"`{finding.value}` is not a word for `{key}`", span, suggestion=near, hint=hint)


def _bound(finding: _Finding) -> str:
    context = finding.context
    if "ge" in context:
        return f"too small; at least {context['ge']} is expected"
    if "gt" in context:
        return f"too small; more than {context['gt']} is expected"
    return f"too large; at most {context.get('le', context.get('lt'))} is expected"


def _length(finding: _Finding) -> str:
    context = finding.context
    key = next((str(part) for part in reversed(finding.path) if isinstance(part, str)), "this")
    many = "characters" if isinstance(finding.value, str) else "entries"
    if "max_length" in context:
        return f"`{key}` has more than {context['max_length']} {many}"
    return f"`{key}` is empty"


def _cure(value: object) -> str | None:
    if isinstance(value, list):
        return "alternatives inside an expression are written a | b"
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


# -- the models, looked at -----------------------------------------------------------------------------------------


def keys_of(model: type) -> list[str]:
    """The keys a mapping of this kind can have, as authors write them."""
    assert issubclass(model, BaseModel), "internal: only models have keys"
    return [field.alias or name for name, field in model.model_fields.items()]


def _home_of(key: str) -> str | None:
    """Where a key that is misplaced would belong."""
    homes = [called for model, called in _CALLED.items() if key in keys_of(model)]
    return " or ".join(dict.fromkeys(homes[:2])) if homes else None


def _model_at(model: type[BaseModel], path: DataPath) -> type[BaseModel] | None:
    for part in _unwrapped(_annotation_at(model, path)):
        if isinstance(part, type) and issubclass(part, BaseModel):
            return part
    return None


def _annotation_at(model: type[BaseModel], path: DataPath) -> Any:
    """The annotation of the part of a model at `path`; Any if the model has no such part."""
    annotation: Any = model
    for step in path:
        annotation = _step(annotation, step)
    return annotation


def _step(annotation: Any, step: str | int) -> Any:
    for part in _unwrapped(annotation):
        origin, arguments = get_origin(part), get_args(part)
        if isinstance(part, type) and issubclass(part, BaseModel):
            for name, field in part.model_fields.items():
                if step in (name, field.alias):
                    return Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation
        elif origin is dict and isinstance(step, str):
            return arguments[1]
        elif origin in (tuple, list) and isinstance(step, int):
            return arguments[0] if arguments[-1:] == (...,) or origin is list else arguments[min(step, len(arguments) - 1)]
    return Any


def _unwrapped(annotation: Any) -> Iterator[Any]:
    """The branches of a union, without annotations around them."""
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from _unwrapped(get_args(annotation)[0])
    elif origin in (Union, UnionType):
        for branch in get_args(annotation):
            yield from _unwrapped(branch)
    else:
        yield annotation


def _literals(annotation: Any) -> list[object]:
    return [word for part in _unwrapped(annotation) if get_origin(part) is Literal for word in get_args(part)]


_SCALARS: Final = {int: "a whole number", float: "a number", bool: "`true` or `false`", str: "a text"}


def _described(annotation: Any) -> str:
    """What belongs there, in words."""
    branches = [part for part in _unwrapped(annotation) if part is not type(None)]
    if {int, bool, str} <= set(map(_hashable, branches)):
        return "an expression"
    for part in branches:
        if part in _SCALARS:
            return _SCALARS[part]
        if isinstance(part, type) and issubclass(part, BaseModel):
            return "a mapping with keys such as " + ", ".join(f"`{k}`" for k in keys_of(part)[:3])
        if get_origin(part) is dict:
            return "a mapping of names"
        if get_origin(part) in (tuple, list):
            return "a list"
    return "something else"


def _hashable(part: Any) -> Any:
    return part if isinstance(part, type) else str(part)
