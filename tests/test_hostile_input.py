"""Hostile and odd input, by the hundred: nothing is lost, nothing hangs, nothing but text reaches a terminal."""

from __future__ import annotations

import ast
import contextlib
import os
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import socialai_dsl
from socialai_dsl.cli.main import main
from socialai_dsl.cli.validate import REPORTS
from socialai_dsl.diagnostics import ScenarioError, Severity
from socialai_dsl.engine.calls import RoomError
from socialai_dsl.frontend import check
from socialai_dsl.grammar.ast import ParseProblem, parse_expression
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Source
from tests.fuzzing.targets import in_time
from tests.slips import write_mistakes

ROOT = Path(__file__).parents[1]
SMALL = (ROOT / "tests" / "diagnostics" / "small.yaml").read_text(encoding="utf-8")
Capture = pytest.CaptureFixture[str]


# -- keys given twice ----------------------------------------------------------------------------------------------


def with_a_key_twice(rng: random.Random) -> tuple[str, str, tuple[int, int]]:
    """A document of nested mappings and lists, the key that one mapping has twice, and the lines of both."""
    twice = rng.choice(("horizon", "a b", "true", "1", "é", "x-y"))
    written = rng.choice((twice, f'"{twice}"', f"'{twice}'")), rng.choice((twice, f'"{twice}"'))
    others = [
        f"k{i}: {rng.choice(('1', 'text', '[1, {a: 2}]', '{b: c}', ''))}" for i in range(rng.randrange(5))
    ]
    if rng.random() < 0.4:
        pairs = [
            f"{written[0]}: 1",
            *(other for other in others if not other.endswith(" ")),
            f"{written[1]}: 2",
        ]
        lines = ["{" + rng.choice((", ", ",\n      ")).join(pairs) + "}"]
        before = "\n".join(lines).rpartition(written[1])[0].count("\n")
        first, second = 0, before
    else:
        at = sorted(rng.sample(range(len(others) + 2), 2))
        lines = list(others)
        for place, key in zip(at, written, strict=True):
            lines.insert(place, f"{key}: 1")
        first, second = at
    depth = rng.randrange(4)
    text = "\n".join(lines)
    for level in range(depth):
        text = f"outer{level}:\n" + "\n".join(f"  {line}" for line in text.split("\n"))
    if rng.random() < 0.3:
        text = "items:\n" + "\n".join(
            f"{'- ' if not n else '  '}{line}" for n, line in enumerate(text.split("\n"))
        )
        depth += 1
    return text + "\n", twice, (depth + first + 1, depth + second + 1)


def test_a_thousand_keys_given_twice_are_refused_with_both_lines() -> None:
    rng = random.Random(5)
    for _ in range(1000):
        text, key, (first, second) = with_a_key_twice(rng)
        with pytest.raises(ScenarioError) as raised:
            read_document(Source("f.yaml", text))
        (found,) = raised.value.diagnostics
        assert (found.code, found.span.line) == ("S002", second), text
        assert found.message == f"`{key}` is given twice; the first is at line {first}", text


# -- expressions ---------------------------------------------------------------------------------------------------

_BRICKS = (
    *("(", ")", "not ", "-", "a", "1", " + ", " and ", " or ", " == ", ".b", "[", "]", "|", " | ", "..", "<a>", '"'),
    *("any(d in ", "pick(", "first(", "count(", " where ", ", ", "$n", "99999999999", "é", "\t", "\\", "prev(", "?"),
)  # fmt: skip


def bombs(count: int) -> Iterator[str]:
    """Texts of one brick or a few, repeated up to and beyond every limit."""
    rng = random.Random(6)
    for _ in range(count):
        bricks = [rng.choice(_BRICKS) for _ in range(rng.choice((1, 1, 2, 3, 5)))]
        text = "".join(bricks) * rng.choice((3, 23, 24, 25, 60, 200, 5_000))
        yield text[: rng.choice((499, 500, 501, 20_000))] + rng.choice(("", "a", ")" * 24))


def test_a_thousand_nasty_expressions_are_a_tree_or_a_problem() -> None:
    outside = []
    for text in bombs(1000):
        with in_time():
            try:
                parse_expression(text)
            except ParseProblem as problem:
                if not 0 <= problem.offset <= len(text):
                    outside.append((text, problem.offset))
    assert outside == []


# -- files that name files -----------------------------------------------------------------------------------------


def chain(count: int, folder: Path, last: str) -> None:
    for number in range(count):
        following = f"f{number + 1}.yaml" if number + 1 < count else last
        (folder / f"f{number}.yaml").write_text(f"scenario: f{number}\nextends: {following}\n")


def circle(folder: Path) -> None:
    chain(50, folder, "f0.yaml")


def long_chain(folder: Path) -> None:
    chain(200, folder, "talkitout")


def itself(folder: Path) -> None:
    chain(1, folder, "f0.yaml")


def suites_of_suites(folder: Path) -> None:
    for number in range(12):
        names = f"[f{number + 1}.yaml, f{number + 1}.yaml+x]" if number < 11 else "[talkitout]"
        (folder / f"f{number}.yaml").write_text(f"suite: f{number}\nmembers: {names}\n")


def wide_suite(folder: Path) -> None:
    for number in range(1, 90):
        (folder / f"f{number}.yaml").write_text(SMALL.replace("scenario: small", f"scenario: f{number}", 1))
    members = ", ".join(f"f{number}.yaml" for number in range(1, 90))
    (folder / "f0.yaml").write_text(f"suite: f0\nmembers: [{members}]\n")


def large_files(folder: Path) -> None:
    for number in range(1, 8):
        filler = "".join(f"# {'x' * 990}\n" for _ in range(1000))
        (folder / f"f{number}.yaml").write_text(f"scenario: f{number}\nextends: f{number + 1}.yaml\n{filler}")
    (folder / "f0.yaml").write_text("scenario: f0\nextends: f1.yaml\n")
    (folder / "f8.yaml").write_text("scenario: f8\n")


def drawn_from_everything(folder: Path) -> None:
    for number in range(1, 300):
        (folder / f"n{number}.yaml").write_text(f"npc: n{number}\nkind: guide\n")
    (folder / "f0.yaml").write_text("scenario: f0\ncast: {a: {one_of: 'n*.yaml'}}\n")


def many_stars(folder: Path) -> None:
    (folder / ("a" * 200 + ".yaml")).write_text("npc: a\n")
    (folder / "f0.yaml").write_text(f"scenario: f0\ncast: {{a: {{one_of: '{'*a' * 60}b.yaml'}}}}\n")


def variants_in_a_circle(folder: Path) -> None:
    (folder / "f0.yaml").write_text("variant: f0\nof: f1.yaml\nset: {horizon: 2}\n")
    (folder / "f1.yaml").write_text("variant: f1\nof: f0.yaml\nset: {horizon: 3}\n")


def sweep_without_end(folder: Path) -> None:
    values = ", ".join(map(str, range(1, 100)))
    (folder / "f1.yaml").write_text(
        SMALL.replace("scenario: small", "scenario: f1\nparams: {n: 1, m: 1, k: 1}", 1)
    )
    text = f"suite: f0\nmembers: f1.yaml\nsweep: {{n: [{values}], m: [{values}], k: [{values}]}}\n"
    (folder / "f0.yaml").write_text(text)


@pytest.mark.parametrize(
    "lay",
    [circle, long_chain, itself, suites_of_suites, wide_suite, large_files, drawn_from_everything, many_stars,
     variants_in_a_circle, sweep_without_end],
    ids=lambda lay: lay.__name__,
)  # fmt: skip
def test_files_that_name_files_without_end_are_refused(lay, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    lay(tmp_path)
    with in_time():
        result = check("f0.yaml")
    assert result.has_errors
    assert len(result.sources) <= 66
    assert len(result.diagnostics) < 100


# -- names that lead to names --------------------------------------------------------------------------------------


def scenario_with(rest: str) -> str:
    return (
        "scenario: f\nhorizon: 5\ngrammar: {templates: [Say <noun>], nouns: [hi]}\nroom: {size: 8}\n"
        f"cast: {{agent: {{}}, a: {{frame: f}}}}\n{rest}"
    )


def test_names_that_lead_to_names_without_end_are_refused(tmp_path: Path) -> None:
    """Each was a traceback, or would have taken longer than anybody waits."""
    frame = "frames: {f: {steps: [{say: hi}]}}\n"
    outcome = "outcome: [{failure: agent.did(done)}]\n"
    chain = "".join(f"  v{i}: v{i + 1}\n" for i in range(500)) + "  v500: 1\n"
    circle = "".join(f"  v{i}: v{(i + 1) % 500}\n" for i in range(500))
    double = "".join(f"  d{i}: d{i + 1} and d{i + 1}\n" for i in range(60)) + "  d60: t == 2\n"
    for text in (
        f"{frame}{outcome}let:\n{chain}",
        f"{frame}{outcome}let:\n{circle}",
        f"{frame}outcome: [{{failure: d0}}]\ndefine:\n{double}",
    ):
        (tmp_path / "f.yaml").write_text(scenario_with(text))
        with in_time():
            result = check(tmp_path / "f.yaml")
        assert {found.code for found in result.diagnostics} == {"S212"}
        assert len(result.diagnostics) < 20


def test_states_that_lead_to_states_within_a_step_are_walked_once(tmp_path: Path) -> None:
    """Each state has two ways to the next: 2 ** 60 ways in all."""
    states = "".join(
        f"      s{i}: {{then: [{{after: 1, goto_now: s{i + 1}}}, {{goto_now: s{i + 1}}}]}}\n"
        for i in range(60)
    )
    frame = f"frames:\n  f:\n    states:\n{states}      s60: {{do: stay}}\n"
    (tmp_path / "f.yaml").write_text(scenario_with(f"{frame}outcome: [{{failure: agent.did(done)}}]\n"))
    with in_time():
        assert not check(tmp_path / "f.yaml").has_errors


def test_a_room_of_boxes_is_looked_at_in_time(tmp_path: Path) -> None:
    """More boxes than an 8x8 room has cells for; and more bodies than any room may have."""
    frame = "frames: {f: {steps: [{say: hi}]}}\noutcome: [{failure: agent.did(done)}]\n"
    for count, code in ((60, "S601"), (130, "S106")):
        boxes = "".join(f"  o{i}: {{type: box}}\n" for i in range(count))
        (tmp_path / "f.yaml").write_text(scenario_with(f"{frame}objects:\n{boxes}"))
        with in_time():
            result = check(tmp_path / "f.yaml")
        assert {found.code for found in result.diagnostics} == {code}


# -- what reaches a terminal ---------------------------------------------------------------------------------------

_NASTY = (
    *("\x1b[31m", "\x1b]0;x\x07", "\x9b2J", "\r", "\n::error::x", "\n##[group]", "\u202e", "\u2066", "\u2028"),
    *("\x07", "\x08", "\x7f", "\x85", "\x00", "%0A::error", "\u200f", "\ufeff", "\t", "]]>", "<script>", "&amp;"),
    *("`", "${x}", "\\x1b", "é", "漢", "\U0001f600", "'", '"', "[red]", "{x}", "%s", "\x1bP", "\x1b_", "\u061c"),
    *("\ud800", "*", "?", "+", "~", "-"),
)  # fmt: skip


def hostile(count: int) -> Iterator[str]:
    """The first ones have a bit of everything in them; of many, each is tried alone too."""
    rng = random.Random(7)
    yield from ("x\n::error::x\x1b[31m\u202e%0A", "\x9b2J\r\u2028`[red]'\ud800")
    yield from _NASTY[: count - 2]
    for _ in range(count - len(_NASTY) - 2):
        yield "".join(rng.choice(_NASTY) if rng.random() < 0.5 else rng.choice("abcdoors") for _ in range(6))


def check_clean(capsys: Capture) -> None:
    captured = capsys.readouterr()
    for said in captured:
        assert said.replace("\n", "").isprintable(), repr(said)
        assert not any(line.startswith(("::error::x", "##[")) for line in said.splitlines()), said


def escaped(text: str) -> str:
    """In double quotes, so that YAML itself has nothing against it."""
    return '"' + "".join(
        c if c.isascii() and c.isprintable() and c not in '"\\' else
        f"\\x{ord(c):02x}" if ord(c) < 256 else f"\\u{ord(c):04x}" if ord(c) < 65536 else f"\\U{ord(c):08x}"
        for c in text
    ) + '"'  # fmt: skip


def attempts(text: str) -> Iterator[list[str]]:
    """Commands that have a text in a file's content, a file's name, a scenario's name and in options."""
    replaced = {
        "exit": SMALL.replace("exit", text),
        "escaped": SMALL.replace("horizon:", f"{escaped(text)}:", 1),
    }
    replaced["value"] = SMALL.replace("scenario: small", f"scenario: small\nabout: {escaped(text)}", 1)
    for name, content in replaced.items():
        Path(f"{name}.yaml").write_text(content, encoding="utf-8", errors="surrogatepass")
        yield from (["validate", f"{name}.yaml", "--format", style] for style in REPORTS)
        yield ["show", f"{name}.yaml", "--origin"]
        yield ["fmt", "--check", f"{name}.yaml"]
    named = f"{text.encode('utf-8', 'ignore').decode().replace('/', '').replace(chr(0), '')}.yaml"
    Path(named).write_text(SMALL.replace("horizon", "horizn", 1))
    yield from (["validate", f"./{named}", "--format", style] for style in REPORTS)
    Path(named).write_text(SMALL)
    yield from (["show", f"./{named}", "--origin"], ["show", f"./{named}"])
    for command in (
        "validate",
        "show",
        "trace",
        "new",
        "codes",
        "fmt",
        "evaluate",
        "coverage",
        "check",
    ):
        yield [command, text]
    yield from (
        ["run", text, "--agent", "random", "--eval-episodes", "2"],  # a file of this name is there, see above
        ["validate", f"talkitout+{text}"],
        ["validate", f"talkitout?{text}=1"],
        ["run", "--resume", text],
    )
    yield from (["validate", "x.yaml", "--format", text], [text], ["validate", "x.yaml", text])
    for option in ("--why", "--do", "--layout"):
        yield ["trace", "talkitout", "--steps", "1", option, text]


def run(command: list[str]) -> None:
    with contextlib.suppress(
        SystemExit
    ):  # argparse's way to say that something is wrong with the command itself
        main(command)


@pytest.mark.parametrize("count", [2, pytest.param(500, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])])
def test_nothing_but_text_is_printed(count: int, tmp_path: Path, monkeypatch, capsys: Capture) -> None:
    monkeypatch.chdir(tmp_path)
    for text in hostile(count):
        for command in attempts(text):
            run(command)
            check_clean(capsys)


# -- rooms that cannot be ------------------------------------------------------------------------------------------


_CONDITIONS = (
    *("anywhere", "cell(1, 1)", "each_wall(1)", "wall(top)", "column(W // 2)", "anywhere where here.x == 1"),
    *("anywhere where here.x == 1 and here.y == 2", "anywhere where not here.next_to(agent)"),
    *("anywhere where here.distance(agent) > 5", "anywhere where here.in_front_of(agent)"),
)  # fmt: skip


def crowded(rng: random.Random) -> str:
    """A scenario with more in a room, or with more conditions on its place, than there may be cells."""
    tight = rng.random() < 0.6
    conditions = _CONDITIONS if tight else ("anywhere",)
    cast = "\n".join(
        f"  c{i}: {{kind: guide, place: {rng.choice(conditions)}, facing: down}}"
        for i in range(rng.randrange(1, 4))
    )
    count = rng.randrange(1, 14 if tight else 4)
    require = rng.choice(("", "", "require: [agent.x == 1 and agent.x == 2]\n", "require: [agent.x == 1]\n"))
    return (
        "scenario: crowded\nhorizon: 5\ngrammar: {templates: [Say <noun>], nouns: [hi]}\n"
        f"room: {{size: {rng.choice((4, 4, 5, 6))}}}\n{require}"
        f"objects: {{things: {{type: box, count: {count}, place: {rng.choice(conditions)}}}}}\n"
        f"cast:\n  agent: {{place: anywhere}}\n{cast}\n"
        "outcome: [{failure: agent.did(done)}]\n"
    )


SECONDS_OF_A_RESET = 0.01
"""Of processor time, when rooms are drawn again and again until one is as required, or none is."""


def reset_in_time(env: Any, seed: int) -> None:
    """Reset twice, alike: the less of the times counts, should the machine have been busy. Raises RoomError."""
    spent, error = [], None
    for _ in range(2):
        before = time.process_time()
        try:
            env.reset(seed=seed)
        except RoomError as impossible:
            error = impossible
        spent.append(time.process_time() - before)
    assert min(spent) < SECONDS_OF_A_RESET
    if error is not None:
        raise error


@pytest.mark.parametrize(
    "count", [40, pytest.param(2000, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])]
)
def test_crowded_rooms_are_refused_or_drawn(count: int, tmp_path: Path) -> None:
    rng, refused, drawn, impossible = random.Random(8), 0, 0, 0
    file = tmp_path / "crowded.yaml"
    for _ in range(count):
        file.write_text(crowded(rng))
        with in_time():
            result = check(file)
            if result.has_errors:
                refused += 1
                continue
            env = socialai_dsl.make(str(file))
            try:
                for seed in range(3):
                    reset_in_time(env, seed)
                drawn += 1
            except RoomError:
                impossible += 1
            finally:
                env.close()
    assert refused > count // 10, (refused, drawn, impossible)
    assert drawn > count // 10, (refused, drawn, impossible)
    assert impossible > 0, (refused, drawn, impossible)


# -- no code from data ---------------------------------------------------------------------------------------------


def test_reading_a_hundred_files_executes_nothing(tmp_path: Path) -> None:
    """In a process of its own, where everything that is imported late has been before."""
    write_mistakes(tmp_path)
    program = """
import sys
from pathlib import Path
from socialai_dsl.frontend import check
from tests.fuzzing.playground import listening
files = sorted(Path(".").glob("[0-9]*.yaml"))
for name in (*files[::16], "rich.yaml", "town.yaml", "social_env"):
    check(name)
with listening() as ear:
    for file in files[::4]:
        check(file)
print(len(files[::4]), sorted(set(ear.executed)))
"""
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env=env, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    count, _, events = done.stdout.strip().partition(" ")
    assert int(count) > 80
    assert events == "[]"


_FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__"}
_FORBIDDEN_IMPORTS = {"pickle", "marshal", "shelve", "dill", "cloudpickle"}


@pytest.mark.parametrize(
    "layer", ["loader", "grammar", "schema", "semantics", "checking", "compiler", "envs", "engine"]
)
def test_the_source_has_no_way_to_execute_data(layer: str) -> None:
    for file in sorted((ROOT / "socialai_dsl" / layer).glob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                assert node.func.id not in _FORBIDDEN_CALLS, f"{file}:{node.lineno}"
            if isinstance(node, ast.Import | ast.ImportFrom):
                names = [a.name for a in node.names] + [getattr(node, "module", None) or ""]
                assert not {name.partition(".")[0] for name in names} & _FORBIDDEN_IMPORTS, (
                    f"{file}:{node.lineno}"
                )


def test_more_registers_than_an_environment_holds_are_a_finding(tmp_path: Path) -> None:
    """Each of twenty members has the 300 registers of its frame."""
    registers = "".join(f"      r{i}: {{start: 0, range: 0..9}}\n" for i in range(300))
    frame = f"frames:\n  f:\n    let:\n{registers}    states: {{s: {{}}}}\n"
    cast = "cast:\n  agent: {}\n" + "".join(f"  n{i}: {{frame: f}}\n" for i in range(20))
    outcome = "outcome: [{success: agent.next_to(n0)}]\n"
    text = f"scenario: x\nroom: {{size: 9}}\ngrammar: body\n{frame}{cast}{outcome}"
    file = tmp_path / "f.yaml"
    file.write_text(text, encoding="utf-8")
    (found,) = [d for d in check(file).diagnostics if d.severity is Severity.ERROR]
    assert (found.code, found.span.line) == ("S106", 4)
    assert found.message == "a scenario has at most 4,096 registers, this one 6,021"
