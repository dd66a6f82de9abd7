"""`socialai export`: the folder plays elsewhere as the run did here, and tells nothing of this machine."""

import contextlib
import json
import shutil
import socket
from pathlib import Path
from typing import Any

import pytest
from safetensors import safe_open

import socialai_dsl
from socialai_dsl.cli.main import main, run_main
from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.runs.copies import MovedScenario

Capture = pytest.CaptureFixture[str]

QUICK = ["--frames", "1500", "--envs", "32", "--eval-episodes", "30", "--device", "cpu"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scenario of its own, named by its whole path when an agent was trained on it."""
    folder = tmp_path_factory.mktemp("place")
    with contextlib.chdir(folder):
        assert main(["new", "corridor"]) == 0
        assert run_main([str(folder / "corridor.yaml"), *QUICK, "--out", str(folder / "run")]) == 0
    return folder


@pytest.fixture(scope="module")
def exported(place: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The agent, exported and moved to where nothing of its run is."""
    with contextlib.chdir(place):
        assert main(["export", "run"]) == 0
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "agent"
    shutil.move(place / "exports" / "corridor-fast-s0", elsewhere)
    return elsewhere


def evaluated(capsys: Capture, *arguments: str) -> Any:
    capsys.readouterr()
    assert main(["evaluate", *arguments, "--episodes", "30", "--device", "cpu", "--json"]) == 0
    (result,) = json.loads(capsys.readouterr().out)
    return result


@pytest.mark.thorough("evaluates and trains")
def test_it_plays_elsewhere_as_it_did_here(
    place: Path, exported: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    here = evaluated(capsys, str(place / "run"))
    monkeypatch.chdir(tmp_path)
    there = evaluated(capsys, str(exported))
    assert there["warnings"] == [], "it is the program that it was trained on"
    assert there["program_sha256"] == here["program_sha256"]
    for name in ("success_rate", "mean_length", "mean_return", "outcomes", "rules"):
        assert there["eval"][name] == here["eval"][name], name
    command = [str(exported / "scenario" / "corridor.yaml"), "--agent", str(exported), *QUICK[4:], "--json"]
    capsys.readouterr()
    assert run_main(command) == 0
    assert json.loads(capsys.readouterr().out)["eval"]["success_rate"] == here["eval"]["success_rate"]


def test_it_holds_what_is_needed_and_nothing_else(exported: Path) -> None:
    names = {path.relative_to(exported).as_posix() for path in exported.rglob("*") if path.is_file()}
    assert names == {
        "model.safetensors", "config.json", "result.json", "vocabulary.json", "README.md", "episode.gif",
        "scenario/corridor.yaml",
    }  # fmt: skip
    with safe_open(exported / "model.safetensors", "pt") as weights:
        assert all(name.startswith("net.") for name in weights.keys())  # noqa: SIM118 - it is no mapping
    words = json.loads((exported / "vocabulary.json").read_text(encoding="utf-8"))
    assert words["vocabulary"][:2] == ["<pad>", "<unk>"]
    assert words["actions"][:3] == ["left", "right", "forward"]


def test_it_tells_nothing_of_this_machine(place: Path, exported: Path) -> None:
    secrets = [str(place), str(place.parent), str(Path.home()) + "/", socket.gethostname() + "."]
    for path in exported.rglob("*"):
        if path.is_file():
            content = path.read_bytes()
            assert [secret for secret in secrets if secret.encode() in content] == [], path.name
    result = json.loads((exported / "result.json").read_text(encoding="utf-8"))
    files = {ending["file"] for ending in result["eval"]["endings"]}
    assert files == {None, "scenario/corridor.yaml"}
    assert result["scenario"] == "scenario/corridor.yaml"


def test_its_card_says_how_to_play(exported: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    card = (exported / "README.md").read_text(encoding="utf-8")
    assert "From this folder, with" in card
    (code,) = [part.partition("```")[0] for part in card.split("```python\n")[1:]]
    monkeypatch.chdir(exported)
    exec(compile(code, "README.md", "exec"), {})
    outcomes = json.loads((exported / "result.json").read_text(encoding="utf-8"))["eval"]["outcomes"]
    assert capsys.readouterr().out.strip() in outcomes


@pytest.mark.parametrize("name", ["help.yaml", "novel/shop.yaml"])
def test_a_shipped_scenario_keeps_its_name(name: str) -> None:
    """Also where the run named its file; only the name says what the other side has as well."""
    spec = f"{shipped_folder() / name}+unsocial"
    moved = MovedScenario.of(socialai_dsl.load(spec), spec)
    assert (moved.scenario, moved.texts) == (f"{name.removesuffix('.yaml')}+unsocial", {})


def test_all_files_of_a_scenario_go_along(place: Path, tmp_path: Path) -> None:
    (tmp_path / "long.yaml").write_text("extends: corridor.yaml\nscenario: long\n")
    shutil.copy(place / "corridor.yaml", tmp_path / "corridor.yaml")
    spec = str(tmp_path / "long.yaml")
    program = socialai_dsl.compile(socialai_dsl.load(spec))
    moved = MovedScenario.of(socialai_dsl.load(spec), spec)
    moved.copy(tmp_path / "out")
    assert sorted(moved.texts) == ["scenario/corridor.yaml", "scenario/long.yaml"]
    assert (
        socialai_dsl.compile(socialai_dsl.load(str(tmp_path / "out" / moved.scenario))).sha256
        == program.sha256
    )


@pytest.mark.thorough("trains, exports and plays")
def test_a_network_of_ones_own_goes_along(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    project = tmp_path / "project"
    project.mkdir()
    shutil.copy(place / "corridor.yaml", project)
    (project / "mine.py").write_text(
        "from socialai_dsl.trainer.nets import FastNet\nclass Net(FastNet):\n    kind_size = 4\n"
    )
    monkeypatch.chdir(tmp_path)
    assert run_main(["project/corridor.yaml", *QUICK, "--net", "mine:Net", "--out", "run"]) == 0
    here = evaluated(capsys, "run", "--net", "mine:Net")
    assert main(["export", "run", "--out", "given"]) == 0
    shutil.rmtree(project)
    there = evaluated(capsys, "given", "--net", "mine:Net")
    assert there["eval"]["success_rate"] == here["eval"]["success_rate"]
    assert 'net="mine:Net", folder=Path("scenario")' in (tmp_path / "given" / "README.md").read_text()


def test_what_cannot_be_exported_is_said(place: Path, tmp_path: Path, capsys: Capture) -> None:
    def refused(*arguments: str) -> str:
        assert main(["export", *arguments]) == 2
        return capsys.readouterr().err

    assert "is not a run's folder" in refused(str(tmp_path))
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    assert "is there already" in refused(str(place / "run"), "--out", str(tmp_path / "full"))
    unfinished = shutil.copytree(place / "run", tmp_path / "unfinished")
    (unfinished / "result.json").unlink()
    assert "expected a finished run" in refused(str(unfinished))
    settings = json.loads((unfinished / "config.json").read_text())
    (unfinished / "config.json").write_text(json.dumps(settings | {"agent": "random"}))
    assert "'random' is not trained" in refused(str(unfinished))
