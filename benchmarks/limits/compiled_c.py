"""Compiles the C version of TalkItOut with the system's compiler and calls it."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from benchmarks.limits.workload import HardCoded, Rooms

_SOURCE: Final = Path(__file__).with_name("talkitout.c")
_COMPILERS: Final = ("cc", "gcc", "clang")
_ALIGNMENT: Final = 64


def has_compiler() -> bool:
    """Whether there is a C compiler."""
    return _compiler() is not None


@cache
def has_permutes() -> bool:
    """Whether the compiler makes byte permutes of 64 bytes for this machine (AVX-512 VBMI)."""
    command = [_compiler() or "cc", "-march=native", "-dM", "-E", "-x", "c", "-"]
    found = subprocess.run(command, input="", capture_output=True, text=True, check=False)
    return "__AVX512VBMI__" in found.stdout


class CompiledC(HardCoded):
    """The C version.

    Args:
        num_envs: E.
        portable: use a gather of 49 cells even where the machine has byte permutes.

    Raises:
        OSError: there is no C compiler, or it fails.
    """

    def __init__(self, num_envs: int, portable: bool = False) -> None:
        super().__init__(num_envs)
        self._code = _compiled(portable)
        self.state_bytes = self._code.env_bytes()
        memory = np.zeros(num_envs * self.state_bytes + _ALIGNMENT, np.uint8)
        first = -memory.ctypes.data % _ALIGNMENT
        self._envs = memory[first:]
        outputs = (self.image, self.tokens, self.reward, self.terminated, self.truncated)
        self._head = ctypes.c_int64(num_envs), _address(self._envs)
        self._outputs = tuple(_address(array) for array in outputs)

    def _start(self, seed: int) -> None:
        self._code.start(*self._head, ctypes.c_uint64(seed), *self._outputs[:2])

    def _enter(self, rooms: Rooms) -> None:
        self._code.enter_rooms(*self._head, _address(rooms), *self._outputs[:2])

    def _step(self, actions: NDArray[np.int64]) -> None:
        self._code.step(*self._head, _address(actions), *self._outputs)


def _address(array: NDArray[np.generic]) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def _compiler() -> str | None:
    return next((path for name in _COMPILERS if (path := shutil.which(name))), None)


@cache
def _compiled(portable: bool) -> ctypes.CDLL:
    compiler = _compiler()
    if compiler is None:
        raise OSError(f"no C compiler: expected one of {', '.join(_COMPILERS)}")
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "talkitout.so"
        flags = ["-O3", "-march=native", "-shared", "-fPIC", *(["-DPORTABLE"] if portable else [])]
        command = [compiler, *flags, str(_SOURCE), "-o", str(library)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise OSError(f"{' '.join(command)}: {done.stderr}")
        code = ctypes.CDLL(str(library))  # stays in memory when the file goes
    code.env_bytes.restype = code.step.restype = ctypes.c_int64
    return code
