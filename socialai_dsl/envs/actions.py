"""An action as people write it: words or numbers of body action, template and noun, or a whole sentence."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.diagnostics import did_you_mean

FORMS = "(body action, template, noun) or (body action, sentence), each part a word, a number or None"


Live = tuple[frozenset[int], frozenset[int]]
"""Indices of templates and nouns that are meant, where a word stands for several."""


def encode_action(
    action: Sequence[Any],
    actions: Sequence[str],
    templates: Sequence[str],
    nouns: Sequence[str],
    live: Live | None = None,
) -> NDArray[np.int64]:
    """The action of the space, int64 (4,), for the paper's notation or words.

    `(1, None, None)` turns right, `(None, 1, 5)` says template 1 with noun 5 and stays, `("forward", "Open sesame")`
    does both.

    Args:
        action: what is meant.
        actions: words for body actions.
        templates: what can be said, each with its <noun>.
        nouns: what the <noun> can be.
        live: which of equal templates and nouns are meant; None: the first.

    Raises:
        ValueError: what was given is none of these; the message says what was got and what was expected.
    """
    if isinstance(action, str) or not isinstance(action, Sequence | np.ndarray) or len(action) not in (2, 3):
        raise ValueError(f"got the action {action!r}; expected {FORMS}")
    live_templates, live_nouns = live or (frozenset(), frozenset())
    primitive = len(actions) if action[0] is None else _index(action[0], actions, "body action")
    if len(action) == 2:
        spoken = (
            None
            if action[1] is None
            else _sentence(action[1], templates, nouns, (live_templates, live_nouns))
        )
    elif (action[1] is None) != (action[2] is None):
        raise ValueError(f"got template {action[1]!r} and noun {action[2]!r}; expected both or neither")
    elif action[1] is None:
        spoken = None
    else:
        template = _index(action[1], templates, "template", live_templates)
        spoken = template, _index(action[2], nouns, "noun", live_nouns)
    return np.array([primitive, 0, 0, 0] if spoken is None else [primitive, 1, *spoken], np.int64)


def _index(given: Any, words: Sequence[str], what: str, live: frozenset[int] = frozenset()) -> int:
    if isinstance(given, str):
        if given in words:
            return min((i for i in live if words[i] == given), default=words.index(given))
        near = did_you_mean(given, words)
        hint = f"; did you mean {near!r}?" if near else ""
        raise ValueError(f"got the {what} {given!r}; expected one of {', '.join(map(repr, words))}{hint}")
    if isinstance(given, int | np.integer) and not isinstance(given, bool) and 0 <= given < len(words):
        return int(given)
    raise ValueError(
        f"got the {what} {given!r}; expected a number from 0 to {len(words) - 1}, a word, or None"
    )


def _sentence(given: Any, templates: Sequence[str], nouns: Sequence[str], live: Live) -> tuple[int, int]:
    pairs = product(range(len(templates)), range(len(nouns)))
    # Of equal sentences the last is kept: a live one if there is one, else the first.
    ordered = sorted(pairs, key=lambda pair: (pair[0] in live[0] and pair[1] in live[1], -pair[0], -pair[1]))
    sentences = {templates[t].replace("<noun>", nouns[n]): (t, n) for t, n in ordered}
    if isinstance(given, str):
        if given in sentences:
            return sentences[given]
        near = did_you_mean(given, sentences)
        hint = f"; did you mean {near!r}?" if near else ""
        raise ValueError(f"got the sentence {given!r}, which the grammar cannot say{hint}")
    raise ValueError(f"got the sentence {given!r}; expected a text such as {next(iter(sentences))!r}")
