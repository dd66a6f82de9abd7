"""Probes: asked at their moment, with the right answer of the engine; playing never notices them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import socialai_dsl as sd
from socialai_dsl.envs.asking import Asker, Question, probe_names
from tests.agreement import questions_agree
from tests.reference import Reference

SHIPPED = ("talkitout", "cointhief", "novel/sally_anne", "novel/gaze_following")
SCENARIOS = Path(__file__).parents[3] / "scenarios"

CORNER = {
    "scenario": "corner",
    "horizon": 6,
    "grammar": {"templates": ["Say <noun>"], "nouns": ["red", "blue"]},
    "room": {"size": 5},
    "objects": {"doors": {"type": "door", "count": 2, "color": ["red", "blue"], "at": [[0, 2], [4, 2]]}},
    "let": {"exit": "pick(doors)"},
    "state": {"round": {"start": 0, "range": "0..9"}},
    "rules": [{"when": "t > 0", "set": {"round": "round + 1"}}],
    "cast": {"agent": {"at": [2, 2], "facing": "right"}},
    "outcome": [{"success": 'agent.said("Say <exit.color>")'}, {"failure": "agent.spoke"}],
}
STAY = np.array([7, 0, 0, 0])
LEFT = np.array([0, 0, 0, 0])


@pytest.fixture
def asked(tmp_path: Path) -> Any:
    """Plays actions in a small scenario with these probes; what is asked at its start and after each step."""

    def play(probes: dict[str, Any], *actions: Any, **more: Any) -> list[list[Question]]:
        path = tmp_path / "corner.yaml"
        path.write_text(
            yaml.safe_dump({**CORNER, **more, "probes": probes}, sort_keys=False), encoding="utf-8"
        )
        return list(following(str(path), list(actions), {"test_episode": 0}))

    return play


def following(name: str, actions: Any, options: dict[str, Any]) -> Iterator[list[Question]]:
    """What is asked at the start of an episode and after each of its steps."""
    env, asker = sd.make(name), Asker(sd.load(name))
    observation, _ = env.reset(options=options)
    yield asker.reset(None, options, observation["image"])
    for action in actions:
        observation, _, terminated, truncated, _ = env.step(action)
        yield asker.step([action], observation["image"], terminated or truncated)
        if terminated or truncated:
            return


def texts(asked: list[list[Question]]) -> list[list[str]]:
    return [[question.probe for question in now] for now in asked]


def test_a_probe_is_asked_once_at_its_first_moment(asked: Any) -> None:
    probes = {
        "start": {"when": "t == 0", "ask": "Which?", "answer": "exit.color"},
        "later": {"when": "t >= 2", "ask": "When?", "answer": "round"},
        "never": {"when": "t == 99", "ask": "Which?", "answer": "exit.color"},
        "end": {"ask": "What was it?", "answer": "exit.color"},
    }
    found = asked(probes, *[STAY] * 6)
    assert texts(found) == [["start"], [], ["later"], [], [], [], ["end"]]
    assert found[2][0].right == "2"
    assert found[0][0].right == found[6][0].right
    assert found[0][0].right in ("red", "blue")


def test_the_state_is_that_after_the_step(asked: Any) -> None:
    probes = {
        "faced": {"when": "agent.did(left)", "ask": "Where to?", "answer": "agent.facing"},
        "turned": {
            "when": "prev(agent.facing) != agent.facing",
            "ask": "Whence?",
            "answer": "prev(agent.facing)",
        },
        "said": {"when": "agent.spoke", "ask": "What?", "answer": "agent.noun", "answers": ["red", "blue"]},
        "ended": {"ask": "Did you say red?", "answer": 'agent.said("Say red")'},
    }
    found = asked(probes, STAY, LEFT, np.array([7, 1, 0, 0]))
    assert texts(found) == [[], [], ["faced", "turned"], ["said", "ended"]]
    assert [question.right for now in found for question in now] == ["up", "right", "red", "yes"]


def test_before_the_first_step_what_was_is_what_is(asked: Any) -> None:
    probes = {
        "start": {"when": "prev(agent.facing) == right", "ask": "Where?", "answer": "prev(agent.facing)"},
        "same": {"ask": "Was it red?", "answer": "prev(exit.color) == exit.color"},
        "later": {"when": "prev(agent.facing) == up", "ask": "Where?", "answer": "prev(agent.facing)"},
    }
    found = asked(probes, LEFT, *[STAY] * 5)
    assert texts(found) == [["start"], [], ["later"], [], [], [], ["same"]]
    assert [found[0][0].right, found[2][0].right, found[6][0].right] == ["right", "up", "yes"]


def test_what_npcs_said_is_known_even_if_no_rule_asks(asked: Any) -> None:
    frames = {"tell": {"states": {"s": {"then": [{"after": 2, "say": "It is <exit.color>"}]}}}}
    cast = {**CORNER["cast"], "guide": {"frame": "tell", "at": [2, 1], "name": "Ann"}}  # type: ignore[dict-item]
    probes = {
        "told": {"when": 'guide.said("It is <exit.color>")', "ask": "Who spoke?", "answer": "exit.color"}
    }
    found = asked(probes, *[STAY] * 3, frames=frames, cast=cast)
    assert texts(found) == [[], [], ["told"], []]


def test_answers_are_what_the_answer_can_be(asked: Any) -> None:
    probes = {
        "number": {"ask": "How much?", "answer": "round"},
        "truth": {"ask": "Red?", "answer": "exit.color == red"},
        "color": {"ask": "Which?", "answer": "exit.color"},
        "table": {"ask": "How is it called?", "answer": "called(exit.color)"},
        "written": {
            "ask": "Which?",
            "answer": "exit.color",
            "answers": ["<exit.color>", "none", "a blue one"],
        },
    }
    (*_, found) = asked(probes, *[STAY] * 6, tables={"called": {"red": "rouge", "blue": "bleu"}})
    answers = {question.probe: question.answers for question in found}
    assert answers["number"] == tuple(map(str, range(10)))
    assert answers["truth"] == ("no", "yes")
    assert answers["color"] == ("blue", "red")
    assert answers["table"] == ("bleu", "rouge")
    assert answers["written"] == tuple(sorted(("a blue one", "none", found[2].right)))


def test_the_right_answer_is_always_offered_and_spelt_as_written(asked: Any) -> None:
    probes = {
        "missing": {"ask": "Which?", "answer": "exit.color", "answers": ["<round>", "none"]},
        "spelt": {"ask": "Which?", "answer": "exit.color", "answers": ["Red", "Blue."]},
    }
    (*_, (missing, spelt)) = asked(probes, *[STAY] * 6)
    assert missing.answers == tuple(
        sorted((missing.right, "none", "6"), key=lambda word: (word != "6", word))
    )
    assert spelt.answers == ("Blue.", "Red")
    assert spelt.right in spelt.answers


def test_values_in_a_question_are_those_of_the_moment(asked: Any) -> None:
    probes = {"q": {"when": "t == 3", "ask": "After <round> turns, <exit.color>?", "answer": "t == round"}}
    found = asked(probes, *[STAY] * 6)
    assert found[3][0].text in ("After 3 turns, red?", "After 3 turns, blue?")


def test_where_a_value_finds_nothing_or_one_answer_is_left_nothing_is_asked(asked: Any) -> None:
    probes = {
        "nothing": {"ask": "Which?", "answer": "first(d in doors where d.open).color"},
        "false": {"ask": "Is it?", "answer": "first(d in doors where d.open).color == red"},
        "single": {"ask": "Which?", "answer": "exit.color", "answers": ["<exit.color>", "<exit.color>"]},
    }
    (*_, found) = asked(probes, *[STAY] * 6)
    assert [(question.probe, question.right) for question in found] == [("false", "no")]


@pytest.mark.thorough("compiles suites")
def test_a_suite_asks_the_probes_of_the_member_that_is_played(tmp_path: Path) -> None:
    suite = tmp_path / "two.yaml"
    members = [str(SCENARIOS / "talkitout.yaml"), str(SCENARIOS / "help.yaml")]
    for path in members:
        (tmp_path / Path(path).name).write_text(Path(path).read_text(encoding="utf-8"), encoding="utf-8")
    suite.write_text("suite: two\nmembers: [talkitout.yaml, help.yaml]\n", encoding="utf-8")
    loaded = sd.load(suite)
    assert probe_names(loaded) == ("talkitout: trust", "talkitout: promise")
    found = {}
    for number in range(12):
        env = sd.make(suite)
        _, info = env.reset(options={"test_episode": number})
        done = env.encode_action(("done", None))
        asked = list(following(str(suite), [done], {"test_episode": number}))
        found[info["member"]] = [question.probe for now in asked for question in now]
    assert found == {"talkitout": ["talkitout: promise"], "help": []}


def test_each_act_of_a_suite_has_its_own_questions(tmp_path: Path) -> None:
    for act, when in (("first", "t >= 1"), ("second", "agent.did(left)")):
        probes = {
            "now": {"when": when, "ask": "Which?", "answer": "exit.color"},
            "end": {"ask": "?", "answer": "exit.color"},
        }
        text = yaml.safe_dump({**CORNER, "scenario": act, "probes": probes}, sort_keys=False)
        (tmp_path / f"{act}.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "acts.yaml").write_text(
        "suite: acts\nmembers: [first.yaml, second.yaml]\ndraw: in_sequence\n", encoding="utf-8"
    )
    speak = np.array([7, 1, 0, 0])
    found = list(
        following(str(tmp_path / "acts.yaml"), [STAY, speak, STAY, LEFT, speak], {"test_episode": 0})
    )
    assert texts(found) == [[], ["first: now"], [], [], ["second: now"], ["second: end"]]


def test_variants_and_bases_change_probes(tmp_path: Path) -> None:
    base = {
        **CORNER,
        "probes": {"a": {"ask": "Which?", "answer": "exit.color"}, "b": {"ask": "How?", "answer": "round"}},
    }
    (tmp_path / "corner.yaml").write_text(yaml.safe_dump(base, sort_keys=False), encoding="utf-8")
    (tmp_path / "corner_other.yaml").write_text(
        "variant: corner_other\nof: corner.yaml\nremove: [probes.b]\nset: {probes.a.ask: No}\n"
        "add: {probes: {c: {ask: Where, answer: agent.facing}}}\n",
        encoding="utf-8",
    )
    (tmp_path / "built.yaml").write_text(
        "scenario: built\nextends: corner.yaml\n"
        "probes: {a: {when: t == 1}, d: {ask: Red, answer: exit.color == red}}\n",
        encoding="utf-8",
    )
    other = sd.load(tmp_path / "corner_other.yaml").checked
    assert [(probe.name, probe.ask) for probe in other.probes] == [("a", ("No",)), ("c", ("Where",))]
    built = sd.load(tmp_path / "built.yaml").checked
    assert [(probe.name, probe.when is None) for probe in built.probes] == [
        ("a", False),
        ("b", True),
        ("d", True),
    ]


@pytest.mark.parametrize("name", SHIPPED)
def test_a_program_is_the_same_without_probes(name: str, tmp_path: Path) -> None:
    written = (SCENARIOS / f"{name}.yaml").read_text(encoding="utf-8")
    before, probes, rest = written.partition("\nprobes:")
    assert probes
    path = tmp_path / f"{Path(name).name}.yaml"
    path.write_text(
        before + "".join(re.findall(r"\n(?:check|rivals):.*", rest, re.DOTALL)) + "\n", encoding="utf-8"
    )
    plain, probed = sd.compile(sd.load(path)), sd.compile(sd.load(name))
    assert probed.sha256 == plain.sha256
    assert probed.listing().splitlines()[1:] == plain.listing().splitlines()[1:]


@pytest.mark.parametrize(
    "name", [*SHIPPED, "talkitout+oracle", "novel/gaze_following+oracle", "novel/sally_anne+oracle"]
)
def test_the_reference_asks_the_same(name: str) -> None:
    """Random play, or the script; the reference interpreter says which probes' moment it is, and what is right."""
    env, asker, reference = sd.make(name), Asker(sd.load(name)), Reference(name)
    draw = np.random.default_rng(0)

    def choose() -> Any:
        return env.scripted_action() if "oracle" in name else _moving(env, draw)

    assert sum(questions_agree(env, asker, reference, seed, choose) for seed in range(3)) >= 3


def _moving(env: Any, draw: np.random.Generator) -> Any:
    """A random action that does not end the episode at once."""
    return np.array(
        [draw.choice([i for i, a in enumerate((*env.program.actions, "")) if a != "done"]), 0, 0, 0]
    )
