"""The School's collaboration problems and AppleStealing: who has to do what in which role, and what pays."""

from __future__ import annotations

from itertools import pairwise, product
from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.evaluation.scripts import play_script
from tests.scenarios.playing import (
    FORWARD,
    NPC,
    Episode,
    Step,
    check_shares,
    distance,
    evenly,
    interior,
    made,
    rooms,
)

PROBLEMS = (
    "lever_door",
    "marble_push",
    "marble_pass",
    "color_match",
    "color_match_switches",
    "color_match_generators",
    "color_match_marbles",
)
TOGETHER = [f"school/{problem}{role}" for problem in PROBLEMS for role in ("", "_swapped")]
ALONE = ["school/marble_pass_asocial", "school/apple_stealing_asocial"]
STEALING = ["school/apple_stealing", "school/apple_stealing?guard=walking"]
ALL = [*TOGETHER, *ALONE, *STEALING]
SIZE = {"room": {"width": 9, "height": 9}}
STEALING_ROOM: dict[str, Any] = {
    "room": {"width": 10, "height": 10},
    "apple": {"at": [4, 3]},
    "agent": {"at": [4, 4], "facing": "up"},
}
LEVER_ROOM: dict[str, Any] = {
    **SIZE,
    "generator": {"at": [8, 4]},
    "gate": {"at": [7, 4]},
    "lever": {"at": [2, 1]},
    "left_platform": {"at": [1, 5]},
    "right_platform": {"at": [5, 7]},
}
PUSH_ROOM: dict[str, Any] = {
    **SIZE,
    "generator": {"at": [8, 4]},
    "gate": {"at": [7, 4]},
    "lever": {"at": [7, 5]},
    "marble": {"at": [4, 4]},
    "left_platform": {"at": [1, 7]},
    "right_platform": {"at": [5, 7]},
}
PASS_ROOM: dict[str, Any] = {
    **SIZE,
    "generator": {"at": [7, 8]},
    "marble": {"at": [4, 4]},
    "left_platform": {"at": [1, 7]},
    "right_platform": {"at": [5, 7]},
}
BOX_ROOM: dict[str, Any] = {
    **SIZE,
    "rights": [{"at": [6, 2], "color": "red"}, {"at": [6, 6], "color": "blue"}],
    "lefts": [{"at": [2, 2], "color": "blue"}, {"at": [2, 6], "color": "red"}],
}
PUSHER = {"at": [3, 4], "facing": "right"}


def wait(episode: Episode, steps: int) -> Step:
    """Several steps of doing nothing; what came of the last."""
    return episode.acts(*[None] * steps)


def until(episode: Episode, name: str, state: str, steps: int = 40) -> None:
    """Do nothing until an object has a status."""
    while episode.now()[name]["state"] != state:
        assert episode.now()["t"] < steps, f"{name} is never {state}"
        episode.act()


def apples(episode: Episode) -> list[bool]:
    """Whether the left and the right apple are in the room."""
    return ["gone" not in episode.now()[f"{side}_apple"] for side in ("left", "right")]


class TestAll:
    @pytest.mark.parametrize("name", ALL)
    def test_its_script_solves_it(self, name: str) -> None:
        assert play_script(name, 200, 1, 1000).solved >= 198

    @pytest.mark.parametrize("name", ALL)
    def test_done_does_nothing_and_time_runs_out_after_eighty_steps(self, name: str) -> None:
        episode = Episode(name)
        step = episode.act("done")
        assert (step.ended, step.reward) == (None, 0)
        assert wait(episode, 78).ended is None
        step = episode.act()
        assert (step.ended, step.reward) == ("timeout", 0)

    @pytest.mark.parametrize("name", ALL)
    def test_spaces(self, name: str) -> None:
        env = made(name)
        assert env.program.actions == ("left", "right", "forward", "toggle", "done")
        assert env.action_space.nvec.tolist() == [6, 2, 4, 16]
        assert env.observation_space["image"].shape == (7, 7, 6)

    @pytest.mark.parametrize("name", TOGETHER)
    def test_the_two_stand_on_their_sides_of_the_fence(self, name: str) -> None:
        for room in rooms(name, 200):
            fence = room["room"]["width"] // 2
            assert {room["room"]["width"], room["room"]["height"]} <= {9, 10}
            left, right = ("partner", "agent") if "swapped" in name else ("agent", "partner")
            assert room[left]["at"][0] < fence < room[right]["at"][0]

    @pytest.mark.parametrize("name", TOGETHER)
    def test_nobody_crosses_the_fence(self, name: str) -> None:
        for seed in range(10):
            episode = Episode(name, {"room": {"width": 9, "height": 9}}, seed)
            agent = episode.now()["agent"]["at"]
            episode.face("right" if agent[0] < 4 else "left")
            episode.acts(*["forward"] * 6)
            assert (episode.now()["agent"]["at"][0] < 4) == (agent[0] < 4)


class TestAppleStealing:
    def test_the_room(self) -> None:
        sizes = (
            (room["room"]["width"], room["room"]["height"]) for room in rooms("school/apple_stealing", 1500)
        )
        check_shares(sizes, evenly(product(range(7, 11), repeat=2)))
        facing = (room["guard"]["facing"] for room in rooms("school/apple_stealing", 1500))
        check_shares(facing, evenly(FORWARD))

    @pytest.mark.parametrize(
        ("label", "numbers"), [("none", [0]), ("few", [1, 2]), ("medium", [3, 4]), ("many", [5, 6])]
    )
    def test_so_many_walls(self, label: str, numbers: list[int]) -> None:
        name = f"school/apple_stealing?obstacles={label}"
        counted = [sum("gone" not in wall for wall in room["obstacles"]) for room in rooms(name, 400)]
        check_shares(counted, evenly(numbers))

    @pytest.mark.parametrize("name", STEALING)
    def test_the_guard_acts_in_every_fifth_step(self, name: str) -> None:
        moves = []
        for seed in range(60):
            episode = Episode(name, {"room": {"width": 10, "height": 10}}, seed)
            poses = []
            for _ in range(40):
                poses.append((episode.now()["guard"]["at"], episode.now()["guard"]["facing"]))
                episode.act()
            for t, (before, after) in enumerate(pairwise(poses), 1):
                if t % 5:
                    assert before == after
                elif before[1] != after[1]:
                    ways = list(FORWARD)
                    assert before[0] == after[0]
                    moves.append((ways.index(after[1]) - ways.index(before[1])) % 4)
                else:
                    moves.append(0)
        rotating = {1: 0.5, 3: 0.5}
        check_shares(moves, {0: 0.5, 1: 0.25, 3: 0.25} if "walking" in name else rotating)

    @pytest.mark.parametrize("facing", FORWARD)
    def test_the_agent_must_be_out_of_its_view(self, facing: str) -> None:
        (across, down), agent = FORWARD[facing], (4, 4)
        taken = {agent, (4, 3)}
        for at in sorted(interior(STEALING_ROOM["room"]) - taken):
            layout = {**STEALING_ROOM, "guard": {"at": list(at), "facing": facing}}
            episode = Episode("school/apple_stealing?obstacles=none", layout)
            ahead = (agent[0] - at[0]) * across + (agent[1] - at[1]) * down
            aside = (agent[1] - at[1]) * across - (agent[0] - at[0]) * down
            # Nothing is in the way but the apple, which can be seen through.
            seen = 0 <= ahead <= 6 and abs(aside) <= 3
            step = episode.act("toggle")
            assert (step.ended, step.reward) == (("failure", 0) if seen else ("success", 1 - 0.1 / 80)), at

    @pytest.mark.parametrize(("gap", "ended"), [(None, "success"), (1, "failure"), (4, "failure")])
    def test_walls_hide(self, gap: int | None, ended: str) -> None:
        walls = [[x, 6 if x == gap else 4] for x in range(1, 6)]
        layout = {
            "room": {"width": 7, "height": 8},
            "apple": {"at": [3, 2]},
            "agent": {"at": [3, 3], "facing": "up"},
            "guard": {"at": [3, 5], "facing": "up"},
            "obstacles": [{"at": at} for at in walls],
            "let": {"number": 5},
        }
        assert Episode("school/apple_stealing?obstacles=many", layout).act("toggle").ended == ended

    def test_what_counts_is_what_it_saw_before_the_step(self) -> None:
        for steps, ended in ((4, "failure"), (5, "success")):
            for seed in range(10):
                layout = {**STEALING_ROOM, "guard": {"at": [4, 8], "facing": "up"}}
                episode = Episode("school/apple_stealing?obstacles=none", layout, seed)
                wait(episode, steps)
                turned = episode.now()["guard"]["facing"] != "up"
                assert turned == (steps == 5)
                assert episode.act("toggle").ended == ended

    def test_alone_it_is_always_a_success(self) -> None:
        assert Episode("school/apple_stealing_asocial", STEALING_ROOM).act("toggle").ended == "success"
        assert "guard" not in Episode("school/apple_stealing_asocial").now()

    def test_the_guard_is_shown_as_an_antagonist(self) -> None:
        layout = {**STEALING_ROOM, "guard": {"at": [5, 3], "facing": "down"}}
        code = Episode("school/apple_stealing?obstacles=none", layout).seen((5, 3))
        assert (code[0], code[2]) == (NPC, 1)
        assert code[3] == 0, "egocentric: it looks against the agent's direction"


class TestLeverDoor:
    def test_the_lever_holds_the_door_for_ten_steps_and_works_once(self) -> None:
        layout = {**LEVER_ROOM, "agent": {"at": [2, 2], "facing": "up"}, "partner": {"at": [5, 1]}}
        episode = Episode("school/lever_door", layout)
        states = []
        for _ in range(12):
            episode.act("toggle")
            states.append(episode.now()["gate"]["state"])
        # The tenth step, that of the pull included, is the last in which anybody can go in.
        assert states == ["open"] * 9 + ["closed"] * 3
        assert episode.now()["lever"]["state"] == "spent"

    def test_the_partner_wanders_then_goes_to_the_door_and_in(self) -> None:
        moved = []
        for seed in range(60):
            layout = {**LEVER_ROOM, "agent": {"at": [2, 2], "facing": "up"}}
            episode = Episode("school/lever_door", layout, seed)
            for _ in range(10):
                before = episode.now()["partner"]
                episode.act()
                moved.append(before["facing"] != episode.now()["partner"]["facing"])
            for _ in range(14):
                episode.act()
            assert distance(episode.now()["partner"]["at"], (7, 4)) == 1
            episode.act("toggle")
            until(episode, "generator", "pressed")
            assert apples(episode) == [True, True]
            assert episode.now()["left_apple"]["at"] == [1, 5]
            assert episode.now()["right_apple"]["at"] == [5, 7]
        check_shares(moved, {True: 2 / 3, False: 1 / 3})

    def test_only_its_own_apple_counts(self) -> None:
        episode = Episode("school/lever_door", {**LEVER_ROOM, "agent": {"at": [2, 2], "facing": "up"}})
        wait(episode, 24)
        episode.act("toggle")
        until(episode, "generator", "pressed")
        episode.go_to((1, 4), avoid=[(2, 1), (1, 5)])
        episode.face("down")
        t = episode.now()["t"]
        step = episode.act("toggle")
        assert (step.ended, step.reward) == ("success", pytest.approx(1 - 0.1 * (t + 1) / 80))

    @pytest.mark.parametrize(("at", "pulls"), [((6, 4), True), ((5, 4), False), ((6, 3), False)])
    def test_the_partner_pulls_when_the_agent_is_at_the_door(self, at: tuple[int, int], pulls: bool) -> None:
        for seed in range(20):
            layout = {**LEVER_ROOM, "agent": {"at": list(at), "facing": "right"}}
            episode = Episode("school/lever_door_swapped", layout, seed)
            wait(episode, 10)
            assert episode.now()["lever"]["state"] == "down", "ten moves at random come first"
            wait(episode, 20)
            assert (episode.now()["lever"]["state"] != "down") == pulls

    def test_the_agent_goes_in(self) -> None:
        layout = {**LEVER_ROOM, "agent": {"at": [6, 4], "facing": "right"}}
        episode = Episode("school/lever_door_swapped", layout)
        episode.acts("forward", "toggle")
        assert episode.now()["agent"]["at"] == [6, 4], "it cannot be opened by hand"
        until(episode, "gate", "open")
        episode.acts("forward", "forward")
        assert apples(episode) == [True, True]
        episode.go_to((5, 6), avoid=[(5, 7), *((7, y) for y in range(1, 8) if y != 4)])
        episode.face("down")
        assert episode.act("toggle").ended == "success"


class TestMarblePush:
    def test_the_partner_opens_when_the_agent_is_at_the_marble(self) -> None:
        layout = {**PUSH_ROOM, "agent": {"at": [2, 4], "facing": "right"}, "partner": {"at": [6, 5]}}
        episode = Episode("school/marble_push", layout)
        wait(episode, 15)
        assert episode.now()["gate"]["state"] == "closed"
        episode.act("forward")
        until(episode, "gate", "open")
        assert episode.now()["t"] <= 20

    def test_the_marble_rolls_through_the_door(self) -> None:
        layout = {**PUSH_ROOM, "agent": PUSHER, "partner": {"at": [6, 5]}}
        episode = Episode("school/marble_push", layout)
        until(episode, "gate", "open")
        episode.act("forward")
        assert episode.now()["agent"]["at"] == [3, 4]
        path = [episode.now()["marble"]["at"]]
        while episode.now()["generator"]["state"] == "idle":
            episode.act()
            path.append(episode.now()["marble"]["at"])
        assert path == [[5, 4], [6, 4], [7, 4], [7, 4]]
        assert apples(episode) == [True, True]
        episode.act("forward")
        assert episode.now()["agent"]["at"] == [3, 4], "there is a fence behind the marble"

    def test_the_door_stops_it(self) -> None:
        layout = {**PUSH_ROOM, "agent": PUSHER, "partner": {"at": [5, 1]}}
        episode = Episode("school/marble_push", layout)
        episode.act("forward")
        wait(episode, 5)
        assert episode.now()["marble"] | {"color": ""} == {"at": [6, 4], "color": "", "state": "still"}
        assert apples(episode) == [False, False]

    @pytest.mark.parametrize(("at", "pushes"), [((6, 5), True), ((6, 6), False)])
    def test_the_partner_pushes_when_the_agent_is_at_the_lever(
        self, at: tuple[int, int], pushes: bool
    ) -> None:
        layout = {**PUSH_ROOM, "agent": {"at": list(at), "facing": "right"}}
        episode = Episode("school/marble_push_swapped", layout)
        wait(episode, 30)
        assert (episode.now()["marble"]["at"] != [4, 4]) == pushes

    def test_the_generator_answers_only_to_the_marble(self) -> None:
        layout = {
            **PUSH_ROOM,
            "agent": {"at": [6, 5], "facing": "right"},
            "partner": {"at": [3, 4], "facing": "left"},
        }
        episode = Episode("school/marble_push_swapped", layout)
        episode.acts("toggle", "left", "forward", "right", "forward", "forward", "toggle")
        assert episode.now()["agent"] == episode.now()["agent"] | {"at": [7, 4], "facing": "right"}
        assert apples(episode) == [False, False]


class TestMarblePass:
    @pytest.mark.parametrize("y", [0, 8])
    def test_the_partner_pushes_it_on(self, y: int) -> None:
        layout = {
            **PASS_ROOM,
            "generator": {"at": [7, y]},
            "agent": {"at": [3, 4], "facing": "right"},
            "partner": {"at": [6, 2]},
        }
        episode = Episode("school/marble_pass", layout)
        wait(episode, 5)
        assert episode.now()["marble"]["at"] == [4, 4], "the partner waits"
        episode.act("forward")
        wait(episode, 3)
        assert episode.now()["marble"]["at"] == [7, 4]
        until(episode, "generator", "pressed")
        assert episode.now()["marble"]["at"] == [7, 1 if y == 0 else 7]
        assert apples(episode) == [True, True]

    def test_the_agent_pushes_it_on(self) -> None:
        layout = {**PASS_ROOM, "agent": {"at": [7, 3], "facing": "down"}, "partner": {"at": [3, 2]}}
        episode = Episode("school/marble_pass_swapped", layout)
        while episode.now()["marble"]["at"] != [7, 4] or episode.now()["marble"]["state"] != "still":
            episode.act()
        episode.act("forward")
        wait(episode, 3)
        assert apples(episode) == [True, True]
        episode.go_to((5, 6), avoid=[(7, 7), (5, 7)])
        episode.face("down")
        assert episode.act("toggle").ended == "success"

    def test_alone_the_marble_is_in_the_far_column(self) -> None:
        for room in rooms("school/marble_pass_asocial", 200):
            assert "partner" not in room
            assert room["marble"]["at"][0] == room["generator"]["at"][0] == room["room"]["width"] - 2
            assert room["agent"]["at"][0] > room["room"]["width"] // 2

    def test_the_generator_answers_only_to_the_marble(self) -> None:
        layout = {**PASS_ROOM, "agent": {"at": [7, 7], "facing": "down"}, "marble": {"at": [7, 4]}}
        episode = Episode("school/marble_pass_asocial", layout)
        episode.acts("forward", "toggle")
        assert apples(episode) == [False, False]


class TestObjects:
    @pytest.mark.parametrize("name", [name for name in TOGETHER if "color_match" in name])
    def test_the_colours_of_the_sides_are_the_same_two(self, name: str) -> None:
        same = []
        for room in rooms(name, 400):
            left, right = ([thing["color"] for thing in room[side]] for side in ("lefts", "rights"))
            assert set(left) == set(right)
            assert len(set(left)) == 2
            same.append(left == right)
        check_shares(same, evenly([True, False]))

    def test_the_partner_opens_either_box(self) -> None:
        opened = []
        for seed in range(400):
            episode = Episode("school/color_match", seed=seed)
            while not any(box["state"] == "opened" for box in episode.now()["rights"]):
                episode.act()
            opened.append(
                next(k for k, box in enumerate(episode.now()["rights"]) if box["state"] == "opened")
            )
            assert apples(episode) == [False, True]
            wait(episode, 20)
            assert apples(episode) == [False, True]
        check_shares(opened, evenly([0, 1]))

    @pytest.mark.parametrize(("chosen", "opened"), list(product(range(2), repeat=2)))
    def test_only_the_box_of_the_same_colour_has_the_apple(self, chosen: int, opened: int) -> None:
        y = (2, 6)[opened]
        layout = {**BOX_ROOM, "agent": {"at": [2, y + 1], "facing": "up"}, "partner": {"at": [6, 4]}}
        layout["let"] = {"partner.favourite": f"rights[{chosen}]"}
        episode = Episode("school/color_match", layout)
        while apples(episode) != [False, True]:
            episode.act()
        episode.act("toggle")
        assert apples(episode) == [chosen != opened, True]
        # The other box no longer answers: there is one try.
        episode.go_to((2, (7, 3)[opened]), avoid=[(2, 2), (2, 6)])
        episode.face("up")
        episode.act("toggle")
        assert apples(episode) == [chosen != opened, True]
        assert [box["state"] for box in episode.now()["lefts"]].count("opened") == 1

    def test_who_does_not_wait_has_even_odds(self) -> None:
        found = []
        for seed in range(300):
            layout = {**BOX_ROOM, "agent": {"at": [2, 3], "facing": "up"}, "partner": {"at": [6, 4]}}
            episode = Episode("school/color_match", layout, seed)
            episode.act("toggle")
            assert apples(episode)[0] is False
            wait(episode, 25)
            found.append(apples(episode)[0])
        check_shares(found, evenly([True, False]))

    @pytest.mark.parametrize("chosen", range(2))
    def test_the_partner_opens_the_box_of_the_agents_colour(self, chosen: int) -> None:
        layout = {**BOX_ROOM, "agent": {"at": [6, (3, 7)[chosen]], "facing": "up"}}
        episode = Episode("school/color_match_swapped", layout)
        wait(episode, 20)
        assert {box["state"] for box in episode.now()["lefts"]} == {"shut"}, "it waits"
        episode.act("toggle")
        assert apples(episode) == [False, True]
        wait(episode, 25)
        assert [box["state"] for box in episode.now()["lefts"]] == [
            ("shut", "opened")[k != chosen] for k in range(2)
        ]
        assert apples(episode) == [True, True]
        assert episode.act("toggle").ended == "success"

    @pytest.mark.parametrize(("chosen", "used"), list(product(range(2), repeat=2)))
    @pytest.mark.parametrize("which", ["switches", "generators", "marbles"])
    def test_the_others_do_likewise(self, which: str, chosen: int, used: int) -> None:
        lefts, agent, act = {
            "switches": ([[2, 2], [2, 6]], {"at": [2, (3, 7)[used]], "facing": "up"}, "toggle"),
            "generators": ([[1, 2], [1, 6]], {"at": [2, (2, 6)[used]], "facing": "left"}, "forward"),
            "marbles": (
                [[2, 0], [0, 4]],
                ({"at": [2, 5], "facing": "up"}, {"at": [3, 4], "facing": "left"})[used],
                "forward",
            ),
        }[which]
        marble = {"left_marble": {"at": [2, 4]}} if which == "marbles" else {}
        layout: dict[str, Any] = {
            **SIZE,
            **marble,
            "lefts": [{"at": at, "color": color} for at, color in zip(lefts, ("blue", "red"), strict=True)],
            "rights": [{"color": "red"}, {"color": "blue"}],
            "agent": agent,
            "let": {"partner.favourite": f"rights[{chosen}]"},
        }
        layout |= {"left_box": {"at": [3, 4]}} if which == "switches" else {"left_platform": {"at": [3, 7]}}
        episode = Episode(f"school/color_match_{which}", layout)
        while [thing["state"] for thing in episode.now()["rights"]].count("pressed") == 0:
            assert episode.act().ended is None
        episode.act(act)
        wait(episode, 6)
        assert [thing["state"] for thing in episode.now()["lefts"]] == [
            ("idle", "pressed")[k == used] for k in range(2)
        ]
        if which == "switches":
            assert episode.now()["left_box"]["state"] == ("locked" if chosen == used else "shut")
        else:
            assert apples(episode)[0] == (chosen != used)


class TestSuites:
    @staticmethod
    def leaves(name: str) -> set[tuple[str, str]]:
        """Problem and role of each member."""
        members = sd.make(name).unwrapped.program.labels
        return {(labels["problem"], labels["role"]) for labels in members}

    def test_collaboration_is_every_problem_in_every_role(self) -> None:
        leaves = self.leaves("school/collaboration")
        assert len(leaves) == 14
        assert self.leaves("school/collaboration?split=role_a") == {leaf for leaf in leaves if leaf[1] == "A"}
        assert self.leaves("school/collaboration?split=role_b") == {leaf for leaf in leaves if leaf[1] == "B"}

    def test_the_groups_of_role_reversal_differ_only_in_the_partner_of_marble_pass(self) -> None:
        experimental, control, test, key = (
            self.leaves(f"school/role_reversal?split={split}")
            for split in ("experimental", "control", "test", "key")
        )
        assert experimental - control == {("marble_pass", "B")}
        assert control - experimental == {("marble_pass", "B_alone")}
        assert key == {("marble_pass", "A")}
        assert test == experimental | key
        assert len(experimental & control) == 12

    def test_both_roles_in_turn_are_worth_half_the_reward_each(self) -> None:
        env = sd.make("school/collaboration_in_turn+oracle").unwrapped
        _, info = env.reset(seed=0)
        paid, terminated = [], False
        while not terminated:
            _, reward, terminated, truncated, info = env.step(env.scripted_action())
            assert not truncated
            paid += [reward] if reward else []
        assert info["success"]
        assert len(paid) == 2
        assert all(0.45 < reward < 0.5 for reward in paid)

    def test_apple_stealing_has_twelve_versions(self) -> None:
        assert len(sd.make("school/apple_stealing_suite").unwrapped.program.labels) == 12
