"""Hand-made layouts that settle everything an episode depends on, and what is known to come of them."""

from __future__ import annotations

from typing import Any, NamedTuple

import pytest

from tests.scenarios.playing import Episode

COINS: dict[str, Any] = {
    "agent": {"at": [4, 3], "facing": "left", "color": "red"},
    "thief": {"at": [3, 3], "facing": "right", "color": "green"},
    "coins": [{"at": [x, y]} for x, y in ((6, 5), (3, 5), (1, 1), (2, 3), (3, 6), (2, 5))],
    "let": {"glance": "left", "home": "right", "wanted": 4},
}
DOORS: list[dict[str, Any]] = [
    {"at": [2, 0], "color": "green"},
    {"at": [3, 5], "color": "red"},
    {"at": [0, 2], "color": "blue"},
    {"at": [5, 2], "color": "grey"},
]
TALK: dict[str, Any] = {
    "room": {"width": 6, "height": 6},
    "agent": {"at": [2, 2], "facing": "up"},
    "wizard": {"at": [1, 3], "color": "red", "facing": "down"},
    "honest": {"at": [3, 2], "color": "grey", "facing": "down", "name": "Jack"},
    "liar": {"at": [4, 4], "color": "purple", "facing": "down", "name": "John"},
    "doors": DOORS,
    "let": {"exit": "doors[0]"},
}
DANCE: dict[str, Any] = {
    "room": {"width": 6, "height": 7},
    "agent": {"at": [4, 4], "facing": "up"},
    "dancer": {"at": [2, 3], "color": "blue"},
    "let": {"dance": [["left", None], ["forward", "Move your body"], ["right", "Shake your head"]]},
}
TEACHER: dict[str, Any] = {
    "room": {"width": 6, "height": 6},
    "agent": {"at": [2, 2], "facing": "right"},
    "teacher": {"at": [3, 2], "facing": "left", "color": "yellow"},
    "doors": DOORS,
    "one_of": {"teacher": "teacher_03"},
    "let": {"exit": "doors[0]"},
}
SHOW: dict[str, Any] = {
    "room": {"width": 5, "height": 6},
    "agent": {"at": [1, 4], "facing": "down"},
    "jim": {"at": [3, 3], "facing": "down", "color": "green"},
    "door": {"at": [1, 0], "color": "purple"},
    "let": {"correct": "switches[0]"},
}
ALONE: dict[str, Any] = {key: value for key, value in SHOW.items() if key != "jim"}
HELP: dict[str, Any] = {
    "room": {"width": 7, "height": 6},
    "agent": {"at": [5, 1], "facing": "left"},
    "jill": {"at": [1, 1], "facing": "up", "color": "grey"},
    "doors": [{"color": "red"}, {"color": "blue"}],
}
HELPER: dict[str, Any] = {
    **HELP,
    "agent": {"at": [1, 4], "facing": "right"},
    "jill": {"at": [5, 4], "facing": "up", "color": "grey"},
    "let": {"jill.goal": "doors[1]"},
}
# From the place before the first switch to the upper door above it.
OUT = ["left", "left", "forward", "forward", "forward", "toggle", "forward"]


class Known(NamedTuple):
    """A layout, a way to act (body actions, sentences after `say`), and its end."""

    scenario: str
    layout: dict[str, Any]
    acts: list[str | None]
    ended: str | None
    steps: int


def also(layout: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """A layout with more, or other, keys; those of members and `let` are merged."""
    merged = dict(layout)
    for key, value in changes.items():
        old = merged.get(key)
        merged[key] = {**old, **value} if isinstance(old, dict) and isinstance(value, dict) else value
    return merged


KNOWN = {
    "the exit": Known("talkitout", TALK, ["forward", "say Open sesame"], "success", 2),
    "another exit": Known(
        "talkitout", also(TALK, let={"exit": "doors[3]"}), ["forward", "say Open sesame"], "failure", 2
    ),
    "no liar": Known(
        "talkitout_no_liar",
        {key: value for key, value in TALK.items() if key not in ("liar", "honest")}
        | {"honest": {"at": [3, 2], "color": "grey", "facing": "down"}},
        ["forward", "say Open sesame"],
        "success",
        2,
    ),
    "the time": Known("talkitout", also(TALK, t=99), [None], "timeout", 100),
    "a dance": Known(
        "dance",
        DANCE,
        [None] * 5 + ["left", "forward, say Move your body", "right, say Shake your head"],
        "success",
        8,
    ),
    "an attempt that is under way": Known(
        "dance",
        also(
            DANCE,
            t=9,
            dancer={"state": "watching", "clock": 0},
            memory={"attempt": [["left", None], ["forward", "Move your body"]]},
        ),
        ["right, say Shake your head"],
        "success",
        10,
    ),
    "four coins": Known("cointhief", COINS, ["say Here is 4"], "success", 1),
    "a strange wish": Known("cointhief", also(COINS, let={"wanted": 0}), ["say Here is 0"], "success", 1),
    "tags": Known("cointhief+tags+as_coded", COINS, ["forward, say Here is 4"], "success", 1),
    "an introduction": Known(
        "diverse_exit",
        TEACHER,
        ["toggle", "say Which is the correct door", "left", "forward", "toggle", "forward"],
        "success",
        6,
    ),
    "a door that is open": Known(
        "diverse_exit+as_coded",
        also(
            TEACHER, doors=[{**DOORS[0], "state": "open"}, *DOORS[1:]], agent={"at": [2, 1], "facing": "up"}
        ),
        ["forward"],
        "success",
        1,
    ),
    "a switch pressed too early": Known("showme", SHOW, ["toggle", *OUT], "failure", 8),
    "a peer that is gone": Known(
        "showme", also(SHOW, jim={"gone": True, "at": None}), ["toggle", *OUT], "success", 8
    ),
    "a switch that is pressed": Known(
        "showme+as_coded",
        also(
            SHOW,
            jim={"gone": True, "at": None},
            switches=[{"state": "pressed"}],
            agent={"at": [1, 1], "facing": "up"},
        ),
        ["toggle", "forward"],
        "success",
        2,
    ),
    "another switch": Known(
        "showme",
        also(SHOW, jim={"gone": True, "at": None}, let={"correct": "switches[2]"}),
        ["toggle", *OUT],
        None,
        8,
    ),
    "the end of the light": Known("showme_no_social", also(ALONE, t=10), ["toggle", *OUT], "success", 18),
    "before its end": Known("showme_no_social", also(ALONE, t=1), ["toggle", *OUT], None, 9),
    "eye contact": Known(
        "help+as_coded",
        also(HELP, jill={"facing": "right"}),
        [None, "left", "left", None, "toggle", "forward"],
        "success",
        6,
    ),
    "what was agreed on": Known(
        "help+as_coded",
        also(HELP, jill={"facing": "left", "state": "pressing"}, agent={"facing": "right"}),
        [None, "toggle", "forward"],
        "success",
        3,
    ),
    "an exiter who looks": Known(
        "help_as_helper", HELPER, [None, None, "left", "left", "toggle", None], "success", 6
    ),
    "an exiter with another goal": Known(
        "help_as_helper",
        also(HELPER, let={"jill.goal": "doors[0]"}),
        [None, None, "left", "left", "toggle", *[None] * 15],
        "timeout",
        20,
    ),
    "a member of the suite": Known(
        "social_env", {"member": "cointhief", **COINS}, ["say Here is 4"], "success", 1
    ),
    "another member": Known(
        "social_env+as_coded",
        {"member": "diverse_exit", **also(TEACHER, agent={"at": [4, 2], "facing": "right"})},
        ["toggle", "forward"],
        "failure",
        2,
    ),
}


def begun(known: Known, seed: int) -> Episode:
    # The agent's own colour is never seen, but it is drawn.
    return Episode(known.scenario, also({"agent": {"color": "red"}}, **known.layout), seed)


@pytest.mark.parametrize("what", KNOWN)
def test_what_comes_of_it(what: str) -> None:
    known = KNOWN[what]
    for seed in range(8):
        episode = begun(known, seed)
        for act in known.acts:
            body, _, sentence = (act or "").partition("say ")
            step = episode.act(body.removesuffix(", ") or None, sentence or None)
        assert (step.ended, episode.now()["t"]) == (known.ended, known.steps)
        assert (step.reward > 0) == (known.ended == "success")


@pytest.mark.parametrize("what", KNOWN)
def test_nothing_else_is_drawn(what: str) -> None:
    first = begun(KNOWN[what], 0).now()
    for seed in range(1, 20):
        assert begun(KNOWN[what], seed).now() == first


def test_every_scenario_has_a_known_layout() -> None:
    played = {known.scenario.partition("+")[0] for known in KNOWN.values()}
    assert played == {
        *(
            "talkitout",
            "talkitout_no_liar",
            "dance",
            "cointhief",
            "diverse_exit",
            "showme",
            "showme_no_social",
        ),
        *("help", "help_as_helper", "social_env"),
    }
