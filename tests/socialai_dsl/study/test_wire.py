"""The wire carries what a seat observes, and nothing else: no draw that the picture and the words heard do not show."""

from __future__ import annotations

import json
import random
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.frontend import load
from socialai_dsl.study.arena import Arena, Episode
from socialai_dsl.study.live import Live
from tests.quick import one_in
from tests.shipped import scenarios, suites
from tests.socialai_dsl.study.participants import ALONE, TOGETHER, loaded_study, newcomer, run, until

KEYS = {
    *("do", "on", "practice", "episode", "episodes", "t", "told", "heard", "waiting"),
    *("view", "seen", "ended", "success", "actions", "phrases", "notice"),
}
SHIPPED = [*scenarios(), *suites()]
ROOMS, STEPS = 40, 6


def alike(env: Any) -> dict[str, Any]:
    """A layout in which all that can be seen is as it is now, and everything else is drawn."""
    seen = {"at", "color", "facing"}
    found: dict[str, Any] = {}
    for name, one in env.describe(0).items():
        if name == "room":
            found[name] = one
        elif isinstance(one, dict) and "at" in one:
            found[name] = {key: part for key, part in one.items() if key in seen}
        elif isinstance(one, list) and one and all(isinstance(part, dict) and "at" in part for part in one):
            found[name] = [
                {key: part for key, part in each.items() if key in seen | {"state"}} for each in one
            ]
    return found


def moments(name: str, pinned: bool = False) -> tuple[dict[Any, set[str]], int]:
    """What is sent of each moment that is observed alike, and how many of them were not alike.

    Args:
        name: of a scenario.
        pinned: whether all rooms look alike when they begin.
    """
    arena, rng = Arena(load(name)), random.Random(0)
    env = arena.take()
    sent: dict[Any, set[str]] = defaultdict(set)
    hidden: dict[Any, set[str]] = defaultdict(set)
    acts = [rng.choice(arena.actions) for _ in range(STEPS)]  # alike in all rooms
    env.reset(seed=0)
    layout = alike(env)
    for room in range(ROOMS):
        reset = (
            {"seed": room, "options": {"layout": layout}} if pinned else {"options": {"test_episode": [room]}}
        )
        episode = Episode(arena, {}, env)
        episode.begin(reset)
        known: dict[str, tuple[Any, ...]] = dict.fromkeys(arena.seats, ())
        for move in [None, *acts]:
            if move is not None:
                action = arena.action(episode.rooms, move, None)
                episode.step(dict.fromkeys(arena.seats, action))
            for seat in arena.seats:
                seen = episode.rooms.seen[seat]
                member = episode.rooms.heard(seat).get("member")
                ended = None if episode.ending is None else episode.ending.success[seat]
                # A language model on the seat is told the member's instructions as well.
                known[seat] = (
                    *known[seat],
                    seat,
                    member,
                    seen["image"].tobytes(),
                    tuple(episode.heard[seat]),
                    ended,
                )
                screen = {**episode.picture(seat), "told": episode.told(seat), "heard": episode.heard[seat]}
                sent[known[seat]].add(json.dumps(screen))
                hidden[known[seat]].add(json.dumps(env.describe(0), default=str))
            if episode.ending is not None:
                break
    return sent, sum(len(states) > 1 for states in hidden.values())


@pytest.mark.parametrize("name", one_in(6, SHIPPED, "plays rooms of each shipped scenario"))
def test_what_is_observed_alike_is_sent_alike(name: str) -> None:
    sent, _ = moments(name)
    assert [screens for screens in sent.values() if len(screens) > 1] == []


@pytest.mark.parametrize(
    "name", ["talkitout", "classics/selective_trust", "together/reference_game_together"]
)
def test_rooms_that_look_alike_and_are_not_are_sent_alike(name: str) -> None:
    """Such as those of TalkItOut in which another door is the exit, and the other guide lies."""
    sent, unlike = moments(name, pinned=True)
    assert unlike > 0, "there is something to hide"
    assert [screens for screens in sent.values() if len(screens) > 1] == []


@pytest.mark.parametrize("text", [ALONE, TOGETHER])
def test_a_screen_has_nothing_but_its_parts(text: str, place: Path, tmp_path: Path) -> None:
    """In particular no seed, no number of a room, no state, no rule, and nothing of other seats."""

    async def look() -> list[dict[str, Any]]:
        live = Live(loaded_study(text, place), tmp_path)
        people = [await newcomer(live) for _ in range(2)]
        for one in people:
            while one.now["do"] in ("consent", "page"):
                await one.go()
        await live.tick()
        for _ in range(5):
            for one in people:
                await one.act("left")
        await live.close()
        return [screen for one in people for screen in one.screens if screen["do"] == "play"]

    screens = run(look)
    assert len(screens) > 5
    for screen in screens:
        assert set(screen) <= KEYS
        assert set(screen["view"]) == {"cells", "gestures", "held", "marks"}


def test_how_it_ended_is_not_sent_where_it_is_not_to_be_told(place: Path, tmp_path: Path) -> None:
    text = ALONE.replace("episodes: 2", "episodes: 2, feedback: none")

    async def end() -> dict[str, Any]:
        live = Live(loaded_study(text, place), tmp_path)
        one = await newcomer(live)
        await until(one, "play")
        while not one.now.get("ended"):
            await one.act("done")
        await live.close()
        return one.now

    screen = run(end)
    assert screen["success"] is None
    assert "success" not in json.dumps(
        {key: part for key, part in screen.items() if key not in ("success", "told")}
    )
