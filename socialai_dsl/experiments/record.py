"""The file `experiment.json` as a model: what an experiment's folder says is run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

Words = Annotated[str, BeforeValidator(lambda value: "" if value is None else value)]
"""A text that may be left out, or null, which is the same."""


class Record(BaseModel):
    """A part of a JSON file; keys that are not needed here are passed over."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class Reference(Record):
    """A published figure.

    Attributes:
        mean: success rate, 0 to 1. std: its standard deviation over seeds; None where it was not published.
        n: the number of seeds; None where it was not published.
        deviation: what `std` divides by, n - 1 (`sample`) or n (`population`).
        note: what is to be known about it. source: where it was published.
    """

    mean: float = Field(ge=0, le=1)
    std: float | None = Field(None, ge=0)
    n: int | None = Field(None, ge=2)
    deviation: Literal["sample", "population"] = "sample"
    note: Words = ""
    source: Words = ""


class ConditionEntry(Record):
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


class RunEntry(Record):
    """A run of a condition; its folder is `runs/<id>`."""

    id: str
    condition: str
    seed: int


class ExperimentRecord(Record):
    """`experiment.json`."""

    format: Literal[1]
    name: str
    profile: Words = ""
    about: Words = ""
    source_sha256: str = ""
    conditions: list[ConditionEntry]
    runs: list[RunEntry]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        names = {condition.name for condition in self.conditions}
        for run in self.runs:
            if run.condition not in names:
                raise ValueError(f"run {run.id!r} is of the condition {run.condition!r}, which is not listed")
            if run.id == ".." or Path(run.id).name != run.id:
                raise ValueError(f"run {run.id!r}: expected the name of a folder in `runs`")
        return self
