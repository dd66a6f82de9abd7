"""`experiments/families`: suites that draw many forms of a scenario, some of which are held out of training."""

from __future__ import annotations

from pathlib import Path

import pytest

from socialai_dsl.checking.loaded import LoadedSuite
from socialai_dsl.frontend import check, load
from socialai_dsl.loader.shipped import variants_of

FAMILIES = sorted((Path(__file__).parents[1] / "experiments" / "families").glob("*_family.yaml"))
EVERYTHING = FAMILIES[0].with_name("everything.yaml")


def test_all_tasks_of_the_suite_of_everything_have_a_script() -> None:
    assert check(str(EVERYTHING)).diagnostics == check(f"{EVERYTHING}+oracle").diagnostics == ()


@pytest.mark.parametrize("file", FAMILIES, ids=lambda file: file.stem)
def test_a_family_has_no_findings_and_is_one_of_a_scenario_with_a_script(file: Path) -> None:
    assert check(str(file)).diagnostics == check(f"{file}+oracle").diagnostics == ()
    scenario = file.stem.removesuffix("_family")
    assert "oracle" in variants_of(scenario)
    loaded = load(str(file))
    assert isinstance(loaded, LoadedSuite)
    assert len(loaded.members) > 2
