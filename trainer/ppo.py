"""Proximal policy optimisation, top to bottom: advantages, loss, update of a rollout, training loop.

Sources: Schulman et al. 2017 (PPO), Schulman et al. 2016 (GAE). Axes: T steps of a rollout, E environments, N frames of
a minibatch, A choices of all heads side by side.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn

from trainer import actions as heads
from trainer import checkpoint as checkpoints
from trainer.config import RunConfig
from trainer.errors import CheckpointError, ObservationError, TrainingStopped
from trainer.logging import MetricsLog, WandbTracker, episode_metrics, guide_metrics, record_start
from trainer.minibatch import Batch, Minibatch, minibatches
from trainer.rollout import Rollout, collect
from trainer.session import Session

Mapper = Callable[[Callable[[Minibatch], Any], Iterable[Minibatch]], Iterable[Any]]
"""`map`, or that of a pool of threads."""


# -- advantages ---------------------------------------------------------------------------------------------------


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
    goes_on = (~(terminated | truncated)).to(values.dtype)  # (T, E)
    after_cut = bootstrap * (truncated & ~terminated).to(values.dtype)  # (T, E)
    following = torch.cat((values[1:], next_value[None]))  # (T, E)
    deltas = rewards + gamma * (following * goes_on + after_cut) - values  # (T, E)
    advantages = torch.empty_like(deltas)
    running = torch.zeros_like(next_value)  # (E,)
    for t in range(len(deltas) - 1, -1, -1):
        running = deltas[t] + gamma * gae_lambda * goes_on[t] * running
        advantages[t] = running
    return advantages


def estimate_advantages(session: Session, rollout: Rollout) -> Batch:
    """All frames of a rollout, (T, E, ...), with advantages as the loss takes them, and returns."""
    config, move = session.config, session.actor.move
    advantages = compute_gae(
        move(rollout.rewards).float(),
        rollout.values,
        rollout.next_value,
        move(rollout.terminated),
        move(rollout.truncated),
        move(rollout.bootstrap).float(),
        config.gamma,
        config.gae_lambda,
    )
    returns = advantages + rollout.values
    own = advantages if rollout.lead is None else advantages[~rollout.lead.led]
    if config.normalize_advantages and len(own):  # a guide may have made every step
        advantages = (advantages - own.mean()) / (own.std(correction=0) + 1e-8)
    return Batch(rollout.actions, rollout.log_probs, rollout.values, advantages, returns, rollout.lead)


# -- loss ---------------------------------------------------------------------------------------------------------


class LossParts(NamedTuple):
    """Parts of the loss, scalars; all but the first are without gradients.

    Attributes:
        loss: what is minimised.
        policy_loss, value_loss, entropy: its terms before their coefficients; entropy in nats.
        approx_kl: estimated divergence of the new policy from the one that acted (Schulman 2020, k3).
        clip_fraction: share of ratios outside the clipping range.
        imitation_loss: cross-entropy between the policy and a guide's actions.
    """

    loss: Tensor
    policy_loss: Tensor
    value_loss: Tensor
    entropy: Tensor
    approx_kl: Tensor
    clip_fraction: Tensor
    imitation_loss: Tensor


STATISTICS = (*LossParts._fields, "grad_norm")
"""What is known of a gradient step; the last is the gradient's norm before clipping."""


def ppo_loss(
    batch: Batch,
    logits: Tensor,
    values: Tensor,
    sizes: tuple[int, ...],
    config: RunConfig,
    entropy_coef: float,
) -> LossParts:
    """PPO's clipped loss (Schulman et al. 2017, equations 7 and 9) for an action of four heads.

    Template and noun count in the ratio only where something was said. With `loss="joint"` the ratio is that of the
    whole action and the entropy that of the joint distribution. With `"per_head"` each head has its own ratio, clip,
    entropy and value term, masked, and the four are averaged, as in the released SocialAI code.

    Frames that a guide led have no policy and no entropy term: PPO's ratio means nothing where another policy acted.

    Args:
        batch: the frames and what the acting policy thought of them.
        logits: (N, A) of the present policy.
        values: (N,) of the present critic.
        sizes: choices of each head.
        config: coefficients.
        entropy_coef: the entropy's weight at this time of the run.
    """
    log_probs, entropies = heads.log_probs_and_entropies(logits, batch.actions, sizes)  # (N, 4) each
    mask = heads.spoken_mask(batch.actions)  # (N, 4)
    own = torch.ones_like(values) if batch.lead is None else (~batch.lead.led).to(values.dtype)  # (N,)
    change = (log_probs - batch.log_probs) * mask * own[:, None]  # (N, 4)
    log_ratio = change.sum(-1, keepdim=True) if config.loss == "joint" else change  # (N, 1) or (N, 4)
    ratio = log_ratio.exp()
    advantage = batch.advantages[:, None]  # (N, 1)
    clipped = ratio.clamp(1 - config.clip, 1 + config.clip)
    policy = -torch.minimum(ratio * advantage, clipped * advantage) * own[:, None]  # (N, 1) or (N, 4)
    value = (values - batch.returns).square()  # (N,)
    if config.clip_value:
        near = batch.values + (values - batch.values).clamp(-config.clip, config.clip)
        value = torch.maximum(value, (near - batch.returns).square())
    if config.loss == "joint":
        entropy = heads.joint_entropy(logits, entropies, sizes) * own  # (N,)
        policy_term, value_term, entropy_term = policy.mean(), value.mean(), entropy.mean()
    else:
        entropy = (entropies * mask).sum(-1) * own  # (N,), of the heads that took part
        policy_term, value_term = (policy * mask).mean(), (value[:, None] * mask).mean()
        entropy_term = entropy.mean() / len(sizes)
    total = policy_term + config.value_coef * value_term - entropy_coef * entropy_term
    imitation = torch.zeros((), device=logits.device)
    if batch.lead is not None:
        imitation = imitation_loss(logits, batch.lead.actions, batch.lead.weights, sizes)
        total = total + config.imitation_coef * imitation
    with torch.no_grad():
        kl = (ratio - 1 - log_ratio).mean()
        clip_fraction = ((ratio - 1).abs() > config.clip).float().mean()
        known = (policy_term, value_term, entropy.mean(), kl, clip_fraction, imitation)
        return LossParts(total, *(part.detach() for part in known))


def imitation_loss(logits: Tensor, actions: Tensor, weights: Tensor, sizes: tuple[int, ...]) -> Tensor:
    """Weighted mean cross-entropy between the policy and given actions: behaviour cloning (Pomerleau 1991).

    Args:
        logits: (N, A) of the policy.
        actions: int64 (N, 4); template and noun count only where they speak.
        weights: (N,) of the frames.
        sizes: choices of each head.
    """
    log_probs = heads.log_probs(logits, actions, sizes) * heads.spoken_mask(actions)  # (N, 4)
    return -(log_probs.sum(-1) * weights).mean()


# -- update -------------------------------------------------------------------------------------------------------


def update(session: Session, rollout: Rollout, mapper: Mapper = map) -> dict[str, float]:
    """Improve the network on one rollout: `epochs` passes over its minibatches, each a gradient step.

    A minibatch's shares are differentiated by the mapper's threads; their gradients are added up.

    Returns:
        Means over the minibatches of `STATISTICS` by name, and the share of the value's variance that the critic
        explained.

    Raises:
        TrainingStopped: a loss or a gradient is not finite; the weights are as the last good step left them.
    """
    limit = session.config.target_kl
    batch = estimate_advantages(session, rollout)
    steps: list[Tensor] = []
    for shares in minibatches(session, rollout, batch):
        steps.append(_step(session, shares, mapper))
        if limit is not None and float(steps[-1][STATISTICS.index("approx_kl")]) > limit:
            break
    means = torch.stack(steps).mean(0).tolist()
    unexplained = (batch.returns - batch.values).var(correction=0) / (batch.returns.var(correction=0) + 1e-8)
    return dict(zip(STATISTICS, means, strict=True)) | {"explained_variance": 1 - float(unexplained)}


def _step(session: Session, shares: Sequence[Minibatch], mapper: Mapper) -> Tensor:
    """One gradient step on a minibatch; returns `STATISTICS`, the gradient's norm before clipping among them.

    Raises:
        TrainingStopped: the loss or the gradient is not finite; the weights are as they were.
    """
    net, config = session.actor.net, session.config
    parameters = list(net.parameters())
    total = sum(share.frames for share in shares)
    sizes, entropy_coef = net.spec.action_sizes, session.entropy_coef

    def differentiate(share: Minibatch) -> tuple[Tensor, Sequence[Tensor | None]]:
        parts = [ppo_loss(*part, sizes, config, entropy_coef) for part in share.evaluate(net)]
        weight = share.frames / total
        loss = torch.stack([part.loss for part in parts]).mean() * weight
        statistics = torch.stack([torch.stack(part).detach() for part in parts]).mean(0) * weight
        return statistics, torch.autograd.grad(loss, parameters, allow_unused=True)

    results = list(mapper(differentiate, shares))
    for parameter, *gradients in zip(parameters, *(gradients for _, gradients in results), strict=True):
        _add_up(parameter, gradients)
    statistics = torch.stack([row for row, _ in results]).sum(0)
    if not bool(torch.isfinite(statistics[0])):
        raise TrainingStopped("the loss is not a finite number")
    norm = nn.utils.clip_grad_norm_(parameters, config.max_grad_norm)
    if not bool(torch.isfinite(norm)):
        raise TrainingStopped("a gradient is not a finite number")
    session.optimizer.step()
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


# -- training loop ------------------------------------------------------------------------------------------------


def train(
    config: RunConfig,
    envs: Any,
    run_dir: Path,
    progress: Callable[[Mapping[str, Any]], None] | None = None,
    resume: bool = False,
    tracker: WandbTracker | None = None,
    program: Any = None,
) -> Path:
    """Train a network and return the path of its final checkpoint.

    Writes `starts.jsonl`, `metrics.jsonl`, TensorBoard events and `checkpoints/` into `run_dir`. A resumed run
    continues from the newest intact checkpoint as if it had never stopped: the same weights to the bit on the same
    CPU with the same number of threads.

    Args:
        config: every number.
        envs: vector environment with same-step auto-reset, as `socialai_dsl.make_vec` gives; fresh, not yet reset.
        run_dir: directory of the run, made if missing.
        progress: called after every update with its row, as `metrics.jsonl` has it.
        resume: continue the run in `run_dir`.
        tracker: takes the figures elsewhere as well.
        program: of the scenario that the agent is for, where a guide plays a variant of it; default the environments'.

    Raises:
        ValueError: configuration and environments do not fit, or the tracker cannot begin.
        CheckpointError: there is nothing to resume, or it is damaged or of another run.
        TrainingStopped: something is not finite or out of bounds, or the disk is full; the last good checkpoint is
            intact.
    """
    session = Session.start(config, envs, program)
    folder = run_dir / checkpoints.FOLDER
    if resume:
        if not folder.is_dir():
            raise CheckpointError(f"{run_dir}: nothing to resume, there are no checkpoints")
        session.load(checkpoints.read(folder))
    with _explained(session, folder):
        run_dir.mkdir(parents=True, exist_ok=True)
        with MetricsLog(run_dir, session.update, config.tensorboard, session.frames, tracker) as log:
            if not resume:
                _save(session, folder)
            record_start(run_dir, session.update, session.frames, config)
            with threads_of(session) as mapper:
                _loop(session, folder, log, mapper, progress)
            return _save(session, folder)


def _loop(
    session: Session,
    folder: Path,
    log: MetricsLog,
    mapper: Mapper,
    progress: Callable[[Mapping[str, Any]], None] | None,
) -> None:
    """Collect, learn, record, save, until all updates are made."""
    config, envs = session.config, session.envs
    session.actor.net.train()
    counted, then = envs.counters(), time.perf_counter()
    while session.update < config.updates:
        for group in session.optimizer.param_groups:
            group["lr"] = session.learning_rate
        rollout = collect(session)
        losses = update(session, rollout, mapper)
        _check(session, losses)
        session.update += 1
        before, counted = counted, envs.counters()
        before_time, then = then, time.perf_counter()
        row: dict[str, Any] = {
            "update": session.update,
            "frames": session.frames,
            "frames_per_second": round(config.frames_per_update / (then - before_time), 1),
            **losses,
            "bonus": rollout.bonus,
            **episode_metrics(rollout.tally, before, counted),
        }
        if config.guide == "none":
            del row["imitation_loss"]
        else:
            row |= guide_metrics(rollout.tally, config.frames_per_update)
        log.write(row)
        if session.update % config.checkpoint_every == 0 and session.update < config.updates:
            log.sync()
            _save(session, folder)
        if progress is not None:
            progress(row)


@contextlib.contextmanager
def threads_of(session: Session) -> Iterator[Mapper]:
    """Threads that each differentiate a share of a minibatch.

    A recurrent network is thousands of small operations. Split inside each operation, as PyTorch does, threads spend
    their time meeting at barriers; whole shares meet once a step. So each thread runs PyTorch on one core. Networks
    whose frames depend on the rest of their batch, and GPUs, are left to PyTorch.
    """
    threads, before = session.config.threads, torch.get_num_threads()
    shared = session.actor.net.distinct and session.actor.device.type == "cpu"
    torch.set_num_threads(1 if shared else threads)
    try:
        if not shared or threads == 1:
            yield map
            return
        with ThreadPoolExecutor(threads, initializer=torch.set_num_threads, initargs=(1,)) as pool:
            yield pool.map
    finally:
        torch.set_num_threads(before)


def _save(session: Session, folder: Path) -> Path:
    """Write a checkpoint and return its path."""
    return checkpoints.write(folder, session.checkpoint(), session.config.keep_checkpoints)


def _check(session: Session, losses: Mapping[str, float]) -> None:
    """Refuse figures of the update, weights, and statistics of the network that no checkpoint may hold."""
    for name, figure in losses.items():
        if not math.isfinite(figure):
            raise TrainingStopped(f"{name} of the update is not a finite number")
    numbers = {
        name: value for name, value in session.actor.net.state_dict().items() if value.is_floating_point()
    }
    finite = torch.stack([torch.isfinite(value).all() for value in numbers.values()]).tolist()
    if not all(finite):
        name = list(numbers)[finite.index(False)]
        raise TrainingStopped(f"the network's {name} holds numbers that are not finite")


@contextlib.contextmanager
def _explained(session: Session, folder: Path) -> Iterator[None]:
    """Say where a run stopped, why, and what is left of it."""
    try:
        yield
    except BrokenPipeError:  # of the terminal that progress is shown on, not of a file
        raise
    except (TrainingStopped, ObservationError, OSError) as error:
        saved = max(folder.glob("*.safetensors"), default=None)
        kept = f"the last good checkpoint is {saved}" if saved else "there is no checkpoint yet"
        reason = f"cannot write: {error}" if isinstance(error, OSError) else str(error)
        where = f"training stopped after {session.frames} frames (update {session.update})"
        raise TrainingStopped(f"{where}: {reason}; {kept}") from error
