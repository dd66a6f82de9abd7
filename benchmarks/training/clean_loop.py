"""A single-file LSTM PPO in the style of widely copied loops: one pass per whole minibatch.

Differs from `plain_loop` as those loops do: the network without BatchNorm sees a minibatch's frames in one call and
only the LSTM goes step by step; minibatches are whole environments; one ratio of the whole action; advantages are
normalised. Histories are padded to a fixed length and encoded anew for every frame and epoch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import torch
from torch import Tensor, nn

from benchmarks.training.networks import SIZE, Agent, silent
from benchmarks.training.settings import Settings, advantages, observe

CLIP = 0.2


def train(
    envs: Any, settings: Settings, trunk: Callable[[int, tuple[int, ...]], nn.Module]
) -> Iterator[None]:
    """Train on `envs` (same-step auto-reset) for ever; each `next` is one rollout and its update.

    Args:
        envs: vector environment.
        settings: sizes; `words` must not be 0.
        trunk: makes the perception from the vocabulary's size and the image's shape.
    """
    sizes = tuple(int(n) for n in envs.single_action_space.nvec)
    shape = envs.single_observation_space["image"].shape
    agent = Agent(trunk(len(envs.program.vocabulary), shape), sizes)
    optimizer = torch.optim.Adam(agent.parameters(), lr=7e-4, eps=1e-5)
    horizon, count = settings.horizon, settings.num_envs
    images = torch.zeros(horizon, count, *shape, dtype=torch.uint8)
    tokens = torch.zeros(horizon, count, settings.words, dtype=torch.int64)
    actions = torch.zeros(horizon, count, len(sizes), dtype=torch.int64)
    log_probs, values, rewards, ends = (torch.zeros(horizon, count) for _ in range(4))
    kept = torch.zeros(horizon, count, 1)

    observation, _ = envs.reset(seed=0)
    memory, goes_on = silent(count), torch.zeros(count, 1)
    while True:
        first = memory
        with torch.no_grad():
            for t in range(horizon):
                images[t], tokens[t] = observe(observation, settings.words)
                kept[t] = goes_on
                memory = agent.remember(agent.trunk(images[t], tokens[t]), memory, goes_on)
                parts, values[t] = agent.decide(memory[0])
                actions[t] = torch.stack([part.sample() for part in parts], -1)
                log_probs[t] = _log_prob(parts, actions[t])
                observation, reward, terminated, truncated, _ = envs.step(actions[t].numpy())
                rewards[t] = torch.from_numpy(reward)
                ends[t] = torch.from_numpy(terminated | truncated)
                goes_on = 1 - ends[t][:, None]
            features = agent.trunk(*observe(observation, settings.words))
            last = agent.decide(agent.remember(features, memory, goes_on)[0])[1]
        gains = advantages(rewards, values, ends, last, 0.95)
        goals = gains + values

        for _ in range(settings.epochs):
            for group in torch.randperm(count).tensor_split(settings.minibatches):
                frames = (images[:, group].flatten(0, 1), tokens[:, group].flatten(0, 1))
                features = agent.trunk(*frames).view(horizon, len(group), SIZE)
                state, hidden = (first[0][group], first[1][group]), []
                for t in range(horizon):
                    state = agent.remember(features[t], state, kept[t, group])
                    hidden.append(state[0])
                parts, value = agent.decide(torch.stack(hidden))
                chosen = actions[:, group]
                ratio = (_log_prob(parts, chosen) - log_probs[:, group]).exp()
                gain = gains[:, group]
                gain = (gain - gain.mean()) / (gain.std() + 1e-8)
                policy = -torch.minimum(ratio * gain, ratio.clamp(1 - CLIP, 1 + CLIP) * gain).mean()
                entropy = sum(part.entropy().mean() for part in parts)
                loss = policy - 0.01 * entropy + 0.5 * (value - goals[:, group]).square().mean()
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
                optimizer.step()
        yield


def _log_prob(parts: list[Any], actions: Tensor) -> Tensor:
    """Log-probability of whole actions (..., 4)."""
    return torch.stack([p.log_prob(a) for p, a in zip(parts, actions.unbind(-1), strict=True)]).sum(0)
