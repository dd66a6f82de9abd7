"""docs/extending.md: every class on the page trains, and resumes as if it had never been interrupted."""

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.cli import main
from socialai_dsl.frontend import check
from socialai_dsl.trainer import checkpoint as checkpoints
from socialai_dsl.trainer.config import OWN, RunConfig
from socialai_dsl.trainer.files import CHECKPOINTS

PAGE = Path(__file__).parents[1] / "docs" / "extending.md"
TEXT = PAGE.read_text(encoding="utf-8")
FILES = dict(re.findall(r"^```\w+\n# (\S+)\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL))
CODE = sorted(name for name in FILES if name.endswith(".py"))
COMMANDS = re.findall(r"^\$ socialai-run (.*)$", TEXT, re.MULTILINE)
LONGEST = 60
BUDGET = [
    "--frames",
    "2000",
    "--envs",
    "32",
    "--eval-episodes",
    "10",
    "--checkpoint-every",
    "1",
    "--threads",
    "1",
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The page's files in a folder that Python does not search and that is not the current one."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    for name, text in FILES.items():
        (tmp_path / "mine" / name).write_text(text, encoding="utf-8")
    return tmp_path / "mine"


def run(*words: str) -> None:
    assert main.main(["run", *words, "--json"]) == 0, words


def weights(run_folder: Path) -> dict[str, Any]:
    """Everything that the last checkpoint holds."""
    return checkpoints.read(run_folder / CHECKPOINTS).tensors


def test_the_page_has_an_example_of_each() -> None:
    for option in RunConfig(**dict.fromkeys(OWN, "mine:Own")).own_classes:
        assert any(f"--{option} " in command for command in COMMANDS), option
    named = [word.partition(":")[0] for command in COMMANDS for word in command.split() if ":" in word]
    assert sorted(f"{name}.py" for name in named) == CODE, "each is used once"


@pytest.mark.parametrize("name", CODE)
def test_an_example_is_short(name: str) -> None:
    assert len(FILES[name].splitlines()) <= LONGEST


@pytest.mark.parametrize("name", sorted(FILES.keys() - set(CODE)))
def test_its_scenarios_have_no_findings(name: str, folder: Path) -> None:
    assert [str(diagnostic) for diagnostic in check(str(folder / name)).diagnostics] == []


@pytest.mark.thorough("trains each example twice")
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: shlex.split(command)[-1])
def test_an_example_trains_and_resumes_exactly(
    command: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its last checkpoint is taken away; the run goes on from the one before, which holds the example's state."""
    scenario, *options = shlex.split(command)
    run(f"mine/{scenario}", *options, *BUDGET, "--out", "whole")
    whole = weights(Path("whole"))
    rows = [json.loads(line) for line in Path("whole/metrics.jsonl").read_text("utf-8").splitlines()]
    if "--bonus" in options:
        assert all(row["bonus"] > 0 for row in rows)
    if "counts:Counts" in options:
        assert rows[0]["bonus"] > rows[1]["bonus"], "what is seen again pays less"
    if "foresight:Foresight" in options:
        assert rows[0]["aux_loss"] > rows[1]["aux_loss"] > 0, "it is learnt"
    if "--guide" in options:
        assert rows[0]["led"] == 1
        assert rows[1]["led"] < 1, "the share of the script fades"

    _, last = sorted(Path("whole", CHECKPOINTS).iterdir())
    last.unlink()
    run("--resume", "whole")
    resumed = weights(Path("whole"))
    assert resumed.keys() == whole.keys()
    assert [name for name in whole if not whole[name].equal(resumed[name])] == []
    if RunConfig.model_validate_json(Path("whole/config.json").read_text("utf-8")).depends_on_frames:
        assert main.main(["run", "--resume", "whole", "--frames", "9000"]) == 2
        assert "--frames: got 9000, expected 2000" in capsys.readouterr().err
        run("--resume", "whole")
    capsys.readouterr()


@pytest.mark.thorough("trains")
def test_an_agent_with_a_network_of_ones_own_is_evaluated(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run("mine/gate.yaml", "--recipe", "plain", "--net", "gru:GruNet", *BUDGET, "--out", "whole")
    assert main.main(["evaluate", "whole", "--net", "gru:GruNet", "--episodes", "10"]) == 0
    assert "success" in capsys.readouterr().out


@pytest.mark.thorough("trains and draws a report")
def test_an_algorithm_of_ones_own_gets_a_folder_a_card_a_test_and_a_report(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = "qlearning:QLearning"
    run("mine/gate.yaml", "--recipe", "plain", "--algorithm", own, *BUDGET, "--out", "whole")
    result = json.loads(Path("whole/result.json").read_text("utf-8"))
    assert (result["agent"], result["eval"]["episodes"]) == (own, 10)
    assert f"An agent of the algorithm `{own}`" in Path("whole/model_card.md").read_text("utf-8")
    assert {"episode.html", "metrics.jsonl", "episodes.csv"} <= {
        path.name for path in Path("whole").iterdir()
    }
    capsys.readouterr()
    assert main.main(["evaluate", "whole", "--algorithm", own, "--episodes", "10", "--json"]) == 0
    (again,) = json.loads(capsys.readouterr().out)
    assert again["eval"]["success_rate"] == result["eval"]["success_rate"]
    assert main.main(["evaluate", "whole", "--episodes", "10"]) == 2
    assert f"name it (--algorithm {own}) to load that code" in capsys.readouterr().err
    assert main.main(["export", "whole", "--out", "given"]) == 0
    assert list(Path("given").rglob("qlearning.py"))
    assert main.main(["report", "whole", "--out", "told"]) == 0
    assert any(own in path.read_text("utf-8") for path in Path("told").rglob("*.csv"))


@pytest.mark.parametrize("shown", re.findall(r"^socialai-run: (bonus: .*)$", TEXT, re.MULTILINE))
def test_mistakes_are_said_as_shown(shown: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, name = folder / "counts.py", "counts:Counts"
    text = file.read_text(encoding="utf-8")
    if "no module" in shown:
        name = "count:Counts"
    elif "no class" in shown:
        name = "counts:Count"
    elif "lacks" in shown:
        file.write_text(text.replace("def load_state", "def load"), encoding="utf-8")
    else:
        file.write_text(text.replace("import Counter\n", "import (Counter\n"), encoding="utf-8")
    assert main.main(["run", "mine/gate.yaml", "--recipe", "plain", "--bonus", name, *BUDGET]) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert said.replace(str(folder), "/home/ada").endswith(shown), said
