"""The examples of `--help`: every command has some, all are understood, and those that end by themselves work."""

from __future__ import annotations

import re
import shlex
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.cli.main import _COMMANDS, main, run_main
from socialai_dsl.experiments.request import requested

MODULES = {name: import_module(f"socialai_dsl.cli.{name}") for name in _COMMANDS}
EXAMPLES = [command for module in MODULES.values() for command, _ in module.EXAMPLES]

GOES_ON = re.compile(
    r"socialai (play|studio|serve|lsp|study)\b"  # until somebody ends it
    r"|socialai-run talkitout$|experiment run"  # for minutes or hours
    r"|llm:|experiment status|studies/"  # with a model, or the folder of an experiment or of a study
)
"""Examples that do not end by themselves, or need what is not here: they are parsed, and not followed."""


def call(command: str) -> int:
    program, *words = shlex.split(command)
    return run_main(words) if program == "socialai-run" else main(words)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the first examples were followed: there are a scenario and a run."""
    folder = tmp_path_factory.mktemp("examples")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert call("socialai new gate") == 0
        (short,) = (command for command, _ in MODULES["run"].EXAMPLES if "--out runs/gate" in command)
        assert call(short) == 0
    return folder


@pytest.mark.parametrize(
    "command",
    [
        c
        for c in EXAMPLES
        if not GOES_ON.search(c) and c != "socialai new gate" and "--out runs/gate" not in c
    ],
)
def test_an_example_works(command: str, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    assert call(command) == 0


@pytest.mark.parametrize("command", [c for c in EXAMPLES if GOES_ON.search(c)])
def test_an_example_that_goes_on_is_understood(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def execute(arguments: Any) -> int:
        return 0

    for module in MODULES.values():
        monkeypatch.setattr(module, "execute", execute)
    assert call(command) == 0


@pytest.mark.parametrize("name", _COMMANDS)
def test_every_help_shows_them(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "--help"]) == 0
    shown = capsys.readouterr().out
    assert "--debug" in shown
    assert MODULES[name].EXAMPLES
    assert all(f"\n  {command}\n      {purpose}\n" in shown for command, purpose in MODULES[name].EXAMPLES)


def test_the_progress_is_asked_of_the_folder_that_the_run_makes() -> None:
    run, status = (
        next(shlex.split(command) for command in EXAMPLES if f"experiment {action}" in command)
        for action in ("run", "status")
    )
    _, folder = requested(run[3], run[run.index("--profile") + 1], None)
    assert status[3] == str(folder)
