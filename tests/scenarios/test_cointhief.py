"""CoinThief: what the thief sees, how often each number is wanted, what is paid, what the tags show."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from tests.scenarios.playing import (
    BALL,
    FORWARD,
    NPC,
    OPPOSITE,
    Episode,
    beside,
    check_shares,
    evenly,
    interior,
    rooms,
)

WAYS = ("right", "down", "left", "up")
NUMBERS = range(7)
COIN, TAGGED_COIN = (BALL, 4, 0, 0), (BALL, 4, 1, 1)
# The thief faces right and glances up.
ROOM: dict[str, Any] = {
    "thief": {"at": [3, 3], "facing": "right"},
    "agent": {"at": [4, 3], "facing": "left"},
    "coins": [
        {"at": [6, 5]},  # ahead, two aside
        {"at": [3, 5]},  # beside it: its own row counts
        {"at": [1, 1]},  # up, two aside
        {"at": [2, 3]},  # beside it, once it looks up
        {"at": [3, 6]},  # beside it, but three aside
        {"at": [2, 5]},  # behind it, and behind it once it looks up
    ],
    "let": {"glance": "left"},
}


def in_view(viewer: list[int], facing: str, cell: list[int]) -> bool:
    """Whether a cell lies in the 5x5 square whose near edge has the viewer in its middle."""
    (across, down), x, y = FORWARD[facing], cell[0] - viewer[0], cell[1] - viewer[1]
    ahead, aside = x * across + y * down, y * across - x * down
    return 0 <= ahead <= 4 and -2 <= aside <= 2


def glance_of(room: dict[str, Any]) -> tuple[str, str]:
    """The thief's direction at first and the one that it glances to, from nothing but the glance."""
    home = room["thief"]["facing"]
    return home, WAYS[(WAYS.index(home) + {"left": -1, "right": 1}[room["let"]["glance"]]) % 4]


def believed(room: dict[str, Any]) -> list[bool]:
    """For each coin whether the thief sees it in either direction."""
    return [
        any(in_view(room["thief"]["at"], way, coin["at"]) for way in glance_of(room))
        for coin in room["coins"]
    ]


@pytest.fixture(scope="module")
def drawn() -> list[dict[str, Any]]:
    """Many rooms; room k is that of seed k."""
    return list(rooms("cointhief+as_coded", 4000))


class TestRooms:
    def test_the_thief_is_beside_the_agent_and_faces_it(self, drawn: list[dict[str, Any]]) -> None:
        for room in drawn:
            assert room["room"] == {"width": 8, "height": 8}
            assert beside(room["thief"]["at"], room["thief"]["facing"]) == tuple(room["agent"]["at"])

    def test_six_yellow_coins_on_cells_of_their_own(self, drawn: list[dict[str, Any]]) -> None:
        for room in drawn:
            cells = {tuple(coin["at"]) for coin in room["coins"]}
            assert len(cells) == 6
            assert cells <= interior(room["room"]) - {tuple(room["agent"]["at"]), tuple(room["thief"]["at"])}
            assert {coin["color"] for coin in room["coins"]} == {"yellow"}

    def test_the_agent_comes_first_then_the_thief_evenly_around_it(self, drawn: list[dict[str, Any]]) -> None:
        cells = interior({"width": 8, "height": 8})
        check_shares((tuple(room["agent"]["at"]) for room in drawn), evenly(cells))
        inner = [room for room in drawn if set(room["agent"]["at"]).isdisjoint({1, 6})]
        check_shares((room["thief"]["facing"] for room in inner), evenly(WAYS))
        corner = [room for room in drawn if room["agent"]["at"] == [1, 1]]
        check_shares((tuple(room["thief"]["at"]) for room in corner), evenly([(1, 2), (2, 1)]))

    def test_the_side_is_even(self, drawn: list[dict[str, Any]]) -> None:
        check_shares((room["let"]["glance"] for room in drawn), evenly(("left", "right")))


class TestWantedNumber:
    def test_it_counts_the_coins_in_either_view(self, drawn: list[dict[str, Any]]) -> None:
        for room in drawn:
            assert room["let"]["wanted"] == sum(believed(room))

    def test_by_hand(self) -> None:
        room = Episode("cointhief", ROOM).now()
        assert believed(room) == [True, True, True, True, False, False]
        assert room["let"]["wanted"] == 4
        other = Episode("cointhief", {**ROOM, "let": {"glance": "right"}}).now()
        assert other["let"]["wanted"] == 5, "looking down: no longer the third, but the last two"

    @pytest.mark.parametrize("name", ["cointhief+as_coded", "cointhief"])
    def test_how_often_each_number_is_wanted(self, name: str) -> None:
        measured = {0: 0.032, 1: 0.100, 2: 0.160, 3: 0.201, 4: 0.226, 5: 0.192, 6: 0.089}
        number = 20_000
        envs = sd.make_vec(name, num_envs=number, autoreset_mode="Disabled")
        paid = np.zeros(number, int)
        for noun, share in measured.items():
            envs.reset(seed=5)
            _, rewards, terminated, _, _ = envs.step(np.tile([3, 1, 0, noun], (number, 1)))
            assert terminated.all()
            paid += rewards > 0
            # The research code's rooms were a sample of the same size.
            error = sqrt(2 * share * (1 - share) / number)
            assert abs((rewards > 0).mean() - share) < 4 * error, noun
        assert (paid == 1).all(), "in each room exactly one number is right"


class TestTheThief:
    def glances(self, name: str, layout: dict[str, Any] | None, seed: int = 0) -> tuple[list[str], list[int]]:
        """The thief's direction after each of eight steps, and the one in the picture."""
        episode = Episode(name, layout, seed)
        agent, thief = episode.now()["agent"], episode.now()["thief"]
        ways, pictures = [], []
        turns = (WAYS.index(OPPOSITE[thief["facing"]]) - WAYS.index(agent["facing"])) % 4
        for k in range(8):
            episode.act("right" if k < turns else None)
            ways.append(episode.now()["thief"]["facing"])
            if k + 1 >= turns:  # the agent faces the thief
                code = episode.seen(thief["at"])
                assert code[0] == NPC
                pictures.append(code[3])
        return ways, pictures

    def test_it_glances_to_its_side_and_back(self, drawn: list[dict[str, Any]]) -> None:
        for seed, room in enumerate(drawn[:200]):
            home, side = glance_of(room)
            ways, pictures = self.glances("cointhief+as_coded", None, seed)
            assert ways == [side, home] * 4
            late = [WAYS.index(way) for way in [home, *ways]]
            assert pictures == late[8 - len(pictures) : 8]

    @pytest.mark.parametrize(("name", "first"), [("cointhief+as_coded", "right"), ("cointhief", "up")])
    def test_as_coded_the_picture_is_one_step_late(self, name: str, first: str) -> None:
        other = {"right": "up", "up": "right"}[first]
        assert self.glances(name, ROOM)[1] == [WAYS.index(way) for way in [first, other] * 4]

    def test_what_it_says(self) -> None:
        assert Episode("cointhief+as_coded", ROOM).hears(*[None] * 19) == [
            "Freeze! Give me all the coins you have!",
            *[""] * 18,
        ]
        assert Episode("cointhief", ROOM).hears(None, None) == ["Eve: Freeze! Give me all your coins!", ""]

    def test_hidden(self) -> None:
        episode = Episode("cointhief+as_coded+unsocial", ROOM)
        assert episode.act().heard == ""
        assert episode.image[..., 0].max() < NPC
        step = episode.act(say="Here is 4")
        assert (step.ended, step.reward) == ("success", pytest.approx(1 - 0.9 * 2 / 20))


class TestOutcome:
    @pytest.mark.parametrize("name", ["cointhief+as_coded", "cointhief"])
    @pytest.mark.parametrize("given", NUMBERS)
    def test_any_number_ends_it_and_the_right_one_pays(self, name: str, given: int) -> None:
        step = Episode(name, ROOM).act(say=f"Here is {given}")
        assert (step.ended, step.reward) == (
            ("success", pytest.approx(0.955)) if given == 4 else ("failure", 0)
        )

    @pytest.mark.parametrize("name", ["cointhief+as_coded", "cointhief"])
    @pytest.mark.parametrize("body", ["left", "right", None])
    def test_turning_is_allowed(self, name: str, body: str | None) -> None:
        episode = Episode(name, ROOM)
        steps = [episode.act(body) for _ in range(18)]
        assert all(step.ended is None for step in steps)
        assert episode.act(body, "Here is 4").reward == pytest.approx(1 - 0.9 * 19 / 20)

    @pytest.mark.parametrize("name", ["cointhief+as_coded", "cointhief"])
    def test_a_forward_move_ends_it(self, name: str) -> None:
        assert Episode(name, ROOM).act("forward").ended == "failure"
        free = {**ROOM, "agent": {"at": [4, 3], "facing": "right"}}
        episode = Episode(name, free)
        assert episode.acts(None, "forward").ended == "failure"

    def test_as_coded_a_forward_move_with_the_right_number_pays(self, drawn: list[dict[str, Any]]) -> None:
        for seed, room in enumerate(drawn[:300]):
            right = f"Here is {sum(believed(room))}"
            wrong = f"Here is {(sum(believed(room)) + 1) % 7}"
            assert Episode("cointhief+as_coded", seed=seed).act("forward", right).ended == "success"
            assert Episode("cointhief", seed=seed).act("forward", right).ended == "failure"
            assert Episode("cointhief+as_coded", seed=seed).act("forward", wrong).ended == "failure"

    def test_time(self) -> None:
        episode = Episode("cointhief+as_coded", ROOM)
        assert episode.acts(*[None] * 19).ended is None
        assert episode.act().ended == "timeout"
        episode = Episode("cointhief+as_coded", ROOM)
        episode.acts(*[None] * 19)
        assert episode.act(say="Here is 4").reward == pytest.approx(0.1)


class TestTags:
    @pytest.mark.parametrize("name", ["cointhief+tags", "cointhief+tags+as_coded"])
    def test_tagged_coins_are_those_that_are_counted(self, name: str) -> None:
        shown = set()
        for seed in range(200):
            episode = Episode(name, seed=seed)
            room = episode.now()
            for k, (coin, counted) in enumerate(zip(room["coins"], believed(room), strict=True)):
                assert coin["state"] == ("tagged" if counted else "plain"), (seed, k)
                if self.visible(room["agent"], coin["at"]):
                    code = episode.seen(coin["at"])
                    assert code == (TAGGED_COIN if counted else COIN)
                    shown.add(code)
        assert shown == {COIN, TAGGED_COIN}

    @staticmethod
    def visible(agent: dict[str, Any], cell: list[int]) -> bool:
        """Whether a cell lies in the agent's 7x7 picture."""
        (across, down), (ax, ay) = FORWARD[agent["facing"]], agent["at"]
        x, y = cell[0] - ax, cell[1] - ay
        return 0 <= x * across + y * down <= 6 and abs(y * across - x * down) <= 3

    def test_without_tags_all_coins_look_alike(self) -> None:
        episode = Episode("cointhief+as_coded", {**ROOM, "agent": {"at": [4, 3], "facing": "right"}})
        assert episode.seen((6, 5)) == COIN

    def test_tags_stay_while_the_thief_looks_around(self) -> None:
        episode = Episode("cointhief+tags+as_coded", {**ROOM, "agent": {"at": [4, 3], "facing": "left"}})
        counted = believed(episode.now())
        for _ in range(4):
            episode.act()
            assert [coin["state"] == "tagged" for coin in episode.now()["coins"]] == counted

    def test_tags_change_nothing_else(self, drawn: list[dict[str, Any]]) -> None:
        tagged = rooms("cointhief+tags+as_coded", 200)
        for plain, other in zip(drawn, tagged, strict=False):
            untagged = [{**coin, "state": "plain"} for coin in other["coins"]]
            assert {**other, "coins": untagged} == plain


def test_nothing_hides_a_coin_from_the_thief() -> None:
    row = [(4, 2), (4, 3), (4, 4), (6, 3), (6, 2), (1, 6)]
    layout = {
        "thief": {"at": [2, 3], "facing": "right"},
        "agent": {"at": [3, 3]},
        "coins": [{"at": list(cell)} for cell in row],
        "let": {"glance": "left"},
    }
    assert Episode("cointhief", layout).now()["let"]["wanted"] == 5


def test_a_layout_may_give_what_the_thief_wants() -> None:
    layout = {**ROOM, "let": {"glance": "left", "wanted": 0}}
    assert Episode("cointhief", layout).act(say="Here is 0").ended == "success"
