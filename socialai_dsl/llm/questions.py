"""Probes in words: the text of a question, and the reader of its answer."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from socialai_dsl.diagnostics import printable
from socialai_dsl.envs.asking import Question
from socialai_dsl.llm.actions import Mode
from socialai_dsl.llm.replies import conclusion, lines_of, mark, readable

_MARK: Final = mark("answer", r"(?:[:：﹕∶꞉]|\bis\b[:：]?)")
_WORD: Final = re.compile(r"(?<!\w)-\d+|(?:[^\W_]|')+")


@dataclass(frozen=True)
class AnsweredQuestion:
    """A question and what was answered; None if the reply held no answer, or several."""

    question: Question
    given: str | None

    @property
    def right(self) -> bool:
        """Whether it is the right answer."""
        return self.given == self.question.right


@dataclass(frozen=True)
class Score:
    """How a probe was answered.

    Attributes:
        asked: how often it was. right: how many answers were. unread: how many replies held no answer.
        chance: the share that guessing gets right; None if it was never asked.
    """

    asked: int
    right: int
    unread: int
    chance: float | None


def score(answered: Iterable[AnsweredQuestion]) -> Score:
    """The score of the questions of one probe."""
    found = list(answered)
    return Score(
        len(found),
        sum(one.right for one in found),
        sum(one.given is None for one in found),
        sum(one.question.chance for one in found) / len(found) if found else None,
    )


def put(question: Question, mode: Mode) -> str:
    """The message that asks a question."""
    form = '{"answer": "..."}' if mode == "json" else "Answer: ..."
    return (
        f"A question, apart from your turns: {printable(question.text)}\n"
        f"The answer is one of: {'; '.join(map(printable, question.answers))}\n"
        f"Do not act now. Reply with one line in this form:\n{form}"
    )


def constraints(question: Question, mode: Mode, grammar: bool) -> dict[str, Any]:
    """The constraints of a request on the form of the answer."""
    if mode == "json":
        answer = {"type": "string", "enum": list(question.answers)}
        schema = {
            "type": "object",
            "properties": {"answer": answer},
            "required": ["answer"],
            "additionalProperties": False,
        }
        named = {"name": "answer", "strict": True, "schema": schema}
        return {"response_format": {"type": "json_schema", "json_schema": named}}
    if not grammar:
        return {}
    answers = " | ".join(json.dumps(answer, ensure_ascii=False) for answer in question.answers)
    return {"grammar": f'root ::= "Answer: " ({answers})'}


def read_answer(reply: str, answers: Sequence[str]) -> str | None:
    """Which of the answers a reply gives; None if it gives none of them, or several.

    What counts is the last JSON object with an `answer` or the last line marked `Answer:`, whichever comes later;
    without either, the last line, and then the whole reply. Case, punctuation, markdown and further words do not count.
    """
    text = readable(reply, "Answer")
    stated = conclusion(text, _MARK, "answer").statements
    if stated:
        meant = stated[-1]
        return _named(meant if isinstance(meant, str) else str(meant["answer"]), answers)
    found = (_named(part, answers) for part in (*lines_of(text)[-1:], text))
    return next((answer for answer in found if answer is not None), None)


def _named(text: str, answers: Sequence[str]) -> str | None:
    """The one answer that a text names; a shorter one within a longer one is not named."""
    wanted = sorted(((_words(answer), answer) for answer in answers), key=lambda one: -len(one[0]))
    beginning: dict[str, list[tuple[list[str], str]]] = {}
    for spelt, answer in wanted:
        if spelt:
            beginning.setdefault(spelt[0], []).append((spelt, answer))
    said, found, end = _words(text), set[str](), 0
    for at in (at for at, word in enumerate(said) if word in beginning):
        here = [one for one in beginning[said[at]] if said[at : at + len(one[0])] == one[0]]
        if here and at >= end:
            spelt, answer = here[0]
            found.add(answer)
            end = at + len(spelt)
    if not found:
        found = {answer for answer in answers if answer.strip() == text.strip()}
    return found.pop() if len(found) == 1 else None


def _words(text: str) -> list[str]:
    return _WORD.findall(text.casefold())
