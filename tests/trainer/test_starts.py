"""Every start of a run is recorded, and what could change its last bits is said."""

import json
import warnings
from pathlib import Path

import pytest

from trainer import starts


def test_starts_are_appended_and_never_cut_back(tmp_path: Path) -> None:
    around = starts.surroundings("cpu", 2, 1)
    assert set(around) == set(starts.SURROUNDINGS)
    starts.record(tmp_path, 0, 0, around)
    with (tmp_path / "starts.jsonl").open("a") as file:
        file.write('{"time": "20')  # killed while writing
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        starts.record(tmp_path, 4, 1024, around)
    first, torn, second = (tmp_path / "starts.jsonl").read_text().splitlines()
    assert torn == '{"time": "20'
    assert json.loads(first)["update"] == 0
    assert json.loads(second) == around | {"update": 4, "frames": 1024, "time": json.loads(second)["time"]}


def test_other_surroundings_are_worth_a_warning(tmp_path: Path) -> None:
    around = starts.surroundings("cpu", 2, 1)
    starts.record(tmp_path, 0, 0, around)
    with pytest.warns(UserWarning, match=r"other conditions \(threads 2 -> 4\)"):
        starts.record(tmp_path, 4, 1024, around | {"threads": 4})
