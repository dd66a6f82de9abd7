"""Designs: orders are balanced, rooms suffice, newcomers fill the groups alike."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from pathlib import Path

import pytest

from socialai_dsl.frontend import load_study
from socialai_dsl.semantics.study import Design, balanced_orders, least_filled, shuffled


@pytest.mark.parametrize("count", range(1, 13))
def test_each_block_stands_at_each_place_and_behind_each_other_equally_often(count: int) -> None:
    orders = balanced_orders(count)
    assert all(sorted(order) == list(range(count)) for order in orders)
    times = len(orders) // count
    assert Counter(place for order in orders for place in enumerate(order)) == Counter(
        {(place, block): times for place in range(count) for block in range(count)}
    )
    follows = Counter(pair for order in orders for pair in pairwise(order))
    assert len(set(follows.values())) <= 1
    assert len(follows) == count * (count - 1)


def test_newcomers_fill_the_groups_alike() -> None:
    counts = [0, 0, 0]
    for _ in range(31):
        counts[least_filled(counts)] += 1
    assert counts == [11, 10, 10]
    assert least_filled([3, 1, 1]) == 1


def test_an_order_of_rooms_follows_from_what_it_is_about() -> None:
    rooms = range(20)
    assert shuffled(rooms, "asking", 1, 7) == shuffled(rooms, "asking", 1, 7)
    assert sorted(shuffled(rooms, "asking", 1, 7)) == list(rooms)
    assert len({shuffled(rooms, "asking", 1, number) for number in range(50)}) == 50


def designed(folder: Path, rest: str) -> Design:
    file = folder / "study.yaml"
    file.write_text(f"study: s\nconsent: I agree.\n{rest}", encoding="utf-8")
    return load_study(file).design


def test_blocks_with_the_same_scenario_have_rooms_of_their_own(tmp_path: Path) -> None:
    named = (("talkitout", 3), ("help", 2), ("talkitout", 2))
    blocks = "".join(f"- {{scenario: {name}, episodes: {count}}}\n" for name, count in named)
    assert designed(tmp_path, f"blocks:\n{blocks}").rooms == ((0, 1, 2), (0, 1), (3, 4))


def test_groups_have_blocks_of_their_own_in_orders_that_are_balanced_among_those_who_play_them(
    tmp_path: Path,
) -> None:
    blocks = (
        "- {scenario: talkitout, episodes: 3, groups: [1, 2]}\n"
        "- {scenario: help, episodes: 2}\n"
        "- {scenario: showme, episodes: 2, groups: [3, 4]}\n"
    )
    design = designed(tmp_path, f"blocks:\n{blocks}assign: {{order: balanced, groups: 4}}\n")
    assert design.orders == ((0, 1), (1, 0), (1, 2), (2, 1))
