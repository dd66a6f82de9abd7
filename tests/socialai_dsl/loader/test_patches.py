"""Patches change what their paths say, in the order remove, set, add, or say why they cannot."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from socialai_dsl.diagnostics import DiagnosticBag, ScenarioError
from socialai_dsl.loader.patches import Edit, Place, apply_patch, follow
from socialai_dsl.loader.reader import read_document
from socialai_dsl.loader.resolved import merge
from socialai_dsl.source import Node, Source

BASE = """\
scenario: base
horizon: 10
cast:
  anna: {name: Anna, with: {answer: yes sir}}
  bob: {name: Bob}
define:
  near(c): c.next_to(anna)
  two(a, b): a == b
  dotted.key: 1
outcome:
  - success: agent.at(door)
    id: won
  - failure: agent.did(done)
  - {failure: t == 3, id: late}
"""


def apply(patch: str, base: str = BASE) -> tuple[Any, list[str], list[Edit], Node]:
    root = read_document(Source("base.yaml", base))
    found = DiagnosticBag()
    edits = apply_patch(root, read_document(Source("p.yaml", patch)), found)
    return root.data, [str(d) for d in found], edits, root


def test_remove_set_add_in_this_order() -> None:
    data, found, edits, _ = apply(
        "add: {cast: {bob: {name: Bobby}}}\nset: {cast.anna.name: Ann, horizon: 20}\nremove: [cast.bob, outcome]\n"
    )
    assert found == []
    assert data["cast"] == {"anna": {"name": "Ann", "with": {"answer": "yes sir"}}, "bob": {"name": "Bobby"}}
    assert list(data) == ["scenario", "horizon", "cast", "define"]
    assert [(e.verb, e.path) for e in edits] == [
        ("remove", "cast.bob"),
        ("remove", "outcome"),
        ("set", "cast.anna.name"),
        ("set", "horizon"),
        ("add", "cast"),
    ]
    assert str(edits[2].span) == "p.yaml:2:7"


def test_lists_by_index_and_id() -> None:
    data, found, _, _ = apply(
        "remove:\n  - outcome[0]\n  - outcome[1]\nset:\n  outcome[late].failure: t == 4\n"
        "add:\n  outcome:\n    - failure: t == 9\n"
    )
    assert found == []
    # Both indices mean the list as it was.
    assert data["outcome"] == [{"failure": "t == 4", "id": "late"}, {"failure": "t == 9"}]


def test_whole_items_and_odd_keys() -> None:
    data, found, _, _ = apply(
        "set:\n  outcome[0]: {success: false}\n  define.near(c): 1\n  define.two(a, b): 2\n  define.dotted.key: 3\n"
        "  define.new(x, y): 4\n"
    )
    assert found == []
    assert data["outcome"][0] == {"success": False}
    assert data["define"] == {"near(c)": 1, "two(a, b)": 2, "dotted.key": 3, "new(x, y)": 4}


def test_a_replaced_key_keeps_its_place_and_a_new_one_goes_last() -> None:
    data, _, _, _ = apply("set: {cast.anna: {name: A}, cast.zoe: {name: Z}, cast.bob: {name: B}}")
    assert list(data["cast"]) == ["anna", "bob", "zoe"]


def test_sections_that_a_scenario_leaves_out_can_be_filled() -> None:
    data, found, _, _ = apply("set: {observe.npcs: hidden}\nadd: {rules: [{when: t == 1}], params: {p: 1}}\n")
    assert found == []
    assert (data["observe"], data["rules"], data["params"]) == (
        {"npcs": "hidden"},
        [{"when": "t == 1"}],
        {"p": 1},
    )


def test_description_is_replaced() -> None:
    assert apply("about: another\nset: {}\n")[0]["about"] == "another"


@pytest.mark.parametrize(
    ("patch", "message"),
    [
        (
            "remove: [cast.ana]",
            "p.yaml:1:10: S501 there is no `cast.ana` in base.yaml; did you mean `cast.anna` (base.yaml:4)?",
        ),
        (
            "set: {cast.ana.name: A}",
            "p.yaml:1:7: S501 there is no `cast.ana` in base.yaml; did you mean `cast.anna` (base.yaml:4)?",
        ),
        (
            "set: {cats.anna: 1}",
            "p.yaml:1:7: S501 there is no `cats` in base.yaml; did you mean `cast` (base.yaml:3)?",
        ),
        (
            "set: {obsreve.npcs: hidden}",
            "S501 there is no `obsreve` in base.yaml; did you mean `observe.npcs`?",
        ),
        ("set: {horizon.x: 1}", "S501 `horizon` in base.yaml is a number, there is nothing below it"),
        ("set: {'cast[0]': 1}", "S501 `cast` in base.yaml is a mapping, not a list"),
        ("set: {outcome.success: 1}", "S501 `outcome` in base.yaml is a list"),
        (
            "remove: ['outcome[3]']",
            "S501 there is no `outcome[3]` in base.yaml; `outcome` has items [0] to [2]",
        ),
        ("remove: ['outcome[-1]']", "S501 there is no `outcome[-1]`"),
        ("remove: ['outcome[lat]']", "; did you mean `outcome[late]`?"),
        ("remove: ['outcome[99999999999999999999]']", "S501 there is no"),
        ("remove: [cast.bob, cast.bob]", "p.yaml:1:20: S501 `cast.bob` is removed twice"),
        ("remove: [cast..bob]", "S501 `cast..bob` is not a path"),
        ("remove: [cast.]", "S501 `cast.` is not a path"),
        ("remove: ['']", "S501 `` is not a path"),
        ("remove: [3]", "S104 a path is a text, not a number"),
        ("remove: cast.bob", "S104 `remove` is a list of paths, not a text"),
        ("set: [a]", "S104 `set` is a mapping from paths to values, not a list"),
        ("add: {cast: {bob: 1}}", "p.yaml:1:14: S502 `cast.bob` exists already (base.yaml:5)"),
        ("add: {outcome: {success: 1}}", "S104 `outcome` in base.yaml is a list"),
        ("add: {cast: [1]}", "S104 `cast` is a mapping"),
        ("add: {horizon: [1]}", "S104 nothing can be added to `horizon`: it is a number"),
        ("add: {cast.zoe: {a: 1}}", "S501 there is no `cast.zoe` in base.yaml"),
        ("set: {" + "a." * 300 + "b: 1}", "S004 a path has at most"),
    ],
)
def test_mistakes(patch: str, message: str) -> None:
    data, found, edits, _ = apply(patch)
    assert len(found) == 1
    assert message in found[0]
    assert len(edits) <= 1
    if not edits:
        assert data == read_document(Source("b", BASE)).data


def test_all_mistakes_of_a_patch_are_reported() -> None:
    _, found, _, _ = apply("remove: [a.b, c]\nset: {d.e: 1, horizon.f: 2}\nadd: {g: [1]}\n")
    assert len(found) == 5


def test_origins_follow_the_parts() -> None:
    _, _, _, root = apply(
        "remove: ['outcome[0]']\nset: {cast.anna.name: Ann}\nadd: {outcome: [{failure: t == 9}]}\n"
    )
    places = {path: str(node.value_span()) for path, node in root.walk()}
    assert places[("outcome", 0, "failure")] == "base.yaml:13:14"
    assert places[("outcome", 2, "failure")] == "p.yaml:3:27"
    assert places[("cast", "anna", "name")] == "p.yaml:2:23"
    assert places[("cast", "bob", "name")] == "base.yaml:5:15"


PATCH = """\
remove: ['outcome[0]', cast.bob]
set: {cast.anna.name: Ann, observe.npcs: hidden}
add: {outcome: [{failure: t}]}
"""
PIECES = [*"{}[]:,.'\n", "add", "set: ", "remove: ", "outcome", "cast", "[late]", "~", "3", ": "]


@given(
    st.lists(st.tuples(st.integers(0, len(PATCH)), st.integers(0, 9), st.sampled_from(PIECES)), max_size=5)
)
def test_mutated_patches_raise_nothing_but_scenario_errors(mutations: list[tuple[int, int, str]]) -> None:
    text = PATCH
    for place, removed, inserted in mutations:
        text = text[:place] + inserted + text[place + removed :]
    try:
        data, found, edits, root = apply(text)
    except ScenarioError:
        return
    assert found or edits or "set" not in text
    assert root.data == data
    for _, node in root.walk():
        assert node.value_span().file in ("base.yaml", "p.yaml")


def document(text: str) -> Node:
    return read_document(Source("f", text))


def test_merge_keeps_the_order_of_the_base_and_the_file_wins() -> None:
    base = document("a: 1\nb: {x: 1, y: [1, 2]}\nc: 3\n")
    over = document("d: 4\nb: {y: [9], z: 2}\na: {deep: 1}\n")
    merged = merge(base, over).data
    assert merged == {"a": {"deep": 1}, "b": {"x": 1, "y": [9], "z": 2}, "c": 3, "d": 4}
    assert isinstance(merged, dict)
    assert list(merged) == ["a", "b", "c", "d"]


KEY = st.text("ab.()[]0,", min_size=1, max_size=4)
TREE = st.recursive(
    st.integers(0, 9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEY, inner, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(KEY, TREE, max_size=4), st.text("ab.[]()01,", max_size=12))
def test_following_any_path_through_anything_ends(data: Any, path: str) -> None:
    root = document("")
    root.put(data)
    place = follow(root, path)
    if isinstance(place, Place) and place.node is not None:
        assert dict(place.parent.items())[place.key] is place.node
    else:
        assert path not in data
