"""This module lets several processes train one agent: each plays some of its environments, all take equal steps."""

from __future__ import annotations

import contextlib
import hashlib
import os
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import timedelta
from types import FrameType
from typing import Any, NoReturn

import torch
from torch import Tensor

from trainer.errors import TrainingStopped

_PATIENCE = timedelta(minutes=10)


@dataclass(frozen=True)
class Team:
    """The processes that train one agent together. Process r holds the r-th of `size` equal shares of environments.

    What every process must know in full is put together here, always in the order of the processes, so that all of
    them compute the same. Alone, every method gives back what it was given. All processes must make the same calls.

    Attributes:
        rank: number of this process, from 0 on; process 0 alone writes files.
        size: processes. here: processes on this machine.
    """

    rank: int = 0
    size: int = 1
    here: int = 1

    @property
    def writes(self) -> bool:
        """Whether this process is the one that writes files and talks to the user."""
        return self.rank == 0

    def share(self, num_envs: int) -> int:
        """How many of a run's environments each process holds.

        Raises:
            ValueError: they cannot be shared evenly.
        """
        if num_envs % self.size:
            raise ValueError(
                f"num_envs: got {num_envs}, expected a multiple of the {self.size} processes that share them"
            )
        return num_envs // self.size

    def mine(self, whole: Tensor, dim: int) -> Tensor:
        """This process's share of a tensor whose dimension `dim` counts the run's environments."""
        count = self.share(whole.shape[dim])
        return whole.narrow(dim, self.rank * count, count)

    def own(self, envs: Tensor, num_envs: int) -> Tensor:
        """Those of the environments `envs`, int64 (B,), that this process holds, numbered from its first one on."""
        count = self.share(num_envs)
        local = envs - self.rank * count
        return local[(local >= 0) & (local < count)]

    def sum(self, values: Tensor) -> Tensor:
        """The sum over the processes.

        Raises:
            TrainingStopped: another process is gone.
        """
        if self.size == 1:
            return values
        import torch.distributed as distributed

        total = values.clone()
        with _reached():
            distributed.all_reduce(total)
        return total

    def gather(self, values: Tensor, dim: int = 0) -> Tensor:
        """The tensors of all processes, which must be of one shape, side by side.

        Raises:
            TrainingStopped: another process is gone.
        """
        if self.size == 1:
            return values
        import torch.distributed as distributed

        parts = [torch.empty_like(values, memory_format=torch.contiguous_format) for _ in range(self.size)]
        with _reached():
            distributed.all_gather(parts, values.contiguous())
        return torch.cat(parts, dim)

    def gather_bytes(self, data: bytes) -> list[bytes]:
        """The bytes of every process on process 0, in order; nothing on the others.

        Raises:
            TrainingStopped: another process is gone.
        """
        if self.size == 1:
            return [data]
        import torch.distributed as distributed

        lengths = self.gather(torch.tensor([len(data)])).tolist()
        padded = torch.zeros(max(lengths), dtype=torch.uint8)
        padded[: len(data)] = torch.frombuffer(bytearray(data), dtype=torch.uint8)
        received = [torch.empty_like(padded) for _ in range(self.size)] if self.writes else None
        with _reached():
            distributed.gather(padded, received, dst=0)
        return [
            part[:length].numpy().tobytes() for part, length in zip(received or [], lengths, strict=False)
        ]

    def tell(self, text: str) -> str:
        """What process 0 says, in all of them.

        Raises:
            TrainingStopped: another process is gone.
        """
        if self.size == 1:
            return text
        import torch.distributed as distributed

        said = torch.frombuffer(bytearray(text.encode() or b"\0"), dtype=torch.uint8)
        length = torch.tensor([len(said)])
        with _reached():
            distributed.broadcast(length, src=0)
            heard = said if self.writes else torch.zeros(int(length), dtype=torch.uint8)
            distributed.broadcast(heard, src=0)
        return heard.numpy().tobytes().decode()

    def agree(self, what: str, data: bytes) -> None:
        """Make sure that all processes have the same `data`.

        Raises:
            TrainingStopped: they differ, or another process is gone.
        """
        if self.size == 1:
            return
        digest = torch.frombuffer(bytearray(hashlib.sha256(data).digest()), dtype=torch.uint8)
        digests = self.gather(digest[None])
        if not bool((digests == digest).all()):
            raise TrainingStopped(f"the {what} not the same in all {self.size} processes")


ALONE = Team()


def started_together() -> tuple[int, int]:
    """How many processes this one was started with, in all and on this machine: 1 and 1 unless torchrun did it."""
    return int(os.environ.get("WORLD_SIZE", "1")), int(os.environ.get("LOCAL_WORLD_SIZE", "1"))


@contextlib.contextmanager
def joined(device: str) -> Iterator[Team]:
    """Meet the other processes that torchrun started, if it did; they talk by gloo on CPUs and by nccl on CUDA.

    On CUDA, the process takes the device of its number on this machine. While the team lasts, a signal to terminate,
    which torchrun sends when another process has ended, stops the training with a message.
    """
    size, here = started_together()
    if size == 1:
        yield ALONE
        return
    import torch.distributed as distributed

    rank, local = int(os.environ["RANK"]), int(os.environ["LOCAL_RANK"])
    if device.startswith("cuda"):
        torch.cuda.set_device(local)
    before = signal.signal(signal.SIGTERM, _terminated)
    try:
        with _reached():
            backend = "cpu:gloo,cuda:nccl" if device.startswith("cuda") else "gloo"
            distributed.init_process_group(backend, timeout=_PATIENCE)
        yield Team(rank, size, here)
    finally:
        signal.signal(signal.SIGTERM, before)
        if distributed.is_initialized():
            distributed.destroy_process_group()


def _terminated(number: int, frame: FrameType | None) -> NoReturn:
    raise TrainingStopped("this process was told to end, as happens when another one of the run has ended")


@contextlib.contextmanager
def _reached() -> Iterator[Any]:
    """Say in words that another process cannot be reached."""
    try:
        yield
    except TrainingStopped:
        raise
    except RuntimeError as error:
        raise TrainingStopped("another process of this run has ended or cannot be reached") from error
