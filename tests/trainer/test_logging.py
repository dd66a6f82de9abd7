"""Metrics are rates per episode, a log is cut back to where a run resumes, and every start is recorded."""

import json
import time
import warnings
from pathlib import Path

import pytest

from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.logging import MetricsLog, Tally, episode_metrics, record_start

ALONE, BOTH = (RunConfig(envs=8, horizon=8, tensorboard=board) for board in (False, True))


def test_rates_are_per_episode_that_ended() -> None:
    before = {"outcomes": {"won": 3, "lost": 5}, "rules": {"asked": 10}, "episodes": 8}
    after = {"outcomes": {"won": 4, "lost": 8}, "rules": {"asked": 22, "told": 2}, "episodes": 12}
    got = episode_metrics(Tally(4, 1, 2, 3.0, 40, all_episodes=4), before, after)
    assert got == {
        "episodes": 4,
        "success": 0.25,
        "mean_return": 0.75,
        "mean_length": 10.0,
        "timeouts": 0.5,
        "outcomes": {"won": 0.25, "lost": 0.75},
        "rules": {"asked": 3.0, "told": 0.5},
    }


def test_without_an_episode_there_are_no_rates() -> None:
    counters = {"outcomes": {"won": 3}, "rules": {"asked": 10}, "episodes": 8}
    got = episode_metrics(Tally(), counters, counters)
    assert got["episodes"] == 0
    assert got["success"] is None
    assert got["outcomes"] == {"won": None}


def updates(run_dir: Path) -> list[int]:
    return [json.loads(line)["update"] for line in (run_dir / "metrics.jsonl").read_text().splitlines()]


@pytest.mark.parametrize("tail", ["", '{"update": 5, "los', '{"update": 5, "los\n'])
def test_a_log_is_cut_back(tail: str, tmp_path: Path) -> None:
    with MetricsLog(tmp_path, ALONE) as log:
        for update in range(1, 5):
            log.write({"update": update, "loss": 0.5})
    with (tmp_path / "metrics.jsonl").open("a") as file:
        file.write(tail)
    with MetricsLog(tmp_path, ALONE, 2) as log:
        assert updates(tmp_path) == [1, 2]
        log.write({"update": 3, "loss": 0.25})
        log.sync()
    assert updates(tmp_path) == [1, 2, 3]


def test_numbers_json_does_not_know_are_not_written(tmp_path: Path) -> None:
    with (
        MetricsLog(tmp_path, ALONE) as log,
        pytest.raises(ValueError, match="not JSON compliant"),
    ):
        log.write({"update": 1, "loss": float("nan")})


def points(run_dir: Path, tag: str) -> list[tuple[int, float]]:
    """What TensorBoard shows of a run: step and value."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    shown = EventAccumulator(str(run_dir))
    shown.Reload()
    return [(event.step, event.value) for event in shown.Scalars(tag)]


def test_tensorboard_counts_frames_and_forgets_what_is_made_again(tmp_path: Path) -> None:
    with MetricsLog(tmp_path, BOTH) as log:
        for update in range(1, 6):
            log.write(
                {
                    "update": update,
                    "frames": 64 * update,
                    "loss": 0.5,
                    "outcomes": {"won": 0.25, "lost": None},
                }
            )
    assert points(tmp_path, "loss") == [(64 * update, 0.5) for update in range(1, 6)]
    # TensorBoard reads files in order of their names: second, process, and then a number of which 10 is before 9.
    time.sleep(1)
    with MetricsLog(tmp_path, BOTH, 2) as log:
        for update in range(3, 7):
            log.write({"update": update, "frames": 64 * update, "loss": 0.25, "outcomes": {"won": 0.25}})
    expected = [(64, 0.5), (128, 0.5), (192, 0.25), (256, 0.25), (320, 0.25), (384, 0.25)]
    assert points(tmp_path, "loss") == expected
    assert [step for step, _ in points(tmp_path, "outcomes/won")] == [step for step, _ in expected]


def test_what_was_synced_is_in_tensorboard_though_nothing_was_closed(tmp_path: Path) -> None:
    """As after a kill right behind a checkpoint."""
    with MetricsLog(tmp_path, BOTH) as log:
        log.write({"update": 1, "frames": 64, "loss": 0.5})
        log.sync()
        assert points(tmp_path, "loss") == [(64, 0.5)]


def test_success_is_of_the_agent_s_own_episodes_and_rates_are_of_all() -> None:
    before = {"outcomes": {"won": 0}, "rules": {"asked": 0}, "episodes": 0}
    after = {"outcomes": {"won": 3}, "rules": {"asked": 8}, "episodes": 4}
    got = episode_metrics(Tally(2, 1, 0, 1.0, 10, all_episodes=4), before, after)
    assert (got["episodes"], got["success"], got["mean_length"]) == (2, 0.5, 5.0)
    assert (got["outcomes"], got["rules"]) == ({"won": 0.75}, {"asked": 2.0})


def test_starts_are_appended_and_never_cut_back(tmp_path: Path) -> None:
    config = RunConfig(envs=8, threads=2)
    record_start(tmp_path, 0, config)
    with (tmp_path / "starts.jsonl").open("a") as file:
        file.write('{"time": "20')  # killed while writing
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        record_start(tmp_path, 4, config)
    first, torn, second = (tmp_path / "starts.jsonl").read_text().splitlines()
    assert torn == '{"time": "20'
    assert json.loads(first).items() >= {"update": 0, "frames": 0, "device": "cpu", "threads": 2}.items()
    assert set(json.loads(second)) == {"time", "update", "frames", "torch", "cpu", "device", "threads"}
    assert json.loads(second)["frames"] == 1024


def test_other_surroundings_are_worth_a_warning(tmp_path: Path) -> None:
    record_start(tmp_path, 0, RunConfig(threads=2))
    with pytest.warns(UserWarning, match=r"other conditions \(threads 2 -> 4\)"):
        record_start(tmp_path, 4, RunConfig(threads=4))
