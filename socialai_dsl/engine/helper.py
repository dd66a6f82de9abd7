"""A process that compiles one of the engine's functions while this one compiles another.

Numba compiles in one thread, half of a cold start for each of the two functions that every batch needs. The helper
leaves its code on the disk; where there is none afterwards, whatever the reason, it is compiled here.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Final

from socialai_dsl.engine.cache import cache_folder

_CODE: Final = """
import json, sys
name, sys.path[:] = json.loads(sys.argv[1])
from socialai_dsl.engine.machine import provide
provide(name)
"""

_PATIENCE: Final = 300
"""Seconds after which a helper is not waited for any more."""


class Helper:
    """Compiles a function of the engine, by its name in `machine`, from now on."""

    def __init__(self, name: str) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        if not _is_useful():
            return
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _CODE, json.dumps([name, sys.path])],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),  # of Windows
            )
        except OSError:  # no more processes, or none allowed
            return

    def wait(self) -> None:
        """Return when it has done what it can."""
        if self._process is None:
            return
        try:
            self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _is_useful() -> bool:
    """Whether a Python can be started beside this one, on a core of its own, and leave something on the disk."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    # What is frozen into a program, or embedded in one, would start that program.
    is_python = Path(sys.executable or "").name.startswith("python") and not hasattr(sys, "frozen")
    return cores > 1 and is_python and cache_folder() is not None
