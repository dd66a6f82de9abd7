"""Questions of probes: how replies are read and scored, and that play does not notice them."""

from __future__ import annotations

import random

import pytest

import socialai_dsl as sd
from socialai_dsl.envs.asking import Question
from socialai_dsl.llm import Episode
from socialai_dsl.llm.episode import scripted_reply
from socialai_dsl.llm.questions import AnsweredQuestion, constraints, put, read_answer, score
from tests.quick import one_in

COLORS = ("red", "green", "dark green")


@pytest.mark.parametrize(
    ("reply", "given"),
    [
        ("Answer: red", "red"),
        ("answer: RED.", "red"),
        ("**Answer:** *red*", "red"),
        ("She saw it in the green box.\nAnswer: the red one!", "red"),
        ("Answer: red\nNo, wait.\nAnswer: green", "green"),
        ("Answer:\n\n`red`", "red"),
        ("The answer is red", "red"),
        ("<think>Answer: green</think>\nAnswer: red", "red"),
        ('```json\n{"answer": "red"}\n```', "red"),
        ('{"answer": "green"}\nAnswer: red', "red"),
        ("red", "red"),
        ("It was green at first.\nShe will look in the red box.", "red"),
        ("I say red.\nThat is all.", "red"),
        ("Answer: dark green", "dark green"),
        ("Answer: dark-green", "dark green"),
        ("Answer: red or green", None),
        ("Answer: blue", None),
        ("Act: left", None),
        ("", None),
        ("redgreen", None),
        ("<answer>red</answer>", "red"),
        ("Answer：red<|im_end|>", "red"),
        ("[THINK]Answer: green[/THINK]Answer: red", "red"),
        ("<analysis>Answer: red", None),
        ("<think>" + "Answer: green. " * 500 + "</think>\nred", "red"),
    ],
)
def test_replies_are_read_as_models_write_them(reply: str, given: str | None) -> None:
    assert read_answer(reply, COLORS) == given


def test_numbers_and_truths() -> None:
    numbers = ("-1", "0", "1", "10")
    assert [read_answer(f"Answer: {number}", numbers) for number in numbers] == list(numbers)
    assert read_answer("There are 10 coins.", numbers) == "10"
    assert read_answer("No, she does not know.", ("no", "yes")) == "no"
    assert read_answer("Yes and no.", ("no", "yes")) is None


def test_a_question_names_its_answers_and_what_a_reply_is_held_to() -> None:
    question = Question("belief", "Where\x1b?", COLORS, "red")
    text = put(question, "text")
    assert "red; green; dark green" in text
    assert "\x1b" not in text
    assert put(question, "json").endswith('{"answer": "..."}')
    schema = constraints(question, "json", False)["response_format"]["json_schema"]["schema"]
    assert schema["properties"]["answer"]["enum"] == list(COLORS)
    assert (
        constraints(question, "text", True)["grammar"]
        == 'root ::= "Answer: " ("red" | "green" | "dark green")'
    )
    assert constraints(question, "text", False) == constraints(question, "tools", False) == {}


def test_a_score_counts_right_answers_beside_chance() -> None:
    two, four = (Question("q", "?", tuple("abcd"[:count]), "a") for count in (2, 4))
    found = score(
        [
            AnsweredQuestion(two, "a"),
            AnsweredQuestion(two, "b"),
            AnsweredQuestion(four, None),
            AnsweredQuestion(four, "a"),
        ]
    )
    assert (found.asked, found.right, found.unread, found.chance) == (4, 2, 1, 0.375)
    assert score([]).chance is None


def played(name: str, number: int, reply: str) -> tuple[Episode, int]:
    """A test episode by its script, with one reply to all questions: `right`, or the answer itself."""
    episode = Episode(f"{name}+oracle", probes=sd.load(f"{name}+oracle"))
    episode.reset(test_episode=number)
    done, questions = False, 0
    while True:
        while (question := episode.question) is not None:
            questions += 1
            episode.answer(question.right if reply == "right" else reply)
        if done:
            return episode, questions
        done = episode.step(scripted_reply(episode)).done


@pytest.mark.parametrize(
    "name",
    one_in(4, ["talkitout", "cointhief", "novel/sally_anne", "novel/gaze_following"], "plays each twice"),
)
def test_asking_changes_nothing_of_an_episode(name: str) -> None:
    plain = Episode(f"{name}+oracle")
    for number in range(3):
        asked, count = played(name, number, "right")
        texts = [plain.reset(test_episode=number)]
        while not plain.result().ending:
            texts.append(plain.step(scripted_reply(plain)).text)
        assert plain.result() == asked.result()
        assert [action.tolist() for action in plain.actions] == [action.tolist() for action in asked.actions]
        assert plain.answered == []
        assert count == len(asked.answered) > 0
        assert all(one.right for one in asked.answered)


def test_guessing_is_right_as_often_as_by_chance() -> None:
    """400 guesses at two boxes each: 50 % within four standard errors."""
    draw, answered = random.Random(0), []
    episode = Episode("novel/sally_anne", probes=sd.load("novel/sally_anne"))
    for number in range(140):
        episode.reset(test_episode=number)
        done = False
        while not done and len(episode.answered) < 3:
            done = episode.step("Act: left").done
            while (question := episode.question) is not None:
                episode.answer(draw.choice(question.answers))
        answered += episode.answered
    found = score(answered)
    assert found.chance == 0.5
    assert found.asked > 400
    assert abs(found.right / found.asked - 0.5) < 4 * 0.5 / found.asked**0.5


def test_what_is_not_answered_before_the_next_step_is_dropped() -> None:
    episode = Episode("novel/gaze_following", probes=sd.load("novel/gaze_following"))
    episode.reset(test_episode=0)
    for _ in range(4):
        episode.step("Act: left")
    question = episode.question
    assert question is not None
    assert question.probe == "attention"
    episode.step("Act: left")
    assert episode.question is None or episode.question.probe != "attention"
    assert episode.answered == []


def test_an_answer_to_nothing_is_a_mistake_of_the_caller() -> None:
    episode = Episode("talkitout")
    episode.reset(seed=0)
    with pytest.raises(ValueError, match="nothing is asked"):
        episode.answer("yes")
