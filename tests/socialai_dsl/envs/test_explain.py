"""`explain()`: which rule fired in the last step, and the first part that was false of the others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import Task
from socialai_dsl.envs import ScenarioEnv
from tests.tiny import Folder, Play

GUIDE = """
frames:
  help:
    define: {near: distance(agent) <= 2}
    let: {asked: 0}
    start: waiting
    states:
      waiting:
        then:
          - {hears: Say hello, when: near and eye_contact(agent), say: Hello., goto: talking}
          - {hears: Say bye, after: 3, say: Bye.}
          - {when: agent.x + 2 * asked == 40 or asked >= 2, set: {asked: 0}}
          - {id: count, hears: any, once: true, set: {asked: asked + 1}}
      talking:
        do: face(agent)
        then: [{when: not near and not eye_contact(agent), goto: waiting}]
cast:
  guide: {at: [5, 1], facing: left, frame: help}
  agent: {at: [1, 1], facing: right}
"""


def explained(play: Play) -> dict[str, Any]:
    env: Any = play.env.unwrapped
    found: dict[str, Any] = env.explain()
    return found


def reason(play: Play, line: str) -> dict[str, Any]:
    """The entry of the rule whose words contain `line`."""
    (entry,) = [entry for entry in explained(play)["others"] if line in entry["words"]]
    return entry


@pytest.fixture
def tiny(tmp_path: Path) -> Folder:
    return Folder(tmp_path)


def test_the_first_false_part_with_its_values(tiny: Folder) -> None:
    play = tiny(GUIDE).step(None, "Say hello")
    entry = reason(play, "say: Hello.")
    assert entry["part"] == "distance(agent) <= 2"
    assert entry["values"] == {"distance(agent)": 4}
    assert entry["why"] == "distance(agent) <= 2 is false: distance(agent) is 4"
    assert (entry["who"], entry["state"], entry["list"]) == ("guide", "waiting", "then")
    assert entry["at"].endswith("tiny.yaml:11")
    assert entry["words"] == "hears: Say hello, when: near and eye_contact(agent), say: Hello., goto: talking"


def test_parts_before_it_held(tiny: Folder) -> None:
    """From two cells away the distance is right; the guide looks away from the agent."""
    play = tiny(GUIDE, {"guide": {"at": [3, 1], "facing": "up"}}).step(None, "Say hello")
    assert reason(play, "say: Hello.")["why"] == "eye_contact(agent) is false"


def test_what_fired_and_what_was_not_asked_after_it(tiny: Folder) -> None:
    play = tiny(GUIDE, {"guide": {"at": [3, 1]}}).step(None, "Say hello")
    (fired,) = explained(play)["fired"]
    assert fired["name"] == "guide.help.waiting.then[0]"
    assert reason(play, "say: Bye.")["why"] == "not asked: line 11 came first"
    assert play.status("guide") == "talking"


def test_values_of_alternatives_and_of_what_is_negated(tiny: Folder) -> None:
    play = tiny(GUIDE).step()
    assert reason(play, "asked >= 2")["values"] == {"agent.x + 2 * asked": 1, "asked": 0}
    play = tiny(GUIDE, {"guide": {"at": [3, 1], "state": "talking"}}).step()
    assert reason(play, "goto: waiting")["why"] == "not near is false: distance(agent) is 2"


def test_heard_after_and_once(tiny: Folder) -> None:
    play = tiny(GUIDE).step()
    assert reason(play, "say: Bye.")["why"] == "hears: Say bye: nothing was heard"
    play.step(None, "Say bye")
    assert reason(play, "say: Bye.")["why"] == "after: 3: turn 2 of this state"
    assert reason(play, "Say hello")["why"] == 'hears: Say hello: heard "Say bye"'
    assert [entry["name"] for entry in explained(play)["fired"]] == ["count"]
    play.step(None, "Say hello")
    assert reason(play, "once: true")["why"] == "it fires once, and has fired before"


def test_a_voice_that_does_not_carry(tiny: Folder) -> None:
    play = tiny("earshot: 3\n" + GUIDE).step(None, "Say hello")
    why = reason(play, "say: Hello.")["why"]
    assert why.endswith('nothing was heard: the agent said "Say hello" at distance 4, its voice carries 3')


def test_what_another_member_said(tiny: Folder) -> None:
    play = tiny(
        """
        frames:
          talk: {states: {on: {then: [{when: t == 1, say: Ready when you are.}]}}}
          wait:
            states:
              on:
                then:
                  - {hears: "Ready, steady, go.", say: Go.}
                  - {hears: Ready when you are., when: t > 5, say: No.}
          shout: {states: {on: {then: [{when: t > 9, say: "Ready, steady, go."}]}}}
        cast:
          one: {at: [3, 3], frame: talk}
          two: {at: [4, 4], frame: wait}
          three: {at: [5, 5], frame: shout}
          agent: {at: [1, 1]}
        """
    ).step()
    assert "Ready when you are." in reason(play, "steady, go., say: Go.")["why"]
    assert reason(play, "say: No.")["why"] == "t > 5 is false: t is 1"


def test_steps_name_what_they_wait_for(tiny: Folder) -> None:
    play = tiny(
        """
        objects: {door: {type: door, place: wall(top), state: closed}}
        frames:
          walk:
            steps:
              - {do: stay, for: 2}
              - {do: stay, until: door.open, say: Open.}
              - {do: go_to(agent)}
        cast:
          walker: {at: [5, 5], facing: up, frame: walk}
          agent: {at: [1, 1]}
        """
    ).step()
    assert reason(play, "for: 2")["why"] == "for: 2: turn 1 of this state"
    play.step()
    assert [entry["kind"] for entry in explained(play)["fired"]] == ["step"]
    play.step()
    assert reason(play, "say: Open.")["why"] == "door.open is false: door is closed"


def test_chance_and_choices_that_find_nothing(tiny: Folder) -> None:
    play = tiny(
        """
        objects: {boxes: {type: box, count: 2, place: row(3)}}
        frames:
          try:
            states:
              on:
                then:
                  - {chance: 0, say: Never.}
                  - {when: first(b in boxes where b.opened).x == 2, say: Found.}
                  - {say: "The <first(b in boxes where b.opened).color> one."}
        cast:
          guide: {at: [5, 5], frame: try}
          agent: {at: [1, 1]}
        """
    ).step()
    assert reason(play, "Never.")["why"] == "chance: 0: not drawn"
    assert reason(play, "Found.")["why"].endswith("finds nothing")
    assert reason(play, "one.")["why"] == "something that it needs is not there"


def test_rules_of_the_world_and_outcomes(tiny: Folder) -> None:
    play = tiny(
        """
        state: {rounds: 0}
        rules:
          - {when: t % 2 == 0, set: {rounds: "min(rounds + 1, 9)"}}
          - {id: slow, when: rounds > 3, reward: 1}
        outcome:
          - success: rounds == 2 and agent.did(left)
          - failure: agent.did(done)
        cast: {agent: {at: [1, 1]}}
        """
    ).step()
    assert reason(play, "t % 2")["why"] == "t % 2 == 0 is false: t % 2 is 1"
    assert reason(play, "success")["values"] == {"rounds": 0}
    play.step("done")
    names = [(entry["who"], entry["name"]) for entry in explained(play)["fired"]]
    assert names[0] == ("world", "rules[0]")
    assert names[1][0] == "outcome"
    assert names[1][1].startswith("failure@")
    assert reason(play, "reward")["name"] == "slow"


def test_goto_now_is_told_in_the_order_it_is_gone(tiny: Folder) -> None:
    play = tiny(
        """
        frames:
          hop:
            start: c
            states:
              a: {then: [{when: t > 5, say: Late.}]}
              b: {then: [{goto_now: a}]}
              c: {then: [{goto_now: b}]}
        cast: {guide: {at: [5, 5], frame: hop}, agent: {at: [1, 1]}}
        """
    ).step()
    assert [entry["state"] for entry in explained(play)["fired"]] == ["c", "b"]
    assert reason(play, "Late.")["state"] == "a"


def test_it_changes_nothing_and_needs_a_step(tiny: Folder) -> None:
    play = tiny(GUIDE)
    env: Any = play.env.unwrapped
    with pytest.raises(ValueError, match="before the first step"):
        env.explain()
    play.step(None, "Say hello")
    before, counted = env.snapshot(), env.counters()
    first = env.explain()
    assert env.explain() == first
    assert (env.snapshot(), env.counters()) == (before, counted)
    env.restore(before)
    with pytest.raises(ValueError, match="before the first step"):
        env.explain()
    play.step(None, "Say hello")
    assert explained(play)["t"] == 2


def test_after_restore_it_goes_on_from_there(tiny: Folder) -> None:
    """The same step gives the same explanation, whether the episode is played through or put back in its middle."""
    whole = tiny(GUIDE).step(None, "Say bye")
    middle = whole.env.unwrapped.snapshot()  # type: ignore[attr-defined]
    whole.step("forward", "Say bye")
    expected = explained(whole)
    whole.env.unwrapped.restore(middle)  # type: ignore[attr-defined]
    whole.step("forward", "Say bye")
    assert explained(whole) == expected


def test_each_step_is_played_again_once(tiny: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    """However often, and after however many steps, somebody asks; and what is told does not depend on it."""
    said = ["Say bye", "Say hello", "Say bye", "Say bye", "Say hello", "Say bye"]
    asked: list[dict[str, Any]] = []
    played: list[Task] = []
    step = Batch.step
    for every in (1, 2, 3, 6):
        play, played[:] = tiny(GUIDE), []
        for number, words in enumerate(said, 1):
            play.step(None, words)
            if number % every == 0:
                with monkeypatch.context() as patched:
                    patched.setattr(
                        Batch, "step", lambda batch, task: played.append(task) or step(batch, task)
                    )
                    assert explained(play) == explained(play)
        asked.append(explained(play))
        assert len(played) == len(said)
    assert asked == [asked[0]] * len(asked)


def test_members_of_suites_and_acts(tiny: Folder) -> None:
    """The action space of a suite is its own; an act that has just ended is explained, not the one that began."""
    for name, noun in (("one", "hello"), ("two", "bye")):
        tiny.write(
            name,
            f"""
            grammar: {{templates: [Say <noun>], nouns: [{noun}]}}
            frames: {{f: {{states: {{on: {{then: [{{hears: Say {noun}, say: Yes.}}]}}}}}}}}
            cast: {{guide: {{at: [5, 5], frame: f}}, agent: {{at: [1, 1]}}}}
            outcome: [{{success: agent.said("Say {noun}")}}]
            """,
        )
    acts = tiny.save(
        "acts", "suite: acts\ndraw: in_sequence\nmembers: [one.yaml, two.yaml]\nactions: union\n"
    )
    env: Any = sd.make(str(acts)).unwrapped
    env.reset(seed=0)
    for noun in ("hello", "bye"):
        env.step(env.encode_action((None, f"Say {noun}")))
        fired = env.explain()["fired"]
        assert [entry["who"] for entry in fired] == ["guide", "outcome"]
        assert noun in fired[0]["words"]


def test_of_a_program_alone_nothing_is_known_that_could_explain_it(tiny: Folder) -> None:
    program = sd.compile(sd.load(str(tiny.write("tiny", GUIDE))))
    env = ScenarioEnv(program)
    env.reset(seed=0)
    env.step(np.array([0, 0, 0, 0]))
    with pytest.raises(ValueError, match="of a program; expected make"):
        env.explain()


WAY = """
room: {{size: 5}}
objects:
  gate: {{type: door, at: [2, 0], state: {gate}, color: red}}
  crate: {{type: box, at: {crate}, color: blue}}
let: {{goal: pick(gate | crate)}}
frames:
  leave: {{steps: [{{do: {do}}}, {{do: stay, for: ever}}]}}
cast:
  ann: {{at: [3, 3], frame: leave}}
  porter: {{at: {porter}}}
  agent: {{at: {agent}, facing: left}}
"""


@pytest.mark.parametrize(
    ("do", "changes", "why"),
    [
        ("go_to(gate)", {"crate": [2, 1]}, "there is no way: crate at 2,1 is in the way"),
        ("go_next_to(gate)", {"crate": [2, 1]}, "there is no way: crate at 2,1 is in the way"),
        ("enter(gate)", {"porter": [2, 1]}, "there is no way: porter at 2,1 is in the way"),
        ("use(gate)", {"agent": [2, 1]}, "there is no way: agent at 2,1 is in the way"),
        ("go_to(goal)", {"porter": [2, 1]}, "there is no way: porter at 2,1 is in the way"),
        (
            "go_to(nearest(d in gate | gate to agent))",
            {"crate": [2, 1]},
            "there is no way: crate at 2,1 is in the way",
        ),
        (
            "go_next_to(porter)",
            {"porter": [1, 1], "crate": [2, 1], "agent": [1, 2]},
            "there is no way: agent at 1,2 is in the way",
        ),
        ("go_to(gate)", {}, ""),
        ("go_next_to(porter)", {}, ""),
    ],
)
def test_a_way_that_is_not_found_names_who_or_what_is_in_it(
    tiny: Folder, do: str, changes: dict[str, list[int]], why: str
) -> None:
    places = {"crate": [3, 1], "porter": [1, 1], "agent": [1, 3], "gate": "open", **changes}
    play = tiny(WAY.format(do=do, **places), {"let": {"goal": "gate"}}).step()
    assert reason(play, do)["why"] == f"do: {do} is not finished" + (f": {why}" if why else "")


def test_a_way_to_somebody_who_has_left(tiny: Folder) -> None:
    play = tiny(
        """
        frames:
          leave: {steps: [{cause: self.vanish}]}
          seek: {steps: [{do: go_next_to(bob)}]}
        cast:
          bob: {at: [5, 5], frame: leave}
          ann: {at: [3, 3], frame: seek}
          agent: {}
        """
    ).step()
    assert (
        reason(play, "go_next_to(bob)")["why"]
        == "do: go_next_to(bob) is not finished: its goal is not in the room"
    )


def test_what_is_heard_with_values_in_it_is_told_before_what_else_must_hold(tiny: Folder) -> None:
    """Nobody has spoken, so nobody is the speaker."""
    play = tiny(
        """
        let: {word: pick("hello" | "hello")}
        frames:
          shy: {states: {s: {then: [{hears: Say <word>, when: next_to(speaker), say: You there}]}}}
        cast:
          ann: {at: [3, 3], frame: shy}
          agent: {}
        """
    )
    assert reason(play.step(), "You there")["why"] == "hears: Say <word>: nothing was heard"
    assert reason(play.step(None, "Say bye"), "You there")["why"] == 'hears: Say <word>: heard "Say bye"'
    assert "next_to(speaker) is false" in reason(play.step(None, "Say hello"), "You there")["why"]


def test_every_key_of_a_rule_that_is_written_is_shown(tiny: Folder) -> None:
    """Conditions first, then what it does, in the order in which it is done."""
    rule = (
        "{to: agent, say: Hello., addressed: false, hears: any, when: self.x == 9, once: true, chance: 0.5}"
    )
    play = tiny(GUIDE.replace("{hears: Say bye, after: 3, say: Bye.}", rule)).step(None, "Say hello")
    assert reason(play, "self.x")["words"] == (
        "hears: any, addressed: false, when: self.x == 9, chance: 0.5, once: true, say: Hello., to: agent"
    )


def test_a_key_that_means_a_condition_is_explained_as_that_condition(tiny: Folder) -> None:
    """Alone, and beside `when`."""
    late = "{after: asked + 5, when: agent.x == 1, say: Late.}"
    play = tiny(GUIDE.replace("{hears: Say bye, after: 3, say: Bye.}", late)).step(None)
    entry = reason(play, "say: Late.")
    assert entry["part"] == "turns_in_state >= asked + 5"
    assert entry["values"]["turns_in_state"] == 1
    alone = late.replace(" when: agent.x == 1,", "")
    play = tiny(GUIDE.replace("{hears: Say bye, after: 3, say: Bye.}", alone)).step(None)
    assert reason(play, "say: Late.")["part"] == "turns_in_state >= asked + 5"
