"""This module is the training loop: collect, update, record, save; exact to resume and safe to kill at any moment."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trainer import checkpoint as checkpoints
from trainer.config import TrainConfig
from trainer.crew import Crew
from trainer.errors import CheckpointError, ObservationError, TrainingStopped
from trainer.metrics import MetricsLog, Tracker, episode_metrics
from trainer.ppo import update
from trainer.ppo_chunks import update_chunks
from trainer.rollout import collect
from trainer.session import Session

CHECKPOINTS = "checkpoints"


@dataclass(frozen=True)
class Progress:
    """How far a run has come, reported after every update.

    Attributes:
        frames, total_frames: environment steps made and to be made.
        frames_per_second: of the last update, collection and learning together.
        success_rate: of the episodes that ended in the last update; None if none did.
        remaining_seconds: estimate from this call's speed so far.
        update: updates made.
    """

    frames: int
    total_frames: int
    frames_per_second: float
    success_rate: float | None
    remaining_seconds: float
    update: int


def train(
    config: TrainConfig,
    envs: Any,
    run_dir: Path,
    progress: Callable[[Progress], None] | None = None,
    resume: bool = False,
    tracker: Tracker | None = None,
) -> Path:
    """Train a network and return the path of its final checkpoint.

    Writes `metrics.jsonl`, TensorBoard events and `checkpoints/` into `run_dir`. A resumed run continues from the
    newest intact checkpoint as if it had never stopped: the same weights to the bit on the same CPU with the same
    number of threads.

    Args:
        config: hyper-parameters.
        envs: vector environment with same-step auto-reset, as `socialai_dsl.make_vec` gives; fresh, not yet reset.
        run_dir: directory of the run, made if missing.
        progress: called after every update.
        resume: continue the run in `run_dir`.
        tracker: takes the figures elsewhere as well.

    Raises:
        ValueError: configuration and environments do not fit, or the tracker cannot begin.
        CheckpointError: there is nothing to resume, or it is damaged or of another run.
        TrainingStopped: something is not finite or out of bounds, or the disk is full; the last good checkpoint
            is intact.
    """
    session = Session.start(config, envs)
    folder = run_dir / CHECKPOINTS
    if resume:
        if not folder.is_dir():
            raise CheckpointError(f"{run_dir}: nothing to resume, there are no checkpoints")
        session.load(checkpoints.read(folder))
    with _explained(session, folder):
        run_dir.mkdir(parents=True, exist_ok=True)
        log = MetricsLog(run_dir, session.update, config.tensorboard, session.frames, tracker)
        if not resume:
            checkpoints.write(folder, session.checkpoint())
    divisible = session.actor.net.distinct and session.actor.device.type == "cpu"
    with contextlib.closing(log), Crew(config.threads, divisible) as crew:
        _loop(session, folder, log, crew, progress)
    with _explained(session, folder):
        return checkpoints.write(folder, session.checkpoint())


def _loop(
    session: Session,
    folder: Path,
    log: MetricsLog,
    crew: Crew,
    progress: Callable[[Progress], None] | None,
) -> None:
    config, envs, began, first = session.config, session.envs, time.perf_counter(), session.update
    learn = update_chunks if config.update == "chunks" else update
    session.actor.net.train()
    counted, then = envs.counters(), began
    while session.update < config.updates:
        with _explained(session, folder):
            rollout = collect(
                session.actor,
                envs,
                session.state,
                config,
                session.generator,
                session.bonus,
                session.tutor,
            )
            losses = learn(session.actor, session.optimizer, rollout, config, session.generator, crew)
            session.update += 1
            before, counted = counted, envs.counters()
            before_time, then = then, time.perf_counter()
            speed = config.frames_per_update / (then - before_time)
            row = {"frames": session.frames, "frames_per_second": round(speed, 1), **losses}
            row |= {"bonus": rollout.bonus, **episode_metrics(rollout.tally, before, counted)}
            log.write(session.update, row)
            if session.update % config.checkpoint_every == 0 and session.update < config.updates:
                log.sync()
                checkpoints.write(folder, session.checkpoint())
        if progress is not None:
            left = (config.updates - session.update) * (then - began) / (session.update - first)
            success = rollout.tally.successes / rollout.tally.episodes if rollout.tally.episodes else None
            total = config.updates * config.frames_per_update
            progress(Progress(session.frames, total, speed, success, left, session.update))


@contextlib.contextmanager
def _explained(session: Session, folder: Path) -> Iterator[None]:
    """Say where a run stopped, why, and what is left of it."""
    try:
        yield
    except (TrainingStopped, ObservationError, OSError) as error:
        saved = sorted(folder.glob("*.safetensors"))
        kept = f"the last good checkpoint is {saved[-1]}" if saved else "there is no checkpoint yet"
        reason = f"cannot write: {error}" if isinstance(error, OSError) else str(error)
        where = f"training stopped after {session.frames} frames (update {session.update})"
        raise TrainingStopped(f"{where}: {reason}; {kept}") from error
