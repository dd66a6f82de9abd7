"""The reference interpreter on what the world does by itself: links, statuses, rules, memories, rooms refused."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
import yaml

from tests.reference import Reference
from tests.reference.chance import attempt, episode

STAY = (3, 0, 0, 0)
TOGGLE = (2, 0, 0, 0)

BASE = """
scenario: base
horizon: 30
earshot: room
actions: [left, forward, toggle]
grammar: {templates: [Say <noun>], nouns: [1, 2]}
room: {size: 7}
cast:
  agent: {at: [1, 3], facing: left}
outcome:
  - failure: t > 28
"""


def play(text: str, **layout: Any) -> Reference:
    """A reference of the base with some keys replaced, after a reset."""
    reference = Reference({**yaml.safe_load(BASE), **yaml.safe_load(text)})
    reference.reset(0, layout=layout)
    return reference


def status(reference: Reference, name: str) -> Any:
    found = reference.describe()["objects"][name]
    return [thing["state"] for thing in found]


def dance(*elements: tuple[str, int]) -> dict[str, Any]:
    """A layout in which the dance is this one."""
    moves = {f"dance[{k}].move": move for k, (move, _) in enumerate(elements)}
    return {"let": moves | {f"dance[{k}].utterance": said for k, (_, said) in enumerate(elements)}}


class TestLinks:
    PAIRS = """
objects:
  doors: {type: door, at: [[3, 0], [5, 0]], state: locked, color: [red, blue]}
  buttons: {type: switch, at: [[0, 3], [0, 5]], unlocks: doors, color: doors.color, one_way: true}
rules:
  - {when: t == 3, cause: doors.lock}
  - {when: t == 4, cause: buttons.reset}
  - {when: t == 5, cause: doors.lock}
"""

    def test_pairs(self):
        world = play(self.PAIRS)
        assert [thing["color"] for thing in world.describe()["objects"]["buttons"]] == ["red", "blue"]
        world.step(TOGGLE)
        assert status(world, "buttons") == ["pressed", "idle"]
        assert status(world, "doors") == ["closed", "locked"], "unlocked, and no other"
        world.step(TOGGLE)
        assert status(world, "buttons") == ["pressed", "idle"], "there is no way back"

    def test_a_link_is_a_level(self):
        world, seen = play(self.PAIRS), []
        world.step(TOGGLE)
        for _ in range(4):
            world.step(STAY)
            seen.append(status(world, "doors")[0])
        assert seen == ["closed", "closed", "closed", "locked"], "locking lasts once the button is released"

    def test_one_unlocks_all_and_all_unlock_one(self):
        world = play("""
objects:
  doors: {type: door, at: [[3, 0], [5, 0]], state: locked, color: red}
  gate: {type: door, at: [6, 3], state: locked, color: red}
  master: {type: switch, at: [0, 3], unlocks: doors, color: red}
  others: {type: switch, at: [[0, 2], [0, 4]], unlocks: gate, color: red}
""")
        world.step(TOGGLE)
        assert (status(world, "doors"), status(world, "gate")) == (["closed", "closed"], ["locked"])
        world.world.agent.cell = (1, 4)
        world.step(TOGGLE)
        assert status(world, "gate") == ["closed"]

    def test_an_early_picture_shows_links_but_no_computed_status(self):
        text = """
observe: {image: before_npcs}
objects:
  linked: {type: door, at: [0, 2], state: locked, color: red}
  computed: {type: door, at: [0, 4], color: red, locked: not button.pressed}
  button: {type: switch, at: [0, 3], unlocks: linked, color: blue}
"""
        world = play(text)
        image = world.step(TOGGLE).image
        # The agent faces the wall: the button ahead, one door to each side of it.
        assert tuple(image[3, 5]) == (12, 2, 1, 0)
        assert (tuple(image[4, 5]), tuple(image[2, 5])) == ((4, 0, 1, 0), (4, 0, 2, 0))
        assert status(world, "computed") == ["closed"]
        assert tuple(world.step(STAY).image[2, 5]) == (4, 0, 1, 0)


class TestStatuses:
    def test_computed_by_place_and_time(self):
        world = play("""
objects:
  balls: {type: ball, at: [[1, 1], [5, 1]], color: red, tagged: agent.distance(it) <= t}
  door: {type: door, at: [0, 3], color: red, state: open, locked: t >= 2 and t < 4}
""")
        assert (status(world, "balls"), status(world, "door")) == (["plain", "plain"], ["open"])
        seen = []
        for _ in range(6):
            world.step(STAY)
            seen.append((*status(world, "balls"), *status(world, "door")))
        assert seen == [
            ("plain", "plain", "open"),
            ("tagged", "plain", "locked"),
            ("tagged", "plain", "locked"),
            ("tagged", "plain", "closed"),
            ("tagged", "plain", "closed"),
            ("tagged", "tagged", "closed"),
        ]

    def test_initial_status_may_be_drawn_and_is_what_reset_restores(self):
        text = """
objects: {lamps: {type: switch, at: [[0, 2], [0, 3], [0, 4]], color: red, pressed: it == lit, dark: true}}
let: {lit: pick(lamps)}
rules:
  - {when: t == 1, cause: lamps.become(idle)}
  - {when: t == 2, cause: lamps.reset}
"""
        lit = Counter()
        for seed in range(60):
            world = play(text)
            image = world.reset(seed).image
            before = status(world, "lamps")
            lit[before.index("pressed")] += 1
            assert [image[i, 5][2] for i in (2, 3, 4)] == [0, 0, 0], "dark"
            world.step(STAY)
            assert status(world, "lamps") == ["idle"] * 3
            world.step(STAY)
            assert status(world, "lamps") == before
        assert all(8 < lit[number] < 32 for number in range(3))


class TestRules:
    def test_all_that_hold_run_in_order_and_once_is_once(self):
        world = play("""
objects: {box: {type: box, at: [3, 3], color: red}, lamp: {type: switch, at: [5, 0], color: red}}
state: {count: {start: 0, range: 0..3}}
rules:
  - {set: {count: count + 1}}
  - {when: count == 2, cause: lamp.become(pressed)}
  - {when: lamp.pressed, once: true, cause: [box.become(opened), lamp.reset]}
  - {when: lamp.pressed, cause: box.vanish}
""")
        seen = []
        for _ in range(5):
            world.step(STAY)
            seen.append((world.world.registers["count"], *status(world, "box"), *status(world, "lamp")))
        assert seen == [
            (1, "shut", "idle"),
            (2, "opened", "idle"),
            (3, "opened", "idle"),
            (3, "opened", "idle"),
            (3, "opened", "idle"),
        ]

    def test_prev_is_the_state_before_the_step(self):
        world = play("""
objects: {lamp: {type: switch, at: [5, 0], color: red}, door: {type: door, at: [6, 2], color: red}}
cast: {agent: {at: [3, 3], facing: up}}
rules:
  - {when: prev(agent.y) == agent.y + 1 and t == prev(t) + 1, cause: lamp.become(pressed)}
  - {when: prev(agent.action) == forward and agent.action == left, cause: door.open}
""")
        seen = []
        for primitive in (3, 1, 0, 0):
            world.step((primitive, 0, 0, 0))
            seen.append((*status(world, "lamp"), *status(world, "door")))
        assert seen == [("idle", "closed"), ("pressed", "closed"), ("pressed", "open"), ("pressed", "open")]

    def test_chance_is_drawn_anew_each_step(self):
        text = """
objects: {lamp: {type: switch, at: [5, 0], color: red}}
rules:
  - {cause: lamp.become(idle)}
  - {chance: 0.25, cause: lamp.become(pressed)}
"""
        pressed = 0
        for seed in range(40):
            world = play(text)
            world.reset(seed)
            for _ in range(20):
                world.step(STAY)
                pressed += status(world, "lamp") == ["pressed"]
        assert 0.2 < pressed / 800 < 0.3


class TestMemory:
    TEXT = """
let: {dance: {sequence: 2, moves: [left, forward], utterance: {chance: 0.5}}}
memory: {attempt: {last: 2, of: agent.acts, while: t >= 2}}
outcome:
  - success: attempt == dance
"""

    def test_it_is_open_by_the_state_before_the_step(self):
        world = play(self.TEXT)
        world.reset(
            0,
            layout={
                "let": {f"dance[{k}].move": "left" for k in (0, 1)}
                | {f"dance[{k}].utterance": 0 for k in (0, 1)}
            },
        )
        # t is 2 after the second step, so the third is the first that is kept.
        results = [world.step((0, 0, 0, 0)).terminated for _ in range(4)]
        assert results == [False, False, False, True]

    def test_nothing_equals_a_memory_that_is_not_full(self):
        world = play(self.TEXT + "  - failure: not attempt == dance and t > 3\n")
        world.reset(0, layout=dance(("left", 2), ("forward", 0)))
        results = [world.step(step) for step in [STAY, STAY, (0, 1, 0, 1), (1, 0, 0, 0)]]
        assert results[-1].reward == pytest.approx(1 - 0.9 * 4 / 30)


class TestRequire:
    def test_rooms_are_drawn_until_all_holds(self):
        text = """
objects: {ball: {type: ball, place: anywhere, color: random}}
cast: {agent: {place: anywhere}}
require: [agent.distance(ball) > 4, ball.color in red | blue]
"""
        picky, plain = play(text), play(text.replace("require", "skills"))
        kept = 0
        for seed in range(40):
            picky.reset(seed)
            described = picky.describe()
            ball, agent = described["objects"]["ball"][0], described["cast"]["agent"]["at"]
            assert abs(ball["at"][0] - agent[0]) + abs(ball["at"][1] - agent[1]) > 4
            assert ball["color"] in ("red", "blue")
            plain.reset(seed)
            kept += plain.describe() == described
        assert 0 < kept < 20, "a room that is as required from the start is the one that is drawn anyway"
        assert picky.rooms_refused > 100

    def test_what_no_room_has_is_said(self):
        with pytest.raises(RuntimeError, match="base"):
            play("require: [t > 0]")

    def test_the_first_attempt_has_the_key_of_the_episode(self):
        key = episode(3, 0, 0)
        assert attempt(key, 0) == key
        assert len({attempt(key, number) for number in range(64)}) == 64


class TestMembers:
    FILES = """
cast:
  guide:
    one_of:
      - {npc: shy, kind: shy, name: Sue, at: [3, 3], facing: up, frame: talk, with: {near: true, line: Hi}}
      - {npc: bold, kind: bold, name: Bob, at: [5, 5], facing: down, frame: talk, with: {near: false, line: Ho}}
      - {npc: odd, kind: shy, kind_code: 9, at: [3, 1], facing: left, frame: talk, with: {near: false, line: Hm}}
  agent: {at: [1, 3], facing: left}
frames:
  talk:
    slots: {near: bool, line: text}
    states: {a: {then: [{when: (distance(agent) < 3) == near, say: <line>}]}}
"""

    def test_each_file_is_drawn_with_all_that_is_its_own(self):
        seen = Counter()
        world = play(self.FILES)
        for seed in range(90):
            world.reset(seed)
            guide = world.world.cast["guide"]
            heard = world.step(STAY).heard
            seen[guide.drawn_from, guide.kind_code, guide.cell, guide.facing, heard] += 1
        assert set(seen) == {
            ("shy", 0, (3, 3), "up", ("Sue: Hi",)),
            ("bold", 1, (5, 5), "down", ("Bob: Ho",)),
            ("odd", 9, (3, 1), "left", ("Guide: Hm",)),
        }
        assert all(count > 15 for count in seen.values())


class TestEgocentric:
    @pytest.mark.parametrize(("facing", "shown"), [("up", 2), ("right", 3), ("down", 0), ("left", 1)])
    def test_directions_are_as_seen_by_the_agent(self, facing, shown):
        world = play(f"""
observe: {{directions: egocentric}}
cast:
  guide: {{at: [3, 3], facing: {facing}, color: red}}
  agent: {{at: [3, 5], facing: up}}
""")
        assert tuple(world.reset(0).image[3, 4]) == (11, 0, 0, shown)
