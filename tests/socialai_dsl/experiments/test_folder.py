"""What a run's folder says, also when its disk is full or somebody has spoilt it."""

import errno
import json
import os
from pathlib import Path

import pytest

from socialai_dsl.errors import UnreadableError
from socialai_dsl.experiments.folder import PlannedRun, read_experiment, runs_of
from socialai_dsl.runs import status as status_file
from socialai_dsl.runs.status import Status


@pytest.fixture
def run(tmp_path: Path) -> PlannedRun:
    path = tmp_path / "abc"
    path.mkdir()
    return PlannedRun(path, {"name": "one", "frames": 100, "options": {"net": "fast"}}, 3, ("help",))


def test_nothing_there_yet(tmp_path: Path) -> None:
    run = PlannedRun(tmp_path / "none", {"name": "one"}, 0, ())
    assert run.status == Status()
    assert run.checkpoint_frames is None
    assert run.last_metrics is None
    assert run.result is None
    assert run.missing_tests == []


def test_a_status_is_read_as_it_was_written(run: PlannedRun) -> None:
    status = Status("failed", message="a “word”")
    status.begin(17, 640)
    status.end("killed")
    status.state = "failed"
    run.write_status(status)
    assert run.status == status
    assert (run.folder / "status.json").stat().st_size % 4096 == 0


def test_a_full_disk_still_takes_a_status(run: PlannedRun, monkeypatch: pytest.MonkeyPatch) -> None:
    """Written over its own blocks, of which it needs no new ones."""
    run.write_status(Status("running"))

    def fail(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(status_file, "write_text", fail)
    run.write_status(Status("failed", message="the disk is full"))
    assert run.status.message == "the disk is full"
    (run.folder / "status.json").unlink()
    with pytest.raises(OSError, match="space"):
        run.write_status(Status("failed"))


def test_a_run_whose_worker_is_gone_waits(run: PlannedRun) -> None:
    status = Status()
    status.begin(1, 0)
    run.write_status(status)
    with run.worker_lock():
        assert run.shown_status.state == "running"
    os.utime(run.folder / "status.json", (1000, 1000))
    shown = run.shown_status
    assert shown.state == "waiting"
    assert shown.attempts[-1]["reason"] == "its process is gone"
    assert shown.attempts[-1]["ended"] == 1000, "when it last gave a sign of life"


@pytest.mark.parametrize(
    "content", ["{", "[]", '{"state": "odd"}', "\ud800".encode("utf-8", "surrogatepass")]
)
def test_a_spoilt_status(run: PlannedRun, content: str | bytes) -> None:
    (run.folder / "status.json").write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(UnreadableError, match=r"status\.json"):
        _ = run.status
    assert run.shown_status.state == "failed"


@pytest.mark.parametrize("length", [0, 5_000, 65_536, 200_000])
@pytest.mark.parametrize("unfinished", ["", '{"frames": 3, "pa', "x" * 70_000])
def test_the_last_whole_line_of_the_metrics(run: PlannedRun, length: int, unfinished: str) -> None:
    rows = [json.dumps({"frames": frames, "padding": "x" * length}) for frames in range(3)]
    (run.folder / "metrics.jsonl").write_text("\n".join(rows) + "\n" + unfinished)
    row = run.last_metrics
    assert row is not None
    assert row["frames"] == 2


def test_the_newest_checkpoint(run: PlannedRun) -> None:
    checkpoints = run.folder / "checkpoints"
    checkpoints.mkdir()
    for name in (
        "000000000000640.safetensors",
        "000000000001280.safetensors",
        "000000000009999.tmp",
        "notes.txt",
    ):
        (checkpoints / name).touch()
    assert run.checkpoint_frames == 1280


def test_a_run_of_two_conditions_is_one(tmp_path: Path) -> None:
    conditions = [
        {"name": name, "tests": tests} for name, tests in (("a", ["help"]), ("b", ["dance", "help"]))
    ]
    document = {
        "conditions": conditions,
        "runs": [{"id": "x", "condition": name, "seed": 1} for name in "ab"],
    }
    (run,) = runs_of(tmp_path, document)
    assert run.label == "a, seed 1"
    assert run.tests == ("help", "dance")


@pytest.mark.parametrize("content", ["", "[]", '{"format": 2}'])
def test_another_kind_of_folder(tmp_path: Path, content: str) -> None:
    with pytest.raises(UnreadableError, match="is no experiment's folder"):
        read_experiment(tmp_path)
    (tmp_path / "experiment.json").write_text(content)
    with pytest.raises(UnreadableError, match=r"experiment\.json"):
        read_experiment(tmp_path)
