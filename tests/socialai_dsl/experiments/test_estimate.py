"""How long runs will take: what is closest to them tells."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from socialai_dsl.experiments.estimate import Speeds, remember
from socialai_dsl.experiments.folder import PlannedRun


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def run(
    place: Path, scenario: str, net: str = "fast", speed: float | None = None, frames: int | None = 1000
) -> PlannedRun:
    path = place / f"{scenario}-{net}-{speed}"
    path.mkdir()
    if speed is not None:
        (path / "result.json").write_text(json.dumps({"frames": 1000, "frames_per_second": speed}))
    return PlannedRun(
        path, {"name": "c", "scenario": scenario, "frames": frames, "options": {"net": net}}, 0, ()
    )


def known(speeds: Speeds, of: PlannedRun) -> tuple[float, str] | None:
    speed = speeds.of(of.condition)
    return None if speed is None else (speed.frames_per_second, speed.source)


def test_nothing_is_known_of_an_unusual_network(tmp_path):
    asked = run(tmp_path, "dance", "my.module:Net")
    assert known(Speeds([asked]), asked) is None
    assert Speeds([asked]).remaining(asked) is None


def test_what_is_usual_then_what_was_measured_then_what_ran_here(tmp_path):
    asked = run(tmp_path, "dance")
    assert known(Speeds([asked]), asked) == (5000, "a typical figure of this network")
    remember("fast", 4000)
    remember("paper", 100)
    assert known(Speeds([asked]), asked) == (4000, "a short measurement on this machine")
    other = run(tmp_path, "help", speed=3000)
    assert known(Speeds([asked, other]), asked) == (3000, "runs of this network here")
    same = [run(tmp_path, "dance", speed=1000), run(tmp_path, "dance", speed=3000)]
    assert known(Speeds([asked, other, *same]), asked) == (pytest.approx(1500), "runs of this scenario here")


def test_a_run_under_way_tells_as_well_and_needs_less(tmp_path):
    asked = run(tmp_path, "dance")
    (asked.folder / "metrics.jsonl").write_text('{"frames": 600, "frames_per_second": 200.0}\n')
    (asked.folder / "checkpoints").mkdir()
    (asked.folder / "checkpoints" / "000000000000600.safetensors").touch()
    assert Speeds([asked]).remaining(asked) == pytest.approx(2 + 15)


def test_what_a_run_takes_besides_training(tmp_path):
    """To start and to test: as the runs did that are done."""
    done, chance = run(tmp_path, "dance", speed=10), run(tmp_path, "help", frames=None)
    assert Speeds([done]).remaining(chance) == 15
    (done.folder / "result.json").write_text('{"train_seconds": 60.0}')
    attempts = [{"started": 100, "ended": 150}, {"started": 200, "ended": 220.5}]
    (done.folder / "status.json").write_text(json.dumps({"state": "done", "attempts": attempts}))
    speeds = Speeds([done])
    assert (speeds.remaining(done), speeds.remaining(chance)) == (0, 10.5)


def test_a_spoilt_cache_is_no_cache(tmp_path):
    remember("fast", 4000)
    (tmp_path / "cache" / "socialai-dsl" / "speeds.json").write_text('{"fast": "quick", "paper": -1')
    asked = run(tmp_path, "dance")
    assert known(Speeds([]), asked) == (5000, "a typical figure of this network")
