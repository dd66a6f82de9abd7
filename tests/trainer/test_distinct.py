"""Distinct rows and prefix trees say the same as the plain data they replace."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from socialai_dsl.trainer.features import DistinctRows, content_ids
from socialai_dsl.trainer.nets.dialogue import PrefixTree, prefix_tree

HISTORIES = st.lists(st.lists(st.integers(1, 3), max_size=6), min_size=1, max_size=12)


def padded(histories: list[list[int]], length: int) -> np.ndarray:
    rows = np.zeros((len(histories), length), np.int16)
    for row, words in zip(rows, histories, strict=True):
        row[: len(words)] = words
    return rows


def path(tree: PrefixTree, state: int) -> list[int]:
    words: list[int] = []
    while state:
        words.insert(0, int(tree.tokens[state - 1]))
        state = int(tree.parents[state - 1])
    return words


@given(HISTORIES)
def test_every_history_is_a_path(histories: list[list[int]]) -> None:
    tree = prefix_tree(padded(histories, 7))
    assert [path(tree, int(leaf)) for leaf in tree.leaves] == histories


@given(HISTORIES)
def test_every_distinct_prefix_is_one_state_and_states_are_sorted_by_length(
    histories: list[list[int]],
) -> None:
    tree = prefix_tree(padded(histories, 6))
    prefixes = {tuple(words[:n]) for words in histories for n in range(1, len(words) + 1)}
    assert len(tree.tokens) == len(prefixes) == tree.offsets[-1]
    for depth, (first, last) in enumerate(zip(tree.offsets[:-1], tree.offsets[1:], strict=True), start=1):
        assert all(len(path(tree, state)) == depth for state in range(first + 1, last + 1))
        assert (tree.parents[first:last] <= first).all(), "a state may only continue a shorter one"


@given(hnp.arrays(np.int16, (9, 5), elements=st.integers(-3, 3)))
def test_content_ids_are_equal_exactly_for_equal_rows(rows: np.ndarray) -> None:
    ids = content_ids(rows)
    same = (rows[:, None] == rows[None]).all(axis=2)
    assert ((ids[:, None] == ids[None]) == same).all()


def test_rows_are_stored_once_and_found_again() -> None:
    table = DistinctRows((2,), np.int16)
    values = np.array([[1, 1], [2, 2], [1, 1], [3, 3]], np.int16)
    rows, fresh = table.add(np.array([70, -5, 70, 9]), values)
    assert len(table.data) == 4
    assert len(fresh) == 3
    assert (table.data[rows] == values).all()
    assert (table.data[1:] == values[fresh]).all(), "fresh rows are the last ones, in order"
    again, fresh = table.add(np.array([9, 9, 70, -5]), values[[3, 3, 0, 1]])
    assert len(fresh) == 0
    assert again.tolist() == [rows[3], rows[3], rows[0], rows[1]]
    assert (table.data[0] == 0).all()
