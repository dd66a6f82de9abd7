"""Experiments whose runs are those of `pretend`, so that they take no time."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.atomic import write_json
from socialai_dsl.cli.main import main
from socialai_dsl.experiments import work
from socialai_dsl.experiments.document import document_of
from socialai_dsl.experiments.folder import EXPERIMENT, RUNS, PlannedRun, read_experiment, runs_of
from socialai_dsl.frontend import load_experiment

HERE = Path(__file__).parent

SMALL = """\
experiment: small
set: {scenario: dance, frames: 1000, checkpoint_every: 2, eval_episodes: 5}
conditions:
  - grid: {bonus: [none, cell]}
  - {name: chance, agent: random, tests: [help]}
"""
"""Three runs."""


class Place:
    """A folder with an experiment's file, and the commands given there."""

    def __init__(self, path: Path, document: dict[str, Any]) -> None:
        self.path = path
        self.document = document
        self.file = path / "small.yaml"
        self.out = path / "out"
        self.file.write_text(SMALL, encoding="utf-8")
        self.drivers: list[subprocess.Popen[bytes]] = []

    def socialai(self, *words: str) -> int:
        return main(["experiment", *words])

    def run(self, *words: str) -> int:
        return self.socialai("run", str(self.file), "--out", str(self.out), *words)

    def start(self, *words: str, seconds: float) -> subprocess.Popen[bytes]:
        """The command as a process of its own, with updates that take so many seconds."""
        script = (
            "import sys; from socialai_dsl.experiments import work; work.PROGRAM = 'pretend'; "
            "from socialai_dsl.cli.main import main; sys.exit(main(sys.argv[1:]))"
        )
        self.prepare()
        command = [sys.executable, "-c", script, "experiment", "run", str(self.out), *words]
        self.drivers.append(
            subprocess.Popen(
                command,
                env=os.environ | {"PRETEND_SECONDS": str(seconds)},
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
            )
        )
        return self.drivers[-1]

    def prepare(self) -> None:
        """The experiment's folder as a first `run` makes it, so that a command need not compile the scenario."""
        if not self.out.exists():
            (self.out / RUNS).mkdir(parents=True)
            write_json(self.out / EXPERIMENT, self.document)

    def runs(self) -> dict[str, PlannedRun]:
        """Label -> run."""
        return {run.label: run for run in runs_of(self.out, read_experiment(self.out))}

    def until(self, holds: Callable[[], Any], seconds: float = 20) -> Any:
        """Wait for something, and return it."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                found = holds()
            except (OSError, AssertionError):
                found = None
            if found:
                return found
            time.sleep(0.02)
        raise AssertionError("it did not happen")

    def at_work(self) -> PlannedRun | None:
        """A run that has got past a checkpoint, and not to its end."""
        for run in self.runs().values():
            if run.status.state == "running" and run.checkpoint_frames:
                return run
        return None


@pytest.fixture(scope="session")
def document(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    file = tmp_path_factory.mktemp("document") / "small.yaml"
    file.write_text(SMALL, encoding="utf-8")
    return document_of(load_experiment(file), None)


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, document: dict[str, Any]) -> Iterator[Place]:
    monkeypatch.setattr(work, "PROGRAM", "pretend")
    before = os.environ.get("PYTHONPATH")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, (str(HERE), str(HERE.parents[2]), before))))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    made = Place(tmp_path, document)
    yield made
    for driver in made.drivers:
        if driver.poll() is None:
            driver.send_signal(signal.SIGKILL)
        driver.communicate()
