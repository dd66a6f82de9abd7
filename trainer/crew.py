"""This module spreads work over CPU threads that share nothing but the network's weights."""

from __future__ import annotations

import contextlib
import ctypes
import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType
from typing import Final, Self, TypeVar

import torch
from torch import Tensor

Item = TypeVar("Item")
Result = TypeVar("Result")

# More threads than this wait for Python's interpreter lock rather than compute.
_AUTOMATIC_LIMIT = 4


def available_cores() -> int:
    """CPU cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def automatic_threads(processes: int = 1) -> int:
    """Threads of a process where nobody says how many, if so many processes share this machine's cores."""
    return max(1, min(available_cores() // processes, _AUTOMATIC_LIMIT))


# Of mallopt(3): blocks above the first bound come from the system and go back to it, and so does the heap's end above
# the second; the first may be at most half of a thread's heap. With one arena all threads use the process's heap, which
# such a block fits into.
_MMAP_THRESHOLD, _TRIM_THRESHOLD, _ARENA_MAX = -3, -1, -8
_LARGEST_BLOCK, _LARGEST_END = 32 << 20, 2**31 - 1


def keep_freed_memory() -> bool:
    """Let this process keep the memory it frees, and return whether that could be arranged (with glibc it can).

    Every update asks for the same hundreds of megabytes in blocks of a few. As the C library is set, most of them are
    given back to the system and fetched again page by page, which takes up to a sixth of the time. Threads started
    later are concerned as well.
    """
    with contextlib.suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        if library.gnu_get_libc_version is not None:
            wanted = ((_MMAP_THRESHOLD, _LARGEST_BLOCK), (_TRIM_THRESHOLD, _LARGEST_END), (_ARENA_MAX, 1))
            return all(library.mallopt(*setting) == 1 for setting in wanted)
    return False


class Crew:
    """Threads that each differentiate their share of a minibatch.

    A recurrent network is thousands of small operations. Split inside each operation, as torch does, they spend
    their time meeting at barriers, and on a busy machine they stand still; whole shares meet once per step. Each
    thread, the caller's included, therefore runs torch on one core while the crew is open.

    Attributes:
        threads: how many.
    """

    def __init__(self, threads: int, divisible: bool = True) -> None:
        wanted = threads or automatic_threads()
        self.threads = wanted if divisible else 1
        self._inside = 1 if divisible else wanted
        self._before = torch.get_num_threads()
        self._pool = ThreadPoolExecutor(
            max(self.threads - 1, 1), initializer=torch.set_num_threads, initargs=(1,)
        )

    def __enter__(self) -> Self:
        torch.set_num_threads(self._inside)
        keep_freed_memory()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pool.shutdown()
        torch.set_num_threads(self._before)

    def shares(self, envs: Tensor) -> list[Tensor]:
        """Split environments, int64 (B,), evenly among the threads; no share is empty, so there may be none."""
        return list(envs.tensor_split(min(self.threads, len(envs)))) if len(envs) else []

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
        """Apply the function to all items at once, one thread each, the caller's taking the first."""
        queue = list(items)
        if not queue:
            return []
        first, *others = queue
        futures = [self._pool.submit(function, item) for item in others]
        try:
            result = function(first)
        finally:
            others_done = [future.exception() for future in futures]
        for error in others_done:
            if error is not None:
                raise error
        return [result, *(future.result() for future in futures)]


SOLO: Final = Crew(1)
"""Nobody but the caller, who uses as many threads inside each operation as torch does."""
