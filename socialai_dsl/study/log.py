"""The log of a study: a line of JSON for each event, on disk before anybody sees what came of it."""

from __future__ import annotations

import asyncio
import json
import os
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from socialai_dsl.errors import UnreadableError, UsageError

FORMAT: Final = "socialai-study/1"
FILE: Final = "log.jsonl"

Event = dict[str, Any]


def read_log(file: Path) -> Iterator[Event]:
    """The events of a log, up to a line that was cut off: of that nobody has seen anything.

    Raises:
        OSError: it cannot be read.
        UnreadableError: it is none of ours, or was changed.
    """
    with open(file, "rb") as stream:
        for number, line in enumerate(stream, start=1):
            if not line.endswith(b"\n"):
                return
            try:
                event = json.loads(line)
            except ValueError:
                event = None
            if not isinstance(event, dict) or (number == 1 and event.get("format") != FORMAT):
                raise UnreadableError(f"{file}:{number}: expected an event of a log of the format {FORMAT}")
            yield event


def follow(file: Path, take: Callable[[Event], None]) -> None:
    """Let each event of a log be taken, in order.

    Raises:
        OSError, UnreadableError: see `read_log`; or an event cannot have come where it stands.
        UsageError: `take` says that the log is of something else.
    """
    for number, event in enumerate(read_log(file), start=1):
        try:
            take(event)
        except UsageError:
            raise
        except (ArithmeticError, AssertionError, AttributeError, LookupError, TypeError, ValueError) as error:
            raise UnreadableError(
                f"{file}:{number}: the event {event.get('event')!r} cannot have come here: {error}"
            ) from None


class Log:
    """A log that is written to. Events are in the order in which they are added; many are flushed at once.

    Args:
        file: is continued where there is one.

    Raises:
        OSError: it cannot be written.
    """

    def __init__(self, file: Path) -> None:
        self._descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        self._size = self._whole_lines()
        os.ftruncate(self._descriptor, self._size)
        self._began = time.monotonic()
        self._waiting: list[bytes] = []
        self._stored: asyncio.Future[None] | None = None
        self._written: asyncio.Future[None] | None = None  # of what is being written now
        self._flushing: asyncio.Task[None] | None = None

    def add(self, event: str, **more: Any) -> Event:
        """Add an event with the present time, and the seconds since this log was opened, which never go back."""
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        mono = round(time.monotonic() - self._began, 4)
        made = {"event": event, "time": now, "mono": mono, **more}
        self._waiting.append(json.dumps(made, ensure_ascii=False, separators=(",", ":")).encode() + b"\n")
        return made

    async def flushed(self) -> None:
        """Wait until all that was added is on disk.

        Raises:
            OSError: it cannot be written; what was added since the last time that it could is forgotten.
        """
        loop = asyncio.get_running_loop()
        if self._waiting:
            if self._stored is None:
                self._stored = loop.create_future()
            stored = self._stored
            if self._flushing is None:
                self._flushing = loop.create_task(self._flush())
            await asyncio.shield(stored)
        elif self._written is not None:  # and not what comes later, which may be without end
            await asyncio.shield(self._written)

    async def _flush(self) -> None:
        """Write what waits, and what comes meanwhile, until nothing is left."""
        loop = asyncio.get_running_loop()
        try:
            while self._waiting:
                lines, stored = b"".join(self._waiting), self._stored or loop.create_future()
                self._waiting, self._stored, self._written = [], None, stored
                try:
                    await asyncio.to_thread(self._write, lines)
                except OSError as error:
                    later, self._waiting, self._stored = self._stored, [], None
                    for waits in (stored, later):  # what came later depends on what could not be written
                        if waits is not None:
                            waits.set_exception(OSError(error.errno, error.strerror))
                            waits.exception()  # nobody may wait for it
                    return
                stored.set_result(None)
        finally:
            self._flushing = self._written = None

    def _write(self, lines: bytes) -> None:
        try:
            done = 0
            while done < len(lines):
                done += os.pwrite(self._descriptor, lines[done:], self._size + done)
            os.fsync(self._descriptor)
        except OSError:
            os.ftruncate(self._descriptor, self._size)
            raise
        self._size += len(lines)

    def _whole_lines(self) -> int:
        """Bytes up to the end of the last whole line."""
        size = os.fstat(self._descriptor).st_size
        at = size
        while at:
            start = max(0, at - 65536)
            found = os.pread(self._descriptor, at - start, start).rfind(b"\n")
            if found >= 0:
                return start + found + 1
            at = start
        return 0

    def close(self) -> None:
        """Let the file go."""
        os.close(self._descriptor)
