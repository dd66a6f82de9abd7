"""Cores of this machine for runs: each is lent to one run at a time, also among several commands."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path


def available_cores() -> list[int]:
    """The cores that this process may use; as many numbers as there are cores where the system does not say."""
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


@contextlib.contextmanager
def lent_cores(count: int) -> Iterator[tuple[int, ...]]:
    """So many cores that no other run has; none if there are not so many free, or the system cannot pin.

    A lock on a file stands for a core, and a process that dies gives its locks back.
    """
    try:
        import fcntl
    except ImportError:
        yield ()
        return
    if not hasattr(os, "sched_setaffinity"):
        yield ()
        return
    folder = Path(tempfile.gettempdir()) / f"socialai-cores-{os.getuid()}"
    with contextlib.ExitStack() as held:
        cores: list[int] = []
        with contextlib.suppress(OSError):
            folder.mkdir(mode=0o700, exist_ok=True)
            for core in available_cores():
                if len(cores) == count:
                    break
                file = held.enter_context(open(folder / f"{core}.lock", "w"))
                with contextlib.suppress(BlockingIOError):
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    cores.append(core)
        yield tuple(cores) if len(cores) == count else ()
