"""What the shipped scenarios claim about themselves is so."""

from __future__ import annotations

import re

import pytest

import socialai_dsl
from socialai_dsl.analysis.check import check_scenario
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.loader.reader import shipped_folder
from tests.quick import one_in

CLAIMING = {
    "talkitout": 5,
    "talkitout+no_liar": 4,
    "talkitout+unsocial": 0,  # a control: nobody is perceived
    "cointhief": 2,
    "cointhief+tags": 2,
    "diverse_exit": 4,
    "help": 2,
    "help+as_helper": 2,
    "showme": 2,
}
"""How many properties are tried, `knowable` among them."""

BEYOND = {
    "classics/director_task": 5,
    "classics/discrepant_desires": 5,
    "classics/gaze_barriers": 6,
    "classics/helper_hinderer": 6,
    "classics/ice_cream_van": 5,
    "classics/joint_commitment": 6,
    "classics/mutual_exclusivity": 6,
    "classics/over_imitation": 5,
    "classics/selective_trust": 6,
    "classics/social_referencing": 6,
    "classics/story_in_turns": 6,
    "classics/ultimatum": 7,
    "novel/bargaining": 3,
    "novel/culprit": 4,
    "novel/fetch": 2,
    "novel/gaze_following": 3,
    "novel/gossip": 4,
    "novel/haggling": 3,
    "novel/implicature": 6,
    "novel/interpreter": 2,
    "novel/reference_game": 5,
    "novel/sally_anne": 2,
    "novel/sally_anne_watched": 4,
    "novel/sarcasm": 5,
    "novel/second_order": 3,
    "novel/turn_taking": 2,
    "novel/whisper": 3,
    "together/commons_together": 1,  # a dilemma, of which nothing is to be known
    "together/levers_together": 2,
    "together/reference_game_together": 2,
}

CLAIMING_NOTHING = [
    *("dance", "showme+no_social", "novel/conventions", "novel/shop"),
]
SCHOOL = [
    *("apple_stealing", "apple_stealing+asocial", "boxes+alone", "doors_alone", "marbles_alone"),
    *("lever_door", "lever_door+swapped", "marble_pass", "marble_pass+swapped", "marble_push"),
    *("marble_push+swapped", "color_match", "color_match+swapped", "color_match_generators"),
    *("color_match_switches", "color_match_marbles"),
]
PROBLEMS = ["boxes", "switches", "generators", "marbles", "doors", "levers"]
CUES = ["pointing", "color", "feedback", "emulation", "scaffolding"]


def verdicts(name: str, rooms: int, states: int = 20_000) -> dict[str, str]:
    loaded = socialai_dsl.load(name)
    assert isinstance(loaded, socialai_dsl.LoadedScenario)
    report = check_scenario(loaded, name, Effort(rooms, 0, states))
    return {plan.text: f"{found.verdict.value}: {found.said}" for plan, found in report.tried}


@pytest.mark.parametrize("name", one_in(2, CLAIMING, "searches rooms"))
def test_claims_hold_in_some_rooms(name: str) -> None:
    found = verdicts(name, 6)
    assert len(found) == CLAIMING[name]
    assert [said for said in found.values() if not said.startswith("holds")] == []


def test_no_claiming_scenario_is_left_out() -> None:
    folder = shipped_folder()
    claiming = {
        file.relative_to(folder).with_suffix("").as_posix()
        for file in folder.rglob("*.yaml")
        if re.search(r"^check:|^ +- {rival:", file.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert claiming == {name for name in CLAIMING if "+" not in name} | set(BEYOND) | {
        "school/information_seeking_base"
    }


@pytest.mark.parametrize("name", one_in(2, CLAIMING_NOTHING, "searches rooms"))
def test_success_is_knowable(name: str) -> None:
    (known,) = verdicts(name, 3).items()
    assert known[0] == "knowable: true"
    assert known[1].startswith("holds")


@pytest.mark.slow
@pytest.mark.parametrize("name", SCHOOL)
def test_success_is_knowable_in_the_school(name: str) -> None:
    (known,) = verdicts(f"school/{name}", 3).items()
    assert known[0] == "knowable: true"
    assert known[1].startswith("holds")


@pytest.mark.slow
@pytest.mark.parametrize("problem", PROBLEMS)
def test_a_problem_of_the_school_without_a_cue_leaves_a_guess(problem: str) -> None:
    (said,) = verdicts(f"school/{problem}", 2).values()
    assert said.startswith("holds")
    assert "`target` stays hidden" in said


@pytest.mark.slow
@pytest.mark.parametrize("cue", CUES)
@pytest.mark.parametrize("problem", PROBLEMS)
def test_a_problem_of_the_school_can_be_known_by_its_cue(problem: str, cue: str) -> None:
    found = verdicts(f"school/{problem}+{cue}", 2)
    assert list(found) == ["needs: caretaker", "knowable: true"]
    assert found["knowable: true"].startswith("holds")
    assert not found["needs: caretaker"].startswith("fails")


@pytest.mark.slow
@pytest.mark.parametrize("name", [*CLAIMING, *BEYOND])
def test_claims_hold_in_many_rooms(name: str) -> None:
    found = verdicts(name, 60)
    assert len(found) == (CLAIMING | BEYOND)[name]
    assert [said for said in found.values() if not said.startswith("holds")] == []
