"""Reading YAML: the data the text says, all mistakes in one go, and nothing that kills the process."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.loader import reader
from socialai_dsl.loader.reader import MAX_DEPTH, MAX_SCALAR
from socialai_dsl.source import Data, Node, Source

PARSERS = [yaml.CSafeLoader, yaml.SafeLoader] if yaml.__with_libyaml__ else [yaml.SafeLoader]


@pytest.fixture(params=PARSERS, ids=lambda parser: parser.__name__)
def _each_parser(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "YAML", request.param)


each_parser = pytest.mark.usefixtures("_each_parser")


def read(text: str) -> Node:
    return reader.read_document(Source("f.yaml", text))


def findings(text: str) -> list[str]:
    with pytest.raises(ScenarioError) as raised:
        read(text)
    return [str(d) for d in raised.value.diagnostics]


SCENARIO = """\
scenario: small                 # a comment
about: |
  Leave by the door.
  Ask first.
horizon: 100
grammar: {templates: [Where is <noun>, Open <noun>], nouns: ["sesame", 'the exit', 6]}
room: {size: 5..8}
frames:
  courtesy:
    start: stranger
    states:
      stranger:
        then:
          - {hears: How are you, say: I am fine., goto: acquainted}
outcome:
  - success: agent.said("Open sesame") and
      agent.next_to(exit)
  - failure: t == 3
    reward: 0.5
"""


@each_parser
def test_a_scenario_as_plain_data() -> None:
    assert read(SCENARIO).data == {
        "scenario": "small",
        "about": "Leave by the door.\nAsk first.\n",
        "horizon": 100,
        "grammar": {"templates": ["Where is <noun>", "Open <noun>"], "nouns": ["sesame", "the exit", 6]},
        "room": {"size": "5..8"},
        "frames": {
            "courtesy": {
                "start": "stranger",
                "states": {
                    "stranger": {
                        "then": [{"hears": "How are you", "say": "I am fine.", "goto": "acquainted"}],
                    }
                },
            }
        },
        "outcome": [
            {"success": 'agent.said("Open sesame") and agent.next_to(exit)'},
            {"failure": "t == 3", "reward": 0.5},
        ],
    }


@each_parser
@pytest.mark.parametrize(("text", "data"), [("", None), ("# only\n", None), ("---\na: 1\n...\n", {"a": 1})])
def test_empty_and_marked_documents(text: str, data: Data) -> None:
    document = read(text)
    assert document.data == data
    assert document.value_span(("nothing",)).line in (1, 2)


@each_parser
def test_keys_are_text_and_keep_their_order() -> None:
    data = read("on: 1\n4: 2\ntrue: 3\nz: 4\na: 5\n").data
    assert isinstance(data, dict)
    assert list(data) == ["on", "4", "true", "z", "a"]


@each_parser
def test_a_repeated_key_names_the_first() -> None:
    assert findings("scenario: a\nhorizon: 1\nroom: {size: 5}\nhorizon: 2\n") == [
        "f.yaml:4:1: S002 `horizon` is given twice; the first is at line 2"
    ]
    assert findings("{1: a, '1': b}")[0].startswith("f.yaml:1:8: S002")


@each_parser
def test_all_mistakes_in_one_run() -> None:
    text = "a: yes\nb: [010, ok, ~]\na: 2\nc: {d: &x 1, e: *x, f: !g h, <<: 3}\n"
    assert [line.split()[1] + "@" + line.split(": ")[0] for line in findings(text)] == [
        "S003@f.yaml:1:4",
        "S003@f.yaml:2:5",
        "S003@f.yaml:2:14",
        "S002@f.yaml:3:1",
        "S005@f.yaml:4:8",
        "S005@f.yaml:4:17",
        "S005@f.yaml:4:24",
        "S005@f.yaml:4:30",
    ]


NOT_YAML = {
    "a: {say: Listen: look at me}": "1:16: a colon followed by a space starts a new key; quote the text",
    "a: Listen: look": "1:10: a colon followed by a space starts a new key; quote the text",
    "a: 1\n b: 2": "2:3: this line is indented further than the key above, which has its value already",
    "horizon:100\nb: 2": "1:1: a space is missing after the colon",
    "a: 1\nb\nc: 2": "2:1: a key without its colon",
    "a: {b: 1": "1:4: the `{` is not closed with `}`",
    "a: [1, 2\nb: 3": "1:4: the `[` is not closed with `]`",
    "a: 'x": "1:4: the quote ' is not closed",
    "a:\n\tb: 1": "2:1: a tab cannot indent; use spaces",
    "a: @x": "1:4: a text cannot begin with `@`; quote the text",
    "a: `x`": "1:4: a text cannot begin with a backquote; quote the text",
    "a: && b": "1:4: a text cannot begin with `&`; quote the text",
    "a: * b": "1:4: a text cannot begin with `*`; quote the text",
    "a: > 5": "1:4: a leading `>` starts a text on the lines below; quote the text",
    'a: "x" and y': "1:8: there is something behind the closing quote",
    "a: 'it's'": "1:8: there is something behind the closing quote",
    "a: {b: 1}}": "1:10: there is nothing for this `}` to close",
    "}": "1:1: there is nothing for this `}` to close",
    "a: - b": "1:4: a list starts on a line of its own",
    "a: x\n- b": "2:1: this line fits neither the list or mapping above nor one around it",
    "a: {b: not x[1]}": "1:13: `[` in a text inside { } or [ ]; quote the text",
    ": x": "1:1: there is no key before this colon",
    "? [a]\n: b": "1:3: a key is a word, not a list or a mapping",
    "a: [[b] c]": "1:9: a comma is missing before this, or the `[` is not closed",
    "a: [b, , c]": "1:8: a value is missing here",
    "'a'\n'b'": "2:1: the document has ended before this",
    "a: b\n\t\tc: 1": "2:1: a tab cannot indent; use spaces",
    "a: ? b": "1:4: a text cannot begin with `? `; quote the text",
    "a: ,b": "1:4: a text cannot begin with `,`; quote the text",
}


@each_parser
@pytest.mark.parametrize("text", NOT_YAML)
def test_what_is_not_yaml_is_explained(text: str) -> None:
    place, message = NOT_YAML[text].split(": ", 1)
    assert findings(text)[0] == f"f.yaml:{place}: S001 not YAML: {message}"


@each_parser
@pytest.mark.parametrize(
    "text", ["*a : 1", "? *a\n: 1", "&a b: 1", "!a b: 1", "{*a : 1}", "- *a : 1", "&a {b: 1}: c"]
)
def test_refused_properties_on_keys(text: str) -> None:
    assert any("S005" in finding for finding in findings(text))


@each_parser
def test_many_tag_directives_are_refused_before_they_are_read() -> None:
    text = "".join(f"%TAG !a{i}! x\n" for i in range(60_000)) + "---\na: 1\n"
    with pytest.raises(ScenarioError) as raised:
        reader.read_document(Source("f.yaml", "# first\n" + text))
    (found,) = raised.value.diagnostics
    assert (found.code, found.span.line, found.span.column) == ("S005", 2, 1)


@pytest.mark.parametrize(("text", "column"), [("{?a: 1}", 3), ("[?x]", 3), ("{b: 1, ?'a': 2}", 9)])
def test_a_question_mark_before_a_key_in_braces_is_refused(text: str, column: int) -> None:
    """YAML 1.2 has it as a letter of the key; libyaml leaves it out."""
    with pytest.raises(ScenarioError) as raised:
        reader.read_document(Source("f.yaml", text))
    (found,) = raised.value.diagnostics
    assert (found.code, found.span.column) == ("S001", column)
    assert reader.read_document(Source("f.yaml", "{'?a': 1, b?: 2, ? c: 3}")).data == {
        "?a": 1,
        "b?": 2,
        "c": 3,
    }


def test_a_second_document_is_refused() -> None:
    assert findings("a: 1\n---\nb: 2\n")[0].startswith("f.yaml:2:1: S001 a file holds one document")


@each_parser
@pytest.mark.parametrize("character", ["\0", "\x1b", "\x7f", "\x85", "\u2028", "\u202e", "\u2066", "\ufeff"])
def test_forbidden_characters_written_or_escaped(character: str) -> None:
    assert findings(f"a: b\nc: x{character}y")[0].startswith("f.yaml:2:5: S006")
    assert "S006" in findings(f'a: "x\\u{ord(character):04x}"')[0]


@each_parser
def test_depth_limit_is_exact() -> None:
    assert read("[" * MAX_DEPTH + "]" * MAX_DEPTH).data is not None
    assert findings("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1)) == [
        f"f.yaml:1:{MAX_DEPTH + 1}: S004 the file is nested more than {MAX_DEPTH} levels deep"
    ]


@each_parser
def test_scalar_limit_is_exact() -> None:
    assert read("x" * MAX_SCALAR).data == "x" * MAX_SCALAR
    assert "S004" in findings("x" * (MAX_SCALAR + 1))[0]


ALIAS_BOMB = "a: &a [x, x]\n" + "".join(
    f"{b}: &{b} [*{a}, *{a}, *{a}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
BOMBS = {
    "aliases": ALIAS_BOMB,
    "merge keys": "a: &a {x: 1}\nb: {<<: [*a, *a, *a]}\n",
    "self reference": "&a [*a]",
    "block lists, 25,000 deep": "- " * 25_000 + "x",
    "lists, 500,000 deep": "[" * 500_000,
    "mappings, 25,000 deep": "{a: " * 25_000,
    "keys, 30,000 deep": "? " * 30_000,
    "100,000 mappings": "- {}\n" * 100_000,
    "100,000 keys": "".join(f"k{i}: 1\n" for i in range(70_000)),
    "5,000 digits": "a: " + "7" * 5_000,
    "a million hex digits": "a: 0x" + "f" * 1_000_000,
    "a long text": "a: '" + "x" * 1_000_000 + "'",
    "a long folded text": "a: >\n" + "  x\n" * 200_000,
    "a long key": "x" * 1_000_000 + ": 1",
    "more than the limit": "a: b\n" * 250_000,
    "binary tag": "a: !!binary AAAA",
    "python tag": "a: !!python/object/apply:os.system [ls]",
    "python name": "!!python/name:os.system",
    "timestamp tag": "a: !!timestamp foo",
    "empty int tag": 'a: !!int ""',
    "large escape": 'a: "\\UFFFFFFFF"',
    "surrogate escape": 'a: "\\ud800"',
    "surrogate": "a: \ud800",
    "unclosed quote": '"' + "a\n" * 400_000,
}


@pytest.mark.parametrize("name", BOMBS)
def test_bombs_are_refused_at_once(name: str) -> None:
    start = time.process_time()
    assert len(findings(BOMBS[name])) <= 200
    # Most take a millisecond.
    # Against hanging; how fast it is a benchmark's business.
    assert time.process_time() - start < 20.0


def test_deep_files_do_not_need_a_deep_stack() -> None:
    program = """
import threading
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Source
refused = []
def attempt():
    for text in ("- " * 25000 + "x", "[" * 100000, "? " * 30000, "{a: " * 30000):
        try:
            read_document(Source("f", text))
        except ScenarioError:
            refused.append(text)
threading.stack_size(512 * 1024)
thread = threading.Thread(target=attempt)
thread.start()
thread.join()
print(len(refused))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "4\n", "")


def test_reading_imports_nothing_heavy() -> None:
    program = (
        "import sys, socialai_dsl.loader\n"
        "print(sorted({'pydantic', 'numba', 'torch', 'numpy', 'lark'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


TEXT = st.text(st.characters(exclude_categories=["Cc", "Cs", "Cn"]), max_size=12).filter(
    lambda text: reader.FORBIDDEN.search(text) is None
)
LEAF = TEXT | st.integers(-(10**9), 10**9) | st.booleans() | st.none()
NESTED = st.recursive(
    LEAF,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT.filter(bool), inner, max_size=4),
    max_leaves=20,
)


def quoted(data: Any, dumper: yaml.Dumper) -> yaml.Node:
    return dumper.represent_scalar("tag:yaml.org,2002:str", data, style='"')


class _Dumper(yaml.SafeDumper):
    """Quotes every text, since what may stand unquoted is stricter here than for PyYAML."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


_Dumper.add_representer(str, lambda dumper, data: quoted(data, dumper))


@given(NESTED, st.booleans())
def test_dumped_data_is_read_again(data: Data, flow: bool) -> None:
    text = yaml.dump(data, Dumper=_Dumper, allow_unicode=True, default_flow_style=flow, width=40)
    document = read(text)
    assert document.data == data
    for path, part in parts(data):
        node = document.at(path).span
        if isinstance(part, str):
            assert text[node.start] == text[node.end - 1] == '"'
        elif not isinstance(part, (dict, list)):
            assert text[node.start : node.end] == json.dumps(part)
        if path and isinstance(path[-1], str):
            assert node.key is not None


def parts(data: Data, path: tuple[str | int, ...] = ()) -> Iterator[tuple[tuple[str | int, ...], Data]]:
    yield path, data
    if isinstance(data, dict):
        for key, value in data.items():
            yield from parts(value, (*path, key))
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from parts(value, (*path, index))


PIECES = [
    *"{}[]:,&*!|>'\"%@`#?-\\\n\t ~=<",
    "\u202e",
    "\0",
    "\ud800",
    "é",
    "漢",
    ": ",
    "- ",
    "<<: ",
    "\n  ",
    "---",
    "...",
]
MUTATION = st.tuples(
    st.integers(0, len(SCENARIO)), st.integers(0, 6), st.sampled_from(PIECES) | st.text(max_size=3)
)


@given(st.lists(MUTATION, min_size=1, max_size=6))
def test_mutated_files_raise_nothing_but_scenario_errors(mutations: list[tuple[int, int, str]]) -> None:
    text = SCENARIO
    for place, removed, inserted in mutations:
        text = text[:place] + inserted + text[place + removed :]
    for parser in PARSERS:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(reader, "YAML", parser)
            check_findings(text)


def check_findings(text: str) -> None:
    try:
        read(text)
    except ScenarioError as error:
        refusal = error
    else:
        return
    assert refusal.diagnostics
    assert str(refusal)
    lines = len(list(Source("", text).lines()))
    for finding in refusal.diagnostics:
        assert finding.span.file == "f.yaml"
        assert 1 <= finding.span.line <= lines + 1
        assert finding.span.column >= 1


def test_a_typical_file_takes_a_few_milliseconds() -> None:
    read(SCENARIO)
    best = min(_seconds(SCENARIO) for _ in range(10))
    assert best < 0.02


def _seconds(text: str) -> float:
    start = time.perf_counter()
    read(text)
    return time.perf_counter() - start
