"""The measurements of `make bench ARGS=--train`: frames per second of our trainer and of the peers."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Final

import numpy as np
import torch

from benchmarks.machine import load, machine, on_cores
from benchmarks.reference_loop import reference_speed
from benchmarks.training_entries import Entry, Update

_PATIENCE: Final = 2.5
_PACKAGES: Final = ("torch", "numpy", "gymnasium", "stable-baselines3", "sb3-contrib")
# Who is compared with whom: the same network on both sides, or one as large.
_PAIRS: Final = (
    ("paper-every-frame", "plain-loop"),
    ("paper", "plain-loop"),
    ("paper-bfloat16", "plain-loop"),
    ("paper-wide", "plain-loop"),
    ("paper-reference", "plain-loop"),
    ("paper", "clean-paper"),
    ("paper", "sb3-paper"),
    ("fast", "clean-fast"),
    ("fast", "sb3-fast"),
    ("fast-long", "clean-fast"),
    ("fast-long", "sb3-fast"),
)


@dataclass(frozen=True)
class Row:
    """One trainer's speed, in frames trained per second: rollout and all epochs.

    Attributes:
        name, what, num_envs, horizon, minibatches, epochs, words, precision: see `Entry`.
        updates: updates measured.
        wall, wall_low, wall_high: median, slowest and fastest update on the clock.
        cpu: median per second of CPU time of the process.
        distinct: share of the frames that were computed in the update; None for peers, who compute all.
        rollout_share: share of the time that went into the rollout; None for peers.
    """

    name: str
    what: str
    num_envs: int
    horizon: int
    minibatches: int
    epochs: int
    words: str
    precision: str
    updates: int
    wall: float
    wall_low: float
    wall_high: float
    cpu: float
    distinct: float | None
    rollout_share: float | None


@dataclass(frozen=True)
class Comparison:
    """How many times faster one of ours is than a peer.

    Attributes:
        ours, peer: names.
        wall, cpu: ratio of the medians.
    """

    ours: str
    peer: str
    wall: float
    cpu: float


@dataclass(frozen=True)
class TrainingReport:
    """Everything measured in one run.

    Attributes:
        load: threads that wanted a core in the minute before; None where the system does not tell.
        reference: iterations per second of the reference loop on one core.
    """

    machine: str
    versions: dict[str, str]
    scenario: str
    threads: int
    load: float | None
    reference: float
    rows: list[Row]
    comparisons: list[Comparison]

    def as_json(self) -> dict[str, Any]:
        """The report as a JSON-able object."""
        return asdict(self)


def measure_training(
    scenario: str,
    chosen: Sequence[Entry],
    threads: int,
    seconds: float,
    repetitions: int,
    note: Callable[[str], None],
) -> TrainingReport:
    """Measure the entries one after the other on `threads` cores.

    Args:
        scenario: name or path.
        chosen: what to measure.
        threads: cores, and threads of each trainer.
        seconds: how long each entry is measured, at least.
        repetitions: updates measured at least, unless they take 2.5 times as long.
        note: told each entry's speed as soon as it is known.
    """
    before, busy = torch.get_num_threads(), load()
    with on_cores(threads):
        reference = reference_speed(3)
        rows = []
        for entry in chosen:
            rows.append(_measure(entry, scenario, threads, seconds, repetitions))
            note(f"{entry.name}: {rows[-1].wall:,.0f} frames/s, {rows[-1].cpu:,.0f} per CPU second")
    torch.set_num_threads(before)
    return TrainingReport(
        machine(),
        _versions(),
        scenario,
        threads,
        busy,
        reference,
        rows,
        list(_compare(rows)),
    )


def _measure(entry: Entry, scenario: str, threads: int, seconds: float, repetitions: int) -> Row:
    training = entry.start(scenario, threads)
    next(training)  # compiles, allocates, and warms up
    walls: list[float] = []
    cpus: list[float] = []
    updates: list[Update] = []
    while sum(walls) < seconds or (len(walls) < repetitions and sum(walls) < _PATIENCE * seconds):
        wall, cpu = time.perf_counter(), time.process_time()
        update = next(training)
        walls.append(time.perf_counter() - wall)
        cpus.append(time.process_time() - cpu)
        if update is not None:
            updates.append(update)
    speeds = entry.frames / np.array(walls)
    frames = len(walls) * entry.frames
    learnt = sum(update.learnt_frames for update in updates)
    return Row(
        entry.name,
        entry.what,
        entry.num_envs,
        entry.horizon,
        entry.minibatches,
        entry.epochs,
        entry.words,
        entry.precision,
        len(walls),
        float(np.median(speeds)),
        float(speeds.min()),
        float(speeds.max()),
        float(np.median(entry.frames / np.maximum(cpus, 1e-9))),
        learnt / (frames * entry.epochs) if updates else None,
        sum(update.rollout_seconds for update in updates) / sum(walls) if updates else None,
    )


def _compare(rows: Sequence[Row]) -> Iterator[Comparison]:
    by_name = {row.name: row for row in rows}
    for ours, peer in _PAIRS:
        if ours in by_name and peer in by_name:
            mine, other = by_name[ours], by_name[peer]
            yield Comparison(ours, peer, mine.wall / other.wall, mine.cpu / other.cpu)


def _versions() -> dict[str, str]:
    found = {}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
