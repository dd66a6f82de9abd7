"""A run killed at random moments and resumed ends as one that never stopped: weights, log and results, to the bit."""

import json
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from socialai_dsl.trainer.checkpoint import read

pytestmark = pytest.mark.thorough("kills and resumes whole processes")

ROOT = Path(__file__).parents[3]
TIMES = ("frames_per_second", "train_seconds")

FAST = ["--net", "fast", "--threads", "2", "--envs", "8", "--hyper", "horizon=32", "--checkpoint-every", "2"]
SUITE = [str(ROOT / "tests/data/suites/school.yaml"), "--bonus", "lang", "--curriculum", "progress", *FAST]
CELLS = ["help", "--bonus", "cell", "--recipe", "plain", *FAST]
GUIDED = ["help", *FAST]
PAPER = ["--net", "paper-reference", "--threads", "1", "--envs", "2", "--hyper", "horizon=40"]
BATCH_NORM = ["help", *PAPER, "--checkpoint-every", "1"]
Process = subprocess.Popen[str]
LONG = [pytest.mark.slow, pytest.mark.timeout(7200)]


@pytest.fixture
def started() -> Iterator[Callable[..., Process]]:
    """Starts a run; those that a failing test leaves behind are ended."""
    processes: list[Process] = []
    # Evaluation would split every small operation among the cores, which takes minutes where these are busy.
    surroundings = os.environ | {"OMP_NUM_THREADS": "1"}

    def start(*arguments: str) -> Process:
        command = [sys.executable, "-m", "socialai_dsl", "run", *arguments]
        pipe = subprocess.PIPE
        processes.append(
            subprocess.Popen(
                command, stdout=pipe, stderr=subprocess.STDOUT, text=True, cwd=ROOT, env=surroundings
            )
        )
        return processes[-1]

    yield start
    for process in processes:
        if process.poll() is None:
            process.kill()
            process.communicate()


def finish(process: Process) -> None:
    output, _ = process.communicate(timeout=900)
    assert process.returncode == 0, output


def lines(path: Path) -> list[str]:
    return path.read_text().splitlines() if path.exists() else []


def frames_per_update(arguments: list[str]) -> int:
    """Every run here says both numbers itself, since those of recipes and presets may change."""
    envs, horizon = (arguments[arguments.index(option) + 1] for option in ("--envs", "--hyper"))
    return int(envs) * int(horizon.removeprefix("horizon="))


def kill_after(run: Path, process: Process, starts: int, updates: int, last: int, delay: float) -> None:
    """Kill the process some moment after its log has that many updates, and before it goes far beyond the last."""

    def has(updates: int) -> bool:
        return len(lines(run / "metrics.jsonl")) >= updates

    while process.poll() is None and not (len(lines(run / "starts.jsonl")) >= starts and has(updates)):
        time.sleep(0.002)
    end = time.monotonic() + delay
    while process.poll() is None and time.monotonic() < end and not has(last):
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == -signal.SIGKILL, f"the kill came too late: {output}"


def without_times(content: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in content.items() if key not in TIMES}


@pytest.mark.parametrize(
    ("arguments", "updates", "kills"),
    [
        pytest.param(SUITE, 7, 2, id="suite-2", marks=pytest.mark.timeout(900)),
        pytest.param(SUITE, 40, 20, id="suite-20", marks=LONG),
        pytest.param(CELLS, 40, 20, id="cells-20", marks=LONG),
        pytest.param(GUIDED, 40, 20, id="guided-20", marks=LONG),
        pytest.param(BATCH_NORM, 22, 20, id="batch_norm-20", marks=LONG),
    ],
)
def test_a_killed_run_ends_as_one_that_never_stopped(
    arguments: list[str], updates: int, kills: int, started: Callable[..., Process], tmp_path: Path
) -> None:
    frames = updates * frames_per_update(arguments)
    command = [*arguments, "--frames", str(frames), "--eval-episodes", "20", "--seed", "3"]
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    finish(started(*command, "--out", str(whole)))

    rng = np.random.default_rng(0)
    last = updates - 2  # two updates and the evaluation are left whenever a kill comes
    moments = sorted(rng.integers(0, last, kills).tolist())
    process = started(*command, "--out", str(killed))
    for number, moment in enumerate(moments):
        kill_after(killed, process, number + 1, moment, last, float(rng.random()) * 0.3)
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # a damaged newest file would only be a warning
            assert read(killed / "checkpoints").meta.update <= updates
        process = started("--resume", str(killed))
    finish(process)

    starts = [json.loads(line) for line in lines(killed / "starts.jsonl")]
    assert len(starts) == kills + 1, "each kill landed in a run of its own"
    assert len({start["update"] for start in starts}) > 1, "progress was made between the kills"
    one, other = read(whole / "checkpoints"), read(killed / "checkpoints")
    assert other.meta == one.meta
    assert other.tensors.keys() == one.tensors.keys()
    for name, value in one.tensors.items():
        assert torch.equal(other.tensors[name], value), f"{name} differs after kills at {moments}"
    logs = [
        [without_times(json.loads(line)) for line in lines(run / "metrics.jsonl")] for run in (whole, killed)
    ]
    assert logs[0] == logs[1]
    assert [row["update"] for row in logs[0]] == list(range(1, updates + 1))
    results = [
        without_times(json.loads((run / "result.json").read_text(encoding="utf-8")))
        for run in (whole, killed)
    ]
    assert results[0] == results[1]
    assert (whole / "transcript.txt").read_bytes() == (killed / "transcript.txt").read_bytes()
    assert len(list((killed / "checkpoints").iterdir())) == 2


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_run_that_is_stopped_saves_what_it_has(
    started: Callable[..., Process], number: signal.Signals, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    rare = ["--checkpoint-every", "1000000"]
    process = started(*GUIDED, *rare, "--frames", "1000000", "--out", str(run))
    while process.poll() is None and len(lines(run / "metrics.jsonl")) < 3:
        time.sleep(0.002)
    process.send_signal(number)
    output, _ = process.communicate(timeout=60)
    made = len(lines(run / "metrics.jsonl"))
    assert "stopping after this update" in output
    assert read(run / "checkpoints").meta.update == made >= 3, "nothing of what was trained is lost"
    if number == signal.SIGINT:
        assert process.returncode == 130
        assert output.endswith(f"interrupted; go on with: socialai-run --resume {run}\n")
    else:
        assert process.returncode == -signal.SIGTERM


def test_a_second_signal_stops_at_once(started: Callable[..., Process], tmp_path: Path) -> None:
    run = tmp_path / "run"
    process = started("help", "--net", "paper-reference", "--threads", "1", "--envs", "64", "--out", str(run))
    while process.poll() is None and not lines(run / "starts.jsonl"):
        time.sleep(0.002)
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 130, output
    assert read(run / "checkpoints").meta.update == len(lines(run / "metrics.jsonl")) == 0
