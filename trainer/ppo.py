"""Proximal policy optimisation, top to bottom: advantages, loss, update of a rollout, the algorithm.

Sources: Schulman et al. 2017 (PPO), Schulman et al. 2016 (GAE). Axes: T steps of a rollout, E environments, N frames of
a minibatch, H heads, A choices of all of them side by side.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn

from socialai_dsl.trainer import actions as heads
from socialai_dsl.trainer.auxiliary import loss_of
from socialai_dsl.trainer.chunks import Chunks, chunks
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.errors import require_finite
from socialai_dsl.trainer.frames import Batch, Environments
from socialai_dsl.trainer.minibatch import cut_out, environments
from socialai_dsl.trainer.nets import ActorCritic
from socialai_dsl.trainer.policy import NetPolicy
from socialai_dsl.trainer.rollout import Rollout, collect
from socialai_dsl.trainer.session import Mapper, Session

# -- advantages ---------------------------------------------------------------------------------------------------


def compute_gae(
    rewards: Tensor,
    values: Tensor,
    next_value: Tensor,
    ended: Tensor,
    bootstrap: Tensor,
    gamma: float,
    gae_lambda: float,
) -> Tensor:
    """Generalised advantage estimates, (T, E) (Schulman et al. 2016, equation 16).

    Args:
        rewards: (T, E) reward of each step.
        values: (T, E) value of the state it was made in.
        next_value: (E,) value of the state after the last step.
        ended: bool (T, E), whether the step was its episode's last.
        bootstrap: (T, E) value of the state a time-out cut the episode off in; 0 where it is over for good.
        gamma: discount per step.
        gae_lambda: weight of longer estimates.
    """
    goes_on = (~ended).to(values.dtype)  # (T, E)
    following = torch.cat((values[1:], next_value[None]))  # (T, E)
    deltas = rewards + gamma * (following * goes_on + bootstrap) - values  # (T, E)
    advantages = torch.empty_like(deltas)
    running = torch.zeros_like(next_value)  # (E,)
    for t in range(len(deltas) - 1, -1, -1):
        running = deltas[t] + gamma * gae_lambda * goes_on[t] * running
        advantages[t] = running
    return advantages


def estimate_advantages(config: RunConfig, rollout: Rollout) -> Batch:
    """All frames of a rollout, (T, E, ...), with advantages as the loss takes them, and returns."""
    advantages = compute_gae(
        rollout.rewards,
        rollout.values,
        rollout.next_value,
        rollout.ended,
        rollout.bootstrap,
        config.gamma,
        config.gae_lambda,
    )
    returns = advantages + rollout.values
    own = advantages if rollout.lead is None else advantages[~rollout.lead.led]
    if config.normalize_advantages and len(own):  # a guide may have made every step
        advantages = (advantages - own.mean()) / (own.std(correction=0) + 1e-8)
    return Batch(rollout.actions, rollout.log_probs, rollout.values, advantages, returns, rollout.lead)


# -- loss ---------------------------------------------------------------------------------------------------------


class Figures(NamedTuple):
    """Means of F figures, (F,), and how many entries each is a mean over, (F,); of none it is not a number."""

    means: Tensor
    counts: Tensor

    @classmethod
    def pooled(cls, some: Sequence[Figures]) -> Figures:
        """The means over the entries of all."""
        means, counts = (torch.stack(column) for column in zip(*some, strict=True))  # (K, F) each
        totals = torch.where(counts > 0, means * counts, 0).sum(0)
        return cls(totals / counts.sum(0), counts.sum(0))


class LossParts(NamedTuple):
    """The loss, and figures about it; all are scalars but `counts`, and only the loss has gradients.

    Each figure is a mean over the frames that it is about: policy, entropy, divergence and clipping those in which the
    agent acted by itself, imitation those that a guide shows, by weight. Of no frames it is not a number.

    Attributes:
        loss: what is minimised: a mean over all frames, each with the terms that it has.
        policy_loss, value_loss, entropy: its terms before their coefficients; entropy in nats.
        approx_kl: estimated divergence of the new policy from the one that acted (Schulman 2020, k3), nats.
        clip_fraction: share of ratios outside the clipping range.
        imitation_loss: cross-entropy between the policy and a guide's actions, nats.
        counts: (7,), the number of entries that each of these is a mean over.
        aux_loss: the auxiliary loss of all frames, before its coefficient; None without one.
    """

    loss: Tensor
    policy_loss: Tensor
    value_loss: Tensor
    entropy: Tensor
    approx_kl: Tensor
    clip_fraction: Tensor
    imitation_loss: Tensor
    counts: Tensor
    aux_loss: Tensor | None = None

    def figures(self) -> Figures:
        """All of them without gradients, in the order of `STATISTICS`, and an auxiliary loss behind them."""
        *means, counts, aux_loss = self
        figures = Figures(torch.stack(means).detach(), counts)
        if aux_loss is None:
            return figures
        return Figures(
            *(torch.cat(pair) for pair in zip(figures, (aux_loss.detach()[None], counts[:1]), strict=True))
        )


STATISTICS = LossParts._fields[:-2]
"""The figures that are known of each gradient step."""

SHORTER, LONGER = 0.5, 1.25
"""What the learning rate is multiplied by after an update that left the trust region, and after one that did not."""


def ppo_loss(
    batch: Batch,
    logits: Tensor,
    values: Tensor,
    sizes: tuple[int, ...],
    config: RunConfig,
    used: Tensor | None = None,
) -> LossParts:
    """PPO's clipped loss (Schulman et al. 2017, equations 7 and 9) for an action of several heads.

    What was said counts in the ratio: the template and its slots. With `loss="joint"` the ratio is that of the
    whole action and the entropy that of the joint distribution. With `"per_head"` each head has its own ratio, clip,
    entropy and value term, masked, and they are averaged, as in the released SocialAI code.

    Frames that a guide led have no policy and no entropy term: PPO's ratio means nothing where another policy acted.
    What a guide does or advises is imitated by a weighted cross-entropy: behaviour cloning (Pomerleau 1991).

    Args:
        batch: the frames and what the acting policy thought of them.
        logits: (N, A) of the present policy.
        values: (N,) of the present critic.
        sizes: choices of each head.
        config: coefficients, of this time of the run.
        used: which slots a template has, `NetSpec.used`.
    """
    log_probs, entropies = heads.log_probs_and_entropies(logits, batch.actions, sizes)  # (N, H) each
    mask = heads.spoken_mask(batch.actions, used)  # (N, H)
    own = torch.ones_like(values) if batch.lead is None else (~batch.lead.led).to(values.dtype)  # (N,)
    change = (log_probs - batch.log_probs) * mask * own[:, None]  # (N, H)
    log_ratio = change.sum(-1, keepdim=True) if config.loss == "joint" else change  # (N, 1) or (N, H)
    ratio = log_ratio.exp()
    advantage = batch.advantages[:, None]  # (N, 1)
    clipped = ratio.clamp(1 - config.clip, 1 + config.clip)
    policy = -torch.minimum(ratio * advantage, clipped * advantage) * own[:, None]  # (N, 1) or (N, H)
    value = (values - batch.returns).square()  # (N,)
    if config.clip_value:
        near = batch.values + (values - batch.values).clamp(-config.clip, config.clip)
        value = torch.maximum(value, (near - batch.returns).square())
    if config.loss == "joint":
        entropy = heads.joint_entropy(logits, entropies, sizes, used) * own  # (N,)
        policy_term, value_term, entropy_term = policy.mean(), value.mean(), entropy.mean()
    else:
        entropy = (entropies * mask).sum(-1) * own  # (N,), of the heads that took part
        policy_term, value_term = (policy * mask).mean(), (value[:, None] * mask).mean()
        entropy_term = entropy.mean() / len(sizes)
    total = policy_term + config.value_coef * value_term - config.entropy_coef * entropy_term
    shown, imitation = torch.zeros_like(own), torch.zeros((), device=logits.device)  # (N,), scalar
    if batch.lead is not None:
        shown, example = batch.lead.weights, batch.lead.actions  # (N,), (N, H)
        likely, _ = heads.log_probs_and_entropies(logits, example, sizes)
        imitation = -((likely * heads.spoken_mask(example, used)).sum(-1) * shown).mean()
        total = total + config.imitation_coef * imitation
    with torch.no_grad():
        joint = change.sum(-1)  # (N,), the log-ratio of the whole action
        kl = (joint.exp() - 1 - joint).mean()
        took_part = own[:, None] if config.loss == "joint" else mask * own[:, None]  # (N, 1) or (N, H)
        outside = ((ratio - 1).abs() > config.clip).to(values.dtype) * took_part
        # Means over all frames, to which frames that a figure is not about have added 0, and the shares of the others.
        means = (total, policy_term, value_term, entropy.mean(), kl, outside.mean(), imitation)
        every, of_own = torch.ones_like(own).mean(), own.mean()
        shares = torch.stack((every, of_own, every, of_own, of_own, took_part.mean(), shown.mean()))
        _, *figures = torch.stack(means) / shares
        return LossParts._make((total, *figures, shares * len(values), None))


# -- update -------------------------------------------------------------------------------------------------------


def update(session: Session, rollout: Rollout, mapper: Mapper = map) -> dict[str, float | None]:
    """Improve the network on one rollout: `epochs` passes over its minibatches, each a gradient step.

    A minibatch's shares are differentiated by the mapper's threads; their gradients are added up.

    `target_kl` limits the divergence from the policy that played by backtracking, as the line search of Schulman et al.
    2015 (appendix C) does: where a minibatch finds it exceeded, the gradient step before is undone, the update ends,
    and later steps are shorter. No minibatch measures the last step of an update. Adam's steps are long even where
    gradients are tiny, so one of them can undo what a nearly certain policy has learnt.

    Where a guide led, the policy that played was not the agent's, so `target_kl` heeds the agent's own frames alone; a
    minibatch without any ends nothing.

    Returns:
        `STATISTICS` by name, means over the minibatches, None where they have no frame of that kind; with an auxiliary
        loss `aux_loss`; the mean norm of the gradient before clipping; the share of the value's variance that the
        critic explained, in all frames; and the learning rate.

    Raises:
        TrainingStopped: a loss, a gradient or a weight is not finite.
    """
    net, config = session.actor.net, session.now
    sizes, used = net.spec.action_sizes, net.spec.used
    parameters = [parameter for module in session.modules.values() for parameter in module.parameters()]
    session.optimizer.param_groups[0]["lr"] = config.lr * session.step_scale
    batch, aux = estimate_advantages(config, rollout), session.aux
    if aux is not None:
        aux.begin(cut_out(session, rollout, batch, torch.arange(config.envs)), net, session.generator)

    def differentiate(share: Environments | Chunks) -> tuple[Figures, Sequence[Tensor | None]]:
        parts = []
        for frames, outputs in share.evaluate(net):
            part = ppo_loss(frames, outputs.logits, outputs.values, sizes, config, used)
            if aux is not None and isinstance(share, Environments):
                extra = loss_of(aux, share, outputs, net)
                part = part._replace(loss=part.loss + config.aux_coef * extra, aux_loss=extra)
            parts.append(part)
        loss = torch.stack([part.loss for part in parts]).mean() * share.weight
        found = Figures.pooled([part.figures() for part in parts])
        return found, torch.autograd.grad(loss, parameters, allow_unused=True)

    steps: list[Figures] = []
    norms: list[Tensor] = []
    trusted: list[Tensor] = []  # the weights before the last gradient step
    cut = chunks if config.update == "chunks" else environments
    for shares in cut(session, rollout, batch):
        found, gradients = zip(*mapper(differentiate, shares), strict=True)
        for parameter, *own in zip(parameters, *gradients, strict=True):
            parameter.grad = _sum(parameter, own)
        means, counts = Figures.pooled(found)
        require_finite("the loss", means[0])
        # By shares of its frames, so that minibatches count equally.
        steps.append(Figures(means, counts / counts[0]))
        norms.append(nn.utils.clip_grad_norm_(parameters, config.max_grad_norm))
        require_finite("a gradient", norms[-1])
        if config.target_kl is not None:
            # Not a number, and so not above the limit, where no frame is the agent's own.
            if trusted and float(means[STATISTICS.index("approx_kl")]) > config.target_kl:
                with torch.no_grad():
                    for parameter, value in zip(parameters, trusted, strict=True):
                        parameter.copy_(value)
                session.step_scale *= SHORTER
                break
            trusted = [parameter.detach().clone() for parameter in parameters]
        session.optimizer.step()
    else:
        session.step_scale = min(1.0, session.step_scale * LONGER)
    for part, module in session.modules.items():
        for name, value in module.state_dict().items():  # also of its buffers
            require_finite(f"an entry of {_WHOSE[part]} {name}", value)
    unexplained = (batch.returns - batch.values).var(correction=0) / (batch.returns.var(correction=0) + 1e-8)
    names = STATISTICS if aux is None else (*STATISTICS, "aux_loss")
    known = zip(names, *(column.tolist() for column in Figures.pooled(steps)), strict=True)
    figures = {name: mean if share else None for name, mean, share in known}
    figures["grad_norm"] = float(torch.stack(norms).mean())
    figures["explained_variance"] = 1 - float(unexplained)
    figures["learning_rate"] = session.optimizer.param_groups[0]["lr"]
    for name, figure in figures.items():
        if figure is not None:
            require_finite(f"{name} of the update", figure)
    return figures


_WHOSE = {"net": "the network's", "aux": "the auxiliary loss's"}


def _sum(parameter: Tensor, gradients: Sequence[Tensor | None]) -> Tensor | None:
    """The sum of the shares' gradients, in memory of its own that is laid out like the parameter.

    Autograd may return one tensor for two parameters, which clipping would then scale twice, and in another
    layout, which fused Adam does not expect.
    """
    present = [gradient for gradient in gradients if gradient is not None]
    return torch.empty_like(parameter).copy_(functools.reduce(torch.add, present)) if present else None


# -- the algorithm ------------------------------------------------------------------------------------------------


class Ppo:
    """Proximal policy optimisation as an algorithm; see `Algorithm`. All that it remembers is the session's."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def collect(self) -> Rollout:
        """Play as the policy samples."""
        return collect(self._session)

    def update(self, played: Rollout) -> dict[str, float | None]:
        """See `update`."""
        return update(self._session, played, self._session.mapper)

    def state(self) -> dict[str, Tensor]:
        """Nothing."""
        return {}

    def load_state(self, state: Mapping[str, Tensor]) -> None:
        """Nothing."""

    @staticmethod
    def policy(net: ActorCritic, greedy: bool, seed: int) -> NetPolicy:
        """What samples the network's actions, or takes the most probable ones."""
        return NetPolicy(net, greedy, seed)
