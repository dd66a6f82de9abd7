"""ShowMe: what the peer shows and when, what locks the door, when leaving pays, and the version without a peer."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import pytest

from tests.scenarios.playing import (
    CLOSED,
    COLORS,
    DOOR,
    EMPTY,
    LOCKED,
    NPC,
    OPEN,
    SWITCH,
    Episode,
    check_shares,
    evenly,
    interior,
    rooms,
)

NAMES = ["showme+as_coded", "showme"]
ALONE = ["showme_no_social+as_coded", "showme_no_social"]
# Jim needs one turn to look at the agent, who looks at him.
ROOM: dict[str, Any] = {
    "room": {"width": 7, "height": 7},
    "jim": {"at": [2, 3], "facing": "down"},
    "agent": {"at": [5, 3], "facing": "left"},
    "door": {"at": [3, 0], "color": "red"},
    "let": {"correct": "switches[1]"},
}
BY_THE_SWITCHES: dict[str, Any] = {**ROOM, "agent": {"at": [2, 5], "facing": "down"}}


def room_with(correct: int, **changes: Any) -> dict[str, Any]:
    return {**ROOM, "let": {"correct": f"switches[{correct}]"}, **changes}


def switches(episode: Episode) -> list[bool]:
    return [switch["state"] == "pressed" for switch in episode.now()["switches"]]


def door(episode: Episode) -> str:
    return episode.now()["door"]["state"]


def watched(name: str, layout: dict[str, Any] | None = None, seed: int = 0) -> Episode:
    """An episode up to the step in which the peer is gone; the agent only looks for its eyes."""
    episode = Episode(name, layout, seed)
    while not episode.now()["jim"].get("gone"):
        assert episode.act().ended is None
    return episode


def press(episode: Episode, number: int) -> None:
    episode.go_to((number + 1, episode.now()["room"]["height"] - 2))
    episode.face("down")
    episode.act("toggle")


def leave(episode: Episode) -> Any:
    """Opens the door and walks through; what came of that."""
    room, (x, y) = episode.now()["room"], episode.now()["door"]["at"]
    front = min(max(x, 1), room["width"] - 2), max(y, 1)
    episode.go_to(front)
    episode.face("up" if y == 0 else "left" if x == 0 else "right")
    if door(episode) != "open":
        episode.act("toggle")
    return episode.act("forward")


class TestThePeer:
    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("correct", range(3))
    def test_it_asks_to_be_watched_presses_leaves_and_puts_everything_back(
        self, name: str, correct: int
    ) -> None:
        episode = Episode(name, room_with(correct))
        heard, course = [], []
        while not episode.now()["jim"].get("gone"):
            heard.append(episode.act().heard)
            now = episode.now()
            state = (
                now["door"]["state"],
                switches(episode),
                now["jim"]["at"] == now["door"]["at"],
                bool(now["jim"].get("gone")),
            )
            if not course or course[-1] != state:
                course.append(state)
        shown = [number == correct for number in range(3)]
        assert course == [
            ("locked", [False] * 3, False, False),
            ("closed", shown, False, False),
            ("open", shown, False, False),
            ("open", shown, True, False),
            ("locked", [False] * 3, False, True),
        ]
        assert [line for line in heard if line] == ["Jim: Look at me"]

    @pytest.mark.parametrize("name", NAMES)
    def test_it_stays_on_the_door_for_one_step(self, name: str) -> None:
        episode = Episode(name, ROOM)
        on_the_door = 0
        while not episode.now()["jim"].get("gone"):
            episode.act()
            on_the_door += episode.now()["jim"]["at"] == [3, 0]
        assert on_the_door == 1

    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize(("facing", "turns"), [("right", 0), ("down", 1), ("up", 1), ("left", 2)])
    def test_it_looks_after_it_has_turned_and_speaks_in_the_same_step(
        self, name: str, facing: str, turns: int
    ) -> None:
        """Also where its own turn has made the eye contact; it moves from the next step on."""
        episode = Episode(name, {**ROOM, "jim": {"at": [2, 3], "facing": facing}})
        silent = max(turns, 1) - 1
        heard = episode.hears(*[None] * (silent + 1))
        assert [bool(line) for line in heard] == [False] * silent + [True]
        now = episode.now()["jim"]
        assert (now["at"], now["facing"]) == ([2, 3], "right")
        episode.act()
        assert episode.now()["jim"]["facing"] != "right", "the switches are below"

    def test_as_coded_it_stands_still_while_it_says_so(self) -> None:
        room = {**ROOM, "jim": {"at": [2, 3], "facing": "right"}}
        episode = Episode("showme+as_coded", room)
        courses = []
        for _ in range(3):
            heard = episode.act().heard
            courses.append((bool(heard), episode.now()["jim"]["at"], episode.now()["jim"]["facing"]))
        assert courses == [(True, [2, 3], "right"), (False, [2, 3], "down"), (False, [2, 4], "down")]

    @pytest.mark.parametrize("name", NAMES)
    def test_without_eye_contact_it_only_turns(self, name: str) -> None:
        episode = Episode(name, {**ROOM, "agent": {"at": [5, 3], "facing": "up"}})
        assert episode.hears(*[None] * 20) == [""] * 20
        assert (episode.now()["jim"]["at"], episode.now()["jim"]["facing"]) == ([2, 3], "right")
        episode.go_to((5, 5))
        episode.face("left")
        assert episode.hears(*[None] * 5) == [""] * 5, "looking past it is no eye contact"
        assert episode.now()["jim"]["at"] == [2, 3]
        episode.go_to((5, 3))
        episode.face("left")
        assert any(episode.hears(None, None)) or episode.now()["heard"] == ["Jim: Look at me"]

    @pytest.mark.parametrize("name", NAMES)
    def test_once_watched_it_needs_no_more_attention(self, name: str) -> None:
        episode = Episode(name, ROOM)
        episode.acts(None, None, "left")
        while not episode.now()["jim"].get("gone"):
            assert episode.act().heard == ""
        assert episode.now()["t"] < 30

    @pytest.mark.parametrize("name", NAMES)
    def test_words_have_no_effect(self, name: str) -> None:
        silent_course = []
        silent = Episode(name, ROOM)
        for _ in range(40):
            silent.act()
            silent_course.append({**silent.now(), "last": None, "pending": None})
        talking = Episode(name, ROOM)
        for k, state in enumerate(silent_course):
            talking.act(say=("Move your body", "Shake your head")[k % 2])
            assert {**talking.now(), "last": None, "pending": None} == state

    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("correct", range(3))
    def test_if_the_agent_pressed_the_right_switch_it_just_leaves(self, name: str, correct: int) -> None:
        layout = room_with(correct, agent={"at": [correct + 1, 5], "facing": "down"})
        episode = Episode(name, layout)
        episode.act("toggle")
        assert door(episode) == "closed"
        episode.go_to((5, 3), avoid=[[2, 3]])
        episode.face("left")
        while not episode.now()["jim"].get("gone"):
            assert episode.act().ended is None
            assert switches(episode) in ([k == correct for k in range(3)], [False] * 3)

    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize(("correct", "wrong"), [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)])
    def test_a_wrong_switch_pressed_before_loses_the_episode(
        self, name: str, correct: int, wrong: int
    ) -> None:
        episode = Episode(name, room_with(correct, agent={"at": [wrong + 1, 5], "facing": "down"}))
        episode.act("toggle")
        episode.go_to((5, 3), avoid=[[2, 3]])
        episode.face("left")
        step = episode.act()
        while step.ended is None:
            assert door(episode) == "locked"
            step = episode.act()
        assert (step.ended, step.reward) == ("timeout", 0)
        assert switches(episode)[wrong], "it cannot be undone"

    @pytest.mark.parametrize(("correct", "wrong"), [(2, 0), (2, 1), (1, 0), (0, 2)])
    def test_as_coded_it_goes_to_whatever_differs_from_the_password(self, correct: int, wrong: int) -> None:
        episode = Episode(
            "showme+as_coded", room_with(correct, agent={"at": [wrong + 1, 5], "facing": "down"})
        )
        episode.act("toggle")
        episode.go_to((5, 3), avoid=[[2, 3]])
        episode.face("left")
        episode.acts(*[None] * 40)
        assert (episode.now()["jim"]["at"], episode.now()["jim"]["facing"]) == ([wrong + 1, 5], "down")
        assert switches(episode)[correct] == (correct < wrong)

    def test_as_coded_it_goes_back_if_the_door_is_locked_again(self) -> None:
        episode = Episode("showme+as_coded", room_with(0, agent={"at": [3, 3], "facing": "left"}))
        episode.acts(None, None)
        episode.go_to((3, 5))
        episode.face("down")
        while door(episode) == "locked":
            episode.act()
        episode.act("toggle")
        assert (door(episode), switches(episode)) == ("locked", [True, False, True])
        episode.act("left")
        episode.go_to((5, 4))
        episode.acts(*[None] * 30)
        assert episode.now()["jim"]["at"] == [3, 5]

    @pytest.mark.parametrize("name", NAMES)
    def test_it_waits_while_the_agent_stands_in_its_way(self, name: str) -> None:
        layout = room_with(0, jim={"at": [1, 3], "facing": "down"}, agent={"at": [1, 5], "facing": "up"})
        episode = Episode(name, layout)
        episode.acts(*[None] * 20)
        assert episode.now()["heard"] == ["Jim: Look at me"]
        assert switches(episode) == [False] * 3
        episode.go_to((3, 5), avoid=[episode.now()["jim"]["at"]])
        episode.acts(*[None] * 8)
        assert switches(episode) == [True, False, False]

    def test_hidden_it_is_silent_but_the_door_is_seen_to_move(self) -> None:
        episode = Episode("showme+as_coded+unsocial", {**ROOM, "agent": {"at": [3, 3], "facing": "left"}})
        heard = episode.hears(None, None, "right")
        assert heard == [""] * 3
        seen = []
        while not episode.now()["jim"].get("gone"):
            assert episode.act().heard == ""
            seen.append(episode.seen((3, 0))[2])
            assert episode.image[..., 0].max() != NPC
        assert set(seen) == {OPEN, CLOSED, LOCKED}


class TestTheDoor:
    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("pressed", list(product([False, True], repeat=3)))
    def test_it_is_unlocked_by_the_right_switch_alone(self, name: str, pressed: tuple[bool, ...]) -> None:
        episode = Episode(name, {**ROOM, "agent": {"at": [1, 5], "facing": "right"}})
        for number in range(3):
            if pressed[number]:
                press(episode, number)
        assert switches(episode) == list(pressed)
        assert door(episode) == ("closed" if pressed == (False, True, False) else "locked")

    @pytest.mark.parametrize("name", NAMES)
    def test_switches_stay_pressed_and_dark(self, name: str) -> None:
        episode = Episode(name, BY_THE_SWITCHES)
        for _ in range(3):
            episode.act("toggle")
            assert switches(episode) == [False, True, False]
            for x, color in ((1, "blue"), (2, "green"), (3, "grey")):
                assert episode.seen((x, 6)) == (SWITCH, COLORS.index(color), 0, 0)

    @pytest.mark.parametrize("name", NAMES)
    def test_an_open_door_is_locked_again_by_another_switch(self, name: str) -> None:
        episode = Episode(name, {**ROOM, "agent": {"at": [3, 5], "facing": "left"}})
        press(episode, 1)
        episode.go_to((3, 1))
        episode.face("up")
        episode.act("toggle")
        assert door(episode) == "open"
        press(episode, 2)
        assert door(episode) == "locked"
        episode.go_to((3, 1))
        episode.face("up")
        assert episode.acts("toggle", "forward").ended is None
        assert (door(episode), episode.now()["agent"]["at"]) == ("locked", [3, 1])

    @pytest.mark.parametrize("name", NAMES)
    def test_a_locked_door_ignores_toggles(self, name: str) -> None:
        episode = Episode(name, {**ROOM, "agent": {"at": [3, 1], "facing": "up"}})
        assert episode.acts("toggle", "forward", "toggle").ended is None
        assert (door(episode), episode.now()["agent"]["at"]) == ("locked", [3, 1])

    @pytest.mark.parametrize(("name", "late"), [("showme+as_coded", True), ("showme", False)])
    def test_as_coded_its_unlocking_is_seen_one_step_late(self, name: str, late: bool) -> None:
        # By the agent, who sees the door beside it.
        layout = {
            "room": {"width": 5, "height": 5},
            "door": {"at": [0, 3]},
            "let": {"correct": "switches[1]"},
        }
        episode = Episode(name, {**layout, "jim": {"at": [3, 1]}, "agent": {"at": [2, 3], "facing": "down"}})
        episode.face("down")
        assert episode.seen((0, 3))[:3:2] == (DOOR, LOCKED)
        episode.act("toggle")
        assert door(episode) == "closed"
        assert episode.seen((0, 3))[2] == (LOCKED if late else CLOSED)
        episode.act()
        assert episode.seen((0, 3))[2] == CLOSED

    @pytest.mark.parametrize(("name", "late"), [("showme+as_coded", 1), ("showme", 0)])
    def test_as_coded_what_the_peer_does_is_seen_one_step_late(self, name: str, late: int) -> None:
        layout = {
            "room": {"width": 5, "height": 5},
            "door": {"at": [2, 0]},
            "jim": {"at": [1, 2], "facing": "right"},
            "agent": {"at": [3, 2], "facing": "left"},
            "let": {"correct": "switches[0]"},
        }
        episode = Episode(name, layout)
        episode.act()
        episode.act("right")
        states, shown, figures = [], [], []
        codes = {"open": OPEN, "closed": CLOSED, "locked": LOCKED}
        for _ in range(14):
            episode.act()
            states.append(codes[door(episode)])
            shown.append(episode.seen((2, 0))[2])
            figures.append((episode.seen((2, 1))[0] == NPC, episode.now()["jim"]["at"] == [2, 1]))
        assert len(set(states)) == 3
        assert shown[late:] == states[: len(states) - late]
        assert [seen for seen, _ in figures][late:] == [is_there for _, is_there in figures][: 14 - late]


class TestOutcome:
    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("correct", range(3))
    def test_who_does_as_the_peer_did_is_paid(self, name: str, correct: int) -> None:
        episode = watched(name, room_with(correct))
        press(episode, correct)
        step = leave(episode)
        assert (step.ended, step.reward) == ("success", pytest.approx(1 - 0.9 * episode.now()["t"] / 100))

    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("wrong", [0, 2])
    def test_another_switch_opens_nothing(self, name: str, wrong: int) -> None:
        episode = watched(name, ROOM)
        press(episode, wrong)
        assert door(episode) == "locked"
        press(episode, 1)
        assert door(episode) == "locked"
        assert leave(episode).ended is None

    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize(("place", "way"), [([1, 0], ["forward"]), ([0, 1], ["forward", "left"])])
    def test_leaving_before_the_peer_fails(self, name: str, place: list[int], way: list[str]) -> None:
        layout = room_with(0, jim={"at": [5, 3]}, agent={"at": [1, 5], "facing": "down"}, door={"at": place})
        episode = Episode(name, layout)
        episode.acts("toggle", "left", "left", "forward", "forward", "forward", *way, "toggle")
        assert episode.now()["heard"] == []
        step = episode.act("forward")
        assert (step.ended, step.reward) == ("failure", 0)

    @pytest.mark.parametrize("name", NAMES)
    def test_leaving_by_what_the_peer_unlocked_before_it_does_fails(self, name: str) -> None:
        episode = Episode(name, {**ROOM, "agent": {"at": [4, 3], "facing": "left"}})
        episode.acts(None, None)
        episode.go_to((3, 1))
        episode.face("up")
        while door(episode) == "locked":
            episode.act()
        step = episode.acts("toggle", "forward")
        assert (step.ended, step.reward) == ("failure", 0)

    @pytest.mark.parametrize("name", NAMES)
    def test_nobody_can_slip_out_behind_the_peer(self, name: str) -> None:
        layout = room_with(0, jim={"at": [2, 1], "facing": "right"}, agent={"at": [4, 1], "facing": "left"})
        episode = Episode(name, layout)
        while episode.now()["jim"]["at"] != [3, 0]:
            episode.act()
        assert episode.act("forward").ended is None
        assert episode.now()["agent"]["at"] == [3, 1]
        assert (door(episode), episode.now()["jim"].get("gone")) == ("locked", True)

    @pytest.mark.parametrize("name", [*NAMES, *ALONE])
    def test_done_and_time(self, name: str) -> None:
        step = Episode(name).act("done")
        assert (step.ended, step.reward) == ("failure", 0)
        episode = Episode(name)
        assert all(episode.act("pickup" if k % 2 else "drop").ended is None for k in range(99))
        assert episode.act().ended == "timeout"


def walls(room: dict[str, Any]) -> Iterator[tuple[str, int]]:
    """The wall and place of the door."""
    (x, y), last = room["door"]["at"], room["room"]["width"] - 1
    wall = {0: "left", last: "right"}.get(x, "top")
    assert wall != "top" or y == 0
    yield wall, x if wall == "top" else y


class TestRooms:
    @pytest.mark.parametrize("name", [NAMES[0], ALONE[0]])
    def test_as_coded_the_door_is_in_one_of_three_walls(self, name: str) -> None:
        drawn = list(rooms(name, 4000))
        places = [place for room in drawn for place in walls(room)]
        check_shares((wall for wall, _ in places), evenly(("top", "left", "right")))
        wide = [place for room in drawn if room["room"]["width"] == 8 for place in walls(room)]
        check_shares((x for wall, x in wide if wall == "top"), evenly(range(1, 7)))
        high = [place for room in drawn if room["room"]["height"] == 8 for place in walls(room)]
        for side in ("left", "right"):
            check_shares((y for wall, y in high if wall == side), evenly(range(1, 7)))

    @pytest.mark.parametrize("name", [NAMES[1], ALONE[1]])
    def test_as_in_the_paper_it_is_in_the_top_wall(self, name: str) -> None:
        drawn = [room for room in rooms(name, 2000) if room["room"]["width"] == 7]
        check_shares((tuple(room["door"]["at"]) for room in drawn), evenly((x, 0) for x in range(1, 6)))

    @pytest.mark.parametrize("name", [*NAMES, *ALONE])
    def test_switches_and_door(self, name: str) -> None:
        drawn = list(rooms(name, 2000))
        for room in drawn:
            bottom = room["room"]["height"] - 1
            assert [switch["at"] for switch in room["switches"]] == [[x, bottom] for x in (1, 2, 3)]
            assert [switch["color"] for switch in room["switches"]] == ["blue", "green", "grey"]
            assert room["door"]["state"] == "locked"
        check_shares((room["let"]["correct"] for room in drawn), evenly(f"switches[{k}]" for k in range(3)))
        check_shares((room["door"]["color"] for room in drawn), evenly(COLORS))

    @pytest.mark.parametrize("name", NAMES)
    def test_the_peer_leaves_the_lowest_row_free(self, name: str) -> None:
        drawn = list(rooms(name, 4000))
        small = [room for room in drawn if room["room"] == {"width": 5, "height": 5}]
        cells = evenly((x, y) for x in (1, 2, 3) for y in (1, 2))
        check_shares((tuple(room["jim"]["at"]) for room in small), cells)
        for room in drawn:
            assert tuple(room["agent"]["at"]) in interior(room["room"]) - {tuple(room["jim"]["at"])}
            assert room["jim"]["facing"] == "down"
        check_shares((room["jim"]["color"] for room in drawn), evenly(COLORS))


class TestWithoutAPeer:
    @staticmethod
    def lit(episode: Episode) -> list[int]:
        """The switches as the agent, who stands before the middle one, sees them."""
        return [episode.seen((x, 4))[2] for x in (1, 2, 3)]

    @staticmethod
    def small(correct: int) -> dict[str, Any]:
        return {
            "room": {"width": 5, "height": 5},
            "door": {"at": [2, 0]},
            "agent": {"at": [2, 3], "facing": "down"},
            "let": {"correct": f"switches[{correct}]"},
        }

    @pytest.mark.parametrize(("name", "late"), [(ALONE[0], 1), (ALONE[1], 0)])
    @pytest.mark.parametrize("correct", range(3))
    def test_the_right_switch_is_lit_for_ten_steps(self, name: str, late: int, correct: int) -> None:
        episode = Episode(name, self.small(correct))
        light = [int(number == correct) for number in range(3)]
        assert self.lit(episode) == light
        for t in range(1, 15):
            episode.act()
            assert episode.now()["t"] == t
            assert switches(episode) == [bool(one) and t < 10 for one in light]
            assert door(episode) == "locked"
            assert self.lit(episode) == (light if t < 10 + late else [0, 0, 0]), t

    @pytest.mark.parametrize("name", ALONE)
    def test_what_is_pressed_by_step_ten_goes_out_again(self, name: str) -> None:
        for t in (2, 9, 10):
            episode = Episode(name, self.small(1))
            episode.acts(*[None] * (t - 1))
            episode.act("toggle")
            episode.acts(*[None] * (12 - t))
            assert (switches(episode), door(episode)) == ([False] * 3, "locked")

    @pytest.mark.parametrize("name", ALONE)
    def test_from_step_eleven_the_right_switch_unlocks(self, name: str) -> None:
        episode = Episode(name, self.small(1))
        episode.acts(*[None] * 10, "toggle")
        assert (switches(episode), door(episode)) == ([False, True, False], "closed")
        assert self.lit(episode) == [0, 1, 0], "the agent sees its own press at once"
        assert leave(episode).ended == "success"

    @pytest.mark.parametrize("name", ALONE)
    def test_a_wrong_switch_spoils_it(self, name: str) -> None:
        episode = Episode(name, self.small(0))
        episode.acts(*[None] * 10, "toggle")
        press(episode, 0)
        assert (switches(episode), door(episode)) == ([True, True, False], "locked")

    @pytest.mark.parametrize("name", ALONE)
    def test_who_remembers_is_paid(self, name: str) -> None:
        for seed in range(100):
            episode = Episode(name, seed=seed)
            correct = int(episode.now()["let"]["correct"][9])
            episode.acts(*[None] * 10)
            press(episode, correct)
            step = leave(episode)
            assert (step.ended, step.reward) == ("success", pytest.approx(1 - 0.9 * episode.now()["t"] / 100))

    @pytest.mark.parametrize("name", ALONE)
    def test_nobody_is_there_and_nothing_is_heard(self, name: str) -> None:
        episode = Episode(name, self.small(0))
        assert "jim" not in episode.now()
        assert episode.hears(*[None] * 30) == [""] * 30
        assert episode.seen((1, 3)) == EMPTY
