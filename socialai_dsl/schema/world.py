"""The world of a scenario: room, objects, and what the agent perceives of it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from socialai_dsl.schema.base import Expression, Expressions, Model, StateName, TextLine, Word, _as_tuple


class Room(Model):
    """A walled rectangle; sizes count the walls. Width and height are drawn independently from `size`."""

    size: Expression | None = Field(
        None, description="n, or a..b: both width and height", examples=["5..8", 8]
    )
    width: Expression | None = Field(None, description="width in cells, walls included")
    height: Expression | None = Field(None, description="height in cells, walls included")
    build: Annotated[tuple[dict[Word, str], ...], BeforeValidator(_as_tuple)] = Field(
        (),
        description="fixed things in place of floor, as {type: place}",
        examples=[[{"lava": "column(W // 2)"}]],
    )
    occlusion: bool = Field(False, description="what is not transparent hides what lies behind it")
    canvas: (
        Annotated[tuple[int, ...], BeforeValidator(_as_tuple), Field(min_length=2, max_length=2)] | None
    ) = Field(None, description="[width, height] of the grid the room lies on; default the largest room")


class ObjectGroup(Model):
    """An object, or with `count` (or a list in `at`) a group of them."""

    type: Word = Field(description="an object type of the prelude", examples=["door"])
    count: int | None = Field(None, ge=1, le=16, description="a group of so many")
    place: Expressions | None = Field(None, description="where it is drawn; a list gives one each")
    at: (
        Annotated[
            tuple[Expression, ...] | tuple[tuple[Expression, ...], ...],
            BeforeValidator(lambda v: tuple(_as_tuple(item) for item in v) if isinstance(v, list) else v),
        ]
        | None
    ) = Field(None, description="[x, y], or a list of them: a group")
    color: Expressions | None = Field(None, description="a colour, `random`, `distinct`, or one each")
    state: StateName | None = Field(None, description="initial status; default the type's")
    pressed: Expression | None = Field(None, description="whether it is pressed at first")
    opened: Expression | None = Field(None, description="whether it is opened at first")
    locked: Expression | None = Field(None, description="computed: it is locked while this holds")
    tagged: Expression | None = Field(None, description="computed: it is tagged while this holds")
    one_way: bool = Field(False, description="a toggle only leads away from the initial status, never back")
    dark: bool = Field(False, description="the agent sees no difference between its statuses")
    inside: str | None = Field(None, description="the object it lies in, unseen until that is opened")
    exclusive: bool = Field(
        False, description="of a group: once one of them is used, the others react to nothing"
    )
    overlap: bool = Field(False, description="it may be put on a cell that is taken")
    timer: int | None = Field(
        None, ge=1, le=10_000, description="steps after which its active status expires"
    )
    opens: str | None = Field(
        None, description="what is open while this is active: one object, or a group in the same order"
    )
    pushed_by: Word | None = Field(None, description="the only type of object that can push it")
    unlocks: str | None = Field(
        None, description="what is unlocked while this is pressed: one object, or a group in the same order"
    )


Channel = Literal["type", "color", "status", "orientation", "pointing", "last_act"]
CHANNELS: tuple[Channel, ...] = ("type", "color", "status", "orientation", "pointing", "last_act")


class Observe(Model):
    """What the agent perceives; it never changes what happens."""

    npcs: Literal["shown", "hidden"] = Field(
        "shown", description="hidden: NPCs are neither seen nor heard nor in the way"
    )
    image: Literal["end", "before_npcs"] = Field("end", description="when in the step the picture is taken")
    names: Literal["shown", "hidden"] = Field("shown", description="speaker names in what is heard")
    own_voice: bool = Field(False, description="whether the agent hears itself")
    channels: Annotated[tuple[Channel, ...], BeforeValidator(_as_tuple)] = Field(
        CHANNELS[:4], description="of the image: the first four, or all six"
    )
    directions: Literal["absolute", "egocentric"] = Field(
        "absolute",
        description="how the image shows the directions of NPCs; egocentric: as seen from the agent",
    )


class UtteranceGrammar(Model):
    """What the agent can say: every template with every noun."""

    templates: Annotated[tuple[TextLine, ...], BeforeValidator(_as_tuple)] = Field(
        min_length=1,
        max_length=64,
        description="texts; <noun> stands for each noun",
        examples=[["Where is <noun>"]],
    )
    nouns: Annotated[tuple[TextLine | int, ...], BeforeValidator(_as_tuple)] = Field(
        min_length=1, max_length=256, description="what <noun> can be", examples=[["the exit", "the wall"]]
    )

    def utterance(self, template: int, noun: int) -> str:
        """The text of a pair: the template with its <noun> filled."""
        return self.templates[template].replace("<noun>", str(self.nouns[noun]))
