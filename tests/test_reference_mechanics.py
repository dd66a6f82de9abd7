"""The reference interpreter on what things do: marbles, timers, contents, shadows, beliefs, gestures, rewards."""

from __future__ import annotations

from typing import Any

import pytest
import yaml

from tests.reference import Reference

LEFT, RIGHT, FORWARD, TOGGLE, STAY = ((number, 0, 0, 0) for number in range(5))

BASE = """
scenario: base
horizon: 40
earshot: room
actions: [left, right, forward, toggle]
grammar: {templates: [Say <noun>], nouns: [1, 2, red]}
room: {size: 7}
cast:
  agent: {at: [1, 3], facing: right}
outcome:
  - failure: t > 38
"""


def play(text: str) -> Reference:
    """A reference of the base with some keys replaced, after a reset."""
    reference = Reference({**yaml.safe_load(BASE), **yaml.safe_load(text)})
    reference.reset(0)
    return reference


def things(reference: Reference, name: str) -> list[tuple[Any, str]]:
    """Where the objects of a group are and how they are."""
    found = reference.describe()["objects"][name]
    return [(thing["at"] and tuple(thing["at"]), thing["state"]) for thing in found]


def after(reference: Reference, name: str, *actions: tuple[int, int, int, int]) -> list[tuple[Any, str]]:
    """The first object of a group after each action."""
    seen = []
    for action in actions:
        reference.step(action)
        seen.append(things(reference, name)[0])
    return seen


class TestMarbles:
    LANE = """
objects:
  marble: {type: marble, at: [2, 3], color: blue}
  mill: {type: generator, at: [5, 3], color: red, pushed_by: marble, opens: gate}
  gate: {type: remote_door, at: [6, 5], color: red}
"""

    def test_it_rolls_in_the_step_of_the_push_and_bumps_into_the_generator(self):
        world = play(self.LANE)
        assert after(world, "marble", FORWARD, STAY, STAY) == [
            ((3, 3), "rolling"),
            ((4, 3), "rolling"),
            ((4, 3), "still"),
        ]
        assert things(world, "mill") == [((5, 3), "pressed")]
        assert things(world, "gate") == [((6, 5), "open")]
        assert world.describe()["cast"]["agent"]["at"] == [1, 3], "who pushes stays"

    def test_only_a_marble_pushes_what_only_marbles_push(self):
        world = play(self.LANE.replace("at: [2, 3]", "at: [2, 5]").replace("at: [5, 3]", "at: [2, 3]"))
        world.step(FORWARD)
        assert things(world, "mill") == [((2, 3), "idle")]

    def test_one_marble_sets_the_next_rolling(self):
        world = play("objects: {row: {type: marble, at: [[2, 3], [3, 3], [5, 3]], color: blue}}")
        world.step(FORWARD)
        # The first bumps at once; the second comes later in the row and moves in the same step.
        assert things(world, "row") == [((2, 3), "still"), ((4, 3), "rolling"), ((5, 3), "still")]
        world.step(STAY)
        assert things(world, "row") == [((2, 3), "still"), ((4, 3), "still"), ((5, 3), "still")]

    def test_a_body_and_lava_stop_it(self):
        world = play("""
objects: {marble: {type: marble, at: [2, 3], color: blue}}
cast: {agent: {at: [1, 3], facing: right}, ann: {at: [4, 3]}}
""")
        assert after(world, "marble", FORWARD, STAY)[-1] == ((3, 3), "still")
        world = play("""
objects: {marble: {type: marble, at: [2, 3], color: blue}}
room: {size: 7, build: [{lava: column(4)}]}
""")
        assert after(world, "marble", FORWARD, STAY)[-1] == ((3, 3), "still")

    def test_an_npc_pushes_in_its_turn(self):
        world = play("""
objects: {marble: {type: marble, at: [3, 3], color: blue}}
frames: {work: {steps: [{do: "push(marble, down)"}, {do: stay, for: ever}]}}
cast: {ann: {at: [3, 2], facing: down, frame: work}, agent: {at: [1, 5], facing: left}}
""")
        assert after(world, "marble", STAY, STAY) == [((3, 3), "rolling"), ((3, 4), "rolling")]
        assert world.describe()["cast"]["ann"]["state"] == 1


class TestTimers:
    LEVER = """
objects:
  lever: {type: lever, at: [2, 3], timer: 3, opens: gate}
  gate: {type: remote_door, at: [6, 3], color: red}
"""

    def test_a_lever_holds_the_door_for_its_steps_and_once(self):
        world = play(self.LEVER)
        assert [status for _, status in after(world, "lever", TOGGLE, STAY, STAY, TOGGLE)] == [
            "up",
            "up",
            "spent",
            "spent",
        ]
        assert things(world, "gate") == [((6, 3), "closed")]

    def test_the_door_is_open_while_it_is_up(self):
        world = play(self.LEVER)
        assert [status for _, status in after(world, "gate", TOGGLE, STAY, STAY)] == [
            "open",
            "open",
            "closed",
        ]


class TestContents:
    BOXES = """
objects:
  boxes: {type: box, at: [[2, 3], [1, 2]], color: [red, blue], exclusive: true}
  toy: {type: apple, inside: first(boxes)}
rules:
  - {when: t == 3, cause: [boxes.reset, toy.reset]}
"""

    def test_what_is_inside_takes_the_place_of_an_opened_box(self):
        world = play(self.BOXES.partition("rules:")[0])
        assert things(world, "toy") == [(None, "whole")]
        world.step(TOGGLE)
        assert things(world, "boxes") == [(None, "opened"), ((1, 2), "shut")]
        assert things(world, "toy") == [((2, 3), "whole")]
        world.step(TOGGLE)
        assert things(world, "toy") == [((2, 3), "eaten")]

    def test_one_opened_box_blocks_the_others(self):
        world = play(self.BOXES.partition("rules:")[0])
        for action in (TOGGLE, LEFT, TOGGLE):
            world.step(action)
        assert things(world, "boxes")[1] == ((1, 2), "shut")

    def test_reset_puts_everything_back(self):
        world = play(self.BOXES)
        for action in (TOGGLE, LEFT, STAY, TOGGLE):
            world.step(action)
        assert things(world, "toy") == [(None, "whole")]
        assert things(world, "boxes") == [((2, 3), "shut"), ((1, 2), "opened")], "the other reacts again"

    def test_an_opened_empty_box_stays_until_something_is_put_into_it(self):
        world = play("""
objects:
  boxes: {type: box, at: [[2, 3], [5, 5]], color: red}
  toy: {type: apple, inside: first(b in boxes where b.index == 1)}
let: {near: first(boxes)}
rules: [{when: t == 2, cause: toy.move_into(near)}]
""")
        world.step(TOGGLE)
        assert things(world, "boxes")[0] == ((2, 3), "opened")
        world.step(STAY)
        assert things(world, "boxes")[0] == (None, "opened")
        assert things(world, "toy") == [((2, 3), "whole")]

    def test_a_group_is_put_back_with_npcs_only_where_their_place_is_free(self):
        world = play("""
frames: {walk: {states: {a: {do: forward, then: [{when: t == 3, cause: [self.reset]}]}}}}
cast:
  ann: {at: [1, 1], facing: right, frame: walk}
  bob: {at: [1, 4], facing: right, frame: walk}
  agent: {at: [1, 3], facing: down}
""")
        for action in (STAY, FORWARD, STAY):
            world.step(action)
        cast = world.describe()["cast"]
        assert cast["agent"]["at"] == [1, 4]
        assert cast["ann"]["at"] == [1, 1]
        assert cast["bob"]["at"] == [4, 4], "somebody stands where it began"


class TestShadow:
    def test_a_wall_ahead_hides_what_lies_behind(self):
        world = play("""
room: {size: 9, occlusion: true}
objects: {wall: {type: wall, at: [4, 5]}, ball: {type: ball, at: [4, 3], color: red}}
cast: {agent: {at: [4, 7], facing: up}}
rules: [{when: agent.sees(ball), cause: ball.vanish}]
""")
        image = world.reset(0).image
        # Column 3 is straight ahead, row 6 the agent's own; the wall is two cells ahead.
        hidden = {(i, j) for i in range(7) for j in range(7) if tuple(image[i, j]) == (0, 0, 0, 0)}
        assert tuple(image[3, 4]) == (2, 5, 0, 0)
        assert tuple(image[3, 3]) == (1, 0, 0, 0), "light comes round from the sides"
        assert hidden == set()
        assert tuple(image[3, 2]) == (6, 0, 0, 0)

    def test_light_spreads_sideways_but_not_into_a_niche(self):
        world = play("""
room: {size: 9, occlusion: true}
objects: {walls: {type: wall, at: [[3, 5], [4, 5], [5, 5], [3, 4], [5, 4]]}}
cast: {agent: {at: [4, 7], facing: up}}
""")
        image = world.reset(0).image
        seen = ["".join("." if image[i, j].any() else "#" for i in range(7)) for j in range(7)]
        assert seen == [
            ".......",
            ".......",
            ".......",
            "...#...",
            ".......",
            ".......",
            ".......",
        ]

    def test_doors_hide_the_next_room_until_they_are_open(self):
        world = play("""
room: {size: 7, occlusion: true, build: [{wall: row(3)}]}
objects: {door: {type: door, at: [3, 3], color: red}, ball: {type: ball, at: [3, 1], color: red}}
cast: {agent: {at: [3, 4], facing: up}}
state: {saw: 0}
rules: [{when: agent.sees(ball), set: {saw: 1}}]
""")
        assert tuple(world.reset(0).image[3, 3]) == (0, 0, 0, 0)
        assert tuple(world.step(STAY).image[3, 3]) == (0, 0, 0, 0)
        assert world.describe()["state"] == {"saw": 0}
        assert tuple(world.step(TOGGLE).image[3, 3]) == (6, 0, 0, 0)
        assert world.describe()["state"] == {"saw": 1}


class TestBeliefs:
    def test_sally_believes_what_she_saw_last(self):
        world = play("""
objects:
  boxes: {type: box, at: [[5, 2], [5, 4]], color: [red, blue]}
  toy: {type: ball, inside: first(boxes), color: green}
let: {other: first(b in boxes where b.index == 1)}
frames: {turn_away: {states: {a: {do: right}}}}
rules: [{when: t == 1, cause: toy.move_into(other)}]
cast:
  sally: {at: [1, 3], facing: right, frame: turn_away, beliefs: {place: {of: toy.inside, when: sees(toy.inside)}}}
  agent: {at: [1, 5], facing: up}
""")
        believed = [world.describe()["cast"]["sally"]["believes"]["place"]]
        for _ in range(5):
            world.step(STAY)
            believed.append(world.describe()["cast"]["sally"]["believes"]["place"])
        # She sees the right half in her turn of step 1, before it is moved, and again in that of step 5.
        assert believed == ["boxes[0]"] * 5 + ["boxes[1]"]


class TestGestures:
    @pytest.mark.parametrize(("facing", "pointing"), [("up", 3), ("right", 2)])
    def test_the_last_channels_show_pointing_and_the_last_act(self, facing, pointing):
        world = play(f"""
observe: {{channels: [type, color, status, orientation, pointing, last_act], directions: egocentric}}
objects: {{ball: {{type: ball, at: [5, 1], color: red}}}}
frames: {{show: {{steps: [{{do: point(ball)}}, {{do: left}}, {{do: stop_pointing}}, {{do: stay, for: ever}}]}}}}
cast:
  ann: {{at: [3, 1], facing: up, frame: show}}
  agent: {{at: [3, 5] , facing: {facing}}}
""")
        cell = (3, 2) if facing == "up" else None
        seen = []
        for _ in range(4):
            image = world.step(STAY).image
            assert (image[:, :, 4:] != 255).any(axis=2).sum() == (1 if cell else 0)
            if cell:
                seen.append(tuple(image[cell][4:]))
        if cell:
            assert seen == [(pointing, 4 + pointing), (pointing, 1), (255, 8), (255, 10)]


class TestRewards:
    def test_shares_rules_and_steps_add_up(self):
        world = play("""
reward: {success: linear(0.5), each_step: -0.01}
state: {price: {start: 2, range: 0..4}}
rules: [{when: t == 2, set: {price: price + 9}, reward: 20}]
outcome: [{success: t == 4, reward: 100 * price // 5}]
""")
        rewards = [world.step(STAY).reward for _ in range(4)]
        assert rewards == pytest.approx([-0.01, 0.19, -0.01, 0.8 * (1 - 0.5 * 4 / 40) - 0.01])


class TestSpeakers:
    def test_the_agent_comes_first_and_then_the_cast(self):
        world = play("""
tables: {word: {1: ana, 2: bel, red: cor}}
frames:
  greet: {states: {a: {then: [{when: t == 1, say: Say 2}]}}}
  listen:
    let: {heard: 0}
    states:
      a:
        first: [{hears: Say <noun>, do: left, set: {heard: heard + 1}, say: <speaker.name> said <word(noun)>, goto: b}]
      b: {then: [{hears: any, say: "<speaker.name>"}]}
cast:
  ann: {at: [5, 1], frame: greet}
  peers: {count: 2, at: [[5, 3], [5, 5]], facing: [up, down], frame: listen, name: [Bo, Cy], color: distinct}
  agent: {at: [1, 3]}
""")
        assert world.step((4, 1, 0, 2)).heard == ("Ann: Say 2", "Bo: Agent said cor", "Cy: Agent said cor")
        described = world.describe()["cast"]
        assert [described[f"peers[{k}]"]["facing"] for k in (0, 1)] == ["left", "right"]
        assert described["peers[0]"]["clock"] == 0
        assert described["peers[0]"]["color"] != described["peers[1]"]["color"]
        # Cy has said something that Bo has not yet heard; Cy hears both.
        assert world.step(STAY).heard == ("Bo: Cy", "Cy: Bo")
