"""What ends a request that was understood: the caller's mistake, or a run that stopped by itself."""

from collections.abc import Mapping, Sequence
from reprlib import repr
from typing import Any, Final


class UsageError(ValueError):
    """The caller asked for something that cannot be done; the message says what was got and expected."""


class UnreadableError(UsageError):
    """A file of ours is damaged, or of another version; the message says which and how."""


class OptionError(UsageError):
    """An option of a run has a value that it cannot have.

    Attributes:
        name: of the option, as `RunConfig` has it. said: what was got and expected.
    """

    def __init__(self, name: str, said: str) -> None:
        super().__init__(f"{name}: {said}")
        self.name, self.said = name, said


class RunFailed(Exception):  # noqa: N818 - it says what happened
    """A run stopped by itself: its numbers are no longer finite, the disk is full, or a budget is spent."""


_BOUNDS: Final = {
    "greater_than_equal": "at least {ge:g}",
    "greater_than": "more than {gt:g}",
    "less_than_equal": "at most {le:g}",
    "less_than": "less than {lt:g}",
}
"""Kinds of pydantic's errors whose words are ours."""


def described_error(error: Exception) -> str:
    """What a person is told of an error of a file."""
    if isinstance(error, OSError):
        place = f": {error.filename}" if error.filename is not None else ""
        return f"{error.strerror or error}{place}"
    return str(error)


def first_mistake(errors: Sequence[Mapping[str, Any]]) -> tuple[str, str]:
    """Where a document first differs from its pydantic model, and how.

    Args:
        errors: what `errors()` of a `ValidationError` returns.

    Returns:
        The place, such as `runs.0.seed`, empty for the whole document; words such as `expected at least 0, got -5`.
    """
    first = errors[0]
    kind, place = first["type"], ".".join(map(str, first["loc"]))
    if kind == "missing":
        return place, "is missing"
    if kind == "extra_forbidden":
        return place, "there is no such key"
    if kind == "value_error":
        return place, first["msg"].removeprefix("Value error, ")
    expected = _BOUNDS[kind].format(**first["ctx"]) if kind in _BOUNDS else first["msg"]
    return place, f"expected {expected.removeprefix('Input should be ')}, got {repr(first['input'])}"
