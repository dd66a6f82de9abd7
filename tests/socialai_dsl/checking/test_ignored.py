"""Comments silence the warnings they name, on their line, and are not to be idle."""

from pathlib import Path

import pytest

import socialai_dsl as sd
from socialai_dsl import frontend
from socialai_dsl.analysis.coverage import Coverage
from socialai_dsl.analysis.scenario_report import ScenarioReport
from socialai_dsl.analysis.tally import Part
from socialai_dsl.diagnostics import CODES, Diagnostic, Severity
from socialai_dsl.source import Source, Span

SCENARIO = """\
scenario: a
horizon: 50
grammar: {{templates: [Open <noun>], nouns: [sesame]}}
room: {{size: 6}}
objects:
  exit: {{type: door, place: wall(top)}}
frames:
  courtesy:
    states:
      stranger: {{do: face(agent)}}
      gone: {{do: wander}}   {comment}
cast:
  honest: {{frame: courtesy}}
  agent: {{}}
outcome: [{{success: agent.at(exit)}}]
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def codes(name: str) -> list[str]:
    return [d.code for d in frontend.check(name).diagnostics]


@pytest.mark.parametrize(
    ("comment", "expected"),
    [
        ("", ["W306"]),
        ("# socialai: ignore=W306", []),
        ("#socialai:ignore = W306 for a variant, which enters it", []),
        ("# socialai: ignore=W306,W311", ["W008"]),
        ("# socialai: ignore=W311", ["W306", "W008"]),
        ("# socialai: ignore=S101", ["W306", "W008"]),
        ("# socialai: ignore=W008", ["W306", "W008"]),
        ("# socialai: ignore", ["W306", "W008"]),
        ("# see also: socialai: ignore=W306", ["W306"]),
    ],
)
def test_a_comment(comment: str, expected: list[str]) -> None:
    Path("a.yaml").write_text(SCENARIO.format(comment=comment), encoding="utf-8")
    assert codes("a.yaml") == expected
    loaded = sd.load("a.yaml")
    assert [d.code for d in loaded.warnings] == expected


def test_errors_are_never_ignored_and_warnings_not_known_are_not_judged() -> None:
    text = SCENARIO.format(comment="# socialai: ignore=W306").replace("horizon: 50", "horizn: 50")
    Path("a.yaml").write_text(text.replace("50", "50 # socialai: ignore=S101"), encoding="utf-8")
    assert codes("a.yaml") == ["S101", "W008"]


def test_in_a_file_that_others_build_on() -> None:
    Path("a.yaml").write_text(SCENARIO.format(comment="# socialai: ignore=W306"), encoding="utf-8")
    Path("a_lost.yaml").write_text(
        "variant: a_lost\nof: a.yaml\nadd:\n  frames.courtesy.states:\n"
        "    lost: {do: stay}  # socialai: ignore=W306\n"
    )
    assert codes("a_lost.yaml") == []
    assert codes("a.yaml+lost") == []
    Path("base.yaml").write_text(
        SCENARIO.format(comment="# socialai: ignore=W306").replace("horizon", "abstract: true\nhorizon")
    )
    assert codes("base.yaml") == [], "an abstract file has no warnings of its own"
    Path("heir.yaml").write_text("scenario: heir\nextends: base.yaml\n")
    assert codes("heir.yaml") == []


def test_in_a_suite() -> None:
    Path("a.yaml").write_text(SCENARIO.format(comment="# socialai: ignore=W306"), encoding="utf-8")
    Path("all.yaml").write_text("suite: all\nmembers: [a.yaml]   # socialai: ignore=W311\n")
    assert codes("all.yaml") == ["W008"]


@pytest.mark.parametrize("severity", Severity)
@pytest.mark.parametrize("code", CODES)
def test_a_comment_ignores_whatever_is_a_warning(code: str, severity: Severity) -> None:
    """Its severity decides, not its code; W008 alone, which is about such comments, is beyond them."""
    source = Source("a.yaml", f"horizon: 50 # socialai: ignore={code}\n")
    finding = Diagnostic(code, "m", source.span(1, 1), severity)
    kept = frontend.sift([finding], {"a.yaml": source}, "a.yaml").kept
    if severity is Severity.WARNING and code != "W008":
        assert kept == ()
    else:
        assert [d.code for d in kept if d != finding] == ["W008"]
        assert finding in kept


def test_a_warning_with_the_code_of_an_error() -> None:
    """A place that the agent may take is a warning, S601."""
    text = SCENARIO.format(comment="# socialai: ignore=W306").replace("size: 6", "size: 3")
    text = text.replace("exit: {", "ball: {type: ball, place: anywhere}\n  exit: {", 1)
    Path("a.yaml").write_text(text, encoding="utf-8")
    (found,) = frontend.check("a.yaml").diagnostics
    assert (found.code, found.severity) == ("S601", Severity.WARNING)
    lines = text.splitlines()
    lines[found.span.line - 1] += " # socialai: ignore=S601"
    Path("a.yaml").write_text("\n".join(lines), encoding="utf-8")
    assert codes("a.yaml") == []


@pytest.mark.parametrize(
    ("comment", "fails"), [("", True), ("# socialai: ignore=W802 no door so far", False)]
)
def test_what_trying_out_shows(comment: str, fails: bool) -> None:
    """The comment is not idle where nothing was tried out."""
    Path("a.yaml").write_text(SCENARIO.format(comment=comment + "\n"), encoding="utf-8")
    checked = frontend.check("a.yaml")
    assert [d.code for d in checked.diagnostics] == ["W306"]
    state = Part(Span("a.yaml", 11, 7), "state", "courtesy.gone", "honest.courtesy.gone")
    report = ScenarioReport("a", 2, 0, coverage=Coverage(4, (state,), True), sources=checked.sources)
    assert report.fails(strict=True) is fails
    assert [d.code for d in report.findings()] == ["W802"] * fails
    assert any("warning" in line for line in report.lines()) is fails
