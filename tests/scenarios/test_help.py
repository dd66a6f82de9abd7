"""Help: who has to look where in either role, which door is meant, what ends it and what pays."""

from __future__ import annotations

import random
from typing import Any

import pytest

from tests.scenarios.playing import (
    CLOSED,
    COLORS,
    DOOR,
    EMPTY,
    LAVA,
    LOCKED,
    NPC,
    SWITCH,
    Episode,
    Step,
    beside,
    check_shares,
    distance,
    evenly,
    interior,
    rooms,
)

EXITER = ["help+as_coded", "help"]
HELPER = ["help_as_helper+as_coded", "help_as_helper"]
# The exiter stands before the upper door, Jill one step from her place at the upper switch.
ROOM: dict[str, Any] = {
    "room": {"width": 7, "height": 7},
    "jill": {"at": [2, 1], "facing": "left"},
    "agent": {"at": [5, 1], "facing": "left"},
    "doors": [{"color": "red"}, {"color": "blue"}],
}
# The helper stands before the upper switch, Jill one step from her place at the upper door.
OTHER_ROOM: dict[str, Any] = {
    "room": {"width": 7, "height": 7},
    "jill": {"at": [4, 1], "facing": "right"},
    "agent": {"at": [1, 1], "facing": "right"},
    "let": {"jill.goal": "doors[0]"},
}


def pressed(episode: Episode) -> list[bool]:
    return [switch["state"] == "pressed" for switch in episode.now()["switches"]]


def doors(episode: Episode) -> list[str]:
    return [door["state"] for door in episode.now()["doors"]]


def look_at_each_other(episode: Episode) -> bool:
    return mutual_look(episode.now())


def mutual_look(room: dict[str, Any]) -> bool:
    (left, facing_right), (right, facing_left) = sorted(
        (room[who]["at"], room[who]["facing"]) for who in ("agent", "jill")
    )
    return left[1] == right[1] and (facing_right, facing_left) == ("right", "left")


def agreed(name: str = "help+as_coded", layout: dict[str, Any] = ROOM) -> Episode:
    """An episode up to the step of eye contact."""
    episode = Episode(name, layout)
    while not (look_at_each_other(episode) and episode.now()["jill"]["at"][0] == 1):
        episode.act()
    return episode


class TestExiter:
    @pytest.mark.parametrize("name", EXITER)
    def test_eye_contact_then_the_door_opens(self, name: str) -> None:
        episode = agreed(name)
        assert pressed(episode) == [False, False]
        episode.acts("right", "right")
        for _ in range(2):
            episode.act()
        assert (pressed(episode), doors(episode)) == ([True, False], ["closed", "locked"])
        t = episode.now()["t"]
        step = episode.acts("toggle", "forward")
        assert (step.ended, step.reward) == ("success", pytest.approx(1 - 0.9 * (t + 2) / 20))

    def test_as_coded_who_only_looks_at_the_helper_gets_no_door(self) -> None:
        for seed in range(200):
            height, x = 5 + seed % 4, 5 + seed // 4 % 2
            agent = {"at": [x, (1, height - 2)[seed // 8 % 2]], "facing": "left"}
            layout = {"room": {"width": 8, "height": height}, "agent": agent}
            episode = Episode("help+as_coded", layout, seed)
            assert episode.acts(*[None] * 20).ended == "timeout"
            assert pressed(episode) == [False, False]
            assert episode.now()["jill"]["state"] == "pressing", "there was eye contact"

    def test_as_in_the_paper_eye_contact_is_enough(self) -> None:
        episode = agreed("help")
        while pressed(episode) == [False, False]:
            episode.act()
        assert pressed(episode) == [True, False]
        assert episode.now()["agent"]["facing"] == "left"

    @pytest.mark.parametrize("name", EXITER)
    def test_who_never_looks_at_the_helper_gets_no_door(self, name: str) -> None:
        for facing in ("right", "up", "down"):
            episode = Episode(name, {**ROOM, "agent": {"at": [5, 1], "facing": facing}})
            assert episode.acts(*[None] * 20).ended == "timeout"
            assert pressed(episode) == [False, False]

    def test_as_coded_the_agent_must_look_at_the_door_itself(self) -> None:
        episode = agreed()
        episode.act("left")
        episode.acts(*[None] * 5)
        assert pressed(episode) == [False, False], "looking at the wall"
        episode.act("left")
        assert pressed(episode) == [True, False]

    def test_as_coded_the_door_is_the_cell_ahead(self) -> None:
        episode = agreed(layout={**ROOM, "agent": {"at": [4, 1], "facing": "left"}})
        episode.acts("right", "right", *[None] * 5)
        assert (episode.now()["agent"]["facing"], pressed(episode)) == ("right", [False, False])
        episode.act("forward")
        assert pressed(episode) == [True, False]

    def test_eye_contact_counts_only_at_the_switch(self) -> None:
        # They look at each other at the start; she goes on to her switch, and nothing is agreed.
        layout = {
            **ROOM,
            "jill": {"at": [2, 5], "facing": "right"},
            "agent": {"at": [5, 5], "facing": "left"},
        }
        episode = Episode("help+as_coded", layout)
        assert look_at_each_other(episode)
        episode.act("right")
        episode.act("right")
        episode.acts(*[None] * 12)
        assert episode.now()["jill"]["at"] == [1, 5]
        assert pressed(episode) == [False, False]

    @pytest.mark.parametrize("name", EXITER)
    @pytest.mark.parametrize("number", [0, 1])
    def test_either_door(self, name: str, number: int) -> None:
        y = (1, 5)[number]
        layout = {**ROOM, "jill": {"at": [2, y]}, "agent": {"at": [5, y], "facing": "left"}}
        episode = agreed(name, layout)
        episode.acts("right", "right", None, None)
        assert pressed(episode) == [k == number for k in range(2)]
        assert episode.acts("toggle", "forward").ended == "success"

    @pytest.mark.parametrize("name", EXITER)
    def test_she_waits_at_the_switch_of_the_door_nearest_to_the_agent(self, name: str) -> None:
        for y, door in [(1, 0), (2, 0), (3, 0), (4, 1), (5, 1)]:
            episode = Episode(name, {**ROOM, "agent": {"at": [4, y], "facing": "down"}})
            episode.acts(*[None] * 12)
            assert episode.now()["jill"]["at"] == [1, (1, 5)[door]], "the upper one of two equally near"

    @pytest.mark.parametrize("name", EXITER)
    def test_she_goes_over_when_the_agent_does(self, name: str) -> None:
        episode = Episode(name, {**ROOM, "agent": {"at": [5, 1], "facing": "down"}})
        episode.acts(None, None, None)
        assert episode.now()["jill"]["at"] == [1, 1]
        episode.acts(*["forward"] * 4, *[None] * 4)
        assert episode.now()["jill"]["at"] == [1, 5]

    def test_as_coded_eye_contact_is_not_forgotten_at_the_other_door(self) -> None:
        episode = agreed()
        episode.go_to((5, 5))
        episode.face("right")
        while pressed(episode) == [False, False]:
            assert episode.act().ended is None
        assert pressed(episode) == [False, True]
        assert episode.acts("toggle", "forward").ended == "success"

    @pytest.mark.parametrize("name", EXITER)
    def test_both_switches_end_it(self, name: str) -> None:
        episode = agreed(name)
        episode.acts("right", "right", None, None)
        assert pressed(episode) == [True, False]
        episode.acts("right", *["forward"] * 4, "left")
        step = episode.act()
        while step.ended is None:
            step = episode.act()
        assert (step.ended, step.reward, pressed(episode)) == ("failure", 0, [True, True])
        assert episode.now()["t"] < 20

    @pytest.mark.parametrize("name", [*EXITER, *HELPER])
    def test_done_and_time(self, name: str) -> None:
        step = Episode(name).act("done")
        assert (step.ended, step.reward) == ("failure", 0)
        episode = Episode(name, {"agent": {"facing": "up"}})
        assert all(episode.act("pickup" if k % 2 else "drop").ended is None for k in range(19))
        assert episode.act().ended == "timeout"

    @pytest.mark.parametrize("name", EXITER)
    def test_the_exiter_on_its_door_loses_by_done_all_the_same(self, name: str) -> None:
        episode = agreed(name)
        episode.acts("right", "right", None, None, "toggle")
        assert doors(episode)[0] == "open"
        assert episode.act("done").ended == "failure"

    @pytest.mark.parametrize("name", [*EXITER, *HELPER])
    def test_lava_is_deadly(self, name: str) -> None:
        for y in range(1, 6):
            at, facing = ([4, y], "left") if name in EXITER else ([2, y], "right")
            other = {"jill": {"at": [1 if name in EXITER else 5, 2], "facing": "down"}}
            episode = Episode(
                name, {"room": {"width": 7, "height": 7}, "agent": {"at": at, "facing": facing}, **other}
            )
            assert episode.seen((3, y)) == LAVA
            step = episode.act("forward")
            assert (step.ended, step.reward) == ("failure", 0)

    @pytest.mark.parametrize("name", EXITER)
    def test_she_keeps_off_the_lava(self, name: str) -> None:
        for seed in range(100):
            episode = Episode(name, seed=seed)
            for k in range(20):
                episode.act("left" if k % 2 else "right")
                assert episode.now()["jill"]["at"][0] < episode.now()["room"]["width"] // 2

    @pytest.mark.parametrize(("name", "late"), [("help+as_coded", True), ("help", False)])
    def test_as_coded_the_unlocking_is_seen_one_step_late(self, name: str, late: bool) -> None:
        episode = agreed(name)
        episode.acts("right", "right")
        shown: list[tuple[bool, int]] = [(False, LOCKED)]
        while shown[-1] != (True, CLOSED):
            episode.act()
            kind, color, state, _ = episode.seen((6, 1))
            assert (kind, COLORS[color]) == (DOOR, "red")
            shown.append((pressed(episode)[0], state))
        assert ((True, LOCKED) in shown) == late

    @pytest.mark.parametrize("name", EXITER)
    def test_a_locked_door_ignores_toggles(self, name: str) -> None:
        episode = Episode(name, {**ROOM, "agent": {"at": [5, 1], "facing": "right"}})
        assert episode.acts("toggle", "forward", "toggle").ended is None
        assert doors(episode) == ["locked", "locked"]
        assert episode.now()["agent"]["at"] == [5, 1]

    @pytest.mark.parametrize("name", EXITER)
    def test_nothing_is_said_and_words_have_no_effect(self, name: str) -> None:
        episode = Episode(name, ROOM)
        assert [episode.act(say="Move your head").heard for _ in range(19)] == [""] * 19

    def test_as_coded_who_knows_how_always_gets_out(self) -> None:
        lengths = []
        for seed in range(400):
            episode = Episode("help+as_coded", seed=seed)
            assert exits(episode).ended == "success"
            lengths.append(episode.now()["t"])
        assert 6 <= min(lengths) <= max(lengths) <= 17

    def test_hidden_she_still_unlocks(self) -> None:
        episode = agreed("help+as_coded+unsocial")
        assert episode.seen((1, 1)) == EMPTY
        episode.acts("right", "right", None, None)
        assert episode.seen((6, 1))[2] == CLOSED
        assert episode.acts("toggle", "forward").ended == "success"


def exits(episode: Episode) -> Step:
    """What becomes of an exiter who goes to the nearest door, waits for eye contact and for the door."""
    now = episode.now()
    number = min((0, 1), key=lambda k: distance(now["agent"]["at"], now["doors"][k]["at"]))
    x, y = now["doors"][number]["at"]
    episode.go_to((x - 1, y))
    episode.face("left")
    while not (look_at_each_other(episode) and episode.now()["jill"]["at"][0] == 1):
        episode.act()
    episode.face("right")
    while doors(episode)[number] == "locked":
        episode.act()
    return episode.acts("toggle", "forward")


def help_out(episode: Episode, last: str | None = None) -> Step:
    """What becomes of a helper who waits for eye contact in the row of the exiter's door and presses."""
    number = int(episode.now()["let"]["jill.goal"][6])
    x, y = episode.now()["switches"][number]["at"]
    episode.go_to((x + 1, y))
    episode.face("right")
    door = episode.now()["doors"][number]["at"]
    while not (look_at_each_other(episode) and episode.now()["jill"]["at"] == [door[0] - 1, y]):
        episode.act()
    episode.face("left")
    step = episode.act("toggle")
    while step.ended is None:
        ready = episode.now()["jill"]["facing"] == "right" and doors(episode)[number] == "open"
        step = episode.act(last if ready else None)
    return step


class TestHelper:
    @pytest.mark.parametrize("name", HELPER)
    def test_eye_contact_then_the_switch(self, name: str) -> None:
        lengths = []
        for seed in range(400):
            episode = Episode(name, seed=seed)
            step = help_out(episode)
            lengths.append(episode.now()["t"])
            assert (step.ended, step.reward) == ("success", pytest.approx(1 - 0.9 * lengths[-1] / 20))
        assert abs(sum(lengths) / 400 - 9.65) < 0.5, "what the same script took in the original"

    @pytest.mark.parametrize("name", HELPER)
    def test_without_eye_contact_nobody_is_helped(self, name: str) -> None:
        for seed in range(200):
            episode = Episode(name, {"agent": {"facing": "left"}}, seed)
            number = int(episode.now()["let"]["jill.goal"][6])
            x, y = episode.now()["switches"][number]["at"]
            episode.go_to((x + 1, y))
            episode.face("left")
            step = episode.act("toggle")
            assert doors(episode)[number] == "closed"
            while step.ended is None:
                step = episode.act()
            assert step.ended == "timeout"
            assert doors(episode)[number] == "closed"

    @pytest.mark.parametrize("name", HELPER)
    def test_the_switch_first_and_then_eye_contact_will_do(self, name: str) -> None:
        episode = Episode(name, {**OTHER_ROOM, "agent": {"at": [1, 1], "facing": "left"}})
        episode.acts("toggle", "right", "right")
        step = episode.act()
        while step.ended is None:
            step = episode.act()
        assert step.ended == "success"

    @pytest.mark.parametrize("name", HELPER)
    def test_the_wrong_switch_helps_nobody(self, name: str) -> None:
        episode = Episode(name, OTHER_ROOM)
        while not look_at_each_other(episode) or episode.now()["jill"]["at"] != [5, 1]:
            episode.act()
        episode.acts("right", *["forward"] * 4, "right")
        step = episode.act("toggle")
        assert (pressed(episode), doors(episode)) == ([False, True], ["locked", "closed"])
        while step.ended is None:
            step = episode.act()
        assert step.ended == "timeout"
        assert doors(episode)[0] == "locked", "she tries it in vain"
        assert episode.now()["jill"]["facing"] == "right"

    @pytest.mark.parametrize("name", HELPER)
    def test_both_switches_end_it(self, name: str) -> None:
        episode = Episode(name, {**OTHER_ROOM, "agent": {"at": [1, 1], "facing": "left"}})
        assert episode.acts("toggle", "left", *["forward"] * 4, "right").ended is None
        step = episode.act("toggle")
        assert (step.ended, step.reward, pressed(episode)) == ("failure", 0, [True, True])

    @pytest.mark.parametrize("name", HELPER)
    def test_done_in_the_very_step_in_which_she_leaves_forfeits_it(self, name: str) -> None:
        for seed in range(100):
            paid = Episode(name, seed=seed)
            assert help_out(paid).ended == "success"
            t = paid.now()["t"]
            forfeited = Episode(name, seed=seed)
            step = help_out(forfeited, "done")
            assert (step.ended, step.reward, forfeited.now()["t"]) == ("failure", 0, t)
            assert forfeited.now()["jill"]["at"] in [door["at"] for door in forfeited.now()["doors"]]

    @pytest.mark.parametrize("name", HELPER)
    def test_switches_cannot_be_undone(self, name: str) -> None:
        episode = Episode(name, {**OTHER_ROOM, "agent": {"at": [1, 1], "facing": "left"}})
        for _ in range(3):
            episode.act("toggle")
            assert (pressed(episode), doors(episode)) == ([True, False], ["closed", "locked"])
            assert episode.seen((0, 1))[0] == SWITCH

    @pytest.mark.parametrize("name", HELPER)
    def test_she_waits_by_her_door_and_turns_to_the_agent(self, name: str) -> None:
        for number, y in enumerate((1, 5)):
            layout = {
                **OTHER_ROOM,
                "agent": {"at": [1, 3], "facing": "up"},
                "let": {"jill.goal": f"doors[{number}]"},
            }
            episode = Episode(name, layout)
            episode.acts(*[None] * 12)
            assert (episode.now()["jill"]["at"], episode.now()["jill"]["facing"]) == ([5, y], "left")

    @pytest.mark.parametrize(("name", "late"), [(HELPER[0], 1), (HELPER[1], 0)])
    def test_as_coded_she_is_seen_one_step_late(self, name: str, late: int) -> None:
        episode = Episode(name, OTHER_ROOM)
        cells, shown = [(4, 1)], []
        for _ in range(4):
            episode.act()
            cells.append(tuple(episode.now()["jill"]["at"]))
            shown.append(next(cell for cell in ((4, 1), (5, 1)) if episode.seen(cell)[0] == NPC))
        assert shown == cells[1 - late : 5 - late]

    @pytest.mark.parametrize("name", HELPER)
    def test_her_door_is_seen_to_open_at_once(self, name: str) -> None:
        layout = {**OTHER_ROOM, "room": {"width": 5, "height": 5}, "jill": {"at": [3, 2]}}
        episode = Episode(name, {**layout, "agent": {"at": [1, 2], "facing": "right"}})
        assert episode.seen((4, 1))[2] == LOCKED
        episode.acts("left", "forward", "left")
        episode.act("toggle")
        assert doors(episode)[0] == "closed"
        episode.acts("right", "right")
        assert episode.seen((4, 1))[2] == CLOSED

    def test_hidden_she_leaves_all_the_same(self) -> None:
        for seed in range(50):
            episode = Episode("help_as_helper+as_coded+unsocial", seed=seed)
            assert help_out(episode).ended == "success"


@pytest.mark.parametrize("name", [*EXITER, *HELPER])
@pytest.mark.thorough("plays many episodes by chance")
def test_whatever_the_agent_does_nobody_leaves_without_eye_contact(name: str) -> None:
    rng, successes = random.Random(name), 0
    for seed in range(600):
        episode = Episode(name, {"room": {"width": 5, "height": 5}}, seed)
        met, ended, before = False, None, episode.now()
        while ended is None:
            ended = episode.act(rng.choice(["left", "right", "forward", "toggle", None])).ended
            room = episode.now()
            met = met or mutual_look(room)
            for switch, earlier, door in zip(
                room["switches"], before["switches"], room["doors"], strict=True
            ):
                if name == "help+as_coded" and switch["state"] != earlier["state"]:
                    assert beside(room["agent"]["at"], room["agent"]["facing"]) == tuple(door["at"])
                if name in EXITER and switch["state"] == "pressed":
                    assert met
            before = room
        assert met or ended != "success"
        successes += ended == "success"
    assert successes > 0


class TestTheSwitches:
    """In the research code they look the same before and after."""

    @pytest.mark.parametrize("name", EXITER)
    def test_the_exiter_does_not_see_which_is_pressed(self, name: str) -> None:
        episode = agreed(name)
        episode.acts("right", "right", None, None)
        assert pressed(episode) == [True, False]
        episode.acts("right", "right")
        assert episode.seen((0, 1)) == (SWITCH, COLORS.index("red"), 0, 0)

    @pytest.mark.parametrize("name", HELPER)
    def test_nor_does_the_helper(self, name: str) -> None:
        episode = Episode(name, {**OTHER_ROOM, "agent": {"at": [1, 1], "facing": "left"}})
        episode.act("toggle")
        assert pressed(episode) == [True, False]
        assert episode.seen((0, 1))[::2] == (SWITCH, 0)


class TestRooms:
    @pytest.mark.parametrize("name", [*EXITER, *HELPER])
    def test_doors_switches_and_lava(self, name: str) -> None:
        drawn = list(rooms(name, 3000))
        for room in drawn:
            right, bottom = room["room"]["width"] - 1, room["room"]["height"] - 2
            assert [door["at"] for door in room["doors"]] == [[right, 1], [right, bottom]]
            assert [switch["at"] for switch in room["switches"]] == [[0, 1], [0, bottom]]
            assert [one["color"] for one in room["doors"]] == [one["color"] for one in room["switches"]]
            assert {door["state"] for door in room["doors"]} == {"locked"}
        check_shares((room["doors"][0]["color"] for room in drawn), evenly(COLORS))
        same = (room["doors"][0]["color"] == room["doors"][1]["color"] for room in drawn)
        check_shares(same, {True: 1 / 6, False: 5 / 6})

    @pytest.mark.parametrize("name", [*EXITER, *HELPER])
    def test_each_on_its_side(self, name: str) -> None:
        drawn = list(rooms(name, 4000))
        left, right = ("jill", "agent") if name in EXITER else ("agent", "jill")
        wide = [room for room in drawn if room["room"] == {"width": 8, "height": 8}]
        check_shares(
            (tuple(room[left]["at"]) for room in wide), evenly((x, y) for x in (1, 2, 3) for y in range(1, 7))
        )
        check_shares(
            (tuple(room[right]["at"]) for room in wide), evenly((x, y) for x in (5, 6) for y in range(1, 7))
        )
        for room in drawn:
            middle = room["room"]["width"] // 2
            assert room[left]["at"][0] < middle < room[right]["at"][0]
            assert {tuple(room[left]["at"]), tuple(room[right]["at"])} <= interior(room["room"])
            assert room["jill"]["facing"] == "down"
        check_shares((room["agent"]["facing"] for room in drawn), evenly(("right", "down", "left", "up")))

    @pytest.mark.parametrize("name", HELPER)
    def test_the_exiter_draws_its_door(self, name: str) -> None:
        check_shares(
            (room["let"]["jill.goal"] for room in rooms(name, 3000)), evenly(("doors[0]", "doors[1]"))
        )


def test_the_way_is_vertical_first() -> None:
    """As in the original, of two equally short ways an NPC takes the one that begins up or down."""
    layout = {**ROOM, "jill": {"at": [2, 4], "facing": "up"}, "agent": {"at": [5, 1], "facing": "up"}}
    episode, course = Episode("help+as_coded", layout), []
    for _ in range(5):
        episode.act()
        course.append(tuple(episode.now()["jill"]["at"]))
    assert course == [beside((2, 4), "up", k) for k in (1, 2, 3)] + [(2, 1), (1, 1)]
