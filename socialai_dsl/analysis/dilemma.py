"""Whether a scenario with several seats is a dilemma: what those who cooperate and those who defect are paid.

Source of the diagram: Schelling (1973), Hockey helmets, concealed weapons, and daylight saving. A scenario is a dilemma
if whoever changes from cooperating to defecting gains by it, however many others cooperate, and all are paid more when
all cooperate than when nobody does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.envs.vector_env import AGENT, ScenarioVectorEnv
from socialai_dsl.frontend import following
from socialai_dsl.program import Program

_LEAST: Final = 1e-6
"""A difference in what is paid below this is none."""


@dataclass(frozen=True)
class Schelling:
    """What players are paid on average, by how many of the others cooperate.

    Attributes:
        frames: of those who cooperate, and of those who defect.
        cooperators, defectors: the mean of what they are paid in an episode, for 0, 1, ... of the others.
        cooperators_se, defectors_se: the standard errors of these means over rooms.
    """

    frames: tuple[str, str]
    cooperators: tuple[float, ...]
    defectors: tuple[float, ...]
    cooperators_se: tuple[float, ...]
    defectors_se: tuple[float, ...]

    @property
    def gains(self) -> tuple[float, ...]:
        """What defecting gains, by how many of the others cooperate."""
        return tuple(d - c for c, d in zip(self.cooperators, self.defectors, strict=True))

    @property
    def is_dilemma(self) -> bool:
        """Whether each gains by defecting, and all lose by it."""
        return min(self.gains) > _LEAST and self.cooperators[-1] - self.defectors[0] > _LEAST

    @property
    def verdict(self) -> str:
        """Whether it is a dilemma, and why, in a sentence."""
        least, most = min(self.gains), max(self.gains)
        together = f"each is paid {self.cooperators[-1]:.3f} if all cooperate, {self.defectors[0]:.3f} if nobody does"
        if self.is_dilemma:
            gain = f"{least:.3f}" if most - least < 0.0005 else f"{least:.3f} to {most:.3f}"
            return f"a dilemma: defecting gains {gain}, however many others cooperate, and {together}"
        if least <= _LEAST:
            others = self.gains.index(least)
            told = f"if {others} of {len(self.gains) - 1} others cooperate, defecting gains {least:.3f}"
            return f"no dilemma: {told}"
        return f"no dilemma: {together}"

    def __str__(self) -> str:
        most = len(self.cooperators) - 1
        told = [
            f"if {others} of {most} others cooperate, cooperating pays {c:.3f} and defecting {d:.3f}"
            for others, (c, d) in enumerate(zip(self.cooperators, self.defectors, strict=True))
        ]
        return "; ".join([self.verdict, *told])

    def figures(self) -> dict[str, Any]:
        """The figures as a JSON-able object."""
        return {**asdict(self), "is_dilemma": self.is_dilemma, "verdict": self.verdict}


def schelling(loaded: LoadedScenario, frames: Sequence[str], rooms: int, seed: int) -> Schelling:
    """Play the rooms of a seed with every number of cooperators, each seat in turn among them.

    Args:
        loaded: a scenario with several seats.
        frames: of those who cooperate, and of those who defect.
        rooms: how many, from 0 on.
        seed: of the rooms.

    Raises:
        ScenarioError: a seat cannot follow one of the frames.
    """
    names = tuple(map(str, compile_program(loaded).seats))
    count = len(names)
    paid: dict[tuple[bool, int], list[NDArray[np.float64]]] = {}
    for together in range(count + 1):
        for first in range(count if 0 < together < count else 1):
            joined = [(seat - first) % count < together for seat in range(count)]
            played = following(loaded, {n: frames[not one] for n, one in zip(names, joined, strict=True)})
            returns = returns_of_scripts(compile_program(played), rooms, seed)
            for cooperates, found in zip(joined, returns.T, strict=True):
                paid.setdefault((cooperates, together - cooperates), []).append(found)
    means, errors = [], []
    for who in (True, False):
        by_room = [np.mean(paid[who, others], axis=0) for others in range(count)]
        means.append(tuple(float(found.mean()) for found in by_room))
        errors.append(tuple(float(found.std(ddof=1) / rooms**0.5) if rooms > 1 else 0.0 for found in by_room))
    return Schelling((frames[0], frames[1]), *means, *errors)


def compile_program(loaded: LoadedScenario) -> Program:
    """The program of a scenario."""
    program = compile_loaded(loaded)
    assert isinstance(program, Program), "internal: a scenario is one program"
    return program


def returns_of_scripts(program: Program, rooms: int, seed: int) -> NDArray[np.float64]:
    """What each seat is paid in each room while all follow their frames, undiscounted, float64 (rooms, S)."""
    envs = ScenarioVectorEnv([program], rooms, autoreset_mode="Disabled", seats="all")
    envs.set_taken(envs.seat == 0)
    envs.reset(seed=seed)
    seats = len(envs.seat_names)
    actions = np.zeros((envs.num_envs, *envs.single_action_space.shape), np.int64)  # type: ignore[misc]
    going, total = np.ones(envs.num_envs, np.bool_), np.zeros(envs.num_envs)
    while going.any():
        actions[::seats] = envs.scripted_actions(AGENT)
        _, reward, terminated, truncated, _ = envs.step(actions)
        total += np.where(going, reward, 0.0)
        going &= ~(terminated | truncated)
    return total.reshape(rooms, seats)
