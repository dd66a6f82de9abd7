"""Folders that commands write: one writer each, nothing of this machine in them, and of use wherever they are moved."""

import base64
import contextlib
import gzip
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from socialai_dsl import evaluate, record, trace
from socialai_dsl.cli.main import main, run_main
from socialai_dsl.episodes import EvalResult, Player, RandomPolicy
from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.runs import folder as run_folder
from socialai_dsl.runs.folder import only_writer
from socialai_dsl.trainer.play import CheckpointPolicy

Capture = pytest.CaptureFixture[str]

QUICK = ["--frames", "1500", "--envs", "32", "--eval-episodes", "6", "--device", "cpu"]


@pytest.fixture(scope="module")
def moved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of a scenario with a base, named by its whole path, and moved to where nothing else of it is."""
    home = tmp_path_factory.mktemp("home")
    with contextlib.chdir(home):
        assert main(["new", "corridor"]) == 0
        (home / "rooms").mkdir()
        shutil.move("corridor.yaml", "rooms/base.yaml")
        shutil.move("corridor_oracle.yaml", "rooms/base_oracle.yaml")
        Path("longer.yaml").write_text("scenario: longer\nextends: rooms/base\nhorizon: 60\n")
        scenario = str(home / "longer.yaml")
        assert run_main([scenario, *QUICK, "--recipe", "plain", "--out", str(home / "run")]) == 0
    place = tmp_path_factory.mktemp("elsewhere") / "sent"
    shutil.move(home / "run", place)
    shutil.rmtree(home)
    return place


def texts(folder: Path) -> Iterator[tuple[str, str]]:
    """Every file below a folder as text, also what pages hold packed."""
    for file in folder.rglob("*"):
        if file.is_file():
            text = file.read_bytes().decode("utf-8", "replace")
            packed = re.search(r'octet-stream">([^<]*)<', text)
            yield file.name, text + (gzip.decompress(base64.b64decode(packed[1])).decode() if packed else "")


def check_tells_no_folder(folder: Path, *secrets: Path) -> None:
    named = [*map(str, secrets), str(shipped_folder().parent), str(Path.home()) + "/"]
    found = {(name, secret) for name, text in texts(folder) for secret in named if secret in text}
    assert found == set()


def test_a_run_folder_works_wherever_it_is(
    moved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.chdir(tmp_path)
    check_tells_no_folder(moved, moved.parent, moved.parent.parent)
    there = json.loads((moved / "result.json").read_text())["eval"]
    capsys.readouterr()
    assert main(["evaluate", str(moved), "--episodes", "6", "--device", "cpu", "--json"]) == 0
    (here,) = json.loads(capsys.readouterr().out)
    assert (here["warnings"], here["eval"]["outcomes"]) == ([], there["outcomes"])
    for agent in (moved, moved / "checkpoints", max((moved / "checkpoints").iterdir())):
        assert isinstance(CheckpointPolicy.load(agent), CheckpointPolicy)
    assert main(["replay", str(moved), "--episodes", "4", "--out", "page.html"]) == 0
    assert main(["export", str(moved), "--out", "given"]) == 0
    assert run_main(["--resume", str(moved), "--frames", "4000"]) == 0
    check_tells_no_folder(moved, moved.parent, moved.parent.parent)
    check_tells_no_folder(tmp_path, tmp_path, moved.parent)


def artefacts(scenario: str, out: Path) -> None:
    """Let every command write what it writes of a scenario."""
    assert (
        main(["evaluate", "random", "--on", scenario, "--episodes", "5", "--out", str(out / "chance")]) == 0
    )
    assert run_main([scenario, "--agent", "random", "--eval-episodes", "5", "--out", str(out / "run")]) == 0
    for name in ("page.html", "traces.json"):
        assert (
            main(["replay", scenario, "--agent", "random", "--episodes", "3", "--out", str(out / name)]) == 0
        )


@pytest.mark.parametrize("how", ["by its path", "by the path of what ships", "by its name"])
def test_no_artefact_names_a_folder_of_the_machine(
    how: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    home, out = tmp_path / "home", tmp_path / "out"
    for folder in (home, out, tmp_path / "elsewhere"):
        folder.mkdir()
    monkeypatch.chdir(home)
    assert main(["new", "corridor"]) == 0
    scenario = {
        "by its path": str(home / "corridor.yaml"),
        "by the path of what ships": str(shipped_folder() / "cointhief.yaml"),
        "by its name": "cointhief+unsocial",
    }[how]
    monkeypatch.chdir(tmp_path / "elsewhere")
    artefacts(scenario, out)
    capsys.readouterr()
    assert main(["trace", scenario, "--json", "--agent", "random"]) == 0
    (out / "trace.json").write_text(capsys.readouterr().out)
    played = evaluate("random", scenario, 3)
    record(played, out / "recorded")
    (out / "figures.json").write_text(json.dumps(played.figures()))
    check_tells_no_folder(out, tmp_path, home)


WRITES = {
    "run": "socialai-run corridor.yaml --agent random --eval-episodes 2 --out DIR",
    "resume": "socialai-run --resume DIR",
    "evaluate": "socialai evaluate random --on corridor.yaml --episodes 2 --out DIR",
    "a language model": "socialai evaluate llm:m --base-url http://localhost:9/v1 --on corridor.yaml --out DIR",
    "report": "socialai report RUN --no-baselines --out DIR",
    "export": "socialai export RUN --out DIR",
    "experiment": "socialai experiment run tiny.yaml --out DIR",
}


@pytest.mark.parametrize("command", WRITES)
def test_the_second_writer_of_a_folder_hears_of_the_first(
    command: str, moved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    """The lock comes before all other checks, and nothing in the folder changes."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run_folder, "_SECONDS_TO_WAIT", 0.1)
    assert main(["new", "corridor"]) == 0
    Path("tiny.yaml").write_text(
        "experiment: tiny\nset: {frames: 100, envs: 4, seeds: 1}\nconditions: [{name: a, scenario: corridor.yaml}]\n"
    )
    folder = tmp_path / "folder"
    shutil.copytree(moved, folder)
    script = (
        "from pathlib import Path; from socialai_dsl.runs.folder import only_writer\n"
        f"with only_writer(Path({str(folder)!r})): print('here', flush=True); input()"
    )
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", script], stdin=pipe, stdout=pipe, text=True) as writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == "here\n"
        before = {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
        program, *words = WRITES[command].replace("DIR", str(folder)).replace("RUN", str(moved)).split()
        capsys.readouterr()
        assert (run_main if program == "socialai-run" else main)(words) == 2
        told = capsys.readouterr().err.splitlines()[-1]
        assert f"{folder}: another process is writing this folder (process {writer.pid} on " in told
        assert {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()} == before
        writer.kill()


def test_recording_is_writing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_folder, "_SECONDS_TO_WAIT", 0.1)
    played = evaluate("random", "dance", 2)
    with (
        only_writer(tmp_path),
        pytest.raises(ValueError, match=r"another process is writing this folder \(process "),
    ):
        record(played, tmp_path)
    assert (record(played, tmp_path, 1) / "episode.html").is_file()


class Own:
    """A policy of one's own, with the two methods that are needed."""

    def reset(self, mask: Any, episodes: Any = None) -> None:
        self.begun = True

    def act(self, observation: Any) -> Any:
        return np.tile([0, 0, 0, 0], (len(observation["tokens"]), 1))


def forward(observation: Any) -> Any:
    return np.tile([2, 0, 0, 0], (len(observation["tokens"]), 1))


@pytest.mark.parametrize("policy", [Own(), forward, RandomPolicy((4, 2, 2, 2)), Player("mine", policy=Own())])
def test_a_policy_of_ones_own_is_tested_recorded_traced_and_replayed(policy: Any, tmp_path: Path) -> None:
    sizes = evaluate("random", "dance", 1).actions[0][0].shape
    assert sizes == (4,)
    played = evaluate(policy, "dance", 3)
    assert (played.result.episodes, played.figures()["actions"]) == (3, "")
    assert (record(played, tmp_path) / "episode.html").is_file()
    (one,) = played.traces([1])
    seen = trace("dance", policy, test_episode=1)
    assert (one.agent, seen.agent) == (played.player.agent, played.player.agent)
    assert (len(one.moments) - 1, len(seen.moments) - 1) == (len(played.actions[1]), len(played.actions[1]))


@pytest.mark.parametrize(
    ("act", "said"),
    [
        (lambda: evaluate(3, "dance"), "agent: got 3, expected"),  # type: ignore[arg-type]
        (lambda: evaluate(None, "dance"), "agent: got None, expected"),  # type: ignore[arg-type]
        (lambda: evaluate(Own, "dance"), "agent: got the class Own, expected an object"),
        (lambda: evaluate("random", "dance", 0), "episodes: got 0, expected"),
        (lambda: evaluate("random", "dance", 2.5), "episodes: got 2.5, expected"),  # type: ignore[arg-type]
        (lambda: evaluate("random", "dance", 10**9), "episodes: got 1000000000, expected"),
        (lambda: evaluate("llm:m", "dance"), "asks for a key"),
        (lambda: evaluate("human", "dance"), "needs a terminal"),
        (lambda: evaluate("nowhere", "dance"), "nowhere"),
        (lambda: trace("dance", "llm:m"), "'llm:m' plays for `socialai evaluate` alone"),
        (lambda: trace("dance", "human"), "'human' plays for `socialai evaluate` alone"),
        (lambda: trace("dance", 3), "agent: got 3, expected"),  # type: ignore[arg-type]
        (lambda: trace("dance", "random", do=["left"]), "agent: got one, but `do`"),
        (
            lambda: trace("dance", lambda _: np.zeros(4)),
            r"actions of the shape \(4,\) .*, expected whole numbers of the shape \(1, 4\)",
        ),
        (lambda: record(nothing(), Path("x")), "evaluation: got an EvalResult, expected"),  # type: ignore[arg-type]
    ],
)
def test_what_cannot_play_is_told_so(
    act: Any, said: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    with pytest.raises(ValueError, match=said):
        act()
    assert list(tmp_path.iterdir()) == []


def nothing() -> EvalResult:
    return EvalResult(np.ones(1, bool), np.zeros(1, int), np.ones(1, int), np.zeros(1), ("success",))


@pytest.mark.parametrize(
    "words",
    [
        "validate circle.yaml",
        "validate experiment.yaml",
        "validate study.yaml",
        "fmt circle.yaml",
        "test circle.yaml",
        "check circle.yaml",
        "trace circle.yaml",
        "run circle.yaml",
        "run help --curriculum circle.yaml",
        "run help --config circle.yaml",
        "evaluate circle.yaml --on help",
        "evaluate random --on circle.yaml",
        "report circle.yaml",
        "study status circle.yaml",
        "experiment plan circle.yaml",
        "replay circle.yaml",
    ],
)
def test_links_in_a_circle_are_a_mistake_of_whoever_names_them(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("circle.yaml").symlink_to("circle.yaml")
    Path("experiment.yaml").write_text("experiment: e\nconditions: [{name: a, scenario: circle.yaml}]\n")
    Path("study.yaml").write_text(
        "study: s\nconsent: I agree.\nblocks: [{scenario: circle.yaml, episodes: 1}]\n"
    )
    assert main(words.split()) in (1, 2)
    said = "".join(capsys.readouterr())
    assert said
    assert "internal error" not in said
