"""Every mistake of an author has a file in tests/diagnostics and, beside it, what is said about it."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from socialai_dsl.diagnostics import CODES, render_text
from socialai_dsl.frontend import CheckResult, check

FOLDER = Path(__file__).parent.parent / "diagnostics"
CASES = sorted(path.stem for path in FOLDER.glob("[0-9]*.yaml"))

NOT_FROM_ONE_FILE = {
    "S507": "needs dozens of files",
    "S508": "about a name on the command line",
    "S801": "found by trying a scenario out",
    "W802": "found by trying a scenario out",
}


@cache
def checked(case: str) -> CheckResult:
    return check(f"{case}.yaml")


@pytest.fixture(autouse=True)
def _in_the_folder(monkeypatch):
    monkeypatch.chdir(FOLDER)


@pytest.mark.parametrize("case", CASES)
def test_message(case, update_goldens):
    result = checked(case)
    said = render_text(result.diagnostics, result.sources) + "\n"
    golden = FOLDER / f"{case}.out"
    if update_goldens:
        golden.write_text(said, encoding="utf-8")
    assert result.diagnostics, f"{case}.yaml has no mistake"
    assert said == golden.read_text(encoding="utf-8"), "if the new text is meant, run pytest --update-goldens"


@pytest.mark.parametrize(
    "case", [case for case in CASES if case[:2] in ("75", "76", "77", "78", "80", "81", "82", "83")]
)
def test_a_slip_of_an_author_is_one_finding(case):
    assert len(checked(case).diagnostics) == 1


def test_every_code_has_a_case():
    seen = {d.code for case in CASES for d in checked(case).diagnostics}
    missing = set(CODES) - seen - set(NOT_FROM_ONE_FILE)
    assert not missing, f"no file in tests/diagnostics shows {sorted(missing)}"
    assert not seen & set(NOT_FROM_ONE_FILE), "these codes have a file now: take them off the list"


@pytest.mark.parametrize("name", ["small.yaml", "rich.yaml", "town.yaml", "rich.yaml?count=2&length=4"])
def test_the_files_that_the_mistakes_were_made_in_are_right(name):
    assert check(name).diagnostics == ()
