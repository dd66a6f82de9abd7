"""Commands are spelt as they are spelt today: in pages, images, hooks, the Makefile, and tests that are seldom run."""

import ast
import re
import shlex
from collections.abc import Iterator
from importlib import import_module
from itertools import takewhile
from pathlib import Path

import pytest
import yaml

from socialai_dsl.cli.main import _COMMANDS, main, run_main
from tests.test_docs import DOCUMENTS, FINDINGS, commands

ROOT = Path(__file__).parents[1]
SHELL = re.compile(r"[<>|&;]+")
SELDOM = ROOT / "tests" / "socialai_dsl" / "llm"
"""Tests of libraries that `make test-models` installs; others run each time."""


def in_files() -> Iterator[tuple[str, list[str]]]:
    """Whole commands with the files that spell them."""
    for page in DOCUMENTS:
        if page.parent != FINDINGS:
            yield from ((page.name, words) for words in commands(page))
    for path in [*(ROOT / "docker").rglob("Dockerfile"), ROOT / "Makefile", ROOT / ".ci/run"]:
        for line in path.read_text(encoding="utf-8").splitlines():
            found = re.match(r"(?:RUN |CMD |\t\$\(BIN\)/|\s*)(socialai(?:-run)? .*)", line)
            if found is not None:
                yield path.name, shlex.split(found[1].replace("$(ARGS)", ""), comments=True)
    for hook in yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8")):
        yield hook["id"], [*shlex.split(hook["entry"]), "scenario.yaml"]


def test_a_command_that_is_shown_is_understood(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With all its options; it is not executed."""
    shown = list(in_files())
    assert {"Dockerfile", "Makefile", "README.md", "language_models.md"} <= {where for where, _ in shown}
    for where, words in shown:
        program, *rest = takewhile(lambda word: not SHELL.fullmatch(word), words)
        command = "run" if program == "socialai-run" else rest[0]
        if not command.startswith("-"):
            monkeypatch.setattr(import_module(f"socialai_dsl.cli.{command}"), "execute", lambda _: 0)
        code = (run_main if program == "socialai-run" else main)(rest)
        said = capsys.readouterr().err
        assert code == 0, f"{where}: {words}: {said}"


@pytest.mark.parametrize("page", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_command_within_a_sentence_is_spelt_as_today(page: Path) -> None:
    if page.name != "CHANGELOG.md":
        for text in re.findall(r"`socialai ([a-z][^`\n]*)`", page.read_text(encoding="utf-8")):
            assert text.split()[0] in _COMMANDS, text


def in_tests(path: Path) -> Iterator[list[str]]:
    """The commands that a test runs; of what it puts in their place, every text of the same function."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    for function in functions:
        texts = [one.value for one in ast.walk(function) if isinstance(one, ast.Constant)]
        said = [text for text in texts if isinstance(text, str)]
        for node in ast.walk(function):
            if isinstance(node, ast.List) and (
                words := list(words_of(node, is_main=is_main(function, node)))
            ):
                yield [*words, *said] if any(isinstance(one, ast.Starred) for one in node.elts) else words


def words_of(node: ast.List, is_main: bool) -> Iterator[str]:
    """The words of a command behind its program; none of another list."""
    words = [one.value if isinstance(one, ast.Constant) else "X" for one in node.elts]
    if "socialai_dsl" in words:
        words = words[words.index("socialai_dsl") + 1 :]
    elif words[:1] == ["socialai"]:
        words = words[1:]
    elif not is_main:
        return
    yield from map(str, words)


def is_main(function: ast.FunctionDef, node: ast.List) -> bool:
    """Whether a list is what `main` is called with."""
    calls = (one for one in ast.walk(function) if isinstance(one, ast.Call) and one.args[:1] == [node])
    return any(getattr(call.func, "id", getattr(call.func, "attr", "")) == "main" for call in calls)


def test_a_command_in_a_test_that_is_seldom_run_is_spelt_as_today() -> None:
    found = [(path.name, words) for path in sorted(SELDOM.glob("*.py")) for words in in_tests(path)]
    assert {"test_openenv.py", "test_verifiers.py"} <= {name for name, _ in found}
    assert [(name, words) for name, words in found if words[0] not in (*_COMMANDS, "X")] == []
