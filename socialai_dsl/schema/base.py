"""What every model of the schema shares: strict, closed, frozen; and the scalar kinds that hold expressions."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, StringConstraints

Word = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=40)]
"""A name that an author declares: letters, digits and underscores, not starting with a digit."""

Expression = int | bool | str
"""The source of an expression; a bare number or truth value may be written without quotes."""

TextLine = Annotated[str, StringConstraints(min_length=1, max_length=500)]
"""A text that somebody can say, possibly with <...> parts."""


def _one_or_many(value: Any) -> Any:
    return value if isinstance(value, list) else [value]


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Expressions = Annotated[tuple[Expression, ...], BeforeValidator(_as_tuple), BeforeValidator(_one_or_many)]
"""One expression, or a list of them."""

Texts = Annotated[tuple[TextLine, ...], BeforeValidator(_as_tuple), BeforeValidator(_one_or_many)]
"""One text, or a list of them."""


class Model(BaseModel):
    """Base of all models: unknown keys are errors, nothing is coerced, nothing changes after loading."""

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        populate_by_name=True,
        protected_namespaces=(),
        # Only the root is ever validated; building every model by itself would triple the time to start.
        defer_build=True,
    )
