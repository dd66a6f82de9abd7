"""`socialai validate`: what is checked, and how it ends."""

import io
import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from socialai_dsl.cli.main import main

Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> Path:
    """A folder with one sound scenario and one with a misspelt key."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "sound"]) == 0
    text = Path("sound.yaml").read_text(encoding="utf-8")
    Path("broken.yaml").write_text(text.replace("horizon: 40 ", "horizn: 40 "), encoding="utf-8")
    capsys.readouterr()
    return tmp_path


def test_a_sound_file(capsys: Capture) -> None:
    assert main(["validate", "sound.yaml"]) == 0
    assert capsys.readouterr().out == "1 file checked: 0 errors, 0 warnings\n"


def test_a_mistake_is_shown_with_its_line(capsys: Capture) -> None:
    assert main(["validate", "broken.yaml"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("broken.yaml:4:1: S101 ")
    assert "did you mean `horizon`?" in lines[0]
    assert lines[2].strip() == "^~~~~~"


def test_a_folder_is_searched_and_json_is_pure(capsys: Capture) -> None:
    assert main(["validate", ".", "--json"]) == 1
    (finding,) = json.loads(capsys.readouterr().out)
    assert (finding["file"], finding["line"], finding["severity"]) == ("broken.yaml", 4, "error")


def test_files_given_twice_are_checked_once(capsys: Capture) -> None:
    assert main(["validate", "sound.yaml", "sound.yaml", "."]) == 1
    assert capsys.readouterr().out.splitlines()[-2] == "4 files checked: 1 error, 0 warnings"


@pytest.mark.parametrize("name", ["nowhere.yaml", "no_such_scenario", "sound.yaml+nothing"])
def test_what_cannot_be_found_is_wrong_usage(name: str, capsys: Capture) -> None:
    assert main(["validate", name]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err != ""


def test_an_empty_folder_is_wrong_usage(tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "empty").mkdir()
    assert main(["validate", "empty"]) == 2
    assert "expected scenario files" in capsys.readouterr().err


def test_a_file_that_names_another_that_is_missing_has_a_finding(capsys: Capture) -> None:
    Path("heir.yaml").write_text("scenario: heir\nextends: nowhere.yaml\n", encoding="utf-8")
    assert main(["validate", "heir.yaml"]) == 1
    assert capsys.readouterr().out.startswith("heir.yaml:2:")


def test_a_comment_that_only_another_file_needs_is_not_idle(capsys: Capture) -> None:
    text = Path("sound.yaml").read_text(encoding="utf-8")
    text = text.replace("waiting:\n        do", "waiting:   # socialai: ignore=W306\n        do")
    Path("sound.yaml").write_text(text, encoding="utf-8")
    Path("sound_late.yaml").write_text(
        "variant: sound_late\nof: sound.yaml\nset: {frames.show_the_way.start: late}\n"
        "add: {frames.show_the_way.states: {late: {then: [{when: t > 3, goto: content}]}}}\n"
    )
    assert main(["validate", "--strict", "sound.yaml"]) == 1
    assert " W008 " in capsys.readouterr().out
    assert main(["validate", "--strict", "sound.yaml", "sound_late.yaml"]) == 0, capsys.readouterr().out


# -- how much is reported -----------------------------------------------------------------------------------------


@pytest.fixture
def many_mistakes() -> None:
    text = Path("sound.yaml").read_text(encoding="utf-8")
    for name in ("one", "two"):
        wrong = text.replace("horizon: 40", "horizn: 40").replace("room:", "rooom:")
        Path(f"{name}.yaml").write_text(wrong.replace("frames:", "framess:"), encoding="utf-8")


def test_at_most_so_many_errors(many_mistakes: None, capsys: Capture) -> None:
    command = ["validate", "one.yaml", "two.yaml", "--max-errors", "4"]
    assert main(command) == 1
    *findings, summary = [
        line for line in capsys.readouterr().out.splitlines() if ".yaml:" in line or "check" in line
    ]
    assert [finding.split(":")[0] for finding in findings] == ["one.yaml"] * 3 + ["two.yaml"]
    assert summary == "2 files checked: 4 errors shown, more left out, 0 warnings"
    assert main([*command, "--json"]) == 1
    assert len(json.loads(capsys.readouterr().out)) == 4


def test_a_file_whose_errors_are_left_out_still_fails(many_mistakes: None, capsys: Capture) -> None:
    assert main(["validate", "one.yaml", "two.yaml", "--max-errors", "1", "--format", "junit"]) == 1
    suite = ElementTree.fromstring(capsys.readouterr().out)
    assert [case.find("failure").get("message") for case in suite] == ["3 errors", "3 errors"]  # type: ignore[union-attr]


def test_fewer_errors_than_asked_for(capsys: Capture) -> None:
    assert main(["validate", "broken.yaml", "--max-errors", "1"]) == 1
    assert capsys.readouterr().out.splitlines()[-2] == "1 file checked: 1 error, 0 warnings"
    assert main(["validate", "broken.yaml", "--max-errors", "0"]) == 2
    assert "--max-errors: got 0, expected at least 1" in capsys.readouterr().err


# -- parameters ----------------------------------------------------------------------------------------------------

CHOOSING = """\
scenario: choosing
horizon: 9
params:
  n: {default: 2, values: [1, 2, 40]}
  asks: {default: true, values: [true, false]}
  where: {default: top, values: {top: wall(top), left: wal(left), drawn: wall(pick(top | left))}}
grammar: {templates: [Say <noun>], nouns: [hello]}
room: {size: 6}
objects:
  boxes: {type: box, count: $n}
  door: {type: door, place: $where}
cast: {agent: {place: anywhere}}
outcome: [{success: agent.did(done) and $asks}]
"""


def test_every_value_of_a_parameter_is_checked_alone(capsys: Capture) -> None:
    Path("choosing.yaml").write_text(CHOOSING)
    assert main(["validate", "choosing.yaml", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert [(d["line"], d["code"], d["hint"]) for d in found] == [
        (10, "S106", "with `choosing?n=40`"),
        (11, "S205", "with `choosing?where=left`"),
    ]
    assert main(["validate", "choosing.yaml?n=1&where=drawn"]) == 0
    Path("choosing.yaml").write_text(CHOOSING.replace("horizon", "horizn"))
    assert main(["validate", "choosing.yaml", "--json"]) == 1
    assert [d["code"] for d in json.loads(capsys.readouterr().out.partition("\n")[2] or "[]")] in (
        [],
        ["S101"],
    )


# -- tried out as well ---------------------------------------------------------------------------------------------

CLAIMING = """\
scenario: claiming
horizon: 12
grammar: {templates: [Say <noun>], nouns: [hello]}
room: {size: 4}
objects: {door: {type: door, place: wall(top)}}
cast: {agent: {place: anywhere}}
outcome:
  - success: agent.next_to(door)
  - {failure: agent.next_to(door) and agent.did(done), id: late}
check: [{never: agent.did(toggle)}]
"""


def test_deep_tries_what_has_no_errors_out(capsys: Capture) -> None:
    Path("claiming.yaml").write_text(CLAIMING)
    assert main(["validate", "--deep", "claiming.yaml", "broken.yaml", "--rooms", "3", "--json"]) == 1
    found = {(d["file"], d["code"], d["line"]) for d in json.loads(capsys.readouterr().out)}
    assert found >= {("claiming.yaml", "S801", 10), ("claiming.yaml", "W802", 9)}
    assert {file for file, *_ in found} == {"claiming.yaml", "broken.yaml"}
    Path("claiming.yaml").write_text(CLAIMING.partition("  - {failure")[0])
    assert main(["validate", "--deep", "--strict", "claiming.yaml", "--rooms", "3"]) == 0
    said = capsys.readouterr().out
    assert "claiming.yaml: 3 rooms of seed 0" in said
    assert "a success can be reached in 3 of 3 rooms" in said
    assert "1 file checked: 0 errors, 0 warnings" in said


# -- standard input -----------------------------------------------------------------------------------------------


def piped(monkeypatch: pytest.MonkeyPatch, content: bytes) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(content)))


def test_standard_input(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    piped(monkeypatch, Path("sound.yaml").read_bytes())
    assert main(["validate", "-"]) == 0
    assert capsys.readouterr().out == "1 file checked: 0 errors, 0 warnings\n"
    piped(monkeypatch, Path("broken.yaml").read_bytes())
    assert main(["validate", "-"]) == 1
    assert capsys.readouterr().out.startswith("stdin.yaml:4:1: S101 ")


def test_standard_input_stands_for_a_file(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    """The text that is piped counts, not the one on the disk; files that it names are found beside it."""
    (folder / "sub").mkdir()
    (folder / "sub" / "base.yaml").write_text(
        Path("sound.yaml").read_text(encoding="utf-8").replace("scenario: sound", "scenario: base")
    )
    (folder / "sub" / "heir.yaml").write_text("nonsense: [")
    piped(monkeypatch, b"scenario: heir\nextends: base.yaml\nhorizon: 41\n")
    assert main(["validate", "-", "--stdin-filename", "sub/heir.yaml"]) == 0, capsys.readouterr().out
    piped(monkeypatch, b"scenario: heir\nextends: base.yaml\nhorizon: forty\n")
    assert main(["validate", "-", "--stdin-filename", "sub/heir.yaml"]) == 1
    assert "sub/heir.yaml:3:10: S104" in capsys.readouterr().out
    assert (folder / "sub" / "heir.yaml").read_text() == "nonsense: ["


@pytest.mark.parametrize("on_disk", [None, "nonsense: ["])
def test_deep_tries_the_text_of_standard_input(
    on_disk: str | None, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    if on_disk is not None:
        Path("claiming.yaml").write_text(on_disk)
    piped(monkeypatch, CLAIMING.encode())
    command = ["validate", "--deep", "-", "--rooms", "3", "--stdin-filename", "claiming.yaml", "--json"]
    assert main(command) == 1
    found = {(d["file"], d["code"], d["line"]) for d in json.loads(capsys.readouterr().out)}
    assert found >= {("claiming.yaml", "S801", 10), ("claiming.yaml", "W802", 9)}


@pytest.mark.parametrize(
    ("content", "code"), [(b"\xff\xfes\0", "S006"), (b"", "S108"), (b"x" * (1 << 21), "S004")]
)
def test_standard_input_that_is_no_scenario(
    content: bytes, code: str, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    piped(monkeypatch, content)
    assert main(["validate", "-"]) == 1
    assert f"stdin.yaml:1:1: {code} " in capsys.readouterr().out


# -- what is printed where ----------------------------------------------------------------------------------------


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("variables", "colored"),
    [({}, True), ({"NO_COLOR": "1"}, False), ({"NO_COLOR": ""}, True), ({"TERM": "dumb"}, False)],
)
def test_color_only_on_a_terminal(
    variables: dict[str, str], colored: bool, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    for name in ("NO_COLOR", "TERM"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert main(["validate", "broken.yaml"]) == 1
    assert "\x1b" not in capsys.readouterr().out
    terminal = _Terminal()
    monkeypatch.setattr("sys.stdout", terminal)
    assert main(["validate", "broken.yaml"]) == 1
    assert ("\x1b[" in terminal.getvalue()) is colored


@pytest.mark.parametrize("style", ["json", "github", "sarif", "junit"])
def test_machine_formats_keep_stdout_pure(
    style: str, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Control characters of an author's text neither reach the log nor break the format, also on a terminal."""
    text = Path("broken.yaml").read_text(encoding="utf-8")
    text = text.replace("horizn", r'"hori\e[31m\x9b\u202e%0A::zn"').replace("frames:", r'"fr\u00a0\tames":')
    Path("hostile.yaml").write_text(text, encoding="utf-8")
    terminal = _Terminal()
    monkeypatch.setattr("sys.stdout", terminal)
    asked = ["--json"] if style == "json" else ["--format", style]
    assert main(["validate", "hostile.yaml", *asked]) == 1
    captured = terminal.getvalue()
    assert captured.replace("\n", "").isprintable()
    if style in ("json", "sarif"):
        json.loads(captured)
    elif style == "junit":
        ElementTree.fromstring(captured)
    else:
        assert all(line.startswith("::error file=hostile.yaml,") for line in captured.splitlines())
