"""Batches of environments for Stable-Baselines3, whose vector interface is its own; single ones need no adapter."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import Any, Self

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

_Indices = int | Sequence[int] | None


class SB3VecEnv(VecEnv):
    """A vector environment of Gymnasium as one of Stable-Baselines3, all of it stepped by one call.

    The info of a step that ends an episode holds what Stable-Baselines3 looks for: `terminal_observation`,
    `TimeLimit.truncated`, `is_success`, and `outcome` (an index into the environments' `outcomes`).

    Args:
        envs: made with `make_vec(..., autoreset_mode="SameStep")`; observations are dictionaries.

    Raises:
        ValueError: episodes are not reset in the step in which they end.
    """

    def __init__(self, envs: VectorEnv[Any, Any, Any]) -> None:
        mode = envs.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            raise ValueError(f"envs: got autoreset_mode {mode}; expected SameStep")
        self.envs = envs
        self._actions: NDArray[np.int64] = np.zeros((), np.int64)
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def __copy__(self) -> Self:
        """A copy with environments of its own."""
        return deepcopy(self)

    def reset(self) -> dict[str, NDArray[Any]]:
        """Start all episodes, with the seed of `seed()` if it was called since the last reset."""
        observation, _ = self.envs.reset(seed=self._seeds[0])
        self._reset_seeds()
        return _copied(observation)

    def step_async(self, actions: NDArray[np.int64]) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(
        self,
    ) -> tuple[dict[str, NDArray[Any]], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """One step of all environments."""
        observation, reward, terminated, truncated, found = self.envs.step(self._actions)
        done = terminated | truncated
        infos: list[dict[str, Any]] = [{"TimeLimit.truncated": False} for _ in range(self.num_envs)]
        for i in np.flatnonzero(done).tolist():
            infos[i] = {
                "terminal_observation": {name: value[i].copy() for name, value in found["final_obs"].items()},
                "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
                "is_success": bool(found["success"][i]),
                "outcome": int(found["outcome"][i]),
            }
        return _copied(observation), reward.astype(np.float32), done, infos

    def close(self) -> None:
        """Let the environments go."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: _Indices = None) -> list[Any]:
        """The batch's attribute of this name, once for each of these environments."""
        return [getattr(self.envs, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: _Indices = None) -> None:
        """Environments of a batch have no attributes of their own. Raises ValueError."""
        raise ValueError(
            f"set_attr: got {attr_name!r}; environments of a batch have no attributes of their own"
        )

    def env_method(self, method_name: str, *args: Any, indices: _Indices = None, **kwargs: Any) -> list[Any]:
        """Environments of a batch have no methods of their own. Raises ValueError."""
        raise ValueError(
            f"env_method: got {method_name!r}; environments of a batch have no methods of their own"
        )

    def env_is_wrapped(self, wrapper_class: type, indices: _Indices = None) -> list[bool]:
        """None is wrapped."""
        return [False for _ in self._get_indices(indices)]


def _copied(observation: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """The observation in arrays of its own: it is stored after the next step, which may write to the same buffers."""
    return {name: value.copy() for name, value in observation.items()}
