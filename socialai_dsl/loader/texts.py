"""Where a file expects a text: there, a plain `No`, `on`, `true`, `null` or `1.5` is what is written."""

from __future__ import annotations

import re
from typing import Final

from socialai_dsl.loader.document import Data, DataPath
from socialai_dsl.loader.scalars import read_plain

_TEXTS: Final = frozenset("say hears templates about notes note skills name state goto goto_now".split())
"""Keys of the language whose values are texts or names of states."""

_PROSE: Final = frozenset("about notes note skills".split())
"""Texts for people, for which `null` says that there is none."""

_AUTHORS: Final = frozenset(
    "objects let define state tables memory params frames slots states roles cast set beliefs".split()
)
"""Keys of the language below which the keys are words of the author."""

_NOTHING: Final = ("", "~")
_STEP: Final = re.compile(r"[^.\[\]]+")


def value_at(path: DataPath, text: str) -> Data | None:
    """What a plain word means where a text may stand; None where YAML's own reading holds.

    Args:
        path: where in its file it stands.
        text: the word as it is written.
    """
    if text in _NOTHING:
        return None
    keys = _keys(path)
    if _is_text(keys):
        return None if text == "null" and keys[-1] in _PROSE else text
    kept = _kept(keys)
    if kept:
        value = read_plain(text).value
        return value if type(value) in kept else text
    return None


def _keys(path: DataPath) -> list[str]:
    """The keys on the way to a value, from the root of the scenario; the key of a patch is such a way itself."""
    keys: list[str] = []
    for step in path:
        if isinstance(step, str):
            keys = _STEP.findall(step) if "." in step else [*keys, step]
    return keys


def _is_text(keys: list[str]) -> bool:
    """Whether nothing but a text, or a name, can stand there."""
    match keys:
        case [*_, "frames", _, "start"] | [*_, "probes", _, "ask" | "answers"]:
            return True
        case [*_, parent, _] if parent in _AUTHORS:
            return False
        case [*_, key]:
            return key in _TEXTS
    return False


def _kept(keys: list[str]) -> tuple[type, ...]:
    """Kinds of values that can stand there beside texts; none where no text can."""
    match keys:
        case [*_, "with", _] | [*_, "tables", _, _]:
            return (bool, int)
        case [*_, "grammar", "nouns"] | [*_, "grammars", _, "nouns"]:
            return (int,)
    return ()
