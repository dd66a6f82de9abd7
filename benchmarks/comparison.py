"""Measures what `make bench` compares our environments with."""

from collections.abc import Callable, Sequence
from typing import Any, Final

from benchmarks.mixes import Allowed, random_actions, walk_actions
from benchmarks.peers import Limit, Peer
from benchmarks.report import Report, Row
from benchmarks.timing import speed_of

_SCENARIO: Final = "talkitout"  # what the hard-coded versions play


def measure_peer(
    report: Report, peer: Peer, batches: Sequence[int], repetitions: int, seconds: float
) -> None:
    """Add a peer's rows to a report, or why there are none."""
    version = peer.version()
    if version is None:
        report.missing[peer.name] = "not installed"
        return
    report.versions[peer.package] = version
    try:
        for batch in batches if peer.batched else (0,):
            speed = speed_of(peer.start(batch), max(batch, 1), repetitions, seconds, peer.block)
            what = f"{peer.name}: {peer.workload}" + (
                "" if peer.block == 1 else f", {peer.block} steps a call"
            )
            report.rows.append(Row(what, "peer", "random", batch, speed, None))
    except Exception as error:  # whatever another project's code does on this machine is not ours to stop at
        report.missing[peer.name] = f"{type(error).__name__}: {error}"


def measure_limit(
    report: Report,
    limit: Limit,
    mixes: Sequence[str],
    batches: Sequence[int],
    repetitions: int,
    seconds: float,
) -> None:
    """Add the rows of a hard-coded version to a report, or why there are none."""
    missing = limit.missing()
    if missing:
        report.missing[limit.name] = missing
        return
    for mix in mixes:
        allowed = Allowed(_SCENARIO) if mix == "walk" else None
        for batch in batches:
            envs = limit.make(batch)
            actions = list(walk_actions(envs.num_envs, allowed, 1) if allowed else random_actions(envs, 1))
            envs.reset(seed=1)
            speed = speed_of(_playing(envs, actions), batch, repetitions, seconds)
            report.rows.append(Row(f"limit: {limit.what}", "limit", mix, batch, speed, None))


def _playing(envs: Any, actions: Any) -> Callable[[int], None]:
    def run(steps: int) -> None:
        step = envs.step
        for i in range(steps):
            step(actions[i % len(actions)])

    return run
