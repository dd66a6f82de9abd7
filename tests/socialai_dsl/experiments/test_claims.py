"""A run has one owner: whoever made its newest claim, until that is let go of or its process is gone."""

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from socialai_dsl.experiments import claims
from socialai_dsl.experiments.claims import claim, is_held, is_overtaken, newest_claim, owner_of


def foreign(run: Path, age: float, **changes: object) -> Path:
    """A claim of another machine with its last sign of life so many seconds ago."""
    folder = run / claims.FOLDER
    folder.mkdir(parents=True)
    path = folder / "0001.json"
    path.write_text(
        json.dumps({"host": "elsewhere", "pid": 1, "scope": "elsewhere 1", "born": "1"} | changes)
    )
    os.utime(path, (time.time() - age,) * 2)
    return path


def test_one_of_many_wins(tmp_path: Path) -> None:
    barrier, won = threading.Barrier(8), []

    def try_it() -> None:
        barrier.wait()
        if (mine := claim(tmp_path)) is not None:
            won.append(mine)

    threads = [threading.Thread(target=try_it) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(won) == 1
    assert [path.name for path in (tmp_path / claims.FOLDER).iterdir()] == ["0001.json"]


def test_one_of_many_takes_over(tmp_path: Path) -> None:
    """The classic mistake is to delete the stale claim, and with it the new one that somebody was quicker to make."""
    foreign(tmp_path, age=500)
    made = [claim(tmp_path) for _ in range(3)]
    assert [one is not None for one in made] == [True, False, False]


def test_what_is_let_go_of_can_be_claimed(tmp_path: Path) -> None:
    first = claim(tmp_path)
    assert first is not None
    assert claim(tmp_path) is None
    first.release()
    second = claim(tmp_path)
    assert second is not None
    assert second.number == 2


def test_a_process_that_died_here_owns_nothing(tmp_path: Path) -> None:
    script = f"from pathlib import Path; from {claims.__name__} import claim; print(claim(Path({str(tmp_path)!r})))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.startswith("Claim")
    assert claim(tmp_path) is not None, "at once, however young the claim is"


def test_a_number_that_another_process_has_now(tmp_path: Path) -> None:
    """Numbers of processes come round; when a process began tells two with one number apart."""
    foreign(tmp_path, age=0, scope=claims.scope(), pid=os.getpid(), born="7")
    assert claim(tmp_path) is not None


@pytest.mark.parametrize(("age", "held"), [(0, True), (100, True), (150, False)])
def test_elsewhere_the_last_sign_of_life_counts(tmp_path: Path, age: float, held: bool) -> None:
    assert is_held(foreign(tmp_path, age), stale_after=120) is held


def test_a_clock_that_goes_wrong_does_not_matter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = foreign(tmp_path, age=0)
    monkeypatch.setattr(claims.time, "time", lambda: 5e9)
    assert is_held(path)


def test_a_claim_that_is_just_being_written(tmp_path: Path) -> None:
    path = foreign(tmp_path, age=0)
    path.write_text("")
    assert owner_of(path) is None
    assert claim(tmp_path) is None


def test_a_sign_of_life_keeps_it(tmp_path: Path) -> None:
    mine = claim(tmp_path)
    assert mine is not None
    os.utime(mine.path, (time.time() - 500,) * 2)
    assert not is_held(mine.path)
    assert mine.renew()
    assert is_held(mine.path)


def test_who_was_overtaken_notices_and_changes_nothing(tmp_path: Path) -> None:
    slow = claim(tmp_path)
    assert slow is not None
    os.utime(slow.path, (time.time() - 500,) * 2)
    quick = claim(tmp_path)
    assert quick is not None
    assert is_overtaken(slow.path)
    assert not slow.renew()
    slow.release()
    assert newest_claim(tmp_path) == quick.path
    assert is_held(quick.path)
