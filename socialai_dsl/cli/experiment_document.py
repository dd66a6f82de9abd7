"""What an experiment's file, name or folder says is run."""

import os
from argparse import Namespace
from pathlib import Path
from typing import Any

from socialai_dsl.checking.experiments import LoadedExperiment
from socialai_dsl.diagnostics import suggested
from socialai_dsl.errors import UsageError
from socialai_dsl.experiments.document import document_of
from socialai_dsl.experiments.folder import read_experiment
from socialai_dsl.frontend import load_experiment
from socialai_dsl.loader.reader import shipped_experiments
from socialai_dsl.loader.resolved import looks_like_path


def asked_for(arguments: Namespace) -> tuple[dict[str, Any], Path]:
    """What is to be run, and the folder for it."""
    given = Path(arguments.file)
    if given.is_dir():
        if arguments.out is not None or arguments.profile is not None:
            raise UsageError(
                f"{given} is a folder, which says itself what is run; --out and --profile are for files"
            )
        return read_experiment(given), given
    if not given.exists() and not looks_like_path(arguments.file):
        shipped = shipped_experiments()
        if arguments.file not in shipped:
            hint = suggested(arguments.file, shipped, f"; those that are shipped are {', '.join(shipped)}")
            raise UsageError(f"there is no experiment {arguments.file!r}{hint}")
        given = shipped[arguments.file]
    loaded = load_experiment(given)
    profile = _profile(loaded, arguments.profile)
    document = document_of(loaded, profile)
    name = document["name"]
    if profile is not None and profile != loaded.experiment.profile:
        name += f"-{profile}"
    return document, arguments.out or Path("runs") / "experiments" / name


def _profile(loaded: LoadedExperiment, asked: str | None) -> str | None:
    if asked is None:
        return loaded.experiment.profile
    if asked not in loaded.cells:
        profiles = loaded.experiment.profiles
        hint = suggested(asked, profiles, f"; the file's profiles are {', '.join(profiles) or 'none'}")
        raise UsageError(f"--profile: there is no {asked!r}{hint}")
    return asked


def threads(document: dict[str, Any]) -> int:
    """The cores that a run needs, whichever it is."""
    return max(int(condition["options"].get("threads", 1)) for condition in document["conditions"])


def workers(document: dict[str, Any]) -> int:
    """As many runs at once as this machine has cores for."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores // threads(document))
