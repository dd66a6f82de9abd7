"""The ranges of registers that rules set, found on the terms that they are set to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import reduce

from socialai_dsl.semantics.resolver import Registers, union
from socialai_dsl.semantics.terms import Operation, Read, ReadEach, Select, Term, Type, range_of, walk
from socialai_dsl.widths import LARGEST_NUMBER

_PATIENCE = 64
"""How often a value is typed, on average over a group, before what still grows is taken to grow on as it did."""
_MOST_TRIES = 8
"""How often a group is widened before what grows by more and more is taken to grow without end."""


class Ranges:
    """Finds ranges that hold whatever is set.

    Registers that follow from each other are a group; groups are taken one by one, sources first. In each round of a
    group the values that read a register whose range has changed are given their types again. After as many rounds as
    values are set in an episode a range holds for certain, but `n: n + 1` would take that many.

    The range of a register may also decide which terms there are, such as the texts of a line: then the scenario is
    resolved again with the ranges that were found, and its terms may ask for more.

    Attributes:
        now: register -> the range to resolve with.
        too_far: register -> the farthest number it may come to, of those that no register can hold.
    """

    def __init__(self, horizon: int) -> None:
        self.now: dict[str, Type] = {}
        self.too_far: dict[str, int] = {}
        self._horizon = horizon
        self._gains: dict[str, tuple[int, int]] = {}

    def settle(self, registers: Registers) -> bool:
        """Find the ranges of the registers of a resolution; whether it had them already."""
        before = dict(self.now)
        reads = _reads(registers)
        for paths in _groups(reads):
            group = _Group(registers, self.now, {path: reads[path].intersection(paths) for path in paths})
            self._solve(group, self._horizon * sum(len(registers.set_to[path]) for path in paths), before)
        types = _Types(registers, self.now)
        for path in registers.set_to:
            asked = types.of_all(registers.values_of(path))
            if not asked.is_kept:
                self.too_far[path] = asked.farthest
        had = all(registers.type_of(path) == self.now[path] for path in registers.set_to)
        return had or self.now == before

    def _solve(self, group: _Group, steps: int, before: Mapping[str, Type]) -> None:
        """Find the ranges of a group whose registers are set at most `steps` times in an episode, all together."""
        if not group.follows_itself:
            group.grow(1)
            return
        passed = group.grow(steps) if not group.paths <= before.keys() else 0
        left, widened = steps - passed, False
        tries = 0
        while group.changed:
            start = group.ranges()
            rounds = group.grow()
            gains = {path: _gain(start[path], type_) for path, type_ in group.ranges().items()}
            more = {path for path in gains if not _within(gains[path], self._gains.get(path, (0, 0)))}
            if more and left and not group.changed:
                break
            self.now |= start
            if not more:
                break
            tries += 1
            times = -(-left // rounds) if tries < _MOST_TRIES else left * LARGEST_NUMBER
            for path in more:
                known = self._gains.get(path, (0, 0))
                self._gains[path] = max(gains[path][0], known[0]), max(gains[path][1], known[1])
                self.now[path] = _widened(start[path], gains[path], times)
            group.changed, widened = set(group.paths), True
        if widened:
            group.narrow(before)


class _Group:
    """Registers that follow from each other, or one that follows from others only.

    Attributes:
        changed: those with values that read something whose range has changed.
    """

    def __init__(self, registers: Registers, now: dict[str, Type], reads: Mapping[str, set[str]]) -> None:
        self._registers, self._now = registers, now
        self.paths = reads.keys()
        self.follows_itself = any(reads.values())
        self._readers = _turned(reads)
        self.changed = set(self.paths)

    def ranges(self) -> dict[str, Type]:
        """Register -> range."""
        return {path: self._now[path] for path in self.paths}

    def grow(self, most: int | None = None) -> int:
        """Make room for what is set until there is, for `most` rounds, or until patience is lost; how many rounds."""
        rounds, work = 0, _PATIENCE * len(self.paths)
        while self.changed and work > 0 and rounds != most:
            work -= len(self.changed)
            rounds += 1
            self._take((path, union(self._now.get(path, asked), asked)) for path, asked in self._asked())
        return rounds

    def narrow(self, least: Mapping[str, Type]) -> None:
        """After widening, take what is really needed: `min(asked + 1, 9)` never leaves 0..9. No less than `least`."""
        self.changed, work = set(self.paths), _PATIENCE * len(self.paths)
        while self.changed and work > 0:
            work -= len(self.changed)
            needed = ((path, union(asked, least.get(path, asked))) for path, asked in self._asked())
            self._take((path, _common(self._now[path], type_)) for path, type_ in needed)

    def _asked(self) -> list[tuple[str, Type]]:
        types = _Types(self._registers, self._now)
        return [(path, types.of_all(self._registers.values_of(path))) for path in self.changed]

    def _take(self, found: Iterable[tuple[str, Type]]) -> None:
        self.changed = set()
        for path, type_ in found:
            range_ = _cut(type_)
            if range_ != self._now.get(path):
                self._now[path] = range_
                self.changed |= self._readers[path]


class _Types:
    """The types of values while registers that are set have some ranges."""

    def __init__(self, registers: Registers, now: Mapping[str, Type]) -> None:
        self._registers, self._now = registers, now
        self._others: dict[str, Type] = {}

    def of_all(self, terms: Iterable[Term]) -> Type:
        """The type that has room for some values of one kind."""
        return reduce(union, map(self.of, terms))

    def of(self, term: Term) -> Type:
        """The type of a value; it is that of the term unless a part has another."""
        type_ = term.type
        match term:
            case Read(path=path) | ReadEach(registers=(Read(path=path), *_)):
                found = self._of_register(path.partition("(")[0], type_)
            case Operation(op=op, args=args) if op != "turn":
                parts = [self.of(arg) for arg in args]
                found = type_ if parts == [arg.type for arg in args] else range_of(op, *parts)
            case Select(values=values, default=default):
                parts = [self.of(value) for value in (*values, default)]
                known = parts == [value.type for value in (*values, default)]
                found = type_ if known else reduce(union, parts)
            case _:
                found = type_
        return type_.ranging(found.low, found.high)

    def _of_register(self, path: str, type_: Type) -> Type:
        if path in self._registers.set_to:
            return self._now.get(path, type_)
        if path not in self._others:
            values = self._registers.values_of(path)
            self._others[path] = self.of_all(values) if values else type_
        return self._others[path]


# -- ranges --------------------------------------------------------------------------------------------------


def _cut(type_: Type) -> Type:
    """A range as far as a register can hold it."""
    low, high = max(type_.low, -LARGEST_NUMBER), min(type_.high, LARGEST_NUMBER)
    return type_.ranging(min(low, LARGEST_NUMBER), max(high, -LARGEST_NUMBER))


def _gain(start: Type, now: Type) -> tuple[int, int]:
    """By how much a range has grown, down and up."""
    return start.low - now.low, now.high - start.high


def _within(gain: tuple[int, int], other: tuple[int, int]) -> bool:
    return gain[0] <= other[0] and gain[1] <= other[1]


def _widened(start: Type, gain: tuple[int, int], times: int) -> Type:
    return _cut(start.ranging(start.low - gain[0] * times, start.high + gain[1] * times))


def _common(a: Type, b: Type) -> Type:
    """The values of both ranges."""
    return a.ranging(max(a.low, b.low), min(a.high, b.high))


# -- what follows from what ------------------------------------------------------------------------------------


def _reads(registers: Registers) -> dict[str, set[str]]:
    """Register that is set -> those, of all that are, which its values follow from, perhaps by way of others that are
    not, such as what `prev` noted.
    """
    found: dict[str, set[str]] = {}
    for path in registers.set_to:
        known, waiting = {path}, [path]
        found[path] = set()
        while waiting:
            parts = walk(registers.values_of(waiting.pop()))
            read = {part.path.partition("(")[0] for part in parts if isinstance(part, Read)}
            found[path] |= read & registers.set_to.keys()
            waiting += read - known - registers.set_to.keys()
            known |= read
    return found


def _turned(reads: Mapping[str, set[str]]) -> dict[str, set[str]]:
    """Register -> those that read it."""
    readers: dict[str, set[str]] = {path: set() for path in reads}
    for path, sources in reads.items():
        for source in sources:
            readers[source].add(path)
    return readers


def _groups(reads: Mapping[str, set[str]]) -> Iterator[list[str]]:
    """Registers that follow from each other, sources first (Kosaraju's algorithm)."""
    readers, seen = _turned(reads), set[str]()
    order = [path for start in reads for path in _reached(start, readers, seen)]
    seen.clear()
    yield from filter(None, (_reached(start, reads, seen) for start in reversed(order)))


def _reached(start: str, graph: Mapping[str, set[str]], seen: set[str]) -> list[str]:
    """What has not been seen and can be reached, each behind all that is reached from it."""
    found: list[str] = []
    waiting = [(start, iter(graph[start]))] if start not in seen else []
    seen.add(start)
    while waiting:
        path, rest = waiting[-1]
        following = next((other for other in rest if other not in seen), None)
        if following is None:
            found.append(path)
            waiting.pop()
        else:
            seen.add(following)
            waiting.append((following, iter(graph[following])))
    return found
