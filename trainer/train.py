"""This module is the training loop: collect, update, record, save; exact to resume and safe to kill at any moment."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from trainer import checkpoint as checkpoints
from trainer import starts
from trainer.config import TrainConfig
from trainer.crew import Crew, automatic_threads
from trainer.errors import CheckpointError, ObservationError, TrainingStopped
from trainer.metrics import MetricsLog, Tracker, add_up, episode_metrics
from trainer.ppo import update
from trainer.ppo_chunks import update_chunks
from trainer.rollout import EpisodeTally, Rollout
from trainer.session import Session
from trainer.team import ALONE, Team


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
    team: Team = ALONE,
    tracker: Tracker | None = None,
) -> Path:
    """Train a network and return the path of its final checkpoint.

    Writes `starts.jsonl`, `metrics.jsonl`, TensorBoard events and `checkpoints/` into `run_dir`. A resumed run
    continues from the newest intact checkpoint as if it had never stopped: the same weights to the bit on the same
    CPU with the same number of threads and processes.

    Args:
        config: hyper-parameters.
        envs: vector environment with same-step auto-reset, as `socialai_dsl.make_vec` gives; fresh, not yet reset.
            Each process of a team brings `team.share(config.num_envs)` environments.
        run_dir: directory of the run, made if missing.
        progress: called after every update.
        resume: continue the run in `run_dir`.
        team: the processes that train together; all must be given the same configuration and directory, and only
            one of them writes there.
        tracker: takes the figures elsewhere as well.

    Raises:
        ValueError: configuration and environments do not fit, or the tracker cannot begin.
        CheckpointError: there is nothing to resume, or it is damaged or of another run.
        TrainingStopped: something is not finite or out of bounds, the disk is full, or another process of the team
            is gone; the last good checkpoint is intact.
    """
    session = Session.start(config, envs, team)
    folder = run_dir / checkpoints.FOLDER
    if resume:
        if not folder.is_dir():
            raise CheckpointError(f"{run_dir}: nothing to resume, there are no checkpoints")
        session.load(checkpoints.read(folder))
    threads = config.threads or automatic_threads(team.here)
    divisible = session.actor.net.distinct and session.actor.device.type == "cpu"
    with _explained(session, folder), contextlib.ExitStack() as stack:
        team.agree("settings, scenario and checkpoint are", _identity(session))
        log = None
        if team.writes:
            run_dir.mkdir(parents=True, exist_ok=True)
            log = MetricsLog(run_dir, session.update, config.tensorboard, session.frames, tracker)
            stack.enter_context(log)
        if not resume:
            _save(session, folder)
        if team.writes:
            around = starts.surroundings(config.device, threads, team.size)
            starts.record(run_dir, session.update, session.frames, around)
        crew = stack.enter_context(Crew(threads, divisible))
        _loop(session, folder, log, crew, progress)
        return _save(session, folder)


def _identity(session: Session) -> bytes:
    """What all processes of a team must begin with."""
    parts = (session.config.model_dump_json(), session.envs.program.sha256, str(session.update))
    return "\n".join(parts).encode()


def _save(session: Session, folder: Path) -> Path:
    """Write a checkpoint and return its path; every process of a team takes part."""
    checkpoint = session.checkpoint()
    if session.team.writes:
        checkpoints.write(folder, checkpoint)
    return checkpoints.path_of(folder, checkpoint.meta)


def _loop(
    session: Session,
    folder: Path,
    log: MetricsLog | None,
    crew: Crew,
    progress: Callable[[Progress], None] | None,
) -> None:
    config, envs, team = session.config, session.envs, session.team
    began, first = time.perf_counter(), session.update
    session.actor.net.train()
    _, _, counted = add_up(team, EpisodeTally(), 0.0, envs.counters())
    then = began
    while session.update < config.updates:
        rollout = session.play(crew)
        losses = _learn(session, rollout, crew)
        _check(session, losses)
        session.update += 1
        before = counted
        tally, bonus, counted = add_up(team, rollout.tally, rollout.bonus, envs.counters())
        before_time, then = then, time.perf_counter()
        speed = config.frames_per_update / (then - before_time)
        if log is not None:
            row = {"frames": session.frames, "frames_per_second": round(speed, 1), **losses}
            row |= {"bonus": bonus, **episode_metrics(tally, before, counted)}
            log.write(session.update, row)
        if session.update % config.checkpoint_every == 0 and session.update < config.updates:
            if log is not None:
                log.sync()
            _save(session, folder)
        if progress is not None:
            left = (config.updates - session.update) * (then - began) / (session.update - first)
            success = tally.successes / tally.episodes if tally.episodes else None
            total = config.updates * config.frames_per_update
            progress(Progress(session.frames, total, speed, success, left, session.update))


def _learn(session: Session, rollout: Rollout, crew: Crew) -> dict[str, float]:
    """Improve the network as the configuration says; see `ppo.update`."""
    everything = (session.actor, session.optimizer, rollout, session.config, session.generator, crew)
    if session.config.update == "chunks":
        return update_chunks(*everything)
    return update(*everything, session.team)


def _check(session: Session, losses: Mapping[str, float]) -> None:
    """Refuse figures of the update, weights, and statistics of the network that no checkpoint may hold."""
    for name, figure in losses.items():
        if not math.isfinite(figure):
            raise TrainingStopped(f"{name} of the update is not a finite number")
    numbers = {
        name: value for name, value in session.actor.net.state_dict().items() if value.is_floating_point()
    }
    finite = torch.stack([torch.isfinite(value).all() for value in numbers.values()]).tolist()
    for name, is_finite in zip(numbers, finite, strict=True):
        if not is_finite:
            raise TrainingStopped(f"the network's {name} holds numbers that are not finite")


@contextlib.contextmanager
def _explained(session: Session, folder: Path) -> Iterator[None]:
    """Say where a run stopped, why, and what is left of it."""
    try:
        yield
    except BrokenPipeError:  # of the terminal that progress is shown on, not of a file
        raise
    except (TrainingStopped, ObservationError, OSError) as error:
        saved = sorted(folder.glob("*.safetensors"))
        kept = f"the last good checkpoint is {saved[-1]}" if saved else "there is no checkpoint yet"
        reason = f"cannot write: {error}" if isinstance(error, OSError) else str(error)
        team = session.team
        who = f" in process {team.rank} of {team.size}" if team.size > 1 else ""
        where = f"training stopped{who} after {session.frames} frames (update {session.update})"
        raise TrainingStopped(f"{where}: {reason}; {kept}") from error
