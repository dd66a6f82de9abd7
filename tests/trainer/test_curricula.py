"""Curricula: what they choose by what they observe, and runs that resume exactly."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import socialai_dsl as sd
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.frontend import load_curriculum
from socialai_dsl.trainer.checkpoint import read
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.curricula import Leaves, Phases, build_curriculum
from socialai_dsl.trainer.curricula.even import EvenFrames
from socialai_dsl.trainer.curricula.progress import WINDOW, LearningProgress
from socialai_dsl.trainer.errors import CheckpointError
from socialai_dsl.trainer.session import Session
from socialai_dsl.trainer.training import train

SCHOOL = str(Path(__file__).parents[1] / "data" / "suites" / "school.yaml")
INTRODUCTIONS = ("none", "eye_contact", "ask", "ask_eye_contact")
EXPERT = Leaves(
    tuple(f"{i}{s}" for i in INTRODUCTIONS for s in ("+", "-")),
    tuple({"introduction": i, "scaffolding": s} for i in INTRODUCTIONS for s in ("true", "false")),
    (1,) * 8,
)


def written(folder: Path, text: str) -> Path:
    path = folder / "plan.yaml"
    path.write_text(f"curriculum: mine\nphases:\n{text}\n")
    return path


def test_the_expert_goes_on_after_a_thousand_episodes_with_enough_success() -> None:
    expert = build_curriculum("expert", EXPERT)
    assert len(set(expert.weights())) == 1
    for _ in range(1000):
        expert.observe(0, True, 10)
    assert len(set(expert.weights())) == 1
    expert.observe(0, True, 10)
    assert [weight > 0 for weight in expert.weights()] == [False] * 7 + [True]


def test_the_expert_waits_until_the_last_five_hundred_are_good_enough() -> None:
    expert = build_curriculum("expert", EXPERT)
    for _ in range(3000):
        expert.observe(0, False, 10)
    for _ in range(374):
        expert.observe(0, True, 10)
    assert len(set(expert.weights())) == 1
    expert.observe(5, True, 10)
    assert len(set(expert.weights())) == 2


def test_the_expert_needs_no_scaffolding_in_the_suite() -> None:
    leaves = Leaves(INTRODUCTIONS, tuple({"introduction": i} for i in INTRODUCTIONS), (1, 1, 1, 1))
    expert = build_curriculum("expert", leaves)
    for _ in range(1001):
        expert.observe(0, True, 10)
    assert [weight > 0 for weight in expert.weights()] == [False, False, False, True]


def test_a_reverse_curriculum_falls_from_one_to_zero() -> None:
    leaves = Leaves(("told", "none"), ({"help": "told"}, {"help": "none"}), (1, 1))
    reverse = build_curriculum("reverse", leaves)
    shares = []
    for _ in range(20_001):
        told, none = reverse.weights()
        shares.append(told / (told + none))
        reverse.observe(0, False, 10)
    assert shares[0] == 1
    assert shares[10_000] == pytest.approx(0.5, abs=1e-5)
    assert shares[19_999] == pytest.approx(5e-5, abs=1e-5)
    assert np.all(np.diff(shares) <= 0)
    assert reverse.weights()[0] == 0


def test_groups_share_by_their_weights_and_keep_the_suites_own(tmp_path: Path) -> None:
    leaves = Leaves(("a", "b", "c"), ({"k": "1"}, {"k": "1"}, {"k": "2"}), (1, 3, 5))
    text = "  - play: [{only: {k: 1}, weight: 3}, {members: [c], weight: 1}]"
    weights = Phases(load_curriculum(written(tmp_path, text)), leaves).weights()
    assert np.array(weights) / sum(weights) == pytest.approx([3 / 16, 9 / 16, 4 / 16], abs=1e-5)


def test_phases_may_share_the_frames(tmp_path: Path) -> None:
    leaves = Leaves(("short", "long", "off"), ({}, {}, {}), (1, 1, 1))
    path = written(tmp_path, "  - play: [{members: [short]}, {members: [long], weight: 3}]")
    path.write_text(f"share: frames\n{path.read_text()}")
    phases = Phases(load_curriculum(path), leaves)
    for _ in range(100):
        phases.observe(0, True, 5)
        phases.observe(1, False, 30)
    short, long, off = phases.weights()
    assert (5 * short / (30 * long), off) == (pytest.approx(1 / 3, abs=1e-4), 0)
    again = Phases(load_curriculum(path), leaves)
    again.load_state(phases.state())
    assert again.weights() == [short, long, 0], "a resumed run knows the lengths"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("  - play: [{only: {k: 3}}]", r"phases.0.play.0: got k: 3; the suite has 1, 2"),
        ("  - play: [{only: {l: 1}}]", "no values: the suite has no such parameter"),
        ("  - play: [{members: [d]}]", "the suite has no member 'd'"),
        ("  - play: [{without: {k: [1, 2]}}]", "no member of the suite is in this group"),
    ],
)
def test_phases_that_do_not_fit_the_suite(tmp_path: Path, text: str, message: str) -> None:
    leaves = Leaves(("a", "b", "c"), ({"k": "1"}, {"k": "1"}, {"k": "2"}), (1, 3, 5))
    with pytest.raises(ValueError, match="curriculum: ") as raised:
        Phases(load_curriculum(written(tmp_path, text)), leaves)
    assert message in str(raised.value)


def test_all_mistakes_of_a_file_are_said_with_their_places(tmp_path: Path) -> None:
    text = "  - play: [{wieght: 3, only: {k: 1}}]\n  - until: {success: 1.5}\n  - play: [{weight: {from: 1, to: 0}}]"
    with pytest.raises(ScenarioError) as raised:
        build_curriculum(str(written(tmp_path, text)), EXPERT)
    assert [(d.code, d.span.line, d.message) for d in raised.value.diagnostics] == [
        ("S105", 3, "phase 1 never ends, so those after it are never played"),
        ("S101", 3, "unknown key `wieght` in a group of members"),
        ("S106", 4, "`1.5` is too large; at most 1 is expected"),
        ("S105", 5, "`weight` needs a key `over`"),
    ]


@pytest.mark.parametrize(("text", "code"), [("  - {play: [", "S001"), ("", "S104")])
def test_files_without_phases(tmp_path: Path, text: str, code: str) -> None:
    with pytest.raises(ScenarioError) as raised:
        build_curriculum(str(written(tmp_path, text)), EXPERT)
    assert [d.code for d in raised.value.diagnostics] == [code]


@pytest.mark.parametrize("name", ["nowhere.yaml", "scenario.yaml"])
def test_files_that_are_no_curriculum(tmp_path: Path, name: str) -> None:
    (tmp_path / "scenario.yaml").write_text("scenario: mine\nextends: talkitout\n")
    with pytest.raises(ScenarioError, match=r"there is no such file|expected a curriculum"):
        build_curriculum(str(tmp_path / name), EXPERT)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "expart",
            "expected one of even, expert, ladder, progress, reverse, a .yaml file, or mine:Curriculum",
        ),
        ("no_such_module:Mine", "there is no module 'no_such_module'"),
        ("json:JSONDecoder", "JSONDecoder lacks the method 'observe'"),
    ],
)
def test_names_that_are_wrong(name: str, message: str) -> None:
    with pytest.raises(ValueError, match="curriculum: ") as raised:
        build_curriculum(name, {})  # type: ignore[arg-type]
    assert message in str(raised.value)


def test_learning_progress_prefers_what_changes() -> None:
    progress = LearningProgress(Leaves(("new", "learnt", "learning"), ({}, {}, {}), (1, 1, 1)))
    for i in range(2 * WINDOW):
        progress.observe(1, True, 10)
        progress.observe(2, i >= WINDOW + WINDOW // 2, 10)
    assert [progress.progress(member) for member in range(3)] == [1, 0, 0.5]
    new, learnt, learning = progress.weights()
    assert new > learning > learnt > 0


def test_even_frames_give_short_episodes_more_often() -> None:
    even = EvenFrames(Leaves(("short", "long", "rare"), ({}, {}, {}), (2, 2, 1)))
    assert even.weights() == [1 << 16, 1 << 16, 1 << 15], (
        "the suite's own chances, as long as nothing is known"
    )
    for _ in range(200):
        even.observe(0, True, 4)
        even.observe(1, False, 40)
        even.observe(2, False, 8)
    short, long, rare = even.weights()
    assert (short, long, rare) == (1 << 16, round((1 << 16) / 10), 1 << 14)
    for _ in range(2000):
        even.observe(1, True, 4)
    assert even.weights() == [short, short, rare], "episodes of long ago are forgotten"


@pytest.mark.parametrize("name", ["even", "expert", "progress"])
def test_the_state_is_all_it_remembers(name: str) -> None:
    rng = np.random.default_rng(3)
    one, other = build_curriculum(name, EXPERT), build_curriculum(name, EXPERT)
    for _ in range(900):
        one.observe(int(rng.integers(8)), bool(rng.random() < 0.9), int(rng.integers(1, 40)))
    other.load_state(one.state())
    for _ in range(900):
        ended = int(rng.integers(8)), bool(rng.random() < 0.9), int(rng.integers(1, 40))
        one.observe(*ended)
        other.observe(*ended)
        assert one.weights() == other.weights()


def config(frames: int, curriculum: str, **more: Any) -> RunConfig:
    values: dict[str, Any] = {
        "frames": frames,
        "envs": 8,
        "horizon": 16,
        "minibatches": 2,
        "epochs": 1,
        "checkpoint_every": 1,
        "tensorboard": False,
        "threads": 1,
    }
    return RunConfig(curriculum=curriculum, **(values | more))


class Alternating:
    """A curriculum of a user's: the members in turn, by the episodes seen."""

    def __init__(self, leaves: Leaves) -> None:
        self.count, self.seen = len(leaves.names), [0]

    def observe(self, member: int, success: bool, steps: int) -> None:
        del success, steps
        self.seen = [self.seen[0] + 1, *self.seen[1:], member]

    def weights(self) -> list[int]:
        return [int(self.seen[0] // 4 % self.count == member) for member in range(self.count)]

    def state(self) -> dict[str, Any]:
        return {"seen": self.seen}

    def load_state(self, state: dict[str, Any]) -> None:
        self.seen = list(state["seen"])


MINE = f"{__name__}:Alternating"


def envs(name: str = SCHOOL) -> Any:
    return sd.make_vec(name, 8, autoreset_mode="SameStep")


def test_a_curriculum_chooses_from_the_first_episode_on() -> None:
    session = Session.start(config(64, MINE), envs())
    assert session.envs.member_ids().tolist() == [0] * 8


@pytest.mark.parametrize("name", [MINE, "even", "progress"])
@pytest.mark.thorough("trains three times")
def test_a_resumed_run_goes_on_to_the_same_bits(name: str, tmp_path: Path) -> None:
    whole = read(train(config(128 * 6, name), envs(), tmp_path / "whole"))
    train(config(128 * 3, name), envs(), tmp_path / "parts")
    parts = read(train(config(128 * 6, name), envs(), tmp_path / "parts", resume=True))
    assert parts.tensors.keys() == whole.tensors.keys()
    assert "curriculum" in whole.tensors
    for key, value in whole.tensors.items():
        assert torch.equal(parts.tensors[key], value), key


def test_a_run_resumes_only_with_the_same_curriculum(tmp_path: Path) -> None:
    train(config(128, "progress"), envs(), tmp_path)
    with pytest.raises(CheckpointError, match="curriculum: progress -> "):
        train(config(256, MINE), envs(), tmp_path, resume=True)
    plan = written(tmp_path, "  - play: [{only: {help: none}}]")
    train(config(128, str(plan)), envs(), tmp_path / "other")
    written(tmp_path, "  - play: [{only: {help: told}}]")
    with pytest.raises(CheckpointError, match="its file has changed since"):
        train(config(256, str(plan)), envs(), tmp_path / "other", resume=True)


@pytest.mark.parametrize("name", ["talkitout", str(Path(SCHOOL).with_name("acts.yaml"))])
def test_only_suites_that_draw_members_have_a_curriculum(name: str) -> None:
    with pytest.raises(ValueError, match="suite"):
        Session.start(config(64, "progress"), envs(name))


def test_episodes_are_credited_to_the_member_that_was_played() -> None:
    session = Session.start(config(64, MINE), envs())
    playing = session.envs
    assert session.tutor is not None
    ended_members: list[int] = []
    before = playing.member_ids()
    rng = np.random.default_rng(0)
    for _ in range(60):
        *_, terminated, truncated, _ = playing.step(
            rng.integers(playing.single_action_space.nvec, size=(8, 4))
        )
        ended = terminated | truncated
        ended_members += before[ended].tolist()
        if ended.any():
            session.tutor.step(ended, ended, np.ones(8, np.int64))
        before = playing.member_ids()
    assert session.tutor.curriculum.state()["seen"][1:] == ended_members
    assert len(ended_members) > 20
