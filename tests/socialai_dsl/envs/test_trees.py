"""Trees, starts, acts and weights as environments."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.diagnostics import ScenarioError

FOLDER = Path(__file__).parents[2] / "data" / "suites"
SCHOOL, ACTS = f"{FOLDER}/school.yaml", f"{FOLDER}/acts.yaml"
TOLD = "problem=password,introduction=ask,help=told"
STILL = (None, None, None)


def say(env: Any, text: str) -> Any:
    return env.step(env.encode_action((None, text)))


def drawn(envs: Any, weights: list[int] | None = None) -> np.ndarray:
    """The share of the environments that plays each member after a reset."""
    if weights is not None:
        envs.set_member_weights(weights)
    envs.reset(seed=3)
    return np.bincount(envs.member_ids(), minlength=len(envs.program.members)) / envs.num_envs


def test_leaves_are_drawn_with_equal_chances_at_each_parameter() -> None:
    shares = drawn(sd.make_vec(SCHOOL, 6000))
    assert shares == pytest.approx([1 / 12] * 6 + [1 / 4] * 2, abs=0.03)


def test_weights_can_be_set_and_concern_later_episodes() -> None:
    envs = sd.make_vec(SCHOOL, 600)
    before = drawn(envs)
    envs.set_member_weights([0] * 7 + [1])
    assert np.bincount(envs.member_ids(), minlength=8) / 600 == pytest.approx(before)
    assert drawn(envs)[7] == 1
    assert drawn(envs, [1] * 8) == pytest.approx([1 / 8] * 8, abs=0.06)


def test_weights_are_part_of_a_snapshot() -> None:
    envs = sd.make_vec(SCHOOL, 40)
    drawn(envs, [0, 0, 0, 0, 0, 0, 1, 0])
    saved = envs.snapshot()
    other = sd.make_vec(SCHOOL, 40)
    other.restore(saved)
    other.reset()
    assert set(other.members()) == {"problem=shopping,size=small"}


@pytest.mark.parametrize("weights", [[1] * 7, [0] * 8, [-1] + [1] * 7, [1 << 32] + [0] * 7])
def test_weights_that_are_wrong(weights: list[int]) -> None:
    with pytest.raises(ValueError, match="weights: got"):
        sd.make_vec(SCHOOL, 2).set_member_weights(weights)


@pytest.mark.parametrize("name", ["talkitout", ACTS])
def test_only_suites_that_draw_members_have_weights(name: str) -> None:
    with pytest.raises(ValueError, match="no suite that draws members"):
        sd.make_vec(name, 2).set_member_weights([1])


def test_a_layout_without_a_member_is_for_the_leaf_that_is_drawn() -> None:
    envs = sd.make_vec(SCHOOL, 50)
    envs.set_member_weights([1, 0, 1, 0, 1, 0, 0, 0])
    envs.reset(seed=4)
    members = envs.members()
    envs.reset(seed=4, options={"layout": {"teacher": {"at": [2, 2]}}})
    assert envs.members() == members


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_episodes_of_a_leaf_start_as_it_says(mode: str) -> None:
    envs = sd.make_vec(SCHOOL, 30, autoreset_mode=mode)
    envs.set_member_weights([0, 0, 1, 1, 0, 0, 0, 0])
    envs.reset(seed=0)
    fresh = np.ones(30, bool)
    starts = 0
    still = np.zeros((30, 4), np.int64)
    still[:, 0] = envs.single_action_space.nvec[0] - 1
    ended = np.zeros(30, bool)
    for _ in range(40):
        for row in np.flatnonzero(fresh):
            told = envs.member_ids()[row] == 3
            state = envs.describe(row)
            assert (state["teacher"]["state"] == "helping") == told
            assert state["heard"] == (["Tea: Open bread"] if told else [])
            assert state["t"] == 0
            if told:
                assert (state["teacher"]["at"], state["let"]["secret"]) == ([2, 2], "bread")
            starts += told
        *_, terminated, truncated, _ = envs.step(still)
        fresh, ended = (
            (terminated | truncated, ended) if mode == "SameStep" else (ended, terminated | truncated)
        )
    assert starts > 20


def test_a_single_environment_starts_so_as_well_and_a_layout_replaces_it() -> None:
    env = sd.make(SCHOOL)
    for seed in range(60):
        _, info = env.reset(seed=seed)
        if info["member"] == TOLD:
            break
    assert info["history"] == "Tea: Open bread"
    assert say(env, "Open bread")[4]["outcome"] == "opened"
    _, info = env.reset(seed=seed, options={"layout": {"member": TOLD, "let": {"secret": "apple"}}})
    assert (info["history"], env.describe()["let"]["secret"]) == ("", "apple")


@pytest.mark.parametrize(
    ("layout", "finding"),
    [
        ("{teacher: {state: helpful}}", "3:23: S204 teacher.state: got 'helpful'; expected one of stranger, helping"),
        ("{teacher: {stat: helping}}", "3:23: S204 teacher: there is no 'stat'; did you mean 'state'?"),
        ("{techer: {at: [1, 1]}}", "3:13: S204 the layout: there is no 'techer'; did you mean 'teacher'?"),
        ("{teacher: {at: [1, 9]}}", "3:31: S204 teacher.at[1]: got 9"),
        ("{heard: [\"Tea: Open sesame\"]}", "3:21: S204 heard[0]: got 'Tea: Open sesame'"),
    ],
)  # fmt: skip
def test_layouts_that_do_not_fit_are_shown_in_the_suite(
    layout: str, finding: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("lesson.yaml").write_text((FOLDER / "lesson.yaml").read_text())
    Path("mine.yaml").write_text(f"suite: mine\nmembers:\n- {{layout: {layout}, scenario: lesson}}\n")
    with pytest.raises(ScenarioError) as raised:
        sd.make("mine.yaml")
    assert finding in str(raised.value)


def test_acts_follow_one_another_in_one_episode() -> None:
    env = sd.make(ACTS)
    _, info = env.reset(seed=0)
    assert info["member"] == "lesson"
    say(env, "Help please")
    secret = env.describe()["let"]["secret"]
    _, first, terminated, _, info = say(env, f"Open {secret}")
    assert not terminated
    assert info["member"] == "errands"
    assert info["history"] == ""
    assert env.describe()["t"] == 2
    _, second, terminated, _, info = say(env, "Give me bread")
    assert terminated
    assert info["success"]
    assert (first, second) == pytest.approx(((1 - 0.9 * 2 / 16) / 2, (1 - 0.9 * 3 / 16) / 2))


def test_an_act_that_fails_spoils_the_episode_but_not_the_next_act() -> None:
    env, other = sd.make(ACTS), sd.make(ACTS)
    env.reset(seed=1)
    env.step(env.encode_action(("done", None)))
    state = env.describe()
    assert state["spoiled"]
    other.reset(seed=1, options={"layout": state})
    assert other.describe() == state
    results = [say(one, "Give me bread") for one in (env, other)]
    assert results[0][1:] == results[1][1:]
    assert results[0][2]
    assert not results[0][4]["success"]


def test_acts_in_a_vector() -> None:
    envs = sd.make_vec(ACTS, 4, autoreset_mode="SameStep")
    envs.reset(seed=1)
    acts = np.zeros((4, 4), np.int64)
    acts[:2] = sd.make(ACTS).encode_action(("done", None))
    acts[2:] = sd.make(ACTS).encode_action(STILL)
    *_, terminated, _, _ = envs.step(acts)
    assert not terminated.any()
    assert envs.members() == ["errands"] * 2 + ["lesson"] * 2
    acts[:] = envs.program and sd.make(ACTS).encode_action((None, "Give me bread"))
    *_, infos = envs.step(acts)
    assert infos["_success"].tolist() == [True, True, False, False]
    assert not infos["success"].any()


def test_a_tree_beside_a_scenario_keeps_its_weights_and_starts() -> None:
    envs = sd.make_vec(["talkitout", SCHOOL, ACTS], 900, autoreset_mode="SameStep")
    envs.reset(seed=2)
    members = envs.members()
    assert set(members[::3]) == {None}
    assert set(members[2::3]) == {"lesson"}
    assert np.mean([str(member).startswith("problem=shopping") for member in members[1::3]]) == pytest.approx(
        0.5, abs=0.1
    )
    told = [row for row in range(1, 900, 3) if str(members[row]).endswith("help=told")]
    assert all(envs.describe(row)["heard"] == ["Tea: Open bread"] for row in told)
    with pytest.raises(ValueError, match="no suite that draws members"):
        envs.set_member_weights([1])
