"""Files of any size that ask as much as they can of what reads them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Bomb:
    """A file that grows.

    Attributes:
        text: size -> content. most: the largest size that is looked at, within the limits of files or just beyond.
    """

    text: Callable[[int], str]
    most: int


def _each(count: int, part: Callable[[int], str], between: str = "") -> str:
    return between.join(part(i) for i in range(count))


def _scenario(
    rest: str = "",
    *,
    room: str = "{size: 8}",
    cast: str = "{agent: {}}",
    outcome: str = "[{failure: agent.did(done)}]",
    grammar: str = "{templates: [Say <noun>], nouns: [hi]}",
) -> str:
    return f"scenario: bomb\nhorizon: 5\ngrammar: {grammar}\nroom: {room}\ncast: {cast}\noutcome: {outcome}\n{rest}"


def _listed(count: int, part: Callable[[int], str], indent: str = "") -> str:
    return "\n" + _each(count, lambda i: f"{indent}{part(i)}\n")


def _frame(states: str) -> str:
    return _scenario(f"frames:\n  f:\n    states:{states}", cast="{agent: {}, a: {frame: f}}")


def _rules(count: int, rule: Callable[[int], str]) -> str:
    return _frame("\n      s:\n        then:" + _listed(count, lambda i: f"- {{{rule(i)}}}", "        "))


DOCUMENTS: dict[str, Bomb] = {
    "block lists in each other": Bomb(lambda n: "- " * n, 64_000),
    "lists in each other": Bomb(lambda n: "[" * n, 64_000),
    "mappings in each other": Bomb(lambda n: "{a: " * n, 64_000),
    "keys of keys": Bomb(lambda n: "? " * n, 64_000),
    "a long word": Bomb(lambda n: "a: " + "x" * n, 1_000_000),
    "a text of words": Bomb(lambda n: "a: " + "x " * n, 500_000),
    "a text of lines": Bomb(lambda n: "a:" + " x\n " * n, 250_000),
    "a quoted text": Bomb(lambda n: 'a: "' + "x" * n + '"', 1_000_000),
    "a quote that is not closed": Bomb(lambda n: 'a: "' + "x\n" * n, 500_000),
    "escapes": Bomb(lambda n: 'a: "' + "\\u0041" * n + '"', 160_000),
    "a block of text": Bomb(lambda n: "a: |\n" + "  x\n" * n, 240_000),
    "keys": Bomb(lambda n: _each(n, lambda i: f"k{i}: 1\n"), 24_000),
    "keys on a line": Bomb(lambda n: "{" + _each(n, lambda i: f"k{i}: 1, ") + "}", 24_000),
    "items": Bomb(lambda n: "- 1\n" * n, 48_000),
    "comments": Bomb(lambda n: "#\n" * n, 500_000),
    "documents": Bomb(lambda n: "---\n" * n, 250_000),
    "anchors": Bomb(lambda n: "[" + _each(n, lambda i: f"&a{i} 1,") + "]", 24_000),
    "aliases": Bomb(lambda n: "[" + "*a, " * n + "]", 24_000),
    "tags": Bomb(lambda n: "- !!a 1\n" * n, 24_000),
    "merge keys": Bomb(lambda n: "<<: 1\n" * n, 24_000),
    "one key": Bomb(lambda n: "k: 1\n" * n, 24_000),
    "tag directives": Bomb(lambda n: _each(n, lambda i: f"%TAG !a{i}! x\n") + "---\n1", 50_000),
    "doubtful words": Bomb(lambda n: "- yes\n" * n, 24_000),
    "digits and underscores": Bomb(lambda n: "- " + "1_" * n + "x", 5_000),
    "minutes": Bomb(lambda n: "- " + "1:" * n, 5_000),
    "control characters": Bomb(lambda n: "a\x01\n" * n, 250_000),
}
"""What reading a document meets."""

SCENARIOS: dict[str, Bomb] = {
    "templates": Bomb(
        lambda n: _scenario(
            grammar="{nouns: [hi], templates: [" + _each(n, lambda i: f"T{i} <noun>, ") + "]}"
        ),
        64,
    ),
    "nouns": Bomb(
        lambda n: _scenario(
            grammar="{templates: [Say <noun>], nouns: [" + _each(n, lambda i: f"n{i}, ") + "]}"
        ),
        256,
    ),
    "outcomes": Bomb(lambda n: _scenario(outcome=_listed(n, lambda i: f"- failure: t == {i}")), 4_000),
    "wrong outcomes": Bomb(lambda n: _scenario(outcome=_listed(n, lambda i: f"- failure: t{i} ==")), 4_000),
    "long conditions": Bomb(
        lambda n: _scenario(
            outcome=_listed(n, lambda i: f"- failure: {' and '.join(['t == 1'] * 45)} or t == {i}")
        ),
        400,
    ),
    "tests": Bomb(
        lambda n: _scenario("tests:" + _listed(n, lambda i: f"t{i}: {{play: [{{do: Say hi}}]}}", "  ")), 4_000
    ),
    "wrong tests": Bomb(
        lambda n: _scenario("tests:" + _listed(n, lambda i: f"t{i}: {{play: [{{do: Sai h{i}}}]}}", "  ")),
        2_000,
    ),
    "tests of variants": Bomb(
        lambda n: _scenario(
            "tests:" + _listed(n, lambda i: f"t{i}: {{of: +v{i}, play: [{{do: left}}]}}", "  ")
        ),
        100,
    ),
    "conditions of a test": Bomb(
        lambda n: _scenario(
            "tests: {a: {play: [{true: [" + _each(n, lambda i: f"prev(t) == {i}, ") + "]}]}}\n"
        ),
        1_000,
    ),
    "acts of a test": Bomb(
        lambda n: _scenario("tests: {a: {play: [{do: [" + _each(n, lambda i: "Say hi, ") + "]}]}}\n"), 20_000
    ),
    "draws": Bomb(lambda n: _scenario("let:" + _listed(n, lambda i: f"v{i}: pick(1..9)", "  ")), 4_000),
    "draws in braces": Bomb(
        lambda n: _scenario("let: {" + _each(n, lambda i: f"v{i}: pick(1..9), ") + "}\n"), 4_000
    ),
    "draws that lead to those above": Bomb(
        lambda n: _scenario(
            "let:" + _listed(n, lambda i: f"v{i}: {f'v{i - 1}' if i else 'pick(1..3)'}", "  ")
        ),
        4_000,
    ),
    "draws that lead to those below": Bomb(
        lambda n: _scenario(
            "let:" + _listed(n, lambda i: f"v{i}: v{i + 1}", "  ") + "  v" + str(n) + ": 1\n"
        ),
        4_000,
    ),
    "draws in a circle": Bomb(
        lambda n: _scenario("let:" + _listed(n, lambda i: f"v{i}: v{(i + 1) % n}", "  ")), 4_000
    ),
    "definitions that lead to one another": Bomb(
        lambda n: _scenario(
            "define:" + _listed(n, lambda i: f"d{i}: d{i + 1} and t == 1", "  ") + f"  d{n}: t == 2\n",
            outcome="[{failure: d0}]",
        ),
        2_000,
    ),
    "definitions that double": Bomb(
        lambda n: _scenario(
            "define:" + _listed(n, lambda i: f"d{i}: d{i + 1} and d{i + 1}", "  ") + f"  d{n}: t == 2\n",
            outcome="[{failure: d0}]",
        ),
        2_000,
    ),
    "misspelt names among many": Bomb(
        lambda n: _scenario(
            "let:" + _listed(n, lambda i: f"value{i}: pick(1..9)", "  "),
            outcome=_listed(n, lambda i: f"- failure: valeu{i} == 1"),
        ),
        4_000,
    ),
    "misspelt utterances": Bomb(lambda n: _rules(n, lambda i: f"hears: Yas hi {i}, say: ok"), 2_000),
    "unknown keys": Bomb(lambda n: _scenario(_each(n, lambda i: f"outcme{i}: 1\n")), 8_000),
    "registers": Bomb(
        lambda n: _scenario("state:" + _listed(n, lambda i: f"r{i}: {{start: 0, range: 0..9}}", "  ")), 4_000
    ),
    "registers that set one another": Bomb(
        lambda n: _scenario(
            "state:"
            + _listed(n, lambda i: f"r{i}: 0", "  ")
            + "rules:"
            + _listed(n, lambda i: f"- {{when: t == 1, set: {{r{i}: {f'r{i - 1}' if i else '1'}}}}}")
        ),
        600,
    ),
    "rules of the world": Bomb(
        lambda n: _scenario(
            "state: {score: {start: 0, range: 0..9}}\nrules:"
            + _listed(n, lambda i: f"- {{id: r{i}, when: t == {i}, set: {{score: 1}}}}")
        ),
        2_000,
    ),
    "objects": Bomb(
        lambda n: _scenario("objects:" + _listed(n, lambda i: f"o{i}: {{type: box}}", "  ")), 120
    ),
    "too many objects": Bomb(
        lambda n: _scenario("objects:" + _listed(n, lambda i: f"o{i}: {{type: box}}", "  ")), 4_000
    ),
    "places in rooms of many sizes": Bomb(
        lambda n: _scenario(
            "objects:"
            + _listed(n, lambda i: f"o{i}: {{type: box, place: anywhere where here.x != {i % 9}}}", "  "),
            room="{size: 4..30}",
        ),
        120,
    ),
    "members of the cast": Bomb(
        lambda n: _scenario(cast="\n  agent: {}" + _listed(n, lambda i: f"c{i}: {{kind: guide}}", "  ")), 120
    ),
    "frames": Bomb(
        lambda n: _scenario("frames:" + _listed(n, lambda i: f"f{i}: {{steps: [{{say: hi {i}}}]}}", "  ")),
        4_000,
    ),
    "states": Bomb(
        lambda n: _frame(
            _listed(n, lambda i: f"s{i}: {{then: [{{hears: Say hi, goto: s{(i + 1) % n}}}]}}", "      ")
        ),
        2_000,
    ),
    "states that nobody enters": Bomb(
        lambda n: _frame(_listed(n, lambda i: f"s{i}: {{do: stay}}", "      ")), 4_000
    ),
    "states within a step": Bomb(
        lambda n: _frame(
            _listed(
                n,
                lambda i: (
                    f"s{i}: {{then: [{{after: 1, goto_now: s{i + 1}}}, {{after: 2, goto_now: s{i + 1}}}]}}"
                ),
                "      ",
            )
            + f"      s{n}: {{do: stay}}\n"
        ),
        1_000,
    ),
    "states round within a step": Bomb(
        lambda n: _frame(
            _listed(n, lambda i: f"s{i}: {{then: [{{hears: Say hi, goto_now: s{(i + 1) % n}}}]}}", "      ")
        ),
        2_000,
    ),
    "rules of a state": Bomb(
        lambda n: _rules(n, lambda i: f"hears: Say hi, when: t == {i}, say: hi {i}"), 2_000
    ),
    "rules that never fire": Bomb(lambda n: _rules(n, lambda i: f"hears: Say hi, say: hi {i}"), 2_000),
    "requirements": Bomb(
        lambda n: _scenario("require:" + _listed(n, lambda i: f"- agent.x != {i + 9}")), 2_000
    ),
    "slots": Bomb(
        lambda n: _scenario(
            "frames:\n  f:\n    slots: {"
            + _each(n, lambda i: f"s{i}: text, ")
            + "}\n    steps:"
            + _listed(n, lambda i: f"- say: <s{i}>", "    "),
            cast="\n  agent: {}\n  a:\n    frame: f\n    with: {" + _each(n, lambda i: f"s{i}: hi, ") + "}",
        ),
        1_000,
    ),
    "changes of a variant": Bomb(
        lambda n: "variant: bomb\nof: small.yaml\nset:" + _listed(n, lambda i: f"let.v{i}: 1", "  "), 4_000
    ),
    "changes that lead nowhere": Bomb(
        lambda n: "variant: bomb\nof: small.yaml\nset:" + _listed(n, lambda i: f"lett.v{i}: 1", "  "), 4_000
    ),
    "additions of a variant": Bomb(
        lambda n: (
            "variant: bomb\nof: small.yaml\nadd:\n  outcome:"
            + _listed(n, lambda i: f"- failure: t == {i}", "  ")
        ),
        2_000,
    ),
    "members of a suite": Bomb(
        lambda n: (
            "suite: bomb\nmembers:"
            + _listed(n, lambda i: f"- {{scenario: small.yaml, name: m{i}, set: {{horizon: {i + 1}}}}}")
        ),
        64,
    ),
    "leaves of a tree": Bomb(
        lambda n: (
            "suite: bomb\ntree:\n  scenario: small.yaml\n  a:"
            + _listed(n, lambda i: f"v{i}: {{set: {{horizon: {i + 1}}}}}", "    ")
        ),
        256,
    ),
}
"""What checking a scenario meets, in the folder of the playground."""
