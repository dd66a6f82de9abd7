"""Runs on a Slurm cluster, by way of submitit: each is a job, queued again when Slurm takes its machine away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from socialai_dsl.experiments.engines import Handle, MissingEngineError
from socialai_dsl.experiments.work import End, perform

FOLDER: Final = "slurm"
"""Where the jobs' scripts and logs are, in the experiment's folder."""

_DEFAULTS: Final[Mapping[str, Any]] = {
    "timeout_min": 24 * 60,
    "mem_gb": 4,
    "slurm_job_name": "socialai",
    "slurm_additional_parameters": {"requeue": True},
}

_TIMEOUTS: Final = 1000
"""How often a job may come to its time limit and be queued again; a run goes on from where it was."""


class Job:
    """What a job does; submitit carries it to the machine, and calls `checkpoint` before that is taken away."""

    def __init__(self, folder: Path, run_id: str) -> None:
        self.folder = folder
        self.run_id = run_id

    def __call__(self) -> End:
        """Work on the run."""
        return perform(self.folder, self.run_id)

    def checkpoint(self, *_: Any, **__: Any) -> Any:
        """The same again: the run goes on from its newest checkpoint."""
        from submitit.helpers import DelayedSubmission

        return DelayedSubmission(self)


class SlurmEngine:
    """See `Engine`."""

    def __init__(
        self, folder: Path, threads: int, workers: int, given: Mapping[str, str | int], cluster: str = "slurm"
    ) -> None:
        """Get ready to submit jobs.

        Args:
            folder: the experiment's.
            threads: cores that each run needs.
            workers: runs at once.
            given: parameters of the jobs, as submitit names them: timeout_min, mem_gb, slurm_partition and so on.
            cluster: `slurm`, or `local`, which is submitit's own imitation of one.

        Raises:
            MissingEngineError: submitit is not installed, or there is no Slurm here.
            ValueError: a parameter is none.
        """
        try:
            import submitit
        except ImportError:
            raise MissingEngineError("the engine slurm needs: pip install 'socialai-dsl[slurm]'") from None
        try:
            self._executor: Any = submitit.AutoExecutor(
                folder / FOLDER, cluster=cluster, slurm_max_num_timeout=_TIMEOUTS
            )
        except RuntimeError as error:
            raise MissingEngineError(f"Slurm cannot be used from here: {error}") from None
        parameters = {**_DEFAULTS, "cpus_per_task": threads, "slurm_array_parallelism": workers, **given}
        try:
            self._executor.update_parameters(**parameters)
        except (NameError, TypeError, ValueError) as error:
            raise ValueError(f"--slurm: {error}") from None
        self._jobs: list[Any] = []

    def submit(self, folder: Path, run_ids: Sequence[str]) -> list[Handle]:
        """See `Engine.submit`; several are one array of jobs."""
        tasks = [Job(folder.resolve(), run_id) for run_id in run_ids]
        with self._executor.batch():
            jobs = [self._executor.submit(task) for task in tasks]
        self._jobs += jobs
        return jobs

    def stop(self) -> None:
        """See `Engine.stop`."""
        for job in self._jobs:
            if not job.done():
                job.cancel()
