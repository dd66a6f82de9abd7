"""This module takes the measurements of `socialai bench`."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

import socialai_dsl
from socialai_dsl.cli.machine import machine, on_cores
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

    def as_json(self) -> dict[str, Any]:
        """The report as a JSON-able object; `ratio` compares machines."""
        rows = [asdict(row) | {"ratio": row.cpu / self.reference} for row in self.rows]
        return {
            "machine": self.machine,
            "repetitions": self.repetitions,
            "reference_iterations_per_second": self.reference,
            "rows": rows,
        }


def measure_all(
    scenarios: Sequence[str],
    batches: Sequence[int],
    mixes: Sequence[str],
    repetitions: int,
    seconds: float,
) -> Report:
    """Measure every scenario with every mix and batch size, and the peer."""
    with on_cores(1):
        report = Report(machine(), repetitions, reference_speed(repetitions))
        for mix in mixes:
            for name in scenarios:
                report.rows += _measure_scenario(name, mix, batches, repetitions, seconds)
            if len(scenarios) > 1:
                report.rows.append(_measure_mixture(scenarios, mix, max(batches), repetitions, seconds))
        report.rows += _measure_peer(repetitions, seconds)
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
