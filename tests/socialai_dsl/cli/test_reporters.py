"""What each format of `socialai validate` prints."""

import json
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from socialai_dsl.checking.formats import CheckedInput, every_finding, limited
from socialai_dsl.cli.validate import REPORTS
from socialai_dsl.diagnostics import Diagnostic, Severity
from socialai_dsl.source import Source, Span

SOURCE = Source("a.yaml", "scenario: a\nhorizn: 3\n")
ERROR = Diagnostic("S101", "unknown key `horizn`", Span("a.yaml", 2, 1, 6), suggestion="horizon")
WARNING = Diagnostic("W306", "50% <odd> & more", Span("b,c:d.yaml", 4, 7), Severity.WARNING, hint="remove it")
CHECKED = [
    CheckedInput("a.yaml", (ERROR,), {"a.yaml": SOURCE}),
    CheckedInput("b.yaml", (ERROR, WARNING), {"a.yaml": SOURCE}),
    CheckedInput("c.yaml", (), {}),
]


def report(name: str) -> str:
    return REPORTS[name](CHECKED)


def test_text_points_at_the_line_and_counts_shared_findings_once() -> None:
    assert report("text").splitlines() == [
        "a.yaml:2:1: S101 unknown key `horizn`; did you mean `horizon`?",
        "   2 | horizn: 3",
        "       ^~~~~~",
        "b,c:d.yaml:4:7: W306 50% <odd> & more",
        "  help: remove it",
        "3 files checked: 1 error, 1 warning",
        "`socialai explain S101` says more about S101",
    ]


def test_a_mistake_is_said_once_of_a_file_and_its_variants() -> None:
    of_variant = replace(ERROR, hint="in `a+v`, patched by a_v.yaml")
    inputs = [
        CheckedInput(name, (one,), {"a.yaml": SOURCE}) for name, one in (("a_v", of_variant), ("a", ERROR))
    ]
    for order in (inputs, inputs[::-1]):
        assert every_finding(order) == [ERROR], "as the file itself says it"
        assert [c.errors for c in limited(order, 0)] == [1, 1]
        assert every_finding(limited(order, 0)) == []
    assert every_finding(inputs[:1]) == [of_variant]
    twice = CheckedInput("a", (ERROR, of_variant), {"a.yaml": SOURCE})
    assert every_finding([twice]) == [ERROR, of_variant], "what one input says twice differs"


def test_json_is_an_array_of_findings() -> None:
    first, second = json.loads(report("json"))
    assert first == {
        "file": "a.yaml",
        "line": 2,
        "column": 1,
        "severity": "error",
        "code": "S101",
        "message": "unknown key `horizn`; did you mean `horizon`?",
        "hint": None,
        "edits": [
            {"file": "a.yaml", "line": 2, "column": 1, "end_line": 2, "end_column": 7, "text": "horizon"}
        ],
    }
    assert (second["severity"], second["hint"], second["edits"]) == ("warning", "remove it", [])


def test_github_annotations_are_escaped() -> None:
    assert report("github").splitlines() == [
        "::error file=a.yaml,line=2,col=1,endColumn=7,title=S101::unknown key `horizn`; did you mean `horizon`?",
        "::warning file=b%2Cc%3Ad.yaml,line=4,col=7,endColumn=8,title=W306::50%25 <odd> & more%0Aremove it",
    ]


def test_sarif_has_rules_and_regions() -> None:
    (run,) = json.loads(report("sarif"))["runs"]
    assert [rule["id"] for rule in run["tool"]["driver"]["rules"]] == ["S101", "W306"]
    first, second = run["results"]
    region = first["locations"][0]["physicalLocation"]["region"]
    assert region == {"startLine": 2, "startColumn": 1, "endColumn": 7}
    assert second["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == "b%2Cc%3Ad.yaml"


def test_sarif_has_the_changes_that_cure_a_finding() -> None:
    (run,) = json.loads(report("sarif"))["runs"]
    (fix,), *others = (result.get("fixes") for result in run["results"])
    assert others == [None], "there is advice alone"
    (change,) = fix["artifactChanges"]
    (replacement,) = change["replacements"]
    assert fix["description"] == {"text": "write `horizon`"}
    assert change["artifactLocation"] == {"uri": "a.yaml"}
    region = {"startLine": 2, "startColumn": 1, "endLine": 2, "endColumn": 7}
    assert replacement == {"deletedRegion": region, "insertedContent": {"text": "horizon"}}


def test_junit_has_a_case_for_each_file() -> None:
    suite = ElementTree.fromstring(report("junit"))
    assert (suite.get("tests"), suite.get("failures")) == ("3", "2")
    assert [case.find("failure") is not None for case in suite] == [True, True, False]


@pytest.mark.parametrize("name", sorted(REPORTS))
def test_nothing_found(name: str) -> None:
    text = REPORTS[name]([CheckedInput("c.yaml", (), {})])
    expected = {"text": "1 file checked: 0 errors, 0 warnings", "json": "[]", "github": ""}
    if name in expected:
        assert text == expected[name]
    else:
        assert "S101" not in text
