"""What language models cost: two amounts, or a table of them by model."""

from __future__ import annotations

from math import inf
from pathlib import Path
from reprlib import repr as shortened
from typing import Any, Final

from socialai_dsl.diagnostics import ScenarioError, suggested
from socialai_dsl.errors import OptionError
from socialai_dsl.loader.reader import SUFFIXES, read_document

MOST_DOLLARS: Final = 1e12

Prices = tuple[float, float]
"""US dollars for a million tokens of requests, and of replies."""


def is_table(given: str) -> bool:
    """Whether prices are given by the path of a table."""
    return given.endswith(SUFFIXES)


def prices_of(model: str, given: str) -> Prices:
    """The prices of a model.

    Args:
        model: its name at its server.
        given: `IN,OUT`, or the path of a YAML file with `MODEL: [IN, OUT]` for each model.

    Raises:
        OptionError: these are no amounts, or the table cannot be read or lacks the model.
    """
    if not is_table(given):
        found = _amounts(given.split(","))
        if found is None:
            expected = "two amounts such as 0.15,0.60, or a table such as prices.yaml"
            raise OptionError("prices", f"got {shortened(given)}, expected {expected}")
        return found
    try:
        document = read_document(Path(given))
    except ScenarioError as error:
        raise OptionError("prices", str(error.diagnostics[0])) from None
    if not isinstance(document.children, dict):
        raise OptionError("prices", f"{document.span.value}: got {document.kind}, expected models by name")
    row = document.children.get(model)
    if row is None:
        known = list(document.children)
        advice = suggested(model, known, f"; it has {', '.join(known[:8])}{', ...' * (len(known) > 8)}")
        raise OptionError("prices", f"{document.file} has no prices of the model {model!r}{advice}")
    found = _amounts(row.data) if isinstance(row.data, list) else None
    if found is None:
        raise OptionError(
            "prices",
            f"{row.span.value}: got {shortened(row.data)}, expected two amounts such as [0.15, 0.60]",
        )
    return found


def _amounts(given: list[Any]) -> Prices | None:
    """Two amounts of US dollars; None if these are none."""
    try:
        request, reply = (inf if isinstance(one, bool) else float(one) for one in given)
    except (TypeError, ValueError):
        return None
    return (request, reply) if 0 <= request <= MOST_DOLLARS and 0 <= reply <= MOST_DOLLARS else None
