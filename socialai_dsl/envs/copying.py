"""Copies of environments: `copy`, `pickle` and other processes copy them whole, at the moment at which they are."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, Self, SupportsIndex, TypeVar

_T = TypeVar("_T")


class Copied:
    """What `copy.copy` copies whole, as `copy.deepcopy` does, and what only the same version of the library unpickles.

    A copy shares no memory with its original. A subclass whose attributes look into memory leaves these out of
    `__getstate__` and finds them anew in `__setstate__`.
    """

    def __copy__(self) -> Self:
        return deepcopy(self)

    def __reduce_ex__(self, protocol: SupportsIndex) -> tuple[Callable[..., Any], tuple[Any, ...], Any]:
        # What is called first is checked first, before anything else of the pickle is read.
        return _empty, (_version(), type(self)), self.__getstate__()


@cache
def _version() -> str:
    """A digest of the library's sources: by the same ones attributes and numbers in memory mean the same."""
    package = Path(__file__).parents[1]
    digest = sha256()
    for source in sorted(package.rglob("*.py")):
        digest.update(source.relative_to(package).as_posix().encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()[:12]


def _empty(version: str, kind: type[_T]) -> _T:
    """An object that is yet to get its attributes.

    Raises:
        ValueError: another version of the library wrote the pickle.
    """
    if version != _version():
        raise ValueError(
            f"got a pickle of a {kind.__name__} by another version of socialai-dsl (sources {version}); "
            f"expected one by this version (sources {_version()})"
        )
    return kind.__new__(kind)
