"""This module takes the measurements of `socialai bench`."""

import os
import platform
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import socialai_dsl
from socialai_dsl.cli.mixes import BATCHES, Actions, Allowed, random_actions, walk_actions
from socialai_dsl.cli.reference_loop import reference_speed


@dataclass(frozen=True)
class Row:
    """One measurement, in environment steps per second.

    Attributes:
        what: the scenario, or what it is compared with.
        mix: how the agent's actions were generated.
        batch: environments stepped together; 0 is a single `gymnasium.Env`.
        cpu: per second of CPU time of the process.
        wall: per second on the clock.
        resets: episodes ended per second of CPU time.
    """

    what: str
    mix: str
    batch: int
    cpu: float
    wall: float
    resets: float


@dataclass
class Report:
    """Everything measured in one run."""

    machine: str
    repetitions: int
    reference: float
    rows: list[Row] = field(default_factory=list)
    training: float | None = None

    def as_json(self) -> dict[str, Any]:
        """The report as a JSON-able object; `ratio` compares machines."""
        rows = [asdict(row) | {"ratio": row.cpu / self.reference} for row in self.rows]
        return {
            "machine": self.machine,
            "repetitions": self.repetitions,
            "reference_iterations_per_second": self.reference,
            "rows": rows,
            "training_frames_per_second": self.training,
        }


def measure_all(
    scenarios: Sequence[str],
    batches: Sequence[int],
    mixes: Sequence[str],
    repetitions: int,
    seconds: float,
    train_frames: int | None,
) -> Report:
    """Measure every scenario with every mix and batch size, the peer, and training if asked."""
    with _one_core():
        report = Report(_machine(), repetitions, reference_speed(repetitions))
        for mix in mixes:
            for name in scenarios:
                report.rows += _measure_scenario(name, mix, batches, repetitions, seconds)
            if len(scenarios) > 1:
                report.rows.append(_measure_mixture(scenarios, mix, max(batches), repetitions, seconds))
        report.rows += _measure_peer(repetitions, seconds)
    if train_frames is not None:
        report.training = _measure_training(scenarios[0], train_frames)
    return report


def _measure_scenario(
    name: str, mix: str, batches: Sequence[int], repetitions: int, seconds: float
) -> Iterator[Row]:
    allowed = Allowed(name) if mix == "walk" else None
    yield _measure_single(name, mix, allowed, repetitions, seconds)
    for batch in batches:
        envs = socialai_dsl.make_vec(name, num_envs=batch, copy=False)
        actions = walk_actions(envs, allowed, 1) if allowed else random_actions(envs, 1)
        yield _measure_vector(name, mix, envs, actions, repetitions, seconds)


def _measure_vector(
    what: str, mix: str, envs: Any, actions: Actions, repetitions: int, seconds: float
) -> Row:
    envs.reset(seed=1)
    ended, passes = 0, 8  # long enough for episodes that nothing ends but time
    for _ in range(passes):
        for batch in actions:
            *_, terminations, truncations, _ = envs.step(batch)
            ended += int(np.count_nonzero(terminations | truncations))
    share = ended / (passes * BATCHES * envs.num_envs)

    def run(steps: int) -> None:
        step = envs.step
        for i in range(steps):
            step(actions[i % BATCHES])

    cpu, wall = _time(run, envs.num_envs, repetitions, seconds)
    envs.close()
    return Row(what, mix, envs.num_envs, cpu, wall, cpu * share)


def _measure_single(name: str, mix: str, allowed: Allowed | None, repetitions: int, seconds: float) -> Row:
    one = socialai_dsl.make_vec(name, num_envs=1)
    batches = walk_actions(one, allowed, 1) if allowed else random_actions(one, 1)
    one.close()
    return _measure_env(name, mix, socialai_dsl.make(name), list(batches[:, 0]), repetitions, seconds)


def _measure_env(
    what: str, mix: str, env: Any, actions: Sequence[Any], repetitions: int, seconds: float
) -> Row:
    env.reset(seed=1)
    episodes = 0

    def run(steps: int) -> None:
        nonlocal episodes
        step, reset = env.step, env.reset
        for i in range(steps):
            *_, terminated, truncated, _ = step(actions[i % BATCHES])
            if terminated or truncated:
                reset()
                episodes += 1

    probe = 50 * BATCHES
    run(probe)
    share = episodes / probe
    cpu, wall = _time(run, 1, repetitions, seconds)
    env.close()
    return Row(what, mix, 0, cpu, wall, cpu * share)


def _measure_mixture(scenarios: Sequence[str], mix: str, batch: int, repetitions: int, seconds: float) -> Row:
    """All scenarios in one batch, environment i playing scenario i modulo their number."""
    names = [scenarios[i % len(scenarios)] for i in range(batch)]
    envs = socialai_dsl.make_vec(names, num_envs=batch, copy=False)
    actions = random_actions(envs, 1)
    if mix == "walk":
        parts = {}
        for name in scenarios:
            parts[name] = walk_actions(envs, Allowed(name), 1)
        actions = np.stack([parts[name][:, i] for i, name in enumerate(names)], axis=1)
    return _measure_vector(f"{len(scenarios)} scenarios mixed", mix, envs, actions, repetitions, seconds)


def _measure_peer(repetitions: int, seconds: float) -> Iterator[Row]:
    """MiniGrid's empty room under random actions, if it is installed."""
    try:
        import gymnasium
        import minigrid
    except ImportError:
        return
    env = gymnasium.make("MiniGrid-Empty-8x8-v0")
    env.action_space.seed(1)
    actions = [env.action_space.sample() for _ in range(BATCHES)]
    what = f"MiniGrid {minigrid.__version__} Empty-8x8"
    yield _measure_env(what, "random", env, actions, repetitions, seconds)


def _measure_training(scenario: str, frames: int) -> float:
    """Frames per second of training with the trainer's defaults, the first tenth left out."""
    from tempfile import TemporaryDirectory

    from trainer.config import TrainConfig
    from trainer.train import Progress, train

    config = TrainConfig(frames=frames, tensorboard=False)
    envs = socialai_dsl.make_vec(scenario, num_envs=config.num_envs, copy=False, autoreset_mode="SameStep")
    speeds: list[float] = []

    def note(progress: Progress) -> None:
        speeds.append(progress.frames_per_second)

    with TemporaryDirectory() as folder:
        train(config, envs, Path(folder), progress=note)
    envs.close()
    kept = speeds[len(speeds) // 10 :]
    return len(kept) / sum(1 / speed for speed in kept)


def _time(run: Callable[[int], None], per_step: int, repetitions: int, seconds: float) -> tuple[float, float]:
    """Median steps per CPU second and per second on the clock; each repetition takes about `seconds`."""
    steps, wall = 8, 0.0
    while True:
        start = time.perf_counter()
        run(steps)
        wall = time.perf_counter() - start
        if wall > seconds / 4:
            break
        steps *= 2
    steps = max(1, round(steps * seconds / wall))
    cpu_speeds, wall_speeds = [], []
    for _ in range(repetitions):
        cpu_start, wall_start = time.process_time(), time.perf_counter()
        run(steps)
        cpu, wall = time.process_time() - cpu_start, time.perf_counter() - wall_start
        cpu_speeds.append(steps * per_step / max(cpu, 1e-9))
        wall_speeds.append(steps * per_step / wall)
    return float(np.median(cpu_speeds)), float(np.median(wall_speeds))


def _machine() -> str:
    """The processor's name, as far as the system tells."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return f"{names[0] if names else platform.processor() or platform.machine()}, Python {platform.python_version()}"


@contextmanager
def _one_core() -> Iterator[None]:
    """Keep this process on one core meanwhile, where the system can."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
