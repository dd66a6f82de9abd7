"""Draws what `make bench` measured: steps per second over the number of environments."""

from pathlib import Path

from matplotlib.figure import Figure

from benchmarks.report import Report, Row

_STYLES = {"ours": "-o", "peer": ":s", "limit": "--^"}


def draw_report(report: Report, path: Path) -> None:
    """Write the figure; single environments stand at 1."""
    lines: dict[tuple[str, str], list[Row]] = {}
    for row in report.rows:
        single = " (single)" if row.batch == 0 else ""
        lines.setdefault((f"{row.what}, {row.mix}{single}", row.kind), []).append(row)
    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.subplots()
    for (label, kind), rows in lines.items():
        batches = [max(row.batch, 1) for row in rows]
        axes.loglog(batches, [row.speed.cpu for row in rows], _STYLES[kind], label=label, markersize=4)
    axes.set_xlabel("environments stepped together")
    axes.set_ylabel("steps per second of CPU time, one core")
    axes.set_title(report.machine, fontsize="small")
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(fontsize="x-small", loc="center left", bbox_to_anchor=(1, 0.5))
    figure.savefig(path, dpi=150)
