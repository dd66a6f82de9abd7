"""Thousands of scenarios at once as a Gymnasium vector environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from socialai_dsl.engine.calls import Task
from socialai_dsl.envs.picture import frame
from socialai_dsl.envs.table import Table, joined
from socialai_dsl.program import Program
from socialai_dsl.program_suite import Playable

_TASKS = {
    AutoresetMode.NEXT_STEP: Task.STEP_NEXT,
    AutoresetMode.SAME_STEP: Task.STEP_SAME,
    AutoresetMode.DISABLED: Task.STEP_ONLY,
}
_MODES = {mode.value.lower(): mode for mode in AutoresetMode}

Observation = dict[str, NDArray[Any]]


class ScenarioVectorEnv(VectorEnv[Observation, NDArray[np.int64], NDArray[Any]]):
    """Environments of one scenario or suite, or of several in turn (environment i plays number i modulo their number).

    Observation: `image` uint8 (E, 7, 7, 4), or (E, 7, 7, 6) if a scenario shows gestures, `tokens` int16 (E, L).
    Action: int64 (E, 4): body action (the last is no movement), speak or not, template, noun. Infos, only in steps
    that end episodes: `success` bool (E,), `outcome` int (E,) (an index into `outcomes`), with masks `_success` and
    `_outcome`; in same-step mode also `final_obs` (arrays as in an observation) and `final_info`.

    Args:
        playables: at least one program or suite of programs; of a suite every episode plays a member, drawn anew.
        num_envs: E.
        num_threads: 1; to use more cores run more processes.
        autoreset_mode: NextStep, SameStep or Disabled (`reset(options={"reset_mask": ...})` restarts some).
        copy: False gives the engine's own buffers, also in infos, valid until the next call; only what changed is
            written to them.
        render_mode: rgb_array or ansi: `render()` gives one picture for each environment.
    """

    def __init__(
        self,
        playables: Sequence[Playable],
        num_envs: int,
        num_threads: int = 1,
        autoreset_mode: str | AutoresetMode = "NextStep",
        copy: bool = True,
        render_mode: str | None = None,
    ) -> None:
        if not playables:
            raise ValueError("scenarios: got none; expected at least one")
        for what, number in (("num_envs", num_envs), ("num_threads", num_threads)):
            if isinstance(number, bool) or not isinstance(number, int | np.integer) or number < 1:
                raise ValueError(f"{what}: got {number!r}; expected a whole number, at least 1")
        mode = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else str(autoreset_mode)
        if mode.lower() not in _MODES:
            raise ValueError(
                f"autoreset_mode: got {autoreset_mode!r}; expected NextStep, SameStep or Disabled"
            )
        if render_mode not in (None, "rgb_array", "ansi"):
            raise ValueError(f"render_mode: got {render_mode!r}; expected None, 'rgb_array' or 'ansi'")
        self.autoreset_mode = _MODES[mode.lower()]
        self.metadata = {
            "render_modes": ["rgb_array", "ansi"],
            "autoreset_mode": self.autoreset_mode,
            "render_fps": 4,
        }
        self._task = _TASKS[self.autoreset_mode]
        self._table = Table(playables, int(num_envs), int(num_threads))
        self._copy = copy
        self.num_envs = int(num_envs)
        self.render_mode = render_mode
        self.single_observation_space = self._table.merged.observation_space()
        self.single_action_space = self._table.merged.action_space()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    @property
    def programs(self) -> tuple[Program, ...]:
        """The programs played, the members of suites each for itself."""
        return self._table.programs

    @property
    def program(self) -> Playable:
        """The program or suite that is played; of several scenarios their mixture."""
        return self._table.merged.playable

    @property
    def outcomes(self) -> list[str]:
        """Name of each number in `infos["outcome"]`: `program.outcomes`."""
        return [name for name, _ in self._table.merged.outcomes]

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """Word of each token id: `program.vocabulary`."""
        return self._table.merged.vocabulary

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start episodes. Options: `layout` (one or a list), `reset_mask`, `test_episode`, `index`.

        Raises:
            ValueError: a seed, an option or a layout is not what was expected.
        """
        if seed is not None:
            self._np_random_seed = seed if isinstance(seed, int) else -1
        self._table.reset(seed, options)
        return self._observation(), {}

    def step(
        self, actions: NDArray[np.int64]
    ) -> tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """One step of every environment. Raises ValueError for actions outside the space."""
        ended = self._table.step(self._task, actions)
        ports = self._table.batch.ports
        infos = self._infos() if ended else {}
        reward, terminated, truncated = ports.reward, ports.terminated, ports.truncated
        if self._copy:
            reward, terminated, truncated = reward.copy(), terminated.copy(), truncated.copy()
        return self._observation(), reward, terminated, truncated, infos

    def _observation(self) -> Observation:
        image, tokens = self._table.image, self._table.tokens
        return (
            {"image": image.copy(), "tokens": tokens.copy()}
            if self._copy
            else {"image": image, "tokens": tokens}
        )

    def _infos(self) -> dict[str, Any]:
        ports = self._table.batch.ports
        ended, outcome, success = ports.ended, ports.outcome, ports.success
        if self._copy:
            ended, outcome, success = ended.copy(), outcome.copy(), success.copy()
        infos: dict[str, Any] = {
            "success": success,
            "_success": ended,
            "outcome": outcome,
            "_outcome": ended,
        }
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            image = joined(ports.final_image, ports.final_extra)
            final: Observation = {"image": image, "tokens": ports.final_tokens}
            infos["final_info"], infos["_final_info"] = dict(infos), ended
            infos["final_obs"] = {k: v.copy() for k, v in final.items()} if self._copy else final
            infos["_final_obs"] = ended
        return infos

    # --- strings, made only when asked for ---

    def utterances(self) -> list[str]:
        """What is heard now: one line for each speaker, "NA" in silence."""
        return ["\n".join(self._table.heard(row)) or "NA" for row in range(self.num_envs)]

    def histories(self) -> list[str]:
        """What was heard since the reset, as far as it is kept."""
        return ["\n".join(self._table.history(row)) for row in range(self.num_envs)]

    def members(self) -> list[str | None]:
        """What a suite calls the scenario that each environment plays in this episode; None without a suite."""
        return [self._table.member(row) for row in range(self.num_envs)]

    def member_ids(self) -> NDArray[np.int64]:
        """Which of `program.members` each environment plays in this episode, (E,); 0 without a suite."""
        return self._table.batch.program_numbers().astype(np.int64)

    def set_member_weights(self, weights: Sequence[int]) -> None:
        """Let later episodes draw the members of the suite, or the leaves of its tree, in proportion to their weights.

        Args:
            weights: a whole number from 0 on for each of `program.members`, not all 0.

        Raises:
            ValueError: they are not that, or no suite is played whose members are drawn.
        """
        self._table.set_member_weights(weights)

    def describe(self, index: int) -> dict[str, Any]:
        """The state of one environment in the scenario's own names; can be put back as a layout."""
        return self._table.describe(index)

    # --- numbers for a learner ---

    def utterance_ids(self) -> NDArray[np.int64]:
        """A number for what was heard in the last step, (E,); 0 for silence."""
        return self._table.utterance_ids()

    def history_ids(self) -> NDArray[np.int64]:
        """A number for all that was heard since the reset, (E,); 0 for nothing."""
        return self._table.history_ids()

    def image_ids(self) -> NDArray[np.int64]:
        """A number for the picture, (E,)."""
        return self._table.image_ids()

    def scripted_actions(self) -> NDArray[np.int64]:
        """What the agents' frames would do now, (E, 4). Raises ValueError if the agent follows no frame."""
        return self._table.scripted_actions()

    def counters(self) -> dict[str, Any]:
        """Counts since the environments were made: {"outcomes": {name: n}, "rules": {name: n}, "episodes": n}."""
        return self._table.counters()

    def bytes_per_env(self) -> dict[str, int]:
        """Bytes of one environment: its state, its observation, and what goes in and out of a step."""
        state, ports = self._table.batch.state, self._table.batch.ports
        arrays = {
            "state": (state.registers, state.boards, state.keys),
            "observation": (self._table.image, self._table.tokens),
            "call": (
                *(ports.actions, ports.reward, ports.terminated, ports.truncated),
                *(ports.ended, ports.outcome, ports.success),
            ),
        }
        return {name: sum(a.nbytes for a in parts) // self.num_envs for name, parts in arrays.items()}

    def snapshot(self) -> bytes:
        """The exact state of all environments, randomness included."""
        return self._table.snapshot()

    def restore(self, data: bytes) -> None:
        """Put back a snapshot of the same scenarios and number of environments. Raises ValueError for any other."""
        self._table.restore(data)

    def render(self) -> tuple[Any, ...] | None:
        """One picture for each environment, in the form of `render_mode`."""
        if self.render_mode is None:
            return None
        return tuple(frame(self._table, row, self.render_mode) for row in range(self.num_envs))

    def set_attr(self, name: str, values: Mapping[str, Any] | Any) -> None:
        """Environments of a batch have no attributes of their own."""
        raise ValueError(f"set_attr: got {name!r}; environments of a batch have no attributes of their own")
