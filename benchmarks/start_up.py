"""Measures for `make bench` the time to a check, to a program and to the first step."""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from typing import Any, Final

import socialai_dsl
from benchmarks.report import Wait

_FIRST_STEP: Final = """
import sys, socialai_dsl
envs = socialai_dsl.make_vec(sys.argv[1], num_envs=16)
envs.reset(seed=0)
envs.step(envs.action_space.sample())
"""


def waits(scenario: str, repetitions: int) -> Iterator[Wait]:
    """How long it takes on the clock until something is there, each begun anew so often.

    Raises:
        RuntimeError: a process that was started for it failed; what it said.
    """
    step, check = ["-c", _FIRST_STEP, scenario], ["-m", "socialai_dsl", "validate", scenario]
    # What is measured first leaves the engine's machine code for what comes next.
    with tempfile.TemporaryDirectory() as folder:
        yield _wait("first step of a new process, engine compiled for it", lambda: _run(step, folder), 1)
        yield _wait("first step of a new process", lambda: _run(step, folder), repetitions)
        yield _wait("`socialai validate`, the whole process", lambda: _run(check, folder), repetitions)
    _compile(scenario)  # the grammar is read once
    yield _wait("a file becomes a program, again", lambda: _compile(scenario), repetitions)


def _wait(what: str, act: Callable[[], Any], repetitions: int) -> Wait:
    seconds = []
    for _ in range(repetitions):
        began = time.perf_counter()
        act()
        seconds.append(time.perf_counter() - began)
    return Wait(what, statistics.median(seconds), min(seconds), max(seconds))


def _compile(scenario: str) -> None:
    socialai_dsl.compile(socialai_dsl.load(scenario))


def _run(arguments: list[str], cache: str) -> None:
    """Run a Python with the engine's machine code in this folder."""
    command = [sys.executable, *arguments]
    environment = {
        **os.environ,
        "SOCIALAI_CACHE_DIR": cache,
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
    }
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"a process failed: {(done.stderr or done.stdout).strip()[-500:]}")
