"""A grammar of templates without slots is played by every kind of mind: the action has no part behind the template."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import socialai_dsl as sd
from socialai_dsl.cli.main import main, run_main
from socialai_dsl.llm import Action, ActionLanguage
from socialai_dsl.studio.session import Session

SCENARIO = """\
scenario: leave_taking
horizon: 20
earshot: room
grammar: {templates: [Shall we pull, I must go]}
room: {size: 6}
frames:
  partner:
    states:
      waiting: {then: [{hears: Shall we pull, say: Yes, goto: agreed}]}
      agreed: {then: [{hears: I must go, say: Goodbye, goto: left}]}
      left: {}
  solve:
    steps: [{say: Shall we pull}, {do: stay, until: bob.is(agreed)}, {say: I must go}]
cast:
  bob: {frame: partner}
  agent: {frame: solve}
outcome:
- success: bob.is(left)
"""
SAID = ("Shall we pull", "I must go")


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "leave_taking.yaml"
    path.write_text(SCENARIO)
    return str(path)


@pytest.mark.filterwarnings("ignore:.*:UserWarning")
def test_gymnasium_plays_it(file: str) -> None:
    env = sd.make(file)
    assert env.action_space.nvec.tolist() == [8, 2, 2]
    check_env(env, skip_render_check=True)


def test_an_action_is_a_sentence_or_the_number_of_one(file: str) -> None:
    env = sd.make(file)
    for number, said in enumerate(SAID):
        for given in ((None, said), (None, number)):
            assert env.encode_action(given).tolist() == [7, 1, number]
    assert env.encode_action(("left", None)).tolist() == [0, 0, 0]
    with pytest.raises(
        ValueError, match="expected \\(body action, template\\) or \\(body action, sentence\\)"
    ):
        env.encode_action("left")


@pytest.mark.parametrize("mode", ["text", "json", "tools"])
def test_a_language_model_is_told_what_it_can_say(file: str, mode: str) -> None:
    language = ActionLanguage(sd.compile(sd.load(file)))
    assert "\nSentences: Shall we pull; I must go\n" in language.instructions(mode)  # type: ignore[arg-type]
    for said in SAID:
        action = Action("left", said)
        assert language.parse(language.write(action)).action == action
        assert language.parse(json.dumps({"move": "left", "say": said})).action == action
    assert "and sentences are Shall we pull, I must go." in language.parse("Act: fly").error


def test_a_person_plays_it_in_the_studio(file: str) -> None:
    session = Session()
    assert session.draw(file, SCENARIO)["episode"]["phrases"] == [*SAID]
    for said in SAID:
        session.act(line=said)
    assert "leave_taking" in session.replay()["page"]


def test_an_agent_learns_it_and_its_episode_is_kept(
    file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    few = ["--frames", "1024", "--envs", "8", "--threads", "1", "--eval-episodes", "8", "--device", "cpu"]
    assert run_main([file, *few, "--out", str(out)]) == 0, capsys.readouterr().err
    assert (out / "episode.html").is_file()
    assert main(["evaluate", str(out), "--episodes", "4"]) == 0, capsys.readouterr().err


def test_a_suite_joins_it_with_a_scenario_that_has_nouns(file: str, tmp_path: Path) -> None:
    suite = tmp_path / "both.yaml"
    suite.write_text("suite: both\nabout: Two.\nmembers: [leave_taking.yaml, talkitout]\ngrammar: union\n")
    envs = sd.make_vec(str(suite), num_envs=8)
    envs.reset(seed=0)
    envs.action_space.seed(0)
    for _ in range(30):
        envs.step(np.asarray(envs.action_space.sample()))
