"""Runs on this machine, several at once, each a process of its own."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from socialai_dsl.experiments.work import End, perform


class LocalEngine:
    """See `Engine`."""

    def __init__(self, workers: int) -> None:
        """Work on `workers` runs at once."""
        self._stopped = threading.Event()
        # The threads only watch processes.
        self._pool = ThreadPoolExecutor(workers, thread_name_prefix="run")

    def submit(self, folder: Path, run_ids: Sequence[str]) -> list[Future[End]]:
        """See `Engine.submit`."""
        return [self._pool.submit(perform, folder, run_id, self._stopped.is_set) for run_id in run_ids]

    def stop(self) -> None:
        """See `Engine.stop`."""
        self._stopped.set()
        self._pool.shutdown(cancel_futures=True)
