"""One mistake in a file that is right gives one error, where the mistake is, and nothing that follows from it."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

import pytest

from socialai_dsl.frontend import check
from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.schema.annotations import CALLED, keys_of
from socialai_dsl.source import Source
from tests.quick import one_in

SCENARIOS = sorted(
    str(path.relative_to(shipped_folder()))
    for path in (*shipped_folder().glob("*.yaml"), *shipped_folder().glob("novel/*.yaml"))
    if path.read_text(encoding="utf-8").startswith("scenario:")
)
KEYS = {key for model in CALLED for key in keys_of(model) if len(key) > 3}
PROSE = re.compile(r"^(about|notes|skills|instructions):.*\n(?:  .*\n)*", re.MULTILINE)
"""What no machine reads."""

Site = tuple[int, int, str]
"""Where a mistake can be made: from here to there, and what is written instead."""


def keys_misspelt(text: str) -> Iterator[Site]:
    """Two letters of a key change places."""
    sections = re.findall(
        r"^(?:let|looks|tables|define|parameters|cast|objects|frames|rivals|probes):.*\n((?:  .*\n|\n)*)",
        text,
        re.MULTILINE,
    )
    names = {name for section in sections for name in re.findall(r"^  ([a-z_]+)\b", section, re.MULTILINE)}
    names |= {
        name
        for line in re.findall(r"\b(?:slots|let|set|with):(.*)", text)
        for name in re.findall(r"\b([a-z_]+):", line)
    }
    below = re.findall(r"^( +)(?:let|define|slots|beliefs):.*\n((?:\1 .*\n|\n)*)", text, re.MULTILINE)
    names |= {
        name
        for indent, block in below
        for name in re.findall(rf"^{indent}  ([a-z_]+)\b", block, re.MULTILINE)
    }
    for found in re.finditer(r"(?:^ *(?:- )?|[{,] *)([a-z_]+):(?= |$)", text, re.MULTILINE):
        # A parameter, a value or a table may be called like a key.
        if found[1] in KEYS - names and f"${found[1]}" not in text:
            yield found.start(1), found.end(1), slip(found[1])


def names_misspelt(text: str) -> Iterator[Site]:
    """Two letters of a name that something is done with change places."""
    for found in re.finditer(r"(?<![.\w])([a-z_]{4,})\.(?:is|color|at|next_to|gone)\b", text):
        yield found.start(1), found.end(1), slip(found[1])


def verbs_misspelt(text: str) -> Iterator[Site]:
    """Two letters of a verb change places; values of a parameter are looked at where they are chosen."""
    for found in re.finditer(r"\b(next_to|eye_contact|turn_to|face|pick|count)\(", text):
        if "values:" not in text[text.rindex("\n", 0, found.start()) : found.start()]:
            yield found.start(1), found.end(1), slip(found[1])


def states_misspelt(text: str) -> Iterator[Site]:
    """Two letters of the state that a rule leads to change places."""
    for found in re.finditer(r"\bgoto(?:_now)?: ([a-z_]{4,})", text):
        yield found.start(1), found.end(1), slip(found[1])


def members_misspelt(text: str) -> Iterator[Site]:
    """Two letters of a name change places where the cast declares it; it may be used in many ways."""
    cast = re.search(r"^cast:\n((?:  .*\n|\n)*)", text, re.MULTILINE)
    for found in re.finditer(r"^  ([a-z_]{4,}):", cast[1], re.MULTILINE) if cast else ():
        if found[1] != "agent":
            yield cast.start(1) + found.start(1), cast.start(1) + found.end(1), slip(found[1])


def types_misspelt(text: str) -> Iterator[Site]:
    """Two letters of an object's type change places."""
    for found in re.finditer(r"\btype: ([a-z]{4,})", text):
        yield found.start(1), found.end(1), slip(found[1])


def brackets_left_open(text: str) -> Iterator[Site]:
    """A closing bracket at the end of a value is forgotten."""
    for found in re.finditer(r"^ .*\w(\))$", text, re.MULTILINE):
        yield found.start(1), found.end(1), ""


def keys_twice(text: str) -> Iterator[Site]:
    """A line is there twice."""
    for found in re.finditer(r"^ *[a-z_]+: \S.*[^,\n]\n", text, re.MULTILINE):
        yield found.end(), found.end(), found[0]


def values_left_out(text: str) -> Iterator[Site]:
    """A key is written, and nothing after it."""
    for found in re.finditer(
        r"^ *(?:horizon|earshot|facing|color|kind|view|type):( .+)$", text, re.MULTILINE
    ):
        yield found.start(1), found.end(1), ""


def symbols_of_other_languages(text: str) -> Iterator[Site]:
    """A word of the language is written as elsewhere."""
    other = {" and ": " && ", " or ": " || ", " == ": " = ", "not ": "!"}
    for found in re.finditer(r"^ .*?\w( and | or | == |not )", text, re.MULTILINE):
        if "say" not in found[0]:
            yield found.start(1), found.end(1), other[found[1]]


KINDS: dict[Callable[[str], Iterator[Site]], str] = {
    keys_misspelt: "S101 S105 S108",
    names_misspelt: "S201",
    verbs_misspelt: "S205",
    states_misspelt: "S301",
    types_misspelt: "S309",
    brackets_left_open: "S202",
    keys_twice: "S002",
    values_left_out: "S104",
    symbols_of_other_languages: "S203",
}
"""With the codes that a kind of mistake is reported as."""


def slip(word: str) -> str:
    """The word with two neighbours exchanged that differ, not at its beginning."""
    i = next(i for i in range(1, len(word) - 1) if word[i] != word[i + 1])
    return word[:i] + word[i + 1] + word[i] + word[i + 2 :]


def sites(kind: Callable[[str], Iterator[Site]], text: str) -> list[Site]:
    """Where a kind of mistake can be made in a file."""
    read = PROSE.sub(lambda found: re.sub(r"[^\n]", "#", found[0]), text)
    return list(kind(re.sub(r"#.*", lambda found: " " * len(found[0]), read)))


@pytest.fixture
def scenarios(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the shipped scenarios, in which we work."""
    copy = tmp_path / "scenarios"
    shutil.copytree(shipped_folder(), copy)
    monkeypatch.chdir(copy)
    return copy


def check_mistakes(folder: Path, kind: Callable[[str], Iterator[Site]], most: int) -> int:
    """Make up to `most` mistakes of a kind in each scenario, one at a time; how many were made.

    A word that is misspelt is found where it stands, with the word that was meant.
    """
    made = 0
    for name in SCENARIOS:
        path = folder / name
        text = path.read_text(encoding="utf-8")
        found = sites(kind, text)
        for start, end, wrong in Random(f"{kind.__name__} {name}").sample(found, min(most, len(found))):
            path.write_text(text[:start] + wrong + text[end:], encoding="utf-8")
            line, column = text.count("\n", 0, start) + 1, start - text.rfind("\n", 0, start)
            result = check(name)
            about = (name, line, wrong, [str(d) for d in result.diagnostics])
            assert len(result.diagnostics) == 1, about
            (said,) = result.diagnostics
            assert (said.span.file, said.span.line) == (name, line), about
            assert said.code in KINDS[kind].split(), about
            if kind.__name__.endswith("_misspelt"):
                assert (said.span.column, said.suggestion) == (column, text[start:end]), about
            made += 1
        path.write_text(text, encoding="utf-8")
    return made


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_one_mistake_gives_one_error(scenarios: Path, kind: Callable[[str], Iterator[Site]]) -> None:
    assert check_mistakes(scenarios, kind, most=1) >= 4


SPARE = "spare_one: [1, 2]"
"""A `let` that nobody uses and that is no expression."""

ELSEWHERE = (names_misspelt, verbs_misspelt, states_misspelt)


@pytest.mark.parametrize("kind", ELSEWHERE, ids=lambda kind: kind.__name__)
def test_a_mistake_hides_none_that_has_nothing_to_do_with_it(
    scenarios: Path, kind: Callable[[str], Iterator[Site]]
) -> None:
    """Two mistakes, of which neither speaks of the other: both are found.

    Rivals are checked once the file is right without them.
    """
    made = 0
    for name in SCENARIOS:
        path = scenarios / name
        text = path.read_text(encoding="utf-8")
        rivals = re.search(r"^rivals:\n(?:  .*\n|\n)*", text, re.MULTILINE)
        inside = range(*rivals.span()) if rivals else range(0)
        found = [site for site in sites(kind, text) if site[0] not in inside]
        for start, end, wrong in Random(f"{kind.__name__} {name}").sample(found, min(1, len(found))):
            mistaken = text[:start] + wrong + text[end:]
            if re.search(r"^let:\n", text, re.MULTILINE):
                mistaken = re.sub(r"^let:\n", f"let:\n  {SPARE}\n", mistaken, count=1, flags=re.MULTILINE)
            elif not re.search(r"^let:", text, re.MULTILINE):
                mistaken += f"\nlet: {{{SPARE}}}\n"
            else:
                continue
            path.write_text(mistaken, encoding="utf-8")
            codes = sorted(d.code for d in check(name).diagnostics)
            assert codes == sorted(["S104", KINDS[kind]]), (name, wrong, codes)
            made += 1
        path.write_text(text, encoding="utf-8")
    assert made >= 4


def test_a_scenario_that_lacks_its_grammar_hides_no_slip(tmp_path: Path) -> None:
    """A name that nothing is like may be that of a slot, and waits for the grammar; others are told at once."""
    file = tmp_path / "gate.yaml"
    file.write_text("""\
scenario: gate
room: {size: 6}
objects:
  gate: {type: door, place: wall(top)}
cast:
  keeper: {frame: duti}
  agent: {place: anywhere}
frames:
  duty: {states: {s: {do: face(agnt), then: [{when: weather == 1, say: Oh}]}}}
outcome:
  - success: agent.at(gat)
""")
    found = {d.suggestion for d in check(str(file)).diagnostics}
    assert found == {None, "duty", "agent", "gate"}
    assert not any("weather" in d.text for d in check(str(file)).diagnostics)


def test_a_member_misspelt_in_the_cast_gives_one_error(scenarios: Path) -> None:
    """It may stand anywhere where the name is used, and says how the cast spells it."""
    made = 0
    for name in SCENARIOS:
        path = scenarios / name
        text = path.read_text(encoding="utf-8")
        for start, end, wrong in sites(members_misspelt, text):
            path.write_text(text[:start] + wrong + text[end:], encoding="utf-8")
            (found,) = check(name).diagnostics
            assert (found.code, found.suggestion) == ("S201", wrong), (name, wrong, found)
            made += 1
        path.write_text(text, encoding="utf-8")
    assert made >= 10


@pytest.mark.parametrize(
    ("written", "meant"),
    [("{value: 0, range: 0..9}", "start"), ("{start: 0, bounds: 0..9}", "range"), ("{value: 0}", "start")],
)
def test_another_word_for_a_key_of_a_register_gives_one_error(
    scenarios: Path, written: str, meant: str
) -> None:
    text = (scenarios / "talkitout.yaml").read_text(encoding="utf-8")
    word = "bounds" if "bounds" in written else "value"
    (scenarios / "r.yaml").write_text(text + f"\nstate: {{mood: {written}}}\n", encoding="utf-8")
    (found,) = check("r.yaml").diagnostics
    line = text.count("\n") + 2
    assert (found.code, found.suggestion, found.span.line) == ("S101", meant, line)
    assert found.span.column == len("state: {mood: ") + written.index(word) + 1


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_one_mistake_anywhere_gives_one_error(scenarios: Path, kind: Callable[[str], Iterator[Site]]) -> None:
    assert check_mistakes(scenarios, kind, most=1000) >= 10


@pytest.mark.parametrize(
    "name",
    one_in(
        3,
        ["talkitout", "help", "cointhief", "novel/haggling", "novel/turn_taking", "novel/culprit"],
        "checks the file once for each line",
    ),
)
def test_one_wrong_indentation_is_one_finding(name: str) -> None:
    """Every key of a file, with what belongs to it, one level too far left or right."""
    path = (shipped_folder() / f"{name}.yaml").resolve()
    lines = path.read_text(encoding="utf-8").splitlines()
    known = {
        ("novel/culprit", 39, 2)
    }  # a cast with a group, which is written out before its place is looked at
    several = []
    for first, line in enumerate(lines):
        key = re.match(r"( *)[A-Za-z_]\w*:", line)
        for by in (-2, 2) if key else ():
            if key is None or len(key[1]) + by < 0 or (name, first + 1, by) in known:
                continue
            end = _end_of_block(lines, first, len(key[1]))
            moved = [
                part[2:] if by < 0 else f"  {part}" if part.strip() else part for part in lines[first:end]
            ]
            text = "\n".join([*lines[:first], *moved, *lines[end:]]) + "\n"
            found = check(str(path), texts={path: Source(path.name, text)}).diagnostics
            if len(found) > 1:
                several.append((first + 1, by, [str(d) for d in found]))
    assert not several


def _end_of_block(lines: list[str], first: int, indentation: int) -> int:
    """Behind the last line that belongs to the key of a line."""
    end = first + 1
    while end < len(lines):
        own = len(lines[end]) - len(lines[end].lstrip())
        listed = own == indentation and lines[end].lstrip().startswith("- ")
        if lines[end].strip() and own <= indentation and not listed:
            break
        end += 1
    return end


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("scenario: shorter\nextends: talkitout\nset: {horizon: 9}\n", "for variants"),
        ("scenario: shorter\nextends: talkitout\nremove: [probes]\n", "for variants"),
        ("variant: shorter\nof: talkitout\nhorizon: 9\n", "`set: {horizon: ...}`"),
    ],
)
def test_a_key_of_the_other_way_to_change_a_scenario(text: str, says: str, tmp_path: Path) -> None:
    """It is no misspelt key: `set` is not meant to be `let`."""
    path = tmp_path / "shorter.yaml"
    path.write_text(text, encoding="utf-8")
    (found,) = check(path).diagnostics
    assert (found.code, found.span.line) == ("S101", 3)
    assert found.suggestion is None
    assert says in str(found.hint)
