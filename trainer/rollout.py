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
from trainer.crew import SOLO, Crew
from trainer.curricula import Tutor
from trainer.distinct import Int64
from trainer.errors import TrainingStopped
from trainer.team import ALONE, Team


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
        rewards: float64 (T, E), bonus included.
        terminated, truncated, starts: bool (T, E); starts: the episode begins with this step.
        bootstrap: float64 (T, E), value of the state a truncated episode ended in; 0 elsewhere.
        next_value: float32 (E,), value of the state after the last step.
        pair_rows: int64 (T, E), row of the actor's `pairs`.
        memories: float32 (T / bptt, 2, E, M), memory before each stretch of back-propagation.
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
    tutor: Tutor | None = None,
    team: Team = ALONE,
    crew: Crew = SOLO,
) -> Rollout:
    """Play `config.horizon` steps in every environment of this process; `state` is advanced in place.

    Raises:
        ObservationError: an observation is outside its bounds.
        TrainingStopped: a reward or an output of the network is not finite.
    """
    net, sizes = actor.net, actor.net.spec.action_sizes
    stretch = config.bptt or config.horizon
    rollout = _allocate(actor, config, len(state.starts))
    # Every process draws the noise of all environments, so that what each samples does not depend on their number.
    drawn = heads.gumbel_noise((config.horizon, team.size * len(state.starts), sum(sizes)), generator)
    noise = team.mine(drawn, 1).to(actor.device)
    logits = torch.empty_like(noise)
    actor.begin()
    with torch.no_grad():
        rows, features = actor.see(state.image, state.tokens, _ids(envs), crew)
        for t in range(config.horizon):
            rollout.pair_rows[t] = rows
            _note_starts(rollout, state, t)
            if t % stretch == 0:
                rollout.memories[t // stretch] = state.memory
            state.memory = net.memory.step(features, state.memory)
            logits[t], rollout.values[t] = net.heads(state.memory[0])
            rollout.actions[t] = heads.choose(logits[t] + noise[t], sizes)
            observation = _step(actor, envs, state, config, bonus, tutor, rollout, t)
            rows, features = actor.see(observation["image"], observation["tokens"], _ids(envs), crew)
        state.image, state.tokens = observation["image"].copy(), observation["tokens"].copy()
        kept = torch.from_numpy(~state.starts).to(actor.device)[:, None]
        rollout.next_value.copy_(net.heads(net.memory.step(features, state.memory * kept)[0])[1])
        rollout.log_probs.copy_(heads.log_probs(logits, rollout.actions, sizes))
    _check(rollout)
    return rollout


def _allocate(actor: Actor, config: TrainConfig, count: int) -> Rollout:
    """An empty rollout; what the environments write is on the CPU, what the network writes on its device."""
    steps, device = config.horizon, actor.device
    memories = torch.empty(steps // (config.bptt or steps), 2, count, actor.net.memory.size, device=device)
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
        memories=memories,
    )


def _note_starts(rollout: Rollout, state: RolloutState, t: int) -> None:
    """Record where episodes begin and empty the memory there."""
    rollout.starts[t] = state.starts
    if state.starts.any():
        state.memory[:, torch.from_numpy(state.starts).to(state.memory.device)] = 0


def _step(
    actor: Actor,
    envs: Any,
    state: RolloutState,
    config: TrainConfig,
    bonus: Bonus | None,
    tutor: Tutor | None,
    rollout: Rollout,
    t: int,
) -> dict[str, NDArray[Any]]:
    """Step the environments with the actions of step t, record what came of it, and return the observation."""
    observation: dict[str, NDArray[Any]]
    observation, reward, terminated, truncated, infos = envs.step(rollout.actions[t].cpu().numpy())
    rollout.rewards[t], rollout.terminated[t], rollout.truncated[t] = reward, terminated, truncated
    ended = rollout.terminated[t] | rollout.truncated[t]
    cut = rollout.truncated[t] & ~rollout.terminated[t]
    state.returns += reward
    state.lengths += 1
    if config.bootstrap_timeouts and cut.any():
        which = np.flatnonzero(cut)
        rollout.bootstrap[t, which] = _value(actor, final_observation(infos, which), state.memory[:, which])
    if ended.any():
        _count(rollout.tally, state, ended, cut, infos)
    if tutor is not None:
        tutor.step(ended, ended_info(infos, "success", ended & False).astype(np.bool_))
    if bonus is not None:
        paid = bonus.step(envs, observation["image"], ended)
        rollout.rewards[t] += paid
        rollout.bonus += float(paid.sum()) / rollout.rewards.size
    state.starts = ended
    return observation


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


def _check(rollout: Rollout) -> None:
    """Refuse a rollout that would poison the weights."""
    if not np.isfinite(rollout.rewards).all():
        raise TrainingStopped("a reward is not a finite number")
    if not bool(torch.isfinite(rollout.values).all() & torch.isfinite(rollout.log_probs).all()):
        raise TrainingStopped("the network's output is not a finite number")
