"""Runs on scenarios with several seats: one network on all of them, tested and recorded with all of them."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

import socialai_dsl as sd
from socialai_dsl.errors import UsageError

OPTIONS = {"envs": 16, "eval_episodes": 12, "threads": 1}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> sd.Run:
    """Half of it led by the scripts."""
    folder = tmp_path_factory.mktemp("runs") / "levers"
    return sd.train("together/levers_together", out=folder, frames=4096, recipe="guided", **OPTIONS)  # type: ignore[arg-type]


def test_all_seats_learn_and_are_tested(run: sd.Run) -> None:
    result = json.loads((run.folder / "result.json").read_text(encoding="utf-8"))
    assert result["eval"]["seats"].keys() == {"partner"}
    assert result["eval"]["episodes"] == 12
    rows = [
        json.loads(line) for line in (run.folder / "metrics.jsonl").read_text(encoding="utf-8").splitlines()
    ]
    ended = [row for row in rows if row["outcomes"] and None not in row["outcomes"].values()]
    assert ended
    for row in ended:  # what is counted in a game of two rows is counted once
        assert sum(row["outcomes"].values()) == pytest.approx(1)


def test_what_was_played_is_recorded_with_all_seats(run: sd.Run) -> None:
    """A film is played again, and would not end where the episode ended if one of the players was missing."""
    assert (run.folder / "episode.gif").is_file()
    assert (run.folder / "episode.html").is_file()


def test_an_agent_plays_again_as_it_was_tested(run: sd.Run) -> None:
    first, again = (
        sd.evaluate(str(run.folder), "together/levers_together", episodes=12).result for _ in range(2)
    )
    assert first.success.tolist() == again.success.tolist()
    assert first.others["partner"][1].tolist() == again.others["partner"][1].tolist()


def test_a_run_goes_on_as_one_that_never_stopped(tmp_path: Path) -> None:
    plain = {**OPTIONS, "recipe": "plain", "horizon": 32}
    short = sd.train("together/commons_together", out=tmp_path / "short", frames=768, **{**plain, "envs": 24})  # type: ignore[arg-type]
    sd.resume(short.folder, frames=1536)
    whole = sd.train(
        "together/commons_together", out=tmp_path / "whole", frames=1536, **{**plain, "envs": 24}
    )  # type: ignore[arg-type]
    timed = ("frames_per_second",)
    rows = [
        [
            {key: value for key, value in json.loads(line).items() if key not in timed}
            for line in (run.folder / "metrics.jsonl").read_text(encoding="utf-8").splitlines()
        ]
        for run in (short, whole)
    ]
    assert rows[0] == rows[1]


def test_rows_that_are_no_whole_games(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="expected a multiple of the 3 seats: agent, bob, cat"):
        sd.train("together/commons_together", out=tmp_path / "run", frames=2048, **OPTIONS)  # type: ignore[arg-type]


@pytest.mark.parametrize("seats", [{"partner": "script"}, {"agent": "random"}, {"partner": "run"}])
def test_an_evaluation_is_replayed_with_the_partners_that_it_had(
    seats: dict[str, str], run: sd.Run, tmp_path: Path
) -> None:
    """Also where the folder of a trained partner is gone since."""
    moved = tmp_path / "moved"
    shutil.copytree(run.folder, moved)
    named = {seat: str(moved) if name == "run" else name for seat, name in seats.items()}
    played = sd.evaluate(
        "random", "together/levers_together", episodes=4, out=tmp_path / "out", seats=named, seed=3
    )
    shutil.rmtree(moved)
    folder = tmp_path / "out" / "levers_together"
    traces = sd.replay(folder, episodes=4)
    assert sorted(len(trace.moments) - 1 for trace in traces) == sorted(played.result.lengths.tolist())
    (alone,) = sd.replay(folder, test_episodes=[2])
    assert alone.moments == played.traces([2])[0].moments
    assert (alone.own, alone.agent) == (played.seat, "random")
