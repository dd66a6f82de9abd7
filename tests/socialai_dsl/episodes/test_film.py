"""Recording an episode: words for actions, the transcript, the film."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from gymnasium.spaces import MultiDiscrete
from PIL import Image

import socialai_dsl as sd
from socialai_dsl.compilation import scenarios_of
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.envs.factory import compiled
from socialai_dsl.episodes.film import RecordedEpisode, film
from socialai_dsl.program import Program
from socialai_dsl.render.panel import DialogueLine, Face
from socialai_dsl.traces.endings import Ending
from socialai_dsl.traces.steps import Step, describe_step
from socialai_dsl.vocabulary import Sentences, Slot

SENTENCES = Sentences.of(("Where is <noun>", "Hello"), (Slot("noun", ("the exit", "Ann")),))


@dataclass
class Words:
    """The part of a program that the recording reads."""

    actions: tuple[str, ...] = ("left", "right", "forward")
    outcomes: tuple[str, ...] = ("success@7", "one: success@7")
    sentences: Sentences = SENTENCES


PROGRAM = cast(Program, Words())


class Stand:
    """An environment of three steps that says what it was told to."""

    program, action_space = PROGRAM, MultiDiscrete([4, 2, 2, 2])
    seats = seat_names = ("agent",)

    def __init__(self, heard: list[str], **more: str) -> None:
        self._heard, self._more = heard, more

    @property
    def unwrapped(self) -> "Stand":
        return self

    def cast(self) -> list[Face]:
        return []

    def reset(self, **options: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        self.t, self.options = 0, options
        return {}, {}

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        self.t += 1
        info: dict[str, Any] = {"utterance": self._heard[self.t - 1]}
        ended = self.t == len(self._heard)
        if ended:
            info |= {"outcome": "success@7", "success": True} | self._more
        return {}, 0.75 if ended else 0.0, ended, False, info

    def render(self) -> np.ndarray:
        return np.full((64, 64, 3), 40 * self.t, np.uint8)


ACTIONS = [np.array(action) for action in ([0, 1, 0, 0], [3, 0, 1, 1], [2, 1, 1, 1])]
HEARD = ["Ann: I am fine.\nBob: Me \x1b[31mtoo", "NA", "nobody"]


def recorded() -> RecordedEpisode:
    return film(Stand(HEARD), ACTIONS, {"options": {"test_episode": 4}}, "an episode")


@pytest.mark.parametrize(
    ("action", "primitive", "said"),
    [
        ([0, 1, 0, 1], "left", "Where is Ann"),
        ([3, 0, 0, 1], "none", None),
        ([2, 1, 1, 0], "forward", "Hello"),
    ],
)
def test_actions_in_words(action: list[int], primitive: str, said: str | None) -> None:
    step = describe_step(PROGRAM, action, 5, "NA")
    assert step == Step(5, primitive, said, ())


def test_a_dialogue_has_the_agent_first() -> None:
    step = describe_step(PROGRAM, [0, 1, 0, 0], 2, "Ann: Go: left.\nnobody")
    assert step.dialogue == [
        DialogueLine(2, "You", "Where is the exit"),
        DialogueLine(2, "Ann", "Go: left."),
        DialogueLine(2, "", "nobody"),
    ]


def test_transcript() -> None:
    assert recorded().transcript().splitlines() == [
        "an episode",
        "",
        "step  did       said and heard",
        '   1  left       You: "Where is the exit"',
        "                 Ann: I am fine.",
        r"                 Bob: Me \x1b[31mtoo",
        "   2  none",
        '   3  forward    You: "Hello"',
        "                 nobody",
        "",
        "success (success@7) after 3 steps, reward 0.750",
    ]


def test_a_transcript_says_once_what_goes_on_in_silence() -> None:
    waits = [Step(t, "none", None, ()) for t in (2, 3, 4, 5)]
    steps = [Step(1, "none", "Hello", ()), *waits, *(Step(t, "left", None, ()) for t in (6, 7, 8))]
    assert RecordedEpisode("an episode", steps).transcript().splitlines()[3:8] == [
        '   1  none       You: "Hello"',
        "   2  none       (until step 5)",
        "   6  left",
        "   7  left",
        "   8  left",
    ]


def test_a_transcript_ends_with_the_line_that_decided() -> None:
    ending = Ending("success@7", True, "success: agent.at(door)", "my.yaml", 7)
    episode = film(Stand(HEARD), ACTIONS, {}, "an episode", {"success@7": ending})
    assert episode.transcript().splitlines()[-2:] == [
        "success (success@7) after 3 steps, reward 0.750",
        "success: agent.at(door)   my.yaml:7",
    ]


def test_in_a_suite_the_ending_is_that_of_the_member() -> None:
    ending = Ending("one: success@7", True, "success: agent.at(door)", "one.yaml", 7)
    played = Stand(HEARD, member="one")
    episode = film(played, ACTIONS, {}, "an episode", {"one: success@7": ending})
    assert episode.transcript().splitlines()[-1] == "success: agent.at(door)   one.yaml:7"


def test_the_film_has_a_picture_for_each_step_and_one_before(tmp_path: Path) -> None:
    recorded().save_film(tmp_path / "episode.gif")
    with Image.open(tmp_path / "episode.gif") as shown:
        assert (shown.n_frames, shown.size) == (4, (640, 360))  # type: ignore[attr-defined]
        shown.seek(3)
        assert shown.info["duration"] > 1000


def test_an_episode_that_goes_otherwise_is_a_bug_of_ours() -> None:
    with pytest.raises(AssertionError, match="internal: played again, an episode goes on after 2 steps"):
        film(Stand(HEARD), ACTIONS[:2], {}, "an episode")


def test_a_recording_of_several_seats_shows_what_each_of_them_did(tmp_path: Path) -> None:
    scenario = "together/levers_together+oracle"
    loaded = sd.load(scenario)
    env = ScenarioEnv(compiled(loaded), "rgb_array", scenarios_of(loaded), {})
    env.reset(seed=1)
    actions, ended = [], False
    while not ended:
        actions.append(env.scripted_action())
        *_, ended, _, _ = env.step(actions[-1])
    found = film(env, actions, {"seed": 1}, "an episode")
    text = found.transcript()
    first, second = (line.split() for line in text.split("\n")[3:5])
    assert (first[:2], second[0]) == (["1", "agent"], "partner")
    assert re.search(r"^partner  success \(success@\d+\) after \d+ steps, reward 0\.\d+$", text, re.MULTILINE)
    assert {"toggle"} <= {step.action for one in found.seats.values() for step in one.steps}
    assert [one.name for one in found.seats.values()] == ["Ann", "Bob"]
    assert all(len(one.steps) == len(found.steps) for one in found.seats.values())
    assert len(found.frames) == len(found.steps) + 1
