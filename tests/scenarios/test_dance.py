"""Dance: when what is heard and shown, what counts as a repetition, and what it pays."""

from __future__ import annotations

from itertools import product
from typing import Any

import pytest

from tests.scenarios.playing import (
    EMPTY,
    NPC,
    Episode,
    check_shares,
    evenly,
    interior,
    rooms,
)

DANCE = [["left", "Move your body"], ["right", None], ["forward", "Shake your head"]]
HALL: dict[str, Any] = {
    "room": {"width": 8, "height": 8},
    "agent": {"at": [3, 6], "facing": "up"},
    "let": {"dance": DANCE},
}
SENTENCES = ("Move your body", "Move your head", "Shake your body", "Shake your head")


def prompted(name: str = "dance+as_coded", **changes: Any) -> Episode:
    """An episode up to the prompt."""
    episode = Episode(name, {**HALL, **changes})
    while not episode.act().heard.endswith("Now repeat my moves!"):
        pass
    return episode


def repeated(episode: Episode, *acts: Any) -> list[float]:
    """The rewards of acts, each [body action, sentence]."""
    return [episode.act(*act).reward for act in acts]


def test_as_coded_there_is_an_idle_step_and_names_are_not_heard() -> None:
    episode = Episode("dance+as_coded", HALL)
    steps = []
    for _ in range(7):
        heard = episode.act().heard
        dancer = episode.now()["dancer"]
        steps.append((heard, dancer["facing"], tuple(dancer["at"])))
    assert steps == [
        ("Look at me!", "down", (3, 4)),
        ("", "down", (3, 4)),
        ("Move your body", "right", (3, 4)),
        ("", "down", (3, 4)),
        ("Shake your head", "down", (3, 5)),
        ("Now repeat my moves!", "down", (3, 5)),
        ("", "down", (3, 5)),
    ]


def test_as_in_the_paper_the_dance_begins_at_once_and_names_are_heard() -> None:
    assert Episode("dance", HALL).hears(*[None] * 6) == [
        "Ren: Look at me!",
        "Ren: Move your body",
        "",
        "Ren: Shake your head",
        "Ren: Now repeat my moves!",
        "",
    ]


@pytest.mark.parametrize(("name", "late"), [("dance+as_coded", 1), ("dance", 0)])
def test_as_coded_the_picture_is_one_step_late(name: str, late: int) -> None:
    episode = Episode(name, {**HALL, "agent": {"at": [2, 6], "facing": "up"}})
    shown = []
    for _ in range(7):
        episode.act()
        ahead, beyond = episode.seen((3, 5)), episode.seen((3, 4))
        dancer, cell = (ahead, (3, 5)) if ahead[0] == NPC else (beyond, (3, 4))
        shown.append((dancer[3], cell))
    moves = [(0, (3, 4)), (1, (3, 4)), (1, (3, 5))]  # it turns left (east), back and goes forward
    before = [(1, (3, 4))] * (1 + 2 * late)
    assert shown == (before + moves + [moves[-1]] * 7)[:7]


def test_the_earliest_success() -> None:
    episode = prompted()
    assert episode.now()["t"] == 6
    assert repeated(episode, *DANCE) == [0, 0, pytest.approx(0.595)]
    assert episode.now()["t"] == 9


def test_the_earliest_success_without_the_idle_step() -> None:
    assert repeated(prompted("dance"), *DANCE)[-1] == pytest.approx(1 - 0.9 * 8 / 20)


def test_every_dance_can_be_repeated() -> None:
    for seed in range(300):
        episode = Episode("dance+as_coded", seed=seed)
        dance = episode.now()["let"]["dance"]
        episode.acts(*[None] * 6)
        assert repeated(episode, *dance) == [0, 0, pytest.approx(0.595)]


def test_the_window_slides() -> None:
    assert repeated(prompted(), ["right", None], *DANCE) == [0, 0, 0, pytest.approx(0.55)]


def test_there_are_several_attempts() -> None:
    episode = prompted()
    wrong = [["left", "Move your body"], ["left", None], ["forward", "Shake your head"]]
    rewards = repeated(episode, *wrong * 3, *DANCE)
    assert rewards == [0] * 11 + [pytest.approx(1 - 0.9 * 18 / 20)]


def test_what_is_done_before_the_prompt_does_not_count() -> None:
    episode = Episode("dance+as_coded", HALL)
    episode.acts(*[None] * 5)
    # The first of them is done in the step of the prompt.
    assert repeated(episode, *DANCE, *DANCE[1:]) == [0] * 5
    episode = Episode("dance+as_coded", HALL)
    episode.acts(*[None] * 3)
    assert repeated(episode, *DANCE) == [0] * 3, "dancing along is no repetition"
    assert repeated(episode, *DANCE)[-1] > 0


def variations() -> list[Any]:
    """The dance with one move or one sentence changed."""
    changed = []
    for place, (move, said) in enumerate(DANCE):
        for other in ("left", "right", "forward", None):
            if other != move:
                changed.append([*DANCE[:place], [other, said], *DANCE[place + 1 :]])
        for other in (*SENTENCES, None):
            if other != said:
                changed.append([*DANCE[:place], [move, other], *DANCE[place + 1 :]])
    return changed


@pytest.mark.parametrize("name", ["dance+as_coded", "dance"])
def test_only_the_exact_dance_counts(name: str) -> None:
    assert len(variations()) == 3 * (3 + 4)
    for wrong in variations():
        assert repeated(prompted(name), *wrong) == [0, 0, 0], wrong


def test_doing_nothing_matches_no_move() -> None:
    for move in ("left", "right", "forward"):
        dance = [[move, None]] * 3
        episode = prompted(let={"dance": dance})
        assert repeated(episode, *[[None, None]] * 14) == [0] * 14


def test_a_blocked_step_forward_counts_for_both() -> None:
    episode = Episode("dance+as_coded", {**HALL, "agent": {"at": [3, 5], "facing": "up"}})
    episode.acts(*[None] * 6)
    assert episode.now()["dancer"]["at"] == [3, 4], "the agent was in its way"
    assert repeated(episode, *DANCE)[-1] == pytest.approx(0.595)
    assert episode.now()["agent"]["at"] == [3, 5]
    wall = prompted(
        agent={"at": [1, 1], "facing": "right"}, let={"dance": [["left", None]] + [["forward", None]] * 2}
    )
    assert repeated(wall, ["left", None], ["forward", None], ["forward", None])[-1] == pytest.approx(0.595)
    assert wall.now()["agent"]["at"] == [1, 1]


def test_nobody_has_to_be_near_or_to_look() -> None:
    far = prompted(agent={"at": [6, 1], "facing": "right"})
    assert far.image[..., 0].max() < NPC
    assert repeated(far, *DANCE)[-1] > 0


def test_hearing_reaches_everywhere() -> None:
    far = Episode("dance+as_coded", {**HALL, "agent": {"at": [6, 1], "facing": "right"}})
    assert far.hears(None, None, None) == ["Look at me!", "", "Move your body"]


@pytest.mark.parametrize("name", ["dance+as_coded", "dance"])
def test_nothing_but_success_and_time_ends_it(name: str) -> None:
    for seed in range(20):
        episode = Episode(name, {"let": {"dance": [["right", None]] * 3}}, seed)
        bodies = ["left", "forward", "right", "forward", None]
        steps = [episode.act(bodies[(k + seed) % 5], None if k % 2 else SENTENCES[k % 4]) for k in range(20)]
        assert all(step.ended is None for step in steps[:-1])
        assert (steps[-1].ended, steps[-1].reward) == ("timeout", 0)


def test_a_success_in_the_last_step_is_paid() -> None:
    episode = prompted()
    episode.acts(*[None] * 11)
    assert repeated(episode, *DANCE) == [0, 0, pytest.approx(0.1)]
    assert episode.now()["t"] == 20


@pytest.mark.parametrize(("width", "height"), list(product(range(5, 9), repeat=2)))
def test_where_the_dancer_stands(width: int, height: int) -> None:
    for seed in range(5):
        room = Episode("dance+as_coded", {"room": {"width": width, "height": height}}, seed).now()
        assert room["dancer"]["at"] == [int(width / 2 - 1), int(height / 2)]
        assert room["dancer"]["facing"] == "down"


def test_the_hidden_dancer_is_neither_seen_nor_heard_but_can_be_matched() -> None:
    episode = Episode("dance+as_coded+unsocial", HALL)
    for _ in range(6):
        assert episode.act().heard == ""
        assert episode.seen((3, 4)) == episode.seen((3, 5)) == EMPTY
    assert repeated(episode, *DANCE)[-1] == pytest.approx(0.595)


@pytest.fixture(scope="module")
def drawn() -> list[dict[str, Any]]:
    """Many rooms."""
    return list(rooms("dance+as_coded", 4000))


class TestDraws:
    """What a reset draws, over many rooms."""

    def test_moves_and_sentences(self, drawn: list[dict[str, Any]]) -> None:
        items = [item for room in drawn for item in room["let"]["dance"]]
        assert len(items) == 3 * len(drawn)
        check_shares((move for move, _ in items), evenly(("left", "right", "forward")))
        check_shares((said for _, said in items), {None: 0.5} | dict.fromkeys(SENTENCES, 0.125))

    def test_items_are_independent(self, drawn: list[dict[str, Any]]) -> None:
        pairs = (tuple(item[0] for item in room["let"]["dance"]) for room in drawn)
        check_shares(pairs, evenly(product(("left", "right", "forward"), repeat=3)))
        silent = (tuple(item[1] is None for item in room["let"]["dance"]) for room in drawn)
        check_shares(silent, evenly(product((False, True), repeat=3)))

    def test_the_agent_is_anywhere_else(self, drawn: list[dict[str, Any]]) -> None:
        small = [room for room in drawn if room["room"] == {"width": 5, "height": 5}]
        cells = interior({"width": 5, "height": 5}) - {(1, 2)}
        check_shares((tuple(room["agent"]["at"]) for room in small), evenly(cells))
