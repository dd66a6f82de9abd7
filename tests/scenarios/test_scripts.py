"""The scenarios' own scripts act on what they have seen and heard alone, and succeed."""

from __future__ import annotations

import pytest

import socialai_dsl as sd
from socialai_dsl.analysis.perceiving import perceived
from socialai_dsl.analysis.properties import Effort, solved_by_script
from socialai_dsl.episodes.scripts import script_of
from tests.scenarios.playing import BEYOND

ROOMS = 40
PAPER = (
    *("talkitout", "talkitout_no_liar", "dance", "cointhief", "cointhief_tags", "diverse_exit", "showme"),
    *("showme_no_social", "help", "help_as_helper"),
)
SCHOOL = tuple(
    f"school/{name}"
    for name in (
        *("boxes+color", "boxes+asocial+alone", "switches+color", "marbles+pointing", "levers+color"),
        *("color_match", "color_match_generators", "color_match_marbles", "color_match_switches"),
        *("color_match_swapped", "lever_door_swapped", "marble_pass_swapped", "marble_push"),
    )
)


AS_CODED = [f"{name}+as_coded" for name in (*PAPER, "social_env")]
ALL = [*PAPER, *BEYOND, *SCHOOL]


@pytest.mark.parametrize("name", ALL)
def test_a_script_acts_on_what_it_has_perceived(name: str) -> None:
    scripted = sd.load(f"{name}+oracle")
    assert isinstance(scripted, sd.LoadedScenario)
    found = perceived(scripted, ROOMS, 0)
    assert found.pairs > 0, "otherwise nothing would be tried"
    assert [str(peek) for peek in found.peeks] == []


@pytest.mark.parametrize("name", ALL)
def test_a_script_leaves_actions_and_words_as_they_are(name: str) -> None:
    """Else no agent can be trained by it: the words would have other numbers in the scenario itself."""
    scripted, plain = sd.load(f"{name}+oracle"), sd.load(name)
    assert isinstance(scripted, sd.LoadedScenario)
    assert isinstance(plain, sd.LoadedScenario)
    assert scripted.checked.words_in_order == plain.checked.words_in_order
    assert scripted.checked.sentences == plain.checked.sentences
    assert scripted.checked.actions == plain.checked.actions


@pytest.mark.parametrize("name", PAPER)
def test_a_script_succeeds_where_success_is_possible(name: str) -> None:
    scripted = sd.load(f"{name}+oracle")
    assert isinstance(scripted, sd.LoadedScenario)
    ceiling = 0.94 if name == "talkitout" else 0.99
    assert solved_by_script(sd.compile(scripted), Effort(300)).mean() >= ceiling


@pytest.mark.parametrize("name", AS_CODED)
def test_a_script_also_plays_what_the_paper_s_tables_were_measured_on(name: str) -> None:
    assert script_of(name) is not None
