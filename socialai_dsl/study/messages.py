"""What a participant's page may send, checked where it arrives; everything else is refused."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

LARGEST: Final = 65_536
"""Bytes of a message that is read at all."""


def _yes(value: bool) -> bool:
    if not value:
        raise ValueError("got false, expected true")
    return value


_Screen = Annotated[str, Field(max_length=80)]
_Milliseconds = Annotated[float, Field(ge=0, le=1e10)]
_Yes = Annotated[bool, AfterValidator(_yes)]
"""`true`, and not what only counts as true, such as 1."""


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Beat(_Message):
    """Say that the page is there."""

    do: Literal["beat"]


class Go(_Message):
    """Go on from a screen: agree, turn a page, or begin the next episode.

    Attributes:
        on: the screen that is meant; of one that is gone nothing follows.
    """

    do: Literal["go"]
    on: _Screen


class Decline(_Message):
    """Do not agree."""

    do: Literal["decline"]
    on: _Screen


class Act(_Message):
    """Move, speak, or both.

    Attributes:
        shown, acted: when the picture was shown and when this was chosen, milliseconds of the page's own clock.
    """

    do: Literal["act"]
    on: _Screen
    movement: Annotated[str, Field(max_length=40)] | None = None
    said: Annotated[str, Field(max_length=1000)] | None = None
    shown: _Milliseconds
    acted: _Milliseconds


class Answers(_Message):
    """Answer the questions of a screen, by their names."""

    do: Literal["answers"]
    on: _Screen
    answers: Annotated[
        dict[Annotated[str, Field(max_length=40)], Annotated[str, Field(max_length=10_000)] | int],
        Field(max_length=200),
    ]


class Join(_Message):
    """Take part from a page of somebody else, on which the participant has agreed.

    Attributes:
        id: by which that page knows the participant. code: that the page was given when it joined before.
        consented: that they have agreed there. simulated: whether nobody sits there.
    """

    do: Literal["join"]
    id: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    code: Annotated[str, Field(max_length=80)] | None = None
    consented: _Yes
    simulated: bool = False


Message = Beat | Go | Decline | Act | Answers
_MESSAGES: Final[TypeAdapter[Message]] = TypeAdapter(Annotated[Message, Field(discriminator="do")])


def parsed(content: str | bytes) -> Message | None:
    """The message that a text is; None if it is none."""
    try:
        return _MESSAGES.validate_json(content)
    except (ValidationError, UnicodeDecodeError):
        return None


def joining(content: str | bytes) -> Join | None:
    """How a page of somebody else takes part; None if the text does not say it."""
    try:
        return Join.model_validate_json(content)
    except (ValidationError, UnicodeDecodeError):
        return None


Screen = dict[str, Any]
