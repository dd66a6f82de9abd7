"""Playing at random: every episode counts alike."""

from pathlib import Path

import numpy as np
import pytest

from socialai_dsl.evaluation.chance import _Tally, play_at_random

WAITING = """
scenario: waiting
horizon: 3
grammar: {templates: [Say <noun>], nouns: [it, that]}
room: {size: 5}
actions: [left, done]
objects: {}
cast: {agent: {place: anywhere}}
outcome:
  - success: agent.said("Say it")
  - failure: agent.did(done)
"""


def test_long_episodes_count_as_often_as_short_ones() -> None:
    """One environment ends its episodes at every step, the other at every tenth: three of each count."""
    tally = _Tally(2, 3)
    step = 0
    while not tally.complete:
        step += 1
        ended = np.array([True, step % 10 == 0])
        tally.note(np.array([1.0, 0.5]), ended, np.array([False, True]) & ended)
    sample = tally.sample()
    assert step == 30
    assert sample.episodes == 6
    assert sample.mean_length == 5.5
    assert sample.sd_length == pytest.approx(np.std([1, 1, 1, 10, 10, 10], ddof=1))
    assert sample.successes == 3
    assert sample.mean_reward == pytest.approx((3 * 1.0 + 3 * 5.0) / 6)


def test_the_uniform_policy(tmp_path: Path) -> None:
    """Said is "Say it" in a quarter of the steps, done is a third of the actions and comes after it."""
    file = tmp_path / "waiting.yaml"
    file.write_text(WAITING)
    sample = play_at_random(str(file), 19_001, seed=4)
    assert sample.episodes == 20_000, "rounded up to a thousand environments"
    going_on = 3 / 4 * 2 / 3
    success = 1 / 4 * (1 + going_on + going_on**2)
    assert sample.success_rate == pytest.approx(success, abs=5 * sample.success_se)
    assert sample.mean_length == pytest.approx(
        1 + going_on + going_on**2, abs=5 * sample.sd_length / 20_000**0.5
    )
    assert sample.success_se == pytest.approx((success * (1 - success) / 20_000) ** 0.5, rel=0.05)


def test_a_seed_gives_the_same_again(tmp_path: Path) -> None:
    file = tmp_path / "waiting.yaml"
    file.write_text(WAITING)
    assert play_at_random(str(file), 50, seed=1) == play_at_random(str(file), 50, seed=1)
    assert play_at_random(str(file), 50, seed=1) != play_at_random(str(file), 50, seed=2)
