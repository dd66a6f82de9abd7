"""Names of run folders, files written in one go."""

import contextlib
import os
from pathlib import Path

import pytest

from socialai_dsl.atomic import read_json, write_json, write_text
from socialai_dsl.errors import UsageError
from socialai_dsl.frontend import load
from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.runs import folder as run_folder
from socialai_dsl.runs.copies import keep_scenario
from socialai_dsl.runs.folder import CONFIG, new_run_folder, scenario_folder_name
from socialai_dsl.runs.versions import versions


@pytest.mark.parametrize(
    ("spec", "name"),
    [
        ("talkitout", "talkitout"),
        ("scenarios/talkitout.yaml", "talkitout"),
        ("/a/b/own.yml+unsocial", "own+unsocial"),
        ("dance+as_coded+unsocial?length=2&sing=1", "dance+as_coded+unsocial,length=2,sing=1"),
        ("a.b.yaml?path=x/y", "a.b,path=x_y"),
    ],
)
def test_folder_names(spec: str, name: str) -> None:
    assert scenario_folder_name(spec) == name


def test_two_runs_in_one_second_have_two_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run_folder.time, "strftime", lambda _: "20260101-000000")
    with contextlib.ExitStack() as runs:
        folders = [runs.enter_context(new_run_folder(None, "dance", 3)) for _ in range(3)]
    assert [str(folder) for folder in folders] == [
        "runs/dance/20260101-000000-s3",
        "runs/dance/20260101-000000-s3-2",
        "runs/dance/20260101-000000-s3-3",
    ]


def test_a_folder_with_a_run_is_not_overwritten(tmp_path: Path) -> None:
    with new_run_folder(tmp_path / "new", "dance", 0) as folder:
        write_json(folder / CONFIG, {})
    with (
        pytest.raises(UsageError, match="holds a run already"),
        new_run_folder(tmp_path / "new", "dance", 0),
    ):
        pass


def test_what_ships_goes_along_by_its_name_and_not_by_a_path(tmp_path: Path) -> None:
    own, to = tmp_path / "own.yaml", tmp_path / "a" / "folder"
    to.mkdir(parents=True)
    own.write_text("suite: own\nmembers: [dance]\n")
    assert keep_scenario(to, str(own), load(str(own))).scenario == "scenario/own.yaml"
    path = os.path.relpath(shipped_folder() / "dance.yaml", tmp_path)
    own.write_text(f"suite: own\nmembers: [{path}]\n")
    with pytest.raises(UsageError, match="name what ships without a path, such as dance, and"):
        keep_scenario(to, str(own), load(str(own)))


def test_a_failed_write_leaves_the_old_file_and_no_litter(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    write_text(path, "old")
    with pytest.raises(UnicodeEncodeError):
        write_text(path, "x" * 10_000_000 + "\udc80")
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["result.json"]


def test_json_is_read_back(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"agent": "ppo", "eval": {"success_rate": 0.5}})
    assert read_json(tmp_path / "a.json") == {"agent": "ppo", "eval": {"success_rate": 0.5}}


@pytest.mark.parametrize("text", ["{", "[1]", ""])
def test_a_broken_file_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(UsageError, match=r"a\.json: expected"):
        read_json(path)


def test_numbers_that_json_lacks_are_not_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(tmp_path / "a.json", {"x": float("nan")})


def test_versions_name_what_decides_the_results() -> None:
    assert {"python", "numpy", "numba"} <= set(versions())
