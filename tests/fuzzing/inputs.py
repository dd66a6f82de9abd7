"""What the fuzzing starts from, and a way to change it that needs nothing but a seed."""

from __future__ import annotations

import random
import re
from pathlib import Path

from tests.fuzzing.playground import DIAGNOSTICS, ROOT
from tests.slips import SLIPS

WORDS = (
    *("scenario: ", "variant: ", "suite: ", "npc: ", "library: ", "extends: ", "of: ", "one_of: ", "members: "),
    *("set:\n  ", "add:\n  ", "remove: ", "params: ", "abstract: true\n", "check: ", "require: ", "leaves: "),
    *("frames: ", "cast: ", "objects: ", "outcome:\n- ", "let: ", "grammar: ", "room: {size: 5..8}\n"),
    *("hears: ", "when: ", "then:\n- ", "goto: ", "do: ", "until: ", "agent", "doors", "npc_defaults: "),
    *("../", "../outside/secret.yaml", "guides/../../outside/secret.yaml", "link.yaml", "linked/secret.yaml"),
    *("small.yaml", "rich", "small+x", "?n=1", "*", "/etc/passwd", "loop.yaml", "fuzz.yaml", "talkitout+unsocial"),
    *("- ", "  ", "\n", "\r\n", "\t", ": ", "? ", "{", "}", "[", "]", ", ", "'", '"', "|\n  ", ">-\n  ", "# "),
    *("&a ", "*a", "<<: ", "!!int ", "!x ", "%YAML 1.1\n---\n", "---\n", "...\n", "%", "`", "@", "\\", '"\\u202e"'),
    *('"\\e[31m"', '"\\x00"', "\u202e", "\u2028", "\x1b", "\x00", "é", "漢", "\U0001f600", "\ufeff", "\x85"),
    *("yes", "~", "010", "0x1F", "1:30", "1e3", ".inf", "2024-01-31", "99999999999", "-1", "0.5", "null", "true"),
    *("$x", "$$", "<noun>", "<", ">", "5..8", "..", "1..", "pick(", "first(", "any(d in doors where ", "prev(", "(("),
    *(" and ", " or ", "not ", " == ", " = ", "&& ", "here", "it", "cells", "W - 1", "socialai: ignore=W306"),
)  # fmt: skip
"""Words that a file is made of, or is broken with."""

EXPRESSIONS = (
    'agent.next_to(exit) and agent.said("Open sesame")',
    "any(d in doors where d != exit and agent.next_to(d))",
    "pick(n in John | Jack where n != honest.name)",
    "anywhere where not here.in_front_of(doors)",
    "count(c in cells where c.x == W // 2 - 1) >= -3 and not t == 4",
    "Go to the <pick(d in doors where d != exit).color> door.",
    "1..3 | left | <noun>",
    "$n * (2 + W % 3)",
)


_NAMING = ("extends", "of", "members")


_VALUE = re.compile(rb"(?<=: )[^\n,{}\[\]]+(?=[,}\]\n])")
"""The value of a key, up to the end of its entry."""


def seeds(target: str) -> list[bytes]:
    """What a target starts from: texts as people write them, right ones and wrong ones."""
    if target == "expression":
        return [text.encode() for text in EXPRESSIONS]
    files = [*sorted(DIAGNOSTICS.glob("*.yaml")), *sorted((ROOT / "scenarios").rglob("*.yaml"))]
    return [*(text.encode() for text in SLIPS.values()), *(path.read_bytes() for path in files)]


def write_corpus(folder: Path, target: str) -> None:
    """The seeds as files, as fuzzers take them: of whole scenarios a few, since each takes long when it is watched."""
    given = seeds(target)
    if target == "whole":
        given = sorted((seed for seed in given if b"members:" not in seed), key=len)[::8][:50]
    for number, seed in enumerate(given):
        (folder / f"{number:04}").write_bytes(seed)


def write_dictionary(file: Path) -> None:
    """The words in the format of libFuzzer and AFL."""
    lines = ("".join(f"\\x{byte:02x}" for byte in word.encode("utf-8", "surrogatepass")) for word in WORDS)
    file.write_text("".join(f'"{line}"\n' for line in lines))


def mutated(seed: bytes, other: bytes, rng: random.Random) -> bytes:
    """A seed with one to four changes: words put in, parts taken out, repeated, moved in from another one."""
    for _ in range(rng.choice((1, 1, 2, 3, 4))):
        seed = _changed(seed, other, rng)
    return seed


def _changed(seed: bytes, other: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(seed) + 1)
    if rng.random() < 0.6 and (ends := [found.end() for found in re.finditer(rb"[ :,{\[\n]", seed)]):
        at = rng.choice(ends)  # where a word begins
    match rng.randrange(11):
        case 0 | 1:
            return seed[:at] + rng.choice(WORDS).encode("utf-8") + seed[at:]
        case 2:
            return seed[:at] + seed[at + rng.choice((1, 2, 8, 40)) :]
        case 3:
            word = rng.choice(WORDS).encode("utf-8")
            return seed[:at] + word * rng.choice((2, 30, 33, 40, 2000)) + seed[at:]
        case 4:
            begin = rng.randrange(len(other) + 1)
            return seed[:at] + other[begin : begin + rng.choice((4, 30, 200))] + seed[at:]
        case 5:
            end = seed.find(b"\n", at)
            start = seed.rfind(b"\n", 0, at) + 1
            line = seed[start : end + 1 if end >= 0 else len(seed)]
            return seed[:start] + line + seed[start:]
        case 6 if entries := list(re.finditer(rb"[\w-]+: [^,{}\[\]\n]*, ", seed)):
            entry = rng.choice(entries)
            return seed[: entry.end()] + entry.group() + seed[entry.end() :]
        case 7 if values := list(_VALUE.finditer(seed)):
            value, depth = rng.choice(values), rng.choice((5, 30, 31, 32, 33, 2000))
            opened, closed = rng.choice(((b"[", b"]"), (b"{a: ", b"}")))
            written = rng.choice((rng.choice(WORDS).encode(), opened * depth + closed * depth))
            return seed[: value.start()] + written + seed[value.end() :]
        case 8:
            key, file = (
                rng.choice(_NAMING),
                rng.choice([word for word in WORDS if "yaml" in word or "." in word]),
            )
            first = seed.find(b"\n") + 1
            return seed[:first] + f"{key}: {file}\n".encode() + seed[first:]
        case 9 if numbers := list(re.finditer(rb"(?<![\w.])\d{1,4}(?![\w.]{2})", seed)):
            number = rng.choice(numbers)
            other_number = max(0, int(number.group()) + rng.choice((-1, 1)))
            return seed[: number.start()] + str(other_number).encode() + seed[number.end() :]
        case _:
            word = rng.choice(WORDS).encode("utf-8")
            end = at + len(re.match(rb"[\w./<>+-]*", seed[at:])[0])  # type: ignore[index]
            return seed[:at] + word + seed[end:]
