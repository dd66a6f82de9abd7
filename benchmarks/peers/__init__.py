"""The engines that `socialai bench` runs beside ours: other projects', and hand-written ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from typing import Any

from benchmarks.limits import CompiledC, CompiledNumba, has_compiler, has_permutes
from benchmarks.peers import batched, scans, single

__all__ = ["LIMITS", "PEERS", "Limit", "Peer", "Run"]

Run = Callable[[int], None]
"""Plays a number of steps of the whole batch."""


@dataclass(frozen=True)
class Peer:
    """An engine of another project under uniformly random actions.

    Attributes:
        name: as `--only` takes it.
        package, module: where it is from, and what is imported.
        workload: what is played, in its own words.
        batched: whether it steps many environments together.
        start: called with a number of environments; not more than one if it is not batched.
        block: steps of a call from Python; more than one is a rollout in one compiled loop.
    """

    name: str
    package: str
    module: str
    workload: str
    batched: bool
    start: Callable[[int], Run]
    block: int = 1

    def version(self) -> str | None:
        """Which release is installed; None if there is none."""
        if find_spec(self.module) is None:
            return None
        try:
            return version(self.package)
        except PackageNotFoundError:
            return "unknown"


@dataclass(frozen=True)
class Limit:
    """TalkItOut written by hand.

    Attributes:
        name: as `--only` takes it.
        what: in a few words.
        make: called with a number of environments.
        missing: why it cannot be made here; empty if it can.
    """

    name: str
    what: str
    make: Callable[[int], Any]
    missing: Callable[[], str]


def _no_compiler() -> str:
    return "" if has_compiler() else "there is no C compiler"


def _no_permutes() -> str:
    return _no_compiler() or ("" if has_permutes() else "no byte permutes (AVX-512 VBMI)")


PEERS: tuple[Peer, ...] = (
    Peer("minigrid", "minigrid", "minigrid", "Empty-8x8", False, single.minigrid("Empty-8x8")),
    Peer(
        "minigrid-gotodoor",
        "minigrid",
        "minigrid",
        "GoToDoor-8x8",
        False,
        single.minigrid("GoToDoor-8x8"),
    ),
    Peer("griddly", "griddly", "griddly", "Doggo", False, single.griddly),
    Peer("envpool", "envpool", "envpool", "Empty-8x8", True, batched.envpool("Empty-8x8")),
    Peer("envpool-gotodoor", "envpool", "envpool", "GoToDoor-8x8", True, batched.envpool("GoToDoor-8x8")),
    Peer("navix", "navix", "navix", "Empty-8x8", True, scans.navix("Empty-8x8"), scans.STEPS),
    Peer("navix-doorkey", "navix", "navix", "DoorKey-8x8", True, scans.navix("DoorKey-8x8"), scans.STEPS),
    Peer(
        "xland", "xminigrid", "xminigrid", "Empty-8x8", True, scans.xland("MiniGrid-Empty-8x8"), scans.STEPS
    ),
    Peer(
        "xland-r1",
        "xminigrid",
        "xminigrid",
        "R1-9x9",
        True,
        scans.xland("XLand-MiniGrid-R1-9x9"),
        scans.STEPS,
    ),
)

LIMITS: tuple[Limit, ...] = (
    Limit("c", "C, byte permutes", CompiledC, _no_permutes),
    Limit("c-portable", "C, portable", lambda count: CompiledC(count, portable=True), _no_compiler),
    Limit("numba", "Numba", CompiledNumba, lambda: ""),
)
