"""DiverseExit: which introduction each of the twelve teachers accepts, when it answers, and where all may stand."""

from __future__ import annotations

from itertools import pairwise, product
from typing import Any, NamedTuple

import pytest

from tests.scenarios.playing import (
    CLOSED,
    COLORS,
    DOOR,
    EMPTY,
    NPC,
    OPEN,
    Episode,
    Step,
    beside,
    check_shares,
    distance,
    evenly,
    interior,
    reachable,
    rooms,
)

WHERE, WHICH = "Where is the exit", "Which is the correct door"
NAMES = ["diverse_exit+as_coded", "diverse_exit"]
DOORS: list[dict[str, Any]] = [
    {"at": [2, 0], "color": "green"},
    {"at": [4, 6], "color": "red"},
    {"at": [0, 4], "color": "blue"},
    {"at": [6, 2], "color": "grey"},
]
# The teacher looks to the left, where the agent stands.
ROOM: dict[str, Any] = {
    "room": {"width": 7, "height": 7},
    "teacher": {"at": [3, 3], "facing": "left"},
    "agent": {"at": [2, 3], "facing": "right"},
    "doors": DOORS,
    "let": {"exit": "doors[0]"},
}


class Introduction(NamedTuple):
    """An introductory configuration."""

    near: bool
    poked: bool
    gaze: bool
    formula: str


def of_code(number: int) -> Introduction:
    """What type `number` of the research code wants."""
    near, poked = [(False, False), (True, False), (True, True)][number % 3]
    return Introduction(near, poked, number // 3 % 2 == 0, WHERE if number >= 6 else WHICH)


def of_paper(number: int) -> Introduction:
    """What type `number` of the paper wants."""
    near, poked = [(True, True), (True, False), (False, False)][number % 3]
    return Introduction(near, poked, number < 6, WHICH if number // 3 % 2 else WHERE)


TEACHERS = {f"teacher_{number:02}": of_paper(number) for number in range(12)}
CONFIGURATIONS = [
    *TEACHERS.values(),
    # Poked from nearby, then left alone: nobody wants that.
    *(Introduction(False, True, gaze, formula) for gaze, formula in product((True, False), (WHERE, WHICH))),
]


def room_of(teacher: str, /, **changes: Any) -> dict[str, Any]:
    return {**ROOM, "one_of": {"teacher": teacher}, **changes}


def teacher_who(**wishes: Any) -> str:
    """A teacher who wants an introduction like this."""
    return next(
        name
        for name, wanted in TEACHERS.items()
        if all(getattr(wanted, key) == value for key, value in wishes.items())
    )


def introduced(name: str, teacher: str, how: Introduction) -> tuple[Episode, Step]:
    """An episode up to the step of an introduction, and what came of that step."""
    at = [2, 3] if how.near or how.poked else [1, 3]
    episode = Episode(name, room_of(teacher, agent={"at": at, "facing": "right"}))
    if how.poked:
        episode.act("toggle")
    if how.poked and not how.near:
        episode.acts("left", "left", "forward", "left", "left")
    if not how.gaze:
        episode.act("left")
    now = episode.now()
    assert (distance(now["agent"]["at"], now["teacher"]["at"]) == 1) == how.near
    assert (now["agent"]["facing"] == "right") == how.gaze
    assert now["teacher"]["facing"] == "left"
    return episode, episode.act(say=how.formula)


def helps(episode: Episode) -> bool:
    """Whether the teacher answers who looks at it from the left."""
    while episode.now()["agent"]["facing"] != "right":
        step = episode.act("right")
    step = episode.act()
    assert step.heard in ("", f"{episode.now()['teacher']['name']}: Go to the green door")
    return step.heard != ""


class TestIntroductions:
    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("teacher", TEACHERS)
    def test_each_teacher_accepts_exactly_one(self, name: str, teacher: str) -> None:
        accepted = [how for how in CONFIGURATIONS if helps(introduced(name, teacher, how)[0])]
        assert accepted == [TEACHERS[teacher]]

    def test_paper_and_code_number_the_same_twelve(self) -> None:
        assert {of_code(number) for number in range(12)} == set(TEACHERS.values())
        assert len(set(TEACHERS.values())) == 12

    @pytest.mark.parametrize("teacher", TEACHERS)
    def test_the_picture_shows_the_number_of_the_code_or_the_paper(self, teacher: str) -> None:
        kind, number = Episode("diverse_exit+as_coded", room_of(teacher)).seen((3, 3))[::2]
        assert (kind, of_code(number)) == (NPC, TEACHERS[teacher])
        assert Episode("diverse_exit", room_of(teacher)).seen((3, 3))[2] == int(teacher[-2:])

    @pytest.mark.parametrize("teacher", TEACHERS)
    def test_names_go_by_number_modulo_three(self, teacher: str) -> None:
        episode = Episode("diverse_exit+as_coded", room_of(teacher))
        number = episode.seen((3, 3))[2]
        assert episode.now()["teacher"]["name"] == ("Bobby", "Robby", "Toby")[number % 3]

    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("teacher", TEACHERS)
    def test_a_right_introduction_is_answered_at_once_if_there_is_eye_contact(
        self, name: str, teacher: str
    ) -> None:
        episode, step = introduced(name, teacher, TEACHERS[teacher])
        answer = f"{episode.now()['teacher']['name']}: Go to the green door"
        assert step.heard == (answer if TEACHERS[teacher].gaze else "")

    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("teacher", TEACHERS)
    def test_only_the_first_formula_counts(self, name: str, teacher: str) -> None:
        wanted = TEACHERS[teacher]
        wrong = wanted._replace(formula=WHICH if wanted.formula == WHERE else WHERE)
        episode, step = introduced(name, teacher, wrong)
        assert step.heard == ""
        assert [episode.act(say=wanted.formula).heard for _ in range(5)] == [""] * 5
        assert not helps(episode)
        episode, _ = introduced(name, teacher, wanted)
        episode.act(say=wrong.formula)
        assert helps(episode), "what follows the right one changes nothing"

    @pytest.mark.parametrize("name", NAMES)
    def test_other_sentences_are_no_introduction(self, name: str) -> None:
        env = Episode(name, ROOM).env
        sentences = [
            template.replace("<noun>", noun)
            for template, noun in product(env.program.templates, env.program.nouns)
        ]
        assert len(sentences) == 64
        others = [sentence for sentence in sentences if sentence not in (WHERE, WHICH)]
        for batch in (others[:31], others[31:]):
            episode = Episode(name, room_of(teacher_who(near=True, poked=False, gaze=True, formula=WHERE)))
            assert [episode.act(say=sentence).heard for sentence in batch] == [""] * 31
            assert episode.act(say=WHERE).heard == "Robby: Go to the green door"

    @pytest.mark.parametrize("name", NAMES)
    def test_eye_contact_is_judged_after_the_turn_of_that_step(self, name: str) -> None:
        gaze, no_gaze = (
            teacher_who(near=True, poked=False, gaze=wanted, formula=WHERE) for wanted in (True, False)
        )
        for teacher, facing, answered in [(gaze, "down", True), (gaze, "up", True), (no_gaze, "down", False)]:
            layout = room_of(teacher, teacher={"at": [3, 3], "facing": facing})
            assert (Episode(name, layout).act(say=WHERE).heard != "") == answered
        # From looking away altogether it needs two turns.
        for teacher, accepted in [(gaze, False), (no_gaze, True)]:
            episode = Episode(name, room_of(teacher, teacher={"at": [3, 3], "facing": "right"}))
            assert episode.act(say=WHERE).heard == ""
            assert helps(episode) == accepted

    @pytest.mark.parametrize("name", NAMES)
    def test_cornerwise_is_far(self, name: str) -> None:
        teacher = teacher_who(near=False, gaze=False, formula=WHERE)
        episode = Episode(name, room_of(teacher, agent={"at": [2, 2], "facing": "up"}))
        assert episode.act(say=WHERE).heard == ""
        episode.acts("left", "left", "forward", "left")
        assert helps(episode)

    @pytest.mark.parametrize("name", NAMES)
    def test_near_needs_no_facing(self, name: str) -> None:
        teacher = teacher_who(near=True, poked=False, gaze=False, formula=WHICH)
        for facing in ("up", "down", "left"):
            episode = Episode(name, room_of(teacher, agent={"at": [2, 3], "facing": facing}))
            episode.act(say=WHICH)
            assert helps(episode)


class TestPokes:
    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("wanted", [True, False])
    def test_a_poke_in_the_step_of_the_introduction_counts(self, name: str, wanted: bool) -> None:
        teacher = teacher_who(near=True, poked=wanted, gaze=True, formula=WHERE)
        assert (Episode(name, room_of(teacher)).act("toggle", WHERE).heard != "") == wanted

    @pytest.mark.parametrize("name", NAMES)
    def test_a_poke_is_not_forgotten(self, name: str) -> None:
        teacher = teacher_who(poked=True, gaze=True, formula=WHERE)
        episode = Episode(name, room_of(teacher))
        episode.acts("toggle", "left", "left", "forward", *[None] * 5, "left", "left", "forward")
        assert episode.now()["teacher"]["poked"]
        assert episode.act(say=WHERE).heard == "Toby: Go to the green door"

    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize(
        "agent",
        [
            {"at": [2, 3], "facing": "up"},
            {"at": [1, 3], "facing": "right"},
            {"at": [2, 2], "facing": "right"},
        ],
    )
    def test_a_toggle_elsewhere_is_no_poke(self, name: str, agent: dict[str, Any]) -> None:
        episode = Episode(name, room_of("teacher_00", agent=agent))
        episode.act("toggle")
        assert not episode.now()["teacher"]["poked"]


class TestAnswers:
    @pytest.mark.parametrize("name", NAMES)
    def test_one_in_every_step_of_eye_contact(self, name: str) -> None:
        teacher = teacher_who(near=True, poked=False, gaze=True, formula=WHICH)
        episode = Episode(name, room_of(teacher))
        answer = "Robby: Go to the green door"
        assert episode.act(say=WHICH).heard == answer
        assert episode.hears(None, None, "left", None, "right", "toggle", "pickup") == [
            *[answer] * 2,
            *[""] * 2,
            *[answer] * 3,
        ]
        # Two cells further on it turns after the agent; eye contact goes over any distance.
        assert episode.hears("left", "left", "forward", "left", "left") == [""] * 4 + [answer]

    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("teacher", ["teacher_01", "teacher_08"])
    @pytest.mark.parametrize("number", range(4))
    def test_the_colour_of_the_right_door(self, name: str, teacher: str, number: int) -> None:
        wanted = TEACHERS[teacher]
        agent = {"at": [2 if wanted.near else 1, 3], "facing": "right" if wanted.gaze else "up"}
        episode = Episode(name, room_of(teacher, agent=agent, let={"exit": f"doors[{number}]"}))
        first = episode.act(say=wanted.formula)
        heard = first.heard or episode.act("right").heard
        assert heard.endswith(f": Go to the {DOORS[number]['color']} door")

    def test_hidden_teachers_are_silent_but_turn(self) -> None:
        layout = room_of("teacher_01", teacher={"at": [3, 3], "facing": "right"})
        episode = Episode("diverse_exit+as_coded+unsocial", layout)
        assert [episode.act(say=WHERE).heard for _ in range(4)] == [""] * 4
        assert episode.now()["teacher"]["facing"] == "left"
        assert episode.seen((3, 3)) == EMPTY
        episode.act("forward")
        assert episode.now()["agent"]["at"] == [3, 3]


class TestTheTeacher:
    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize(
        ("agent", "direction"),
        [
            *[([4, 4], "right"), ([4, 2], "up"), ([2, 2], "left"), ([2, 4], "down")],  # cornerwise
            *[([5, 4], "right"), ([5, 2], "right"), ([4, 1], "up"), ([2, 1], "up")],
            *[([1, 2], "left"), ([1, 4], "left"), ([2, 5], "down"), ([4, 5], "down")],
        ],
    )
    def test_it_turns_a_step_at_a_time_towards_the_agent(
        self, name: str, agent: list[int], direction: str
    ) -> None:
        ways = ("right", "down", "left", "up")
        for start in ways:
            layout = room_of("teacher_02", agent={"at": agent}, teacher={"at": [3, 3], "facing": start})
            episode = Episode(name, layout)
            apart = (ways.index(direction) - ways.index(start)) % 4
            steps = [start]
            for _ in range(3):
                episode.act()
                steps.append(episode.now()["teacher"]["facing"])
            turns = [(ways.index(b) - ways.index(a)) % 4 for a, b in pairwise(steps)]
            assert turns in {0: [[0, 0, 0]], 1: [[1, 0, 0]], 3: [[3, 0, 0]], 2: [[1, 1, 0], [3, 3, 0]]}[apart]
            assert steps[-1] == direction

    def test_from_behind_it_turns_either_way(self) -> None:
        layout = room_of("teacher_02", teacher={"at": [3, 3], "facing": "right"})
        turned = []
        for seed in range(400):
            episode = Episode("diverse_exit+as_coded", layout, seed)
            episode.act()
            turned.append(episode.now()["teacher"]["facing"])
        check_shares(turned, evenly(("up", "down")))

    @pytest.mark.parametrize(
        ("name", "shown"), [("diverse_exit+as_coded", [1, 2, 2]), ("diverse_exit", [2] * 3)]
    )
    def test_as_coded_its_turn_is_seen_one_step_late(self, name: str, shown: list[int]) -> None:
        episode = Episode(name, room_of("teacher_02", teacher={"at": [3, 3], "facing": "down"}))
        directions = []
        for _ in shown:
            episode.act()
            directions.append(episode.seen((3, 3))[3])
        assert directions == shown


class TestDoors:
    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("number", range(4))
    def test_only_the_right_one_pays_asked_or_not(self, name: str, number: int) -> None:
        front = {0: ([2, 1], "up"), 1: ([4, 5], "down"), 2: ([1, 4], "left"), 3: ([5, 2], "right")}
        at, facing = front[number]
        episode = Episode(
            name, room_of("teacher_00", agent={"at": at, "facing": facing}, let={"exit": "doors[3]"})
        )
        assert episode.act("toggle").ended is None
        step = episode.act("forward")
        assert (step.ended, step.reward) == (
            ("success", pytest.approx(1 - 0.9 * 2 / 50)) if number == 3 else ("failure", 0)
        )

    @pytest.mark.parametrize("name", NAMES)
    def test_they_open_and_shut_and_a_shut_one_is_in_the_way(self, name: str) -> None:
        episode = Episode(name, room_of("teacher_00", agent={"at": [2, 1], "facing": "up"}))
        assert episode.seen((2, 0)) == (DOOR, COLORS.index("green"), CLOSED, 0)
        assert episode.act("forward").ended is None
        assert episode.now()["agent"]["at"] == [2, 1]
        episode.act("toggle")
        assert episode.seen((2, 0)) == (DOOR, COLORS.index("green"), OPEN, 0)
        episode.act("toggle")
        assert episode.act("forward").ended is None
        assert episode.acts("toggle", "forward").ended == "success"

    @pytest.mark.parametrize("name", NAMES)
    def test_done_and_time(self, name: str) -> None:
        step = Episode(name, ROOM).act("done")
        assert (step.ended, step.reward) == ("failure", 0)
        episode = Episode(name, room_of("teacher_01"))
        assert all(episode.act("pickup" if k % 2 else "drop").ended is None for k in range(49))
        assert episode.act().ended == "timeout"

    @pytest.mark.parametrize("name", NAMES)
    @pytest.mark.parametrize("teacher", TEACHERS)
    def test_whom_the_answer_reaches_can_leave(self, name: str, teacher: str) -> None:
        episode, _ = introduced(name, teacher, TEACHERS[teacher])
        assert helps(episode)
        x, _ = episode.now()["agent"]["at"]
        way = ["left", "forward", "forward", *["right", "forward", "left"] * (2 - x), "toggle", "forward"]
        assert episode.acts(*way).ended == "success"


@pytest.fixture(scope="module", params=NAMES)
def drawn(request: pytest.FixtureRequest) -> list[dict[str, Any]]:
    """Many rooms."""
    return list(rooms(request.param, 4000))


class TestRooms:
    def test_one_door_in_each_wall_away_from_the_corners(self, drawn: list[dict[str, Any]]) -> None:
        for room in drawn:
            width, height = room["room"]["width"], room["room"]["height"]
            top, bottom, left, right = (door["at"] for door in room["doors"])
            assert (top[1], bottom[1], left[0], right[0]) == (0, height - 1, 0, width - 1)
            assert {top[0], bottom[0]} <= set(range(2, width - 2))
            assert {left[1], right[1]} <= set(range(2, height - 2))
            assert len({door["color"] for door in room["doors"]}) == 4
            assert {door["state"] for door in room["doors"]} == {"closed"}

    def test_doors_colours_exit_and_teacher_are_even(self, drawn: list[dict[str, Any]]) -> None:
        check_shares((room["let"]["exit"] for room in drawn), evenly(f"doors[{k}]" for k in range(4)))
        check_shares((room["one_of"]["teacher"] for room in drawn), evenly(TEACHERS))
        check_shares((room["teacher"]["color"] for room in drawn), evenly(COLORS))
        for number in range(4):
            check_shares((room["doors"][number]["color"] for room in drawn), evenly(COLORS))
        wide = [room for room in drawn if room["room"]["width"] == 8]
        check_shares((room["doors"][0]["at"][0] for room in wide), evenly(range(2, 6)))

    def test_where_the_teacher_stands(self, drawn: list[dict[str, Any]]) -> None:
        for room in drawn:
            x, y = room["teacher"]["at"]
            assert (x, y) in interior(room["room"])
            assert y <= room["room"]["height"] - 3
            assert all(distance((x, y), door["at"]) > 1 for door in room["doors"])
            assert room["teacher"]["facing"] == "down"

    def test_far_teachers_leave_the_middle_of_the_smallest_room(self, drawn: list[dict[str, Any]]) -> None:
        small = [room for room in drawn if room["room"] == {"width": 5, "height": 5}]
        far = [room for room in small if not TEACHERS[room["one_of"]["teacher"]].near]
        near = [room for room in small if TEACHERS[room["one_of"]["teacher"]].near]
        # Doors are in the middles of the walls, so only corners and the middle are left, and not the lower corners.
        check_shares((tuple(room["teacher"]["at"]) for room in far), evenly([(1, 1), (3, 1)]))
        check_shares((tuple(room["teacher"]["at"]) for room in near), evenly([(1, 1), (3, 1), (2, 2)]))

    def test_the_agent_is_anywhere_else(self, drawn: list[dict[str, Any]]) -> None:
        corner = [
            room
            for room in drawn
            if room["room"] == {"width": 5, "height": 5} and room["teacher"]["at"] == [1, 1]
        ]
        cells = interior({"width": 5, "height": 5}) - {(1, 1)}
        check_shares((tuple(room["agent"]["at"]) for room in corner), evenly(cells))
        check_shares((room["agent"]["facing"] for room in drawn), evenly(("right", "down", "left", "up")))

    def test_the_right_door_can_always_be_reached(self, drawn: list[dict[str, Any]]) -> None:
        for room in drawn:
            free = interior(room["room"]) - {tuple(room["teacher"]["at"])}
            reached = reachable(room["agent"]["at"], free)
            exit_at = room["doors"][int(room["let"]["exit"][6])]["at"]
            assert any(beside(exit_at, way) in reached for way in ("right", "down", "left", "up"))


def test_a_layout_may_put_the_teacher_where_it_is_never_drawn() -> None:
    episode = Episode("diverse_exit", {**ROOM, "teacher": {"at": [2, 5]}})
    assert episode.now()["teacher"]["at"] == [2, 5]
