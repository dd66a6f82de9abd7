"""What a run says, and how it exits, when the disk or the numbers fail it; afterwards it can be resumed."""

import errno
import json
import os
import subprocess
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import torch

from socialai_dsl.cli.main import run_main
from socialai_dsl.errors import UsageError
from socialai_dsl.trainer import checkpoint as checkpoints
from socialai_dsl.trainer.checkpoint import read

pytestmark = pytest.mark.thorough("trains on disks that fail")

Capture = pytest.CaptureFixture[str]

RUN = [
    "help",
    "--recipe",
    "plain",
    "--frames",
    "1536",
    "--envs",
    "8",
    "--checkpoint-every",
    "2",
    "--eval-episodes",
    "5",
]
RUN += ["--device", "cpu"]


class Disk:
    """A small disk of its own."""

    def __init__(self, place: Path, size: str) -> None:
        self.place = place
        place.mkdir()
        self._mount("-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place))

    def change(self, option: str) -> None:
        self._mount("-o", f"remount,{option}", str(self.place))

    def _mount(self, *arguments: str) -> None:
        subprocess.run(["mount", *arguments], check=True, capture_output=True, timeout=20)

    def remove(self) -> None:
        subprocess.run(["umount", "--lazy", str(self.place)], check=True, capture_output=True, timeout=20)


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Disk]:
    try:
        disk = Disk(tmp_path / "disk", "4m")  # the first checkpoint has 1.7 MB, later ones 5 MB
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("only root can make a disk")
    yield disk
    disk.remove()


def check_clear(said: str, *parts: str) -> None:
    """One line that says what happened; no traceback."""
    assert len(said.strip().splitlines()) == 1, said
    for part in parts:
        assert part in said


def test_a_full_disk(disk: Disk, capsys: Capture) -> None:
    run = disk.place / "run"
    assert run_main([*RUN, "--out", str(run)]) == 4
    check_clear(
        capsys.readouterr().err,
        "training stopped after 512 frames (update 2): cannot write: ",
        os.strerror(errno.ENOSPC),
        f"the last good checkpoint is {run / 'checkpoints' / ('0' * 15)}.safetensors",
    )
    assert read(run / "checkpoints").meta.update == 0
    assert not list(run.rglob("*.tmp"))
    disk.change("size=64m")
    assert run_main(["--resume", str(run)]) == 0
    assert read(run / "checkpoints").meta.update == 6


def test_a_disk_too_full_to_begin(disk: Disk, capsys: Capture) -> None:
    disk.change("size=1m")
    run = disk.place / "run"
    assert run_main([*RUN, "--out", str(run)]) == 4
    check_clear(capsys.readouterr().err, "there is no checkpoint yet", os.strerror(errno.ENOSPC))
    disk.change("size=64m")
    assert run_main([*RUN, "--out", str(run)]) == 0, "the same command can be given again"


def test_a_read_only_folder(disk: Disk, capsys: Capture) -> None:
    disk.change("ro")
    assert run_main([*RUN, "--out", str(disk.place / "run")]) == 2
    check_clear(capsys.readouterr().err, os.strerror(errno.EROFS), str(disk.place / "run"))


@pytest.mark.parametrize("number", [errno.EIO, errno.EROFS])
def test_a_disk_that_fails_while_training(
    number: int, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Permissions do not hold root back, so the error comes from the call that makes a checkpoint safe."""
    run, fsync = tmp_path / "run", os.fsync

    def fail_later(descriptor: int) -> None:
        if len(list((run / "checkpoints").glob("*.safetensors"))) == 2:
            raise OSError(number, os.strerror(number))
        fsync(descriptor)

    with monkeypatch.context() as broken:
        broken.setattr(checkpoints.os, "fsync", fail_later)
        assert run_main([*RUN, "--out", str(run)]) == 4
    check_clear(
        capsys.readouterr().err, "training stopped after ", "cannot write: ", os.strerror(number), str(run)
    )
    kept = read(run / "checkpoints").meta.update
    assert kept in (1, 2)
    assert run_main(["--resume", str(run)]) == 0
    starts = [json.loads(line)["update"] for line in (run / "starts.jsonl").read_text().splitlines()]
    assert starts == [0, kept]


def test_numbers_that_are_not_finite(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, step, steps = tmp_path / "run", torch.optim.Adam.step, 0

    def spoiling(optimizer: torch.optim.Adam) -> None:
        nonlocal steps
        steps += 1
        step(optimizer)
        if steps == 64:  # the last of the fourth update
            optimizer.param_groups[0]["params"][0].data.fill_(torch.nan)

    monkeypatch.setattr(torch.optim.Adam, "step", spoiling)
    assert run_main([*RUN, "--out", str(run)]) == 4
    check_clear(
        capsys.readouterr().err,
        "training stopped after 768 frames (update 3)",
        "an entry of the network's channels is not a finite number",
        "the last good checkpoint is ",
    )
    assert read(run / "checkpoints").meta.update == 2


def test_a_warning_is_one_line_without_a_place_in_our_code(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def warn(*_: Any) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.showwarning = lambda *what: print(warnings.formatwarning(*what), end="")
            warnings.warn("mind the gap", stacklevel=1)
        raise UsageError("enough")

    usual = warnings.formatwarning
    monkeypatch.setattr("socialai_dsl.runs.train.new_run_folder", warn)
    assert run_main([*RUN, "--out", str(tmp_path / "run")]) == 2
    assert capsys.readouterr().out == "socialai-run: warning: mind the gap\n"
    assert warnings.formatwarning is usual


@pytest.mark.parametrize("damage", ["cut short", "one bit", "another file"])
def test_a_damaged_checkpoint(damage: str, tmp_path: Path, capsys: Capture) -> None:
    """Resuming takes the one before and says so; without one before it refuses, and touches nothing."""
    run = tmp_path / "run"
    assert run_main([*RUN, "--out", str(run)]) == 0
    older, newer = sorted((run / "checkpoints").iterdir())
    for path in (newer, older):
        data = bytearray(path.read_bytes())
        if damage == "one bit":
            data[len(data) // 2] ^= 1
        path.write_bytes({"cut short": data[:-1], "one bit": data, "another file": b"PK\x03\x04"}[damage])
        capsys.readouterr()
        if path == newer:
            with pytest.warns(UserWarning, match=f"{newer.name}: .*; using {older.name} instead"):
                assert run_main(["--resume", str(run)]) == 0
            newer.write_bytes(b"")
    assert run_main(["--resume", str(run)]) == 2
    said = capsys.readouterr().err
    check_clear(said, older.name, newer.name)
