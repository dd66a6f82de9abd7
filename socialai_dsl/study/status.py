"""How far a study is, from its log alone."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from socialai_dsl.checking.studies import LoadedStudy
from socialai_dsl.study.log import FILE, Event, follow
from socialai_dsl.study.progress import Progress


@dataclass(frozen=True)
class Status:
    """How far a study is.

    Attributes:
        joined, declined, began, finished: participants. groups: of each group those who began, and those who finished.
        stages: what those do who have begun and not finished -> how many. won: successful episodes that count.
        pay: what those who finished get, in all; None where nothing is paid.
        simulated: whether it is a rehearsal.
        latest: the time of the last event.
    """

    joined: int
    declined: int
    began: int
    finished: int
    groups: tuple[tuple[int, int], ...]
    stages: dict[str, int]
    won: int
    pay: float | None
    latest: str
    simulated: bool = False


def status_of(loaded: LoadedStudy, folder: Path) -> Status:
    """How far the study in a folder is, also while its server runs.

    Raises:
        OSError, UnreadableError: its log cannot be read.
    """
    progress, latest, simulated = Progress(loaded), "", False

    def take(event: Event) -> None:
        nonlocal latest, simulated
        progress.apply(event)
        latest = event["time"]
        simulated = simulated or (event["event"] == "study" and bool(event.get("simulated")))

    follow(folder / FILE, take)
    people = list(progress.people.values())
    began = [person for person in people if person.group is not None]
    finished = [person for person in began if person.ended is not None]
    groups = tuple(
        (sum(p.group == number for p in began), sum(p.group == number for p in finished))
        for number in range(1, len(loaded.design.orders) + 1)
    )
    stages: Counter[str] = Counter()
    for person in began:
        if person.ended is None:
            stage, number = progress.stage(person)
            stages[{"page": "instructions", "asked": "questions"}.get(stage, _played(stage, number))] += 1
    pay = loaded.study.pay
    paid = None if pay is None else sum(pay.base + progress.bonus(person) for person in finished)
    declined = sum(person.declined for person in people)
    won = sum(person.won for person in people)
    counts = len(people), declined, len(began), len(finished)
    return Status(*counts, groups, dict(stages), won, paid, latest, simulated)


def _played(stage: str, number: int) -> str:
    return "practice" if number < 0 else f"block {number + 1}" if stage == "play" else stage
