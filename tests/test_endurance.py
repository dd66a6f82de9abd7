"""Hundreds of millions of steps leave memory, speed and open files as they were."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.loader.shipped import shipped_scenarios
from tests.quick import one_in

SCENARIOS = Path(__file__).parents[1] / "scenarios"
IN_FOLDERS = [
    f"{path.parent.name}/{path.stem}"
    for folder in ("classics", "novel", "school")
    for path in sorted((SCENARIOS / folder).glob("*.yaml"))
    if re.search(r"^scenario: ", path.read_text(encoding="utf-8"), re.MULTILINE)
    and not re.search(r"^abstract: true", path.read_text(encoding="utf-8"), re.MULTILINE)
]
"""Those that a file of theirs describes whole; their variants are played by other tests."""
NAMES = [*shipped_scenarios(), *IN_FOLDERS]

STEPS = int(os.environ.get("SOCIALAI_ENDURANCE_STEPS", 500_000_000))
ROUNDS = 10
ENVS = 4096
MEGABYTE = 1 << 20


def resident() -> int:
    """Bytes of memory in use."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def play(name: str, steps: int, rooms: int = ENVS) -> float:
    """Steps per CPU second of a new batch under random actions that move more than they end."""
    envs: Any = sd.make_vec(name, num_envs=rooms, copy=False)
    sizes = envs.single_action_space.nvec
    plan = np.random.default_rng(1).integers(0, sizes, (64, rooms, len(sizes)))
    plan[..., 0] %= 3
    envs.reset(seed=1)
    began = time.process_time()
    for i in range(steps):
        envs.step(plan[i % 64])
    spent = time.process_time() - began
    envs.close()
    return steps * rooms / max(spent, 1e-6)  # the clock of a virtual machine may stand still for so few


@pytest.mark.parametrize("name", one_in(8, NAMES, "plays every scenario"))
def test_each_scenario_can_be_played_so(name: str) -> None:
    assert play(name, 70, rooms=4) > 0


@pytest.mark.slow
@pytest.mark.timeout(7200)
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the system does not tell")
def test_nothing_grows_and_nothing_slows_down() -> None:
    steps = -(-STEPS // (ROUNDS * len(NAMES) * ENVS))
    rows = []
    for number in range(ROUNDS):
        speeds = [play(name, steps) for name in NAMES]
        speed = len(speeds) / sum(1 / one for one in speeds)
        rows.append((speed, resident(), open_files()))
        print(
            f"round {number}: {speed / 1e6:.2f} M steps per CPU second, "
            f"{rows[-1][1] / MEGABYTE:.1f} MB, {rows[-1][2]} open files",
            flush=True,
        )
    print(f"{ROUNDS * steps * len(NAMES) * ENVS:,} steps of {len(NAMES)} scenarios")
    speed, memory, files = (list(column) for column in zip(*rows, strict=True))
    assert max(memory[2:]) - memory[1] < 4 * MEGABYTE, "memory grows"
    assert set(files) == {files[0]}, "files stay open"
    half = ROUNDS // 2
    assert np.median(speed[half:]) > 0.8 * np.median(speed[:half]), "it slows down"
