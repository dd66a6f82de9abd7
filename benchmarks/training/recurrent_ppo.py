"""sb3-contrib's RecurrentPPO on our environments, with a peer's trunk as its features extractor."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from gymnasium import spaces
from sb3_contrib import RecurrentPPO
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor, nn

from benchmarks.training.networks import SIZE
from benchmarks.training.settings import Settings, padded
from socialai_dsl.sb3 import SB3VecEnv

Trunk = Callable[[int, tuple[int, ...]], nn.Module]


def train(envs: Any, settings: Settings, trunk: Trunk) -> Iterator[None]:
    """Train on `envs` (same-step auto-reset) for ever; each `next` is one rollout and its update.

    One LSTM for policy and value and one layer of 64 for each head, so that the network is as large as the others'.
    """
    frames = settings.num_envs * settings.horizon
    model = RecurrentPPO(
        "MultiInputLstmPolicy",
        _Padded(envs, settings.words),
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


class _Padded(SB3VecEnv):
    """Histories have a fixed length, which the library asks for; time-outs are terminal, as for the other trainers."""

    def __init__(self, envs: Any, words: int) -> None:
        super().__init__(envs)
        self._words = words
        tokens = spaces.Box(0, len(envs.program.vocabulary) - 1, (words,), np.int16)
        self.observation_space = spaces.Dict(image=envs.single_observation_space["image"], tokens=tokens)

    def reset(self) -> dict[str, Any]:
        return self._padded(super().reset())

    def step_wait(self) -> tuple[dict[str, Any], Any, Any, list[dict[str, Any]]]:
        observation, reward, done, _ = super().step_wait()
        return self._padded(observation), reward, done, [{} for _ in done]

    def _padded(self, observation: dict[str, Any]) -> dict[str, Any]:
        return {**observation, "tokens": padded(observation["tokens"], self._words)}
