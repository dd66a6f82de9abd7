"""Playing at random: every episode counts alike."""

from pathlib import Path

import pytest

from socialai_dsl.evaluation.chance import play_at_random

KINDS = """
scenario: kinds
horizon: 20
grammar: {templates: [Say <noun>], nouns: [it, that]}
room: {size: 5}
actions: [left]
objects: {}
let: {side: pick(left | right)}
cast: {agent: {place: anywhere}}
outcome: [{success: side == left}]
"""

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


def test_long_episodes_count_as_often_as_short_ones(tmp_path: Path) -> None:
    """An episode ends at once in one of two kinds of rooms, and lasts 20 steps in the other: each is half of all."""
    file = tmp_path / "kinds.yaml"
    file.write_text(KINDS)
    sample = play_at_random(str(file), 5_000, seed=1)
    assert sample.episodes == 5_000
    assert sample.success_rate == pytest.approx(1 / 2, abs=5 * (1 / 4 / 5_000) ** 0.5)
    assert sample.mean_length == pytest.approx((1 + 20) / 2, abs=5 * sample.sd_length / sample.episodes**0.5)


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
