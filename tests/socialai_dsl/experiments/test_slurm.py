"""Experiments as jobs: with submitit's imitation of a cluster, and what is told to a real one."""

import os
import signal
import stat
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.experiments import work
from socialai_dsl.experiments.driver import drive
from socialai_dsl.experiments.engines import MissingEngineError
from socialai_dsl.experiments.engines.slurm import Job, SlurmEngine

submitit = pytest.importorskip("submitit", reason="install the extra slurm")

pytestmark = pytest.mark.filterwarnings(
    "ignore::ResourceWarning"
)  # submitit leaves its jobs' pipes to the collector


@pytest.fixture
def prepared(place: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """An experiment whose folder is ready, and nothing is done."""
    monkeypatch.setattr("socialai_dsl.cli.experiment_run.work_on", lambda *_: 0)
    assert place.run() == 0
    return place


def test_all_runs_come_to_their_end_as_jobs(prepared, monkeypatch):
    monkeypatch.setattr("socialai_dsl.experiments.engines.slurm.Job", PretendJob)
    engine = SlurmEngine(prepared.out, 1, 2, {"timeout_min": 5}, cluster="local")
    ends = {}
    for _ in drive(
        prepared.out, list(prepared.runs().values()), engine, lambda run, *end: ends.update({run.label: end})
    ):
        pass
    assert ends == dict.fromkeys(prepared.runs(), ("done", ""))
    assert {run.status.state for run in prepared.runs().values()} == {"done"}


class PretendJob(Job):
    """A job whose runs are those of `pretend`."""

    def __call__(self) -> work.End:
        import pretend  # its folder is in PYTHONPATH

        return pretend.perform(self.folder, self.run_id)


def test_a_job_that_is_interrupted_is_submitted_again_as_it_was():
    job = Job("somewhere", "abc")
    again = job.checkpoint()
    assert isinstance(again, submitit.helpers.DelayedSubmission)
    assert again.function is job


def test_a_machine_is_taken_away(prepared, monkeypatch):
    """The job is queued again by its cluster, and the run goes on from its checkpoint."""
    monkeypatch.setattr("socialai_dsl.experiments.engines.slurm.Job", PretendJob)
    monkeypatch.setenv("PRETEND_SECONDS", "0.2")
    engine = SlurmEngine(prepared.out, 1, 1, {"timeout_min": 5}, cluster="local")
    run = prepared.runs()["none, seed 0"]
    (job,) = engine.submit(prepared.out, [run.id])
    prepared.until(lambda: run.checkpoint_frames)
    status = Path(f"/proc/{run.status.attempts[-1]['pid']}/stat").read_text()
    parent = int(status.rpartition(")")[2].split()[1])
    os.kill(parent, signal.SIGUSR2)  # as Slurm does some time before it takes a machine away
    assert job.result() == ("done", "")
    assert [attempt["reason"] for attempt in run.status.attempts] == ["stopped", "done"]
    assert run.status.attempts[1]["from_frames"] > 0


def test_what_slurm_is_told(prepared, tmp_path, monkeypatch):
    """A cluster of shell scripts, which keep what they are given."""
    commands = tmp_path / "bin"
    commands.mkdir()
    for name, text in {
        "sbatch": f'cp "$1" {tmp_path}/script.sh; echo Submitted batch job 4321',
        "srun": "true",
        "sacct": "true",
        "scancel": f'echo "$@" >> {tmp_path}/cancelled',
    }.items():
        (commands / name).write_text(f"#!/bin/sh\n{text}\n")
        (commands / name).chmod(stat.S_IRWXU)
    monkeypatch.setenv("PATH", f"{commands}{os.pathsep}{os.environ['PATH']}")
    given = {"timeout_min": 600, "slurm_partition": "cpu"}
    engine = SlurmEngine(prepared.out, 2, 2, given)
    jobs = engine.submit(prepared.out, [run.id for run in prepared.runs().values()])
    assert [job.job_id for job in jobs] == ["4321_0", "4321_1", "4321_2"]
    told = (tmp_path / "script.sh").read_text().splitlines()
    for line in (
        "#SBATCH --array=0-2%2",
        "#SBATCH --cpus-per-task=2",
        "#SBATCH --job-name=socialai",
        "#SBATCH --mem=4GB",
        "#SBATCH --partition=cpu",
        "#SBATCH --requeue",
        "#SBATCH --time=600",
    ):
        assert line in told
    assert any(line.startswith("#SBATCH --signal=USR2@") for line in told), (
        "so that a job is queued again in time"
    )
    assert any(line.startswith("srun ") and "submitit.core._submit" in line for line in told)
    engine.stop()
    assert "4321_0" in (tmp_path / "cancelled").read_text()


def test_where_there_is_no_slurm(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.raises(MissingEngineError, match="Slurm cannot be used from here"):
        SlurmEngine(tmp_path, 1, 1, {})


def test_a_parameter_that_is_none(tmp_path):
    with pytest.raises(ValueError, match=r"--slurm: .*minutes"):
        SlurmEngine(tmp_path, 1, 1, {"minutes": 3}, cluster="local")
