"""The process of a window, asked one question at a time; one that hangs or dies is replaced."""

from __future__ import annotations

import asyncio
import contextlib
import json
import multiprocessing
import os
import socket
import threading
from collections.abc import Callable
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Final

from socialai_dsl.studio.worker import answer_window

_LONGEST_ANSWER: Final = 32 << 20
_START_SECONDS: Final = 120.0
_SAFE_PATH: Final = "PYTHONSAFEPATH"

_forking = multiprocessing.get_context("forkserver")
_forking.set_forkserver_preload(["socialai_dsl.studio.warm"])
_starting = threading.Lock()


class EngineLostError(Exception):
    """The process was stopped or has ended; the message says so to the person at the screen."""


class Worker:
    """A process and the connection to it; `start_worker` makes one.

    Attributes:
        reader, writer: what it says, and what it is told.
    """

    def __init__(
        self, process: BaseProcess, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self._process = process
        self.reader, self.writer = reader, writer

    async def stop(self) -> None:
        """End the process and wait for it."""
        self.writer.close()
        self._process.kill()
        await asyncio.to_thread(self._process.join)
        self._process.close()


async def start_worker(run: Callable[[socket.socket, str], None], root: Path) -> Worker:
    """Fork a process that runs this function of `worker`; the first one waits until there is something to fork.

    Raises:
        EngineLostError: it could not be started.
    """
    ours, theirs = socket.socketpair()
    process = _forking.Process(target=run, args=(theirs, str(root)), daemon=True)
    try:
        await asyncio.wait_for(asyncio.to_thread(_start, process), _START_SECONDS)
    except (OSError, EOFError, TimeoutError):
        ours.close()
        raise EngineLostError("the engine's process could not be started") from None
    finally:
        theirs.close()
    return Worker(process, *await asyncio.open_connection(sock=ours, limit=_LONGEST_ANSWER))


def _start(process: BaseProcess) -> None:
    """Start one process at a time, as `multiprocessing` keeps a common list of them.

    The fork server is a Python of its own, which is not to import modules of the folder that happens to be open.
    """
    with _starting:
        before = os.environ.get(_SAFE_PATH)
        os.environ[_SAFE_PATH] = "1"
        try:
            process.start()
        finally:
            del os.environ[_SAFE_PATH]
            if before is not None:
                os.environ[_SAFE_PATH] = before


class Engine:
    """A process that answers one window's questions, started with the first one.

    Args:
        root: the folder whose files it may read.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._worker: Worker | None = None
        self._turn = asyncio.Lock()

    async def ask(self, question: dict[str, Any], seconds: float) -> dict[str, Any]:
        """The answer to a question.

        Raises:
            EngineLostError: none came within `seconds`, or the process has ended.
        """
        async with self._turn:
            if self._worker is None:
                self._worker = await start_worker(answer_window, self._root)
            try:
                self._worker.writer.write(json.dumps(question).encode() + b"\n")
                line = await asyncio.wait_for(self._worker.reader.readline(), seconds)
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
        worker, self._worker = self._worker, None
        if worker is not None:
            with contextlib.suppress(OSError):
                await worker.stop()
