"""`socialai report --curves`: the learning curves of several runs in one picture and one table."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.cli.errors import Exit
from socialai_dsl.errors import UsageError
from socialai_dsl.runs.folder import METRICS

if TYPE_CHECKING:
    from socialai_dsl.reporting.analysis import Summary

_ROWS: Final = 8
_WORTH_SHOWING: Final = 0.005


def draw_curves(runs: Sequence[Path], out: Path) -> Exit:
    """Group the runs by everything but their seed, draw them, and print a table in Markdown."""
    from socialai_dsl.reporting.analysis import Summary
    from socialai_dsl.reporting.collect import read_runs
    from socialai_dsl.reporting.plots import conditions_figure

    try:
        experiment = read_runs(runs)
    except ValueError as error:
        raise UsageError(str(error)) from error
    for run in experiment.runs:
        if run.updates() is None:
            said = "; ".join(run.problems) or f"it has no {METRICS} that can be read"
            raise UsageError(f"{run.folder}: expected the folder of a run that has learned, {said}")
    summaries = [Summary(condition) for condition in experiment.conditions]
    conditions_figure(summaries).savefig(out)
    for summary in summaries:
        print(_table(summary))
    print(f"written to {out}")
    return Exit.GOOD


def _table(summary: "Summary") -> str:
    """Success of each seed, and the mean rates of outcomes and rules, at a few moments, as Markdown."""
    import numpy as np

    from socialai_dsl.reporting.seeds import mean_over_seeds

    seeds = summary.seeds
    assert seeds is not None, "internal: every run has a curve"
    step = max(1, len(seeds.frames) // _ROWS)
    moments = range(step - 1, len(seeds.frames), step)
    means = {name: mean_over_seeds(rate) for name, rate in seeds.rates.items()}
    rates = {name: rate for name, rate in means.items() if np.nanmax(rate, initial=0.0) >= _WORTH_SHOWING}
    head = ["frames", *(f"run {number + 1}" for number in range(len(seeds.success)))]
    head += [name.partition("/")[2] for name in rates]
    lines = [f"\n{summary.name}\n", f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for moment in moments:
        cells = [f"{seeds.frames[moment] / 1e6:.2f} M"]
        cells += [_shown(value) for value in seeds.success[:, moment]]
        cells += [_shown(rate[moment]) for rate in rates.values()]
        lines.append(f"| {' | '.join(cells)} |")
    test = ", ".join(f"{rate:.3f}" for rate in summary.success)
    return "\n".join([*lines, "", f"test set: {test}"])


def _shown(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.2f}"
