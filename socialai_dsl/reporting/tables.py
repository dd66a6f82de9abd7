"""The figures of a report as tables for other programs: CSV, and Parquet where pyarrow is installed."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

from socialai_dsl.reporting.analysis import THRESHOLDS, Analysis, Summary, column_of, row_of
from socialai_dsl.reporting.collect import Condition, Run
from socialai_dsl.reporting.statistics import Spread, mean_interval

Rows = Sequence[Mapping[str, Any]]


def tables(analysis: Analysis) -> dict[str, Rows]:
    """Name of a table -> its rows, each with the same columns: runs, conditions, comparisons, rooms and outcomes."""
    return {
        "runs": [
            _run(condition, run) for condition in analysis.experiment.conditions for run in condition.runs
        ],
        "conditions": [_condition(summary) for summary in analysis.summaries],
        "comparisons": [
            {
                "group": section.group,
                "first": one.first,
                "second": one.second,
                "difference": one.test.difference,
                "welch_t": one.test.t,
                "degrees_of_freedom": one.test.degrees,
                "p": one.test.p,
                "p_bonferroni": one.adjusted,
                "hedges_g": one.test.g,
            }
            for section in analysis.sections
            for one in section.comparisons
        ],
        "rooms": [
            {
                "group": section.group,
                "first": one.first,
                "second": one.second,
                "rooms": one.rooms,
                "first_better": one.ahead,
                "second_better": one.behind,
                "difference": one.difference.value,
                "difference_low": one.difference.low,
                "difference_high": one.difference.high,
            }
            for section in analysis.sections
            for one in section.pairings
        ],
        "outcomes": [row for condition in analysis.experiment.conditions for row in _outcomes(condition)],
    }


def as_csv(rows: Rows) -> str:
    """Rows as CSV with a head; None is an empty field."""
    text = io.StringIO()
    if rows:
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return text.getvalue()


def as_parquet(rows: Rows) -> bytes | None:
    """Rows as a Parquet file; None where pyarrow is not installed."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        return None
    stream = pyarrow.BufferOutputStream()
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(list(rows)), stream)
    content: bytes = stream.getvalue().to_pybytes()
    return content


def _place(condition: Condition) -> dict[str, Any]:
    entry = condition.entry
    return {
        "condition": entry.name,
        "group": entry.group,
        "row": entry.row,
        "column": entry.column,
        "scenario": entry.scenario,
        "agent": entry.agent,
    }


def _run(condition: Condition, run: Run) -> dict[str, Any]:
    figures, result = run.figures, run.result
    return {
        **_place(condition),
        "id": run.id,
        "seed": run.seed,
        "state": run.state,
        "frames": run.frames,
        "success_rate": figures.success_rate if figures else None,
        "mean_return": figures.mean_return if figures else None,
        "mean_length": figures.mean_length if figures else None,
        "test_episodes": figures.episodes if figures else None,
        "replies": figures.replies if figures else None,
        "invalid_replies": figures.invalid_replies if figures else None,
        "tokens": figures.prompt_tokens + figures.completion_tokens if figures else None,
        "cost": figures.cost if figures else None,
        "train_seconds": result.train_seconds if result else None,
        "frames_per_second": result.frames_per_second if result else None,
        "tests": "; ".join(f"{name}={one.success_rate:.6g}" for name, one in run.tests.items()),
        "program_sha256": result.program_sha256 if result else None,
        "config_sha256": run.digest or None,
        "problems": "; ".join(run.problems),
    }


def _condition(summary: Summary) -> dict[str, Any]:
    success, reference, efficiency = summary.success, summary.reference, summary.efficiency
    interval = mean_interval(success.values)
    areas = Spread(efficiency.areas) if efficiency else Spread(())
    reached = efficiency.reached if efficiency else [()] * len(THRESHOLDS)
    return {
        **_place(summary.condition),
        "row": row_of(summary),
        "column": column_of(summary),
        "seeds": len(summary.condition.runs),
        "seeds_done": success.n,
        "success_mean": success.mean if success.n else None,
        "success_std": success.std,
        "success_low": interval[0] if interval else None,
        "success_high": interval[1] if interval else None,
        "published_mean": reference.mean if reference else None,
        "published_std": reference.std if reference else None,
        "published_source": reference.source if reference else None,
        "area_mean": areas.mean if areas.n else None,
        **{
            f"seeds_reaching_{level:.2f}": sum(frames is not None for frames in seeds)
            for level, seeds in zip(THRESHOLDS, reached, strict=True)
        },
        "tests": "; ".join(f"{name}={spread.mean:.6g}" for name, spread in summary.tests.items() if spread.n),
        "too_short": "; ".join(summary.short),
    }


def _outcomes(condition: Condition) -> list[dict[str, Any]]:
    """How often each outcome ended an episode and each rule fired in one, by run."""
    rows = []
    for run in condition.done:
        assert run.figures is not None, "internal: a run that is done has figures"
        endings = {ending.outcome: ending for ending in run.figures.endings}
        for kind, rates in (("outcome", run.figures.outcomes), ("rule", run.figures.rules)):
            for name, rate in rates.items():
                ending = endings.get(name) if kind == "outcome" else None
                rows.append(
                    {
                        "condition": condition.entry.name,
                        "id": run.id,
                        "seed": run.seed,
                        "kind": kind,
                        "name": name,
                        "per_episode": rate,
                        "file": ending.file if ending else None,
                        "line": ending.line if ending else None,
                    }
                )
    return rows
