"""This module prints what `socialai bench --train` measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from socialai_dsl.cli.training_speed import Comparison, Row, TrainingReport


def training_table(report: TrainingReport) -> str:
    """The report as text."""
    cores = "one core" if report.threads == 1 else f"{report.threads} cores"
    limits = ", ".join(f"{value:,.0f} in {name}" for name, value in report.limits.items())
    lines = [
        f"{report.machine}; {cores}; {report.scenario}",
        ", ".join(f"{name} {version}" for name, version in report.versions.items()),
        f"reference loop: {report.reference / 1e6:.0f} M iterations per CPU second",
        f"convolutions of the paper's network, forward and backward, GFLOP/s: {limits}",
        "",
        f"{'name':<18} {'envs x steps':>12} {'parts':>5} {'epochs':>6} {'histories':<19} {'frames/s':>9} "
        f"{'slowest':>8} {'fastest':>8} {'per cpu s':>9} {'n':>3} {'distinct':>8} {'rollout':>7} {'numbers':<8} {'GFLOP/s':>7} {'of limit':>8}",
        *(_row(row) for row in report.rows),
        "",
        "frames/s: rollout and all epochs, on the clock, median of n updates; distinct: share of the frames "
        "computed",
        "in the update; rollout: its share of the time; GFLOP/s: the paper network's arithmetic that was done,",
        "of limit: in parts of its convolutions' speed with the same numbers",
    ]
    if report.comparisons:
        lines += ["", f"{'ours':<18} {'peer':<12} {'clock':>7} {'cpu':>7} {'floor':>6} {'scaled':>7}"]
        lines += [_comparison(comparison) for comparison in report.comparisons]
        lines.append(
            "scaled: the clock's ratio, with the floor in the place of a peer that is slower than it"
        )
    else:
        lines += [
            "",
            "no peer was measured; they are in the repository's benchmarks/, not in an installed package",
        ]
    return "\n".join(lines)


def _row(row: Row) -> str:
    distinct = "" if row.distinct is None else f"{row.distinct:.2f}"
    rollout = "" if row.rollout_share is None else f"{100 * row.rollout_share:.0f} %"
    share = "" if row.limit_share is None else f"{100 * row.limit_share:.0f} %"
    gflops = "" if row.gflops is None else f"{row.gflops:,.0f}"
    return (
        f"{row.name:<18} {f'{row.num_envs} x {row.horizon}':>12} {row.minibatches:>5} {row.epochs:>6} {row.words:<19} "
        f"{row.wall:>9,.0f} {row.wall_low:>8,.0f} {row.wall_high:>8,.0f} {row.cpu:>9,.0f} {row.updates:>3} "
        f"{distinct:>8} {rollout:>7} {row.precision:<8} {gflops:>7} {share:>8}"
    )


def _comparison(comparison: Comparison) -> str:
    floor = "" if comparison.floor is None else f"{comparison.floor:,.0f}"
    return (
        f"{comparison.ours:<18} {comparison.peer:<12} {comparison.wall:>6.1f}x {comparison.cpu:>6.1f}x {floor:>6} "
        f"{comparison.scaled:>6.1f}x"
    )
