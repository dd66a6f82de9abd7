"""A game with several seats as a parallel environment of PettingZoo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from socialai_dsl.draws import MAX_SEED
from socialai_dsl.engine.calls import TRUNCATED, Task
from socialai_dsl.envs.copying import Copied
from socialai_dsl.envs.options import check_render_mode
from socialai_dsl.envs.picture import frame
from socialai_dsl.envs.scenario_env import SILENCE, encode_action
from socialai_dsl.envs.table import Table
from socialai_dsl.envs.values import whole_number
from socialai_dsl.program import Program, Register

Observation = dict[str, NDArray[Any]]

_ASKED_BY_TESTS = {"options": 1}
"""What PettingZoo's own test gives as options, only to see whether they are taken."""


class ScenarioParallelEnv(Copied, ParallelEnv[str, Observation, NDArray[np.int64]]):
    """One game of a scenario. Its seats are PettingZoo's agents, named as the members of the cast: `agent`, `helper`.

    All act at once, and an episode begins and ends for all of them together. Observations, actions and infos of an
    agent are those of `ScenarioEnv`: `image`, uint8 (7, 7, C), `tokens`, int16 (L,), an action of 3 + slots integers;
    `utterance`, `history`, and in the last step `success` and `outcome`.

    `socialai_dsl.make_parallel` makes one from a name.

    Args:
        program: what `socialai_dsl.compile` returns for a scenario.
        render_mode: `rgb_array`, `ansi`, or `human`, which prints the room after every step.

    Raises:
        ValueError: it is no program of a scenario, or there is no such render mode.
    """

    def __init__(self, program: Program, render_mode: str | None = None) -> None:
        if not isinstance(program, Program):
            raise ValueError(f"program: got {program!r}; expected what `compile` returns for a scenario")
        self.program = program
        modes = ["rgb_array", "ansi", "human"]
        self.metadata = {
            "name": program.name,
            "render_modes": modes,
            "render_fps": 4,
            "is_parallelizable": True,
        }
        self.render_mode = check_render_mode(render_mode, modes)
        self._table = Table([program], 1, all_seats=True)
        self.possible_agents = [str(seat) for seat in program.seats]
        self.agents: list[str] = []
        self.observation_spaces = {
            name: self._table.merged.observation_space() for name in self.possible_agents
        }
        self.action_spaces = {name: self._table.merged.action_space() for name in self.possible_agents}

    def observation_space(self, agent: str) -> spaces.Dict:
        """The observations of an agent, always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.MultiDiscrete:
        """The actions of an agent, always the same object."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Start an episode.

        Args:
            seed: starts episode 0 of this seed. Without it the next episode follows.
            options: those of `ScenarioEnv.reset`.

        Returns:
            Observations and infos by agent.

        Raises:
            ValueError: the seed or an option is not what was expected.
            RuntimeError: 64 drawn rooms in a row violate the scenario's `require`.
        """
        seed = None if seed is None else whole_number("seed", seed, 0, MAX_SEED)
        self._table.reset(seed, None if options == _ASKED_BY_TESTS else options)
        # Still so where `reset_mask` is False.
        plays = self._table.all_begun and not self._table.state.registers[0, Register.ENDED]
        self.agents = list(self.possible_agents) if plays else []
        if self.render_mode == "human":
            self.render()
        return self._observations(), self._infos()

    def step(
        self, actions: Mapping[str, NDArray[np.int64] | Sequence[int]]
    ) -> tuple[
        dict[str, Observation],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Take one step.

        Args:
            actions: the action of each agent, integers (3 + slots,).

        Returns:
            Observations, rewards, terminations (an outcome ended the episode), truncations (the horizon did) and infos,
            each by agent.

        Raises:
            ValueError: the episode has ended, an agent has no action, or an action is outside the space.
        """
        if not self.agents:
            raise ValueError("step: got a call outside of an episode; expected reset() first")
        if not isinstance(actions, Mapping) or set(actions) != set(self.agents):
            given = (
                f"actions of {', '.join(map(str, actions))}"
                if isinstance(actions, Mapping)
                else repr(actions)
            )
            raise ValueError(f"step: got {given}; expected actions of {', '.join(self.agents)}")
        ended = self._table.step(Task.STEP_ONLY, [actions[name] for name in self.possible_agents])
        ports, infos = self._table.batch.ports, self._infos()
        rewards = {name: float(ports.reward[seat]) for seat, name in enumerate(self.possible_agents)}
        truncated = bool(ended) and int(self._table.state.registers[0, Register.ENDED]) == TRUNCATED
        found = (
            self._observations(),
            rewards,
            self._of_all(bool(ended) and not truncated),
            self._of_all(truncated),
            infos,
        )
        if ended:
            outcome = self.program.outcomes[int(self._table.state.registers[0, Register.OUTCOME])]
            for seat, name in enumerate(self.possible_agents):
                infos[name] |= {"success": bool(ports.success[seat]), "outcome": outcome}
            self.agents = []
        if self.render_mode == "human":
            self.render()
        return found

    def _of_all(self, value: bool) -> dict[str, bool]:
        return dict.fromkeys(self.possible_agents, value)

    def _observations(self) -> dict[str, Observation]:
        image, tokens = self._table.image, self._table.tokens
        return {
            name: {"image": image[seat].copy(), "tokens": tokens[seat].copy()}
            for seat, name in enumerate(self.possible_agents)
        }

    def _infos(self) -> dict[str, dict[str, Any]]:
        return {
            name: {
                "utterance": "\n".join(self._table.heard(seat)) or SILENCE,
                "history": "\n".join(self._table.history(seat)),
            }
            for seat, name in enumerate(self.possible_agents)
        }

    def encode_action(self, action: Sequence[Any]) -> NDArray[np.int64]:
        """The action that words or the paper's notation mean; see `ScenarioEnv.encode_action`."""
        return encode_action(action, self.program.actions, self.program.sentences)

    def describe(self) -> dict[str, Any]:
        """The state in the scenario's own names, as a layout that `reset` accepts."""
        return self._table.describe(0)

    def render(self) -> Any:
        """The room, by `render_mode`: uint8 (H, W, 3), text, or printed; without a mode, None.

        Raises:
            ValueError: there was no reset yet.
        """
        if self.render_mode is None:
            return None
        self._table.look("render")
        if self.render_mode != "human":
            return frame(self._table, 0, self.render_mode)
        print(frame(self._table, 0, "ansi"))
        return None

    def state(self) -> NDArray[Any]:
        """What all agents see, uint8 (S, 7, 7, C)."""
        return self._table.image.copy()
