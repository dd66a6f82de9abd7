"""The update of the paper's code: chunks and their shifts, memories, batch statistics, and the step that results."""

import copy
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from socialai_dsl.trainer.chunks import chunk_starts, chunks
from socialai_dsl.trainer.config import RunConfig, configure
from socialai_dsl.trainer.policy import NetPolicy
from socialai_dsl.trainer.ppo import compute_gae, estimate_advantages, update
from socialai_dsl.trainer.rollout import Rollout, collect
from socialai_dsl.trainer.session import Session
from tests.trainer.fake_envs import EchoEnvs
from tests.trainer.plain import encode


def small(net: str = "paper-reference", **changes: Any) -> RunConfig:
    values: dict[str, Any] = {
        "envs": 6,
        "horizon": 8,
        "bptt": 4,
        "epochs": 2,
        "frames": 480,
        "threads": 1,
    }
    return configure(net="paper-reference", **(values | changes)).model_copy(update={"net": net})


def played(config: RunConfig) -> tuple[Session, Rollout]:
    """A session after two rollouts, so that the second begins in the middle of episodes."""
    session = Session.start(config, EchoEnvs(config.envs, length=8, chatter=0.4))
    session.actor.net.train()
    for _ in range(2):
        rollout = collect(session)
    assert rollout.forgets[1:].any(), "episodes must begin within the rollout"
    return session, rollout


# -- chunks -------------------------------------------------------------------------------------------------------


def test_chunks_lie_end_to_end() -> None:
    assert chunk_starts(2, 8, 4, shifted=False).tolist() == [[0, 0], [0, 4], [1, 0], [1, 4]]


def test_shifted_chunks_begin_half_a_chunk_later_and_the_last_is_dropped() -> None:
    assert chunk_starts(2, 12, 4, shifted=True).tolist() == [[0, 2], [0, 6], [1, 2], [1, 6]]
    assert chunk_starts(1, 40, 5, shifted=True)[:, 1].tolist() == [2, 7, 12, 17, 22, 27, 32]
    assert chunk_starts(1, 40, 10, shifted=True)[:, 1].tolist() == [5, 15, 25]


@pytest.mark.parametrize(("preset", "kept"), [("paper-reference", 3 / 4), ("paper-reference-tuned", 7 / 8)])
def test_the_presets_keep_the_published_share_of_the_frames(preset: str, kept: float) -> None:
    config = configure(net=preset)
    chunks = chunk_starts(config.envs, config.horizon, config.bptt, shifted=True)
    assert len(chunks) * config.bptt == kept * config.frames_per_update
    assert (chunks[:, 1] + config.bptt <= config.horizon).all()


# -- memories -----------------------------------------------------------------------------------------------------


class Steps:
    """Notes what goes into the memory and comes out of it, call by call."""

    def __init__(self, session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
        self.calls: list[tuple[Tensor, Tensor]] = []
        step = session.actor.net.memory.step

        def noted(inputs: Tensor, memory: Tensor) -> tuple[Tensor, Tensor]:
            output, after = step(inputs, memory)
            self.calls.append((memory.detach().clone(), after.detach().clone()))
            return output, after

        monkeypatch.setattr(session.actor.net.memory, "step", noted)


def rows(memories: Tensor) -> set[tuple[float, ...]]:
    """Memories (C, 2, M) as a set, since chunks come in any order."""
    return {tuple(memory.flatten().tolist()) for memory in memories}


def test_a_chunk_begins_with_the_memory_that_was_last_computed_for_its_first_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    config = small(epochs=3)
    session, rollout = played(config)
    rollout = rollout._replace(forgets=torch.zeros_like(rollout.forgets))  # memories go on for ever
    steps = Steps(session, monkeypatch)
    update(session, rollout)
    first, second, third = (steps.calls[epoch * 4 : epoch * 4 + 4] for epoch in range(3))
    assert rows(first[0][0]) == rows(rollout.memories.flatten(0, 1)), "those of the acting network"
    # Unshifted chunks hold steps 0-3 and 4-7, shifted ones 2-5. What step 1 returned is the memory before step 2.
    before_2_or_6 = rows(first[1][1])
    assert rows(second[0][0]) < before_2_or_6, "shifted chunks begin with memories of the epoch before"
    assert len(rows(second[0][0])) == 6
    before_4 = rows(second[1][1])
    assert len(before_4) == 6
    began = rows(third[0][0])
    assert began == rows(rollout.memories[0]) | before_4, (
        "step 0 is in no chunk but its own; 4 was met shifted"
    )


def test_memories_do_not_reach_into_an_episode(monkeypatch: pytest.MonkeyPatch) -> None:
    config = small(epochs=1)
    session, rollout = played(config)
    marks = torch.zeros_like(rollout.forgets)
    marks[6] = True  # the third step of each chunk that begins at 4
    rollout = rollout._replace(forgets=marks)
    steps = Steps(session, monkeypatch)
    update(session, rollout)
    empty = [(given == 0).flatten(1).all(1).sum().item() for given, _ in steps.calls]
    assert empty[1:] == [0, 6, 0], "six environments, each emptied before the marked step only"


def test_memories_not_yet_known_are_not_numbers() -> None:
    session, rollout = played(small())
    memories = next(chunks(session, rollout, estimate_advantages(session.config, rollout)))[0].memories
    assert memories.shape == (8, 6, 2, 128)
    assert torch.equal(memories[4, 3], rollout.memories[1][3])
    assert memories[[1, 2, 3, 5, 6, 7]].isnan().all()


# -- batch statistics ---------------------------------------------------------------------------------------------


@pytest.mark.thorough("trains the paper's network")
def test_batch_norm_sees_the_environments_while_acting_and_one_step_of_all_chunks_while_learning() -> None:
    config = configure(net="paper-reference")
    session = Session.start(config, EchoEnvs(16))
    net = session.actor.net.train()
    norms = [module for module in net.modules() if isinstance(module, nn.BatchNorm2d)]
    assert len(norms) == 6
    seen: list[int] = []
    norms[0].register_forward_hook(lambda _module, given, _result: seen.append(len(given[0])))
    rollout = collect(session)
    assert seen == [16] * 41, "each step's observations, and the one after the last for its value"
    assert {int(norm.num_batches_tracked) for norm in norms} == {40}, "which counts in the next rollout"
    seen.clear()
    update(session, rollout)
    assert seen == [64] * 10 + [48] * 10 + [64] * 10 + [48] * 10, "also in the running statistics"
    assert {int(norm.num_batches_tracked) for norm in norms} == {40 + 40}
    assert len(session.optimizer.state) == len(list(net.parameters()))
    assert {int(state["step"]) for state in session.optimizer.state.values()} == {4}, "one step an epoch"


def test_acting_normalises_by_the_batch_and_evaluation_by_the_running_statistics() -> None:
    config = small()
    session = Session.start(config, EchoEnvs(6))
    session.actor.net.train()
    image, tokens = session.state.image.copy(), session.state.tokens.copy()
    acting, playing = copy.deepcopy(session.actor.net), copy.deepcopy(session.actor.net)
    rollout = collect(session)

    by_batch = first_values(acting, image, tokens)
    assert torch.allclose(rollout.values[0], by_batch, atol=1e-5)
    policy = NetPolicy(playing, greedy=True)
    before = {name: value.clone() for name, value in playing.state_dict().items()}
    policy.act({"image": image, "tokens": tokens})
    assert all(torch.equal(before[name], value) for name, value in playing.state_dict().items())
    by_running = first_values(playing, image, tokens)
    assert not torch.allclose(by_running, by_batch, atol=1e-2)
    alone = first_values(playing, image[:1], tokens[:1])
    assert torch.allclose(alone, by_running[:1], atol=1e-5), "in evaluation nobody depends on the others"
    assert not torch.allclose(first_values(acting, image[:1], tokens[:1]), by_batch[:1], atol=1e-2)


@torch.no_grad()
def first_values(net: Any, image: np.ndarray, tokens: np.ndarray) -> Tensor:
    """Values of first observations, each history through PyTorch's own GRU."""
    texts = torch.stack([encode(net.dialogue, row) for row in net.reader.read(tokens)])
    each = torch.arange(len(image))
    features = net.perceive(net.prepare(torch.from_numpy(image)), texts, each, each)
    values: Tensor = net.heads(net.memory.step(features, net.memory.initial(len(image)))[0])[1]
    return values


def test_batch_statistics_make_the_first_ratios_differ_from_one() -> None:
    session, rollout = played(small(epochs=1))
    assert update(session, rollout)["approx_kl"] > 1e-6
    session, rollout = played(small(epochs=1, net="paper"))
    assert update(session, rollout)["approx_kl"] == pytest.approx(0, abs=1e-6), (
        "without batch statistics they are one"
    )


# -- the step -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("net", ["paper-reference", "fast"])
def test_the_update_is_that_of_a_plain_loop_over_frames(net: str) -> None:
    """Everything once more in plain PyTorch, frame by frame, head by head, in float64, over shifts both ways."""
    config = small(net=net, epochs=3, max_grad_norm=0.05)
    session, rollout = played(config)
    session.actor.net.double()
    rollout = rollout._replace(
        values=rollout.values.double(),
        log_probs=rollout.log_probs.double(),
        next_value=rollout.next_value.double(),
        memories=rollout.memories.double(),
    )
    twin = copy.deepcopy(session.actor.net)
    expected = plain_update(twin, session, rollout, config)
    statistics = update(session, rollout)
    assert statistics["loss"] == pytest.approx(expected, rel=1e-9)
    for (name, got), other in zip(
        session.actor.net.state_dict().items(), twin.state_dict().values(), strict=True
    ):
        assert torch.allclose(got, other, rtol=1e-7, atol=1e-9), name


def plain_update(net: Any, session: Session, rollout: Rollout, config: RunConfig) -> float:
    """Train `net` on the rollout and return the mean loss of the epochs."""
    actor = session.actor
    pairs = actor.pairs.data[rollout.pair_rows]
    advantages = compute_gae(
        rollout.rewards, rollout.values, rollout.next_value, rollout.ended, torch.zeros(rollout.values.shape),
        config.gamma, config.gae_lambda,
    )  # fmt: skip
    returns = advantages + rollout.values
    memory_of = {
        (t, e): rollout.memories[t // 4, e] for t in (0, 4) for e in range(config.envs)
    }  # before step t of environment e
    optimizer = torch.optim.Adam(net.parameters(), lr=1e-4, eps=1e-5, foreach=False)
    losses = []
    for epoch in range(config.epochs):
        starts = [(2, e) for e in range(6)] if epoch % 2 else [(t, e) for t in (0, 4) for e in range(6)]
        memory = torch.stack([memory_of[start] for start in starts])  # (C, 2, M)
        total = torch.zeros((), dtype=torch.float64)
        for step in range(4):
            frames = [(t + step, e) for t, e in starts]
            kept = torch.tensor([not rollout.forgets[frame] for frame in frames]).double()[:, None, None]
            images = torch.from_numpy(np.stack([actor.images.data[pairs[frame][0]] for frame in frames]))
            texts = torch.stack(
                [encode(net.dialogue, actor.histories.data[pairs[frame][1]]) for frame in frames]
            )
            each = torch.arange(len(frames))
            features = net.perceive(net.prepare(images), texts, each, each)
            h, c = net.memory.cell(features, (memory * kept).unbind(1))
            memory = torch.stack((h, c), 1)
            logits, values = net.heads(h)
            for number, frame in enumerate(frames):
                loss = plain_loss(
                    logits[number],
                    values[number],
                    rollout,
                    advantages[frame],
                    returns[frame],
                    frame,
                    net.spec,
                )
                total = total + loss / len(frames) / 4
                t, e = frame
                if step < 3:
                    memory_of[t + 1, e] = memory[number].detach()
        optimizer.zero_grad()
        total.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(net.parameters(), config.max_grad_norm)
        optimizer.step()
        losses.append(total.item())
    return float(np.mean(losses))


def plain_loss(
    logits: Tensor,
    value: Tensor,
    rollout: Rollout,
    advantage: Tensor,
    returned: Tensor,
    frame: Any,
    spec: Any,
) -> Tensor:
    """The paper's loss of one frame, head by head."""
    action, before = rollout.actions[frame], rollout.values[frame]
    total = torch.zeros((), dtype=torch.float64)
    first = 0
    for head, size in enumerate(spec.action_sizes):
        probabilities = torch.softmax(logits[first : first + size], 0)
        first += size
        if head >= 2 and action[1] == 0:
            continue  # nothing was said
        ratio = probabilities[action[head]] / rollout.log_probs[frame][head].exp()
        policy = -torch.min(ratio * advantage, ratio.clamp(0.8, 1.2) * advantage)
        entropy = -(probabilities * probabilities.log()).sum()
        near = before + (value - before).clamp(-0.2, 0.2)
        error = torch.max((value - returned) ** 2, (near - returned) ** 2)
        total = total + (policy - 0.01 * entropy + 0.5 * error) / 4
    return total


def test_minibatches_are_of_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    config = small(minibatches=3, epochs=2)
    session, rollout = played(config)
    steps = Steps(session, monkeypatch)
    update(session, rollout)
    sizes = [len(given) for given, _ in steps.calls]
    assert sizes == [4] * 12 + [4] * 4 + [2] * 4, "12 chunks by four, then 6 shifted ones by four"


def test_time_outs_are_terminal() -> None:
    assert not configure(net="paper-reference").bootstrap_timeouts
    values, cut = torch.tensor([[0.5], [0.25]]), torch.tensor([[True], [False]])
    got = compute_gae(torch.zeros(2, 1), values, torch.tensor([1.0]), cut, torch.zeros(2, 1), 0.99, 0.99)
    assert got.flatten().tolist() == pytest.approx([-0.5, 0.99 - 0.25]), (
        "0 + .99 * 0 - .5, then 0 + .99 * 1 - .25"
    )


def test_gae_of_the_paper_s_numbers() -> None:
    """Gamma and lambda .99: deltas .99 * .3 - .5 = -.203 and 1 - .3 = .7; the first gets .99 * .99 of the second."""
    end = torch.tensor([[False], [True]])
    got = compute_gae(
        torch.tensor([[0.0], [1.0]]), torch.tensor([[0.5], [0.3]]), torch.tensor([9.0]), end,
        torch.zeros(2, 1), 0.99, 0.99,
    )  # fmt: skip
    assert got.flatten().tolist() == pytest.approx([-0.203 + 0.9801 * 0.7, 0.7])
