"""Other libraries play and train on the environments: the examples of docs/interop.md, and wrappers on all ids."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.wrappers import vector

import socialai_dsl
from socialai_dsl.loader.shipped import IDS

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "interop.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
NEEDED = {
    "stable_baselines3": "PPO(",
    "sb3_contrib": "RecurrentPPO(",
    "torchrl": "torchrl.envs import",
    "ray": "PPOConfig()",
    "agilerl": "IPPO(",
}
ALSO = {"ray": ["tree"], "agilerl": ["pettingzoo", "peft"], "torchrl": ["pettingzoo"]}
"""What an example needs that does not come with its library: Ray without RLlib lacks the first one."""
APART = {"ray", "agilerl"}
"""They start processes or threads, and are to leave nothing behind in this one, nor join anybody else's."""
NAMES = [f"SocialAI/{name}-v1" for name in IDS]

# Dance tells nothing apart in some channel of a cell, so that its bounds are equal there.
pytestmark = [
    pytest.mark.filterwarnings("ignore:.*maximum and minimum values are equal"),
    pytest.mark.filterwarnings("ignore:PettingZoo in TorchRL is tested using"),
]


def needed(example: str) -> str | None:
    """The library that an example is about, if it is not one of those that are always there."""
    found = [name for name, used in NEEDED.items() if re.search(rf"\b{re.escape(used)}", example)]
    return found[0] if found else None


def test_every_library_has_an_example() -> None:
    assert {needed(example) for example in EXAMPLES} == {None, *NEEDED}


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_the_examples_run(number: int) -> None:
    library = needed(EXAMPLES[number])
    for module in filter(None, (library, *ALSO.get(library or "", ()))):
        if find_spec(module) is None:
            pytest.skip(f"{module} is not installed")
    if library in APART:
        with tempfile.TemporaryDirectory(prefix="ray") as folder:  # a short path: it holds sockets
            done = subprocess.run(
                [sys.executable, "-c", EXAMPLES[number]],
                capture_output=True,
                text=True,
                cwd=ROOT,
                env={**os.environ, "RAY_TMPDIR": folder},
                timeout=250,
                check=False,
            )
        assert done.returncode == 0, done.stderr
        return
    exec(compile(EXAMPLES[number], f"interop.md, example {number + 1}", "exec"), {"__name__": "example"})


SINGLE: dict[str, Callable[[Any], Any]] = {
    "statistics": wrappers.RecordEpisodeStatistics,
    "flat": wrappers.FlattenObservation,
    "time limit": lambda env: wrappers.TimeLimit(env, 5),
}
BATCHES: dict[str, Callable[[Any], Any]] = {
    "statistics": vector.RecordEpisodeStatistics,
    "flat": vector.FlattenObservation,
    "list of infos": vector.DictInfoToList,
}


@pytest.mark.parametrize("name", NAMES)
def test_wrappers_of_single_environments(name: str) -> None:
    for what, wrap in SINGLE.items():
        env = wrap(gym.make(name))
        env.action_space.seed(1)
        env.reset(seed=1)
        lengths, length = [], 0
        for _ in range(40):
            observation, _, terminated, truncated, info = env.step(env.action_space.sample())
            length += 1
            assert env.observation_space.contains(observation), what
            if terminated or truncated:
                if what == "statistics":
                    assert info["episode"]["l"] == length
                lengths.append(length)
                length = 0
                env.reset()
        assert lengths, "no episode ended"
        assert what != "time limit" or max(lengths) <= 5
        env.close()


@pytest.mark.parametrize("name", NAMES)
def test_wrappers_of_batches(name: str) -> None:
    for what, wrap in BATCHES.items():
        envs = wrap(gym.make_vec(name, num_envs=3))
        envs.action_space.seed(1)
        envs.reset(seed=1)
        ended = 0
        for _ in range(40):
            observation, _, terminated, truncated, infos = envs.step(envs.action_space.sample())
            assert envs.observation_space.contains(observation), what
            ended += np.count_nonzero(terminated | truncated)
            if what == "list of infos":
                assert [bool(info.get("outcome") is not None) for info in infos] == (
                    terminated | truncated
                ).tolist()
            elif what == "statistics":
                assert ("episode" in infos) == bool((terminated | truncated).any())
        assert ended, "no episode ended"
        envs.close()


@pytest.mark.skipif(find_spec("moviepy") is None, reason="moviepy is not installed")
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", NAMES)
def test_videos(name: str, tmp_path: Path) -> None:
    env = wrappers.RecordVideo(
        gym.make(name, render_mode="rgb_array"), str(tmp_path / "video"), disable_logger=True
    )
    env.reset(seed=1)
    for _ in range(3):
        env.step(np.zeros(4, np.int64))
    env.close()
    (video,) = (tmp_path / "video").glob("*.mp4")
    assert video.stat().st_size > 1000


@pytest.mark.thorough("starts processes")
@pytest.mark.parametrize(
    "code",
    [
        "import gymnasium; gymnasium.make('socialai_dsl:SocialAI/TalkItOut-v1')",
        "import gymnasium, socialai_dsl; gymnasium.make('SocialAI/TalkItOut-v1')",
        "import socialai_dsl, gymnasium; gymnasium.make('SocialAI/TalkItOut-v1')",
    ],
)
def test_the_ids_are_known_in_whichever_order_the_two_are_imported(code: str) -> None:
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


def test_looking_for_gymnasium_does_not_keep_the_ids_from_being_registered() -> None:
    code = (
        "import importlib.util, socialai_dsl, sys\n"
        "spec = importlib.util.find_spec('gymnasium')\n"
        "assert spec.loader.get_filename('gymnasium').endswith('__init__.py')\n"
        "assert 'gymnasium' not in sys.modules\n"
        "import gymnasium\n"
        "gymnasium.spec('SocialAI/TalkItOut-v1')\n"
        "assert not any('hook' in type(finder).__module__ for finder in sys.meta_path)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


@pytest.mark.skipif(find_spec("stable_baselines3") is None, reason="stable-baselines3 is not installed")
class TestSB3VecEnv:
    """The batch of ours that Stable-Baselines3 steps."""

    def make(self, copy: bool = True) -> Any:
        from socialai_dsl.sb3 import SB3VecEnv

        return SB3VecEnv(socialai_dsl.make_vec("talkitout", num_envs=3, autoreset_mode="SameStep", copy=copy))

    def test_steps_are_those_of_the_batch(self) -> None:
        ours = socialai_dsl.make_vec("talkitout", num_envs=3, autoreset_mode="SameStep")
        expected, _ = ours.reset(seed=7)
        adapted = self.make()
        adapted.seed(7)
        got = adapted.reset()
        rng = np.random.default_rng(1)
        ended = []
        for _ in range(150):
            for name, value in expected.items():
                assert np.array_equal(got[name], value)
            action = rng.choice([0, 1, 2, 7, 6], (3, 1), p=[0.3, 0.3, 0.3, 0.09, 0.01]) * np.array(
                [1, 0, 0, 0]
            )
            expected, reward, terminated, truncated, infos = ours.step(action)
            got, rewards, dones, found = adapted.step(action)
            assert np.array_equal(rewards, reward.astype(np.float32))
            assert np.array_equal(dones, terminated | truncated)
            for i, info in enumerate(found):
                assert info["TimeLimit.truncated"] == truncated[i]
                assert ("terminal_observation" in info) == dones[i]
                if dones[i]:
                    ended.append(bool(truncated[i]))
                    assert info["is_success"] == infos["success"][i]
                    assert np.array_equal(
                        info["terminal_observation"]["image"], infos["final_obs"]["image"][i]
                    )
        assert set(ended) == {True, False}

    def test_what_was_seen_does_not_change_afterwards(self) -> None:
        adapted = self.make(copy=False)
        first = adapted.reset()
        kept = first["image"].copy()
        for _ in range(4):
            adapted.step(np.array([[1, 0, 0, 0]] * 3))
        assert np.array_equal(first["image"], kept)

    def test_another_mode_is_refused(self) -> None:
        from socialai_dsl.sb3 import SB3VecEnv

        with pytest.raises(ValueError, match="expected SameStep"):
            SB3VecEnv(socialai_dsl.make_vec("talkitout", num_envs=3))
        with pytest.raises(ValueError, match="no attributes of their own"):
            self.make().set_attr("horizon", 3)
