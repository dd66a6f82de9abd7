"""`make bench ARGS=--train`: what it measures, how it compares, and what it refuses."""

import json
import time
from collections.abc import Iterator
from dataclasses import replace

import pytest
import torch

import socialai_dsl
from benchmarks import training_speed
from benchmarks.__main__ import main
from benchmarks.training_entries import Entry, entries, own_updates
from benchmarks.training_report import training_table
from socialai_dsl.trainer.config import configure

Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What takes seconds and is not asked about."""
    monkeypatch.setattr(training_speed, "reference_speed", lambda _: 1e8)
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


def entry(name: str, seconds: float) -> Entry:
    def start(scenario: str, threads: int) -> Iterator[None]:
        assert (scenario, threads) == ("talkitout", 1)
        while True:
            time.sleep(seconds)
            yield

    return Entry(name, name, 4, 5, 1, 4, "", start)


def test_ours_is_compared_with_each_peer() -> None:
    chosen = [entry("fast", 0.002), entry("clean-fast", 0.02), entry("sb3-fast", 0.02)]
    report = training_speed.measure_training("talkitout", chosen, 1, 0.1, 3, lambda _: None)
    assert [row.updates >= 3 for row in report.rows] == [True] * 3
    assert all(row.wall_low <= row.wall <= row.wall_high for row in report.rows)
    clean, other = report.comparisons
    assert (clean.ours, clean.peer, other.peer) == ("fast", "clean-fast", "sb3-fast")
    fast, slow, _ = (row.wall for row in report.rows)
    assert clean.wall == pytest.approx(fast / slow)
    table = training_table(replace(report, load=3.0))
    assert "load 3.0" in table
    assert "other work" not in training_table(replace(report, load=None))
    assert all(name in table for name in ("fast", "clean-fast", "4 x 5"))


def test_updates_are_repeated_but_not_without_end() -> None:
    report = training_speed.measure_training("talkitout", [entry("fast", 0.03)], 1, 0.02, 50, lambda _: None)
    assert 1 <= report.rows[0].updates <= 3


@pytest.mark.thorough("measures training")
def test_the_report_is_json(capsys: Capture) -> None:
    command = ["--train", "--only", "fast", "--seconds", "0.01", "--repeat", "1", "--json"]
    assert main(command) == 0
    report = json.loads(capsys.readouterr().out)
    (row,) = report["rows"]
    assert (row["name"], row["num_envs"], row["horizon"], row["epochs"]) == ("fast", 256, 32, 4)
    assert row["wall"] > 0 < row["cpu"]
    assert 0 < row["distinct"] < 1
    assert 0 < row["rollout_share"] < 1
    assert report["threads"] == 1
    assert "torch" in report["versions"]


@pytest.mark.thorough("measures training")
def test_duplicates_are_counted_and_kept_if_asked() -> None:
    config = configure(net="paper", envs=4, horizon=20, minibatches=1)
    frames = config.frames_per_update * config.epochs
    for alone, low, high in ((False, 0.1, 0.95), (True, 1.0, 1.0)):
        envs = socialai_dsl.make_vec("talkitout", num_envs=4, copy=False, autoreset_mode="SameStep")
        update = next(own_updates(config, envs, alone))
        assert low <= update.learnt_frames / frames <= high
        assert update.rollout_seconds > 0


def test_ours_and_peers_are_known() -> None:
    assert {"fast", "paper", "plain-loop", "clean-paper", "clean-fast", "fast-long"} < {
        e.name for e in entries()
    }


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--threads", "1"], "expected --train"),
        (["--only", "fast"], "expected --train"),
        (["--train", "--only", "slow"], "expected one of fast, "),
        (["--train", "--threads", "0"], "--threads: got 0"),
        (["--train", "--threads", "100000"], "--threads: got 100000"),
        (["--train", "--all"], "expected one SCENARIO"),
        (["--train", "dance", "help"], "expected one SCENARIO"),
    ],
)
def test_wrong_usage(options: list[str], message: str, capsys: Capture) -> None:
    assert main(options) == 2
    assert message in capsys.readouterr().err
