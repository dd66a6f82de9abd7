"""sb3-contrib's RecurrentPPO on our environments, with a peer's trunk as its features extractor."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from gymnasium import spaces
from sb3_contrib import RecurrentPPO
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnv
from torch import Tensor, nn

from benchmarks.training.networks import SIZE
from benchmarks.training.settings import Settings, padded

Trunk = Callable[[int, tuple[int, ...]], nn.Module]


def train(envs: Any, settings: Settings, trunk: Trunk) -> Iterator[None]:
    """Train on `envs` (same-step auto-reset) for ever; each `next` is one rollout and its update.

    One LSTM for policy and value and one layer of 64 for each head, so that the network is as large as the others'.
    """
    frames = settings.num_envs * settings.horizon
    model = RecurrentPPO(
        "MultiInputLstmPolicy",
        _Adapter(envs, settings.words),
        learning_rate=7e-4,
        n_steps=settings.horizon,
        batch_size=frames // settings.minibatches,
        n_epochs=settings.epochs,
        ent_coef=0.01,
        device="cpu",
        seed=0,
        policy_kwargs={
            "features_extractor_class": _Extractor,
            "features_extractor_kwargs": {"vocabulary": len(envs.program.vocabulary), "trunk": trunk},
            "lstm_hidden_size": SIZE,
            "shared_lstm": True,
            "enable_critic_lstm": False,
            "net_arch": {"pi": [4 * 64], "vf": [64]},
            "normalize_images": False,
        },
    )
    while True:
        model.learn(frames, reset_num_timesteps=False)
        yield


class _Extractor(BaseFeaturesExtractor):
    """A trunk behind the interface of Stable-Baselines3, which hands over every observation as floats."""

    def __init__(self, observation_space: spaces.Dict, vocabulary: int, trunk: Trunk) -> None:
        super().__init__(observation_space, SIZE)
        self.trunk = trunk(vocabulary, observation_space["image"].shape or ())

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        features: Tensor = self.trunk(observations["image"], observations["tokens"].long())
        return features


class _Adapter(VecEnv):
    """Our vector environment as Stable-Baselines3's; time-outs are terminal, histories have a fixed length."""

    def __init__(self, envs: Any, words: int) -> None:
        self._envs, self._words = envs, words
        tokens = spaces.Box(0, len(envs.program.vocabulary) - 1, (words,), np.int16)
        space = spaces.Dict(image=envs.single_observation_space["image"], tokens=tokens)
        super().__init__(envs.num_envs, space, envs.single_action_space)
        self._actions: Any = None

    def reset(self) -> dict[str, Any]:
        return self._shape(self._envs.reset(seed=0)[0])

    def step_async(self, actions: Any) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[dict[str, Any], Any, Any, list[dict[str, Any]]]:
        observation, reward, terminated, truncated, _ = self._envs.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        return self._shape(observation), reward.astype(np.float32), terminated | truncated, infos

    def _shape(self, observation: dict[str, Any]) -> dict[str, Any]:
        return {"image": observation["image"], "tokens": padded(observation["tokens"], self._words)}

    def close(self) -> None:
        self._envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [None for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise NotImplementedError("the environments of a comparison are not changed")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        raise NotImplementedError("the environments of a comparison are not changed")

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        return [False for _ in self._get_indices(indices)]
