"""What `make bench ARGS=--train` measured, as text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from benchmarks.training_speed import Comparison, Row, TrainingReport

_IDLE: Final = 0.5


def training_table(report: TrainingReport) -> str:
    """The report as text."""
    cores = "one core" if report.threads == 1 else f"{report.threads} cores"
    own = [row for row in report.rows if row.distinct is not None]
    lines = [
        f"{report.machine}; {cores}; {report.scenario}",
        ", ".join(f"{name} {version}" for name, version in report.versions.items()),
        f"reference loop: {report.reference / 1e6:.0f} M iterations per CPU second",
        *_busy(report.load),
        "",
        f"{'name':<18} {'envs x steps':>12} {'parts':>5} {'epochs':>6} {'histories':<19} {'numbers':<8} "
        f"{'frames/s':>9} {'slowest':>8} {'fastest':>8} {'per cpu s':>9} {'n':>3}",
        *(_speed(row) for row in report.rows),
        "frames/s: rollout and all epochs, on the clock, median of n updates",
    ]
    if own:
        lines += ["", f"{'name':<18} {'distinct':>8} {'rollout':>7}"]
        lines += [_work(row) for row in own]
        lines.append("distinct: share of the frames computed in the update; rollout: its share of the time")
    if report.comparisons:
        lines += ["", f"{'ours':<18} {'peer':<12} {'clock':>7} {'cpu':>7}"]
        lines += [_comparison(comparison) for comparison in report.comparisons]
    else:
        lines += ["", "no peer was measured"]
    return "\n".join(lines)


def _busy(load: float | None) -> list[str]:
    """A warning if the machine was not ours."""
    if load is None or load < _IDLE:
        return []
    return [f"other work was running (load {load:.1f} before): trust the times per CPU second"]


def _speed(row: Row) -> str:
    return (
        f"{row.name:<18} {f'{row.num_envs} x {row.horizon}':>12} {row.minibatches:>5} {row.epochs:>6} {row.words:<19} "
        f"{row.precision:<8} {row.wall:>9,.0f} {row.wall_low:>8,.0f} {row.wall_high:>8,.0f} {row.cpu:>9,.0f} "
        f"{row.updates:>3}"
    )


def _work(row: Row) -> str:
    return f"{row.name:<18} {row.distinct:>8.2f} {f'{100 * (row.rollout_share or 0):.0f} %':>7}"


def _comparison(comparison: Comparison) -> str:
    return f"{comparison.ours:<18} {comparison.peer:<12} {comparison.wall:>6.1f}x {comparison.cpu:>6.1f}x"
