"""What may be wrong only because a part of the file was left out, after a mistake in it that has been reported."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from operator import itemgetter
from typing import Final, get_origin

from socialai_dsl.diagnostics import Diagnostic
from socialai_dsl.schema.annotations import annotation_at, keys_of, models_along
from socialai_dsl.schema.holds import branches
from socialai_dsl.schema.scenario import Scenario
from socialai_dsl.source import DataPath, Node

_OF_WHOLE_FILES: Final = frozenset({"S316"})
"""What can only be said of a file without other errors: whatever has one may be what would make it possible."""

_OF_NAMES: Final = frozenset({"S201", "S204", "S205", "S206", "S213", "S301", "S305"})
"""What follows only where it is about a name that the part may have declared, or that depends on such a name."""

_OF_TEXTS: Final = frozenset({"S401", "S402"})
"""What also follows where the part decides what can be said."""

_OF_PARTS: Final = frozenset({"S105", "S302", "S303", "S304", "S310", "S315"})
"""What may follow wherever the part is."""

_GRAMMAR: Final[DataPath] = ("grammar",)

_OF_THE_GRAMMAR: Final = frozenset({"S201", "S204", "S302", "S303", *_OF_TEXTS})
"""What may follow where all of the grammar is missing, which has the slots and what can be said."""

_SPEAKING: Final = frozenset({"frames", "cast", "npc_defaults", "grammar", "rivals"})
"""Sections that decide what can be said."""

_THINGS: Final = frozenset({"cast", "objects"})
"""Sections in which an entry stays what it is, whatever is written in it."""

_WORD: Final = re.compile(r"[A-Za-z_]\w*")


class Consequences:
    """What may follow from parts of a document that were left out."""

    def __init__(self, tree: Node, lost: Sequence[DataPath]) -> None:
        self._tree = tree
        self._lost = [path for path in lost if path[:1] != ("tests",)]  # nothing else depends on a test

    def may_be(self, finding: Diagnostic) -> bool:
        """Whether a finding may be one."""
        code = finding.code
        if code in _OF_WHOLE_FILES:
            return True
        if not self._lost or code not in _OF_NAMES | _OF_TEXTS | _OF_PARTS:
            return False
        # A name like one that is known is a slip, and hardly that of a slot.
        of_grammar = code in _OF_THE_GRAMMAR and finding.suggestion is None
        if any(_is_whole(path) and (path != _GRAMMAR or of_grammar) for path in self._lost):
            return True
        if code in _OF_PARTS and any(path != _GRAMMAR for path in self._lost):
            return True
        if code in _OF_TEXTS and any(path[0] in _SPEAKING for path in self._lost):
            return True
        return not self._names.isdisjoint(self._words_at(finding))

    @cached_property
    def _names(self) -> set[str]:
        """Names that the parts may have declared, and those whose values speak of them."""
        found: set[str] = set()
        for path in self._lost:
            found |= set(_names_in(path))
            part = self._tree.get(path)
            for below, _ in part.walk(path) if part is not None else ():
                found |= set(_names_in(below))
        waiting = set(found)
        while waiting:
            new = {name for name, words in self._values if not waiting.isdisjoint(words)}
            waiting = new - found
            found |= waiting
        return found

    @cached_property
    def _values(self) -> list[tuple[str, set[str]]]:
        """Each name that is declared with the words of its value; of members and things the name is enough."""
        found = []
        for path, part in self._tree.walk():
            names = list(_names_in(path))
            if names and part.children is None and not (path[0] in _THINGS and names[-1] == path[1]):
                found.append((names[-1], _words(part.value)))
        return found

    def _words_at(self, finding: Diagnostic) -> set[str]:
        """The words of the value or key that a finding is about."""
        parts = self._parts_of.get(finding.span.file, [])
        if not parts:
            return set()
        _, _, _, part = parts[0]
        index = part.source.index(finding.span)
        number = bisect_right(parts, index, key=itemgetter(0)) - 1
        start, end, key, part = parts[max(number, 0)]
        if not start <= index <= end:
            return set()
        return {key, *(_words(part.value) if part.children is None else ())}

    @cached_property
    def _parts_of(self) -> dict[str, list[tuple[int, int, str, Node]]]:
        """Of each file its keys and plain values in order: begin, end, the key if it is one, and what belongs to it."""
        found: dict[str, list[tuple[int, int, str, Node]]] = {}
        for path, part in self._tree.walk():
            of_file = found.setdefault(part.file, [])
            if part.span.key is not None:
                start = part.source.index(part.span.key)
                of_file.append((start, start + part.span.key.width, str(path[-1]), part))
            if part.children is None:
                of_file.append((part.span.start, part.end, "", part))
        for of_file in found.values():
            of_file.sort(key=itemgetter(0))
        return found


def _is_whole(path: DataPath) -> bool:
    """Whether a part is a section with names that others may speak of."""
    kinds = (get_origin(part) for part in branches(annotation_at(Scenario, path)))
    return path == _GRAMMAR or (len(path) == 1 and any(kind in (dict, Mapping) for kind in kinds))


def _names_in(path: DataPath) -> Iterator[str]:
    """The steps of a path that are names of an author's, not keys that the language has there."""
    for step, model in models_along(Scenario, path):
        if isinstance(step, str) and (model is None or step not in keys_of(model)):
            yield from _words(step)


def _words(value: object) -> set[str]:
    return set(_WORD.findall(str(value)))
