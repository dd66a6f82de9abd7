"""This module keeps how conditions were written beside what they mean, for whoever explains why one is false."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from socialai_dsl.grammar import ast
from socialai_dsl.schema import Outcome, Rule, Step, WorldRule
from socialai_dsl.semantics.build import changed
from socialai_dsl.semantics.terms import Const, Term

Entry = Rule | Step | WorldRule | Outcome


@dataclass(eq=False, slots=True)
class Reading:
    """A part of an expression: how it was written, what it means, and the parts it is made of.

    What a definition or a slot stands for is a part of its name.
    """

    node: ast.Expr
    term: Term | None = None
    parts: list[Reading] = field(default_factory=list)

    def walk(self) -> Iterator[Reading]:
        """This part, then those it is made of."""
        yield self
        for part in self.parts:
            yield from part.walk()

    def conjuncts(self) -> Iterator[Reading]:
        """The conditions that must all hold for this one to hold, in the order in which they are asked."""
        operands: tuple[ast.Expr, ...] = ()
        if isinstance(self.node, ast.Logic) and self.node.op == "and":
            operands = self.node.operands
        elif isinstance(self.node, ast.Name | ast.Call) and self._stands_for_its_part():
            yield from self.parts[-1].conjuncts()
            return
        if len(operands) != len(self.parts) or not operands:
            yield self
            return
        for part in self.parts:
            yield from part.conjuncts()

    def _stands_for_its_part(self) -> bool:
        """Whether this is the name of a condition that is written elsewhere."""
        return bool(self.parts) and self.parts[-1].term == self.term and not isinstance(self.term, Const)


class Readings:
    """How the expressions of a scenario were written.

    Attributes:
        roots: site of a value (draws.py) -> its reading. entries: site of a rule, step or outcome -> itself.
    """

    def __init__(self) -> None:
        self.roots: dict[str, Reading] = {}
        self.entries: dict[str, Entry] = {}
        self._open: list[Reading] = []

    def begin(self, node: ast.Expr) -> Reading:
        """A part of an expression is going to be read."""
        reading = Reading(node)
        self._open.append(reading)
        return reading

    def end(self, reading: Reading, term: Term | None, site: str) -> None:
        """It has been read; `term` is None if it means nothing. A whole value is kept by its site."""
        self._open.pop()
        reading.term = term
        if term is None:
            return
        if self._open:
            self._open[-1].parts.append(reading)
        else:
            self.roots[site] = reading

    def change(self, site: str, change: Callable[[Term], Term | None]) -> None:
        """Replace terms in what was read for a site, as `build.changed` does."""
        root = self.roots.get(site)
        for reading in root.walk() if root is not None else ():
            reading.term = changed(reading.term, change)
