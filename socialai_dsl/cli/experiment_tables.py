"""The tables of an experiment's runs, from the figures of `experiments.figures`: plan, estimated time, progress."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from socialai_dsl.cli.terminal import columns
from socialai_dsl.experiments.figures import grouped, share_done

_STATES: Final = ("done", "running", "waiting", "failed", "cancelled")
_MESSAGES_SHOWN: Final = 10


def plan_text(figures: Mapping[str, Any], each: bool) -> str:
    """The plan for people."""
    header = ("condition", "seeds", "frames", "frames/s", "time left", "state")
    rows = [
        (
            name,
            _numbers(row["seed"] for row in group),
            _range([row["frames"] for row in group]),
            _speed(group),
            _time(group),
            _states(row["state"] for row in group),
        )
        for name, group in grouped(figures["runs"], each)
    ]
    sources = dict.fromkeys(row["speed_from"] for row in figures["runs"] if row["speed_from"])
    lines = [_title(figures), "", *columns([header, *rows]), ""]
    unknown, seconds = figures["unknown"], figures["seconds"]
    known = [] if seconds is None else [clock(seconds)]
    time = " and ".join(known + ([f"an unknown time (of {unknown} runs, see --measure)"] if unknown else []))
    lines.append(f"{len(figures['runs'])} runs, {figures['workers']} at once: {time} left")
    besides = f"starting and testing add {clock(figures['seconds_besides'])} a run"
    lines.append(f"speeds are from {'; '.join(sources)}; {besides}" if sources else besides)
    return "\n".join(lines)


def status_text(figures: Mapping[str, Any], each: bool) -> str:
    """The state of things for people."""
    header = ("condition", "seeds", "frames done", "success", "state")
    rows = [
        (
            name if not each else f"{name}  {group[0]['id']}",
            _numbers(row["seed"] for row in group),
            f"{share_done(group):.0%}",
            _range_of_shares([r["success_rate"] for r in group if r["success_rate"] is not None]),
            _states(row["state"] for row in group),
        )
        for name, group in grouped(figures["runs"], each)
    ]
    states = _states(row["state"] for row in figures["runs"])
    lines = [_title(figures), "", *columns([header, *rows]), "", states]
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


def _states(states: Iterable[str]) -> str:
    """`3 done, 1 running`; of a single run its state alone."""
    counted = Counter(states)
    if counted.total() == 1:
        return next(iter(counted))
    return ", ".join(f"{counted[state]} {state}" for state in _STATES if counted[state])


def _speed(group: Sequence[Mapping[str, Any]]) -> str:
    """The speeds of runs that train."""
    speeds = [row["frames_per_second"] for row in group if row["frames"]]
    return "unknown" if None in speeds else _range(speeds) or "-"


def _time(group: Sequence[Mapping[str, Any]]) -> str:
    times = [row["seconds"] for row in group]
    return "unknown" if None in times else clock(sum(times))


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
