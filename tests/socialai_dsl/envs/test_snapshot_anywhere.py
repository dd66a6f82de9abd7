"""A snapshot is exact wherever in an episode it is taken, in every scenario and mode."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import socialai_dsl as sd
from socialai_dsl.loader.shipped import shipped_scenarios

ENVS = 6
AFTER = 40


@cache
def made(name: str, mode: str) -> tuple[Any, Any]:
    """Environments to take a snapshot of, and others to put it back into."""
    first, second = (sd.make_vec(name, num_envs=ENVS, autoreset_mode=mode) for _ in range(2))
    return first, second


def told(envs: Any, actions: np.ndarray) -> list[bytes]:
    """All that a step tells."""
    observation, reward, terminated, truncated, infos = envs.step(actions)
    arrays = [observation["image"], observation["tokens"], reward, terminated, truncated]
    arrays += [infos[key] for key in ("success", "outcome") if key in infos]
    return [array.tobytes() for array in arrays] + [
        envs.utterance_ids().tobytes(),
        envs.history_ids().tobytes(),
    ]


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@settings(max_examples=12)
@given(
    name=st.sampled_from(shipped_scenarios()),
    before=st.integers(0, 120),
    seed=st.integers(0, 2**63 - 1),
    plan=st.integers(0, 2**32 - 1),
)
def test_what_follows_a_snapshot_is_the_same(mode: str, name: str, before: int, seed: int, plan: int) -> None:
    envs, other = made(name, mode)
    rng = np.random.default_rng(plan)
    sizes = envs.single_action_space.nvec
    actions = rng.integers(0, sizes, (before + AFTER, ENVS, 4))
    actions[..., 0] = np.where(rng.random((before + AFTER, ENVS)) < 0.9, actions[..., 0] % 3, actions[..., 0])
    envs.reset(seed=seed)
    for step in actions[:before]:
        envs.step(step)
    saved = envs.snapshot()
    expected = [told(envs, step) for step in actions[before:]]
    described, counted = [envs.describe(i) for i in range(ENVS)], envs.counters()
    for target in (other, envs):
        target.reset(seed=1)
        target.restore(saved)
        assert target.snapshot() == saved
        assert [told(target, step) for step in actions[before:]] == expected
        assert [target.describe(i) for i in range(ENVS)] == described
        assert target.counters() == counted
