"""`socialai-run` and `socialai evaluate` from end to end, on a scenario that trains in seconds."""

import json
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from socialai_dsl.cli.agents import train_config
from socialai_dsl.cli.errors import UsageError
from socialai_dsl.cli.main import main, run_main
from socialai_dsl.cli.settings import Settings
from trainer.config import configure, paper_preset

DATA = Path(__file__).parents[2] / "data"

Capture = pytest.CaptureFixture[str]

QUICK = ["--frames", "1500", "--envs", "32", "--eval-episodes", "30", "--device", "cpu"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> Path:
    """A folder with a small scenario."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(DATA / "corridor.yaml", "corridor.yaml")
    capsys.readouterr()
    return tmp_path


def result_of(run: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(Path(run, "result.json").read_text(encoding="utf-8"))
    return content


def test_a_run_leaves_everything_it_promises(capsys: Capture) -> None:
    assert run_main(["corridor.yaml", *QUICK, "--seed", "3"]) == 0
    (run,) = Path("runs/corridor").iterdir()
    assert run.name.endswith("-s3")
    left = {path.name.split(".out.tfevents")[0] for path in run.iterdir()}
    assert left == {
        "config.json",
        "starts.jsonl",
        "metrics.jsonl",
        "checkpoints",
        "events",
        "learning_curve.png",
        "model_card.md",
        "episode.gif",
        "transcript.txt",
        "result.json",
    }
    result = result_of(str(run))
    assert set(result) == {
        "scenario",
        "agent",
        "seed",
        "frames",
        "train_seconds",
        "frames_per_second",
        "eval",
        "program_sha256",
        "versions",
    }
    assert result["frames"] >= 1500
    assert result["eval"]["episodes"] == 30
    with Image.open(run / "episode.gif") as film:
        steps = int(Path(run, "transcript.txt").read_text().split(" after ")[1].split(" steps")[0])
        assert film.n_frames <= steps + 1  # type: ignore[attr-defined]
    printed = capsys.readouterr().out
    low, high = result["eval"]["success_interval"]
    assert f"95% interval {low:.1%} to {high:.1%} (Wilson)" in printed
    assert "30 of the test set, sampled actions, seed 0" in printed
    assert len(printed.splitlines()) < 20, "the table stays short"


def test_json_prints_the_result_and_nothing_else(capsys: Capture) -> None:
    assert run_main(["corridor.yaml", *QUICK, "--out", "here", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == result_of("here")


def test_a_run_is_resumed_and_says_no_to_another_scenario(capsys: Capture) -> None:
    assert run_main(["corridor.yaml", *QUICK, "--out", "here"]) == 0
    assert run_main(["--resume", "here", "--frames", "4000"]) == 0
    assert result_of("here")["frames"] >= 4000
    assert run_main(["corridor.yaml", "--resume", "here"]) == 2
    assert run_main(["corridor.yaml", "--out", "here"]) == 2
    assert "holds a run already" in capsys.readouterr().err


def test_a_resumed_run_equals_one_that_never_stopped() -> None:
    assert run_main(["corridor.yaml", *QUICK, "--out", "stopped"]) == 0
    assert run_main(["--resume", "stopped", "--frames", "4000"]) == 0
    assert run_main(["corridor.yaml", *QUICK, "--frames", "4000", "--out", "straight"]) == 0
    assert result_of("stopped")["eval"] == result_of("straight")["eval"]


def test_a_preset_brings_its_numbers_and_options_override_them() -> None:
    few = [
        "--net",
        "paper-reference",
        "--frames",
        "80",
        "--envs",
        "2",
        "--threads",
        "1",  # more would wait for busy cores
        "--eval-episodes",
        "4",
        "--device",
        "cpu",
    ]
    assert run_main(["corridor.yaml", *few, "--seed", "5", "--out", "here"]) == 0
    written = json.loads(Path("here", "config.json").read_text())
    assert (
        written["trainer"] == paper_preset(frames=80, num_envs=2, seed=5, explo_c=0.0, threads=1).model_dump()
    )
    assert run_main(["--resume", "here", "--frames", "160"]) == 0
    assert result_of("here")["frames"] == 160
    assert main(["evaluate", "here", "--on", "corridor.yaml", "--episodes", "4", "--device", "cpu"]) == 0


@pytest.mark.parametrize(
    ("net", "envs"), [("paper-reference-tuned", 16), ("paper-reference", 16), ("fast", 256)]
)
def test_the_number_of_environments_is_the_preset_s_unless_given(
    net: str, envs: int, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    trained: list[Settings] = []

    def train_agent(settings: Settings, *_: object) -> None:
        trained.append(settings)
        raise UsageError("far enough")

    monkeypatch.setattr("socialai_dsl.cli.agents.train_agent", train_agent)
    assert run_main(["corridor.yaml", "--net", net, "--explo", "cell"]) == 2
    (settings,) = trained
    assert settings.envs == envs
    config = train_config(settings)
    assert config == configure(
        net, frames=settings.frames, num_envs=envs, explo="cell", explo_c=3.0, threads=settings.threads
    )
    assert settings.threads >= 1


def test_hyper_parameters_are_the_trainer_s_and_stay_with_the_run() -> None:
    given = [
        "--hyper",
        "entropy_coef=0.02",
        "--hyper",
        "explo_formula=as_printed",
        "--hyper",
        "clip_value=true",
    ]
    assert run_main(["corridor.yaml", *QUICK, *given, "--out", "here"]) == 0
    assert run_main(["--resume", "here", "--frames", "4000"]) == 0
    used = json.loads(Path("here", "config.json").read_text())["trainer"]
    assert used["frames"] == 4000
    assert (used["entropy_coef"], used["explo_formula"], used["clip_value"]) == (0.02, "as_printed", True)


def test_random_play_is_the_same_every_time() -> None:
    for name in ("one", "two"):
        assert run_main(["corridor.yaml", "--agent", "random", "--eval-episodes", "60", "--out", name]) == 0
    assert result_of("one") == result_of("two")
    assert result_of("one")["frames"] == 0
    assert not Path("one", "learning_curve.png").exists()


def test_an_oracle_needs_a_script(capsys: Capture) -> None:
    assert run_main(["corridor.yaml", "--agent", "oracle"]) == 2
    assert "corridor" in capsys.readouterr().err


def test_a_trained_agent_is_evaluated_elsewhere(capsys: Capture) -> None:
    assert run_main(["corridor.yaml", *QUICK, "--out", "here"]) == 0
    own = result_of("here")["eval"]
    capsys.readouterr()
    command = ["evaluate", "here", "--on", "corridor.yaml", "--on", "corridor.yaml+unsocial"]
    assert main([*command, "--episodes", "30", "--device", "cpu", "--json"]) == 0
    same, hidden = json.loads(capsys.readouterr().out)
    assert same["eval"] == own
    assert hidden["scenario"] == "corridor.yaml+unsocial"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "expected a scenario"),
        (["corridor.yaml", "--agent", "nobody"], "--agent: expected ppo, random, oracle, human or"),
        (["corridor.yaml", "--agent", "random", "--frames", "10"], "is not trained"),
        (["corridor.yaml", "--net", "huge"], "net: got 'huge'"),
        (
            ["corridor.yaml", "--agent", "random", "--wandb", "p"],
            "--wandb: the agent 'random' is not trained",
        ),
        (["--resume", "nowhere"], "is not a run's folder"),
        (
            ["corridor.yaml", "--agent", "random", "--hyper", "lr=1"],
            "--hyper: the agent 'random' is not trained",
        ),
        (
            ["corridor.yaml", "--agent", "random", "--compile"],
            "--compile: the agent 'random' is not trained",
        ),
        (["corridor.yaml", "--hyper", "lr"], "--hyper: got 'lr', expected NAME=VALUE"),
        (["corridor.yaml", "--hyper", "entropy_coeff=1"], "'entropy_coeff'; did you mean entropy_coef?"),
        (["corridor.yaml", "--hyper", "banana=1"], "'banana'; expected one of horizon, bptt,"),
        (["corridor.yaml", "--hyper", "num_envs=3"], "num_envs has an option of its own, --envs"),
        (["corridor.yaml", "--hyper", "lr=1", "--hyper", "lr=2"], "--hyper: lr is given twice"),
        (["corridor.yaml", "--hyper", "lr=[1]"], "expected a number, a word, true or false"),
        (["corridor.yaml", "--hyper", "lr=-1"], "lr: Input should be greater than 0, got -1"),
        (["nowhere.yaml"], "there is no such file"),
        (["corridor.yaml", "--agent", "corridor.yaml"], "corridor.yaml"),
    ],
)
def test_wrong_usage(arguments: list[str], message: str, capsys: Capture) -> None:
    assert run_main(arguments) == 2
    assert message in capsys.readouterr().err


def test_a_scenario_with_mistakes_is_not_run(capsys: Capture) -> None:
    Path("broken.yaml").write_text(Path("corridor.yaml").read_text().replace("horizon:", "horizn:"))
    assert run_main(["broken.yaml"]) == 1
    assert "broken.yaml:3:1: S101" in capsys.readouterr().err
    assert not Path("runs").exists()


def test_wandb_that_is_not_installed(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "wandb", None)
    assert run_main(["corridor.yaml", *QUICK, "--wandb", "project", "--out", "here"]) == 2
    assert "pip install 'socialai-dsl[wandb]'" in capsys.readouterr().err
    assert not Path("here").exists(), "the same command can be given again"


def test_a_network_of_ones_own_is_evaluated(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    Path("narrow_nets.py").write_text(
        "from trainer.nets.fast import FastNet\nclass NarrowNet(FastNet):\n    kind_size = 4\n"
    )
    monkeypatch.syspath_prepend(str(Path.cwd()))
    assert run_main(["corridor.yaml", *QUICK, "--net", "narrow_nets:NarrowNet", "--out", "here"]) == 0
    own = result_of("here")["eval"]
    capsys.readouterr()
    command = ["evaluate", "here", "--episodes", "30", "--device", "cpu", "--json"]
    assert main([*command, "--net", "narrow_nets:NarrowNet"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["eval"] == own
    assert main(command) == 2
    assert "name it (--net narrow_nets:NarrowNet)" in capsys.readouterr().err


def test_unwritable_output(capsys: Capture) -> None:
    Path("file").write_text("")
    assert run_main(["corridor.yaml", *QUICK, "--out", "file/run"]) == 2
    assert "file/run" in capsys.readouterr().err
