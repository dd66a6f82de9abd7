"""SocialEnv: which scenario is drawn, whose sentences are heard, whose rules and time hold."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.envs import ScenarioVectorEnv
from tests.scenarios.playing import Episode, check_shares, evenly, made, rooms

SUITES = ["social_env+as_coded", "social_env"]
CODED, PAPER = SUITES
MEMBERS = ["dance", "cointhief", "talkitout", "showme", "diverse_exit", "help"]
HORIZONS = dict(zip(MEMBERS, (20, 20, 100, 100, 50, 20), strict=True))
# Templates and nouns of each member, one after another, as the research code has them.
TEMPLATES = dict(zip(MEMBERS, (2, 1, 4, 2, 4, 2), strict=True))
NOUNS = dict(zip(MEMBERS, (2, 7, 16, 2, 16, 2), strict=True))
LIVE = dict(zip(MEMBERS, (4, 7, 64, 4, 64, 4), strict=True))
DANCE = [["left", None], ["right", "Move your body"], ["left", None]]
COINS: dict[str, Any] = {
    "member": "cointhief",
    "thief": {"at": [3, 3], "facing": "right"},
    "agent": {"at": [4, 3], "facing": "left"},
    "let": {"glance": "left", "wanted": 4},
}


def played(suite: str, member: str, **layout: Any) -> Episode:
    return Episode(suite, {"member": member, **layout})


def after_each_pair(suite: str, **layout: Any) -> tuple[list[tuple[int, int]], ScenarioVectorEnv, Any]:
    """Every pair of a suite, environments in each of which one was said, and what that step gave."""
    program = made(suite).program
    pairs = list(product(range(len(program.templates)), range(len(program.nouns))))
    envs = sd.make_vec(program, len(pairs), autoreset_mode="Disabled")
    envs.reset(seed=0, options={"layout": layout})
    return pairs, envs, envs.step(np.array([(7, 1, *pair) for pair in pairs]))


def segment(member: str, lengths: dict[str, int]) -> range:
    start = sum(lengths[other] for other in MEMBERS[: MEMBERS.index(member)])
    return range(start, start + lengths[member])


class TestTheDraw:
    @pytest.mark.parametrize("suite", SUITES)
    def test_members_are_drawn_evenly_for_each_episode(self, suite: str) -> None:
        check_shares((room["member"] for room in rooms(suite, 3000)), evenly(MEMBERS))
        env, members = made(suite), set()
        env.reset(seed=0)
        for _ in range(60):
            members.add(env.reset()[1]["member"])
        assert members == set(MEMBERS)

    @pytest.mark.parametrize("suite", SUITES)
    def test_the_test_has_the_other_role(self, suite: str) -> None:
        drawn = {room["member"] for room in rooms(f"{suite}?split=test", 200)}
        assert drawn == {*MEMBERS, "help_as_helper"} - {"help"}
        train = {room["member"] for room in rooms(f"{suite}?split=train", 200)}
        assert train == set(MEMBERS)
        assert "jill.goal" in Episode(f"{suite}?split=test", {"member": "help_as_helper"}).now()["let"]

    @pytest.mark.parametrize("suite", SUITES)
    def test_rooms_are_those_of_the_members(self, suite: str) -> None:
        for room in rooms(suite, 300):
            assert {
                "dance": "dancer",
                "cointhief": "thief",
                "talkitout": "liar",
                "showme": "jim",
                "diverse_exit": "teacher",
                "help": "jill",
            }[room["member"]] in room
            if room["member"] == "cointhief":
                assert room["room"] == {"width": 8, "height": 8}


class TestSentences:
    def test_as_coded_the_grammars_stand_one_after_another(self) -> None:
        env = made(CODED)
        assert env.action_space.nvec.tolist() == [8, 2, 15, 45]
        for member in MEMBERS:
            own = made(f"{member}+as_coded").program
            assert tuple(env.program.templates[k] for k in segment(member, TEMPLATES)) == own.templates
            assert tuple(env.program.nouns[k] for k in segment(member, NOUNS)) == own.nouns

    def test_as_in_the_paper_they_are_merged(self) -> None:
        env = made(PAPER)
        assert env.action_space.nvec.tolist() == [8, 2, 7, 26]
        assert len(set(env.program.templates)) == 7
        assert len(set(env.program.nouns)) == 26

    @pytest.mark.parametrize("member", MEMBERS)
    def test_as_coded_only_the_member_s_own_pairs_are_heard(self, member: str) -> None:
        pairs, envs, _ = after_each_pair(CODED, member=member)
        assert len(pairs) == 15 * 45
        live = {pair for row, pair in enumerate(pairs) if envs.describe(row)["last"]["said"] is not None}
        assert live == set(product(segment(member, TEMPLATES), segment(member, NOUNS)))
        assert len(live) == LIVE[member]

    @pytest.mark.parametrize("member", MEMBERS)
    def test_as_in_the_paper_the_pair_must_be_one_of_the_member(self, member: str) -> None:
        program, own = made(PAPER).program, made(member).program
        sentences = {t.replace("<noun>", n) for t, n in product(own.templates, own.nouns)}
        pairs, envs, _ = after_each_pair(PAPER, member=member)
        assert len(pairs) == 7 * 26
        for row, (t, n) in enumerate(pairs):
            sentence = program.templates[t].replace("<noun>", program.nouns[n])
            assert envs.describe(row)["last"]["said"] == (sentence if sentence in sentences else None)

    def test_as_coded_a_foreign_pair_is_silence(self) -> None:
        # Any utterance ends CoinThief, and these say the right number in vain.
        pairs, _, (_, rewards, terminated, *_) = after_each_pair(CODED, **COINS)
        for (template, noun), reward, ended in zip(pairs, rewards, terminated, strict=True):
            assert ended == (template == 2 and 2 <= noun <= 8)
            assert (reward > 0) == ((template, noun) == (2, 6))

    def test_as_coded_a_foreign_pair_keeps_a_dance_silent(self) -> None:
        room = {"room": {"width": 7, "height": 7}, "agent": {"at": [5, 5]}, "let": {"dance": DANCE}}
        # In Dance, and the same words of ShowMe's and of Help's part.
        for template, noun, paid in [
            (0, 0, False),
            (7, 25, True),
            (13, 43, True),
            (0, 25, True),
            (2, 6, True),
        ]:
            episode = played(CODED, "dance", **room)
            episode.acts(*[None] * 6)
            episode.act("left")
            episode.act("right", "Move your body")
            _, reward, _, _, _ = episode.env.step(np.array([0, 1, template, noun]))
            assert (reward > 0) == paid, (template, noun)

    def test_words_mean_the_pair_of_the_member_that_is_played(self) -> None:
        for member, sentence in [
            ("showme", "Shake your head"),
            ("help", "Shake your head"),
            ("dance", "Shake your head"),
        ]:
            episode = played(CODED, member)
            _, speaks, template, noun = episode.env.encode_action((None, sentence))
            assert (speaks, template) == (1, segment(member, TEMPLATES)[1])
            assert noun == segment(member, NOUNS)[1]


class TestRules:
    @pytest.mark.parametrize("suite", SUITES)
    @pytest.mark.parametrize("member", MEMBERS)
    def test_each_has_its_own_time(self, suite: str, member: str) -> None:
        episode = played(suite, member)
        assert all(episode.act().ended is None for _ in range(HORIZONS[member] - 1))
        assert episode.act().ended == "timeout"

    @pytest.mark.parametrize("suite", SUITES)
    @pytest.mark.parametrize("member", MEMBERS)
    def test_which_actions_end_it(self, suite: str, member: str) -> None:
        ending = {
            "dance": {"toggle", "done"},
            "cointhief": {"forward", "pickup", "drop", "toggle", "done"},
            "talkitout": {"toggle", "done"},
        }.get(member, {"done"})
        room = {} if member == "cointhief" else {"room": {"width": 7, "height": 7}}
        room |= {"agent": {"at": [5, 5], "facing": "up"}} if member != "cointhief" else {}
        for body in made(suite).program.actions:
            step = played(suite, member, **room).act(body)
            assert (step.ended, step.reward) == ("failure" if body in ending else None, 0), body

    def test_rewards_go_by_the_time_of_the_member(self) -> None:
        for suite in SUITES:
            step = Episode(suite, COINS).act(say="Here is 4")
            assert (step.ended, step.reward) == ("success", pytest.approx(1 - 0.9 / 20))
            door = {"doors": [{"at": [2, 0]}], "let": {"exit": "doors[0]"}}
            room = {"room": {"width": 6, "height": 6}, "agent": {"at": [2, 1], "facing": "up"}, **door}
            talk = played(
                suite, "talkitout", **room, wizard={"at": [4, 4]}, honest={"at": [1, 4]}, liar={"at": [4, 1]}
            )
            assert talk.act(say="Open sesame").reward == pytest.approx(1 - 0.9 / 100)

    def test_members_play_as_coded_too(self) -> None:
        assert Episode(CODED, COINS).act().heard == "Freeze! Give me all the coins you have!"
        assert Episode(PAPER, COINS).act().heard == "Eve: Freeze! Give me all your coins!"
        assert played(CODED, "dance").act().heard == "Look at me!"
        assert played(PAPER, "dance").act().heard == "Ren: Look at me!"
        assert Episode(CODED, COINS).act("forward", "Here is 4").ended == "success"
        assert Episode(PAPER, COINS).act("forward", "Here is 4").ended == "failure"

    @pytest.mark.parametrize(("suite", "late"), [(CODED, True), (PAPER, False)])
    def test_as_coded_the_picture_is_one_step_late(self, suite: str, late: bool) -> None:
        room = {"room": {"width": 7, "height": 7}, "teacher": {"at": [3, 3], "facing": "down"}}
        episode = played(suite, "diverse_exit", **room, agent={"at": [2, 3], "facing": "right"})
        episode.act()
        assert episode.now()["teacher"]["facing"] == "left"
        assert episode.seen((3, 3))[3] == (1 if late else 2)

    def test_as_coded_doors_of_showme_are_in_three_walls(self) -> None:
        for suite, walls in ((CODED, {"top", "side"}), (PAPER, {"top"})):
            found = set()
            for seed in range(60):
                door = Episode(suite, {"member": "showme"}, seed).now()["door"]["at"]
                found.add("top" if door[1] == 0 else "side")
            assert found == walls
