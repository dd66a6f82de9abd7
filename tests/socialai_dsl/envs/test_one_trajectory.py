"""One hash of all trajectories, whatever the batch and the process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
CODE = """
import hashlib
import numpy as np
import socialai_dsl as sd

plan = np.random.default_rng(1).integers(0, (3, 2, 1, 2), (60, 4096, 4))
for name in ("talkitout", "cointhief"):
    for size in (1, 7, 4096):
        envs = sd.make_vec(name, num_envs=size)
        digests = [hashlib.sha256() for _ in range(3)]  # of the first row, of seven, of all
        observation, _ = envs.reset(seed=5)
        for step in plan[:, :size]:
            observation, *results, _ = envs.step(step)
            for rows, digest in zip((1, 7, 4096), digests):
                for array in (observation["image"], observation["tokens"], *results):
                    digest.update(array[:rows].tobytes())
        known = sum(size >= rows for rows in (1, 7, 4096))
        print(name, *(digest.hexdigest() for digest in digests[:known]))
"""


@pytest.mark.thorough("starts three processes that play everything")
def test_three_processes_play_one_trajectory() -> None:
    """Each process with another hash seed, so that no order of a set or dictionary can matter."""
    outputs = []
    for seed in ("0", "1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-c", CODE],
            capture_output=True,
            text=True,
            env=environment,
            cwd=ROOT,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        outputs.append(done.stdout)
    assert len(set(outputs)) == 1
    lines = [line.split() for line in outputs[0].splitlines()]
    assert len(lines) == 6
    for name in ("talkitout", "cointhief"):
        one, seven, all_rows = (line[1:] for line in lines if line[0] == name)
        assert one == seven[:1] == all_rows[:1]
        assert seven == all_rows[:2]
