"""Registers that there are for each of a group, and registers that hold nothing yet: what they become, and layouts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.program import Op, Program
from tests.tiny import Folder

KEPT = """
    grammar: {templates: [This is <noun>, Hello], nouns: [dax, wug]}
    objects: {balls: {type: ball, count: 16, color: red}}
    state: {hits: {for: balls, start: it.index, range: 0..99}}
    frames:
      learn:
        let:
          name_of: {for: balls, start: none}
          gap: {for: red | blue | grey, start: 1, range: 0..9}
        states: {s: {then: [%s]}}
    cast: {ann: {at: [4, 5], frame: learn}}
    earshot: room
"""
NEAREST = "nearest(b in balls to agent)"


def played(folder: Path, rule: str, named: str = "balls") -> Any:
    return Folder(folder)(KEPT % (rule + f", {{hears: This is <noun>, set: {{name_of({named}): noun}}}}"))


def ops(run: Any) -> list[Op]:
    program: Program = run.env.unwrapped.program
    return [Op(op) for op in program.code[:, 0].tolist()]


def test_a_key_that_is_computed_costs_one_instruction(tmp_path: Path) -> None:
    one = ops(played(tmp_path, f"{{when: hits({NEAREST}) > 98, say: Hello}}"))
    two = ops(played(tmp_path, f"{{when: hits({NEAREST}) > 98 or hits({NEAREST}) > 97, say: Hello}}"))
    assert Op.STORE_AT not in one
    assert 0 < two.count(Op.READ_AT) - one.count(Op.READ_AT) == one.count(Op.READ_AT)
    setting = ops(played(tmp_path, f"{{when: t > 98, set: {{hits({NEAREST}): 1}}}}"))
    assert setting.count(Op.STORE_AT) == one.count(Op.READ_AT)


def test_a_key_that_is_known_is_a_register_like_any_other(tmp_path: Path) -> None:
    run = played(tmp_path, "{when: any(b in balls where hits(b) == 3 and b.index == 3), set: {gap(blue): 5}}")
    assert Op.READ_AT not in ops(run)
    assert Op.STORE_AT not in ops(run)
    assert run.steps(1).value("ann.gap") == {"red": 1, "blue": 5, "grey": 1}


def test_each_starts_with_its_own_value_and_keeps_its_range(tmp_path: Path) -> None:
    run = played(tmp_path, "{when: t < 3, set: {hits(objects): 50 * t, gap(grey): -5}}")
    assert run.state["state"]["hits"]["balls[7]"] == 7
    run.steps(2)
    assert set(run.state["state"]["hits"].values()) == {99}
    assert run.value("ann.gap")["grey"] == 0


def test_keys_with_gaps(tmp_path: Path) -> None:
    rule = "{when: t < 6, set: {gap(first(c in colors where c != red or t > 2)): t}}"
    run = played(tmp_path, rule).steps(1)
    assert run.value("ann.gap") == {"red": 1, "blue": 1, "grey": 1}, "green has none"
    assert run.steps(2).value("ann.gap") == {"red": 3, "blue": 1, "grey": 1}


def test_what_a_first_rule_sets_after_the_body_action(tmp_path: Path) -> None:
    text = (KEPT % "{hears: This is <noun>, set: {name_of(first(balls)): noun}}").replace(
        "{s: {then", f"{{s: {{first: [{{when: t == 1, do: left, set: {{hits({NEAREST}): 77}}}}], then"
    )
    run = Folder(tmp_path)(text).steps(1)
    assert list(run.state["state"]["hits"].values()).count(77) == 1


def test_layouts_give_them_back(tmp_path: Path) -> None:
    run = played(tmp_path, "{when: t > 98, say: Hello}", "first(balls)").step(said="This is wug")
    described = run.state
    assert described["let"]["ann.name_of"] == {"balls[0]": "wug"} | {
        f"balls[{k}]": "none" for k in range(1, 16)
    }
    given = {
        "let": {"ann.name_of": {"balls[0]": "none", "balls[3]": "dax"}},
        "state": {"hits": {"balls[1]": 9}},
    }
    env = run.env
    env.reset(options={"layout": given})
    state = env.unwrapped.describe()
    assert (state["let"]["ann.name_of"]["balls[0]"], state["let"]["ann.name_of"]["balls[3]"]) == (
        "none",
        "dax",
    )
    assert (state["state"]["hits"]["balls[1]"], state["state"]["hits"]["balls[2]"]) == (9, 2)
    env.reset(options={"layout": described})
    assert env.unwrapped.describe()["let"] == described["let"]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"let": {"ann.name_of": "dax"}}, "expected a mapping of balls"),
        ({"let": {"ann.name_of": {"balls[16]": "dax"}}}, "there is no 'balls\\[16\\]'"),
        ({"let": {"ann.name_of": {"balls[1]": "fep"}}}, "expected one of none, dax, wug"),
        ({"let": {"ann.gap": {"blue": 10}}}, "expected a whole number from 0 to 9"),
    ],
)
def test_layouts_that_do_not_fit(tmp_path: Path, given: dict[str, Any], message: str) -> None:
    env = played(tmp_path, "{when: t > 98, say: Hello}").env
    with pytest.raises(ValueError, match=message):
        env.reset(options={"layout": given})


def test_explanations_say_that_there_is_nothing(tmp_path: Path) -> None:
    run = played(tmp_path, f"{{when: name_of({NEAREST}) == dax, say: Hello}}").steps(1)
    (asked,) = [entry for entry in run.env.unwrapped.explain()["others"] if "dax" in entry.get("why", "")]
    assert f"name_of({NEAREST}) is none" in asked["why"]


def test_a_program_without_them_has_none_of_their_instructions() -> None:
    program = sd.compile(sd.load("talkitout"))
    assert isinstance(program, Program)
    assert not {int(Op.READ_AT), int(Op.STORE_AT)} & set(program.code[:, 0].tolist())


EMPTY = """
    grammar: {templates: [It is <noun>, Hello], nouns: ["3", "5", "9"]}
    tables: {paid: {"3": 4, "5": 7, "9": 2}}
    objects:
      keys: {type: switch, count: 3, at: [[1, 3], [1, 4], [1, 5]], unlocks: back | front | side}
      front: {type: door, at: [6, 2], state: locked}
      back: {type: door, at: [6, 4], state: locked}
      side: {type: door, at: [6, 5], state: locked}
    state:
      who: {start: none}
      gate: {start: none}
      word: {start: none}
      held: 0
    rules:
      - {when: t == 1 and CONDITION, set: {held: held + 1}}
      - {when: t == 1 and not (CONDITION), set: {held: held + 1}}
      - {when: t == 3 and CONDITION, set: {held: held + 10}}
      - {when: t == 3 and not (CONDITION), set: {held: held + 10}}
      - {when: t == 2, set: {who: pick(people), gate: pick(front | back | side), word: pick(nouns)}}
    frames: {wait: {states: {waiting: {do: stay}}}}
    cast:
      people: {count: 2, at: [[4, 4], [4, 2]], name: [Ann, Bob], frame: wait}
"""


@pytest.mark.parametrize(
    "condition",
    [
        *("who.is(waiting)", 'who.name == "Ann"', "who.turns_in_state > 99", "back.toggled_by(who)"),
        *("paid(word) == 4", "gate.unlocked_by.pressed", "word + 1 > 5", "who.x == 4"),
    ],
)
def test_what_follows_from_an_empty_register_is_not_found(tmp_path: Path, condition: str) -> None:
    """Neither it nor its opposite holds, until the register holds something."""
    run = Folder(tmp_path)(EMPTY.replace("CONDITION", condition))
    assert run.steps(1).state["state"]["held"] == 0
    assert run.steps(2).state["state"]["held"] == 10
