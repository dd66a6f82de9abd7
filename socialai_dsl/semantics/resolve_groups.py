"""Groups (objects, colours, ranges, alternatives) and the quantifiers over them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal, cast

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.semantics.build import all_of, between
from socialai_dsl.semantics.resolver import INT, Resolver
from socialai_dsl.semantics.scope import Macro, Scope
from socialai_dsl.semantics.signatures import QUANTIFIERS, WORDS
from socialai_dsl.semantics.terms import BOOL, CELL, COLOR, Const, Quantified, Term, Type, Variable
from socialai_dsl.semantics.wording import described, quoted, spoken

MAX_GROUP = 256
MAX_WEIGHT = 100
_MOST_CELLS = 28 * 28

Op = Literal["any", "all", "count", "first", "pick", "nearest"]


@dataclass(frozen=True)
class Group:
    """Known values of one type, in order; a weight repeats a value. `bounds` narrow a range whose ends are drawn."""

    type: Type
    items: tuple[Const, ...]
    bounds: tuple[Term, Term] | None = None


def is_group(resolver: Resolver, node: ast.Expr, scope: Scope) -> bool:
    """Whether an expression stands for several values."""
    match node:
        case ast.Alternatives() | ast.Interval():
            return True
        case ast.Name(id=word):
            bound = scope.variables.get(word)
            if bound is not None:
                return isinstance(bound, Macro) and is_group(resolver, bound.node, bound.scope)
            objects = resolver.symbols.objects.get(word)
            return (
                word in ("colors", "nouns", "cells")
                or word in resolver.symbols.groups
                or (objects is not None and not objects.single)
            )
    return False


def group(resolver: Resolver, node: ast.Expr, expected: Type | None, scope: Scope) -> Group:
    """The members of a group; bare words in it are of the expected type."""
    match node:
        case ast.Interval():
            return _interval(resolver, node, scope)
        case ast.Alternatives(options=options):
            return _alternatives(resolver, node, options, expected, scope)
        case ast.Name(id=word):
            bound = scope.variables.get(word)
            if isinstance(bound, Macro) and is_group(resolver, bound.node, bound.scope):
                return group(resolver, bound.node, expected, bound.scope)
            if bound is None and word == "cells":
                return _cells(resolver, node, scope)
            if bound is None and word in ("colors", "nouns"):
                type_ = COLOR if word == "colors" else resolver.symbols.nouns
                return Group(type_, _values(type_))
            objects = resolver.symbols.objects.get(word)
            if bound is None and word in resolver.symbols.groups:
                numbers = [resolver.symbols.numbers[name] for name in resolver.symbols.groups[word]]
                type_ = Type("entity", numbers[0], numbers[-1])
                return Group(type_, _values(type_))
            if bound is None and objects is not None:
                type_ = Type("entity", objects.numbers[0], objects.numbers[-1])
                return Group(type_, _values(type_))
    single = resolver.value(node, expected, scope)
    if isinstance(single, Const):
        return Group(single.type, (single,))
    message = f"`{quoted(node)}` is {described(single.type)}, here a group is needed"
    hint = (
        "a group is the name of objects with `count`, `colors`, `nouns`, a range 1..3, or alternatives a | b"
    )
    raise resolver.fail("S204", message, node, scope, hint=hint)


def _cells(resolver: Resolver, node: ast.Name, scope: Scope) -> Group:
    """All floor cells of the room; a search over cells cannot be done for each of many cells."""
    bound = (term for term in scope.variables.values() if isinstance(term, Variable))
    if scope.here or any(term.type.kind == "cell" for term in bound):
        message = "`cells` cannot stand inside another search over cells"
        raise resolver.fail(
            "S211", message, node, scope, hint="draw or compute one of the two in `let` first"
        )
    return Group(CELL, ())


def _values(type_: Type) -> tuple[Const, ...]:
    return tuple(Const(type_, value) for value in range(type_.low, type_.high + 1))


def _interval(resolver: Resolver, node: ast.Interval, scope: Scope) -> Group:
    low, high = resolver.value(node.low, INT, scope), resolver.value(node.high, INT, scope)
    type_ = Type("int", low.type.low, high.type.high)
    known = isinstance(low, Const) and isinstance(high, Const)
    if type_.size < 1:
        raise resolver.fail(
            "S106", f"the range {quoted(node)} is empty: its end is below its start", node, scope
        )
    if type_.size > MAX_GROUP:
        raise resolver.fail(
            "S106", f"a range has at most {MAX_GROUP} values, this one {type_.size}", node, scope
        )
    return Group(type_, _values(type_), None if known else (low, high))


def _alternatives(
    resolver: Resolver, node: ast.Expr, options: tuple[ast.Expr, ...], expected: Type | None, scope: Scope
) -> Group:
    parts = [_weighted(resolver, option, scope) for option in options]
    lead = next((p for _, p in parts if not resolver.is_bare(p, scope)), None)
    if expected is None and lead is not None:
        expected = group(resolver, lead, None, scope).type
    items: list[Const] = []
    for weight, option in parts:
        members = group(resolver, option, _open(expected), scope)
        if members.bounds is not None:
            raise resolver.fail(
                "S204", f"the ends of `{quoted(option)}` are not known numbers", option, scope
            )
        items += members.items * weight
    return _joined(resolver, node, items, scope)


def _open(expected: Type | None) -> Type | None:
    if expected is not None and expected.kind in ("int", "entity") and not expected.words:
        return replace(expected, low=0, high=0)
    return expected


def _weighted(resolver: Resolver, option: ast.Expr, scope: Scope) -> tuple[int, ast.Expr]:
    match option:
        case ast.Arithmetic(op="*", left=ast.Number(value=weight), right=right) if not isinstance(
            right, ast.Number
        ):
            if not 1 <= weight <= MAX_WEIGHT:
                raise resolver.fail("S106", f"a weight is from 1 to {MAX_WEIGHT}", option, scope)
            return weight, right
    return 1, option


def _joined(resolver: Resolver, node: ast.Expr, items: list[Const], scope: Scope) -> Group:
    """Alternatives under one type that has room for all of them."""
    kinds = {item.type.kind for item in items}
    if len(kinds) > 1:
        first, second = (described(item.type) for item in _different(items))
        raise resolver.fail("S204", f"`{quoted(node)}` mixes {first} with {second}", node, scope)
    if kinds == {"text"}:
        words = tuple(dict.fromkeys(spoken(item.type, item.value) for item in items))
        type_ = Type("text", 0, len(words) - 1, words)
        return Group(type_, tuple(Const(type_, words.index(spoken(i.type, i.value))) for i in items))
    if kinds <= {"int", "entity"} and not items[0].type.words:
        numbers = [item.value for item in items]
        type_ = Type(items[0].type.kind, min(numbers), max(numbers))
        return Group(type_, tuple(Const(type_, value) for value in numbers))
    return Group(items[0].type, tuple(items))


def _different(items: list[Const]) -> Iterator[Const]:
    yield items[0]
    yield next(item for item in items if item.type.kind != items[0].type.kind)


def quantified(resolver: Resolver, node: ast.Quantifier, expected: Type | None, scope: Scope) -> Term:
    """`pick(x in group where condition to target)` and its kin."""
    if node.name not in QUANTIFIERS:
        near = did_you_mean(node.name, QUANTIFIERS)
        raise resolver.fail("S205", f"`{node.name}(d in ...)` is not known", node, scope, suggestion=near)
    if node.var in WORDS or node.var in resolver.symbols.declared:
        message = f"the variable `{node.var}` has a name that means something already"
        raise resolver.fail("S213", message, node, scope, hint="call it by a letter, such as `d`")
    if node.name == "nearest" and node.to is None:
        raise resolver.fail("S211", "`nearest` needs `to`: nearest(d in doors to agent)", node, scope)
    if node.name != "nearest" and node.to is not None:
        raise resolver.fail("S211", f"`to` belongs to `nearest`, not to `{node.name}`", node, scope)
    if node.name in ("any", "all") and node.where is None:
        raise resolver.fail("S211", f"`{node.name}` needs `where` and a condition", node, scope)
    chooses = node.name in ("pick", "first", "nearest")
    ordinal = scope.draws.number() if node.name == "pick" else 0
    members = group(resolver, node.group, _open(expected) if chooses else None, scope)
    variable = _named(node.var, scope)
    inner = replace(scope.binding(node.var, Variable(members.type, variable)), nested=scope.nested + 1)
    condition = resolver.value(node.where, BOOL, inner) if node.where is not None else None
    to = resolver.somewhere(node.to, scope) if node.to is not None else None
    return made(cast(Op, node.name), members, variable, condition, scope, ordinal, to)


def pick(resolver: Resolver, node: ast.Call, expected: Type | None, scope: Scope) -> Term:
    """`pick(group)` and `first(group)`, `count(group)`: without a condition."""
    ordinal = scope.draws.number() if node.name == "pick" else 0
    members = group(resolver, node.args[0], _open(expected) if node.name != "count" else None, scope)
    return made(cast(Op, node.name), members, _named("each", scope), None, scope, ordinal)


def made(
    op: Op,
    members: Group,
    variable: str,
    condition: Term | None,
    scope: Scope,
    ordinal: int = 0,
    to: Term | None = None,
) -> Quantified:
    """The term of a quantifier."""
    if members.bounds is not None:
        inside = between(Variable(members.type, variable), *members.bounds)
        condition = inside if condition is None else all_of([inside, condition])
    type_ = members.type
    if op in ("any", "all"):
        type_ = BOOL
    elif op == "count":
        type_ = Type("int", 0, len(members.items))
    site = scope.pick_site if op == "pick" else ""
    cells = members.type.kind == "cell"
    if cells and op == "count":
        type_ = Type("int", 0, _MOST_CELLS)
    return Quantified(type_, op, variable, members.items, condition, to, ordinal, site, cells)


def any_member(resolver: Resolver, node: ast.Expr, scope: Scope, relation: Callable[[Term], Term]) -> Term:
    """Whether a relation holds to any member of the group at `node`."""
    members = group(resolver, node, None, scope)
    if members.type.kind not in ("entity", "cell"):
        message = (
            f"`{quoted(node)}` is {described(members.type)}, here somebody or something in the room is needed"
        )
        raise resolver.fail("S204", message, node, scope)
    variable = _named("each", scope)
    condition = relation(Variable(members.type, variable))
    return made("any", members, variable, condition, scope)


def _named(word: str, scope: Scope) -> str:
    return f"{word}#{scope.nested}" if scope.nested else word
