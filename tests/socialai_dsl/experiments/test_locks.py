"""One worker works on a run, and one process writes a folder; who looks is in nobody's way, who dies holds nothing."""

import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from socialai_dsl.errors import UsageError
from socialai_dsl.experiments.driver import _known
from socialai_dsl.experiments.folder import PlannedRun
from socialai_dsl.experiments.work import Outcome, _performed_alone, cancel, retry
from socialai_dsl.runs import folder as run_folder
from socialai_dsl.runs.folder import only_writer
from socialai_dsl.runs.lock import hold
from socialai_dsl.runs.status import Status


@pytest.fixture
def run(tmp_path: Path) -> PlannedRun:
    return PlannedRun(tmp_path, {"name": "one", "frames": 100, "options": {}}, 0, ())


@pytest.fixture
def other(tmp_path: Path) -> Iterator["subprocess.Popen[str]"]:
    """Another process that works on the run and writes its folder."""
    script = (
        "import time; from pathlib import Path; from socialai_dsl.runs.lock import hold\n"
        f"folder = Path({str(tmp_path)!r})\n"
        "with hold(folder, 'worker'), hold(folder, 'run'): print('held', flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


def test_one_of_many_works(run: PlannedRun, monkeypatch: pytest.MonkeyPatch) -> None:
    barrier, ends = threading.Barrier(8), []

    def work(_: object) -> tuple[Outcome, str]:
        time.sleep(0.5)
        return Outcome.DONE, ""

    monkeypatch.setattr("socialai_dsl.experiments.work._Work.perform", work)

    def try_it() -> None:
        barrier.wait()
        ends.append(_performed_alone(run, lambda: False)[0])

    threads = [threading.Thread(target=try_it) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(ends) == [Outcome.DONE, *[Outcome.HELD] * 7]


def test_who_looks_keeps_nobody_from_working(run: PlannedRun, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many look all the time, in every way there is, each of many tries to work succeeds."""
    monkeypatch.setattr("socialai_dsl.experiments.work._Work.perform", lambda _: (Outcome.DONE, ""))
    run.write_status(Status("running"))
    over, looks = threading.Event(), []

    def look() -> None:
        while not over.is_set():
            looks.append((run.worker, run.shown_status, _known(run)))

    threads = [threading.Thread(target=look) for _ in range(4)]
    for thread in threads:
        thread.start()
    try:
        ends = [_performed_alone(run, lambda: False)[0] for _ in range(300)]
    finally:
        over.set()
        for thread in threads:
            thread.join()
    assert ends == [Outcome.DONE] * 300
    assert len(looks) > 100


def test_a_worker_is_named_until_it_is_killed(run: PlannedRun, other: "subprocess.Popen[str]") -> None:
    run.write_status(Status("running"))
    found = run.worker
    assert found is not None
    assert (found.pid, found.host) == (other.pid, socket.gethostname())
    assert abs((datetime.now(UTC) - datetime.fromisoformat(found.since)).total_seconds()) < 60
    assert run.shown_status.state == "running"
    assert not retry(run)
    other.kill()
    other.wait()
    assert run.worker is None
    assert run.shown_status.state == "waiting"
    assert retry(run)


def test_looking_at_a_run_makes_nothing_in_its_folder(run: PlannedRun) -> None:
    assert run.worker is None
    assert list(run.folder.iterdir()) == []


def test_a_run_that_nobody_works_on_is_given_up_at_once(run: PlannedRun) -> None:
    cancel(run)
    assert run.status.state == "cancelled"
    assert retry(run)
    assert run.status.state == "waiting"
    assert not run.is_cancelled


def test_two_processes_do_not_write_one_folder(
    tmp_path: Path, other: "subprocess.Popen[str]", monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_folder, "_SECONDS_TO_WAIT", 0.1)
    who = f"another process is writing this folder \\(process {other.pid} on "
    with pytest.raises(UsageError, match=who), only_writer(tmp_path):
        pass
    other.kill()
    other.wait()
    with only_writer(tmp_path):
        pass
    with only_writer(tmp_path):
        pass


def test_an_error_of_the_writer_gives_the_lock_back(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), hold(tmp_path, "run"):
        raise ZeroDivisionError
    with hold(tmp_path, "run"):
        assert sorted(os.listdir(tmp_path)) == ["run.lock", "run.owner"]
    assert os.listdir(tmp_path) == []


def test_the_next_writer_waits_for_one_that_is_about_to_die(
    tmp_path: Path, other: "subprocess.Popen[str]"
) -> None:
    threading.Timer(0.3, other.kill).start()
    began = time.monotonic()
    with only_writer(tmp_path):
        assert time.monotonic() - began > 0.2
