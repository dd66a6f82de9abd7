"""Measures our environments for `make bench`."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

import socialai_dsl
from benchmarks.mixes import BATCHES, Actions, Allowed, random_actions, translated, walk_actions
from benchmarks.report import Memory, Row
from benchmarks.rule_heavy import rule_heavy_actions
from benchmarks.timing import Speed, speed_of

PROGRAMS: Final = 64
"""How many different programs one batch is made of."""


class Ours:
    """Measures our environments on the cores that this process may use.

    Args:
        batches: environments stepped together.
        repetitions: of each measurement.
        seconds: how long each repetition takes, about.
    """

    def __init__(self, batches: Sequence[int], repetitions: int, seconds: float) -> None:
        self._batches = batches
        self._repetitions, self._seconds = repetitions, seconds
        self._allowed: dict[str, Allowed] = {}

    def scenario(self, name: str, mix: str) -> Iterator[Row]:
        """A single environment, and a batch of each size."""
        yield self._single(name, mix)
        for batch in self._batches:
            envs = socialai_dsl.make_vec(name, num_envs=batch, copy=False)
            yield self._vector(name, mix, envs, self._actions(name, mix, envs))

    def together(self, names: Sequence[str], mix: str) -> Row:
        """All scenarios in one batch, environment i playing scenario i modulo their number."""
        played = [names[i % len(names)] for i in range(max(self._batches))]
        return self._mixture(f"{len(names)} scenarios mixed", played, mix, self._seconds)

    def programs(self, names: Mapping[str, str], mix: str = "walk") -> Iterator[Row]:
        """As many programs each alone, then all in one batch in random order.

        Args:
            names: scenario -> digest of its program.
            mix: walk or random.
        """
        batch, seconds = max(self._batches), self._seconds / 4
        alone = []
        for name in names:
            envs = socialai_dsl.make_vec(name, num_envs=batch, copy=False)
            alone.append(self._vector(name, mix, envs, self._actions(name, mix, envs), seconds))
        what = f"{len(names)} programs ({len(set(names.values()))} different), each alone"
        yield Row(what, "ours", mix, batch, _mean_time(alone), _harmonic(row.resets or 0.0 for row in alone))
        order = np.random.default_rng(1).permutation(np.arange(batch) % len(names))
        played = [list(names)[i] for i in order.tolist()]
        yield self._mixture(f"{len(names)} programs in one batch", played, mix, self._seconds)

    def rules(self, name: str) -> Iterator[Row]:
        """An NPC is spoken to, and answers, in nearly every step."""
        envs: Any = socialai_dsl.make_vec(name, num_envs=max(self._batches), copy=False)
        if not hasattr(envs.program, "words"):  # a suite; its members are scenarios
            envs.close()
            return
        heavy = rule_heavy_actions(envs, self._allowed_in(name), 1)

        def run(steps: int) -> None:
            step = envs.step
            for i in range(steps):
                step(heavy.actions[i])

        speed = speed_of(
            run,
            envs.num_envs,
            self._repetitions,
            self._seconds,
            len(heavy.actions),
            lambda: envs.restore(heavy.start),
        )
        envs.close()
        what = f"{name}, {heavy.fired:.2f} rules a step"
        yield Row(what, "ours", "rules", envs.num_envs, speed, None)

    def memory(self, name: str) -> Memory:
        """Bytes of one environment."""
        envs: Any = socialai_dsl.make_vec(name, num_envs=1)
        found = Memory(name, **envs.bytes_per_env())
        envs.close()
        return found

    def _allowed_in(self, name: str) -> Allowed:
        if name not in self._allowed:
            self._allowed[name] = Allowed(name)
        return self._allowed[name]

    def _actions(self, name: str, mix: str, envs: Any) -> Actions:
        if mix == "walk":
            return walk_actions(envs.num_envs, self._allowed_in(name), 1)
        return random_actions(envs, 1)

    def _vector(self, what: str, mix: str, envs: Any, actions: Actions, seconds: float | None = None) -> Row:
        envs.reset(seed=1)
        ended, passes = 0, 8  # long enough for episodes that nothing ends but time
        for _ in range(passes):
            for batch in actions:
                *_, terminations, truncations, _ = envs.step(batch)
                ended += int(np.count_nonzero(terminations | truncations))
        share = ended / (passes * BATCHES * envs.num_envs)
        speed = speed_of(playing(envs, actions), envs.num_envs, self._repetitions, seconds or self._seconds)
        envs.close()
        return Row(what, "ours", mix, envs.num_envs, speed, speed.cpu * share)

    def _mixture(self, what: str, played: Sequence[str], mix: str, seconds: float) -> Row:
        envs: Any = socialai_dsl.make_vec(list(played), num_envs=len(played), copy=False)
        actions = random_actions(envs, 1)
        if mix == "walk":
            for name in dict.fromkeys(played):
                rows = [i for i, other in enumerate(played) if other == name]
                own = walk_actions(envs.num_envs, self._allowed_in(name), 1)[:, rows]
                actions[:, rows] = translated(own, name, envs.program)
        return self._vector(what, mix, envs, actions, seconds)

    def _single(self, name: str, mix: str) -> Row:
        one = socialai_dsl.make_vec(name, num_envs=1)
        actions = list(self._actions(name, mix, one)[:, 0])
        one.close()
        env: Any = socialai_dsl.make(name)
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
        speed = speed_of(run, 1, self._repetitions, self._seconds)
        env.close()
        return Row(name, "ours", mix, 0, speed, speed.cpu * share)


def playing(envs: Any, actions: Actions) -> Any:
    """A function that plays as many steps of a batch as it is called with."""

    def run(steps: int) -> None:
        step = envs.step
        for i in range(steps):
            step(actions[i % BATCHES])

    return run


def _mean_time(rows: Sequence[Row]) -> Speed:
    """The speed of a step that takes the mean of the times of these."""
    names = ("cpu", "cpu_low", "cpu_high", "wall", "wall_low", "wall_high")
    return Speed(*(_harmonic(getattr(row.speed, name) for row in rows) for name in names))


def _harmonic(numbers: Any) -> float:
    values = np.array(list(numbers))
    return float(len(values) / np.sum(1 / values)) if values.all() else 0.0
