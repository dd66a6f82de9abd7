"""What the shipped scenarios claim about themselves is so."""

from __future__ import annotations

import pytest

import socialai_dsl
from socialai_dsl.cli.check import check_scenario
from socialai_dsl.envs.properties import Effort
from socialai_dsl.loader import shipped_folder

CLAIMING = {
    "talkitout": 2,
    "talkitout+no_liar": 2,
    "talkitout+unsocial": 2,
    "diverse_exit": 1,
    "help": 1,
    "help+as_helper": 1,
}
NOVEL = {"culprit": 2, "haggling": 2, "interpreter": 1, "turn_taking": 1, "whisper": 2}


def verdicts(name: str, rooms: int, states: int = 20_000) -> dict[str, str]:
    loaded = socialai_dsl.load(name)
    assert isinstance(loaded, socialai_dsl.LoadedScenario)
    report = check_scenario(loaded, name, Effort(rooms, 0, states))
    return {plan.text: f"{found.verdict.value}: {found.said}" for plan, found in report.tried}


@pytest.mark.parametrize("name", CLAIMING)
def test_claims_hold_in_some_rooms(name: str) -> None:
    found = verdicts(name, 6)
    assert len(found) == CLAIMING[name]
    assert [said for said in found.values() if not said.startswith("holds")] == []


def test_no_claiming_scenario_is_left_out() -> None:
    folder = shipped_folder()
    claiming = {
        file.stem for file in folder.rglob("*.yaml") if "\ncheck:" in file.read_text(encoding="utf-8")
    }
    assert claiming == {name for name in CLAIMING if "+" not in name} | set(NOVEL) | {
        "information_seeking_base"
    }


@pytest.mark.slow
@pytest.mark.parametrize("cue", ["", "+pointing", "+color", "+feedback"])
@pytest.mark.parametrize("problem", ["boxes", "switches", "generators", "marbles", "doors", "levers"])
def test_nobody_solves_a_problem_of_the_school_without_the_caretaker(problem: str, cue: str) -> None:
    found = verdicts(f"school/{problem}{cue}", 2)
    assert list(found) == ["needs: caretaker"]
    assert found["needs: caretaker"].startswith("holds")


@pytest.mark.slow
@pytest.mark.parametrize("name", [*CLAIMING, *NOVEL])
def test_claims_hold_in_many_rooms(name: str) -> None:
    found = verdicts(f"novel/{name}" if name in NOVEL else name, 60)
    assert len(found) == (CLAIMING | NOVEL)[name]
    assert [said for said in found.values() if not said.startswith("holds")] == []
