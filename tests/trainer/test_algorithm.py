"""An algorithm of one's own gets what PPO gets; what it lacks or returns and must not is named."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import torch

from socialai_dsl.cli.main import run_main
from socialai_dsl.trainer.checkpoint import read
from socialai_dsl.trainer.errors import CheckpointError, TrainingStopped
from socialai_dsl.trainer.logging import Tally
from socialai_dsl.trainer.play import CheckpointPolicy
from socialai_dsl.trainer.policy import NetPolicy
from socialai_dsl.trainer.ppo import Ppo
from socialai_dsl.trainer.rollout import collect
from socialai_dsl.trainer.session import Session
from socialai_dsl.trainer.training import SHIPPED, algorithm_class, begin, train
from tests.trainer.fake_envs import EchoEnvs

MINE = """
import torch
from socialai_dsl.trainer.policy import NetPolicy
from socialai_dsl.trainer.rollout import collect


class Algorithm:
    '''Learns nothing but to count, and to draw.'''

    def __init__(self, session):
        self.session, self.drawn = session, torch.zeros(2)

    def collect(self):
        return collect(self.session, lambda logits: torch.zeros(len(logits), 4, dtype=torch.int64))

    def update(self, rollout):
        self.drawn += torch.rand(2, generator=self.session.generator)
        return {"drawn": float(self.drawn[0]), "nothing": None, "imitation_loss": 1}

    def state(self):
        return {"drawn": self.drawn}

    def load_state(self, state):
        self.drawn = state["drawn"].clone()

    @staticmethod
    def policy(net, greedy, seed):
        return Wilful(net)


class Wilful(NetPolicy):
    '''Says the last word of its network's choices.'''

    def act(self, observation):
        return super().act(observation) * 0 + 3
"""


@pytest.fixture
def own(tmp_path: Path) -> dict[str, str]:
    (tmp_path / "mine.py").write_text(MINE)
    return {"algorithm": "mine:Algorithm", "scenario": str(tmp_path / "x.yaml")}


def test_it_plays_learns_resumes_and_is_played_by_its_own_code(
    own: dict[str, str], tmp_path: Path, small_config: Any
) -> None:
    config = small_config(**own, checkpoint_every=1, keep_checkpoints=9)
    rows: list[Any] = []
    whole = train(config, EchoEnvs(8), tmp_path / "whole", rows.append)
    drawn = [row["drawn"] for row in rows]
    assert drawn == sorted(drawn)
    assert rows[0]["nothing"] is None
    assert "policy_loss" not in rows[0]
    assert rows[0]["outcomes"]["left"] == 1, "the actions that it chose are played"
    assert read(whole).tensors["algorithm.drawn"].tolist()[0] == pytest.approx(drawn[-1])

    def stop(row: Any) -> None:
        if row["update"] == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(config, EchoEnvs(8), tmp_path / "parts", stop)
    parts = read(train(config, EchoEnvs(8), tmp_path / "parts", resume=True)).tensors
    for name, value in read(whole).tensors.items():
        assert torch.equal(parts[name], value), name

    envs = EchoEnvs(4)
    policy = CheckpointPolicy.load(whole, envs, folder=tmp_path, algorithm="mine:Algorithm")
    assert (policy.act(envs.reset(seed=0)[0]) == 3).all()


def test_no_file_chooses_what_is_imported(own: dict[str, str], tmp_path: Path, small_config: Any) -> None:
    path = train(small_config(**own, frames=64), EchoEnvs(8), tmp_path / "run")
    for named in (None, "other:Algorithm"):
        with pytest.raises(
            CheckpointError, match=r"name it \(--algorithm mine:Algorithm\) to load that code"
        ):
            CheckpointPolicy.load(path, EchoEnvs(8), folder=tmp_path, algorithm=named)


def test_ppo_is_an_algorithm_like_others(tmp_path: Path, small_config: Any) -> None:
    assert {"ppo": Ppo} == SHIPPED
    assert isinstance(begin(small_config(), EchoEnvs(8)).algorithm, Ppo)
    path = train(small_config(frames=64), EchoEnvs(8), tmp_path)
    assert isinstance(CheckpointPolicy.load(path, EchoEnvs(8)).policy, NetPolicy)


METHODS = ("collect", "update", "state", "load_state", "policy")


@pytest.mark.parametrize("method", METHODS)
def test_one_that_lacks_a_method_is_refused_before_training(
    method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(MINE.replace(f"def {method}(", f"def other_{method}("))
    with pytest.raises(ValueError, match=f"algorithm: .*mine.py: Algorithm lacks the method '{method}'"):
        algorithm_class("mine:Algorithm", tmp_path)
    command = [
        "help",
        "--recipe",
        "plain",
        "--algorithm",
        "mine:Algorithm",
        "--out",
        "run",
        "--frames",
        "300",
    ]
    assert run_main(command) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert said[-1].endswith(f"mine.py: Algorithm lacks the method '{method}'")
    assert not Path("run").exists()


class Given(NamedTuple):
    """What an algorithm returned, without more."""

    tally: Any = None


class Returning:
    """Returns what it is given."""

    def __init__(self, session: Session, played: Any = None, figures: Any = None) -> None:
        self._session, self._played, self._figures = session, played, figures

    def collect(self) -> Any:
        return Given(Tally()) if self._played is None else self._played

    def update(self, played: Any) -> Any:
        return self._figures

    def state(self) -> dict[str, Any]:
        return {}

    def load_state(self, state: Any) -> None:
        pass

    policy = NetPolicy


@pytest.mark.parametrize(
    ("returned", "error", "message"),
    [
        ({"played": 3}, ValueError, "algorithm: collect returned int, expected an object whose `tally` is a"),
        (
            {"played": Given()},
            ValueError,
            "algorithm: collect returned Given, expected an object whose `tally`",
        ),
        ({"figures": None}, ValueError, "algorithm: update returned NoneType, expected numbers by name"),
        ({"figures": {1: 2}}, ValueError, "algorithm: update returned dict, expected numbers by name"),
        ({"figures": {"a": "b"}}, ValueError, "algorithm: a of update: got str, expected a number or None"),
        ({"figures": {"a": np.nan}}, TrainingStopped, "a of the update is not a finite number"),
    ],
)
def test_what_it_must_not_return_is_refused_by_name_and_nothing_is_lost(
    returned: Any,
    error: Any,
    message: str,
    tmp_path: Path,
    small_config: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(SHIPPED, "ppo", lambda session: Returning(session, **returned))  # type: ignore[misc]
    with pytest.raises(error, match=message):
        train(small_config(), EchoEnvs(8), tmp_path)
    assert read(tmp_path / "checkpoints").meta.update == 0


def test_actions_of_another_shape_are_refused(small_config: Any) -> None:
    session = Session.start(small_config(), EchoEnvs(8))
    with pytest.raises(
        ValueError, match=r"algorithm: the actions chosen: got the shape \(8,\), expected \(8, 4\)"
    ):
        collect(session, lambda logits: torch.zeros(len(logits), dtype=torch.int64))
