"""Runs on a Ray cluster: each is a task of Ray's core, which Ray starts again elsewhere when its machine is lost."""

from __future__ import annotations

import logging
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from socialai_dsl.experiments.engines import Handle, MissingEngineError
from socialai_dsl.experiments.work import perform

_RETRIES: Final = 20
"""How often Ray may start a task again whose worker or machine was lost; the run goes on from its checkpoint."""

_OBJECT_STORE_BYTES: Final = 100_000_000
"""Of a cluster that we start: nothing but two words goes through it, and Ray would take a third of the memory."""

_SECONDS_TO_STOP: Final = 15.0


class RayEngine:
    """See `Engine`."""

    def __init__(self, address: str | None, threads: int, workers: int) -> None:
        """Join a cluster, or start one on this machine.

        Args:
            address: of a running cluster, as `ray.init` takes it; None: that of RAY_ADDRESS, or start one.
            threads: cores that each run needs.
            workers: runs at once, where we start the cluster.

        Raises:
            MissingEngineError: Ray is not installed, or there is no such cluster.
        """
        # Telling its makers that it is used would need the network.
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        try:
            import ray
        except ImportError:
            raise MissingEngineError("the engine ray needs: pip install 'socialai-dsl[ray]'") from None
        self._ray: Any = ray
        address = address or os.environ.get("RAY_ADDRESS") or "local"
        own: dict[str, Any] = {}
        if address == "local":
            own = {"num_cpus": threads * workers, "object_store_memory": _OBJECT_STORE_BYTES}
            own["include_dashboard"] = False
        try:
            ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR, **own)
        except (ConnectionError, ValueError, RuntimeError) as error:
            said = str(error).strip().splitlines()[0]
            raise MissingEngineError(f"there is no Ray cluster at {address}: {said}") from None
        self._task = ray.remote(perform).options(num_cpus=threads, max_retries=_RETRIES, name="socialai run")
        self._references: list[Any] = []

    def submit(self, folder: Path, run_ids: Sequence[str]) -> list[Handle]:
        """See `Engine.submit`."""
        references = [self._task.remote(folder.resolve(), run_id) for run_id in run_ids]
        self._references += references
        return [reference.future() for reference in references]

    def stop(self) -> None:
        """See `Engine.stop`."""
        unfinished = self._references
        if unfinished:
            _, unfinished = self._ray.wait(unfinished, num_returns=len(unfinished), timeout=0)
        for reference in unfinished:
            self._ray.cancel(
                reference, force=False
            )  # as Ctrl-C in its worker, which leaves the run as it stands
        if unfinished:
            self._ray.wait(unfinished, num_returns=len(unfinished), timeout=_SECONDS_TO_STOP)
        self._ray.shutdown()
