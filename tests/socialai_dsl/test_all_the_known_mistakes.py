"""The mistakes that authors were seen to make, each in a shipped scenario: found at its place, with the word meant."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest

from socialai_dsl.diagnostics import Diagnostic
from socialai_dsl.frontend import check
from socialai_dsl.loader.library import shipped_folder


@dataclass(frozen=True)
class Mistake:
    """One slip, and what has to be said of it.

    Attributes:
        file: the shipped file, without its ending. right: what it says. wrong: what is written instead.
        place: the part of `wrong` that the finding begins at.
        code, suggestion: of the one finding.
        says: words that its message or its help have.
        checked: the scenario to check, if it is another than the file.
    """

    file: str
    right: str
    wrong: str
    place: str
    code: str
    suggestion: str | None = None
    says: tuple[str, ...] = ()
    checked: str | None = None


BARGAIN = "when: agent.noun < least - 1 and insulted >= patience, say: Goodbye, goto: gone}"
JOKE = "when: agent.noun < least - 1, say: You must be joking, set: {insulted: insulted + 1}}"

MISTAKES = {
    "01 a key misspelt": Mistake("talkitout", "horizon: 100", "horizont: 100", "horizont", "S101", "horizon"),
    "02 a name misspelt": Mistake(
        "talkitout", "next_to(exit)", "next_to(exitt)", "exitt", "S201", "exit", ("let, line 21",)
    ),
    "03 a state misspelt": Mistake(
        "talkitout", "goto: acquainted", "goto: aquainted", "aquainted", "S301", "acquainted", ("courtesy",)
    ),
    "04 what nobody can say": Mistake(
        "talkitout", "hears: Where is the exit,", "hears: Where is the exits,", "Where", "S401",
        '"Where is the exit"',
    ),
    "05 a number that the grammar lacks": Mistake(
        "cointhief", 'nouns: [0, 1, 2, 3, 4, 5, 6]         # a noun that is a number has that value\n',
        'nouns: [1, 2, 3, 4, 5, 6]\n', "", "S402", None, ("`wanted` can be 0", '"Here is 0"', "add `0`"),
    ),
    "06 a comma in braces": Mistake(
        "cointhief", "say: Freeze! Give", "say: Freeze, give", "give", "S102", None,
        ("a comma ends the value", '"Freeze, give'),
    ),
    "07 a colon in a text": Mistake(
        "showme", "say: Look at me}", "say: Listen: look at me}", ": look", "S001", None, ("quote the text",)
    ),
    "08 a bracket left open": Mistake(
        "showme", "do: use(lesson)", "do: use(lesson", "(lesson", "S202", None, ("bracket is not closed",)
    ),
    "09 && for and": Mistake(
        "talkitout", 'sesame") and agent.next_to(exit)', 'sesame") && agent.next_to(exit)', "&&", "S203",
        None, ("write `and`",),
    ),
    "10 = for ==": Mistake("dance", "attempt == dance", "attempt = dance", "= dance", "S203", None, ("write `==`",)),
    "11 on in a state": Mistake(
        "talkitout", "      stranger:\n        then:", "      stranger:\n        on:", "on:", "S103", None,
        ("a state has `first`, `do`, `then`",),
    ),
    "12 yes for true": Mistake(
        "diverse_exit/npc_00", "near: true", "near: yes", "yes", "S204", None, ("write `true`",), "diverse_exit"
    ),
    "12b a word for true": Mistake(
        "diverse_exit/npc_00", "near: true", 'near: "yes"', 'yes"', "S204", None,
        ("slot `near` is a bool: write `true`",), "diverse_exit"
    ),
    "13 a slot left empty": Mistake(
        "dance", "    frame: look_then_repeat\n    with: {lesson: dance}\n", "    frame: look_then_repeat\n", "",
        "S302", None, ("`lesson` (sequence)", "`dancer`", "add `with: {lesson: ...}`"),
    ),
    "14 a slot misspelt": Mistake("dance", "{lesson: dance}", "{lessons: dance}", "lessons", "S303", "lesson"),
    "15 a step without an end": Mistake(
        "showme", "{do: face(agent), until: eye_contact(agent), say", "{do: face(agent), say", "face", "S304",
        None, ("add `until:` or `for:`",),
    ),
    "16 another word for an activity": Mistake(
        "showme", "do: use(lesson)", "do: press(lesson)", "press", "S205", None, ("`use(lesson)`",)
    ),
    "17 a register that is not declared": Mistake(
        "novel/haggling", "set: {insulted: insulted + 1}", "set: {insult: insulted + 1}", "insult:", "S305", "insulted"
    ),
    "18 a state that is never entered": Mistake(
        "novel/haggling", "      gone: {do: wander}", "      gone: {do: wander}\n      away: {}", "away", "W306",
        None, ("can never be entered",),
    ),
    "19 do in then": Mistake(
        "talkitout", "{hears: How are you, say", "{hears: How are you, do: face(agent), say", "do:", "S307", None,
        ("put `do` in the state or in `first`",),
    ),
    "20 steps and states": Mistake(
        "dance", "    steps:\n", "    states: {idle: {}}\n    steps:\n", "steps", "S308", None,
        ("either `steps` or `states`",),
    ),
    "21 a path that leads nowhere": Mistake(
        "talkitout_no_liar", "cast.liar", "cast.lier", "cast.lier", "S501", "cast.liar", ("talkitout.yaml:46",)
    ),
    "22 a parameter misspelt": Mistake("dance", "for: $pause", "for: $pauze", "$pauze", "S206", "pause"),
    "23 comparisons in a chain": Mistake(
        "talkitout", "and agent.next_to(exit)", "and 1 < agent.distance(exit) <= 2", "<= 2", "S207", None,
        ("write `1 < agent.distance(exit) and agent.distance(exit) <= 2`",),
    ),
    "24 an object type misspelt": Mistake("talkitout", "type: door,", "type: doors,", "doors,", "S309", "door"),
    "25 a key twice": Mistake(
        "talkitout", "horizon: 100\n", "horizon: 100\nhorizon: 90\n", "horizon: 90", "S002", None, ("line 7",)
    ),
    "26 a state it does not have": Mistake(
        "dance", "dancer.is(watching)", "dancer.is(watch)", "watch)", "S310", "watching", ("look_then_repeat",)
    ),
    "27 a rule in the shadow of another": Mistake(
        "novel/haggling", f"{BARGAIN}\n          - {{hears: I offer <noun>, {JOKE}",
        f"{JOKE}\n          - {{hears: I offer <noun>, {BARGAIN}", f"{{hears: I offer <noun>, {BARGAIN}", "W311",
        None, ("line 34 holds whenever it does",),
    ),
    "28 no free cell": Mistake(
        "cointhief", "    place: next_to(agent)\n    facing: toward(agent)\n    view: 5\n    frame: hold_up\n",
        "    place: column(1) where here.y == 1\n    facing: down\n    view: 5\n    frame: hold_up\n",
        "column", "S601", None,
        ("`thief`", "8x8", "`agent` may take all of its place", "`order:`"),
    ),
    "28b more things than cells": Mistake(
        "cointhief", "room: {size: 8}", "room: {size: 4}", "", "S601", None, ("`coins[2]`", "4x4", "no free cell")
    ),
    "29 round within one step": Mistake(
        "diverse_exit/teacher", "say: Go to the <exit.color> door}",
        "say: Go to the <exit.color> door, goto_now: stranger}", "", "S312", None,
        ("stranger -> helpful -> stranger",), "diverse_exit",
    ),
    "30 two frames for one body": Mistake(
        "talkitout", "    with: {answer: Ask <honest.name>.}\n",
        "    with: {answer: Ask <honest.name>.}\n    frames: [courtesy, patrol]\n", "patrol", "S313", None,
        ("`courtesy` and `patrol`", "`wizard`"),
    ),
    "31 let in a circle": Mistake(
        "talkitout", "  exit: pick(doors)",
        "  exit: pick(d in doors where d != other)\n  other: pick(d in doors where d != exit)", "exit: pick", "S208",
        None, ("`exit` needs `other` and `other` needs `exit`",),
    ),
}  # fmt: skip


@pytest.fixture
def scenarios(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the shipped scenarios, in which we work."""
    copy = tmp_path / "scenarios"
    shutil.copytree(shipped_folder(), copy)
    monkeypatch.chdir(copy)
    return copy


def only_finding(name: str) -> Diagnostic:
    """The one finding that there has to be."""
    found = check(name).diagnostics
    assert len(found) == 1, [str(d) for d in found]
    return found[0]


@pytest.mark.parametrize("mistake", MISTAKES.values(), ids=MISTAKES)
def test_mistake(scenarios: Path, mistake: Mistake) -> None:
    path = scenarios / f"{mistake.file}.yaml"
    text = path.read_text(encoding="utf-8")
    assert text.count(mistake.right) >= 1
    changed = text.replace(mistake.right, mistake.wrong, 1)
    path.write_text(changed, encoding="utf-8")
    found = only_finding(f"{mistake.checked or mistake.file}.yaml")
    assert (found.code, found.suggestion) == (mistake.code, mistake.suggestion)
    assert found.span.file == f"{mistake.file}.yaml"
    if mistake.place:
        at = changed.index(mistake.place, text.index(mistake.right))
        line = changed.count("\n", 0, at) + 1
        assert (found.span.line, found.span.column) == (line, at - changed.rfind("\n", 0, at))
    for words in mistake.says:
        assert words in f"{found.text}; {found.hint}"


def test_32_a_variant_that_makes_the_scenario_senseless(scenarios: Path) -> None:
    """The place is in the scenario, which is right alone; so the patch is named."""
    (scenarios / "quiet.yaml").write_text(
        "variant: quiet\nof: any\nset:\n  grammar.nouns: [the exit, you]\n", encoding="utf-8"
    )
    found = only_finding("talkitout.yaml+quiet")
    assert (found.code, found.span.file, found.span.line) == ("S401", "talkitout.yaml", 54)
    assert found.text == 'nobody can say "Open sesame" with this grammar'
    assert "in `talkitout+quiet`, patched by quiet.yaml:4" in (found.hint or "")
