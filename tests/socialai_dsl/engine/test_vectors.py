"""A processor without wide vectors plays the same, only slower."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from socialai_dsl.engine.vectors import WIDE

PLAY = """
import hashlib, numpy as np, socialai_dsl as sd
from socialai_dsl.engine.vectors import WIDE
digest = hashlib.sha256()
for name in ("talkitout", "school/boxes", "school/marbles+pointing", "novel/culprit", "cointhief_tags"):
    envs = sd.make_vec(name, num_envs=32)
    rng = np.random.default_rng(0)
    observation, _ = envs.reset(seed=4)
    for _ in range(100):
        for part in observation.values():
            digest.update(part.tobytes())
        observation, reward, *_ = envs.step(rng.integers(0, envs.single_action_space.nvec, (32, 4)))
        digest.update(reward.tobytes())
print(WIDE, digest.hexdigest())
"""


def played(**environment: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", PLAY],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
        check=True,
    )
    return done.stdout.split()


@pytest.mark.skipif(not WIDE, reason="this processor has no wide vectors")
def test_narrow_processors_play_the_same(tmp_path: Path) -> None:
    wide = played()
    narrow = played(NUMBA_CPU_NAME="generic", SOCIALAI_CACHE_DIR=str(tmp_path))
    assert wide[0] == "True"
    assert narrow == ["False", wide[1]]
