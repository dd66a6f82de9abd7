"""The compiler writes short code: what is known is worked out before, and what nobody asks for is not there.

What the code does is compared with the reference interpreter (`tests/test_agreement.py`).
"""

from __future__ import annotations

from pathlib import Path

import pytest

import socialai_dsl as sd
from socialai_dsl.program import Flag, FrameColumn, Header, Program
from tests.tiny import Folder

DOOR = "objects: {door: {type: door, at: [6, 2]}}\n"
DIE = "let: {die: pick(0..3)}\n"
COUNTS = "state: {n: 0}\n"


def ann(state: str) -> str:
    """Ann's frame has one state."""
    return (
        f"frames: {{f: {{start: a, states: {{a: {{{state}}}}}}}}}\ncast: {{ann: {{frame: f, at: [3, 3]}}}}\n"
    )


def compiled(folder: Path, text: str) -> Program:
    """The program of a tiny scenario."""
    found = sd.compile(sd.load(Folder(folder).write("tiny", text)))
    assert isinstance(found, Program)
    return found


def code(program: Program, label: str) -> str:
    """The names of the instructions at a label."""
    lines = program.listing().splitlines()
    start = lines.index(f"{label}:") + 1
    return " ".join(line.split()[1] for line in lines[start : lines.index("", start)])


CUT = "MAX MIN LOAD"
"""A value is cut to the range of its register."""

CODE: dict[str, tuple[str, str, str]] = {
    "a link changes only what has to change": (
        "objects: {door: {type: door, at: [6, 2], state: locked}, key: {type: switch, at: [1, 0], unlocks: door}}",
        "links",
        "IF_EQ IF_EQ IF_EQ BECOME HALT",
    ),
    "whoever is held back is free again": (
        "objects: {chests: {type: box, count: 2, exclusive: true, at: [[2, 3], [4, 3]]}}",
        "links",
        "LOAD IF_NE LOAD SET_FIELD LOAD IF_NE LOAD SET_FIELD HALT",
    ),
    "a status that may change is settled": (
        DIE + "objects: {door: {type: door, at: [6, 2], locked: die == 2}}",
        "settle",
        "IF_EQ IF_NE BECOME HALT IF_EQ BECOME HALT",
    ),
    "the rest of a rule is deferred": (
        DOOR + ann("first: [{do: forward, cause: door.open, say: Here}]"),
        "ann.f.deferred",
        "IF_EQ LOAD BECOME SAY HALT HALT",
    ),
    "a kept value is cut to what can be said": (
        ann("first: [{do: forward, say: 'At <self.x>'}]"),
        "ann.f.deferred",
        "IF_EQ MAX MIN LOAD LOAD SAY HALT HALT",
    ),
    "a room is as required": (
        DIE + "require: [die > 1, die != 3]",
        "require",
        "IF_LT IF_NE LOAD HALT",
    ),
    "one of several numbers is one look at a set": (
        DIE + COUNTS + "rules: [{when: die == 1 or die == 3, set: {n: 1}}]",
        "rules",
        f"IF_BIT LOAD COUNT {CUT} HALT",
    ),
    "a table that counts on is a sum": (
        DIE + COUNTS + "tables: {w: {0: 5, 1: 6, 2: 7, 3: 8}}\nrules: [{when: t > 1, set: {n: w(die)}}]",
        "rules",
        f"IF_LT ADD MAX MIN COUNT {CUT} HALT",
    ),
    "one act is remembered by two loads": (
        "memory: {acts: {last: 1, of: agent.acts}}\nlet: {d: {sequence: 1, moves: [left, right]}}\n"
        + COUNTS
        + "rules: [{when: acts == d, set: {n: 1}}]",
        "rules",
        f"LOAD LOAD ADD MIN IF_EQ IF_EQ IF_EQ LOAD COUNT {CUT} HALT",
    ),
    "a belief": (
        "cast: {ann: {at: [3, 3], beliefs: {near: {of: next_to(agent)}}}}",
        "ann.believes",
        "LOAD IF_NEXT_TO LOAD LOAD HALT",
    ),
    "a dance": (
        "let: {d: {sequence: 1, moves: [left, right]}}\n" + ann("do: perform(d)"),
        "ann.f.a.do",
        "IF_EQ BODY IF_NE MAX ADD SAY HALT BODY HALT",
    ),
}


@pytest.mark.parametrize("name", CODE)
def test_code(name: str, tmp_path: Path) -> None:
    text, label, expected = CODE[name]
    assert code(compiled(tmp_path, text), label) == expected


@pytest.mark.parametrize(
    ("text", "instruction"),
    [
        (
            "let: {hue: pick(c in colors where c != red)}\nobjects: {o: {type: ball, color: hue}}",
            "DRAW_OTHER",
        ),
        ("let: {n: count(c in cells where c.x == 2)}", "B_RECT"),
        ("let: {n: count(c in cells where c.x == 2)}", "no EACH_CELL"),
        ("objects: {rug: {type: floor, place: anywhere}}", "B_FREE"),
        ("objects: {rug: {type: floor, place: anywhere, overlap: true}}", "no B_FREE"),
    ],
)
def test_code_of_a_reset(text: str, instruction: str, tmp_path: Path) -> None:
    written, (no, _, op) = code(compiled(tmp_path, text), "reset").split(), instruction.rpartition(" ")
    assert (op in written) is (no != "no")


EACH_STEP = (
    *(Header.BEFORE_PC, Header.RULES_PC, Header.SETTLE_PC, Header.LINKS_PC, Header.TICK_PC),
    Header.REQUIRE_PC,
)


@pytest.mark.parametrize(
    ("text", "has"),
    [
        ("", []),
        (DOOR, []),
        ("objects: {lever: {type: lever, at: [1, 0]}}", []),
        ("objects: {lever: {type: lever, at: [1, 0], timer: 3}}", [Header.TICK_PC]),
        (DIE + "objects: {ball: {type: ball, at: [3, 3], tagged: die == 2}}", []),
        (COUNTS + "rules: [{when: prev(t) == 2, set: {n: 1}}]", [Header.BEFORE_PC, Header.RULES_PC]),
    ],
    ids=["nothing", "no link", "no timer", "a timer", "known at reset", "prev"],
)
def test_what_is_done_in_each_step(text: str, has: list[Header], tmp_path: Path) -> None:
    program = compiled(tmp_path, text)
    assert [word for word in EACH_STEP if program.header(word)] == has


@pytest.mark.parametrize(
    ("text", "registers"),
    [
        (ann("first: [{do: forward}]"), []),
        (ann("first: [{do: forward, once: true}]"), ["ann.fired.ann.f.a.first[0]"]),
        (DOOR + ann("first: [{do: forward, cause: door.open}]"), ["ann.pending"]),
        (DOOR + ann("first: [{do: forward, cause: door.put(self.cell)}]"), ["ann.kept[0]", "ann.pending"]),
        (DOOR + "rules: [{when: t == 3, cause: door.reset}]", []),
        (
            DOOR + "rules: [{when: t == 3, cause: door.reset}, {when: t == 5, cause: door.vanish}]",
            ["door.reset.home", "door.reset.home.gone"],
        ),
        (ann("then: [{say: Say hello}]"), []),
        (
            ann("then: [{say: Say hello}]") + COUNTS + 'rules: [{when: ann.said("Say hello"), set: {n: 1}}]',
            ["ann.said"],
        ),
    ],
)
def test_what_is_kept_between_steps(text: str, registers: list[str], tmp_path: Path) -> None:
    paths = [name.path for name in compiled(tmp_path, text).registers]
    found = [
        path for path in paths if any(word in path for word in ("pending", "kept", "home", "said", "fired"))
    ]
    assert found == registers


@pytest.mark.parametrize(
    ("asked", "keeps"),
    [("say: You", 0), ("say: 'You, <speaker.name>'", Flag.HEARD_BY), ("say: 'You <noun>'", Flag.HEARD_BY)],
)
def test_inboxes_hold_who_spoke_only_where_somebody_asks(asked: str, keeps: int, tmp_path: Path) -> None:
    text = ann(f"then: [{{hears: 'Say <noun>', {asked}}}, {{when: t == 5, say: Say bye}}]")
    text = text.replace("cast: {", "cast: {bob: {frame: f, at: [4, 4]}, ")
    program = compiled(tmp_path, text)
    assert program.header(Header.FLAGS) & Flag.HEARD_BY == keeps


def test_only_who_believes_perceives(tmp_path: Path) -> None:
    def perceives(text: str) -> bool:
        return bool(compiled(tmp_path, text).table(Header.FRAME_AT)[0, FrameColumn.PERCEIVE])

    assert not perceives(ann("do: stay"))
    assert perceives("cast: {ann: {at: [3, 3], beliefs: {near: {of: next_to(agent)}}}}")


ABOUT = """
objects:
  lamp: {{type: ball, at: [5, 5], tagged: "{}"}}
  door: {{type: door, at: [6, 2]}}
  box: {{type: ball, at: [3, 5]}}
  switches: {{type: switch, at: [[1, 0], [2, 0]]}}
let: {{die: pick(0..3)}}
state: {{written: 0}}
rules: [{{when: t == 3, set: {{written: 1}}}}, {{when: t == 5, cause: box.vanish}}]
frames: {{f: {{start: a, states: {{a: {{do: {}}}}}}}}}
cast: {{guide: {{frame: f, at: [4, 3]}}, statue: {{at: [4, 5]}}}}
"""
"""The guide turns and the statue does nothing; the box vanishes; nothing but a condition changes the lamp."""

NEVER = (
    *("die == 2", "W == 6", "agent.color == red", "statue.x == 2", "statue.facing == up", "guide.x == 3"),
    *("statue.distance(door) < 3", "statue.next_to(door)", "statue.faces(door)", "statue.sees(door)"),
    "any(c in cells where c.next_to(door))",
)
MARKED = (
    *("written == 1", "box.y == 2", "box.gone", "statue.distance(box) < 3", "statue.unobstructed(door)"),
    *("statue.looks_at(door)", "die == 2 and any(s in switches where s.pressed)"),
    *("not any(s in switches where s.pressed)", "nearest(s in switches to statue).pressed"),
)
ALWAYS = (
    *("t == 2", "agent.spoke", "agent.action == left", "prev(t) == 2", "agent.x == 2", "agent.next_to(door)"),
    *("guide.facing == up", "guide.faces(door)", "guide.looks_at(door)", "guide.sees(door)", "guide.is(a)"),
    *("statue.eye_contact(guide)", "statue.in_front_of(guide)", "statue.can_reach(door)"),
    *(
        "statue.sees(agent)",
        "any(c in cells where c.next_to(agent))",
        "nearest(s in switches to agent).pressed",
    ),
)


@pytest.mark.parametrize(
    ("condition", "when"),
    [(one, when) for when, all_ in enumerate((NEVER, MARKED, ALWAYS)) for one in all_],
)
def test_a_status_is_settled_when_it_can_change(condition: str, when: int, tmp_path: Path) -> None:
    """0: by the reset; 1: after a status, place or register was changed that it reads; 2: in every step."""
    assert settled(compiled(tmp_path, ABOUT.format(condition, "turn_to(down)"))) == when


@pytest.mark.parametrize(("do", "when"), [("stay", 0), ("left", 0), ("forward", 2), ("go_to(door)", 2)])
def test_only_who_walks_changes_a_place(do: str, when: int, tmp_path: Path) -> None:
    assert settled(compiled(tmp_path, ABOUT.format("guide.x == 3", do))) == when


def settled(program: Program) -> int:
    """How often a status is settled, of 0 to 2."""
    always = program.header(Header.FLAGS) & Flag.SETTLE_ALWAYS
    return bool(program.header(Header.SETTLE_PC)) + bool(always)
