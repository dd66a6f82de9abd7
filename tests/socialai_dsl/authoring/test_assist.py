"""What can be written at a place, also while the file is no YAML; what a word means."""

from dataclasses import replace
from pathlib import Path

import pytest

from socialai_dsl.authoring.assist import complete, declaration, explain, usage
from socialai_dsl.loader.reader import read_document
from socialai_dsl.semantics.words import SIGNATURES
from socialai_dsl.source import Source
from tests.socialai_dsl.authoring.marked import marked

TEXT = """\
scenario: a
grammar: {templates: [Where is <noun>], nouns: [the exit]}
objects:
  exit: {type: door, place: wall(top)}
let:
  shade: exit.color
frames:
  duty:
    states:
      waiting:
        do: face(agent)
        then: [{hears: Where is the exit, say: There., goto: content}]
      content: {}
cast:
  ann: {frame: duty}
  agent: {}
outcome:
  - success: agent.at(exit)
"""


def offered(text: str, folder: Path | None = None) -> list[str]:
    plain, line, column = marked(text)
    whole = read_document(Source("", TEXT)).data
    return [offer.text for offer in complete(plain, whole, folder, line, column)]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("  - success: agent.at(exit)", "  - ^", "failure"),
        ("  - success: agent.at(exit)", "  - success: agent.did(don^", None),
        ("  - success: agent.at(exit)", "  - success: ag^", "agent"),
        ("success: agent.at(exit)", "success: agent.at(exit) and ann.^", "sees"),
        ("do: face(agent)", "do: fa^", "face"),
        ("do: face(agent)", "do: face(^", "agent"),
        ("do: face(agent)", "d^", "do"),
        ("goto: content}]", "^", "goto_now"),
        ("goto: content}]", "goto: c^", "content"),
        ("say: There.", "say: The <^", "shade"),
        ("say: There.", "say: The <exit.c^", "color"),
        ("hears: Where is the exit", "hears: ^", "Where is the exit"),
        ("type: door", "type: sw^", "switch"),
        ("frame: duty", "frame: ^", "duty"),
        ("ann: {frame: duty}", "ann: {frame: duty, co^}", "count"),
        ("agent: {}", "agent: {pl^}", "place"),
        ("place: wall(top)", "place: le^", "left_half"),
        ("grammar: {", "hor^\ngrammar: {", "horizon"),
        ("outcome:", "observe: {npcs: ^}\noutcome:", "hidden"),
        ("outcome:", "actions: [t^]\noutcome:", "toggle"),
        ("outcome:", "prob^\noutcome:", "probes"),
        ("outcome:", "instr^\noutcome:", "instructions"),
        ("outcome:", "probes: {q: {an^}}\noutcome:", "answers"),
        ("outcome:", "probes: {q: {when: ann.^}}\noutcome:", "is"),
        ("outcome:", "probes: {q: {answer: exit.c^}}\noutcome:", "color"),
        ("outcome:", "probes: {q: {ask: Which <^}}\noutcome:", "shade"),
        ("outcome:", "probes: {q: {answers: [the <exit.c^]}}\noutcome:", "color"),
        ("outcome:", "tests: {q: {play: [{do: W^}]}}\noutcome:", "Where is the exit"),
        ("outcome:", "tests: {q: {play: [{do: [left, f^]}]}}\noutcome:", "forward"),
        ("outcome:", "tests: {q: {play: [{hea^}]}}\noutcome:", "hears"),
        ("outcome:", "tests: {q: {play: [{state: {a^}}]}}\noutcome:", "ann"),
        ("outcome:", "tests: {q: {play: [{state: {ann: w^}}]}}\noutcome:", "waiting"),
        ("outcome:", "tests: {q: {play: [{true: ann.^}]}}\noutcome:", "is"),
        ("outcome:", "tests: {q: {play: [{not: [ag^]}]}}\noutcome:", "agent"),
        ("outcome:", 'tests: {q: {play: [{hears: "Ann: The <^"}]}}\noutcome:', "shade"),
        ("outcome:", "tests: {q: {ends: t^}}\noutcome:", "timeout"),
        ("outcome:", "tests: {q: {ro^}}\noutcome:", "room"),
    ],
)
def test_completion(old: str, new: str, expected: str | None) -> None:
    assert old in TEXT
    found = offered(TEXT.replace(old, new, 1))
    if expected is not None:
        assert expected in found


@pytest.mark.parametrize(
    ("typed", "expected"), [("std: 0.1, ", "n"), ("dev", "deviation"), ("deviation: po", "population")]
)
def test_completion_in_a_reference_of_an_experiment(typed: str, expected: str) -> None:
    text = "experiment: e\nconditions:\n  - {name: one, scenario: help, reference: {mean: 0.5"
    whole = read_document(Source("", text + "}}\n")).data
    plain, line, column = marked(f"{text}, {typed}^}}}}\n")
    assert expected in [offer.text for offer in complete(plain, whole, None, line, column)]


@pytest.mark.parametrize(
    ("old", "new", "offered_there", "others"),
    [
        (
            "outcome:",
            "check: [{rival: ^}]\nrivals: {guess: {steps: []}}\noutcome:",
            {"guess"},
            {"agent", "t"},
        ),
        ("outcome:", "check: [{needs: ^}]\noutcome:", {"ann", "agent"}, {"exit", "t"}),
        ("outcome:", "check: [{needs: ann, draw: ^}]\noutcome:", {"shade"}, {"ann"}),
        ("type: door", "type: door, opens: ^", {"exit"}, {"ann", "shade"}),
        ("type: door", "type: door, inside: ^", {"exit", "ann"}, {"shade"}),
        ("type: door", "type: door, pushed_by: ^", {"door", "ball"}, {"exit"}),
        (
            "outcome:",
            "looks: {mood: {for: ann, words: [a, b]}}\nobserve: {tone: ^}\noutcome:",
            {"mood"},
            {"ann"},
        ),
        ("outcome:", "order: [^]\noutcome:", {"exit", "ann"}, {"shade", "t"}),
        ("hears: Where is the exit, say: There.", "say: There., set: {^}", {"n"}, {"exit"}),
        ("outcome:", "horizon: ^\noutcome:", set(), {"agent", "t", "sees"}),
        ("outcome:", "params: {n: {default: ^}}\noutcome:", {"ann"}, {"sees"}),
        ("outcome:", "published: [{who: chil^, did: x}]\noutcome:", set(), {"agent"}),
        ("outcome:", "memory: {m: {of: ^}}\noutcome:", {"agent.acts"}, {"base.yaml"}),
        ("scenario: a", "scenario: ^", set(), {"base.yaml"}),
        ("templates: [Where", "templates: [Wh^", set(), {"agent"}),
    ],
)
def test_what_is_offered_is_what_the_key_holds(
    tmp_path: Path, old: str, new: str, offered_there: set[str], others: set[str]
) -> None:
    (tmp_path / "base.yaml").write_text("")
    text = TEXT.replace("    states:", "    let: {n: 0}\n    states:", 1).replace(old, new, 1)
    plain, line, column = marked(text)
    found = {offer.text for offer in complete(plain, None, tmp_path, line, column)}
    assert offered_there <= found
    assert not others & found


def test_files_are_offered_and_opened_wherever_a_key_names_one(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text("")
    for text in (
        "scenario: a\ncast: {ann: {one_of: [^]}}\n",
        "suite: a\nsplits: {s: {replace: {x: ^}}}\n",
        "suite: a\nsplits: {s: {members: [^]}}\n",
        "experiment: e\nconditions: [{name: one, tests: [{scenario: ^}]}]\n",
        "experiment: e\nconditions: [{name: one, tests: [^]}]\n",
    ):
        assert "base.yaml" in offered(text, tmp_path), text
        plain, line, column = marked(text.replace("^", "ba^se"))
        document = read_document(replace(Source("a.yaml", plain), path=tmp_path / "a.yaml"))
        assert declaration(document, document.data, line, column) == tmp_path / "base.yaml", text


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("hears: Where is", "hears: Where i^s"),
        ("templates: [Where is", "templates: [Where i^s"),
        ("ann: {frame: duty}", "ann: {frame: duty, name: Ann i^s}"),
        ("outcome:", "published: [{who: it i^s, did: x}]\noutcome:"),
    ],
)
def test_words_of_a_text_are_no_words_of_the_language(old: str, new: str) -> None:
    plain, line, column = marked(TEXT.replace(old, new, 1))
    document = read_document(Source("a.yaml", plain))
    assert explain(document, document.data, line, column) is None


def test_no_prose_is_completed() -> None:
    assert offered(TEXT.replace("objects:", "about: The ^\nobjects:")) == []
    assert offered(TEXT.replace("objects:", "instructions: The <^\nobjects:")) == []
    assert offered(TEXT.replace("objects:", "instructions: {en: The ^}\nobjects:")) == []
    assert offered(TEXT.replace("say: There.", "say: Th^")) == []
    assert offered(TEXT.replace("outcome:", "probes: {q: {ask: Wh^}}\noutcome:")) == []


def test_keys_that_are_there_are_not_offered() -> None:
    found = offered(TEXT.replace("say: There.,", "^,"))
    assert "say" in found
    assert "hears" not in found
    assert "goto" not in found


def test_files_beside(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text("")
    assert "base.yaml" in offered("scenario: a\nextends: b^\n", tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("face(agent)", "fa^ce(agent)", "a quarter turn per step towards x"),
        ("do: face", "d^o: face", "an activity"),
        ("agent.at(exit)", "agent.a^t(exit)", "on the cell of x"),
        ("agent.at(exit)", "agent.at(ex^it)", "an object"),
        ("exit.color", "exit.co^lor", "its colour"),
        ("  shade:", "  sh^ade:", "drawn or computed once per episode"),
        ("frame: duty", "fr^ame: duty", "the frame that it follows"),
        ("frame: duty", "frame: d^uty", "a frame"),
        ("outcome:", "pro^bes: {q: {ask: Which}}\noutcome:", "a question to language models"),
        ("outcome:", "probes: {q: {an^swer: exit.color}}\noutcome:", "the right answer at that moment"),
        ("outcome:", "probes: {q: {answer: exit.co^lor}}\noutcome:", "its colour"),
    ],
)
def test_hover(old: str, new: str, expected: str) -> None:
    plain, line, column = marked(TEXT.replace(old, new, 1))
    document = read_document(Source("a.yaml", plain))
    found = explain(document, document.data, line, column)
    assert found is not None
    assert expected in found[0]


def test_nothing_is_said_about_prose() -> None:
    plain, line, column = marked(TEXT.replace("say: There.", "say: Th^ere."))
    document = read_document(Source("a.yaml", plain))
    assert explain(document, document.data, line, column) is None


def test_every_position_is_survived() -> None:
    """Completion and hover at each place of a file, and of one cut off there."""
    document = read_document(Source("a.yaml", TEXT))
    lines = TEXT.split("\n")
    for number, content in enumerate(lines, 1):
        for column in range(1, len(content) + 2, 3):
            explain(document, document.data, number, column)
            cut = "\n".join([*lines[: number - 1], content[: column - 1]])
            complete(cut, document.data, None, number, column)
    assert complete(TEXT, None, None, 99, 1) == []


def test_every_instruction_has_a_usage() -> None:
    assert {signature.name for signature in SIGNATURES if signature.name not in usage(signature)} == set()


IN_A_FILE = "tests_of: a.yaml\ntests:\n  q:\n    play:\n      - {do: left}\n"


@pytest.mark.parametrize(
    ("new", "some", "others"),
    [
        ("do: ^", {"left", "none", "Where is the exit"}, {"go_to", "face", "agent"}),
        ("do: left, state: {ann: ^}", {"waiting", "content"}, {"agent"}),
        ("do: left, true: ^", {"agent", "exit", "t"}, {"waiting"}),
        ("do: left, hears: ^", set(), {"agent", "Where is the exit"}),
        ("do: left, ^", {"hears", "state", "true", "not"}, {"do", "say"}),
    ],
)
def test_completion_in_a_file_of_tests_knows_the_scenario(new: str, some: set[str], others: set[str]) -> None:
    found = set(offered(IN_A_FILE.replace("do: left", new)))
    assert some <= found
    assert not others & found


def test_files_are_offered_for_what_is_tested(tmp_path: Path) -> None:
    (tmp_path / "lodge.yaml").write_text("")
    assert offered(IN_A_FILE.replace("a.yaml", "lo^"), tmp_path) == ["lodge.yaml"]


@pytest.mark.parametrize(
    ("word", "about"),
    [
        ("pl^ay", "what is done, step by step"),
        ("d^o", "an act or several, as typed"),
        ("tests^_of", "the scenario's file"),
    ],
)
def test_keys_of_tests_are_explained(word: str, about: str) -> None:
    plain, line, column = marked(IN_A_FILE.replace(word.replace("^", ""), word, 1))
    document = read_document(Source("", plain))
    found = explain(document, read_document(Source("", TEXT)).data, line, column)
    assert found is not None
    assert about in found[0]
