"""`socialai report`: writes a page about an experiment or single runs, with figures and tables."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.atomic import write_text
from socialai_dsl.cli.arguments import refuse
from socialai_dsl.cli.curves import draw_curves
from socialai_dsl.cli.errors import Exit
from socialai_dsl.errors import UsageError
from socialai_dsl.runs.folder import only_writer

if TYPE_CHECKING:
    from socialai_dsl.baselines import Baselines
    from socialai_dsl.reporting.analysis import Analysis
    from socialai_dsl.reporting.collect import Experiment

SUMMARY: Final = "write a page with figures and tables about runs, finished or not"
FIGURES: Final = "figures"
FOLDER: Final = "report"
BASELINES: Final = "baselines.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "folders", nargs="+", type=Path, metavar="DIR", help="the folder of an experiment, or folders of runs"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder to write (default: `report` in the experiment's folder, or here for runs)",
    )
    parser.add_argument(
        "--curves",
        type=Path,
        metavar="FILE",
        help="draw only the learning curves, seeds of one condition together, and print them as a table",
    )
    parser.add_argument(
        "--no-baselines",
        action="store_true",
        help="do not measure script, chance and success without NPCs; show only what is known",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Read, compute, draw, write."""
    require_libraries()
    if arguments.curves is not None:
        refuse(arguments, ("out", "no_baselines"), "--curves draws the curves alone, into its own FILE")
        return draw_curves(arguments.folders, arguments.curves)
    from socialai_dsl.reporting.analysis import analyse

    experiment, place = _experiment(arguments.folders)
    out = arguments.out or place / FOLDER
    with only_writer(out):
        measured, notes = _baselines(experiment, out / BASELINES, arguments.no_baselines)
        _write(analyse(experiment, measured, notes), out)
    print(f"written to {out / 'index.html'}")
    return Exit.GOOD


def require_libraries() -> None:
    """Say how to install what reports need, if it is missing.

    Raises:
        UsageError: a library is not installed.
    """
    try:
        import jinja2  # noqa: F401
        import matplotlib  # noqa: F401
        import pandas  # noqa: F401
        import scipy  # noqa: F401
    except ImportError as error:
        raise UsageError(f"reports need {error.name}: pip install 'socialai-dsl[report]'") from None


def _experiment(folders: list[Path]) -> "tuple[Experiment, Path]":
    """What the folders hold, and where its report belongs."""
    from socialai_dsl.experiments.folder import EXPERIMENT
    from socialai_dsl.reporting.collect import read_experiment, read_runs

    try:
        if len(folders) == 1 and (folders[0] / EXPERIMENT).exists():
            return read_experiment(folders[0]), folders[0]
        return read_runs(folders), Path()
    except ValueError as error:
        raise UsageError(str(error)) from error


def _baselines(
    experiment: "Experiment", file: Path, only_known: bool
) -> "tuple[dict[str, Baselines], list[str]]":
    """Baselines by scenario, from an earlier report or measured now, and remarks."""
    from socialai_dsl.episodes.players import require_trainer
    from socialai_dsl.evaluation.levels import read_baselines, update_baselines

    if only_known:
        return read_baselines(file), []
    require_trainer()
    return update_baselines(experiment.scenarios, file, lambda line: print(line, file=sys.stderr, flush=True))


def _write(analysis: "Analysis", out: Path) -> None:
    import importlib.util
    from importlib.metadata import version

    from socialai_dsl.reporting.analysis import tables
    from socialai_dsl.reporting.page import render_page
    from socialai_dsl.reporting.plots import figures
    from socialai_dsl.reporting.style import saved

    folder = out / FIGURES
    folder.mkdir(exist_ok=True)
    drawings = {}
    for name, figure in figures(analysis).items():
        drawings[name] = saved(figure, "svg")
        (folder / f"{name}.svg").write_bytes(drawings[name])
        (folder / f"{name}.png").write_bytes(saved(figure, "png"))
    for name, table in tables(analysis).items():
        write_text(out / f"{name}.csv", table.to_csv(index=False) if len(table) else "")
        if len(table) and importlib.util.find_spec("pyarrow") is not None:
            table.to_parquet(out / f"{name}.parquet")
    page = render_page(analysis, drawings, version("socialai-dsl"), out)
    write_text(out / "index.html", page)  # last, so that its presence means a whole report
