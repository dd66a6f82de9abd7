"""The single environment: Gymnasium's own checks, info, actions in words, layouts, pictures."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import socialai_dsl as sd
from socialai_dsl.envs import ScenarioEnv
from tests.quick import one_in

NAMES = [
    "talkitout",
    "talkitout_no_liar",
    "talkitout+unsocial",
    "talkitout+as_coded",
    "talkitout_no_liar+as_coded+unsocial",
    "talkitout+oracle",
]
# Warnings are errors in this suite, so the checker has to be content without a word.


@pytest.mark.parametrize("name", one_in(4, NAMES, "draws many pictures"))
def test_gymnasiums_checker(name: str) -> None:
    for render_mode in (None, "rgb_array", "ansi"):
        check_env(gymnasium.make("SocialAI/Scenario-v1", scenario=name, render_mode=render_mode).unwrapped)


def test_ids() -> None:
    for name in ("TalkItOut", "TalkItOutNoLiar"):
        env = gymnasium.make(f"SocialAI/{name}-v1")
        observation, info = env.reset(seed=1)
        assert observation in env.observation_space
        assert info == {"utterance": "NA", "history": ""}
    assert isinstance(
        gymnasium.make("SocialAI/Scenario-v1", scenario="talkitout+unsocial").unwrapped, ScenarioEnv
    )


def test_spaces() -> None:
    env = sd.make("talkitout")
    assert env.action_space == gymnasium.spaces.MultiDiscrete([8, 2, 4, 16])
    image = env.observation_space["image"]
    assert (image.shape, image.dtype, image.high[0, 0].tolist()) == ((7, 7, 4), np.uint8, [11, 5, 2, 3])
    tokens = env.observation_space["tokens"]
    assert (tokens.shape, tokens.dtype, tokens.high[0]) == ((256,), np.int16, len(env.program.vocabulary) - 1)


def test_variants_share_vocabulary_and_length() -> None:
    shown, hidden = sd.make("talkitout").program, sd.make("talkitout+unsocial").program
    assert shown.vocabulary == hidden.vocabulary
    assert shown.vocabulary[:2] == ("<pad>", "<unk>")


# --- actions in words ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ((1, None, None), [1, 0, 0, 0]),
        ((None, 1, 5), [7, 1, 1, 5]),
        (("forward", "Open sesame"), [2, 1, 1, 0]),
        (("forward", None), [2, 0, 0, 0]),
        ((None, None), [7, 0, 0, 0]),
        (("toggle", "Where is <noun>", "the exit"), [5, 1, 0, 1]),
    ],
)
def test_encode_action(given: Any, expected: list[int]) -> None:
    assert sd.make("talkitout").encode_action(given).tolist() == expected


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("forwards", None), "did you mean 'forward'"),
        ((9, None, None), "from 0 to 6"),
        ((None, 1, None), "both or neither"),
        ((None, "Open sesami"), "did you mean 'Open sesame'"),
        ((None, "I would like to leave"), "which the grammar cannot say; expected a text such as"),
        ("forward", "expected \\(body action"),
        ((1,), "expected \\(body action"),
        (np.array(1), "expected \\(body action"),
        (np.zeros((2, 4), np.int64), "expected \\(body action"),
        ((True, None), "expected a number"),
        ((None, 3.5, 1), "expected a number"),
    ],
)
def test_encode_action_says_what_is_wrong(given: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        sd.make("talkitout").encode_action(given)


@pytest.mark.parametrize("action", [[8, 0, 0, 0], [0, 2, 0, 0], [0, 0, 0], [-1, 0, 0, 0], 3, [0.5, 0, 0, 0]])
def test_actions_outside_the_space_are_refused(action: Any) -> None:
    env = sd.make("talkitout")
    env.reset(seed=0)
    with pytest.raises(ValueError, match="step: got the action"):
        env.step(action)


# --- layouts ------------------------------------------------------------------------------------------------------

LAYOUT = {
    "room": {"width": 6, "height": 7},
    "agent": {"at": [2, 3], "facing": "left"},
    "wizard": {"at": [1, 1], "facing": "down", "color": "red"},
    "honest": {"at": [4, 4], "color": "blue", "name": "John"},
    "liar": {"at": [1, 5], "name": "Jack"},
    "doors": [{"at": [2, 0], "color": "green"}, {"at": [3, 6], "color": "red"}],
    "let": {"exit": "doors[0]"},
}


def test_a_layout_is_what_the_room_becomes_and_the_rest_is_drawn_around_it() -> None:
    env = sd.make("talkitout")
    drawn = set()
    for seed in range(60):
        env.reset(seed=seed, options={"layout": LAYOUT})
        state = env.describe()
        assert state["room"] == LAYOUT["room"]
        assert state["agent"]["at"] == [2, 3]
        assert (state["wizard"]["color"], state["honest"]["name"], state["liar"]["name"]) == (
            "red",
            "John",
            "Jack",
        )
        assert [door["color"] for door in state["doors"]][:2] == ["green", "red"]
        assert len({door["color"] for door in state["doors"]}) == 4
        assert state["let"]["exit"] == "doors[0]"
        cells = [tuple(state[name]["at"]) for name in ("agent", "wizard", "honest", "liar")]
        assert len(set(cells)) == 4
        drawn.add((state["doors"][2]["color"], tuple(state["doors"][2]["at"])))
    assert len(drawn) > 5


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        ({"wizzard": {}}, "no 'wizzard'; did you mean 'wizard'"),
        ({"room": {"width": 9, "height": 6}}, "room.width: got 9; expected a whole number from 5 to 8"),
        ({"agent": {"at": [7, 7]}}, "agent.at\\[0\\]: got 7; .*give `room`"),
        ({"room": {"width": 6, "height": 6}, "agent": {"at": [9, 1]}}, "agent.at\\[0\\]: got 9"),
        ({"agent": {"at": [2]}}, "expected \\[x, y\\]"),
        ({"agent": {"at": [2, 2]}, "wizard": {"at": [2, 2]}}, "where agent is already"),
        ({"agent": {"facing": "north"}}, "agent.facing: got 'north'"),
        ({"wizard": {"color": "blau"}}, "wizard.color: got 'blau'"),
        (
            {"doors": [{"state": "ajar"}]},
            "doors\\[0\\].state: got 'ajar'; expected one of open, closed, locked",
        ),
        ({"doors": [{}] * 5}, "at most 4"),
        ({"let": {"exit": "doors[4]"}}, "let.exit: got 'doors\\[4\\]'"),
        ({"let": {"entry": 1}}, "there is no 'entry'"),
        ({"honest": {"name": "Jim"}}, "honest.name: got 'Jim'"),
        ({"wizard": {"name": "Merlin"}}, "does not draw it"),
        ({"wizard": {"state": "asleep"}}, "wizard.state: got 'asleep'"),
        ({"t": 100}, "t: got 100; expected a whole number from 0 to 99"),
        ({"heard": ["Gandalf: Hello"]}, "heard\\[0\\]: got 'Gandalf: Hello'"),
        ({"agent": 3}, "agent: got 3; expected a mapping"),
        ([1, 2], "expected a mapping"),
    ],
)
def test_what_does_not_fit_is_named(layout: Any, message: str) -> None:
    env = sd.make("talkitout")
    with pytest.raises(ValueError, match=message):
        env.reset(seed=0, options={"layout": layout})
    env.reset(seed=0)  # and nothing is broken by it


# --- pictures and saving ------------------------------------------------------------------------------------------


def test_render_modes(capsys: pytest.CaptureFixture[str]) -> None:
    layout = {"layout": LAYOUT}
    picture = sd.make("talkitout", render_mode="rgb_array")
    picture.reset(seed=0, options=layout)
    frame = picture.render()
    assert (frame.shape, frame.dtype) == ((7 * 32, 6 * 32, 3), np.uint8)
    text = sd.make("talkitout", render_mode="ansi")
    text.reset(seed=0, options=layout)
    *room, wizard, honest, liar = text.render().splitlines()
    assert len(room) == 7
    assert [wizard[:6], honest[:6], liar[:6]] == ["Av 1,1", "Bv 4,4", "Bv 1,5"]
    human = sd.make("talkitout", render_mode="human")
    human.reset(seed=0, options=layout)
    assert capsys.readouterr().out.strip()
    with pytest.raises(ValueError, match="render_mode"):
        sd.make("talkitout", render_mode="video")


def test_snapshot_and_restore() -> None:
    env = sd.make("talkitout")
    env.reset(seed=4)
    plan = [env.action_space.sample() * np.array([0, 1, 1, 1]) for _ in range(20)]
    for action in plan[:10]:
        env.step(action)
    saved = env.snapshot()

    def rest() -> list[Any]:
        return [(o["tokens"].tolist(), r, t, i["utterance"]) for o, r, t, _, i in map(env.step, plan[10:])]

    expected = rest()
    env.restore(saved)
    assert rest() == expected


def test_a_scenario_with_mistakes_raises_them_all() -> None:
    with pytest.raises(sd.ScenarioError) as caught:
        sd.make("talkitut")
    assert caught.value.diagnostics
    assert "talkitout" in str(caught.value)


def test_a_reset_that_leaves_an_ended_episode_as_it_is_does_not_revive_it() -> None:
    env = sd.make("talkitout")
    env.reset(seed=1)
    assert env.step(np.array([env.action_space.nvec[0] - 2, 0, 0, 0]))[2], "`done` ends the episode"
    env.reset(options={"reset_mask": np.array([False])})
    with pytest.raises(ValueError, match="outside of an episode"):
        env.step(np.array([0, 0, 0, 0]))
