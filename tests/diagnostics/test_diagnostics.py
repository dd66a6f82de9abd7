"""Mistakes of authors: each has a file here, and its line in `found.txt`; each code has its page in the docs.

Most are slips in a right file; see `tests/slips.py`. The words of a finding stand on its page; the files here with
several findings have them in an `.out`.
"""

from __future__ import annotations

import json
import re
import shlex
import shutil
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from itertools import accumulate
from pathlib import Path
from urllib.parse import unquote

import pytest

from socialai_dsl.analysis.check import check_scenario, scenarios_of
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.checking.formats import CheckedInput, as_json, as_sarif
from socialai_dsl.diagnostics import CODES, Diagnostic, render_text
from socialai_dsl.evaluation.scenario_tests import play_tests
from socialai_dsl.frontend import CheckResult, check
from socialai_dsl.schema.files import FILES
from socialai_dsl.source import Source
from tests.quick import one_in
from tests.slips import SLIPS, write_mistakes

FOLDER = Path(__file__).parent


CASES = sorted([*(path.stem for path in FOLDER.glob("[0-9]*.yaml")), *SLIPS])
SEVERAL = sorted(path.stem for path in FOLDER.glob("*.out"))
"""Those of which everything that is said is kept: files with several findings."""
ONE_SLIP = ("75", "76", "77", "78", "80", "81", "82", "83", "84")
"""How the numbers of files begin in which an author made one slip: it is one finding."""

NOT_FROM_ONE_FILE = {
    "S507": "needs dozens of files",
    "S801": "found by trying a scenario out",
    "W802": "found by trying a scenario out",
    "S803": "found by playing a test",
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with all files, those that slips make among them."""
    folder = tmp_path_factory.mktemp("diagnostics")
    write_mistakes(folder)
    return folder


@cache
def checked(case: str) -> CheckResult:
    return check(f"{case}.yaml")


def line_of(case: str, found: Diagnostic) -> str:
    """A finding without its sentence: the file, the code, the place, and what its cure does, if it has one."""
    file, place = found.span.file, f"{found.span.line}:{found.span.column}"
    cure = found.cure if found.edits else "help" if found.help else ""
    return f"{case} {found.code} {'' if file == f'{case}.yaml' else f'{file}:'}{place} {cure}".rstrip()


def test_each_mistake_is_found_where_it_is(
    whole: Path, update_goldens: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(whole)
    found = [line_of(case, one) for case in CASES for one in checked(case).diagnostics]
    golden = FOLDER / "found.txt"
    if update_goldens:
        golden.write_text("\n".join(found) + "\n", encoding="utf-8")
    assert found == golden.read_text(encoding="utf-8").splitlines(), (
        "if it is meant, run pytest --update-goldens"
    )
    often = Counter(line.split()[0] for line in found)
    assert [case for case in CASES if not often[case]] == [], "these have no mistake"
    assert [case for case in CASES if case.startswith(ONE_SLIP) and often[case] != 1] == []


@pytest.mark.parametrize("case", SEVERAL)
def test_what_is_said_of_several_mistakes(
    case: str, whole: Path, update_goldens: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(whole)
    result = checked(case)
    said = render_text(result.diagnostics, result.sources) + "\n"
    golden = FOLDER / f"{case}.out"
    if update_goldens:
        golden.write_text(said, encoding="utf-8")
    assert said == golden.read_text(encoding="utf-8"), "if the new text is meant, run pytest --update-goldens"


def test_every_code_has_a_case(whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(whole)
    seen = {d.code for case in CASES for d in checked(case).diagnostics}
    missing = set(CODES) - seen - set(NOT_FROM_ONE_FILE)
    assert not missing, f"no file in tests/diagnostics shows {sorted(missing)}"
    assert not seen & set(NOT_FROM_ONE_FILE), "these codes have a file now: take them off the list"


@pytest.mark.parametrize(
    "name", ["small.yaml", "rich.yaml", "town.yaml", "shop.yaml", "rich.yaml?count=2&length=4"]
)
def test_the_files_that_the_mistakes_were_made_in_are_right(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(FOLDER)
    assert check(name).diagnostics == ()


# -- cures -----------------------------------------------------------------------------------------------------

REVEALED = {
    "061_unused_frame": {"W317"},  # warnings are said of files without errors
    "101_shared_grammar": {"S401"},  # the grammar that is meant cannot say what the file needs
    "113_drawn_file_missing": {"S213"},  # the only file with a like name is listed already
    "625_state_with_max": {"S402"},  # the least number of the range, which nobody wrote, cannot be said
    "700_experiment_slips": {"S704"},  # the agent that is meant needs a script
    "703_no_such_checkpoint": {"S704"},
    "883_looks": {"S205"},  # rules are read when what is drawn makes sense
    "905_tests": {"S002"},  # two keys with one slip
}
"""The second mistakes of files that have several, which come to light when a first is cured."""


def kinds(found: Iterable[Diagnostic]) -> Counter[tuple[str, str]]:
    """How often each thing is said."""
    return Counter((one.code, one.message) for one in found)


def as_a_tool_follows(case: str, found: Diagnostic, sources: dict[str, Source]) -> dict[str, str]:
    """The files as they are with a cure: a tool that reads JSON, or SARIF, makes the same of them."""
    files = {edit.span.file for edit in found.edits}
    texts = {
        file: sources[file].edited(edit for edit in found.edits if edit.span.file == file) for file in files
    }
    read = [CheckedInput(case, (found,), sources)]
    (one,) = json.loads(as_json(read))
    ((result,),) = (run["results"] for run in json.loads(as_sarif(read))["runs"])
    (fix,) = result["fixes"]
    by_json, by_sarif = {file: [] for file in files}, {}
    for edit in one["edits"]:
        place = (edit["line"], edit["column"], edit["end_line"], edit["end_column"])
        by_json[edit["file"]].append((*place, edit["text"]))
    for change in fix["artifactChanges"]:
        keys = ("startLine", "startColumn", "endLine", "endColumn")
        by_sarif[unquote(change["artifactLocation"]["uri"])] = [
            (*(each["deletedRegion"][key] for key in keys), each["insertedContent"]["text"])
            for each in change["replacements"]
        ]
    assert by_sarif == by_json
    for file, edits in by_json.items():
        lines = re.split("(?<=\n)|(?<=\r)(?!\n)", sources[file].text)
        starts = [0, *accumulate(map(len, lines))]
        text = sources[file].text
        for line, column, end_line, end_column, new in sorted(edits, reverse=True):
            text = text[: starts[line - 1] + column - 1] + new + text[starts[end_line - 1] + end_column - 1 :]
        assert text == texts[file]
    return texts


@contextmanager
def followed(case: str, found: Diagnostic, sources: dict[str, Source]) -> Iterator[None]:
    """The files, in the working directory, as they are with a cure."""
    files = as_a_tool_follows(case, found, sources)
    for file, text in files.items():
        Path(file).write_text(text, encoding="utf-8", newline="")
    yield
    for file in files:
        Path(file).write_text(sources[file].text, encoding="utf-8", newline="")


@pytest.mark.parametrize("case", one_in(2, CASES, "checks a file again for each of its cures"))
def test_a_cure_works(case: str, whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every change of files that a finding proposes is made: the finding is gone, and no other has come."""
    monkeypatch.chdir(whole)
    before = checked(case)
    for found in before.diagnostics:
        if not found.edits:
            continue
        with followed(case, found, before.sources):
            left = check(f"{case}.yaml").diagnostics
        said = (str(found), found.cure, [str(one) for one in left])
        assert (
            kinds(left)[found.code, found.message] < kinds(before.diagnostics)[found.code, found.message]
        ), said
        new = {one.code for one in left if (one.code, one.message) not in kinds(before.diagnostics)}
        assert new <= REVEALED.get(case, set()), said


DECLARES = """\
scenario: declares
grammar: {templates: [Hi]}
room: {size: 6}
STATE
cast: {agent: {}}
rules: [{when: t == 3, set: {a: 1, z: 1}}]
outcome: [{success: agent.said("Hi") and a + z != 9}]
"""


@pytest.mark.parametrize("state", ["state: {a: 0, z: 0}", "state:\n  a: 0\n  z: 0  # last"])
@pytest.mark.parametrize(
    "above",
    [
        "variant: above\nof: declares.yaml\nset: {state.b: 1, rules: RULES}",
        "variant: above\nof: declares.yaml\nset:\n  state.b: 1\n  state.z: 2\n  rules: RULES",
        "variant: above\nof: declares.yaml\nset: {state.a: 2, state.z: 2, state.b: 1, rules: RULES}",
        "variant: above\nof: declares.yaml\nset:\n  state: {b: 0, z: 0, a: 0}\n  rules: RULES",
        "variant: above\nof: declares.yaml\nadd: {state: {b: 1}, rules: RULES}",
        "scenario: above\nextends: declares.yaml\nstate: {a: 2, b: 1}\nrules: RULES",
        "scenario: above\nextends: declares.yaml\nstate:\n  b: 1\n  a: 2\nrules: RULES",
    ],
)
def test_a_cure_changes_what_is_written_in_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, state: str, above: str
) -> None:
    """Parts of a section may come from a patch or a base: what is added to it stands among those of its own file."""
    monkeypatch.chdir(tmp_path)
    rules = "[{when: t == 4, set: {a: 1, b: 1, c: 1}}]"
    Path("declares.yaml").write_text(DECLARES.replace("STATE", state), encoding="utf-8")
    Path("above.yaml").write_text(above.replace("RULES", rules) + "\n", encoding="utf-8")
    before = check("above.yaml")
    (found,) = (one for one in before.diagnostics if one.code == "S305")
    if not found.edits:
        assert above.count("state.") == 3, "but for a section of which all is patched"
        return
    with followed("above", found, before.sources):
        assert [str(one) for one in check("above.yaml").diagnostics if one.code != "W317"] == []


# -- the pages -----------------------------------------------------------------------------------------------------

PAGES = Path(__file__).parents[2] / "docs" / "diagnostics"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"# ([\w/]+\.yaml)\n")


def shown(page: str, part: str, folder: Path) -> CheckResult:
    """What is found in the files, or the name, that a part of a page shows."""
    shutil.copy(PAGES / "start.yaml", folder)
    (folder / "example.yaml").write_text("scenario: example\nextends: start.yaml\n", encoding="utf-8")
    name = "example.yaml"
    for language, text in BLOCK.findall(part):
        if language == "yaml":
            named = NAMED.match(text)
            (folder / (named[1] if named else name)).write_text(text, encoding="utf-8")
        elif language == "console":
            program, command, *options, name = shlex.split(text.removeprefix("$ "))
            assert program == "socialai", page
            if command == "test":
                return with_tests_played(name)
            assert command == "validate", page
            assert options in ([], ["--deep"]), page
            if options:
                return tried_out(name)
    return check(name)


def with_tests_played(name: str) -> CheckResult:
    """What is found in a file, and what playing its tests shows."""
    found = [finding for one in play_tests([name]) for finding in one.outcome.diagnostics]
    return replace(check(name), diagnostics=tuple(found))


def tried_out(name: str) -> CheckResult:
    """What is found in a file, and what trying it out in a few rooms shows."""
    result = check(name)
    found = [
        finding
        for case in scenarios_of(name)
        for finding in check_scenario(case.loaded, case.called, Effort(4, 0, 2000), deep=True).findings()
    ]
    return replace(result, diagnostics=(*result.diagnostics, *found))


def parts(code: str) -> tuple[str, str, str]:
    """A page in three: what stands before the examples, the wrong one and the right one."""
    head, wrong, right = re.split(
        r"^## (?:Wrong|Right)\n", (PAGES / f"{code}.md").read_text("utf-8"), flags=re.MULTILINE
    )
    return head, wrong, right


@pytest.mark.parametrize("code", CODES)
def test_a_page_shows_its_finding_and_how_it_goes(
    code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, update_goldens: bool
) -> None:
    """Its wrong example gives that finding alone, in the words of the page; its right one gives none."""
    monkeypatch.chdir(tmp_path)
    head, wrong, right = parts(code)
    assert head.startswith(f"# {code}: {CODES[code]}\n")
    result = shown(code, wrong, tmp_path)
    assert [d.code for d in result.diagnostics] == [code], [str(d) for d in result.diagnostics]
    said = render_text(result.diagnostics, result.sources) + "\n"
    page = PAGES / f"{code}.md"
    if update_goldens:
        text = page.read_text(encoding="utf-8")
        page.write_text(
            re.sub(r"(?s)```text\n.*?```", lambda _: f"```text\n{said}```", text, count=1), "utf-8"
        )
    assert f"```text\n{said}```" in parts(code)[1], "if the new text is meant, run pytest --update-goldens"
    for file in tmp_path.iterdir():
        shutil.rmtree(file) if file.is_dir() else file.unlink()
    assert [str(d) for d in shown(code, right, tmp_path).diagnostics] == []


def test_every_code_has_its_page_and_its_line_in_the_index() -> None:
    """In the order of the catalogue."""
    assert {path.stem for path in PAGES.glob("[SW]*.md")} == set(CODES)
    index = (PAGES / "index.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| \[([SW]\d+)\]\(\1\.md\) \| (.+) \|$", index, re.MULTILINE) == list(CODES.items())


def test_the_page_of_an_unknown_kind_names_all_kinds_of_files() -> None:
    head = parts("S108")[0]
    assert [kind for kind in FILES if f"`{kind}`" not in head] == []
