"""Auxiliary losses are trained along, saved, logged and, where they are no finite scalars, refused by name."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from socialai_dsl.trainer.auxiliary import AuxiliaryLoss, build_auxiliary
from socialai_dsl.trainer.checkpoint import read
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.frames import Environments, Outputs, Stretches
from socialai_dsl.trainer.minibatch import cut_out
from socialai_dsl.trainer.nets import ActorCritic
from socialai_dsl.trainer.ppo import estimate_advantages, update
from socialai_dsl.trainer.rollout import collect
from socialai_dsl.trainer.session import Session
from socialai_dsl.trainer.training import train
from tests.trainer.fake_envs import EchoEnvs

MINE = """
import torch
from torch import nn
from torch.nn import functional
from socialai_dsl.trainer.auxiliary import AuxiliaryLoss


class Loss(AuxiliaryLoss):
    '''Predicts the return from the memory, of a random half of the rollouts.'''

    def __init__(self, config, net):
        super().__init__(config, net)
        self.guess = nn.Linear(net.memory.size, 1)
        self.register_buffer("begun", torch.zeros(()))
        self.register_buffer("wanted", torch.zeros(()))

    def begin(self, played, net, generator):
        self.begun += 1
        self.wanted.copy_(torch.rand((), generator=generator) < 0.5)

    def forward(self, frames, outputs, net):
        guess = self.guess(outputs.memory).squeeze(-1)
        return self.wanted * functional.mse_loss(guess, frames.batch.returns)
"""


class Given(AuxiliaryLoss):
    """Returns what it is given, or what that makes of what it is called with."""

    def __init__(self, result: Any) -> None:
        nn.Module.__init__(self)
        self.result = result

    def forward(self, frames: Environments, outputs: Outputs, net: ActorCritic) -> Tensor:
        found: Tensor = self.result(frames, outputs, net) if callable(self.result) else self.result
        return found


def session_with(config: RunConfig, loss: Any) -> Session:
    session = Session.start(config, EchoEnvs(8))
    session.aux = loss
    return session


def test_it_moves_the_network_by_its_own_gradient_times_its_weight(small_config: Any) -> None:
    """In one step on one minibatch, without anything else that has a gradient."""
    alone = {"minibatches": 1, "epochs": 1, "entropy_coef": 0.0, "value_coef": 0.0, "max_grad_norm": 1e9}
    config = small_config(**alone, aux_coef=0.3, aux_coef_end=0.1, normalize_advantages=False)
    session = session_with(config, Given(lambda frames, outputs, net: outputs.features.square().mean()))
    session.update = 3  # of six: the weight has gone half the way, to 0.2
    rollout = collect(session)
    rollout.rewards.zero_(), rollout.values.zero_(), rollout.next_value.zero_()
    minibatch = cut_out(session, rollout, estimate_advantages(config, rollout), torch.arange(8))
    loss = minibatch.stretches.outputs(session.actor.net).features.square().mean()
    wanted = torch.autograd.grad(loss, list(session.actor.net.parameters()), allow_unused=True)
    figures = update(session, rollout)
    assert figures["aux_loss"] == pytest.approx(loss.item())
    assert figures["loss"] == pytest.approx(0.2 * loss.item(), abs=1e-6)
    norm = sum(0.04 * float(gradient.square().sum()) for gradient in wanted if gradient is not None) ** 0.5
    assert figures["grad_norm"] == pytest.approx(norm, rel=1e-4)


def test_it_is_called_for_every_share_with_its_own_frames(small_config: Any, monkeypatch: Any) -> None:
    """Each environment once in each epoch, by its memory and first step."""
    monkeypatch.setattr(ActorCritic, "smallest_share", 1)
    seen: list[Tensor] = []

    def note(frames: Environments, outputs: Outputs, net: ActorCritic) -> Tensor:
        images, tokens = frames.stretches.seen()
        assert images.shape[:2] == tokens.shape[:2] == frames.stretches.starts.shape
        assert len(outputs.memory) == len(frames.batch.returns) == images.shape[0] * images.shape[1]
        seen.append(frames.batch.returns.view(frames.stretches.starts.shape))
        return outputs.values.mean()

    config = small_config(threads=2)
    session = session_with(config, Given(note))
    rollout = collect(session)
    update(session, rollout)
    assert len(seen) == 2 * 2 * 2, "epochs, minibatches, shares"
    of_all = estimate_advantages(config, rollout).returns
    columns = torch.cat(seen, 1).T.tolist()
    assert sorted(columns) == sorted(2 * of_all.T.tolist())


def test_the_frames_are_those_that_were_seen(small_config: Any) -> None:
    envs = EchoEnvs(8, chatter=0.5)
    session = Session.start(small_config(bptt=4), envs)
    before = session.state.image.copy(), session.state.tokens.copy()
    rollout = collect(session)
    everything = cut_out(session, rollout, estimate_advantages(session.config, rollout), torch.arange(8))
    images, tokens = everything.stretches.seen()
    assert images.shape == (4, 16, 7, 7, 4), "two stretches of four steps side by side"
    assert (images[0, :8].numpy() == before[0]).all()
    assert (tokens[0, :8].numpy() == session.actor.net.reader.read(before[1])).all()
    rows = rollout.pair_rows.view(2, 4, 8).transpose(0, 1).flatten(1, 2).numpy()  # (4, 16)
    assert (images.numpy() == session.actor.images.data[session.actor.pairs.data[rows, 0]]).all()


@pytest.mark.parametrize("net", ["fast", "paper-reference"])
def test_kept_frames_are_computed_as_they_were(net: str, small_config: Any) -> None:
    session = Session.start(small_config(net=net), EchoEnvs(8, chatter=0.5))
    rollout = collect(session)
    frames = cut_out(
        session, rollout, estimate_advantages(session.config, rollout), torch.arange(8)
    ).stretches
    model = session.actor.net.eval()
    again = Stretches.replayed(model, *frames.seen(), frames.starts, frames.memory)
    for one, other in zip(frames.outputs(model), again.outputs(model), strict=True):
        assert torch.allclose(one, other, atol=1e-5)


def test_a_run_with_one_resumes_to_the_same_bits(tmp_path: Path, small_config: Any) -> None:
    (tmp_path / "mine.py").write_text(MINE)
    config = small_config(
        aux="mine:Loss", scenario=str(tmp_path / "x.yaml"), checkpoint_every=1, keep_checkpoints=9
    )
    rows: list[Any] = []
    whole = read(train(config, EchoEnvs(8), tmp_path / "whole", rows.append))
    assert {"aux.guess.weight", "aux.begun", "aux_adam.exp_avg.guess.weight"} <= whole.tensors.keys()
    assert whole.tensors["aux.begun"] == 6
    losses = [row["aux_loss"] for row in rows]
    assert 0 < losses.count(0.0) < 6, "it drew"
    first = read(sorted((tmp_path / "whole" / "checkpoints").iterdir())[0])
    assert not torch.equal(whole.tensors["aux.guess.weight"], first.tensors["aux.guess.weight"]), "it learns"

    def stop(row: Any) -> None:
        if row["update"] == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(config, EchoEnvs(8), tmp_path / "parts", stop)
    parts = read(train(config, EchoEnvs(8), tmp_path / "parts", resume=True))
    assert parts.tensors.keys() == whole.tensors.keys()
    assert [
        name for name, value in whole.tensors.items() if not torch.equal(value, parts.tensors[name])
    ] == []


def test_its_weights_are_the_seed_s_and_leave_the_network_s_alone(tmp_path: Path, small_config: Any) -> None:
    (tmp_path / "mine.py").write_text(MINE)
    own = {"aux": "mine:Loss", "scenario": str(tmp_path / "x.yaml")}
    torch.manual_seed(5)
    one = Session.start(small_config(**own), EchoEnvs(8))
    torch.manual_seed(6)
    other, plain = (Session.start(config, EchoEnvs(8)) for config in (small_config(**own), small_config()))
    assert one.aux is not None and other.aux is not None  # noqa: PT018
    assert all(map(torch.equal, one.aux.state_dict().values(), other.aux.state_dict().values()))
    weights = zip(one.actor.net.parameters(), plain.actor.net.parameters(), strict=True)
    assert all(torch.equal(*pair) for pair in weights)


@pytest.mark.parametrize(
    ("result", "got"),
    [
        (torch.tensor(float("nan")), "nan"),
        (torch.tensor(float("-inf")), "-inf"),
        (torch.zeros(3), r"torch\.float32 of the shape \(3,\)"),
        (torch.zeros(1), r"torch\.float32 of the shape \(1,\)"),
        (torch.zeros((), dtype=torch.float64), r"torch\.float64 of the shape \(\)"),
        (0.5, "float"),
        (None, "NoneType"),
        (np.float32(1), "float32"),
    ],
)
def test_what_it_must_not_return_is_refused_by_name_and_nothing_is_lost(
    result: Any, got: str, tmp_path: Path, small_config: Any
) -> None:
    session = session_with(small_config(), Given(result))
    session.save(tmp_path)
    before = [parameter.detach().clone() for parameter in session.actor.net.parameters()]
    with pytest.raises(
        ValueError, match=f"^aux: Given returned {got}, expected a finite scalar tensor of float32$"
    ):
        update(session, collect(session))
    assert all(map(torch.equal, before, session.actor.net.parameters()))
    session.resume(tmp_path)


def test_a_class_of_another_kind_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from torch import nn\nfrom socialai_dsl.trainer.auxiliary import AuxiliaryLoss\n"
        "class Plain:\n    def begin(self): pass\n    def forward(self): pass\n"
        "class Lacking(AuxiliaryLoss): pass\n"
        "class Keeping(AuxiliaryLoss):\n    def __init__(self, config, net):\n        super().__init__(config, net)\n"
        "        self.part = net\n    def forward(self, frames, outputs, net): pass\n"
    )

    class Net(nn.Module):
        pass

    net: Any = Net()
    net.weight = nn.Parameter(torch.zeros(1))
    for name, message in (
        (
            "Plain",
            "aux: got 'mine:Plain', expected a subclass of socialai_dsl.trainer.auxiliary.AuxiliaryLoss",
        ),
        ("Lacking", "Lacking lacks the method 'forward'"),
        ("Keeping", "aux: mine:Keeping keeps a part of the network"),
    ):
        with pytest.raises(ValueError, match=message):
            build_auxiliary(RunConfig(aux=f"mine:{name}", scenario=str(tmp_path / "x.yaml")), net)
