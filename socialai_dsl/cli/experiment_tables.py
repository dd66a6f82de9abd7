"""The tables of an experiment's runs: plan, estimated time, progress."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from socialai_dsl.errors import UnreadableError
from socialai_dsl.experiments.estimate import Speeds
from socialai_dsl.experiments.folder import PlannedRun

_STATES: Final = ("done", "running", "waiting", "failed", "cancelled")
_MESSAGES_SHOWN: Final = 10


def plan_figures(
    document: Mapping[str, Any], folder: Path, runs: Sequence[PlannedRun], speeds: Speeds, workers: int
) -> dict[str, Any]:
    """The plan: each run with its state and the seconds left, and the sum.

    Args:
        document: of the experiment.
        folder: the experiment's.
        runs: its runs.
        speeds: what is known of the speed.
        workers: how many runs there are at once.
    """
    rows = []
    for run, row in zip(runs, _rows(document, runs), strict=True):
        speed = speeds.of(run.condition) if run.condition["frames"] else None
        known = {
            "frames_per_second": round(speed.frames_per_second, 1) if speed else None,
            "speed_from": speed.source if speed else None,
        }
        seconds = 0.0 if row["state"] in ("failed", "cancelled") else _remaining(speeds, run)
        rows.append(row | known | {"seconds": None if seconds is None else round(seconds, 1)})
    known_seconds = [row["seconds"] for row in rows if row["seconds"] is not None]
    return {
        **_head(document, folder),
        "workers": workers,
        "seconds": round(sum(known_seconds) / workers, 1),
        "seconds_besides": round(speeds.seconds_besides, 1),
        "unknown": len(rows) - len(known_seconds),
        "states": dict(Counter(row["state"] for row in rows)),
        "runs": rows,
    }


def seconds_left(runs: Sequence[PlannedRun], left: Sequence[PlannedRun]) -> float | None:
    """The seconds left of some runs, one after the other; None if the speed of one is unknown.

    Args:
        runs: all, which tell the speed.
        left: those that are asked about.
    """
    speeds = Speeds(runs)
    times = [_remaining(speeds, run) for run in left]
    known = [seconds for seconds in times if seconds is not None]
    return sum(known) if len(known) == len(times) else None


def _remaining(speeds: Speeds, run: PlannedRun) -> float | None:
    try:
        return speeds.remaining(run)
    except (OSError, UnreadableError):
        return 0.0  # such a run is not worked on


def status_figures(document: Mapping[str, Any], folder: Path, runs: Sequence[PlannedRun]) -> dict[str, Any]:
    """How far each run is."""
    rows = _rows(document, runs)
    return {**_head(document, folder), "states": dict(Counter(row["state"] for row in rows)), "runs": rows}


def _head(document: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    return {"name": document["name"], "profile": document["profile"], "folder": str(folder)}


def _rows(document: Mapping[str, Any], runs: Sequence[PlannedRun]) -> list[dict[str, Any]]:
    conditions: dict[str, list[str]] = {}
    for entry in document["runs"]:
        conditions.setdefault(entry["id"], []).append(entry["condition"])
    return [_row(run, conditions[run.id]) for run in runs]


def _row(run: PlannedRun, conditions: Sequence[str]) -> dict[str, Any]:
    status = run.shown_status
    done, success = 0, None
    try:
        result = run.result
        metrics = run.last_metrics if run.condition["frames"] else None
        done = int((result or metrics or {}).get("frames", 0))
        success = result["eval"]["success_rate"] if result else None
    except (OSError, UnreadableError):
        pass  # the state says what is wrong
    return {
        "id": run.id,
        "conditions": conditions,
        "seed": run.seed,
        "frames": run.condition["frames"] or 0,
        "frames_done": done,
        "state": status.state,
        "attempts": len(status.attempts),
        "success_rate": success,
        "message": status.message,
    }


def plan_text(figures: Mapping[str, Any], each: bool) -> str:
    """The plan for people."""
    header = ("condition", "seeds", "frames", "frames/s", "time left", "state")
    rows = [
        (
            name,
            _numbers(row["seed"] for row in group),
            _range([row["frames"] for row in group]),
            _range([row["frames_per_second"] for row in group if row["frames_per_second"]]) or "-",
            _time(group),
            _states(row["state"] for row in group),
        )
        for name, group in _groups(figures["runs"], each)
    ]
    sources = dict.fromkeys(row["speed_from"] for row in figures["runs"] if row["speed_from"])
    lines = [_title(figures), "", *_table(header, rows), ""]
    unknown = figures["unknown"]
    time = clock(figures["seconds"]) + (
        f", and {unknown} of unknown speed (see --measure)" if unknown else ""
    )
    lines.append(f"{len(figures['runs'])} runs, {figures['workers']} at once: {time} left")
    besides = f"{clock(figures['seconds_besides'])} a run are counted for starting and testing"
    lines.append(f"speeds are those of {'; '.join(sources)}; {besides}" if sources else besides)
    return "\n".join(lines)


def status_text(figures: Mapping[str, Any], each: bool) -> str:
    """The state of things for people."""
    header = ("condition", "seeds", "frames done", "success", "state")
    rows = [
        (
            name if not each else f"{name}  {group[0]['id']}",
            _numbers(row["seed"] for row in group),
            f"{_share(group):.0%}",
            _range_of_shares([r["success_rate"] for r in group if r["success_rate"] is not None]),
            _states(row["state"] for row in group),
        )
        for name, group in _groups(figures["runs"], each)
    ]
    states = _states(row["state"] for row in figures["runs"])
    lines = [_title(figures), "", *_table(header, rows), "", states]
    said = [row for row in figures["runs"] if row["message"]]
    lines += [
        f"{row['conditions'][0]}, seed {row['seed']} ({row['id']}): {row['message']}"
        for row in said[:_MESSAGES_SHOWN]
    ]
    if len(said) > _MESSAGES_SHOWN:
        lines.append(f"and {len(said) - _MESSAGES_SHOWN} more, see --json")
    return "\n".join(lines)


def clock(seconds: float) -> str:
    """Seconds in units that people plan with."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    if seconds < 90 * 60:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h" if seconds < 48 * 3600 else f"{seconds / 86_400:.1f} days"


def _title(figures: Mapping[str, Any]) -> str:
    profile = f", profile {figures['profile']}" if figures["profile"] else ""
    return f"{figures['name']}{profile}, in {figures['folder']}"


def _groups(rows: Sequence[dict[str, Any]], each: bool) -> list[tuple[str, list[dict[str, Any]]]]:
    if each:
        return [(" and ".join(row["conditions"]), [row]) for row in rows]
    groups: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        for condition in row["conditions"]:
            groups.setdefault(condition, []).append(row)
    return list(groups.items())


def _states(states: Iterable[str]) -> str:
    """`3 done, 1 running`; of a single run its state alone."""
    counted = Counter(states)
    if counted.total() == 1:
        return next(iter(counted))
    return ", ".join(f"{counted[state]} {state}" for state in _STATES if counted[state])


def _share(group: Sequence[Mapping[str, Any]]) -> float:
    """How much of the training is done; of agents that are not trained, how many have played."""
    pairs = [(float(row["frames_done"]), float(row["frames"])) for row in group]
    wanted = sum(frames for _, frames in pairs)
    if not wanted:
        return [row["state"] for row in group].count("done") / len(group)
    return sum(min(done, frames) for done, frames in pairs) / wanted


def _time(group: Sequence[Mapping[str, Any]]) -> str:
    known = [row["seconds"] for row in group if row["seconds"] is not None]
    return clock(sum(known)) if known else "-"


def _numbers(seeds: Iterable[int]) -> str:
    """`0-15`, or the seeds one by one if they do not follow each other."""
    found = sorted(seeds)
    if len(found) > 2 and found == list(range(found[0], found[-1] + 1)):
        return f"{found[0]}-{found[-1]}"
    return ", ".join(map(str, found))


def _range(values: Sequence[float]) -> str:
    if not values:
        return ""
    low, high = min(values), max(values)
    return f"{low:,.0f}" if low == high else f"{low:,.0f} to {high:,.0f}"


def _range_of_shares(values: Sequence[float]) -> str:
    if not values:
        return "-"
    mean = sum(values) / len(values)
    return f"{mean:.1%}" if len(values) == 1 else f"{mean:.1%} ({min(values):.1%} to {max(values):.1%})"


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[i]) for row in (header, *rows)) for i in range(len(header))]
    return [
        "  ".join(f"{cell:<{w}}" for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in (header, *rows)
    ]
