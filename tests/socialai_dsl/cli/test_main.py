"""Exit codes and messages: every way a command can end."""

import argparse
import errno
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from socialai_dsl.cli import main as cli
from socialai_dsl.cli import validate
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.main import main, run_main
from socialai_dsl.diagnostics import Diagnostic, ScenarioError
from socialai_dsl.errors import RunFailed, UsageError
from socialai_dsl.source import Span

Capture = pytest.CaptureFixture[str]


def ending_with(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> Callable[..., int]:
    """`socialai validate` whose work ends with this error."""

    def execute(arguments: argparse.Namespace) -> Exit:
        raise error

    monkeypatch.setattr(validate, "execute", execute)
    return lambda *options: main(["validate", "x.yaml", *options])


@pytest.mark.parametrize(("file", "code"), [("a.yaml", 1), ("the name on the command line", 2)])
def test_findings(
    file: str, code: int, monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text("")
    finding = Diagnostic("S501", "no such path", Span(file, 2, 1, 6))
    assert ending_with(monkeypatch, ScenarioError([finding]))() == code
    assert capsys.readouterr().err == f"{file}:2:1: S501 no such path\n"


def test_usage(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    assert ending_with(monkeypatch, UsageError("frames: got -1, expected at least 1"))() == 2
    assert capsys.readouterr().err == "socialai: frames: got -1, expected at least 1\n"


def test_unwritable_output_names_the_file(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    error = PermissionError(errno.EACCES, os.strerror(errno.EACCES), "/runs/result.json")
    assert ending_with(monkeypatch, error)() == 2
    assert capsys.readouterr().err == "socialai: Permission denied: /runs/result.json\n"


def test_our_own_bug_asks_for_a_report(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    assert ending_with(monkeypatch, AssertionError("internal: no such register"))() == 3
    shown = capsys.readouterr().err
    assert "internal: no such register" in shown
    assert "report it" in shown
    assert "Traceback" not in shown


def test_debug_shows_the_traceback(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    assert ending_with(monkeypatch, AssertionError("internal: x"))("--debug") == 3
    assert "Traceback" in capsys.readouterr().err


def test_ctrl_c(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    assert ending_with(monkeypatch, KeyboardInterrupt())() == 130
    assert capsys.readouterr().err == "socialai: interrupted\n"


@pytest.mark.skipif(os.name == "nt", reason="needs a shell")
@pytest.mark.parametrize(
    ("closed", "command", "end"),
    [
        ("<&-", "fmt -", 0),
        ("<&-", "play help", 2),
        (">&-", "schema", 0),
        ("2>&-", "validate nothing", 2),
        ("<&- >&- 2>&-", "list talkitout", 0),
        (">&- 2>&-", "nothing", 2),
    ],
)
def test_closed_standard_streams_change_no_end(closed: str, command: str, end: int) -> None:
    """A service may start a command without them."""
    script = f'exec "$0" -W error -m socialai_dsl {command} {closed}'
    done = subprocess.run(["sh", "-c", script, sys.executable], capture_output=True, check=False, text=True)
    assert done.returncode == end
    assert "internal error" not in done.stderr
    assert "ResourceWarning" not in done.stderr


def test_a_reader_that_went_away_is_no_error() -> None:
    script = "import sys; from socialai_dsl.cli.main import main; sys.exit(main(['--help']))"
    # Unbuffered, argparse would meet the broken pipe and keep quiet about it.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    process = subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=Path(cli.__file__).parents[2],
        env=environment,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    errors = process.stderr.read()
    process.stderr.close()
    assert (process.wait(60), errors) == (141, b"")


@pytest.mark.parametrize("arguments", [["validate"], ["validate", "--format", "xml", "a.yaml"]])
def test_wrong_usage(arguments: list[str], capsys: Capture) -> None:
    assert main(arguments) == 2
    assert "usage: socialai" in capsys.readouterr().err


@pytest.mark.parametrize("entry", [main, run_main])
def test_help_and_version(entry: Callable[[list[str]], int], capsys: Capture) -> None:
    for option, expected in (("--help", "usage: "), ("--version", "socialai")):
        assert entry([option]) == 0
        assert expected in capsys.readouterr().out


def test_an_unknown_command_is_answered_with_the_nearest_one(capsys: Capture) -> None:
    assert main(["validat", "help"]) == 2
    assert capsys.readouterr().err == "socialai: there is no command validat; did you mean validate?\n"


def test_without_a_command_it_explains_itself(capsys: Capture) -> None:
    assert main([]) == 0
    printed = capsys.readouterr().out
    assert all(f"\n  {name} " in printed for name in cli._COMMANDS)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_knows_commands_and_options(shell: str, capsys: Capture) -> None:
    assert main(["--print-completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(name in script for name in cli._COMMANDS)
    assert "stdin-filename" in script


def test_the_completion_script_is_sound(capsys: Capture) -> None:
    assert main(["--print-completion", "bash"]) == 0
    subprocess.run(["bash", "-n"], input=capsys.readouterr().out, text=True, check=True, timeout=30)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "talkitout", "--nett", "x"], "socialai run: there is no option --nett; did you mean --net?"),
        (
            ["list", "--wibble=3"],
            "socialai list: there is no option --wibble=3; `socialai list --help` lists the options",
        ),
    ],
)
def test_an_option_that_does_not_exist(arguments: list[str], message: str, capsys: Capture) -> None:
    assert main(arguments) == 2
    assert capsys.readouterr().err == f"{message}\n"


def test_a_run_that_stops_by_itself(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    assert ending_with(monkeypatch, RunFailed("the loss is not finite"))() == 4
    assert capsys.readouterr().err == "socialai: the loss is not finite\n"
