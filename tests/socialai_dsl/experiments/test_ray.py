"""Experiments on a Ray cluster of two nodes that lose workers, a node and their driver."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.cli.main import main
from socialai_dsl.experiments import work
from socialai_dsl.experiments.folder import PlannedRun, read_experiment, runs_of

HERE = Path(__file__).parent
ROOT = HERE.parents[2]

EXPERIMENT = """\
experiment: faults
set: {frames: FRAMES, envs: 8, checkpoint_every: 1, eval_episodes: 10, seeds: SEEDS}
conditions:
  - grid: {scenario: [help, dance], bonus: [none, auto]}
overrides:
  - {where: {scenario: help}, set: {tests: [help_as_helper]}}
"""
"""Four conditions, whose runs have thirty updates each, with a checkpoint after each."""

UPDATES = 30


def runs_in(folder: Path) -> list[PlannedRun]:
    return runs_of(folder, read_experiment(folder)) if (folder / "experiment.json").exists() else []


def table(folder: Path) -> dict[str, Any]:
    """What the experiment found: success on each test set, and the digest of the weights of each run."""
    found = {}
    for run in runs_in(folder):
        result = run.result
        assert result is not None, run.label
        weights = sorted((run.folder / "checkpoints").glob("*.safetensors"))[-1]
        digest = result.get("digest") or hashlib.sha256(tensors_of(weights)).hexdigest()
        tested = {name: figures["success_rate"] for name, figures in run.tested.items()}
        found[run.label] = (result["eval"]["success_rate"], tested, weights.name, digest)
    return found


def tensors_of(file: Path) -> bytes:
    """The numbers of a checkpoint, without what says how they came about."""
    content = file.read_bytes()
    return content[8 + int.from_bytes(content[:8], "little") :]


def until(holds: Any, seconds: float) -> Any:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = holds()
        if found:
            return found
        time.sleep(0.1)
    raise AssertionError("it did not happen")


PRETENDING = """
import sys
import pretend
from socialai_dsl.cli.main import main
from socialai_dsl.experiments.engines import ray
ray.perform = pretend.perform
sys.exit(main(sys.argv[1:]))
"""
"""The command, whose workers know the runs of `pretend` alone."""


class Cluster:
    """Two nodes of a core each, and the command that has them work."""

    def __init__(self, place: Path, pretends: bool) -> None:
        from ray.cluster_utils import Cluster as Nodes

        self.pretends = pretends
        self.update, self.seeds = (100, 2) if pretends else (256, 5)
        self.file = place / "faults.yaml"
        text = EXPERIMENT.replace("FRAMES", str(UPDATES * self.update)).replace("SEEDS", str(self.seeds))
        self.file.write_text(text, encoding="utf-8")
        self.out = place / "out"
        settings = {"num_cpus": 1, "object_store_memory": 80_000_000, "include_dashboard": False}
        self.nodes = Nodes(initialize_head=True, head_node_args=settings)
        self.second = self.nodes.add_node(num_cpus=1, object_store_memory=80_000_000)
        self.nodes.wait_for_nodes()
        self.drivers: list[subprocess.Popen[bytes]] = []

    def start(self) -> subprocess.Popen[bytes]:
        program = ["-c", PRETENDING] if self.pretends else ["-m", "socialai_dsl"]
        command = [sys.executable, *program, "experiment", "run", str(self.file), "--out", str(self.out)]
        command += ["--engine", "ray", "--address", self.nodes.address]
        self.drivers.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT))
        return self.drivers[-1]

    def remove(self) -> None:
        """Lose the second node, without a word."""
        self.nodes.remove_node(self.second, allow_graceful=False)

    def add(self) -> None:
        self.second = self.nodes.add_node(num_cpus=1, object_store_memory=80_000_000)

    def under_way(self, *besides: str, second: bool = False) -> PlannedRun | None:
        """A run in training that has got past a checkpoint, perhaps one of a worker of the second node."""
        raylet = self.second.all_processes["raylet"][0].process.pid
        for run in runs_in(self.out):
            frames = run.checkpoint_frames or 0
            begun = run.status.state == "running" and 0 < frames < 20 * self.update
            if run.id not in besides and begun and (not second or parent_of(owner(run)) == raylet):
                return run
        return None

    def close(self) -> None:
        for driver in self.drivers:
            if driver.poll() is None:
                driver.kill()
            driver.communicate()
        self.nodes.shutdown()


def owner(run: PlannedRun) -> int:
    """Ray's worker that works on a run: the parent of the process that trains."""
    return parent_of(run.status.attempts[-1]["pid"]) or 0


def parent_of(pid: int) -> int | None:
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    except OSError:
        return None


@pytest.fixture(params=[True, False], ids=["pretending", "training"])
def cluster(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Cluster]:
    pytest.importorskip("ray", reason="install the extra ray")
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    monkeypatch.setenv("RAY_worker_niceness", "0")  # Ray's 15 would starve the runs on a busy machine
    monkeypatch.setenv("PRETEND_SECONDS", "0.3")
    places = (str(HERE), str(ROOT), os.environ.get("PYTHONPATH"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, places)))
    monkeypatch.chdir(tmp_path)
    if request.param:
        monkeypatch.setattr(work, "PROGRAM", "pretend")
    made = Cluster(tmp_path, request.param)
    yield made
    made.close()


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.filterwarnings("ignore")  # Ray's own
def test_nothing_is_lost_and_nothing_done_twice(cluster: Cluster, tmp_path: Path) -> None:
    driver = cluster.start()

    killed = until(cluster.under_way, 600)
    os.kill(owner(killed), signal.SIGKILL)  # Ray's worker, and with it the process that trains

    lost = until(lambda: cluster.under_way(killed.id, second=True), 600)
    cluster.remove()
    until(lambda: lost.shown_status.state == "waiting", 300)
    cluster.add()

    until(lambda: [run for run in runs_in(cluster.out) if run.status.state == "done"], 600)
    orphaned = until(lambda: cluster.under_way(killed.id, lost.id), 600)
    driver.kill()
    driver.wait()
    until(lambda: orphaned.shown_status.state == "waiting", 300)
    ends = {run.id: run.status.attempts for run in runs_in(cluster.out) if run.status.state == "done"}

    again = cluster.start()
    said, _ = again.communicate(timeout=1800)
    assert again.returncode == 0, said
    runs = runs_in(cluster.out)
    assert len(runs) == 4 * cluster.seeds
    for run in runs:
        status = run.status
        assert status.state == "done", run.label
        assert [attempt["reason"] for attempt in status.attempts].count("done") == 1
        assert all(attempt["ended"] is not None for attempt in status.attempts)
        frames = [
            json.loads(line)["frames"] for line in (run.folder / "metrics.jsonl").read_text().splitlines()
        ]
        assert frames == [cluster.update * (n + 1) for n in range(UPDATES)], "each update is there once"
        assert run.id not in ends or status.attempts == ends[run.id], "what was done is left alone"
    for run in (killed, lost, orphaned):
        assert any(attempt["from_frames"] > 0 for attempt in run.status.attempts), run.label
        assert len(run.status.attempts) >= 2

    undisturbed = tmp_path / "undisturbed"
    assert main(["experiment", "run", str(cluster.file), "--out", str(undisturbed)]) == 0
    assert table(cluster.out) == table(undisturbed)
