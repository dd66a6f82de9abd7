"""A language model perceives what a trained agent perceives: nothing less, and nothing more."""

import json
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.llm import Episode, TextView
from socialai_dsl.llm.view import Style
from socialai_dsl.program import VIEW
from socialai_dsl.vocabulary import COLORS, words
from tests.quick import one_in
from tests.test_same_world import moments
from tests.tiny import Folder

STYLES = get_args(Style)

PLAYED = [
    "talkitout",
    "talkitout+unsocial",
    "cointhief_tags",
    "dance",
    "diverse_exit",
    "help",
    "showme",
    "social_env",
    "school/boxes+pointing",
    "school/boxes+emulation",
    "school/lever_door",
    "school/marble_push",
    "school/apple_stealing_suite",
    "school/generators+color",
    "novel/gaze_following",
    "novel/sally_anne",
    *(
        str(Path(__file__).parents[2] / "data" / f"{name}.yaml")
        for name in ("hands", "hands_and_gestures", "looks")
    ),
]
"""Four channels and more, occlusion or none, hidden NPCs, suites, absolute directions and relative ones."""


@pytest.mark.parametrize("name", one_in(3, PLAYED, "plays every scenario in text"))
def test_every_cell_that_is_not_empty_is_told_of_where_it_is(name: str) -> None:
    view = TextView(sd.compile(sd.load(name)), "json")
    for observation, info, _ in moments(name):
        told = json.loads(view.observe(observation, info))
        colours = {(thing["ahead"], thing["right"]): thing.get("color") for thing in told["seen"]}
        assert len(colours) == len(told["seen"])
        for kind in told["covered"]:
            for near, far, left, right in kind["areas"]:
                cells = {(a, r) for a in range(near, far + 1) for r in range(left, right + 1)}
                assert not cells & set(colours)
                colours |= dict.fromkeys(cells)
        image = observation["image"]
        shown = {
            (VIEW - 1 - along, across - VIEW // 2): int(image[across, along, 1])
            for across, along in np.argwhere(image[..., 0] != 1).tolist()
        }
        assert ((0, 0) in shown) == ("carrying" in told), "its own cell shows what it carries"
        shown.pop((0, 0), None)
        assert set(colours) == set(shown)
        assert all(c is None or c == COLORS[shown[place]] for place, c in colours.items())


@pytest.mark.parametrize(
    "name", ["talkitout", "help", "novel/sally_anne", "novel/whisper", "talkitout+unsocial"]
)
def test_what_is_heard_is_told_word_for_word(name: str) -> None:
    """The history of tokens, which trained agents read, is made of the lines that are told of."""
    views = [TextView(sd.compile(sd.load(name)), style) for style in STYLES]
    history: list[str] = []
    for observation, info, env in moments(name):
        lines = [] if info["utterance"] == "NA" else info["utterance"].split("\n")
        history = [*history, *lines] if info["history"] != "" else []
        for view in views:
            text = view.observe(observation, info)
            assert all(line in text for line in lines)
        tokens = [env.program.vocabulary[token] for token in observation["tokens"] if token]
        heard = words(" ".join(history))
        assert heard[len(heard) - len(tokens) :] == tokens


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("talkitout", "You and others hear each other when you are next to each other."),
        ("school/boxes+pointing", "You and others hear each other when you are anywhere in the room."),
        ("social_env", "You hear others who are anywhere in the room, some only next to you."),
        (
            "novel/sarcasm",
            "A word in brackets before a line is the tone in which it is said: (calm), (laughing).",
        ),
        ("novel/gaze_following", "A line begins with the name of who says it"),
        (
            "talkitout",
            "In a turn you move first, then you are heard, then the others act one after the other, then",
        ),
        (
            "dance+as_coded",
            "; you see this moment, then the others act one after the other, and you hear what they say.",
        ),
        ("talkitout", "An episode ends with success, with failure, or after 100 turns."),
    ],
)
def test_instructions_tell_who_hears_whom_and_the_order_of_a_turn(name: str, told: str) -> None:
    assert told in TextView(sd.compile(sd.load(name))).instructions()


def test_nobody_is_told_of_who_cannot_be_heard() -> None:
    assert "hear others" not in TextView(sd.compile(sd.load("talkitout+unsocial"))).instructions()


@pytest.mark.parametrize(
    ("at", "facing", "words"),
    [
        ([2, 1], "down", "towards you"),
        ([2, 1], "left", "to your left"),
        ([2, 1], "up", "away from you"),
        ([1, 1], "down", "past you"),
        ([1, 3], "right", "towards you"),
        ([1, 3], "left", "to your left"),
        ([3, 3], "left", "towards you"),
    ],
)
def test_who_faces_the_agent_is_told(at: list[int], facing: str, words: str, tmp_path: Path) -> None:
    play = Folder(tmp_path)(
        f"""\
        observe: {{directions: egocentric}}
        cast: {{agent: {{at: [2, 3], facing: up}}, ann: {{at: {at}, facing: {facing}}}}}
        """
    )
    text = TextView(play.env.unwrapped.program).observe(play.observation, play.info)  # type: ignore[attr-defined]
    assert f"facing {words}" in text


def test_a_step_that_failed_is_told_where_the_pictures_show_it() -> None:
    episode = Episode("talkitout")
    episode.reset(seed=0)
    texts = [episode.step("Act: forward").text for _ in range(8)]
    assert not texts[0].startswith("You did not move.")
    assert texts[-1].startswith("You did not move.\nYou see:")
    assert not episode.step("Act: left").text.startswith("You did not move.")
    assert not episode.step("Act: done").text.startswith("You did not move.")


def test_hidden_people_are_not_told_of() -> None:
    view = TextView(sd.compile(sd.load("talkitout+unsocial")))
    texts = [view.observe(observation, info) for observation, info, _ in moments("talkitout+unsocial")]
    assert not any("guide" in text or "wizard" in text or ": " in text.split("You hear")[1] for text in texts)
    shown = TextView(sd.compile(sd.load("talkitout")))
    seen = [shown.observe(observation, info) for observation, info, _ in moments("talkitout")]
    assert any("guide" in text for text in seen)


def test_gestures_are_told_of() -> None:
    view = TextView(sd.compile(sd.load("school/boxes+pointing+oracle")))
    env = sd.make("school/boxes+pointing+oracle")
    observation, info = env.reset(seed=1)
    texts, ended = [view.observe(observation, info)], False
    while not ended:
        observation, _, terminated, truncated, info = env.step(env.scripted_action())
        texts.append(view.observe(observation, info))
        ended = terminated or truncated
    assert any("caretaker, facing towards you, pointing towards you, just began to point" in t for t in texts)
    assert any("cells out of sight" in text for text in texts)


def test_cells_that_are_pointed_at_are_told_of() -> None:
    name = str(Path(__file__).parents[3] / "docs" / "cookbook" / "pointing_at_a_cell.yaml")
    layout: Any = {"agent": {"at": [4, 7], "facing": "up"}, "ann": {"at": [3, 5], "facing": "down"}}
    env, view = sd.make(name), TextView(sd.compile(sd.load(name)))

    def told(pointing: list[int]) -> str:
        observation, info = env.reset(
            seed=0, options={"layout": {**layout, "ann": {**layout["ann"], "pointing": pointing}}}
        )
        return view.observe(observation, info)

    assert "pointing at the cell 4 steps beyond it and 2 steps to the left of it" in told([1, 1])
    assert "pointing at the cell 1 step before it and 1 step to the right of it" in told([4, 6])
    assert "pointing at the cell that it is on" in told([3, 5])


@pytest.mark.parametrize("mode", ["text", "json", "tools"])
@pytest.mark.parametrize("style", STYLES)
def test_instructions_name_what_can_be_done_and_said_and_nothing_of_the_solution(
    mode: Any, style: Style
) -> None:
    loaded = sd.load("talkitout")
    program = sd.compile(loaded)
    text = TextView(program, style).instructions(mode)
    assert all(word in text for word in (*program.actions, *program.templates, *program.nouns))
    assert "100 turns" in text
    assert not any(
        word in text for word in ("wizard", "guide", "Gandalf", "right one", "Open sesame", "trusted")
    )
    assert "Leave the room." in TextView(program, style).instructions(mode, goal="Leave the room.")


def test_an_unknown_style_is_refused() -> None:
    with pytest.raises(ValueError, match="style: got 'verse', expected one of prose, grid, json"):
        TextView(sd.compile(sd.load("help")), "verse")  # type: ignore[arg-type]


def test_hands_are_told_of() -> None:
    """Its own, and what an NPC carries."""
    name = str(Path(__file__).parents[2] / "data" / "hands.yaml")
    layout = {
        "agent": {"at": [2, 3], "facing": "up", "carries": "balls[0]"},
        "balls": [{"color": "red"}],
        "ann": {"at": [2, 1], "facing": "down", "carries": "apple"},
        "bob": {"at": [4, 4]},
    }
    env = sd.make(name)
    observation, info = env.reset(seed=0, options={"layout": layout})
    text = TextView(sd.compile(sd.load(name)), "prose").observe(observation, info)
    assert "You carry a plain red ball." in text
    assert "facing south, carrying a red apple" in text


def test_looks_are_told_of() -> None:
    """Words before the colour of things, and with the name of the look of NPCs."""
    name = str(Path(__file__).parents[2] / "data" / "looks.yaml")
    layout = {
        "agent": {"at": [2, 3], "facing": "up", "carries": "balls[0]"},
        "balls": [{"looks": {"size": "small", "pattern": "striped"}}],
        "box": {"at": [2, 2], "looks": {"size": "large"}},
        "ann": {"at": [2, 1], "facing": "down", "looks": {"mood": "angry"}},
    }
    env = sd.make(name)
    observation, info = env.reset(seed=0, options={"layout": layout})
    text = TextView(sd.compile(sd.load(name)), "prose").observe(observation, info)
    assert "You carry a small striped plain red ball." in text
    assert "1 step ahead: a large shut red box" in text
    assert "peer, mood angry, facing south" in text
    told = json.loads(TextView(sd.compile(sd.load(name)), "json").observe(observation, info))
    assert told["carrying"]["looks"] == {"size": "small", "pattern": "striped"}


@pytest.mark.parametrize("style", STYLES)
def test_people_who_look_different_are_told_apart(style: Style, tmp_path: Path) -> None:
    """Also where they are of one kind, and each has a code of its own in the picture."""
    texts = set[str]()
    for kind in ("{kind: guide}", "{kind: guide, kind_code: 5}", "{kind: wizard}"):
        play = Folder(tmp_path)(
            f"""\
            cast:
              ann: {{at: [5, 5], kind: guide}}
              bob: {{at: [4, 5], kind: guide, kind_code: 5}}
              carl: {{at: [3, 5], kind: wizard}}
              dora: {{at: [3, 1], facing: left, color: red, {kind[1:]}
            """
        )
        program = play.env.unwrapped.program  # type: ignore[attr-defined]
        texts.add(TextView(program, style).observe(play.observation, play.info))
    assert len(texts) == 3
