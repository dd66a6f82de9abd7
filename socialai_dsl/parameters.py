"""Parameters of a file: their values, and `$name` put in where it stands for a whole value."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from socialai_dsl.diagnostics import DiagnosticBag, did_you_mean
from socialai_dsl.loader import Data, Resolved
from socialai_dsl.loader.scalars import read_plain
from socialai_dsl.source import DataPath

Value = int | bool | float | str

_WHOLE = re.compile(r"\$([A-Za-z_]\w*)")


@dataclass(frozen=True)
class Substituted:
    """A document with its parameters put in.

    Attributes:
        data: a copy in which every value that was `$name` is the parameter's value.
        values: parameter -> value, for those inside expressions.
        paths: where a whole value was a parameter.
    """

    data: Mapping[str, object]
    values: dict[str, Value] = field(default_factory=dict)
    paths: frozenset[DataPath] = frozenset()


def substitute(resolved: Resolved, bag: DiagnosticBag) -> Substituted:
    """Put the parameters in: defaults, or what was given behind `?`. Reports S206."""
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    values = _values(resolved, bag)
    substitution = _Substitution(values, resolved, bag)
    data = {
        key: part if key == "params" else substitution.of(part, (key,)) for key, part in resolved.data.items()
    }
    return Substituted(data, values, frozenset(substitution.paths))


def _values(resolved: Resolved, bag: DiagnosticBag) -> dict[str, Value]:
    declared = _declared(resolved)
    values: dict[str, Value] = {}
    for name, declaration in declared.items():
        default = _entry(declaration, "default") if isinstance(declaration, dict) else declaration
        choices = _entry(declaration, "values") if isinstance(declaration, dict) else None
        if default is not None and choices is not None:
            default = _chosen(name, default, choices, resolved, bag)
        if name in resolved.params:
            default = _given(name, default, choices, resolved, bag)
        if isinstance(default, int | bool | float | str):
            values[name] = default
    for name in resolved.params:
        if name not in declared:
            near = did_you_mean(name, declared)
            hint = None if near else "it has " + ", ".join(declared) if declared else "it has none"
            message = f"`{resolved.name}` has no parameter `{name}`"
            bag.error("S206", message, resolved.param_span(name), suggestion=near, hint=hint)
    return values


def _declared(resolved: Resolved) -> dict[str, Data]:
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    declared = _entry(resolved.data, "params")
    return declared if isinstance(declared, dict) else {}


def _entry(mapping: Mapping[str, Data], key: str) -> Data:
    """The value of a key, also of one that is misspelt: the models report that, and no parameter is unknown for it."""
    if key in mapping:
        return mapping[key]
    return next((value for word, value in mapping.items() if did_you_mean(word, [key])), None)


def _chosen(name: str, default: Data, choices: Data, resolved: Resolved, bag: DiagnosticBag) -> Data:
    """The value that the default is, or, where values have labels, stands for."""
    if isinstance(choices, dict) and default in choices.values():
        return default
    labels = list(map(str, choices)) if isinstance(choices, dict | list) else [str(default)]
    if str(default) not in labels:
        near = did_you_mean(str(default), labels)
        span = resolved.value_span(("params", name, "default"))
        hint = None if near else "one of " + ", ".join(labels)
        message = f"the default of `{name}` is none of its values"
        bag.error("S206", message, span, suggestion=near, hint=hint)
    return choices.get(str(default), default) if isinstance(choices, dict) else default


def _given(name: str, default: Data, choices: Data, resolved: Resolved, bag: DiagnosticBag) -> Data:
    """The value that was asked for, read as YAML would read it; the default if it cannot be had."""
    text, span = resolved.params[name], resolved.param_span(name)
    if isinstance(choices, dict):
        if text not in choices:
            near = did_you_mean(text, choices)
            hint = None if near else "one of " + ", ".join(choices)
            bag.error("S206", f"`{text}` is none of the values of `{name}`", span, suggestion=near, hint=hint)
        return choices.get(text, default)
    value = read_plain(text).value
    if isinstance(choices, list) and (value not in choices or isinstance(value, bool) != _any_bool(choices)):
        hint = "one of " + ", ".join(map(str, choices))
        bag.error("S206", f"`{text}` is none of the values of `{name}`", span, hint=hint)
        return default
    if choices is None and not _alike(value, default):
        message = f"`{text}` is not of the kind of the default of `{name}`, `{default}`"
        bag.error("S206", message, span)
        return default
    return value


def _any_bool(choices: list[Data]) -> bool:
    return any(isinstance(choice, bool) for choice in choices)


def _alike(value: Data, default: Data) -> bool:
    if isinstance(value, bool) or isinstance(default, bool):
        return isinstance(value, bool) and isinstance(default, bool)
    if isinstance(value, int | float) or isinstance(default, int | float):
        return isinstance(value, int | float) and isinstance(default, int | float)
    return isinstance(value, str)


class _Substitution:
    """Replaces whole values, and remembers where."""

    def __init__(self, values: Mapping[str, Value], resolved: Resolved, bag: DiagnosticBag) -> None:
        self._values = values
        self._declared = _declared(resolved)
        self._resolved = resolved
        self._bag = bag
        self.paths: list[DataPath] = []

    def of(self, part: Data, path: DataPath) -> Data:
        """A part with its parameters put in."""
        if isinstance(part, dict):
            return {key: self.of(value, (*path, key)) for key, value in part.items()}
        if isinstance(part, list):
            return [self.of(value, (*path, i)) for i, value in enumerate(part)]
        match = _WHOLE.fullmatch(part) if isinstance(part, str) else None
        if match is None:
            return part
        name = match.group(1)
        if name not in self._values and name in self._declared:
            return part  # it has no default, which is reported where it is declared
        if name not in self._values:
            near = did_you_mean(name, self._values)
            span = self._resolved.locate(path, 0, len(name) + 1)
            self._bag.error("S206", f"unknown parameter `{name}`", span, suggestion=near)
            return part
        self.paths.append(path)
        return self._values[name]
