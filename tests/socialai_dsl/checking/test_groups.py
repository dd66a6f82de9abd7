"""Groups in the cast, written out as members."""

from __future__ import annotations

import pytest
import yaml

from socialai_dsl.checking.scenarios import MOST_MEMBERS as MOST
from socialai_dsl.checking.scenarios import put_parameters, spread
from socialai_dsl.diagnostics import DiagnosticBag
from socialai_dsl.frontend import check
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Source

TEXT = """\
scenario: party
cast:
  peers: {count: 3, name: [Bob, Cy, Dee], color: distinct, at: [[1, 1], [2, 1], [3, 1]], kind: guest}
  agent: {}
"""


def written_out(text):
    tree, bag = read_document(Source("party.yaml", text)), DiagnosticBag()
    spread(tree, bag)
    return tree, list(bag)


def test_each_member_has_its_own_of_a_list_and_the_rest_in_common():
    made, found = written_out(TEXT)
    assert not found
    assert made.data["cast"] == {
        "peers[0]": {"name": "Bob", "color": "distinct", "at": [1, 1], "kind": "guest"},
        "peers[1]": {"name": "Cy", "color": "distinct", "at": [2, 1], "kind": "guest"},
        "peers[2]": {"name": "Dee", "color": "distinct", "at": [3, 1], "kind": "guest"},
        "agent": {},
    }


def test_what_is_wrong_with_one_of_them_is_shown_where_it_is_written():
    made, _ = written_out(TEXT)
    columns = {"Bob": 28, "Cy": 33, "Dee": 37}
    for i, column in enumerate(columns.values()):
        place = made.at(("cast", f"peers[{i}]", "name")).value_span()
        assert (place.line, place.column) == (3, column)
        assert made.at(("cast", f"peers[{i}]")).key_span().column == 3
        assert made.at(("cast", f"peers[{i}]", "at", 0)).value_span().line == 3


def test_parameters_are_followed_to_every_member():
    tree = read_document(Source("party.yaml", TEXT.replace("guest", "$kind")))
    put_parameters(tree, {"kind": "guest"}, ["kind"], bag := DiagnosticBag())
    spread(tree, bag)
    kinds = [tree.at(("cast", f"peers[{i}]", "kind")) for i in range(3)]
    assert [(kind.value, kind.substituted) for kind in kinds] == [("guest", True)] * 3
    assert not list(bag)


def test_without_groups_nothing_changes():
    text = "scenario: alone\ncast: {agent: {}, bob: {name: Bob}}\n"
    made, found = written_out(text)
    assert made.data == yaml.safe_load(text)
    assert not found


@pytest.mark.parametrize("cast", ["[agent]", "everybody", "{agent: }", "{agent: bob, bob: 3}"])
def test_what_is_no_cast_is_left_to_others(cast):
    made, found = written_out(f"scenario: alone\ncast: {cast}\n")
    assert not found
    assert set(made.data) == {"scenario", "cast"}


@pytest.mark.parametrize(
    ("member", "code", "message"),
    [
        ("peers: {count: 0}", "S106", f"`count` is a number of members from 1 to {MOST}"),
        ("peers: {count: true}", "S106", f"`count` is a number of members from 1 to {MOST}"),
        (f"peers: {{count: {MOST + 1}}}", "S106", f"`count` is a number of members from 1 to {MOST}"),
        ("peers: {count: 0, name: [Bob, Cy]}", "S106", f"`count` is a number of members from 1 to {MOST}"),
        (
            "peers: {count: 2, name: [Bob]}",
            "S106",
            "1 given for 2: a list has one for each member of the group",
        ),
        (
            "peers: {count: 2, at: [1, 1]}",
            "S106",
            "1 given for 2: a list has one for each member of the group",
        ),
        ("peers: {cuont: 2}", "S101", "unknown key `cuont` in a member of the cast"),
        ("peers: {cuont: 2, name: [Ann, Bob]}", "S101", "unknown key `cuont` in a member of the cast"),
        ('"peers[0]": {}', "S104", "`peers[0]` is not a name"),
        ("bob: {name: [Bob, Cy]}", "S104", "a list gives one `name` to each of a group; `bob` is only one"),
        ("agent: {count: 2}", "S101", "there is one agent, so it has no `count`"),
    ],
)
def test_mistakes_are_reported_once(member, code, message):
    _, found = written_out(f"scenario: party\ncast:\n  {member}\n")
    assert [(d.code, d.message) for d in found] == [(code, message)]


def test_a_group_of_one_is_a_group():
    made, found = written_out("scenario: party\ncast: {peers: {count: 1, at: [1, 1], name: [Bob]}}\n")
    assert not found
    assert made.data["cast"] == {"peers[0]": {"at": [1, 1], "name": "Bob"}}


PARTY = """\
scenario: party
horizon: 9
grammar: {templates: [Hello <noun>], nouns: [you]}
room: {size: 8}
let: {host: pick(peers)}
cast:
  agent: {}
  peers: {count: 3, name: [Bob, Cy, Dee], color: distinct, place: [left_half, row(2), anywhere]}
outcome: [{success: any(p in peers where p.index == 1 and p.next_to(host)) and host.name == "Cy"}]
"""


def test_its_members_are_entities_of_one_name(tmp_path):
    file = tmp_path / "party.yaml"
    file.write_text(PARTY)
    result = check(file)
    assert not result.diagnostics
    assert [(one.key, one.index) for one in result.checked.entities[1:]] == [("peers", i) for i in range(3)]


@pytest.mark.parametrize(
    ("place", "column"), [("[left_half, rwo(2), anywhere]", 79), ("[left_half, row(2), anywere]", 87)]
)
def test_a_mistake_in_one_of_a_list_is_found_there(tmp_path, place, column):
    file = tmp_path / "party.yaml"
    file.write_text(PARTY.replace("[left_half, row(2), anywhere]", place))
    (found,) = check(file).diagnostics
    assert (found.span.line, found.span.column) == (8, column)
