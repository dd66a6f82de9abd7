"""The order of events in one step: a test for every numbered sentence of docs/one_step.md."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import pytest

import socialai_dsl as sd
from socialai_dsl.envs.asking import Asker
from tests.tiny import Folder, Play

PAGE = Path(__file__).parents[1] / "docs" / "one_step.md"

EMPTY, WALL, DOOR, BALL, NPC, MARBLE = 1, 2, 4, 6, 11, 16
"""Codes of types in the picture."""

RED, BLUE = 0, 2
"""Codes of colours in the picture."""


@pytest.fixture
def play(tmp_path: Path) -> Folder:
    """Writes tiny scenarios and begins their episodes."""
    return Folder(tmp_path)


# -- the page and its tests ------------------------------------------------------------------------


def _lines_of_lists() -> list[str]:
    text = PAGE.read_text(encoding="utf-8").split("\n## ", 1)[1]
    joined = re.sub(r"\n  (?=\S)", " ", text)
    return [line for line in joined.splitlines() if line and not re.match(r"(## )?\d+\. ", line)]


def _numbered() -> dict[str, str]:
    found = [re.fullmatch(r"\* \*\*(\d+\.\d+)\*\* (.+)", line) for line in _lines_of_lists()]
    return {match[1]: match[2] for match in found if match}


def test_everything_on_the_page_is_a_numbered_sentence() -> None:
    lines = _lines_of_lists()
    assert len(lines) > 80
    assert [line for line in lines if not re.match(r"\* \*\*\d+\.\d+\*\* ", line)] == []
    assert len(_numbered()) == len(lines), "a number twice"


def test_numbers_count_up() -> None:
    numbers = [tuple(map(int, number.split("."))) for number in _numbered()]
    for before, after in pairwise(numbers):
        assert after in ((before[0], before[1] + 1), (before[0] + 1, 1))


def test_every_sentence_has_its_test_and_the_other_way_round() -> None:
    tests = [re.match(r"test_(\d+)_(\d+)_", name) for name in globals()]
    tested = [f"{match[1]}.{match[2]}" for match in tests if match]
    assert sorted(tested) == sorted(_numbered()), "each number of the page once"


# -- 0. before anything happens --------------------------------------------------------------------


def test_0_1_prev_is_the_value_in_the_state_the_last_step_left(play: Folder) -> None:
    run = play("""
        frames: {watch: {let: {was: 0, now: 0}, states: {s: {then: [{set: {was: prev(agent.x), now: agent.x}}]}}}}
        cast: {ann: {at: [5, 5], frame: watch}}
    """)
    run.step("forward")
    assert (run.value("ann.was"), run.value("ann.now")) == (1, 2)
    run.step("left")
    assert (run.value("ann.was"), run.value("ann.now")) == (2, 2)


def test_0_2_prev_is_kept_for_the_whole_step(play: Folder) -> None:
    run = play("""
        frames:
          walk:
            let: {early: 0, late: 0}
            states:
              s: {first: [{set: {early: prev(self.x)}}], do: forward, then: [{set: {late: prev(self.x)}}]}
        cast: {ann: {at: [2, 5], facing: right, frame: walk}}
    """)
    run.step()
    assert run.at("ann") == [3, 5]
    assert (run.value("ann.early"), run.value("ann.late")) == (2, 2)


def test_0_3_a_memory_is_open_if_its_condition_held_before(play: Folder) -> None:
    run = play("memory: {acts: {last: 2, of: agent.acts, while: agent.x == 1}}")
    run.step("forward")
    assert run.state["memory"]["acts"] == [["forward", None]], "it stood at x = 1 when the step began"
    run.step("left").step("left").step("forward")
    assert run.state["memory"]["acts"] == [["forward", None]], "it came back to x = 1 only in the step"


def test_0_4_then_t_grows_by_one(play: Folder) -> None:
    run = play("""
        frames: {watch: {let: {was: 0, now: 0}, states: {s: {first: [{set: {was: prev(t), now: t}}]}}}}
        cast: {ann: {at: [5, 5], frame: watch}}
    """)
    run.steps(2)
    assert run.state["t"] == 2
    assert (run.value("ann.was"), run.value("ann.now")) == (1, 2)


def test_0_5_what_the_agent_does_and_says_is_of_this_step(play: Folder) -> None:
    run = play("""
        frames:
          watch:
            let: {moved: false, talked: false, greeted: false}
            states:
              s:
                then:
                  - set: {moved: agent.action == forward, talked: agent.spoke, greeted: agent.said("Say hello")}
        cast: {ann: {at: [5, 5], frame: watch}}
    """)
    names = ("ann.moved", "ann.talked", "ann.greeted")
    run.step("forward", "Say hello")
    assert [run.value(name) for name in names] == [True, True, True]
    run.step()
    assert [run.value(name) for name in names] == [False, False, False]


def test_0_6_poked_is_of_this_step_and_was_poked_of_the_episode(play: Folder) -> None:
    run = play("""
        frames:
          watch:
            let: {now: false, earlier: false}
            states: {s: {then: [{set: {now: poked, earlier: was_poked}}]}}
        cast: {ann: {at: [2, 1], frame: watch}}
    """)
    run.step("toggle")
    assert (run.value("ann.now"), run.value("ann.earlier")) == (True, True)
    run.step()
    assert (run.value("ann.now"), run.value("ann.earlier")) == (False, True)


# -- 1. the agent's body ---------------------------------------------------------------------------


def test_1_1_a_scripted_agent_reads_first_before_it_moves(play: Folder) -> None:
    run = play("""
        frames: {script: {let: {seen: 0}, states: {s: {first: [{set: {seen: self.x}}], do: forward}}}}
        cast: {agent: {frame: script}}
    """)
    run.step("forward")
    assert run.at("agent") == [2, 1]
    assert run.value("agent.seen") == 1


def test_1_2_left_and_right_turn_the_agent(play: Folder) -> None:
    run = play("about: nothing but a room")
    turned = [run.step(way).facing("agent") for way in ("left", "left", "right", "right", "right")]
    assert turned == ["up", "left", "up", "right", "down"]
    assert run.at("agent") == [1, 1]


def test_1_3_forward_enters_unless_solid_or_taken(play: Folder) -> None:
    door = "objects: {{door: {{type: door, at: [2, 1], state: {}}}}}"
    assert play("about: free floor").step("forward").at("agent") == [2, 1]
    assert play(door.format("open")).step("forward").at("agent") == [2, 1]
    assert play(door.format("closed")).step("forward").at("agent") == [1, 1]
    assert play("cast: {agent: {facing: up}}").step("forward").at("agent") == [1, 1]
    assert play("cast: {ann: {at: [2, 1]}}").step("forward").at("agent") == [1, 1]
    outside = play("""
        objects: {door: {type: door, at: [0, 1], state: open}}
        cast: {agent: {facing: left}}
    """)
    assert outside.step("forward").step("forward").at("agent") == [0, 1], (
        "through the door, but not off the room"
    )


def test_1_4_hidden_npcs_do_not_stop_the_agent(play: Folder) -> None:
    run = play("""
        observe: {npcs: hidden}
        cast: {ann: {at: [2, 1]}}
    """)
    assert run.step("forward").at("agent") == run.at("ann") == [2, 1]


def test_1_5_the_agent_may_step_onto_a_deadly_cell(play: Folder) -> None:
    assert play("room: {build: [{lava: column(2)}]}").step("forward").at("agent") == [2, 1]


@pytest.mark.parametrize("npcs", ["shown", "hidden"])
def test_1_6_a_toggle_at_an_npc_pokes_it_and_nothing_else(play: Folder, npcs: str) -> None:
    run = play(f"""
        observe: {{npcs: {npcs}}}
        objects: {{door: {{type: door, at: [2, 1], state: open}}}}
        cast: {{ann: {{at: [2, 1]}}}}
    """).step("toggle")
    assert run.state["ann"]["poked"]
    assert run.state["last"]["poked"] == "ann"
    assert run.status("door") == "open"


def test_1_7_a_toggle_changes_the_object_ahead(play: Folder) -> None:
    run = play("""
        objects: {door: {type: door, at: [2, 1]}, far: {type: door, at: [3, 1]}}
        outcome: [{success: door.poked}]
    """).step("toggle")
    assert (run.status("door"), run.status("far")) == ("open", "closed")
    assert run.terminated


@pytest.mark.parametrize("kind", ["door", "box"])
def test_1_8_a_locked_object_ignores_a_toggle(play: Folder, kind: str) -> None:
    run = play(f"objects: {{thing: {{type: {kind}, at: [2, 1], state: locked}}}}").step("toggle")
    assert (run.status("thing"), run.state["last"]["poked"]) == ("locked", "thing")


def test_1_9_a_one_way_object_never_changes_back(play: Folder) -> None:
    thing = "objects: {{thing: {{type: switch, at: [2, 1], one_way: {}}}}}"
    assert play(thing.format("true")).step("toggle").step("toggle").status("thing") == "pressed"
    assert play(thing.format("false")).step("toggle").step("toggle").status("thing") == "idle"


@pytest.mark.parametrize("action", ["pickup", "drop", "done", None])
def test_1_10_the_other_actions_change_nothing(play: Folder, action: str | None) -> None:
    run = play("objects: {door: {type: door, at: [2, 1]}}")
    before = {key: run.state[key] for key in ("agent", "door")}
    run.step(action)
    assert {key: run.state[key] for key in ("agent", "door")} == before


def test_1_11_push_walking_into_something_pushes_it(play: Folder) -> None:
    run = play("""
        objects: {marble: {type: marble, at: [1, 2]}, generator: {type: generator, at: [2, 1]}}
    """).step("forward")
    assert (run.at("agent"), run.status("generator")) == ([1, 1], "pressed")
    run.step("right").step("forward")
    assert (run.at("agent"), run.facing("marble"), run.status("marble")) == ([1, 1], "down", "rolling")


@pytest.mark.parametrize(("kind", "use"), [("box", "toggle"), ("generator", "forward")])
def test_1_12_held_back_by_another_of_its_group(play: Folder, kind: str, use: str) -> None:
    run = play(f"objects: {{things: {{type: {kind}, at: [[2, 1], [1, 2]], exclusive: true}}}}")
    before = run.state["things"][0]["state"]
    run.step(use).step("right").step(use)
    assert [thing["state"] == before for thing in run.state["things"]] == [False, True]
    assert run.state["last"]["poked"] == ("things[1]" if use == "toggle" else None)


def test_1_13_top_the_last_in_the_file_is_toggled_and_seen(play: Folder) -> None:
    run = play("""
        objects:
          under: {type: door, at: [2, 1], color: red}
          over: {type: door, at: [2, 1], color: blue, overlap: true}
    """)
    assert run.shown(1)[:2] == [DOOR, BLUE]
    run.step("toggle")
    assert (run.status("under"), run.status("over")) == ("closed", "open")


def test_1_14_links_take_effect_before_anything_rolls(play: Folder) -> None:
    text = """
        objects:
          lever: {type: lever, at: [2, 1], opens: gate}
          gate: {type: remote_door, at: [4, 3]}
          marble: {type: marble, at: [3, 3], state: rolling}
    """
    assert play(text).step("toggle").at("marble") == [4, 3], "through the gate that has just been opened"
    assert play(text).step().at("marble") == [3, 3]


def test_1_15_a_status_that_holds_for_a_moment_has_followed(play: Folder) -> None:
    run = play("""
        objects:
          marble: {type: marble, at: [3, 3]}
          gate: {type: door, at: [0, 4], state: open, locked: t == 2 and marble.x - agent.x == 1}
        cast: {agent: {at: [2, 3], facing: right}}
    """)
    assert (run.step("forward").at("marble"), run.status("gate")) == ([4, 3], "open")
    assert (run.step("forward").at("marble"), run.status("gate")) == ([5, 3], "closed"), (
        "locked before it rolled on"
    )


@pytest.mark.parametrize(
    ("more", "to"),
    [
        ("", [3, 1]),
        ("objects: {box: {type: box, at: [3, 1]}}", [2, 1]),
        ("objects: {mat: {type: floor, at: [3, 1]}}", [3, 1]),
        ("room: {size: 7, build: [{lava: 'rect(3, 1, 3, 1)'}]}", [2, 1]),
        ("cast: {bob: {at: [3, 1]}}", [2, 1]),
    ],
)
def test_1_16_who_can_be_pushed_is_moved_and_the_agent_stays(play: Folder, more: str, to: list[int]) -> None:
    ann = "ann: {at: [2, 1], facing: down, pushed_by: anybody}"
    text = more.replace("cast: {", f"cast: {{{ann}, ") if "cast" in more else f"cast: {{{ann}}}\n{more}"
    run = play(text).step("forward")
    assert (run.at("agent"), run.at("ann"), run.facing("ann")) == ([1, 1], to, "down")
    assert play("cast: {ann: {at: [2, 1]}}").step("forward").at("ann") == [2, 1], "nobody can without the key"


# -- 2. what counts and rolls by itself ------------------------------------------------------------


def test_2_1_counts_the_step_in_which_it_became_active(play: Folder) -> None:
    run = play("objects: {lever: {type: lever, at: [2, 1], timer: 3}}")
    assert [run.step().state["lever"]["timer"], run.step("toggle").state["lever"]["timer"]] == [0, 1]
    late = play("""
        objects: {lever: {type: lever, at: [4, 5], timer: 3}}
        frames: {pull: {steps: [{do: toggle}]}}
        cast: {ann: {at: [3, 5], facing: right, frame: pull}}
    """).step()
    assert (late.status("lever"), late.state["lever"]["timer"]) == ("up", 0), "an NPC's turn comes after"
    assert late.step().state["lever"]["timer"] == 1


def test_2_2_expires_when_all_its_steps_are_counted(play: Folder) -> None:
    run = play(
        "objects: {lever: {type: lever, at: [2, 1], timer: 2, opens: gate}, gate: {type: remote_door, at: [5, 0]}}"
    )
    run.step("toggle")
    assert (run.status("lever"), run.status("gate")) == ("up", "open")
    run.step()
    assert (run.status("lever"), run.status("gate")) == ("spent", "closed")
    short = play("objects: {lever: {type: lever, at: [2, 1], timer: 1}}").step("toggle")
    assert (short.status("lever"), short.state["lever"]["timer"]) == ("spent", 0)


def test_2_3_zero_in_any_other_status(play: Folder) -> None:
    run = play("""
        objects: {lever: {type: lever, at: [2, 1], timer: 3}}
        rules: [{when: t == 2, cause: [lever.become(down)]}]
    """).step("toggle")
    assert [run.step().state["lever"]["timer"] for _ in range(2)] == [2, 0]
    assert run.step("toggle").state["lever"]["timer"] == 1
    again = play("""
        objects: {lever: {type: lever, at: [2, 1], timer: 2, state: up}}
        rules: [{when: t in 2..3, cause: [lever.become(up)]}]
    """)
    assert [again.step().state["lever"]["timer"] for _ in range(4)] == [1, 0, 1, 0], (
        "expired, and up once more"
    )
    anew = play("""
        objects: {lever: {type: lever, at: [2, 1], timer: 3, state: up}}
        rules: [{when: t == 2, cause: [lever.reset, lever.become(up)]}]
    """)
    assert [anew.step().state["lever"]["timer"] for _ in range(4)] == [1, 0, 1, 2], "reset"


@pytest.mark.parametrize(
    ("order", "places"), [(("hind", "fore"), ([2, 3], [4, 3])), (("fore", "hind"), ([3, 3], [4, 3]))]
)
def test_2_4_rolls_one_cell_in_the_order_of_the_file(
    play: Folder, order: tuple[str, str], places: tuple[list[int], list[int]]
) -> None:
    x = {"hind": 2, "fore": 3}
    things = ", ".join(f"{name}: {{type: marble, at: [{x[name]}, 3], state: rolling}}" for name in order)
    run = play(f"objects: {{{things}}}").step()
    assert (run.at("hind"), run.at("fore")) == places


def test_2_5_same_step_in_which_the_agent_pushed_it(play: Folder) -> None:
    run = play("objects: {marble: {type: marble, at: [2, 1]}}")
    assert [run.step(action).at("marble") for action in ("forward", None, None)] == [[3, 1], [4, 1], [5, 1]]


@pytest.mark.parametrize(
    "obstacle",
    [
        "objects: {door: {type: door, at: [4, 1]}}",
        "room: {build: [{wall: column(4)}]}",
        "room: {build: [{lava: column(4)}]}",
        "cast: {ann: {at: [4, 1]}}",
        "observe: {npcs: hidden}\n        cast: {ann: {at: [4, 1]}}",
        "cast: {agent: {at: [4, 1]}}",
    ],
)
def test_2_6_free_cells_are_what_it_rolls_on(play: Folder, obstacle: str) -> None:
    thing = "objects: {marble: {type: marble, at: [3, 1], state: rolling}"
    both = obstacle.replace("objects: {", thing + ", ")
    text = both if both != obstacle else f"{thing}}}\n        {obstacle}"
    run = play(f"""
        {text}
    """).step()
    assert (run.at("marble"), run.status("marble")) == ([3, 1], "still")


def test_2_7_stops_where_it_pushes_what_is_ahead(play: Folder) -> None:
    run = play("""
        objects: {marble: {type: marble, at: [3, 3], state: rolling}, generator: {type: generator, at: [4, 3]}}
    """).step()
    assert (run.at("marble"), run.status("marble"), run.status("generator")) == ([3, 3], "still", "pressed")


def test_2_8_bodies_do_not_push_what_only_rolling_things_push(play: Folder) -> None:
    run = play("""
        objects:
          near: {type: generator, at: [2, 1], pushed_by: marble}
          far: {type: generator, at: [4, 3], pushed_by: marble}
          marble: {type: marble, at: [3, 3], state: rolling}
    """).step("forward")
    assert (run.status("near"), run.status("far")) == ("idle", "pressed")


def test_2_9_then_the_world_is_settled(play: Folder) -> None:
    run = play("""
        objects:
          switch: {type: switch, at: [2, 1], unlocks: linked}
          linked: {type: door, at: [4, 0], state: locked}
          computed: {type: door, at: [5, 0], locked: not switch.pressed}
        frames:
          watch:
            let: {a: false, b: false}
            states: {s: {first: [{set: {a: linked.locked, b: computed.locked}}]}}
        cast: {ann: {at: [5, 5], frame: watch}}
    """)
    run.step()
    assert (run.value("ann.a"), run.value("ann.b")) == (True, True)
    run.step("toggle")
    assert (run.value("ann.a"), run.value("ann.b")) == (False, False), "before anybody else has moved"
    rolling = play("""
        objects:
          marble: {type: marble, at: [3, 3], state: rolling}
          generator: {type: generator, at: [4, 3], opens: gate}
          gate: {type: remote_door, at: [4, 0]}
          computed: {type: door, at: [5, 0], locked: generator.pressed}
        frames:
          watch:
            let: {a: false, b: false}
            states: {s: {first: [{set: {a: gate.open, b: computed.locked}}]}}
        cast: {ann: {at: [5, 5], frame: watch}}
    """).step()
    assert (rolling.value("ann.a"), rolling.value("ann.b")) == (True, True), "after it has rolled"


# -- 3. how the world is settled -------------------------------------------------------------------


def test_3_1_a_link_unlocks_what_is_locked(play: Folder) -> None:
    run = play("""
        objects:
          switch: {type: switch, at: [2, 1], unlocks: barred | ajar | chest}
          barred: {type: door, at: [4, 0], state: locked}
          ajar: {type: door, at: [5, 0], state: open}
          chest: {type: box, at: [5, 5], state: locked}
    """)
    assert (run.status("barred"), run.status("chest")) == ("locked", "locked")
    run.step("toggle")
    assert [run.status(name) for name in ("barred", "ajar", "chest")] == ["closed", "open", "shut"]


def test_3_2_what_a_link_unlocks_cannot_be_locked_for_long(play: Folder) -> None:
    run = play("""
        objects:
          switch: {type: switch, at: [1, 0], unlocks: door, pressed: true}
          door: {type: door, at: [5, 0]}
        frames:
          lock: {states: {s: {then: [{cause: [door.lock]}]}}}
          watch: {let: {seen: false}, states: {s: {first: [{set: {seen: door.locked}}]}}}
        cast:
          ann: {at: [5, 5], frame: lock}
          bob: {at: [4, 5], frame: watch}
    """).step()
    assert run.value("bob.seen"), "nothing has been settled between their turns"
    assert run.status("door") == "closed"


def test_3_3_what_a_link_unlocked_stays_so(play: Folder) -> None:
    run = play("""
        objects:
          switch: {type: switch, at: [2, 1], unlocks: door}
          door: {type: door, at: [5, 0], state: locked}
    """)
    run.step("toggle").step("toggle")
    assert (run.status("switch"), run.status("door")) == ("idle", "closed")


def test_3_4_a_switch_that_has_vanished_unlocks_nothing(play: Folder) -> None:
    run = play("""
        objects:
          switch: {type: switch, at: [2, 1], unlocks: door, pressed: true}
          door: {type: door, at: [5, 0]}
        rules:
          - {when: t == 1, cause: [door.lock]}
          - {when: t == 2, cause: [switch.vanish, door.lock]}
    """)
    assert [run.step().status("door") for _ in range(2)] == ["closed", "locked"]


def test_3_5_opens_is_a_level(play: Folder) -> None:
    run = play("""
        objects:
          one: {type: switch, at: [2, 1], opens: gate}
          two: {type: switch, at: [1, 2], opens: gate}
          gate: {type: remote_door, at: [5, 0], state: open}
        rules: [{when: t == 6, cause: [two.vanish]}]
    """)
    assert run.status("gate") == "closed"
    gates = [run.step(action).status("gate") for action in ("toggle", "right", "toggle", "left", "toggle")]
    assert gates == ["open", "open", "open", "open", "open"]
    assert run.status("one") == "idle"
    assert run.step().status("gate") == "closed", "the other has vanished"


def test_3_6_release_of_what_lies_inside(play: Folder) -> None:
    run = play("objects: {box: {type: box, at: [2, 1]}, apple: {type: apple, inside: box}}")
    assert (run.at("apple"), run.state["apple"]["inside"]) == (None, "box")
    run.step("toggle")
    assert (run.at("box"), run.at("apple")) == (None, [2, 1])
    assert run.step("toggle").status("apple") == "eaten"


def test_3_7_empty_things_stay(play: Folder) -> None:
    run = play("""
        objects: {box: {type: box, at: [2, 1]}, other: {type: box, at: [5, 5]}, apple: {type: apple, inside: other}}
    """).step("toggle")
    assert (run.at("box"), run.status("box")) == ([2, 1], "opened")


def test_3_8_exclusive_holds_also_when_the_one_is_gone(play: Folder) -> None:
    run = play(
        """
        objects: {boxes: {type: box, at: [[2, 1], [1, 2]], exclusive: true}, apple: {type: apple, inside: target}}
        let: {target: pick(boxes)}
        """,
        {"let": {"target": "boxes[0]"}},
    ).step("toggle")
    assert run.state["boxes"][0].get("gone")
    run.step("right").step("toggle")
    assert run.state["boxes"][1]["state"] == "shut"


COMPUTED = """
    objects:
      switch: {type: switch, at: [2, 1]}
      door: {type: door, at: [1, 2], state: open, locked: switch.pressed}
"""


def test_3_9_a_computed_status_holds_while_its_condition_does(play: Folder) -> None:
    run = play(COMPUTED)
    assert run.status("door") == "open"
    assert run.step("toggle").status("door") == "locked"


def test_3_10_what_was_locked_becomes_closed(play: Folder) -> None:
    run = play(COMPUTED).step("toggle").step("toggle")
    assert run.status("door") == "closed"
    chest = play("objects: {chest: {type: box, at: [5, 5], locked: agent.x == 1}}")
    assert (chest.status("chest"), chest.step("forward").status("chest")) == ("locked", "shut")


def test_3_11_any_other_status_is_left_alone(play: Folder) -> None:
    run = play(COMPUTED).step("right")
    assert run.facing("agent") == "down"
    assert [run.step("toggle").status("door") for _ in range(3)] == ["closed", "open", "closed"]


def test_3_12_tagged_is_computed_likewise(play: Folder) -> None:
    run = play("objects: {ball: {type: ball, at: [3, 3], tagged: agent.in_line(it)}}")
    assert run.status("ball") == "plain"
    assert [run.step("forward").status("ball") for _ in range(3)] == ["plain", "tagged", "plain"]


def test_3_13_a_computed_status_is_settled_after_those_it_reads(play: Folder) -> None:
    run = play("""
        objects:
          third: {type: door, at: [3, 0], locked: second.locked}
          second: {type: door, at: [4, 0], locked: switch.pressed}
          switch: {type: switch, at: [2, 1]}
        frames: {watch: {let: {seen: false}, states: {s: {first: [{set: {seen: third.locked}}]}}}}
        cast: {ann: {at: [5, 5], frame: watch}}
    """).step("toggle")
    assert run.value("ann.seen"), "in one pass, before anybody else has moved"
    assert (run.status("second"), run.status("third")) == ("locked", "locked")


def test_3_14_computed_statuses_read_what_links_did(play: Folder) -> None:
    run = play("""
        objects:
          computed: {type: door, at: [3, 0], locked: linked.locked}
          linked: {type: door, at: [4, 0], state: locked}
          switch: {type: switch, at: [2, 1], unlocks: linked}
        frames: {watch: {let: {seen: true}, states: {s: {first: [{set: {seen: computed.locked}}]}}}}
        cast: {ann: {at: [5, 5], frame: watch}}
    """)
    assert run.status("computed") == "locked"
    run.step("toggle")
    assert not run.value("ann.seen")
    assert (run.status("linked"), run.status("computed")) == ("closed", "closed")


def test_3_15_a_reset_ends_with_settling(play: Folder) -> None:
    run = play("""
        objects:
          switch: {type: switch, at: [2, 1], unlocks: linked, pressed: true}
          linked: {type: door, at: [4, 0], state: locked}
          computed: {type: door, at: [3, 0], locked: agent.x == 1}
    """)
    assert run.state["t"] == 0
    assert (run.status("linked"), run.status("computed")) == ("closed", "locked")


# -- 4. the agent's voice --------------------------------------------------------------------------

LISTENER = "ear: {let: {heard_at: 0}, states: {s: {then: [{hears: Say hello, set: {heard_at: t}}]}}}"
"""A frame that notes when it last heard a hello."""

EAR = f"frames: {{{LISTENER}}}"


@pytest.mark.parametrize(("at", "hears"), [([3, 1], True), ([1, 2], False)])
def test_4_1_earshot_is_measured_after_the_body_moved(play: Folder, at: list[int], hears: bool) -> None:
    run = play(f"""
        earshot: next_to
        {EAR}
        cast: {{ann: {{at: {at}, frame: ear}}}}
    """).step("forward", "Say hello")
    assert run.at("agent") == [2, 1]
    assert (run.value("ann.heard_at") == 1) is hears


@pytest.mark.parametrize(
    ("earshot", "farthest"), [("next_to", 1), (1, 1), (2, 2), (3, 3), ("room", 4)], ids=str
)
def test_4_2_how_far_a_voice_carries(play: Folder, earshot: object, farthest: int) -> None:
    run = play(f"""
        earshot: {earshot}
        {EAR}
        cast:
          one: {{at: [2, 1], frame: ear}}
          two: {{at: [2, 2], frame: ear}}
          three: {{at: [2, 3], frame: ear}}
          four: {{at: [3, 3], frame: ear}}
    """).step(None, "Say hello")
    heard = [run.value(f"{name}.heard_at") == 1 for name in ("one", "two", "three", "four")]
    assert heard == [distance <= farthest for distance in (1, 2, 3, 4)]


@pytest.mark.parametrize(("earshot", "hears"), [("next_to", False), (1, True), ("room", True)])
def test_4_3_hidden_npcs_hear_the_agent(play: Folder, earshot: object, hears: bool) -> None:
    run = play(f"""
        earshot: {earshot}
        observe: {{npcs: hidden}}
        {EAR}
        cast: {{ann: {{at: [2, 1], frame: ear}}, bob: {{at: [1, 2], frame: ear}}}}
    """).step("forward", "Say hello")
    assert run.at("agent") == run.at("ann")
    assert (run.value("ann.heard_at") == 1) is hears, "on the agent's own cell"


def test_4_4_in_a_suite_what_a_member_lacks_is_silence(play: Folder) -> None:
    play.write("one", "outcome: [{failure: agent.spoke}]")
    play.write(
        "two",
        """
        grammar: {templates: [Ask <noun>], nouns: [why]}
        outcome: [{failure: agent.spoke}]
    """,
    )
    path = play.save("both", "suite: both\nmembers: [one.yaml, two.yaml]\n")
    run = Play(path, {"member": "two"})
    assert not run.step(None, "Say hello").terminated
    assert run.state["last"]["said"] is None
    assert run.step(None, "Ask why").terminated


def test_4_5_the_agent_hears_itself_first_if_at_all(play: Folder) -> None:
    text = """
        observe: {{own_voice: {}}}
        frames: {{talk: {{states: {{s: {{then: [{{say: Hi.}}]}}}}}}}}
        cast: {{ann: {{at: [5, 5], frame: talk}}}}
    """
    heard = play(text.format("true")).step(None, "Say bye").info["utterance"].splitlines()
    assert [line.split(": ")[-1] for line in heard] == ["Say bye", "Hi."]
    assert play(text.format("false")).step(None, "Say bye").info["utterance"] == "Ann: Hi."


def test_4_6_a_scripted_agent_reads_then_before_npcs_move(play: Folder) -> None:
    run = play("""
        frames:
          script: {let: {own: 0, seen: 0}, states: {s: {then: [{after: 1, set: {own: self.x, seen: ann.x}}]}}}
          walk: {states: {s: {do: forward}}}
        cast:
          agent: {frame: script}
          ann: {at: [5, 5], facing: left, frame: walk}
    """).step("forward", "Say hello")
    assert run.state["agent"]["clock"] == 1
    assert run.at("ann") == [4, 5]
    assert (run.value("agent.own"), run.value("agent.seen")) == (2, 5)


# -- 5. the NPCs, one after the other --------------------------------------------------------------

WALK = "frames: {walk: {states: {s: {do: forward}}}}"


def test_4_7_the_choice_for_a_slot_that_is_not_there_changes_nothing(play: Folder) -> None:
    run = play("""
        grammar: {templates: [Take <n>, Eat <what>], slots: {n: 1..3, what: [bread, soup]}}
        cast: {ann: {at: [4, 5], frame: listen}, agent: {at: [3, 5]}}
        frames: {listen: {states: {s: {then: [{hears: Eat <what>, when: agent.n != 3, say: <what>}]}}}}
        outcome: [{failure: agent.n == 3}]
    """)
    for n in range(3):
        assert run.act([run.env.action_space.nvec[0] - 1, 1, 1, n, 1]).info["utterance"] == "Ann: soup"
        assert not run.terminated
    assert run.step(None, "Take 3").terminated
    for noun in (0, 1):
        _nor_does_a_noun(play, noun)


def _nor_does_a_noun(play: Folder, noun: int) -> None:
    """In a sequence and a memory there is one `Hello` as well, so whoever says it repeats it."""
    run = play("""
        grammar: {templates: [Say <noun>, Hello], nouns: [red, blue]}
        let: {dance: {sequence: 4, moves: [left], utterance: {chance: 1}}}
        memory: {attempt: {last: 4}}
        cast: {ann: {at: [4, 5], frame: listen}, agent: {at: [3, 5]}}
        frames:
          listen:
            states:
              s:
                then:
                  - {hears: any, when: noun == red, say: Red}
                  - {hears: any, say: Not <noun>}
                  - {hears: any, say: No noun}
        outcome:
          - success: attempt == dance
          - failure: agent.noun == blue and not agent.said("Say blue")
    """)
    assert run.act([1, 1, 1, noun]).info["utterance"] == "Ann: No noun"
    assert not run.terminated
    assert run.step(None, "Say red").info["utterance"] == "Ann: Red"
    heard = set()
    for seed in range(9):
        run.env.reset(seed=seed)
        for _, said in run.state["let"]["dance"]:
            heard.add(said)
            run.act([0, 1, 1, noun]) if said == "Hello" else run.step("left", said)
        assert run.info["success"] is True
    assert heard == {"Say red", "Say blue", "Hello"}


@pytest.mark.parametrize(("order", "ends"), [(("ann", "bob"), [2, 4]), (("bob", "ann"), [3, 4])])
def test_5_1_npcs_take_turns_in_the_order_of_the_cast(
    play: Folder, order: tuple[str, str], ends: list[int]
) -> None:
    column = {"ann": 2, "bob": 3}
    cast = ", ".join(f"{name}: {{at: [{column[name]}, 5], facing: right, frame: walk}}" for name in order)
    run = play(f"""
        {WALK}
        cast: {{{cast}}}
    """).step()
    assert [run.at("ann")[0], run.at("bob")[0]] == ends, "ann can follow only after bob has left his cell"


def test_5_2_who_has_vanished_takes_no_turn(play: Folder) -> None:
    run = play("""
        frames:
          leave:
            let: {early: 0, late: 0}
            states:
              s:
                first: [{set: {early: t}}]
                then:
                  - {when: t == 2, set: {late: t}, cause: [self.vanish], say: Bye.}
                  - {set: {late: t}, say: Here.}
        cast: {ann: {at: [5, 5], frame: leave}}
    """)
    assert [run.step().info["utterance"] for _ in range(4)] == ["Ann: Here.", "Ann: Bye.", "NA", "NA"]
    assert (run.at("ann"), run.value("ann.early"), run.value("ann.late")) == (None, 2, 2)


NEAR = "beliefs: {column_of: {of: agent.x, when: agent.x < 3}}"
"""Somebody who knows where the agent is as long as it is on the left."""


def test_5_3_believes_come_before_first(play: Folder) -> None:
    run = play(f"""
        frames: {{watch: {{let: {{seen: 0}}, states: {{s: {{first: [{{set: {{seen: self.believes.column_of}}}}]}}}}}}}}
        cast: {{ann: {{at: [5, 5], frame: watch, {NEAR}}}}}
    """)
    assert run.state["ann"]["believes"]["column_of"] == 1, "at first it is true"
    assert [run.step("forward").value("ann.seen") for _ in range(2)] == [2, 2]
    assert run.at("agent") == [3, 1]


def test_5_4_members_without_a_frame_believe_as_well(play: Folder) -> None:
    run = play(f"cast: {{ann: {{at: [5, 5], {NEAR}}}}}")
    seen = [run.step("forward").state["ann"]["believes"]["column_of"] for _ in range(2)]
    assert (seen, run.at("ann")) == ([2, 2], [5, 5])


def test_5_5_first_is_read_before_the_body_moves(play: Folder) -> None:
    run = play("""
        frames:
          walk:
            let: {early: 0, late: 0}
            states: {s: {first: [{set: {early: self.x}}], do: forward, then: [{set: {late: self.x}}]}}
        cast: {ann: {at: [2, 5], facing: right, frame: walk}}
    """).step()
    assert (run.value("ann.early"), run.value("ann.late")) == (2, 3)


@pytest.mark.parametrize("where", ["first", "then"])
def test_5_6_the_first_rule_that_holds_fires_alone(play: Folder, where: str) -> None:
    run = play(f"""
        frames:
          list:
            let: {{a: 0, b: 0, c: 0}}
            states:
              s: {{{where}: [{{when: agent.x == 5, set: {{a: 1}}}}, {{set: {{b: 1}}}}, {{set: {{c: 1}}}}]}}
        cast: {{ann: {{at: [5, 5], frame: list}}}}
    """).step()
    assert [run.value(f"ann.{name}") for name in "abc"] == [0, 1, 0]


def test_5_7_a_rule_with_an_activity_takes_the_whole_turn(play: Folder) -> None:
    run = play("""
        frames:
          turn:
            let: {late: 0}
            states: {s: {first: [{when: t == 1, do: left}], do: forward, then: [{set: {late: t}}]}}
        cast: {ann: {at: [3, 5], facing: right, frame: turn}}
    """).step()
    assert (run.at("ann"), run.facing("ann"), run.value("ann.late")) == ([3, 5], "up", 0)
    run.step()
    assert (run.at("ann"), run.value("ann.late")) == ([3, 4], 2)


def test_5_8_rest_of_a_rule_comes_after_the_body_action(play: Folder) -> None:
    run = play("""
        objects: {door: {type: door, at: [4, 5]}}
        frames:
          go:
            let: {was: 0}
            states:
              s:
                first:
                  - {when: t == 1, do: forward, cause: [door.open]}
                  - {do: forward, set: {was: self.x}, say: From <self.x>., goto: after_it}
              after_it: {}
        cast: {ann: {at: [3, 5], facing: right, frame: go}}
    """).step()
    assert (run.at("ann"), run.status("door")) == ([3, 5], "open"), "the door was closed when it went"
    run.step()
    assert (run.at("ann"), run.value("ann.was"), run.info["utterance"]) == ([4, 5], 3, "Ann: From 3.")
    assert run.status("ann") == "after_it"


def test_5_9_clock_of_the_new_state_is_0(play: Folder) -> None:
    run = play("""
        frames:
          go:
            let: {fired_at: 0}
            states:
              s: {first: [{do: left, goto: other}]}
              other: {then: [{after: 2, once: true, set: {fired_at: t}}]}
        cast: {ann: {at: [3, 5], frame: go}}
    """).step()
    assert run.state["ann"]["clock"] == 0
    assert run.steps(3).value("ann.fired_at") == 3


def test_5_10_a_goto_in_first_is_of_this_turn(play: Folder) -> None:
    run = play("""
        frames:
          change:
            let: {old: 0, new: 0}
            states:
              before: {first: [{goto: after_it}], do: forward, then: [{set: {old: t}}]}
              after_it: {do: left, then: [{set: {new: t}}]}
        cast: {ann: {at: [3, 5], facing: right, frame: change}}
    """).step()
    assert (run.at("ann"), run.facing("ann")) == ([3, 5], "up")
    assert (run.value("ann.old"), run.value("ann.new")) == (0, 1)


def test_5_11_who_vanishes_in_first_does_nothing_more(play: Folder) -> None:
    run = play("""
        objects: {door: {type: door, at: [4, 5]}}
        frames:
          leave:
            let: {late: 0}
            states: {s: {first: [{cause: [self.vanish], say: Bye.}], do: toggle, then: [{set: {late: t}}]}}
        cast: {ann: {at: [3, 5], facing: right, frame: leave}}
    """).step()
    assert (run.at("ann"), run.status("door"), run.value("ann.late")) == (None, "closed", 0)
    assert run.info["utterance"] == "Ann: Bye."


def test_5_12_one_body_action_a_turn(play: Folder) -> None:
    run = play("""
        objects: {switch: {type: switch, at: [5, 3]}}
        frames: {press: {states: {s: {do: use(switch)}}}}
        cast: {ann: {at: [3, 5], facing: left, frame: press}}
    """)
    for _ in range(8):
        before = (*run.at("ann"), run.facing("ann"), run.status("switch"))
        run.step()
        after = (*run.at("ann"), run.facing("ann"), run.status("switch"))
        assert sum(a != b for a, b in zip(before, after, strict=True)) == 1
    assert run.status("switch") == "pressed"


@pytest.mark.parametrize(
    ("obstacle", "cast"),
    [
        ("objects: {door: {type: door, at: [4, 5]}}", ""),
        ("objects: {box: {type: box, at: [4, 5]}}", ""),
        ("room: {build: [{wall: column(4)}]}", ""),
        ("room: {build: [{lava: column(4)}]}", ""),
        ("about: somebody", ", bob: {at: [4, 5]}"),
        ("about: the agent", ", agent: {at: [4, 5]}"),
        ("observe: {npcs: hidden}", ", agent: {at: [4, 5]}"),
    ],
)
def test_5_13_npcs_do_not_enter_what_is_solid_deadly_or_taken(play: Folder, obstacle: str, cast: str) -> None:
    run = play(f"""
        {obstacle}
        {WALK}
        cast: {{ann: {{at: [3, 5], facing: right, frame: walk}}{cast}}}
    """)
    assert run.step().at("ann") == [3, 5]


PUSHER = """
    objects: {marble: {type: marble, at: [4, 5]}}
    frames: {push: {steps: [{do: forward}]}}
    cast: {ann: {at: [3, 5], facing: right, frame: push}}
"""


def test_5_14_push_by_an_npc(play: Folder) -> None:
    run = play(PUSHER).step()
    assert (run.at("ann"), run.status("marble"), run.facing("ann")) == ([3, 5], "rolling", "right")


def test_5_15_next_step_it_rolls(play: Folder) -> None:
    run = play(PUSHER)
    assert [run.step().at("marble") for _ in range(3)] == [[4, 5], [5, 5], [5, 5]]
    assert run.status("marble") == "still"


def test_5_16_the_toggle_of_an_npc_changes_the_object_and_pokes_nobody(play: Folder) -> None:
    run = play("""
        objects: {door: {type: door, at: [4, 5], state: open}}
        frames: {press: {states: {s: {do: toggle}}}}
        cast: {ann: {at: [3, 5], facing: right, frame: press}, bob: {at: [4, 5]}}
        outcome: [{failure: door.poked}]
    """).step()
    assert run.status("door") == "closed"
    assert not run.state["bob"]["poked"]
    assert not run.terminated
    assert run.state["last"]["poked"] is None


def test_5_17_toggled_is_known_until_its_next_turn(play: Folder) -> None:
    run = play(
        """
        objects: {door: {type: door, at: [4, 5]}}
        frames:
          press: {steps: [{do: toggle}]}
          watch:
            let: {by: 0, at_all: 0}
            states:
              s: {first: [{when: door.toggled_by(ann), set: {by: t}}], then: [{when: door.toggled, set: {at_all: t}}]}
        cast:
          bob: {at: [1, 5], frame: watch}
          ann: {at: [3, 5], facing: right, frame: press}
          cal: {at: [2, 5], frame: watch}
    """.replace("at_all: door.toggled", "at_all: count(d in door | door where d.toggled)")
    ).steps(4)
    assert (run.value("cal.by"), run.value("bob.by")) == (1, 2)
    assert (run.value("cal.at_all"), run.value("bob.at_all")) == (1, 2)


def test_5_18_points_until_it_stops(play: Folder) -> None:
    run = play("""
        objects: {door: {type: door, at: [5, 5]}}
        frames: {show: {steps: [{do: point(door)}, {do: left}, {do: forward}, {do: stop_pointing}]}}
        cast: {ann: {at: [3, 5], facing: down, frame: show}}
    """)
    seen = [run.step().state["ann"].get("pointing") for _ in range(4)]
    assert seen == ["right", "right", "right", None]
    assert (run.facing("ann"), run.at("ann")) == ("right", [4, 5])
    run = play("""
        objects: {ball: {type: ball, at: [5, 1]}}
        frames: {show: {steps: [{do: point_at(ball), cause: ball.vanish}, {do: forward}, {do: stop_pointing}]}}
        cast: {ann: {at: [3, 4], facing: down, frame: show}}
    """)
    seen = [run.step().state["ann"].get("pointing") for _ in range(3)]
    assert seen == [[5, 1], [5, 1], None]


def test_5_19_the_world_is_settled_after_the_body_action(play: Folder) -> None:
    run = play("""
        objects:
          switch: {type: switch, at: [4, 5], unlocks: linked}
          linked: {type: door, at: [4, 0], state: locked}
          computed: {type: door, at: [5, 0], locked: not switch.pressed}
        frames:
          press:
            let: {a: true, b: true}
            states: {s: {do: toggle, then: [{set: {a: linked.locked, b: computed.locked}}]}}
        cast: {ann: {at: [3, 5], facing: right, frame: press}}
    """).step()
    assert (run.value("ann.a"), run.value("ann.b")) == (False, False)


CLOCK = """
    frames:
      count:
        let: {{fired_at: 0}}
        states: {{s: {{{where}: [{{after: 1, once: true, set: {{fired_at: t}}}}]}}}}
    cast: {{ann: {{at: [5, 5], frame: count}}}}
"""


def test_5_20_after_1_in_then_holds_in_the_first_turn(play: Folder) -> None:
    run = play(CLOCK.format(where="then"))
    assert run.state["ann"]["clock"] == 0
    run.step()
    assert run.state["ann"]["clock"] == 1
    assert run.value("ann.fired_at") == 1


def test_5_21_after_1_in_first_holds_in_the_second_turn(play: Folder) -> None:
    assert play(CLOCK.format(where="first")).steps(3).value("ann.fired_at") == 2


def test_5_22_a_rule_computes_before_it_acts(play: Folder) -> None:
    run = play("""
        frames:
          swap:
            let: {a: 1, b: 2}
            states: {s: {then: [{say: I have <a>., set: {a: b, b: a}}]}}
        cast: {ann: {at: [5, 5], frame: swap}}
    """).step()
    assert (run.value("ann.a"), run.value("ann.b")) == (2, 1)
    assert run.info["utterance"] == "Ann: I have 1."


@pytest.mark.parametrize(
    ("effects", "status"),
    [
        ("door.open, door.lock", "locked"),
        ("door.lock, door.open", "open"),
        ("door.open, door.unlock", "open"),
        ("door.lock, door.unlock", "closed"),
    ],
)
def test_5_23_effects_happen_in_the_order_listed(play: Folder, effects: str, status: str) -> None:
    run = play(f"""
        objects: {{door: {{type: door, at: [5, 0]}}}}
        frames: {{act: {{states: {{s: {{then: [{{cause: [{effects}]}}]}}}}}}}}
        cast: {{ann: {{at: [5, 5], frame: act}}}}
    """).step()
    assert run.status("door") == status


@pytest.mark.parametrize(
    ("place", "at"),
    [("shut", [3, 5]), ("lava", [3, 5]), ("agent", [3, 5]), ("bob", [3, 5]), ("gate", [4, 4])],
)
def test_5_24_put_somebody_where_nobody_can_stand(play: Folder, place: str, at: list[int]) -> None:
    run = play(f"""
        objects:
          shut: {{type: door, at: [2, 2]}}
          lava: {{type: lava, at: [2, 3]}}
          gate: {{type: door, at: [4, 4], state: open}}
        cast: {{ann: {{at: [3, 5]}}, bob: {{at: [5, 5]}}}}
        rules: [{{when: t == 1, cause: [ann.put({place})]}}]
    """).step()
    assert run.at("ann") == at


def test_5_25_into_something(play: Folder) -> None:
    run = play("""
        objects:
          one: {type: box, at: [4, 4]}
          other: {type: box, at: [5, 4]}
          toy: {type: ball, inside: one}
        rules:
          - {when: t == 1, cause: [one.reveal]}
          - {when: t == 2, cause: [toy.move_into(other)]}
          - {when: t == 3, cause: [other.reveal]}
    """)
    assert [run.step().at("toy") for _ in range(3)] == [[4, 4], None, [5, 4]]
    assert run.state["toy"]["inside"] == "other", "it lay there last"


def test_5_26_reset_of_things_and_people(play: Folder) -> None:
    run = play("""
        objects:
          box: {type: box, at: [2, 1]}
          apple: {type: apple, inside: box}
          marble: {type: marble, at: [1, 2]}
        frames: {walk: {states: {s: {do: choose(forward)}}}}
        cast: {ann: {at: [3, 5], facing: right, frame: walk}}
        rules: [{when: t == 3, cause: [objects.reset, ann.reset]}]
    """)
    before = {key: run.state[key] for key in ("box", "apple", "marble", "ann")}
    run.step("toggle").step("right")
    assert (run.at("apple"), run.at("ann")) == ([2, 1], [5, 5])
    run.step("forward")
    after = {key: run.state[key] for key in ("box", "apple", "marble")}
    assert after == {key: before[key] for key in after}
    assert (run.at("ann"), run.facing("ann")) == (before["ann"]["at"], before["ann"]["facing"])


def test_5_27_what_then_changes_is_settled_later(play: Folder) -> None:
    run = play("""
        objects:
          switch: {type: switch, at: [4, 0], unlocks: door}
          door: {type: door, at: [5, 0], state: locked}
        frames:
          press: {states: {s: {then: [{when: t <= 2, cause: [switch.become(pressed)]}]}}}
          watch:
            let: {early: false, late: true}
            states: {s: {first: [{set: {early: door.locked}}], then: [{set: {late: door.locked}}]}}
        cast: {ann: {at: [5, 5], frame: press}, bob: {at: [4, 5], frame: watch}}
    """).step()
    assert (run.value("bob.early"), run.value("bob.late")) == (True, False)

    alone = play("""
        objects:
          switch: {type: switch, at: [4, 0], unlocks: door}
          door: {type: door, at: [5, 0], state: locked}
        frames: {press: {states: {s: {then: [{cause: [switch.become(pressed)]}]}}}}
        cast: {ann: {at: [5, 5], frame: press}}
    """)
    assert alone.step().status("door") == "closed", "after the rules of the world"

    idle = play("""
        objects:
          switch: {type: switch, at: [4, 0], unlocks: door}
          door: {type: door, at: [5, 0], state: locked}
        state: {was_locked: false}
        frames: {press: {states: {s: {then: [{cause: [switch.become(pressed)]}]}}}}
        cast: {ann: {at: [5, 5], frame: press}, bob: {at: [4, 5]}}
        rules: [{when: door.locked, set: {was_locked: true}}]
    """)
    assert idle.step().state["state"]["was_locked"], "bob makes no body action"


GOING = """
    frames:
      change:
        let: {{fired_at: 0}}
        states:
          before: {{then: [{{{go}: after_it}}]}}
          after_it: {{first: [{{set: {{fired_at: 9}}}}], then: [{{when: fired_at == 0, set: {{fired_at: t}}}}]}}
    cast: {{ann: {{at: [5, 5], frame: change}}}}
"""


def test_5_28_after_goto_the_new_state_begins_with_the_next_turn(play: Folder) -> None:
    run = play(GOING.format(go="goto")).step()
    assert (run.state["ann"]["state"], run.state["ann"]["clock"]) == ("after_it", 0)
    assert run.value("ann.fired_at") == 0
    assert run.step().value("ann.fired_at") == 9, "`first` of the next turn"


def test_5_29_goto_now_reads_the_new_then_at_once(play: Folder) -> None:
    run = play(GOING.format(go="goto_now")).step()
    assert (run.state["ann"]["state"], run.state["ann"]["clock"]) == ("after_it", 0)
    assert run.value("ann.fired_at") == 1


CHOICES = [
    "pick(d in doors where d.locked)",
    "first(d in doors where d.locked)",
    "nearest(d in doors where d.locked to self)",
]
OF_CELLS = [choice.replace("d in doors where d.locked", "c in cells where c.x > 20") for choice in CHOICES]


@pytest.mark.parametrize("choice", [*CHOICES, *OF_CELLS])
def test_5_30_a_condition_is_false_where_nothing_is_found(play: Folder, choice: str) -> None:
    undrawn = choice.replace("pick", "first").replace("self", "agent")
    run = play(f"""
        objects:
          doors: {{type: door, count: 2, at: [[4, 0], [5, 0]]}}
          gate: {{type: door, at: [6, 3], locked: not agent.at({undrawn})}}
        frames:
          look:
            let: {{a: 0, b: 0, c: 0}}
            states:
              s:
                then:
                  - when: at({choice})
                    set: {{a: 1}}
                  - when: not at({choice})
                    set: {{b: 1}}
                  - set: {{c: 1}}
        cast: {{ann: {{at: [5, 5], frame: look}}}}
    """).step()
    assert [run.value(f"ann.{name}") for name in "abc"] == [0, 0, 1]
    assert run.status("gate") == "closed"


@pytest.mark.parametrize("choice", CHOICES)
@pytest.mark.parametrize("effect", ['cause: ["{}.open"]', "say: I see <{}.color>", 'set: {{x0: "{}.x"}}'])
def test_5_31_a_rule_does_not_fire_where_nothing_is_found(play: Folder, choice: str, effect: str) -> None:
    text = """
        objects: {{doors: {{type: door, count: 2, at: [[4, 0], [5, 0]], state: {}}}}}
        frames:
          look:
            let: {{x0: 0, b: 0}}
            states:
              s:
                then:
                  - goto: gone_on
                    {}
                  - set: {{b: 1}}
              gone_on: {{}}
        cast: {{ann: {{at: [5, 5], frame: look}}}}
    """
    run = play(text.format("closed", effect.format(choice))).step()
    assert (run.state["ann"]["state"], run.value("ann.b"), run.info["utterance"]) == ("s", 1, "NA")
    assert [door["state"] for door in run.state["doors"]] == ["closed", "closed"]
    run = play(text.format("locked", effect.format(choice))).step()
    assert (run.state["ann"]["state"], run.value("ann.b")) == ("gone_on", 0)


@pytest.mark.parametrize("choice", [*CHOICES, *OF_CELLS])
def test_5_32_an_activity_is_staying_where_nothing_is_found(play: Folder, choice: str) -> None:
    run = play(f"""
        objects: {{doors: {{type: door, count: 2, at: [[4, 0], [5, 0]]}}}}
        frames:
          look:
            steps:
              - do: go_next_to({choice})
              - {{do: left}}
        cast: {{ann: {{at: [5, 5], facing: right, frame: look}}}}
    """).step()
    assert (run.at("ann"), run.facing("ann")) == ([5, 5], "right")
    assert run.step().facing("ann") == "up"


def test_5_33_once_is_once_in_an_episode(play: Folder) -> None:
    run = play("""
        frames:
          talk:
            states:
              s: {then: [{once: true, say: First., goto: u}, {say: Again.}]}
              u: {then: [{goto: s}]}
        cast: {ann: {at: [5, 5], frame: talk}}
    """)
    assert [run.step().info["utterance"] for _ in range(4)] == [
        "Ann: First.",
        "NA",
        "Ann: Again.",
        "Ann: Again.",
    ]
    run.env.reset(seed=1)
    assert run.step().info["utterance"] == "Ann: First."


def test_5_34_a_step_acts_when_it_ends_after_the_body(play: Folder) -> None:
    run = play("""
        objects: {door: {type: door, at: [5, 0]}}
        frames:
          go:
            let: {ended_at: 0}
            steps: [{do: forward, for: 2, set: {ended_at: self.x}, cause: [door.open], say: There.}]
        cast: {ann: {at: [2, 5], facing: right, frame: go}}
    """)
    run.step()
    assert (run.at("ann"), run.status("door"), run.info["utterance"]) == ([3, 5], "closed", "NA")
    run.step()
    assert (run.at("ann"), run.status("door"), run.info["utterance"]) == ([4, 5], "open", "Ann: There.")
    assert run.value("ann.ended_at") == 4


def test_5_35_the_next_entry_begins_with_the_next_turn(play: Folder) -> None:
    run = play("""
        frames: {go: {steps: [{do: left}, {do: forward}]}}
        cast: {ann: {at: [3, 5], facing: right, frame: go}}
    """).step()
    assert (run.at("ann"), run.facing("ann")) == ([3, 5], "up")
    assert run.step().at("ann") == [3, 4]


def test_5_36_an_entry_without_activity_stays_for_one_turn(play: Folder) -> None:
    run = play("""
        frames: {go: {steps: [{say: Now.}, {do: left}]}}
        cast: {ann: {at: [3, 5], facing: right, frame: go}}
    """).step()
    assert (run.at("ann"), run.facing("ann"), run.info["utterance"]) == ([3, 5], "right", "Ann: Now.")
    assert run.step().facing("ann") == "up"


def test_5_37_what_is_fulfilled_before_it_begins_takes_no_turn(play: Folder) -> None:
    text = """
        objects:
          door: {{type: door, at: [3, 6]}}
          far: {{type: door, at: [3, 0]}}
          gate: {{type: door, at: [3, 5], state: open}}
        frames: {{go: {{steps: [{{do: {goal}{effect}}}, {{do: left}}]}}}}
        cast: {{ann: {{at: [3, 5], facing: right, frame: go}}}}
    """
    for goal in (
        "go_next_to(door)",
        "go_to(self.cell)",
        "enter(gate)",
        "search(door)",
        '"go_away_from(far, 5)"',
    ):
        assert play(text.format(goal=goal, effect="")).step().facing("ann") == "up", goal
        run = play(text.format(goal=goal, effect=", say: There.")).step()
        assert (run.facing("ann") != "up", run.info["utterance"]) == (True, "Ann: There."), goal


def test_5_38_aim_of_an_entry_is_that_of_its_turn(play: Folder) -> None:
    run = play("""
        objects: {doors: {type: door, at: [[4, 5], [3, 6]]}}
        frames: {go: {steps: [{do: use(first(d in doors where d.closed))}, {do: left}]}}
        cast: {ann: {at: [3, 5], facing: right, frame: go}}
    """).steps(2)
    assert [door["state"] for door in run.state["doors"]] == ["open", "closed"]
    assert run.facing("ann") == "up", "the entry was over, though another door was closed"


DANCE = """
    let: {{dance: {{sequence: 3, moves: [left, right, forward], utterance: {{chance: 0.5}}}}}}
    frames: {{dance: {frame}}}
    cast: {{ann: {{at: [3, 5], facing: {facing}, frame: dance}}}}
"""
TURNS = {"let": {"dance": [["left", "Say hello"], ["right", None], ["forward", "Say bye"]]}}


def test_5_39_perform_does_and_says_the_kth_element(play: Folder) -> None:
    run = play(DANCE.format(frame="{steps: [{do: perform(dance)}]}", facing="right"), TURNS)
    seen = [(run.step().at("ann"), run.facing("ann"), run.info["utterance"]) for _ in range(3)]
    assert seen == [
        ([3, 5], "up", "Ann: Say hello"),
        ([3, 5], "right", "NA"),
        ([4, 5], "right", "Ann: Say bye"),
    ]


def test_5_40_a_blocked_move_counts(play: Folder) -> None:
    blocked = {"let": {"dance": [["forward", None], ["forward", "Say bye"], ["left", None]]}}
    run = play(DANCE.format(frame="{steps: [{do: perform(dance)}]}", facing="down"), blocked)
    seen = [(run.step().at("ann"), run.facing("ann"), run.info["utterance"]) for _ in range(3)]
    assert seen == [([3, 5], "down", "NA"), ([3, 5], "down", "Ann: Say bye"), ([3, 5], "right", "NA")]


def test_5_41_after_its_last_element_perform_is_finished(play: Folder) -> None:
    run = play(
        DANCE.format(frame="{steps: [{do: perform(dance)}, {do: left}]}", facing="right"), TURNS
    ).steps(3)
    assert run.step().facing("ann") == "up", "the next entry of `steps`"
    run = play(DANCE.format(frame="{states: {s: {do: perform(dance)}}}", facing="right"), TURNS).steps(3)
    for _ in range(3):
        run.step()
        assert (run.at("ann"), run.facing("ann"), run.info["utterance"]) == ([4, 5], "right", "NA")


@pytest.mark.parametrize(("facing", "heard"), [("left", "Ann: Say hello"), ("right", "NA")])
def test_5_42_a_line_is_heard_where_the_turn_ends(play: Folder, facing: str, heard: str) -> None:
    start = {"left": 3, "right": 2}[facing]
    run = play(f"""
        earshot: next_to
        frames: {{talk: {{states: {{s: {{first: [{{say: Say hello}}], do: forward}}}}}}}}
        cast: {{ann: {{at: [{start}, 1], facing: {facing}, frame: talk}}}}
    """).step()
    assert run.info["utterance"] == heard


def test_5_43_one_utterance_a_turn(play: Folder) -> None:
    run = play("""
        frames: {talk: {states: {s: {first: [{say: Early.}], then: [{say: Late.}]}}}}
        cast: {ann: {at: [5, 5], frame: talk}}
    """).step()
    assert run.info["utterance"] == "Ann: Early."
    frame = "{states: {s: {do: perform(dance), then: [{say: Late.}]}}}"
    run = play(DANCE.format(frame=frame, facing="right"), TURNS)
    assert [run.step().info["utterance"] for _ in range(2)] == ["Ann: Say hello", "Ann: Late."]


TALK = "talk: {states: {s: {then: [{when: t == 1, say: Say hello}]}}}"


def _listening(play: Folder, cast: str) -> Play:
    return play(f"""
        frames:
          {TALK}
          {LISTENER}
        cast: {{{cast}}}
    """)


def test_5_44_an_npc_hears_those_before_it_in_this_step(play: Folder) -> None:
    run = _listening(play, "ann: {at: [5, 5], frame: talk}, bob: {at: [4, 5], frame: ear}").steps(2)
    assert run.value("bob.heard_at") == 1
    run = _listening(play, "bob: {at: [4, 5], frame: ear}").step().step(None, "Say hello")
    assert run.value("bob.heard_at") == 2


def test_5_45_an_npc_hears_those_after_it_a_step_later(play: Folder) -> None:
    run = _listening(play, "bob: {at: [4, 5], frame: ear}, ann: {at: [5, 5], frame: talk}").steps(3)
    assert run.value("bob.heard_at") == 2


def test_5_46_nobody_hears_himself(play: Folder) -> None:
    run = (
        play("""
        frames:
          both:
            let: {heard_at: 0}
            states: {s: {then: [{hears: Say hello, set: {heard_at: t}}, {when: t == 2, say: Say hello}]}}
        cast: {ann: {at: [5, 5], frame: both}, agent: {frame: both}}
    """)
        .step(None, "Say hello")
        .step()
    )
    assert (run.value("ann.heard_at"), run.value("agent.heard_at")) == (1, 0), "the agent said it"
    run.step()
    assert (run.value("ann.heard_at"), run.value("agent.heard_at")) == (1, 3), "Ann said it a step before"


@pytest.mark.parametrize(("order", "first"), [(("hello", "bye"), "hello"), (("bye", "hello"), "bye")])
def test_5_47_the_first_matching_rule_fires(play: Folder, order: tuple[str, str], first: str) -> None:
    rules = ", ".join(f"{{hears: Say {word}, say: It was {word}.}}" for word in order)
    run = play(f"""
        frames:
          {TALK}
          listen: {{states: {{s: {{then: [{rules}]}}}}}}
        cast: {{ann: {{at: [5, 5], frame: talk}}, bob: {{at: [4, 5], frame: listen}}}}
    """).step(None, "Say bye")
    assert run.info["utterance"].splitlines()[-1] == f"Bob: It was {first}."


def test_5_48_speaker_and_noun_are_those_of_the_first_in_the_cast(play: Folder) -> None:
    run = play("""
        frames:
          talk: {states: {s: {then: [{say: Say bye}]}}}
          greet: {states: {s: {then: [{say: Say hello}]}}}
          listen: {states: {s: {then: [{hears: Say <noun>, say: "<speaker.name> said <noun>"}]}}}
        cast:
          bob: {at: [4, 5], frame: talk}
          ann: {at: [5, 5], frame: listen}
          zoe: {at: [3, 5], frame: greet}
    """)
    assert run.step().info["utterance"].splitlines()[1] == "Ann: Bob said bye"
    assert run.step().info["utterance"].splitlines()[1] == "Ann: Bob said bye", "Zoe spoke before him"
    assert run.step(None, "Say hello").info["utterance"].splitlines()[1] == "Ann: Agent said hello"


def test_5_49_any_is_whatever_was_heard(play: Folder) -> None:
    run = play("""
        frames:
          talk: {states: {s: {then: [{when: t == 2, say: Nice weather.}]}}}
          listen: {let: {heard_at: 0}, states: {s: {then: [{hears: any, set: {heard_at: t}}]}}}
        cast: {bob: {at: [4, 5], frame: talk}, ann: {at: [5, 5], frame: listen}}
    """)
    assert [run.step().value("ann.heard_at") for _ in range(3)] == [0, 2, 2]
    assert run.step(None, "Say bye").value("ann.heard_at") == 4


def test_5_50_said_is_known_to_the_end_of_the_step(play: Folder) -> None:
    run = play("""
        earshot: next_to
        frames:
          talk: {states: {s: {then: [{when: t == 2, say: Say hello}]}}}
          watch:
            let: {seen: 0}
            states: {s: {then: [{when: ann.spoke and ann.said("Say hello"), set: {seen: t}}]}}
        cast:
          bob: {at: [1, 5], frame: watch}
          ann: {at: [3, 5], frame: talk}
          cal: {at: [5, 5], frame: watch}
        outcome: [{success: ann.spoke}]
    """).step()
    assert not run.terminated
    assert run.step().terminated
    assert (run.value("bob.seen"), run.value("cal.seen")) == (0, 2)


def test_5_51_what_was_heard_is_forgotten_at_the_end_of_the_turn(play: Folder) -> None:
    run = (
        play("""
        frames:
          listen: {let: {heard_at: 0}, states: {s: {then: [{hears: Say hello, when: t > 1, set: {heard_at: t}}]}}}
        cast: {ann: {at: [5, 5], frame: listen}}
    """)
        .step(None, "Say hello")
        .steps(2)
    )
    assert run.value("ann.heard_at") == 0
    assert run.step(None, "Say hello").value("ann.heard_at") == 4
    assert run.step().value("ann.heard_at") == 4


@pytest.mark.parametrize("text", ["Say hello", "say HELLO", "Say hello.", "Say hello!", "SAY hello?"])
def test_5_52_case_and_the_final_mark_do_not_matter(play: Folder, text: str) -> None:
    run = play(f"""
        frames:
          talk: {{states: {{s: {{then: [{{say: "{text}"}}]}}}}}}
          {LISTENER}
        cast: {{ann: {{at: [5, 5], frame: talk}}, bob: {{at: [4, 5], frame: ear}}}}
    """).step()
    assert run.value("bob.heard_at") == 1


def test_5_53_hidden_npcs_act_but_only_the_audible_are_heard(play: Folder) -> None:
    run = play("""
        observe: {npcs: hidden}
        frames: {talk: {states: {s: {do: forward, then: [{say: Hi.}]}}}}
        cast:
          ann: {at: [2, 5], facing: right, frame: talk}
          bob: {at: [2, 4], facing: right, frame: talk, audible: always}
    """).step()
    assert (run.at("ann"), run.at("bob")) == ([3, 5], [3, 4])
    assert run.info["utterance"] == "Bob: Hi."


def test_5_54_on_one_cell_is_neither_next_to_nor_eye_contact(play: Folder) -> None:
    run = play("""
        observe: {npcs: hidden}
        frames:
          look:
            let: {beside: true, eyes: true}
            states: {s: {then: [{set: {beside: next_to(agent), eyes: eye_contact(agent)}}]}}
        cast: {ann: {at: [2, 1], facing: left, frame: look}}
    """).step()
    assert (run.value("ann.beside"), run.value("ann.eyes")) == (True, True)
    run.step("forward")
    assert run.at("agent") == run.at("ann")
    assert (run.value("ann.beside"), run.value("ann.eyes")) == (False, False)


def test_5_55_no_notice_of_what_has_no_noun(play: Folder) -> None:
    run = play("""
        frames:
          talk: {states: {s: {then: [{say: Good day}]}}}
          ask: {states: {s: {then: [{say: Say bye}]}}}
          listen: {states: {s: {then: [{hears: any, say: "<speaker.name> said <noun>"}]}}}
        cast:
          ann: {at: [3, 5], frame: talk}
          bob: {at: [4, 5], frame: ask}
          cal: {at: [5, 5], frame: listen}
    """)
    assert run.step().info["utterance"].splitlines()[-1] == "Cal: Bob said bye"
    assert run.step(None, "Say hello").info["utterance"].splitlines()[-1] == "Cal: Agent said hello"


def test_5_56_put_to_what_is_not_in_the_room(play: Folder) -> None:
    run = play("""
        objects: {ball: {type: ball, at: [3, 3]}, coin: {type: ball, at: [4, 4]}}
        cast: {ann: {at: [5, 5]}}
        rules:
          - {when: t == 1, cause: [coin.vanish]}
          - {when: t == 2, cause: [ball.put(coin), ann.put(coin)]}
    """).steps(2)
    assert (run.at("ball"), run.at("ann"), run.at("coin")) == ([3, 3], [5, 5], None)


@pytest.mark.parametrize("choice", CHOICES)
def test_5_57_of_a_conditional_value_only_what_is_taken_is_asked_for(play: Folder, choice: str) -> None:
    run = play(f"""
        objects: {{doors: {{type: door, count: 2, at: [[4, 0], [5, 0]]}}}}
        frames:
          look:
            let: {{a: 0, b: 0, c: 0, d: 0, e: 0}}
            states:
              s:
                do: go_next_to({choice} if t == 1 else agent)
                then:
                  - when: t == 1
                    set:
                      a: 2 if agent.x == 1 else {choice}.x
                      b: 3 if not (agent.x == 1 or {choice}.open) else 4
                  - when: 1 == (1 if {choice}.open else 1)
                    set: {{c: 1}}
                  - set:
                      d: 1 if agent.x == 3 else {choice}.x
                  - set: {{e: 1}}
        cast: {{ann: {{at: [5, 1], facing: left, frame: look}}}}
    """).step()
    assert [run.value(f"ann.{name}") for name in "abcde"] == [2, 4, 0, 0, 0]
    assert run.at("ann") == [5, 1], "there is nothing to go to"
    run.step()
    assert [run.value(f"ann.{name}") for name in "abcde"] == [2, 4, 0, 0, 1]
    assert run.at("ann") == [4, 1]


TRUSTING = """
    grammar: {templates: [I am <noun>, Hello], nouns: [good, bad]}
    frames:
      judge:
        let:
          trust: {for: people, start: 1, range: 0..5}
          word: {start: none}
          seen: 0
        states:
          s:
            then:
              %s
              - {hears: I am <noun>, set: {word: noun}}
      talk: {states: {s: {then: [{when: t == 2, say: Hello}]}}}
    cast:
      people: {count: 2, at: [[4, 4], [5, 4]], frame: talk}
      ann: {at: [4, 5], frame: judge}
    earshot: room
"""


def test_5_58_keys_are_computed_with_the_values(play: Folder) -> None:
    rule = "{when: t == 1, set: {seen: 1, trust(first(p in people where p.index == seen)): 3}}"
    run = play(TRUSTING % f"- {rule}").steps(1)
    assert run.value("ann.trust") == {"people[0]": 3, "people[1]": 1}


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        *(("word == good", False), ("word != good", True), ("word == none", True), ("word == word", False)),
        *(("word in good | bad", False), ("not word in good | bad", True), ("word != word", True)),
    ],
)
def test_5_59_nothing_is_unlike_every_value(play: Folder, condition: str, holds: bool) -> None:
    rule = f"- {{when: {condition}, set: {{seen: 1}}}}"
    assert play(TRUSTING % rule).steps(1).value("ann.seen") == holds


def test_5_60_of_a_key_without_a_register_nothing_is_set(play: Folder) -> None:
    run = play(TRUSTING % "- {hears: any, set: {trust(speaker): 4, seen: seen + 1}}")
    run.step(said="I am good")
    assert (run.value("ann.seen"), run.value("ann.trust")) == (0, {"people[0]": 1, "people[1]": 1})
    run.steps(1)
    assert (run.value("ann.seen"), run.value("ann.trust")) == (1, {"people[0]": 4, "people[1]": 1})


LEFT_OUT = """
    frames:
      walk:
        let: {{asked: 0}}
        steps:
          - {{do: left}}
          - {{when: {when}, do: stay, for: 3, state: waiting, set: {{asked: 1}}}}
          - {{do: right, say: Gone on.}}
    objects: {{doors: {{type: door, count: 2, at: [[4, 0], [5, 0]]}}}}
    cast: {{ann: {{at: [5, 5], facing: right, frame: walk}}}}
"""


def test_5_61_when_is_read_at_the_start_of_the_first_turn(play: Folder) -> None:
    run = play(LEFT_OUT.format(when="t == 2")).steps(4)
    assert (run.facing("ann"), run.value("ann.asked")) == ("up", 1), "it lasted though t went on"
    run = play(LEFT_OUT.format(when="t == 1 or t == 3")).steps(2)
    assert (run.facing("ann"), run.info["utterance"]) == ("right", "Ann: Gone on."), "t was 2 in its turn"


@pytest.mark.parametrize("when", ["t == 9", *(f"not {choice}.open" for choice in CHOICES)])
def test_5_62_an_entry_that_is_left_out_takes_no_turn(play: Folder, when: str) -> None:
    run = play(LEFT_OUT.format(when=f'"{when}"')).steps(2)
    assert (run.facing("ann"), run.value("ann.asked"), run.status("ann")) == ("right", 0, "finished")


ROUNDS = """
    frames:
      walk:
        let: {{rounds: 0}}
        steps:
          - {{{keys}, steps: [{{do: turn(left), set: {{rounds: rounds + 1}}}}, {{do: turn(left)}}]}}
          - {{say: Done.}}
    cast: {{ann: {{at: [5, 5], facing: right, frame: walk}}}}
"""


@pytest.mark.parametrize(
    ("keys", "rounds"),
    [
        ("repeat: 3", 3),
        ("when: t == 1, repeat: 3", 3),
        ("when: t == 2, repeat: 3", 0),
        ("when: t == 1", 1),
        ("repeat: 3, while: t <= 3", 2),
        ("repeat: 3, while: t > 1", 0),
        ("repeat: 3, until: t == 1", 3),
        ("repeat: 3, until: t == 3", 1),
        ("repeat: 0", 0),
    ],
)
def test_5_63_conditions_of_rounds(play: Folder, keys: str, rounds: int) -> None:
    run = play(ROUNDS.format(keys=keys)).steps(2 * rounds)
    assert run.info["utterance"] == "NA"
    run.step()
    assert (run.info["utterance"], run.value("ann.rounds")) == ("Ann: Done.", rounds)


def test_5_64_the_next_round_begins_with_the_next_turn(play: Folder) -> None:
    run = play(ROUNDS.format(keys="repeat: 2"))
    seen = []
    for _ in range(4):
        seen.append((run.status("ann"), run.value("ann.rounds[0]")))
        run.step()
    assert seen == [("step0.0", 0), ("step0.1", 0), ("step0.0", 1), ("step0.1", 1)]
    assert (run.status("ann"), run.value("ann.rounds[0]"), run.facing("ann")) == ("step1", 0, "right")


def test_5_65_a_round_of_nothing_takes_no_turn(play: Folder) -> None:
    run = play("""
        frames:
          walk:
            steps:
              - {do: left}
              - repeat: 9
                steps:
                  - {when: t == 9, do: left}
                  - {repeat: 9, while: t == 9, steps: [{do: left}]}
                  - {do: go_to(self)}
              - {do: right, say: Done.}
        cast: {ann: {at: [5, 5], facing: right, frame: walk}}
    """).steps(2)
    assert (run.info["utterance"], run.facing("ann")) == ("Ann: Done.", "right")


def test_5_66_what_is_next_is_the_state_even_if_it_is_left_out(play: Folder) -> None:
    run = play(LEFT_OUT.format(when="false")).step()
    assert run.status("ann") == "waiting"
    assert run.step().status("ann") == "finished"
    text = """
        frames:
          walk:
            steps:
              - {do: left, until: t == 2}
              - {when: false, do: left}
              - {when: is(third) and turns_in_state == 0, do: right, for: 2, state: third}
              - {do: left, say: Done.}
        cast: {ann: {at: [5, 5], facing: right, frame: walk}}
    """
    assert play(text).steps(3).facing("ann") == "up", "it was in its third entry when that was asked"


def test_5_67_a_rule_that_uses_slots_notices_what_has_all_of_them(play: Folder) -> None:
    run = play("""
        grammar: {templates: [Give <what> to <whom>, Eat <what>], slots: {what: [bread, soup], whom: [ann, bob]}}
        frames:
          eat: {states: {s: {then: [{say: Eat soup}]}}}
          give: {states: {s: {then: [{say: Give bread to Ann}]}}}
          listen: {states: {s: {then: [{hears: any, say: "<speaker.name> said <what> to <whom>"}]}}}
        cast:
          ann: {at: [3, 5], frame: eat}
          bob: {at: [4, 5], frame: give}
          cal: {at: [5, 5], frame: listen}
    """)
    assert run.step().info["utterance"].splitlines()[-1] == "Cal: Bob said bread to Ann"
    assert run.step(None, "Eat bread").info["utterance"].splitlines()[-1] == "Cal: Bob said bread to Ann"
    assert (
        run.step(None, "Give soup to Bob").info["utterance"].splitlines()[-1] == "Cal: Agent said soup to Bob"
    )


TOLD = """
    grammar: {templates: [It is <noun>, Hello], nouns: [red, blue]}
    objects: {ball: {type: ball, at: [3, 3], color: red}}
    cast:
      ann: {at: [4, 5]}
      bob:
        at: [5, 5]
        beliefs:
          hue:
            start: none
            from:
              - {hears: Hello, of: blue}
              - {hears: It is <noun>, when: speaker == agent, of: first(c in colors where c == noun)}
              - {when: t == 4, of: ball.color}
            forget: 2
    earshot: room
"""


def test_5_68_the_first_source_that_holds_counts(play: Folder) -> None:
    run = play(TOLD)
    believed = [
        run.step(said=said).state["bob"]["believes"]["hue"] for said in (None, "It is red", "Hello", None)
    ]
    assert believed == ["none", "red", "blue", "red"]


def test_5_69_without_a_source_a_belief_is_forgotten(play: Folder) -> None:
    run = play(TOLD).step(said="Hello")
    assert [run.step().state["bob"]["believes"]["hue"] for _ in range(2)] == ["blue", "none"]


THOSE = """
    objects:
      doors: {{type: door, count: 2, at: [[0, 2], [0, 4]]}}
      balls: {{type: ball, count: 3, color: [red, blue, red]}}
    state: {{seen: {{for: balls, start: 0, range: 0..9}}, last: 9}}
    cast: {{ann: {{at: [5, 5]}}}}
    rules: [{{when: t == 1, {does}}}]
"""


def test_5_70_those_are_the_ones_for_which_the_condition_held_before_any_effect(play: Folder) -> None:
    run = play(
        THOSE.format(
            does="set: {last: 0}, cause: [doors.open, those(d in doors where d.closed).lock, "
            "those(b in balls where b.color == red and last == 9).vanish]"
        )
    ).step()
    assert [door["state"] for door in run.state["doors"]] == ["locked", "locked"]
    assert [ball.get("gone", False) for ball in run.state["balls"]] == [True, False, True]


def test_5_71_of_whom_nothing_is_found_is_not_one_of_those(play: Folder) -> None:
    found = "nearest(d in doors where d.index == b.index to b).closed"
    run = play(
        THOSE.format(does=f"set: {{last: 5}}, cause: ['those(b in balls where {found}).vanish']")
    ).step()
    assert [ball.get("gone", False) for ball in run.state["balls"]] == [True, True, False]
    run = play(
        THOSE.format(does="set: {last: 5}, cause: ['those(b in balls where b.x > t + 9).vanish']")
    ).step()
    assert run.state["state"]["last"] == 5


def test_5_72_a_value_about_each_of_those_is_computed_for_each_of_them_alone(play: Folder) -> None:
    run = play(
        THOSE.format(
            does="cause: ['those(b in balls where b.index < 2).put(first(d in doors where d.index == b.index))'], "
            "set: {'seen(those(b in balls where b.color == red))': seen(b) + b.index + 1}"
        )
    ).step()
    assert [ball["at"] for ball in run.state["balls"]][:2] == [[0, 2], [0, 4]]
    assert run.state["state"]["seen"] == {"balls[0]": 1, "balls[1]": 0, "balls[2]": 3}


TO_ONE = """
    overheard: {overheard}
    grammar:
      templates: ["<whom>, come", Hello]
      slots: {{whom: [ann, bob]}}
      to: <whom>
    frames:
      listen:
        let: {{mine: 0, others: 0}}
        states:
          s:
            then:
              - {{hears: any, addressed: true, set: {{mine: "min(mine + 1, 9)"}}, say: Yes, to: agent}}
              - {{hears: any, addressed: false, set: {{others: "min(others + 1, 9)"}}}}
      tell: {{states: {{s: {{then: [{{when: t == 2, say: Psst, to: bob}}]}}}}}}
    cast:
      cal: {{at: [3, 5], frame: tell}}
      ann: {{at: [4, 5], frame: listen}}
      bob: {{at: [5, 5], frame: listen}}
"""


def _noticed(run: Play) -> list[int]:
    return [run.value(f"{name}.{which}") for name in ("ann", "bob") for which in ("mine", "others")]


def test_5_73_addressed_is_what_is_said_to_the_member(play: Folder) -> None:
    run = play(TO_ONE.format(overheard="true"))
    assert run.step(None, "Ann, come").info["utterance"] == "Ann to Agent: Yes"
    assert _noticed(run) == [1, 0, 0, 1]
    assert run.step().info["utterance"].splitlines() == ["Cal to Bob: Psst", "Bob to Agent: Yes"]
    assert _noticed(run) == [1, 1, 1, 1]
    run.step(None, "Hello")
    assert [run.value("ann.mine"), run.value("bob.mine")] == [1, 1]


def test_5_74_what_is_said_to_one_nobody_else_hears_unless_it_is_overheard(play: Folder) -> None:
    run = play(TO_ONE.format(overheard="false")).step(None, "Ann, come")
    assert _noticed(run) == [1, 0, 0, 0]
    assert run.step().info["utterance"] == "Bob to Agent: Yes"
    assert _noticed(run) == [1, 0, 1, 0]
    assert _noticed(run.step(None, "Hello")) == [1, 1, 1, 1]


def test_5_75_what_is_said_to_a_member_that_is_not_found_is_not_said(play: Folder) -> None:
    run = play("""
        frames:
          tell:
            states:
              s:
                then:
                  - {say: You, to: first(c in cast where c.x > 2 and c != self)}
                  - {say: Nobody}
        cast: {ann: {at: [5, 5], frame: tell}}
    """)
    assert run.step().info["utterance"] == "Ann: Nobody"


def test_5_76_an_npc_pushes_who_can_be_pushed(play: Folder) -> None:
    run = play("""
        frames: {walk: {steps: [{do: forward, for: 2}]}}
        cast:
          agent: {at: [3, 3], pushed_by: anybody}
          ann: {at: [2, 5], facing: right, frame: walk}
          bob: {at: [3, 5], facing: left, pushed_by: anybody}
          cleo: {at: [3, 4], facing: up, frame: walk}
    """).step()
    assert (run.at("ann"), run.at("bob"), run.facing("bob")) == ([2, 5], [4, 5], "left")
    assert (run.at("cleo"), run.at("agent")) == ([3, 4], [3, 2])
    run.step()
    assert (run.at("ann"), run.at("bob")) == ([3, 5], [4, 5])


# -- 6. memories -----------------------------------------------------------------------------------


def test_6_1_a_memory_takes_in_what_was_done_and_said(play: Folder) -> None:
    run = (
        play("memory: {acts: {last: 3, of: agent.acts}}")
        .step("forward", "Say hello")
        .step(None, "Say bye")
        .step()
    )
    assert run.state["memory"]["acts"] == [["forward", "Say hello"], ["none", "Say bye"], ["none", None]]


def test_6_2_a_closed_memory_keeps_what_it_holds(play: Folder) -> None:
    run = play("memory: {acts: {last: 3, of: agent.acts, while: t != 1}}")
    run.step("left").step("forward").step("right")
    assert run.state["memory"]["acts"] == [["left", None], ["right", None]]


def test_6_3_a_full_memory_forgets_the_oldest_act(play: Folder) -> None:
    run = play("memory: {acts: {last: 2, of: agent.acts}}").step("left").step("forward").step("right")
    assert run.state["memory"]["acts"] == [["forward", None], ["right", None]]


def test_6_4_a_memory_that_is_not_full_equals_nothing(play: Folder) -> None:
    text = """
        let: {dance: {sequence: 2, moves: [left, right]}}
        memory: {attempt: {last: 2, of: agent.acts}}
        outcome: [{success: attempt == dance}]
    """
    run = play(text, {"let": {"dance": [["left", None], ["left", None]]}})
    assert [run.step("left").terminated for _ in range(2)] == [False, True]
    run = play(text, {"let": {"dance": [["left", None], ["right", None]]}})
    assert [run.step(way).terminated for way in ("right", "left", "right")] == [False, False, True]
    run = play(text, {"let": {"dance": [["left", None], ["right", None]]}})
    assert not run.step("left").step("right", "Say bye").terminated, "words count as well"


# -- 7. rules of the world -------------------------------------------------------------------------


def test_7_1_rules_are_read_after_turns_and_memories(play: Folder) -> None:
    run = play("""
        let: {dance: {sequence: 1, moves: [left]}}
        memory: {attempt: {last: 1, of: agent.acts}}
        objects: {one: {type: door, at: [4, 0]}, two: {type: door, at: [5, 0]}}
        frames: {walk: {states: {s: {do: forward}}}}
        cast: {ann: {at: [2, 5], facing: right, frame: walk}}
        rules:
          - {when: ann.x == 3, cause: [one.open]}
          - {when: attempt == dance, cause: [two.open]}
    """).step("left")
    assert (run.status("one"), run.status("two")) == ("open", "open")


def test_7_2_every_rule_that_holds_takes_effect_in_order(play: Folder) -> None:
    run = play("""
        objects: {a: {type: door, at: [4, 0]}, b: {type: door, at: [5, 0]}}
        rules:
          - {when: b.locked, cause: [a.lock]}
          - {when: t == 1, cause: [b.open]}
          - {when: b.open, cause: [b.lock]}
    """).step()
    assert (run.status("a"), run.status("b")) == ("closed", "locked")
    assert run.step().status("a") == "locked"


def test_7_3_set_is_read_by_later_rules_and_then_by_all(play: Folder) -> None:
    run = play("""
        state: {level: 0}
        frames: {watch: {let: {seen: 9}, states: {s: {then: [{set: {seen: level}}]}}}}
        cast: {ann: {at: [5, 5], frame: watch}}
        rules: [{when: level == 0, set: {level: 1}}, {when: level == 1, set: {level: 2}}]
    """).step()
    assert (run.state["state"]["level"], run.value("ann.seen")) == (2, 0)
    assert run.step().value("ann.seen") == 2


def test_7_4_once_is_once_in_an_episode(play: Folder) -> None:
    run = play("""
        objects: {door: {type: door, at: [1, 0]}}
        cast: {agent: {facing: up}}
        rules: [{once: true, cause: [door.open]}]
    """)
    assert run.step().status("door") == "open"
    assert run.step("toggle").status("door") == "closed"
    run.env.reset(seed=0)
    assert run.step().status("door") == "open"


def test_7_5_the_world_is_settled_after_its_rules(play: Folder) -> None:
    run = play("""
        objects:
          switch: {type: switch, at: [3, 0], unlocks: linked}
          linked: {type: door, at: [4, 0], state: locked}
          computed: {type: door, at: [5, 0], locked: switch.pressed}
        rules: [{when: t == 2, cause: [switch.become(pressed)]}]
    """).step()
    assert (run.status("linked"), run.status("computed")) == ("locked", "closed")
    run.step()
    assert (run.status("linked"), run.status("computed")) == ("closed", "locked")


# -- 8. the end ------------------------------------------------------------------------------------


def test_8_1_a_deadly_cell_comes_before_every_outcome(play: Folder) -> None:
    run = play("""
        room: {build: [{lava: column(2)}]}
        outcome: [{success: agent.did(forward)}]
    """).step("forward")
    assert (run.terminated, run.truncated, run.reward) == (True, False, 0.0)
    assert (run.info["success"], run.info["outcome"]) == (False, "deadly")


@pytest.mark.parametrize(
    ("order", "success"), [(("success", "failure"), True), (("failure", "success"), False)]
)
def test_8_2_the_first_entry_that_holds_ends_the_episode(
    play: Folder, order: tuple[str, str], success: bool
) -> None:
    entries = ", ".join(f"{{{kind}: agent.x == 3}}" for kind in order)
    run = play(f"outcome: [{{failure: agent.x == 5}}, {entries}]").step("forward")
    assert (run.terminated, run.truncated) == (False, False)
    run.step("forward")
    assert (run.terminated, run.truncated, run.info["success"]) == (True, False, success)


def test_8_3_outcomes_speak_of_the_state_in_the_end(play: Folder) -> None:
    run = play("""
        objects: {door: {type: door, at: [5, 0]}, other: {type: door, at: [4, 0], locked: door.open}}
        frames: {walk: {states: {s: {do: forward}}}}
        cast: {ann: {at: [2, 5], facing: right, frame: walk}}
        rules: [{when: ann.x == 3, cause: [door.open]}]
        outcome: [{success: ann.x == 3 and door.open and other.locked}]
    """).step()
    assert run.terminated


@pytest.mark.parametrize(
    ("reward", "share"), [("", 1.0), (", reward: 100", 1.0), (", reward: 40", 0.4), (", reward: 0", 0.0)]
)
def test_8_4_what_a_success_pays(play: Folder, reward: str, share: float) -> None:
    run = play(f"outcome: [{{success: agent.did(done){reward}}}]").steps(2).step("done")
    assert run.info["success"]
    assert run.reward == pytest.approx(share * (1 - 0.9 * 3 / 20))


def test_8_5_slope_of_the_reward(play: Folder) -> None:
    run = play("""
        reward: {success: linear(0.5)}
        outcome: [{success: agent.did(done), reward: 80}]
    """).steps(2)
    assert run.step("done").reward == pytest.approx(0.8 * (1 - 0.5 * 3 / 20))


@pytest.mark.parametrize(
    ("reward", "share"), [("20 * agent.x", 0.2), ("101 * agent.x", 1.0), ("agent.x - 9", 0.0)]
)
def test_8_6_graded_rewards_are_computed_in_the_end(play: Folder, reward: str, share: float) -> None:
    run = play(f"outcome: [{{success: agent.did(done), reward: {reward}}}]").step("done")
    assert run.reward == pytest.approx(share * (1 - 0.9 / 20))


def test_8_7_a_failure_and_an_ordinary_step_pay_nothing(play: Folder) -> None:
    run = play("about: done is a failure").step("forward")
    assert (run.reward, run.terminated) == (0.0, False)
    run.step("done")
    assert (run.reward, run.terminated, run.info["success"]) == (0.0, True, False)


def test_8_8_bonus_and_each_step_are_added(play: Folder) -> None:
    run = play("""
        reward: {each_step: -0.01}
        rules: [{when: t >= 2, reward: 20}, {when: t == 2, reward: -5}]
        outcome: [{success: agent.did(done)}, {failure: agent.did(left)}]
    """)
    assert [run.step().reward for _ in range(2)] == pytest.approx([-0.01, -0.01 + 0.15])
    assert run.step("done").reward == pytest.approx(-0.01 + 0.2 + 1 - 0.9 * 3 / 20)
    run.env.reset(seed=0)
    assert run.steps(2).step("left").reward == pytest.approx(-0.01 + 0.2)


def test_8_9_the_name_of_an_outcome(play: Folder) -> None:
    text = """\
        outcome:
          - {success: agent.did(left), id: turned}
          - failure: agent.did(right)
          - success: agent.did(forward)
    """
    names = [play(text).step(action).info["outcome"] for action in ("left", "right", "forward")]
    assert names == ["turned", "failure@5", "success@6"]


def test_8_10_when_time_is_up(play: Folder) -> None:
    run = play("horizon: 3").steps(2)
    assert (run.terminated, run.truncated) == (False, False)
    run.step()
    assert (run.terminated, run.truncated, run.reward) == (False, True, 0.0)
    assert (run.info["outcome"], run.info["success"]) == ("timeout", False)


def test_8_11_an_outcome_in_the_last_step_is_terminated_only(play: Folder) -> None:
    run = (
        play("""
        horizon: 3
        outcome: [{success: agent.did(done)}]
    """)
        .steps(2)
        .step("done")
    )
    assert (run.terminated, run.truncated) == (True, False)
    assert run.reward == pytest.approx(0.1)


# -- 9. what the agent perceives -------------------------------------------------------------------


def test_9_1_the_picture_is_taken_last(play: Folder) -> None:
    run = play("""
        objects: {door: {type: door, at: [3, 2]}}
        frames: {walk: {states: {s: {do: forward}}}}
        cast: {ann: {at: [5, 1], facing: left, frame: walk}}
        rules: [{cause: [door.open]}]
    """)
    assert (run.shown(4)[0], run.shown(3)[0]) == (NPC, EMPTY)
    assert (run.shown(2, 1)[0], run.shown(2, 1)[2]) == (DOOR, 1)
    run.step()
    assert (run.shown(4)[0], run.shown(3)[0]) == (EMPTY, NPC)
    assert (run.shown(2, 1)[0], run.shown(2, 1)[2]) == (DOOR, 0)


def test_9_2_the_picture_before_npcs_has_links_but_not_computed_statuses(play: Folder) -> None:
    run = play("""
        observe: {image: before_npcs}
        objects:
          switch: {type: switch, at: [2, 1], unlocks: linked}
          linked: {type: door, at: [3, 2], state: locked}
          computed: {type: door, at: [4, 2], locked: switch.pressed}
          ruled: {type: door, at: [5, 2]}
          marble: {type: marble, at: [3, 3], state: rolling}
        frames: {walk: {let: {seen: false}, states: {s: {first: [{set: {seen: computed.locked}}], do: forward}}}}
        cast: {ann: {at: [5, 1], facing: left, frame: walk}}
        rules: [{cause: [ruled.open]}]
    """).step("toggle")
    assert run.value("ann.seen"), "settled before anybody else has moved"
    assert [run.shown(ahead, 1)[:3:2] for ahead in (2, 3, 4)] == [[DOOR, 1], [DOOR, 1], [DOOR, 1]]
    assert [run.status(name) for name in ("linked", "computed", "ruled")] == ["closed", "locked", "open"]
    assert (run.at("marble"), run.shown(2, 2)[0], run.shown(3, 2)[0]) == ([4, 3], MARBLE, EMPTY)
    assert (run.shown(1)[0], run.shown(1)[2]) == (12, 1), "the switch that the agent has just pressed"
    assert (run.shown(4)[0], run.shown(3)[0]) == (NPC, EMPTY), "Ann as she stood before her turn"
    run.step("left").step("right")
    assert [run.shown(ahead, 1)[2] for ahead in (2, 3, 4)] == [1, 2, 0], "seen in the next step"


@pytest.mark.parametrize("image", ["end", "before_npcs"])
def test_9_3_what_was_said_is_in_the_words_of_this_step(play: Folder, image: str) -> None:
    run = play(f"""
        observe: {{image: {image}}}
        frames: {{talk: {{states: {{s: {{then: [{{say: Say hello}}]}}}}}}}}
        cast: {{ann: {{at: [5, 5], frame: talk}}}}
    """).step()
    words = run.env.unwrapped.program.vocabulary  # type: ignore[attr-defined]
    assert [words[token] for token in run.observation["tokens"] if token] == ["ann", "say", "hello"]
    assert run.info["utterance"] == "Ann: Say hello"


def test_9_4_a_line_for_each_thing_heard(play: Folder) -> None:
    run = play("""
        frames: {talk: {states: {s: {then: [{when: t == 1, say: I am <self.name>.}]}}}}
        cast: {bob: {at: [4, 5], frame: talk}, ann: {at: [5, 5], frame: talk}}
    """)
    assert run.info["utterance"] == "NA"
    assert run.step().info["utterance"] == "Bob: I am Bob.\nAnn: I am Ann."
    assert run.step().info["utterance"] == "NA"


def test_9_5_the_history_has_all_lines(play: Folder) -> None:
    run = play("""
        frames: {talk: {states: {s: {then: [{when: t != 2, say: I am <self.name>.}]}}}}
        cast: {ann: {at: [5, 5], frame: talk}}
    """)
    assert run.info["history"] == ""
    assert run.steps(3).info["history"] == "Ann: I am Ann.\nAnn: I am Ann."


def test_9_8_marked_lines(play: Folder) -> None:
    text = """
        observe: {{lines: {}, names: {}, own_voice: true}}
        frames: {{talk: {{states: {{s: {{then: [{{say: Ann says hello}}]}}}}}}}}
        cast: {{ann: {{at: [5, 5], frame: talk}}}}
    """
    for names, marks in (("shown", ["<Agent>", "<Ann>"]), ("hidden", ["<line>", "<line>"])):
        run = play(text.format("marked", names)).step(None, "Say bye")
        words = run.env.unwrapped.program.vocabulary  # type: ignore[attr-defined]
        heard = [words[token] for token in run.observation["tokens"] if token]
        assert heard == [marks[0], "say", "bye", marks[1], "ann", "says", "hello"]
        plain = play(text.format("plain", names)).step(None, "Say bye")
        assert run.info["utterance"] == plain.info["utterance"]
        assert not {*marks} & {*plain.env.unwrapped.program.vocabulary}  # type: ignore[attr-defined]


def test_9_6_lines_without_names(play: Folder) -> None:
    run = play("""
        observe: {names: hidden}
        frames: {talk: {states: {s: {then: [{say: Say hello}]}}}}
        cast: {ann: {at: [5, 5], frame: talk}}
    """).step()
    assert run.info["utterance"] == "Say hello"


def test_9_7_hidden_npcs_are_not_in_the_picture(play: Folder) -> None:
    text = """
        observe: {{npcs: {}}}
        objects: {{door: {{type: door, at: [2, 1], state: open}}}}
        cast: {{ann: {{at: [2, 1]}}, bob: {{at: [3, 1]}}}}
    """
    run = play(text.format("shown")).step()
    assert [run.shown(1)[0], run.shown(2)[0]] == [NPC, NPC]
    run = play(text.format("hidden")).step()
    assert [run.shown(1)[0], run.shown(2)[0]] == [DOOR, EMPTY]


# -- 10. what probes are about ---------------------------------------------------------------------


PROBED = """\
state: {rounds: {start: 0, range: 0..9}}
rules: [{when: t > 0, set: {rounds: rounds + 1}}]
outcome: [{failure: agent.did(done), id: given_up}]
probes:
"""


def _asked(play: Folder, probe: str, *bodies: str) -> list[list[tuple[str, str]]]:
    """Probe and right answer of what is asked after the reset and after each step."""
    env = play(PROBED + "\n".join(f"  {line}" for line in probe.splitlines())).env
    observation, _ = env.reset(seed=0)
    asker = Asker(sd.load(play.path / "tiny.yaml"))
    found = [asker.reset(0, None, observation["image"])]
    for body in bodies:
        action = env.encode_action((None if body == "stay" else body, None))
        observation, _, terminated, truncated, _ = env.step(action)
        found.append(asker.step([action], observation["image"], terminated or truncated))
    return [[(question.probe, question.right) for question in now] for now in found]


def test_10_1_state_after_the_step(play: Folder) -> None:
    probe = "first: {when: t == 0, ask: How many, answer: rounds}\nthen: {when: t == 2, ask: How many, answer: rounds}"
    assert _asked(play, probe, "stay", "stay") == [[("first", "0")], [], [("then", "2")]]


def test_10_2_acts_of_that_step(play: Folder) -> None:
    probe = (
        "turned: {when: agent.did(left) and prev(agent.facing) == right, ask: Where, answer: agent.facing}"
    )
    assert _asked(play, probe, "stay", "left", "left") == [[], [], [("turned", "up")], []]


def test_10_3_once_at_the_first_moment(play: Folder) -> None:
    probe = "late: {when: rounds >= 1, ask: How many, answer: rounds}"
    assert _asked(play, probe, "stay", "stay", "stay") == [[], [("late", "1")], [], []]


def test_10_4_without_when_at_the_end(play: Folder) -> None:
    probe = "last: {ask: How many, answer: rounds}"
    assert _asked(play, probe, "stay", "done") == [[], [], [("last", "2")]]
    assert _asked(play, probe, *["stay"] * 20)[-2:] == [[], [("last", "9")]]


def test_10_5_the_last_step_is_a_moment(play: Folder) -> None:
    probe = "given_up: {when: agent.did(done), ask: How many, answer: rounds}"
    assert _asked(play, probe, "stay", "done") == [[], [], [("given_up", "2")]]


def test_10_6_before_the_first_step(play: Folder) -> None:
    probe = "start: {when: prev(agent.facing) == right, ask: Where, answer: prev(agent.facing)}"
    assert _asked(play, probe, "left") == [[("start", "right")], []]


def test_10_7_asking_changes_nothing(play: Folder) -> None:
    probe = "  first: {when: t == 0, ask: How many, answer: rounds}\n"
    plain, probed = play(PROBED.removesuffix("probes:\n")).env, play(PROBED + probe).env
    assert plain.program.sha256 == probed.program.sha256


# -- hands -----------------------------------------------------------------------------------------


def _with_toy(more: str = "", **keys: str) -> str:
    """A toy ahead of the agent, more objects, and other keys of the scenario."""
    toy = "toy: {type: ball, color: red, carryable: true, at: [2, 1]}"
    text = f"objects: {{{', '.join([toy, more] if more else [toy])}}}"
    return "\n".join([text, *(f"{key}: {value}" for key, value in keys.items())])


def _carries(run: Play, who: str = "agent") -> str | None:
    found: str | None = run.state[who].get("carries")
    return found


def test_11_1_pickup_takes_the_last_that_can_be_carried(play: Folder) -> None:
    run = play("""
        objects:
          under: {type: ball, at: [2, 1], carryable: true}
          over: {type: ball, at: [2, 1], carryable: true, overlap: true}
          fixed: {type: floor, at: [2, 1], overlap: true}
    """).step("pickup")
    assert (_carries(run), run.at("over"), run.at("under")) == ("over", None, [2, 1])
    assert _carries(play("objects: {ball: {type: ball, at: [2, 1]}}").step("pickup")) is None


@pytest.mark.parametrize("npcs", ["shown", "hidden"])
def test_11_2_nothing_from_where_somebody_is_nor_what_is_held_back(play: Folder, npcs: str) -> None:
    for at, taken in (("[5, 5]", "mat"), ("[2, 1]", None)):
        run = play(f"""
            objects: {{mat: {{type: floor, at: [2, 1], carryable: true}}}}
            cast: {{ann: {{at: {at}}}}}
            observe: {{npcs: {npcs}}}
        """)
        assert _carries(run.step("pickup")) == taken
    run = play("objects: {boxes: {type: box, at: [[2, 1], [1, 2]], carryable: true, exclusive: true}}")
    assert _carries(run.step("toggle").step("right").step("pickup")) is None
    assert _carries(run.step("left").step("pickup")) == "boxes[0]"


def test_11_3_one_thing_at_a_time(play: Folder) -> None:
    run = play("objects: {toys: {type: ball, at: [[2, 1], [1, 2]], carryable: true}}")
    run.step("pickup").step("right").step("pickup")
    assert (_carries(run), run.state["toys"][1]["at"]) == ("toys[0]", [1, 2])


def test_11_4_it_is_out_of_the_room_and_goes_along(play: Folder) -> None:
    run = play(_with_toy(outcome="[{failure: agent.carries(toy) and not toy.gone}]")).step("pickup")
    assert run.at("toy") is None
    run.step("forward").step("forward").step("right").step("drop")
    assert (run.at("agent"), run.at("toy"), run.terminated) == ([3, 1], [3, 2], False)


@pytest.mark.parametrize(
    ("ahead", "lies"), [("wall", False), ("lava", False), ("box", False), ("floor", True)]
)
def test_11_5_drop_lays_it_where_something_can_roll(play: Folder, ahead: str, lies: bool) -> None:
    run = play(_with_toy(f"thing: {{type: {ahead}, at: [1, 2]}}")).step("pickup").step("right").step("drop")
    assert (run.at("toy"), _carries(run)) == (([1, 2], None) if lies else (None, "toy"))


@pytest.mark.parametrize("npcs", ["shown", "hidden"])
def test_11_6_drop_gives_it_to_empty_hands(play: Folder, npcs: str) -> None:
    for more, toy, cup in (
        ("", "ann", None),
        ("cup: {type: ball, carryable: true, inside: ann}", "agent", "ann"),
    ):
        run = play(_with_toy(more, cast="{ann: {at: [1, 2]}}", observe=f"{{npcs: {npcs}}}"))
        run.step("pickup").step("right").step("drop")
        assert (_carries(run, toy), run.at("toy")) == ("toy", None)
        assert cup is None or _carries(run, cup) == "cup"


def test_11_7_accepts_is_asked_of_the_last_step(play: Folder) -> None:
    run = play(_with_toy(cast="{ann: {at: [1, 2], accepts: t == 3}}")).step("pickup").step("right")
    assert [_carries(run.step("drop"), "ann") for _ in range(2)] == [None, "toy"]


def test_11_8_npcs_by_the_same_rules(play: Folder) -> None:
    run = play("""
        objects: {toy: {type: ball, carryable: true, at: [4, 3]}}
        frames: {move: {steps: [{do: pickup}, {do: left}, {do: drop}, {do: pickup}, {do: left}, {do: drop}]}}
        cast:
          agent: {at: [2, 3]}
          ann: {at: [3, 3], facing: right, frame: move}
    """)
    seen = [(_carries(run.step(), "ann"), run.at("toy")) for _ in range(5)]
    assert seen == [("toy", None), ("toy", None), (None, [3, 2]), ("toy", None), ("toy", None)]
    assert _carries(run.step()) == "toy"


def test_11_9_a_carrier_that_vanishes_keeps_it(play: Folder) -> None:
    run = play("""
        objects: {toy: {type: ball, carryable: true, inside: ann}}
        cast: {ann: {at: [3, 3]}}
        rules: [{when: t == 1, cause: [ann.vanish]}, {when: t == 3, cause: [ann.put(first(c in cells where c.x == 5))]}]
    """)
    seen = [(run.at("ann"), _carries(run, "ann"), run.at("toy")) for _ in range(4) if run.step()]
    assert [carried for _, carried, _ in seen] == ["toy"] * 4
    assert [at is None for at, _, _ in seen] == [True, True, False, False]
    assert all(at is None for _, _, at in seen)


def test_11_10_a_carrier_that_is_reset_keeps_it(play: Folder) -> None:
    run = play("""
        objects: {toy: {type: ball, carryable: true, at: [4, 3]}}
        frames: {take: {steps: [{do: pickup}, {do: left, cause: [self.reset]}]}}
        cast: {ann: {at: [3, 3], facing: right, frame: take}}
    """).steps(2)
    assert (run.facing("ann"), _carries(run, "ann")) == ("right", "toy")


@pytest.mark.parametrize(
    ("effect", "at"),
    [("put(first(c in cells where c.x == 5))", [5, 1]), ("move_into(box)", None), ("vanish", None)],
)
def test_11_11_what_is_taken_away_is_in_nobodys_hands(
    play: Folder, effect: str, at: list[int] | None
) -> None:
    text = _with_toy("box: {type: box, at: [5, 5]}", rules=f"[{{when: t == 2, cause: [toy.{effect}]}}]")
    run = play(text).step("pickup")
    assert _carries(run) == "toy"
    assert (_carries(run.step()), run.at("toy")) == (None, at)


def test_11_12_into_hands_unless_they_are_full(play: Folder) -> None:
    run = play("""
        objects:
          box: {type: box, at: [5, 5]}
          toy: {type: ball, carryable: true, inside: box}
          cup: {type: ball, carryable: true, at: [4, 4]}
        cast: {ann: {at: [3, 3]}}
        rules: [{when: t == 1, cause: [toy.move_into(ann), cup.move_into(ann), box.reveal]}]
    """).step()
    assert (_carries(run, "ann"), run.at("toy"), run.at("cup"), run.at("box")) == (
        "toy",
        None,
        [4, 4],
        [5, 5],
    )


def test_11_13_reset_gives_back(play: Folder) -> None:
    text = """
        objects:
          toy: {{type: ball, carryable: true, inside: ann}}
          cup: {{type: ball, carryable: true, at: [4, 4]}}
        cast: {{ann: {{at: [3, 3]}}}}
        rules: [{{when: t == 1, cause: [toy.move_into(agent)]}}, {{when: t == 2, cause: [{}]}}]
    """
    run = play(text.format("toy.vanish, toy.reset")).steps(2)
    assert (_carries(run, "ann"), _carries(run)) == ("toy", None)
    run = play(text.format("toy.vanish, cup.move_into(ann), toy.reset")).steps(2)
    assert (_carries(run, "ann"), _carries(run), run.at("toy")) == ("cup", None, None)
    run = play(text.format("toy.vanish, cup.move_into(agent), cup.reset")).steps(2)
    assert (_carries(run), run.at("cup")) == (None, [4, 4])


def test_11_14_entries_end_with_the_act(play: Folder) -> None:
    text = """
        objects: {{toy: {{type: ball, carryable: true, at: [4, 3]}}}}
        frames: {{fetch: {{steps: [{{do: "{}"}}, {{do: stay, for: ever, state: over}}]}}}}
        cast:
          agent: {{at: [3, 4]}}
          ann: {{at: [3, 3], facing: right, frame: fetch}}
    """
    run = play(text.format("fetch(toy)")).step()
    assert (_carries(run, "ann"), run.status("ann")) == ("toy", "over")
    run = play(text.format("bring(toy, agent)"))
    seen = [(run.step().status("ann"), _carries(run)) for _ in range(3)]
    assert [carried for _, carried in seen] == [None, None, "toy"]
    assert [state == "over" for state, _ in seen] == [False, False, True]
    run = play(text.format("fetch(toy)"), {"ann": {"carries": "toy"}}).step()
    assert (run.state["ann"].get("last"), run.status("ann")) == (None, "over")


def test_11_15_its_own_cell_shows_what_it_carries(play: Folder) -> None:
    run = play(_with_toy(cast="{ann: {at: [1, 2]}}"))
    assert run.shown(0)[:4] == [EMPTY, 0, 0, 0]
    assert run.step("pickup").shown(0)[:4] == [BALL, 0, 0, 0]
    run.step("right").step("drop")
    assert (run.shown(0)[:4], run.shown(1)[4]) == ([EMPTY, 0, 0, 0], BALL)


# -- looks -----------------------------------------------------------------------------------------


def _looks(run: Play, name: str) -> dict[str, str]:
    found: dict[str, str] = run.state[name]["looks"]
    return found


def test_12_1_start_or_one_of_the_words(play: Folder) -> None:
    run = play("""
        looks:
          size: {for: balls, words: [small, large], start: [large, random, large if it.x > 1 else small]}
          mood: {for: ann, words: [calm, angry], start: angry}
        objects: {balls: {type: ball, at: [[3, 3], [4, 4], [5, 5]]}}
        cast: {ann: {at: [1, 5]}}
    """)
    sizes = [ball["looks"]["size"] for ball in run.state["balls"]]
    assert (sizes[0], sizes[2], _looks(run, "ann")) == ("large", "large", {"mood": "angry"})
    drawn = set()
    for seed in range(9):
        run.env.reset(seed=seed)
        drawn.add(run.state["balls"][1]["looks"]["size"])
    assert drawn == {"small", "large"}


def test_12_2_set_of_one_and_of_a_group(play: Folder) -> None:
    run = play("""
        looks:
          size: {for: balls, words: [small, large], start: small}
          mood: {for: ann | bob, words: [calm, angry], start: [calm, angry]}
        objects: {balls: {type: ball, at: [[3, 3], [4, 4]]}}
        frames:
          feel: {states: {s: {then: [{when: t == 1, set: {mood: bob.mood, bob.mood: self.mood, balls.size: large}}]}}}
        rules: [{when: t == 2, set: {first(balls).size: small}}]
        cast: {ann: {at: [1, 5], frame: feel}, bob: {at: [5, 1]}}
    """).step()
    assert [_looks(run, name)["mood"] for name in ("ann", "bob")] == ["angry", "calm"]
    assert [ball["looks"]["size"] for ball in run.state["balls"]] == ["large", "large"]
    assert [ball["looks"]["size"] for ball in run.step().state["balls"]] == ["small", "large"]


def test_12_3_the_look_of_what_has_none_finds_nothing(play: Folder) -> None:
    text = """
        looks: {{mood: {{for: ann, words: [calm, angry], start: calm}}}}
        frames:
          hear: {{states: {{s: {{then: [{{hears: any, when: {}, say: Yes}}]}}}}}}
        cast: {{ann: {{at: [1, 5], frame: hear}}, bob: {{at: [5, 1], frame: hear}}}}
    """
    for condition in ("speaker.mood == calm", "speaker.mood != calm", "not (speaker.mood == calm)"):
        assert play(text.format(condition)).step(said="Say bye").info["utterance"] == "NA"


def test_12_4_reset_and_vanish_leave_them(play: Folder) -> None:
    run = play("""
        looks: {size: {for: ball, words: [small, large], start: small}}
        objects: {ball: {type: ball, at: [3, 3]}}
        rules: [{when: t == 1, set: {ball.size: large}}, {when: t == 2, cause: [ball.vanish, ball.reset]}]
    """).steps(2)
    assert (_looks(run, "ball"), run.at("ball")) == ({"size": "large"}, [3, 3])


def test_12_5_the_channel_shows_what_is_seen(play: Folder) -> None:
    text = """
        looks:
          size: {{for: under | over, words: [small, large], start: [small, large]}}
          mood: {{for: ann, words: [calm, angry], start: angry}}
        objects: {{under: {{type: floor, at: [2, 1]}}, over: {{type: floor, at: [2, 1], overlap: true}}}}
        cast: {{ann: {{at: {}}}}}
    """
    assert play(text.format("[5, 5]")).shown(1)[4:] == [1, 255]
    assert play(text.format("[2, 1]")).shown(1)[4:] == [255, 1]
    assert play(text.format("[2, 1]")).shown(2)[4:] == [255, 255]


def test_12_6_its_own_cell_shows_those_of_its_load(play: Folder) -> None:
    looks = "{size: {for: toy, words: [small, large], start: large}, mood: {for: agent, words: [calm, sad]}}"
    run = play(_with_toy(looks=looks))
    assert run.shown(0)[4:] == [255, 255]
    assert run.step("pickup").shown(0)[4:] == [1, 255]


def test_12_7_neither_in_the_dark_nor_of_hidden_npcs(play: Folder) -> None:
    text = """
        looks: {{size: {{for: ball, words: [small, large], start: large}}, mood: {{for: ann, words: [calm, sad]}}}}
        objects: {{ball: {{type: ball, at: [4, 1]}}, bricks: {{type: wall, place: column(3), count: 5}}}}
        cast: {{ann: {{at: [2, 1]}}}}
        room: {{size: 7, occlusion: {}}}
        observe: {{npcs: hidden}}
    """
    assert play(text.format("false")).shown(3)[4:] == [1, 255]
    run = play(text.format("true"))
    assert run.shown(1)[4:] == [255, 255]
    assert run.shown(3) == [0, 0, 0, 0, 255, 255]


def test_12_8_the_tone_is_that_of_the_moment(play: Folder) -> None:
    run = play("""
        looks: {mood: {for: ann, words: [calm, angry], start: calm}}
        frames:
          feel: {states: {s: {then: [{when: t == 2, set: {self.mood: angry}, say: Well}, {say: So}]}}}
        cast: {ann: {at: [1, 5], frame: feel}}
        observe: {tone: mood}
    """)
    heard = [run.step().info["utterance"] for _ in range(3)]
    assert heard == ["Ann: (calm) So", "Ann: (angry) Well", "Ann: (angry) So"]


def test_12_9_the_tone_is_no_part_of_what_is_said(play: Folder) -> None:
    run = play("""
        looks: {mood: {for: ann, words: [calm, angry], start: angry}}
        frames:
          feel: {states: {s: {then: [{when: t == 1, say: Say hello}]}}}
          hear: {let: {known: 0}, states: {s: {then: [{hears: Say <noun>, when: noun == hello, set: {known: 1}}]}}}
        cast: {ann: {at: [1, 5], frame: feel}, bob: {at: [5, 1], frame: hear}}
        observe: {tone: mood}
        outcome: [{failure: ann.said("Say hello") and bob.known == 1}]
    """).step()
    assert (run.info["utterance"], run.terminated) == ("Ann: (angry) Say hello", True)


def test_12_10_perform_speaks_before_anything_is_set(play: Folder) -> None:
    text = """
        looks: {mood: {for: ann, words: [calm, angry], start: calm}}
        let: {dance: {sequence: 1, moves: [left], utterance: {chance: 0.5}}}
        frames: {dance: {steps: [{do: perform(dance), set: {mood: angry}}, {say: So}]}}
        cast: {ann: {at: [1, 5], frame: dance}}
        observe: {tone: mood}
    """
    run = play(text, {"let": {"dance": [["left", "Say hello"]]}})
    heard = [run.step().info["utterance"] for _ in range(2)]
    assert heard == ["Ann: (calm) Say hello", "Ann: (angry) So"]


# -- 13. several seats -----------------------------------------------------------------------------


def test_13_1_the_agent_has_the_first_seat(play: Folder) -> None:
    run = play.table("""
        cast:
          ann: {at: [5, 5], seat: open}
          bob: {at: [4, 5]}
          crew: {count: 2, at: [[1, 5], [2, 5]], seat: open}
    """)
    assert run.seats == ["agent", "ann", "crew[0]", "crew[1]"]


def test_13_2_a_seat_is_taken_from_one_step_to_the_next(play: Folder) -> None:
    run = play.table("cast: {ann: {at: [2, 5], facing: right, seat: open}}")
    run.step(ann="forward")
    assert run.at("ann") == [3, 5]
    run.step()
    assert run.at("ann") == [3, 5], "nobody sits there in this step"
    run.step(ann="forward", agent="forward")
    assert (run.at("ann"), run.at("agent")) == ([4, 5], [2, 1])


def test_13_3_a_member_whose_seat_is_free_is_an_npc(play: Folder) -> None:
    run = play.table("""
        frames: {walk: {states: {s: {do: forward, then: [{say: Here}]}}}}
        cast: {ann: {at: [2, 5], facing: right, seat: open, frame: walk}, bob: {at: [2, 4], seat: open}}
    """)
    run.step()
    assert (run.at("ann"), run.at("bob")) == ([3, 5], [2, 4])
    assert run.heard("agent") == ["Ann: Here"]


def test_13_4_all_act_on_one_state_and_are_known_from_its_start(play: Folder) -> None:
    run = play.table("""
        frames:
          watch:
            let: {moved: false, talked: false, greeted: false}
            states:
              s:
                first:
                  - set: {moved: bob.action == forward, talked: bob.spoke, greeted: bob.said("Say hello")}
        cast: {ann: {at: [5, 5], frame: watch}, bob: {at: [2, 4], facing: right, seat: open}}
    """)
    names = ("ann.moved", "ann.talked", "ann.greeted")
    run.step(bob=("forward", "Say hello"))
    assert [run.value(name) for name in names] == [True, True, True]
    run.step()
    assert [run.value(name) for name in names] == [False, False, False]
    run = play.table("""
        frames:
          watch: {states: {s: {first: [{set: {before: bob.action == left}}]}}}
          pace: {states: {s: {do: left}}}
        state: {before: false, later: false}
        rules: [{set: {later: bob.action == left}}]
        cast:
          agent: {frame: watch}
          bob: {at: [2, 4], seat: open, frame: pace}
    """)
    run.step()
    assert (run.value("before"), run.value("later")) == (False, True)
    assert run.step().value("before"), "on a free seat it is that of the last turn"


def test_13_5_bodies_move_in_the_order_of_the_seats(play: Folder) -> None:
    run = play.table("""
        cast: {ann: {at: [3, 1], facing: left, seat: open}, bob: {at: [1, 2], facing: up, seat: open}}
    """)
    run.step(agent="forward", ann="forward", bob="forward")
    assert [run.at(name) for name in ("agent", "ann", "bob")] == [[2, 1], [3, 1], [1, 1]]


def test_13_6_who_is_played_has_the_body_of_the_agent(play: Folder) -> None:
    run = play.table("""
        objects:
          door: {type: door, at: [0, 5]}
          coin: {type: ball, at: [1, 3], carryable: true}
          marble: {type: marble, at: [4, 3]}
        room: {build: [{lava: column(5)}]}
        cast:
          ann: {at: [1, 5], facing: left, seat: open}
          bob: {at: [1, 4], facing: up, seat: open}
          cat: {at: [3, 3], facing: right, seat: open}
          dan: {at: [4, 2], facing: right, seat: open}
    """)
    run.step(ann="toggle", bob="pickup", cat="forward", dan="forward")
    assert run.state["door"]["state"] == "open"
    assert (run.at("coin"), run.at("cat")) == (None, [3, 3])
    assert run.at("dan") is None, "it may step onto what is deadly"
    assert run.state["marble"]["state"] == "still", "it has rolled against the lava in the same step"
    run = play.table("""
        cast: {agent: {pushed_by: anybody}, ann: {at: [1, 3], facing: up, seat: open}, bob: {at: [3, 1], seat: open}}
    """)
    run.step(ann="forward").step(ann="forward")
    assert (run.at("ann"), run.at("agent")) == ([1, 2], [1, 1]), "behind the agent is the wall"
    run.step(agent="forward", ann="forward").step(ann="right").step(ann="forward")
    assert (run.at("ann"), run.at("agent")) == ([1, 1], [2, 1]), "and here bob"
    run.step(agent="right").step(agent="forward", ann="forward").step(ann="right").step(ann="forward")
    assert (run.at("ann"), run.at("agent")) == ([2, 1], [2, 3]), "it was pushed down"


@pytest.mark.parametrize(("npcs", "meet"), [("shown", False), ("hidden", True)])
def test_13_7_nobody_enters_the_cell_of_another_unless_npcs_are_hidden(
    play: Folder, npcs: str, meet: bool
) -> None:
    run = play.table(f"""
        observe: {{npcs: {npcs}}}
        cast: {{ann: {{at: [1, 2], facing: up, seat: open}}, bob: {{at: [2, 1], facing: down, seat: open}}}}
    """)
    run.step(ann="forward", agent="forward")
    assert (run.at("ann") == [1, 1], run.at("agent") == [2, 1]) == (meet, meet)
    run.step(ann="right").step(ann="forward")
    assert (run.at("ann") == run.at("bob")) is meet


def test_13_8_a_toggle_pokes_npcs_and_members_with_a_seat(play: Folder) -> None:
    run = play.table("""
        objects: {door: {type: door, at: [1, 1], state: open}}
        cast:
          ann: {at: [1, 2], facing: up, seat: open}
          bob: {at: [1, 3], facing: up, seat: open}
          cat: {at: [1, 4], facing: up, seat: open}
          dan: {at: [2, 4], facing: left, seat: open}
          eve: {at: [2, 3]}
        state: {a: false, b: false, e: false}
        rules: [{set: {a: ann.poked, b: bob.poked, e: eve.poked}}]
    """)
    run.step(bob="toggle")
    assert [run.value(who) for who in ("a", "b", "e")] == [True, False, False]
    run.step(dan="right").step(dan="toggle")
    assert [run.value(who) for who in ("a", "b", "e")] == [False, False, True]
    run.step(ann="toggle")
    assert run.state["door"]["state"] == "closed", "the agent is not poked, and stands in the door"


TOGGLED = """
    objects: {lamp: {type: switch, at: [0, 5]}}
    frames:
      use: {states: {s: {do: toggle}}}
      watch:
        let: {by_bob: false, touched: false}
        states: {s: {then: [{set: {by_bob: lamp.toggled_by(bob), touched: lamp.poked}}]}}
    cast: {ann: {at: [5, 5], frame: watch}, bob: {at: [1, 5], facing: left, seat: open, frame: use}}
    rules: [{set: {poked_now: lamp.poked, by: lamp.toggled_by(bob)}}]
    state: {poked_now: false, by: false}
"""


def test_13_9_what_a_player_toggled_at_is_toggled_by_it_until_the_next_step(play: Folder) -> None:
    run = play.table(TOGGLED)
    run.step(bob="toggle")
    assert run.value("ann.by_bob"), "its turn comes after that of ann"
    run.step(bob=None)
    assert not run.value("ann.by_bob"), "with the next step it is over"
    run.step(bob="toggle").step()
    assert not run.value("ann.by_bob"), "also where nobody sits there any more"
    assert run.value("by"), "and its frame toggles in its own turn"


def test_13_10_what_a_member_with_a_seat_toggled_at_is_poked(play: Folder) -> None:
    run = play.table(TOGGLED)
    run.step(bob="toggle")
    assert (run.value("ann.touched"), run.value("poked_now")) == (True, True)
    run.step()
    assert (run.value("ann.touched"), run.value("poked_now")) == (False, True), (
        "in its turn, after that of ann"
    )
    run.step(bob="left")
    assert not run.value("poked_now")


def test_13_11_the_world_goes_on_once_after_all_bodies(play: Folder) -> None:
    run = play.table("""
        objects:
          marble: {type: marble, at: [1, 4]}
          crank: {type: lever, at: [0, 5], timer: 2}
        cast: {ann: {at: [1, 5], facing: left, seat: open}, bob: {at: [1, 3], facing: down, seat: open}}
    """)
    run.step(agent="forward", bob="forward", ann="toggle")
    assert run.state["marble"]["state"] == "still", "ann is in its way"
    assert run.state["crank"]["state"] == "up"
    run.step(bob="left")
    assert run.state["crank"]["state"] == "spent", "it counts once a step, from this one on"


def test_13_12_players_speak_after_the_agent_and_its_frame(play: Folder) -> None:
    run = play.table("""
        observe: {own_voice: true}
        frames:
          script: {let: {heard_it: false}, states: {s: {then: [{when: heard(any), set: {heard_it: true}}]}}}
        cast: {agent: {frame: script}, ann: {at: [5, 5], seat: open}, bob: {at: [4, 5], seat: open}}
    """)
    run.step(bob=("left", "Say bye"), ann=("left", "Say hello"), agent=("left", "Say bye"))
    assert run.heard("agent") == ["Agent: Say bye", "Ann: Say hello", "Bob: Say bye"]
    assert not run.value("agent.heard_it"), "its frame went on before they spoke"
    run.step()
    assert run.value("agent.heard_it")


def test_13_13_a_voice_is_heard_within_its_earshot(play: Folder) -> None:
    run = play.table("""
        frames: {listen: {let: {got: 0}, states: {s: {then: [{hears: any, set: {got: "min(got + 1, 9)"}}]}}}}
        cast:
          ann: {at: [1, 3], facing: up, earshot: 2, seat: open}
          bob: {at: [1, 4], seat: open}
          cat: {at: [1, 5], frame: listen}
          dan: {at: [2, 5], frame: listen}
    """)
    run.step(ann=("forward", "Say hello"))
    assert [run.heard(seat) for seat in run.seats] == [["Ann: Say hello"], [], ["Ann: Say hello"]]
    assert (run.value("cat.got"), run.value("dan.got")) == (0, 0), "it spoke where its body had moved to"
    run.step(ann="left").step(ann="left").step(ann=("forward", "Say bye"))
    assert [run.heard(seat) for seat in run.seats] == [["Ann: Say bye"], [], ["Ann: Say bye"]]
    assert (run.value("cat.got"), run.value("dan.got")) == (1, 0)
    run = play.table("""
        observe: {tone: mood}
        looks: {mood: {for: cast, words: [calm, angry], start: calm}}
        frames: {script: {states: {s: {then: [{set: {ann.mood: angry}}]}}}}
        cast: {agent: {frame: script}, ann: {at: [5, 5], seat: open}}
    """)
    run.step(ann=(None, "Say bye"), agent=(None, "Say bye"))
    assert (run.heard("agent"), run.heard("ann")) == (["Ann: (calm) Say bye"], ["Agent: Say bye"])
    assert run.step(ann=(None, "Say bye")).heard("agent") == ["Ann: (angry) Say bye"]


def test_13_14_every_seat_hears_npcs_in_the_order_spoken(play: Folder) -> None:
    text = """
        observe: {{own_voice: {}}}
        frames: {{talk: {{slots: {{line: text}}, states: {{s: {{then: [{{say: <line>}}]}}}}}}}}
        cast:
          ann: {{at: [5, 5], seat: open}}
          bob: {{at: [4, 5], frame: talk, with: {{line: Yes}}}}
          cat: {{at: [3, 5], frame: talk, with: {{line: No}}}}
    """
    run = play.table(text.format("false")).step(ann=("left", "Say hello"), agent=("left", "Say bye"))
    assert run.heard("agent") == ["Ann: Say hello", "Bob: Yes", "Cat: No"]
    assert run.heard("ann") == ["Agent: Say bye", "Bob: Yes", "Cat: No"]
    run = play.table(text.format("true")).step(ann=("left", "Say hello"), agent=("left", "Say bye"))
    assert run.heard("ann") == run.heard("agent")
    assert run.heard("ann") == ["Agent: Say bye", "Ann: Say hello", "Bob: Yes", "Cat: No"]
    run = play.table("""
        observe: {own_voice: true}
        frames: {talk: {states: {s: {then: [{say: Yes}]}}}}
        cast: {ann: {at: [5, 5], seat: open, frame: talk}}
    """)
    assert (run.step().heard("agent"), run.heard("ann")) == (["Ann: Yes"], []), "its script is not its player"


def test_13_15_while_npcs_are_hidden_others_are_neither_seen_nor_heard(play: Folder) -> None:
    run = play.table("""
        observe: {npcs: hidden}
        cast:
          ann: {at: [3, 1], facing: left, seat: open}
          bob: {at: [5, 5], seat: open, audible: always}
    """)
    run.step(agent=("left", "Say hello"), ann=("done", "Say hello"), bob=("left", "Say bye"))
    assert [run.heard(seat) for seat in run.seats] == [["Bob: Say bye"], ["Bob: Say bye"], []]
    assert run.shown("ann", 2)[0] == EMPTY, "there is the agent"


def test_13_16_who_is_played_follows_its_frame_without_body_and_voice(play: Folder) -> None:
    run = play.table("""
        frames:
          act:
            let: {told: 0}
            states:
              s:
                do: forward
                then:
                  - set: {told: "min(told + 1, 9)", seen: bob.believes.x_of_agent}
                    cause: [lamp.become(pressed)]
                    say: Here
        state: {seen: 0}
        objects: {lamp: {type: switch, at: [0, 5]}}
        cast:
          bob:
            at: [2, 3]
            facing: right
            seat: open
            frame: act
            beliefs: {x_of_agent: {of: agent.x}}
    """)
    run.step(agent="forward", bob=None)
    assert (run.at("bob"), run.heard("agent")) == ([2, 3], [])
    assert (run.value("bob.told"), run.value("seen"), run.state["lamp"]["state"]) == (1, 2, "pressed")


def test_13_17_a_script_goes_on_from_where_things_are(play: Folder) -> None:
    run = play.table("""
        frames:
          greet:
            states:
              waiting: {then: [{hears: Say hello, goto: going}]}
              going: {do: forward, then: [{say: On my way}]}
        cast: {bob: {at: [2, 3], facing: right, seat: open, frame: greet}}
    """)
    run.step(agent=("left", "Say hello"), bob="left")
    assert (run.state["bob"]["state"], run.at("bob")) == ("going", [2, 3])
    run.step()
    assert (run.at("bob"), run.heard("agent")) == ([2, 2], ["Bob: On my way"])


def test_13_18_who_is_on_a_deadly_cell_vanishes(play: Folder) -> None:
    run = play.table("""
        room: {build: [{lava: column(2)}]}
        objects: {light: {type: ball, at: [5, 5], tagged: agent.gone}}
        rules: [{set: {was_there: not agent.gone}}]
        state: {was_there: false}
        cast: {ann: {at: [3, 3], facing: left, seat: open}, bob: {at: [5, 1], seat: open}}
    """)
    run.step(agent="forward", bob="left")
    assert run.at("agent") is None
    assert run.value("was_there"), "it is there when the rules of the world are read"
    assert run.state["light"]["state"] == "tagged", "the world is settled then"
    run.step(ann="forward", bob="left")
    assert (run.at("ann"), run.at("bob"), run.terminated.any()) == (None, [5, 1], False)


def test_13_19_with_the_last_who_is_played_the_episode_ends(play: Folder) -> None:
    text = """
        room: {build: [{lava: column(2)}]}
        cast: {ann: {at: [3, 3], facing: left, seat: open}}
        outcome: [{failure: agent.gone, id: alone}]
    """
    run = play.table(text).step(agent="forward", ann=None)
    assert run.outcome == "alone", "of two one is left, and the outcome is read"
    run = play.table(text).step(agent="forward", ann="forward")
    assert (run.outcome, run.terminated.tolist()) == ("deadly", [True, True])
    run = play.table(text).step(agent="forward")
    assert run.outcome == "deadly", "nobody sits on the other seat"


def test_13_20_who_is_out_of_the_room_does_says_and_hears_nothing(play: Folder) -> None:
    run = play.table("""
        objects: {door: {type: door, at: [0, 3]}}
        rules:
          - {when: t == 1, cause: [ann.vanish]}
          - {when: t == 3, cause: [ann.put(door.cell), ann.reset]}
          - {when: ann.spoke or ann.did(toggle), set: {acted: acted + 1}}
        state: {acted: {start: 0, range: 0..9}}
        cast: {ann: {at: [1, 3], facing: left, seat: open}, bob: {at: [5, 5], seat: open}}
    """)
    run.step(ann="right").step(ann=("toggle", "Say hello"), bob=("left", "Say bye"))
    assert (run.value("acted"), run.state["door"]["state"]) == (0, "closed")
    assert [run.heard(seat) for seat in run.seats] == [["Bob: Say bye"], [], []]
    assert {tuple(run.shown("ann", ahead, 1)) for ahead in range(7)} == {(WALL, 5, 0, 0)}
    run.step(ann=("toggle", "Say hello"))
    assert run.at("ann") == [1, 3], "it came back at the end of this step"
    assert run.value("acted") == 0
    run.step(ann=("toggle", "Say hello"))
    assert (run.value("acted"), run.state["door"]["state"]) == (1, "open")


def test_13_21_an_outcome_ends_it_for_all_and_may_be_the_success_of_some(play: Folder) -> None:
    run = play.table("""
        cast: {ann: {at: [5, 5], seat: open}, bob: {at: [4, 5], seat: open}}
        outcome: [{success: ann.spoke, for: [ann, agent], id: won}]
    """)
    run.step(ann=(None, "Say bye"))
    assert (run.terminated.tolist(), run.outcome) == ([True, True, True], "won")
    assert run.infos["success"].tolist() == [True, True, False]


def test_13_22_each_seat_is_paid_its_share(play: Folder) -> None:
    cast = "cast: {ann: {at: [5, 5], seat: open}, bob: {at: [4, 5], seat: open}}"
    run = play.table(f"""
        {cast}
        reward: {{success: linear(0), each_step: 0.5}}
        rules: [{{when: t == 1, reward: {{ann: 10, bob: -20}}}}, {{when: t == 1, reward: 1}}]
        outcome: [{{success: t == 2, reward: {{agent: 100, bob: 20 * t}}}}]
    """)
    assert run.step(ann=None).reward.tolist() == pytest.approx([0.51, 0.61, 0.31])
    assert run.step(bob=None).reward.tolist() == pytest.approx([1.5, 0.5, 0.9])
    run = play.table(f"""
        {cast}
        reward: {{success: linear(0)}}
        outcome: [{{success: t == 1, for: ann, reward: 60}}]
    """)
    assert run.step().reward.tolist() == pytest.approx([0, 0.6, 0])


def test_13_23_a_picture_shows_the_room_from_where_its_member_stands(play: Folder) -> None:
    run = play.table("""
        cast:
          agent: {color: blue, kind: boss}
          ann: {at: [3, 1], facing: left, seat: open, color: red}
          bob: {at: [1, 1], facing: up, color: green}
          cat: {at: [3, 4], facing: up, seat: open}
    """)
    assert run.shown("ann", 2) == [NPC, BLUE, 1, 0], "the agent before the NPC in its cell"
    assert run.shown("cat", 3) == [NPC, RED, 0, 2]
    assert run.shown("agent", 2) == [NPC, RED, 0, 2]


def test_13_24_its_own_cell_tells_a_player_on_which_seat_it_sits(play: Folder) -> None:
    run = play.table("""
        objects: {coin: {type: ball, color: blue, carryable: true, inside: bob}}
        cast: {ann: {at: [5, 5], seat: open}, bob: {at: [4, 5], seat: open}}
    """)
    assert [run.shown(seat, 0)[:4] for seat in run.seats] == [
        [EMPTY, 0, 0, 0],
        [EMPTY, 0, 0, 1],
        [BALL, BLUE, 0, 2],
    ]
