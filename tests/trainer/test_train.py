"""Training learns, resumes exactly, and stops cleanly with its last good checkpoint."""

import json
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.vector import AutoresetMode

import socialai_dsl
from socialai_dsl.evaluation import evaluate_policy
from socialai_dsl.trainer import ppo
from socialai_dsl.trainer.checkpoint import read
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.curricula import Tutor
from socialai_dsl.trainer.errors import CheckpointError, TrainingStopped
from socialai_dsl.trainer.play import CheckpointPolicy
from socialai_dsl.trainer.training import train
from tests.trainer.fake_envs import EchoEnvs

ROOT = Path(__file__).parents[2]


class Stop(Exception):  # noqa: N818 - it interrupts, as KeyboardInterrupt does
    """The process went away."""


def stop_after(update: int) -> Any:
    def progress(seen: Mapping[str, Any]) -> None:
        if seen["update"] == update:
            raise Stop

    return progress


def rows(run_dir: Path) -> list[dict[str, Any]]:
    lines = (run_dir / "metrics.jsonl").read_text().splitlines()
    return [{k: v for k, v in json.loads(line).items() if k != "frames_per_second"} for line in lines]


@pytest.mark.thorough("trains for seconds")
def test_it_learns_to_repeat_a_word_it_heard(tmp_path: Path) -> None:
    config = RunConfig(
        frames=45_000, envs=128, horizon=16, lr=2e-3, threads=1, tensorboard=False, bonus="none"
    )
    envs = EchoEnvs(128)
    path = train(config, envs, tmp_path)
    there = EchoEnvs(128, mode=AutoresetMode.DISABLED)
    result = evaluate_policy(CheckpointPolicy.load(path, there, seed=1), there, 300)
    assert result.success_rate > 0.9, f"only {result.success_rate:.0%} of the episodes succeeded"
    first, last = rows(tmp_path)[0], rows(tmp_path)[-1]
    assert first["success"] < 0.3, "the task must not be easy by chance"
    assert last["success"] > 0.9
    assert last["outcomes"]["right"] == pytest.approx(last["success"])


@pytest.mark.parametrize(
    ("net", "bonus", "threads", "update"),
    [
        ("fast", "lang", 1, "environments"),
        ("fast", "cell", 2, "environments"),
        ("relations", "none", 2, "environments"),
        ("paper-reference", "none", 1, "chunks"),
    ],
)
@pytest.mark.thorough("trains for seconds")
def test_a_run_stopped_three_times_ends_with_the_same_bits(
    net: str, bonus: str, threads: int, update: str, tmp_path: Path, small_config: Any
) -> None:
    updates = 9 if net == "fast" else 4
    config = small_config(
        net=net,
        bonus=bonus,
        threads=threads,
        update=update,
        bptt=4,
        frames=64 * updates,
    )
    whole = read(train(config, EchoEnvs(8, chatter=0.3), tmp_path / "whole"))
    stops = np.sort(np.random.default_rng(0).choice(np.arange(1, updates), 3, replace=False)).tolist()
    for index, stop in enumerate(stops):
        with pytest.raises(Stop):
            train(config, EchoEnvs(8, chatter=0.3), tmp_path / "parts", stop_after(stop), resume=index > 0)
    parts = read(train(config, EchoEnvs(8, chatter=0.3), tmp_path / "parts", resume=True))
    assert parts.meta == whole.meta
    for name, value in whole.tensors.items():
        assert torch.equal(parts.tensors[name], value), f"{name} differs after stops at {stops}"
    assert rows(tmp_path / "parts") == rows(tmp_path / "whole")


def test_a_run_whose_agent_remembers_several_episodes_resumes(tmp_path: Path, small_config: Any) -> None:
    def envs() -> EchoEnvs:
        made = EchoEnvs(8, limit=3)
        made.program.session = 3
        return made

    whole = read(train(small_config(frames=64 * 4), envs(), tmp_path / "whole"))
    train(small_config(frames=64 * 2), envs(), tmp_path / "parts")
    longer = read(train(small_config(frames=64 * 4), envs(), tmp_path / "parts", resume=True))
    assert all(torch.equal(longer.tensors[name], value) for name, value in whole.tensors.items())
    assert whole.tensors["state.trials"].any()


def test_a_run_that_has_heard_nothing_yet_resumes(tmp_path: Path, small_config: Any) -> None:
    """What encodes words has had no gradient, so that Adam knows nothing of it."""
    whole = read(train(small_config(frames=64 * 4), EchoEnvs(8, limit=1), tmp_path / "whole"))
    assert "adam.step.dialogue.embedding.weight" not in whole.tensors
    train(small_config(frames=64 * 2), EchoEnvs(8, limit=1), tmp_path / "parts")
    longer = read(train(small_config(frames=64 * 4), EchoEnvs(8, limit=1), tmp_path / "parts", resume=True))
    assert all(torch.equal(longer.tensors[name], value) for name, value in whole.tensors.items())


def test_a_finished_run_can_be_resumed_for_longer(tmp_path: Path, small_config: Any) -> None:
    whole = read(train(small_config(frames=64 * 5), EchoEnvs(8), tmp_path / "whole"))
    train(small_config(frames=64 * 3), EchoEnvs(8), tmp_path / "parts")
    longer = read(train(small_config(frames=64 * 5), EchoEnvs(8), tmp_path / "parts", resume=True))
    assert all(torch.equal(longer.tensors[name], value) for name, value in whole.tensors.items())


def test_schedules_fall_evenly_to_their_ends(
    tmp_path: Path, small_config: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    used: list[tuple[float, float, float]] = []
    real_step, real_loss = torch.optim.Adam.step, ppo.ppo_loss

    def note_loss(*frames: Any) -> Any:
        used.append((0.0, frames[4].entropy_coef, frames[4].clip))
        return real_loss(*frames)

    def note_step(optimizer: Any) -> Any:
        used[-1] = (optimizer.param_groups[0]["lr"], *used[-1][1:])
        return real_step(optimizer)

    monkeypatch.setattr(ppo, "ppo_loss", note_loss)
    monkeypatch.setattr(torch.optim.Adam, "step", note_step)
    start = {"lr": 8e-4, "entropy_coef": 0.04, "clip": 0.2, "epochs": 1, "minibatches": 1}
    ends = {"lr_end": 4e-4, "entropy_coef_end": 0.0, "clip_end": 0.1}
    train(small_config(frames=64 * 4, **start, **ends), EchoEnvs(8), tmp_path)
    expected = [(8e-4 - k * 1e-4, 0.04 - k * 0.01, 0.2 - k * 0.025) for k in range(4)]
    assert used == [pytest.approx(values) for values in expected]
    used.clear()
    train(small_config(frames=64 * 2, **start), EchoEnvs(8), tmp_path / "flat")
    assert used == [(8e-4, 0.04, 0.2)] * 2


def test_as_many_checkpoints_are_kept_as_were_asked_for(tmp_path: Path, small_config: Any) -> None:
    train(small_config(keep_checkpoints=3, checkpoint_every=1), EchoEnvs(8), tmp_path)
    kept = sorted(path.stem for path in (tmp_path / "checkpoints").iterdir())
    assert kept == [f"{64 * update:015d}" for update in (4, 5, 6)]


def test_progress_and_metrics_are_complete(tmp_path: Path, small_config: Any) -> None:
    seen: list[Mapping[str, Any]] = []
    config = small_config(frames=300, tensorboard=True)
    path = train(config, EchoEnvs(8), tmp_path, seen.append)
    assert path == tmp_path / "checkpoints" / f"{320:015d}.safetensors"
    assert [row["frames"] for row in seen] == [64, 128, 192, 256, 320]
    assert all(row["frames_per_second"] > 0 for row in seen)
    assert [{k: v for k, v in row.items() if k != "frames_per_second"} for row in seen] == rows(tmp_path)
    row = rows(tmp_path)[-1]
    assert set(row) == {
        "update", "frames", "loss", "policy_loss", "value_loss", "entropy", "approx_kl", "clip_fraction", "grad_norm",
        "explained_variance", "learning_rate", "bonus", "episodes", "success", "mean_return", "mean_length", "timeouts",
        "outcomes", "rules",
    }  # fmt: skip
    assert sum(row["outcomes"].values()) == pytest.approx(1)
    assert row["timeouts"] == pytest.approx(row["outcomes"]["time_out"])
    assert row["rules"]["speaks"] > 0
    assert list(tmp_path.glob("events.out.tfevents.*"))


def real(scenario: str, **options: Any) -> Any:
    return socialai_dsl.make_vec(scenario, num_envs=8, **options)


MODE = 'envs: got the autoreset mode {}, expected socialai_dsl.make_vec(..., autoreset_mode="SameStep")'
FORM = 'envs: got {}, expected socialai_dsl.make_vec(..., autoreset_mode="SameStep")'


@pytest.mark.parametrize(
    ("envs", "options", "message"),
    [
        (lambda: EchoEnvs(8, mode=AutoresetMode.NEXT_STEP), {}, MODE.format("NextStep")),
        (lambda: EchoEnvs(8, mode=AutoresetMode.DISABLED), {}, MODE.format("Disabled")),
        (lambda: EchoEnvs(8, mode=None), {}, MODE.format("None")),
        (lambda: real("dance"), {}, MODE.format("NextStep")),
        (
            lambda: real("social_env", autoreset_mode="Disabled"),
            {"curriculum": "even"},
            MODE.format("Disabled"),
        ),
        (
            lambda: real("dance", autoreset_mode="NextStep"),
            {"bootstrap_timeouts": True},
            MODE.format("NextStep"),
        ),
        (lambda: EchoEnvs(7), {}, "envs: got 7 environments, expected envs = 8"),
        (lambda: socialai_dsl.make("dance"), {}, FORM.format("ScenarioEnv")),
        (lambda: gym.make_vec("CartPole-v1", num_envs=8), {}, FORM.format("CartPoleVectorEnv")),
        (lambda: None, {}, FORM.format("NoneType")),
        (lambda: with_actions([4, 3, 2, 4]), {}, "action space: got MultiDiscrete([4 3 2 4]), expected"),
        (lambda: with_actions([4, 2, 3, 4]), {}, "action space: got MultiDiscrete([4 2 3 4]), expected (te"),
        (lambda: EchoEnvs(8), {"agent": "random"}, "agent: got random, expected ppo"),
        (lambda: EchoEnvs(8), {"device": "tpu9"}, "device: got tpu9, expected cpu or cuda: "),
        (lambda: EchoEnvs(8), {"device": "meta"}, "device: got meta, expected cpu or cuda: "),
        (lambda: EchoEnvs(8), {"curriculum": "even"}, "curriculum: got a scenario, expected a suite"),
    ],
)
def test_what_the_trainer_does_not_train_is_refused_in_one_sentence(
    envs: Any, options: dict[str, Any], message: str, tmp_path: Path, small_config: Any
) -> None:
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        train(small_config(**options), envs(), tmp_path / "run")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "run").exists()


def with_actions(sizes: list[int]) -> EchoEnvs:
    envs = EchoEnvs(8)
    envs.single_action_space = gym.spaces.MultiDiscrete(sizes)
    return envs


@pytest.mark.parametrize("weights", [[1], [0.5] * 6, [-1] * 6, [0] * 6, None, ["1"] * 6, [float("nan")] * 6])
def test_weights_of_a_curriculum_that_are_none_are_refused_by_name(weights: Any) -> None:
    curriculum = SimpleNamespace(weights=lambda: weights)
    with pytest.raises(ValueError, match=r"^curriculum: .*got.* expected .*(whole numbers|integers)"):
        Tutor(curriculum, real("social_env", autoreset_mode="SameStep"))  # type: ignore[arg-type]


def test_a_run_is_not_written_over_another(tmp_path: Path, small_config: Any) -> None:
    train(small_config(), EchoEnvs(8), str(tmp_path))
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    with pytest.raises(
        ValueError, match=f"run_dir: {tmp_path} holds a run already; resume it, or choose ano"
    ):
        train(small_config(seed=1), EchoEnvs(8), tmp_path)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


class Poisoned(EchoEnvs):
    """Turns bad in its 17th step, that is in the third rollout of eight steps."""

    def __init__(self, kind: str) -> None:
        super().__init__(8)
        self.kind, self.steps = kind, 0

    def step(self, actions: np.ndarray) -> Any:
        self.steps += 1
        self.poison = self.kind if self.steps >= 17 else None
        return super().step(actions)


def check_stopped(run_dir: Path, message: str, caught: Any) -> None:
    text = str(caught.value)
    assert message in text
    assert "training stopped after 128 frames (update 2)" in text
    assert "\n" not in text
    kept = read(run_dir / "checkpoints")
    assert kept.meta.update == 2
    assert str(run_dir / "checkpoints") in text
    assert all(bool(torch.isfinite(value).all()) for value in kept.part("net").values())
    assert [row["update"] for row in rows(run_dir)] == [1, 2]


@pytest.mark.parametrize(
    ("kind", "message"), [("reward", "a reward"), ("image", "image:"), ("tokens", "tokens:")]
)
def test_bad_environments_stop_the_run_at_once(
    kind: str, message: str, tmp_path: Path, small_config: Any
) -> None:
    with pytest.raises(TrainingStopped) as caught:
        train(small_config(), Poisoned(kind), tmp_path)
    check_stopped(tmp_path, message, caught)


@pytest.mark.parametrize(
    ("place", "message"),
    [("weight", "the network's output"), ("loss", "the loss"), ("gradient", "a gradient")],
)
def test_numbers_that_are_not_finite_stop_the_run_at_once(
    place: str, message: str, tmp_path: Path, small_config: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, calls = ppo.ppo_loss, 0

    def poisoned(batch: Any, logits: torch.Tensor, values: torch.Tensor, *rest: Any) -> Any:
        nonlocal calls
        calls += 1
        if place == "gradient" and calls == 10:
            values.register_hook(lambda grad: grad * torch.inf)
        if place == "loss" and calls == 10:
            values = values / 0
        return real(batch, logits, values, *rest)

    def spoil(session: Any) -> Any:
        def progress(seen: Mapping[str, Any]) -> None:
            if seen["update"] == 2 and place == "weight":
                with torch.no_grad():
                    session[0].actor.net.film.bias[0] = torch.nan

        return progress

    sessions: list[Any] = []
    start = ppo.Session.start
    monkeypatch.setattr(ppo, "ppo_loss", poisoned)
    monkeypatch.setattr(ppo.Session, "start", lambda *rest: sessions.append(start(*rest)) or sessions[-1])
    with pytest.raises(TrainingStopped) as caught:
        train(small_config(), EchoEnvs(8), tmp_path, spoil(sessions))
    check_stopped(tmp_path, message, caught)


@pytest.mark.parametrize("name", ["film.bias", "image_conv.1.running_var"])
def test_weights_that_a_step_spoils_are_not_saved(
    name: str, tmp_path: Path, small_config: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last step of an update may do it, when nothing computes with them before the checkpoint is due."""
    config = small_config(
        net="fast" if name == "film.bias" else "paper-reference", epochs=1, checkpoint_every=1
    )
    start, step, steps = ppo.Session.start, torch.optim.Adam.step, []

    def spoiling(optimizer: Any) -> None:
        step(optimizer)
        steps.append(optimizer)
        if len(steps) == 6:
            sessions[0].actor.net.state_dict()[name][0] = torch.inf

    sessions: list[Any] = []
    monkeypatch.setattr(ppo.Session, "start", lambda *rest: sessions.append(start(*rest)) or sessions[-1])
    monkeypatch.setattr(torch.optim.Adam, "step", spoiling)
    with pytest.raises(TrainingStopped) as caught:
        train(config, EchoEnvs(8), tmp_path)
    check_stopped(tmp_path, f"an entry of the network's {name} is not a finite number", caught)


def test_figures_that_are_not_finite_stop_the_run(
    tmp_path: Path, small_config: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, calls = ppo.ppo_loss, 0

    def diverging(*everything: Any) -> Any:
        nonlocal calls
        calls += 1
        parts = real(*everything)
        return parts._replace(approx_kl=parts.loss / 0) if calls == 12 else parts

    monkeypatch.setattr(ppo, "ppo_loss", diverging)
    with pytest.raises(TrainingStopped) as caught:
        train(small_config(), EchoEnvs(8), tmp_path)
    check_stopped(tmp_path, "approx_kl of the update is not a finite number", caught)


@pytest.mark.thorough("trains for seconds")
def test_a_full_disk_stops_the_run_and_spares_the_last_checkpoint(tmp_path: Path) -> None:
    """A child process may write files of 100 kB at most from its second checkpoint on, as on a full disk."""
    script = f"""
import resource, sys
sys.path.insert(0, {str(ROOT)!r})
from pathlib import Path
from tests.trainer.fake_envs import EchoEnvs
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.errors import TrainingStopped
from socialai_dsl.trainer.training import train

config = RunConfig(envs=8, horizon=8, minibatches=2, epochs=1, frames=1000, tensorboard=False, checkpoint_every=3)

def fill(progress):
    if progress["update"] == 4:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

try:
    train(config, EchoEnvs(8), Path({str(tmp_path)!r}), fill)
except TrainingStopped as error:
    print(error)
    sys.exit(7)
"""
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert result.returncode == 7, result.stderr
    assert "training stopped after 384 frames (update 6): cannot write" in result.stdout
    assert read(tmp_path / "checkpoints").meta.update == 3
    assert not list((tmp_path / "checkpoints").glob("*.tmp"))
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] != 100_000


@pytest.mark.parametrize("kills", [2, pytest.param(50, marks=[pytest.mark.slow, pytest.mark.timeout(900)])])
@pytest.mark.thorough("kills and resumes processes")
def test_a_killed_run_resumes_to_the_same_bits(kills: int, tmp_path: Path, small_config: Any) -> None:
    """SIGKILL at arbitrary moments, checkpoints after every update so that many kills hit a write."""
    script = f"""
import sys
sys.path.insert(0, {str(ROOT)!r})
from pathlib import Path
from tests.trainer.fake_envs import EchoEnvs
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.training import train

config = RunConfig.model_validate_json(sys.argv[1])
run_dir = Path({str(tmp_path / "killed")!r})
train(config, EchoEnvs(8), run_dir, lambda progress: print(progress.update, flush=True),
      resume=any((run_dir / "checkpoints").glob("*.safetensors")))
"""
    config = small_config(frames=64 * 6 * (kills + 1), epochs=1, checkpoint_every=1)
    rng = np.random.default_rng(0)
    while True:
        command = [sys.executable, "-c", script, config.model_dump_json()]
        child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert child.stdout is not None
        if child.stdout.readline() and kills > 0:
            time.sleep(float(rng.random()) * 0.15)
            child.send_signal(signal.SIGKILL)
            kills -= 1
        child.communicate(timeout=120)
        if child.returncode != -signal.SIGKILL:
            break
    assert child.returncode == 0
    whole = read(train(config, EchoEnvs(8), tmp_path / "whole"))
    killed = read(tmp_path / "killed" / "checkpoints")
    assert all(torch.equal(killed.tensors[name], value) for name, value in whole.tensors.items())
    assert rows(tmp_path / "killed") == rows(tmp_path / "whole")
    assert len(list((tmp_path / "killed" / "checkpoints").iterdir())) == config.keep_checkpoints


def test_resuming_nothing_is_an_error(tmp_path: Path, small_config: Any) -> None:
    with pytest.raises(CheckpointError, match="nothing to resume"):
        train(small_config(), EchoEnvs(8), tmp_path, resume=True)


def test_the_number_of_environments_has_to_fit(tmp_path: Path, small_config: Any) -> None:
    with pytest.raises(ValueError, match="got 4 environments, expected envs = 8"):
        train(small_config(), EchoEnvs(4), tmp_path)


def test_torch_s_threads_are_as_before(tmp_path: Path, small_config: Any) -> None:
    train(small_config(threads=2, frames=64), EchoEnvs(8), tmp_path)
    assert torch.get_num_threads() == 1
