"""Compiled code on disk: private to the user, and never older than the package's sources.

Numba's own cache looks at one source file only and trusts whatever lies on the disk. Here the folder is named by a
digest of all sources of the engine, the versions and the switches that shape the code; entries carry a digest of their
own, and one that cannot be read is deleted and compiled again.
"""

import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import llvmlite
import numba
import numpy as np
from numba import njit
from numba.core import config
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, _CacheLocator

_Function = TypeVar("_Function", bound=Callable[..., object])
_DIGEST_BYTES: Final = 32


def entry(function: _Function) -> _Function:
    """Compile a function that Python calls, and keep its code on disk."""
    dispatcher = njit(nogil=True, error_model="numpy", _nrt=False, forceinline=False)(function)
    folder = cache_folder()
    if folder is not None and not config.DISABLE_JIT:
        dispatcher._cache = CodeCache(function)
    return cast(_Function, dispatcher)


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
    sources = [*sorted((package / "engine").glob("*.py")), package / "program.py", package / "draws.py"]
    digest = hashlib.sha256()
    for source in sources:
        digest.update(source.name.encode())
        digest.update(hashlib.sha256(source.read_bytes()).digest())
    for word in (
        numba.__version__,
        llvmlite.__version__,
        np.__version__,
        sys.version,
        config.CPU_NAME,
        config.CPU_FEATURES,
        config.OPT,
        config.BOUNDSCHECK,
        config.DEBUGINFO_DEFAULT,
        package,
    ):
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


class _Locator(_CacheLocator):  # type: ignore[misc]
    """Places all entries in the folder above, whatever file a function comes from."""

    def __init__(self, function: Callable[..., object]) -> None:
        folder = cache_folder()
        assert folder is not None, "internal: no cache folder"
        self._folder = folder

    def get_cache_path(self) -> str:
        return str(self._folder)

    def get_source_stamp(self) -> str:
        return fingerprint()

    def get_disambiguator(self) -> str:
        return fingerprint()

    @classmethod
    def from_function(cls, function: Callable[..., object], file: str) -> "_Locator":
        return cls(function)


class _Implementation(CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Locator,)


def _digest(name: str, body: bytes) -> bytes:
    return hashlib.sha256(name.encode() + b"\0" + body).digest()


class _Files(IndexDataCacheFile):  # type: ignore[misc]
    """Data files that end with a digest of name and content: a damaged one, or another's, is never loaded."""

    def _load_data(self, name: str) -> Any:
        if not name.startswith(self._index_name.removesuffix("nbi")):
            raise ValueError(f"the index of another function, which names {name}")
        data = Path(self._data_path(name)).read_bytes()
        if _digest(name, data[:-_DIGEST_BYTES]) != data[-_DIGEST_BYTES:]:
            raise EOFError(f"damaged cache entry {name}")
        return super()._load_data(name)  # the format ends itself: what follows is not looked at

    def _save_data(self, name: str, data: Any) -> None:
        body = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(body + _digest(name, body))


class CodeCache(FunctionCache):  # type: ignore[misc]
    """A cache that answers "not there" instead of failing."""

    _impl_class = _Implementation

    def __init__(self, function: Callable[..., object]) -> None:
        super().__init__(function)
        self._cache_file = _Files(
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=self._impl.locator.get_source_stamp(),
        )

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The code compiled for a signature, None if there is none or it cannot be read."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # whatever a damaged file makes of unpickling: the code is simply compiled anew
            self._remove_entries()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the code compiled for a signature, if the disk lets us."""
        try:
            super().save_overload(sig, data)
        except OSError:  # a full or vanished disk must not stop a run
            self._remove_entries()

    def _remove_entries(self) -> None:
        for path in Path(self._cache_path).glob("*.nb[ic]"):
            path.unlink(missing_ok=True)
