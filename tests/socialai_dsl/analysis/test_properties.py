"""What scenarios claim of themselves: what is so holds, what is not fails, and a leak is found where it is."""

from __future__ import annotations

import contextlib
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import socialai_dsl
from socialai_dsl.analysis.check import check_scenario
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.guessing import Guess, Guessing
from socialai_dsl.analysis.knowable import Knowing
from socialai_dsl.analysis.perceiving import perceived
from socialai_dsl.analysis.properties import Trial
from socialai_dsl.analysis.reports import Report, Verdict
from socialai_dsl.analysis.search import Finding, Search
from socialai_dsl.cli.main import main
from socialai_dsl.engine.calls import RoomError

# One of two doors is right. Ada tells which to whoever asks and is in front of her.
TOLD = """
scenario: told
horizon: 30
earshot: room
actions: [left, right, forward]
grammar: {templates: [Where is <noun>, Open <noun>], nouns: [it, 0, 1]}
room: {size: 5}
objects:
  doors: {type: door, count: 2, color: red, at: [[0, 2], [4, 2]]}
let: {exit: pick(doors)}
frames:
  tell:
    states:
      waiting: {then: [{hears: Where is it, when: in_front_of_me, say: Number <exit.index>, goto: content}]}
      content: {}
    define: {in_front_of_me: agent.next_to(self)}
cast:
  ada: {name: Ada, at: [2, 2], facing: down, color: red, frame: tell}
  bob: {name: Bob, at: [3, 3], facing: up, color: red}
  agent: {at: [1, 1], facing: down}
outcome:
  - {success: agent.said("Open <exit.index>"), id: out}
  - failure: agent.spoke and not agent.said("Where is it")
"""
SCRIPT = """
variant: told_oracle
of: told.yaml
set:
  cast.agent.frame: oracle
  frames.oracle:
    steps: [{do: go_next_to(ada)}, {say: Where is it}, {say: Open <exit.index>}]
"""
ROOMS = 12

Trying = Callable[..., Report]


@pytest.fixture
def tried(tmp_path: Path) -> Trying:
    """What is found out about a property of the scenario, in which some pieces of text may be replaced."""

    def trying(entry: str, *changes: tuple[str, str], states: int = 20_000) -> Report:
        text = TOLD
        for old, new in changes:
            assert old in text, "nothing would change"
            text = text.replace(old, new)
        (tmp_path / "told.yaml").write_text(f"{text}check: [{entry}]\n")
        (tmp_path / "told_oracle.yaml").write_text(SCRIPT)
        loaded = socialai_dsl.load(tmp_path / "told.yaml")
        scripted = socialai_dsl.load(f"{tmp_path / 'told.yaml'}+oracle")
        assert isinstance(loaded, socialai_dsl.LoadedScenario)
        assert isinstance(scripted, socialai_dsl.LoadedScenario)
        (plan,) = loaded.checked.properties
        effort = Effort(ROOMS, 1, states)
        return Trial(loaded, effort, scripted).check(plan, effort)

    return trying


def test_what_can_come_about_is_reachable_in_every_room(tried: Trying) -> None:
    for condition in ("success", "out", "ada.is(content)", "ada.is(content) and agent.y == 3"):
        report = tried(f"{{reachable: {condition}, share: 1}}")
        assert (report.verdict, report.held, report.against) == (Verdict.HOLDS, ROOMS, ())


def test_what_cannot_come_about_is_not(tried: Trying) -> None:
    report = tried("{reachable: agent.at(exit)}")
    assert (report.verdict, report.held, report.against) == (Verdict.FAILS, 0, (0, 1, 2, 3, 4))
    report = tried("{never: agent.at(exit)}")
    assert (report.verdict, report.held) == (Verdict.HOLDS, ROOMS)


def test_never_names_a_room_and_the_steps(tried: Trying) -> None:
    report = tried("{never: ada.is(content)}")
    assert (report.verdict, report.held) == (Verdict.FAILS, 0)
    assert "in room 0 after 1 step" in report.said, (
        "one step down is next to her, and that is far enough to ask"
    )


def test_a_condition_is_looked_at_in_the_step_that_ends_the_episode(tried: Trying) -> None:
    assert tried('{reachable: agent.said("Open it")}').verdict is Verdict.HOLDS


def test_what_was_before_can_be_asked(tried: Trying) -> None:
    turned = "prev(agent.facing == right) and agent.facing"
    assert tried(f'{{never: "{turned} == left"}}').verdict is Verdict.HOLDS
    assert tried(f'{{never: "{turned} == up"}}').verdict is Verdict.FAILS


def test_a_search_that_gives_up_is_undecided(tried: Trying) -> None:
    report = tried("{never: agent.at(exit)}", states=3)
    assert (report.verdict, report.undecided) == (Verdict.UNDECIDED, ROOMS)
    assert tried("{reachable: agent.at(exit)}", states=3).verdict is Verdict.UNDECIDED


def test_the_length_of_a_shortest_success(tried: Trying) -> None:
    late = ("agent.spoke and not", "t < 4 or agent.spoke and not")
    assert tried("{within: 1}").verdict is Verdict.HOLDS, "a guess may be right at once"
    last = ('success: agent.said("Open <exit.index>")', "success: ada.is(content) and agent.y == 3")
    assert tried("{within: 2}", last).verdict is Verdict.HOLDS
    report = tried("{within: 1}", last)
    assert (report.verdict, report.held) == (Verdict.FAILS, 0)
    assert tried("{within: 30}", last, late).verdict is Verdict.FAILS, "whoever lives cannot win"


def test_the_script_is_played(tried: Trying) -> None:
    assert tried("{oracle: 1}").verdict is Verdict.HOLDS
    away = ("agent: {at: [1, 1], facing: down}", "agent: {at: [1, 1], facing: up}")
    report = tried("{oracle: 0.5}", away, ("horizon: 30", "horizon: 3"))
    assert (report.verdict, report.held) == (Verdict.FAILS, 0)


def test_without_the_one_who_knows_there_is_only_guessing(tried: Trying) -> None:
    report = tried("{needs: ada}")
    assert (report.verdict, report.held) == (Verdict.HOLDS, ROOMS)
    assert "chance" not in report.said, "nothing is drawn after the reset"


def test_with_the_one_who_knows_rooms_are_told_apart(tried: Trying) -> None:
    report = tried("{needs: bob}")
    assert (report.verdict, report.held, report.undecided) == (Verdict.UNDECIDED, 0, ROOMS)


def test_who_may_try_again_needs_nobody(tried: Trying) -> None:
    patient = ("  - failure: agent.spoke", "  - failure: t > 28 and agent.spoke")
    report = tried("{needs: ada}", patient)
    assert (report.verdict, report.held) == (Verdict.FAILS, 0)
    assert "an agent can do without them" in report.said


def test_who_shows_it_without_knowing_is_no_help(tried: Trying) -> None:
    at_the_exit = ("bob: {name: Bob, at: [3, 3]", "bob: {name: Bob, place: next_to(exit)")
    report = tried("{needs: ada}", at_the_exit)
    assert (report.verdict, report.held) == (Verdict.UNDECIDED, 0), "the rooms look different"


BOXES = """
scenario: boxes
horizon: 30
actions: [left, right, forward, toggle]
grammar: {templates: [Say <noun>], nouns: [it]}
room: {size: 5}
objects:
  boxes: {type: box, count: 2, color: red, at: [[0, 2], [4, 2]], exclusive: true}
  apple: {type: apple, inside: target}
let: {target: pick(boxes)}
frames: {look: {states: {looking: {do: face(target)}}}}
cast:
  ada: {at: [2, 3], facing: up, color: red, frame: look}
  agent: {at: [2, 2], facing: left}
outcome: [{success: apple.eaten}]
check: [{needs: ada}]
"""


@pytest.mark.parametrize(("exclusive", "verdict"), [("false", Verdict.UNDECIDED), ("true", Verdict.HOLDS)])
def test_knowing_too_late_is_no_better_than_a_guess(tmp_path: Path, exclusive: str, verdict: Verdict) -> None:
    """An open box shows what is in it; where the other then stays shut, that helps nobody."""
    file = tmp_path / "boxes.yaml"
    file.write_text(BOXES.replace("exclusive: true", f"exclusive: {exclusive}"))
    loaded = socialai_dsl.load(file)
    assert isinstance(loaded, socialai_dsl.LoadedScenario)
    report = Trial(loaded, Effort(2)).check(loaded.checked.properties[0], Effort(2))
    assert report.verdict is verdict


def test_cues_of_those_who_may_tell_are_no_leaks(tried: Trying) -> None:
    report = tried("{only_through: {draw: exit, by: [ada]}}")
    assert report.verdict is Verdict.HOLDS
    assert "0 in something else" in report.said
    assert not report.said.startswith(f"of {2 * ROOMS} pairs of episodes 0 "), "the script asks her"


def test_a_line_to_somebody_is_a_cue_of_who_says_it(tried: Trying) -> None:
    addressed = ("say: ", "to: agent, say: ")
    assert tried("{only_through: {draw: exit, by: [ada]}}", addressed).verdict is Verdict.HOLDS
    assert tried("{only_through: {draw: exit, by: [bob]}}", addressed).said.endswith(", in `ada`")


def test_cues_of_others_are_leaks(tried: Trying) -> None:
    report = tried("{only_through: {draw: exit, by: [bob]}}")
    assert report.verdict is Verdict.FAILS
    assert len(report.against) == 5
    assert report.said.endswith(", in `ada`")


def test_a_door_that_looks_different_is_a_leak(tried: Trying) -> None:
    leaky = ("color: red, at: [[", "color: red, locked: it == exit, at: [[")
    report = tried("{only_through: {draw: exit, by: [ada]}}", leaky)
    assert (report.verdict, report.held) == (Verdict.FAILS, 0)
    assert " after 0 steps " in report.said
    assert report.said.rpartition(", in ")[2].startswith("`doors[")


def test_turning_in_view_is_a_cue(tried: Trying) -> None:
    turning = ("waiting: {then", "waiting: {do: face(exit), then")
    assert tried("{only_through: {draw: exit, by: [ada]}}", turning).verdict is Verdict.HOLDS
    assert tried("{only_through: {draw: exit, by: [bob]}}", turning).verdict is Verdict.FAILS


def test_the_picture_before_npcs_shows_the_turn_a_step_later(tried: Trying) -> None:
    turning = ("waiting: {then", "waiting: {do: face(exit), then")
    before = ("outcome:", "observe: {image: before_npcs}\noutcome:")
    assert tried("{only_through: {draw: exit, by: [ada]}}", turning, before).verdict is Verdict.HOLDS
    assert tried("{only_through: {draw: exit, by: [bob]}}", turning, before).verdict is Verdict.FAILS


def test_where_names_are_hidden_every_line_may_be_a_cue(tried: Trying) -> None:
    hidden = ("outcome:", "observe: {names: hidden}\noutcome:")
    assert tried("{only_through: {draw: exit, by: [bob]}}", hidden).verdict is Verdict.HOLDS


def test_which_line_is_said_may_be_what_tells(tried: Trying) -> None:
    """Bob, who says any number but that of the exit, in words that nobody waits for, tells it to who hears him."""
    lines = (
        "  ada: {name",
        "  bob: {name: Bob, at: [3, 3], facing: up, color: red, frame: hint}\n  ada: {name",
    )
    alone = ("  bob: {name: Bob, at: [3, 3], facing: up, color: red}\n", "")
    frame = (
        "cast:\n",
        "  hint: {states: {a: {then: [{chance: 0.3, say: Not <pick(d in doors where d != exit).index>}]}}}\ncast:\n",
    )
    report = tried("{needs: ada}", alone, lines, frame)
    assert (report.verdict, report.held) == (Verdict.UNDECIDED, 0)
    assert "it is `bob`, after" in report.said
    nonsense = (frame[0], frame[1].replace(" where d != exit", ""))
    report = tried("{needs: ada}", alone, lines, nonsense)
    assert report.verdict is Verdict.HOLDS
    assert (
        "chance during the episode, such as which way somebody turns, was tried only in part" in report.said
    )


def test_a_script_that_knows_what_it_was_not_told_peeks(tried: Trying) -> None:
    report = tried("{script: perceives}")
    assert report.verdict is Verdict.HOLDS, "it asks, and heeds the answer"
    deaf = ("say: Number <exit.index>, goto: content", "goto: content")
    report = tried("{script: perceives}", deaf)
    assert (report.verdict, report.held) == (Verdict.FAILS, 0)
    assert "`let.exit`, doors[" in report.said
    assert report.said.endswith("decides what it does in step 3, unperceived")
    assert tried("{script: perceives, share: 0}", deaf).verdict is Verdict.FAILS, (
        "one room at least has to hold"
    )


def test_rooms_that_cannot_be_drawn_do_not_count_where_a_script_peeks(tmp_path: Path) -> None:
    rare = TOLD.replace("exit: pick(doors)", "exit: pick(doors), odd: pick(1..100)").replace(
        "outcome:", "require: [odd == 7]\noutcome:"
    )
    (tmp_path / "told.yaml").write_text(rare.replace("say: Number <exit.index>, goto", "goto"))
    (tmp_path / "told_oracle.yaml").write_text(SCRIPT)
    scripted = socialai_dsl.load(f"{tmp_path / 'told.yaml'}+oracle")
    assert isinstance(scripted, socialai_dsl.LoadedScenario)
    env = socialai_dsl.make(socialai_dsl.compile(scripted))
    drawn = []
    for index in range(ROOMS):
        with contextlib.suppress(RoomError):
            env.reset(seed=1, options={"index": index})
            drawn.append(index)
    assert 0 < len(drawn) < ROOMS
    assert {peek.index for peek in perceived(scripted, ROOMS, 1).peeks} == set(drawn)
    assert perceived(scripted, drawn[0], 1).pairs == 0


FACE = """
scenario: face
about: After Sorce 1985, cross the ledge where the mother's face is happy.
horizon: 12
actions: [left, right, forward]
grammar: {templates: [Where is <noun>], nouns: [it]}
room: {size: 7}
objects:
  near: {type: box, at: [1, 3]}
  far: {type: box, at: [5, 3]}
looks:
  mood: {for: mother, words: [calm, happy, afraid]}
let: {safe: pick(0 | 1)}
frames:
  watch:
    states:
      calm: {then: [{when: t >= 1, set: {mood: happy if safe == 0 else afraid}, goto: shown}]}
      shown: {}
cast:
  mother: {name: Mother, at: [3, 1], facing: down, frame: watch}
  agent: {at: [3, 5], facing: up}
outcome:
  - {success: agent.next_to(near) and safe == 0 or agent.next_to(far) and safe == 1}
  - {failure: agent.next_to(near) or agent.next_to(far)}
"""


def test_a_silenced_member_has_no_face_either(tmp_path: Path) -> None:
    """After Sorce (1985): only the mother's face says which side is safe."""
    (tmp_path / "face.yaml").write_text(FACE + "check:\n  - {needs: mother}\n")
    loaded = socialai_dsl.load(tmp_path / "face.yaml")
    assert isinstance(loaded, socialai_dsl.LoadedScenario)
    (report,) = [found for _, found in check_scenario(loaded, "face", Effort(10)).tried][:1]
    assert (report.verdict, report.held) == (Verdict.HOLDS, 10)


DOOR = """scenario: door
horizon: 20
actions: [left, right, forward]
grammar: {templates: [Please open <noun>], nouns: [the door]}
room: {size: 6}
objects:
  gate: {type: door, place: wall(top), state: locked}
frames:
  duty:
    states:
      watching: {do: face(agent), then: [{hears: Please open the door, when: eye_contact(agent), cause: [gate.open]}]}
cast:
  keeper: {name: Ada, frame: duty}
  agent: {place: anywhere}
outcome:
  - success: agent.at(gate)
check:
  - {never: gate.open}
"""


def test_a_violation_can_be_pasted_into_a_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("door.yaml").write_text(DOOR)
    assert main(["check", "door.yaml", "--rooms", "4"]) == 1
    (command,) = re.findall(r"to see it: socialai (.*)", capsys.readouterr().out)
    words = shlex.split(command)
    assert words[:2] == ["trace", "door.yaml"]
    assert words[-2:-1] == ["--do"]
    assert main([*words, "--json"]) == 0
    assert "gate.open" in capsys.readouterr().out


# What is to be known is drawn by no `let`: where a thing lies. Ada points at it for whoever looks at her.
HELD = """
scenario: held
horizon: 20
grammar: body
actions: [left, right, forward, toggle]
room: {size: 5}
observe: {channels: [type, color, status, orientation, pointing, last_act]}
objects:
  boxes: {type: box, count: 2, color: red, at: [[1, 1], [3, 1]]}
  apple: {type: apple, inside: pick(boxes)}
frames:
  show:
    states:
      waiting: {do: point(apple.inside)}
cast:
  ada: {at: [2, 2], frame: show}
  agent: {at: [2, 3], facing: up}
outcome:
  - {success: any(b in boxes where b.opened and b == apple.inside)}
  - failure: any(b in boxes where b.opened)
check: [{needs: ada}]
"""


@pytest.mark.parametrize(
    ("changes", "verdict", "said"),
    [
        ([], Verdict.HOLDS, "an agent can only guess"),
        ([("color: red, at: [[1, 1], [3, 1]]}", "color: distinct, at: [[1, 1], [3, 1]]}")], Verdict.HOLDS, "guess"),
        ([("count: 2, color: red, at: [[1, 1], [3, 1]]", "count: 1, at: [[1, 1]]")], Verdict.FAILS, "do without"),
        ([("  - failure: any(b in boxes where b.opened)\n", "")], Verdict.FAILS, "an agent can do without them"),
    ],
)  # fmt: skip
def test_what_no_name_draws_is_needed_as_well(
    tmp_path: Path, changes: list[tuple[str, str]], verdict: Verdict, said: str
) -> None:
    text = HELD
    for old, new in changes:
        assert old in text, "nothing would change"
        text = text.replace(old, new)
    (tmp_path / "held.yaml").write_text(text, encoding="utf-8")
    loaded = socialai_dsl.load(tmp_path / "held.yaml")
    assert isinstance(loaded, socialai_dsl.LoadedScenario)
    (plan,) = loaded.checked.properties
    report = Trial(loaded, Effort(4)).check(plan, Effort(4))
    assert report.verdict is verdict, report.said
    assert said in report.said


def test_searches_of_rooms_that_look_different_are_bounded_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However often two rooms come to look different, and however hard each is."""
    states, looked_at, inside = 5_000, list[int](), list[bool]()
    solve, search = Guessing.solve, Search.solve

    def guessing(self: Guessing, *arguments: Any, **more: Any) -> Guess:
        looked_at.clear()
        inside.append(True)
        found = solve(self, *arguments, **more)
        inside.pop()
        most.append(sum(looked_at))
        return found

    def searching(self: Search, *arguments: Any, **more: Any) -> Finding:
        assert not inside or sum(looked_at) <= 2 * states, "no further search begins"
        found = search(self, *arguments, **more)
        if inside:
            looked_at.append(found.states)
        return found

    most: list[int] = []
    monkeypatch.setattr(Guessing, "solve", guessing)
    monkeypatch.setattr(Search, "solve", searching)
    file = Path(__file__).parents[3] / "docs" / "cookbook" / "hidden_information.yaml"
    loaded = socialai_dsl.load(file)
    assert isinstance(loaded, socialai_dsl.LoadedScenario)
    trial = Trial(loaded, Effort(24, states=states), loaded)
    for room in (20, 21):
        Knowing(trial.rooms, trial.effort, trial.scripted).look_at(room)
    assert max(most) > states, "the bound is reached"
