"""A guide leads and is imitated; led steps give PPO nothing, and without a guide nothing is different."""

import copy
import json
from collections.abc import Mapping
from math import log
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from gymnasium.vector import AutoresetMode

from socialai_dsl.evaluation import evaluate_policy
from socialai_dsl.trainer.actions import log_probs_and_entropies
from socialai_dsl.trainer.checkpoint import read
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.frames import Batch
from socialai_dsl.trainer.guides import Lead, ScriptGuide
from socialai_dsl.trainer.play import CheckpointPolicy
from socialai_dsl.trainer.ppo import estimate_advantages, ppo_loss, update
from socialai_dsl.trainer.rollout import collect
from socialai_dsl.trainer.session import Session
from socialai_dsl.trainer.training import train
from tests.trainer.fake_envs import EchoEnvs


def mixed_batch() -> tuple[Batch, torch.Tensor]:
    """Led and speaking, led and silent, own: each head now chooses option 1 with probability 0.6, it was 0.5."""
    logits = torch.tensor([[log(0.4), log(0.6)] * 4] * 3, requires_grad=True)
    actions = torch.tensor([[1, 1, 1, 1], [1, 0, 1, 1], [1, 1, 1, 1]])
    batch = Batch(
        actions,
        # The script may do what the policy never would; then the ratio is beyond all numbers.
        log_probs=torch.tensor([[-1000.0] * 4, [log(0.5)] * 4, [log(0.5)] * 4]),
        values=torch.zeros(3),
        advantages=torch.tensor([1e6, -1e6, 2.0]),
        returns=torch.tensor([3.0, 2.0, 3.0]),
        lead=Lead(actions, torch.tensor([True, True, False]), torch.tensor([1.0, 0.5, 0.0])),
    )
    return batch, logits


def test_the_loss_of_led_and_own_frames_together() -> None:
    batch, logits = mixed_batch()
    config = RunConfig(imitation_coef=0.7)
    parts = ppo_loss(batch, logits, torch.full((3,), 1.5), (2, 2, 2, 2), config)
    policy = -2 * 1.2  # of the own frame alone, whose ratio 1.2 ** 4 is clipped
    value = (1.5**2 + 0.5**2 + 1.5**2) / 3
    entropy = -(2 + 0.6 * 2) * (0.6 * log(0.6) + 0.4 * log(0.4))
    imitation = -(1.0 * 4 * log(0.6) + 0.5 * (log(0.6) + log(0.4)))  # silent: no template, no noun
    assert parts.policy_loss.item() == pytest.approx(policy)
    assert parts.value_loss.item() == pytest.approx(value)
    assert parts.entropy.item() == pytest.approx(entropy)
    assert parts.imitation_loss.item() == pytest.approx(imitation / 1.5), "by weight"
    assert parts.clip_fraction.item() == 1
    assert parts.approx_kl.item() == pytest.approx(1.2**4 - 1 - 4 * log(1.2), rel=1e-5)
    of_all = (policy - 0.01 * entropy + 0.7 * imitation) / 3 + 0.5 * value
    assert parts.loss.item() == pytest.approx(of_all), "each frame with the terms that it has"

    parts.loss.backward()  # type: ignore[no-untyped-call]
    assert logits.grad is not None
    # Cross-entropy: probability minus what was shown; nothing of advantage, ratio or entropy.
    assert logits.grad[0].tolist() == pytest.approx([0.7 * 0.4 / 3, -0.7 * 0.4 / 3] * 4)
    shown = [0.35 * 0.4 / 3, -0.35 * 0.4 / 3, -0.35 * 0.6 / 3, 0.35 * 0.6 / 3]
    assert logits.grad[1].tolist() == pytest.approx([*shown, 0, 0, 0, 0])


OF_OWN = ("policy_loss", "entropy", "approx_kl", "clip_fraction")


@pytest.mark.parametrize("loss", ["joint", "per_head"])
@pytest.mark.parametrize("led", range(11))
def test_figures_of_the_agent_s_own_frames_do_not_depend_on_led_ones(led: int, loss: str) -> None:
    """Whatever share of the frames a guide leads; where it leads all, they are not numbers."""
    generator = torch.Generator().manual_seed(0)
    actions = torch.randint(2, (10, 4), generator=generator)
    logits, before, values, advantages = (
        torch.randn(shape, generator=generator) for shape in ((10, 8), (10, 8), (10,), (10,))
    )
    config, sizes = RunConfig(loss=loss), (2, 2, 2, 2)
    log_probs, _ = log_probs_and_entropies(before, actions, sizes)
    lead = Lead(actions, torch.arange(10) < led, torch.ones(10))
    batch = Batch(actions, log_probs, values, advantages, values + 1, lead)
    parts = ppo_loss(batch, logits, values, sizes, config)
    assert np.isfinite([parts.loss.item(), parts.value_loss.item(), parts.imitation_loss.item()]).all()
    own = slice(led, None)
    alone = Batch(actions[own], log_probs[own], values[own], advantages[own], values[own] + 1)
    expected = ppo_loss(alone, logits[own], values[own], sizes, config)
    for name in OF_OWN:
        figure = getattr(parts, name).item()
        if led == 10:
            assert np.isnan(figure), name
        else:
            assert figure == pytest.approx(getattr(expected, name).item(), rel=1e-4), name
    assert np.isnan(expected.imitation_loss.item()), "nobody showed anything"


def guided(small_config: Any, **changes: Any) -> RunConfig:
    config: RunConfig = small_config(**({"guide": "script", "guide_share": 0.5} | changes))
    return config


def envs(count: int = 8, **options: Any) -> EchoEnvs:
    return EchoEnvs(count, delay=3, limit=7, chatter=0.3, **options)


def test_advantages_are_normalised_over_the_agent_s_own_steps(small_config: Any) -> None:
    session = Session.start(guided(small_config, horizon=6, frames=48 * 4), envs())
    session.update = 1
    collect(session)
    session.update = 2  # half of the frames: episodes that have begun are led to their end
    rollout = collect(session)
    assert rollout.lead is not None
    led = rollout.lead.led
    assert 0 < led.sum() < led.numel()
    advantages = estimate_advantages(session.config, rollout).advantages
    own = advantages[~led]
    assert own.mean().item() == pytest.approx(0, abs=1e-6)
    assert own.std(correction=0).item() == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("led", [0, 7, 8])
def test_the_trust_region_is_that_of_the_agent_s_own_frames(led: int, small_config: Any) -> None:
    """Seven environments of eight led do not make it wider; all of them led, there is none."""
    session = Session.start(small_config(epochs=3, minibatches=1, imitation_coef=0.0), envs())
    rollout = collect(session)
    leads = (torch.arange(8) < led).expand(8, 8)
    rollout = rollout._replace(lead=Lead(rollout.actions, leads, torch.zeros(8, 8)))
    figures = {}
    for target in (1e6, None, 1e-9):
        again = copy.deepcopy(session)
        again.config = small_config(epochs=3, minibatches=1, imitation_coef=0.0, target_kl=target)
        figures[target] = update(again, rollout)
        (steps,) = {int(state["step"]) for state in again.optimizer.state.values()}
        assert steps == (1 if target == 1e-9 and led < 8 else 3)
    assert figures[None] == figures[1e6]
    missing = {name for name, figure in figures[None].items() if figure is None}
    assert missing == {"imitation_loss", *(OF_OWN if led == 8 else ())}


def test_what_the_script_has_begun_it_plays_to_the_end() -> None:
    playing = EchoEnvs(3)
    playing.reset(seed=0)
    guide = ScriptGuide(RunConfig(guide="script", guide_share=0.5), playing)

    def led(starts: list[bool], progress: float) -> list[bool]:
        lead = guide.lead(playing, np.array(starts), progress)
        assert (lead.weights == lead.led).all(), "what is led is imitated"
        assert (lead.actions[lead.led] == playing.scripted_actions()[lead.led]).all()
        return lead.led.tolist()  # type: ignore[no-any-return]

    assert led([True, True, True], 0.0) == [True, True, True]
    assert led([False, True, False], 0.5) == [True, False, True]
    assert led([False, False, True], 0.9) == [True, False, False]
    again = ScriptGuide(RunConfig(guide="script", guide_share=0.5), playing)
    again.load_state(json.loads(json.dumps(guide.state())))
    assert again.lead(playing, np.zeros(3, np.bool_), 0.9).led.tolist() == [True, False, False]


def test_led_steps_are_the_script_s_and_not_counted_as_the_agent_s(small_config: Any) -> None:
    session = Session.start(guided(small_config, frames=64 * 4), envs())
    rollout = collect(session)
    assert rollout.lead is not None
    assert rollout.lead.led.all()
    assert torch.equal(rollout.actions, rollout.lead.actions)
    tally = rollout.tally
    assert (tally.episodes, tally.successes, tally.led_steps) == (0, 0, 64)
    assert tally.all_episodes == session.envs.counters()["outcomes"]["right"] > 0, "the script succeeds"
    assert 0 < tally.agreed_steps < 64
    session.update = 2
    played = [collect(session) for _ in range(3)]
    assert played[-1].lead is None
    assert sum(rollout.tally.episodes for rollout in played) > 0


@pytest.mark.parametrize("update", ["share 0", "handed over"])
def test_without_a_lead_nothing_is_different(update: str, tmp_path: Path, small_config: Any) -> None:
    """A guide that does not lead leaves the same weights, to the bit, as no guide."""
    plain = read(train(small_config(), envs(), tmp_path / "plain"))
    if update == "share 0":
        path = train(guided(small_config, guide_share=0.0), envs(), tmp_path / "guided")
    else:
        (tmp_path / "mine.py").write_text(NOBODY)
        settings = {"guide": "mine:Guide", "scenario": str(tmp_path / "any.yaml")}
        path = train(guided(small_config, **settings), envs(), tmp_path / "guided")
    other = read(path)
    assert other.tensors.keys() == plain.tensors.keys() | {"guide"}
    for name, value in plain.tensors.items():
        assert torch.equal(other.tensors[name], value), name


NOBODY = """
import numpy as np
from socialai_dsl.trainer.guides import Lead

class Guide:
    def __init__(self, config, envs):
        pass

    def lead(self, envs, starts, progress):
        count = len(starts)
        return Lead(np.zeros((count, 4), np.int64), np.zeros(count, bool), np.zeros(count, np.float32))

    def state(self):
        return {}

    def load_state(self, state):
        pass
"""


def test_a_guide_that_does_what_cannot_be_done_is_told_so(small_config: Any, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        NOBODY.replace("np.zeros(count, np.float32)", "np.ones(count, np.float32)")
    )
    (tmp_path / "wrong.py").write_text(
        (tmp_path / "mine.py")
        .read_text()
        .replace("np.zeros((count, 4), np.int64)", "np.full((count, 4), 99)")
    )
    scenario = str(tmp_path / "any.yaml")
    collect(Session.start(guided(small_config, guide="mine:Guide", scenario=scenario), envs()))
    with pytest.raises(ValueError, match=r"actions of lead: got \[99, 99, 99, 99\] for environment 0"):
        collect(Session.start(guided(small_config, guide="wrong:Guide", scenario=scenario), envs()))


def test_a_guided_run_stopped_and_resumed_ends_with_the_same_bits(tmp_path: Path, small_config: Any) -> None:
    class Stop(Exception):  # noqa: N818 - it interrupts, as KeyboardInterrupt does
        pass

    def stop_after(update: int) -> Any:
        def progress(seen: Mapping[str, Any]) -> None:
            if seen["update"] == update:
                raise Stop

        return progress

    schedules = {"lr_end": 1e-4, "entropy_coef_end": 0.0, "target_kl": 1e-4}
    config = guided(small_config, **schedules, checkpoint_every=1, horizon=9, frames=72 * 6)
    whole = read(train(config, envs(), tmp_path / "whole"))
    assert whole.tensors["step_scale"] < 1
    for number, stop in enumerate((2, 4, 5)):  # led, some still led, nobody led any more
        with pytest.raises(Stop):
            train(config, envs(), tmp_path / "parts", stop_after(stop), resume=number > 0)
    parts = read(train(config, envs(), tmp_path / "parts", resume=True))
    for name, value in whole.tensors.items():
        assert torch.equal(parts.tensors[name], value), name
    rows = [
        [json.loads(line) for line in (tmp_path / run / "metrics.jsonl").read_text().splitlines()]
        for run in ("whole", "parts")
    ]
    for row in (*rows[0], *rows[1]):
        del row["frames_per_second"]
    assert rows[0] == rows[1]


@pytest.mark.thorough("trains for seconds")
def test_imitation_alone_teaches_what_the_script_does(tmp_path: Path) -> None:
    config = RunConfig(
        guide="script",
        guide_share=1.0,
        frames=128 * 16 * 14,
        envs=128,
        horizon=16,
        lr=2e-3,
        tensorboard=False,
    )
    path = train(config, EchoEnvs(128), tmp_path)
    rows = [json.loads(line) for line in (tmp_path / "metrics.jsonl").read_text().splitlines()]
    assert all((row["led"], row["success"], row["episodes"]) == (1, None, 0) for row in rows)
    assert rows[0]["agreement"] < 0.3
    assert rows[-1]["agreement"] > 0.9
    assert rows[-1]["imitation_loss"] < 0.3 * rows[0]["imitation_loss"]

    class Scriptless(EchoEnvs):
        def scripted_actions(self) -> Any:
            raise AssertionError("nobody may be asked what to do while the agent is evaluated")

    there = Scriptless(64, mode=AutoresetMode.DISABLED)
    result = evaluate_policy(CheckpointPolicy.load(path, there, seed=1), there, 200)
    assert result.success_rate > 0.9


def test_the_figures_show_the_phases(tmp_path: Path, small_config: Any) -> None:
    train(guided(small_config, frames=64 * 8), envs(), tmp_path)
    rows = [json.loads(line) for line in (tmp_path / "metrics.jsonl").read_text().splitlines()]
    assert [row["led"] == 1 for row in rows[:4]] == [True] * 4
    assert [row["led"] for row in rows[-2:]] == [0, 0]
    for row in rows:
        assert {name for name in OF_OWN if row[name] is None} == set(OF_OWN if row["led"] == 1 else ())
        assert (row["imitation_loss"] is None) == (row["agreement"] is None) == (row["led"] == 0)
    assert rows[-1]["success"] is not None
    train(small_config(), envs(), tmp_path / "alone")
    (first, *_) = (tmp_path / "alone" / "metrics.jsonl").read_text().splitlines()
    assert not {"led", "agreement", "imitation_loss"} & set(json.loads(first))


def test_a_scenario_without_a_script_is_refused(small_config: Any) -> None:
    class Scriptless(EchoEnvs):
        def scripted_actions(self) -> Any:
            raise ValueError("echo: the agent has no frame")

    with pytest.raises(
        ValueError, match="guide: the scenario has no script to imitate: echo: the agent has no fra"
    ):
        Session.start(guided(small_config), Scriptless(8))


def test_a_script_that_says_other_things_than_the_scenario_is_refused(small_config: Any) -> None:
    """Its words would have other numbers, and the agent could not play the scenario it is for."""
    plain = EchoEnvs(8).program
    playing = EchoEnvs(8)
    Session.start(guided(small_config), playing, plain)
    playing.program.vocabulary = [*plain.vocabulary, "psst"]
    with pytest.raises(
        ValueError, match="guide: echo with its script has other vocabulary than without it: psst; let"
    ):
        Session.start(guided(small_config), playing, plain)
