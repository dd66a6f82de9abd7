"""The ranges of registers that are set: from the start value and every value assigned, as far as an episode goes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from socialai_dsl.schema import Scenario
from socialai_dsl.semantics.terms import Type

_WIDEN_AFTER = 12
_MOST_ROUNDS = 20


class Ranges:
    """Finds, over repeated resolutions, ranges that hold whatever is set.

    Attributes:
        now: register -> the range to resolve with.
        unbounded: registers whose growth depends on their size, so that no range can be given.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.now: dict[str, Type] = {}
        self.unbounded: list[str] = []
        self._growth: dict[str, int] = {}
        self._rounds = 0
        self._wide: dict[str, Type] | None = None
        self._steps = scenario.horizon * _setters(scenario)

    def settled(self, needed: Mapping[str, Type]) -> bool:
        """Take note of the ranges that a resolution asked for; whether it had them already."""
        self._rounds += 1
        fits = all(_within(type_, self.now.get(path)) for path, type_ in needed.items())
        if self._wide is not None and (not fits or self.now is self._wide):
            return self._back()
        if fits:
            return self._rounds <= _WIDEN_AFTER + 1 or not self._narrow(needed)
        if self._rounds <= _WIDEN_AFTER:
            self._growth = {path: _excess(type_, self.now.get(path)) for path, type_ in needed.items()}
            self.now = dict(needed)
            return False
        if self._rounds == _WIDEN_AFTER + 1:
            self.now = {path: self._widened(type_, self.now[path]) for path, type_ in needed.items()}
            return False
        self.unbounded = [p for p, t in needed.items() if _excess(t, self.now[p]) > self._growth[p]]
        return True

    def _narrow(self, needed: Mapping[str, Type]) -> bool:
        """After widening, try what is really needed: `min(asked + 1, 9)` never leaves 0..9. Whether that is less."""
        if self._rounds > _MOST_ROUNDS or needed == self.now:
            return False
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


def _within(type_: Type, range_: Type | None) -> bool:
    return range_ is not None and range_.low <= type_.low and type_.high <= range_.high


def _excess(type_: Type, range_: Type | None) -> int:
    """By how much a type goes beyond a range."""
    if range_ is None:
        return 0
    return max(0, range_.low - type_.low) + max(0, type_.high - range_.high)


def _setters(scenario: Scenario) -> int:
    """How many rules and steps set something."""
    rules = [
        rule
        for frame in scenario.frames.values()
        for state in (frame.states or {}).values()
        for rule in (*state.first, *state.then)
    ]
    steps = [step for frame in scenario.frames.values() for step in frame.steps or ()]
    own = sum(bool(entry.set) for entry in (*rules, *steps))
    return own + sum(bool(rule.set) for rule in scenario.rules)
