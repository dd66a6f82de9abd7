"""Runs in Python: what `socialai-run` does, without a word."""

import json
import shutil
import threading
from pathlib import Path
from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.errors import UsageError
from socialai_dsl.runs.outputs import record_run

WILD = '{"scenario": "help", "net": []}'
QUICK: dict[str, Any] = {
    "frames": 512,
    "envs": 8,
    "eval_episodes": 8,
    "threads": 1,
    "device": "cpu",
    "seed": 3,
}


def test_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It is told of before and after each update; its folder has everything; more frames make it longer."""
    seen: list[sd.Progress] = []
    run = sd.train("help", out=tmp_path / "run", recipe="plain", horizon=32, progress=seen.append, **QUICK)
    assert [(one.frames, one.total) for one in seen] == [(0, 512), (256, 512), (512, 512)]
    assert {one.run for one in seen} == {run} == {sd.Run(tmp_path / "run")}
    assert run.result == json.loads((run.folder / "result.json").read_text())
    assert (run.config.frames, run.config.lr, run.checkpoint_frames) == (512, 7e-4, 512)
    assert run.agent == str(run.folder)
    with pytest.raises(
        UsageError, match="frames: got 256, but the run has 512 already; expected at least as many"
    ):
        sd.resume(run.folder, frames=256)
    assert run.config.frames == 512
    longer = sd.resume(run.folder, frames=768)
    assert longer == run
    assert longer.result is not None
    assert longer.result["frames"] == 768
    assert capsys.readouterr() == ("", "")


def test_an_agent_that_is_not_trained(tmp_path: Path) -> None:
    run = sd.train("help", out=tmp_path / "run", agent="oracle", eval_episodes=5)
    assert (run.agent, run.checkpoint_frames) == ("oracle", None)
    assert run.result is not None
    assert run.result["eval"]["success_rate"] == 1
    with pytest.raises(ValueError, match=r"resume: the agent 'oracle' of .* is not trained"):
        sd.resume(run.folder)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"fames": 5}, "fames: there is no such option; did you mean frames"),
        ({"frames": "many"}, "frames: expected a valid integer, got 'many'"),
        ({"lr": -1.0}, "lr: expected more than 0, got -1.0"),
        ({"device": "tpu"}, "device: got 'tpu', expected auto, cpu or cuda"),
        (
            {"agent": "nobody"},
            "there is no agent 'nobody'; expected the path of a run or a checkpoint, random",
        ),
        ({"agent": "random", "frames": 10}, "frames: the agent 'random' is not trained"),
        ({"recipe": "plain", "guide_share": 0.2}, "guide_share: it is for --guide, and this run has none"),
        ({"recipe": "wild"}, "recipe: got 'wild', expected one of plain"),
    ],
)
def test_an_option_that_is_wrong_is_named_and_no_folder_made(
    options: dict[str, Any], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=said):
        sd.train("help", **options)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_holds_a_run(tmp_path: Path) -> None:
    sd.train("help", out=tmp_path / "run", agent="random", eval_episodes=1)
    with pytest.raises(UsageError, match=r"out: .* holds a run already; resume it, or choose another folder"):
        sd.train("help", out=tmp_path / "run", agent="random", eval_episodes=1)
    with pytest.raises(UsageError, match=r"resume: .*nowhere is not a run's folder"):
        sd.resume(tmp_path / "nowhere")


def test_a_thread_of_its_own(tmp_path: Path) -> None:
    """Only the main thread may ask for signals."""
    options = {**QUICK, "frames": 256, "recipe": "plain", "out": tmp_path / "run"}
    thread = threading.Thread(target=sd.train, args=("help",), kwargs=options)
    thread.start()
    thread.join(120)
    assert sd.Run(tmp_path / "run").result is not None


def test_options_in_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from socialai_dsl.cli.main import run_main

    file = tmp_path / "options.json"
    file.write_text(json.dumps({"scenario": "help", "agent": "random", "seed": 4, "eval_episodes": 3}))
    assert run_main(["--config", str(file), "--out", str(tmp_path / "run"), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["scenario"], result["seed"], result["eval"]["episodes"]) == ("help", 4, 3)
    assert run_main(["--config", str(file), "--seed", "5"]) == 2
    assert "--config: the file says all options" in capsys.readouterr().err
    for text, said in (
        ("[]", "expected a JSON object"),
        ("{", "expected JSON"),
        ("{}", "expected a scenario"),
        (WILD, "--net: got [], expected a number"),
    ):
        file.write_text(text)
        assert run_main(["--config", str(file)]) == 2
        assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("missing", "said"),
    [
        ("scenario", r"lacks its copy of the scenario, scenario/mine\.yaml; copy the folder as a whole"),
        ("metrics.jsonl", r"lacks its metrics\.jsonl; copy the folder as a whole"),
        ("checkpoints", "nothing to resume, there are no checkpoints"),
        ("config.json", "is not a run's folder, it has no config"),
    ],
)
def test_a_folder_that_was_copied_in_part(missing: str, said: str, half: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(half, tmp_path / "copy")
    found = folder / missing
    shutil.rmtree(found) if found.is_dir() else found.unlink()
    before = {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    with pytest.raises(UsageError, match=said):
        sd.resume(folder)
    after = {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    assert before.items() <= after.items(), "nothing is lost"


@pytest.fixture(scope="module")
def half(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of a scenario of one's own."""
    place = tmp_path_factory.mktemp("own")
    (place / "mine.yaml").write_text("scenario: mine\nextends: help\n")
    options = {**QUICK, "frames": 256, "recipe": "plain"}
    return sd.train(place / "mine.yaml", out=place / "run", **options).folder


def test_a_run_that_was_killed_before_its_first_checkpoint_begins_anew(tmp_path: Path) -> None:
    options = {**QUICK, "frames": 256, "recipe": "plain"}
    whole = sd.train("help", out=tmp_path / "whole", **options)
    (tmp_path / "killed" / "checkpoints").mkdir(parents=True)
    shutil.copyfile(whole.folder / "config.json", tmp_path / "killed" / "config.json")
    for name in ("metrics.jsonl", "checkpoints/000000000000000.tmp"):
        (tmp_path / "killed" / name).touch()
    with pytest.raises(UsageError, match="holds a run already; resume it"):
        sd.train("help", out=tmp_path / "killed", **options)
    again = sd.resume(tmp_path / "killed")
    assert again.result is not None
    assert whole.result is not None
    assert again.result["eval"] == whole.result["eval"]


def test_what_an_earlier_player_left_in_a_folder_is_not_shown_as_of_the_next_one(tmp_path: Path) -> None:
    """Chance fails, and the script does not; neither in the folder of an evaluation nor in that of a run."""

    def shown(folder: Path) -> set[str]:
        return {file.name for file in folder.iterdir() if file.suffix in (".gif", ".html", ".txt")}

    def left(agent: str, record: int = 1) -> set[str]:
        place = sd.evaluate(agent, "help", 4, out=tmp_path / "same", record=record).folder
        assert place is not None
        return shown(place)

    assert left("random") == {"failure-000.gif", "failure-000.txt", "episode.html"}
    assert left("oracle") == {"success-000.gif", "success-000.txt", "episode.html"}
    (tmp_path / "same" / "help" / "success-story.txt").write_text("of somebody else")
    of_the_script = {"success-000.gif", "success-000.txt", "episode.html", "success-story.txt"}
    assert left("oracle", 0) == of_the_script, "the episodes are the same"
    assert left("random", 0) == {"success-story.txt"}

    run = sd.train("help", out=tmp_path / "run", agent="oracle", eval_episodes=4)
    for name in ("failure.gif", "failure.txt"):
        (run.folder / name).write_text("of an earlier test")
    record_run(sd.evaluate("oracle", "help", 4), run.folder, "script")
    assert shown(run.folder) == {"episode.gif", "transcript.txt", "episode.html"}
