"""The ranges of registers that rules set, found by resolving a scenario again with what its rules asked for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

from socialai_dsl.schema.scenario import Scenario
from socialai_dsl.semantics.cast import members
from socialai_dsl.semantics.scope import frames_of
from socialai_dsl.semantics.terms import Type
from socialai_dsl.widths import LARGEST_NUMBER

_PATIENCE = 12
"""Rounds of growth before the registers that still grow are taken to grow throughout an episode."""
_MOST_NARROWINGS = 7


class Ranges:
    """Finds, over repeated resolutions, ranges that hold whatever is set.

    A register that is computed from others is known when they are, which takes a round for each register on the way.
    One that follows from itself, such as `n: n + 1`, is given what it can gain in a whole episode.

    Attributes:
        now: register -> the range to resolve with.
        too_far: register -> the farthest number it may come to, of those that no register can hold.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.now: dict[str, Type] = {}
        self.too_far: dict[str, int] = {}
        self._rounds = 0
        self._grew: set[str] = set()
        self._growing: set[str] = set()
        self._gains: dict[str, int] = {}
        self._narrowings = 0
        self._wide: dict[str, Type] | None = None
        followed = Counter(member.value("frame") for member in members(scenario).values())
        setters = sum(bool(rule.set) for rule in scenario.rules)
        for path, frame in frames_of(scenario):
            own = sum(bool(entry.set) for entry in frame.all_effects())
            setters += own * max(1, followed[str(path[-1])])
        self._steps = scenario.horizon * setters

    def settled(
        self, asked: Mapping[str, Type], read: Mapping[str, set[str]], copies: Mapping[str, set[str]]
    ) -> bool:
        """Take note of the ranges that a resolution asked for; whether it had them already.

        Args:
            asked: register -> range.
            read: register -> the registers that the values it is set to follow from.
            copies: register -> those whose values it is set to as they are, which needs no other resolution.
        """
        self._rounds += 1
        needed = _with_copies(asked, copies)
        for path, type_ in needed.items():
            if abs(type_.farthest) > LARGEST_NUMBER:
                self.too_far.setdefault(path, type_.farthest)
        excess = {p: _excess(t, self.now.get(p)) for p, t in needed.items() if p not in self.too_far}
        if self._wide is not None and (any(excess.values()) or self.now is self._wide):
            return self._back()
        growing = {path for path, more in excess.items() if more > self._gains.get(path, 0)}
        if not growing:
            return not self._gains or any(excess.values()) or not self._narrow(needed)
        if self._rounds > self._steps:
            return True  # as often as that nothing is set in an episode
        spreads = bool(growing - self._grew) or growing < self._growing
        widens = self._rounds > _PATIENCE and (bool(self._gains) or not spreads)
        self._grew |= growing
        self._growing = growing
        following = {path: self.now[path] if path in self._gains else type_ for path, type_ in needed.items()}
        for path in growing if widens else ():
            if path in _sources(path, read):
                self._gains[path] = excess[path]
                following[path] = self._widened(needed[path], self.now.get(path, needed[path]))
        self.now = {path: _cut(type_) for path, type_ in following.items()}
        return False

    def _narrow(self, needed: Mapping[str, Type]) -> bool:
        """After widening, try what is really needed: `min(asked + 1, 9)` never leaves 0..9. Whether that is less."""
        if self._narrowings == _MOST_NARROWINGS or needed == self.now:
            return False
        self._narrowings += 1
        self._wide, self.now = self.now, dict(needed)
        return True

    def _back(self) -> bool:
        """The narrower ranges do not hold: the last ones that did are taken. Whether they are taken already."""
        assert self._wide is not None, "internal: nothing was narrowed"
        done = self.now is self._wide
        self.now = self._wide
        return done

    def _widened(self, needed: Type, now: Type) -> Type:
        """A range that still grows, by as much as it can in a whole episode."""
        low = needed.low - (now.low - needed.low) * self._steps if needed.low < now.low else needed.low
        high = needed.high + (needed.high - now.high) * self._steps if needed.high > now.high else needed.high
        return replace(needed, low=low, high=high)


def _cut(type_: Type) -> Type:
    """A range as far as a register can hold it."""
    low, high = (max(-LARGEST_NUMBER, min(end, LARGEST_NUMBER)) for end in (type_.low, type_.high))
    return replace(type_, low=low, high=high)


def _sources(path: str, read: Mapping[str, set[str]]) -> set[str]:
    """All registers that a register follows from, itself among them if it follows from itself."""
    found: set[str] = set()
    waiting = [path]
    while waiting:
        new = read.get(waiting.pop(), set()) - found
        found |= new
        waiting += new
    return found


def _with_copies(asked: Mapping[str, Type], copies: Mapping[str, set[str]]) -> dict[str, Type]:
    """The ranges with room for all that reaches a register by copying, however many others are on the way."""
    into: dict[str, list[str]] = {}
    for path in asked:
        for source in copies.get(path, ()):
            into.setdefault(source, []).append(path)
    needed, waiting = dict(asked), [path for path in asked if path in into]
    while waiting:
        source = waiting.pop()
        for path in into.get(source, ()):
            low, high = min(needed[path].low, needed[source].low), max(needed[path].high, needed[source].high)
            if (low, high) != (needed[path].low, needed[path].high):
                needed[path] = replace(needed[path], low=low, high=high)
                waiting.append(path)
    return needed


def _excess(type_: Type, range_: Type | None) -> int:
    """By how much a type goes beyond a range; beyond none by something."""
    if range_ is None:
        return 1
    return max(0, range_.low - type_.low) + max(0, type_.high - range_.high)
