"""A network, bonus, curriculum or guide of one's own works from a file beside the scenario; mistakes are named."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from gymnasium.vector import AutoresetMode

from socialai_dsl.trainer.bonus import build_bonus
from socialai_dsl.trainer.checkpoint import read
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.curricula import Leaves, build_curriculum
from socialai_dsl.trainer.errors import TrainingStopped
from socialai_dsl.trainer.guides import Lead, build_guide
from socialai_dsl.trainer.nets import NetSpec, build_net
from socialai_dsl.trainer.play import CheckpointPolicy
from socialai_dsl.trainer.rollout import collect
from socialai_dsl.trainer.session import Session
from socialai_dsl.trainer.training import train
from tests.trainer.fake_envs import EchoEnvs

SPEC = NetSpec((4, 2, 2, 4), (7, 7, 4), (12, 5, 3, 3), ("<pad>", "<unk>", "hello"))
LEAVES = Leaves(("a", "b"), ({}, {}), (1, 1))

MINE = '''
import numpy as np
from torch import nn
from socialai_dsl.trainer.guides import ScriptGuide
from socialai_dsl.trainer.nets import FastNet, Memory


class GruMemory(Memory):
    def __init__(self, inputs, size):
        super().__init__((size,), size)
        self.cell = nn.GRUCell(inputs, size)

    def step(self, inputs, memory):
        memory = self.cell(inputs, memory)
        return memory, memory


class Net(FastNet):
    def __init__(self, spec):
        super().__init__(spec)
        self.memory = GruMemory(self.features, self.memory.size)


class Bonus:
    """Pays for each kind of utterance less, the more often it was heard in all episodes."""

    def __init__(self, config, num_envs):
        self.counts = np.zeros(1000, np.int64)

    def step(self, step):
        heard = step.envs.utterance_ids()
        np.add.at(self.counts, heard, 1)
        return 0.1 / np.sqrt(self.counts[heard])

    def state(self):
        return {"counts": self.counts}

    def load_state(self, state):
        self.counts = np.array(state["counts"])


class Curriculum:
    def __init__(self, leaves):
        self.count = len(leaves.names)

    def observe(self, member, success):
        pass

    def weights(self):
        return [1] * self.count

    def state(self):
        return {}

    def load_state(self, state):
        pass


class Guide(ScriptGuide):
    """The script plays one episode of every environment."""

    def __init__(self, config, envs):
        super().__init__(config, envs)
        self.begun = 0

    def lead(self, envs, starts, progress):
        lead = super().lead(envs, starts, float(self.begun >= len(starts)))
        self.begun += int(starts.sum())
        return lead

    def state(self):
        return super().state() | {"begun": self.begun}

    def load_state(self, state):
        super().load_state(state)
        self.begun = state["begun"]
'''

BUILDERS: dict[str, Callable[[str, Path], Any]] = {
    "net": lambda name, folder: build_net(name, SPEC, 0, folder=folder),
    "bonus": lambda name, folder: build_bonus(RunConfig(bonus=name, scenario=str(folder / "x.yaml")), 4),
    "curriculum": lambda name, folder: build_curriculum(name, LEAVES, folder),
    "guide": lambda name, folder: build_guide(
        RunConfig(guide=name, scenario=str(folder / "x.yaml")), EchoEnvs(4)
    ),
}


@pytest.mark.parametrize("option", BUILDERS)
def test_a_class_is_found_beside_the_scenario(option: str, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(MINE)
    made = BUILDERS[option](f"mine:{option.title()}", tmp_path)
    assert type(made).__name__ == option.title()
    assert type(made).__module__ != "mine"


@pytest.mark.parametrize("option", BUILDERS)
@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("nothing", "", "got 'nothing', expected one of "),
        ("mine:", "", "got 'mine:', expected one of "),
        (
            "not_there:Mine",
            "",
            "there is no module 'not_there': looked for {folder}/not_there.py, then for an instal",
        ),
        ("mine:Mine", "Mine = 3", "{folder}/mine.py has no class 'Mine'"),
        ("mine:Other", "class Mine: pass", "{folder}/mine.py has no class 'Other'"),
        ("mine:Mine", "class Mine: pass", "{folder}/mine.py: Mine lacks the method '{first}'"),
        ("mine:Mine", "import nowhere_at_all", "{folder}/mine.py: No module named 'nowhere_at_all'"),
        ("mine:Mine", "class Mine", "{folder}/mine.py cannot be imported: SyntaxError: "),
        ("mine:Mine", "1 / 0", "{folder}/mine.py cannot be imported: ZeroDivisionError: division by zero"),
    ],
)
def test_a_mistake_is_one_line(option: str, name: str, text: str, message: str, tmp_path: Path) -> None:
    if text:
        (tmp_path / "mine.py").write_text(text)
    first = {"net": "prepare", "bonus": "step", "curriculum": "observe", "guide": "lead"}[option]
    with pytest.raises(ValueError, match=f"^{option}: ") as caught:
        BUILDERS[option](name, tmp_path)
    said = str(caught.value)
    assert message.format(folder=tmp_path, first=first) in said
    assert "\n" not in said


def test_a_network_lacks_what_it_does_not_implement(tmp_path: Path) -> None:
    text = (
        "from socialai_dsl.trainer.nets import ActorCritic\n"
        "class Mine(ActorCritic):\n    def prepare(self, images): pass\n"
    )
    (tmp_path / "mine.py").write_text(text)
    with pytest.raises(ValueError, match=r"net: .*/mine\.py: Mine lacks the method 'perceive'"):
        build_net("mine:Mine", SPEC, 0, folder=tmp_path)
    (tmp_path / "other.py").write_text(
        "class Mine:\n    def prepare(self): pass\n    def perceive(self): pass\n"
    )
    with pytest.raises(
        ValueError,
        match=r"net: got 'other:Mine', expected a subclass of socialai_dsl\.trainer\.nets\.ActorCritic",
    ):
        build_net("other:Mine", SPEC, 0, folder=tmp_path)


def test_equally_named_files_of_two_folders_do_not_meet(tmp_path: Path) -> None:
    for number in (1, 2):
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / "mine.py").write_text(
            f"from socialai_dsl.trainer.nets import FastNet\nclass Net(FastNet):\n    kind_size = {4 * number}\n"
        )
    sizes = [build_net("mine:Net", SPEC, 0, folder=tmp_path / str(n)).kind_size for n in (1, 2, 1)]
    assert sizes == [4, 8, 4]


def test_what_lies_beside_the_file_can_be_imported_and_is_that_of_its_own_folder(tmp_path: Path) -> None:
    text = "from beside_the_file import SIZE\nfrom socialai_dsl.trainer.nets import FastNet\n"
    for size in (12, 20):
        folder = tmp_path / str(size)
        folder.mkdir()
        (folder / "beside_the_file.py").write_text(f"SIZE = {size}\n")
        (folder / "mine.py").write_text(text + "class Net(FastNet):\n    kind_size = SIZE\n")
        assert build_net("mine:Net", SPEC, 0, folder=folder).kind_size == size


def test_a_file_that_was_changed_is_read_again(tmp_path: Path) -> None:
    for size in (4, 8):
        text = f"from socialai_dsl.trainer.nets import FastNet\nclass Net(FastNet):\n    kind_size = {size}\n"
        (tmp_path / "mine.py").write_text(text)
        assert build_net("mine:Net", SPEC, 0, folder=tmp_path).kind_size == size


@pytest.mark.thorough("trains three times")
def test_a_run_with_everything_of_ones_own_resumes_to_the_same_bits(
    tmp_path: Path, small_config: Any
) -> None:
    """A memory that is one vector instead of an LSTM's two, a bonus and a guide with state; nothing else is said."""
    (tmp_path / "mine.py").write_text(MINE)
    own = {
        "net": "mine:Net",
        "bonus": "mine:Bonus",
        "guide": "mine:Guide",
        "scenario": str(tmp_path / "x.yaml"),
    }
    config = small_config(**own, bptt=4, checkpoint_every=1)

    def stop(seen: Mapping[str, Any]) -> None:
        if seen["update"] == 1:
            raise KeyboardInterrupt

    whole = read(train(config, EchoEnvs(8), tmp_path / "whole"))
    with pytest.raises(KeyboardInterrupt):
        train(config, EchoEnvs(8), tmp_path / "parts", stop)
    path = train(config, EchoEnvs(8), tmp_path / "parts", resume=True)
    parts = read(path)
    assert parts.tensors["state.memory"].shape == (8, 128)
    for name, value in whole.tensors.items():
        assert torch.equal(parts.tensors[name], value), name
    before = read(sorted((tmp_path / "parts" / "checkpoints").iterdir())[0]).part("net")
    moved = [name for name, value in parts.part("net").items() if not torch.equal(value, before[name])]
    assert {"memory.cell.weight_ih", "memory.cell.weight_hh"} <= set(moved), "it learns"

    there = EchoEnvs(4, mode=AutoresetMode.DISABLED)
    policy = CheckpointPolicy.load(path, there, net="mine:Net", folder=tmp_path)
    assert policy.act(there.reset(seed=0)[0]).shape == (4, 4)


def returning(method: str, result: Any) -> Any:
    """One whose method returns this, or what this makes of the number of environments."""
    return type("Mine", (), {method: lambda self, envs, *rest: result(8) if callable(result) else result})()


def lead(**changes: Any) -> Lead:
    given = {"actions": np.zeros((8, 4), np.int64), "led": np.ones(8, np.bool_), "weights": np.ones(8)}
    return Lead(**(given | changes))


@pytest.mark.parametrize(
    ("result", "message"),
    [
        (lambda n: np.zeros(n - 5), r"got the shape \(3,\), expected \(8,\)"),
        (0.5, r"got the shape \(\), expected \(8,\)"),
        (lambda n: np.zeros((n, 1)), r"got the shape \(8, 1\), expected \(8,\)"),
        (None, "got the shape"),
        (lambda n: ["1"] * n, "got the type <U1, expected float64"),
        (lambda n: np.zeros(n, complex), "got the type complex128, expected float64"),
        ([[1], [1, 2]], "got what is no array"),
        (lambda n: np.full(n, np.nan), "what the bonus paid is not a finite number"),
        (lambda n: np.full(n, -np.inf), "what the bonus paid is not a finite number"),
        (lambda n: np.full(n, 1e300), "what the bonus paid is not a finite number"),
    ],
)
def test_what_a_bonus_must_not_pay_is_refused_by_name(result: Any, message: str, small_config: Any) -> None:
    session = Session.start(small_config(), EchoEnvs(8))
    session.bonus = returning("step", result)
    stops = message.startswith("what the bonus")
    with pytest.raises(
        TrainingStopped if stops else ValueError,
        match=message if stops else f"bonus: the result of step: {message}",
    ):
        collect(session)


@pytest.mark.parametrize(
    ("result", "message"),
    [
        (
            lead(actions=np.full((8, 4), 4)),
            r"actions of lead: got \[4, 4, 4, 4\] for environment 0, expected wh",
        ),
        (lead(actions=np.full((8, 4), -1)), r"actions of lead: got \[-1, -1, -1, -1\] for environment 0"),
        (
            lead(actions=np.eye(8, 4, -3, np.int64) * 2),
            r"actions of lead: got \[0, 2, 0, 0\] for environment 4",
        ),
        (lead(actions=np.zeros((8, 4))), "actions of lead: got the type float64, expected int64"),
        (lead(actions=np.zeros((8, 3), int)), r"actions of lead: got the shape \(8, 3\), expected \(8, 4\)"),
        (lead(actions=None), "actions of lead: got the shape"),
        (lead(led=np.ones(8, int)), "led of lead: got the type int64, expected bool"),
        (lead(led=True), r"led of lead: got the shape \(\), expected \(8,\)"),
        (lead(weights=-np.ones(8)), "weights of lead: got -1, expected at least 0"),
        (lead(weights=np.ones((8, 1))), r"weights of lead: got the shape \(8, 1\), expected \(8,\)"),
        (lead(weights=np.full(8, np.nan)), "a weight that the guide's lead returned is not a finite number"),
        (np.zeros((8, 4), int), "lead returned ndarray, expected Lead"),
        (None, "lead returned NoneType, expected Lead"),
    ],
)
def test_what_a_guide_must_not_do_is_refused_by_name(result: Any, message: str, small_config: Any) -> None:
    session = Session.start(small_config(), EchoEnvs(8))
    session.guide = returning("lead", result)
    stops = message.startswith("a weight")
    with pytest.raises(
        TrainingStopped if stops else ValueError, match=message if stops else f"guide: {message}"
    ):
        collect(session)


def test_what_a_guide_returns_may_be_of_any_type_that_loses_nothing(small_config: Any) -> None:
    for given in (lead(actions=np.zeros((8, 4), np.uint8)), lead(led=[True] * 8, weights=[1] * 8)):
        session = Session.start(small_config(), EchoEnvs(8))
        session.guide = returning("lead", given)
        rollout = collect(session)
        assert rollout.lead is not None
        assert rollout.lead.led.all()
        assert [part.dtype for part in rollout.lead] == [torch.int64, torch.bool, torch.float32]


@pytest.mark.parametrize(
    ("part", "wrong", "message"),
    [
        ("perceive", lambda *_: torch.zeros(3, 128), r"the result of perceive: got the shape \(3, 128\)"),
        ("heads", lambda x: (x, x[:, 0]), r"logits of heads: got the shape \(8, 128\), expected \(8, 12\)"),
        (
            "heads",
            lambda x: (x[:, :12], x[:, :1]),
            r"values of heads: got the shape \(8, 1\), expected \(8,\)",
        ),
    ],
)
def test_what_a_network_must_not_return_is_refused_by_name(
    part: str, wrong: Any, message: str, small_config: Any
) -> None:
    session = Session.start(small_config(), EchoEnvs(8))
    owner, name = (session.actor.net.heads, "forward") if part == "heads" else (session.actor.net, "perceive")
    setattr(owner, name, wrong)
    with pytest.raises(ValueError, match=f"net: {message}"):
        collect(session)


@pytest.mark.parametrize("state", [None, 3, {"a": object()}, {"a": [[1], [1, 2]]}])
def test_a_state_that_cannot_be_kept_is_refused_before_the_first_frame(
    state: Any, tmp_path: Path, small_config: Any
) -> None:
    session = Session.start(small_config(), EchoEnvs(8))
    session.bonus = returning("state", None)
    session.bonus.state = lambda: state  # type: ignore[union-attr]
    with pytest.raises(ValueError, match="bonus: state returned what are no arrays by name"):
        session.save(tmp_path)
    session.bonus, session.guide = None, returning("state", None)
    session.guide.state = lambda: {"a": object()}  # type: ignore[union-attr]
    with pytest.raises(ValueError, match="guide: state returned what is no JSON data"):
        session.save(tmp_path)
    assert not list(tmp_path.rglob("*.safetensors"))
