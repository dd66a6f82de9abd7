"""Locks on folders: one process writes, and everybody may look at who does without being in its way."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import socket
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from filelock import FileLock, Timeout

if sys.platform != "win32":
    import fcntl

_SECONDS_TO_NAME: Final = 1.0
"""How long a process that has the lock may take until it has written its name."""


@dataclass(frozen=True)
class Holder:
    """The process that writes a folder.

    Attributes:
        pid, host: of the process. since: when it began, ISO 8601.
    """

    pid: int
    host: str
    since: str

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}, since {self.since}"


class HeldError(Exception):
    """Another process writes the folder.

    Attributes:
        holder: which; None where it could not be read.
    """

    def __init__(self, folder: Path, holder: Holder | None) -> None:
        self.holder = holder
        super().__init__(f"{folder}: another process is writing this folder ({holder or 'it gives no name'})")


@contextlib.contextmanager
def hold(folder: Path, name: str, wait: float = 0.0) -> Iterator[None]:
    """Be the one process that writes a folder; the system ends this when the process dies, however it dies.

    Two files do this. Writers compete for `NAME.lock`, which nobody else opens. The winner puts its name into
    `NAME.owner`, which is locked before it is there, so looking at it cannot keep a writer from its own lock.

    Args:
        folder: is there.
        name: of the lock; locks with different names are independent.
        wait: seconds to wait for another process.

    Raises:
        HeldError: another process holds it.
        OSError: the folder cannot be written.
    """
    lock, owner = FileLock(folder / f"{name}.lock", timeout=wait), folder / f"{name}.owner"
    try:
        lock.acquire()
    except Timeout:
        raise HeldError(folder, _named(folder, name)) from None
    try:
        descriptor = _written(owner)
        try:
            yield
        finally:
            os.close(descriptor)
            owner.unlink(missing_ok=True)
    finally:
        # filelock looks whether what it has locked is still there, so whoever waits takes a new file.
        Path(lock.lock_file).unlink(missing_ok=True)
        lock.release()


def holder(folder: Path, name: str) -> Holder | None:
    """The process that writes a folder; None if there is none. This takes no lock that a writer needs.

    On Windows, whose locks cannot be looked at, a process that was killed is named until the next one writes.
    """
    try:
        descriptor = os.open(folder / f"{name}.owner", os.O_RDONLY)
    except OSError:
        return None
    try:
        return None if _is_left(descriptor) else _read(descriptor)
    finally:
        os.close(descriptor)


def _is_left(descriptor: int) -> bool:
    """Whether the process that wrote an open file is gone."""
    if sys.platform == "win32":
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _written(owner: Path) -> int:
    """Write who we are; the open file, which is locked for as long as it is open."""
    own = owner.with_name(f".{owner.name}.{os.getpid()}-{time.monotonic_ns()}")
    descriptor = os.open(own, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644)
    try:
        if sys.platform != "win32":
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                if error.errno != errno.ENOSYS:  # a disk without locks: nobody can see that we are here
                    raise
        with contextlib.suppress(OSError):  # a full disk: the lock holds, without a name
            os.write(descriptor, json.dumps(vars(_ourselves())).encode())
        if sys.platform == "win32":  # which moves no open file
            os.close(descriptor)
            own.replace(owner)
            return os.open(owner, os.O_RDONLY)
        own.replace(owner)
    except BaseException:
        os.close(descriptor)
        own.unlink(missing_ok=True)
        raise
    return descriptor


def _ourselves() -> Holder:
    return Holder(os.getpid(), socket.gethostname(), datetime.now(UTC).isoformat(timespec="seconds"))


def _read(descriptor: int) -> Holder:
    try:
        return Holder(**json.loads(os.read(descriptor, 4096)))
    except (OSError, ValueError, TypeError):
        return Holder(0, "an unknown host", "an unknown time")


def _named(folder: Path, name: str) -> Holder | None:
    """The process that holds the lock, which writes its name a moment after it has it."""
    last = time.monotonic() + _SECONDS_TO_NAME
    while (found := holder(folder, name)) is None and time.monotonic() < last:
        time.sleep(0.01)
    return found
