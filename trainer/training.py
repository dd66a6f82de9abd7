"""The training loop, for whatever algorithm: play, learn, record, save."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from socialai_dsl.trainer.algorithm import Algorithm
from socialai_dsl.trainer.checkpoint import Checkpoint
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.errors import CheckpointError, require_finite
from socialai_dsl.trainer.extensions import load_class
from socialai_dsl.trainer.files import CHECKPOINTS, checkpoint_files
from socialai_dsl.trainer.logging import Metrics, MetricsLog, Tally, Tracker
from socialai_dsl.trainer.ppo import Ppo
from socialai_dsl.trainer.session import Session, explained_stops, threads_of

SHIPPED: Mapping[str, type[Algorithm]] = {"ppo": Ppo}
"""The algorithms that need no module."""


def algorithm_class(name: str, folder: Path = Path()) -> type[Algorithm]:
    """Find an algorithm: a shipped one, or `mine:Algorithm` of the user's, looked for in `folder` first.

    Raises:
        ValueError: there is no such algorithm, or it lacks a method.
    """
    if name in SHIPPED:
        return SHIPPED[name]
    found: type[Algorithm] = load_class(name, "algorithm", tuple(SHIPPED), Algorithm, folder)
    return found


def restore_algorithm(
    checkpoint: Checkpoint, algorithm: str | None = None, folder: Path = Path()
) -> type[Algorithm]:
    """Find the algorithm of a checkpoint, whose policy plays its network.

    Args:
        checkpoint: result of `checkpoint.read`.
        algorithm: its name, needed if it is not a shipped one, because a file must not choose what is imported.
        folder: where the file of such an algorithm is looked for first.

    Raises:
        CheckpointError: it is not named.
        ValueError: see `algorithm_class`.
    """
    name = checkpoint.meta.config.algorithm
    if ":" in name and algorithm != name:
        raise CheckpointError(
            f"checkpoint was made with the algorithm {name}; name it (--algorithm {name}) to load that code"
        )
    return algorithm_class(name, folder)


def begin(config: RunConfig, envs: Any, program: Any = None) -> Session:
    """Begin a run, as `Session.start` does, with its algorithm. Raises ValueError, also if that is not there."""
    found: Any = algorithm_class(config.algorithm, config.code_folder)
    session = Session.start(config, envs, program)
    session.algorithm = found(session)
    return session


def train(
    config: RunConfig,
    envs: Any,
    run_dir: Path | str,
    progress: Callable[[Mapping[str, Any]], None] = lambda row: None,
    resume: bool = False,
    tracker: Tracker | None = None,
    program: Any = None,
    stop: Callable[[], bool] = lambda: False,
) -> Path:
    """Train a network and return the path of its final checkpoint.

    Writes `starts.jsonl`, `metrics.jsonl`, TensorBoard events and `checkpoints/` into `run_dir`. A resumed run
    continues from the newest intact checkpoint as if it had never stopped: the same weights to the bit on the same
    CPU with the same number of threads.

    Args:
        config: every option of the run.
        envs: what `socialai_dsl.make_vec(..., autoreset_mode="SameStep")` returns, not yet reset.
        run_dir: directory of the run, made if missing; only a resumed one holds a run already.
        progress: called after every update with its row, as in `metrics.jsonl`.
        resume: continue the run in `run_dir`.
        tracker: sends the figures elsewhere as well.
        program: of the scenario that the agent is for, where a guide plays a variant of it; by default that of `envs`.
        stop: asked before every update; where it is true, training ends early, and a resumed run goes on from there.

    Raises:
        ValueError: configuration and environments do not fit, something of the user's returned what it must not, the
            directory holds another run, or the tracker cannot begin.
        CheckpointError: there is nothing to resume, or it is damaged or of another run.
        TrainingStopped: something is not finite or out of bounds, or the disk is full; the last good checkpoint is
            intact.
    """
    run_dir = Path(run_dir)
    session = begin(config, envs, program)
    algorithm = session.algorithm
    assert algorithm is not None, "internal: a session that has begun has an algorithm"
    if not resume and checkpoint_files(run_dir / CHECKPOINTS):
        raise ValueError(f"run_dir: {run_dir} holds a run already; resume it, or choose another folder")
    if resume:
        session.resume(run_dir)
    with (
        explained_stops(session, run_dir),
        MetricsLog(run_dir, config, session.update, tracker) as log,
        threads_of(session) as session.mapper,
    ):
        if not resume:
            session.save(run_dir)
        metrics = Metrics(session)
        while session.update < config.updates and not stop():
            session.begin_update()
            played = algorithm.collect()
            tally = _tally(played)
            figures = _figures(algorithm.update(played))
            session.update += 1
            row = metrics.row(tally, figures)
            log.write(row)
            if session.update % config.checkpoint_every == 0 and session.update < config.updates:
                log.sync()
                session.save(run_dir)
            progress(row)
        return session.save(run_dir)


def _tally(played: Any) -> Tally:
    tally = getattr(played, "tally", None)
    if not isinstance(tally, Tally):
        raise ValueError(
            f"algorithm: collect returned {type(played).__name__}, expected an object whose `tally` is a "
            "socialai_dsl.trainer.logging.Tally"
        )
    return tally


def _figures(found: Any) -> dict[str, float | None]:
    """What an algorithm's update returned. Raises ValueError for what is no numbers, TrainingStopped if not finite."""
    if not isinstance(found, Mapping) or not all(isinstance(name, str) for name in found):
        raise ValueError(f"algorithm: update returned {type(found).__name__}, expected numbers by name")
    for name, figure in found.items():
        if not isinstance(figure, int | float | None):
            raise ValueError(
                f"algorithm: {name} of update: got {type(figure).__name__}, expected a number or None"
            )
        if figure is not None:
            require_finite(f"{name} of the update", figure)
    return dict(found)
