"""Who plays which episode: seeds, indices and episode numbers of the rows of a batch."""

from __future__ import annotations

import secrets
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.draws import MAX_SEED, TEST_DOMAIN
from socialai_dsl.engine.state import Key

LAST_EPISODE = (1 << 32) - 1
OPTIONS = ("index", "layout", "reset_mask", "test_episode")


def check_options(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """The options of a reset. Raises ValueError for one that does not exist."""
    options = dict(options or {})
    for name in options:
        if name not in OPTIONS:
            raise ValueError(f"options: got {name!r}; expected some of {', '.join(OPTIONS)}")
    return options


def choose_episodes(
    keys: NDArray[np.uint64], chosen: NDArray[np.bool_], seed: Any, options: Mapping[str, Any], fresh: bool
) -> None:
    """Set seed, index and episode in the rows, uint64 (E, Key.WORDS), that are chosen, bool (E,).

    `test_episode` names episodes of a domain of keys that no seed reaches; 0 to 499 are the fixed test set.
    One seed gives environment i (seed, i); a list gives it (seeds[i], 0); both start at episode 0. Without a seed the
    next episode follows, or, in a fresh batch, a seed is drawn from the operating system.
    """
    rows = np.flatnonzero(chosen)
    if options.get("test_episode") is not None:
        episodes = _each("options['test_episode']", options["test_episode"], len(keys), LAST_EPISODE)
        keys[rows, Key.SEED], keys[rows, Key.INDEX] = TEST_DOMAIN, 0
        keys[rows, Key.EPISODE] = episodes[rows]
        return
    if seed is None and not fresh:
        keys[rows, Key.EPISODE] += np.uint64(1)
        return
    keys[rows, Key.EPISODE] = 0
    if seed is None:
        seed = secrets.randbelow(MAX_SEED + 1)
    keys[rows, Key.SEED] = _each("seed", seed, len(keys), MAX_SEED)[rows]
    one_for_all = isinstance(seed, int | np.integer)
    keys[rows, Key.INDEX] = rows if one_for_all else 0
    if options.get("index") is not None:
        keys[rows, Key.INDEX] = _each("options['index']", options["index"], len(keys), MAX_SEED)[rows]


def _each(what: str, given: Any, count: int, highest: int) -> NDArray[np.uint64]:
    """One number for each environment, from one for all or a list."""
    numbers = [given] * count if isinstance(given, int | np.integer) else given
    if not isinstance(numbers, Sequence | np.ndarray) or len(numbers) != count:
        raise ValueError(f"{what}: got {given!r}; expected a whole number or a list of {count}")
    for number in numbers:
        if isinstance(number, bool) or not isinstance(number, int | np.integer) or not 0 <= number <= highest:
            raise ValueError(f"{what}: got {number!r}; expected a whole number from 0 to {highest}")
    return np.array([int(number) for number in numbers], np.uint64)
