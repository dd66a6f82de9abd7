"""A setting of a run as it is typed behind `socialai-run`."""

import json
from collections.abc import Mapping
from typing import Any


def typed(name: str, value: Any) -> list[list[str]]:
    """The words of each option that a setting is given by: a switch alone, a mapping once for each of its keys."""
    option = f"--{name.replace('_', '-')}"
    if isinstance(value, Mapping):
        return [
            [option, f"{key}={each if isinstance(each, str) else json.dumps(each)}"]
            for key, each in value.items()
        ]
    return [[option]] if value is True else [[option, str(value)]]
