"""Arithmetic on ranges of values: the range of the result of each arithmetic instruction."""

from __future__ import annotations

from collections.abc import Callable

from socialai_dsl.compiler.intervals import Interval, clamp
from socialai_dsl.program import Op


def _sum(a: Interval, b: Interval) -> Interval:
    return clamp(a[0] + b[0], a[1] + b[1])


def _difference(a: Interval, b: Interval) -> Interval:
    return clamp(a[0] - b[1], a[1] - b[0])


def _product(a: Interval, b: Interval) -> Interval:
    corners = [x * y for x in a for y in b]
    return clamp(min(corners), max(corners))


def _quotient(a: Interval, b: Interval) -> Interval:
    if b[0] > 0:
        corners = [x // y for x in a for y in b]
        return min(corners), max(corners)
    # Towards zero or beyond the divisor 0 the magnitude never grows, but floor may add one.
    most = max(abs(a[0]), abs(a[1])) + 1
    return -most, most


def _remainder(a: Interval, b: Interval) -> Interval:
    if b[0] > 0:
        return a if a[0] >= 0 and a[1] < b[0] else (0, b[1] - 1)
    most = max(abs(b[0]), abs(b[1]))
    return -most, most


def _least(a: Interval, b: Interval) -> Interval:
    return min(a[0], b[0]), min(a[1], b[1])


def _greatest(a: Interval, b: Interval) -> Interval:
    return max(a[0], b[0]), max(a[1], b[1])


ARITHMETIC: dict[Op, Callable[[Interval, Interval], Interval]] = {
    Op.ADD: _sum,
    Op.SUB: _difference,
    Op.MUL: _product,
    Op.DIV: _quotient,
    Op.MOD: _remainder,
    Op.MIN: _least,
    Op.MAX: _greatest,
}
