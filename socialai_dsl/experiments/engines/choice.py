"""The engines by their names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from socialai_dsl.errors import UsageError
from socialai_dsl.experiments.engines import Engine, MissingEngineError
from socialai_dsl.experiments.engines.local import LocalEngine
from socialai_dsl.experiments.engines.ray import RayEngine
from socialai_dsl.experiments.engines.slurm import SlurmEngine
from socialai_dsl.experiments.request import threads, usual_workers


def engine_named(
    name: str,
    folder: Path,
    document: dict[str, Any],
    workers: int | None = None,
    address: str | None = None,
    parameters: Mapping[str, str | int] | None = None,
) -> Engine:
    """Get an engine ready for an experiment.

    Args:
        name: one of `ENGINES`.
        folder: the experiment's.
        document: what is run, as `experiment.json` has it.
        workers: runs at once (default: as many as this machine has cores for; on a cluster all).
        address: of the Ray cluster.
        parameters: of the Slurm jobs.

    Raises:
        UsageError: what the engine needs is not installed or not there, or a parameter is none.
    """
    cores, at_most = threads(document), workers or usual_workers(document)
    try:
        match name:
            case "ray":
                return RayEngine(address, cores, at_most)
            case "slurm":
                # A cluster has more cores than this machine: all jobs are submitted at once.
                return SlurmEngine(folder, cores, workers or len(document["runs"]), parameters or {})
    except (MissingEngineError, ValueError) as error:
        raise UsageError(str(error)) from None
    return LocalEngine(at_most)
