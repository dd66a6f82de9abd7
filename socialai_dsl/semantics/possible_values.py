"""Which values something can have, as far as its declaration says."""

from __future__ import annotations

from socialai_dsl.grammar import ast
from socialai_dsl.semantics.findings import FailedError
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.terms import COLOR, Const, FieldOf, Quantified, Read, Select, Term

_ALL_COLORS = frozenset(range(COLOR.low, COLOR.high + 1))
_DRAWN_FREELY = ("random", "distinct")


def values_of(resolver: Resolver, term: Term) -> frozenset[int]:
    """The values that a term can have; those of its whole type where nothing more is known."""
    match term:
        case Const(value=value):
            return frozenset({value})
        case Read(path=path) if (drawn := resolver.registers.drawn_at_reset(path)) is not None:
            return values_of(resolver, drawn)
        case Quantified(op="pick" | "first" | "nearest", items=items):
            return frozenset(item.value for item in items)
        case Select(values=values, default=default):
            return frozenset().union(*(values_of(resolver, value) for value in (*values, default)))
        case FieldOf(entity=who, name="color"):
            return frozenset().union(*(_colors(resolver, number) for number in values_of(resolver, who)))
    return frozenset(range(term.type.low, term.type.high + 1))


def _colors(resolver: Resolver, number: int) -> frozenset[int]:
    """The colours that an object or a member of the cast can have."""
    symbols = resolver.symbols
    for objects in symbols.objects.values():
        if number not in objects.numbers:
            continue
        given = symbols.scenario.objects[objects.name].color or (
            symbols.default_colors.get(objects.type.name, "random"),
        )
        single = not resolver.findings.is_list(("objects", objects.name, "color"))
        place = 0 if single else objects.numbers.index(number)
        return _written(resolver, given[place]) if place < len(given) else _ALL_COLORS
    member = symbols.member_of(number)
    raws = [one.color for one in symbols.alternatives[member]] if member is not None else [None]
    return frozenset().union(*(_written(resolver, raw) for raw in raws))


def _written(resolver: Resolver, raw: object) -> frozenset[int]:
    """The colours that a `color:` can mean."""
    if not isinstance(raw, str) or raw in _DRAWN_FREELY:
        return _ALL_COLORS
    try:
        return _named(resolver, resolver.findings.expression((), raw))
    except FailedError:
        return _ALL_COLORS  # which is reported where it is resolved


def _named(resolver: Resolver, node: ast.Expr) -> frozenset[int]:
    match node:
        case ast.Name(id=word) if word in COLOR.words:
            return frozenset({COLOR.low + COLOR.words.index(word)})
        case ast.Call(name="pick", args=(ast.Alternatives(options=options),), subject=None):
            return frozenset().union(*(_named(resolver, option) for option in options))
        case ast.Call(name="permuted", args=(ast.Attribute(name="color") as colors,), subject=None):
            return _named(resolver, colors)
        case ast.Attribute(subject=ast.Name(id=name), name="color") if name in resolver.symbols.objects:
            numbers = resolver.symbols.objects[name].numbers
            return frozenset().union(*(_colors(resolver, number) for number in numbers))
    return _ALL_COLORS
