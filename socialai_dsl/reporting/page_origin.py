"""Where the figures of a report come from: baselines, runs, machines, versions, digests."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final
from urllib.parse import quote

from markupsafe import Markup

from socialai_dsl.baselines import Baselines, Level
from socialai_dsl.reporting.analysis import Analysis, Summary
from socialai_dsl.reporting.collect import RunRecord
from socialai_dsl.reporting.written import NONE, Rows, count_of, duration, signed
from socialai_dsl.runs.folder import REPLAY

DIGEST: Final = 12
"""Digits of a digest that are shown."""


def baselines_part(baselines: Mapping[str, Baselines]) -> Rows:
    """What each scenario gives without learning."""
    rows = [
        {
            "scenario": name,
            "own script": _level(one.script),
            "random": _level(one.chance),
            "without NPCs, at least": _level(one.without_npcs),
        }
        for name, one in baselines.items()
    ]
    return [row for row in rows if set(row.values()) != {row["scenario"], NONE}]


def _level(level: Level | None) -> str:
    return NONE if level is None else f"{level.value:.3f} ± {level.error:.3f}\n{level.sample}"


def runs_part(analysis: Analysis, place: Path) -> Rows:
    """Every run, with its figures and a link to its replay."""
    return [
        {
            "condition": condition.entry.name,
            "seed": str(run.seed),
            "state": state_of(run),
            "frames": f"{run.frames:,}",
            "success": "\n".join(_successes(run)),
            "return": signed(getattr(run.figures, "mean_return", None), ".3f"),
            "length": signed(getattr(run.figures, "mean_length", None), ".1f"),
            "time": NONE if run.result is None else duration(run.result.train_seconds),
            "frames/s": signed(getattr(run.result, "frames_per_second", None) or None, ",.0f"),
            "folder": run.id,
            "episodes": _replay(run, place),
        }
        for condition in analysis.experiment.conditions
        if not condition.study
        for run in condition.runs
    ]


def _successes(run: RunRecord) -> Iterator[str]:
    """The success of the agent, then that of each other seat."""
    yield signed(getattr(run.figures, "success_rate", None), ".3f")
    if run.figures is not None:
        yield from (f"{seat} {part.success_rate:.3f}" for seat, part in run.figures.seats.items())


def _replay(run: RunRecord, place: Path) -> str:
    """A link to the page on which episodes of a run can be watched."""
    page = run.folder / REPLAY
    if not page.is_file():
        return NONE
    return Markup('<a href="{}">watch</a>').format(quote(Path(os.path.relpath(page, place)).as_posix()))


def facts_part(analysis: Analysis, version: str) -> Rows:
    """Versions, machines, times and digests."""
    runs = analysis.experiment.runs
    results = [run.result for run in runs if run.result is not None]
    facts = [("report made by", f"socialai-dsl {version}")]
    if analysis.experiment.source_sha256:
        facts.append(("experiment file, SHA-256", analysis.experiment.source_sha256))
    for package in dict.fromkeys(package for result in results for package in result.versions):
        counts = Counter(result.versions[package] for result in results if package in result.versions)
        several = ", ".join(f"{value} ({count_of(count, 'run')})" for value, count in counts.most_common())
        facts.append((package, several if len(counts) > 1 else next(iter(counts))))
    for machine, count in Counter(_machine(run) for run in runs if run.starts).most_common():
        facts.append(("ran on", f"{machine} ({count_of(count, 'run')})"))
    seconds = sum(result.train_seconds for result in results)
    facts.append(("training time", f"{duration(seconds)}, all runs together, one after the other"))
    return [{"what": name, "which": value} for name, value in facts]


def _machine(run: RunRecord) -> str:
    start = run.starts[-1]
    threads = count_of(start.threads, "thread") if start.threads else "threads not recorded"
    processes = f", {start.processes} processes" if start.processes > 1 else ""
    return f"{start.device}, {start.cpu} instructions, {threads}{processes}"


def identity_part(summary: Summary, baselines: Baselines | None) -> dict[str, str]:
    """The digests of a condition's programs and configurations."""
    programs = programs_of(summary)
    configurations = dict.fromkeys(run.digest for run in summary.condition.runs if run.digest)
    measured = baselines.program_sha256 if baselines is not None else ""
    changed = "\nthe scenario has changed since" if measured and programs and measured not in programs else ""
    return {
        "condition": summary.name,
        "scenario": summary.condition.entry.scenario,
        "program": (" ".join(p[:DIGEST] for p in programs) or NONE) + changed,
        "configuration": " ".join(c[:DIGEST] for c in configurations) or NONE,
    }


def state_of(run: RunRecord) -> str:
    """The state of a run, in words."""
    if run.state == "done" and run.result is None:
        return "without a result"
    return "not begun" if run.state == "missing" else run.state


def programs_of(summary: Summary) -> list[str]:
    """The digests of the programs that the runs of a condition have played, each once."""
    digests = [run.result.program_sha256 for run in summary.condition.done if run.result is not None]
    return list(dict.fromkeys(digests))
