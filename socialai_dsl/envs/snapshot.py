"""The exact state of a batch as bytes: a JSON header, raw arrays, a digest. No pickle."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MAGIC = b"socialai-snapshot-1\n"
_DIGEST = 32
_LONGEST_HEADER = 1 << 20


def pack(arrays: Mapping[str, NDArray[Any]], identity: Mapping[str, Any]) -> bytes:
    """The arrays and what they belong to, as bytes."""
    layout = {name: [array.dtype.str, list(array.shape)] for name, array in arrays.items()}
    header = json.dumps({"identity": dict(identity), "arrays": layout}, sort_keys=True).encode()
    body = b"".join(
        [_MAGIC, len(header).to_bytes(4, "little"), header, *(array.tobytes() for array in arrays.values())]
    )
    return body + hashlib.sha256(body).digest()


def unpack(data: bytes, arrays: Mapping[str, NDArray[Any]], identity: Mapping[str, Any]) -> None:
    """Write a snapshot back into the arrays it was taken of.

    Raises:
        ValueError: the bytes are no snapshot, are damaged, or belong to other environments.
    """
    if not isinstance(data, bytes) or not data.startswith(_MAGIC) or len(data) < len(_MAGIC) + 4 + _DIGEST:
        raise ValueError("got bytes that are no snapshot of environments")
    body, digest = data[:-_DIGEST], data[-_DIGEST:]
    if hashlib.sha256(body).digest() != digest:
        raise ValueError("the snapshot is damaged: its digest does not fit")
    at = len(_MAGIC)
    size = int.from_bytes(body[at : at + 4], "little")
    header = json.loads(body[at + 4 : at + 4 + min(size, _LONGEST_HEADER)])
    expected = {name: [array.dtype.str, list(array.shape)] for name, array in arrays.items()}
    if header["identity"] != dict(identity) or header["arrays"] != expected:
        raise ValueError(
            f"the snapshot is of other environments: got {header['identity']}, expected {dict(identity)}"
        )
    at += 4 + size
    for array in arrays.values():
        array[...] = np.frombuffer(body, array.dtype, array.size, at).reshape(array.shape)
        at += array.nbytes
