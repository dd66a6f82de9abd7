"""Reading experiments: whatever state their runs are in, a report can be made of what is there."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.model_options import ModelOptions
from socialai_dsl.reporting.collect import RunRecord, read_experiment, read_runs
from socialai_dsl.runs.lock import hold
from socialai_dsl.trainer.config import WITHOUT_EFFECT, RunConfig
from tests.socialai_dsl.reporting.synthetic import condition, write_experiment, write_run, write_tests


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """One condition of four seeds."""
    return write_experiment(tmp_path, [condition("Help / PPO", [0.2, 0.4, 0.6, 0.8])])


def runs(folder: Path) -> list[RunRecord]:
    return read_experiment(folder).runs


def test_a_finished_run_is_read_whole(folder: Path) -> None:
    write_tests(folder / "runs" / "c0-s1", {"help_as_helper": 0.1})
    first, second, *_ = runs(folder)
    assert (first.state, first.frames, first.problems) == ("done", 1000, ())
    assert first.figures is not None
    assert first.figures.success_rate == 0.2
    assert second.tests["help_as_helper"].success_rate == 0.1
    assert first.digest == second.digest, "a configuration's digest does not depend on the seed"
    assert len(first.updates() or []) == 10


def test_runs_in_every_state(folder: Path) -> None:
    missing, unfinished, failed, torn = (folder / "runs" / f"c0-s{seed}" for seed in range(4))
    shutil.rmtree(missing)
    for run in (unfinished, torn):
        (run / "result.json").unlink()
        (run / "status.json").unlink()
    (failed / "result.json").unlink()
    (failed / "status.json").write_text(
        json.dumps({"state": "failed", "attempts": [1, 2], "message": "no space"})
    )
    with (torn / "metrics.jsonl").open("a") as file:
        file.write('{"update": 11, "fra')
    found = runs(folder)
    assert [run.state for run in found] == ["missing", "running", "failed", "running"]
    assert [run.result for run in found] == [None] * 4
    assert found[2].message == "no space"
    assert found[3].frames == 1000, "the line that was never finished does not count"


def test_a_run_whose_worker_is_gone_has_stopped(folder: Path) -> None:
    run = folder / "runs" / "c0-s0"
    (run / "status.json").write_text(json.dumps({"state": "running", "attempts": [1]}))
    assert runs(folder)[0].state == "running"
    with hold(run, "worker"):
        assert runs(folder)[0].state == "running"
    (run / "worker.lock").touch()  # as a worker that is killed leaves it
    assert runs(folder)[0].state == "stopped"


def test_a_run_of_two_conditions_is_one_run(folder: Path) -> None:
    path = folder / "experiment.json"
    record = json.loads(path.read_text())
    record["conditions"].append(record["conditions"][0] | {"name": "again"})
    record["runs"].append({"id": "c0-s0", "condition": "again", "seed": 0})
    path.write_text(json.dumps(record))
    assert len(runs(folder)) == 4


@pytest.mark.parametrize("name", ["result.json", "status.json", "tests.json", "config.json", "metrics.jsonl"])
@pytest.mark.parametrize("content", ["{", '{"a": [', "[1, 2]\n", '{"eval": {"success_rate": 7}}\n', "\x00\n"])
def test_damaged_files_are_problems_of_their_run(folder: Path, name: str, content: str) -> None:
    run = folder / "runs" / "c0-s2"
    if name == "metrics.jsonl":
        (run / "result.json").unlink()
    (run / name).write_text(content)
    damaged = runs(folder)[2]
    if (name, content) != ("config.json", '{"eval": {"success_rate": 7}}\n'):  # a mapping is a configuration
        assert any(problem.startswith(name) for problem in damaged.problems), damaged.problems
    assert [run.problems for run in runs(folder) if run.seed != 2] == [()] * 3


@pytest.mark.parametrize(
    "content",
    [
        "episode,success\n0,maybe\n",
        "number\n0\n",
        "episode,success\n0\n",
        "\xff\x00\n",
        "episode,success\n0,1\n0,0\n",
        "episode,success\n0,7\n",
        "episode,success\n0,99999999999999999999\n",
    ],
)
def test_a_damaged_list_of_episodes_is_a_problem(folder: Path, content: str) -> None:
    (folder / "runs" / "c0-s2" / "episodes.csv").write_text(content, encoding="latin-1")
    damaged = runs(folder)[2]
    assert damaged.problems == ("episodes.csv is damaged",)
    assert (damaged.rooms.empty, damaged.state) == (True, "done")


def test_a_folder_in_place_of_a_file_is_a_problem_too(folder: Path) -> None:
    run = folder / "runs" / "c0-s0"
    (run / "result.json").unlink()
    (run / "result.json").mkdir()
    assert "result.json cannot be read" in runs(folder)[0].problems[0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": 2}, "format: expected 1, got 2"),
        (
            {"runs": [{"id": "x", "condition": "nobody", "seed": 0}]},
            "condition 'nobody', which is not listed",
        ),
        ({"runs": [{"id": "../x", "condition": "Help / PPO", "seed": 0}]}, "expected the name of a folder"),
        ({"runs": [{"id": "..", "condition": "Help / PPO", "seed": 0}]}, "expected the name of a folder"),
    ],
)
def test_a_damaged_experiment_is_a_mistake(folder: Path, change: dict[str, object], message: str) -> None:
    path = folder / "experiment.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(ValueError, match=r"experiment\.json") as caught:
        read_experiment(folder)
    assert message in str(caught.value)


def test_runs_without_an_experiment_are_grouped_by_what_they_are(tmp_path: Path) -> None:
    folders = [
        write_run(tmp_path / "a", "help", 1, 0.5),
        write_run(tmp_path / "b", "help", 0, 0.7),
        write_run(tmp_path / "c", "talkitout+unsocial", 0, 0.2),
    ]
    helped, unsocial = read_runs(folders).conditions
    assert [run.seed for run in helped.runs] == [0, 1]
    assert (helped.entry.row, helped.entry.column) == ("help", "ppo")
    assert unsocial.entry.name == "talkitout+unsocial / ppo"
    settings = json.loads((tmp_path / "b" / "config.json").read_text())
    (tmp_path / "b" / "config.json").write_text(json.dumps(settings | {"lr": 0.1}))
    columns = [condition.entry.column for condition in read_runs(folders).conditions]
    assert columns == ["ppo", "ppo, lr=0.1", "ppo"]
    with pytest.raises(ValueError, match=r"expected the folder of a run, with its config\.json"):
        read_runs([tmp_path])


@pytest.mark.parametrize("seat", ["agent", "jill"])
def test_networks_of_one_name_are_seeds_only_if_they_are_the_same(tmp_path: Path, seat: str) -> None:
    """Weights tell agents apart that were trained before, on the own seat and on others."""
    folders = [write_run(tmp_path / name, "help", seed, 0.5) for seed, name in enumerate("abc")]
    for folder, network in zip(folders, ("1", "1", "2"), strict=True):
        settings = json.loads((folder / "config.json").read_text()) | {"agent": "gate"}
        result = json.loads((folder / "result.json").read_text())
        if seat == "agent":
            result |= {"network_sha256": network}
        else:
            settings |= {"seats": {seat: ["partners/jill-0-gate.safetensors"]}}
            (folder / "partners").mkdir()
            (folder / "partners" / "jill-0-gate.safetensors").write_text(network)
        (folder / "config.json").write_text(json.dumps(settings))
        (folder / "result.json").write_text(json.dumps(result))
    same, other = read_runs(folders).conditions
    assert [len(same.runs), len(other.runs)] == [2, 1]
    assert same.entry.column != other.entry.column
    (alone,) = read_runs(folders[:2]).conditions
    assert alone.entry.column == ("gate" if seat == "agent" else "gate, jill by gate")


def changed(name: str, value: Any) -> Any:
    """Another value of an option."""
    words = {
        "update": "chunks",
        "loss": "per_head",
        "returns": "episode",
        "bonus_formula": "as_printed",
        "precision": "bfloat16",
        "recipe": "guided",
        "device": "cuda",
    }
    if isinstance(value, bool):
        return not value
    if name == "bptt":
        return 16
    if isinstance(value, str) or name == "wandb":
        return words.get(name, "mine:Own")
    if name == "seats":
        return {"jill": ["random"]}
    return 2 * value if isinstance(value, int) else (value or 1.0) / 2


@pytest.mark.parametrize("name", sorted(RunConfig.model_fields.keys() - {"scenario", "agent", "seed"}))
def test_runs_that_compute_something_else_are_no_seeds_of_each_other(name: str, tmp_path: Path) -> None:
    """Whatever keeps a run from going on with other options makes another condition, and so do the frames."""
    folders = [write_run(tmp_path / str(seed), "help", seed, 0.5) for seed in (0, 1)]
    one = RunConfig(scenario="help", update="chunks" if name == "bptt" else "environments", bptt=8)
    other = one.model_copy(update={name: changed(name, getattr(one, name)), "seed": 1})
    for folder, config in zip(folders, (one, other), strict=True):
        (folder / "config.json").write_text(config.model_dump_json())
    apart = name == "frames" or set(one.differences(other)) != {"seed"}
    assert apart or name in {*WITHOUT_EFFECT, "device", "threads", "eval_episodes"}
    RunConfig.model_validate_json(other.model_dump_json())
    found = {condition.entry.name for condition in read_runs(folders).conditions}
    assert len(found) == 1 + apart


def test_frames_are_named_where_they_tell_conditions_apart(tmp_path: Path) -> None:
    folders = [write_run(tmp_path / str(seed), "help", seed, 0.5) for seed in (0, 1, 2)]
    for folder, frames, seed in zip(folders, (1000, 2000, 2000), (0, 0, 1), strict=True):
        config = RunConfig(scenario="help", frames=frames, seed=seed)
        (folder / "config.json").write_text(config.model_dump_json())
    short, long = read_runs(folders).conditions
    assert (short.entry.column, long.entry.column) == ("ppo, 1,000 frames", "ppo, 2,000 frames")
    assert (len(long.runs), long.entry.frames) == (2, 2000)
    assert [one.entry.column for one in read_runs(folders[1:]).conditions] == ["ppo"]


@pytest.mark.parametrize(
    ("granted", "column"),
    [
        ({"tell": "instructions", "told": "Find the exit."}, "ppo, told instructions"),
        ({"tell": "instructions", "told": "Raus!", "language": "de"}, "ppo, told instructions (de)"),
        ({"tell": "goal"}, "ppo, told a goal"),
        ({"tell": "goal", "told": "Get out."}, 'ppo, told "Get out."'),
        ({"tell": "goal", "told": "Wait."}, 'ppo, told "Wait."'),
        ({"greedy": True, "eval": {"actions": "most probable actions"}}, "ppo, most probable actions"),
        ({"kind": "model", "eval": {"actions": ModelOptions().manner}}, "ppo"),
        (
            {"kind": "model", "eval": {"actions": "grid and text, 2 observations"}},
            "ppo, grid and text, 2 observations",
        ),
        ({"view": "room"}, "ppo, sees the room"),
        ({"trials": 3}, "ppo, 3 trials"),
        ({"trials": 3, "kind": "person"}, "ppo"),
    ],
)
def test_what_a_player_is_granted_makes_another_condition(
    tmp_path: Path, granted: dict[str, Any], column: str
) -> None:
    folders = [write_run(tmp_path / name, "help", 0, 0.5) for name in ("a", "b")]
    result = json.loads((tmp_path / "b" / "result.json").read_text())
    figures = result["eval"] | granted.get("eval", {})
    (tmp_path / "b" / "result.json").write_text(json.dumps(result | granted | {"eval": figures}))
    assert {c.entry.column for c in read_runs(folders).conditions} == {"ppo", column}
