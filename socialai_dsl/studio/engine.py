"""The process of a window, asked one question at a time; one that hangs or dies is replaced."""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import socket
import threading
from collections.abc import Callable
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Final

from pydantic import ValidationError

from socialai_dsl.envs.seats import NOBODY
from socialai_dsl.studio.files import PLAYERS
from socialai_dsl.studio.messages import ANSWERS, Begin, Check, Question, Show, Test, WriteTest
from socialai_dsl.studio.worker import answer_window

_LONGEST_ANSWER: Final = 32 << 20
_START_SECONDS: Final = 120.0
_TRYING_SECONDS: Final = 90.0
_LOADING_SECONDS: Final = 60.0
_USUAL_SECONDS: Final = 10.0
_SAFE_PATH: Final = "PYTHONSAFEPATH"

_forking = multiprocessing.get_context("forkserver")
_forking.set_forkserver_preload(["socialai_dsl.studio.warm"])
_list = threading.Lock()


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
        await asyncio.to_thread(_end, self._process)


async def start_worker(run: Callable[[socket.socket, str], None], root: Path) -> Worker:
    """Fork a process that runs this function of `worker`; the first one waits until there is something to fork.

    Raises:
        EngineLostError: it could not be started.
    """
    starting = asyncio.get_running_loop().run_in_executor(None, _start, run, root)
    try:
        async with asyncio.timeout(_START_SECONDS):
            # Shielded, since a start cannot be taken back: the process is ended when it has started.
            process, ours = await asyncio.shield(starting)
            return Worker(process, *await asyncio.open_connection(sock=ours, limit=_LONGEST_ANSWER))
    except BaseException as error:
        starting.add_done_callback(_drop)
        if isinstance(error, OSError | EOFError):
            raise EngineLostError("the engine's process could not be started") from None
        raise


def _start(run: Callable[[socket.socket, str], None], root: Path) -> tuple[BaseProcess, socket.socket]:
    """Start one process at a time, as `multiprocessing` keeps a common list of them.

    Returns the process, and the connection to it.

    The fork server is a Python of its own, which is not to import modules of the folder that happens to be open.
    """
    ours, theirs = socket.socketpair()
    process = _forking.Process(target=run, args=(theirs, str(root)), daemon=True)
    with theirs, _list:
        before = os.environ.get(_SAFE_PATH)
        os.environ[_SAFE_PATH] = "1"
        try:
            process.start()
        except BaseException:
            ours.close()
            raise
        finally:
            del os.environ[_SAFE_PATH]
            if before is not None:
                os.environ[_SAFE_PATH] = before
    return process, ours


def _end(process: BaseProcess) -> None:
    """End a process. Not while another is started, which looks through the common list and reads from each of it."""
    process.kill()
    with _list:
        process.join()
        process.close()


def _drop(started: asyncio.Future[tuple[BaseProcess, socket.socket]]) -> None:
    """End a process that nobody waits for."""
    if not started.cancelled() and started.exception() is None:
        process, ours = started.result()
        ours.close()
        threading.Thread(target=_end, args=(process,)).start()


class Engine:
    """A process that answers one window's questions, started with the first one.

    Args:
        root: the folder whose files it may read.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._worker: Worker | None = None
        self._turn = asyncio.Lock()

    async def ask(self, question: Question) -> str:
        """The answer to a question, as JSON.

        Raises:
            EngineLostError: none came in time, or the process has ended.
        """
        seconds = _seconds(question)
        async with self._turn:
            if self._worker is None:
                self._worker = await start_worker(answer_window, self._root)
            try:
                self._worker.writer.write(question.model_dump_json().encode() + b"\n")
                async with asyncio.timeout(seconds):  # `wait_for` may lose that the window was closed
                    line = await self._worker.reader.readline()
            except TimeoutError:
                await self.stop()
                raise EngineLostError(f"this took longer than {seconds:g} seconds and was stopped") from None
            except (OSError, ValueError):
                line = b""
            if not line.endswith(b"\n"):
                await self.stop()
                raise EngineLostError("the engine's process has ended; it is started again")
            try:
                answer = ANSWERS.validate_json(line)
            except ValidationError:
                answer = None
            if answer is None or answer.id != question.id or answer.do not in (question.do, "refused"):
                await self.stop()
                raise EngineLostError(
                    "the engine's process gave an answer to something else; it is started again"
                )
            return line.decode().rstrip("\n")

    async def stop(self) -> None:
        """End the process. The next question starts another."""
        worker, self._worker = self._worker, None
        if worker is not None:
            with contextlib.suppress(OSError):
                await worker.stop()


def _seconds(question: Question) -> float:
    """How long an answer may take."""
    if isinstance(question, Check | Test):
        return _TRYING_SECONDS
    if isinstance(question, Show | WriteTest):
        return _LOADING_SECONDS
    loads = isinstance(question, Begin) and not {question.player, *question.others.values()} <= {
        *PLAYERS,
        NOBODY,
    }
    return _LOADING_SECONDS if loads else _USUAL_SECONDS
