"""The reference interpreter plays the paper's scenarios as they were measured on the research code."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest

from tests.reference import Reference
from tests.reference.interpreter import Action, Result
from tests.reference.script import script_of
from tests.reference.world import Entity

LEFT, RIGHT, FORWARD = 0, 1, 2
TOGGLE, DONE, STAY = 5, 6, 7
COLORS = ("red", "green", "blue", "purple", "yellow", "grey")


def silent(primitive: int) -> Action:
    return primitive, 0, 0, 0


def play(reference: Reference, *primitives: int) -> Result:
    """Plays body actions in silence; what the last one led to."""
    for primitive in primitives:
        result = reference.step(silent(primitive))
    return result


def lets(name: str, value: Any, layout: dict[str, Any]) -> dict[str, Any]:
    return {**layout, "let": {**layout.get("let", {}), name: value}}


# -- Dance -------------------------------------------------------------------------------------------------

# left and "Move your body", right in silence, forward and "Shake your head".
DANCE = {
    "dance[0].move": "left",
    "dance[0].utterance": 1,
    "dance[1].move": "right",
    "dance[1].utterance": 0,
    "dance[2].move": "forward",
    "dance[2].utterance": 4,
}
STEPS: list[Action] = [(LEFT, 1, 0, 0), (RIGHT, 0, 0, 0), (FORWARD, 1, 1, 1)]
NOTHING = (3, 0, 0, 0)  # there are three actions only
HALL = {"room": {"width": 8, "height": 8}, "agent": {"at": [5, 5], "facing": "up"}, "let": DANCE}


class TestDance:
    @pytest.mark.parametrize("pause", [0, 1])
    def test_timeline(self, pause):
        dance = Reference(f"dance?pause={pause}")
        dance.reset(0, layout=HALL)
        ren = dance.world.cast["dancer"]
        assert (ren.cell, ren.facing) == ((3, 4), "down")
        seen = [(dance.step(NOTHING).heard, ren.facing, ren.cell) for _ in range(6 + pause)]
        assert seen == [
            (("Ren: Look at me!",), "down", (3, 4)),
            *[((), "down", (3, 4))] * pause,
            (("Ren: Move your body",), "right", (3, 4)),
            ((), "down", (3, 4)),
            (("Ren: Shake your head",), "down", (3, 5)),
            (("Ren: Now repeat my moves!",), "down", (3, 5)),
            ((), "down", (3, 5)),
        ]

    def test_earliest_success_with_the_pause_of_the_code(self):
        dance = Reference("dance?pause=1")
        dance.reset(0, layout=HALL)
        for _ in range(6):
            dance.step(NOTHING)
        results = [dance.step(step) for step in STEPS]
        assert dance.world.t == 9
        assert [result.reward for result in results] == [0, 0, pytest.approx(0.595)]
        assert results[-1].terminated

    def test_what_is_done_before_the_prompt_does_not_count(self):
        dance = Reference("dance")
        dance.reset(0, layout=HALL)
        results = [dance.step(step) for step in [NOTHING, NOTHING, *STEPS]]
        assert dance.world.t == 5, "the prompt is heard with the last of them"
        results += [dance.step(step) for step in STEPS[1:]]
        assert not any(result.terminated for result in results)

    def test_the_window_slides(self):
        dance = Reference("dance?pause=1")
        dance.reset(0, layout=HALL)
        for _ in range(6):
            dance.step(NOTHING)
        results = [dance.step(step) for step in [(RIGHT, 0, 0, 0), *STEPS]]
        assert [result.terminated for result in results] == [False, False, False, True]
        assert results[-1].reward == pytest.approx(0.55)

    @pytest.mark.parametrize(
        "wrong",
        [
            [STEPS[0], (RIGHT, 1, 0, 0), STEPS[2]],  # a silent item wants silence
            [STEPS[0], STEPS[1], (FORWARD, 0, 0, 0)],  # an utterance wants to be said
            [STEPS[0], STEPS[1], (FORWARD, 1, 0, 1)],  # that one
            [STEPS[0], NOTHING, STEPS[2]],  # no action matches none
        ],
    )
    def test_only_the_exact_dance_counts(self, wrong):
        dance = Reference("dance")
        dance.reset(0, layout=HALL)
        for _ in range(5):
            dance.step(NOTHING)
        assert not any(dance.step(step).terminated for step in wrong)

    def test_a_blocked_step_counts_all_the_same(self):
        dance = Reference("dance")
        # The agent stands below the dancer: neither can go forward.
        dance.reset(0, layout={**HALL, "agent": {"at": [3, 5], "facing": "up"}})
        for _ in range(5):
            dance.step(NOTHING)
        assert dance.world.cast["dancer"].cell == (3, 4)
        assert [dance.step(step).reward > 0 for step in STEPS] == [False, False, True]
        assert dance.world.agent.cell == (3, 5)

    def test_dances_are_drawn_evenly(self):
        dance, moves, said, spots = Reference("dance"), Counter(), Counter(), Counter()
        for seed in range(400):
            dance.reset(seed)
            for move, utterance in dance.world.lets["dance"].elements:
                moves[move] += 1
                said[utterance] += 1
            world = dance.world
            spots[world.cast["dancer"].cell == (world.width // 2 - 1, world.height // 2)] += 1
        assert spots == {True: 400}
        assert {move: 0.28 < count / 1200 < 0.39 for move, count in moves.items()} == dict.fromkeys(
            ("left", "right", "forward"), True
        )
        assert 0.45 < said[0] / 1200 < 0.55
        assert all(0.09 < said[number] / 1200 < 0.16 for number in (1, 2, 3, 4))


# -- CoinThief ---------------------------------------------------------------------------------------------

# The thief faces right and glances up; its view is five deep, its own row included, and two to each side.
COINS = {
    "thief": {"at": [3, 3], "facing": "right"},
    "agent": {"at": [4, 3], "facing": "left"},
    "coins": [
        {"at": [6, 5]},  # ahead, two aside
        {"at": [3, 5]},  # beside it: its own row counts
        {"at": [1, 1]},  # above, two aside
        {"at": [2, 3]},  # beside it, once it looks up
        {"at": [1, 2]},  # behind, and aside once it looks up
        {"at": [6, 6]},  # three aside
    ],
    "let": {"glance": "left"},
}


class TestCoinThief:
    @pytest.mark.parametrize(("glance", "wanted"), [("left", 5), ("right", 3)])
    def test_required_number_by_hand(self, glance, wanted):
        thief = Reference("cointhief")
        thief.reset(0, layout=lets("glance", glance, COINS))
        # Glancing down it loses the two above; (2, 3) is in its own row either way.
        assert thief.world.lets["home"] == "right"
        assert thief.world.lets["wanted"] == wanted

    def test_share_of_each_number(self):
        thief, wanted, rooms = Reference("cointhief"), Counter(), 800
        for seed in range(rooms):
            thief.reset(seed)
            wanted[thief.world.lets["wanted"]] += 1
        # Measured over 20,000 rooms of the research code.
        measured = (0.032, 0.100, 0.160, 0.201, 0.226, 0.192, 0.089)
        for number, share in enumerate(measured):
            assert wanted[number] / rooms == pytest.approx(share, abs=0.045)

    @pytest.mark.parametrize("offset", [-1, 0, 1])
    def test_any_number_ends_it_and_the_right_one_pays(self, offset):
        thief = Reference("cointhief")
        thief.reset(0, layout=COINS)
        thief.step(NOTHING)
        result = thief.step((LEFT, 1, 0, 5 + offset))
        assert result.terminated
        assert result.reward == pytest.approx(1 - 0.9 * 2 / 20 if offset == 0 else 0)

    def test_it_is_heard_after_the_first_step_and_looks_to_and_fro(self):
        thief = Reference("cointhief")
        thief.reset(0, layout=COINS)
        eve, heard, looks = thief.world.cast["thief"], [], []
        for _ in range(4):
            heard.append(thief.step(NOTHING).heard)
            looks.append(eve.facing)
        assert heard == [("Eve: Freeze! Give me all your coins!",), (), (), ()]
        assert looks == ["up", "right", "up", "right"]

    def test_tags(self):
        plain, tagged = Reference("cointhief"), Reference("cointhief_tags")
        layout = {**COINS, "agent": {"at": [4, 3], "facing": "down"}}
        assert plain.reset(0, layout=layout).tokens == tagged.reset(0, layout=layout).tokens
        shown = [thing.status for thing in tagged.world.objects["coins"]]
        assert shown == ["tagged"] * 5 + ["plain"]
        image = tagged.reset(0, layout=layout).image
        # The agent looks down: (6, 5) is two ahead and two to its left, (6, 6) three ahead.
        assert tuple(image[1, 4]) == (6, 4, 1, 1)
        assert tuple(image[1, 3]) == (6, 4, 0, 0)
        assert tuple(plain.reset(0, layout=layout).image[1, 4]) == (6, 4, 0, 0)


# -- DiverseExit -------------------------------------------------------------------------------------------

WAYS = [(near, poked) for near, poked in ((True, True), (True, False), (False, False))]
FORMULAS = {"Where is the exit": (0, 1), "Which is the correct door": (2, 2)}
CONFIGURATIONS = [
    (near, poked, gaze, said) for near, poked in WAYS for gaze in (True, False) for said in FORMULAS
]


class TestDiverseExit:
    def test_twelve_teachers_are_drawn_evenly(self):
        diverse, codes, rooms = Reference("diverse_exit"), Counter(), 720
        for seed in range(rooms):
            diverse.reset(seed)
            world, teacher = diverse.world, diverse.world.cast["teacher"]
            codes[teacher.kind_code] += 1
            assert teacher.drawn_from == f"teacher_{teacher.kind_code:02}"
            assert teacher.name == ("Toby", "Robby", "Bobby")[teacher.kind_code % 3]
            assert teacher.cell[1] <= world.height - 3
            if not teacher.slots["near"].tree.value:
                assert (world.width, world.height, teacher.cell) != (5, 5, (2, 2))
        assert sorted(codes) == list(range(12))
        assert all(35 < count < 90 for count in codes.values())

    def test_each_has_one_configuration_and_each_configuration_one_teacher(self):
        diverse, accepted = Reference("diverse_exit"), []
        for number in range(12):
            answers = [way for way in CONFIGURATIONS if self.introduce(diverse, number, *way)]
            assert len(answers) == 1
            accepted += answers
        assert sorted(accepted) == sorted(CONFIGURATIONS)

    def introduce(
        self, diverse: Reference, number: int, near: bool, poked: bool, gaze: bool, said: str
    ) -> bool:
        """Whether the teacher tells the door at the next eye contact, after being introduced in this way."""
        diverse.reset(
            0,
            layout={
                "room": {"width": 7, "height": 7},
                "teacher": {"at": [3, 3], "facing": "down"},
                "agent": {"at": [3, 4], "facing": "up"},
                "let": {"teacher.one_of": number},
            },
        )
        world = diverse.world
        if poked:
            play(diverse, TOGGLE)
        world.agent.cell = (3, 4 if near else 5)
        world.agent.facing = "up" if gaze else "down"
        diverse.step((STAY, 1, *FORMULAS[said]))
        world.agent.facing = "up"
        return bool(play(diverse, STAY).heard)

    def test_it_tells_the_door_and_the_door_pays(self):
        diverse = Reference("diverse_exit")
        diverse.reset(
            0,
            layout={
                "room": {"width": 7, "height": 7},
                "teacher": {"at": [3, 2], "facing": "down", "color": "red"},
                "agent": {"at": [3, 3], "facing": "up"},
                "doors": [
                    {"at": [2, 0], "color": "red"},
                    {"at": [3, 6], "color": "blue"},
                    {"at": [0, 3], "color": "green"},
                    {"at": [6, 3], "color": "grey"},
                ],
                "let": {"teacher.one_of": "teacher_01", "exit": "doors[1]"},
            },
        )
        assert diverse.step((STAY, 1, 0, 1)).heard == ("Robby: Go to the blue door",)
        assert tuple(diverse.step(silent(STAY)).image[3, 5]) == (11, 0, 1, 1)
        result = play(diverse, LEFT, LEFT, FORWARD, FORWARD, TOGGLE)
        assert not result.terminated
        assert diverse.world.objects["doors"][1].status == "open"
        result = play(diverse, FORWARD)
        assert (result.terminated, result.outcome) == (True, 0)
        assert result.reward == pytest.approx(1 - 0.9 * 8 / 50)


# -- ShowMe ------------------------------------------------------------------------------------------------

# The peer is two cells from the right button and the agent stands where it looks at it.
WORKSHOP = {
    "room": {"width": 7, "height": 7},
    "door": {"at": [3, 0], "color": "red"},
    "jim": {"at": [3, 4], "facing": "down"},
    "agent": {"at": [5, 4], "facing": "left"},
    "let": {"correct": "switches[2]"},
}


class TestShowMe:
    def test_room(self):
        show = Reference("showme")
        correct = Counter()
        for seed in range(120):
            show.reset(seed)
            world = show.world
            assert world.objects["door"].cell[1] == 0
            assert world.objects["door"].status == "locked"
            assert [switch.cell for switch in world.objects["switches"]] == [
                (x, world.height - 1) for x in (1, 2, 3)
            ]
            assert [switch.color for switch in world.objects["switches"]] == ["blue", "green", "grey"]
            assert world.cast["jim"].cell[1] <= world.height - 3
            correct[world.lets["correct"].index] += 1
        assert all(25 < correct[number] < 56 for number in range(3))

    def test_doors_of_the_code_are_in_three_walls(self):
        show, walls = Reference("showme?door_wall=drawn"), Counter()
        for seed in range(150):
            show.reset(seed)
            (x, y), world = show.world.objects["door"].cell, show.world
            walls["top" if y == 0 else {0: "left", world.width - 1: "right"}[x]] += 1
        assert all(30 < walls[side] < 70 for side in ("top", "left", "right"))

    def test_the_peer_shows_the_button_and_leaves(self):
        show = Reference("showme")
        show.reset(0, layout=WORKSHOP)
        world, heard = show.world, []
        jim, door, switches = world.cast["jim"], world.objects["door"], world.objects["switches"]
        story = []
        while not jim.gone:
            result = play(show, STAY)
            assert not result.terminated
            heard += result.heard
            story.append((jim.cell, door.status, [switch.status for switch in switches]))
        assert heard == ["Jim: Look at me"], "once, at eye contact"
        idle = ["idle"] * 3
        pressed = ["idle", "idle", "pressed"]
        # One turn towards the agent, one back down, a step, the button; then to the door, which it opens.
        assert story[:4] == [
            ((3, 4), "locked", idle),
            ((3, 4), "locked", idle),
            ((3, 5), "locked", idle),
            ((3, 5), "closed", pressed),
        ]
        assert [entry[1:] for entry in story[4:-1]].count(("open", pressed)) >= 2
        assert story[-2][0] == (3, 0), "it walks onto the door's cell"
        assert story[-1] == (None, "locked", idle), "and the next step everything is as it was"

    def test_success_only_after_the_peer_has_left(self):
        for gone in (False, True):
            show = Reference("showme")
            show.reset(0, layout=WORKSHOP)
            if gone:
                while not show.world.cast["jim"].gone:
                    play(show, STAY)
            self.leave(show)
            result = play(show, FORWARD)
            assert (result.terminated, result.reward > 0) == (True, gone)

    def leave(self, show: Reference) -> None:
        """Presses the right button, opens the door and stands before it."""
        world = show.world
        world.agent.cell, world.agent.facing = (3, 5), "down"
        world.cast["jim"].cell = None if world.cast["jim"].gone else (1, 1)
        play(show, TOGGLE)
        assert world.objects["door"].status == "closed"
        world.agent.cell, world.agent.facing = (3, 1), "up"
        play(show, TOGGLE)
        assert world.objects["door"].status == "open"

    def test_a_wrong_button_locks_the_door_for_good(self):
        show = Reference("showme")
        show.reset(0, layout=WORKSHOP)
        show.world.cast["jim"].cell = (5, 1)
        for x in (3, 2):
            show.world.agent.cell, show.world.agent.facing = (x, 5), "down"
            play(show, TOGGLE)
        assert show.world.objects["door"].status == "locked"
        play(show, TOGGLE)
        assert show.world.objects["switches"][1].status == "pressed", "a button cannot be released"

    def test_buttons_do_not_light(self):
        show = Reference("showme")
        show.reset(0, layout={**WORKSHOP, "jim": {"at": [1, 1]}})
        show.world.agent.cell, show.world.agent.facing = (3, 5), "down"
        image = play(show, TOGGLE).image
        assert show.world.objects["switches"][2].status == "pressed"
        assert tuple(image[3, 5]) == (12, 5, 0, 0)

    def test_done_ends_it(self):
        show = Reference("showme")
        show.reset(0, layout=WORKSHOP)
        assert play(show, DONE).outcome == 2


ALONE = {key: value for key, value in WORKSHOP.items() if key != "jim"}


class TestShowMeWithoutThePeer:
    def test_the_right_button_is_lit_for_ten_steps(self):
        alone = Reference("showme_no_social")
        alone.reset(0, layout={**ALONE, "agent": {"at": [3, 5], "facing": "down"}})
        door, switches = alone.world.objects["door"], alone.world.objects["switches"]
        story = []
        for _ in range(12):
            image = play(alone, STAY).image
            story.append((image[3, 5][2], door.status, [switch.status for switch in switches]))
        lit = (1, "locked", ["idle", "idle", "pressed"])
        dark = (0, "locked", ["idle"] * 3)
        assert story == [lit] * 9 + [dark] * 3
        play(alone, TOGGLE)
        assert door.status == "closed"

    def test_then_it_is_done_alone(self):
        alone = Reference("showme_no_social")
        alone.reset(0, layout={**ALONE, "agent": {"at": [3, 5], "facing": "down"}})
        play(alone, *[STAY] * 10, TOGGLE, LEFT, LEFT, *[FORWARD] * 4)
        result = play(alone, TOGGLE, FORWARD)
        assert result.outcome == 0
        assert result.reward == pytest.approx(1 - 0.9 * 19 / 100)


# -- Help --------------------------------------------------------------------------------------------------

HOUSE = {
    "room": {"width": 7, "height": 7},
    "agent": {"at": [5, 1], "facing": "left"},
    "jill": {"at": [1, 1], "facing": "down"},
}


class TestHelp:
    def test_room(self):
        for name, agent_left in (("help", False), ("help_as_helper", True)):
            house = Reference(name)
            for seed in range(60):
                house.reset(seed)
                world = house.world
                middle = world.width // 2
                assert set(world.terrain) == {(middle, y) for y in range(1, world.height - 1)}
                assert (world.agent.cell[0] < middle) == agent_left
                assert (world.cast["jill"].cell[0] > middle) == agent_left
                assert world.cast["jill"].facing == "down"
                assert [door.status for door in world.objects["doors"]] == ["locked", "locked"]
                assert [s.color for s in world.objects["switches"]] == [
                    d.color for d in world.objects["doors"]
                ]

    def test_an_exiter_who_looks_at_the_helper_gets_out(self):
        house = Reference("help")
        house.reset(0, layout=HOUSE)
        jill, door, switch = house.world.cast["jill"], *self.first_pair(house)
        play(house, STAY)
        assert (jill.facing, jill.state) == ("right", "pressing"), "eye contact along the row"
        play(house, LEFT, LEFT)
        assert (jill.facing, switch.status, door.status) == ("left", "idle", "locked")
        assert not play(house, TOGGLE).terminated
        assert (switch.status, door.status) == ("pressed", "closed"), "unlocked, not opened"
        play(house, TOGGLE)
        assert door.status == "open"
        result = play(house, FORWARD)
        assert (result.terminated, result.outcome) == (True, 2)
        assert result.reward == pytest.approx(1 - 0.9 * 6 / 20)

    def first_pair(self, house: Reference) -> tuple[Entity, Entity]:
        return house.world.objects["doors"][0], house.world.objects["switches"][0]

    def test_without_eye_contact_nothing_is_pressed(self):
        house = Reference("help")
        house.reset(0, layout={**HOUSE, "agent": {"at": [5, 1], "facing": "up"}})
        result = play(house, *[STAY] * 20)
        assert result.truncated
        assert [switch.status for switch in house.world.objects["switches"]] == ["idle", "idle"]

    def test_as_coded_it_waits_until_the_exiter_faces_the_door(self):
        for name, status in (("help", "pressed"), ("help_as_coded", "idle")):
            house = Reference(name)
            house.reset(0, layout=HOUSE)
            play(house, *[STAY] * 15)
            assert house.world.objects["switches"][0].status == status
        play(house, LEFT, LEFT, STAY)
        assert house.world.objects["switches"][0].status == "pressed"

    def test_lava_kills_and_done_ends(self):
        house = Reference("help")
        house.reset(0, layout={**HOUSE, "agent": {"at": [4, 1], "facing": "left"}})
        result = play(house, FORWARD)
        assert (result.terminated, result.reward, result.outcome) == (True, 0.0, "deadly")
        house.reset(0, layout=HOUSE)
        assert play(house, DONE).outcome == 0


SWAPPED = {
    "room": {"width": 7, "height": 7},
    "agent": {"at": [1, 1], "facing": "right"},
    "jill": {"at": [5, 1], "facing": "down"},
    "let": {"jill.goal": "doors[0]"},
}


class TestHelpAsHelper:
    def start(self) -> Reference:
        house = Reference("help_as_helper")
        house.reset(0, layout=SWAPPED)
        return house

    def test_it_opens_once_the_helper_has_looked_and_pressed(self):
        house = self.start()
        jill = house.world.cast["jill"]
        play(house, STAY)
        assert jill.facing == "left", "it stands by its door already and turns to the helper at once"
        result = play(house, RIGHT, RIGHT, TOGGLE)
        assert house.world.objects["doors"][0].status in ("closed", "open")
        while not result.terminated:
            result = play(house, STAY)
        assert (result.outcome, jill.cell) == (2, (6, 1))
        assert house.world.t <= 7

    def test_pressing_without_eye_contact_does_not_help(self):
        house = self.start()
        house.world.agent.facing = "left"
        result = play(house, TOGGLE, *[STAY] * 19)
        assert house.world.objects["doors"][0].status == "closed"
        assert result.truncated

    def test_both_buttons_lose(self):
        house = self.start()
        house.world.agent.facing = "left"
        assert not play(house, TOGGLE).terminated
        house.world.agent.cell = (1, 5)
        result = play(house, TOGGLE)
        assert (result.terminated, result.outcome, result.reward) == (True, 1, 0)

    def test_done_on_the_very_step_forfeits_it(self):
        house = self.start()
        play(house, STAY, RIGHT, RIGHT, TOGGLE)
        jill, door = house.world.cast["jill"], house.world.objects["doors"][0]
        while door.status != "open":
            play(house, STAY)
        result = play(house, DONE)
        assert jill.cell == door.cell
        assert (result.terminated, result.outcome, result.reward) == (True, 0, 0)

    def test_the_door_is_drawn_evenly(self):
        house, goals = Reference("help_as_helper"), Counter()
        for seed in range(150):
            house.reset(seed)
            goals[house.world.cast["jill"].registers["goal"].index] += 1
        assert 55 < goals[0] < 95


class TestAsCoded:
    """What the research code did and the paper's text does not say."""

    def test_dance_is_heard_without_a_name_and_seen_late(self):
        dance = Reference("dance+as_coded")
        dance.reset(0, layout={**HALL, "agent": {"at": [3, 6], "facing": "up"}})
        steps = [dance.step(NOTHING) for _ in range(7)]
        assert [step.heard for step in steps] == [
            ("Look at me!",),
            (),
            ("Move your body",),
            (),
            ("Shake your head",),
            ("Now repeat my moves!",),
            (),
        ]
        # The dancer is two ahead; it turns left in the third step, back in the fourth, and comes nearer in the fifth.
        assert [step.image[3, 4][3] for step in steps[:5]] == [1, 1, 1, 0, 1]
        assert [step.image[3, 5][0] for step in steps[4:6]] == [1, 11]

    def test_thief(self):
        thief = Reference("cointhief+as_coded")
        thief.reset(0, layout=COINS)
        first, second = thief.step(NOTHING), thief.step(NOTHING)
        assert first.heard == ("Freeze! Give me all the coins you have!",)
        assert [step.image[3, 5][3] for step in (first, second)] == [0, 3], "to the agent, then to its side"
        assert thief.step((FORWARD, 1, 0, 5)).reward > 0
        thief.reset(0, layout=COINS)
        assert thief.step((FORWARD, 0, 0, 0)).outcome == 1

    def test_numbers_of_the_teachers(self):
        diverse = Reference("diverse_exit+as_coded")
        for number in range(12):
            diverse.reset(0, layout={"let": {"teacher.one_of": number}})
            teacher = diverse.world.cast["teacher"]
            likes = {name: teacher.slots[name].tree.value for name in ("near", "after_poke", "gaze")}
            assert teacher.kind_code == number
            assert teacher.name == ("Bobby", "Robby", "Toby")[number % 3]
            assert likes == {
                "near": number % 3 > 0,
                "after_poke": number % 3 == 2,
                "gaze": number // 3 % 2 == 0,
            }
            assert teacher.slots["formula"].tree.plain == (
                "Where is the exit" if number // 6 else "Which is the correct door"
            )

    def test_the_lock_is_seen_one_step_late(self):
        show = Reference("showme+as_coded")
        show.reset(0, layout={**WORKSHOP, "jim": {"at": [1, 1]}, "agent": {"at": [3, 5], "facing": "down"}})
        play(show, TOGGLE)
        assert show.world.objects["door"].status == "closed"
        show.reset(0, layout={**WORKSHOP, "jim": {"at": [1, 1]}, "agent": {"at": [3, 5], "facing": "down"}})
        # Beside the button on its left wall, so that the door is in sight while it is pressed.
        show.world.objects["door"].cell = (6, 5)
        show.world.agent.facing = "down"
        late = play(show, TOGGLE).image
        prompt = play(show, STAY).image
        assert (tuple(late[0, 6]), tuple(prompt[0, 6])) == ((4, 0, 2, 0), (4, 0, 1, 0))

    def test_the_peer_goes_back_if_the_door_is_locked_again(self):
        show = Reference("showme+as_coded")
        show.reset(0, layout={**WORKSHOP, "agent": {"at": [5, 4], "facing": "left"}})
        jim = show.world.cast["jim"]
        while show.world.objects["door"].status == "locked":
            play(show, STAY)
        play(show, STAY)
        assert jim.state == "leaving"
        show.world.agent.cell, show.world.agent.facing = (1, 5), "down"
        play(show, TOGGLE)
        play(show, STAY)
        assert jim.state == "pressing"

    def test_the_guide_without_a_liar_is_heard_though_unseen(self):
        talk = Reference("talkitout_no_liar+as_coded+unsocial")
        layout = {
            "room": {"width": 8, "height": 8},
            "wizard": {"at": [6, 6]},
            "honest": {"at": [2, 2]},
            "agent": {"at": [2, 3]},
        }
        talk.reset(0, layout=layout)
        assert talk.step((STAY, 1, 3, 3)).heard == ("John: I am well.",)
        talk.world.agent.cell = (6, 5)
        assert talk.step((STAY, 1, 3, 3)).heard == ()


def test_parameters_are_read_like_scalars():
    assert script_of("dance?pause=1&sing=1&length=2").let["dance"].length == 2
    assert script_of("dance?sing=0").let["dance"].chance == 0
