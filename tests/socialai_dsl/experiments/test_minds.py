"""Players that are not trained, language models among them, as runs of an experiment."""

import contextlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.cli.main import main
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.experiments.document import document_of
from socialai_dsl.experiments.folder import PlannedRun, read_experiment, runs_of
from socialai_dsl.experiments.work import _Work
from socialai_dsl.frontend import load_experiment
from socialai_dsl.runs.folder import Run
from tests.socialai_dsl.llm.endpoint import Stub, endpoint
from tests.socialai_dsl.reporting.page_reader import Page

pytest.importorskip("httpx", reason="language models need the extra llm")

FILE = """\
experiment: minds
set: {scenario: talkitout, eval_episodes: 4, trials: 2}
conditions:
  - {name: script, agent: oracle}
  - {name: rival, agent: "rival:first_answer"}
  - {name: chance, agent: random, seeds: [5]}
  - {name: model, agent: "llm:stub", model: {base_url: "URL", mode: json, probes: "off", concurrency: 1, LIMIT}}
"""


@pytest.fixture
def stub() -> Iterator[Stub]:
    with endpoint(lambda _: '{"move": "done", "say": null}') as served:
        yield served


@pytest.fixture
def experiment(tmp_path: Path, stub: Stub) -> Callable[..., int]:
    """Runs it, with a limit of what the model may cost."""

    def run(limit: str = "max_tokens: 20", *words: str) -> int:
        file = tmp_path / "minds.yaml"
        file.write_text(FILE.replace("URL", stub.url).replace("LIMIT", limit), encoding="utf-8")
        return main(
            ["experiment", "run", str(file), "--out", str(tmp_path / "out"), "--workers", "1", *words]
        )

    return run


def runs(tmp_path: Path) -> dict[str, Run]:
    folder = tmp_path / "out"
    return {run.condition["name"]: run for run in runs_of(folder, read_experiment(folder))}


@pytest.mark.thorough("starts commands")
def test_all_kinds_of_players_play_the_same_rooms_in_sessions(
    experiment: Callable[..., int], tmp_path: Path, stub: Stub
) -> None:
    assert experiment() == 0
    asked = len(stub.requests)
    assert experiment() == 0
    assert len(stub.requests) == asked, "what is done is not played again"
    found = {name: run.result for name, run in runs(tmp_path).items()}
    assert {name: (one["agent"], one["trials"], one["seed"]) for name, one in found.items() if one} == {
        "script": ("oracle", 2, 0),
        "rival": ("rival:first_answer", 2, 0),
        "chance": ("random", 2, 5),
        "model": ("llm:stub", 2, 0),
    }
    success = {name: one["eval"]["success_rate"] for name, one in found.items() if one}
    assert success["script"] > success["model"] == 0, "the model gives up at once"
    assert all(len(one["eval"]["trials"]) == 2 for one in found.values() if one)
    assert stub.requests[0]["max_tokens"] == 20
    assert stub.requests[0]["response_format"]["type"] == "json_schema"
    folder = runs(tmp_path)["model"].folder
    assert len(list((folder / "transcripts").glob("episode-*.jsonl"))) == 4
    assert not (folder / "played").exists()
    assert main(["report", str(tmp_path / "out"), "--out", str(tmp_path / "report"), "--no-baselines"]) == 0
    page = Page((tmp_path / "report" / "index.html").read_text(encoding="utf-8"))
    assert [row for row in page.table("replies") if row[0].startswith("model")]


@pytest.mark.thorough("starts commands")
def test_a_budget_stops_the_model_alone_and_a_retry_goes_on(
    experiment: Callable[..., int], tmp_path: Path, stub: Stub
) -> None:
    assert experiment("budget: '20'") != 0
    states = {name: run.status.state for name, run in runs(tmp_path).items()}
    assert states == {"script": "done", "rival": "done", "chance": "done", "model": "failed"}
    assert "the budget is spent" in (runs(tmp_path)["model"].status.message or "")
    asked = len(stub.requests)
    assert experiment("budget: '2000'", "--update") == 1, "a failed run waits for a retry"
    assert main(["experiment", "retry", str(tmp_path / "out")]) == 0
    assert experiment("budget: '2000'") == 0
    assert len(stub.requests) == 4, f"the {asked} replies that were there are played again"


def test_what_decides_about_replies_makes_another_run(tmp_path: Path) -> None:
    def ids(limit: str) -> dict[str, str]:
        file = tmp_path / "minds.yaml"
        file.write_text(
            FILE.replace("URL", "http://localhost:1/v1").replace("LIMIT", limit), encoding="utf-8"
        )
        document: dict[str, Any] = document_of(load_experiment(file), None)
        assert json.loads(json.dumps(document)) == document
        return {run["condition"]: run["id"] for run in document["runs"]}

    first = ids("max_tokens: 20")
    assert ids('max_tokens: 20, budget: "5", timeout: 7') == first
    other = ids("max_tokens: 30")
    assert other["model"] != first["model"]
    assert {name: run for name, run in other.items() if name != "model"} == {
        name: run for name, run in first.items() if name != "model"
    }


def test_a_table_of_prices_stands_beside_the_experiment(tmp_path: Path) -> None:
    """A run is given its path from anywhere; a model that it lacks is a finding, where the table is named."""
    file, table = tmp_path / "minds.yaml", tmp_path / "prices.yaml"
    file.write_text(
        FILE.replace("URL", "http://localhost:1/v1").replace("LIMIT", "prices: prices.yaml"), "utf-8"
    )
    table.write_text("stub: [1, 2]\n", encoding="utf-8")
    (model,) = [
        one for one in document_of(load_experiment(file), None)["conditions"] if one["name"] == "model"
    ]
    assert model["options"]["model"]["prices"] == str(table)
    table.write_text("stubb: [1, 2]\n", encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        load_experiment(file)
    (found,) = caught.value.diagnostics
    assert found.code == "S104"
    assert "has no prices of the model 'stub'; did you mean stubb?" in found.message
    assert (
        found.span.column == FILE.splitlines()[-1].replace("URL", "http://localhost:1/v1").index("LIMIT") + 9
    )


@pytest.mark.parametrize("moved", range(4))
def test_results_that_were_left_while_they_were_moved_are_taken(
    moved: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is played twice, wherever the process was killed; also in a folder that has some of it already."""
    options = {"eval_episodes": 6, "trials": 3}
    condition = {"name": "one", "scenario": "help", "agent": "random", "frames": None, "options": options}
    work = _Work(PlannedRun(tmp_path / "run", condition, 0, ()), lambda: False)
    place = tmp_path / "run" / "played" / "help"
    (place / "scenario").mkdir(parents=True)
    (tmp_path / "run" / "scenario").mkdir()
    for folder, content in ((tmp_path / "run", "before"), (place, "{}")):
        for name in ("episodes.csv", "scenario/help.yaml"):
            (folder / name).write_text(content)
    (place / "result.json").write_text("{}")
    whole, moves = Path.replace, iter(range(moved))

    def move(path: Path, target: Path) -> Path:
        if next(moves, None) is None:
            raise InterruptedError
        return whole(path, target)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", move)
        with contextlib.suppress(InterruptedError):
            work._train()
    work._train()
    found = {file.relative_to(tmp_path / "run").as_posix() for file in (tmp_path / "run").rglob("*.*")}
    assert found == {"episodes.csv", "scenario/help.yaml", "result.json"}
    assert (tmp_path / "run" / "scenario" / "help.yaml").read_text() == "{}"
    assert not (tmp_path / "run" / "played").exists()
