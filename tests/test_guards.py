"""The guard cells of `make test-bounds` find a write next to an array, and nothing else."""

import numpy as np
import pytest

import socialai_dsl as sd
from tests.guards import Guards


@pytest.mark.parametrize("name", ["talkitout", "social_env", "school/boxes"])
@pytest.mark.parametrize("num_envs", [1, 5])
def test_playing_writes_nowhere_else(monkeypatch: pytest.MonkeyPatch, name: str, num_envs: int) -> None:
    guards = Guards(monkeypatch)
    envs = sd.make_vec(name, num_envs=num_envs, autoreset_mode="SameStep")
    envs.reset(seed=1)
    envs.action_space.seed(1)
    for _ in range(200):
        envs.step(envs.action_space.sample())
    envs.image_ids()
    assert guards.broken() == []


@pytest.mark.parametrize("offset", [-1, 1])
def test_a_write_outside_is_found(monkeypatch: pytest.MonkeyPatch, offset: int) -> None:
    guards = Guards(monkeypatch)
    envs = sd.make_vec("talkitout", num_envs=1)
    tokens = envs._table.batch.state.tokens
    whole = np.lib.stride_tricks.as_strided(tokens, (tokens.shape[1] + 1,), (2,)) if offset > 0 else None
    if whole is not None:
        whole[-1] = 3
    else:
        before = tokens.base
        while before.base is not None:
            before = before.base
        before[4095] = 3
    assert guards.broken() == ["tokens"]
