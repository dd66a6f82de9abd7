"""Syntax trees to terms: every name looked up, every type checked, words read as what is expected of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Final

from socialai_dsl.grammar import ast
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics import (
    contents,
    links,
    resolve_calls,
    resolve_groups,
    resolve_names,
    sequences,
    tables,
)
from socialai_dsl.semantics.build import (
    LARGEST,
    all_of,
    any_of,
    arithmetic,
    between,
    is_own_noun,
    may_find_nothing,
    number,
    one_of,
)
from socialai_dsl.semantics.findings import FailedError, Findings, Scalar, surviving
from socialai_dsl.semantics.readings import Readings
from socialai_dsl.semantics.registers import Registers
from socialai_dsl.semantics.scope import Draws, PlayedFrame, Scope, Symbols
from socialai_dsl.semantics.terms import (
    BOOL,
    DIRECTION,
    TURN,
    Compare,
    Const,
    Not,
    Operation,
    Select,
    Term,
    Type,
)
from socialai_dsl.semantics.utterances import Utterances
from socialai_dsl.semantics.wording import described, quoted, spoken, words_of

MAX_NESTED: Final = 64
MAX_PARTS: Final = 2_000
MAX_ALL_PARTS: Final = 100_000
"""How deep an expression may lead, and how many parts it and all of them may have, definitions written out."""

INT = Type("int", 0, 0)
"""Expected: any number."""
ANY_TEXT = Type("text", 0, -1)
"""Expected: any text."""

_WORDED = ("text", "noun", "color", "status")


class Resolver:
    """Gives meaning to the expressions of one scenario.

    Attributes:
        symbols: what the scenario declares.
        findings: where mistakes go.
        registers: what is drawn or computed at reset, resolved when first needed.
        utterances: what the agent can say.
        frames: member -> the frame it plays.
        npc_texts: every text that an NPC can say, for what others may hear. said_by: member -> those it can say.
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
        self.utterances = Utterances(self, symbols.scenario.grammar)
        self.npc_texts: dict[str, None] = {}
        self.said_by: dict[str, dict[str, None]] = {}
        self.readings = Readings()
        self.used: set[DataPath] = set()
        self._within: list[tuple[ast.Expr, Scope]] = []
        self._parts = self._all_parts = 0
        self._tables: dict[str, tuple[tuple[str, ...], tuple[Term, ...]] | None] = {}

    def table(self, name: str) -> tuple[tuple[str, ...], tuple[Term, ...]]:
        """Keys and values of a table; raises FailedError once what is wrong with it has been reported."""
        if name not in self._tables:
            self._tables[name] = None
            with surviving():
                self._tables[name] = tables.resolved(self, name)
        found = self._tables[name]
        if found is None:
            raise FailedError
        return found

    @cached_property
    def unlocks(self) -> Mapping[int, tuple[int, ...]]:
        """Object -> the objects it unlocks."""
        return links.unlocked(self)

    @cached_property
    def moved_inside(self) -> set[str]:
        """Names of what some effect moves into something."""
        return contents.moved_inside(self.symbols.scenario)

    @cached_property
    def opens(self) -> Mapping[int, tuple[int, ...]]:
        """Object -> the objects that are open while it is active."""
        return links.opened(self)

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
        plain = text.replace(" ", "").replace("'", "").replace("-", "").replace(".", "")
        if expected.kind == "text" and plain.isalnum() and " " in text:
            return _text(text)
        return None

    def value(self, node: ast.Expr, expected: Type | None, scope: Scope) -> Term:
        """The term for a tree, of the expected type if one is given."""
        reading = self.readings.begin(node)
        term: Term | None = None
        self._within.append((node, scope))
        try:
            self._limit()
            term = self._value(node, expected, scope)
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

    def _value(self, node: ast.Expr, expected: Type | None, scope: Scope) -> Term:
        match node:
            case ast.Number(value=value):
                return self.fit(number(value), expected, node, scope)
            case ast.Truth(value=truth):
                return self.fit(Const(BOOL, int(truth)), expected, node, scope)
            case ast.Text(plain=plain):
                if plain is None:
                    raise self.fail("S204", "a text with <...> can only be said or heard", node, scope)
                return self._as_text(plain, expected, node, scope)
            case ast.Name():
                return self.fit(resolve_names.name(self, node, expected, scope), expected, node, scope)
            case ast.Attribute():
                return self.fit(resolve_names.attribute(self, node, scope), expected, node, scope)
            case ast.Call():
                return self.fit(resolve_calls.call(self, node, expected, scope), expected, node, scope)
            case ast.Quantifier():
                return self.fit(resolve_groups.quantified(self, node, expected, scope), expected, node, scope)
            case ast.Not(operand=operand):
                return self.fit(Not(self.value(operand, BOOL, scope)), expected, node, scope)
            case ast.Logic():
                return self.fit(self._logic(node, scope), expected, node, scope)
            case ast.Compare():
                return self.fit(self._comparison(node, scope), expected, node, scope)
            case ast.Member():
                return self.fit(self._membership(node, scope), expected, node, scope)
            case ast.Arithmetic() | ast.Negative():
                return self.fit(self._arithmetic(node, scope), expected, node, scope)
            case ast.Alternatives() | ast.Interval():
                raise self.fail(
                    "S204", f"`{quoted(node)}` is a choice of several, here one is needed", node, scope,
                    hint=f"to draw one write `pick({quoted(node)})`; to ask for any of them write `in`",
                )  # fmt: skip
            case ast.Placed():
                raise self.fail(
                    "S210", "`where` belongs in a place or inside pick(d in group where ...)", node, scope
                )
            case _:
                raise AssertionError(f"internal: no meaning for {type(node).__name__}")

    def fail(self, code: str, message: str, node: ast.Expr, scope: Scope, **more: str | None) -> FailedError:
        """Report what is wrong with a part of an expression; raising the result gives the expression up."""
        return self.findings.fail(code, message, self.findings.node(scope.path, node), **more)

    def fit(self, term: Term, expected: Type | None, node: ast.Expr, scope: Scope) -> Term:
        """The term itself if it is of the expected type, or the word of that type it stands for."""
        if expected is None or _same_kind(term.type, expected):
            return term
        if isinstance(term, Const) and expected.words and term.type.kind in (*_WORDED, "int"):
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

    def _as_text(self, text: str, expected: Type | None, node: ast.Expr, scope: Scope) -> Term:
        if expected is None or expected.kind == "text":
            return _text(text)
        return self.fit(_text(text), expected, node, scope)

    # -- logic and comparisons -------------------------------------------------------------------------------

    def _logic(self, node: ast.Logic, scope: Scope) -> Term:
        operands: list[Term] = []
        failed = False
        for operand in node.operands:
            try:
                operands.append(self.value(operand, BOOL, scope))
            except FailedError:
                failed = True  # the others may have mistakes of their own
        if failed:
            raise FailedError
        return all_of(operands) if node.op == "and" else any_of(operands)

    def _comparison(self, node: ast.Compare, scope: Scope) -> Term:
        if node.op in ("==", "!="):
            acts = [sequences.acts_at(self, side, scope) for side in (node.left, node.right)]
            if acts[0] is not None and acts[1] is not None:
                alike = sequences.same(self, acts[0], acts[1], node, scope)
                return alike if node.op == "==" else _negated(alike)
            if acts[0] is not None or acts[1] is not None:
                raise sequences.incomparable(self, node, acts[0] is not None, scope)
            if resolve_groups.is_group(self, node.right, scope):
                member = ast.Member(node.left, node.right, node.op == "!=", at=node.at)
                return self._membership(member, scope)
            left, right = self.pair(node.left, node.right, scope)
            same = self.equal(left, right, node, scope)
            return same if node.op == "==" else _negated(same)
        left = self.value(node.left, INT, scope)
        right = self.value(node.right, INT, scope)
        if node.op in (">", ">="):
            left, right = right, left
        return Compare("<" if node.op in ("<", ">") else "<=", left, right)

    def pair(self, left: ast.Expr, right: ast.Expr, scope: Scope) -> tuple[Term, Term]:
        """Two sides of a comparison; a bare word takes its type from the other side."""
        if resolve_names.is_bare(self, left, scope) and not resolve_names.is_bare(self, right, scope):
            second = self.value(right, None, scope)
            return self.guess(left, second.type, scope), second
        first = self.value(left, None, scope)
        return first, self.guess(right, first.type, scope)

    def guess(self, node: ast.Expr, hint: Type, scope: Scope) -> Term:
        """A value which, if it is a bare word, is one of the type `hint`."""
        if resolve_names.is_bare(self, node, scope):
            return self.value(node, hint, scope)
        return self.value(node, None, scope)

    def equal(self, left: Term, right: Term, node: ast.Expr, scope: Scope) -> Term:
        """Whether two values are the same, by what they are called where their types differ."""
        if _same_kind(left.type, right.type) and left.type.words == right.type.words:
            if isinstance(left, Const) and isinstance(right, Const):
                return Const(BOOL, int(left.value == right.value))
            return Compare("==", left, right)
        worded = (*_WORDED, "int")
        if left.type.kind in worded and right.type.kind in worded and (left.type.words or right.type.words):
            alike = any_of(
                all_of([_is(left, i), _is(right, j)])
                for i in range(left.type.low, left.type.high + 1)
                for j in range(right.type.low, right.type.high + 1)
                if spoken(left.type, i) == spoken(right.type, j)
            )
            # Both are asked for, even if none of their values are called the same.
            asked = [side for side in (left, right) if may_find_nothing(side) and not is_own_noun(side)]
            return all_of([*(Compare("==", side, side) for side in asked), alike])
        message = f"{described(left.type)} and {described(right.type)} cannot be compared"
        colored = {left.type.kind, right.type.kind} == {"color", "entity"}
        hint = "the colour of something is `x.color`" if colored else None
        raise self.fail("S204", message, node, scope, hint=hint)

    def _membership(self, node: ast.Member, scope: Scope) -> Term:
        options = self._options(node.right)
        lead = next((o for o in options if not resolve_names.is_bare(self, o, scope)), None)
        if resolve_names.is_bare(self, node.left, scope) and lead is not None:
            left = self.value(node.left, self._element(lead, scope), scope)
        else:
            left = self.value(node.left, None, scope)
        found = any_of(self._among(left, option, node, scope) for option in options)
        return _negated(found) if node.negated else found

    def _element(self, option: ast.Expr, scope: Scope) -> Type:
        """The type of an option, or of what is in it; it is asked for its type alone, so its picks are not numbered."""
        asked = replace(scope, draws=Draws(scope.draws.site))
        if resolve_groups.is_group(self, option, scope):
            return resolve_groups.group(self, option, None, asked).type
        return self.value(option, None, asked).type

    def _options(self, node: ast.Expr) -> tuple[ast.Expr, ...]:
        return node.options if isinstance(node, ast.Alternatives) else (node,)

    def _among(self, left: Term, option: ast.Expr, node: ast.Expr, scope: Scope) -> Term:
        if isinstance(option, ast.Interval):
            left = self.fit(left, INT, option, scope)
            return between(left, self.value(option.low, INT, scope), self.value(option.high, INT, scope))
        if resolve_groups.is_group(self, option, scope):
            group = resolve_groups.group(self, option, left.type, scope)
            if not _same_kind(left.type, group.type) or left.type.words != group.type.words:
                return any_of(self.equal(left, item, node, scope) for item in group.items)
            return one_of(left, group.items)
        return self.equal(left, self.guess(option, left.type, scope), option, scope)

    # -- arithmetic ------------------------------------------------------------------------------------------

    def _arithmetic(self, node: ast.Arithmetic | ast.Negative, scope: Scope) -> Term:
        if isinstance(node, ast.Negative):
            return self.computed("neg", (self.value(node.operand, INT, scope),), node, scope)
        if node.op in "+-":
            left, right = self._operands(node, scope)
            if left.type.kind == "direction":
                return _turned(node.op, left, right)
        else:
            left, right = self.value(node.left, INT, scope), self.value(node.right, INT, scope)
            if node.op in ("//", "%") and right.type.low <= 0 <= right.type.high:
                message = f"`{quoted(node.right)}` can be 0, and nothing can be divided by 0"
                raise self.fail("S204", message, node.right, scope)
        return self.computed(node.op, (left, right), node, scope)

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

    def _operands(self, node: ast.Arithmetic, scope: Scope) -> tuple[Term, Term]:
        """Numbers, or a direction and a turn added to it."""
        if resolve_names.is_bare(self, node.left, scope) and not isinstance(node.left, ast.Number):
            left = self.value(node.left, DIRECTION, scope)
        else:
            left = self.value(node.left, None, scope)
        if left.type.kind == "direction":
            return left, self.value(node.right, TURN, scope)
        return self.fit(left, INT, node.left, scope), self.value(node.right, INT, scope)


def _text(text: str) -> Const:
    return Const(Type("text", 0, 0, (text,)), 0)


def _is(term: Term, value: int) -> Term:
    if isinstance(term, Const):
        return Const(BOOL, int(term.value == value))
    return Compare("==", term, Const(term.type, value))


def _negated(term: Term) -> Term:
    if isinstance(term, Const):
        return Const(BOOL, 1 - term.value)
    if isinstance(term, Compare) and term.op == "==":
        return Compare("!=", term.left, term.right)
    return Not(term)


def _turned(op: str, direction: Term, turn: Term) -> Term:
    change = turn if op == "+" else arithmetic("neg", turn)
    if isinstance(direction, Const) and isinstance(change, Const):
        return Const(DIRECTION, (direction.value + change.value) % 4)
    return Operation(DIRECTION, "turn", (direction, change))


def is_number(word: str) -> bool:
    """Whether a word is a whole number."""
    return word.removeprefix("-").isdecimal()


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


def _same_kind(actual: Type, expected: Type) -> bool:
    if actual.kind != expected.kind:
        return False
    if actual.kind == "int":
        return bool(actual.words) == bool(expected.words) and (
            not actual.words or actual.words == expected.words
        )
    return actual.kind != "status" or actual.words == expected.words
