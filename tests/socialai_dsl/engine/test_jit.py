"""Compiled code is kept by Numba, found by later processes, and made anew where none can be read."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from socialai_dsl.engine.jit import is_interpreted
from tests.shipped import scenarios

pytestmark = [
    pytest.mark.skipif(is_interpreted(), reason="nothing is compiled"),
    pytest.mark.thorough("processes compile anew"),
]

# `identify` compiles in a second; `serve` in twenty.
IDENTIFY = """
import numpy as np
from socialai_dsl.engine.jit import load
from socialai_dsl.engine.pointers import make_book
from socialai_dsl.engine.queries import identify
from socialai_dsl.engine.state import ArrayId
arrays = [np.full((1, 64), 7, np.int64)] * len(ArrayId)
identified = load(identify)
identified(make_book(arrays), 1)
print(arrays[0][0, 0], sum(identified.stats.cache_hits.values()), sum(identified.stats.cache_misses.values()))
"""
NOTICE = "socialai: compiling the engine, once for this machine: 20 to 70 seconds\n"
PLAY = """
import hashlib, sys, numpy as np, socialai_dsl as sd
_, steps, rows, *names = sys.argv
for name in names:
    digest = hashlib.sha256()
    envs = sd.make_vec(name, num_envs=int(rows))
    rng, sizes = np.random.default_rng(0), envs.single_action_space.nvec
    observation, _ = envs.reset(seed=4)
    for _ in range(int(steps)):
        for part in observation.values():
            digest.update(part.tobytes())
        observation, reward, *_ = envs.step(rng.integers(0, sizes, (int(rows), len(sizes))))
        digest.update(reward.tobytes())
    print(digest.hexdigest())
"""
SOME = ("talkitout", "school/boxes", "school/marbles+pointing", "novel/culprit", "cointhief_tags")
PLAIN = {"NUMBA_DISABLE_JIT": "1", "PYTHONWARNINGS": "error"}


def printed(code: str, *arguments: str, **environment: str) -> list[str]:
    """What a process prints, which says nothing but that it compiles."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        env={**clean, **environment},
        timeout=1800,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr in ("", NOTICE)
    return done.stdout.split()


def test_what_one_process_compiles_the_next_loads(tmp_path: Path) -> None:
    digest, hits, misses = printed(IDENTIFY, SOCIALAI_CACHE_DIR=str(tmp_path))
    assert (hits, misses) == ("0", "1")
    assert printed(IDENTIFY, SOCIALAI_CACHE_DIR=str(tmp_path)) == [digest, "1", "0"]


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_what_is_cut_off_is_compiled_again(tmp_path: Path, suffix: str) -> None:
    digest, *_ = printed(IDENTIFY, SOCIALAI_CACHE_DIR=str(tmp_path))
    (kept,) = tmp_path.rglob(f"*.{suffix}")
    kept.write_bytes(kept.read_bytes()[:100])
    assert printed(IDENTIFY, SOCIALAI_CACHE_DIR=str(tmp_path))[0] == digest
    printed(IDENTIFY, SOCIALAI_CACHE_DIR=str(tmp_path))
    assert printed(IDENTIFY, SOCIALAI_CACHE_DIR=str(tmp_path)) == [digest, "1", "0"], "the next can keep it"


def test_without_a_place_on_the_disk_it_compiles_all_the_same() -> None:
    digest, hits, _ = printed(IDENTIFY, SOCIALAI_CACHE_DIR="")
    assert digest != "7"
    assert hits == "0"


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_plain_processor_plays_the_same(tmp_path: Path) -> None:
    own = printed(PLAY, "50", "8", *SOME)
    assert printed(PLAY, "50", "8", *SOME, NUMBA_CPU_NAME="generic", SOCIALAI_CACHE_DIR=str(tmp_path)) == own


def test_plain_python_plays_the_same_without_a_warning() -> None:
    assert printed(PLAY, "4", "2", *SOME, **PLAIN) == printed(PLAY, "4", "2", *SOME)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_plain_python_plays_every_scenario_without_a_warning() -> None:
    names = scenarios()
    assert printed(PLAY, "3", "1", *names, **PLAIN) == printed(PLAY, "3", "1", *names)
