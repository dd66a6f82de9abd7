"""The vector environment: every size, thread count and mode plays the same episodes as single environments."""

import hashlib
from typing import Any

import gymnasium
import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.envs import ScenarioVectorEnv

STEPS = 60


def actions(envs: ScenarioVectorEnv, steps: int, seed: int = 0) -> np.ndarray:
    """Random actions that move more than they end, (steps, E, 4)."""
    rng = np.random.default_rng(seed)
    limits = envs.single_action_space.nvec
    drawn = np.stack([rng.integers(n, size=(steps, envs.num_envs)) for n in limits], axis=-1)
    drawn[..., 0] = rng.choice([0, 1, 2, 2, 7, 5], size=drawn.shape[:2])
    return drawn


def digest(envs: ScenarioVectorEnv, plan: np.ndarray, rows: slice, seed: Any = 5) -> str:
    """A hash of everything that `rows` see and get under a plan of actions."""
    sha = hashlib.sha256()
    observation, _ = envs.reset(seed=seed)
    for step in plan:
        observation, reward, terminated, truncated, _ = envs.step(step)
        for array in (observation["image"], observation["tokens"], reward, terminated, truncated):
            sha.update(np.ascontiguousarray(array[rows]).tobytes())
    return sha.hexdigest()


@pytest.mark.parametrize("name", ["talkitout", "talkitout_no_liar+as_coded"])
def test_one_trajectory_whatever_the_batch(name: str) -> None:
    hashes = set()
    large = sd.make_vec(name, num_envs=4096)
    plan = actions(large, STEPS)
    for size in (1, 7, 4096):
        envs = sd.make_vec(name, num_envs=size)
        hashes.add(digest(envs, plan[:, :size], slice(0, 1)))
    assert len(hashes) == 1


def test_threads_are_refused_with_what_to_do_instead() -> None:
    assert sd.make_vec("talkitout", num_envs=2, num_threads=1).num_envs == 2
    with pytest.raises(
        ValueError, match="num_threads: got 2; expected 1: to use more cores run more processes"
    ):
        sd.make_vec("talkitout", num_envs=1000, num_threads=2)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_rows_are_single_environments(mode: str) -> None:
    """Row i of a batch with seed s is a single environment with (s, i), in every auto-reset mode."""
    envs = sd.make_vec("talkitout", num_envs=5, autoreset_mode=mode)
    singles = [sd.make("talkitout") for _ in range(5)]
    observation, _ = envs.reset(seed=9)
    expected = [env.reset(seed=9, options={"index": i})[0] for i, env in enumerate(singles)]
    ended = [False] * 5
    for step in actions(envs, 80, seed=3):
        observation, reward, terminated, truncated, infos = envs.step(step)
        for i, env in enumerate(singles):
            if ended[i] and mode == "NextStep":
                expected[i], result = env.reset()[0], (0.0, False, False)
                ended[i] = False
            else:
                expected[i], *rest = env.step(step[i])
                result = (rest[0], rest[1], rest[2])
                ended[i] = rest[1] or rest[2]
                if ended[i]:
                    assert infos["success"][i] == rest[3]["success"]
                    assert envs.outcomes[infos["outcome"][i]] == rest[3]["outcome"]
                if ended[i] and mode == "SameStep":
                    assert np.array_equal(infos["final_obs"]["image"][i], expected[i]["image"])
                    assert np.array_equal(infos["final_obs"]["tokens"][i], expected[i]["tokens"])
                    expected[i] = env.reset()[0]
            assert (reward[i], terminated[i], truncated[i]) == result
            assert np.array_equal(observation["image"][i], expected[i]["image"])
            assert np.array_equal(observation["tokens"][i], expected[i]["tokens"])


def test_disabled_mode_restarts_only_the_masked_rows() -> None:
    envs = sd.make_vec("talkitout", num_envs=3, autoreset_mode="Disabled")
    envs.reset(seed=1)
    done = envs.unwrapped.single_action_space.nvec[0] - 2  # the body action `done`
    _, _, terminated, _, _ = envs.step(np.array([[done, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]]))
    assert terminated.tolist() == [True, False, False]
    before = envs.describe(1)
    envs.reset(options={"reset_mask": np.array([True, False, False])})
    assert envs.describe(0)["t"] == 0
    assert envs.describe(1) == before


def test_a_list_of_seeds_gives_the_single_environments_of_these_seeds() -> None:
    envs = sd.make_vec("talkitout", num_envs=3)
    observation, _ = envs.reset(seed=[4, 8, 4])
    for i, seed in enumerate((4, 8, 4)):
        assert np.array_equal(observation["image"][i], sd.make("talkitout").reset(seed=seed)[0]["image"])


def test_the_same_seed_gives_the_same_rooms_with_npcs_hidden() -> None:
    shown, hidden = sd.make_vec("talkitout", 50), sd.make_vec("talkitout+unsocial", 50)
    shown.reset(seed=3)
    hidden.reset(seed=3)
    assert [shown.describe(i) for i in range(50)] == [hidden.describe(i) for i in range(50)]


def test_test_episodes_are_the_same_for_everybody_and_no_seed_reaches_them() -> None:
    one, other = sd.make_vec("talkitout", 4), sd.make_vec("talkitout", 2)
    first, _ = one.reset(options={"test_episode": [0, 1, 2, 3]})
    second, _ = other.reset(options={"test_episode": [3, 0]})
    assert np.array_equal(first["image"][[3, 0]], second["image"])
    rooms = sd.make_vec("talkitout", 2000)
    rooms.reset(seed=0)
    state = one.describe(0)
    assert all(rooms.describe(i) != state for i in range(2000))


def test_buffers_are_private_with_copy_and_the_engines_own_without() -> None:
    for copy in (True, False):
        envs = sd.make_vec("talkitout", 4, copy=copy)
        first, _ = envs.reset(seed=0)
        kept = first["image"].copy()
        for step in actions(envs, 5):
            envs.step(step)
        assert np.array_equal(first["image"], kept) == copy


@pytest.mark.parametrize("spoil", ["cut", "flip", "other"])
def test_a_foreign_snapshot_is_refused(spoil: str) -> None:
    envs = sd.make_vec("talkitout", 2)
    envs.reset(seed=0)
    saved = envs.snapshot()
    if spoil == "other":
        with pytest.raises(ValueError, match="other environments"):
            sd.make_vec("talkitout_no_liar", 2).restore(saved)
        return
    bad = saved[:-5] if spoil == "cut" else saved[:300] + bytes([saved[300] ^ 1]) + saved[301:]
    with pytest.raises(ValueError, match="damaged"):
        envs.restore(bad)


def test_ids_tell_utterances_histories_and_pictures_apart() -> None:
    envs = sd.make_vec("talkitout+oracle", 60, autoreset_mode="SameStep")
    observation, _ = envs.reset(seed=0)
    seen: dict[str, dict[int, Any]] = {"utterance": {}, "history": {}, "image": {}}
    for _ in range(40):
        observation, *_ = envs.step(envs.scripted_actions())
        contents = {
            "utterance": envs.utterances(),
            "history": [tuple(tokens.tolist()) for tokens in observation["tokens"]],
            "image": [image.tobytes() for image in observation["image"]],
        }
        ids = {"utterance": envs.utterance_ids(), "history": envs.history_ids(), "image": envs.image_ids()}
        for kind, known in seen.items():
            for number, content in zip(ids[kind].tolist(), contents[kind], strict=True):
                assert known.setdefault(number, content) == content, kind
        silent = [text == "NA" for text in contents["utterance"]]
        assert (ids["utterance"] == 0).tolist() == silent


@pytest.mark.parametrize("scenario", ["novel/gossip", "social_env"])
def test_the_parts_of_what_is_heard_are_those_of_the_transcript(scenario: str) -> None:
    """Who speaks is the member of the cast whose present name begins the line; texts and their order are the lines'."""
    envs = sd.make_vec(f"{scenario}+oracle", 40, autoreset_mode="SameStep")
    envs.reset(seed=0)
    assert len(set(envs.lines)) == len(envs.lines), "each text once"
    fixed: dict[tuple[str, int], str] = {}
    several = 0
    for _ in range(30):
        envs.step(envs.scripted_actions())
        heard = envs.heard_lines()
        assert heard.speakers.dtype == heard.lines.dtype == np.int64
        assert heard.speakers.shape == heard.lines.shape
        for row, text in enumerate(envs.utterances()):
            count = int((heard.lines[row] >= 0).sum())
            assert (heard.speakers[row, :count] >= 0).all()
            assert (heard.lines[row, count:] == heard.speakers[row, count:]).all(), "both -1 behind the last"
            said = [envs.lines[line] for line in heard.lines[row, :count].tolist()]
            assert "\n".join(said) == ("" if text == "NA" else text)
            several += count > 1
            program = envs.programs[envs.member_ids()[row]]
            described = envs.describe(row)
            for speaker, line in zip(heard.speakers[row].tolist(), said, strict=False):
                entity = program.entities[speaker]
                assert entity.role == "npc", "its script plays silently for the agent itself"
                name = line.partition(": ")[0]
                member = described.get(entity.key, {})
                drawn = (member if entity.index is None else member[entity.index]).get("name")
                assert name == (drawn or fixed.setdefault((program.name, speaker), name))
    assert several > 0
    assert len(fixed) > 1
    assert len(set(fixed.values())) == len(fixed)


def test_equal_texts_have_one_number_whoever_says_them() -> None:
    envs = sd.make_vec("talkitout", 2)
    room: dict[str, Any] = {"room": {"width": 8, "height": 8}, "agent": {"at": [2, 2]}}
    honest = {"honest": {"at": [2, 3], "name": "John"}, "liar": {"at": [6, 6], "name": "Jack"}}
    liar = {"honest": {"at": [6, 6], "name": "Jack"}, "liar": {"at": [2, 3], "name": "John"}}
    away = {"wizard": {"at": [6, 1]}}
    envs.reset(seed=0, options={"layout": [{**room, **honest, **away}, {**room, **liar, **away}]})
    envs.step(np.array([[7, 1, 3, 3]] * 2))
    assert envs.utterances() == ["John: I am fine."] * 2
    first, second = envs.utterance_ids()
    assert first == second != 0


def test_counters_count_outcomes_rules_and_episodes() -> None:
    envs = sd.make_vec("talkitout_no_liar+oracle", 30, autoreset_mode="SameStep")
    envs.reset(seed=0)
    ends = 0
    for _ in range(60):
        *_, infos = envs.step(envs.scripted_actions())
        ends += int(infos["_success"].sum()) if infos else 0
    counted = envs.counters()
    assert counted["episodes"] == ends == sum(counted["outcomes"].values()) > 0
    assert set(counted["outcomes"]) == set(envs.program.outcomes)
    answered = [n for name, n in counted["rules"].items() if "acquainted" in name]
    assert all(number > 0 for number in answered)


def test_a_mixed_batch_plays_each_program_as_it_would_alone() -> None:
    mixed = sd.make_vec(["talkitout", "talkitout_no_liar"], 6)
    alone = sd.make_vec("talkitout_no_liar", 6)
    plan = actions(mixed, 40)
    assert digest(mixed, plan, slice(1, None, 2)) == digest(alone, plan, slice(1, None, 2))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sd.make_vec("talkitout", 0), "num_envs: got 0"),
        (lambda: sd.make_vec("talkitout", 2, autoreset_mode="Never"), "autoreset_mode: got 'Never'"),
        (lambda: sd.make_vec([], 2), "scenarios: got none"),
        (lambda: sd.make_vec("talkitout", 2).reset(seed=-1), "seed: got -1"),
        (lambda: sd.make_vec("talkitout", 2).reset(seed=[1]), "seed: got \\[1\\]"),
        (
            lambda: sd.make_vec("talkitout", 2).reset(options={"layouts": {}}),
            "layouts: got {}, but reset has no such option; did you mean 'layout'",
        ),
        (lambda: sd.make_vec("talkitout", 2).step(np.zeros((2, 4), int)), "before the first reset"),
        (lambda: stepped(np.zeros((2, 3), int)), "shape \\(2, 3\\)"),
        (lambda: stepped(np.zeros((2, 4))), "float64"),
        (lambda: stepped(np.array([[0, 0, 0, 0], [9, 0, 0, 0]])), "\\[9, 0, 0, 0\\] in row 1"),
        (lambda: sd.make_vec("talkitout", 2).scripted_actions(), "follows no frame"),
    ],
)
def test_a_callers_mistake_is_a_value_error_that_says_what(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


def stepped(given: np.ndarray) -> None:
    envs = sd.make_vec("talkitout", 2)
    envs.reset(seed=0)
    envs.step(given)


def test_gymnasium_makes_vectors_by_id() -> None:
    envs = gymnasium.make_vec("SocialAI/TalkItOut-v1", num_envs=3)
    assert isinstance(envs.unwrapped, ScenarioVectorEnv)
    observation, _ = envs.reset(seed=1)
    assert observation in envs.observation_space
    envs.close()
