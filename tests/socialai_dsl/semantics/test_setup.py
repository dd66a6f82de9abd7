"""What is drawn at reset: where, at which site, and in which order."""

from __future__ import annotations

from socialai_dsl.frontend import load
from socialai_dsl.semantics.plans import Coloring, Drawn, Facing, Placing
from socialai_dsl.semantics.terms import Read


def places(checked):
    return [item for item in checked.setup if isinstance(item, Placing)]


def order(checked):
    """A short name for every item: what it is and whose."""
    return [
        item.path if isinstance(item, Drawn) else f"{type(item).__name__.lower()} {item.entity}"
        for item in checked.setup
    ]


def test_objects_then_npcs_then_the_agent(meaning):
    assert [p.entity for p in places(meaning())] == [2, 3, 4, 5, 1, 0]


def test_order_comes_first(meaning):
    assert [p.entity for p in places(meaning(order=["agent", "guide"]))] == [0, 1, 2, 3, 4, 5]


def test_what_a_place_needs_comes_before_it(meaning):
    checked = meaning(objects={"doors": {"type": "door", "count": 2, "place": "next_to(agent)"}})
    assert [p.entity for p in places(checked)] == [0, 2, 3, 1]


def test_a_place_may_need_a_drawn_value_which_needs_a_colour(meaning):
    cast = {"guide": {"place": "column(n) where not here.next_to(doors)"}}
    checked = meaning(cast=cast, let={"n": "count(d in doors where d.color == red) + 1"})
    names = order(checked)
    assert (
        max(names.index(f"coloring {n}") for n in (2, 3, 4, 5))
        < names.index("let.n")
        < names.index("placing 1")
    )


def test_who_is_nearest_is_asked_once_all_of_them_have_their_places(meaning):
    cast = {"guide": {"place": "next_to(goal)"}}
    names = order(meaning(cast=cast, let={"goal": "nearest(d in doors to agent)"}))
    assert max(names.index(f"placing {n}") for n in (0, 2, 3, 4, 5)) < names.index("let.goal")
    assert names.index("let.goal") < names.index("placing 1")


def test_each_wall_has_one(meaning):
    regions = [p.regions for p in places(meaning()) if p.entity > 1]
    assert [(r[0].name, r[0].side, r[0].margin) for r in regions] == [
        ("wall", "top", 2),
        ("wall", "bottom", 2),
        ("wall", "left", 2),
        ("wall", "right", 2),
    ]


def test_sites_are_those_of_the_document(meaning):
    checked = meaning()
    by_entity = {(type(s), s.entity): s for s in checked.setup if not isinstance(s, Drawn)}
    assert [by_entity[Placing, n].site for n in (0, 1, 3)] == [
        "cast.agent.cell",
        "cast.guide.cell",
        "objects.doors.cell",
    ]
    assert [by_entity[Placing, n].number for n in (2, 3, 4, 5)] == [0, 1, 2, 3]
    assert (by_entity[Coloring, 3].site, by_entity[Coloring, 3].number) == ("objects.doors.color", 1)
    assert by_entity[Coloring, 4].distinct_from == (2, 3)
    assert by_entity[Facing, 1].site == "cast.guide.facing"


def test_defaults_count_as_written_in_the_member(meaning):
    checked = meaning(npc_defaults={"color": "pick(red | blue)", "facing": "down"}, cast={"guide": {}})
    (color,) = [s for s in checked.setup if isinstance(s, Coloring) and s.entity == 1]
    assert color.value.site == "cast.guide.color"


def test_a_list_of_places_gives_one_each(meaning):
    checked = meaning(objects={"doors": {"type": "door", "count": 2, "place": ["wall(top)", "row(2)"]}})
    assert [p.regions[0].name for p in places(checked)[:2]] == ["wall", "row"]


def test_a_list_of_cells_is_a_group(meaning):
    checked = meaning(objects={"doors": {"type": "switch", "at": [[1, "H - 1"], [2, 1]]}})
    assert [e.index for e in checked.entities if e.key == "doors"] == [0, 1]


def test_a_wall_that_is_drawn_is_an_argument(meaning):
    doors = {"type": "door", "count": 1, "place": "wall(pick(top | left))"}
    (region,) = places(meaning(objects={"doors": doors}))[0].regions
    assert (region.side, [i.value for i in region.args[0].items]) == (None, [0, 2])


def test_a_colour_of_a_group_gives_one_each(meaning):
    objects = {"keys": {"type": "switch", "count": 4, "color": "doors.color"}}
    colors = [s for s in meaning(objects=objects).setup if isinstance(s, Coloring) and s.entity > 5]
    assert [c.value.term.entity.value for c in colors] == [2, 3, 4, 5]


def test_a_known_name_needs_no_register(meaning):
    checked = meaning(cast={"guide": {"name": "Old Tom"}, "x_ray": {}, "agent": {}})
    assert [e.name.type.words for e in checked.entities[:3]] == [("Agent",), ("Old Tom",), ("X ray",)]


def test_lets_in_a_circle_are_reported_once(mistakes):
    found = mistakes(let={"a": "b + 1", "b": "a + 1"})
    assert found == ["S208 `a` needs `b` and `b` needs `a`"]


def test_places_in_a_circle_are_reported_once(mistakes):
    found = mistakes(cast={"guide": {"place": "next_to(agent)"}, "agent": {"place": "next_to(guide)"}})
    assert [line[:4] for line in found] == ["S208"]


def test_slots_are_registers_drawn_at_their_own_site(meaning):
    frames = {
        "go": {
            "slots": {"goal": "object"},
            "let": {"n": "pick(1..3)"},
            "states": {"a": {"do": "go_to(goal)"}},
        }
    }
    cast = {"guide": {"frame": "go", "with": {"goal": "pick(doors)"}}}
    drawn = {s.path: s.value for s in meaning(frames=frames, cast=cast).setup if isinstance(s, Drawn)}
    assert drawn["guide.goal"].site == "cast.guide.with.goal"
    assert drawn["guide.n"].site == "guide/frames.go.let.n"


def test_the_same_draws_with_hidden_npcs():
    assert load("talkitout").checked.setup == load("talkitout+unsocial").checked.setup


def test_the_liar_is_named_and_coloured_after_the_honest_guide():
    checked = load("talkitout").checked
    names = order(checked)
    assert names.index("honest.name") < names.index("liar.name")
    assert names.index("coloring 2") < names.index("coloring 3")
    (liar,) = [s for s in checked.setup if isinstance(s, Drawn) and s.path == "liar.name"]
    assert isinstance(liar.value.term.condition.right, Read)
