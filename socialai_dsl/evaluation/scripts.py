"""How many rooms a scenario's script solves, and whether the others can be solved."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from socialai_dsl.analysis.effort import Clock, why_no_more
from socialai_dsl.analysis.search import Finding, search_rooms
from socialai_dsl.envs.factory import make_vec
from socialai_dsl.episodes.play import AGENT, EachRoom, Observer, Rooms, Step, play
from socialai_dsl.episodes.policies import ScriptedPolicy
from socialai_dsl.episodes.room_sets import RoomSet
from socialai_dsl.episodes.scripts import with_script

_TOGETHER: Final = 250
_ROOMS_SHOWN: Final = 12
UNPROVEN: Final = ", as far as chance was tried"
VERDICTS: Final = {
    "unsolvable": "cannot be solved",
    "solvable": "can be solved: a fault of the script, or only luck would find it",
    "undecided": "are undecided: too many states, or too little time",
}
"""What may be found of a room that the script does not solve -> the same in words."""


@dataclass(frozen=True)
class UnsolvedRoom:
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
class ScriptReport:
    """The result of a scenario's own script.

    Attributes:
        scenario: what was played, without the script.
        seed: of the environments. planned: how many rooms there should be.
        rooms: how many were played, numbers 0 to rooms - 1 of the seed.
        solved: how many of them the script solved, in `mean_length` steps on average (0 if none).
        unsolved: the others. searched: how many of these were searched.
        interrupted: whether Ctrl-C ended it.
    """

    scenario: str
    seed: int
    planned: int
    rooms: int
    solved: int
    mean_length: float
    unsolved: tuple[UnsolvedRoom, ...]
    searched: int
    interrupted: bool

    @property
    def success_rate(self) -> float:
        """Share of rooms that the script solved; 0 of none."""
        return self.solved / self.rooms if self.rooms else 0.0

    @property
    def success_se(self) -> float:
        """Binomial standard error of the share."""
        return math.sqrt(self.success_rate * (1 - self.success_rate) / self.rooms) if self.rooms else 0.0

    @property
    def ceiling(self) -> float:
        """Share of rooms that were not found to be unsolvable: no policy succeeds more often."""
        return 1 - len(self.found("unsolvable")) / self.rooms if self.rooms else 1.0

    def found(self, verdict: str) -> tuple[UnsolvedRoom, ...]:
        """The unsolved rooms with this verdict."""
        return tuple(room for room in self.unsolved if room.verdict == verdict)

    def lines(self) -> list[str]:
        """The report in a few lines."""
        if not self.rooms:
            return [f"{self.scenario}: no room was played", *self._shortage()]
        rate, error = self.success_rate, self.success_se
        lines = [
            f"{self.scenario}: {self.solved:,} of {self.rooms:,} rooms solved, {rate:.2%} ± {error:.2%}, "
            f"in {self.mean_length:.1f} steps; no policy succeeds in more than {self.ceiling:.2%}"
        ]
        for verdict, meaning in VERDICTS.items():
            if rooms := self.found(verdict):
                proven = "" if all(room.exact for room in rooms) or verdict != "unsolvable" else UNPROVEN
                lines.append(f"  {len(rooms)} {meaning}{proven} (seed {self.seed}, index {_indices(rooms)})")
        return [*lines, *self._shortage()]

    def _shortage(self) -> Iterator[str]:
        why = why_no_more(self.interrupted)
        if self.rooms < self.planned:
            yield f"  of {self.planned:,} rooms there was time to play {self.rooms:,}; {why}"
        if self.searched < len(self.unsolved):
            yield f"  of {len(self.unsolved):,} unsolved rooms there was time to search {self.searched:,}; {why}"

    def as_object(self) -> dict[str, Any]:
        """The report for JSON."""
        return {
            **asdict(self),
            "success_rate": self.success_rate,
            "success_rate_se": self.success_se,
            "ceiling": self.ceiling,
        }


def _indices(rooms: Sequence[UnsolvedRoom]) -> str:
    """The first of the rooms; the JSON has them all."""
    shown = ", ".join(str(room.index) for room in rooms[:_ROOMS_SHOWN])
    more = len(rooms) - _ROOMS_SHOWN
    return shown + (f" and {more} more" if more > 0 else "")


def play_script(
    scenario: str, rooms: int, seed: int, states: int, clock: Clock | None = None
) -> ScriptReport:
    """Let the script play, then search every room that it left unsolved.

    Args:
        scenario: a path or a name, with a script for the agent or a variant `oracle` that has one.
        rooms: how many.
        seed: of the environments; environment i plays its first episode.
        states: how many states a search may look at.
        clock: when to stop early; searches have what is left after half of its time. With a clock, Ctrl-C ends with
            what is known.

    Raises:
        UsageError: there is no script.
    """
    scripted, whole = with_script(scenario).name, Clock() if clock is None else clock
    played = _Played(rooms)
    findings: list[Finding] = []
    with whole.until_interrupted():
        _play(scripted, played, seed, whole.part(2))
        for finding in _search(scenario, played.failed, seed, states, whole):
            findings.append(finding)
    if clock is None and whole.interrupted:
        raise KeyboardInterrupt
    success = played.success[: played.rooms]
    found = [
        UnsolvedRoom(
            index, played.outcomes[index], f.verdict.value, f.exact, len(f.plan) if f.plan else None, f.states
        )
        for index, f in zip(played.failed, findings, strict=False)
    ]
    unsearched = played.failed[len(findings) :]
    found += [
        UnsolvedRoom(index, played.outcomes[index], "undecided", False, None, 0) for index in unsearched
    ]
    return ScriptReport(
        scenario=scenario,
        seed=seed,
        planned=rooms,
        rooms=played.rooms,
        solved=int(success.sum()),
        mean_length=float(played.lengths[: played.rooms][success].mean()) if success.any() else 0.0,
        unsolved=tuple(found),
        searched=len(findings),
        interrupted=whole.interrupted,
    )


class _Played(Observer):
    """How the script's episodes ended. Rooms count block by block, so that no length is favoured when time runs out."""

    def __init__(self, rooms: int) -> None:
        self.over, self.success = np.zeros(rooms, np.bool_), np.zeros(rooms, np.bool_)
        self.lengths, self.outcomes = np.zeros(rooms, np.int64), [""] * rooms

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        self.lengths[step.numbers[step.running]] += 1
        for room in np.flatnonzero(step.ended).tolist():
            number = int(step.numbers[room])
            self.over[number], self.success[number] = True, step.success[room]
            self.outcomes[number] = rooms.env.outcomes[step.outcome[room]]

    @property
    def rooms(self) -> int:
        """How many count: the blocks from the first one on that are over."""
        return len(self.over) if self.over.all() else int(self.over.argmin()) // _TOGETHER * _TOGETHER

    @property
    def failed(self) -> list[int]:
        """The rooms that it did not solve."""
        return [room for room in range(self.rooms) if not self.success[room]]


def _play(scripted: str, played: _Played, seed: int, clock: Clock) -> None:
    """Play one episode in each room."""
    rooms = len(played.over)
    envs: Any = make_vec(scripted, num_envs=min(rooms, _TOGETHER), copy=False, autoreset_mode="Disabled")

    def over() -> bool:
        clock.progress(f"{scripted}: {int(played.over.sum())} of {rooms} rooms played")
        return clock.is_over

    try:
        agenda = EachRoom(rooms, rooms=RoomSet.of_seed(seed))
        play(Rooms(envs, [played]), {AGENT: ScriptedPolicy(envs)}, agenda, over)
    finally:
        envs.close()


def _search(scenario: str, indices: list[int], seed: int, states: int, clock: Clock) -> Iterator[Finding]:
    """What is found of these rooms, one after the other, until the clock is over."""
    if not indices or clock.is_over:
        return
    envs = make_vec(scenario, num_envs=len(indices))
    try:
        envs.reset(seed=seed, options={"index": indices})
        for number, finding in enumerate(search_rooms(envs, list(range(len(indices))), states, clock), 1):
            yield finding
            clock.progress(f"{scenario}: {number} of {len(indices)} unsolved rooms searched")
    finally:
        envs.close()
