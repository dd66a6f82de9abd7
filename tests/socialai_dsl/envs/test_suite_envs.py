"""Suites as environments: the member of each episode, one space for all, and each member as it plays alone."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import socialai_dsl as sd
from socialai_dsl.envs import ScenarioEnv, ScenarioVectorEnv

FOLDER = Path(__file__).parents[2] / "data" / "suites"
PAIR = f"{FOLDER}/pair.yaml"


def playing(env: ScenarioEnv, member: str, **layout: Any) -> dict[str, Any]:
    """Start an episode of this member."""
    _, info = env.reset(seed=3, options={"layout": {"member": member, **layout}})
    assert info["member"] == env.describe()["member"] == member
    return info


def plan(envs: ScenarioVectorEnv, steps: int, seed: int = 0) -> np.ndarray:
    """Random actions that seldom end an episode, (steps, E, 4)."""
    rng = np.random.default_rng(seed)
    limits = envs.single_action_space.nvec
    drawn = np.stack([rng.integers(n, size=(steps, envs.num_envs)) for n in limits], axis=-1)
    drawn[..., 0] = rng.choice([0, 1, 2, 2, limits[0] - 1], size=drawn.shape[:2])
    return drawn


@pytest.mark.parametrize("name", [PAIR, PAIR + "+loud", "social_env", "social_env+as_coded?split=test"])
def test_gymnasiums_checker(name: str) -> None:
    check_env(gymnasium.make("SocialAI/Scenario-v1", scenario=name, render_mode="rgb_array").unwrapped)


def test_the_suite_of_the_paper_has_an_id() -> None:
    env = gymnasium.make("SocialAI/SocialEnv-v1")
    assert env.action_space == gymnasium.spaces.MultiDiscrete([8, 2, 7, 26])
    assert sd.make("social_env+as_coded").action_space == gymnasium.spaces.MultiDiscrete([8, 2, 15, 45])
    envs = gymnasium.make_vec("SocialAI/SocialEnv-v1", num_envs=3)
    observation, _ = envs.reset(seed=0)
    assert observation in envs.observation_space
    envs.close()


def test_every_episode_draws_its_member() -> None:
    envs = sd.make_vec("social_env", 6000)
    envs.reset(seed=5)
    members, counts = np.unique(envs.members(), return_counts=True)
    assert len(members) == 6
    assert np.all(abs(counts - 1000) < 5 * np.sqrt(6000 * 1 / 6 * 5 / 6))
    env = sd.make("social_env")
    for i in range(20):
        assert env.reset(seed=5, options={"index": i})[1]["member"] == envs.members()[i]
    test = sd.make_vec("social_env?split=test", 20)
    test.reset(seed=5)
    swapped = {"help": "help_as_helper"}
    assert test.members() == [swapped.get(str(member), member) for member in envs.members()[:20]]


def test_spaces_cover_all_members() -> None:
    suite, alone = sd.make(PAIR), [sd.make("talkitout"), sd.make(f"{FOLDER}/errands.yaml")]
    assert suite.action_space == gymnasium.spaces.MultiDiscrete([8, 2, 5, 18])
    for key in ("image", "tokens"):
        shapes = [env.observation_space[key].shape for env in alone]
        assert suite.observation_space[key].shape == max(shapes)
    assert np.all(
        suite.observation_space["image"].high == np.max([e.observation_space["image"].high for e in alone], 0)
    )


@pytest.mark.parametrize("variant", ["", "+loud"])
@pytest.mark.thorough("plays every member twice")
def test_a_member_plays_as_it_does_alone(variant: str) -> None:
    """Row by row the same pictures, texts and rewards, whatever is played around it and whatever was played before."""
    envs = sd.make_vec(PAIR + variant, 40, autoreset_mode="SameStep")
    names = {"talkitout": "talkitout", "errands": f"{FOLDER}/errands.yaml"}
    if variant:
        names["errands"] += "+loud"
    observation, _ = envs.reset(seed=1)
    episode = [0] * 40
    singles: list[Any] = [None] * 40
    suite = envs.program
    for step in plan(envs, 60, seed=2):
        for i, member in enumerate(envs.members()):
            if singles[i] is None:
                singles[i] = sd.make(names[str(member)])
                singles[i].reset(seed=1, options={"index": i})
                for _ in range(episode[i]):
                    singles[i].reset()
                assert np.array_equal(observation["image"][i], singles[i]._observation()["image"])
        before = envs.members()
        observation, reward, terminated, truncated, infos = envs.step(step)
        for i, env in enumerate(singles):
            number = suite.members.index(before[i])
            template = suite.template_maps[number][step[i, 2]]
            noun = suite.slot_maps[number][0][step[i, 3]]
            said = step[i, 1] and template >= 0 and noun >= 0
            body = min(step[i, 0], env.action_space.nvec[0] - 1)
            shown, paid, ended, out, info = env.step([body, said, max(template, 0), max(noun, 0)])
            assert (reward[i], terminated[i], truncated[i]) == (paid, ended, out)
            if ended or out:
                assert envs.outcomes[infos["outcome"][i]] == f"{before[i]}: {info['outcome']}"
                assert infos["success"][i] == info["success"]
                assert np.array_equal(infos["final_obs"]["image"][i], shown["image"])
                episode[i], singles[i] = episode[i] + 1, None
                continue
            assert np.array_equal(observation["image"][i], shown["image"])
            assert envs.utterances()[i] == info["utterance"]
            words = [suite.vocabulary[token] for token in observation["tokens"][i] if token]
            assert words == [env.program.vocabulary[token] for token in shown["tokens"] if token]
    assert sum(episode) > 30


def test_results_do_not_depend_on_the_batch() -> None:
    reference = None
    for size in (130, 3):
        envs = sd.make_vec("social_env", size)
        actions = plan(sd.make_vec("social_env", 130), 40)
        seen = [envs.reset(seed=8)[0]["image"][:3].tobytes()]
        for step in actions[:, :size]:
            observation, reward, *_ = envs.step(step)
            seen.append(
                (
                    observation["image"][:3].tobytes(),
                    observation["tokens"][:3].tobytes(),
                    reward[:3].tobytes(),
                )
            )
        reference = reference or seen
        assert seen == reference
        envs.close()


# --- what is said ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", ["", "+loud"])
def test_what_belongs_to_another_member_is_silence(variant: str) -> None:
    env = sd.make(PAIR + variant)
    playing(env, "errands")
    action = env.encode_action((None, "Where is sesame"))
    action[2:] = [env.program.templates.index("Where is <noun>"), env.program.nouns.index("sesame")]
    *_, info = env.step(action)
    assert info["utterance"] == "NA"
    assert env.describe()["last"]["said"] is None
    *_, info = env.step(env.encode_action((None, "Open sesame")))
    assert info["utterance"].endswith("It is open.")
    assert info["member"] == "errands"


def test_of_equal_words_the_member_that_plays_means_its_own() -> None:
    env = sd.make(PAIR + "+loud")
    playing(env, "errands")
    assert env.encode_action((None, "Open sesame")).tolist() == [7, 1, 5, 17]
    assert env.encode_action((None, "Open <noun>", "sesame")).tolist() == [7, 1, 5, 17]
    playing(env, "talkitout")
    assert env.encode_action((None, "Open sesame")).tolist() == [7, 1, 1, 0]
    assert env.encode_action((None, "Open <noun>", "sesame")).tolist() == [7, 1, 1, 0]


def test_a_member_has_the_body_actions_of_the_suite() -> None:
    env = sd.make(PAIR)
    playing(env, "errands")
    *_, terminated, _, info = env.step(env.encode_action(("toggle", None)))
    assert terminated
    assert (info["success"], info["member"]) == (False, "errands")
    assert info["outcome"].startswith("failure@")


# --- layouts --------------------------------------------------------------------------------------------------------


def test_a_layout_fits_the_member_that_is_drawn() -> None:
    env = sd.make(PAIR)
    for seed in range(20):
        _, drawn = env.reset(seed=seed)
        _, info = env.reset(seed=seed, options={"layout": {"agent": {"at": [2, 2]}}})
        assert info == drawn
        assert env.describe()["agent"]["at"] == [2, 2]


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        ({"member": "errand"}, "member: got 'errand'; expected one of talkitout, errands"),
        ({"member": "errands", "wizard": {"at": [1, 1]}}, "layout: there is no 'wizard'"),
        ({"member": "errands", "let": {"exit": "doors[0]"}}, "let: there is no 'exit'"),
        (3, "got 3; expected a mapping"),
    ],
)
def test_layouts_that_do_not_fit_leave_everything_as_it_was(layout: Any, message: str) -> None:
    env = sd.make(PAIR)
    env.reset(seed=1)
    before = env.snapshot()
    with pytest.raises(ValueError, match=message):
        env.reset(seed=2, options={"layout": layout})
    assert env.snapshot() == before
    with pytest.raises(ValueError, match="there is no 'member'"):
        sd.make("talkitout").reset(seed=0, options={"layout": {"member": "talkitout"}})


def test_a_list_of_layouts_in_a_vector() -> None:
    envs = sd.make_vec(PAIR, 4)
    layouts = [
        {"member": "errands"},
        {"member": "talkitout", "wizard": {"at": [1, 1]}},
        None,
        {"member": "errands"},
    ]
    envs.reset(seed=0, options={"layout": layouts})
    assert [envs.members()[i] for i in (0, 1, 3)] == ["errands", "talkitout", "errands"]
    assert envs.describe(1)["wizard"]["at"] == [1, 1]
    twin = sd.make_vec(PAIR, 4)
    twin.reset(seed=7, options={"layout": [envs.describe(i) for i in range(4)]})
    assert [twin.describe(i) for i in range(4)] == [envs.describe(i) for i in range(4)]


# --- saving, counting, mixing ---------------------------------------------------------------------------------------


def test_a_snapshot_keeps_the_members_that_play() -> None:
    envs = sd.make_vec("social_env", 30, autoreset_mode="SameStep")
    envs.reset(seed=2)
    actions = plan(envs, 60, seed=1)
    for step in actions[:30]:
        envs.step(step)
    saved, members = envs.snapshot(), envs.members()
    expected = [[a.tolist() for a in (o["image"], r)] for o, r, *_ in map(envs.step, actions[30:])]
    assert envs.members() != members
    other = sd.make_vec("social_env", 30, autoreset_mode="SameStep")
    other.restore(saved)
    assert other.members() == members
    assert [[a.tolist() for a in (o["image"], r)] for o, r, *_ in map(other.step, actions[30:])] == expected


def test_a_single_environment_restored_names_its_member() -> None:
    env = sd.make("social_env")
    saved = {}
    for seed in range(12):
        member = env.reset(seed=seed)[1]["member"]
        saved[member] = env.snapshot()
    assert len(saved) > 2
    for member, data in saved.items():
        env.restore(data)
        *_, info = env.step(env.encode_action((None, None)))
        assert info["member"] == env.describe()["member"] == member


def test_counters_and_outcomes_go_by_member() -> None:
    envs = sd.make_vec(PAIR, 50, autoreset_mode="SameStep")
    envs.reset(seed=0)
    ended: dict[str, int] = {}
    for step in plan(envs, 80):
        *_, infos = envs.step(step)
        for outcome in infos["outcome"][infos["_outcome"]] if infos else []:
            ended[envs.outcomes[outcome]] = ended.get(envs.outcomes[outcome], 0) + 1
    counted = envs.counters()
    assert {name: n for name, n in counted["outcomes"].items() if n} == ended
    assert envs.outcomes == list(counted["outcomes"]) == envs.program.outcomes
    assert counted["episodes"] == sum(ended.values())
    assert counted["rules"]["errands: baker.trade.waiting.then[0]"] > 0


def test_ids_tell_members_apart() -> None:
    envs = sd.make_vec("social_env+oracle", 60, autoreset_mode="SameStep")
    envs.reset(seed=0)
    known: dict[str, dict[int, Any]] = {"utterance": {}, "history": {}}
    for _ in range(40):
        envs.step(envs.scripted_actions())
        for kind, ids, texts in (
            ("utterance", envs.utterance_ids(), envs.utterances()),
            ("history", envs.history_ids(), envs.histories()),
        ):
            for number, text in zip(ids.tolist(), texts, strict=True):
                assert known[kind].setdefault(number, text) == text
    assert len(known["utterance"]) > 10


def test_the_scripts_of_all_members_play() -> None:
    envs = sd.make_vec("social_env+oracle", 300, autoreset_mode="SameStep")
    envs.reset(seed=0)
    for _ in range(120):
        envs.step(envs.scripted_actions())
    ended, won = dict.fromkeys(envs.program.members, 0), dict.fromkeys(envs.program.members, 0)
    for name, number in envs.counters()["outcomes"].items():
        member = name.partition(":")[0]
        ended[member] += number
        won[member] += number * (": success" in name)
    assert all(won[member] > 0.8 * ended[member] > 0 for member in ended), (won, ended)
    with pytest.raises(ValueError, match="follows no frame"):
        sd.make_vec(PAIR, 2).scripted_actions()


def test_suites_in_a_mixture_keep_their_rows() -> None:
    envs = sd.make_vec([PAIR, "talkitout_no_liar"], 8)
    envs.reset(seed=4)
    members = envs.members()
    assert members[1::2] == [None] * 4
    assert set(members[::2]) <= {"talkitout", "errands"}
    alone = sd.make_vec(PAIR, 8)
    alone.reset(seed=4)
    assert [envs.describe(i) for i in (0, 2, 4, 6)] == [alone.describe(i) for i in (0, 2, 4, 6)]
    assert "member" not in envs.describe(1)
    assert any(name.startswith("pair: errands: ") for name in envs.outcomes)
    twice = sd.make_vec(["talkitout", "talkitout_no_liar", "talkitout"], 7)
    assert [program.name for program in twice.programs] == ["talkitout", "talkitout_no_liar"]


def test_a_suite_of_one_member() -> None:
    env = sd.make(PAIR + "?split=alone")
    _, info = env.reset(seed=0)
    assert info["member"] == "errands"
    playing(env, "errands")
    assert env.action_space == gymnasium.spaces.MultiDiscrete([4, 2, 2, 3])


def test_a_room_that_cannot_be_as_required_is_reported_with_the_scenarios_name() -> None:
    with pytest.raises(RuntimeError, match=r"^impossible: none of 64 rooms was as `require` asks"):
        sd.make(f"{FOLDER}/impossible.yaml").reset(seed=0)
