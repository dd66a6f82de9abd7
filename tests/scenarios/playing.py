"""Plays shipped scenarios in words: what the tests of scenarios do, see and hear."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from math import sqrt
from pathlib import Path
from typing import Any

import socialai_dsl as sd
from socialai_dsl.envs import ScenarioEnv

Cell = tuple[int, int]
Code = tuple[int, ...]

SCENARIOS = Path(__file__).parents[2] / "scenarios"
BEYOND = tuple(
    f"{folder}/{path.stem}"
    for folder in ("classics", "novel")
    for path in sorted((SCENARIOS / folder).glob("*.yaml"))
    if not path.stem.endswith(("_oracle", ".tests"))
)
"""The scenarios beyond the paper and the School."""

FORWARD: dict[str, Cell] = {"right": (1, 0), "down": (0, 1), "left": (-1, 0), "up": (0, -1)}
OPPOSITE = {"right": "left", "left": "right", "up": "down", "down": "up"}
COLORS = ("red", "green", "blue", "purple", "yellow", "grey")

EMPTY, GREY_WALL, LAVA = (1, 0, 0, 0), (2, 5, 0, 0), (9, 0, 0, 0)
DOOR, BALL, NPC, SWITCH = 4, 6, 11, 12
OPEN, CLOSED, LOCKED = 0, 1, 2


@dataclass(frozen=True)
class Step:
    """What came of one step; `ended` is None while the episode goes on."""

    heard: str
    reward: float
    ended: str | None


@cache
def made(name: str) -> ScenarioEnv:
    """The environment of a scenario, made once; it plays one episode at a time."""
    return sd.make(name).unwrapped  # type: ignore[no-any-return, attr-defined]


class Episode:
    """An episode that has begun. Only the latest of a scenario may be played on."""

    def __init__(self, name: str, layout: dict[str, Any] | None = None, seed: int = 0) -> None:
        self.env = made(name)
        observation, info = self.env.reset(seed=seed, options={"layout": layout} if layout else None)
        assert info["utterance"] == "NA"
        self.image = observation["image"]

    def act(self, body: str | None = None, say: str | None = None) -> Step:
        """One step: a body action, a sentence, both or neither."""
        observation, reward, terminated, truncated, info = self.env.step(self.env.encode_action((body, say)))
        self.image = observation["image"]
        ended = None
        if terminated or truncated:
            ended = "success" if info["success"] else "timeout" if truncated else "failure"
        heard = info["utterance"]
        return Step("" if heard == "NA" else heard, reward, ended)

    def acts(self, *bodies: str | None) -> Step:
        """Several body actions in silence; what came of the last."""
        for body in bodies:
            step = self.act(body)
        return step

    def hears(self, *bodies: str | None) -> list[str]:
        """What is heard in each of several steps."""
        return [self.act(body).heard for body in bodies]

    def face(self, direction: str) -> None:
        """Turns until it looks in a direction."""
        ways = list(FORWARD)
        while (facing := self.now()["agent"]["facing"]) != direction:
            self.act("left" if (ways.index(direction) - ways.index(facing)) % 4 == 3 else "right")

    def go_to(self, cell: Cell, avoid: Iterable[Iterable[int]] = ()) -> None:
        """Walks within the walls by a shortest way, around the cells to avoid."""
        while (at := tuple(self.now()["agent"]["at"])) != cell:
            free = interior(self.now()["room"]) - {tuple(one) for one in avoid}
            way = next(way for way in FORWARD if beside(at, way) in _nearer(at, cell, free))
            self.face(way)
            self.act("forward")

    def now(self) -> dict[str, Any]:
        """The state in the scenario's own names."""
        return self.env.describe()

    def seen(self, at: Iterable[int]) -> Code:
        """How the latest picture shows a cell; it must be in view."""
        x, y = at
        agent = self.now()["agent"]
        (across, down), (ax, ay) = FORWARD[agent["facing"]], agent["at"]
        ahead = (x - ax) * across + (y - ay) * down
        aside = (y - ay) * across - (x - ax) * down
        assert 0 <= ahead <= 6, f"{(x, y)} is not in view"
        assert abs(aside) <= 3, f"{(x, y)} is not in view"
        return tuple(self.image[3 + aside, 6 - ahead].tolist())


@cache
def _drawn(name: str) -> list[dict[str, Any]]:
    return []


def rooms(name: str, number: int) -> Sequence[dict[str, Any]]:
    """States after the reset, one for each seed; they are drawn once, so nobody may change them."""
    known, env = _drawn(name), made(name)
    for seed in range(len(known), number):
        env.reset(seed=seed)
        known.append(env.describe())
    return known[:number]


def beside(cell: Iterable[int], direction: str, cells: int = 1) -> Cell:
    """The cell so many cells on in a direction."""
    (x, y), (across, down) = cell, FORWARD[direction]
    return x + across * cells, y + down * cells


def distance(a: Iterable[int], b: Iterable[int]) -> int:
    """Steps between two cells if nothing is in the way."""
    return sum(abs(p - q) for p, q in zip(a, b, strict=True))


def interior(room: dict[str, int]) -> set[Cell]:
    """The cells within the walls."""
    return set(product(range(1, room["width"] - 1), range(1, room["height"] - 1)))


def reachable(start: Iterable[int], free: set[Cell]) -> set[Cell]:
    """The free cells that can be walked to."""
    found, todo = set(), [tuple(start)]
    while todo:
        cell = todo.pop()
        if cell not in found:
            found.add(cell)
            todo += [next_cell for way in FORWARD if (next_cell := beside(cell, way)) in free]
    return found


def check_shares(
    values: Iterable[Hashable], expected: dict[Any, float], standard_errors: float = 4.5
) -> None:
    """Each value occurs with its probability, and no other value occurs."""
    counted = Counter(values)
    number = counted.total()
    assert set(counted) <= set(expected)
    for value, share in expected.items():
        error = sqrt(share * (1 - share) / number)
        measured = counted[value] / number
        assert abs(measured - share) <= standard_errors * error, (value, measured, share)


def evenly(values: Iterable[Any]) -> dict[Any, float]:
    """The same probability for each value."""
    listed = list(values)
    return {value: 1 / len(listed) for value in listed}


def _nearer(start: Cell, goal: Cell, free: set[Cell]) -> set[Cell]:
    """The neighbours of a cell from which a shortest way over free cells leads to the goal."""
    edge, reached = {goal}, {goal}
    while not (near := {beside(start, way) for way in FORWARD} & edge):
        edge = {beside(cell, way) for cell in edge for way in FORWARD} & free - reached
        assert edge, f"no way from {start} to {goal}"
        reached |= edge
    return near
