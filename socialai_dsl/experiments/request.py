"""What an experiment's file, name or folder says is run, and the folder for it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Final

from socialai_dsl.atomic import write_json
from socialai_dsl.checking.experiments import LoadedExperiment
from socialai_dsl.diagnostics import suggested
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.experiments.document import differences, document_of
from socialai_dsl.experiments.folder import EXPERIMENT, RUNS, PlannedRun, read_experiment, runs_of
from socialai_dsl.frontend import load_experiment
from socialai_dsl.loader.reader import shipped_experiments
from socialai_dsl.loader.shipped import file_named

_CHANGES_SHOWN: Final = 10


def requested(name: str, profile: str | None, out: Path | None) -> tuple[dict[str, Any], Path]:
    """What is to be run, as `experiment.json` has it, and the folder for it.

    Args:
        name: the file of an experiment, the name of one that ships, or the folder of one that was started.
        profile: of the file (default: the file's).
        out: the folder (default: `runs/experiments/NAME`, or `NAME-PROFILE` for a profile that is not the default).

    Raises:
        ScenarioError: the file, or a scenario, has mistakes.
        UsageError: there is no such experiment or profile, or the folder says itself what is run.
    """
    given = Path(name)
    if given.is_dir():
        if out is not None or profile is not None:
            raise UsageError(
                f"{given} is a folder, which says itself what is run; --out and --profile are for files"
            )
        return read_experiment(given), given
    loaded = load_experiment(file_named(name, "experiment", shipped_experiments()))
    chosen = _profile(loaded, profile)
    document = document_of(loaded, chosen)
    called = document["name"]
    if chosen is not None and chosen != loaded.experiment.profile:
        called += f"-{chosen}"
    return document, out or Path("runs") / "experiments" / called


def _profile(loaded: LoadedExperiment, asked: str | None) -> str | None:
    if asked is None:
        return loaded.experiment.profile
    if asked not in loaded.cells:
        profiles = loaded.experiment.profiles
        hint = suggested(asked, profiles, f"; the file's profiles are {', '.join(profiles) or 'none'}")
        raise OptionError("profile", f"there is no {asked!r}{hint}")
    return asked


def prepare(folder: Path, document: dict[str, Any], runs: Path | None, update: bool) -> None:
    """Make an experiment's folder, or see that it is one of the same experiment; the caller is its only writer.

    Args:
        folder: is there.
        document: what is to be run.
        runs: the folder of the runs, which other experiments may share (default: `runs` in the folder).
        update: let a folder of an earlier state of the experiment follow.

    Raises:
        UsageError: the folder is of another experiment, or its runs are elsewhere.
        OSError: it cannot be written.
    """
    if (folder / EXPERIMENT).exists():
        changed = differences(read_experiment(folder), document)
        if changed and not update:
            more = len(changed) - _CHANGES_SHOWN
            shown = changed[:_CHANGES_SHOWN] + ([f"and {more} more"] if more > 0 else [])
            listed = "".join(f"\n  {line}" for line in shown)
            raise UsageError(
                f"{folder} is of another experiment or of an earlier state of this one:{listed}\n"
                "Choose another --out; or let the folder follow with --update, which keeps the runs that are the same"
            )
    own = folder / RUNS
    if runs is not None and own.resolve() != runs.resolve():
        if own.exists() or own.is_symlink():
            raise OptionError("runs", f"{own} exists already, so its runs stay there")
        runs.mkdir(parents=True, exist_ok=True)
        own.symlink_to(runs.resolve(), target_is_directory=True)
    own.mkdir(exist_ok=True)
    write_json(folder / EXPERIMENT, document)


def chosen_runs(folder: Path, names: list[str]) -> list[PlannedRun]:
    """The runs of an experiment's folder that are named by their id or their condition, or all if nothing is named.

    Raises:
        UsageError: there is no such run, or no experiment.
    """
    document = read_experiment(folder)
    runs = runs_of(folder, document)
    if not names:
        return runs
    known: dict[str, set[str]] = {}
    for entry in document["runs"]:
        known.setdefault(entry["condition"], set()).add(entry["id"])
        known.setdefault(entry["id"], set()).add(entry["id"])
    for word in names:
        if word not in known:
            raise UsageError(f"RUN: {folder} has no run and no condition {word!r}{suggested(word, known)}")
    wanted = set().union(*(known[word] for word in names))
    return [run for run in runs if run.id in wanted]


def threads(document: dict[str, Any]) -> int:
    """The cores that a run needs, whichever it is."""
    return max(int(condition["options"].get("threads", 1)) for condition in document["conditions"])


def usual_workers(document: dict[str, Any]) -> int:
    """As many runs at once as this machine has cores for."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores // threads(document))
