"""Suites that are trees, that sweep, or that play acts: their leaves, weights and splits, and what is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from socialai_dsl.frontend import check
from tests.socialai_dsl.checking.suite_files import suite, written

pytestmark = pytest.mark.usefixtures("folder")


def test_every_parameter_of_a_tree_has_a_value_in_every_leaf() -> None:
    school = suite("school")
    assert len(school.members) == 3 * 2 + 2
    assert school.labels[1] == {"problem": "password", "introduction": "none", "help": "told"}
    assert school.member_names[1] == "problem=password,introduction=none,help=told"
    assert school.labels[-1] == {"problem": "shopping", "size": "large"}


def test_the_values_of_a_parameter_are_equally_likely() -> None:
    assert suite("school").weights == (1, 1, 1, 1, 1, 1, 3, 3)


def test_a_leaf_is_its_scenario_with_the_values_for_its_parameters_and_its_changes() -> None:
    school = suite("school")
    texts = [member.resolved.params for member in school.members]
    assert texts[:3] == [{"introduction": "none"}, {"introduction": "none"}, {"introduction": "ask"}]
    assert texts[-1] == {}
    assert [member.scenario.room.size for member in school.members[-2:]] == [5, 6]


def test_a_leaf_may_say_how_its_episodes_start() -> None:
    starts = suite("school").starts
    assert [start is not None for start in starts] == [False, True] * 3 + [False] * 2
    assert starts[1] is not None
    assert starts[1].layout["let"] == {"secret": "bread"}


def test_splits_hold_out_what_has_all_the_values_named() -> None:
    school, train, test = suite("school"), suite("school?split=train"), suite("school?split=test")
    assert test.member_names == ("problem=password,introduction=gaze,help=none",)
    assert sorted(train.member_names + test.member_names) == sorted(school.member_names)
    assert train.weights == (1, 1, 1, 1, 1, 3, 3)
    assert suite("school?split=rooms").member_names == (
        "problem=shopping,size=small",
        "problem=shopping,size=large",
    )


FAMILY = (
    "suite: mine\ntree: {scenario: lesson, introduction: [none, ask, gaze], "
    "size: {small: {set: {room.size: 5}}, any: {}}}\n"
    "held_out: {introduction: gaze, size: [small]}\n"
    "splits:\n  gaze: {only: {introduction: gaze}}\n  small: {only: {size: small}}\n"
    "  both: {only: {introduction: [ask, gaze], size: small}}\n  ask: {without: {introduction: none}}\n"
)


def test_what_is_held_out_is_played_where_a_split_names_it_alone() -> None:
    Path("mine.yaml").write_text(FAMILY)
    played = {split: suite(f"mine.yaml{split}").member_names for split in ("", "?split=ask", "?split=gaze")}
    assert played == {
        "": ("introduction=none,size=any", "introduction=ask,size=any"),
        "?split=ask": ("introduction=ask,size=any",),
        "?split=gaze": ("introduction=gaze,size=any",),
    }
    assert suite("mine.yaml?split=small").member_names == (
        "introduction=none,size=small",
        "introduction=ask,size=small",
    )
    assert suite("mine.yaml?split=both").member_names == (
        "introduction=ask,size=small",
        "introduction=gaze,size=small",
    )


def test_a_sweep_is_the_product_of_its_values_and_keeps_the_members_share() -> None:
    sizes = suite("sizes")
    assert len(sizes.members) == 7
    assert sizes.weights == (1,) * 6 + (6,)
    assert sizes.member_names[5] == "errands[room.size=7,earshot=next_to]"
    assert [member.scenario.room.size for member in sizes.members[:6]] == [5, 5, 6, 6, 7, 7]
    assert sizes.labels[5] == {"room.size": "7", "earshot": "next_to"}


def test_a_sweep_needs_no_members() -> None:
    Path("mine.yaml").write_text("suite: mine\nsweep: {errands: {room.size: [5, 6]}}\n")
    assert suite("mine.yaml").member_names == ("errands[room.size=5]", "errands[room.size=6]")


def test_members_may_be_changed_and_named() -> None:
    Path("mine.yaml").write_text(
        "suite: mine\nmembers:\n- errands\n- {scenario: errands, name: wide, set: {room.size: 9}}\n"
        "splits: {test: {replace: {wide: lesson}}}\n"
    )
    assert suite("mine.yaml").member_names == ("errands", "wide")
    assert suite("mine.yaml").members[1].scenario.room.size == 9
    assert suite("mine.yaml?split=test").member_names == ("errands", "lesson")


def test_acts_share_the_longest_horizon() -> None:
    acts = suite("acts")
    assert acts.in_sequence
    assert [member.checked.horizon for member in acts.members] == [16, 16]
    assert not suite("pair").in_sequence


def test_a_value_changes_the_scenario_as_the_files_put_together_say() -> None:
    Path("sizes.yaml").write_text(
        "suite: sizes\ntree: {scenario: lesson, size: {small: {set: {room.size: 7}}}}\n"
    )
    Path("late.yaml").write_text("suite: late\nextends: sizes\ntree: {size: {small: {set: {horizon: 9}}}}\n")
    (member,) = suite("late").members
    assert (member.scenario.room.size, member.checked.horizon) == (7, 9)


def test_variants_are_passed_on_to_leaves() -> None:
    assert [m.resolved.name for m in suite("school+unsocial").members[:1]] == ["lesson+unsocial"]


@pytest.mark.parametrize(
    ("text", "findings"),
    [
        (
            "tree: {scenaro: errands}",
            ["2:8: S101 `scenaro` is no key of a tree, and no parameter, which has values; did you mean `scenario`?"],
        ),
        (
            "tree: {scenario: lesson, introdution: [ask]}",
            ["2:26: S206 no scenario has a parameter `introdution`, and its values change nothing; "
             "did you mean `introduction`?"],
        ),
        (
            "tree: {scenario: lesson, introduction: [ask, aks]}",
            ["2:46: S206 `aks` is none of the values of `introduction`; did you mean `ask`?"],
        ),
        (
            "tree: {scenario: lesson, introduction: [ask, ask]}",
            ["2:46: S213 `ask` is a value of `introduction` already"],
        ),
        ("tree: {introduction: [ask]}", ["2:23: S105 nothing says which scenario the leaf `introduction=ask` is"]),
        ("tree: {scenario: leson}", ["2:18: S504 there is no file `leson` in .; did you mean `lesson`?"]),
        ("tree: {scenario: pair}", ["2:18: S108 `pair` is a file of the kind `suite`; the members of a suite are "
                                    "scenarios"]),
        (
            "tree: {scenario: lesson, size: {small: {set: {rom.size: 5}}}}",
            ["2:47: S501 there is no `rom` in lesson.yaml; did you mean `room` (lesson.yaml:15)?"],
        ),
        (
            "tree: {scenario: lesson, size: {small: {set: {room.size: 2}}}}",
            ["2:58: S106 a room has 3 to 30 cells each way, walls included; 2..2 given"],
        ),
        (
            "tree: {a: {x: {scenario: lesson}}, b: {y: {scenario: errands}}}",
            ["2:44: S107 two values of this leaf name a scenario; the other one stands in line 2"],
        ),
        (
            "tree: {scenario: lesson, a: {x: {introduction: [ask]}}, introduction: [none]}",
            ["2:57: S213 `introduction` has a value already in this leaf"],
        ),
        ("tree: {scenario: lesson, size: []}", ["2:32: S106 `size` is empty"]),
        ("tree: {scenario: lesson, size: {a=b: {about: x}}}", ["2:33: S104 `a=b` is not a name"]),
        ("tree: {scenario: lesson}\nmembers: [errands]", ["3:1: S107 a suite has only one of `tree` and `members`"]),
        (
            "tree: {scenario: lesson, introduction: [ask, none]}\nsplits: {a: {only: {introduction: gaze}}}",
            ["3:35: S504 `gaze` is no value of `introduction` in the tree"],
        ),
        (
            "tree: {scenario: lesson, introduction: [ask, none]}\nsplits: {a: {without: {introducton: ask}}}",
            ["3:24: S504 the tree has no parameter `introducton`; did you mean `introduction`?"],
        ),
        (
            "tree: {scenario: lesson, introduction: [ask]}\nsplits: {a: {without: {introduction: ask}}}",
            ["3:10: S504 no leaf is in the split `a`"],
        ),
        (
            "tree: {scenario: lesson}\nsplits: {a: {members: [errands]}}",
            ["3:14: S107 a tree's splits have `only` and `without`, no `members`"],
        ),
        (
            "members: [errands]\nsplits: {a: {only: {size: 5}}}",
            ["3:14: S107 splits of members have `replace` and `members`, no `only`"],
        ),
        (
            "members: [errands]\nsweep: {errand: {room.size: [5]}}",
            ["3:9: S504 `errand` is no member of this suite; did you mean `errands`?"],
        ),
        (
            "members: [errands]\nsweep: {errands: {rom.size: [5, 6]}}",
            ["3:30: S501 there is no `rom` in errands.yaml; did you mean `room` (errands.yaml:11)?",
             "3:33: S501 there is no `rom` in errands.yaml; did you mean `room` (errands.yaml:11)?"],
        ),
        ("sweep: {errands: {room.size: 5}}", ["2:30: S104 `room.size` must be a list, got the number 5"]),
        (
            "tree: {scenario: lesson}\ndraw: in_sequence",
            ["2:1: S107 the acts of an episode are listed in `members`; a `tree` has no order"],
        ),
        (
            "draw: in_sequence\nmembers: [{scenario: lesson, layout: {t: 3}}]",
            ["3:30: S107 an act begins where the one before it ends, so it has no `layout`"],
        ),
        (
            "tree: {scenario: lesson, introduction: [ask, gaze]}\nheld_out: {introduction: gaz}",
            ["3:26: S504 `gaz` is no value of `introduction` in the tree; did you mean `gaze`?"],
        ),
        (
            "tree: {scenario: lesson, introduction: [ask, gaze]}\nheld_out: {introduction: [ask, gaze]}",
            ["3:1: S504 every leaf is held out"],
        ),
        (
            "tree: {scenario: lesson, size: {a: {}, b: {set: {room.size: 7}}, c: {set: {room.size: 7}}}}\n"
            "held_out: {size: c}",
            ["3:1: S107 `size=c` is held out, and plays the same as `size=b`, which is not"],
        ),
        (
            "members: [errands]\nheld_out: {size: 5}",
            ["3:1: S107 values of a `tree` are held out; a suite with `members` has splits with members of their own"],
        ),
        ("members: [{scenario: lesson, lay: {}}]",
         ["2:30: S101 unknown key `lay` in a member; did you mean `layout`?"]),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_where_it_is(text: str, findings: list[str]) -> None:
    assert written(text) == findings


def test_a_tree_of_too_many_leaves_is_refused_before_it_is_unfolded() -> None:
    numbers = ", ".join(map(str, range(30)))
    text = "tree: {scenario: lesson, " + ", ".join(f"p{i}: [{numbers}]" for i in range(30)) + "}"
    found = written(text)
    assert found[0].startswith("2:1: S004 this tree has 205891132094649")


def test_mistakes_of_a_leaf_name_the_suite_that_patched_it() -> None:
    found = written("tree: {scenario: lesson, who: {nobody: {remove: [let.secret]}}}")
    assert any("lesson.yaml" in finding and "`secret`" in finding for finding in found)
    assert all("in `lesson`, patched by mine.yaml" in str(d.hint) for d in check("mine.yaml").diagnostics)
