"""Whatever number an author writes or lets be reached: it is refused where it stands, or kept exactly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.frontend import load
from socialai_dsl.widths import LARGEST_NUMBER
from tests.agreement import Pair

BASE = """\
scenario: numbers
horizon: {horizon}
earshot: room
actions: [left, right, forward, toggle]
grammar: {{templates: [Say <noun>], nouns: [hello, bye]}}
room: {{size: 8}}
objects:
  doors: {{type: door, count: 2, place: each_wall(2), color: distinct}}
  lever: {{type: lever, place: anywhere, timer: {timer}}}
{parts}
cast:
  agent: {{}}
  bob: {{frame: talk{belief}}}
outcome:
  - success: agent.at(first(d in doors where d.index == 0))
"""
TALK = "frames: {talk: {states: {s: {then: [{hears: any, say: Hi}]}}}}\n"

STATE, RULES, STATES = "state: {%s}\nrules: [{%s}]", "rules: [{%s}]", "frames: {talk: {%s}}"
HEARD = "states: {s: {then: [{hears: any, %s}]}}"
PLACES = {
    "a constant": "let: {k: N}\nrules: [{when: k > t, reward: 2}]",
    "a draw": "let: {k: pick(N - 1 | N)}\nrules: [{when: k >= N, reward: 2}]",
    "a range": STATE % ("m: {start: 0, range: 0..N}", "set: {m: m + 10000}"),
    "a range below zero": STATE % ("m: {start: 0, range: -N..0}", "set: {m: m - 10000}"),
    "a start": STATE % ("m: N", "set: {m: 'max(0, m - 1)'}"),
    "nothing beside it": STATE % ("m: {start: none, range: -N..N}", "when: t % 2 == 0, set: {m: N - t}"),
    "a sum": STATE % ("m: 0", "set: {m: 'min(m + N, N)'}"),
    "a growing sum": STATE % ("m: 0", "set: {m: m + N}"),
    "a square": STATE % ("m: 0, q: 0", "set: {m: m + 1, q: m * m * N}"),
    "a double": STATE % ("m: N", "set: {m: m * 2}"),
    "a remainder": STATE % ("m: 7", "set: {m: (m * 48271 + N) % 65536}"),
    "a key": "let: {k: pick(N - 1 | N)}\n" + STATE % ("s: {start: 5, for: N - 1..N}", "set: {s(k): 7}"),
    "a key below zero": "let: {k: pick(0 | 1)}\n"
    + STATE % ("s: {start: 5, for: -N..1 - N}", "set: {s(k - N): 7}"),
    "a key from far": STATE
    % ("m: {start: 1, range: 0..N}, s: {start: 5, for: 1..3}", "set: {s(m): 7, m: m + N // 2}"),
    "the step before": STATE % ("m: {start: 0, range: 0..9}", "when: prev(m * N) >= 3 * N, set: {m: 1}"),
    "a table": "tables: {w: {red: N, green: 1, blue: 2, purple: 3, yellow: 4, grey: 5}}\n"
    + STATE % ("m: 0", "set: {m: w(lever.color)}"),
    "a comparison": RULES % "when: t * N > 5 * N, reward: 2",
    "a cell": RULES % "when: agent.x < N, reward: 2",
    "a reward": RULES % "when: t > 1, reward: N",
    "a distance": RULES % "when: agent.distance(lever) < N, reward: 2",
    "some of a group": STATE
    % (
        "s: {for: doors, start: 0, range: -N..N}",
        "set: {s(those(d in doors where d.color != red)): s(d) + N}",
    ),
    "turns": STATES % "states: {s: {then: [{after: N, say: Hi}]}}",
    "a duration": STATES % "steps: [{do: stay, for: N}, {say: Hi}]",
    "rounds": STATES % "steps: [{repeat: N, steps: [{say: Hi}]}]",
    "a text": STATE % ("m: {start: 0, range: 0..N}", "set: {m: m + 1}")
    + "\n"
    + STATES % (HEARD % "say: 'It is <m>'"),
    "a frame's own": STATES % ("let: {m: {start: N, range: 0..N}}, " + HEARD % "set: {m: m - 1}, say: Hi"),
}
EDGES = [
    1,
    *(2**bits + more for bits in (8, 15, 16, 19) for more in (-1, 0)),
    LARGEST_NUMBER - 1,
    LARGEST_NUMBER,
    LARGEST_NUMBER + 1,
    *(2**bits + more for bits in (31, 32) for more in (-1, 0)),
    10**10,
    10**18,
    10**30,
]


def played(path: Path, text: str) -> bool:
    """Whether a scenario is accepted; then it is played beside the reference interpreter."""
    path.write_text(text, encoding="utf-8")
    try:
        loaded = load(str(path))
    except ScenarioError as error:
        found = error.diagnostics
    else:
        Pair.of(loaded, number_words=False).play(3, 0, np.random.default_rng(0))
        return True
    assert all(d.span.file == str(path) for d in found)
    return False


@pytest.mark.parametrize("place", PLACES)
def test_a_number_is_refused_or_kept_exactly(tmp_path: Path, place: str) -> None:
    accepted = []
    for number in EDGES:
        parts = PLACES[place].replace("N", str(number))
        parts = parts if "frames:" in parts else TALK + parts
        text = BASE.format(horizon=12, timer=3, parts=parts, belief="")
        accepted.append(played(tmp_path / "numbers.yaml", text))
    assert accepted[0], "even 1 is refused"
    assert not accepted[-1], "larger than 64 bits"


@pytest.mark.parametrize("number", [-1, 0, 2**15, 10_001, 2**31, 10**30])
@pytest.mark.parametrize("key", ["horizon", "timer"])
def test_a_number_of_steps_is_refused_where_it_does_not_fit(tmp_path: Path, key: str, number: int) -> None:
    text = BASE.format(**{"horizon": 12, "timer": 3, key: number}, parts=TALK, belief="")
    assert not played(tmp_path / "numbers.yaml", text)


@pytest.mark.parametrize("number", [0, 2**15, 10**30])
def test_forgetting_lasts_within_the_horizon(tmp_path: Path, number: int) -> None:
    belief = f", beliefs: {{x: {{of: lever.color, when: sees(lever), start: none, forget: {number}}}}}"
    text = BASE.format(horizon=12, timer=3, parts=TALK, belief=belief)
    assert not played(tmp_path / "numbers.yaml", text)


def chain(length: int) -> str:
    """Registers each of which takes the value of the one before."""
    names = ", ".join(f"r{k}: 0" for k in range(length))
    sets = ", ".join(["r0: 'min(r0 + 1, 5)'", *(f"r{k}: r{k - 1}" for k in range(1, length))])
    return f"state: {{{names}}}\nrules: [{{set: {{{sets}}}}}]"


@pytest.mark.parametrize("length", [2, 13, 14, 40])
def test_registers_that_follow_from_each_other_do_not_grow_without_end(tmp_path: Path, length: int) -> None:
    text = BASE.format(horizon=60, timer=3, parts=TALK + chain(length), belief="")
    assert played(tmp_path / "numbers.yaml", text)
