"""This module plays the environments with the current policy and keeps what an update needs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from trainer import actions as heads
from trainer.actor import Actor
from trainer.bonus import Bonus
from trainer.config import TrainConfig
from trainer.distinct import Int64
from trainer.errors import TrainingStopped


@dataclass
class EpisodeTally:
    """Sums over the episodes that ended in a rollout.

    Attributes:
        episodes, successes, timeouts: counts.
        total_return, total_length: sums of undiscounted returns (without bonus) and of lengths in steps.
    """

    episodes: int = 0
    successes: int = 0
    timeouts: int = 0
    total_return: float = 0.0
    total_length: int = 0


@dataclass
class RolloutState:
    """What one rollout hands to the next.

    Attributes:
        image: uint8 (E, H, W, C), tokens: int16 (E, L): the current observation.
        starts: bool (E,), whether the current observation begins an episode.
        memory: float32 (2, E, M).
        returns: float64 (E,), lengths: int64 (E,) of the running episodes.
    """

    image: NDArray[np.uint8]
    tokens: NDArray[np.int16]
    starts: NDArray[np.bool_]
    memory: Tensor
    returns: NDArray[np.float64]
    lengths: NDArray[np.int64]

    @classmethod
    def initial(cls, observation: dict[str, NDArray[Any]], memory: Tensor) -> RolloutState:
        """The state after a reset that returned `observation`, with an empty memory."""
        count = len(observation["tokens"])
        return cls(
            observation["image"].copy(),
            observation["tokens"].copy(),
            np.ones(count, np.bool_),
            memory,
            np.zeros(count),
            np.zeros(count, np.int64),
        )


@dataclass
class Rollout:
    """T steps of E environments, time first.

    Attributes:
        actions: int64 (T, E, 4). log_probs: float32 (T, E, 4), before masking. values: float32 (T, E).
        rewards: float32 (T, E), bonus included.
        terminated, truncated, starts: bool (T, E); starts: the episode begins with this step.
        bootstrap: float32 (T, E), value of the state a truncated episode ended in; 0 elsewhere.
        next_value: float32 (E,), value of the state after the last step.
        pair_rows: int64 (T, E), row of the actor's `pairs`.
        memories: float32 (T / bptt, 2, E, M), memory before each stretch of back-propagation.
        tally: the episodes that ended.
        bonus: mean exploration bonus per frame.
    """

    actions: Tensor
    log_probs: Tensor
    values: Tensor
    rewards: Tensor
    terminated: Tensor
    truncated: Tensor
    starts: Tensor
    bootstrap: Tensor
    next_value: Tensor
    pair_rows: Int64
    memories: Tensor
    tally: EpisodeTally = field(default_factory=EpisodeTally)
    bonus: float = 0.0


def ended_info(infos: dict[str, Any], key: str, default: NDArray[Any]) -> NDArray[Any]:
    """Value of `key` at the episodes' ends, shape (E,): from `infos` itself or from its `final_info`."""
    if key in infos:
        return np.asarray(infos[key])
    return np.asarray(infos.get("final_info", {}).get(key, default))


def final_observation(infos: dict[str, Any], ended: Int64) -> dict[str, NDArray[Any]]:
    """Last observations of the environments `ended`, from either form Gymnasium gives `final_obs` in."""
    final = infos["final_obs"]
    if isinstance(final, dict):
        return {key: np.asarray(value)[ended] for key, value in final.items()}
    return {key: np.stack([final[e][key] for e in ended]) for key in ("image", "tokens")}


def collect(
    actor: Actor,
    envs: Any,
    state: RolloutState,
    config: TrainConfig,
    generator: torch.Generator,
    bonus: Bonus | None,
) -> Rollout:
    """Play `config.horizon` steps in every environment; `state` is advanced in place.

    Raises:
        TrainingStopped: an observation is outside its bounds, or a reward or a value is not finite.
    """
    net, sizes = actor.net, actor.net.spec.action_sizes
    steps, count = config.horizon, len(state.starts)
    stretch = config.bptt or steps
    device = actor.device
    noise = heads.gumbel_noise((steps, count, sum(sizes)), generator).to(device)
    logits = torch.empty(steps, count, sum(sizes), device=device)
    values = torch.empty(steps, count, device=device)
    actions = torch.empty(steps, count, 4, dtype=torch.int64, device=device)
    memories = torch.empty(steps // stretch, 2, count, net.memory.size, device=device)
    rewards, bootstrap = np.zeros((steps, count)), np.zeros((steps, count), np.float32)
    terminated, truncated, starts = (np.zeros((steps, count), np.bool_) for _ in range(3))
    pair_rows = np.zeros((steps, count), np.int64)
    tally, paid = EpisodeTally(), 0.0

    actor.begin()
    with torch.no_grad():
        pair_rows[0], features = actor.see(state.image, state.tokens, _ids(envs))
        for t in range(steps):
            starts[t] = state.starts
            if state.starts.any():
                state.memory[:, torch.from_numpy(state.starts).to(device)] = 0
            if t % stretch == 0:
                memories[t // stretch] = state.memory
            state.memory = net.memory.step(features, state.memory)
            logits[t], values[t] = net.heads(state.memory[0])
            actions[t] = heads.choose(logits[t] + noise[t], sizes)
            observation, rewards[t], terminated[t], truncated[t], infos = envs.step(actions[t].cpu().numpy())
            ended = terminated[t] | truncated[t]
            state.returns += rewards[t]
            state.lengths += 1
            if ended.any():
                if config.bootstrap_timeouts and (cut := np.flatnonzero(truncated[t] & ~terminated[t])).size:
                    bootstrap[t, cut] = _value(actor, final_observation(infos, cut), state.memory[:, cut])
                _count(tally, state, ended, truncated[t] & ~terminated[t], infos)
            if bonus is not None:
                extra = bonus.step(envs, observation["image"], ended)
                rewards[t] += extra
                paid += float(extra.sum())
            state.starts = ended
            following, features = actor.see(observation["image"], observation["tokens"], _ids(envs))
            if t + 1 < steps:
                pair_rows[t + 1] = following
        state.image, state.tokens = observation["image"].copy(), observation["tokens"].copy()
        memory = state.memory * torch.from_numpy(~state.starts).to(device)[:, None]
        next_value = net.heads(net.memory.step(features, memory)[0])[1]
        log_probs = heads.log_probs(logits, actions, sizes)
    _check(actor, rewards, values)
    return Rollout(
        actions,
        log_probs,
        values,
        *(
            torch.from_numpy(array).to(device)
            for array in (rewards.astype(np.float32), terminated, truncated, starts)
        ),
        torch.from_numpy(bootstrap).to(device),
        next_value,
        pair_rows,
        memories,
        tally,
        paid / (steps * count),
    )


def _ids(envs: Any) -> tuple[Int64, Int64]:
    return envs.image_ids(), envs.history_ids()


def _value(actor: Actor, observation: dict[str, NDArray[Any]], memory: Tensor) -> NDArray[np.float32]:
    """Value of a few observations that are not part of the rollout, given the memory before them."""
    probe = Actor(actor.net, observation["tokens"].shape[1])
    _, features = probe.see(observation["image"], observation["tokens"])
    value: NDArray[np.float32] = actor.net.heads(actor.net.memory.step(features, memory)[0])[1].cpu().numpy()
    return value


def _count(
    tally: EpisodeTally,
    state: RolloutState,
    ended: NDArray[np.bool_],
    timed_out: NDArray[np.bool_],
    infos: dict[str, Any],
) -> None:
    """Add the episodes that ended to the tally and start new ones."""
    success = ended_info(infos, "success", np.zeros(len(ended), np.bool_))
    tally.episodes += int(ended.sum())
    tally.successes += int(success[ended].astype(np.bool_).sum())
    tally.timeouts += int(timed_out.sum())
    tally.total_return += float(state.returns[ended].sum())
    tally.total_length += int(state.lengths[ended].sum())
    state.returns[ended] = 0
    state.lengths[ended] = 0


def _check(actor: Actor, rewards: NDArray[np.float64], values: Tensor) -> None:
    """Refuse a rollout that would poison the weights."""
    spec = actor.net.spec
    if not np.isfinite(rewards).all():
        raise TrainingStopped("a reward is not a finite number")
    if not bool(torch.isfinite(values).all()):
        raise TrainingStopped("a value estimate is not a finite number")
    if (actor.images.data.max(axis=(0, 1, 2)) > np.array(spec.image_high)).any():
        raise TrainingStopped("an observed image is outside the bounds of its space")
    words = actor.histories.data
    if words.min() < 0 or words.max() >= spec.vocabulary_size:
        raise TrainingStopped("an observed token is not in the vocabulary")
