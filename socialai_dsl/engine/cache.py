"""The folder of Numba's compiled code: private to the user, and named by the package's sources.

The folder is named by a digest of all sources that the code is made from, and of Numba's settings. Numba itself tells
processors and versions of its own apart.
"""

import hashlib
import os
import stat
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Final

import numba
import numpy as np

_SETTINGS: Final = (
    "OPT",
    "BOUNDSCHECK",
    "DEBUGINFO_DEFAULT",
    "LOOP_VECTORIZE",
    "SLP_VECTORIZE",
    "ENABLE_AVX",
)
"""Numba's settings that shape code and that its own cache does not ask for."""


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
        *(package / "engine").glob("*.py"),
        *(package / "program").glob("*.py"),
        package / "draws.py",
        package / "vocabulary.py",
        package / "widths.py",
    ]
    digest = hashlib.sha256()
    for source in sorted(sources):
        digest.update(source.name.encode())
        digest.update(hashlib.sha256(source.read_bytes()).digest())
    settings = [str(getattr(numba.config, name, None)) for name in _SETTINGS]
    for word in (numba.__version__, np.__version__, sys.version, *settings):
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
