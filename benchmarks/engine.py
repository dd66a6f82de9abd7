"""Measures engines for `make bench`, ours and others, in one run on one core."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Final

from benchmarks.comparison import measure_limit, measure_peer
from benchmarks.machine import load, machine, on_cores
from benchmarks.many_programs import different_programs
from benchmarks.ours import PROGRAMS, Ours
from benchmarks.peers import LIMITS, PEERS
from benchmarks.reference_loop import reference_speed
from benchmarks.report import Report
from benchmarks.start_up import waits

OWN_PARTS: Final = ("ours", "rules", "programs", "start")


@dataclass(frozen=True)
class Plan:
    """What to measure.

    Attributes:
        scenarios: names or paths, at least one.
        batches: environments stepped together.
        mixes: how the agent's actions are generated: walk, random.
        repetitions: of each measurement.
        seconds: how long each repetition takes, about.
        parts: names of what is measured: of `OWN_PARTS`, peers and limits; everything if empty.
    """

    scenarios: Sequence[str]
    batches: Sequence[int]
    mixes: Sequence[str]
    repetitions: int
    seconds: float
    parts: Collection[str] = ()

    def holds(self, part: str) -> bool:
        """Whether this part is wanted."""
        return not self.parts or part in self.parts


def parts() -> list[str]:
    """Names of all that can be measured."""
    return [*OWN_PARTS, *(peer.name for peer in PEERS), *(limit.name for limit in LIMITS)]


def measure_engine(plan: Plan, note: Callable[[str], None]) -> Report:
    """Measure what was planned, one after another.

    Args:
        plan: what.
        note: told of each part that begins.
    """
    busy = load()
    ours = Ours(plan.batches, plan.repetitions, plan.seconds)
    with on_cores(1):
        report = Report(machine(), busy, plan.repetitions, reference_speed(plan.repetitions))
        _measure_ours(report, ours, plan, note)
        for limit in LIMITS:
            if plan.holds(limit.name):
                note(f"the limit: {limit.what}")
                measure_limit(report, limit, plan.mixes, plan.batches, plan.repetitions, plan.seconds)
        for peer in PEERS:
            if plan.holds(peer.name):
                note(f"{peer.name}: {peer.workload}")
                measure_peer(report, peer, plan.batches, plan.repetitions, plan.seconds)
    if plan.holds("start"):
        note("the start of a process")
        try:
            report.waits += waits(plan.scenarios[0], plan.repetitions)
        except RuntimeError as error:  # what was measured before is reported all the same
            report.missing["start"] = str(error)
    return report


def _measure_ours(report: Report, ours: Ours, plan: Plan, note: Callable[[str], None]) -> None:
    report.memory += [ours.memory(name) for name in plan.scenarios]
    if plan.holds("ours"):
        for mix in plan.mixes:
            for name in plan.scenarios:
                note(f"{name}, {mix}")
                report.rows += ours.scenario(name, mix)
            if len(plan.scenarios) > 1:
                report.rows.append(ours.together(plan.scenarios, mix))
    if plan.holds("rules"):
        note("many rules")
        report.rows += ours.rules(plan.scenarios[0])
    if plan.holds("programs"):
        note(f"{PROGRAMS} programs")
        report.rows += ours.programs(different_programs(PROGRAMS))
