"""Scenarios and suites without mistakes, ready to be compiled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import lcm
from typing import Any

from socialai_dsl.diagnostics import Diagnostic
from socialai_dsl.loader.resolved import ResolvedFile
from socialai_dsl.schema.scenario import Scenario
from socialai_dsl.schema.suite import Suite
from socialai_dsl.semantics.plans import CheckedScenario
from socialai_dsl.semantics.suite import SharedSpace
from socialai_dsl.source import DataPath


@dataclass(frozen=True)
class LoadedScenario:
    """A scenario without mistakes, ready for `compile`.

    Attributes:
        name: with variants, e.g. `talkitout+unsocial`.
        checked: its meaning, every name resolved.
        scenario: its shape, as pydantic models.
        resolved: its plain data with positions.
        warnings: findings that do not keep it from running.
    """

    name: str
    checked: CheckedScenario
    scenario: Scenario
    resolved: ResolvedFile
    warnings: tuple[Diagnostic, ...] = ()

    def __repr__(self) -> str:
        return f"<LoadedScenario {self.name}: {len(self.checked.entities)} entities, horizon {self.checked.horizon}>"


@dataclass(frozen=True)
class Start:
    """How a suite lets the episodes of a member start.

    Attributes:
        layout: a layout of the member, as plain data. place: where it stands in the suite's file.
    """

    layout: Mapping[str, Any]
    place: DataPath


@dataclass(frozen=True)
class LoadedSuite:
    """A suite without mistakes: scenarios of which each episode plays one.

    Attributes:
        name: with variants, e.g. `social_env+unsocial`.
        members: the scenarios in order.
        member_names: what the suite's file calls them.
        labels: of each member that is a leaf of a tree or is swept over, parameter -> value.
        weights: how likely each member is, in proportion to the others.
        starts: how each member's episodes start; None if they are drawn.
        in_sequence: whether an episode plays all of them, one after another.
        space: the action space and how each member's utterances are found in it.
        suite: the models. resolved: the data with its positions.
        warnings: findings that do not keep it from running.
    """

    name: str
    members: tuple[LoadedScenario, ...]
    member_names: tuple[str, ...]
    labels: tuple[Mapping[str, str], ...]
    weights: tuple[int, ...]
    starts: tuple[Start | None, ...]
    in_sequence: bool
    space: SharedSpace
    suite: Suite
    resolved: ResolvedFile
    warnings: tuple[Diagnostic, ...] = ()

    def __repr__(self) -> str:
        return f"<LoadedSuite {self.name}: {', '.join(self.member_names)}>"


Loaded = LoadedScenario | LoadedSuite
"""What `load` returns."""


def session_of(loaded: Loaded) -> int:
    """The number of successive episodes that share draws; of a suite the least common multiple over its members."""
    members = (loaded,) if isinstance(loaded, LoadedScenario) else loaded.members
    return lcm(*(member.checked.session for member in members))


def about_of(loaded: Loaded) -> str:
    """What a file says of itself."""
    data = loaded.resolved.data
    return str(data.get("about", "")) if isinstance(data, dict) else ""


def unscripted(loaded: Loaded) -> tuple[str, ...]:
    """The members of a suite, or the scenario, in which the agent follows no frame."""
    if isinstance(loaded, LoadedSuite):
        members = list(zip(loaded.member_names, loaded.members, strict=True))
    else:
        members = [(loaded.checked.name, loaded)]
    return tuple(name for name, one in members if not any(frame.entity == 0 for frame in one.checked.frames))
