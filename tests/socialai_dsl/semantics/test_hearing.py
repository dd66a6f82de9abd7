"""Who said something: in rules that hear it, and in conditions that ask for it."""

from __future__ import annotations

import pytest

from socialai_dsl.semantics.terms import Const, HeardNoun, Said, SaidBy, Speaker, Spoke, World, walk


def talking(*rules):
    return {
        "frames": {"talk": {"states": {"s": {"then": list(rules)}}}},
        "cast": {"guide": {"name": "Gus", "frame": "talk"}},
    }


@pytest.fixture
def heard(meaning):
    """The last rule of a frame with these rules, with a second NPC that says something."""

    def rule(*rules):
        sections = talking(*rules)
        sections["frames"]["ask"] = {"states": {"s": {"then": [{"say": "Here is 2"}]}}}
        sections["cast"]["asker"] = {"frame": "ask"}
        checked = meaning(**sections)
        (plan,) = [frame for frame in checked.frames if frame.member == "guide"]
        return plan.states[0].then[-1]

    return rule


def terms(plan, kind):
    return [part for part in walk(plan) if isinstance(part, kind)]


def test_the_speaker_of_what_only_the_agent_says_is_known(heard):
    rule = heard({"hears": "How are you", "when": "next_to(speaker)", "say": "Well"})
    assert not terms(rule, Speaker)
    assert Const in {type(test.object) for test in walk(rule) if hasattr(test, "object")}


def test_the_speaker_of_what_others_say_as_well_is_looked_for(heard):
    rule = heard({"hears": "Here is <noun>", "when": "next_to(speaker)", "say": "<noun>"})
    (speaker,) = terms(rule, Speaker)
    assert {text for pattern in speaker.patterns for text in pattern.said_by_npcs} == {"Here is 2"}
    (noun,) = terms(rule.say, HeardNoun)
    assert noun.patterns == speaker.patterns


def test_the_noun_of_what_only_the_agent_says_is_its_noun(heard):
    rule = heard({"hears": "Where is <noun>", "say": "<noun>"})
    assert not terms(rule, HeardNoun)
    assert [term.name for term in terms(rule.say, World)] == ["noun"]


def test_anything_is_heard(heard):
    rule = heard({"hears": "any", "say": "Hm"})
    (pattern,) = rule.hears
    assert len(pattern.pairs) == 27
    assert pattern.said_by_npcs == {"Here is 2", "Hm"}


GUIDE = talking({"hears": "How are you", "say": "I am fine."})


@pytest.fixture
def asked(meaning):
    """The condition of an outcome in a scenario with a guide that says one thing, and two that say nothing."""

    def condition(expression, **let):
        sections = {**GUIDE, "cast": {**GUIDE["cast"], "pair": {"count": 2, "frame": "talk"}}}
        return meaning(**sections, let=let, outcome=[{"success": expression}]).outcomes[0].condition.term

    return condition


def test_what_an_npc_said(asked):
    (said,) = terms(asked('guide.said("I am fine")'), SaidBy)
    assert (said.entity, said.pattern.said_by_npcs) == (1, {"I am fine."})


def test_what_the_agent_said(asked):
    assert isinstance(asked('agent.said("How are you")'), Said)
    assert isinstance(asked("agent.spoke"), Spoke)


@pytest.mark.parametrize("subject", ["any(p in pair where p.{})", "one.{}"])
def test_of_whoever_is_meant(asked, subject):
    for what in ("spoke", 'said("I am fine.")'):
        found = terms(asked(subject.format(what), one="pick(pair)"), SaidBy)
        assert [said.entity for said in found] == [2, 3]


def test_of_the_agent_or_an_npc(asked):
    found = asked('one.said("How are you")', one="pick(agent | guide)")
    assert terms(found, Said)
    assert not terms(found, SaidBy)


@pytest.mark.parametrize(
    ("condition", "code"),
    [
        ("exit.spoke", "S211"),
        ('pair.said("I am fine.")', "S204"),
        ('guide.said("I am ill.")', "S401"),
        ('guide.said("How are you")', "S401"),
        ("speaker == guide", "S211"),
    ],
)
def test_what_nobody_can_be_asked(examine, condition, code):
    sections = {**GUIDE, "cast": {**GUIDE["cast"], "pair": {"count": 2}}}
    assert [d.code for d in examine(**sections, outcome=[{"success": condition}]).diagnostics] == [code]
