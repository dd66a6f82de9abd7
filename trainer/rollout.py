"""Rollouts: plays the environments with the current policy and keeps what an update needs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from socialai_dsl.trainer import actions as heads
from socialai_dsl.trainer.bonus import BatchStep
from socialai_dsl.trainer.errors import require_finite
from socialai_dsl.trainer.extensions import require_array, require_shape
from socialai_dsl.trainer.features import Actor, Int64, content_ids
from socialai_dsl.trainer.guides import Guide, Lead
from socialai_dsl.trainer.logging import Tally
from socialai_dsl.trainer.nets.memory import emptied
from socialai_dsl.trainer.session import Session, session_of


class Rollout(NamedTuple):
    """T steps of E environments, time first, on the network's device.

    Attributes:
        actions: int64 (T, E, H), as played.
        values, rewards: float32 (T, E); rewards with the bonus.
        forgets: bool (T, E), whether memory is emptied before this step.
        ended: bool (T, E), whether what returns add up ended with it: the episode, or its session.
        bootstrap: float32 (T, E), value of the state a time-out cut an episode off in; 0 elsewhere.
        pair_rows: int64 (T, E), row of the actor's `pairs`; on the CPU.
        log_probs: float32 (T, E, H) of the policy, before masking.
        next_value: float32 (E,), value of the state after the last step.
        memories: float32 (T / bptt, E, *shape), memory before each stretch of back-propagation.
        lead: what a guide did, (T, E, ...); None where none took part.
        tally: counts and sums for the log.
    """

    actions: Tensor
    values: Tensor
    rewards: Tensor
    forgets: Tensor
    ended: Tensor
    bootstrap: Tensor
    pair_rows: Tensor
    log_probs: Tensor
    next_value: Tensor
    memories: Tensor
    lead: Lead | None
    tally: Tally


@torch.no_grad()
def collect(session: Session, choose: Callable[[Tensor], Tensor] | None = None) -> Rollout:
    """Play `horizon` steps in every environment; `session.state` is advanced in place.

    Args:
        session: the run.
        choose: makes actions, int64 (E, H), of the network's logits (E, A); by default the policy samples.

    Raises:
        ValueError: something of the user's returned what it must not.
        ObservationError: an observation is outside its bounds.
        TrainingStopped: a reward or an output of the network is not finite.
    """
    actor, state, config = session.actor, session.state, session.config
    net, sizes, tally = actor.net, actor.net.spec.action_sizes, Tally()
    shape = (config.horizon, config.envs, sum(sizes))
    noise = heads.gumbel_noise(shape, session.generator).to(actor.device)  # (T, E, A)
    steps, memories, leads = [], [], []
    actor.begin()
    for t in range(config.horizon):
        rows, features = actor.see(state.image, state.tokens, _ids(session))  # (E,), (E, F)
        forgets = actor.move(state.forgets)  # (E,)
        memory = emptied(state.memory, forgets)  # (E, *shape)
        if t % (config.bptt or config.horizon) == 0:
            memories.append(memory)
        output, state.memory = net.memory.step(features, memory)
        logits, values = net.heads(output)  # (E, A), (E,)
        require_shape("net: logits of heads", logits, shape[1:])
        require_shape("net: values of heads", values, shape[1:2])
        actions = heads.choose(logits + noise[t], sizes) if choose is None else choose(logits)  # (E, H)
        require_shape("algorithm: the actions chosen", actions, (config.envs, len(sizes)))
        if session.guide is not None:
            actions, given = _follow(session, session.guide, actions, tally)
            leads.append(given)
        reward, ended, bootstrap = map(actor.move, _step(session, actions, tally))  # (E,) each
        steps.append((actions, values, reward, forgets, ended, bootstrap, torch.from_numpy(rows), logits))
    next_value = _value(
        actor, emptied(state.memory, actor.move(state.forgets)), state.image, state.tokens, _ids(session)
    )
    *columns, logits = (torch.stack(column) for column in zip(*steps, strict=True))
    log_probs, _ = heads.log_probs_and_entropies(logits, columns[0], sizes)
    lead = None
    if any(given.led.any() or given.weights.any() for given in leads):
        lead = Lead(*map(torch.stack, zip(*leads, strict=True)))
    rollout = Rollout._make((*columns, log_probs, next_value, torch.stack(memories), lead, tally))
    require_finite("a reward", rollout.rewards)
    require_finite("the network's output", rollout.log_probs)
    require_finite("the network's output", rollout.values)
    return rollout


def _ids(session: Session) -> tuple[Int64, Int64]:
    """Ids of the current images, as the network sees them, and histories, int64 (E,) each."""
    envs, state = session.envs, session.state
    images = content_ids(state.image) if state.seen.size else envs.image_ids()
    return images, envs.history_ids()


def _follow(session: Session, guide: Guide, own: Tensor, tally: Tally) -> tuple[Tensor, Lead]:
    """Ask the guide; returns the actions to play, int64 (E, H): its own where it leads, else those of the policy."""
    state, move = session.state, session.actor.move
    found = guide.lead(session.envs, state.starts, session.progress)
    given = _checked(found, tuple(own.shape), session.actor.net.spec.action_sizes)
    state.led |= given.led
    lead = Lead(*map(move, given))
    silent = heads.spoken_mask(lead.actions, session.actor.net.spec.used) == 0  # (E, H)
    agrees = ((own == lead.actions) | silent).all(1)  # (E,)
    tally.led_steps += int(lead.led.sum())
    tally.agreed_steps += int((agrees & lead.led).sum())
    return torch.where(lead.led[:, None], lead.actions, own), lead


def _checked(found: Any, shape: tuple[int, ...], sizes: tuple[int, ...]) -> Lead:
    """What a guide returned, for actions of a shape (E, H) with so many choices of each head.

    Raises:
        ValueError: arrays of another shape or type, a choice that there is not, a negative weight.
        TrainingStopped: a weight is not finite.
    """
    if not isinstance(found, tuple) or len(found) != len(Lead._fields):
        raise ValueError(f"guide: lead returned {type(found).__name__}, expected Lead(actions, led, weights)")
    needed = ((shape, np.int64), (shape[:1], np.bool_), (shape[:1], np.float32))
    given = Lead(
        *(
            require_array(f"guide: {name} of lead", part, *one)
            for name, part, one in zip(Lead._fields, found, needed, strict=True)
        )
    )
    asked = given.led | (given.weights != 0)
    strange = asked & ((given.actions < 0) | (given.actions >= sizes)).any(1)  # (E,)
    if strange.any():
        row = int(strange.argmax())
        raise ValueError(
            f"guide: actions of lead: got {given.actions[row].tolist()} for environment {row}, expected whole numbers "
            f"from 0 to {[size - 1 for size in sizes]}"
        )
    require_finite("a weight that the guide's lead returned", torch.from_numpy(given.weights))
    if (given.weights < 0).any():
        raise ValueError(f"guide: weights of lead: got {given.weights.min():g}, expected at least 0")
    return given


def _step(
    session: Session, actions: Tensor, tally: Tally
) -> tuple[NDArray[Any], NDArray[np.bool_], NDArray[Any]]:
    """Step the environments; returns rewards with the bonus, where returns end, and their bootstrap, (E,) each."""
    envs, state, config = session.envs, session.state, session.config
    played = actions.cpu().numpy()
    observation, reward, terminated, truncated, infos = envs.step(played)
    ended, cut = terminated | truncated, truncated & ~terminated  # (E,)
    success = infos.get("success", np.zeros_like(ended))  # (E,)
    state.trials = (state.trials + ended) % session_of(envs)
    over = ended & (state.trials == 0) if config.returns == "session" else ended  # (E,)
    bootstrap, lost = np.zeros(len(ended), np.float32), cut & over
    if config.bootstrap_timeouts and lost.any():
        final, probe = infos["final_obs"], Actor(session.actor.net, state.tokens.shape[1])
        image, _ = probe.net.sight.look(final["image"][lost], final["tokens"][lost], state.seen[lost])
        values = _value(probe, state.memory[probe.move(lost)], image, final["tokens"][lost])
        bootstrap[lost] = values.cpu().numpy()
    state.seen[ended] = 0
    state.tokens, state.starts = observation["tokens"].copy(), ended
    state.image, state.seen = session.actor.net.sight.look(
        observation["image"].copy(), state.tokens, state.seen
    )
    state.returns += reward
    state.lengths += 1
    if session.tutor is not None:
        session.tutor.step(ended, success, state.lengths)
    if ended.any():
        tally.count(state, ended, cut, success)
        state.returns[ended], state.lengths[ended], state.led[ended] = 0, 0, False
    if session.bonus is not None:
        how = ended, success & ended, cut
        step = BatchStep(envs, observation["image"], played, reward, *how, session.now, session.progress)
        found = session.bonus.step(step)
        paid = require_array("bonus: the result of step", found, ended.shape, np.float64)
        require_finite("what the bonus paid", torch.from_numpy(paid).float())
        tally.bonus += float(paid.sum()) / config.frames_per_update
        reward = reward + paid
    return reward.astype(np.float32), over, bootstrap


def _value(actor: Actor, memory: Tensor, *observation: Any) -> Tensor:
    """Value, (K,), of an observation, as `Actor.see` takes it, given the memory before it.

    Running statistics of the network stay as they are: it meets the observation in the next rollout, or never acts on
    it, and each counts once.
    """
    net = actor.net
    statistics = [buffer.clone() for buffer in net.buffers()]
    _, features = actor.see(*observation)
    value: Tensor = net.heads(net.memory.step(features, memory)[0])[1]
    for buffer, before in zip(net.buffers(), statistics, strict=True):
        buffer.copy_(before)
    return value
