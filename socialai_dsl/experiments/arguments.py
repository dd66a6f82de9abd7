"""A setting of a run as it is typed behind `socialai-run`."""

import json
from collections.abc import Mapping
from typing import Any


def typed(name: str, value: Any) -> list[str]:
    """The words that a setting is given by: a switch alone, a mapping's option once for each of its keys."""
    option = f"--{name.replace('_', '-')}"
    if isinstance(value, Mapping):
        given = (
            f"{key}={each if isinstance(each, str) else json.dumps(each)}" for key, each in value.items()
        )
        return [word for pair in given for word in (option, pair)]
    return [option] if value is True else [option, str(value)]
