"""Rollouts: the environments are played with the current policy, and what an update needs is kept."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from trainer import actions as heads
from trainer.errors import TrainingStopped
from trainer.features import Actor, Int64
from trainer.guides import Lead, StepLead
from trainer.nets.memory import emptied
from trainer.session import Session, State


@dataclass
class EpisodeTally:
    """Sums over the agent's own episodes that ended in a rollout; those that a guide took part in are left out.

    Attributes:
        episodes, successes, timeouts: counts.
        total_return, total_length: sums of undiscounted returns (without bonus) and of lengths in steps.
        all_episodes: own and led ones.
        led_steps, agreed_steps: steps that a guide made, and those of them in which the policy's own sample was the
            same.
    """

    episodes: int = 0
    successes: int = 0
    timeouts: int = 0
    total_return: float = 0.0
    total_length: int = 0
    all_episodes: int = 0
    led_steps: int = 0
    agreed_steps: int = 0


@dataclass
class Rollout:
    """T steps of E environments, time first.

    Attributes:
        actions: int64 (T, E, 4), as played. log_probs: float32 (T, E, 4) of the policy, before masking.
        values: float32 (T, E).
        rewards: float64 (T, E), bonus included.
        terminated, truncated, starts: bool (T, E); starts: the episode begins with this step.
        bootstrap: float64 (T, E), value of the state a truncated episode ended in; 0 elsewhere.
        next_value: float32 (E,), value of the state after the last step.
        pair_rows: int64 (T, E), row of the actor's `pairs`.
        memories: float32 (T / bptt, E, *shape), memory before each stretch of back-propagation.
        lead: what a guide did, as tensors (T, E, ...); None where none took part.
        tally: the episodes that ended.
        bonus: mean exploration bonus per frame.
    """

    actions: Tensor
    log_probs: Tensor
    values: Tensor
    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    starts: NDArray[np.bool_]
    bootstrap: NDArray[np.float64]
    next_value: Tensor
    pair_rows: Int64
    memories: Tensor
    lead: Lead[Tensor] | None = None
    tally: EpisodeTally = field(default_factory=EpisodeTally)
    bonus: float = 0.0


def collect(session: Session) -> Rollout:
    """Play `horizon` steps in every environment; `session.state` is advanced in place.

    Raises:
        ObservationError: an observation is outside its bounds.
        TrainingStopped: a reward or an output of the network is not finite.
    """
    actor, envs, state, config = session.actor, session.envs, session.state, session.config
    net, sizes = actor.net, actor.net.spec.action_sizes
    stretch = config.bptt or config.horizon
    rollout = _allocate(session)
    shape = (config.horizon, config.envs, sum(sizes))
    noise = heads.gumbel_noise(shape, session.generator).to(actor.device)  # (T, E, A)
    logits = torch.empty_like(noise)  # (T, E, A)
    leads: list[StepLead] = []
    actor.begin()
    with torch.no_grad():
        rows, features = actor.see(state.image, state.tokens, _ids(envs))  # (E,), (E, F)
        for t in range(config.horizon):
            rollout.pair_rows[t], rollout.starts[t] = rows, state.starts
            state.memory = emptied(state.memory, torch.from_numpy(state.starts).to(actor.device))
            if t % stretch == 0:
                rollout.memories[t // stretch] = state.memory
            output, state.memory = net.memory.step(features, state.memory)
            logits[t], rollout.values[t] = net.heads(output)
            rollout.actions[t] = heads.choose(logits[t] + noise[t], sizes)
            if session.guide is not None:
                leads.append(_follow(session, rollout, t))
            observation = _step(session, rollout, t)
            if t + 1 < config.horizon:
                rows, features = actor.see(observation["image"], observation["tokens"], _ids(envs))
        state.image, state.tokens = observation["image"].copy(), observation["tokens"].copy()
        rollout.next_value.copy_(_value_ahead(session))
        rollout.log_probs.copy_(heads.log_probs(logits, rollout.actions, sizes))
    if any(lead.led.any() or lead.weights.any() for lead in leads):
        rollout.lead = Lead(
            *(torch.from_numpy(np.stack(part)).to(actor.device) for part in zip(*leads, strict=True))
        )
    _check(rollout)
    return rollout


def _allocate(session: Session) -> Rollout:
    """An empty rollout; what the environments write is on the CPU, what the network writes on its device."""
    config, device = session.config, session.actor.device
    steps, count = config.horizon, config.envs
    shape = session.actor.net.memory.shape
    return Rollout(
        actions=torch.empty(steps, count, 4, dtype=torch.int64, device=device),
        log_probs=torch.empty(steps, count, 4, device=device),
        values=torch.empty(steps, count, device=device),
        rewards=np.zeros((steps, count)),
        terminated=np.zeros((steps, count), np.bool_),
        truncated=np.zeros((steps, count), np.bool_),
        starts=np.zeros((steps, count), np.bool_),
        bootstrap=np.zeros((steps, count)),
        next_value=torch.empty(count, device=device),
        pair_rows=np.zeros((steps, count), np.int64),
        memories=torch.empty(steps // (config.bptt or steps), count, *shape, device=device),
    )


def _follow(session: Session, rollout: Rollout, t: int) -> StepLead:
    """Ask the guide, and let it act where it leads."""
    state, guide = session.state, session.guide
    assert guide is not None, "internal: there is a guide"
    lead = guide.lead(session.envs, state.starts, min(session.frames / session.config.frames, 1.0))
    for name, part in zip(Lead._fields, lead, strict=True):
        shape = (*state.starts.shape, 4) if name == "actions" else state.starts.shape
        _require_shape(f"guide: {name} of lead", part, shape)
    if lead.led.any():
        led, actions = torch.from_numpy(lead.led), torch.from_numpy(lead.actions)
        own = rollout.actions[t].cpu()
        agrees = ((own == actions) | (heads.spoken_mask(actions) == 0)).all(1)
        rollout.tally.led_steps += int(led.sum())
        rollout.tally.agreed_steps += int((agrees & led).sum())
        rollout.actions[t] = torch.where(led[:, None], actions, own).to(rollout.actions.device)
    state.led |= lead.led
    return lead


def _step(session: Session, rollout: Rollout, t: int) -> dict[str, NDArray[Any]]:
    """Step the environments with the actions of step t, record what came of it, and return the observation."""
    observation: dict[str, NDArray[Any]]
    envs, state, config = session.envs, session.state, session.config
    observation, reward, terminated, truncated, infos = envs.step(rollout.actions[t].cpu().numpy())
    rollout.rewards[t], rollout.terminated[t], rollout.truncated[t] = reward, terminated, truncated
    ended = rollout.terminated[t] | rollout.truncated[t]  # (E,)
    cut = rollout.truncated[t] & ~rollout.terminated[t]  # (E,)
    state.returns += reward
    state.lengths += 1
    if config.bootstrap_timeouts and cut.any():
        which = np.flatnonzero(cut)
        rollout.bootstrap[t, which] = _values_at_the_end(session, infos["final_obs"], which)
    success = infos.get("success", np.zeros_like(ended))  # (E,)
    if ended.any():
        _count(rollout.tally, state, ended, cut, success)
    if session.tutor is not None:
        session.tutor.step(ended, success)
    if session.bonus is not None:
        paid = session.bonus.step(envs, observation["image"], ended)
        _require_shape("bonus: the result of step", paid, ended.shape)
        rollout.rewards[t] += paid
        rollout.bonus += float(paid.sum()) / rollout.rewards.size
    state.starts = ended
    return observation


def _require_shape(what: str, array: Any, shape: tuple[int, ...]) -> None:
    """Refuse an array of the user's code that NumPy would stretch or stumble over."""
    if np.shape(array) != shape:
        raise ValueError(f"{what}: got the shape {np.shape(array)}, expected {shape}")


def _ids(envs: Any) -> tuple[Int64, Int64]:
    return envs.image_ids(), envs.history_ids()


def _value_ahead(session: Session) -> Tensor:
    """Value of the states after the rollout, (E,); the next rollout begins with them and counts them then."""
    state, actor = session.state, session.actor
    memory = emptied(state.memory, torch.from_numpy(state.starts).to(actor.device))
    with _frozen_statistics(actor.net):
        _, features = actor.see(state.image, state.tokens, _ids(session.envs))
        value: Tensor = actor.net.heads(actor.net.memory.step(features, memory)[0])[1]
    return value


def _values_at_the_end(session: Session, final: dict[str, NDArray[Any]], which: Int64) -> NDArray[np.float32]:
    """Value of the last observations (E, ...) of the environments `which`, int64 (K,), given the memory before them."""
    net = session.actor.net
    probe = Actor(net, final["tokens"].shape[1])
    memory = session.state.memory[torch.from_numpy(which)]
    with _frozen_statistics(net):
        _, features = probe.see(final["image"][which], final["tokens"][which])
        value: NDArray[np.float32] = net.heads(net.memory.step(features, memory)[0])[1].cpu().numpy()
    return value


@contextlib.contextmanager
def _frozen_statistics(net: nn.Module) -> Iterator[None]:
    """Leave the running statistics of batch normalisation as they are, so that each observation counts once."""
    norms: list[Any] = [part for part in net.modules() if getattr(part, "track_running_stats", False)]
    for norm in norms:
        norm.track_running_stats = False
    try:
        yield
    finally:
        for norm in norms:
            norm.track_running_stats = True


def _count(
    tally: EpisodeTally,
    state: State,
    ended: NDArray[np.bool_],
    timed_out: NDArray[np.bool_],
    success: NDArray[np.bool_],
) -> None:
    """Add the episodes that ended to the tally and start new ones."""
    own = ended & ~state.led
    tally.all_episodes += int(ended.sum())
    tally.episodes += int(own.sum())
    tally.successes += int(success[own].sum())
    tally.timeouts += int(timed_out[own].sum())
    tally.total_return += float(state.returns[own].sum())
    tally.total_length += int(state.lengths[own].sum())
    state.returns[ended], state.lengths[ended], state.led[ended] = 0, 0, False


def _check(rollout: Rollout) -> None:
    """Refuse a rollout that would poison the weights."""
    if not np.isfinite(rollout.rewards).all():
        raise TrainingStopped("a reward is not a finite number")
    if not bool(torch.isfinite(rollout.values).all() & torch.isfinite(rollout.log_probs).all()):
        raise TrainingStopped("the network's output is not a finite number")
