"""`socialai-run` and `socialai evaluate` from end to end, on a scenario that trains in seconds."""

import argparse
import contextlib
import json
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

import socialai_dsl
from socialai_dsl.cli.main import main, run_main
from socialai_dsl.cli.run import add_arguments
from socialai_dsl.cli.run_options import given_options
from socialai_dsl.errors import UsageError
from socialai_dsl.runs.folder import Run
from socialai_dsl.runs.options import new_config, usual_options
from socialai_dsl.trainer.config import RunConfig, configure

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


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run; tests that go on from it take a copy."""
    place = tmp_path_factory.mktemp("trained")
    shutil.copy(DATA / "corridor.yaml", place)
    with contextlib.chdir(place):
        assert run_main(["corridor.yaml", *QUICK, "--out", "here"]) == 0
    return place / "here"


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
        "episode.html",
        "episodes.csv",
        "asked.csv",
        "transcript.txt",
        "result.json",
        "scenario",
    }
    result = result_of(str(run))
    ended = [line.split(",")[1] for line in (run / "episodes.csv").read_text().splitlines()[1:]]
    assert result["eval"]["success_rate"] == ended.count("1") / len(ended)
    assert set(result) == {
        "scenario",
        "agent",
        "seed",
        "kind",
        "network_sha256",
        "greedy",
        "view",
        "feedback",
        "history",
        "tell",
        "trials",
        "warnings",
        "recipe",
        "guide",
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


@pytest.mark.thorough("trains")
def test_json_prints_the_result_and_nothing_else(capsys: Capture) -> None:
    assert run_main(["corridor.yaml", *QUICK, "--out", "here", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == result_of("here")


@pytest.mark.thorough("trains")
def test_a_run_says_no_to_another_scenario(trained: Path, capsys: Capture) -> None:
    shutil.copytree(trained, "here")
    assert run_main(["corridor.yaml", "--resume", "here"]) == 2
    assert run_main(["corridor.yaml", "--out", "here"]) == 2
    assert "holds a run already" in capsys.readouterr().err


@pytest.mark.thorough("trains twice")
def test_a_resumed_run_equals_one_that_never_stopped(trained: Path) -> None:
    shutil.copytree(trained, "stopped")
    assert run_main(["--resume", "stopped", "--frames", "4000"]) == 0
    assert result_of("stopped")["frames"] >= 4000
    assert run_main(["corridor.yaml", *QUICK, "--frames", "4000", "--out", "straight"]) == 0
    assert result_of("stopped")["eval"] == result_of("straight")["eval"]


@pytest.mark.thorough("trains")
def test_a_resumed_run_keeps_what_it_computes_and_takes_what_only_says_how(
    trained: Path, capsys: Capture
) -> None:
    shutil.copytree(trained, "here")
    config = json.loads(Path("here/config.json").read_text())
    for typed, said in {
        "--seed 5": "--seed: got 5, expected 0, because a run goes on with the options it began with",
        "--hyper lr=0.5": f"--hyper lr: got 0.5, expected {config['lr']}, because",
        "--recipe paper": "--recipe: got paper, expected plain, because",
        "--agent random": "--agent: got random, expected ppo, because",
        "--hyper lrr=1": "'lrr'; did you mean lr?",
    }.items():
        assert run_main(["--resume", "here", *typed.split()]) == 2
        assert said in capsys.readouterr().err
        assert json.loads(Path("here/config.json").read_text()) == config
    threads = config["threads"] + 1
    how = ["--threads", str(threads), "--eval-episodes", "4", "--keep-checkpoints", "1", "--seed", "0"]
    with pytest.warns(UserWarning, match=f"threads {threads - 1} -> {threads}"):
        assert run_main(["--resume", "here", *how]) == 0
    assert result_of("here")["eval"]["episodes"] == 4
    assert json.loads(Path("here/config.json").read_text())["threads"] == threads


@pytest.mark.thorough("trains the paper's network")
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
    given = {
        "frames": 80,
        "envs": 2,
        "seed": 5,
        "threads": 1,
        "eval_episodes": 4,
        "scenario": "scenario/corridor.yaml",
    }
    assert written == configure("paper", net="paper-reference", **given).model_dump()
    assert run_main(["--resume", "here", "--frames", "160"]) == 0
    assert result_of("here")["frames"] == 160
    assert main(["evaluate", "here", "--on", "corridor.yaml", "--episodes", "4", "--device", "cpu"]) == 0


@pytest.mark.parametrize(
    ("net", "envs"), [("paper-reference-tuned", 16), ("paper-reference", 16), ("fast", 256)]
)
def test_the_number_of_environments_is_the_preset_s_unless_given(
    net: str, envs: int, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    trained: list[RunConfig] = []

    def train_agent(run: Run, config: RunConfig, *_: object) -> None:
        trained.append(config)
        raise UsageError("far enough")

    monkeypatch.setattr("socialai_dsl.runs.train._train", train_agent)
    assert run_main(["corridor.yaml", "--net", net, "--explo", "cell"]) == 2
    (config,) = trained
    usual = configure(config.recipe, net=net)
    changed = {
        "scenario": "scenario/corridor.yaml",
        "bonus": "cell",
        "bonus_c": 3.0,
        "threads": config.threads,
    }
    assert config.model_dump() == usual.model_dump() | changed
    assert config.envs == envs
    assert config.threads >= 1


def test_the_automatic_bonus_is_the_paper_s() -> None:
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    found = {}
    for name in BONUSES:
        typed = [name, "--bonus", "auto", "--recipe", "plain", "--device", "cpu"]
        config = new_config(name, given_options(parser.parse_args(typed)), socialai_dsl.load(name))
        found[name] = (config.bonus, config.bonus_c)
    assert found == BONUSES


BONUSES = {
    "talkitout": ("lang", 7),
    "talkitout_no_liar": ("lang", 7),
    "diverse_exit": ("lang", 20),
    "dance": ("cell", 3),
    "showme": ("cell", 3),
    "showme_no_social": ("cell", 3),
    "help": ("cell", 3),
    "help_as_helper": ("cell", 3),
    "cointhief": ("cell", 2),
    "cointhief_tags": ("cell", 2),
    "social_env": ("cell", 2),
}


@pytest.mark.thorough("trains twice")
def test_hyper_parameters_are_the_trainer_s_and_stay_with_the_run() -> None:
    given = [
        "--hyper",
        "entropy_coef=0.02",
        "--hyper",
        "bonus_formula=as_printed",
        "--hyper",
        "clip_value=true",
    ]
    assert run_main(["corridor.yaml", *QUICK, "--bonus", "lang", *given, "--out", "here"]) == 0
    assert run_main(["--resume", "here", "--frames", "4000"]) == 0
    used = json.loads(Path("here", "config.json").read_text())
    assert used["frames"] == 4000
    assert (used["entropy_coef"], used["bonus_formula"], used["clip_value"]) == (0.02, "as_printed", True)


def test_random_play_is_the_same_every_time() -> None:
    for name in ("one", "two"):
        assert run_main(["corridor.yaml", "--agent", "random", "--eval-episodes", "60", "--out", name]) == 0
    assert result_of("one") == result_of("two")
    assert result_of("one")["frames"] == 0
    assert not Path("one", "learning_curve.png").exists()


def test_an_oracle_needs_a_script(capsys: Capture) -> None:
    assert run_main(["corridor.yaml", "--agent", "oracle"]) == 2
    assert "corridor" in capsys.readouterr().err


def test_a_trained_agent_is_evaluated_elsewhere(trained: Path, capsys: Capture) -> None:
    shutil.copytree(trained, "here")
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
        (["corridor.yaml", "--agent", "nobody"], "there is no agent 'nobody'; expected the path of a run"),
        (["corridor.yaml", "--agent", "random", "--frames", "10"], "is not trained"),
        (["corridor.yaml", "--net", "huge"], "net: got 'huge'"),
        (
            ["corridor.yaml", "--agent", "random", "--wandb", "p"],
            "--wandb: the agent 'random' is not trained",
        ),
        (["--resume", "nowhere"], "is not a run's folder"),
        (
            ["corridor.yaml", "--agent", "random", "--hyper", "lr=1"],
            "--hyper lr: the agent 'random' is not trained",
        ),
        (
            ["corridor.yaml", "--agent", "random", "--recipe", "guided"],
            "--recipe: the agent 'random' is not trained",
        ),
        (
            ["corridor.yaml", "--agent", "random", "--seat", "agent=script"],
            "--seat: the agent 'random' is not trained",
        ),
        (["corridor.yaml", "--hyper", "lr"], "--hyper: got 'lr', expected NAME=VALUE"),
        (["corridor.yaml", "--hyper", "entropy_coeff=1"], "'entropy_coeff'; did you mean entropy_coef?"),
        (
            ["corridor.yaml", "--hyper", "banana=1"],
            "'banana'; expected one of guide_share, imitation_coef, aux_coef, horizon,",
        ),
        (["corridor.yaml", "--hyper", "envs=3"], "envs has an option of its own, --envs"),
        (["corridor.yaml", "--hyper", "lr=1", "--hyper", "lr=2"], "--hyper: lr is given twice"),
        (["corridor.yaml", "--hyper", "lr=[1]"], "expected a number, a word, true, false or null"),
        (["corridor.yaml", "--hyper", "lr=-1"], "--hyper lr: expected more than 0, got -1"),
        (["corridor.yaml", "--hyper", "bptt=5"], "--hyper bptt: got 5, expected a divisor of horizon = 32"),
        (
            ["corridor.yaml", "--checkpoint-every", "0"],
            "--checkpoint-every: expected at least 1",
        ),
        (
            ["corridor.yaml", "--keep-checkpoints", "0"],
            "--keep-checkpoints: expected at least 1",
        ),
        (["corridor.yaml", "--seed", "-1"], "--seed: expected at least 0, got -1"),
        (
            ["corridor.yaml", "--guide", "script"],
            "corridor.yaml: the agent of corridor has no frame, and there is no variant",
        ),
        (
            ["corridor.yaml", "--recipe", "guided"],
            "corridor.yaml: the agent of corridor has no frame, and there is no variant",
        ),
        (["corridor.yaml", "--net", "nowhere:Net"], "net: there is no module 'nowhere': looked for "),
        (["corridor.yaml", "--bonus", "mine:Bonus"], "bonus: there is no module 'mine': looked for "),
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


@pytest.mark.parametrize("agent", ["rival:nobody", "shipped:talkitout"])
def test_an_agent_that_cannot_play_here_leaves_no_folder(agent: str, capsys: Capture) -> None:
    assert run_main(["corridor.yaml", "--agent", agent, "--eval-episodes", "2", "--out", "here"]) == 2
    assert "corridor" in capsys.readouterr().err
    assert not Path("here").exists(), "the same command can be given again"


def test_a_curriculum_with_mistakes_leaves_no_folder(capsys: Capture) -> None:
    Path("phases.yaml").write_text("curriculum: phases\nphases: []\n")
    suite = str(DATA / "suites" / "school.yaml")
    assert run_main([suite, *QUICK, "--curriculum", "phases.yaml", "--out", "here"]) == 1
    assert "phases.yaml:2:" in capsys.readouterr().err
    assert not Path("here").exists(), "the same command can be given again"


def test_wandb_that_is_not_installed(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "wandb", None)
    assert run_main(["corridor.yaml", *QUICK, "--wandb", "project", "--out", "here"]) == 2
    assert "pip install 'socialai-dsl[wandb]'" in capsys.readouterr().err
    assert not Path("here").exists(), "the same command can be given again"


MINE = """
import numpy as np
from socialai_dsl.trainer.guides import Lead
from socialai_dsl.trainer.nets import FastNet

class Net(FastNet):
    kind_size = 4

class Bonus:
    def __init__(self, config, num_envs):
        self.paid = np.zeros(1)

    def step(self, step):
        self.paid += len(step.ended)
        return np.full(len(step.ended), 0.125)

    def state(self):
        return {"paid": self.paid}

    def load_state(self, state):
        self.paid = np.array(state["paid"])

class Guide:
    def __init__(self, config, envs):
        pass

    def lead(self, envs, starts, progress):
        with open("asked.txt", "a") as file:
            file.write("x")
        count = len(starts)
        return Lead(np.ones((count, 4), np.int64), np.ones(count, bool), np.ones(count, np.float32))

    def state(self):
        return {}

    def load_state(self, state):
        pass
"""


@pytest.mark.thorough("trains twice and evaluates")
def test_parts_of_ones_own_work_from_the_scenario_s_folder(capsys: Capture) -> None:
    """Nothing is on Python's path; the command is given elsewhere."""
    Path("project").mkdir()
    shutil.move("corridor.yaml", "project/corridor.yaml")
    Path("project/mine.py").write_text(MINE)
    own = ["--net", "mine:Net", "--bonus", "mine:Bonus", "--guide", "mine:Guide"]
    assert run_main(["project/corridor.yaml", *QUICK, *own, "--out", "here"]) == 0
    rows = [json.loads(line) for line in Path("here/metrics.jsonl").read_text().splitlines()]
    assert [(row["bonus"], row["led"]) for row in rows] == [(0.125, 1)] * 2
    evaluated = result_of("here")["eval"]
    assert len(Path("asked.txt").read_text()) == 2 * 32, "once a step of training, never in evaluation"
    assert run_main(["--resume", "here"]) == 0
    capsys.readouterr()
    command = ["evaluate", "here", "--episodes", "30", "--device", "cpu", "--json"]
    assert main([*command, "--net", "mine:Net"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["eval"] == evaluated
    assert main(command) == 2
    assert "name it (--net mine:Net)" in capsys.readouterr().err
    (code,) = [
        part.partition("```")[0] for part in Path("here/model_card.md").read_text().split("```python\n")[1:]
    ]
    with contextlib.chdir("here"):
        exec(compile(code, "model_card.md", "exec"), {})
    assert capsys.readouterr().out.strip() in evaluated["outcomes"]


@pytest.mark.parametrize("option", ["net", "bonus", "curriculum", "guide"])
def test_parts_of_ones_own_that_are_wrong_are_said_in_one_line(option: str, capsys: Capture) -> None:
    Path("wrong.py").write_text("class Part:\n    pass\n")
    scenario = str(DATA / "suites" / "school.yaml") if option == "curriculum" else "corridor.yaml"
    folder = Path(scenario).resolve().parent
    name = "wrong:Part" if option != "curriculum" else "wrong_here:Part"
    assert run_main([scenario, *QUICK, f"--{option}", name, "--out", "here"]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    if option == "curriculum":
        assert f"curriculum: there is no module 'wrong_here': looked for {folder}/wrong_here.py" in said
    else:
        assert f"{option}: {folder}/wrong.py: Part lacks the method " in said
    assert not Path("here").exists(), "the same command can be given again"


@pytest.mark.thorough("trains twice on a scenario of the paper")
def test_a_scripted_scenario_is_guided_unless_another_recipe_is_asked_for(capsys: Capture) -> None:
    few = ["--frames", "2048", "--envs", "8", "--threads", "1", "--eval-episodes", "5", "--device", "cpu"]
    assert run_main(["help", *few, "--out", "here"]) == 0
    result, config = result_of("here"), json.loads(Path("here/config.json").read_text())
    assert (result["scenario"], result["recipe"], result["guide"]) == ("help", "guided", "script")
    assert result["program_sha256"] == socialai_dsl.compile(socialai_dsl.load("help")).sha256, (
        "the plain scenario"
    )
    assert (config["recipe"], config["guide"]) == ("guided", "script")
    rows = [json.loads(line) for line in Path("here/metrics.jsonl").read_text().splitlines()]
    assert rows[0]["led"] == 1 > rows[-1]["led"]
    capsys.readouterr()
    assert run_main(["--resume", "here", "--frames", "4096"]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert "--frames: got 4096, expected 2048, because a guide, a schedule" in said
    assert json.loads(Path("here/config.json").read_text()) == config, "it can still be resumed as it was"
    assert run_main(["--resume", "here", "--frames", "-1"]) == 2
    assert "--frames: expected at least 0, got -1" in capsys.readouterr().err
    assert run_main(["help", "--recipe", "plain", *few, "--out", "plain"]) == 0
    assert (result_of("plain")["recipe"], result_of("plain")["guide"]) == ("plain", "none")


def test_a_file_says_how_long_an_agent_is_guided() -> None:
    for name, text in {
        "short": "scenario: short\nextends: corridor.yaml\ntraining_frames: 4096\n",
        "pair": "suite: pair\nabout: Two.\nmembers: [corridor.yaml, short.yaml]\ntraining_frames: 8192\n",
        "acts": "suite: acts\nabout: Two.\nmembers: [corridor.yaml, short.yaml]\ndraw: in_sequence\n",
    }.items():
        Path(f"{name}.yaml").write_text(text)
    loaded = {name: socialai_dsl.load(f"{name}.yaml") for name in ("corridor", "short", "pair", "acts")}
    usual = {name: usual_options("guided", one) for name, one in loaded.items()}
    assert usual == {
        "corridor": {"frames": 500_000},
        "short": {"frames": 4096},
        "pair": {"frames": 8192, "curriculum": "even"},
        "acts": {"frames": 6_000_000},  # nothing is drawn that a curriculum could choose
    }
    assert usual_options("plain", loaded["pair"]) == {"frames": 600_000}


@pytest.mark.thorough("trains twice")
def test_a_suite_of_which_one_member_has_no_script(capsys: Capture) -> None:
    Path("two.yaml").write_text("suite: two\nabout: One has a script.\nmembers: [corridor.yaml, help]\n")
    assert run_main(["two.yaml", *QUICK, "--recipe", "guided", "--out", "here"]) == 2
    assert "two.yaml: the agent of corridor has no frame" in capsys.readouterr().err
    assert not Path("here").exists()
    assert run_main(["two.yaml", *QUICK, "--out", "here"]) == 0
    assert (result_of("here")["recipe"], result_of("here")["guide"]) == ("plain", "none")


def test_unwritable_output(capsys: Capture) -> None:
    Path("file").write_text("")
    assert run_main(["corridor.yaml", *QUICK, "--out", "file/run"]) == 2
    assert "file/run" in capsys.readouterr().err


def test_a_loss_of_ones_own_that_is_not_finite_ends_the_run_and_loses_nothing(capsys: Capture) -> None:
    """In the third update; the checkpoint after the second is there, and so are its rows."""
    Path("mine.py").write_text(
        "import torch\n"
        "from socialai_dsl.trainer.auxiliary import AuxiliaryLoss\n"
        "class Loss(AuxiliaryLoss):\n"
        "    def __init__(self, config, net):\n"
        "        super().__init__(config, net)\n"
        "        self.register_buffer('begun', torch.zeros(()))\n"
        "    def begin(self, played, net, generator):\n"
        "        self.begun += 1\n"
        "    def forward(self, frames, outputs, net):\n"
        "        return outputs.values.mean() / (self.begun < 3)\n"
    )
    given = ["--aux", "mine:Loss", "--frames", "1024", "--envs", "8", "--checkpoint-every", "1"]
    assert run_main(["corridor.yaml", *given, "--out", "run"]) == 2
    said = capsys.readouterr().err
    assert "aux: Loss returned " in said
    assert "expected a finite scalar tensor of float32" in said
    assert "Traceback" not in said
    assert sorted(path.stem for path in Path("run/checkpoints").iterdir())[-1] == f"{512:015d}"
    assert len(Path("run/metrics.jsonl").read_text().splitlines()) == 2


def test_an_error_in_code_of_ones_own_names_its_place(capsys: Capture) -> None:
    Path("mine.py").write_text(
        "class Bonus:\n"
        "    def __init__(self, config, num_envs): pass\n"
        "    def step(self, step): return not_there\n"
        "    def state(self): return {}\n"
        "    def load_state(self, state): pass\n"
    )
    assert run_main(["corridor.yaml", *QUICK, "--bonus", "mine:Bonus"]) == 2
    said = capsys.readouterr().err
    assert "mine.py:3: NameError: name 'not_there' is not defined" in said
    assert "Traceback" not in said
