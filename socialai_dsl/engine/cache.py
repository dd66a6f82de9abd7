"""Compiled code on disk: private to the user, and never older than the package's sources.

The folder is named by a digest of all sources of the engine, the versions, the processor and the settings that shape
the code. Entries end with a digest of name and content: what is damaged, or another's, is compiled again instead.
"""

import hashlib
import os
import stat
import sys
import tempfile
import threading
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Final

import llvmlite.binding as llvm

from socialai_dsl.engine.settings import settings

_DIGEST_BYTES: Final = 32


@cache
def cache_folder() -> Path | None:
    """The folder of compiled code, made if need be; None if no place is private and writable.

    `SOCIALAI_CACHE_DIR` names another place for it; empty turns the disk cache off.
    """
    wanted = os.environ.get("SOCIALAI_CACHE_DIR")
    if wanted == "":
        return None
    if wanted:
        candidates = [Path(wanted)]
    else:
        base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
        candidates = [
            Path(base).expanduser() / "socialai-dsl",
            Path(tempfile.gettempdir()) / f"socialai-dsl-{_user()}",
        ]
    for candidate in candidates:
        folder = candidate / fingerprint()
        if _make_private(candidate) and _make_private(folder):
            return folder
    return None


@cache
def fingerprint() -> str:
    """Digest of everything that compiled code depends on."""
    package = Path(__file__).parents[1]
    sources = [
        *sorted((package / "engine").glob("*.py")),
        *sorted((package / "program").glob("*.py")),
        package / "draws.py",
    ]
    digest = hashlib.sha256()
    for source in sources:
        digest.update(source.name.encode())
        digest.update(hashlib.sha256(source.read_bytes()).digest())
    words = [*map(version, ("numba", "llvmlite", "numpy")), sys.version, *settings().values(), package]
    for word in (*words, llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()):
        digest.update(f"\x1f{word}".encode())
    return digest.hexdigest()[:24]


def _user() -> int:
    return os.getuid() if hasattr(os, "getuid") else 0


def _make_private(folder: Path) -> bool:
    """Make a folder that only this user can write; whether it is one. Foreign code must never be loaded."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return False
    if not stat.S_ISDIR(status.st_mode) or not os.access(folder, os.W_OK):
        return False
    if os.name == "nt":
        return True
    return status.st_uid == _user() and status.st_mode & (stat.S_IWGRP | stat.S_IWOTH) == 0


def read(name: str) -> bytes | None:
    """What was kept under this name; None if nothing was, or what is there is damaged."""
    folder = cache_folder()
    if folder is None:
        return None
    try:
        data = (folder / name).read_bytes()
    except OSError:
        return None
    body = data[:-_DIGEST_BYTES]
    return body if _digest(name, body) == data[-_DIGEST_BYTES:] else None


def keep(name: str, body: bytes) -> None:
    """Keep something for later processes if the disk lets us: a full or vanished one must not stop a run."""
    folder = cache_folder()
    if folder is None:
        return
    temporary = folder / f".{name}.{os.getpid()}-{threading.get_ident()}"
    try:
        temporary.write_bytes(body + _digest(name, body))
        temporary.replace(folder / name)
    except OSError:
        temporary.unlink(missing_ok=True)


def _digest(name: str, body: bytes) -> bytes:
    return hashlib.sha256(name.encode() + b"\0" + body).digest()
