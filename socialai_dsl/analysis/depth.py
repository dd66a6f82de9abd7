"""The difficulty of a scenario: shortest successes, its script's success, success without others."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from socialai_dsl.analysis.advance import compiled
from socialai_dsl.analysis.alone import Alone, success_alone
from socialai_dsl.analysis.effort import Effort, OutOfTimeError
from socialai_dsl.analysis.properties import Trial
from socialai_dsl.analysis.search import Finding, SearchVerdict
from socialai_dsl.checking.loaded import LoadedScenario


@dataclass(frozen=True)
class Depth:
    """The difficulty of success in the rooms that were tried.

    Attributes:
        rooms: how many rooms were searched.
        steps: length of a shortest success in each room that can be solved, ascending.
        unsolvable: rooms without any success. undecided: rooms whose search gave up.
        unsolved: rooms that the script does not solve; None without a script.
        rivals: of each rival, the share of rooms that it solves.
        alone: what is possible where no NPC is seen or heard; None if there is none.
    """

    rooms: int
    steps: tuple[int, ...]
    unsolvable: tuple[int, ...]
    undecided: tuple[int, ...]
    unsolved: tuple[int, ...] | None
    rivals: dict[str, float]
    alone: Alone | None


def depth(trial: Trial, effort: Effort) -> Depth:
    """Search rooms, let the script play them, and try what a policy gets that knows of no NPC."""
    searching = replace(effort, clock=effort.clock.part(2))
    findings: list[Finding] = []
    unsolved, rivals, alone = None, dict[str, float](), None
    with suppress(OutOfTimeError), effort.clock.limiting():
        findings = list(trial.successes(searching, "shortest successes"))
        if trial.scripted is not None:
            unsolved = tuple((~trial.solved).nonzero()[0].tolist())
        rivals = {name: float(trial.solved_by(name).mean()) for name in trial.loaded.scenario.rivals}
        alone = without_npcs(trial.loaded, effort)
    return Depth(
        len(findings),
        tuple(sorted(finding.steps for finding in findings if finding.steps is not None)),
        _rooms(findings, SearchVerdict.UNSOLVABLE),
        _rooms(findings, SearchVerdict.UNDECIDED),
        unsolved,
        rivals,
        alone,
    )


def without_npcs(loaded: LoadedScenario, effort: Effort) -> Alone | None:
    """The success of a policy that neither sees nor hears an NPC; None without NPCs."""
    if all(entity.role != "npc" for entity in loaded.checked.entities):
        return None
    hidden = replace(loaded, checked=replace(loaded.checked, npcs_hidden=True))
    return success_alone(compiled(hidden), effort)


def _rooms(findings: Sequence[Finding], verdict: SearchVerdict) -> tuple[int, ...]:
    return tuple(room for room, finding in enumerate(findings) if finding.verdict is verdict)
