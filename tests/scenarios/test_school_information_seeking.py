"""Information seeking in the School: what each cue says and when, what counts as success, that rooms can be solved."""

from __future__ import annotations

from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.trainer.curricula import Leaves, build_curriculum
from tests.quick import one_in
from tests.scenarios.playing import FORWARD, Episode, beside, check_shares, distance, evenly, made, rooms

PROBLEMS = ("boxes", "switches", "generators", "marbles", "doors", "levers")
CUES = ("color", "feedback", "pointing", "emulation", "scaffolding")
INTRODUCTIONS = ("none", "eye_contact", "ask", "ask_eye_contact")

# The agent and the caretaker stand in one row, both looking down.
MEETING: dict[str, Any] = {
    "room": {"width": 9, "height": 9},
    "agent": {"at": [2, 4], "facing": "down"},
    "caretaker": {"at": [6, 4], "facing": "down"},
    "things": [{"at": [2, 2], "color": "red"}, {"at": [6, 6], "color": "blue"}],
    "let": {"target": "things[0]", "distractor": "things[1]"},
}
# The caretaker is about to open the box, beside which the agent waits.
OPENING: dict[str, Any] = {
    "room": {"width": 9, "height": 9},
    "agent": {"at": [2, 3], "facing": "up"},
    "caretaker": {"at": [3, 2], "facing": "left", "state": "solving"},
    "things": [{"at": [2, 2]}, {"at": [6, 6]}],
    "let": {"target": "things[0]", "distractor": "things[1]", "caretaker.busy": True},
}

TRICKED: dict[str, Any] = {
    **MEETING,
    "let": {"target": "things[0]", "distractor": "things[1]", "decoy": "things[1]"},
}
SIDES: dict[str, Any] = {**MEETING, "agent": {"at": [4, 4], "facing": "right"}, "caretaker": {"at": [1, 1]}}
BETWEEN: dict[str, Any] = {**SIDES, "things": [{"at": [3, 4]}, {"at": [5, 4]}]}
EXTRA: dict[str, Any] = {
    "boxes": {},
    "switches": {"box": {"at": [4, 5]}},
    "generators": {"platform": {"at": [4, 5]}},
    "levers": {"gate": {"at": [6, 7]}, "niche": {"at": [7, 7]}, "apple": {"at": [7, 7]}},
}
MARBLE: dict[str, Any] = {
    **MEETING,
    "caretaker": {"at": [1, 1]},
    "marble": {"at": [4, 4]},
    "things": [{"at": [6, 4]}, {"at": [4, 6]}],
    "platform": {"at": [2, 3]},
    "agent": {"at": [3, 4], "facing": "right"},
}


def school(problem: str, cue: str = "", **params: str) -> str:
    """The name of a problem with a cue."""
    asked = "&".join(f"{key}={value}" for key, value in params.items())
    return f"school/{problem}" + (f"+{cue}" if cue else "") + (f"?{asked}" if asked else "")


def target_of(room: dict[str, Any]) -> dict[str, Any]:
    """The thing that leads to the apple."""
    return room["things"][int(room["let"]["target"][-2])]  # type: ignore[no-any-return]


def other_than(room: dict[str, Any], thing: dict[str, Any]) -> dict[str, Any]:
    """The other one of the two things."""
    return next(one for one in room["things"] if one is not thing)


def on_the_way(start: list[int], direction: str, cells: int = 10) -> list[tuple[int, int]]:
    """The cells straight ahead."""
    return [beside(start, direction, k) for k in range(1, cells)]


class TestIntroductions:
    def said(self, introduction: str, *acts: tuple[str | None, str | None]) -> list[str]:
        episode = Episode(school("boxes", "color", introduction=introduction), MEETING)
        return [episode.act(*act).heard for act in acts]

    def test_none(self) -> None:
        assert self.said("none", (None, None), (None, None)) == ["Caretaker: red", ""]

    def test_eye_contact_is_noticed_before_the_caretaker_turns(self) -> None:
        acts = [("left", None), (None, None), (None, None)]
        assert self.said("eye_contact", *acts) == ["", "Caretaker: red", ""]

    def test_eye_contact_needs_no_words(self) -> None:
        acts = [(None, "Help please"), ("left", None), ("right", None), ("left", None)]
        assert self.said("eye_contact", *acts) == ["", "Caretaker: red", "", ""]

    def test_ask(self) -> None:
        acts = [("left", None), (None, "Help you"), ("right", "Help please"), (None, "Help please")]
        assert self.said("ask", *acts) == ["", "", "Caretaker: red", ""]

    def test_ask_with_eye_contact_in_the_same_step(self) -> None:
        acts = [(None, "Help please"), ("left", None), ("right", "Help please"), ("left", "Help please")]
        assert self.said("ask_eye_contact", *acts) == ["", "", "", "Caretaker: red"]


class TestCues:
    @pytest.mark.parametrize("problem", PROBLEMS)
    def test_the_color_is_that_of_the_right_thing_and_said_once(self, problem: str) -> None:
        for seed in range(20):
            episode = Episode(school(problem, "color", introduction="none"), seed=seed)
            color = target_of(episode.now())["color"]
            assert episode.hears(*["left"] * 4) == [f"Caretaker: {color}", "", "", ""]

    @pytest.mark.parametrize("problem", PROBLEMS)
    def test_feedback_in_every_step_after_the_introduction(self, problem: str) -> None:
        heard = set()
        for seed in range(12):
            episode = Episode(school(problem, "feedback", introduction="none"), seed=seed)
            spot = target_of(episode.now())["at"]
            assert episode.act().heard == ""
            for k in range(30):
                step = episode.act("forward" if (seed + k * k) % 3 else "left")
                far = distance(episode.now()["agent"]["at"], spot)
                word = "Hot" if far <= 1 else "Warm" if far <= 2 else "Medium" if far <= 5 else "Cold"
                assert step.heard == f"Caretaker: {word}"
                heard.add(word)
        assert len(heard) >= 3

    def test_feedback_by_hand(self) -> None:
        # From (2, 4) to the box at (2, 2), which is opened, and away from where it was.
        episode = Episode(school("boxes", "feedback", introduction="none"), MEETING)
        heard = episode.hears("left", "left", "forward", "toggle", "left", "left", "forward", "forward")
        assert heard == [
            "",
            *(f"Caretaker: {word}" for word in ["Warm", "Hot", "Hot", "Hot", "Hot", "Warm", "Medium"]),
        ]
        assert [step.split()[-1] for step in episode.hears("left", "forward", "forward", "forward")][
            -1
        ] == "Cold"

    @pytest.mark.parametrize("problem", PROBLEMS)
    def test_pointing_is_unambiguous_and_in_nobodys_way(self, problem: str) -> None:
        for seed in range(40):
            episode = Episode(school(problem, "pointing", introduction="none"), seed=seed)
            room = episode.now()
            pointing = [episode.act() and episode.now()["caretaker"].get("pointing") for _ in range(40)]
            way, began = pointing[-1], pointing.index(pointing[-1])
            assert pointing == [None] * began + [way] * (40 - began)
            now = episode.now()
            ahead = on_the_way(now["caretaker"]["at"], way)
            target = target_of(room)
            assert tuple(target["at"]) in ahead
            assert tuple(other_than(room, target)["at"]) not in ahead
            if problem == "marbles":
                x, y = room["marble"]["at"]
                assert x != now["caretaker"]["at"][0]
                assert y != now["caretaker"]["at"][1]
            if problem == "doors":
                assert all(distance(door["at"], now["caretaker"]["at"]) > 1 for door in room["things"])

    def test_pointing_then_looks_at_the_agent(self) -> None:
        episode = Episode(
            school("boxes", "pointing", introduction="none"), {**MEETING, "agent": {"at": [4, 4]}}
        )
        for _ in range(30):
            episode.act()
        before = episode.now()["caretaker"]
        assert before["pointing"] is not None
        x, y = before["at"]
        assert distance((x, y), (4, 4)) > 0
        assert before["facing"] in toward((x, y), (4, 4))

    def test_only_the_cue_tells_the_right_thing(self) -> None:
        drawn = list(rooms(school("boxes"), 1500))
        check_shares((room["let"]["target"] for room in drawn), evenly(["things[0]", "things[1]"]))


def toward(here: tuple[int, int], there: tuple[int, int]) -> set[str]:
    """The directions that lead nearer."""
    return {way for way in FORWARD if distance(beside(here, way), there) < distance(here, there)}


class TestMisleading:
    """Before the introduction cues are about a random one of the two things; only then they are true."""

    def test_color(self) -> None:
        episode = Episode(school("boxes", "color", introduction="ask", misleading="true"), TRICKED)
        assert episode.hears(None, None, None) == ["Caretaker: blue", "", ""]
        assert episode.act(say="Help please").heard == "Caretaker: red"
        assert episode.hears(None, None) == ["", ""]

    def test_the_thing_it_is_about_is_drawn(self) -> None:
        name = school("boxes", "color", introduction="ask", misleading="true")
        same = [room["let"]["decoy"] == room["let"]["target"] for room in rooms(name, 1500)]
        check_shares(same, evenly([False, True]))

    def test_feedback(self) -> None:
        heard: list[str] = []
        for seed in range(60):
            name = school("boxes", "feedback", introduction="ask", misleading="true")
            episode = Episode(name, MEETING, seed)
            heard += episode.hears(*[None] * 20)
            assert episode.act(say="Help please").heard == ""
            assert episode.act().heard == "Caretaker: Warm"
        check_shares(heard, evenly(f"Caretaker: {word}" for word in ("Hot", "Warm", "Medium", "Cold")))

    def test_pointing(self) -> None:
        name = school("boxes", "pointing", introduction="ask", misleading="true")
        for seed in range(20):
            layout = {**TRICKED, "agent": {"at": [1, 7], "facing": "up"}}
            episode = Episode(name, layout, seed)
            episode.acts(*[None] * 25)
            caretaker = episode.now()["caretaker"]
            assert (6, 6) in on_the_way(caretaker["at"], caretaker["pointing"])
            assert caretaker["facing"] in toward(tuple(caretaker["at"]), (4, 4)), "it looks at the middle"
            assert episode.act(say="Help please").heard == ""
            assert episode.now()["caretaker"].get("pointing") is None
            episode.acts(*[None] * 25)
            caretaker = episode.now()["caretaker"]
            assert (2, 2) in on_the_way(caretaker["at"], caretaker["pointing"])
            assert caretaker["facing"] in toward(tuple(caretaker["at"]), (1, 7))

    def test_it_looks_at_the_middle_until_then(self) -> None:
        layout = {**TRICKED, "caretaker": {"at": [4, 1], "facing": "up"}}
        episode = Episode(school("boxes", "color", introduction="ask", misleading="true"), layout)
        episode.acts(None, None, None)
        assert episode.now()["caretaker"]["facing"] == "down"
        episode.act(say="Help please")
        episode.acts(None, None)
        assert episode.now()["caretaker"]["facing"] == "down", "the agent is at (2, 4), below and to the left"


class TestEmulation:
    @pytest.mark.parametrize("problem", PROBLEMS)
    def test_the_caretaker_eats_and_then_all_is_as_before(self, problem: str) -> None:
        for seed in range(15):
            episode = Episode(school(problem, "emulation", introduction="none"), seed=seed)
            before = episode.now()
            eaten = []
            for _ in range(70):
                step = episode.act()
                assert step.ended is None
                eaten.append(episode.now()["apple"]["state"] == "eaten")
                if episode.now()["caretaker"]["state"] == "watching":
                    break
            if not any(eaten):  # the agent stands in the way
                continue
            after = episode.now()
            changed = {key for key in after if after[key] != before.get(key)}
            assert changed <= {"t", "agent", "caretaker", "last", "heard", "pending"}
            assert after["caretaker"]["at"] == before["caretaker"]["at"]
            assert after["agent"]["at"] == before["agent"]["at"]

    def test_an_apple_that_the_caretaker_has_uncovered_does_not_count(self) -> None:
        episode = Episode(school("boxes", "emulation"), OPENING)
        assert episode.act().ended is None
        assert episode.now()["things"][0]["state"] == "opened"
        assert episode.act("toggle").ended is None
        assert episode.now()["apple"]["state"] == "eaten"
        while episode.now()["caretaker"]["state"] != "watching":
            assert episode.act().ended is None
        assert episode.now()["things"][0]["state"] == "shut"
        assert episode.act("toggle").ended is None
        step = episode.act("toggle")
        assert step.ended == "success"

    def test_who_helps_itself_before_the_introduction_succeeds(self) -> None:
        layout = {**MEETING, "agent": {"at": [2, 3], "facing": "up"}}
        episode = Episode(school("boxes", "emulation", introduction="ask"), layout)
        assert episode.acts("toggle", "toggle").ended == "success"


class TestScaffolding:
    def test_an_apple_that_the_caretaker_has_uncovered_counts(self) -> None:
        episode = Episode(school("boxes", "scaffolding"), OPENING)
        assert episode.act().ended is None
        step = episode.act("toggle")
        assert (step.ended, step.reward) == ("success", pytest.approx(1 - 0.1 * 2 / 80))

    @pytest.mark.parametrize("problem", PROBLEMS)
    def test_it_prepares_all_but_does_not_eat_and_goes_back(self, problem: str) -> None:
        prepared = 0
        for seed in range(15):
            episode = Episode(school(problem, "scaffolding", introduction="none"), seed=seed)
            home = episode.now()["caretaker"]["at"]
            episode.acts(*[None] * 70)
            now = episode.now()
            assert now["apple"]["state"] == "whole"
            prepared += now["caretaker"]["state"] == "watching" and now["caretaker"]["at"] == home
        assert prepared >= 12, "the agent may stand in the way"


class TestOutcome:
    @pytest.mark.parametrize("problem", list(EXTRA))
    def test_using_the_other_thing_makes_success_impossible(self, problem: str) -> None:
        layout = {**BETWEEN, **EXTRA[problem]}
        use = "forward" if problem == "generators" else "toggle"
        episode = Episode(school(problem), layout)
        episode.acts(use, "left", "left", use)
        right, wrong = (thing["state"] for thing in episode.now()["things"])
        initial = {"boxes": "shut", "levers": "down"}.get(problem, "idle")
        assert (right, wrong != initial) == (initial, True)
        episode = Episode(school(problem), layout)
        episode.acts("left", "left", use)
        assert episode.now()["things"][0]["state"] != initial

    def test_the_other_door(self) -> None:
        layout = {
            **SIDES,
            "things": [{"at": [6, 3]}, {"at": [6, 4]}],
            "niches": [{"at": [7, 3]}, {"at": [7, 4]}],
            "apple": {"at": [7, 3]},
            "agent": {"at": [5, 4], "facing": "right"},
        }
        episode = Episode(school("doors"), layout)
        episode.acts("toggle", "left", "forward", "right", "toggle")
        assert [door["state"] for door in episode.now()["things"]] == ["closed", "open"]
        episode = Episode(school("doors"), layout)
        assert episode.acts("left", "forward", "right", "toggle", "forward", "toggle").ended == "success"

    def test_the_marble_rolls_a_cell_a_step_into_the_generator(self) -> None:
        episode = Episode(school("marbles"), MARBLE)
        episode.act("forward")
        assert episode.now()["marble"]["at"] == [5, 4]
        assert episode.now()["apple"].get("gone")
        episode.act()
        assert episode.now()["things"][0]["state"] == "pressed"
        assert episode.now()["apple"]["at"] == [2, 3]
        episode.acts("left", "left", "forward")
        assert episode.act("right").ended is None
        assert episode.act("toggle").ended == "success"

    def test_a_generator_for_marbles_cannot_be_walked_into(self) -> None:
        layout = {**MARBLE, "agent": {"at": [7, 4], "facing": "left"}}
        episode = Episode(school("marbles"), layout)
        episode.acts("forward", "toggle")
        assert episode.now()["things"][0]["state"] == "idle"

    def test_the_marble_in_the_other_generator(self) -> None:
        layout = {**MARBLE, "agent": {"at": [4, 3], "facing": "down"}}
        episode = Episode(school("marbles"), layout)
        episode.acts("forward", None, None)
        assert [thing["state"] for thing in episode.now()["things"]] == ["idle", "pressed"]
        assert episode.now()["apple"].get("gone")

    def test_done_and_time(self) -> None:
        episode = Episode(school("boxes"), MEETING)
        assert episode.acts("done", *[None] * 78).ended is None
        assert episode.act().ended == "timeout"

    def test_the_picture_hides_what_is_in_the_boxes(self) -> None:
        name = school("boxes")
        for room in ({"target": "things[0]"}, {"target": "things[1]"}):
            episode = Episode(name, {**MEETING, "let": room})
            image = episode.image.tolist()
            assert image == Episode(name, MEETING).image.tolist()


@pytest.mark.thorough("plays 40 rooms of every problem with every cue and introduction")
@pytest.mark.parametrize("cue", CUES)
@pytest.mark.parametrize("problem", PROBLEMS)
def test_the_rooms_can_be_solved(problem: str, cue: str) -> None:
    """The scripted agent loses a room of a hundred: it searches too long, or gets in the caretaker's way."""
    for introduction in INTRODUCTIONS:
        name = school(problem, f"{cue}+oracle", introduction=introduction)
        assert solved(name, 40) >= 39, introduction


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.thorough("plays many rooms of every problem")
def test_they_can_be_solved_without_a_cue_and_with_misleading_ones(problem: str) -> None:
    assert solved(school(problem, "oracle"), 100) == 100
    for cue in ("color", "feedback", "pointing"):
        assert solved(school(problem, f"{cue}+oracle", misleading="true"), 40) >= 38


def solved(name: str, number: int) -> int:
    """How many of the rooms of the first seeds the scripted agent solves."""
    env = made(name)
    successes = 0
    for seed in range(number):
        env.reset(seed=seed)
        over = False
        while not over:
            *_, terminated, truncated, info = env.step(env.scripted_action())
            over = terminated or truncated
        successes += bool(info["success"])
    return successes


class TestAlone:
    @pytest.mark.parametrize("alone", ["asocial", "asocial+alone"])
    @pytest.mark.parametrize("problem", PROBLEMS)
    def test_without_a_caretaker_nobody_is_there_and_all_rooms_can_be_solved(
        self, problem: str, alone: str
    ) -> None:
        env = made(school(problem, alone))
        env.reset(seed=0)
        room = env.describe()
        assert "caretaker" not in room
        assert len(room["things"]) == (1 if "+" in alone else 2)
        assert solved(school(problem, f"{alone}+oracle"), 40) == 40

    @pytest.mark.parametrize("problem", PROBLEMS)
    def test_without_a_distractor_there_is_one_thing_and_a_caretaker(self, problem: str) -> None:
        assert solved(school(problem, "alone+oracle"), 40) == 40
        for seed in range(5):
            room = Episode(school(problem, "alone"), seed=seed).now()
            assert (len(room["things"]), room["let"]["target"]) == (1, "things[0]")
            assert not room["caretaker"].get("gone")

    def test_cues_are_given_without_a_distractor_as_well(self) -> None:
        episode = Episode(school("boxes", "alone+color", introduction="none"), seed=3)
        color = episode.now()["things"][0]["color"]
        assert episode.hears("left", "left") == [f"Caretaker: {color}", ""]

    @pytest.mark.parametrize(("split", "count"), [("", 12), ("?split=train", 10), ("?split=test", 2)])
    def test_the_suite_plays_each_problem_with_and_without_a_distractor(self, split: str, count: int) -> None:
        envs = sd.make_vec(f"school/information_seeking_asocial{split}", num_envs=400)
        envs.reset(seed=0)
        found = set(envs.members())
        assert len(found) == count
        assert any("doors" in leaf for leaf in found) == (split != "?split=train")

    @pytest.mark.parametrize("variant", ["alone", "asocial", "asocial+alone", "alone+pointing"])
    @pytest.mark.parametrize("problem", PROBLEMS)
    @pytest.mark.thorough("plays many rooms of every problem")
    def test_nothing_looks_odd(self, problem: str, variant: str) -> None:
        assert sd.load(school(problem, variant)).warnings == ()


@pytest.mark.parametrize("misleading", ["false", "true"])
@pytest.mark.parametrize("cue", CUES)
@pytest.mark.parametrize("problem", one_in(3, PROBLEMS, "loads hundreds of scenarios"))
def test_nothing_looks_odd(problem: str, cue: str, misleading: str) -> None:
    assert sd.load(school(problem, f"{cue}+oracle", misleading=misleading)).warnings == ()


@pytest.fixture(scope="module")
def leaves() -> dict[str, set[str]]:
    """Split -> the leaves that are played."""
    found = {}
    for name in ("", "?split=train", "?split=test", "?split=pointing_train", "?split=pointing_test"):
        envs = sd.make_vec(f"school/information_seeking{name}", num_envs=4000)
        envs.reset(seed=0)
        found[name] = set(envs.members())
    return found


@pytest.mark.thorough("compiles the hundreds of scenarios of the suite")
class TestSuite:
    def test_every_combination_is_played(self, leaves: dict[str, set[str]]) -> None:
        assert len(leaves[""]) == len(PROBLEMS) * len(INTRODUCTIONS) * len(CUES)

    def test_doors_are_held_out(self, leaves: dict[str, set[str]]) -> None:
        assert leaves["?split=train"] | leaves["?split=test"] == leaves[""]
        assert leaves["?split=test"] == {leaf for leaf in leaves[""] if "problem=doors" in leaf}
        assert not leaves["?split=train"] & leaves["?split=test"]
        assert leaves["?split=pointing_train"] == {
            leaf for leaf in leaves["?split=train"] if "cue=pointing" in leaf
        }
        assert leaves["?split=pointing_test"] == {
            leaf for leaf in leaves["?split=test"] if "cue=pointing" in leaf
        }

    def test_misleading(self) -> None:
        envs = sd.make_vec("school/information_seeking+misleading", num_envs=50)
        envs.reset(seed=0)
        assert all("misleading=true" in leaf for leaf in envs.members())

    def test_the_expert_curriculum_ends_with_the_hardest_introduction_alone(self) -> None:
        leaves = Leaves.of(sd.make_vec("school/information_seeking", num_envs=1))
        expert = build_curriculum("expert", leaves)
        assert all(expert.weights())
        for k in range(1500):
            expert.observe(k % len(leaves.names), success=True, steps=10)
        left = {name for name, weight in zip(leaves.names, expert.weights(), strict=True) if weight}
        assert left == {
            name
            for name in leaves.names
            if "introduction=ask_eye_contact" in name and "scaffolding=false" in name
        }
