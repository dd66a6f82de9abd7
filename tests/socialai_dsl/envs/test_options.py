"""What callers give is used, or refused in a sentence that names it; refused, it changes nothing."""

from __future__ import annotations

from math import nan
from typing import Any

import gymnasium
import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.envs import ScenarioEnv, ScenarioVectorEnv
from socialai_dsl.envs.layout import pins_of

DANCE, TALK = "SocialAI/Dance-v1", "SocialAI/TalkItOut-v1"
ANY: Any = sd


# -- making ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"lenght": 4}, r"lenght: got 4, but make has no such option; .*part of its name: 'NAME\?lenght=4'"),
        ({"rendermode": "human"}, "rendermode: got 'human', .*did you mean 'render_mode'"),
        ({"autoreset_mode": "SameStep"}, "autoreset_mode: got 'SameStep', but make has no such option"),
        ({"num_envs": 2}, "num_envs: got 2"),
        ({"seed": 1}, "seed: got 1"),
        (
            {"render_mode": "rgb"},
            "render_mode: got 'rgb'; expected None or one of .*did you mean 'rgb_array'",
        ),
        ({"render_mode": ""}, "render_mode: got ''"),
        ({"render_mode": True}, "render_mode: got True"),
    ],
)
def test_options_of_single_environments(options: dict[str, Any], message: str) -> None:
    for make in (lambda: gymnasium.make(DANCE, **options), lambda: ANY.make("dance", **options)):
        with pytest.raises(ValueError, match=message):
            make()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"lenght": 4}, "lenght: got 4, but make_vec has no such option"),
        ({"autoresetmode": "SameStep"}, "autoresetmode: .*did you mean 'autoreset_mode'"),
        ({"autoreset_mode": "SameSteps"}, "autoreset_mode: got 'SameSteps'; .*did you mean 'SameStep'"),
        ({"autoreset_mode": None}, "autoreset_mode: got None"),
        ({"render_mode": "human"}, "render_mode: got 'human'; expected None or one of rgb_array, ansi"),
        ({"copy": "no"}, "copy: got 'no'; expected True or False"),
        ({"num_threads": 2}, "num_threads: got 2"),
        *(({"num_envs": n}, f"num_envs: got {n!r}") for n in (0, -1, 1.5, True, nan, None, "2")),
    ],
)
def test_options_of_batches(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ANY.make_vec("dance", **options)
    if isinstance(options.get("num_envs", 1), int):  # else Gymnasium reads it first
        with pytest.raises(ValueError, match=message):
            gymnasium.make_vec(DANCE, **options)


def test_who_tries_an_option_of_others_learns_so_in_the_words_of_python() -> None:
    """TorchRL tries `frameskip`, and goes on without it where these words come back."""
    with pytest.raises(TypeError, match="unexpected keyword argument 'frameskip'"):
        gymnasium.make(DANCE, frameskip=1)


def test_only_environments_one_by_one_end_early() -> None:
    with pytest.raises(ValueError, match=r"max_episode_steps: got 5, .*vectorization_mode='sync'"):
        gymnasium.make_vec(TALK, num_envs=2, max_episode_steps=5)
    envs = gymnasium.make_vec(TALK, num_envs=2, max_episode_steps=5, vectorization_mode="sync")
    envs.reset(seed=1)
    still = np.array([[envs.single_action_space.nvec[0] - 1, 0, 0, 0]] * 2)  # type: ignore[attr-defined]
    assert [envs.step(still)[3].tolist() for _ in range(5)] == [[False] * 2] * 4 + [[True] * 2]


@pytest.mark.parametrize("scenario", [5, None, 1.5, b"dance", {}, {"dance": 1}, ["dance", None], [["dance"]]])
def test_what_is_no_scenario(scenario: Any) -> None:
    for make in (sd.make, sd.make_vec):
        with pytest.raises(ValueError, match=r"scenario: got .*; expected a name, a path"):
            make(scenario)
    with pytest.raises(ValueError, match=r"program: got .*; expected what `compile` returns"):
        ScenarioEnv(scenario)
    with pytest.raises(ValueError, match=r"playables: got .*; expected what `compile` returns"):
        ScenarioVectorEnv([scenario], 1)


# -- resetting ---------------------------------------------------------------------------------------------------


BAD_SEEDS = [-1, 2**63, 10**30, True, 1.0, nan, "1", b"12", {1, 2}, {}, np.array(3), np.array([1.0, 2.0])]
"""What is no seed of one environment, and not one of two either."""


@pytest.mark.parametrize("seed", [*BAD_SEEDS, [1], [1, True], [1, -1], [1, 2.0], [[1], [2]]], ids=repr)
def test_what_is_no_seed(seed: Any) -> None:
    env, envs = sd.make("talkitout"), sd.make_vec("talkitout", 2)
    for made in (env, envs):
        made.reset(seed=5)
        before, generator = made.snapshot(), made.np_random.bit_generator.state
        with pytest.raises(ValueError, match="seed: got "):
            made.reset(seed=seed)
        assert (made.snapshot(), made.np_random.bit_generator.state) == (before, generator)


def test_whole_numbers_of_numpy_are_seeds() -> None:
    for made in (sd.make("talkitout"), sd.make_vec("talkitout", 2)):
        made.reset(seed=7)
        before, drawn = made.snapshot(), made.np_random.random()
        made.reset(seed=np.int64(7))  # type: ignore[arg-type]
        assert (made.snapshot(), made.np_random.random()) == (before, drawn)


def test_where_a_list_of_seeds_has_none_the_next_episode_follows() -> None:
    envs, fresh = (sd.make_vec("talkitout", 3) for _ in range(2))
    alone = sd.make("talkitout")
    envs.reset(seed=9)
    observation, _ = envs.reset(seed=[1, None, 3])
    alone.reset(seed=9, options={"index": 1})
    for row, expected in enumerate((alone.reset(seed=1)[0], None, alone.reset(seed=3)[0])):
        if expected is not None:
            assert np.array_equal(observation["image"][row], expected["image"])
    alone.reset(seed=9, options={"index": 1})
    assert np.array_equal(observation["image"][1], alone.reset()[0]["image"])
    rooms = set()
    for _ in range(5):
        fresh = sd.make_vec("talkitout", 3)
        fresh.reset(seed=[1, None, None])
        assert np.array_equal(fresh.reset(seed=[1, None, 3])[0]["image"][0], observation["image"][0])
        rooms |= {str(fresh.describe(1))}
    assert len(rooms) > 1, "they are drawn from the operating system"


@pytest.mark.parametrize(
    ("seed", "options", "message"),
    [
        (None, 5, "options: got 5; expected a mapping"),
        (None, "abc", "options: got 'abc'"),
        (None, {"layot": {}}, "layot: got {}, but reset has no such option; did you mean 'layout'"),
        (None, {1: 2}, "1: got 2, but reset has no such option; expected some of index, layout"),
        (3, {"test_episode": 1}, "seed: got 3 beside options\\['test_episode'\\]"),
        (None, {"test_episode": 1, "index": 2}, "options\\['index'\\]: got 2 beside"),
        (None, {"index": 2}, "options\\['index'\\]: got 2 without a seed"),
        ([1, None], {"index": 2}, "options\\['index'\\]: got 2 without a seed"),
        (1, {"index": True}, "options\\['index'\\]: got True"),
        (1, {"index": -1}, "options\\['index'\\]: got -1"),
        (None, {"test_episode": 1.0}, "options\\['test_episode'\\]: got 1.0"),
        (None, {"test_episode": 2**32}, "options\\['test_episode'\\]: got 4294967296"),
        (None, {"test_episode": [1]}, "options\\['test_episode'\\]: got \\[1\\]"),
        (None, {"layout": "ab"}, "options\\['layout'\\]: got 'ab'"),
        (None, {"layout": [None]}, "options\\['layout'\\]: got \\[None\\]"),
        (None, {"layout": [{}, 3]}, "layout: got 3; expected a mapping"),
        *(
            (None, {"reset_mask": mask}, "(?s)options\\['reset_mask'\\]: got .*; expected 2 booleans")
            for mask in (True, "tt", [True], [1, 0], np.ones((2, 1), np.bool_), np.ones(3, np.bool_))
        ),
    ],
)
def test_options_of_resets(seed: Any, options: Any, message: str) -> None:
    envs = sd.make_vec("talkitout", 2)
    envs.reset(seed=5)
    before = envs.snapshot()
    with pytest.raises(ValueError, match=message):
        envs.reset(seed=seed, options=options)
    assert envs.snapshot() == before


WRONG: list[Any] = [
    0,
    1,
    False,
    True,
    1.5,
    nan,
    "",
    "no",
    b"x",
    [],
    [1],
    (),
    {"nothing_so_called": 1},
    np.array([1, 2]),
]
"""What a key of a layout may be given by mistake."""


@pytest.mark.parametrize("name", ["talkitout", "help", "showme", "cointhief"])
def test_no_value_of_a_layout_is_passed_over(name: str) -> None:
    """Whatever is given at any place of a layout is pinned, or refused with its place."""
    env = sd.make(name)
    env.reset(seed=1)
    program, whole = env.playing, env.describe()
    empty = pins_of(program, {})
    passed_over = []
    for place, found in places(whole):
        for wrong in WRONG:
            layout: Any = wrong
            for step in reversed(place):
                layout = {step: layout} if isinstance(step, str) else [None] * step + [layout]
            pins = pinned(program, layout, place[0])
            says_nothing = wrong is False or (
                isinstance(wrong, list | tuple) and not wrong and isinstance(found, list)
            )
            if pins is not None and not says_nothing and np.array_equal(pins, empty):
                passed_over.append((place, wrong))
    assert passed_over == []


def pinned(program: Any, layout: Any, key: str) -> np.ndarray | None:
    """What a layout pins; None if it is refused, which names the key."""
    try:
        return pins_of(program, layout)
    except ValueError as error:
        message = str(error)
    assert message.startswith(key)
    return None


def places(part: Any, place: tuple[Any, ...] = ()) -> Any:
    """All places in what describes a room, with what is there."""
    if place:
        yield place, part
    if isinstance(part, dict):
        for key, value in part.items():
            yield from places(value, (*place, key))
    elif isinstance(part, list) and part and isinstance(part[0], dict):
        yield from places(part[0], (*place, 0))


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        ({"spoiled": True}, "there is no 'spoiled'"),
        ({"member": "help", "wizard": {}}, "there is no 'wizard'"),
        ({"member": 3}, "member: got 3"),
    ],
)
def test_layouts_of_suites(layout: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        sd.make("social_env").reset(seed=1, options={"layout": layout})


def test_what_is_gone_is_nowhere() -> None:
    env = sd.make("talkitout")
    with pytest.raises(ValueError, match=r"wizard.at: got \[1, 1\], but wizard.gone is True"):
        env.reset(seed=1, options={"layout": {"wizard": {"gone": True, "at": [1, 1]}}})


# -- before the first reset, and after the end -------------------------------------------------------------------


LOOKS = ["render", "describe", "snapshot", "scripted_action", "scene", "cast", "plain_text", "looks_of_npcs"]


def test_nothing_is_to_be_seen_before_the_first_reset() -> None:
    env, envs = (
        sd.make("showme+oracle", render_mode="ansi"),
        sd.make_vec("showme+oracle", 2, render_mode="ansi"),
    )
    calls = [getattr(env, name) for name in LOOKS] + [lambda: env.step([0] * 4)]
    calls += [envs.render, envs.snapshot, envs.scripted_actions, lambda: envs.describe(0)]
    for call in [*calls, lambda: envs.step(np.zeros((2, 4), int))]:
        with pytest.raises(ValueError, match=r"expected reset\(\) first"):
            call()
    with pytest.raises(gymnasium.error.ResetNeeded):
        gymnasium.make(TALK, render_mode="ansi").render()


def test_rows_without_an_episode_cannot_be_stepped() -> None:
    for made, mask in ((sd.make("talkitout"), [False]), (sd.make_vec("talkitout", 2), [True, False])):
        made.reset(seed=1, options={"reset_mask": mask})
        with pytest.raises(ValueError, match=r"expected reset\(\)( of all)? first"):
            made.step(made.action_space.sample())
        made.reset(seed=1, options={"reset_mask": [not one for one in mask]})
        made.step(made.action_space.sample())


@pytest.mark.parametrize(
    "action",
    [
        None,
        "left",
        [0] * 3,
        [[0] * 4, [0]],
        [0.0] * 4,
        [nan] * 4,
        [False] * 4,
        [2**70, 0, 0, 0],
        [-1, 0, 0, 0],
    ],
    ids=repr,
)
def test_what_is_no_action(action: Any) -> None:
    env, envs = sd.make("talkitout"), sd.make_vec("talkitout", 2)
    for made, given in ((env, action), (envs, [action, action]), (envs, action)):
        made.reset(seed=1)
        before = made.snapshot()
        with pytest.raises(ValueError, match="step: got "):
            made.step(given)
        assert made.snapshot() == before


def test_closing_twice_and_using_it_on_does_no_harm() -> None:
    for made in (sd.make("talkitout"), sd.make_vec("talkitout", 2)):
        made.reset(seed=1)
        made.close()
        made.close()
        made.step(np.zeros_like(made.action_space.sample()))
        made.reset(seed=2)


@pytest.mark.parametrize("index", [-1, 2, True, 1.0, "0", None])
def test_environments_of_a_batch_are_named_by_number(index: Any) -> None:
    envs = sd.make_vec("talkitout", 2)
    envs.reset(seed=1)
    with pytest.raises(ValueError, match="index: got"):
        envs.describe(index)


@pytest.mark.parametrize(
    "weights", [None, 5, "123456", [1.5] * 6, [True] * 6, [nan] * 6, [1], [0] * 6, [-1] + [1] * 5]
)
def test_what_members_do_not_weigh(weights: Any) -> None:
    envs = sd.make_vec("social_env", 2)
    with pytest.raises(ValueError, match="weights"):
        envs.set_member_weights(weights)
