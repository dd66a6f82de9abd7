"""`socialai report` from end to end, on runs with known figures."""

import json
from pathlib import Path

import pytest

from socialai_dsl.cli import ceilings, report
from socialai_dsl.cli.main import main
from socialai_dsl.cli.report import ceilings_of
from socialai_dsl.reporting.collect import read_experiment
from tests.socialai_dsl.reporting.synthetic import condition, write_experiment, write_run

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two seeds of an agent, and the scenario's script as a condition of its own."""
    agents = [condition("Help / PPO", [0.4, 0.6]), condition("Help / oracle", [0.9], agent="oracle")]
    return write_experiment(tmp_path, agents)


def test_everything_is_written(folder: Path, capsys: Capture) -> None:
    assert main(["report", str(folder), "--no-ceilings"]) == 0
    out = folder / "report"
    assert f"written to {out / 'index.html'}" in capsys.readouterr().out
    names = {path.name for path in out.iterdir()} - {path.name for path in out.glob("*.parquet")}
    assert names == {
        "index.html", "figures",
        "runs.csv", "conditions.csv", "comparisons.csv", "rooms.csv", "outcomes.csv",
    }  # fmt: skip
    page = (out / "index.html").read_text(encoding="utf-8")
    for name in ("part1-success", "part1-curves1", "part1-endings1-1"):
        assert (out / "figures" / f"{name}.svg").is_file()
        assert (out / "figures" / f"{name}.png").is_file()
    assert "Help / oracle, 500 episodes" in page, "a condition tells what the script gets"


def test_who_does_not_learn_is_measured_once(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.setattr(ceilings, "_EPISODES", 10)
    monkeypatch.setattr(ceilings, "_ROOMS", 2)
    experiment, out = read_experiment(folder), folder
    found, notes = ceilings_of(experiment, out, only_known=False)
    assert "help: playing the script, at random, and without NPCs" in capsys.readouterr().err
    measured = json.loads((out / ceilings.FILE).read_text())["help"]
    assert measured["oracle"]["value"] == 1.0
    assert measured["random"]["source"] == "10 test episodes"
    assert found["help"].alone is not None
    assert 0.3 < found["help"].alone.value <= 1.0
    assert found["help"].alone.source == "2 rooms"
    assert found["help"].oracle is not None
    assert found["help"].oracle.value == 0.9, "what a condition tells counts before what is measured"
    assert notes == []

    assert ceilings_of(experiment, out, only_known=False) == (found, [])
    assert capsys.readouterr().err == ""
    changed = {"help": measured | {"program_sha256": "0" * 64}}
    (out / ceilings.FILE).write_text(json.dumps(changed))
    ceilings_of(experiment, out, only_known=False)
    assert "help: playing the script" in capsys.readouterr().err, (
        "a scenario that has changed is measured again"
    )


def test_a_scenario_that_is_gone_is_a_remark(tmp_path: Path) -> None:
    write_experiment(tmp_path, [condition("A / x", [0.5], scenario="gone.yaml")])
    _, notes = ceilings_of(read_experiment(tmp_path), tmp_path, only_known=False)
    (note,) = notes
    assert note.startswith("gone.yaml: nothing to set beside it")


def test_runs_without_an_experiment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = [write_run(tmp_path / name, "help", seed, 0.5) for seed, name in enumerate("ab")]
    monkeypatch.chdir(tmp_path)
    assert main(["report", *map(str, runs), "--no-ceilings", "--out", "there"]) == 0
    assert "2 of 2 seeds" in (tmp_path / "there" / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "expected the folder of a run"),
        ("{", "experiment.json: "),
        ('{"format": 1}', "name: Field required"),
    ],
)
def test_what_is_no_experiment_is_said(
    tmp_path: Path, content: str | None, message: str, capsys: Capture
) -> None:
    if content is not None:
        (tmp_path / "experiment.json").write_text(content)
    assert main(["report", str(tmp_path)]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / report.FOLDER).exists()
