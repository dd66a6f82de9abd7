"""Runs come to their end whatever happens to who works on them: none is lost, none is done twice."""

import errno
import json
import os
import signal
import subprocess
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.experiments.folder import PlannedRun

pytestmark = pytest.mark.thorough("starts commands and workers, and kills them")


def reasons(run: PlannedRun) -> list[str]:
    return [attempt["reason"] for attempt in run.status.attempts]


def results(place: Any) -> dict[str, Any]:
    return {label: (run.result, run.tested) for label, run in place.runs().items()}


def is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def updates(run: PlannedRun) -> list[int]:
    lines = (run.folder / "metrics.jsonl").read_text().splitlines()
    return [json.loads(line)["frames"] for line in lines]


@pytest.fixture(scope="session")
def undisturbed_once() -> dict[str, Any]:
    return {}


@pytest.fixture
def undisturbed(place: Any, undisturbed_once: dict[str, Any], tmp_path: Path) -> dict[str, Any]:
    """The results of the experiment where nothing happens."""
    if not undisturbed_once:
        out, place.out = place.out, tmp_path / "undisturbed"
        assert place.run() == 0
        undisturbed_once |= results(place)
        place.out = out
    return undisturbed_once


def test_all_runs_come_to_their_end(place, capsys):
    assert place.run() == 0
    runs = place.runs()
    assert len(runs) == 3
    assert {run.status.state for run in runs.values()} == {"done"}
    assert all(reasons(run) == ["done"] for run in runs.values() if run.condition["agent"] == "ppo")
    assert runs["chance, seed 0"].tested == {"help": {"success_rate": 0.5, "program_sha256": None}}
    assert "3 done" in capsys.readouterr().out


def test_a_second_time_nothing_is_done(place, capsys):
    place.run()
    before = {label: run.status.attempts for label, run in place.runs().items()}
    capsys.readouterr()
    assert place.run("--json") == 0
    assert {label: run.status.attempts for label, run in place.runs().items()} == before
    assert json.loads(capsys.readouterr().out)["states"] == {"done": 3}


def test_a_killed_process_is_resumed_from_its_checkpoint(place, undisturbed):
    driver = place.start("--workers", "1", seconds=0.05)
    run = place.until(place.at_work)
    os.kill(run.status.attempts[-1]["pid"], signal.SIGKILL)
    assert driver.wait(60) == 0
    first, second = run.status.attempts
    assert first["reason"] == "killed by signal SIGKILL"
    assert second["from_frames"] > 0
    assert second["reason"] == "done"
    assert updates(run) == list(range(100, 1001, 100))
    assert results(place) == undisturbed


def test_a_killed_driver_leaves_nobody_behind_and_the_command_goes_on(place, undisturbed):
    driver = place.start("--workers", "1", seconds=0.05)
    run = place.until(place.at_work)
    worker = run.status.attempts[-1]
    driver.kill()
    driver.wait()
    place.until(lambda: not is_alive(worker["pid"]))
    assert run.shown_status.state == "waiting"
    assert place.run() == 0
    assert results(place) == undisturbed
    first, second = run.status.attempts
    assert (first["reason"], second["reason"]) == ("its process was gone", "done")
    assert second["from_frames"] > 0
    assert updates(run) == list(range(100, 1001, 100))
    others = [other for other in place.runs().values() if other.id != run.id]
    assert all(reasons(other)[-1] == "done" and reasons(other).count("done") == 1 for other in others)


@pytest.mark.parametrize("number", [pytest.param(signal.SIGINT, marks=pytest.mark.slow), signal.SIGTERM])
def test_stopped_by_a_person_or_the_system(place, undisturbed, number):
    driver = place.start("--workers", "2", seconds=0.1)
    run = place.until(place.at_work)
    driver.send_signal(number)
    said, _ = driver.communicate(timeout=30)
    assert driver.returncode == 130, said
    assert b"the same command goes on" in said
    assert run.status.state == "waiting"
    assert reasons(run) == ["stopped"]
    assert run.checkpoint_frames == updates(run)[-1], "an update was not saved"
    assert place.run() == 0
    assert results(place) == undisturbed


def test_two_commands_share_the_work(place, undisturbed):
    """As two machines do that see the same folder."""
    first = place.start("--workers", "1", seconds=0.02)
    second = place.start("--workers", "1", seconds=0.02)
    assert (first.wait(60), second.wait(60)) == (0, 0)
    assert results(place) == undisturbed
    for run in place.runs().values():
        assert len(reasons(run)) == 1 + bool(run.tests), "each run was worked on once"


def test_a_run_that_fails_stops_no_other(place, capsys):
    place.file.write_text(place.file.read_text().replace("- {name", "- {name: ill, envs: 13}\n  - {name"))
    assert place.run() == 1
    runs = place.runs()
    assert {label for label, run in runs.items() if run.status.state == "failed"} == {"ill, seed 0"}
    assert runs["ill, seed 0"].status.message == "thirteen environments bring bad luck"
    said = capsys.readouterr().out
    assert "3 done, 1 failed" in said
    assert f"ill, seed 0 ({runs['ill, seed 0'].id}): thirteen environments bring bad luck" in said
    assert place.run() == 1
    assert len(reasons(runs["ill, seed 0"])) == 1, "what failed is not tried again by itself"


def test_an_unreadable_folder_stops_no_other(place, capsys):
    place.run()
    runs = place.runs()
    for label in ("none, seed 0", "cell, seed 0"):
        (runs[label].folder / "result.json").unlink()
        (runs[label].folder / "status.json").write_text("{" if label.startswith("none") else "{}")
    capsys.readouterr()
    assert place.run() == 1
    said = capsys.readouterr().out
    assert f"{runs['none, seed 0'].folder / 'status.json'}: expected JSON" in said
    assert "1 done, 2 failed" in said


def test_a_full_disk_stops_no_other(place):
    """The disk of one run, which is large enough to begin."""
    place.prepare()
    run = place.runs()["none, seed 0"]
    run.folder.mkdir()
    try:
        mount = ["mount", "-t", "tmpfs", "-o", "size=32k", "tmpfs", str(run.folder)]
        subprocess.run(mount, check=True, capture_output=True, timeout=20)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("only root can make a disk")
    try:
        assert place.run() == 1
        assert run.status.state == "failed"
        assert os.strerror(errno.ENOSPC) in run.status.message
    finally:
        subprocess.run(["umount", "--lazy", str(run.folder)], check=True, capture_output=True, timeout=20)
    assert [other.status.state for other in place.runs().values() if other.id != run.id] == ["done", "done"]


def test_cancelled_and_tried_again(place, undisturbed, capsys):
    driver = place.start("--workers", "1", seconds=0.05)
    run = place.until(place.at_work)
    assert place.socialai("cancel", str(place.out), run.id, "chance") == 0
    assert capsys.readouterr().out == "2 runs cancelled\n"
    assert driver.wait(60) == 0
    assert {label for label, other in place.runs().items() if other.status.state == "cancelled"} == {
        run.label,
        "chance, seed 0",
    }
    assert place.run() == 0, "what was cancelled stays so"
    assert run.status.state == "cancelled"
    assert place.socialai("retry", str(place.out)) == 0
    assert place.run() == 0
    assert results(place) == undisturbed
    assert run.status.attempts[-1]["from_frames"] > 0


def test_another_configuration_is_refused(place, capsys):
    place.run()
    capsys.readouterr()
    place.file.write_text(place.file.read_text().replace("frames: 1000", "frames: 500"))
    assert place.run() == 2
    said = capsys.readouterr().err
    assert "`none`, frames: 1000 there, 500 here" in said
    assert "--update" in said
    kept = place.runs()["none, seed 0"]
    assert place.run("--update") == 0
    assert place.runs()["none, seed 0"].id != kept.id
    assert place.runs()["chance, seed 0"].folder.exists()
    assert kept.status.state == "done", "what was there before stays"


def test_experiments_that_share_a_folder_share_runs(place, tmp_path):
    shared = tmp_path / "shared"
    assert place.run("--runs", str(shared)) == 0
    other = tmp_path / "other.yaml"
    other.write_text(
        "experiment: other\nset: {frames: 1000, eval_episodes: 5}\nconditions:\n"
        "  - {name: once more, scenario: dance, bonus: cell, checkpoint_every: 3, seeds: 2}\n"
    )
    before = set(shared.iterdir())
    assert place.socialai("run", str(other), "--out", str(tmp_path / "other"), "--runs", str(shared)) == 0
    assert len(set(shared.iterdir()) - before) == 1, "only the second seed is new"


def test_a_test_that_is_added_is_all_that_is_done(place):
    place.run()
    trained = place.runs()["none, seed 0"].status.attempts
    place.file.write_text(place.file.read_text().replace("set: {", "set: {tests: [help, talkitout], "))
    assert place.run("--update") == 0
    run = place.runs()["none, seed 0"]
    assert sorted(run.tested) == ["help", "talkitout"]
    assert run.status.attempts[:1] == trained
    assert run.status.attempts[1]["from_frames"] == 1000
