"""TalkItOut: what is drawn, who answers what, which door pays, what the agent sees and reads."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from tests.scenarios.playing import (
    EMPTY,
    Episode,
    beside,
    check_shares,
    evenly,
    interior,
    reachable,
    rooms,
)

ASK, GREET, OPEN_SESAME = "Where is the exit", "How are you", "Open sesame"
# Everybody stands apart, so that one at a time hears the agent; John is honest, the second door is right.
APART: dict[str, Any] = {
    "room": {"width": 8, "height": 8},
    "agent": {"at": [2, 1], "facing": "down"},
    "wizard": {"at": [1, 1], "facing": "down", "color": "red"},
    "honest": {"at": [6, 1], "color": "blue", "name": "John"},
    "liar": {"at": [1, 6], "color": "green", "name": "Jack"},
    "doors": [
        {"at": [3, 0], "color": "red"},
        {"at": [3, 7], "color": "green"},
        {"at": [0, 4], "color": "blue"},
        {"at": [7, 4], "color": "grey"},
    ],
    "let": {"exit": "doors[1]"},
}


def apart(x: int, y: int, facing: str = "down", **changes: Any) -> Episode:
    """An episode in that room, with the agent elsewhere in it."""
    return Episode("talkitout", {**APART, "agent": {"at": [x, y], "facing": facing}, **changes})


def front(room: dict[str, Any], door: dict[str, Any]) -> tuple[int, int]:
    """The cell before a door in the wall."""
    (cell,) = {beside(door["at"], way) for way in ("up", "down", "left", "right")} & interior(room["room"])
    return cell


@pytest.fixture(scope="module")
def drawn() -> list[dict[str, Any]]:
    """Many rooms."""
    return list(rooms("talkitout", 2000))


class TestRooms:
    def test_a_door_in_each_wall_away_from_the_corners(self, drawn: list[dict[str, Any]]) -> None:
        for room in drawn:
            width, height = room["room"]["width"], room["room"]["height"]
            top, bottom, left, right = (door["at"] for door in room["doors"])
            assert (top[1], bottom[1], left[0], right[0]) == (0, height - 1, 0, width - 1)
            assert all(2 <= x <= width - 3 for x in (top[0], bottom[0]))
            assert all(2 <= y <= height - 3 for y in (left[1], right[1]))
            assert len({door["color"] for door in room["doors"]}) == 4

    def test_npcs_leave_doors_free_and_stand_apart(self, drawn: list[dict[str, Any]]) -> None:
        for room in drawn:
            cells = [tuple(room[name]["at"]) for name in ("wizard", "honest", "liar", "agent")]
            assert len(set(cells)) == 4
            assert not set(cells[:3]) & {front(room, door) for door in room["doors"]}

    def test_the_guides_are_told_apart_by_name_and_colour(self, drawn: list[dict[str, Any]]) -> None:
        for room in drawn:
            assert {room["honest"]["name"], room["liar"]["name"]} == {"John", "Jack"}
            assert room["honest"]["color"] != room["liar"]["color"]
        check_shares((room["honest"]["name"] for room in drawn), evenly(["John", "Jack"]))

    def test_sizes_and_exits_are_even(self, drawn: list[dict[str, Any]]) -> None:
        sizes = [(width, height) for width in range(5, 9) for height in range(5, 9)]
        check_shares(((room["room"]["width"], room["room"]["height"]) for room in drawn), evenly(sizes))
        check_shares((room["let"]["exit"] for room in drawn), evenly(f"doors[{k}]" for k in range(4)))
        check_shares((room["agent"]["facing"] for room in drawn), evenly(["right", "down", "left", "up"]))

    def test_shares_that_were_measured_on_the_research_code(self, drawn: list[dict[str, Any]]) -> None:
        at_a_door = walled_in = 0
        for room in drawn:
            fronts = [front(room, door) for door in room["doors"]]
            free = interior(room["room"]) - {tuple(room[name]["at"]) for name in ("wizard", "honest", "liar")}
            at_a_door += tuple(room["agent"]["at"]) in fronts
            exit_ = fronts[int(room["let"]["exit"][6])]
            walled_in += exit_ not in reachable(room["agent"]["at"], free)
        assert 0.26 < at_a_door / len(drawn) < 0.32, "29 % of agents start in front of a door"
        assert 0.022 < walled_in / len(drawn) < 0.046, "3.4 % of exits are walled in"


class TestDialogue:
    def test_the_liar_names_each_wrong_door_anew_and_never_the_right_one(self) -> None:
        play = apart(2, 6)
        play.act(say=GREET)
        lies = [play.act(say=ASK).heard for _ in range(60)]
        check_shares(lies, evenly(f"Jack: Go to the {color} door." for color in ("red", "blue", "grey")))


class TestEnd:
    @pytest.mark.parametrize("body", [None, "toggle", "done"])
    def test_the_right_door_pays_whatever_the_body_does(self, body: str | None) -> None:
        step = apart(3, 6).act(body, OPEN_SESAME)
        assert (step.ended, step.reward) == ("success", pytest.approx(1 - 0.9 / 100))

    @pytest.mark.parametrize("cell", [(3, 1), (1, 4), (6, 4)])
    def test_the_others_do_not(self, cell: tuple[int, int]) -> None:
        step = apart(*cell).act(say=OPEN_SESAME)
        assert (step.ended, step.reward) == ("failure", 0)

    @pytest.mark.parametrize("body", ["left", "right", "forward", "pickup", "drop", "toggle", "done", None])
    def test_toggle_and_done_end_it(self, body: str | None) -> None:
        step = apart(4, 4).act(body)
        assert (step.ended, step.reward) == ("failure" if body in ("toggle", "done") else None, 0)

    def test_a_success_in_the_last_step_is_paid(self) -> None:
        play = apart(3, 6)
        play.acts(*[None] * 99)
        step = play.act(say=OPEN_SESAME)
        assert (step.ended, step.reward) == ("success", pytest.approx(0.1))


class TestPerception:
    def test_visible_npcs_are_in_the_way_and_hidden_ones_silent_unseen_and_passable(self) -> None:
        play = apart(2, 1, "left")
        play.act("forward")
        assert play.now()["agent"]["at"] == [2, 1]
        hidden = Episode("talkitout+unsocial", {**APART, "agent": {"at": [2, 1], "facing": "left"}})
        assert hidden.seen((1, 1)) == EMPTY
        assert hidden.act(say=GREET).heard == ""
        assert hidden.now()["wizard"]["state"] == "acquainted", "it goes on acting"
        hidden.act("forward")
        assert hidden.now()["agent"]["at"] == [1, 1]

    def test_words_of_the_history_drop_out_by_whole_utterances(self) -> None:
        env = sd.make("talkitout").unwrapped
        words = env.program.vocabulary  # type: ignore[attr-defined]
        assert words[2:5] == ("where", "is", "open")
        env.reset(seed=0, options={"layout": APART})
        kept = []
        for text in (GREET, *[ASK] * 85):
            tokens = env.step(env.encode_action((None, text)))[0]["tokens"]  # type: ignore[attr-defined]
            kept.append([words[token] for token in tokens if token])
        assert kept[0] == ["gandalf", "i", "am", "fine"]
        assert kept[1] == [*kept[0], "gandalf", "ask", "john"]
        assert len(tokens) == 256
        assert kept[-1] == ["gandalf", "ask", "john"] * 85


def test_as_coded_is_the_same_task_in_other_words() -> None:
    """The same pictures, lines with words at the same places of the vocabulary, and rewards, whatever is done."""
    plain, coded = (sd.make_vec(f"talkitout{variant}", num_envs=16) for variant in ("", "+as_coded"))
    rng, sizes = np.random.default_rng(0), plain.single_action_space.nvec
    for envs in (plain, coded):
        envs.reset(seed=3)
    for _ in range(60):
        acts = rng.integers(0, sizes, (16, len(sizes)))
        acts[:, 0] %= 3
        (one, reward, *_), (other, paid, *_) = plain.step(acts), coded.step(acts)
        assert all(np.array_equal(one[part], other[part]) for part in one)
        assert np.array_equal(reward, paid)
