"""The cases of the YAML test suite: read as the suite says, or refused with a finding for a reason that is listed.

Cases that fail in the suite are refused but for `LENIENT`; the others have the values of the suite but for `DIFFERENT`,
or are refused: for words, tags and the like by their code, and for what stands in `REFUSED`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.diagnostics import Diagnostic, ScenarioError, render_text
from socialai_dsl.loader.reader import decoded, read_document

FOLDER = Path(__file__).parents[2] / "data" / "yaml_test_suite"
CASES: dict[str, dict[str, Any]] = {
    case["id"]: case for case in json.loads((FOLDER / "cases.json").read_text(encoding="utf-8"))
}

ON_PURPOSE = {
    "S003": "a word that YAML 1.1 and 1.2 read differently",
    "S005": "anchors, aliases, tags and directives are no part of the language",
    "S006": "control characters, also as escapes",
}
"""Codes that say by themselves why a case is refused."""

REFUSED = {
    "a file is one document": "6XDY 6ZKB 7Z25 9DXL JHB9 KSS4 L383 M7A3 PUW8",
    "a key is a word, not a list or a mapping": "4FJ6 6PBE 9MMW KK5P LX3P M2N8/0 M2N8/1 M5DY Q9WF RZP5 SBG9 V9D5 XW4D",
    "a key is not empty": "2JQS CFD4 DFF7 FRK4 NHX8 NKF9 S3PD SM9W/1 UKK6/0",
    "a line that begins with `%`": "2LFX 6LVF BEC7 MUS6/5 MUS6/6",
    "libyaml: in braces a key and its colon are on one line": (
        "4MUZ/0 4MUZ/1 4MUZ/2 5MUD 9SA2 K3WX NJ66 UT92 VJP3/1"
    ),
    "libyaml: no colon at the beginning or end of a plain text in braces": "4ABK 58MP 5T43 DBG4 HM87/0",
    "libyaml: no tab where a line's indentation ends": (
        "6BCT 6CA3 96NN/0 96NN/1 A2M4 DK95/0 DK95/3 DK95/4 Q5MG R4YG Y79Y/1 Y79Y/10"
    ),
    "libyaml: a text below `---` is indented": "DK3J FP8R",
    "libyaml: an end without a document": "HWV9 QT73",
    "libyaml: anchors have plain names (which may not be used anyway)": "8XYN W5VH",
    "in braces a key does not begin with `?`, which libyaml and YAML 1.2 read differently": "652Z HM87/1",
}
"""Why -> right YAML that is refused."""

LENIENT = {
    "lines of a list or text in braces or quotes need no indentation": "9C9N QB6E",
    "a comment needs no space before it": "9JBA CVW2 SU5Z X4QW",
    "a tab in indentation that nothing depends on": "DK95/1 Y79Y/3",
    "empty lines of a block that are longer than its first": "S98Z",
    "a lone dash in a list in brackets is a text": "G5U8 YJV2",
}
"""Why -> what is no YAML by the suite, and is read by libyaml."""

DIFFERENT = {
    "a block that ends with the file and without a line break": "JEF9/2 L24T/1",
    "the suite gives no value for a case that is right": "2G84/3",
}
"""Why -> what is read with another value, or cannot be compared."""


def listed(reasons: dict[str, str]) -> set[str]:
    return {name for names in reasons.values() for name in names.split()}


def outcome(case: dict[str, Any]) -> tuple[str, Any]:
    """`accepted` and the values of the documents, or `refused` and the error."""
    try:
        read = read_document(decoded(case["yaml"].encode("utf-8"), "case.yaml"))
    except ScenarioError as error:
        return "refused", error
    return "accepted", [] if read.data is None and case.get("json") == [] else [read.data]


def expected(case: dict[str, Any], found: tuple[Diagnostic, ...]) -> str:
    """`accepted`, `refused`, or `different` where the value is not the suite's."""
    name = case["id"]
    if name in listed(LENIENT) or name in listed(DIFFERENT):
        return "different"
    if case.get("fails") or name in listed(REFUSED) or any(one.code in ON_PURPOSE for one in found):
        return "refused"
    return "accepted"


@pytest.mark.parametrize("name", CASES)
def test_a_case_is_read_as_the_suite_says_or_refused_with_a_reason(name: str) -> None:
    case = CASES[name]
    verdict, found = outcome(case)
    wanted = expected(case, found.diagnostics if verdict == "refused" else ())
    if verdict == "refused":
        assert render_text(found.diagnostics, found.sources).replace("\n", "").isprintable()
        found = found.diagnostics
        assert wanted == "refused", [str(one) for one in found]
        lines = case["yaml"].splitlines() or [""]
        assert all(1 <= one.span.line <= len(lines) + 1 and one.message for one in found)
    elif wanted == "different":
        assert json.dumps(found) != json.dumps(case.get("json"))
    else:
        assert wanted == "accepted"
        assert json.dumps(found, sort_keys=True) == json.dumps(case["json"], sort_keys=True)


def test_the_lists_name_cases_once() -> None:
    lists = [
        name for part in (REFUSED, LENIENT, DIFFERENT) for names in part.values() for name in names.split()
    ]
    assert len(set(lists)) == len(lists)
    assert set(lists) <= CASES.keys()
    assert not [name for name in listed(REFUSED) if CASES[name].get("fails")]
    assert all(CASES[name].get("fails") for name in listed(LENIENT))


def test_what_comes_of_the_cases_is_counted() -> None:
    """The figures of docs/reliability.md."""
    verdicts = {name: outcome(case) for name, case in CASES.items()}
    accepted = {name for name, (verdict, _) in verdicts.items() if verdict == "accepted"}
    wrong = {name for name, case in CASES.items() if case.get("fails")}
    right = accepted - listed(LENIENT) - listed(DIFFERENT)
    assert (len(CASES), len(right), len(wrong - accepted), len(wrong & accepted)) == (402, 167, 83, 11)
    assert len(CASES.keys() - wrong - accepted) == 138
