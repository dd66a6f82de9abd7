"""Syntax trees to terms: every name looked up, every type checked, words read as what is expected of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

from socialai_dsl.grammar import ast
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
    all_of,
    any_of,
    arithmetic,
    between,
    is_own_noun,
    may_find_nothing,
    number,
    one_of,
)
from socialai_dsl.semantics.findings import FailedError, surviving
from socialai_dsl.semantics.resolver import INT, WORDED, Resolver, same_kind, text_value
from socialai_dsl.semantics.scope import Draws, Scope
from socialai_dsl.semantics.terms import BOOL, DIRECTION, TURN, Compare, Const, Not, Operation, Term, Type
from socialai_dsl.semantics.wording import described, quoted, spoken


class ScenarioResolver(Resolver):
    """The resolver of a scenario: every kind of expression, and what is known of the whole."""

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

    def meaning(self, node: ast.Expr, expected: Type | None, scope: Scope) -> Term:
        """The term for a tree by what kind of node it is."""
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

    def _as_text(self, text: str, expected: Type | None, node: ast.Expr, scope: Scope) -> Term:
        if expected is None or expected.kind == "text":
            return text_value(text)
        return self.fit(text_value(text), expected, node, scope)

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
        if self.is_bare(left, scope) and not self.is_bare(right, scope):
            second = self.value(right, None, scope)
            return self.guess(left, second.type, scope), second
        first = self.value(left, None, scope)
        return first, self.guess(right, first.type, scope)

    def guess(self, node: ast.Expr, hint: Type, scope: Scope) -> Term:
        """A value which, if it is a bare word, is one of the type `hint`."""
        if self.is_bare(node, scope):
            return self.value(node, hint, scope)
        return self.value(node, None, scope)

    def equal(self, left: Term, right: Term, node: ast.Expr, scope: Scope) -> Term:
        """Whether two values are the same, by what they are called where their types differ."""
        if same_kind(left.type, right.type) and left.type.words == right.type.words:
            if isinstance(left, Const) and isinstance(right, Const):
                return Const(BOOL, int(left.value == right.value))
            return Compare("==", left, right)
        worded = (*WORDED, "int")
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
        lead = next((o for o in options if not self.is_bare(o, scope)), None)
        if self.is_bare(node.left, scope) and lead is not None:
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
            if not same_kind(left.type, group.type) or left.type.words != group.type.words:
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

    def _operands(self, node: ast.Arithmetic, scope: Scope) -> tuple[Term, Term]:
        """Numbers, or a direction and a turn added to it."""
        if self.is_bare(node.left, scope) and not isinstance(node.left, ast.Number):
            left = self.value(node.left, DIRECTION, scope)
        else:
            left = self.value(node.left, None, scope)
        if left.type.kind == "direction":
            return left, self.value(node.right, TURN, scope)
        return self.fit(left, INT, node.left, scope), self.value(node.right, INT, scope)


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
