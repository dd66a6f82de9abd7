"""The files of an experiment and its runs as models of exactly what a report reads."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from socialai_dsl.errors import first_mistake

_Words = Annotated[str, BeforeValidator(lambda value: "" if value is None else value)]
"""A text that may be left out, or null, which is the same."""


class _Record(BaseModel):
    """A part of a JSON file; what a report does not need is passed over."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class Reference(_Record):
    """A published figure.

    Attributes:
        mean: success rate, 0 to 1. std: its standard deviation over seeds; None where it was not published.
        note: what is to be known about it. source: where it was published.
    """

    mean: float = Field(ge=0, le=1)
    std: float | None = Field(None, ge=0)
    note: _Words = ""
    source: _Words = ""


class ConditionEntry(_Record):
    """One cell of a table, or one curve of a case study: what its runs have in common but for the seed.

    Attributes:
        name: unique. row, column: its place in the table of its group.
        group: `table2`, the name of a case study, or None.
        scenario: with variants and parameters. agent: who plays. frames: to train for; None if nobody is trained.
        tests: further scenarios that its agents were tested on.
        reference: published figure of the scenario itself. test_references: of the tests.
    """

    name: str
    row: str | None = None
    column: str | None = None
    group: str | None = None
    scenario: str
    agent: str = "ppo"
    frames: int | None = None
    tests: list[str] = Field(default_factory=list)
    reference: Reference | None = None
    test_references: dict[str, Reference] = Field(default_factory=dict)


class RunEntry(_Record):
    """A run of a condition; its folder is `runs/<id>`."""

    id: str
    condition: str
    seed: int


class ExperimentRecord(_Record):
    """`experiment.json`."""

    format: Literal[1]
    name: str
    profile: _Words = ""
    about: _Words = ""
    source_sha256: str = ""
    conditions: list[ConditionEntry]
    runs: list[RunEntry]


class EndingRecord(_Record):
    """How test episodes ended, with the line of the scenario's file that says so."""

    outcome: str
    success: bool
    text: str
    file: str | None = None
    line: int | None = None
    share: float


class ProbeFigures(_Record):
    """How a language model answered a probe: how often it was asked, and right; the share that guessing gets right."""

    asked: int = Field(ge=0)
    right: int = Field(ge=0)
    chance: float | None = Field(None, ge=0, le=1)


class Figures(_Record):
    """What came of the test episodes: the object `eval` of a result.

    Attributes:
        replies, invalid_replies, prompt_tokens, completion_tokens, tokens_estimated, cost: of language models alone;
            `cost` in US dollars, None where prices are not known.
    """

    episodes: int = Field(ge=1)
    success_rate: float = Field(ge=0, le=1)
    mean_length: float
    mean_return: float
    outcomes: dict[str, float] = Field(default_factory=dict)
    endings: list[EndingRecord] = Field(default_factory=list)
    rules: dict[str, float] = Field(default_factory=dict)
    replies: int = Field(0, ge=0)
    invalid_replies: int = Field(0, ge=0)
    prompt_tokens: int = Field(0, ge=0)
    completion_tokens: int = Field(0, ge=0)
    tokens_estimated: bool = False
    cost: float | None = Field(None, ge=0)
    probes: dict[str, ProbeFigures] = Field(default_factory=dict)


class ResultRecord(_Record):
    """`result.json`."""

    frames: int = 0
    train_seconds: float = 0.0
    frames_per_second: float | None = None
    eval: Figures
    program_sha256: str = ""
    versions: dict[str, str] = Field(default_factory=dict)


class StatusRecord(_Record):
    """`status.json`; a run without it is judged by the files it has."""

    state: Literal["waiting", "running", "done", "failed", "cancelled"]
    message: str | None = None


class StartRecord(_Record):
    """A line of `starts.jsonl`."""

    cpu: str = ""
    device: str = ""
    threads: int = 0
    processes: int = 1


class UpdateRecord(_Record):
    """A line of `metrics.jsonl`.

    Attributes:
        frames: made so far. episodes: that ended in this update. success: share of them; None if none ended.
        outcomes: name -> share of them. rules: name -> firings per episode.
    """

    frames: int = Field(ge=0)
    episodes: int = Field(ge=0)
    success: float | None
    outcomes: dict[str, float | None]
    rules: dict[str, float | None]


def described(error: ValidationError) -> str:
    """Where the first mistake of a file is, and what."""
    return ": ".join(filter(None, first_mistake(error.errors())))
