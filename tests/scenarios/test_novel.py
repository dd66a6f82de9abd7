"""The scenarios beyond the paper: that they can be solved, what is drawn, who knows what, what is paid."""

from __future__ import annotations

from collections import Counter
from typing import Any, ClassVar

import pytest

import socialai_dsl as sd
from tests.quick import one_in
from tests.scenarios.playing import (
    BEYOND,
    FORWARD,
    Episode,
    beside,
    check_shares,
    distance,
    evenly,
    made,
    rooms,
)

# A shop whose keeper's mood is known, the agent beside the keeper.
SHOP: dict[str, Any] = {
    "room": {"width": 5, "height": 5},
    "agent": {"at": [2, 2], "facing": "up"},
    "keeper": {"at": [2, 3]},
}


FOUR = evenly((friends, meant) for friends in (False, True) for meant in (False, True))
"""Friends or not, and whether the idea is meant."""


def played(name: str, seed: int) -> tuple[dict[str, Any], dict[str, Any], float]:
    """The end of an episode of the scripted agent: the state, the info and the reward."""
    env = made(name)
    env.reset(seed=seed)
    while True:
        _, reward, terminated, truncated, info = env.step(env.scripted_action())
        if terminated or truncated:
            return env.describe(), info, float(reward)


@pytest.mark.parametrize("name", one_in(4, BEYOND, "plays 300 rooms"))
def test_the_rooms_can_be_solved(name: str) -> None:
    """The way to the apple of `culprit` can be barred for the whole time, in one room of a thousand."""
    solved = sum(bool(played(f"{name}+oracle", seed)[1]["success"]) for seed in range(300))
    assert solved >= (298 if name == "novel/culprit" else 300)


@pytest.mark.parametrize("name", BEYOND)
def test_nothing_looks_odd(name: str) -> None:
    assert sd.load(f"{name}+oracle").warnings == ()


class TestWhisper:
    def test_one_of_four_words(self) -> None:
        drawn = (room["let"]["secret"] for room in rooms("novel/whisper", 1500))
        check_shares(drawn, evenly(["saffron", "juniper", "clover", "thistle"]))

    def test_only_those_beside_hear_it(self) -> None:
        layout = {
            "room": {"width": 8, "height": 8},
            "agent": {"at": [3, 3], "facing": "right"},
            "elder": {"at": [5, 3]},
            "guard": {"at": [3, 5]},
            "exit": {"at": [4, 0]},
            "let": {"secret": "clover"},
        }
        episode = Episode("novel/whisper", layout)
        assert episode.act(say="What is the password").heard == ""
        assert episode.act(say="The password is thistle").ended is None, "the guard is two cells away"
        assert episode.act("forward", "What is the password").heard == "Elder: The password is clover"
        assert episode.now()["exit"]["state"] == "locked", "nor did the guard hear the elder"


class TestBargaining:
    def test_any_thing_may_have_any_price(self) -> None:
        drawn = [room["let"] for room in rooms("novel/bargaining", 1500)]
        check_shares((let["wanted"] for let in drawn), evenly(("the cup", "the coat", "the clock")))
        check_shares((let["tables.least[0]"] for let in drawn), evenly(range(3)))
        check_shares((let["more"] for let in drawn), evenly(range(1, 5)))

    @pytest.mark.parametrize(("coins", "ended"), [(3, None), (4, "success"), (6, "success"), (7, "failure")])
    def test_a_bargain_costs_what_he_takes_to_what_he_asks(self, coins: int, ended: str | None) -> None:
        prices = {f"tables.least[{k}]": k for k in (0, 1, 2)}
        episode = Episode("novel/bargaining", {"let": {"wanted": "the coat", "more": 2, **prices}})
        assert episode.act(say="How much is the coat").heard == "Sam: I ask 6 for the coat"
        assert episode.act(say=f"I offer {coins} for the coat").ended == ended

    def test_the_script_pays_no_coin_too_many(self) -> None:
        for seed in range(100):
            state, _, _ = played("novel/bargaining+oracle", seed)
            bought = ("the cup", "the coat", "the clock").index(state["let"]["wanted"])
            assert state["state"]["paid"] == (2, 4, 5)[state["let"][f"tables.least[{bought}]"]]


class TestConventions:
    def test_every_thing_comes_up_early_and_late(self) -> None:
        for seed in range(50):
            env = made("novel/conventions+oracle")
            env.reset(seed=seed)
            marked, ended = [], False
            while not ended:
                before = env.describe()
                _, _, terminated, truncated, _ = env.step(env.scripted_action())
                ended = terminated or truncated
                if len(marked) == before["state"]["round"]:
                    marked.append([thing["state"] for thing in before["things"]].index("tagged"))
            assert sorted(marked[:3]) == sorted(marked[3:6]) == [0, 1, 2]

    def test_a_code_of_one_s_own_fails_where_ann_has_named_a_thing(self) -> None:
        """The agent calls the first thing `blik`, the second `dax`, the third `wug`, whatever Ann has said."""
        right = 0
        for seed in range(60):
            episode = Episode("novel/conventions", seed=seed)
            ended = None
            while ended is None:
                here = episode.now()
                topic = [thing["state"] for thing in here["things"]].index("tagged")
                asked = here["ann"]["state"] == "listening"
                ended = episode.act(say=f"This is {('blik', 'dax', 'wug')[topic]}" if asked else None).ended
            right += ended == "success"
        assert right < 25


class TestCulprit:
    def test_anybody_at_any_moment(self) -> None:
        drawn = list(rooms("novel/culprit", 1500))
        check_shares((room["let"]["culprit"] for room in drawn), evenly(f"people[{k}]" for k in range(3)))
        check_shares((room["let"]["moment"] for room in drawn), evenly(range(3, 9)))
        assert all(len({one["color"] for one in room["people"]}) == 3 for room in drawn)

    def test_only_the_culprit_takes_it_and_not_before_the_moment(self) -> None:
        for seed in range(100):
            episode = Episode("novel/culprit", seed=seed)
            chosen = int(episode.now()["let"]["culprit"][-2])
            for t in range(1, 40):
                heard = episode.act().heard
                now = episode.now()
                stealing = [k for k, one in enumerate(now["people"]) if one["state"] == "stealing"]
                assert stealing in ([], [chosen])
                assert not (stealing and t < now["let"]["moment"])
                assert (heard != "") == (heard == "Sheriff: The apple is gone! Who was it?")
                if heard:
                    assert now["apple"]["gone"]
                    break


class TestInterpreter:
    def test_another_language_in_every_episode(self) -> None:
        languages = Counter(
            tuple(room["let"][f"tables.dar[{k}]"] for k in range(6))
            for room in rooms("novel/interpreter", 800)
        )
        assert all(sorted(language) == list(range(6)) for language in languages)
        assert len(languages) > 400, "of 720"

    def test_the_interpreter_translates_back(self) -> None:
        words = ["ana", "bel", "cor", "dol", "ers", "fit"]
        layout = {
            "room": {"width": 7, "height": 7},
            "agent": {"at": [3, 3]},
            "stranger": {"at": [2, 3]},
            "interpreter": {"at": [4, 3]},
        }
        for seed in range(10):
            episode = Episode("novel/interpreter", layout, seed)
            room = episode.now()
            color = room["doors"][int(room["let"]["exit"][-2])]["color"]
            _, word, _ = episode.act(say="Where is the exit").heard.split()
            assert episode.act(say=f"What means {word}").heard == f"Interpreter: {word} is {color}"
            meanings = {episode.act(say=f"What means {one}").heard.split()[-1] for one in words}
            assert meanings == {"red", "green", "blue", "purple", "yellow", "grey"}


class TestShop:
    def test_moods(self) -> None:
        check_shares((room["let"]["keeper.mood"] for room in rooms("novel/shop", 1500)), evenly(range(3)))

    @pytest.mark.parametrize("mood", range(3))
    @pytest.mark.parametrize("greetings", range(4))
    def test_each_of_three_greetings_takes_one_off_the_price(self, mood: int, greetings: int) -> None:
        episode = Episode("novel/shop", {**SHOP, "let": {"keeper.mood": mood}})
        episode.act()
        for _ in range(greetings):
            assert episode.act(say="Good day").heard == "Keeper: Good day to you"
        price = 6 - mood - greetings
        assert episode.act(say="Give me bread").heard == f"Keeper: It costs {price}"
        step = episode.act(say=f"I pay {price}")
        paid = (100 - 15 * (price - 1)) / 100 * (1 - 0.9 * (greetings + 3) / 40)
        assert (step.ended, step.reward) == ("success", pytest.approx(paid))

    def test_a_wrong_price_spoils_the_mood(self) -> None:
        episode = Episode("novel/shop", {**SHOP, "let": {"keeper.mood": 2}})
        episode.act()
        for price in (5, 6):
            assert episode.act(say="I pay 1").heard == "Keeper: That is not the price"
            assert episode.act(say="Give me bread").heard == f"Keeper: It costs {price}"
        step = episode.act(say="I pay 1")
        assert (step.heard, step.ended) == ("Keeper: We are closed", "failure")


class TestHaggling:
    @pytest.mark.parametrize("reserve", [2, 3, 4, 5])
    def test_the_scripted_agent_pays_the_least_that_is_taken(self, reserve: int) -> None:
        found = 0
        for seed in range(60):
            room, info, reward = played("novel/haggling+oracle", seed)
            if room["let"]["reserve"] == reserve:
                found += 1
                assert info["success"]
                assert room["let"]["seller.ask"] == reserve
                assert reward == pytest.approx(1 - 0.9 * room["t"] / 30)
        assert found > 5

    def test_who_pays_more_earns_less(self) -> None:
        layout = {
            "room": {"width": 5, "height": 5},
            "agent": {"at": [2, 2], "facing": "down"},
            "seller": {"at": [2, 3], "facing": "up"},
            "let": {"reserve": 4, "seller.least": 4},
        }
        episode = Episode("novel/haggling", layout)
        assert episode.act().heard == "Sam: It costs 9"
        step = episode.act(say="I offer 9")
        assert step.heard == "Sam: Sold"
        assert step.reward == pytest.approx(100 * 1 // 6 / 100 * (1 - 0.9 * 2 / 30))


class TestSallyAnne:
    @pytest.mark.parametrize(("moves", "share"), [("control", 0.0), ("mixed", 0.5), ("false_belief", 1.0)])
    def test_she_believes_it_where_she_has_put_it(self, moves: str, share: float) -> None:
        moved = []
        for seed in range(300):
            room, info, _ = played(f"novel/sally_anne+oracle?moves={moves}", seed)
            assert info["success"]
            assert room["sally"]["believes"]["toy_in"] == room["let"]["home"]
            assert room["toy"]["inside"] in (room["let"]["home"], room["let"]["other"])
            moved.append(room["toy"]["inside"] == room["let"]["other"])
        if share in (0.0, 1.0):
            assert set(moved) == {bool(share)}
        else:
            check_shares(moved, evenly([False, True]))

    def test_she_would_know_if_she_saw_it(self) -> None:
        # Sally looks at both boxes; Anne, beside the other one, is about to move the ball.
        layout = {
            "room": {"width": 8, "height": 8},
            "agent": {"at": [1, 1]},
            "experimenter": {"at": [6, 1]},
            "boxes": [{"at": [2, 4]}, {"at": [5, 4]}],
            "sally": {"at": [3, 2], "facing": "down", "state": "step2", "believes": {"toy_in": "boxes[0]"}},
            "anne": {"at": [5, 5], "facing": "up", "state": "moving"},
            "toy": {"inside": "boxes[0]"},
            "let": {"home": "boxes[0]", "other": "boxes[1]"},
        }
        episode = Episode("novel/sally_anne", layout)
        episode.acts(None, None)
        assert episode.now()["toy"]["inside"] == "boxes[1]"
        assert episode.now()["sally"]["believes"]["toy_in"] == "boxes[1]"


class TestGazeFollowing:
    def test_her_gaze_leads_to_the_box_and_to_no_other(self) -> None:
        for seed in range(100):
            episode = Episode("novel/gaze_following", seed=seed)
            room = episode.now()
            target = int(room["let"]["target"][-2])
            start = room["peer"]["at"]
            on_gaze = {
                way
                for way in FORWARD
                for k in range(1, 9)
                if beside(start, way, k) == tuple(room["boxes"][target]["at"])
            }
            assert len(on_gaze) == 1
            for k, box in enumerate(room["boxes"]):
                in_line = box["at"][0] == start[0] or box["at"][1] == start[1]
                assert in_line == (k == target)
            assert distance(start, room["boxes"][target]["at"]) > 1

    def test_she_looks_at_the_agent_until_their_eyes_meet(self) -> None:
        layout = {
            "room": {"width": 8, "height": 8},
            "agent": {"at": [3, 5], "facing": "up"},
            "peer": {"at": [5, 5], "facing": "down"},
            "boxes": [{"at": [0, 2]}, {"at": [7, 3]}, {"at": [5, 0]}],
            "let": {"target": "boxes[2]", "peer.referent": "boxes[2]"},
        }
        episode = Episode("novel/gaze_following", layout)
        assert episode.hears(*[None] * 5) == [""] * 5
        assert episode.now()["peer"]["facing"] == "left"
        assert episode.act("right").heard == "Ann: Look"
        episode.acts(None, None, None)
        assert episode.now()["peer"]["facing"] == "up"


class TestImplicature:
    LAYOUT: ClassVar[dict[str, Any]] = {
        "lamps": [{"at": [2, 0]}, {"at": [4, 0]}, {"at": [6, 0]}],
        "ann": {"at": [1, 1]},
        "examiner": {"at": [2, 5]},
        "agent": {"at": [4, 6], "facing": "up"},
    }

    def test_each_answer_is_right_in_a_third_of_the_rooms(self) -> None:
        answers = {(3, 3): "yes", (2, 3): "no"}
        drawn = [room["let"] for room in rooms("novel/implicature", 1500)]
        right = (answers.get((let["lit"], let["looked_at"]), "nobody knows") for let in drawn)
        check_shares(right, evenly(("yes", "no", "nobody knows")))

    def test_lamps_look_alike_to_the_agent(self) -> None:
        pictures = []
        for lit in (2, 3):
            env = made("novel/implicature")
            observation, _ = env.reset(
                seed=0, options={"layout": self.LAYOUT | {"let": {"lit": lit, "looked_at": 2}}}
            )
            pictures.append(observation["image"])
        assert (pictures[0] == pictures[1]).all()

    def test_ann_waits_until_the_agent_sees_her(self) -> None:
        away = self.LAYOUT | {"agent": {"at": [4, 6], "facing": "down"}, "let": {"lit": 3, "looked_at": 3}}
        episode = Episode("novel/implicature", away)
        assert episode.hears(*[None] * 10) == [""] * 10
        assert episode.acts("left", "left").heard == "Ann: I will look at the lamps"

    def test_an_answer_before_the_question_is_a_failure(self) -> None:
        episode = Episode("novel/implicature", self.LAYOUT | {"let": {"lit": 3, "looked_at": 3}})
        assert episode.act(say="I say yes").ended == "failure"


class TestFetch:
    def test_any_ball_for_either_person(self) -> None:
        drawn = [room["let"] for room in rooms("novel/fetch", 1000)]
        check_shares((let["wish"] for let in drawn), evenly(f"balls[{k}]" for k in range(3)))
        check_shares((let["receiver"] for let in drawn), evenly(("people[0]", "people[1]")))

    def test_max_takes_nothing_and_the_agent_has_one_thing_at_a_time(self) -> None:
        layout = {
            "room": {"width": 7, "height": 7},
            "agent": {"at": [3, 3], "facing": "up"},
            "asker": {"at": [2, 3]},
            "balls": [{"at": [3, 2]}, {"at": [4, 3]}, {"at": [5, 5]}],
        }
        episode = Episode("novel/fetch", layout)
        episode.acts("pickup", "right", "pickup", "left", "left", "drop")
        assert episode.now()["agent"]["carries"] == "balls[0]"
        assert "carries" not in episode.now()["asker"]


class TestReferenceGame:
    def test_some_two_words_single_out_the_star_and_not_all(self) -> None:
        for room in rooms("novel/reference_game", 200):
            *others, star = [{**ball["looks"], "color": ball["color"]} for ball in room["balls"]]
            pairs = (("size", "pattern"), ("size", "color"), ("pattern", "color"))
            found = [all(any(ball[key] != star[key] for key in pair) for ball in others) for pair in pairs]
            assert any(found)
            assert not all(found)

    def test_the_star_is_seen_on_one_ball(self) -> None:
        for room in rooms("novel/reference_game", 20):
            assert [ball["state"] for ball in room["balls"]] == ["plain"] * 3 + ["tagged"]

    def test_max_takes_any_other_that_fits(self) -> None:
        """Whatever is said that fits another ball leads to a failure."""
        for seed in range(12):
            env = made("novel/reference_game")
            env.reset(seed=seed)
            *others, star = [{**ball["looks"], "color": ball["color"]} for ball in env.describe()["balls"]]
            fits = any(all(ball[key] == star[key] for key in ("size", "pattern")) for ball in others)
            said = f"The {star['size']} {star['pattern']} one"
            *_, terminated, truncated, info = env.step(env.encode_action((None, said)))
            while not (terminated or truncated):
                *_, terminated, truncated, info = env.step(env.encode_action((None, None)))
            assert info["success"] != fits


class TestSarcasm:
    def test_bond_prize_and_idea_are_drawn_alone(self) -> None:
        drawn = [room["let"] for room in rooms("novel/sarcasm", 1200)]
        check_shares(((let["friends"], let["prize"] == let["proposed"]) for let in drawn), FOUR)

    @pytest.mark.parametrize(("friends", "meant"), FOUR)
    def test_the_words_are_the_same_and_tone_and_greeting_tell(self, friends: bool, meant: bool) -> None:
        let = {"friends": friends, "prize": f"boxes[{int(not meant)}]", "proposed": "boxes[0]"}
        episode = Episode("novel/sarcasm", {"let": let, "boxes": [{"color": "red"}, {"color": "blue"}]})
        heard = [line for _ in range(6) for line in episode.act().heard.split("\n") if line]
        greeting = "Hello my friend" if friends else "You again"
        tone = "laughing" if friends == meant else "calm"
        assert heard == [
            "Bob: Hello Ann",
            f"Ann: (calm) {greeting}",
            "Bob: I would open the red box",
            f"Ann: ({tone}) Great idea",
        ]

    def test_the_tone_is_not_seen(self) -> None:
        assert made("novel/sarcasm").observation_space["image"].shape == (7, 7, 4)


class TestGossip:
    QUESTIONS = ("Is Dan kind", "Is Ann kind", "Is Bob kind", "Is Cleo kind")

    def test_without_dan_s_deed_a_room_and_its_opposite_sound_alike(self) -> None:
        for helpful, lying in ((1, 0), (3, 5), (6, 2)):
            heard = []
            for gives, kind, liars in ((1, helpful, lying), (0, 7 - helpful, 7 - lying)):
                let = {"dan_gives": gives, "helpful": kind, "lying": liars}
                episode = Episode("novel/gossip", {"let": let})
                assert episode.hears(None, None)[-1] == ("Dan: Have a coin" if gives else "Dan: Go away")
                heard.append([episode.act(say=question).heard for question in self.QUESTIONS])
            assert heard[0] == heard[1]

    def test_nobody_helps_unless_they_are_kind(self) -> None:
        for helpful in range(1, 7):
            for k, name in enumerate(("Ann", "Bob", "Cleo")):
                episode = Episode("novel/gossip", {"let": {"helpful": helpful}})
                kind = helpful >> k & 1
                assert episode.act(say=f"Please help me {name}").ended == ("success" if kind else "failure")


class TestSecondOrder:
    def test_max_waits_for_anne_in_half_of_the_rooms(self) -> None:
        check_shares((room["let"]["waits"] for room in rooms("novel/second_order", 1000)), evenly((0, 1)))

    @pytest.mark.parametrize("waits", [0, 1])
    def test_anne_knows_what_sally_was_told_if_she_was_there(self, waits: int) -> None:
        for seed in range(20):
            env = made("novel/second_order")
            env.reset(seed=seed, options={"layout": {"let": {"waits": waits}}})
            while env.describe()["teller"]["state"] != "listening":
                env.step(env.encode_action((None, None)))
            now = env.describe()
            assert now["sally"]["believes"]["ball_in"] == now["let"]["other"]
            assert now["anne"]["believes"]["sally_thinks"] == now["let"]["other" if waits else "home"]


class TestTurnTaking:
    @pytest.mark.parametrize("patience", [1, 2, 3])
    def test_the_partner_takes_its_time(self, patience: int) -> None:
        layout = {"let": {"patience": patience}}
        episode = Episode("novel/turn_taking", layout)
        for number in (1, 3, 5, 7):
            assert episode.hears(*[None] * patience) == [*[""] * (patience - 1), f"Pat: Now {number}"]
            step = episode.act(say=f"Now {number + 1}")
            assert step.ended == ("success" if number == 7 else None)

    def test_patience_is_drawn(self) -> None:
        check_shares(
            (room["let"]["patience"] for room in rooms("novel/turn_taking", 1500)), evenly([1, 2, 3])
        )
