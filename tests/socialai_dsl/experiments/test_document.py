"""Which run is which: the same if and only if it computes the same."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.atomic import write_json
from socialai_dsl.checking.experiments import LoadedExperiment
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.experiments.document import completed, config_of, differences, document_of
from socialai_dsl.experiments.folder import runs_of
from socialai_dsl.frontend import check, load, load_experiment
from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.runs.folder import TESTS
from socialai_dsl.schema.experiment import NETS, Hyper, Settings

ROOT = Path(__file__).parents[3]


def document(folder: Path, condition: str, settings: str = "frames: 100", name: str = "e") -> dict[str, Any]:
    file = folder / f"{name}.yaml"
    file.write_text(
        f"experiment: {name}\nset: {{{settings}}}\nconditions: [{{name: one, scenario: dance{condition}}}]\n",
        encoding="utf-8",
    )
    return document_of(load_experiment(file), None)


def ids(*arguments: Any, **named: Any) -> list[str]:
    return [run["id"] for run in document(*arguments, **named)["runs"]]


@pytest.mark.parametrize(
    "condition",
    [
        ", net: fast",
        ", bonus: none",
        ", threads: 1, device: cpu",
        ", tests: [help]",
        ", checkpoint_every: 7",
        ", row: a",
        ", hyper: {returns: session}",
    ],
)
def test_what_makes_no_difference(tmp_path, condition):
    assert ids(tmp_path, condition) == ids(tmp_path, "", name="another")


@pytest.mark.parametrize(
    "condition",
    [
        "+unsocial",
        "?length=2",
        ", net: paper",
        ", bonus: cell",
        ", frames: 200",
        ", seeds: [1]",
        ", envs: 8",
        ", threads: 2",
        ", agent: random",
        ", eval_episodes: 7",
        ", curriculum: progress",
        ", hyper: {lr: 0.001}",
        ", hyper: {returns: episode}",
    ],
)
def test_what_makes_a_difference(tmp_path, condition):
    assert ids(tmp_path, condition) != ids(tmp_path, "", name="another")


def test_seeds_are_runs_of_their_own(tmp_path):
    found = ids(tmp_path, ", seeds: 3")
    assert len(set(found)) == 3
    assert found[0] == ids(tmp_path, "")[0]


def test_the_scenario_s_content_counts_and_not_its_place(tmp_path):
    found = []
    for folder, horizon in (("a", 20), ("b", 20), ("c", 30)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "mine.yaml").write_text(
            f"scenario: mine\nextends: dance.yaml\nhorizon: {horizon}\n"
        )
        file = tmp_path / folder / "e.yaml"
        file.write_text("experiment: e\nconditions: [{name: one, scenario: mine.yaml, frames: 100}]\n")
        made = document_of(load_experiment(file), None)
        found.append(made["runs"][0]["id"])
        assert made["conditions"][0]["scenario"] == str(tmp_path / folder / "mine.yaml")
    assert found[0] == found[1] != found[2]


def test_the_weights_of_a_checkpoint_count(tmp_path):
    weights = tmp_path / "run" / "checkpoints" / "000000000000100.safetensors"
    weights.parent.mkdir(parents=True)
    found = []
    for content in (b"one", b"two"):
        weights.write_bytes(content)
        found.append(ids(tmp_path, ", agent: run"))
    assert found[0] != found[1]


def test_what_a_condition_says(tmp_path):
    text = ", bonus: auto, tests: [{scenario: help, reference: {mean: 0.3}}], reference: {mean: 0.5, std: 0.1, n: 3}"
    (condition,) = document(tmp_path, text)["conditions"]
    assert condition == {
        "name": "one",
        "row": "one",
        "column": "ppo",
        "group": None,
        "scenario": "dance",
        "agent": "ppo",
        "frames": 100,
        "options": {
            "recipe": "plain",
            "net": "fast",
            "envs": 256,
            "bonus": "cell",  # the paper's for Dance, as is its scale
            "device": "cpu",
            "threads": 1,
            "checkpoint_every": 50,
            "eval_episodes": 500,
            "hyper": {"bonus_c": 3.0},
        },
        "tests": ["help"],
        "test_programs": {"help": compile_loaded(load("help")).sha256},
        "reference": {"mean": 0.5, "std": 0.1, "n": 3, "deviation": "sample", "note": None, "source": None},
        "test_references": {
            "help": {"mean": 0.3, "std": None, "n": None, "deviation": "sample", "note": None, "source": None}
        },
    }
    (chance,) = document(tmp_path, ", agent: random")["conditions"]
    assert (chance["frames"], chance["options"]) == (None, {"device": "cpu", "eval_episodes": 500})


def test_first_seeds_come_first(tmp_path):
    file = tmp_path / "e.yaml"
    file.write_text(
        "experiment: e\nset: {frames: 9, seeds: 2}\nconditions: [{grid: {scenario: [dance, help]}}]\n"
    )
    runs = document_of(load_experiment(file), None)["runs"]
    assert [(run["condition"], run["seed"]) for run in runs] == [
        ("dance", 0),
        ("help", 0),
        ("dance", 1),
        ("help", 1),
    ]


@pytest.mark.parametrize(
    ("condition", "settings", "said"),
    [
        ("", "frames: 100", []),
        (", frames: 200", "frames: 100", ["`one`, frames: 100 there, 200 here"]),
        (", net: paper", "frames: 100", ["`one`, net: 'fast' there, 'paper' here"]),
        ("", "frames: 100, seeds: 2", ["`one`, seeds: 0 there, 0, 1 here"]),
    ],
)
def test_differences_are_named(tmp_path, condition, settings, said):
    kept = document(tmp_path, "")
    assert differences(kept, document(tmp_path, condition, settings)) == said


def test_a_changed_scenario_is_a_difference(tmp_path):
    kept = document(tmp_path, "")
    changed = kept | {"runs": [{**kept["runs"][0], "id": "0"}]}
    assert differences(changed, kept) == ["`one`: its scenario, its checkpoint or its code has changed since"]


def test_a_changed_scenario_of_a_test_is_a_difference_and_is_played_again(tmp_path):
    """But not the run, which has not changed."""
    room, name = tmp_path / "room.yaml", str(tmp_path / "room.yaml")
    found = []
    for horizon in (20, 30):
        room.write_text(f"scenario: mine\nextends: dance.yaml\nhorizon: {horizon}\n")
        found.append(document(tmp_path, ", tests: [room.yaml]"))
    kept, changed = found
    assert kept["runs"] == changed["runs"]
    assert differences(kept, changed) == [f"`one`: {name}, one of its tests, has changed since"]
    (run,), (same,) = (runs_of(tmp_path, one) for one in (changed, kept))
    figures = {name: {"program_sha256": kept["conditions"][0]["test_programs"][name]}}
    run.folder.mkdir(parents=True)
    write_json(run.folder / TESTS, figures)
    assert (run.missing_tests, same.missing_tests) == ([name], [])
    write_json(run.folder / TESTS, {name: {}})  # results and folders of earlier versions do not say
    assert run.missing_tests == []
    del kept["conditions"][0]["test_programs"]
    assert differences(kept, changed) == []


def test_phases_are_named_from_the_file_and_count_by_what_they_say(tmp_path, monkeypatch):
    phases = tmp_path / "own" / "phases.yaml"
    phases.parent.mkdir()
    phases.write_text("curriculum: mine\nphases: [{}]\n")
    monkeypatch.chdir(phases.parent)  # the folder of the command does not matter
    made = document(tmp_path, ", curriculum: own/phases.yaml")
    assert made["conditions"][0]["options"]["curriculum"] == str(phases)
    assert document(tmp_path, ", curriculum: own/phases.yaml")["runs"] == made["runs"]
    phases.write_text("curriculum: mine\nphases: [{play: [{weight: 2}]}]\n")
    assert document(tmp_path, ", curriculum: own/phases.yaml")["runs"] != made["runs"]
    phases.write_text("curriculum: mine\nphases: [{plya: []}]\n")
    with pytest.raises(ScenarioError, match="unknown key `plya` in a phase"):
        document(tmp_path, ", curriculum: own/phases.yaml")


def test_changed_code_of_ones_own_is_another_run(tmp_path):
    (tmp_path / "room.yaml").write_text((ROOT / "scenarios" / "help.yaml").read_text())
    (tmp_path / "e.yaml").write_text(
        "experiment: e\nset: {frames: 9}\nconditions: [{name: one, scenario: room.yaml, net: 'mine:Net'}]\n"
    )
    ids = []
    for size in (4, 8, 4):
        (tmp_path / "mine.py").write_text(f"SIZE = {size}\n")
        ids.append(document_of(load_experiment(tmp_path / "e.yaml"), None)["runs"][0]["id"])
    assert ids[0] == ids[2] != ids[1]


# -- the experiments that ship -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def shipped() -> dict[str, LoadedExperiment]:
    return {
        name: load_experiment(ROOT / "experiments" / f"{name}.yaml") for name in ("paper", "case_studies")
    }


@pytest.mark.parametrize(
    ("name", "profile", "runs"),
    [("paper", "full", 336), ("paper", "small", 64), ("paper", "smoke", 42), ("case_studies", "full", 304)],
)
def test_the_shipped_experiments(shipped, name, profile, runs):
    loaded = shipped[name]
    assert sum(len(cell.seeds) for cell in loaded.cells[profile]) == runs
    assert loaded.experiment.profile == "full"
    frames = Counter(cell.frames for cell in loaded.cells["full"])
    assert frames == {30_000_000: frames.total() - 3, 5_000_000: 3}


def test_conditions_that_both_files_have_are_the_same_runs(shipped):
    paper, studies = (
        {
            condition["name"]: [run["id"] for run in made["runs"] if run["condition"] == condition["name"]]
            for condition in made["conditions"]
        }
        for made in (document_of(loaded, "small") for loaded in shipped.values())
    )
    shared = paper.keys() & studies.keys()
    assert len(shared) == 11
    assert all(paper[name] == studies[name] for name in shared)
    assert len({identity for runs in paper.values() for identity in runs}) == 64


def test_the_hyper_parameters_are_those_of_the_trainer():
    from socialai_dsl.trainer.config import FLAGS, HYPER, RunConfig

    assert set(Hyper.model_fields) == set(HYPER)
    assert set(FLAGS) - {"agent", "seed", "frames", "wandb"} < set(Settings.model_fields)
    for name, mine in Hyper.model_fields.items():
        theirs = RunConfig.model_fields[name]
        assert set(map(str, mine.metadata)) == set(map(str, theirs.metadata)), f"{name} has other bounds"
        assert mine.description == theirs.description
        usual = theirs.default
        assert getattr(Hyper.model_validate({name: usual}), name) == usual


def test_hyper_parameters_of_several_places_are_put_together(tmp_path):
    text = """
experiment: tuning
set: {scenario: dance, frames: 100, hyper: {lr: 0.001, clip: 0.1}}
conditions:
  - {name: a}
  - {name: b, hyper: {lr: 0.01, loss: per_head}}
"""
    (tmp_path / "tuning.yaml").write_text(text)
    document = document_of(load_experiment(tmp_path / "tuning.yaml"), None)
    a, b = (condition["options"]["hyper"] for condition in document["conditions"])
    assert a == {"lr": 0.001, "clip": 0.1}
    assert b == {"lr": 0.01, "clip": 0.1, "loss": "per_head"}


def test_the_networks_are_those_of_the_trainer():
    from socialai_dsl.trainer import nets
    from socialai_dsl.trainer.config import NET_PRESETS

    assert set(NETS) == set(nets._SHIPPED) >= set(NET_PRESETS)


@pytest.mark.parametrize(
    ("condition", "frames", "curriculum"),
    [
        ("", 500_000, "none"),
        (", frames: 5000", 5000, "none"),
        (", scenario: social_env", None, "even"),
        (", scenario: social_env, curriculum: none", None, "none"),
    ],
)
def test_a_guided_condition_takes_from_the_scenario_what_it_does_not_say(
    tmp_path: Path, condition: str, frames: int | None, curriculum: str
) -> None:
    file = tmp_path / "e.yaml"
    file.write_text(
        f"experiment: e\nset: {{scenario: dance, recipe: guided}}\nconditions: [{{name: one{condition}}}]\n"
    )
    loaded = load_experiment(file)
    (cell,) = loaded.cells[None]
    cell = completed(cell, loaded.played[cell.scenario])
    frames = frames or load("social_env").suite.training_frames  # None: as its file says
    assert (cell.frames, config_of(cell).frames, config_of(cell).curriculum) == (frames, frames, curriculum)
    assert document_of(loaded, None)["conditions"][0]["frames"] == frames


def test_a_name_that_is_no_path_means_what_ships_or_stands_beside_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Never what happens to be in the working directory, of which nothing is opened."""
    there, here = tmp_path / "there", tmp_path / "here"
    for folder in (there, here):
        folder.mkdir()
    shutil.copy(shipped_folder() / "talkitout.yaml", there / "mine.yaml")
    shutil.copy(shipped_folder() / "talkitout.yaml", here / "yours.yaml")
    monkeypatch.chdir(here)
    text = "experiment: e\nset: {frames: 100}\nconditions: [{name: a, scenario: NAME}]\n"
    (there / "e.yaml").write_text(text.replace("NAME", "mine"), encoding="utf-8")
    assert check(there / "e.yaml").diagnostics == ()
    (there / "e.yaml").write_text(text.replace("NAME", "yours"), encoding="utf-8")
    (finding,) = check(there / "e.yaml").diagnostics
    assert finding.code == "S504"
    (there / "e.yaml").write_text(text.replace("NAME", "school/boxes"), encoding="utf-8")
    assert check(there / "e.yaml").diagnostics == (), "what ships in a folder"
    (there / "school").mkdir()
    shutil.copy(shipped_folder() / "talkitout.yaml", there / "school" / "boxes.yaml")
    ((name, *_),) = load_experiment(there / "e.yaml").named()
    assert Path(name).is_relative_to(there)
