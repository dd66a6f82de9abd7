"""This module is proximal policy optimisation: advantages, losses and the update of a rollout."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from trainer import actions as heads
from trainer.actor import Actor
from trainer.config import TrainConfig
from trainer.crew import Crew
from trainer.errors import TrainingStopped
from trainer.minibatch import Batch, Minibatch, make_minibatch
from trainer.nets import ActorCritic
from trainer.rollout import Rollout
from trainer.team import ALONE, Team


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

    def row(self) -> Tensor:
        """The first six of `STATISTICS`, without gradients."""
        parts = (self.total, self.policy, self.value, self.entropy, self.approx_kl, self.clip_fraction)
        return torch.stack([part.detach() for part in parts])


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


STATISTICS = ("loss", "policy_loss", "value_loss", "entropy", "approx_kl", "clip_fraction", "grad_norm")


def update(
    actor: Actor,
    optimizer: torch.optim.Optimizer,
    rollout: Rollout,
    config: TrainConfig,
    generator: torch.Generator,
    crew: Crew,
    team: Team = ALONE,
) -> dict[str, float]:
    """Improve the network on one rollout: `epochs` passes over `minibatches` groups of whole environments.

    The groups are drawn anew for each rollout and visited in a new order in each epoch. A group's environments are
    shared by the processes of the team, which hold some of them each, and there by the threads of the crew; their
    gradients are added up, so that every process makes the same step.

    Returns:
        Means over the minibatches of `LossParts` and of the gradient's norm before clipping, by name, and the
        share of the value's variance that the critic explained.

    Raises:
        TrainingStopped: a loss or a gradient is not finite; the weights are as the last good step left them.
    """
    raw = estimate_advantages(actor, rollout, config)
    returns = raw + rollout.values
    whole, acting = team.gather(raw, 1), team.gather(rollout.values, 1)
    advantages = team.mine(scale_advantages(whole, config), 1)
    stretch = config.bptt or config.horizon

    def prepare(envs: Tensor) -> Minibatch:
        return make_minibatch(actor, rollout, advantages, returns, envs, stretch)

    order = torch.randperm(config.num_envs, generator=generator)
    chosen = [team.own(group, config.num_envs) for group in order.tensor_split(config.minibatches)]
    groups = [crew.map(prepare, crew.shares(envs)) for envs in chosen]
    frames = team.sum(torch.tensor([sum(len(share.batch.returns) for share in group) for group in groups]))
    steps = [
        _step(actor.net, optimizer, groups[index], int(frames[index]), config, crew, team)
        for _ in range(config.epochs)
        for index in torch.randperm(len(groups), generator=generator).tolist()
    ]
    return summarize(steps, acting, whole + acting)


def summarize(steps: list[Tensor], values: Tensor, returns: Tensor) -> dict[str, float]:
    """Means of the gradient steps' `STATISTICS` by name, and the share of the value's variance that was explained."""
    means = torch.stack(steps).mean(0).tolist()
    unexplained = (returns - values).var(correction=0) / (returns.var(correction=0) + 1e-8)
    return dict(zip(STATISTICS, means, strict=True)) | {"explained_variance": 1 - float(unexplained)}


def estimate_advantages(actor: Actor, rollout: Rollout, config: TrainConfig) -> Tensor:
    """`compute_gae` of a rollout, on the network's device."""

    def move(array: NDArray[Any]) -> Tensor:
        return torch.from_numpy(array).to(actor.device)

    return compute_gae(
        move(rollout.rewards).float(),
        rollout.values,
        rollout.next_value,
        move(rollout.terminated),
        move(rollout.truncated),
        move(rollout.bootstrap).float(),
        config.gamma,
        config.gae_lambda,
    )


def scale_advantages(raw: Tensor, config: TrainConfig) -> Tensor:
    """Advantages as the loss takes them: scaled to mean 0 and deviation 1 if the configuration says so."""
    return (raw - raw.mean()) / (raw.std(correction=0) + 1e-8) if config.normalize_advantages else raw


def _step(
    net: ActorCritic,
    optimizer: torch.optim.Optimizer,
    shares: list[Minibatch],
    total: int,
    config: TrainConfig,
    crew: Crew,
    team: Team,
) -> Tensor:
    """One gradient step on a group of environments with `total` frames, given in shares; returns `STATISTICS`."""
    parameters = list(net.parameters())

    def differentiate(share: Minibatch) -> tuple[Tensor, Sequence[Tensor | None]]:
        logits, values = share.evaluate(net)
        loss = ppo_loss(share.batch, logits, values, net.spec.action_sizes, config)
        weight = len(share.batch.returns) / total
        gradients = torch.autograd.grad(loss.total * weight, parameters, allow_unused=True)
        return loss.row() * weight, gradients

    results = crew.map(differentiate, shares)
    statistics = torch.zeros(len(STATISTICS) - 1, device=parameters[0].device)
    for share_statistics, _ in results:
        statistics += share_statistics
    for parameter, *gradients in zip(parameters, *(share[1] for share in results), strict=True):
        _add_up(parameter, gradients)
    return descend(net, optimizer, _add_up_team(parameters, statistics, team), config)


def descend(
    net: ActorCritic, optimizer: torch.optim.Optimizer, statistics: Tensor, config: TrainConfig
) -> Tensor:
    """Clip the gradients that lie in the parameters and make the optimiser's step.

    Returns:
        `STATISTICS`: the given ones, those of the loss, and the gradient's norm before clipping.

    Raises:
        TrainingStopped: the loss or the gradient is not finite; the weights are as they were.
    """
    if not bool(torch.isfinite(statistics[0])):
        raise TrainingStopped("the loss is not a finite number")
    norm = nn.utils.clip_grad_norm_(net.parameters(), config.max_grad_norm)
    if not bool(torch.isfinite(norm)):
        raise TrainingStopped("a gradient is not a finite number")
    optimizer.step()
    return torch.cat((statistics, norm[None]))


def _add_up(parameter: Tensor, gradients: Sequence[Tensor | None]) -> None:
    """Store the sum of the shares' gradients, in memory of its own that is laid out like the parameter.

    Autograd may return one tensor for two parameters, which clipping would then scale twice, and in another
    layout, which fused Adam does not expect.
    """
    present = [gradient for gradient in gradients if gradient is not None]
    if not present:
        parameter.grad = None
        return
    if parameter.grad is None:
        parameter.grad = torch.empty_like(parameter)
    parameter.grad.copy_(present[0])
    for gradient in present[1:]:
        parameter.grad.add_(gradient)


def _add_up_team(parameters: Sequence[Tensor], statistics: Tensor, team: Team) -> Tensor:
    """Replace the gradients by their sums over the team, in one message with the statistics, whose sum is returned."""
    if team.size == 1:
        return statistics
    present = torch.tensor([float(parameter.grad is not None) for parameter in parameters])
    flat = [_gradient(parameter).reshape(-1) for parameter in parameters]
    sums = team.sum(torch.cat([*flat, statistics, present.to(statistics.device)]))
    sizes = [parameter.numel() for parameter in parameters]
    *gradients, statistics, used = torch.split(sums, [*sizes, len(statistics), len(present)])
    for parameter, gradient, is_used in zip(parameters, gradients, used.tolist(), strict=True):
        # Adam passes over parameters without a gradient, which a zero would not be.
        _add_up(parameter, [gradient.view(parameter.shape)] if is_used else [])
    return statistics


def _gradient(parameter: Tensor) -> Tensor:
    """The gradient of a parameter, zeros where it has none."""
    return torch.zeros_like(parameter) if parameter.grad is None else parameter.grad
