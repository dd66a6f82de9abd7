"""Weights & Biases is told what happens, and can never stop a run."""

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from socialai_dsl.runs.tracking import TrackingWarning, WandbTracker
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.training import train
from tests.trainer.fake_envs import EchoEnvs

CONFIG = RunConfig(
    envs=8,
    horizon=8,
    minibatches=2,
    epochs=2,
    frames=6 * 8 * 8,
    threads=1,
    checkpoint_every=2,
    tensorboard=False,
)


class FakeRun:
    def __init__(self, options: dict[str, Any], step: int) -> None:
        self.options, self.step, self.finished = options, step, False
        self.logged: list[tuple[int, dict[str, float]]] = []
        self.fails_at: int | None = None

    def log(self, row: dict[str, float], step: int) -> None:
        if self.fails_at is not None and step >= self.fails_at:
            raise OSError("the network is gone")
        assert step >= self.step
        self.step = step
        self.logged.append((step, row))

    def finish(self) -> None:
        self.finished = True


class FakeWandb(ModuleType):
    """As much of the package as is used."""

    def __init__(self) -> None:
        super().__init__("wandb")
        self.runs: list[FakeRun] = []
        self.fails_at: int | None = None
        self.refuses = False

    def Settings(self, **options: Any) -> dict[str, Any]:  # noqa: N802 - the package's own name
        return options

    def init(self, **options: Any) -> FakeRun:
        if self.refuses:
            raise RuntimeError("no API key")
        earlier = [run for run in self.runs if run.options["id"] == options["id"]]
        run = FakeRun(options, earlier[-1].step + 1 if earlier else 0)
        run.fails_at = self.fails_at
        self.runs.append(run)
        return run


@pytest.fixture
def wandb(monkeypatch: pytest.MonkeyPatch) -> FakeWandb:
    fake = FakeWandb()
    monkeypatch.setitem(sys.modules, "wandb", fake)
    return fake


def test_a_run_is_sent_over_frames(wandb: FakeWandb, tmp_path: Path) -> None:
    tracker = WandbTracker("project", tmp_path, {"seed": 0}, "a run")
    train(CONFIG, EchoEnvs(8), tmp_path, tracker=tracker)
    (run,) = wandb.runs
    assert (run.options["project"], run.options["name"], run.options["config"]) == (
        "project",
        "a run",
        {"seed": 0},
    )
    assert [step for step, _ in run.logged] == [64 * update for update in range(1, 7)]
    assert {"loss", "outcomes/time_out", "rules/speaks"} <= set(run.logged[-1][1])
    assert run.finished


def test_a_resumed_run_goes_on_where_it_was(wandb: FakeWandb, tmp_path: Path) -> None:
    """The checkpoint is older than what was sent: that is made again, but not sent again."""
    tracker = WandbTracker("project", tmp_path, {}, "a run")

    def stop_at_5(progress: Any) -> None:
        if progress["update"] == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(CONFIG, EchoEnvs(8), tmp_path, tracker=tracker, progress=stop_at_5)
    again = WandbTracker("project", tmp_path, {}, "a run")
    train(CONFIG, EchoEnvs(8), tmp_path, tracker=again, resume=True)
    first, second = wandb.runs
    assert first.options["id"] == second.options["id"]
    assert [step // 64 for step, _ in first.logged] == [1, 2, 3, 4, 5]
    assert [step // 64 for step, _ in second.logged] == [6]


def test_a_failure_on_the_way_is_said_once_and_stops_nothing(wandb: FakeWandb, tmp_path: Path) -> None:
    wandb.fails_at = 3 * 64
    tracker = WandbTracker("project", tmp_path, {}, "a run")
    with pytest.warns(TrackingWarning, match=r"OSError: the network is gone.*training goes on") as caught:
        train(CONFIG, EchoEnvs(8), tmp_path, tracker=tracker)
    assert len(caught) == 1
    assert len((tmp_path / "metrics.jsonl").read_text().splitlines()) == 6
    assert len(wandb.runs[0].logged) == 2


def test_a_failure_at_the_start_is_explained(wandb: FakeWandb, tmp_path: Path) -> None:
    wandb.refuses = True
    tracker = WandbTracker("project", tmp_path, {}, "a run")
    with pytest.raises(ValueError, match="W&B cannot begin: RuntimeError: no API key"):
        train(CONFIG, EchoEnvs(8), tmp_path, tracker=tracker)


def test_it_has_to_be_installed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "wandb", None)
    with pytest.raises(ValueError, match=r"pip install 'socialai-dsl\[wandb\]'"):
        WandbTracker("project", tmp_path, {}, "a run")


def test_the_package_itself_offline(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Where the extra is installed: a run without a network leaves a file to be sent later."""
    pytest.importorskip("wandb", reason="the extra `wandb` is not installed")
    monkeypatch.setenv("WANDB_MODE", "offline")
    tracker = WandbTracker("project", tmp_path, {"seed": 0}, "a run")
    train(CONFIG, EchoEnvs(8), tmp_path, tracker=tracker)
    (written,) = (tmp_path / "wandb").glob("offline-run-*/*.wandb")
    assert written.stat().st_size > 0
