"""Guides: players that act in some steps of training and whose actions the agent imitates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.extensions import load_class

SHIPPED = ("none", "script")


class Lead(NamedTuple):
    """A guide's part in one step of E environments: NumPy arrays, or tensors (T, E, ...) for a rollout.

    Attributes:
        actions: int64 (E, H), the guide's own choice.
        led: bool (E,), true where the guide's action is played instead of the policy's; these give no policy gradient.
            After handing over in an episode the guide leads it no more: advantage estimates would be biased.
        weights: float32 (E,), weight of the cross-entropy between policy and `actions`: imitation if led, else advice.
    """

    actions: Any
    led: Any
    weights: Any


class Guide(Protocol):
    """The interface of a guide, which leads and advises in training and is never asked in evaluation.

    `--guide mine:Guide` builds `Guide(config, envs)`.
    """

    def lead(self, envs: Any, starts: NDArray[np.bool_], progress: float) -> Lead:
        """Decide about the coming step.

        Args:
            envs: the vector environment before the step; `envs.scripted_actions()` asks its script.
            starts: bool (E,), true where the coming step is an episode's first.
            progress: share of the run's frames so far, 0 to 1.
        """

    def state(self) -> dict[str, Any]:
        """Its whole state, as JSON data."""

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Continue from what `state()` of an equal guide returned."""


class ScriptGuide:
    """The scenario's own script plays whole episodes, and the agent imitates it; then the agent learns alone.

    Source: behaviour cloning (Pomerleau 1991) before reinforcement learning, as in DAPG (Rajeswaran et al. 2018).
    """

    def __init__(self, config: RunConfig, envs: Any) -> None:
        """Begin with nobody led. Raises ValueError if the environments have no script for the agent."""
        try:
            envs.scripted_actions()
        except ValueError as error:
            raise ValueError(f"guide: the scenario has no script to imitate: {error}") from error
        self._share = config.guide_share
        self._led = np.zeros(envs.num_envs, np.bool_)

    def lead(self, envs: Any, starts: NDArray[np.bool_], progress: float) -> Lead:
        """See `Guide.lead`; an episode that began with the script is played by it to its end."""
        self._led = np.where(starts, progress < self._share, self._led)
        if self._led.any():
            actions = np.asarray(envs.scripted_actions(), np.int64)
        else:
            actions = np.zeros((len(starts), *envs.single_action_space.shape), np.int64)
        return Lead(actions, self._led.copy(), self._led.astype(np.float32))

    def state(self) -> dict[str, Any]:
        """See `Guide.state`."""
        return {"led": self._led.tolist()}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """See `Guide.load_state`."""
        self._led = np.array(state["led"], np.bool_)


def build_guide(config: RunConfig, envs: Any) -> Guide | None:
    """The guide that a configuration names, None for `none`. Raises ValueError if it is not there or does not fit."""
    if config.guide == "none":
        return None
    script = config.guide == "script"
    found = ScriptGuide if script else load_class(config.guide, "guide", SHIPPED, Guide, config.code_folder)
    return found(config, envs)
