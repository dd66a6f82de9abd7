"""Suites on the command line: checked, shown, played, trained on and evaluated like scenarios."""

import asyncio
import json
import re
import shutil
from pathlib import Path

import pytest

from benchmarks.__main__ import main as bench
from socialai_dsl.cli.main import main, run_main
from socialai_dsl.play.screen import PlayApp

Capture = pytest.CaptureFixture[str]
DATA = Path(__file__).parents[2] / "data" / "suites"
QUICK = ["--frames", "1500", "--envs", "32", "--eval-episodes", "40", "--device", "cpu"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the suites."""
    shutil.copytree(DATA, tmp_path / "suites")
    monkeypatch.chdir(tmp_path / "suites")
    return tmp_path


@pytest.mark.thorough("trains on a suite")
def test_a_run_and_what_it_says_of_each_member(capsys: Capture) -> None:
    assert run_main(["pair.yaml", *QUICK, "--out", "run"]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"errands: failure: agent.did\(toggle\) +errands.yaml:32\n", printed)
    result = json.loads(Path("run/result.json").read_text())
    members = result["eval"]["members"]
    assert list(members) == ["talkitout", "errands"]
    assert sum(member["share"] for member in members.values()) == pytest.approx(1)
    assert sum(m["share"] * m["success_rate"] for m in members.values()) == pytest.approx(
        result["eval"]["success_rate"]
    )
    assert Path("run/transcript.txt").read_text().split("\n")[0].rpartition(": ")[2] in members
    last = json.loads(Path("run/metrics.jsonl").read_text().splitlines()[-1])
    assert "errands: sold" in last["outcomes"]
    assert "errands: baker.trade.waiting.then[0]" in last["rules"]
    assert (Path("run") / "learning_curve.png").stat().st_size > 0

    assert run_main(["--resume", "run", "--frames", "3000"]) == 0
    capsys.readouterr()
    assert main(["evaluate", "run", "--on", "pair.yaml?split=test", "--episodes", "20", "--json"]) == 0
    (evaluated,) = json.loads(capsys.readouterr().out)
    assert list(evaluated["eval"]["members"]) == ["talkitout", "errands_open"]


def test_the_scripts_of_a_suite(capsys: Capture) -> None:
    assert run_main(["social_env", "--agent", "oracle", "--eval-episodes", "60", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["eval"]["success_rate"] > 0.9
    assert all(member["success_rate"] > 0.5 for member in result["eval"]["members"].values())
    assert run_main(["pair.yaml", "--agent", "oracle"]) == 2
    assert "the agent of errands has no frame" in capsys.readouterr().err


@pytest.fixture
def person(monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody at a terminal who gives up each episode at once."""

    async def keys(app: PlayApp) -> None:
        async with app.run_test() as pilot:
            await pilot.press(*["x", "n"] * 12, "q")

    def run(app: PlayApp) -> object:
        asyncio.run(keys(app))
        return app.return_value

    monkeypatch.setattr("socialai_dsl.play._require_terminal", lambda: None)
    monkeypatch.setattr(PlayApp, "run", run)


@pytest.mark.usefixtures("person")
@pytest.mark.parametrize(
    ("options", "granted"),
    [
        ([], {"tell": "nothing", "view": "seat"}),
        (["--goal", "Help.", "--view", "room"], {"tell": "goal", "told": "Help.", "view": "room"}),
    ],
)
def test_what_a_person_was_told_and_saw_is_recorded(options: list[str], granted: dict[str, str]) -> None:
    command = [
        "evaluate",
        "human",
        "--on",
        "talkitout",
        "--episodes",
        "2",
        "--record",
        "0",
        "--out",
        "people",
    ]
    assert main([*command, *options]) == 0
    (session,) = Path("people").iterdir()
    result = json.loads((session / "talkitout" / "result.json").read_text())
    begun, *events = map(json.loads, (session / "talkitout" / "played.jsonl").read_text().splitlines())
    for recorded in (result, begun):
        assert {key: recorded[key] for key in ("tell", "told", "view") if key in recorded} == granted
    titles = {event["title"] for event in events if event["event"] == "episode"}
    assert all(("talkitout" in title) == (granted["view"] == "room") for title in titles)


@pytest.mark.usefixtures("person")
@pytest.mark.thorough("compiles suites")
def test_a_person_plays_members() -> None:
    assert run_main(["pair.yaml?split=test", "--agent", "human", "--eval-episodes", "8", "--out", "run"]) == 0
    result = json.loads(Path("run/result.json").read_text())
    assert sum(result["eval"]["outcomes"].values()) == pytest.approx(1)
    assert sum(member["share"] for member in result["eval"]["members"].values()) == pytest.approx(1)


def test_show(capsys: Capture) -> None:
    assert main(["show", "pair+loud"]) == 0
    assert "grammar: concat" in capsys.readouterr().out
    assert main(["show", "pair", "--program"]) == 0
    listing = capsys.readouterr().out
    assert "=== talkitout ===" in listing
    assert "=== errands ===" in listing
    assert main(["show", "pair+loud", "--origin"]) == 0
    assert 'pair_loud.yaml:3:16: grammar = "concat"' in capsys.readouterr().out


def test_validate(capsys: Capture) -> None:
    assert main(["validate", "."]) == 0
    assert "0 errors" in capsys.readouterr().out
    text = Path("errands.yaml").read_text()
    Path("errands.yaml").write_text(text.replace("baker.is(gone)", "baker.is(gon)"))
    assert main(["validate", "pair.yaml"]) == 1
    assert "errands.yaml:31:24: S310" in capsys.readouterr().out


def test_bench(capsys: Capture) -> None:
    quick = [
        "--batch",
        "8",
        "--mix",
        "walk",
        "--repeat",
        "1",
        "--seconds",
        "0.01",
        "--only",
        "ours",
        "--json",
    ]
    assert bench(["pair.yaml", *quick]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [row["what"] for row in rows[:2]] == ["pair.yaml", "pair.yaml"]


def test_a_room_that_cannot_be_is_the_authors_affair(capsys: Capture) -> None:
    for agent in ("ppo", "random"):
        assert run_main(["impossible.yaml", "--agent", agent]) == 1
        said = capsys.readouterr().err
        assert said.startswith("socialai-run: impossible: none of 64 rooms was as `require` asks")
        assert "bug" not in said


@pytest.mark.thorough("trains twice")
def test_a_run_with_a_curriculum_is_resumed_with_it(capsys: Capture) -> None:
    plan = "curriculum: mine\nphases:\n- play: [{only: {help: told}}]\n  until: {episodes: 99000}\n- {}\n"
    Path("plan.yaml").write_text(plan)
    assert run_main(["school.yaml", *QUICK, "--curriculum", "plan.yaml", "--out", "run"]) == 0
    rows = [json.loads(line) for line in Path("run/metrics.jsonl").read_text().splitlines()]
    played = {name.partition(":")[0] for name, rate in rows[0]["outcomes"].items() if rate}
    assert played
    assert all("help=told" in name for name in played)
    assert json.loads(Path("run/config.json").read_text())["curriculum"] == "plan.yaml"
    assert run_main(["--resume", "run", "--frames", "3000"]) == 0
    Path("plan.yaml").write_text(plan.replace("99000", "98000"))
    assert run_main(["--resume", "run", "--frames", "4500"]) == 0, "a run has a copy of its own"
    (kept,) = Path("run").rglob("plan.yaml")
    kept.write_text(plan.replace("99000", "98000"))
    assert run_main(["--resume", "run", "--frames", "6000"]) == 2
    assert "its file has changed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["school.yaml", "--curriculum", "expart"],
            "curriculum: got 'expart', expected one of even, expert, ladder, progress",
        ),
        (
            ["school.yaml", "--curriculum", "expert"],
            "got introduction: ask_eye_contact; the suite has ask, gaze, none",
        ),
        (["errands.yaml", "--curriculum", "progress"], "curriculum: got a scenario, expected a suite"),
        (["acts.yaml", "--curriculum", "progress"], "no suite that draws members"),
        (["pair.yaml", "--curriculum", "progress", "--agent", "random"], "the agent 'random' is not trained"),
    ],
)
def test_curricula_that_do_not_fit(arguments: list[str], message: str, capsys: Capture) -> None:
    assert run_main([*arguments[:1], "--out", "run", *arguments[1:]]) == 2
    assert message in capsys.readouterr().err
    assert not Path("run").exists()


def test_acts_are_trained_on_and_evaluated(capsys: Capture) -> None:
    assert run_main(["acts.yaml", *QUICK, "--out", "run", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["eval"]["success_rate"] <= result["eval"]["members"]["errands"]["success_rate"] + 1e-9


def test_layouts_in_suites_are_checked(capsys: Capture) -> None:
    assert main(["validate", "school.yaml"]) == 0
    Path("school.yaml").write_text(Path("school.yaml").read_text().replace("secret: bread", "secret: broad"))
    assert main(["validate", "school.yaml"]) == 1
    assert "school.yaml:11:65: S204 let.secret: got 'broad'; expected one of" in capsys.readouterr().out
