"""Plays many rooms with a scenario's own script, and searches those that it does not solve."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.cli.errors import UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from socialai_dsl.analysis.effort import Clock
    from socialai_dsl.analysis.search import Finding

_TOGETHER: Final = 1000


@dataclass(frozen=True)
class Room:
    """A room that the script did not solve.

    Attributes:
        index: `env.reset(seed=SEED, options={"index": index})` is in it.
        outcome: how the script's episode ended.
        verdict: solvable, unsolvable or undecided.
        exact: whether that is proven: False where chance during the episode could not be tried in full.
        steps: length of a success that was found; None without one.
        states: how many states were looked at.
    """

    index: int
    outcome: str
    verdict: str
    exact: bool
    steps: int | None
    states: int


@dataclass(frozen=True)
class OracleReport:
    """How a scenario's own script did.

    Attributes:
        scenario: what was played, without the script.
        seed: of the environments. rooms: how many were played, numbers 0 to rooms - 1 of the seed.
        solved: how many of them the script solved, in `mean_length` steps on average (0 if none).
        unsolved: the others.
    """

    scenario: str
    seed: int
    rooms: int
    solved: int
    mean_length: float
    unsolved: tuple[Room, ...]

    @property
    def success_rate(self) -> float:
        """Share of rooms that the script solved."""
        return self.solved / self.rooms

    @property
    def success_se(self) -> float:
        """Binomial standard error of the share."""
        return math.sqrt(self.success_rate * (1 - self.success_rate) / self.rooms)

    @property
    def ceiling(self) -> float:
        """Share of rooms that were not found to be unsolvable: no policy succeeds more often."""
        return 1 - len(self.found("unsolvable")) / self.rooms

    def found(self, verdict: str) -> tuple[Room, ...]:
        """The unsolved rooms with this verdict."""
        return tuple(room for room in self.unsolved if room.verdict == verdict)


def play_oracle(
    scenario: str, rooms: int, seed: int, states: int, clock: "Clock | None" = None
) -> OracleReport:
    """Let the script play, then search every room that it left unsolved.

    Args:
        scenario: a path or a name, with a script for the agent or a variant `oracle` that has one.
        rooms: how many.
        seed: of the environments; environment i plays its first episode.
        states: how many states a search may look at.
        clock: is told how far it is.

    Raises:
        UsageError: there is no script.
    """
    import numpy as np

    scripted = _with_script(scenario)
    success, lengths = np.zeros(rooms, np.bool_), np.zeros(rooms, np.int64)
    outcomes = [""] * rooms
    for first in range(0, rooms, _TOGETHER):
        if clock is not None:
            clock.progress(f"{scenario}: {first} of {rooms} rooms played")
        indices = np.arange(first, min(first + _TOGETHER, rooms))
        _play(scripted, indices, seed, success, lengths, outcomes)
    failed = np.flatnonzero(~success).tolist()
    findings = _search(scenario, failed, seed, states, clock)
    unsolved = tuple(
        Room(index, outcomes[index], f.verdict.value, f.exact, len(f.plan) if f.plan else None, f.states)
        for index, f in zip(failed, findings, strict=True)
    )
    mean = float(lengths[success].mean()) if success.any() else 0.0
    return OracleReport(scenario, seed, rooms, int(success.sum()), mean, unsolved)


def _with_script(scenario: str) -> str:
    """The variant `oracle` of a scenario; where there is none, the scenario itself."""
    import socialai_dsl

    name, mark, parameters = scenario.partition("?")
    scripted = f"{name}+oracle{mark}{parameters}"
    try:
        socialai_dsl.load(scripted)
    except socialai_dsl.ScenarioError as error:
        if all(diagnostic.code == "S503" for diagnostic in error.diagnostics):
            return scenario
        raise
    return scripted


def _play(
    scripted: str,
    indices: "NDArray[np.int64]",
    seed: int,
    success: "NDArray[np.bool_]",
    lengths: "NDArray[np.int64]",
    outcomes: list[str],
) -> None:
    """Play one episode in each of these rooms and note how it ended."""
    import numpy as np

    import socialai_dsl

    envs: Any = socialai_dsl.make_vec(scripted, num_envs=len(indices), copy=False, autoreset_mode="Disabled")
    try:
        envs.reset(seed=seed, options={"index": indices})
        running = np.ones(len(indices), np.bool_)
        while running.any():
            _, _, terminated, truncated, infos = envs.step(_scripted_actions(envs, scripted))
            lengths[indices[running]] += 1
            now = running & (terminated | truncated)
            if now.any():
                success[indices[now]] = infos["success"][now]
                for row in np.flatnonzero(now).tolist():
                    outcomes[indices[row]] = envs.outcomes[infos["outcome"][row]]
                running &= ~now
    finally:
        envs.close()


def _scripted_actions(envs: Any, scripted: str) -> "NDArray[np.int64]":
    try:
        actions: NDArray[np.int64] = envs.scripted_actions()
    except ValueError:
        raise UsageError(f"{scripted}: the agent has no frame, and there is no variant `oracle`") from None
    return actions


def _search(
    scenario: str, indices: list[int], seed: int, states: int, clock: "Clock | None"
) -> "list[Finding]":
    import socialai_dsl
    from socialai_dsl.analysis.search import search_rooms

    if not indices:
        return []
    envs = socialai_dsl.make_vec(scenario, num_envs=len(indices))
    try:
        envs.reset(seed=seed, options={"index": indices})
        findings: list[Finding] = []
        for finding in search_rooms(envs, list(range(len(indices))), states):
            findings.append(finding)
            if clock is not None:
                clock.progress(f"{scenario}: {len(findings)} of {len(indices)} unsolved rooms searched")
        return findings
    finally:
        envs.close()
