"""Reads layouts, the known rooms in which episodes start: in JSON, or in YAML like scenarios."""

from __future__ import annotations

import json
from typing import Any

from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Source


def read_layout(source: Source) -> Any:
    """The plain data of a layout: YAML if the file's name says so, else JSON.

    Raises:
        ScenarioError: it is no YAML.
        ValueError: it is no JSON.
    """
    if source.name.endswith((".yaml", ".yml")):
        return read_document(source).data
    try:
        return json.loads(source.text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"layout: {source.name} is no JSON: {error}") from None
