"""One worker works on a run, and one process writes its folder; whoever dies gives its lock back."""

import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from filelock import FileLock

from socialai_dsl import run_folder
from socialai_dsl.errors import UsageError
from socialai_dsl.experiments.folder import Run, Status, is_locked
from socialai_dsl.experiments.work import Outcome, _performed_alone, cancel, retry
from socialai_dsl.run_folder import only_writer


@pytest.fixture
def run(tmp_path: Path) -> Run:
    return Run(tmp_path, "abc", {"name": "one", "frames": 100, "options": {}}, 0, ())


def test_one_of_many_works(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_a_worker_that_was_killed_holds_nothing(run: Run) -> None:
    run.write_status(Status("running"))
    script = (
        "import time; from filelock import FileLock\n"
        f"lock = FileLock({str(run.path / 'worker.lock')!r}); lock.acquire()\n"
        "print('locked', flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as worker:
        assert worker.stdout is not None
        assert worker.stdout.readline() == "locked\n"
        assert is_locked(run.path)
        assert run.shown_status().state == "running"
        assert not retry(run)
        worker.kill()
    assert not is_locked(run.path)
    assert run.shown_status().state == "waiting"


def test_looking_at_a_run_makes_nothing_in_its_folder(run: Run) -> None:
    assert not is_locked(run.path)
    assert list(run.path.iterdir()) == []


def test_a_run_that_nobody_works_on_is_given_up_at_once(run: Run) -> None:
    cancel(run)
    assert run.status().state == "cancelled"
    assert retry(run)
    assert run.status().state == "waiting"
    assert not run.is_cancelled()


def test_two_processes_do_not_write_one_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_folder, "_SECONDS_TO_WAIT", 0.1)
    with only_writer(tmp_path), pytest.raises(UsageError, match="another process is at work on this run"):
        _in_a_thread(tmp_path)
    with only_writer(tmp_path):
        pass


def _in_a_thread(folder: Path) -> None:
    """Another thread stands for another process, because a lock belongs to an open file."""
    raised: list[BaseException] = []

    def try_it() -> None:
        try:
            with only_writer(folder):
                pass
        except UsageError as error:
            raised.append(error)

    thread = threading.Thread(target=try_it)
    thread.start()
    thread.join()
    if raised:
        raise raised[0]


def test_the_next_writer_waits_for_one_that_is_about_to_die(tmp_path: Path) -> None:
    lock = FileLock(tmp_path / run_folder.LOCK, thread_local=False)
    lock.acquire()
    threading.Timer(0.3, lock.release).start()
    began = time.monotonic()
    with only_writer(tmp_path):
        assert time.monotonic() - began > 0.2
