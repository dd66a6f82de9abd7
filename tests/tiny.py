"""Scenarios of a few lines, written where they are tested, and what happens when they are played."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from textwrap import dedent
from typing import Any

import numpy as np

import socialai_dsl as sd

BASE = """\
scenario: base
abstract: true
horizon: 20
earshot: room
grammar: {templates: [Say <noun>], nouns: [hello, bye]}
room: {size: 7}
cast:
  agent: {at: [1, 1], facing: right}
outcome: [{failure: agent.did(done)}]
"""
"""What every tiny scenario has unless it says otherwise: a 7x7 room, the agent in its corner, voices that carry."""


class Play:
    """An episode of a tiny scenario.

    Attributes:
        env: the environment. observation, info: as reset or the last step gave them.
        reward, terminated, truncated: of the last step.
    """

    def __init__(self, path: Path, layout: Mapping[str, Any] | None) -> None:
        self.env = sd.make(str(path))
        self.observation, self.info = self.env.reset(seed=0, options={"layout": layout} if layout else None)
        self.reward, self.terminated, self.truncated = 0.0, False, False

    def step(self, body: str | None = None, said: str | None = None) -> Play:
        """One step with this body action and utterance."""
        return self.act(self.env.unwrapped.encode_action((body, said)))  # type: ignore[attr-defined]

    def act(self, action: Any) -> Play:
        """One step with an action of the space."""
        self.observation, reward, self.terminated, self.truncated, self.info = self.env.step(action)
        self.reward = float(reward)
        return self

    def steps(self, count: int) -> Play:
        """So many steps in which the agent does nothing."""
        for _ in range(count):
            self.step()
        return self

    @property
    def state(self) -> dict[str, Any]:
        """The state in the scenario's own names."""
        state: dict[str, Any] = self.env.unwrapped.describe()  # type: ignore[attr-defined]
        return state

    def at(self, name: str) -> Any:
        """The cell of somebody or something, [x, y]."""
        return self.state[name]["at"]

    def facing(self, name: str) -> Any:
        """The direction of somebody."""
        return self.state[name]["facing"]

    def status(self, name: str) -> Any:
        """The status of an object, or the state of a member's frame."""
        return self.state[name]["state"]

    def value(self, name: str) -> Any:
        """The value of `member.register`."""
        return self.state["let"][name]

    def shown(self, ahead: int, right: int = 0) -> list[int]:
        """What the picture shows so many cells ahead of the agent: type, colour, status, orientation."""
        cell: list[int] = self.observation["image"][3 + right, 6 - ahead].tolist()
        return cell


class Table:
    """An episode of a tiny scenario in which all seats can be played.

    Attributes:
        envs: one game, with a row for each seat. seats: the members that have them. observation, reward, terminated,
        truncated, infos: as reset or the last step gave them, a row for each seat.
    """

    def __init__(self, path: Path) -> None:
        self.envs = sd.make_vec(str(path), 1, seats="all")
        self.seats = [str(seat) for seat in self.envs.programs[0].seats]
        self._encode = sd.make(str(path)).unwrapped.encode_action  # type: ignore[attr-defined]
        self.observation, self.infos = self.envs.reset(seed=0)
        self.reward = np.zeros(len(self.seats))
        self.terminated = self.truncated = np.zeros(len(self.seats), np.bool_)

    def step(self, **acts: str | tuple[str | None, str | None] | None) -> Table:
        """One step in which these members are played: a body action, or one and an utterance. The agent always is."""
        both = {seat: act if isinstance(act, tuple) else (act, None) for seat, act in acts.items()}
        self.envs.set_taken(np.array([seat == "agent" or seat in both for seat in self.seats]))
        actions = np.array([self._encode(both.get(seat, (None, None))) for seat in self.seats])
        found = self.envs.step(actions)
        self.observation, self.reward, self.terminated, self.truncated, self.infos = found
        return self

    @property
    def state(self) -> dict[str, Any]:
        """The state in the scenario's own names."""
        return self.envs.describe(0)

    def at(self, name: str) -> Any:
        """The cell of somebody or something, [x, y]; None out of the room."""
        described = self.state[name]
        return None if described.get("gone") else described["at"]

    def value(self, name: str) -> Any:
        """The value of `member.register`, or of a register of the world."""
        state = self.state
        return state["let"][name] if "." in name else state["state"][name]

    def heard(self, seat: str) -> list[str]:
        """The lines that a seat heard in this step."""
        line = self.envs.utterances()[self.seats.index(seat)]
        return [] if line == "NA" else line.split("\n")

    def shown(self, seat: str, ahead: int, right: int = 0) -> list[int]:
        """What a seat sees so many cells ahead: type, colour, status, orientation."""
        image = self.observation["image"][self.seats.index(seat)]
        cell: list[int] = image[3 + right, 6 - ahead].tolist()
        return cell

    @property
    def outcome(self) -> str:
        """How the episode ended."""
        return str(self.envs.outcomes[self.infos["outcome"][0]])


class Folder:
    """Where tiny scenarios are written."""

    def __init__(self, path: Path) -> None:
        self.path = path
        (path / "base.yaml").write_text(BASE, encoding="utf-8")

    def __call__(self, text: str, layout: Mapping[str, Any] | None = None) -> Play:
        """Begin an episode of the scenario that `text` makes of `BASE`."""
        return Play(self.write("tiny", text), layout)

    def table(self, text: str) -> Table:
        """Begin an episode with all seats of the scenario that `text` makes of `BASE`."""
        return Table(self.write("tiny", text))

    def write(self, name: str, text: str) -> Path:
        """Save a scenario that extends `BASE`."""
        return self.save(name, f"scenario: {name}\nextends: base.yaml\n{dedent(text).lstrip()}")

    def save(self, name: str, text: str) -> Path:
        """Save a file as it is."""
        path = self.path / f"{name}.yaml"
        path.write_text(text, encoding="utf-8")
        return path
