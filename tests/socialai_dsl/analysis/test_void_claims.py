"""A claim about nothing fails, and says what there was nothing of."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.properties import Trial, by_default
from socialai_dsl.analysis.reports import Report, Verdict
from socialai_dsl.checking.loaded import LoadedScenario

# One of two doors is right. Ada tells which.
TOLD = """
scenario: told
horizon: 20
earshot: room
actions: [left, right, forward, done]
grammar: {templates: [Where is <noun>, Open <noun>], nouns: [it, 0, 1]}
room: {size: 6}
objects:
  doors: {type: door, count: 2, color: red, at: [[0, 2], [5, 2]]}
  chest: {type: box, place: nowhere}
let: {exit: pick(doors), hour: pick(1..9)}
frames:
  tell:
    states:
      waiting: {then: [{hears: Where is it, say: Number <exit.index>}]}
  solve:
    steps: [{say: Where is it}, {say: Open <exit.index>}]
cast:
  ada: {name: Ada, frame: tell}
  agent: {place: anywhere, frame: solve}
outcome:
  - success: agent.said("Open <exit.index>")
  - failure: agent.spoke and not agent.said("Where is it")
"""
ROOMS = 5

NOBODY_SUCCEEDS = (
    "success: agent.said",
    "failure: hour == 1 or hour > 1\n  - success: agent.said",
)
NOBODY_IS_THERE = ("  ada: {name: Ada, ", "  ada: {name: Ada, place: anywhere where here.x > 2 * hour + 9, ")
NO_AGENT = ("agent: {place: anywhere,", "agent: {place: anywhere where here.x > 2 * hour + 9,")
NOTHING_DIFFERS = ("say: Number <exit.index>", "say: I will not tell")
NOTHING_TO_DO = ("success: agent.said", "success: t > 3\n  - success: agent.said")
ENDS_AT_ONCE = ("success: agent.said", "failure: t > 0\n  - success: agent.said")

Trying = Callable[..., Report]


@pytest.fixture
def tried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Trying:
    """What is found out about a property of the scenario, in which some pieces of text may be replaced."""
    # Scenarios in which somebody is nowhere are errors; here they are to be played all the same.
    monkeypatch.setattr("socialai_dsl.semantics.check.check_absences", lambda *_: None)

    def trying(entry: str, *changes: tuple[str, str]) -> Report:
        text = TOLD
        for old, new in changes:
            assert old in text, "nothing would change"
            text = text.replace(old, new)
        (tmp_path / "told.yaml").write_text(f"{text}check: [{entry}]\n")
        loaded = socialai_dsl.load(tmp_path / "told.yaml")
        assert isinstance(loaded, LoadedScenario)
        (plan,) = loaded.checked.properties
        effort = Effort(ROOMS, 1, 5_000)
        return Trial(loaded, effort, loaded).check(plan, effort)

    return trying


@pytest.mark.parametrize(
    "entry",
    [
        "{needs: ada}",
        "{needs: ada, draw: exit}",
        "{only_through: {draw: exit, by: ada}}",
        "{reachable: success}",
        "{never: failure and agent.did(done)}".replace("failure and ", ""),
        "{within: 2}",
        "{oracle: 1}",
        "{knowable: true}",
    ],
)
def test_what_the_claims_rest_on_where_there_is_something(tried: Trying, entry: str) -> None:
    report = tried(entry)
    if "never" in entry:
        assert report.verdict is Verdict.FAILS
        return
    assert report.verdict is Verdict.HOLDS, report
    assert (report.rooms, report.rests) == (ROOMS, ROOMS)
    assert report.pairs > 0 or "only_through" not in entry


VOID = {
    "no success exists": NOBODY_SUCCEEDS,
    "nobody is present": NOBODY_IS_THERE,
    "the agent is absent": NO_AGENT,
    "nothing differs": NOTHING_DIFFERS,
    "success comes of itself": NOTHING_TO_DO,
    "it ends at once": ENDS_AT_ONCE,
}


@pytest.mark.parametrize(
    ("entry", "void", "said"),
    [
        ("{needs: ada}", "no success exists", "in 5 rooms no success is possible"),
        ("{needs: ada}", "nobody is present", "in 5 rooms `ada` is absent"),
        ("{needs: ada}", "the agent is absent", "in 5 rooms `agent` is absent"),
        ("{needs: ada}", "nothing differs", "in 5 rooms an agent can only guess even with them"),
        ("{needs: ada}", "success comes of itself", "in 5 rooms an agent can do without them"),
        ("{needs: ada}", "it ends at once", "in 5 rooms no success is possible"),
        ("{only_through: {draw: exit, by: ada}}", "no success exists", "none of 10 pairs of episodes differ"),
        (
            "{only_through: {draw: exit, by: ada}}",
            "nobody is present",
            "in 5 rooms none of the members is there",
        ),
        ("{only_through: {draw: exit, by: ada}}", "nothing differs", "none of 10 pairs of episodes differ"),
        ("{only_through: {draw: exit, by: ada}}", "it ends at once", "none of 10 pairs of episodes differ"),
        ("{only_through: {draw: hour, by: ada}}", "nothing differs", "none of 10 pairs of episodes differ"),
        ("{reachable: success}", "no success exists", "in 0 of 5 rooms"),
        ("{reachable: success, share: 0}", "no success exists", "in 0 of 5 rooms"),
        ("{reachable: agent.x == 2}", "the agent is absent", "in 5 rooms `agent` is absent"),
        ("{never: ada.next_to(agent)}", "nobody is present", "in 5 rooms `ada` is absent"),
        ("{never: agent.x == 7 and agent.did(done)}", "the agent is absent", "in 5 rooms `agent` is absent"),
        ("{never: ada.next_to(agent) and t > 4}", "it ends at once", "in 5 rooms every episode ends"),
        ("{within: 20}", "no success exists", "no success can be reached in any of 5 rooms"),
        ("{within: 20, share: 0}", "no success exists", "no success can be reached in any of 5 rooms"),
        (
            "{within: 20}",
            "success comes of itself",
            "in 5 rooms a success happens while the agent does nothing",
        ),
        (
            "{knowable: true}",
            "success comes of itself",
            "in 5 rooms a success happens while the agent does nothing",
        ),
        ("{oracle: 0}", "no success exists", "solves 0 of 5 rooms"),
        (
            "{oracle: 1}",
            "success comes of itself",
            "in all of 5 rooms a success happens while the agent does nothing",
        ),
        ("{knowable: true}", "no success exists", "in 5 rooms no success is possible"),
        ("{knowable: true}", "nothing differs", "`exit` stays hidden to the end in 5 rooms"),
        ("{knowable: true}", "nobody is present", "`exit` stays hidden to the end in 5 rooms"),
        ("{knowable: false}", "no success exists", "in 5 rooms no success is possible"),
    ],
)
def test_a_claim_about_nothing_fails(tried: Trying, entry: str, void: str, said: str) -> None:
    report = tried(entry, VOID[void])
    assert report.verdict is Verdict.FAILS, report
    assert said in report.said
    assert report.held == 0 or "oracle" in entry


HEAD = """
scenario: void
horizon: 12
earshot: EARSHOT
actions: [left, right, forward]
grammar: {templates: [It is <noun>, Where is <noun>], nouns: [it, red, blue]}
room: {width: 9, height: 6, build: [{BUILT: column(4)}]}
let: {answer: pick(n in nouns where n != "it")}
"""
BEHIND_LAVA = """
objects: {gate: {type: door, state: open, place: wall(right)}}
cast: {ada: {place: left_half}, agent: {place: left_half}}
outcome: [{success: agent.at(gate) and agent.said("It is <answer>")}]
"""
OUT_OF_EARSHOT = """
frames: {tell: {states: {a: {then: [{hears: Where is it, say: It is <answer>.}]}}}}
cast: {ada: {frame: tell, place: left_half}, agent: {place: right_half}}
outcome: [{success: agent.said("It is <answer>")}, {failure: agent.said("It is <noun>")}]
"""
FAILURE_FIRST = """
frames: {tell: {states: {a: {then: [{hears: Where is it, say: It is <answer>.}]}}}}
cast: {ada: {frame: tell}, agent: {place: anywhere}}
outcome: [{failure: agent.said("It is <noun>")}, {success: agent.said("It is <answer>")}]
"""
TOO_LATE = """
frames: {tell: {states: {a: {then: [{when: t > 5, say: It is <answer>.}]}}}}
cast: {ada: {frame: tell}, agent: {place: anywhere}}
outcome: [{success: agent.said("It is <answer>") and t < 4}, {failure: agent.spoke or t > 6}]
"""
UNSEEN_ARM = """
objects: {boxes: {type: box, count: 2, color: [red, blue], at: [[1, 1], [1, 4]]}}
define: {meant: first(b in boxes where b.color == red and answer == "red" or b.color == blue)}
frames: {show: {states: {a: {do: point(meant)}}}}
cast: {ada: {frame: show, at: [2, 2]}, agent: {place: left_half}}
outcome: [{success: agent.said("It is <answer>")}, {failure: agent.spoke}]
"""


@pytest.mark.parametrize(
    ("text", "built", "earshot", "said"),
    [
        (BEHIND_LAVA, "lava", "room", "in 5 rooms no success is possible"),
        (OUT_OF_EARSHOT, "fence", "next_to", "`answer` stays hidden to the end in 5 rooms"),
        (FAILURE_FIRST, "fence", "room", "in 5 rooms no success is possible"),
        (TOO_LATE, "fence", "room", "`answer` stays hidden until it is too late (step 6 at the earliest)"),
        (UNSEEN_ARM, "fence", "room", "`answer` stays hidden to the end in 5 rooms"),
    ],
    ids=["behind lava", "out of earshot", "failure first", "too late", "an arm nobody sees"],
)
def test_a_void_scenario_is_found_without_any_claim(
    tmp_path: Path, text: str, built: str, earshot: str, said: str
) -> None:
    file = tmp_path / "void.yaml"
    file.write_text(HEAD.replace("BUILT", built).replace("EARSHOT", earshot) + text)
    loaded = socialai_dsl.load(file)
    assert isinstance(loaded, LoadedScenario)
    (plan,) = by_default(loaded, loaded.resolved.tree.key_span(("outcome",)))
    effort = Effort(ROOMS, 0, 20_000)
    report = Trial(loaded, effort).check(plan, effort)
    assert report.verdict is Verdict.FAILS
    assert said in report.said
