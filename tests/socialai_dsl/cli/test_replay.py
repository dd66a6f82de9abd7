"""`socialai replay`: the page is complete and small, and mistakes are told in words."""

from __future__ import annotations

import base64
import gzip
import json
import re
from pathlib import Path
from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.cli.main import main, run_main
from socialai_dsl.envs.factory import compiled
from socialai_dsl.episodes import trace_of
from socialai_dsl.episodes.players import Player
from socialai_dsl.evaluation.test_set import play_test_set, trace_test_episodes
from socialai_dsl.traces import Trace
from socialai_dsl.traces.page import replay_page

Capture = pytest.CaptureFixture[str]

QUICK = ["--frames", "1500", "--envs", "32", "--eval-episodes", "30", "--device", "cpu"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def episodes_in(page: Path) -> list[dict[str, Any]]:
    found = re.search(r'<script id="episodes"[^>]*>([^<]*)</script>', page.read_text(encoding="utf-8"))
    assert found is not None
    traces: list[dict[str, Any]] = json.loads(gzip.decompress(base64.b64decode(found.group(1))))
    return traces


def won(trace: dict[str, Any]) -> bool:
    return bool(trace["moments"][-1]["ended"]["success"])


def test_successes_come_first_and_ten_episodes_are_small(capsys: Capture) -> None:
    assert main(["replay", "cointhief", "--agent", "random"]) == 0
    assert "episodes written to episode.html" in capsys.readouterr().out
    page = Path("episode.html")
    assert page.stat().st_size <= 400_000
    kept = [won(trace) for trace in episodes_in(page)]
    assert kept == sorted(kept, reverse=True)
    assert len(kept) <= 10


def test_ten_episodes_that_run_out_of_time_are_small() -> None:
    env = sd.make("social_env")
    traces = [
        trace_of(
            env, [env.action_space.sample() * 0] * 300, {"seed": seed}, scenario="s", agent="a", episode="e"
        )
        for seed in range(10)
    ]
    assert len(replay_page(traces)) <= 400_000


def test_one_test_episode_and_traces_as_a_file() -> None:
    assert main(["replay", "talkitout", "--test-episode", "7", "-o", "seven.json"]) == 0
    (trace,) = json.loads(Path("seven.json").read_text(encoding="utf-8"))
    assert (trace["episode"], trace["agent"], trace["format"]) == (
        "test episode 7",
        "oracle",
        "socialai-trace/1",
    )
    assert trace["about"].startswith("Leave by the right one")
    assert main(["replay", "seven.json", "-o", "seven.html"]) == 0
    assert episodes_in(Path("seven.html")) == [trace]
    assert main(["replay", "talkitout", *(f"--test-episode={n}" for n in (7, 2, 7)), "-o", "two.json"]) == 0
    first, second = json.loads(Path("two.json").read_text(encoding="utf-8"))
    assert (first, second["episode"]) == (trace, "test episode 2")


def test_a_late_test_episode_is_played_without_those_before() -> None:
    (trace,) = sd.replay("dance", agent="random", test_episodes=[900_000])
    assert trace.episode == "test episode 900000"


@pytest.mark.parametrize("trials", [1, 3])
@pytest.mark.parametrize("agent", ["random", "oracle", "shipped:dance"])
def test_an_episode_that_is_played_without_others_is_that_of_the_evaluation(agent: str, trials: int) -> None:
    loaded = sd.load("dance")
    program, player = compiled(loaded), Player(agent, seed=4)
    every = play_test_set(player, "dance", loaded, program, 12, trials)
    alone, _ = trace_test_episodes(player, "dance", loaded, program, [11, 4, 5], trials)
    assert alone == every.traces([11, 4, 5])


@pytest.mark.parametrize("trials", [1, 3])
def test_the_agent_of_a_folder_plays_again_with_its_seed_and_its_trials(trials: int) -> None:
    evaluation = sd.evaluate("random", "dance", 6, seed=5, trials=trials, out="out")
    assert evaluation.folder is not None
    assert sd.replay(evaluation.folder, test_episodes=[4, 1]) == [
        trace.model_copy(update={"scenario": evaluation.kept}) for trace in evaluation.traces([4, 1])
    ]


@pytest.mark.parametrize("alone", [True, False])
def test_who_plays_a_scenario_with_sessions_remembers_them_as_in_an_evaluation(alone: bool) -> None:
    """What chance draws follows from the number of the first episode that it remembers."""
    file = Path(__file__).parents[2] / "data" / "agreement" / "sessions.yaml"
    evaluated = sd.evaluate("random", file, 6).traces([1, 5])
    asked: dict[str, Any] = {"test_episodes": [1, 5]} if alone else {"episodes": 6, "record": 6}
    replayed = {one.episode: one for one in sd.replay(file, agent="random", **asked)}
    for one in evaluated:
        assert [m.action for m in replayed[one.episode].moments] == [m.action for m in one.moments]


def test_what_trace_prints_can_be_replayed(capsys: Capture) -> None:
    assert main(["trace", "talkitout", "--test-episode", "7", "--json"]) == 0
    printed = capsys.readouterr().out
    Path("seven.json").write_text(printed)
    assert main(["replay", "talkitout", "--test-episode", "7", "-o", "replayed.json"]) == 0
    (replayed,) = json.loads(Path("replayed.json").read_text(encoding="utf-8"))
    assert json.loads(printed)["moments"] == replayed["moments"]
    assert main(["replay", "seven.json", "-o", "seven.html"]) == 0
    assert [trace["episode"] for trace in episodes_in(Path("seven.html"))] == ["test episode 7"]


def test_a_run_writes_what_its_agent_expected() -> None:
    assert run_main(["dance", *QUICK, "--recipe", "plain", "--out", "run"]) == 0
    traces = [Trace.model_validate(trace) for trace in episodes_in(Path("run", "episode.html"))]
    assert all(moment.thought is not None for trace in traces for moment in trace.moments[1:])
    for moment in traces[0].moments[1:]:
        assert moment.thought is not None
        assert [len(head) for head in moment.thought.probabilities] == [4, 2, 2, 2]
        assert all(sum(head) == pytest.approx(1, abs=0.005) for head in moment.thought.probabilities)
        assert moment.action is not None
        chosen = [head[k] for head, k in zip(moment.thought.probabilities, moment.action, strict=True)]
        assert min(chosen) > 0
    assert main(["replay", "run", "--episodes", "30", "-o", "again.html"]) == 0
    again = [Trace.model_validate(trace) for trace in episodes_in(Path("again.html"))]
    assert [trace.moments for trace in again] == [trace.moments for trace in traces]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["talkitout", "-o", "page.txt"], "--out: got page.txt, expected a name that ends in .html or .json"),
        (["none.json"], "No such file"),
        (["list.json"], "expected at least one trace"),
        (["text.json"], "expected a JSON list of traces"),
        (["other.json"], "0.format"),
        (["nowhere"], "there is no"),
        (["talkitout", "--agent", "nowhere"], "nowhere"),
    ],
)
def test_mistakes(arguments: list[str], told: str, capsys: Capture) -> None:
    Path("list.json").write_text("[]")
    Path("text.json").write_text("no")
    Path("other.json").write_text('[{"format": "socialai-trace/9"}]')
    assert main(["replay", *arguments]) in (1, 2)
    assert told in capsys.readouterr().err
    assert not Path("episode.html").exists()


def test_a_notebook_shows_an_episode() -> None:
    env = sd.make("talkitout")
    trace = trace_of(env, [], {"seed": 0}, scenario="talkitout", agent="nobody", episode="seed 0")
    shown = trace._repr_html_()
    assert shown.startswith("<iframe")
    assert "&lt;script" in shown
    assert "<script" not in shown
