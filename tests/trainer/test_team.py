"""Two processes train one agent as one process does with all of the environments, and none outlives another."""

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor

from socialai_dsl.cli.main import main
from tests.trainer.fake_envs import EchoEnvs
from trainer.checkpoint import Checkpoint, read
from trainer.errors import CheckpointError
from trainer.session import Session
from trainer.team import ALONE, Team
from trainer.train import train

ROOT = Path(__file__).parents[2]

PRELUDE = f"""
import json, os, signal, sys
sys.path.insert(0, {str(ROOT)!r})
from pathlib import Path
import torch
from tests.trainer.fake_envs import EchoEnvs
from trainer.config import TrainConfig
from trainer.errors import TrainingStopped
from trainer.team import joined
from trainer.train import train

torch.set_num_threads(1)
"""


def together(script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a script in two processes."""
    file = Path(arguments[0]) / "script.py"
    file.write_text(PRELUDE + script, encoding="utf-8")
    launcher = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2"]
    return subprocess.run(
        [*launcher, str(file), *arguments], capture_output=True, text=True, timeout=240, check=False
    )


def rows(run_dir: Path) -> list[dict[str, Any]]:
    lines = (run_dir / "metrics.jsonl").read_text().splitlines()
    return [{k: v for k, v in json.loads(line).items() if k != "frames_per_second"} for line in lines]


# --- what a process holds ---


def test_shares_are_equal_and_in_order() -> None:
    teams = [Team(rank, 3, 3) for rank in range(3)]
    group = torch.tensor([5, 0, 3, 2, 4])
    assert [team.own(group, 6).tolist() for team in teams] == [[0], [1, 0], [1, 0]]
    whole = torch.arange(12).view(2, 6)
    assert torch.equal(torch.cat([team.mine(whole, 1) for team in teams], 1), whole)
    with pytest.raises(ValueError, match="got 7, expected a multiple of the 3 processes"):
        teams[0].share(7)


def test_alone_everything_is_as_it_was() -> None:
    values = torch.randn(3, 4)
    assert ALONE.sum(values) is values
    assert ALONE.gather(values) is values
    assert ALONE.mine(values, 1).equal(values)
    assert ALONE.gather_bytes(b"x") == [b"x"]
    assert ALONE.tell("here") == "here"
    assert ALONE.writes


def test_networks_that_look_at_the_rest_of_the_batch_are_trained_by_one_process(small_config: Any) -> None:
    with pytest.raises(ValueError, match="paper-reference normalises over the batch"):
        Session.start(small_config(net="paper-reference"), EchoEnvs(4), Team(0, 2, 2))
    with pytest.raises(ValueError, match="got 8 environments, expected num_envs = 8 / 2 processes = 4"):
        Session.start(small_config(), EchoEnvs(8), Team(0, 2, 2))


# --- the same as one process ---

SAME = """
class Stop(Exception):
    pass

folder = Path(sys.argv[1])
with joined("cpu") as team:
    for number, text in enumerate(json.loads(sys.argv[2])):
        torch.set_default_dtype(torch.float64)
        config = TrainConfig.model_validate_json(text)

        def envs():
            return EchoEnvs(team.share(config.num_envs), chatter=0.3)

        def stop(progress):
            if progress.update == 3:
                raise Stop

        train(config, envs(), folder / f"{number}-together", team=team)
        try:
            train(config, envs(), folder / f"{number}-stopped", stop, team=team)
        except Stop:
            pass
        train(config, envs(), folder / f"{number}-stopped", resume=True, team=team)
"""


@pytest.fixture
def double_precision() -> Any:
    torch.set_default_dtype(torch.float64)
    yield
    torch.set_default_dtype(torch.float32)


def parts(checkpoint: Checkpoint, prefix: str) -> dict[str, Tensor]:
    return {name: value for name, value in checkpoint.tensors.items() if name.startswith(prefix)}


def test_two_processes_equal_one_and_resume_to_the_same_bits(
    tmp_path: Path, small_config: Any, double_precision: None
) -> None:
    """In double precision, where sums in another order differ by about 1e-16 of their size.

    Adam divides a gradient by its size plus eps = 1e-5, so it may enlarge such a difference by 1e5: 1e-11 bounds what
    rounding can do to a weight (4e-16 was measured). A frame lost, doubled or weighed wrongly does about lr = 7e-4.
    """
    configs = [
        small_config(explo="lang", bptt=4, bootstrap_timeouts=True),
        small_config(explo="cell", num_envs=4, minibatches=4, frames=4 * 8 * 6, loss="per_head"),
        small_config(net="paper", normalize_advantages=False, horizon=4, epochs=1, frames=8 * 4 * 4),
    ]
    result = together(SAME, str(tmp_path), json.dumps([config.model_dump_json() for config in configs]))
    assert result.returncode == 0, result.stderr
    for number, config in enumerate(configs):
        alone = read(train(config, EchoEnvs(config.num_envs, chatter=0.3), tmp_path / f"{number}-alone"))
        team, stopped = (
            read(tmp_path / f"{number}-{kind}" / "checkpoints") for kind in ("together", "stopped")
        )
        check_equal_but_for_rounding(alone, team)
        check_same_log(rows(tmp_path / f"{number}-alone"), rows(tmp_path / f"{number}-together"))

        assert stopped.tensors.keys() == team.tensors.keys()
        for name, value in team.tensors.items():
            assert torch.equal(stopped.tensors[name], value), f"{name} differs after a stop"
        assert rows(tmp_path / f"{number}-stopped") == rows(tmp_path / f"{number}-together")
        starts = (tmp_path / f"{number}-stopped" / "starts.jsonl").read_text().splitlines()
        assert [json.loads(line)["processes"] for line in starts] == [2, 2]

    with pytest.raises(CheckpointError, match=r"made by 2 processes.*got 1: torchrun --nproc-per-node 2"):
        train(configs[0], EchoEnvs(8), tmp_path / "0-together", resume=True)


def check_equal_but_for_rounding(alone: Checkpoint, team: Checkpoint) -> None:
    assert team.meta.processes == 2
    for name, value in parts(alone, "net.").items():
        assert (team.tensors[name] - value).abs().max() < 1e-11, f"{name} differs"
    assert torch.equal(alone.tensors["rng"], team.tensors["rng"])
    for name in ("image", "tokens", "starts", "returns", "lengths"):
        whole = torch.cat([team.tensors[f"state.{name}"], team.tensors[f"rank1.state.{name}"]])
        assert torch.equal(whole, alone.tensors[f"state.{name}"]), f"{name}: another environment was played"


def check_same_log(alone: list[dict[str, Any]], team: list[dict[str, Any]]) -> None:
    for one, two in zip(alone, team, strict=True):
        assert one.keys() == two.keys()
        for key in (
            "update",
            "frames",
            "episodes",
            "success",
            "timeouts",
            "mean_length",
            "outcomes",
            "rules",
        ):
            assert one[key] == two[key], key
        for key, value in one.items():
            if isinstance(value, float):
                assert two[key] == pytest.approx(value, rel=1e-6, abs=1e-8), key


# --- what happens when one of them fails ---

FAIL = """
class Failing(EchoEnvs):
    steps = 0

    def step(self, actions):
        self.steps += 1
        if self.steps == 20 and os.environ["RANK"] == "1":
            if sys.argv[2] == "killed":
                os.kill(os.getpid(), signal.SIGKILL)
            self.poison = sys.argv[2]
        return super().step(actions)

# torchrun ends the others as soon as it sees that one is gone: here they are to find out by themselves.
signal.signal(signal.SIGTERM, signal.SIG_IGN)
config = TrainConfig.model_validate_json(sys.argv[3])
try:
    with joined("cpu") as team:
        train(config, Failing(team.share(config.num_envs)), Path(sys.argv[1]) / "run", team=team)
except TrainingStopped as error:
    sys.exit(f"rank {os.environ['RANK']}: {error}")
"""


@pytest.mark.parametrize(
    ("how", "messages"),
    [
        ("killed", ["rank 0: training stopped in process 0 of 2 after 128 frames (update 2): "]),
        (
            "reward",
            ["rank 1: training stopped in process 1 of 2 after 128 frames (update 2): a reward is not"],
        ),
    ],
)
def test_no_process_outlives_another(
    how: str, messages: list[str], tmp_path: Path, small_config: Any
) -> None:
    began = time.monotonic()
    result = together(FAIL, str(tmp_path), how, small_config().model_dump_json())
    assert time.monotonic() - began < 120, "the others were left waiting"
    assert result.returncode != 0
    for message in messages:
        assert message in result.stderr
    assert "Traceback" not in result.stderr.split("torch/distributed")[0]
    if how == "killed":
        assert "another" in result.stderr, "it is said why process 0 ended"
        assert "Signal 9" in result.stderr, "the kill landed"
    kept = read(tmp_path / "run" / "checkpoints")
    assert kept.meta.update == 2
    assert all(bool(torch.isfinite(value).all()) for value in kept.part("net").values())


# --- by the command line ---


def test_torchrun_trains_by_the_command_line(tmp_path: Path) -> None:
    """A suite with its curriculum and a bonus; single precision, so only the first updates are compared."""
    command = ["run", "social_env", "--frames", str(8 * 32 * 3), "--envs", "8", "--eval-episodes", "1"]
    command += ["--explo", "lang", "--curriculum", "progress", "--threads", "1", "--seed", "5"]
    assert main([*command, "--out", str(tmp_path / "alone")]) == 0
    launcher = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2", "-m"]
    result = subprocess.run(
        [*launcher, "socialai_dsl", *command, "--out", str(tmp_path / "team")],
        capture_output=True,
        text=True,
        timeout=240,
        cwd=ROOT,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.count("writing to") == 1, "one process speaks"
    one, two = rows(tmp_path / "alone"), rows(tmp_path / "team")
    assert len(one) == len(two) == 3
    for key, value in one[0].items():
        if isinstance(value, float):
            assert two[0][key] == pytest.approx(value, rel=1e-4, abs=1e-6), key
    assert [row["episodes"] for row in one] == [row["episodes"] for row in two]
    assert one[0]["outcomes"] == two[0]["outcomes"]
    curricula = [read(tmp_path / name / "checkpoints").tensors["curriculum"] for name in ("alone", "team")]
    assert torch.equal(*curricula), "all processes' curricula are told of all episodes"


def test_a_number_of_environments_that_cannot_be_shared_is_a_usage_error(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2", "-m"]
    command += ["socialai_dsl", "run", "help", "--envs", "7", "--out", str(tmp_path / "run")]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=ROOT, check=False)
    assert result.returncode != 0
    assert "--envs: num_envs: got 7, expected a multiple of the 2 processes that share them" in result.stderr
    assert not (tmp_path / "run").exists()
