"""The SocialAI 1.0 training loop written plainly, a stand-in for the paper's research code.

What it does, and in which steps, follows the paper: the network with BatchNorm, in training mode while acting too;
16 environments and 40 steps; the history encoded from its first word for every frame; four epochs over chunks of ten
frames, each chunk walked through frame by frame with the memory carried along; ratio, clipping and value loss per
head. Every second epoch's chunks begin half a chunk later, which leaves a quarter of the frames out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from benchmarks.training.networks import Agent, PaperTrunk, silent
from benchmarks.training.settings import Settings, advantages, observe

RECURRENCE = 10
CLIP = 0.2


@dataclass
class _Frames:
    """A rollout, each environment's frames one after the other: (E * T, ...)."""

    images: NDArray[np.uint8]
    tokens: NDArray[np.int16]
    actions: Tensor
    log_probs: Tensor
    values: Tensor
    advantages: Tensor
    kept: Tensor
    h: Tensor
    c: Tensor


def train(envs: Any, settings: Settings) -> Iterator[None]:
    """Train on `envs` (same-step auto-reset) for ever; each `next` is one rollout and its update."""
    sizes = tuple(int(n) for n in envs.single_action_space.nvec)
    shape = envs.single_observation_space["image"].shape
    agent = Agent(PaperTrunk(len(envs.program.vocabulary), shape, batch_norm=True), sizes)
    optimizer = torch.optim.Adam(agent.parameters(), lr=1e-4, eps=1e-5)
    player = _Player(agent, envs, settings)
    while True:
        frames = player.collect()
        for epoch in range(settings.epochs):
            for starts in _chunks(settings, shifted=epoch % 2 == 1):
                _improve(agent, optimizer, frames, starts)
        yield


class _Player:
    def __init__(self, agent: Agent, envs: Any, settings: Settings) -> None:
        self._agent, self._envs, self._settings = agent, envs, settings
        self._observation, _ = envs.reset(seed=0)
        self._memory = silent(settings.num_envs)
        self._kept = torch.zeros(settings.num_envs, 1)

    @torch.no_grad()
    def collect(self) -> _Frames:
        """Play one rollout."""
        steps: list[tuple[Any, ...]] = []
        rewards, ends = [], []
        for _ in range(self._settings.horizon):
            seen, before, kept = self._observation, self._memory, self._kept
            parts, value = self._look()
            actions = torch.stack([part.sample() for part in parts], 1)
            log_probs = torch.stack([p.log_prob(a) for p, a in zip(parts, actions.unbind(1), strict=True)], 1)
            self._observation, reward, terminated, truncated, _ = self._envs.step(actions.numpy())
            ended = torch.from_numpy(terminated | truncated).float()
            self._kept = 1 - ended[:, None]
            rewards.append(torch.from_numpy(reward).float())
            ends.append(ended)
            steps.append((seen["image"], seen["tokens"], actions, log_probs, value, kept, *before))
        memory, kept = self._memory, self._kept
        _, last = self._look()
        self._memory, self._kept = memory, kept
        images, tokens, *rest = zip(*steps, strict=True)
        actions, log_probs, values, kept, h, c = (torch.stack(part) for part in rest)
        gains = advantages(torch.stack(rewards), values, torch.stack(ends), last, 0.99)
        flat = [_by_environment(part) for part in (actions, log_probs, values, gains, kept, h, c)]
        return _Frames(np.concatenate(np.stack(images, 1)), np.concatenate(np.stack(tokens, 1)), *flat)

    def _look(self) -> tuple[list[Any], Tensor]:
        images, tokens = observe(self._observation, self._settings.words)
        features = self._agent.trunk(images, tokens)
        self._memory = self._agent.remember(features, self._memory, self._kept)
        return self._agent.decide(self._memory[0])


def _by_environment(array: Tensor) -> Tensor:
    """(T, E, ...) to (E * T, ...)."""
    return array.transpose(0, 1).flatten(0, 1)


def _chunks(settings: Settings, shifted: bool) -> list[Tensor]:
    """First frames of the chunks, in random order, one tensor for each gradient step."""
    starts = torch.arange(settings.num_envs * settings.horizon).view(settings.num_envs, -1, RECURRENCE)[
        :, :, 0
    ]
    if shifted:
        starts = starts[:, :-1] + RECURRENCE // 2
    order = starts.flatten()
    return list(order[torch.randperm(len(order))].tensor_split(settings.minibatches))


def _improve(agent: Agent, optimizer: torch.optim.Optimizer, frames: _Frames, starts: Tensor) -> None:
    """One gradient step on chunks, frame after frame."""
    memory = frames.h[starts], frames.c[starts]
    loss = torch.zeros(())
    for step in range(RECURRENCE):
        now = starts + step
        rows = now.numpy()
        images, tokens = observe({"image": frames.images[rows], "tokens": frames.tokens[rows]}, 0)
        memory = agent.remember(agent.trunk(images, tokens), memory, frames.kept[now])
        loss = loss + _loss(agent, frames, now, memory[0])
        if step < RECURRENCE - 1:
            frames.h[now + 1], frames.c[now + 1] = memory[0].detach(), memory[1].detach()
    optimizer.zero_grad()
    (loss / RECURRENCE).backward()  # type: ignore[no-untyped-call]
    nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
    optimizer.step()


def _loss(agent: Agent, frames: _Frames, now: Tensor, hidden: Tensor) -> Tensor:
    """Mean over the heads of each one's clipped policy, entropy and value terms; words count only if spoken."""
    parts, value = agent.decide(hidden)
    actions, gain, before = frames.actions[now], frames.advantages[now], frames.values[now]
    goal = gain + before
    near = before + (value - before).clamp(-CLIP, CLIP)
    value_loss = torch.maximum((value - goal) ** 2, (near - goal) ** 2)
    spoke = actions[:, 1].float()
    total = torch.zeros(())
    for head, part in enumerate(parts):
        mask = spoke if head >= 2 else torch.ones_like(spoke)
        ratio = (part.log_prob(actions[:, head]) - frames.log_probs[now, head]).exp()
        policy = -torch.minimum(ratio * gain, ratio.clamp(1 - CLIP, 1 + CLIP) * gain)
        total = total + ((policy - 0.01 * part.entropy() + 0.5 * value_loss) * mask).mean() / len(parts)
    return total
