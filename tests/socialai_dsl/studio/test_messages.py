"""Both boundaries: whatever arrives is a message or is refused in a sentence, and the next one is answered, too."""

from __future__ import annotations

import asyncio
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import given, settings
from pydantic import BaseModel

from socialai_dsl.studio import engine, messages
from socialai_dsl.studio.engine import Engine, EngineLostError, start_worker
from socialai_dsl.studio.judging import JUDGED
from socialai_dsl.studio.messages import ANSWERS, QUESTIONS, WINDOW_QUESTIONS, Check, Refused, parsed
from socialai_dsl.studio.session import ASKED
from socialai_dsl.studio.worker import Desk, answer_window
from tests.socialai_dsl.studio.hostile import FILES, GAME, answer_wrongly, texts
from tests.socialai_dsl.studio.processes import wait_until_none_works, workers

SCENARIO = Path(__file__).parents[3] / "scenarios" / "talkitout.yaml"


def words(union: Any) -> set[str]:
    """The words of the messages of a union."""
    kinds: list[type[BaseModel]] = list(get_args(union))
    return {word for kind in kinds for word in get_args(kind.model_fields["do"].annotation)}


def test_every_question_has_an_answer_and_is_tried_below() -> None:
    questions, answers = get_args(messages.Question)[0], get_args(messages.Answer)[0]
    assert (
        {*ASKED, *JUDGED} == words(questions) == words(answers) - {"refused"} == {one["do"] for one in GAME}
    )
    assert words(messages.FileQuestion) == {one["do"] for one in FILES}
    for one in (*GAME, *FILES):
        assert parsed(WINDOW_QUESTIONS, json.dumps({"id": 1, **one})).do == one["do"]
        assert isinstance(parsed(QUESTIONS, json.dumps({"id": 1, **one})), Refused) == (one in FILES)


@settings(max_examples=300, derandomize=True)
@given(texts(GAME + FILES))
def test_a_text_is_a_message_or_is_refused_in_a_sentence(text: str) -> None:
    found = parsed(WINDOW_QUESTIONS, text)
    if isinstance(found, Refused):
        assert 10 < len(found.refused) < 600
    try:
        number = json.loads(text)["id"]
    except (ValueError, TypeError, KeyError, RecursionError):
        return
    if type(number) is int and 0 <= number < 1 << 53:
        assert found.id == number, "so that whoever asked is told"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "cannot be read: invalid JSON"),
        ("[]", "cannot be read"),
        ('{"id": 1}', "without the word `do`"),
        ('{"id": 1, "do": "explode"}', "got 'explode' as `do`"),
        ('{"id": 1, "do": [2]}', "got [2] as `do`"),
        ('{"id": 1, "do": "back"}', "without `to`"),
        ('{"id": 1, "do": "back", "to": "0"}', "`to`: got '0'; input should be a valid integer"),
        ('{"id": 1, "do": "back", "to": -1}', "`to`: got -1; input should be greater than or equal to 0"),
        ('{"id": 1, "do": "back", "to": true}', "`to`: got True"),
        (
            '{"id": 1, "do": "begin", "room": {"seed": 9223372036854775808}}',
            "`room.seed`: got 9223372036854775808",
        ),
        ('{"id": 1, "do": "begin", "room": {"seed": NaN}}', "`room.seed`: got nan"),
        ('{"id": 1, "do": "list", "more": 1}', "the key 'more', which it does not have"),
        ('{"id": null, "do": "list"}', "`id`: got None"),
        ('{"id": 1, "do": "add", "name": "\\ud800.yaml", "text": ""}', "cannot be read: invalid JSON"),
        ("\ud800", "cannot be read"),
        ('{"id": 12, "do": "draw", "text": "' + "a" * (3 << 20), "got a message of 3145"),
        ('{"id": 12, "x": ' + "[" * 900, "recursion limit exceeded"),
    ],
)
def test_what_is_wrong_is_said(text: str, said: str) -> None:
    found = parsed(WINDOW_QUESTIONS, text)
    assert isinstance(found, Refused)
    assert said in found.refused
    assert found.id == (12 if '"id": 12' in text else 1 if '"id": 1' in text else None)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("folder")
    shutil.copy(SCENARIO, made)
    return made


def test_a_process_answers_every_line_and_goes_on(folder: Path) -> None:
    desk = Desk(folder)

    def ask(**question: Any) -> dict[str, Any]:
        answer: dict[str, Any] = json.loads(desk.answer(json.dumps({"id": 1, **question})))
        return answer

    drawing = {"do": "draw", "path": SCENARIO.name, "text": SCENARIO.read_text(), "room": {"seed": 3}}
    assert "episode" in ask(**drawing)

    @settings(max_examples=150, derandomize=True)
    @given(texts(GAME))
    def each(line: str) -> None:
        answer = desk.answer(line)
        assert "\n" not in answer
        found = ANSWERS.validate_json(answer)
        assert not isinstance(found, Refused) or not found.lost, found.refused

    each()
    assert "episode" in ask(**drawing)
    assert ask(do="act", movement="left")["more"]["moments"][0]["t"] == 1


def test_a_failure_of_ours_is_an_answer_and_a_new_game(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(folder)
    for failure in (AssertionError("internal: x"), RecursionError(), MemoryError(), KeyError("x" * 5000)):

        def fail(*_: object, failure: Exception = failure) -> dict[str, Any]:
            raise failure

        monkeypatch.setitem(ASKED, "auto", fail)  # type: ignore[arg-type]
        found = ANSWERS.validate_json(desk.answer('{"id": 4, "do": "auto"}'))
        assert isinstance(found, Refused)
        assert (found.id, found.lost) == (4, True)
        assert len(found.refused) < 1200
    monkeypatch.setitem(ASKED, "auto", lambda _: {"more": float("nan")})  # type: ignore[arg-type]
    assert '"lost":true' in desk.answer('{"id": 4, "do": "auto"}')


@pytest.fixture
def children() -> Iterator[None]:
    """Every process that a test has started is gone after it."""
    yield
    wait_until_none_works()


@pytest.mark.usefixtures("children")
def test_a_process_that_answers_wrongly_is_replaced(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "answer_window", answer_wrongly)
    right = '{"id": 5, "do": "check", "claims": [], "findings": [], "lines": ["x"]}\n'

    async def ask_all() -> None:
        asked = Engine(folder)
        for wrong in (
            "",
            "\n",
            "nonsense\n",
            "\xff\xfe\n",
            "null\n",
            "[" * 999 + "\n",
            right.strip(),
            right.replace("5", "6"),
            right.replace("check", "replay"),
            right.replace('["x"]', "[1]"),
            right.replace("lines", "line"),
            '{"id": 5, "do": "back", "length": 1}\n',
        ):
            with pytest.raises(EngineLostError, match="it is started again"):
                await asked.ask(Check(id=5, do="check", path="x.yaml", text=wrong))
        assert await asked.ask(Check(id=5, do="check", path="x.yaml", text=right)) == right.strip()
        await asked.stop()

    asyncio.run(ask_all())


@pytest.mark.usefixtures("children")
def test_a_process_ends_with_its_server_whatever_it_does(folder: Path) -> None:
    async def leave_it_alone() -> None:
        worker = await start_worker(answer_window, folder)
        asked = Check(id=1, do="check", path=SCENARIO.name, text=SCENARIO.read_text())
        worker.writer.write(asked.model_dump_json().encode() + b"\n")
        await asyncio.sleep(0.5)
        assert workers()
        worker.writer.close()  # as the system does for a server that was killed
        await asyncio.to_thread(wait_until_none_works)
        await worker.stop()

    asyncio.run(leave_it_alone())
