"""Every finding has a page in the docs: its wrong example gives that finding alone, its right one gives none."""

from __future__ import annotations

import re
import shlex
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from socialai_dsl.analysis.effort import Effort
from socialai_dsl.cli.check import check_scenario, scenarios_of
from socialai_dsl.diagnostics import CODES, render_text
from socialai_dsl.frontend import CheckResult, check

FOLDER = Path(__file__).parents[1] / "docs" / "diagnostics"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"# ([\w/]+\.yaml)\n")


def checked(page: str, part: str, folder: Path) -> CheckResult:
    """What is found in the files, or the name, that a part of a page shows."""
    shutil.copy(FOLDER / "start.yaml", folder)
    (folder / "example.yaml").write_text("scenario: example\nextends: start.yaml\n", encoding="utf-8")
    name = "example.yaml"
    for language, text in BLOCK.findall(part):
        if language == "yaml":
            named = NAMED.match(text)
            (folder / (named[1] if named else name)).write_text(text, encoding="utf-8")
        elif language == "console":
            program, command, *options, name = shlex.split(text.removeprefix("$ "))
            assert (program, command) == ("socialai", "validate"), page
            assert options in ([], ["--deep"]), page
            if options:
                return tried_out(name)
    return check(name)


def tried_out(name: str) -> CheckResult:
    """What is found in a file, and what trying it out in a few rooms shows."""
    result = check(name)
    found = [
        finding
        for scenario, called in scenarios_of(name)
        for finding in check_scenario(scenario, called, Effort(4, 0, 2000), deep=True).findings()
    ]
    return replace(result, diagnostics=(*result.diagnostics, *found))


def parts(code: str) -> tuple[str, str, str]:
    """A page in three: what stands before the examples, the wrong one and the right one."""
    head, wrong, right = re.split(
        r"^## (?:Wrong|Right)\n", (FOLDER / f"{code}.md").read_text("utf-8"), flags=re.MULTILINE
    )
    return head, wrong, right


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_every_code_has_its_page() -> None:
    assert {path.stem for path in FOLDER.glob("[SW]*.md")} == set(CODES)


@pytest.mark.parametrize("code", CODES)
def test_a_page_is_called_like_its_code(code: str) -> None:
    assert parts(code)[0].startswith(f"# {code}: {CODES[code]}\n")


@pytest.mark.parametrize("code", CODES)
def test_the_wrong_example_gives_this_finding_alone(code: str, tmp_path: Path, update_goldens: bool) -> None:
    result = checked(code, parts(code)[1], tmp_path)
    assert [d.code for d in result.diagnostics] == [code], [str(d) for d in result.diagnostics]
    said = render_text(result.diagnostics, result.sources) + "\n"
    page = FOLDER / f"{code}.md"
    if update_goldens:
        text = page.read_text(encoding="utf-8")
        page.write_text(
            re.sub(r"(?s)```text\n.*?```", lambda _: f"```text\n{said}```", text, count=1), "utf-8"
        )
    assert f"```text\n{said}```" in parts(code)[1], "if the new text is meant, run pytest --update-goldens"


@pytest.mark.parametrize("code", CODES)
def test_the_right_example_gives_none(code: str, tmp_path: Path) -> None:
    assert [str(d) for d in checked(code, parts(code)[2], tmp_path).diagnostics] == []


def test_the_list_of_pages_is_complete() -> None:
    """In the order of the catalogue."""
    index = (FOLDER / "index.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| \[([SW]\d+)\]\(\1\.md\) \| (.+) \|$", index, re.MULTILINE) == list(CODES.items())
