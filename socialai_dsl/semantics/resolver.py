"""What resolves the expressions of a scenario, as the parts of the language see it; `resolve` is the whole."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from socialai_dsl.grammar import ast
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.build import LARGEST, arithmetic, number
from socialai_dsl.semantics.findings import FailedError, Findings, Scalar
from socialai_dsl.semantics.readings import Readings
from socialai_dsl.semantics.registers import Registers
from socialai_dsl.semantics.scope import PlayedFrame, Scope, Symbols
from socialai_dsl.semantics.signatures import VALUES, WORDS
from socialai_dsl.semantics.terms import (
    ACTION,
    COLOR,
    DIRECTION,
    SIDE,
    TURN,
    Compare,
    Const,
    Select,
    Term,
    Type,
)
from socialai_dsl.semantics.utterances import Utterances
from socialai_dsl.semantics.wording import described, quoted, spoken, words_of
from socialai_dsl.vocabulary import is_number, is_plain

MAX_NESTED: Final = 64
MAX_PARTS: Final = 2_000
MAX_ALL_PARTS: Final = 100_000
"""How deep an expression may lead, and how many parts it and all of them may have, definitions written out."""

INT = Type("int", 0, 0)
"""Expected: any number."""
ANY_TEXT = Type("text", 0, -1)
"""Expected: any text."""
ENTITY = Type("entity", 0, 0)
"""Expected: an inhabitant of the room."""

VOCABULARIES = (COLOR, DIRECTION, ACTION, TURN, SIDE)
"""The types whose words belong to the language."""

WORDED = ("text", "noun", "color", "status")
"""Kinds of values that are called by words, which values of another kind may be called as well."""


class Resolver(ABC):
    """Gives meaning to the expressions of one scenario: what each part of the language is resolved with.

    Attributes:
        symbols: what the scenario declares.
        findings: where mistakes go.
        registers: what is drawn or computed at reset, resolved when first needed.
        utterances: what the agent can say, and what NPCs say.
        frames: member -> the frame it plays.
        readings: how everything was written that has been given a meaning.
        used: where the definitions and draws stand that something uses.
    """

    def __init__(
        self,
        symbols: Symbols,
        findings: Findings,
        frames: Mapping[str, PlayedFrame],
        words: Mapping[str, Type],
        ranges: Mapping[str, Type],
    ) -> None:
        self.symbols = symbols
        self.findings = findings
        self.frames = frames
        self.registers = Registers(self, words, ranges)
        self.utterances = Utterances(symbols.scenario.grammar)
        self.readings = Readings()
        self.used: set[DataPath] = set()
        self._within: list[tuple[ast.Expr, Scope]] = []
        self._parts = self._all_parts = 0
        self._tables: dict[str, tuple[tuple[str, ...], tuple[Term, ...]] | None] = {}

    @abstractmethod
    def table(self, name: str) -> tuple[tuple[str, ...], tuple[Term, ...]]:
        """Keys and values of a table; raises FailedError once what is wrong with it has been reported."""

    @property
    @abstractmethod
    def unlocks(self) -> Mapping[int, tuple[int, ...]]:
        """Object -> the objects it unlocks."""

    @property
    @abstractmethod
    def opens(self) -> Mapping[int, tuple[int, ...]]:
        """Object -> the objects that are open while it is active."""

    @property
    @abstractmethod
    def moved_inside(self) -> set[str]:
        """Names of what some effect moves into something."""

    @abstractmethod
    def meaning(self, node: ast.Expr, expected: Type | None, scope: Scope) -> Term:
        """The term for a tree by what kind of node it is; `value` keeps how it was written as well."""

    def written(self, path: DataPath, raw: Scalar, expected: Type | None, scope: Scope) -> Term:
        """The value of the expression that is written at `path`; raises FailedError once it has been reported."""
        if isinstance(raw, str) and expected is not None and expected.kind in ("text", "noun"):
            literal = self._literal(path, raw, expected, scope)
            if literal is not None:
                return literal
        return self.value(self.findings.expression(path, raw), expected, scope)

    def _literal(self, path: DataPath, raw: str, expected: Type, scope: Scope) -> Term | None:
        """A text of several words needs no quotes where a text is expected."""
        text = raw.strip()
        if expected.kind == "noun" and text in expected.words:
            return Const(expected, expected.words.index(text))
        if expected.kind == "text" and is_plain(text) and " " in text:
            return text_value(text)
        return None

    def value(self, node: ast.Expr, expected: Type | None, scope: Scope) -> Term:
        """The term for a tree, of the expected type if one is given."""
        reading = self.readings.begin(node)
        term: Term | None = None
        self._within.append((node, scope))
        try:
            self._limit()
            term = self.meaning(node, expected, scope)
        finally:
            self._within.pop()
            self.readings.end(reading, term, scope.draws.site)
        return term

    def _limit(self) -> None:
        """What names lead to, and theirs, could go as deep and grow as large as a file likes."""
        if len(self._within) == 1:
            self._parts = 0
        self._parts += 1
        self._all_parts += 1
        if len(self._within) > MAX_NESTED:
            message = f"names and definitions lead to one another more than {MAX_NESTED} deep"
        elif self._parts > MAX_PARTS:
            message = f"with its definitions written out, this has more than {MAX_PARTS} parts"
        elif self._all_parts > MAX_ALL_PARTS:
            message = f"with all definitions written out, the scenario has more than {MAX_ALL_PARTS} parts"
        else:
            return
        raise self.fail("S212", message, *self._within[0])

    def fail(self, code: str, message: str, node: ast.Expr, scope: Scope, **more: str | None) -> FailedError:
        """Report what is wrong with a part of an expression; raising the result gives the expression up."""
        return self.findings.fail(code, message, self.findings.node(scope.path, node), **more)

    def fit(self, term: Term, expected: Type | None, node: ast.Expr, scope: Scope) -> Term:
        """The term itself if it is of the expected type, or the word of that type it stands for."""
        if expected is None or same_kind(term.type, expected):
            return term
        if isinstance(term, Const) and expected.words and term.type.kind in (*WORDED, "int"):
            word = spoken(term.type, term.value)
            if word in expected.words:
                return Const(expected, expected.low + expected.words.index(word))
        if expected.kind == "int" and not expected.words and term.type.kind == "noun":
            value = _number_of(term)
            if value is not None:
                return value
        message = f"`{quoted(node)}` is {described(term.type)}, but {described(expected)} is expected here"
        hint = None
        if expected.kind == "bool" and term.type.kind == "text":
            hint = "write `true` or `false`"
        elif expected.words and expected.kind not in ("noun", "bool"):
            hint = f"one of {words_of(expected)}"
        elif expected.kind == "int" and term.type.kind == "noun":
            other = next(word for word in term.type.words if not is_number(word))
            hint = f"it is a number only if every noun is one; `{other}` is none"
        raise self.fail("S204", message, node, scope, hint=hint)

    def computed(self, op: str, args: tuple[Term, ...], node: ast.Expr, scope: Scope) -> Term:
        """An operation on numbers, which must fit into the engine's 64 bits whatever they are."""
        term = arithmetic(op, *args)
        low, high = term.type.low, term.type.high
        if low >= -LARGEST and high <= LARGEST:
            return term
        far = high if high > LARGEST else low
        raise self.fail(
            "S214",
            f"`{quoted(node)}` can be {far:.1e}, and numbers go up to {LARGEST:.1e}",
            node,
            scope,
            hint="use smaller numbers, or bound a part of it: `min(..., 1000)`",
        )

    def somewhere(self, node: ast.Expr, scope: Scope) -> Term:
        """Something that has a place: an object, a member of the cast, or a cell."""
        term = self.value(node, None, scope)
        return term if term.type.kind == "cell" else self.fit(term, ENTITY, node, scope)

    # -- bare words ------------------------------------------------------------------------------------------

    def is_bare(self, node: ast.Expr, scope: Scope) -> bool:
        """Whether a value takes its type from its use: a word that names nothing, a text, a number, a wordy `let`."""
        if isinstance(node, ast.Name):
            register = self._register_of(node, scope)
            if register is not None:
                return self.registers.is_wordy(register)
            return not self._names_something(node.id, scope)
        return isinstance(node, ast.Text)

    def _register_of(self, node: ast.Name, scope: Scope) -> str | None:
        if node.id in scope.variables:
            return None
        frame = scope.frame
        if frame is not None and frame.register(node.id) in self.registers:
            return frame.register(node.id)
        if node.id in self.symbols.scenario.state:
            return f"state.{node.id}"
        return f"let.{node.id}" if node.id in self.symbols.scenario.let else None

    def means_nothing(self, word: str, scope: Scope) -> bool:
        """Whether a word is neither declared nor of the language: where a text is expected, it is one."""
        known = any(word in type_.words for type_ in VOCABULARIES) or word in WORDS or word in VALUES
        return not known and not self._names_something(word, scope)

    def _names_something(self, word: str, scope: Scope) -> bool:
        frame = scope.frame
        if (
            word in scope.variables
            or word in self.symbols.declared
            or word in ("t", "W", "H", "self", "it", "cells")
        ):
            return True
        if frame is not None and (
            word in frame.model.slots or word in frame.model.let or word in frame.defines
        ):
            return True
        in_vocabulary = any(word in type_.words for type_ in VOCABULARIES)
        return word in VALUES and not in_vocabulary

    def is_wordy(self, node: ast.Expr, scope: Scope) -> bool:
        """Whether an expression comes down to bare words that several vocabularies have, such as `left`."""
        match node:
            case ast.Name(id=word):
                several = sum(word in type_.words for type_ in VOCABULARIES) > 1
                return several and self.is_bare(node, scope)
            case ast.Alternatives(options=options):
                return any(self.is_wordy(option, scope) for option in options)
            case ast.Arithmetic(op="*", right=right):
                return self.is_wordy(right, scope)
            case ast.Call(name="pick", args=(only,)):
                return self.is_wordy(only, scope)
            case ast.Quantifier(name="pick" | "first", group=group):
                return self.is_wordy(group, scope)
        return False


def text_value(text: str) -> Const:
    """A known text."""
    return Const(Type("text", 0, 0, (text,)), 0)


def _number_of(noun: Term) -> Term | None:
    """A noun as the number that it is; None if some noun is none."""
    words = noun.type.words
    if not all(map(is_number, words)):
        return None
    values = [int(word) for word in words]
    type_ = Type("int", min(values), max(values))
    if isinstance(noun, Const):
        return number(values[noun.value])
    # As a number it is needed: where there is no noun, nothing is found.
    place = replace(noun, type=Type("int", 0, len(words) - 1))
    if values == list(range(values[0], values[0] + len(values))):
        return arithmetic("+", place, number(values[0])) if values[0] else place
    cases = [Compare("==", place, number(i)) for i in range(len(values) - 1)]
    return Select(type_, tuple(cases), tuple(Const(type_, v) for v in values[:-1]), Const(type_, values[-1]))


def same_kind(actual: Type, expected: Type) -> bool:
    """Whether a value of one type is also of the other; numbers of any range are."""
    if actual.kind != expected.kind:
        return False
    if actual.kind == "int":
        return bool(actual.words) == bool(expected.words) and (
            not actual.words or actual.words == expected.words
        )
    return actual.kind != "status" or actual.words == expected.words
