"""Every file, every command and every line of output that the tutorial shows, in the order in which it shows them."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.cli import main

PAGE = Path(__file__).parents[1] / "docs" / "tutorial.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
TRAINING = "socialai-run"


def blocks() -> list[tuple[str, str]]:
    return BLOCK.findall(PAGE.read_text(encoding="utf-8"))


class Reader:
    """Somebody who does what the tutorial says.

    Attributes:
        printed: what the last command printed.
        training: whether to train as well, which takes a minute.
    """

    def __init__(self, training: bool) -> None:
        self.training = training
        self.printed = ""
        self._names: dict[str, Any] = {}

    def follow(self) -> None:
        """Everything, from the first step to the last."""
        for language, text in blocks():
            match language:
                case "yaml":
                    self._save(text)
                case "python":
                    self._run_python(text)
                case "console":
                    self._run(text)
                case "text":
                    self._compare(text)
                case other:
                    raise AssertionError(f"nobody follows a block of {other}")

    @staticmethod
    def _save(text: str) -> None:
        first, _, _ = text.partition("\n")
        name = re.match(r"# (\w+\.yaml)(, at its end)?$", first)
        assert name, f"a file without a name: {first}"
        with open(name[1], "a" if name[2] else "w", encoding="utf-8") as file:
            file.write(text)

    def _run_python(self, text: str) -> None:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(text, PAGE.name, "exec"), self._names)
        self.printed = printed.getvalue()

    def _run(self, text: str) -> None:
        (line,) = text.splitlines()
        program, *words = shlex.split(line.removeprefix("$ "))
        if program == "cat":
            self.printed = Path(words[0]).read_text(encoding="utf-8") if self.training else ""
            return
        if program == TRAINING and not self.training:
            return
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            code = main.main(words if program == "socialai" else ["run", *words])
        self.printed = printed.getvalue()
        assert code == (1 if "typo.yaml" in words else 0), self.printed

    def _compare(self, text: str) -> None:
        for line in text.splitlines():
            assert line in self.printed, self.printed


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_it_has_ten_steps() -> None:
    headings = re.findall(r"^## (\d+)\. ", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert headings == [str(number) for number in range(1, 11)]


def test_whoever_follows_it_gets_what_it_shows(capsys: pytest.CaptureFixture[str]) -> None:
    """All but the training; the oracle's run is short."""
    Reader(training=False).follow()
    assert "cupboard." in Path("oracle_run/transcript.txt").read_text(encoding="utf-8")
    assert Path("bakery.png").read_bytes().startswith(b"\x89PNG")


def said_in_python() -> Iterator[str]:
    for language, text in blocks():
        if language == "python":
            yield text


def test_the_baker_answers_who_greets_her(capsys: pytest.CaptureFixture[str]) -> None:
    """In the conversation of step 5."""
    reader = Reader(training=False)
    for language, text in blocks():
        if language == "yaml":
            reader._save(text)
    for text in said_in_python():
        reader._run_python(text)
    assert re.fullmatch(r"(?s).*Hm\?.*Good morning!.*In the \w+ cupboard\.\s*", reader.printed)


@pytest.mark.slow
def test_an_agent_is_trained_and_leaves_a_transcript() -> None:
    reader = Reader(training=True)
    reader.follow()
    assert "agent" in reader.printed
    assert Path("first_run/learning_curve.png").exists()
