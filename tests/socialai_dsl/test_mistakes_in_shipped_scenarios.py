"""A slip in a scenario that is shipped is found where it was made, with the word that was meant, and nothing else."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from socialai_dsl.diagnostics import Diagnostic
from socialai_dsl.frontend import check
from socialai_dsl.loader.library import shipped_folder
from socialai_dsl.source import Source

SLIPS = {
    # file, what it says, what is written instead, scenario that is checked -> what is said about it
    ("dance", "attempt == dance", "attempt = dance", "dance"): (
        "dance.yaml `=` S203 `=` is not used here: to compare write `==`"
    ),
    ("dance", "    with: {lesson: dance}\n", "", "dance"): (
        "dance.yaml `dancer` S302 frame `look_then_repeat` has a slot `lesson` (sequence) that `dancer` does "
        "not fill"
    ),
    ("dance", "{lesson: dance}", "{lessons: dance}", "dance"): (
        "dance.yaml `lessons` S303 frame `look_then_repeat` has no slot `lessons`; did you mean `lesson`?"
    ),
    ("dance", "perform(lesson)", "press(lesson)", "dance"): (
        "dance.yaml `press` S205 unknown activity `press`; to toggle something write `use(lesson)`"
    ),
    ("dance", "perform(lesson)", "perfrom(lesson)", "dance"): (
        "dance.yaml `perfrom` S205 unknown activity `perfrom`; did you mean `perform`?"
    ),
    ("dance", "for: $pause", "for: $pauze", "dance"): (
        "dance.yaml `$pauze` S206 unknown parameter `pauze`; did you mean `pause`?"
    ),
    ("dance", "dancer.is(watching)", "dancer.is(watch)", "dance"): (
        "dance.yaml `watch` S310 `dancer` has no state `watch` (it plays `look_then_repeat`: watching, "
        "finished); did you mean `watching`?"
    ),
    ("dance", "last: $length", "last: 2", "dance"): (
        "dance.yaml `a` S106 `attempt` has 2 acts, `dance` has 3"
    ),
    ("dance", "sequence: $length", "sequence: length", "dance"): (
        "dance.yaml `length` S104 `sequence` is a whole number, here is the text `length`"
    ),
    ("dance", "moves: [left", "moves: [lefft", "dance"): (
        "dance.yaml `lefft` S103 `lefft` is not a word for `moves`; did you mean `left`?"
    ),
    ("dance", "of: agent.acts", "of: agent.act", "dance"): (
        "dance.yaml `agent.act` S103 `agent.act` is not a word for `of`; did you mean `agent.acts`?"
    ),
    ("dance", "utterance: {chance", "utterance: {chances", "dance"): (
        "dance.yaml `chances` S101 unknown key `chances` in the utterance of a sequence; did you mean "
        "`chance`?"
    ),
    ("dance", "success: attempt == dance", "success: attemt == dance", "dance"): (
        "dance.yaml `attemt` S201 unknown name `attemt`; did you mean `attempt` (memory, line N)?"
    ),
    ("talkitout_no_liar", "cast.liar", "cast.lier", "talkitout_no_liar"): (
        "talkitout_no_liar.yaml `cast.lier` S501 there is no `cast.lier` in talkitout.yaml; did you mean "
        "`cast.liar` (talkitout.yaml:N)?"
    ),
    ("cointhief", "thief.would_see(c, home) or", "thief.would_see(c) or", "cointhief"): (
        "cointhief.yaml `would_see` S211 `would_see` takes 2 values in brackets: `would_see(x, up)`; 1 given"
    ),
    ("cointhief", "thief.would_see(c, home) or", "thief.would_se(c, home) or", "cointhief"): (
        "cointhief.yaml `would_se` S205 unknown verb `would_se`; did you mean `would_see`?"
    ),
    ("cointhief", "home + glance", "home + 1", "cointhief"): (
        "cointhief.yaml `1` S204 `1` is a number, but a turn (left or right) is expected here"
    ),
    ("cointhief", "order: [agent, thief, coins]", "order: [agent, thief, coin]", "cointhief"): (
        "cointhief.yaml `coin` S201 unknown name `coin`; did you mean `coins`?"
    ),
    ("cointhief", "place: next_to(agent)", "place: next_to(agnet)", "cointhief"): (
        "cointhief.yaml `agnet` S201 unknown name `agnet`; did you mean `agent` (cast, line N)?"
    ),
    ("cointhief_tags", "in_thiefs_view(it)", "in_thiefs_view(its)", "cointhief_tags"): (
        "cointhief_tags.yaml `its` S201 unknown name `its`; did you mean `it`?"
    ),
    ("cointhief_tags", "in_thiefs_view(it)", "in_thieves_view(it)", "cointhief_tags"): (
        "cointhief_tags.yaml `in_thieves_view` S205 unknown word `in_thieves_view`; did you mean "
        "`in_thiefs_view`?"
    ),
    ("cointhief_tags", "coins.tagged", "coins.taged", "cointhief_tags"): (
        "cointhief_tags.yaml `objects.coins.taged` S101 unknown key `taged` in an object; did you mean "
        "`tagged`?"
    ),
    ("showme", "correct.pressed and", "correct.presed and", "showme"): (
        "showme.yaml `presed` S205 nothing here has a `presed`; did you mean `pressed`?"
    ),
    ("showme", "one_way: true", "oneway: true", "showme"): (
        "showme.yaml `oneway` S101 unknown key `oneway` in an object; did you mean `one_way`?"
    ),
    ("showme", "do: use(lesson)", "do: press(lesson)", "showme"): (
        "showme.yaml `press` S205 unknown activity `press`; to toggle something write `use(lesson)`"
    ),
    ("showme", "do: enter(door)", "do: go_through(door)", "showme"): (
        "showme.yaml `go_through` S205 unknown activity `go_through`; to go through something write "
        "`enter(door)`"
    ),
    ("showme", "switches.reset", "switch.reset", "showme"): (
        "showme.yaml `switch` S201 unknown name `switch`; did you mean `switches` (objects, line N)?"
    ),
    ("showme", ", until: eye_contact(agent)", "", "showme"): (
        "showme.yaml `face(agent)` S304 `face(agent)` never ends by itself: add `until:` or `for:`"
    ),
    ("showme", "default: top ", "default: tops ", "showme"): (
        "showme.yaml `tops` S206 the default of `door_wall` is none of its values; did you mean `top`?"
    ),
    ("showme", "$door_wall", "$doorwall", "showme"): (
        "showme.yaml `$doorwall` S206 unknown parameter `doorwall`; did you mean `door_wall`?"
    ),
    ("help", "unlocks: doors", "unlocks: door", "help"): (
        "help.yaml `door` S201 unknown name `door`; did you mean `doors` (objects, line N)?"
    ),
    ("help", "state: locked", "state: lock", "help"): (
        "help.yaml `lock` S204 a door is never `lock`; it is open or closed or locked; did you mean `locked`?"
    ),
    ("help", "role: helper", "role: helpr", "help"): (
        "help.yaml `helpr` S201 unknown role `helpr`; did you mean `helper`?"
    ),
    ("help", "role: exiter", "role: helper", "help"): (
        "help.yaml `helper` S213 `agent` plays the role `helper` already"
    ),
    ("help", "goal.unlocked_by", "goal.unlockd_by", "help"): (
        "help.yaml `unlockd_by` S205 nothing here has a `unlockd_by`; did you mean `unlocked_by`?"
    ),
    ("help", "color: doors.color", "color: doors.colour", "help"): (
        "help.yaml `colour` S205 `colour` gives no colours; write `doors.color`"
    ),
    ("help", "frame: give_exit", "frame: give_exits", "help"): (
        "help.yaml `give_exits` S201 unknown frame `give_exits`; did you mean `give_exit`?"
    ),
    ("help", "when: eye_contact(exiter)", "when: eye_contact(exit)", "help"): (
        "help.yaml `exit` S201 unknown name `exit`; did you mean `exiter` (roles, line N)?"
    ),
    ("help", "lava: column", "larva: column", "help"): (
        "help.yaml `larva` S309 unknown object type `larva`; did you mean `lava`?"
    ),
    ("diverse_exit/npc_03", "near:", "neer:", "diverse_exit"): (
        "diverse_exit/npc_03.yaml `neer` S303 frame `introduction` has no slot `neer`; did you mean `near`?"
    ),
    ("diverse_exit/npc_03", "with:", "width:", "diverse_exit"): (
        "diverse_exit/npc_03.yaml `width` S101 unknown key `width` in an npc file; did you mean `with`?"
    ),
    ("diverse_exit/teacher", "goto_now: helpful", "goto_now: helpfull", "diverse_exit"): (
        "diverse_exit/teacher.yaml `helpfull` S301 no state `helpfull` in frame `introduction`; did you mean "
        "`helpful`?"
    ),
    ("diverse_exit/teacher", "heard(formula)", "heard(formla)", "diverse_exit"): (
        'diverse_exit/teacher.yaml `formla` S211 `formla` is not a text; what is said is quoted: "Open '
        'sesame"; did you mean `formula`?'
    ),
    ("diverse_exit/teacher", "was_poked ==", "is_poked ==", "diverse_exit"): (
        "diverse_exit/teacher.yaml `is_poked` S201 unknown name `is_poked`; did you mean `was_poked`?"
    ),
    ("diverse_exit/teacher", "frame: introduction", "frame: introductions", "diverse_exit"): (
        "diverse_exit/teacher.yaml `introductions` S201 unknown frame `introductions`; did you mean "
        "`introduction`?"
    ),
    ("diverse_exit", "npc_*.yaml", "ncp_*.yaml", "diverse_exit"): (
        "diverse_exit.yaml `diverse_exit/ncp_*.yaml` S504 no file matches `diverse_exit/ncp_*.yaml`"
    ),
    ("diverse_exit", "one_of", "oneof", "diverse_exit"): (
        "diverse_exit.yaml `oneof` S101 unknown key `oneof` in a member of the cast; did you mean `one_of`?"
    ),
}


@pytest.fixture
def scenarios(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the shipped scenarios, in which we work."""
    copy = tmp_path / "scenarios"
    shutil.copytree(shipped_folder(), copy)
    monkeypatch.chdir(copy)
    return copy


def _without_numbers(found: Diagnostic, sources: dict[str, Source]) -> str:
    """A finding with the text that it marks in place of its line and column, which change with the scenarios."""
    span = found.span
    marked = sources[span.file].line(span.line)[span.column - 1 :][: span.width]
    return f"{span.file} `{marked}` {found.code} " + re.sub(r"(line |yaml:)\d+", r"\1N", found.text)


@pytest.mark.parametrize(
    ("slip", "said"), SLIPS.items(), ids=lambda part: part[2] if type(part) is tuple else ""
)
def test_slip(scenarios: Path, slip: tuple[str, str, str, str], said: str) -> None:
    file, right, wrong, scenario = slip
    path = scenarios / f"{file}.yaml"
    text = path.read_text(encoding="utf-8")
    assert right in text
    path.write_text(text.replace(right, wrong, 1), encoding="utf-8")
    result = check(f"{scenario}.yaml")
    assert [_without_numbers(found, result.sources) for found in result.diagnostics] == [said]
