"""A scenario with each value that its parameters may have, beside the one they have by default."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from socialai_dsl.checking.scenarios import check_scenario
from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, Severity
from socialai_dsl.loader import Data, Resolved
from socialai_dsl.loader.scalars import read_plain

MOST: Final = 64
"""How many values of a file are tried; each takes about as long as the scenario itself."""


def of_other_values(resolved: Resolved) -> Iterator[Diagnostic]:
    """The errors that a scenario has with another value of one of its parameters, each alone.

    The scenario itself is right. What is found says which value it was.
    """
    said: set[Diagnostic] = set()
    for number, (name, text) in enumerate(_others(resolved)):
        if number == MOST:
            return
        bag = DiagnosticBag()
        asked = resolved.with_parameter(name, text, resolved.value_span(("params", name, "values")))
        check_scenario(asked, bag)
        for found in bag:
            if found.severity is Severity.ERROR and found not in said:
                said.add(found)
                note = f"with `{resolved.name}?{name}={text}`"
                yield replace(found, hint=f"{found.hint}; {note}" if found.hint else note)


def _others(resolved: Resolved) -> Iterator[tuple[str, str]]:
    """Name and value of what can be asked for behind `?`, but for defaults and what is given already."""
    declared = resolved.data.get("params") if isinstance(resolved.data, dict) else None
    for name, declaration in declared.items() if isinstance(declared, dict) else ():
        if not isinstance(declaration, dict) or resolved.given(name) is not None:
            continue
        choices, default = declaration.get("values"), declaration.get("default")
        if isinstance(choices, dict):
            yield from ((name, label) for label, value in choices.items() if default not in (label, value))
        elif isinstance(choices, list):
            texts = ((_written(value), value) for value in choices if not _same(value, default))
            yield from ((name, text) for text, value in texts if _same(read_plain(text).value, value))


def _same(value: Data, other: Data) -> bool:
    """Whether two values are one: 1 is not true."""
    return value == other and isinstance(value, bool) is isinstance(other, bool)


def _written(value: Data) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
