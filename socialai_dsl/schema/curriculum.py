"""A curriculum as models: phases of training, each with the members of a suite that it plays and its end."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag

from socialai_dsl.schema.holds import Holds
from socialai_dsl.schema.scenario import ListOf, Model, Probability, Prose, Word
from socialai_dsl.schema.suite import Labels, MemberName

Weight = Annotated[
    float, Field(ge=0, le=1e6), BeforeValidator(lambda value: float(value) if type(value) is int else value)
]


class Ramp(Model):
    """A weight that changes linearly with the episodes of the phase, and then stays."""

    start: Weight = Field(alias="from", description="the weight at the beginning of the phase")
    to: Weight = Field(description="the weight at the end of the change, and after it")
    over: int = Field(ge=1, description="the number of episodes that the change takes")

    def after(self, episodes: int) -> float:
        """The weight after this number of episodes of the phase."""
        return self.start + (self.to - self.start) * min(episodes / self.over, 1.0)


def _form(value: Any) -> str:
    return "ramp" if isinstance(value, dict | Ramp) else "number"


class Group(Model):
    """Some members of a suite, and the probability of the group; within it the suite's own probabilities count."""

    only: dict[Word, Labels] = Field(
        default_factory=dict,
        description="parameter: value or values; the leaves that have one of the values of every parameter",
    )
    without: dict[Word, Labels] = Field(
        default_factory=dict,
        description="parameter: value or values; all leaves but those that `only` would choose",
    )
    members: ListOf[Annotated[MemberName, Holds("label")]] | None = Field(
        None, description="names of members, in place of leaves"
    )
    weight: Annotated[
        Annotated[Weight, Tag("number")] | Annotated[Ramp, Tag("ramp")], Discriminator(_form)
    ] = Field(1.0, description="of the whole group, in proportion to the other groups of the phase")


class Until(Model):
    """The end of a phase: more than a number of episodes, and enough recent success."""

    episodes: int = Field(0, ge=0, description="the phase lasts for more than this number of episodes")
    success: Probability = Field(0.0, description="and until the mean success of the last ones is this")
    over: int = Field(500, ge=1, le=100_000, description="how many of the last episodes count")


class Phase(Model):
    """The members of a phase, and its end; the last phase never ends."""

    name: Prose | None = Field(None, description="a few words for readers of the file")
    play: Annotated[ListOf[Group], Field(min_length=1)] | None = Field(
        None, description="groups of members; default all"
    )
    until: Until | None = Field(None, description="its end")

    @property
    def groups(self) -> tuple[Group, ...]:
        """Those of `play`, or the one of all members."""
        return self.play or (Group(),)


class Curriculum(Model):
    """The members of a suite that are played in training, phase by phase."""

    curriculum: Word = Field(description="the name of the curriculum")
    about: Prose | None = Field(None, description="one sentence for readers of the file")
    share: Literal["episodes", "frames"] = Field(
        "episodes",
        description="what the weights share out; with `frames` a member is drawn the less often, "
        "the longer its latest episodes were",
    )
    phases: Annotated[ListOf[Phase], Field(min_length=1)] = Field(description="one after another")
