"""What a scenario says beside what happens: claims of `check` about itself, and `probes`. Playing never reads them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, StringConstraints

from socialai_dsl.schema.base import Expression, Model, TextLine, Texts, Word, _as_tuple, _one_or_many
from socialai_dsl.schema.behaviour import Probability

_Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*(\[[0-9]+\])?$", max_length=40)]
Names = Annotated[
    tuple[_Name, ...],
    BeforeValidator(_as_tuple),
    Field(min_length=1),
    BeforeValidator(
        _one_or_many, json_schema_input_type=_Name | Annotated[tuple[_Name, ...], Field(min_length=1)]
    ),
]
"""One member or group of the cast, or a list of them."""


class OnlyThrough(Model):
    """What was drawn shows only through these members."""

    draw: Word = Field(description="a `let` whose values are tried against each other")
    by: Names = Field(description="members of the cast whose cues may tell what was drawn")


class Property(Model):
    """A property: one of `reachable`, `never`, `within`, `oracle`, `script`, `needs`, `only_through` and `knowable`."""

    reachable: Expression | None = Field(None, description="a condition, or the name of an outcome")
    never: Expression | None = Field(None, description="a condition, or the name of an outcome")
    within: int | None = Field(None, ge=1, le=10_000, description="steps of a shortest success")
    oracle: Probability | None = Field(None, description="share of rooms that the variant `oracle` solves")
    script: Literal["perceives"] | None = Field(
        None, description="the variant `oracle` acts on what it has perceived alone"
    )
    needs: Names | None = Field(None, description="members without whom one can only guess")
    only_through: OnlyThrough | None = Field(None, description="whose cues alone may show what was drawn")
    knowable: bool | None = Field(
        None,
        description="whether an agent can perceive in time what its success depends on (tried by default)",
    )
    share: Probability | None = Field(
        None, description="least share of rooms, for `reachable`, `within`, `script`, `needs` and `knowable`"
    )
    draw: Word | None = Field(None, description="for `needs`: the `let` that has to be guessed")


class Probe(Model):
    """A question to a language model about the present moment, whose right answer the engine computes."""

    when: Expression | None = Field(
        None, description="asked at the first moment at which this holds; default: when the episode has ended"
    )
    ask: TextLine = Field(description="the question; <...> is a value", examples=["Where will Sally look?"])
    answer: Expression = Field(
        description="what is right at that moment: a value, or a condition for yes or no",
        examples=["sally.believes.toy_in.color"],
    )
    answers: Texts = Field(
        (), description="what can be answered; <...> is a value (default: all that the answer can be)"
    )
