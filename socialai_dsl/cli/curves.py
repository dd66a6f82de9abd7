"""`socialai curves`: draws the learning curves of several runs and prints their tables."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.cli.errors import Exit, UsageError
from socialai_dsl.cli.run_folder import RESULT, SETTINGS, read_json, scenario_folder_name

if TYPE_CHECKING:
    from socialai_dsl.reporting.seeds_figure import Condition

SUMMARY: Final = "draw the learning curves of several runs, seeds of one condition together"

_ROWS: Final = 8
_WORTH_SHOWING: Final = 0.005


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN_DIR", help="folders of finished runs")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("curves.png"),
        metavar="FILE",
        help="picture to write (default: curves.png)",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Group the runs by everything but their seed, draw them, and print a table in Markdown."""
    from socialai_dsl.cli.agents import require_trainer

    require_trainer()
    from socialai_dsl.reporting.seeds_figure import draw_conditions

    groups: dict[str, list[Path]] = {}
    for run in arguments.runs:
        groups.setdefault(_title(_read(run, SETTINGS)), []).append(run)
    conditions = [_condition(title, runs) for title, runs in groups.items()]
    draw_conditions(conditions, arguments.out)
    for condition in conditions:
        print(_table(condition))
    print(f"written to {arguments.out}")
    return Exit.GOOD


def _read(run: Path, name: str) -> dict[str, Any]:
    if not (run / name).is_file():
        raise UsageError(f"{run}: expected the folder of a finished run, it has no {name}")
    return read_json(run / name)


def _title(settings: dict[str, Any]) -> str:
    """What was run, without the seed."""
    from socialai_dsl.reporting.collect import unusual

    return ", ".join([scenario_folder_name(str(settings["scenario"])), *unusual(settings)])


def _condition(title: str, runs: list[Path]) -> "Condition":
    import socialai_dsl
    from socialai_dsl.cli.endings import endings_of
    from socialai_dsl.reporting.seeds import read_seeds
    from socialai_dsl.reporting.seeds_figure import Condition

    scenario = str(_read(runs[0], SETTINGS)["scenario"])
    loaded = socialai_dsl.load(scenario)
    endings = endings_of(loaded, socialai_dsl.compile(loaded))
    results = [_read(run, RESULT) for run in runs]
    try:
        seeds = read_seeds([run / "metrics.jsonl" for run in runs])
    except ValueError as error:
        raise UsageError(str(error)) from error
    successes = frozenset(ending.name for ending in endings if ending.success)
    words = {ending.name: ending.text for ending in endings}
    tests = [(float(result["frames"]), float(result["eval"]["success_rate"])) for result in results]
    return Condition(title, seeds, successes, words, tests)


def _table(condition: "Condition") -> str:
    """Success of each seed, and the mean rates of outcomes and rules, at a few moments, as Markdown."""
    import numpy as np

    from socialai_dsl.reporting.seeds import mean_over_seeds

    seeds = condition.seeds
    step = max(1, len(seeds.frames) // _ROWS)
    moments = range(step - 1, len(seeds.frames), step)
    means = {name: mean_over_seeds(rate) for name, rate in seeds.rates.items()}
    rates = {name: rate for name, rate in means.items() if np.nanmax(rate, initial=0.0) >= _WORTH_SHOWING}
    head = ["frames", *(f"run {number + 1}" for number in range(len(seeds.success)))]
    head += [name.partition("/")[2] for name in rates]
    lines = [f"\n{condition.title}\n", f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for moment in moments:
        cells = [f"{seeds.frames[moment] / 1e6:.2f} M"]
        cells += [_shown(value) for value in seeds.success[:, moment]]
        cells += [_shown(rate[moment]) for rate in rates.values()]
        lines.append(f"| {' | '.join(cells)} |")
    test = ", ".join(f"{rate:.3f}" for _, rate in condition.tests)
    return "\n".join([*lines, "", f"test set: {test}"])


def _shown(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.2f}"
