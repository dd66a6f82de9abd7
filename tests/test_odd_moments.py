"""Odd moments on which the engine and the reference interpreter once differed: both do what the pages say."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from socialai_dsl.frontend import load
from tests.agreement import Pair
from tests.tiny import Folder

Act = tuple[str | None, str | None]
STILL: Act = (None, None)


def play(folder: Path, text: str, acts: Sequence[Act]) -> dict[str, Any]:
    """Play the same acts on both sides, which have to agree after each; the state at the end."""
    pair = Pair.of(load(str(Folder(folder).write("tiny", text))), number_words=False)
    pair.reset(seed=0)
    for act in acts:
        pair.step(tuple(map(int, np.asarray(pair.env.encode_action(act)))))  # type: ignore[arg-type]
    return pair.env.describe()


def written(folder: Path, text: str) -> Pair:
    """Both sides of a whole scenario."""
    file = folder / f"{text.split()[1]}.yaml"
    file.write_text(text)
    return Pair.of(load(str(file)))


def registers(state: dict[str, Any], owner: str = "ann") -> dict[str, Any]:
    """What somebody's frame holds."""
    return {
        name.partition(".")[2]: value for name, value in state["let"].items() if name.startswith(f"{owner}.")
    }


WHERE_GONE = """
objects: {{coin: {{type: ball, at: [3, 3]}}}}
state:
  total: {{start: 0, range: -9..9}}
  far: {{start: 0, range: 0..20}}
  way_down: false
  close_by: true
rules:
  - {{when: t == 1, cause: [coin.vanish]}}
  - set:
      total: coin.x + coin.y
      far: coin.distance(agent)
      way_down: agent.dir_to(coin) == down
      close_by: {near}
"""


@pytest.mark.parametrize(
    "near", ["agent.distance(coin) < 9", "coin.x >= 0", "agent.in_line(coin)", "agent.sees(coin)"]
)
def test_what_has_left_is_nowhere(tmp_path: Path, near: str) -> None:
    found = play(tmp_path, WHERE_GONE.format(near=near), [STILL])["state"]
    assert found == {"total": -2, "far": 14, "way_down": True, "close_by": False}


def test_nothing_is_nearest_to_what_has_left(tmp_path: Path) -> None:
    state = play(
        tmp_path,
        """
        objects: {coin: {type: ball, at: [3, 3]}, doors: {type: door, count: 2, at: [[3, 0], [5, 0]]}}
        state: {some: 0}
        rules:
          - {when: t == 1, cause: [coin.vanish]}
          - {when: "nearest(d in doors to coin).closed", set: {some: "min(some + 1, 9)"}}
        """,
        [STILL] * 4,
    )
    assert state["state"]["some"] == 0, "the first rule runs before the second"


def test_the_noun_of_a_silent_agent_is_not_said(tmp_path: Path) -> None:
    text = """
    frames:
      ask:
        let: {other: 0, rest: 0}
        states:
          s:
            then:
              - {when: t < 3, say: Was it <agent.noun>, set: {other: 1}}
              - {when: agent.noun != "bye", set: {rest: "min(rest + 1, 9)"}}
    cast: {ann: {at: [5, 5], frame: ask}}
    """
    silent = play(tmp_path, text, [STILL] * 2)
    assert (registers(silent), silent["heard"]) == ({"other": 0, "rest": 2}, [])
    spoken = play(tmp_path, text, [(None, "Say bye")])
    assert (registers(spoken), spoken["heard"]) == ({"other": 1, "rest": 0}, ["Ann: Was it bye"])


@pytest.mark.parametrize("comparison", ["last != price(t)", "price(t) != last", "not prev(last) == last"])
def test_a_comparison_with_an_empty_register_looks_for_the_other_side(
    tmp_path: Path, comparison: str
) -> None:
    text = f"""
    state: {{last: {{start: none, range: 0..3}}, price: {{for: 1..2, start: none, range: 0..3}}, times: 0}}
    rules:
      - {{when: {comparison}, set: {{times: "min(times + 1, 9)"}}}}
      - {{when: t == 9, set: {{last: 1, price(2): 1}}}}
    """
    # `prev` of nothing is nothing; of the keys 1 to 4 two have a price.
    found = 0 if "prev" in comparison else 2
    assert play(tmp_path, text, [STILL] * 4)["state"]["times"] == found


def test_a_box_is_toggled_by_who_opened_it_though_its_content_stands_there(tmp_path: Path) -> None:
    state = play(
        tmp_path,
        """
        objects: {box: {type: box, at: [4, 5]}, apple: {type: apple, inside: box}}
        state: {box_by: false, apple_by: false, any_by: false}
        frames: {open: {steps: [{do: toggle}]}}
        cast: {ann: {at: [3, 5], facing: right, frame: open}}
        rules:
          - {when: t == 1, set: {box_by: box.toggled_by(ann), apple_by: apple.toggled_by(ann), any_by: box.toggled}}
        """,
        [STILL],
    )
    assert state["state"] == {"box_by": True, "apple_by": False, "any_by": True}
    assert (state["box"].get("gone"), state["apple"]["at"]) == (True, [4, 5])


@pytest.mark.parametrize(("npcs", "heard"), [("shown", 1), ("hidden", 0)])
def test_a_scripted_agent_does_not_hear_who_is_hidden(tmp_path: Path, npcs: str, heard: int) -> None:
    text = f"""
    observe: {{npcs: {npcs}}}
    frames:
      talk: {{states: {{s: {{then: [{{say: Good day}}]}}}}}}
      listen: {{let: {{heard_it: 0}}, states: {{s: {{then: [{{hears: Good day, set: {{heard_it: 1}}}}]}}}}}}
    cast: {{agent: {{at: [1, 1], frame: listen}}, ann: {{at: [5, 5], frame: talk}}}}
    """
    assert registers(play(tmp_path, text, [STILL] * 3), "agent")["heard_it"] == heard


def test_turning_lasts_until_it_is_done(tmp_path: Path) -> None:
    text = """
    frames: {look: {let: {since: 0}, steps: [{do: turn_to(left)}, {for: 1, set: {since: t}}]}}
    cast: {ann: {at: [5, 5], facing: right, frame: look}}
    """
    state = play(tmp_path, text, [STILL] * 3)
    assert (state["ann"]["facing"], registers(state)["since"]) == ("left", 3)


@pytest.mark.parametrize(("at", "front"), [([3, 0], [3, 1]), ([3, 3], None)])
def test_objects_have_a_front_in_a_wall_only(tmp_path: Path, at: list[int], front: list[int] | None) -> None:
    text = f"""
    objects: {{door: {{type: door, at: {at}}}}}
    cast: {{agent: {{at: {front or [4, 3]}, facing: up}}}}
    state: {{before_it: false}}
    rules: [{{set: {{before_it: agent.in_front_of(door)}}}}]
    """
    assert play(tmp_path, text, [STILL])["state"]["before_it"] is (front is not None)


def test_paths_of_the_agent_lead_round_what_is_deadly(tmp_path: Path) -> None:
    state = play(
        tmp_path,
        """
        room: {build: [{lava: row(3)}]}
        objects: {door: {type: door, at: [3, 6]}, coin: {type: ball, at: [5, 1]}}
        state: {over: false, along: false}
        rules: [{set: {over: agent.can_reach(door), along: agent.can_reach(coin)}}]
        """,
        [STILL],
    )
    assert state["state"] == {"over": False, "along": True}


def test_what_was_before_may_have_been_nothing(tmp_path: Path) -> None:
    state = play(
        tmp_path,
        """
        objects: {doors: {type: door, count: 2, at: [[3, 0], [5, 0]], color: [red, blue]}}
        state: {is_red: 0, other: 0}
        rules:
          - {when: "prev(first(d in doors where d.open).color) == red", set: {is_red: "min(is_red + 1, 9)"}}
          - {when: "not (prev(first(d in doors where d.open).color) == red)", set: {other: "min(other + 1, 9)"}}
          - {when: t == 2, cause: [first(doors).open]}
        """,
        [STILL] * 4,
    )
    assert state["state"] == {"is_red": 2, "other": 0}


def test_a_cell_that_is_drawn_of_none_is_the_first(tmp_path: Path) -> None:
    state = play(tmp_path, "let: {spot: pick(c in cells where c.x > 20)}", [])
    assert state["let"]["spot"] == [1, 1]


@pytest.mark.parametrize("noun", ["1", "4"])
def test_a_noun_in_a_range_is_the_number_that_it_is(tmp_path: Path, noun: str) -> None:
    text = """
    grammar: {templates: [Say <noun>], nouns: [1, 2, 3, 4]}
    state: {within: false}
    rules: [{when: agent.noun in 1..4, set: {within: true}}]
    """
    assert play(tmp_path, text, [(None, f"Say {noun}")])["state"]["within"] is True


def test_a_gate_in_a_fence_overlaps_what_is_built(tmp_path: Path) -> None:
    text = """
    room: {build: [{fence: column(W // 2)}]}
    objects: {gate: {type: door, place: column(W // 2), overlap: true}}
    """
    state = play(tmp_path, text, [])
    assert state["gate"]["at"][0] == 3
    assert 1 <= state["gate"]["at"][1] <= 5


def test_the_speaker_is_who_said_the_value_that_was_waited_for(tmp_path: Path) -> None:
    state = play(
        tmp_path,
        """
        grammar: {templates: [Say <noun>], nouns: [1, 2]}
        state: {price: {start: 2, range: 1..2}}
        frames:
          bid: {states: {s: {then: [{say: Say 2}]}}}
          sell: {states: {s: {then: [{hears: Say <price>, say: "Sold to <speaker.name>"}]}}}
        cast: {ann: {at: [3, 5], frame: bid}, bob: {at: [5, 5], frame: sell}}
        """,
        [(None, "Say 1")],
    )
    assert state["heard"][-1] == "Bob: Sold to Ann"


@pytest.mark.parametrize("what", ["one", "pick(apples)", "first(apples)", "moved"])
def test_whatever_is_moved_into_a_box_comes_out_of_it(tmp_path: Path, what: str) -> None:
    state = play(
        tmp_path,
        f"""
        objects: {{box: {{type: box, at: [3, 3]}}, apples: {{type: apple, count: 2, at: [[1, 5], [5, 1]]}}}}
        let: {{one: first(apples)}}
        define: {{moved: first(a in apples where a.index == 1)}}
        state: {{lay_in_it: false}}
        rules:
          - {{when: t == 1, cause: ["{what}.move_into(box)"]}}
          - {{when: t == 2, set: {{lay_in_it: "any(a in apples where a.gone)"}}, cause: [box.reveal]}}
        """,
        [STILL] * 3,
    )
    assert state["state"]["lay_in_it"] is True
    assert state["box"].get("gone")
    assert [3, 3] in [apple.get("at") for apple in state["apples"]]


CROWDED = """
scenario: crowded
about: Boxes everywhere.
horizon: 20
earshot: room
grammar: {{templates: [Hello <noun>], nouns: [you]}}
room: {{size: {size}}}
objects: {{boxes: {{type: box, count: {boxes}, place: anywhere}}}}
let:
  near: pick(b in boxes where agent.can_reach(b))
  far: pick(b in boxes where not agent.can_reach(b))
cast: {{agent: {{place: anywhere}}}}
outcome: [success: agent.said("Hello you")]
"""


def crowded(folder: Path, size: str, boxes: int) -> Pair:
    """A room full of boxes, on both sides."""
    path = folder / "crowded.yaml"
    path.write_text(CROWDED.format(size=size, boxes=boxes), encoding="utf-8")
    return Pair.of(load(str(path)))


def test_what_is_drawn_at_reset_knows_what_is_in_the_way(tmp_path: Path) -> None:
    pair = crowded(tmp_path, "6", 11)
    first = 0
    for episode in range(40):
        pair.reset(0, episode)
        pair.step((6, 0, 0, 0))
        chosen = pair.env.describe()["let"]
        first += chosen["near"] == "boxes[0]" and chosen["far"] == "boxes[0]"
    assert first == 0, "without paths all boxes could be reached, or none"


def test_an_agent_without_a_cell_sees_what_lies_outside(tmp_path: Path) -> None:
    pair = crowded(tmp_path, "5..6", 9)
    absent = 0
    for episode in range(10):
        pair.reset(0, episode)
        pair.step((2, 0, 0, 0))
        absent += pair.env.describe()["agent"]["at"] is None
    assert 0 < absent < 10


def test_a_push_is_for_what_is_in_the_way(tmp_path: Path) -> None:
    state = play(
        tmp_path,
        """
        objects:
          marble: {type: marble, at: [2, 1], overlap: true}
          plate: {type: floor, at: [2, 1], overlap: true}
        cast: {agent: {at: [1, 1], facing: right}}
        """,
        [("forward", None)],
    )
    assert (state["marble"]["at"], state["marble"]["state"]) == ([3, 1], "rolling")


@pytest.mark.parametrize(
    "asked", ["prev(min(0, agent.noun)) != agent.noun", "prev(agent.noun + 1) != agent.noun"]
)
def test_what_was_not_found_is_not_even_unlike_what_it_can_never_equal(tmp_path: Path, asked: str) -> None:
    state = play(
        tmp_path,
        f"""
        grammar: {{templates: [It is <noun>], nouns: ["1", "2"]}}
        state: {{unlike: false}}
        rules: [{{when: "{asked}", set: {{unlike: true}}}}]
        """,
        [STILL],
    )
    assert not state["state"]["unlike"]


def test_nobody_arrives_at_the_cell_of_what_is_gone(tmp_path: Path) -> None:
    state = play(
        tmp_path,
        """
        objects: {coin: {type: ball, at: [3, 3]}}
        frames:
          walk: {steps: [{do: go_to(coin.cell)}, {do: stay, for: ever}]}
        cast:
          agent: {at: [1, 1]}
          ann: {at: [5, 5], frame: walk}
        rules: [{when: t == 1, cause: [coin.vanish]}]
        """,
        [STILL] * 4,
    )
    assert state["ann"]["state"] == "step0"


COUNTING = """
frames:
  count:
    let: {coins: {start: 1, range: 0..9}}
    states:
      counting:
        then: [{when: t <= 2, set: {coins: coins + 3}, say: I have <coins>}]
cast: {ann: {frame: count, at: [2, 2], facing: down}, agent: {at: [3, 2], facing: left}}
"""


def test_what_is_said_is_worked_out_before_anything_is_set(tmp_path: Path) -> None:
    """Even if the register that is set is, as the first line of all, the number of the line."""
    state = play(tmp_path, COUNTING, [STILL] * 3)
    assert state["heard"] == ["Ann: I have 1", "Ann: I have 4"]
    assert registers(state)["coins"] == 7


def test_an_agent_without_a_cell_does_nothing(tmp_path: Path) -> None:
    pair = crowded(tmp_path, "5..6", 9)
    absent = []
    for episode in range(10):
        pair.reset(0, episode)
        before = pair.env.describe()["agent"]
        for action in (0, 1, 1, 2, 3):
            pair.step((action, 0, 0, 0))
        absent += [pair.env.describe()["agent"]["facing"] == before["facing"]] if before["at"] is None else []
    assert absent
    assert all(absent)


RESTORED = """
objects:
  box: {type: box, at: [3, 3]}
  coin: {type: ball, inside: box}
rules:
  - {when: t == 1, cause: [box.reveal]}
  - {when: t == 3, cause: [box.reset]}
cast: {agent: {at: [1, 1]}}
"""


def test_a_box_is_put_back_with_what_lay_in_it(tmp_path: Path) -> None:
    assert play(tmp_path, RESTORED, [STILL] * 2)["coin"]["at"] == [3, 3]
    state = play(tmp_path, RESTORED, [STILL] * 3)
    assert state["coin"].get("gone")
    assert state["box"]["at"] == [3, 3]


POINTING = """
frames:
  show:
    states:
      pointing: {do: point(agent)}
cast: {ann: {frame: show, at: [2, 2], facing: down}, agent: {at: [2, 4], facing: up}}
rules: [{when: t == 2, cause: [ann.reset]}]
observe: {channels: [type, color, status, orientation, pointing, last_act]}
"""


def test_who_is_put_back_takes_the_arm_down(tmp_path: Path) -> None:
    """Even who can neither walk nor turn nor vanish, so that nothing else is put back."""
    state = play(tmp_path, POINTING, [STILL])
    assert state["ann"]["pointing"] == "down"
    assert state["ann"]["at"] == [2, 2]
    assert "pointing" not in play(tmp_path, POINTING, [STILL] * 2)["ann"]


BRIDGE = """
objects:
  lava: {type: lava, at: [2, 1]}
  plank: {type: floor, at: [2, 1], overlap: true}
cast: {agent: {at: [1, 1], facing: right}}
rules: [{when: t == 2, cause: [plank.vanish]}]
"""


@pytest.mark.parametrize(
    ("acts", "ended"), [([("forward", None)], False), ([("forward", None), STILL], True)]
)
def test_what_is_seen_of_a_cell_decides_whether_it_is_deadly(
    tmp_path: Path, acts: Sequence[Act], ended: bool
) -> None:
    """A plank over lava is a bridge, until it is taken away."""
    pair = Pair.of(load(str(Folder(tmp_path).write("tiny", BRIDGE))), number_words=False)
    pair.reset(seed=0)
    over = [pair.step(tuple(map(int, np.asarray(pair.env.encode_action(act))))) for act in acts]  # type: ignore[arg-type]
    assert over[-1] == ended


BACK = """
frames:
  drift:
    states:
      turning: {do: left}
cast: {ann: {frame: drift, at: [2, 2], facing: down}, agent: {at: [2, 4], facing: up}}
rules:
  - {when: t == 1, cause: [ann.vanish]}
  - {when: t == 2, cause: [ann.put(agent.cell), ann.reset]}
observe: {channels: [type, color, status, orientation, pointing, last_act]}
"""


def test_who_comes_back_has_done_nothing_in_between(tmp_path: Path) -> None:
    """The picture, which both sides take, shows no act of her."""
    state = play(tmp_path, BACK, [STILL] * 3)
    assert (state["ann"]["at"], state["ann"]["facing"]) == ([2, 2], "right")


def test_nobody_hears_an_agent_that_found_no_cell(tmp_path: Path) -> None:
    pair = written(
        tmp_path,
        """
scenario: crowded
horizon: 6
earshot: room
grammar: {templates: [Hi <noun>], nouns: [you]}
room: {size: 5}
observe: {own_voice: true}
objects: {balls: {type: ball, count: 8, color: red}}
frames:
  listen: {states: {waiting: {then: [{hears: any, say: Who is it, goto: woken}]}, woken: {}}}
cast:
  one: {frame: listen}
  agent: {}
order: [balls, one, agent]
outcome: [{failure: agent.did(done)}]
""",
    )
    pair.reset(3)
    assert pair.env.describe()["agent"]["gone"]
    for _ in range(3):
        pair.step((0, 1, 0, 0))
    assert pair.env.describe()["one"]["state"] == "waiting"


def test_a_status_follows_before_things_roll(tmp_path: Path) -> None:
    """A door is locked while the agent is beside a marble in step 2: a moment is enough to close an open one."""
    pair = written(
        tmp_path,
        """
scenario: rolling
horizon: 8
grammar: body
room: {size: 8}
objects:
  marble: {type: marble, at: [3, 1]}
  door: {type: door, state: open, at: [0, 4], locked: t == 2 and marble.x - agent.x == 1}
cast:
  agent: {at: [2, 1], facing: right}
outcome: [{failure: agent.did(done)}]
""",
    )
    pair.reset(3)
    seen = []
    forward = pair.reference.scenario.actions.index("forward")
    for _ in range(3):
        pair.step((forward, 0, 0, 0))
        state = pair.env.describe()
        seen.append((state["agent"]["at"][0], state["marble"]["at"][0], state["door"]["state"]))
    # It pushes the marble, which rolls on at once; then it follows, and the marble rolls on.
    assert seen == [(2, 4, "open"), (3, 5, "closed"), (4, 6, "closed")]


@pytest.mark.parametrize("value", ["word", 'word if t > 0 else "none yet"'])
def test_an_empty_register_cannot_be_said(tmp_path: Path, value: str) -> None:
    run = Folder(tmp_path)(f"""
        frames:
          repeat_it:
            let: {{word: {{start: none}}}}
            states:
              s:
                then:
                  - {{hears: Say <noun>, set: {{word: noun}}}}
                  - {{say: It was <{value}>.}}
                  - {{say: Nothing.}}
        cast: {{ann: {{at: [5, 5], frame: repeat_it}}}}
    """).step()
    assert run.info["utterance"] == "Ann: Nothing."
    run.step(said="Say hello")
    assert run.step().info["utterance"] == "Ann: It was hello."


@pytest.mark.parametrize(("when", "facing"), [("is(early)", "down"), ("is(late)", "up")])
def test_entries_after_nested_ones_that_are_left_out_are_asked_as_themselves(
    tmp_path: Path, when: str, facing: str
) -> None:
    text = f"""
    frames:
      walk:
        steps:
          - {{when: false, steps: [{{do: left, state: early}}]}}
          - {{repeat: 2, when: is(inner), steps: [{{when: is(inner), do: left, state: inner}}, {{do: right}}]}}
          - {{when: {when}, do: right, for: 2, state: late}}
          - {{do: left}}
    cast: {{ann: {{at: [5, 5], facing: left, frame: walk}}}}
    """
    state = play(tmp_path, text, [STILL] * 5)
    assert (state["ann"]["facing"], state["ann"]["state"]) == (
        facing,
        "late" if facing == "up" else "finished",
    )


@pytest.mark.parametrize("never", ["repeat: 0, steps: [{do: left}]", "steps: [{do: left, for: 0}]"])
def test_steps_of_no_rounds_are_over_at_once(tmp_path: Path, never: str) -> None:
    text = f"""
    frames: {{walk: {{steps: [{{{never}}}]}}}}
    cast: {{ann: {{at: [5, 5], facing: up, frame: walk}}}}
    """
    state = play(tmp_path, text, [STILL] * 2)
    assert (state["ann"]["facing"], state["ann"]["state"]) == ("up", "finished")


@pytest.mark.parametrize(
    "frame",
    [
        "{steps: [{do: perform(dance), set: {mood: angry}}]}",
        "{states: {s: {first: [{say: Say bye}], then: [{set: {mood: angry}}]}}}",
    ],
)
def test_what_changes_after_a_line_was_said_does_not_change_its_tone(tmp_path: Path, frame: str) -> None:
    text = f"""
    looks: {{mood: {{for: ann, words: [calm, angry], start: calm}}}}
    let: {{dance: {{sequence: 1, moves: [left], utterance: {{chance: 1}}}}}}
    frames: {{talk: {frame}}}
    cast: {{ann: {{at: [5, 5], frame: talk}}}}
    observe: {{tone: mood}}
    """
    state = play(tmp_path, text, [STILL])
    assert state["heard"][0].startswith("Ann: (calm) Say ")
    assert state["ann"]["looks"] == {"mood": "angry"}


def test_a_rule_may_set_many_registers_to_computed_values(tmp_path: Path) -> None:
    text = """
    state: {a: {for: 1..90, start: 0, range: 0..9}}
    rules: [{set: {a(1..90): t % 7 + abs(t - 3)}}]
    """
    assert play(tmp_path, text, [STILL])["state"]["a"] == {str(key): 3 for key in range(1, 91)}


def test_a_place_may_have_many_parts_and_a_search_others_within(tmp_path: Path) -> None:
    nearest = "agent"
    for name in "abcdefghi":
        nearest = f"nearest({name} in cells to {nearest})"
    text = f"""
    let: {{there: {nearest}}}
    objects: {{coin: {{type: ball, place: {" | ".join(f"row({y})" for y in (1, 2, 3, 4, 5) * 2)}}}}}
    """
    assert play(tmp_path, text, [STILL])["let"]["there"] == [1, 1]


@pytest.mark.parametrize("other", ["nearest(b in balls to coin)", "first(b in balls where b.tagged)"])
@pytest.mark.parametrize("said", [None, "Find balls 1"])
def test_a_slot_is_not_even_unlike_what_is_not_found(tmp_path: Path, other: str, said: str | None) -> None:
    """Neither while the agent is silent, nor while it speaks."""
    text = f"""
    grammar: {{templates: [Find <which>], slots: {{which: balls}}}}
    objects: {{balls: {{type: ball, count: 2, color: red}}, coin: {{type: ball, place: nowhere}}}}
    state: {{unlike: false, other: false}}
    rules:
      - {{when: agent.which != {other}, set: {{unlike: true}}}}
      - {{when: not (agent.which == {other}), set: {{other: true}}}}
    """
    assert play(tmp_path, text, [(None, said)])["state"] == {"unlike": False, "other": False}


@pytest.mark.parametrize("group", ["one | nearest(b in balls to coin)", "nearest(b in balls to coin) | one"])
@pytest.mark.parametrize("asked", ["in", "not in"])
def test_all_that_something_may_be_one_of_is_asked_for(tmp_path: Path, group: str, asked: str) -> None:
    """Also what stands after one that it is."""
    text = f"""
    objects: {{balls: {{type: ball, count: 2, color: red}}, coin: {{type: ball, place: nowhere}}}}
    let: {{one: first(balls)}}
    state: {{held: false}}
    rules: [{{when: one {asked} {group}, set: {{held: true}}}}]
    """
    assert play(tmp_path, text, [STILL])["state"] == {"held": False}


@pytest.mark.parametrize(("one", "other"), [("n", "m"), ("n", "n"), ("which", "whose"), ("which", "which")])
@pytest.mark.parametrize("said", [None, "Give balls 1 and balls 1, 2 of 2"])
def test_what_is_not_said_in_one_slot_is_unlike_what_is_not_in_another(
    tmp_path: Path, one: str, other: str, said: str | None
) -> None:
    text = f"""
    grammar:
      templates: ["Give <which> and <whose>, <n> of <m>"]
      slots: {{which: balls, whose: balls, n: 1..3, m: 1..3}}
    objects: {{balls: {{type: ball, count: 2, color: red}}}}
    state: {{like: false, unlike: false}}
    rules:
      - {{when: agent.{one} == agent.{other}, set: {{like: true}}}}
      - {{when: agent.{one} != agent.{other}, set: {{unlike: true}}}}
    """
    like = said is not None
    assert play(tmp_path, text, [(None, said)])["state"] == {"like": like, "unlike": not like}


def test_who_has_left_the_room_points_at_nothing(tmp_path: Path) -> None:
    text = """
    objects: {coin: {type: ball, at: [4, 5]}, box: {type: box, at: [2, 5]}}
    frames:
      show: {states: {s: {do: point_at(coin)}}}
      straight: {states: {s: {do: point(box)}}}
    cast: {ann: {frame: show, at: [3, 2]}, bob: {frame: straight, at: [2, 2]}}
    state: {ann_points: {start: 0, range: 0..9}, bob_points: {start: 0, range: 0..9}}
    rules:
      - {when: ann.points_at(coin), set: {ann_points: ann_points + 1}}
      - {when: bob.points_at(box), set: {bob_points: bob_points + 1}}
      - {when: t == 2, cause: [ann.vanish, bob.vanish]}
    """
    assert play(tmp_path, text, [STILL] * 4)["state"] == {"ann_points": 2, "bob_points": 2}


@pytest.mark.parametrize("asked", ["==", "!="])
def test_a_conditional_value_that_is_taken_is_there_even_to_be_compared(tmp_path: Path, asked: str) -> None:
    text = f"""
    frames:
      wait:
        let: {{hue: {{start: none}}, who: {{start: none}}, hues: 0, friends: 0, taken: {{start: 9, range: 0..9}}}}
        states:
          s:
            then:
              - {{when: t == 1 and (hue if t > 0 else blue) {asked} red, set: {{hues: 1}}}}
              - {{when: t == 1 and (who if t > 0 else self) {asked} agent, set: {{friends: 1}}}}
              - {{when: t == 2, set: {{hue: red, who: agent}}}}
              - when: t > 2 and (hue if t > 0 else blue) == red and (who if t > 0 else self) == agent
                set: {{taken: 1}}
    cast: {{ann: {{frame: wait}}}}
    """
    found = registers(play(tmp_path, text, [STILL] * 3))
    assert (found["hues"], found["friends"]) == (0, 0), "an empty register was found"
    assert found["taken"] == 1


def test_the_cell_of_what_is_gone_empties_what_may_be_empty(tmp_path: Path) -> None:
    text = """
    objects: {coin: {type: ball, at: [3, 3]}}
    frames:
      note:
        let: {spot: {start: self.cell}, last: {start: none}, alike: false, empty: false, equal: false}
        states:
          s:
            then:
              - {when: t == 2, set: {spot: coin.cell, last: coin.cell}}
              - {when: t == 3 and spot == coin.cell, set: {alike: true}}
              - {when: t == 4 and last == none, set: {empty: true}}
              - {when: t == 5 and last == coin.cell, set: {equal: true}}
    cast: {ann: {frame: note, beliefs: {place: {of: coin.cell}, seen: {of: coin.cell, forget: 9}}}}
    rules: [{when: t == 1, cause: [coin.vanish]}]
    """
    state = play(tmp_path, text, [STILL] * 5)
    found = registers(state)
    assert (found["spot"], found["last"]) == ("nowhere", "none")
    assert (found["alike"], found["empty"], found["equal"]) == (True, True, False)
    assert state["ann"]["believes"] == {"place": "nowhere", "seen": "none"}


@pytest.mark.parametrize("choice", ["nearest(b in boxes to coin)", "first(b in boxes where not coin.gone)"])
def test_who_accepts_on_a_condition_that_finds_nothing_takes_nothing(tmp_path: Path, choice: str) -> None:
    """Though the condition held in an earlier step."""
    text = f"""
    objects: {{coin: {{type: ball, carryable: true, at: [3, 3]}}, boxes: {{type: box, count: 2, at: [[5, 3], [5, 5]]}}}}
    frames: {{hand_over: {{steps: [{{do: fetch(coin)}}, {{do: "give(coin, bob)", for: 4}}]}}}}
    cast:
      ann: {{frame: hand_over, at: [3, 4], facing: up}}
      bob: {{at: [3, 5], accepts: "{choice}.shut"}}
    """
    state = play(tmp_path, text, [STILL] * 5)
    assert state["ann"]["carries"] == "coin"
    assert "carries" not in state["bob"]


LIES_IN_NOTHING = """
objects:
  boxes: {type: box, count: 2, at: [[2, 2], [4, 4]], color: [red, blue]}
  ball: {type: ball, at: [3, 3]}
  coins: {type: ball, count: 2, at: [[5, 1], [5, 2]]}
cast: {ann: {at: [1, 5], beliefs: {it_in: {start: none, of: ball.inside}}}}
state:
  told: {start: none}
  tally: {for: boxes, start: 0, range: 0..9}
rules:
  - {when: t == 2, cause: [ball.move_into(first(b in boxes where b.color == blue))]}
  - {when: t == 4, cause: [ball.reset]}
  - {when: ball.inside == first(boxes) or ball.inside != first(boxes), set: {told: ball.inside.color}}
  - {when: t > 0, set: {tally(ball.inside): tally(ball.inside) + 1}}
  - {when: any(c in coins where c.inside.color == red), cause: [first(coins).move_into(first(boxes))]}
"""


@pytest.mark.parametrize(
    ("steps", "told", "counts", "believes"),
    [
        (1, "none", [0, 0], "none"),
        (2, "blue", [0, 1], "none"),
        (3, "blue", [0, 2], "boxes[1]"),
        (5, "blue", [0, 2], "boxes[1]"),
    ],
)
def test_what_never_lay_in_anything_is_in_no_box(
    tmp_path: Path, steps: int, told: str, counts: list[int], believes: str
) -> None:
    found = play(tmp_path, LIES_IN_NOTHING, [STILL] * steps)
    assert found["state"] == {"told": told, "tally": {f"boxes[{k}]": n for k, n in enumerate(counts)}}
    assert found["ann"]["believes"]["it_in"] == believes


BELOW_ZERO = """
grammar: {templates: [Take <n>], slots: {n: -2..2}}
actions: [left, right, forward]
memory: {odd: {last: 2, while: t % 2 == 1}, latest: {last: 2}}
state: {sum: {for: -2..2, start: it * 10, range: -99..99}, same: 0}
frames:
  listen:
    states: {s: {then: [{hears: Take <n>, when: n < 1, set: {sum(those(k in -2..2 where k <= n)): sum(k) - n}}]}}
cast: {ann: {at: [5, 5], frame: listen}}
rules: [{when: odd == latest, set: {same: same + 1}}]
outcome: [{failure: t == 9}]
"""


def test_numbers_below_zero_are_heard_and_memories_compared_once_both_are_full(tmp_path: Path) -> None:
    acts = [
        ("left", "Take -2"),
        ("left", "Take -1"),
        ("left", "Take -1"),
        ("left", "Take -1"),
        (None, "Take 2"),
    ]
    found = play(tmp_path, BELOW_ZERO, acts)["state"]
    assert found["sum"] == {"-2": -15, "-1": -7, "0": 0, "1": 10, "2": 20}
    assert found["same"] == 1
