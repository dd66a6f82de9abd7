"""Copies of environments, made in any way, are at the same moment and share nothing with their originals."""

from __future__ import annotations

import copy
import gc
import multiprocessing
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.engine.calls import Task
from socialai_dsl.envs import copying
from socialai_dsl.envs.asking import Asker
from socialai_dsl.envs.table import Table
from socialai_dsl.llm.episode import Episode
from socialai_dsl.loader.shipped import shipped_scenarios
from socialai_dsl.play.game import Game

SUITES = Path(__file__).parents[2] / "data" / "suites"
NAMES = [*shipped_scenarios(), "showme+oracle", f"{SUITES}/acts.yaml", f"{SUITES}/school.yaml"]
STEPS = 12


def out_of_band(env: Any) -> Any:
    """Through a pickle whose arrays nobody may write to."""
    buffers: list[pickle.PickleBuffer] = []
    data = pickle.dumps(env, 5, buffer_callback=buffers.append)
    return pickle.loads(data, buffers=[bytes(buffer.raw()) for buffer in buffers])


def by_protocol(number: int) -> Callable[[Any], Any]:
    return lambda env: pickle.loads(pickle.dumps(env, number))


WAYS: dict[str, Callable[[Any], Any]] = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "out of band": out_of_band,
    **{f"pickle {number}": by_protocol(number) for number in range(pickle.HIGHEST_PROTOCOL + 1)},
}


def single(name: str, **options: Any) -> Any:
    """An environment in the middle of an episode, whose generators have been used."""
    env = sd.make(name, **options)
    env.action_space.seed(5)
    env.reset(seed=3)
    env.np_random.random()
    begun(env)
    return env


def begun(env: Any) -> None:
    """Take some steps."""
    for _ in range(4):
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()


def moment(env: Any) -> dict[str, Any]:
    """All that can be asked of a single environment."""
    inner = env.unwrapped
    return {
        "state": inner.snapshot(),
        "described": inner.describe(),
        "counters": inner.counters(),
        "playing": inner.playing.name,
        "text": inner.plain_text(),
        "explained": inner.explain() if inner._recording.actions else None,
        "generators": [g.bit_generator.state for g in (inner.np_random, env.action_space.np_random)],
        "modes": (inner.render_mode, inner.metadata),
    }


def played(env: Any) -> list[Any]:
    """What random steps tell, and the moment after them."""
    told: list[Any] = []
    for _ in range(STEPS):
        observation, *rest = env.step(env.action_space.sample())
        told.append(([array.tobytes() for array in observation.values()], rest))
        if rest[1] or rest[2]:
            observation, info = env.reset()
            told.append(([array.tobytes() for array in observation.values()], info))
    return [told, moment(env)]


@pytest.mark.parametrize("name", NAMES)
def test_a_copy_plays_on_as_its_original_which_stays_where_it_is(name: str) -> None:
    env = single(name)
    before = moment(env)
    for way in ("deepcopy", "pickle 5"):
        twin = WAYS[way](env)
        assert moment(twin) == before
        first = played(twin)
        assert moment(env) == before
        assert first == played(WAYS[way](env)) != before
    assert played(env) == first


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", ["talkitout", f"{SUITES}/acts.yaml"])
def test_every_way_to_copy_is_one(way: str, name: str) -> None:
    for options in ({}, {"render_mode": "ansi"}):
        env = single(name, **options)
        before, twin = moment(env), WAYS[way](env)
        expected = played(twin)
        assert moment(env) == before
        assert played(env) == expected


@pytest.mark.parametrize("way", [way for way in WAYS if way != "copy"])
def test_what_gymnasium_wraps_is_copied_too(way: str) -> None:
    env = gymnasium.make("SocialAI/TalkItOut-v1", max_episode_steps=9)
    env.action_space.seed(1)
    env.reset(seed=2)
    begun(env)
    twin, before = WAYS[way](env), moment(env)
    expected = played(twin)
    assert moment(env) == before
    assert played(env) == expected


# -- batches -----------------------------------------------------------------------------------------------------


def batch(names: Any, mode: str, **options: Any) -> Any:
    envs = sd.make_vec(names, num_envs=5, autoreset_mode=mode, **options)
    envs.action_space.seed(5)
    envs.reset(seed=3)
    if isinstance(names, str) and names == "social_env":
        envs.set_member_weights([0, 1, 0, 4, 0, 1])
    played_together(envs, 40)
    return envs


def moments(envs: Any) -> list[Any]:
    """All that can be asked of a batch."""
    ids = [array.tolist() for array in (envs.utterance_ids(), envs.history_ids(), envs.image_ids())]
    texts = [envs.utterances(), envs.histories(), envs.members()]
    described = [envs.describe(row) for row in range(envs.num_envs)]
    return [envs.snapshot(), *ids, *texts, described, envs.counters(), envs.autoreset_mode, envs.render_mode]


def played_together(envs: Any, steps: int = STEPS) -> list[Any]:
    """What random steps tell; where the caller resets, what ended begins anew."""
    told: list[Any] = []
    for _ in range(steps):
        observation, reward, terminated, truncated, infos = envs.step(envs.action_space.sample())
        told.append([array.tolist() for array in (*observation.values(), reward, terminated, truncated)])
        told.append(repr(infos))
        ended = terminated | truncated
        if envs.autoreset_mode is gymnasium.vector.AutoresetMode.DISABLED and ended.any():
            observation, _ = envs.reset(options={"reset_mask": ended.copy()})
            told.append([array.tolist() for array in observation.values()])
    return [told, moments(envs)]


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
@pytest.mark.parametrize(
    "names",
    ["talkitout", "social_env", ["dance", "showme"], f"{SUITES}/acts.yaml", f"{SUITES}/school.yaml"],
    ids=["scenario", "suite", "mixture", "acts", "layouts"],
)
def test_a_copied_batch_plays_on_as_its_original(names: Any, mode: str) -> None:
    for options in ({}, {"copy": False, "render_mode": "ansi"}):
        envs = batch(names, mode, **options)
        before = moments(envs)
        twins = [way(envs) for way in WAYS.values()]
        told = [played_together(twin) for twin in twins[:3]]
        assert moments(envs) == before
        assert [moments(twin) == before for twin in twins[3:]] == [True] * len(twins[3:])
        assert told == [played_together(envs)] * 3


def test_a_copy_keeps_the_known_rooms_and_their_draws() -> None:
    envs = sd.make_vec("talkitout", num_envs=3)
    layout = {"room": {"width": 6, "height": 7}, "agent": {"at": [2, 3]}}
    envs.reset(seed=1, options={"layout": [layout, None, layout]})
    twin = copy.deepcopy(envs)
    for other in (envs, twin):
        other.reset()
        other.reset(options={"layout": [None, layout, None]})
    assert moments(envs) == moments(twin)


def test_before_the_first_reset_a_copy_has_none_either() -> None:
    for made in (sd.make("talkitout"), sd.make_vec("talkitout", num_envs=2)):
        for way in WAYS.values():
            twin = way(made)
            with pytest.raises(ValueError, match="expected reset"):
                twin.step(twin.action_space.sample())
            twin.reset(seed=1)
        made.reset(seed=1)
        assert made.snapshot() == twin.snapshot()


@pytest.mark.parametrize("way", [way for way in WAYS if way != "copy"])
def test_batches_for_stable_baselines(way: str) -> None:
    pytest.importorskip("stable_baselines3")
    from socialai_dsl.sb3 import SB3VecEnv

    envs = SB3VecEnv(sd.make_vec("talkitout", num_envs=3, autoreset_mode="SameStep"))
    envs.seed(4)
    envs.reset()
    plan = np.random.default_rng(0).integers(0, envs.action_space.nvec, (STEPS, 3, 4))  # type: ignore[attr-defined]
    twin, shallow = WAYS[way](envs), copy.copy(envs)
    before = envs.envs.snapshot()  # type: ignore[attr-defined]
    told = [[repr(other.step(actions)) for actions in plan] for other in (twin, shallow)]
    assert envs.envs.snapshot() == before  # type: ignore[attr-defined]
    assert [repr(envs.step(actions)) for actions in plan] == told[0] == told[1]


# -- other processes, and lives ----------------------------------------------------------------------------------


def played_elsewhere(singles: list[Any], batches: list[Any]) -> list[Any]:
    return [*map(played, singles), *map(played_together, batches)]


@pytest.mark.parametrize("start", ["spawn", "forkserver"])
def test_copies_play_on_in_another_process_when_the_original_is_gone(start: str) -> None:
    if start not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {start} here")
    singles = [single(name) for name in (NAMES if start == "spawn" else NAMES[:1])]
    batches = [batch("social_env", "SameStep"), batch("talkitout", "NextStep", copy=False)]
    kept = copy.deepcopy((singles, batches))
    with ProcessPoolExecutor(1, multiprocessing.get_context(start)) as pool:
        answer = pool.submit(played_elsewhere, singles, batches)
        result = answer.result()
    del singles, batches, answer
    gc.collect()
    junk = [np.full(1 << 16, 7, np.int64) for _ in range(50)]
    assert result == played_elsewhere(*kept)
    del junk


@pytest.mark.parametrize(
    "made", [sd.make, sd.make_vec, lambda name: Episode(name), lambda name: Asker(sd.load(name))]
)
def test_a_pickle_of_another_version_is_refused(made: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(copying, "_version", lambda: "0123")
    data = pickle.dumps(made("talkitout"))
    monkeypatch.undo()
    with pytest.raises(ValueError, match=r"got a pickle of a \w+ by another version .*\(sources 0123\)"):
        pickle.loads(data)


# -- what holds environments -------------------------------------------------------------------------------------


def an_episode() -> Any:
    episode = Episode("help", probes=sd.load("help"))
    episode.reset(seed=1)
    episode.step("Act: forward")
    return episode


def a_game() -> Any:
    game = Game("talkitout")
    game.begin("a room", {"seed": 1})
    game.act("forward", None)
    return game


def a_table() -> Any:
    table = Table([sd.make("showme+oracle").program], 2)
    table.reset(1, None)
    return table


def replied(episode: Any) -> list[Any]:
    return [repr(episode.step("Act: left")) for _ in range(4)] + [episode.result(), episode.question]


def undone(game: Any) -> list[Any]:
    game.act("left", None)
    game.undo()
    game.act("right", "Where is the exit")
    return [game._stage.moments[-1].snapshot, game.now.lines, game.steps]


def stepped(table: Any) -> list[Any]:
    for _ in range(4):
        table.step(Task.STEP_NEXT, table.scripted_actions())
    return [table.snapshot(), table.image.tolist(), table.tokens.tolist()]


@pytest.mark.parametrize(
    ("made", "plays", "shallow"),
    [(an_episode, replied, True), (a_game, undone, False), (a_table, stepped, True)],
)
def test_what_holds_environments_is_copied_with_them(made: Any, plays: Any, shallow: bool) -> None:
    original = made()
    twins = [way(original) for name, way in WAYS.items() if shallow or name != "copy"]
    expected = plays(made())
    assert [plays(twin) for twin in twins] == [expected] * len(twins)
    assert plays(original) == expected
