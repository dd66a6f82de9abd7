"""What every model of the schema shares: strict, closed, frozen; and the scalar kinds that hold expressions."""

from __future__ import annotations

from typing import Annotated, Any, Final

from pydantic import BaseModel, BeforeValidator, ConfigDict, StringConstraints, WithJsonSchema
from pydantic.config import JsonDict


def as_written(form: Any) -> BeforeValidator:
    """What authors may write where the model holds what the loader makes of it; only the JSON Schema tells."""
    return BeforeValidator(_unchanged, json_schema_input_type=form)


def _unchanged(value: Any) -> Any:
    return value


Word = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=40)]
"""A name that an author declares: letters, digits and underscores, not starting with a digit."""

WORD_SCHEMA: Final[JsonDict] = {"pattern": "^[A-Za-z_][A-Za-z0-9_]*$", "maxLength": 40}
"""The same for keys of a mapping whose known keys have fields; pydantic leaves their names out."""

Expression = int | bool | str
"""The source of an expression; a bare number or truth value may be written without quotes."""

_Text = Annotated[str, StringConstraints(min_length=1, max_length=500)]

# The loader makes texts of plain numbers, `true` and `null` where a text is expected.
_Null = Annotated[None, WithJsonSchema({"enum": [None]})]
TextLine = Annotated[_Text, as_written(_Text | float | bool | _Null)]
"""A text that somebody can say, possibly with <...> parts."""

Prose = Annotated[str, as_written(str | float | bool)]
"""A text for people."""

StateName = Annotated[Word, as_written(Word | bool | _Null)]
"""The name of a state."""

ExpressionOrText = Annotated[Expression, as_written(Expression | float | _Null)]
"""The source of an expression, or a text."""


def _one_or_many(value: Any) -> Any:
    return value if isinstance(value, list) else [value]


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Expressions = Annotated[
    tuple[Expression, ...],
    BeforeValidator(_as_tuple),
    BeforeValidator(_one_or_many, json_schema_input_type=Expression | tuple[Expression, ...]),
]
"""One expression, or a list of them."""

Texts = Annotated[
    tuple[TextLine, ...],
    BeforeValidator(_as_tuple),
    BeforeValidator(_one_or_many, json_schema_input_type=TextLine | tuple[TextLine, ...]),
]
"""One text, or a list of them."""


class Model(BaseModel):
    """Base of all models: unknown keys are errors, nothing is coerced, nothing changes after loading."""

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        populate_by_name=True,  # for us, who make models of models; files are read by the alias alone
        protected_namespaces=(),
        # Only the root is ever validated; building every model by itself would triple the time to start.
        defer_build=True,
    )
