"""Options of callers: each is used, or refused by its name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from socialai_dsl.diagnostics import suggested
from socialai_dsl.loader.layouts import read_layout
from socialai_dsl.source import Source


class UnknownOptionError(ValueError, TypeError):
    """An option that a call does not have. It is a TypeError as well, for libraries that look for Python's own."""


def refuse_unknown(call: str, unknown: Mapping[str, Any], known: Sequence[str], otherwise: str = "") -> None:
    """Raise UnknownOptionError for the first option that a call does not have, if there is one.

    Args:
        call: what was called.
        unknown: options that it does not have, with their values.
        known: those that it has.
        otherwise: what is added where none of them is near.
    """
    for name, given in unknown.items():
        listed = f"some of {', '.join(known)}" if known else "none"
        hint = suggested(str(name), known, f"; expected {listed}{otherwise}", repr)
        raise UnknownOptionError(f"{name}: got {given!r}, but {call} has no such option{hint}")


def check_render_mode(given: Any, modes: Sequence[str]) -> str | None:
    """One of the modes, or None. Raises ValueError for anything else."""
    if given is None or (isinstance(given, str) and given in modes):
        return given
    near = suggested(str(given), modes, quoted=repr)
    raise ValueError(f"render_mode: got {given!r}; expected None or one of {', '.join(modes)}{near}")


def reset_options(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """The options of a reset. Raises ValueError for one that does not exist."""
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise ValueError(f"options: got {options!r}; expected a mapping of names to values, or None")
    known = ("index", "layout", "reset_mask", "test_episode")
    refuse_unknown("reset", {k: v for k, v in options.items() if k not in known}, known)
    return dict(options)


def reset_arguments(
    seed: int = 0,
    index: int | None = None,
    test_episode: int | None = None,
    layout: Path | Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The arguments of `env.reset` for an episode.

    Args:
        seed: of the rooms.
        index: which room of the seed, from 0, as `check` and `validate` number them.
        test_episode: a number of the fixed test set, instead of seed and index.
        layout: a room to start from, or a JSON or YAML file with one (docs/layouts.md).

    Raises:
        ValueError: these cannot go together, or the file is no JSON.
        ScenarioError: the file is no YAML.
        OSError: the file cannot be read.
    """
    options: dict[str, Any] = {}
    if test_episode is not None:
        if index is not None:
            raise ValueError(
                "index: the test set has rooms of its own; leave out the index or the test episode"
            )
        options["test_episode"] = test_episode
    if index is not None:
        options["index"] = index
    if isinstance(layout, Path):
        try:
            source = Source(str(layout), layout.read_text(encoding="utf-8"), layout)
        except UnicodeDecodeError as error:
            raise ValueError(f"layout: {layout} is no text: {error}") from None
        options["layout"] = read_layout(source)
    elif layout is not None:
        options["layout"] = layout
    return {"options": options or None} | ({} if test_episode is not None else {"seed": seed})


def origin(reset: Mapping[str, Any]) -> str:
    """Which episode the arguments of `env.reset` begin, in words."""
    options = reset["options"] or {}
    if "test_episode" in options:
        return f"test episode {options['test_episode']}"
    room = f", room {options['index']}" if "index" in options else ""
    return f"seed {reset['seed']}{room}"


def each(what: str, given: Any, count: int, highest: int, or_none: bool = False) -> list[int | None]:
    """One number for each environment, from one for all or a list.

    Args:
        what: name of the option.
        given: its value.
        count: how many environments there are.
        highest: greatest number; the least is 0.
        or_none: whether elements of the list may be None.

    Raises:
        ValueError: it is something else.
    """
    numbers = [given] * count if isinstance(given, int | np.integer) else given
    is_list = (isinstance(numbers, Sequence) and not isinstance(numbers, str | bytes)) or (
        isinstance(numbers, np.ndarray) and numbers.ndim == 1
    )
    if not is_list or len(numbers) != count:
        raise ValueError(f"{what}: got {given!r}; expected a whole number or a list of {count}")
    for number in numbers:
        if number is None and or_none:
            continue
        if isinstance(number, bool) or not isinstance(number, int | np.integer) or not 0 <= number <= highest:
            raise ValueError(f"{what}: got {number!r}; expected a whole number from 0 to {highest}")
    return [None if number is None else int(number) for number in numbers]
