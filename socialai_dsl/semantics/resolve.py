"""Syntax trees to terms: names looked up, types checked, words read by the expected type."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from socialai_dsl import cures
from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.semantics import groups, object_facts, resolve_names, rows, tables
from socialai_dsl.semantics.conditional import conditional
from socialai_dsl.semantics.groups import check_moment
from socialai_dsl.semantics.resolve_names import synonym_of, without_arguments
from socialai_dsl.semantics.resolver import INT, WORDED, Resolver, same_kind, text_value
from socialai_dsl.semantics.scope import (
    Draws,
    ReportedError,
    Scope,
    described,
    quoted,
    spoken,
    wrong_count,
)
from socialai_dsl.semantics.terms import (
    BOOL,
    DIRECTION,
    TURN,
    Compare,
    Const,
    Not,
    Operation,
    ReadEach,
    Select,
    Term,
    Type,
    all_of,
    any_of,
    arithmetic,
    as_number,
    between,
    equals,
    holds_nothing,
    is_own_noun,
    may_be_nothing,
    may_find_nothing,
    number,
    one_of,
)
from socialai_dsl.semantics.words import ACTIVITIES, EFFECTS, PLACES, VALUES, WORDS
from socialai_dsl.semantics.words.use import Use
from socialai_dsl.vocabulary import is_number


def call(resolver: Resolver, node: ast.Call, expected: Type | None, scope: Scope) -> Term:
    """`verb(...)`, `subject.verb(...)` or a definition with arguments."""
    defined = _definition(resolver, node, scope)
    if defined is not None:
        define, arguments = defined
        return resolve_names.expanded(resolver, define, arguments, node, expected, scope)
    if node.subject is None and node.name in resolver.symbols.scenario.tables:
        return tables.looked_up(resolver, node, scope)
    if node.name not in VALUES and (kept := rows.kept_for(resolver, node, scope)) is not None:
        return kept
    word = VALUES.get(node.name)
    if word is None:
        raise _unknown(resolver, node, scope)
    most = len(word.takes)
    if not most - word.optional <= len(node.args) <= most:
        hint = None
        if word.takes == ("group",) and len(node.args) > 1:
            several = " | ".join(map(quoted, node.args))
            hint = resolver.instead(f"{node.name}({several})", node, scope, "alternatives are written a | b")
        elif word.subject != "none" and node.subject is None and len(node.args) == most + 1:
            who, *others = map(ast.unparse, node.args)
            if who in resolver.symbols.numbers or who in resolver.symbols.objects:
                hint = resolver.instead(f"{who}.{node.name}({', '.join(others)})", node, scope)
        raise resolver.fail("S211", wrong_count(word, len(node.args)), node, scope, hint=hint)
    if word.subject == "none" and node.subject is not None:
        message = f"`{node.name}` has nothing before it: write `{node.name}(...)`"
        raise resolver.fail("S211", message, node, scope)
    if not word.takes:
        return without_arguments(resolver, node.name, node.subject, node, scope)
    if word.subject != "none":
        check_moment(resolver, word, node, scope)
    return word.meaning(Use(resolver, word, node, node.subject, node.args, expected, scope))


def _definition(resolver: Resolver, node: ast.Call, scope: Scope) -> tuple[Any, dict[str, ast.Expr]] | None:
    if node.subject is not None:
        return None
    define = scope.frame.defines.get(node.name) if scope.frame is not None else None
    define = define or resolver.symbols.defines.get(node.name)
    if define is None:
        return None
    if len(node.args) != len(define.parameters):
        wanted = ", ".join(define.parameters) or "nothing"
        message = f"`{define.name}` takes {wanted}; {len(node.args)} given"
        raise resolver.fail("S211", message, node, scope)
    return define, dict(zip(define.parameters, node.args, strict=True))


def _unknown(resolver: Resolver, node: ast.Call, scope: Scope) -> ReportedError:
    if node.name in ACTIVITIES or node.name in EFFECTS or node.name in PLACES:
        kind = (
            "an activity" if node.name in ACTIVITIES else "an effect" if node.name in EFFECTS else "a place"
        )
        return resolver.fail(
            "S204", f"`{node.name}` is {kind}; here a condition or value is expected", node, scope
        )
    if (meant := synonym_of(resolver, node.name, node, scope)) is not None:
        return resolver.fail("S205", f"unknown verb `{node.name}`", node, scope, hint=meant)
    if node.name == "permuted":
        message = "`permuted` makes a table of another table, or the colours of a group of those of another"
        hint = "`tables: {dar: permuted(words)}`, `color: permuted(doors.color)`"
        return resolver.fail("S204", message, node, scope, hint=hint)
    if node.name == "believes" and node.subject is not None:
        return resolver.fail("S211", object_facts.unnamed(quoted(node.subject)), node, scope)
    candidates = [*VALUES, *resolver.symbols.defines, *(scope.frame.defines if scope.frame else ())]
    candidates += resolver.symbols.scenario.tables if node.subject is None else ()
    near = did_you_mean(node.name, candidates)
    kind = "word" if node.subject is None else "verb"
    return resolver.fail("S205", f"unknown {kind} `{node.name}`", node, scope, suggestion=near)


# -- every kind of expression --------------------------------------------------------------------------------


class ScenarioResolver(Resolver):
    """The resolver of a scenario: the meaning of every kind of expression."""

    words = WORDS

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
                return self.fit(text_value(plain), expected, node, scope)
            case ast.Name():
                return self.fit(resolve_names.name(self, node, expected, scope), expected, node, scope)
            case ast.Attribute():
                return self.fit(resolve_names.attribute(self, node, scope), expected, node, scope)
            case ast.Call():
                return self.fit(call(self, node, expected, scope), expected, node, scope)
            case ast.Quantifier():
                return self.fit(groups.quantified(self, node, expected, scope), expected, node, scope)
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
            case ast.Conditional():
                return self.fit(conditional(self, node, expected, scope), expected, node, scope)
            case ast.Alternatives() | ast.Interval():
                message = f"`{quoted(node)}` is a choice of several, here one is needed"
                also = "which draws one; to ask for any of them write `in`"
                hint = self.instead(f"pick({quoted(node)})", node, scope, also)
                raise self.fail("S204", message, node, scope, hint=hint)
            case ast.FilteredRegion():
                raise self.fail(
                    "S210", "`where` belongs in a place or inside pick(d in group where ...)", node, scope
                )
            case _:
                raise AssertionError(f"internal: no meaning for {type(node).__name__}")

    # -- logic and comparisons -------------------------------------------------------------------------------

    def _logic(self, node: ast.Logic, scope: Scope) -> Term:
        operands: list[Term] = []
        failed = False
        for operand in node.operands:
            try:
                operands.append(self.value(operand, BOOL, scope))
            except ReportedError:
                failed = True  # the others may have mistakes of their own
        if failed:
            raise ReportedError
        return all_of(operands) if node.op == "and" else any_of(operands)

    def _comparison(self, node: ast.Compare, scope: Scope) -> Term:
        if node.op in ("==", "!="):
            acts = [groups.acts_at(self, side, scope) for side in (node.left, node.right)]
            if acts[0] is not None and acts[1] is not None:
                alike = groups.same(self, acts[0], acts[1], node, scope)
                return alike if node.op == "==" else _negated(alike)
            if acts[0] is not None or acts[1] is not None:
                raise groups.incomparable(self, node, acts[0] is not None, scope)
            if groups.is_group(self, node.right, scope):
                member = ast.Member(node.left, node.right, node.op == "!=", at=node.at)
                return self._membership(member, scope)
            same = self._same(node, scope)
            return same if node.op == "==" else _negated(same)
        left, right = self._measured(node, scope)
        if node.op in (">", ">="):
            left, right = right, left
        return Compare("<" if node.op in ("<", ">") else "<=", left, right)

    def _measured(self, node: ast.Compare, scope: Scope) -> tuple[Term, Term]:
        """The sides of `<` and the like: numbers, or values of a look that go from the least to the greatest."""
        if not any(self._names_look(side) for side in (node.left, node.right)):
            return self.value(node.left, INT, scope), self.value(node.right, INT, scope)
        left, right = self.pair(node.left, node.right, scope)
        look = left if left.type.kind == "look" else right
        right = self.fit(right, look.type, node.right, scope)
        left = self.fit(left, look.type, node.left, scope)
        named = [name for name, one in self.symbols.scenario.looks.items() if one.words == look.type.words]
        if not any(self.symbols.scenario.looks[name].ordered for name in named):
            message = f"the values of `{named[0]}` have no order"
            hint = (
                f"`looks: {{{named[0]}: {{..., ordered: true}}}}` if they go from the least to the greatest"
            )
            raise self.fail("S204", message, node, scope, hint=hint)
        return as_number(left), as_number(right)

    def _names_look(self, node: ast.Expr) -> bool:
        """Whether an expression is `x.size`, or in a frame `size`, of a look of this name."""
        name = (
            node.name if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else None
        )
        return name in self.symbols.scenario.looks

    def _same(self, node: ast.Compare, scope: Scope) -> Term:
        """Whether both sides of a comparison are the same; `none` is what a register holds that holds nothing."""
        for word, side in ((node.left, node.right), (node.right, node.left)):
            if isinstance(word, ast.Name) and word.id == "none" and not self.is_bare(side, scope):
                other = self.value(side, None, scope)
                if may_be_nothing(other):
                    return holds_nothing(other)
                said = self.guess(word, other.type, scope)
                left, right = (said, other) if word is node.left else (other, said)
                return self.equal(left, right, node, scope)
        left, right = self.pair(node.left, node.right, scope)
        return self.equal(left, right, node, scope)

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
        for one, other in ((left, right), (right, left)):
            if one in self.slot_words:
                slot, word = self.slot_words[one]  # where the agent said nothing there, it is unlike anything
                same = any_of(
                    all_of([_is(word, i), self.equal(value, other, node, scope)])
                    for i, value in enumerate(slot.values)
                )
                return same if other in self.slot_words else all_of([*_asked_for(other), same])
            if isinstance(one, Select) and may_be_nothing(one):
                values = tuple(self.equal(value, other, node, scope) for value in one.values)
                return Select(BOOL, one.conditions, values, self.equal(one.default, other, node, scope))
        if same_kind(left.type, right.type) and left.type.words == right.type.words:
            if isinstance(left, Const) and isinstance(right, Const):
                return Const(BOOL, int(left.value == right.value))
            return _both_hold(left, right)
        worded = (*WORDED, "int")
        if left.type.kind in worded and right.type.kind in worded and (left.type.words or right.type.words):
            alike = any_of(
                all_of([_is(left, i), _is(right, j)]) for i, j in _called_alike(left.type, right.type)
            )
            # Both are asked for, even if none of their values are called the same.
            return all_of([*_asked_for(left, right), alike])
        message = f"{described(left.type)} and {described(right.type)} cannot be compared"
        colored = {left.type.kind, right.type.kind} == {"color", "entity"}
        hint: cures.Hint = "the colour of something is `x.color`" if colored else None
        if isinstance(node, ast.Compare) and colored:
            thing = node.left if left.type.kind == "entity" else node.right
            hint = self.instead(f"{quoted(thing)}.color", thing, scope)
        raise self.fail("S204", message, node, scope, hint=hint)

    def _membership(self, node: ast.Member, scope: Scope) -> Term:
        options = ast.options_of(node.right)
        lead = next((o for o in options if not self.is_bare(o, scope)), None)
        if self.is_bare(node.left, scope) and lead is not None:
            left = self.value(node.left, self._element(lead, scope), scope)
        else:
            left = self.value(node.left, None, scope)
        among = [self._among(left, option, node, scope) for option in options]
        found = any_of(is_it for is_it, _ in among)
        if len(options) > 1:  # every option has to be found, also those after the one that matches
            values = [value for _, value in among if value is not None and value not in self.slot_words]
            found = all_of([*_asked_for(*values), found])
        return _negated(found) if node.negated else found

    def _element(self, option: ast.Expr, scope: Scope) -> Type:
        """The type of an option, or of what is in it; it is asked for its type alone, so its picks are not numbered."""
        asked = replace(scope, draws=Draws(scope.draws.site))
        if groups.is_group(self, option, scope):
            return groups.group(self, option, None, asked).type
        return self.value(option, None, asked).type

    def _among(self, left: Term, option: ast.Expr, node: ast.Expr, scope: Scope) -> tuple[Term, Term | None]:
        """Whether a value is one option, or in it, and the option itself if that is one value."""
        if isinstance(option, ast.Interval):
            left = self.fit(left, INT, option, scope)
            low, high = (self.value(end, INT, scope) for end in (option.low, option.high))
            return between(left, low, high), None
        if groups.is_group(self, option, scope):
            group = groups.group(self, option, left.type, scope)
            alike = same_kind(left.type, group.type) and left.type.words == group.type.words
            if not alike or left in self.slot_words:
                return any_of(self.equal(left, item, node, scope) for item in group.items), None
            return one_of(left, group.items), None
        value = self.guess(option, left.type, scope)
        return self.equal(left, value, option, scope), value

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


def _called_alike(left: Type, right: Type) -> list[tuple[int, int]]:
    """Values of two types that are called the same, in ascending order; of numbers without end only those are looked at
    that the other type has words for.
    """
    if not left.words:
        return sorted((i, j) for j, i in _called_alike(right, left))
    known: dict[str, list[int]] = {}
    for i in left.values:
        known.setdefault(spoken(left, i), []).append(i)
    if right.words:
        return sorted((i, j) for j in right.values for i in known.get(spoken(right, j), ()))
    numbers = ((word, int(word)) for word in known if is_number(word))
    fitting = [(word, j) for word, j in numbers if str(j) == word and right.low <= j <= right.high]
    return sorted((i, j) for word, j in fitting for i in known[word])


def _both_hold(left: Term, right: Term) -> Term:
    """Whether two values of one type are equal: nothing is unlike anything, another register with nothing included."""
    alike = Compare("==", left, right)
    # What is not said in one slot is unlike what is not said in another.
    if is_own_noun(left) and is_own_noun(right):
        is_said = between(left, Const(left.type, left.type.low), Const(left.type, left.type.high))
        return all_of([is_said, alike])
    empty = [side for side in (left, right) if may_be_nothing(side)]
    # The number of nothing may be that of something else: a number, or the cell of what is in none.
    shared = left.type.kind in ("int", "cell") or all(_is_unlike(side) for side in (left, right))
    if not empty or not shared:
        return alike
    # What makes the whole condition false is asked for first, as an empty register does not ask for the other side.
    there = _asked_for(*(side for side in (left, right) if side is not empty[0]))
    return all_of([*there, *(_negated(holds_nothing(side)) for side in empty), alike])


def _asked_for(*sides: Term) -> list[Term]:
    """Conditions that ask for what has to be there, and hold where it is."""
    return [Compare("==", side, side) for side in sides if _fails_if_missing(side)]


def _fails_if_missing(term: Term) -> bool:
    """Whether a term may find nothing, and with it the whole condition; of a register that is its key."""
    if isinstance(term, ReadEach):
        return term.may_miss or may_find_nothing(term.key)
    return may_find_nothing(term) and not _is_unlike(term)


def _is_unlike(term: Term) -> bool:
    """Whether a term that finds nothing is unlike any value, rather than making the whole condition false."""
    return is_own_noun(term) or may_be_nothing(term)


def _is(term: Term, value: int) -> Term:
    if isinstance(term, Const):
        return Const(BOOL, int(term.value == value))
    return equals(term, value)


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
