"""`experiments/ladders`: suites that lead up to a scenario, and the curriculum that climbs them."""

from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl.checking.loaded import LoadedScenario, LoadedSuite
from socialai_dsl.cli.main import main
from socialai_dsl.trainer.curricula import Leaves, build_curriculum

FOLDER = Path(__file__).parents[1] / "experiments" / "ladders"
LADDERS = sorted(FOLDER.glob("*_ladder.yaml"))


@pytest.mark.parametrize("path", LADDERS, ids=lambda path: path.stem)
def test_only_the_last_rung_is_the_scenario_itself(path: Path) -> None:
    ladder = socialai_dsl.load(str(path))
    assert isinstance(ladder, LoadedSuite)
    itself = socialai_dsl.load(path.stem.removesuffix("_ladder"))
    assert isinstance(itself, LoadedScenario)
    same = [
        name
        for name, rung in zip(ladder.member_names, ladder.members, strict=True)
        if rung.scenario == itself.scenario
    ]
    assert same == ["rung=last"]


@pytest.mark.parametrize("path", LADDERS, ids=lambda path: path.stem)
def test_who_succeeds_climbs_rung_by_rung(path: Path) -> None:
    leaves = Leaves.of(socialai_dsl.make_vec(str(path), num_envs=1))
    phases = path.with_name(path.name.replace("_ladder", "_phases"))
    curriculum = build_curriculum(str(phases) if phases.exists() else "ladder", leaves)
    last = len(leaves.names) - 1
    for newest in range(last + 1):
        assert [number for number, weight in enumerate(curriculum.weights()) if weight] == [
            *range(newest + 1)
        ]
        for _ in range(1_000):
            curriculum.observe(newest, False, 10)
        assert curriculum.weights()[newest] == max(curriculum.weights()), "who fails stays"
        for _ in range(2_000):
            curriculum.observe(newest, True, 10)


def test_there_are_ladders() -> None:
    assert len(LADDERS) == 4


def test_everything_beside_the_experiments_is_sound() -> None:
    assert main(["validate", str(FOLDER.parent)]) == 0
