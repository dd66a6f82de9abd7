"""The machine of a measurement: its description, and the cores that a measurement may use."""

import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager


def machine() -> str:
    """The processor's name, as far as the system tells, and Python's version."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return f"{names[0] if names else platform.processor() or platform.machine()}, Python {platform.python_version()}"


def load() -> float | None:
    """How many threads of the whole machine wanted a core in the last minute, where the system tells."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


@contextmanager
def on_cores(count: int) -> Iterator[int]:
    """Keep this thread, and those it starts, on `count` cores, where the system can; how many there are."""
    if not hasattr(os, "sched_setaffinity"):
        yield min(count, os.cpu_count() or 1)
        return
    before = os.sched_getaffinity(0)
    cores = set(sorted(before)[-count:])
    os.sched_setaffinity(0, cores)
    try:
        yield len(cores)
    finally:
        os.sched_setaffinity(0, before)
