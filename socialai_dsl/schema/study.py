"""A study as models: what participants read, play and are asked, who plays what in which order, and what is paid."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import Discriminator, Field, StringConstraints, Tag

from socialai_dsl.schema.experiment import Asked
from socialai_dsl.schema.holds import Holds
from socialai_dsl.schema.scenario import (
    NOT_BLANK,
    TEST_SET,
    ListOf,
    Model,
    Probability,
    Prose,
    Word,
    as_written,
)
from socialai_dsl.schema.suite import MemberName

PERSON: Final = "person"
"""Who has a seat that a participant plays."""

WHO: Final = (PERSON, "script", "random", "nobody")
"""Who can have a seat without being an agent, a rival or a language model."""

STANDING_IN: Final = WHO[1:]
"""Who can stand in for a person, likewise."""

_Told = Annotated[str, StringConstraints(pattern=NOT_BLANK, max_length=20_000)]
Told = Annotated[_Told, as_written(_Told | float | bool), Holds("told")]
"""What participants read, as it stands."""

_Title = Annotated[str, StringConstraints(min_length=1, max_length=200)]
Option = Annotated[_Title, as_written(_Title | float | bool), Holds("label")]

PageText = Annotated[_Told, as_written(_Told | float | bool), Holds("told")]
"""The name of a file that ends in .md, beside the study, or the text itself, both in Markdown."""

Who = Annotated[str, StringConstraints(min_length=1, max_length=1000), Holds("spelt")]
Seats = dict[Annotated[str, Holds("spelt")], Who]


def _is_mapping(value: Any) -> str:
    return "mapping" if isinstance(value, dict) else "word"


StandIns = Annotated[
    Annotated[Who, Tag("word")] | Annotated[Seats, Tag("mapping")], Discriminator(_is_mapping)
]
"""Who stands in for people: the same on all their seats, or by seat."""

Tell = Literal["nothing", "instructions"]
Seconds = Annotated[int, Field(ge=1, le=3600)]


class Criterion(Model):
    """When practice is over."""

    success: Probability = Field(description="share of the round's episodes that have to succeed")


class Practice(Model):
    """Episodes that do not count, in rounds until a participant can do it."""

    scenario: MemberName = Field(description="the scenario, with variants and parameters")
    episodes: int = Field(2, ge=1, le=100, description="episodes of a round")
    until: Criterion | None = Field(None, description="the criterion; without one there is one round")
    rounds: int = Field(
        3,
        ge=1,
        le=20,
        description="the largest number of rounds; then the study goes on, and the data say so",
    )
    tell: Tell | None = Field(None, description="what participants are told of the task, as for a block")


class Question(Model):
    """A question to participants."""

    id: Word = Field(description="its name in the data; each question of a study has its own")
    ask: Told = Field(description="the question")
    kind: Literal["text", "choice", "scale"] = Field(
        "text", description="the kind of answer: words, a choice, or a number of a scale"
    )
    options: Annotated[ListOf[Option], Field(min_length=2, max_length=100)] | None = Field(
        None, description="of a choice: what can be chosen"
    )
    start: int | None = Field(
        None, alias="from", ge=-1000, le=1000, description="of a scale: its first number"
    )
    to: int | None = Field(None, ge=-1000, le=1000, description="of a scale: its last number")
    ends: Annotated[ListOf[Option], Field(min_length=2, max_length=2)] | None = Field(
        None, description="of a scale: what its first and its last number mean"
    )
    optional: bool = Field(False, description="whether it may be left out")


Questions = Annotated[ListOf[Question], Field(max_length=200)]

Rooms = Annotated[
    Annotated[Literal["test"], Tag("word")]
    | Annotated[
        ListOf[Annotated[int, Field(ge=0, lt=TEST_SET)]],
        Field(min_length=1, max_length=TEST_SET),
        Tag("list"),
    ],
    Discriminator(lambda value: "list" if isinstance(value, list | tuple) else "word"),
]


class Block(Model):
    """Episodes of a scenario that count."""

    name: Word | None = Field(
        None, description="its name in the data; default: the scenario's name and its number"
    )
    scenario: MemberName = Field(description="the scenario, with variants and parameters")
    episodes: int = Field(ge=1, le=TEST_SET, description="the number of episodes")
    rooms: Rooms = Field(
        "test",
        description="`test`: rooms of the test set, in which agents are evaluated, from number 0 on, after those "
        "of earlier blocks with the same scenario; or a list of room numbers",
    )
    shuffle: bool = Field(
        False, description="whether each participant plays the rooms in a random order of their own"
    )
    view: Literal["both", "picture", "words"] = Field(
        "both", description="the form in which participants get what their seat sees"
    )
    seats: Seats | None = Field(
        None,
        description="member of the cast: its player: `person`, `script`, `random`, `nobody`, shipped:NAME, a "
        "checkpoint or run folder relative to this file, llm:MODEL, for the agent also rival:NAME; default: the agent "
        "is a person, the others follow their scripts",
    )
    wait: Seconds = Field(
        120, description="seconds after which a seat is filled by `stands_in` if no other person has come"
    )
    stands_in: StandIns = Field(
        "script",
        description="the player on the seat of a person who does not come, or leaves, as in `seats`: one for all such "
        "seats, or by member of the cast",
    )
    act_within: Seconds = Field(
        60,
        description="seconds that others wait for an act; then `stands_in` plays that step, and for a language model "
        "the script plays to the end of the episode",
    )
    away: Annotated[int, Field(ge=2, le=600)] = Field(
        10, description="seconds without a sign of a participant's page after which it counts as left"
    )
    tell: Tell | None = Field(
        None,
        description="what participants are told of the task; default: the scenario's `instructions` "
        "if it has some",
    )
    feedback: Literal["none", "outcome"] = Field(
        "outcome",
        description="`outcome`: participants are told after an episode whether it was a success; "
        "`none`: they are not",
    )
    groups: Annotated[ListOf[Annotated[int, Field(ge=1, le=100)]], Field(min_length=1)] | None = Field(
        None, description="numbers of the groups that play it; default: all"
    )
    questions: Questions = Field((), description="asked after the block")


class Assign(Model):
    """Who plays the blocks in which order. Each newcomer gets the group that has the fewest participants."""

    order: Literal["fixed", "balanced"] = Field(
        "fixed",
        description="`fixed`: as in the file; `balanced`: by a balanced Latin square, in which each block stands "
        "equally often at each place, and after each other block",
    )
    groups: int | None = Field(
        None, ge=1, le=100, description="the number of groups; default: as many as there are orders"
    )


class Pay(Model):
    """What participants are paid."""

    currency: Annotated[str, StringConstraints(pattern=r"^[A-Z]{3}$"), Holds("spelt")] = Field(
        "EUR", description="three letters, as of ISO 4217"
    )
    base: float | int = Field(
        0, ge=0, le=100_000, description="the amount for everybody who comes to the end"
    )
    bonus: float | int = Field(
        0, ge=0, le=10_000, description="the amount for each successful episode that counts"
    )


class Exclude(Model):
    """Whose data are marked as excluded in `participants`; nothing is ever left out of the files."""

    practice: bool = Field(False, description="those who did not reach the criterion of practice")
    unfinished: bool = Field(True, description="those who did not come to the end")
    success_below: Probability | None = Field(
        None, description="those with a smaller share of successful episodes among those that count"
    )
    faster_than: int | None = Field(
        None, ge=1, le=60_000, description="those whose median time to act is shorter; in milliseconds"
    )


class Recruit(Model):
    """Participants who come from a platform, by the address `/join`."""

    id: Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,63}$"), Holds("spelt")] = Field(
        "PROLIFIC_PID",
        description="the parameter of the address with the participant's id, which is kept in a file "
        "of its own",
    )
    on_return: Literal["resume", "refuse"] = Field(
        "resume",
        description="a participant who comes again with the same id goes on (`resume`), or is refused",
    )


class End(Model):
    """The last page."""

    code: Annotated[str, StringConstraints(min_length=1, max_length=80), Holds("label")] | None = Field(
        None, description="the completion code"
    )
    say: Told | None = Field(None, description="a text that is shown besides thanks")
    link: (
        Annotated[str, StringConstraints(pattern=r"^https://\S+$", max_length=1000), Holds("spelt")] | None
    ) = Field(None, description="the address to go to then, such as the platform's page of completion")


class Study(Model):
    """A study with people: consent, instructions, practice, blocks, questions, the end."""

    study: Word = Field(description="the name of the study")
    about: Prose | None = Field(None, description="one sentence for authors, which participants do not see")
    notes: Prose | None = Field(None, description="more for authors")
    language: Literal["en", "de", "fr"] = Field("en", description="the language of the page's own words")
    consent: PageText = Field(
        description="what participants agree to: a file that ends in .md, or the text itself",
        examples=["consent.md"],
    )
    instructions: ListOf[PageText] = Field(
        (), description="pages that are read before anything is played: files that end in .md, or texts"
    )
    practice: Practice | None = Field(None, description="episodes that do not count")
    blocks: Annotated[ListOf[Block], Field(min_length=1, max_length=50)] = Field(description="what is played")
    model: Asked | None = Field(None, description="how language models on seats are asked")
    assign: Assign = Field(Assign(), description="who plays the blocks in which order")
    participants: int | None = Field(None, ge=1, le=100_000, description="the largest number of participants")
    questions: Questions = Field((), description="asked at the end")
    pay: Pay | None = Field(None, description="the payment")
    exclude: Exclude = Field(Exclude(), description="whose data are marked as excluded")
    recruit: Recruit = Field(Recruit(), description="how participants come")
    end: End = Field(End(), description="the last page")
