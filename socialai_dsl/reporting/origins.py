"""Blocks about origins: baselines, the runs, their machines, the methods."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Final
from urllib.parse import quote

from socialai_dsl.experiments.folder import REPLAY
from socialai_dsl.reporting.analysis import RISING, SOLVED, Analysis, Ceilings, Level, Summary
from socialai_dsl.reporting.collect import Run
from socialai_dsl.reporting.document import Block, Cell, Folded, Heading, Items, Meter, Table
from socialai_dsl.reporting.statistics import ALPHA, mean_interval
from socialai_dsl.reporting.wording import NONE, count_of, duration

_DIGEST: Final = 12


def ceiling_blocks(analysis: Analysis) -> Iterator[Block]:
    """What the scenarios' scripts, chance, and policies without NPCs get."""
    known = {name: one for name, one in analysis.ceilings.items() if one.oracle or one.random or one.alone}
    if not known:
        return
    yield Heading(2, "Who does not learn", "levels")
    yield Table(
        ["scenario", ">own script", ">random", ">without NPCs, at least"],
        [
            [Cell(name, tone="strong"), _level(one.oracle), _level(one.random), _level(one.alone)]
            for name, one in known.items()
        ],
        "Success ± standard error. Own script: the scenario's variant “oracle”. Random: "
        "every part of the action drawn uniformly. Without NPCs: a policy found by search that knows the whole "
        "room, and neither sees nor hears an NPC; so much at least can be had by guessing (socialai check --deep).",
    )


def _level(level: Level | None) -> Cell:
    if level is None:
        return NONE
    return Cell(f"{level.value:.3f} ± {level.error:.3f}", (level.source,), meter=Meter(level.value))


def run_blocks(analysis: Analysis, place: Path) -> Iterator[Block]:
    """Every run, in a table of a report that will lie at `place`."""
    rows = [
        [
            Cell(condition.entry.name),
            Cell(str(run.seed)),
            Cell(state_of(run), tone="" if run.state == "done" else "warning"),
            Cell(f"{run.frames:,}"),
            Cell(f"{run.figures.success_rate:.3f}") if run.figures is not None else NONE,
            Cell(f"{run.figures.mean_return:.3f}") if run.figures is not None else NONE,
            Cell(f"{run.figures.mean_length:.1f}") if run.figures is not None else NONE,
            Cell(duration(run.result.train_seconds)) if run.result is not None else NONE,
            Cell(f"{run.result.frames_per_second:,.0f}")
            if run.result is not None and run.result.frames_per_second
            else NONE,
            Cell(run.id, code=True),
            _replay(run, place),
        ]
        for condition in analysis.experiment.conditions
        for run in condition.runs
    ]
    yield Heading(2, "Runs", "runs")
    yield Folded(
        f"All {count_of(len(rows), 'run')}",
        [
            Table(
                [
                    "condition",
                    ">seed",
                    "state",
                    ">frames",
                    ">success",
                    ">return",
                    ">length",
                    ">time",
                    ">frames/s",
                    "folder",
                    "episodes",
                ],
                rows,
                "Success, return (sum of an episode's rewards) and length (steps): means over the test episodes. Time: "
                "of training alone. Frames: steps of all environments together.",
            )
        ],
    )


def _replay(run: Run, place: Path) -> Cell:
    """A link to the page on which episodes of a run can be watched."""
    page = run.folder / REPLAY
    if not page.is_file():
        return NONE
    return Cell("watch", link=quote(Path(os.path.relpath(page, place)).as_posix()))


def provenance_blocks(analysis: Analysis, version: str) -> Iterator[Block]:
    """Versions, machines, times and digests."""
    yield Heading(2, "What it ran on", "provenance")
    results = [run.result for run in analysis.experiment.runs if run.result is not None]
    packages: dict[str, Counter[str]] = {}
    for result in results:
        for package, number in result.versions.items():
            packages.setdefault(package, Counter())[number] += 1
    machines = Counter(_machine(run) for run in analysis.experiment.runs if run.starts)
    facts = [["report made by", f"socialai-dsl {version}"]]
    if analysis.experiment.source_sha256:
        facts.append(["experiment file, SHA-256", analysis.experiment.source_sha256])
    facts += [[name, _counted(counts)] for name, counts in packages.items()]
    facts += [
        ["ran on", f"{machine} ({count_of(count, 'run')})"] for machine, count in machines.most_common()
    ]
    seconds = sum(result.train_seconds for result in results)
    facts.append(["training time", f"{duration(seconds)}, all runs together, one after the other"])
    yield Table(["", ""], [[Cell(name), Cell(value, code="SHA" in name)] for name, value in facts])
    yield Folded(
        "Programs and configurations",
        [
            Table(
                ["condition", "scenario", "program", "configuration"],
                [
                    _identity(summary, analysis.ceilings.get(summary.condition.entry.scenario))
                    for summary in analysis.summaries
                ],
                f"First {_DIGEST} digits of SHA-256 digests: of the compiled scenario, and of config.json without the "
                "seed. Equal digests mean equal rules and equal settings.",
            )
        ],
    )


def _identity(summary: Summary, ceilings: Ceilings | None) -> list[Cell]:
    programs = dict.fromkeys(r.result.program_sha256 for r in summary.condition.done if r.result is not None)
    configurations = dict.fromkeys(run.digest for run in summary.condition.runs if run.digest)
    measured = ceilings.program_sha256 if ceilings is not None else ""
    changed = (
        ("the scenario has changed since",) if measured and programs and measured not in programs else ()
    )
    return [
        Cell(summary.name),
        Cell(summary.condition.entry.scenario, code=True),
        Cell(" ".join(p[:_DIGEST] for p in programs) or "–", changed, code=True),
        Cell(" ".join(c[:_DIGEST] for c in configurations) or "–", code=True),
    ]


def _machine(run: Run) -> str:
    start = run.starts[-1]
    threads = count_of(start.threads, "thread") if start.threads else "threads not recorded"
    processes = f", {start.processes} processes" if start.processes > 1 else ""
    return f"{start.device}, {start.cpu} instructions, {threads}{processes}"


def _counted(counts: Counter[str]) -> str:
    if len(counts) == 1:
        return next(iter(counts))
    return ", ".join(f"{value} ({count_of(count, 'run')})" for value, count in counts.most_common())


def method_blocks(analysis: Analysis) -> Iterator[Block]:
    """What all figures rest on, with sources."""
    yield Heading(2, "How it was computed", "methods")
    yield Items(
        [
            "A run's success is the share of its test episodes that ended in success; the rooms are the same for every "
            "agent, and actions are sampled.",
            "Standard deviations over seeds divide by n − 1. An interval of a mean over few seeds is wide: "
            + _interval_example(analysis),
            "Welch's test (Welch 1947) compares two groups of seeds; it takes seeds to be independent and normally "
            "distributed, which success rates near 0 or 1 are not.",
            f"Bonferroni's correction holds the chance of a single false finding in a table below {ALPHA}; it is "
            "strict, and what is not shown to differ may differ all the same.",
            "Hedges' g (Hedges 1981) is the difference of the means over the pooled standard deviation "
            "√(((n₁−1)s₁² + (n₂−1)s₂²) / (n₁+n₂−2)), times Γ(m/2) / (√(m/2) Γ((m−1)/2)) with m = n₁+n₂−2.",
            "Interquartile means and their intervals follow Agarwal, Schwarzer, Castro, Courville and Bellemare "
            "(2021), Deep reinforcement learning at the edge of the statistical precipice.",
            f"Too short: seeds without a result, fewer frames than asked for, or mean success in the last fifth of "
            f"training more than {RISING} above that in the fifth before, and below {SOLVED} on the test episodes.",
        ]
    )


def _interval_example(analysis: Analysis) -> str:
    """The interval of the condition with the widest one, as a warning."""
    found = [(s, mean_interval(s.success.values)) for s in analysis.summaries]
    wide = [(s, i) for s, i in found if i is not None]
    if not wide:
        return "here no condition has two seeds, so nothing is known about spread."
    summary, (low, high) = max(wide, key=lambda pair: pair[1][1] - pair[1][0])
    seeds = count_of(summary.success.n, "seed")
    return f"Student's 95 % interval is widest for {summary.name}, {low:.2f} to {high:.2f} with {seeds}."


def state_of(run: Run) -> str:
    """The state of a run in words."""
    if run.state == "done" and run.result is None:
        return "without a result"
    return "not begun" if run.state == "missing" else run.state
