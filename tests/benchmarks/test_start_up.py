"""`make bench ARGS="--only start"`: what is started, how often, and what is said if that fails."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from benchmarks import start_up
from benchmarks.__main__ import main

Capture = pytest.CaptureFixture[str]


class Processes:
    """Stands in for `subprocess.run`: it notes what would be started, and ends it with `code`."""

    def __init__(self, code: int = 0) -> None:
        self.code = code
        self.started: list[tuple[str, str]] = []

    def __call__(
        self, command: list[str], *, env: dict[str, str], **_: Any
    ) -> subprocess.CompletedProcess[str]:
        assert Path(env["SOCIALAI_CACHE_DIR"]).is_dir()
        self.started.append((command[1], env["SOCIALAI_CACHE_DIR"]))
        return subprocess.CompletedProcess(command, self.code, "", "no engine today\n")


def test_each_wait_is_measured_as_often_as_asked(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    processes = Processes()
    monkeypatch.setattr(start_up.subprocess, "run", processes)
    assert main(["--only", "start", "--repeat", "3", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [flag for flag, _ in processes.started] == ["-c", *["-c"] * 3, *["-m"] * 3]
    assert len({folder for _, folder in processes.started}) == 1, "compiled once, then loaded"
    assert [wait["what"] for wait in report["waits"]] == [
        "first step of a new process, engine compiled for it",
        "first step of a new process",
        "`socialai validate`, the whole process",
        "a file becomes a program, again",
    ]
    assert all(0 < wait["low"] <= wait["seconds"] <= wait["high"] for wait in report["waits"])
    assert report["rows"] == []


def test_the_table_shows_them(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.setattr(start_up.subprocess, "run", Processes())
    assert main(["--only", "start", "--repeat", "1"]) == 0
    table = capsys.readouterr().out
    assert "seconds on the clock" in table
    assert "a file becomes a program, again" in table


def test_what_cannot_be_started_is_said(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.setattr(start_up.subprocess, "run", Processes(code=1))
    assert main(["--only", "start"]) == 0
    table = capsys.readouterr().out
    assert "not measured: start (a process failed: no engine today)" in table
    assert "bytes of one environment" in table, "the rest is reported all the same"
