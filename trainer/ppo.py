"""This module is proximal policy optimisation: advantages, losses and the update of a rollout."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from trainer import actions as heads
from trainer.actor import Actor
from trainer.config import TrainConfig
from trainer.distinct import prefix_tree
from trainer.errors import TrainingStopped
from trainer.nets import ActorCritic
from trainer.rollout import Rollout


def compute_gae(
    rewards: Tensor,
    values: Tensor,
    next_value: Tensor,
    terminated: Tensor,
    truncated: Tensor,
    bootstrap: Tensor,
    gamma: float,
    gae_lambda: float,
) -> Tensor:
    """Generalised advantage estimates, (T, E) (Schulman et al. 2016, equation 16).

    Args:
        rewards: (T, E) reward of each step.
        values: (T, E) value of the state it was made in.
        next_value: (E,) value of the state after the last step.
        terminated: bool (T, E), whether the step ended the episode.
        truncated: bool (T, E), whether the episode was cut off after the step.
        bootstrap: (T, E) value of the state a truncated episode ended in; 0 makes the time-out terminal.
        gamma: discount per step.
        gae_lambda: weight of longer estimates.
    """
    goes_on = (~(terminated | truncated)).to(values.dtype)
    after_cut = bootstrap * (truncated & ~terminated).to(values.dtype)
    following = torch.cat((values[1:], next_value[None]))
    deltas = rewards + gamma * (following * goes_on + after_cut) - values
    advantages = torch.empty_like(deltas)
    running = torch.zeros_like(next_value)
    for t in range(len(deltas) - 1, -1, -1):
        running = deltas[t] + gamma * gae_lambda * goes_on[t] * running
        advantages[t] = running
    return advantages


@dataclass(frozen=True)
class Batch:
    """Frames the loss is taken over, all (N, ...): see `Rollout`; `returns` are the targets of the value."""

    actions: Tensor
    log_probs: Tensor
    values: Tensor
    advantages: Tensor
    returns: Tensor


@dataclass(frozen=True)
class LossParts:
    """Parts of the loss, scalars.

    Attributes:
        total: what is minimised; only this one carries gradients.
        policy, value, entropy: its terms before their coefficients; entropy in nats, summed over the heads taking part.
        approx_kl: estimated divergence of the new policy from the one that acted (Schulman 2020, k3).
        clip_fraction: share of ratios outside the clipping range.
    """

    total: Tensor
    policy: Tensor
    value: Tensor
    entropy: Tensor
    approx_kl: Tensor
    clip_fraction: Tensor


def ppo_loss(
    batch: Batch, logits: Tensor, values: Tensor, sizes: tuple[int, ...], config: TrainConfig
) -> LossParts:
    """PPO's clipped loss (Schulman et al. 2017, equations 7 and 9) for an action of four heads.

    Template and noun count, in ratio and entropy, only where something was said. With `loss="joint"` the ratio is
    that of the whole action. With `"per_head"` each head has its own ratio, clip, entropy and value term, masked,
    and the four are averaged, as in the released SocialAI code.

    Args:
        batch: the frames and what the acting policy thought of them.
        logits: (N, sum of sizes) of the present policy.
        values: (N,) of the present critic.
        sizes: choices of each head.
        config: coefficients.
    """
    log_probs, entropies = heads.log_probs_and_entropies(logits, batch.actions, sizes)
    mask = heads.spoken_mask(batch.actions)
    change = (log_probs - batch.log_probs) * mask
    log_ratio = change.sum(-1, keepdim=True) if config.loss == "joint" else change
    ratio = log_ratio.exp()
    advantage = batch.advantages[:, None]
    clipped = ratio.clamp(1 - config.clip, 1 + config.clip)
    policy = -torch.minimum(ratio * advantage, clipped * advantage)
    value = (values - batch.returns).square()
    if config.clip_value:
        near = batch.values + (values - batch.values).clamp(-config.clip, config.clip)
        value = torch.maximum(value, (near - batch.returns).square())
    entropy = entropies * mask
    if config.loss == "joint":
        policy_term, value_term, entropy_term = policy.mean(), value.mean(), entropy.sum(-1).mean()
    else:
        policy_term = (policy * mask).mean()
        value_term = (value[:, None] * mask).mean()
        entropy_term = entropy.mean()
    total = policy_term + config.value_coef * value_term - config.entropy_coef * entropy_term
    with torch.no_grad():
        return LossParts(
            total,
            policy_term.detach(),
            value_term.detach(),
            entropy.sum(-1).mean(),
            (ratio - 1 - log_ratio).mean(),
            ((ratio - 1).abs() > config.clip).float().mean(),
        )


@dataclass(frozen=True)
class Minibatch:
    """Whole environments of a rollout with their distinct frames, prepared once and used in every epoch.

    Attributes:
        batch: the frames, time-major: N = T * B.
        starts: bool (T, B). memory: (2, B, M) before the first step.
        prepared: the net's view of the distinct images.
        tokens, parents, offsets: prefix tree of the distinct histories.
        image_index, text_index: int64 (P,), image and tree state of each distinct pair.
        frame_index: int64 (N,), pair of each frame.
    """

    batch: Batch
    starts: Tensor
    memory: Tensor
    prepared: Any
    tokens: Tensor
    parents: Tensor
    offsets: list[int]
    image_index: Tensor
    text_index: Tensor
    frame_index: Tensor

    def evaluate(self, net: ActorCritic) -> tuple[Tensor, Tensor]:
        """Logits (N, sum of sizes) and values (N,) of the frames under the present weights."""
        text = net.dialogue(self.tokens, self.parents, self.offsets)
        features = net.perceive(self.prepared, text, self.image_index, self.text_index)
        steps, count = self.starts.shape
        frames = features.index_select(0, self.frame_index).view(steps, count, -1)
        logits, values = net.heads(net.memory(frames, self.starts, self.memory).flatten(0, 1))
        return logits, values


def make_minibatch(
    actor: Actor, rollout: Rollout, advantages: Tensor, returns: Tensor, envs: Tensor, stretch: int
) -> Minibatch:
    """Cut the environments `envs`, int64 (B,), out of a rollout, in stretches of `stretch` steps side by side."""

    def cut(array: Tensor) -> Tensor:
        """(T, E, ...) to (stretch, T / stretch * B, ...)."""
        chosen = array.index_select(1, envs.to(array.device))
        return chosen.view(-1, stretch, *chosen.shape[1:]).transpose(0, 1).flatten(1, 2)

    pair_rows, frame_index = np.unique(cut(torch.from_numpy(rollout.pair_rows)).numpy(), return_inverse=True)
    pairs = actor.pairs.data[pair_rows]
    image_rows, image_index = np.unique(pairs[:, 0], return_inverse=True)
    history_rows, history_index = np.unique(pairs[:, 1], return_inverse=True)
    tree = prefix_tree(actor.histories.data[history_rows])
    device = actor.device

    def move(array: np.ndarray[Any, Any]) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(array)).to(device)

    return Minibatch(
        Batch(
            cut(rollout.actions).flatten(0, 1),
            cut(rollout.log_probs).flatten(0, 1),
            cut(rollout.values).flatten(),
            cut(advantages).flatten(),
            cut(returns).flatten(),
        ),
        cut(torch.from_numpy(rollout.starts)).to(device),
        rollout.memories.index_select(2, envs.to(device)).transpose(0, 1).flatten(1, 2),
        actor.net.prepare(move(actor.images.data[image_rows])),
        move(tree.tokens),
        move(tree.parents),
        tree.offsets,
        move(image_index),
        move(tree.leaves[history_index]),
        move(frame_index.reshape(-1)),
    )


def update(
    actor: Actor,
    optimizer: torch.optim.Optimizer,
    rollout: Rollout,
    config: TrainConfig,
    generator: torch.Generator,
) -> dict[str, float]:
    """Improve the network on one rollout: `epochs` passes over `minibatches` groups of whole environments.

    The groups are drawn anew for each rollout and visited in a new order in each epoch.

    Returns:
        Means over the minibatches of `LossParts` and of the gradient's norm before clipping, by name, and the
        share of the value's variance that the critic explained.

    Raises:
        TrainingStopped: a loss or a gradient is not finite; the weights are as the last good step left them.
    """
    net = actor.net
    device = actor.device
    raw = compute_gae(
        torch.from_numpy(rollout.rewards).to(device, torch.float32),
        rollout.values,
        rollout.next_value,
        torch.from_numpy(rollout.terminated).to(device),
        torch.from_numpy(rollout.truncated).to(device),
        torch.from_numpy(rollout.bootstrap).to(device, torch.float32),
        config.gamma,
        config.gae_lambda,
    )
    returns = raw + rollout.values
    advantages = (raw - raw.mean()) / (raw.std(correction=0) + 1e-8) if config.normalize_advantages else raw
    order = torch.randperm(raw.shape[1], generator=generator)
    groups = [
        make_minibatch(actor, rollout, advantages, returns, group, config.bptt or config.horizon)
        for group in order.tensor_split(config.minibatches)
    ]
    steps = [
        _step(net, optimizer, groups[index], config)
        for _ in range(config.epochs)
        for index in torch.randperm(len(groups), generator=generator).tolist()
    ]
    means = torch.stack(steps).mean(0).tolist()
    unexplained = (returns - rollout.values).var(correction=0) / (returns.var(correction=0) + 1e-8)
    return dict(zip(_STATISTICS, means, strict=True)) | {"explained_variance": 1 - float(unexplained)}


_STATISTICS = ("loss", "policy_loss", "value_loss", "entropy", "approx_kl", "clip_fraction", "grad_norm")


def _step(
    net: ActorCritic, optimizer: torch.optim.Optimizer, minibatch: Minibatch, config: TrainConfig
) -> Tensor:
    """One gradient step; returns `_STATISTICS`."""
    logits, values = minibatch.evaluate(net)
    loss = ppo_loss(minibatch.batch, logits, values, net.spec.action_sizes, config)
    if not bool(torch.isfinite(loss.total)):
        raise TrainingStopped("the loss is not a finite number")
    optimizer.zero_grad()
    loss.total.backward()  # type: ignore[no-untyped-call]
    norm = nn.utils.clip_grad_norm_(net.parameters(), config.max_grad_norm)
    if not bool(torch.isfinite(norm)):
        raise TrainingStopped("a gradient is not a finite number")
    optimizer.step()
    parts = (loss.total, loss.policy, loss.value, loss.entropy, loss.approx_kl, loss.clip_fraction, norm)
    return torch.stack([part.detach() for part in parts])
