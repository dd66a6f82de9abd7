"""`socialai bench`: what is measured, and what `walk` leaves out."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import socialai_dsl
from socialai_dsl.cli.main import main
from socialai_dsl.cli.mixes import Allowed, random_actions, walk_actions

DATA = Path(__file__).parents[2] / "data"

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> str:
    """The scenario of `socialai new`, in which turning right or asking for the weather gives up."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(DATA / "corridor.yaml", "corridor.yaml")
    capsys.readouterr()
    text = Path("corridor.yaml").read_text(encoding="utf-8")
    text += '  - failure: agent.said("How is the weather") or agent.action == right\n'
    Path("corridor.yaml").write_text(text, encoding="utf-8")
    return "corridor.yaml"


def test_walk_leaves_out_what_ends_the_scenario(scenario: str) -> None:
    allowed = Allowed(scenario)
    program = socialai_dsl.compile(socialai_dsl.load(scenario))
    words = [*program.actions, "none"]
    assert [words[i] for i in allowed.primitives] == ["left", "forward", "none"]
    said = {program.templates[t].replace("<noun>", program.nouns[n]) for t, n in allowed.utterances}
    assert said == {"Please open the door", "Please open the weather", "How is the door"}


def test_actions_are_in_the_space_and_differ_from_step_to_step(scenario: str) -> None:
    envs = socialai_dsl.make_vec(scenario, num_envs=8)
    for actions in (random_actions(envs, 1), walk_actions(envs, Allowed(scenario), 1)):
        assert all(envs.action_space.contains(batch) for batch in actions)
        assert not np.array_equal(actions[0], actions[1])
    envs.close()


def test_the_report_is_json(scenario: str, capsys: Capture) -> None:
    command = ["bench", scenario, "--batch", "1,8", "--mix", "random", "--repeat", "1", "--seconds", "0.02"]
    assert main([*command, "--json", "--out", "report.json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads(Path("report.json").read_text(encoding="utf-8"))
    own = [row for row in report["rows"] if row["what"] == scenario]
    assert [row["batch"] for row in own] == [0, 1, 8]
    assert all(row["cpu"] > 0 and row["ratio"] > 0 and row["resets"] > 0 for row in own)


def test_wrong_usage(capsys: Capture) -> None:
    assert main(["bench", "--repeat", "0"]) == 2
    with pytest.raises(SystemExit) as ended:
        main(["bench", "--batch", "1,x"])
    assert ended.value.code == 2
