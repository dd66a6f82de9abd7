"""What differs for one mind differs for all: trained agents, language models and people get the same world."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.checking.briefing import brief
from socialai_dsl.llm import Episode
from socialai_dsl.llm.view import LastStep, Style, TextView
from socialai_dsl.play.game import Game
from socialai_dsl.program import Header, LineColumn, Program
from socialai_dsl.program_suite import Playable
from socialai_dsl.vocabulary import composed
from tests.quick import one_in
from tests.shipped import everything, suites

PLAYED = [*everything(), *suites()]
SAMPLES = [
    str(Path(__file__).parent / "data" / f"{name}.yaml") for name in ("hands", "hands_and_gestures", "looks")
]
"""Channels that no shipped scenario has together."""
STEPS = 40


def lines_of(program: Program) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Each line as it looks, with its tokens."""
    table, at = program.table(Header.LINE_AT).tolist(), program.header(Header.TOKEN_AT)
    for line, row in zip(program.lines, table, strict=True):
        first, count = row[LineColumn.FIRST_TOKEN], row[LineColumn.TOKENS]
        tokens = program.words[at + first : at + first + count].tolist()
        yield " ".join(composed(line).split()), tuple(tokens)


def differ_alike(program: Program) -> bool:
    """Whether lines differ as tokens exactly if they differ as they look."""
    lines = set(lines_of(program))
    return len(lines) == len({look for look, _ in lines}) == len({tokens for _, tokens in lines})


@pytest.mark.parametrize("name", one_in(12, PLAYED, "compiles every scenario"))
def test_what_is_for_authors_reaches_no_player(name: str) -> None:
    """`about` and `notes` often say the hypothesis."""
    loaded = sd.load(name)
    data = loaded.resolved.data
    assert isinstance(data, dict)
    game, episode = Game(name), Episode(sd.compile(loaded), briefing=brief(loaded))
    game.begin("", {"seed": 0})
    told = " ".join([episode.reset(seed=0), episode.instructions, game.task, game.explanation, game.now.seen])
    for key in ("about", "notes"):
        assert str(data.get(key, "nothing of the kind")).strip() not in told
    assert game.task in episode.instructions, "people and models are told the same words"
    game.close(), episode.close()


def members(program: Playable) -> tuple[Program, ...]:
    """The programs of a suite, or the one."""
    return (program,) if isinstance(program, Program) else program.programs


@pytest.mark.parametrize("name", one_in(12, PLAYED, "compiles every scenario"))
def test_lines_differ_for_a_trained_agent_where_they_differ_for_others(name: str) -> None:
    for program in members(sd.compile(sd.load(name))):
        assert differ_alike(program), program.name


def moments(name: str) -> Iterator[tuple[dict[str, Any], dict[str, Any], Any]]:
    """Observations and infos of some episodes that are played by chance, most of it walking; the environment."""
    for observation, info, env, _ in steps(name):
        yield observation, info, env


def steps(name: str) -> Iterator[tuple[dict[str, Any], dict[str, Any], Any, LastStep | None]]:
    """The same with the step that led to each observation."""
    env = sd.make(name)
    random = np.random.default_rng(0)
    ahead = list(env.program.actions).index("forward")
    for seed in range(3):
        observation, info = env.reset(seed=seed)
        yield observation, info, env, None
        for _ in range(STEPS):
            action = random.integers(0, env.action_space.nvec, dtype=np.int64)  # type: ignore[attr-defined]
            action[0] = ahead if random.random() < 0.4 else action[0]
            before = observation["image"].copy()
            observation, _, terminated, truncated, info = env.step(action)
            yield observation, info, env, LastStep((*env.program.actions, None)[action[0]], before)
            if terminated or truncated:
                break
    env.close()


@pytest.mark.parametrize("name", [*one_in(12, PLAYED, "plays every scenario in text"), *SAMPLES])
def test_a_text_differs_exactly_where_the_observation_does(name: str) -> None:
    """Nothing looks like something else to a model alone, or to a trained agent alone; and no step is said to fail
    that did not.
    """
    views = {style: TextView(sd.compile(sd.load(name)), style) for style in get_args(Style)}
    texts: dict[Any, dict[Any, Any]] = {style: {} for style in views}
    place = None
    for observation, info, env, last in steps(name):
        perceived = observation["image"].tobytes(), info["utterance"]
        for style, view in views.items():
            text = view.observe(observation, info)
            assert texts[style].setdefault(text, perceived) == perceived, f"two observations read {text}"
            assert texts[style].setdefault(perceived, text) == text, (
                "the text tells more than the observation"
            )
        stood, place = place, env.describe()["agent"]["at"]
        if views["prose"].observe(observation, info, last).startswith("You did not move."):
            assert stood == place
