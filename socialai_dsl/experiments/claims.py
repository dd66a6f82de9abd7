"""Who works on a run: claims that are made atomically, kept alive, and taken over when their owner is gone.

A run's claims are numbered files. The newest is in force; making the next one, which only one process can, is how a run
is taken over, so two that find the same stale claim cannot both win. Nothing is ever deleted.

Whether an owner is gone is told in two ways: on the same machine by its process, anywhere else by the claim's age,
which is measured by the clock of the file system that both share.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

from socialai_dsl.atomic import write_json

FOLDER: Final = "claims"
STALE_AFTER: Final = 120.0
"""Seconds without a sign of life after which an owner on another machine counts as gone."""


@dataclass(frozen=True)
class Claim:
    """A run that this process works on.

    Attributes:
        path: the claim's file. owner: what it says.
    """

    path: Path
    owner: Mapping[str, Any]

    @property
    def number(self) -> int:
        """Which of the run's claims it is, from 1 on."""
        return int(self.path.stem)

    def renew(self) -> bool:
        """Give a sign of life; whether the run is still ours."""
        if is_overtaken(self.path):
            return False
        os.utime(self.path)
        return True

    def release(self) -> None:
        """Let go of the run."""
        if not is_overtaken(self.path):
            write_json(self.path, {**self.owner, "released": time.time()})


def is_overtaken(path: Path) -> bool:
    """Whether somebody took over a run from the owner of this claim."""
    return not path.exists() or _successor(path).exists()


def claim(run: Path, stale_after: float = STALE_AFTER) -> Claim | None:
    """Claim a run; None if somebody else works on it.

    Args:
        run: the run's folder, made if missing.
        stale_after: seconds without a sign of life after which an owner elsewhere counts as gone.

    Raises:
        OSError: the folder cannot be used.
    """
    folder = run / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    newest = newest_claim(run)
    if newest is not None and is_held(newest, stale_after):
        return None
    path = _successor(newest) if newest is not None else folder / "0001.json"
    owner = {"host": socket.gethostname(), "pid": os.getpid(), "scope": scope(), "started": time.time()}
    owner["born"] = born(os.getpid())
    try:
        descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666)
    except FileExistsError:
        return None
    with os.fdopen(descriptor, "w", encoding="utf-8") as file:
        json.dump(owner, file)
        file.flush()
        os.fsync(file.fileno())
    return Claim(path, owner)


def newest_claim(run: Path) -> Path | None:
    """The claim in force, or the last one that was."""
    try:
        names = os.listdir(run / FOLDER)
    except FileNotFoundError:
        return None
    numbers = [int(name[:-5]) for name in names if name.endswith(".json") and name[:-5].isdigit()]
    return run / FOLDER / f"{max(numbers):04d}.json" if numbers else None


def is_held(path: Path, stale_after: float = STALE_AFTER) -> bool:
    """Whether the owner of a claim is at work."""
    owner = owner_of(path)
    if owner is not None:
        if "released" in owner:
            return False
        if owner.get("scope") == scope() and born(int(owner["pid"])) != owner.get("born"):
            return False
    # No owner yet: the file was made this moment, or its maker died in it.
    return _age(path) <= stale_after


def owner_of(path: Path) -> dict[str, Any] | None:
    """What a claim says; None while it is being written."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return None
    return content if isinstance(content, dict) else None


def _successor(path: Path) -> Path:
    return path.with_name(f"{int(path.stem) + 1:04d}.json")


def _age(path: Path) -> float:
    """Seconds since the last sign of life, by the clock that also stamped it."""
    probe = path.with_name(f".clock-{os.getpid()}-{time.monotonic_ns()}")
    try:
        probe.touch()
        return probe.stat().st_mtime - path.stat().st_mtime
    finally:
        probe.unlink(missing_ok=True)


@cache
def scope() -> str:
    """Within which processes are known by their number: one start of one machine, and one container of it."""
    parts = [socket.gethostname()]
    with contextlib.suppress(OSError):
        parts.append(Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip())
    with contextlib.suppress(OSError):
        parts.append(os.readlink("/proc/self/ns/pid"))
    return " ".join(parts)


def born(pid: int) -> str | None:
    """When a process began, as the system counts it; None if there is no such process (any more).

    Where the system does not tell, an empty text: then a process that has the number of an old one is taken for it.
    """
    if Path("/proc/self/stat").exists():
        try:
            fields = (
                Path(f"/proc/{pid}/stat")
                .read_text(encoding="ascii", errors="replace")
                .rpartition(")")[2]
                .split()
            )
        except OSError:
            return None
        return None if fields[0] in "ZX" else fields[19]
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return None
    except PermissionError:
        return ""
    return ""
