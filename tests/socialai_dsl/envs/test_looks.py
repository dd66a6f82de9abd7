"""Looks in layouts, in batches and in suites."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.llm.view import TextView

LOOKS = Path(__file__).parents[2] / "data" / "looks.yaml"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two scenarios that differ in the name of a look, and a third with other words for one."""
    text = LOOKS.read_text(encoding="utf-8")
    for name, old, new in (
        ("a", "", ""),
        ("b", "  hat: {", "  cap_or_hood: {"),
        ("c", "words: [cap, hood], start: hood", "words: [cap, crown], start: crown"),
    ):
        made = text.replace("scenario: looks", f"scenario: {name}").replace(old, new)
        (tmp_path / f"{name}.yaml").write_text(made, encoding="utf-8")
    return tmp_path


def test_a_layout_has_them() -> None:
    env = sd.make(str(LOOKS)).unwrapped
    env.reset(seed=0)
    described = env.describe()  # type: ignore[attr-defined]
    for seed in range(1, 6):
        observation, _ = env.reset(seed=seed, options={"layout": described})
        assert env.describe() == described  # type: ignore[attr-defined]
        assert observation["image"].shape == (7, 7, 9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"mood": "glad"}, "ann.looks.mood: got 'glad'; expected one of calm, cheerful, angry, sad"),
        ({"moot": "calm"}, "ann.looks: there is no 'moot'; did you mean 'mood'"),
    ],
)
def test_a_layout_with_a_word_or_look_that_is_none(given: dict[str, str], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        sd.make(str(LOOKS)).reset(seed=0, options={"layout": {"ann": {"looks": given}}})


def test_members_of_a_suite_share_channels_by_name(folder: Path) -> None:
    (folder / "both.yaml").write_text("suite: both\nmembers: [a.yaml, b.yaml]\n", encoding="utf-8")
    env = sd.make(str(folder / "both.yaml")).unwrapped
    channels: tuple[str, ...] = env.channels  # type: ignore[attr-defined]
    assert channels[4:] == ("carrying", "size", "pattern", "mood", "hat", "cap_or_hood")
    absent = {"a": "cap_or_hood", "b": "hat"}
    for seed in range(10):
        _, info = env.reset(seed=seed)
        for _ in range(5):
            observation, *_ = env.step(env.action_space.sample())
            assert np.all(observation["image"][..., channels.index(absent[info["member"]])] == 255)


def test_looks_of_one_name_and_other_words_have_channels_of_their_own(folder: Path) -> None:
    (folder / "both.yaml").write_text("suite: both\nmembers: [a.yaml, c.yaml]\n", encoding="utf-8")
    env = sd.make(str(folder / "both.yaml")).unwrapped
    channels: tuple[str, ...] = env.channels  # type: ignore[attr-defined]
    hats = [name for name in channels if name.startswith("hat")]
    assert hats == ["hat", "hat: cap crown"]
    told, seen = TextView(env.program), dict[str, set[str]]()  # type: ignore[attr-defined]
    for seed in range(30):
        observation, info = env.reset(seed=seed)
        for _ in range(5):
            said = set(
                re.findall(r"\bhat[:\w ]*", told.observe(observation, info))
            )  # what a language model reads
            assert said <= {"hat hood" if info["member"] == "a" else "hat crown"}
            view = env.view(observation["image"])  # type: ignore[attr-defined]
            marks = [mark for marks in view.marks.values() for mark in marks if mark.look == "hat"]
            seen.setdefault(info["member"], set()).update(mark.word for mark in marks)
            absent = hats[info["member"] == "a"]
            assert np.all(observation["image"][..., channels.index(absent)] == 255)
            observation, *_, info = env.step(env.action_space.sample())
    assert seen == {"a": {"hood"}, "c": {"crown"}}  # what each starts with, in its own words
    vector = sd.make_vec([str(folder / "a.yaml"), str(folder / "c.yaml")], num_envs=2)
    assert vector.single_observation_space == env.observation_space
