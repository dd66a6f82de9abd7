"""A helper is a Python of its own, started only where it can be of use, and nothing depends on it."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from socialai_dsl.engine import cache, helper


@pytest.fixture
def useful(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(helper, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 1}, raising=False)


def test_it_looks_for_modules_where_this_process_does_and_says_nothing(
    useful: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "only_there.py").write_text("NAME = 'found'")
    monkeypatch.syspath_prepend(str(tmp_path / "elsewhere"))
    code = helper._CODE.split("from socialai_dsl")[0]
    code += f"import only_there; print('noise'); open({str(tmp_path / 'seen')!r}, 'w').write(name + only_there.NAME)"
    monkeypatch.setattr(helper, "_CODE", code)
    helper.Helper("serve").wait()
    assert (tmp_path / "seen").read_text() == "servefound"
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    "reason", ["one core", "no cache", "frozen", "embedded", "nothing to run", "no processes"]
)
def test_none_is_started_where_it_is_of_no_use(
    reason: str, useful: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(helper, "_CODE", f"open({str(tmp_path / 'seen')!r}, 'w')")
    if reason == "one core":
        monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0}, raising=False)
    elif reason == "no cache":
        monkeypatch.setattr(helper, "cache_folder", lambda: None)
    elif reason == "frozen":
        monkeypatch.setattr(sys, "frozen", True, raising=False)
    elif reason == "embedded":
        monkeypatch.setattr(sys, "executable", "/usr/bin/true")
    elif reason == "nothing to run":
        monkeypatch.setattr(sys, "executable", None)
    else:
        monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    helper.Helper("serve").wait()
    assert not (tmp_path / "seen").exists()


def test_one_that_hangs_is_not_waited_for(useful: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(helper, "_CODE", "import time; time.sleep(600)")
    monkeypatch.setattr(helper, "_PATIENCE", 0.3)
    hanging = helper.Helper("serve")
    hanging.wait()
    assert hanging._process is not None
    assert hanging._process.returncode != 0


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_it_leaves_the_code_on_the_disk(
    useful: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOCIALAI_CACHE_DIR", str(tmp_path / "cache"))
    helper.Helper("identify").wait()
    cache.cache_folder.cache_clear()
    try:
        assert cache.read("identify")
    finally:
        cache.cache_folder.cache_clear()
