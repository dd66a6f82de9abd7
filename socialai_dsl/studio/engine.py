"""A window's own process, asked one question at a time; one that hangs or dies is replaced."""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
from pathlib import Path
from typing import Any, Final

_WORKER: Final = "socialai_dsl.studio.worker"
_LONGEST_ANSWER: Final = 32 << 20
_START_SECONDS: Final = 120.0

_starting = asyncio.Semaphore(2)
"""Processes start two at a time: many at once would keep each other from ever being ready."""


class EngineLostError(Exception):
    """The process was stopped or has ended; the message says so to the person at the screen."""


class Engine:
    """A process for one window.

    Args:
        root: the folder whose files it may read.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()

    async def start(self) -> None:
        """Start the process, unless it runs, and wait until it is ready.

        Raises:
            EngineLostError: it never was.
        """
        if self._process is not None:
            return
        async with _starting:
            process = await start_worker(self._root)
            assert process.stdout is not None, "internal: it has an output"
            try:
                ready = await asyncio.wait_for(process.stdout.readline(), _START_SECONDS)
            except TimeoutError:
                ready = b""
            if not ready:
                await stop_process(process)
                raise EngineLostError("the engine's process could not be started")
            self._process = process

    async def ask(self, question: dict[str, Any], seconds: float) -> dict[str, Any]:
        """The answer to a question.

        Raises:
            EngineLostError: there was none within so many seconds, or the process has ended.
        """
        async with self._turn:
            await self.start()
            process = self._process
            assert process is not None, "internal: it was started"
            assert process.stdin is not None, "internal: it has an input"
            assert process.stdout is not None, "internal: it has an output"
            try:
                process.stdin.write(json.dumps(question).encode() + b"\n")
                line = await asyncio.wait_for(process.stdout.readline(), seconds)
            except TimeoutError:
                await self.stop()
                raise EngineLostError(f"this took longer than {seconds:g} seconds and was stopped") from None
            except (OSError, ValueError):
                line = b""
            if not line:
                await self.stop()
                raise EngineLostError("the engine's process has ended; it is started again")
            answer: dict[str, Any] = json.loads(line)
            return answer

    async def stop(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            await stop_process(process)


async def start_worker(root: Path, *words: str) -> asyncio.subprocess.Process:
    """A process of `worker`, with these words before its folder."""
    return await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", _WORKER, *words, str(root)),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        limit=_LONGEST_ANSWER,
    )


async def stop_process(process: asyncio.subprocess.Process) -> None:
    """End a process and wait for it."""
    with contextlib.suppress(ProcessLookupError):
        process.kill()
    await process.wait()
