"""A page about an experiment or about single runs and evaluations, with figures and tables."""

from __future__ import annotations

import contextlib
import importlib.util
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.atomic import write_text
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.levels import read_baselines, update_baselines
from socialai_dsl.experiments.folder import EXPERIMENT
from socialai_dsl.frontend import LoadedScenario, load
from socialai_dsl.runs.folder import METRICS, only_writer
from socialai_dsl.runs.people import is_study, with_people

if TYPE_CHECKING:  # these load pandas and Matplotlib, which are only there if reports were asked for
    from socialai_dsl.baselines import Baselines
    from socialai_dsl.reporting.analysis import Analysis, Summary
    from socialai_dsl.reporting.collect import Experiment

PAGE: Final = "index.html"
FIGURES: Final = "figures"
FOLDER: Final = "report"
BASELINES: Final = "baselines.json"


def report(
    folders: str | Path | Sequence[str | Path],
    out: str | Path | None = None,
    *,
    baselines: bool = True,
    tell: Callable[[str], None] = lambda line: None,
) -> Path:
    """Write a page about runs and evaluations of every kind of player, as `socialai report` does.

    Args:
        folders: that of an experiment, or those of runs and of scenarios in evaluations, such as `Evaluation.folder`;
            besides, those of studies, whose people are joined with all of them room by room, and what
            `socialai crossplay --out`, `socialai words --out` and `socialai check --pictures` wrote.
        out: folder to write (default: `report` in the experiment's folder, or here for runs).
        baselines: whether script, chance and success without NPCs are measured; otherwise only what is known is shown.
        tell: takes a line before each scenario that is measured, and for each study with which something is wrong.

    Returns:
        The page, which needs nothing outside the folder.

    Raises:
        UsageError: a folder is not what was expected, or a library is missing (a ValueError).
        OSError: a file cannot be read or written.
    """
    require_libraries()
    from socialai_dsl.reporting.analysis import analyse

    named = [folders] if isinstance(folders, str | Path) else list(folders)
    experiment, place, remarks = _experiment([Path(folder) for folder in named])
    for remark in remarks:
        tell(remark)
    there = place / FOLDER if out is None else Path(out)
    with only_writer(there):
        measured, notes = _baselines(experiment, there / BASELINES, baselines, tell)
        _write(analyse(experiment, measured, [*remarks, *notes]), there)
    return there / PAGE


def curves(folders: Sequence[Path], out: Path) -> list[Summary]:
    """Draw the learning curves of runs, as `socialai report --curves` does: seeds of one condition together.

    Args:
        folders: of runs.
        out: the picture, whose name says its format.

    Returns:
        Of each condition what is known of it, with its `seeds`.

    Raises:
        UsageError: a folder is not that of a run that has learned, or a library is missing (a ValueError).
        OSError: a file cannot be read or written.
    """
    require_libraries()
    from socialai_dsl.reporting.analysis import Summary
    from socialai_dsl.reporting.collect import read_runs
    from socialai_dsl.reporting.plots import conditions_figure

    try:
        experiment = read_runs(folders)
    except ValueError as error:
        raise UsageError(str(error)) from error
    for run in experiment.runs:
        if run.updates() is None:
            said = "; ".join(run.problems) or f"it has no {METRICS} that can be read"
            raise UsageError(f"{run.folder}: expected the folder of a run that has learned, {said}")
    summaries = [Summary(condition) for condition in experiment.conditions]
    conditions_figure(summaries).savefig(out)
    return summaries


def require_libraries(*libraries: str) -> None:
    """Say how to install what reports and pictures need, if it is missing.

    Args:
        libraries: by default all that a page needs.

    Raises:
        UsageError: a library is not installed.
    """
    for library in libraries or ("jinja2", "matplotlib", "pandas", "scipy"):
        if importlib.util.find_spec(library) is None:
            raise UsageError(f"reports need {library}: pip install 'socialai-dsl[report]'")


def _experiment(folders: list[Path]) -> tuple[Experiment, Path, list[str]]:
    """What the folders hold, where its report belongs, and remarks on the studies among them."""
    from socialai_dsl.reporting.collect import read_experiment, read_figures, read_runs, with_figures

    try:
        studies = [folder for folder in folders if is_study(folder)]
        figures = {folder: read_figures(folder) for folder in folders if folder not in studies}
        runs = [folder for folder, found in figures.items() if not found]
        if len(runs) == 1 and (runs[0] / EXPERIMENT).exists():
            experiment, place = read_experiment(runs[0]), runs[0]
        else:
            experiment, place = read_runs(runs), Path()
        found = with_figures(experiment, [one for some in figures.values() for one in some])
    except ValueError as error:
        raise UsageError(str(error)) from error
    if not studies:
        return _with_humans(found), place, []
    joined, remarks = with_people(found, studies)
    if not joined.conditions and len(studies) == len(folders):
        raise UsageError("; ".join(remarks))
    return _with_humans(joined), place, remarks


def _with_humans(experiment: Experiment) -> Experiment:
    """With the figures of people that the files of scenarios name as published, where they can be read."""
    from socialai_dsl.reporting.records import PublishedRecord

    humans = {}
    for scenario in experiment.scenarios:
        with contextlib.suppress(ScenarioError):
            loaded = load(scenario)
            published = loaded.scenario.published if isinstance(loaded, LoadedScenario) else ()
            if published:
                humans[scenario] = [PublishedRecord(**one.model_dump()) for one in published]
    return replace(experiment, humans=humans)


def _baselines(
    experiment: Experiment, file: Path, measures: bool, tell: Callable[[str], None]
) -> tuple[dict[str, Baselines], list[str]]:
    """Baselines by scenario, from an earlier report or measured now, and remarks."""
    if not measures:
        return read_baselines(file), []
    return update_baselines(experiment.scenarios, file, tell)


def _write(analysis: Analysis, out: Path) -> None:
    from socialai_dsl.reporting.page import render_page
    from socialai_dsl.reporting.plots import figures
    from socialai_dsl.reporting.style import saved
    from socialai_dsl.reporting.tables import tables

    folder = out / FIGURES
    folder.mkdir(exist_ok=True)
    drawings = {}
    for name, figure in figures(analysis).items():
        drawings[name] = saved(figure, "svg")
        (folder / f"{name}.svg").write_bytes(drawings[name])
        (folder / f"{name}.png").write_bytes(saved(figure, "png"))
    for name, table in tables(analysis).items():
        if not len(table):  # what an earlier report has left there is gone
            for kind in ("csv", "parquet"):
                (out / f"{name}.{kind}").unlink(missing_ok=True)
            continue
        write_text(out / f"{name}.csv", table.to_csv(index=False))
        if importlib.util.find_spec("pyarrow") is not None:
            table.to_parquet(out / f"{name}.parquet")
    page = render_page(analysis, drawings, version("socialai-dsl"), out)
    write_text(out / PAGE, page)  # last, so that its presence means a whole report
