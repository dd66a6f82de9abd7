"""What is drawn at reset comes after what it needs, and may not go in circles."""

from __future__ import annotations

from socialai_dsl.semantics.plans import Drawn


def order(checked):
    """A short name for every item: what it is and whose."""
    return [
        item.path if isinstance(item, Drawn) else f"{type(item).__name__.lower()} {item.entity}"
        for item in checked.setup
    ]


def test_who_is_nearest_is_asked_once_all_of_them_have_their_places(meaning):
    cast = {"guide": {"place": "next_to(goal)"}}
    names = order(meaning(cast=cast, let={"goal": "nearest(d in doors to agent)"}))
    assert max(names.index(f"placing {n}") for n in (0, 2, 3, 4, 5)) < names.index("let.goal")
    assert names.index("let.goal") < names.index("placing 1")


def test_lets_in_a_circle_are_reported_once(mistakes):
    found = mistakes(let={"a": "b + 1", "b": "a + 1"})
    assert found == ["S208 `a` needs `b` and `b` needs `a`"]


def test_places_in_a_circle_are_reported_once(mistakes):
    found = mistakes(cast={"guide": {"place": "next_to(agent)"}, "agent": {"place": "next_to(guide)"}})
    assert [line[:4] for line in found] == ["S208"]
