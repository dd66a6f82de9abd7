"""`socialai report` from end to end, on runs with known figures."""

import json
from pathlib import Path

import pytest

from socialai_dsl.baselines import Baselines
from socialai_dsl.cli.main import main
from socialai_dsl.evaluation import levels
from socialai_dsl.evaluation.levels import baselines as levels_of
from socialai_dsl.reporting.analysis import analyse
from socialai_dsl.reporting.collect import read_experiment
from socialai_dsl.runs.report import BASELINES, FOLDER
from tests.socialai_dsl.reporting.synthetic import condition, write_experiment, write_run

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two seeds of an agent, and the scenario's script as a condition of its own."""
    agents = [condition("Help / PPO", [0.4, 0.6]), condition("Help / oracle", [0.9], agent="oracle")]
    return write_experiment(tmp_path, agents)


def test_everything_is_written(folder: Path, capsys: Capture) -> None:
    assert main(["report", str(folder), "--no-baselines"]) == 0
    out = folder / "report"
    assert f"written to {out / 'index.html'}" in capsys.readouterr().out
    names = {path.name for path in out.iterdir()} - {path.name for path in out.glob("*.parquet")}
    assert names == {
        "index.html", "figures",
        "runs.csv", "conditions.csv", "comparisons.csv", "outcomes.csv",
    }, "a table without a row is not written"  # fmt: skip
    page = (out / "index.html").read_text(encoding="utf-8")
    for name in ("part1-success", "part1-curves1", "part1-endings1-1"):
        assert (out / "figures" / f"{name}.svg").is_file()
        assert (out / "figures" / f"{name}.png").is_file()
    assert "Help / oracle, 500 episodes" in page, "a condition tells what the script gets"


def test_baselines_are_measured_once(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.setattr(levels, "baselines", lambda scenario: levels_of(scenario, episodes=10, rooms=2))
    assert main(["report", str(folder)]) == 0
    assert "help: playing the script, at random, and without NPCs" in capsys.readouterr().err
    file = folder / "report" / BASELINES
    measured = json.loads(file.read_text())["help"]
    assert measured["script"]["value"] == 1.0
    assert measured["chance"]["sample"] == "10 test episodes"
    assert 0.3 < measured["without_npcs"]["value"] <= 1.0
    assert measured["without_npcs"]["sample"] == "2 rooms"
    found = analyse(read_experiment(folder), levels.read_baselines(file)).baselines["help"]
    assert found.chance is not None
    assert found.chance.value == measured["chance"]["value"]
    assert found.script is not None
    assert found.script.value == 0.9, "what a condition tells counts before what is measured"

    told: list[str] = []
    levels.update_baselines(["help"], file, told.append)
    assert told == []
    file.write_text(json.dumps({"help": measured | {"program_sha256": "0" * 64}}))
    monkeypatch.setattr(levels, "baselines", lambda scenario: Baselines(program_sha256="1" * 64))
    again, _ = levels.update_baselines(["help"], file, told.append)
    assert (len(told), again["help"].program_sha256) == (1, "1" * 64), "a changed scenario is measured again"
    assert levels.read_baselines(file) == again


def test_a_scenario_that_is_gone_is_a_remark(tmp_path: Path) -> None:
    found, remarks = levels.update_baselines(["gone.yaml"], tmp_path / "baselines.json", print)
    assert found == {}
    (remark,) = remarks
    assert remark.startswith("gone.yaml: nothing to set beside it")


def test_runs_without_an_experiment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = [write_run(tmp_path / name, "help", seed, 0.5) for seed, name in enumerate("ab")]
    monkeypatch.chdir(tmp_path)
    assert main(["report", *map(str, runs), "--no-baselines", "--out", "there"]) == 0
    assert "2 of 2 seeds" in (tmp_path / "there" / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "expected the folder of a run"),
        ("{", "experiment.json: "),
        ('{"format": 1}', "name: is missing"),
    ],
)
def test_what_is_no_experiment_is_said(
    tmp_path: Path, content: str | None, message: str, capsys: Capture
) -> None:
    if content is not None:
        (tmp_path / "experiment.json").write_text(content)
    assert main(["report", str(tmp_path)]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / FOLDER).exists()
