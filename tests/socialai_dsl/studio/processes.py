"""The processes of windows, as the system sees them."""

from __future__ import annotations

import os
import time
from pathlib import Path


def workers() -> list[int]:
    """What runs and was started by what we have started: by the fork server, which is our own child."""
    parents: dict[int, int] = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = file.read_text().rpartition(")")[2].split()[:2]
        except OSError:  # it has ended meanwhile
            continue
        if state != "Z":
            parents[int(file.parent.name)] = int(parent)
    return [process for process, parent in parents.items() if parents.get(parent) == os.getpid()]


def wait_until_none_works(seconds: float = 15) -> None:
    """Of windows that are closed no process is left within seconds."""
    deadline = time.monotonic() + seconds
    while left := workers():
        assert time.monotonic() < deadline, left
        time.sleep(0.02)
