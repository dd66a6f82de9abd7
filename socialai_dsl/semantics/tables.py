"""Tables: values looked up by a key, as written or permuted at reset."""

from __future__ import annotations

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.semantics import groups
from socialai_dsl.semantics.groups import WIDE, values_of
from socialai_dsl.semantics.resolver import ANY_TEXT, Resolver
from socialai_dsl.semantics.scope import (
    KEY,
    ReportedError,
    Scope,
    described,
    quoted,
    reset_scope,
    spoken,
    surviving,
)
from socialai_dsl.semantics.terms import (
    Compare,
    Const,
    Quantification,
    Read,
    SitedTerm,
    Term,
    Type,
    Variable,
    all_of,
    chosen,
    numbers_of,
    where_there_is,
)
from socialai_dsl.source import DataPath
from socialai_dsl.vocabulary import is_number, is_plain

_NO_KEYS = ("entity", "cell", "bool", "utterance")
"""Kinds of values that no words stand for."""


def look_at_all(resolver: Resolver) -> None:
    """Report what is wrong with a table, though nothing may be looked up in it."""
    for name in resolver.symbols.scenario.tables:
        with surviving():
            table(resolver, name)


def looked_up(resolver: Resolver, node: ast.Call, scope: Scope) -> Term:
    """`dar(exit.color)`: the value beside the key that the argument is."""
    name = node.name
    resolver.used.add(("tables", name))
    keys, values = table(resolver, name)
    if len(node.args) != 1:
        raise resolver.fail("S211", f"`{name}` is a table: it takes one key", node, scope)
    key = _key(resolver, name, node.args[0], scope)
    known = numbers_of(key)
    possible = values_of(resolver, key)
    cases: dict[int, Term] = {}
    # Few values far from each other have a wide type.
    for value in sorted(possible) if isinstance(possible, frozenset) and len(known) > WIDE else known:
        word = spoken(key.type, value)
        if word not in keys and value not in possible:
            continue
        if word not in keys:
            raise _no_key(resolver, name, keys, word, key, node.args[0], scope)
        if isinstance(key, Const):
            return values[keys.index(word)]
        cases[value] = values[keys.index(word)]
    return where_there_is(key, chosen(key, [*cases], [*cases.values()], values[0].type))


def _key(resolver: Resolver, name: str, node: ast.Expr, scope: Scope) -> Term:
    """What is looked up: something that words stand for. A word that means nothing else is itself looked up."""
    means_nothing = isinstance(node, ast.Name) and resolver.means_nothing(node.id, scope)
    key = resolver.value(node, ANY_TEXT if means_nothing else None, scope)
    if key.type.kind in _NO_KEYS:
        message = f"`{quoted(node)}` is {described(key.type)}; the keys of the table `{name}` are words"
        colored = f"{quoted(node)}.color"
        hint = resolver.instead(colored, node, scope) if key.type.kind == "entity" else None
        raise resolver.fail("S204", message, node, scope, hint=hint)
    return key


def _no_key(
    resolver: Resolver,
    name: str,
    keys: tuple[str, ...],
    word: str,
    key: Term,
    node: ast.Expr,
    scope: Scope,
) -> ReportedError:
    """What is looked up, or what it can be, is not in the table."""
    near = did_you_mean(word, keys)
    if isinstance(key, Const):
        hint = None if near else "it has " + ", ".join(keys)
        message = f"the table `{name}` has no `{word}`"
        return resolver.fail("S402", message, node, scope, suggestion=near, hint=hint)
    if (name, word) in resolver.missing_keys:
        return ReportedError()  # wherever else it is looked up, that is no other mistake
    resolver.missing_keys.add((name, word))
    message = f"`{quoted(node)}` can be {word}, which the table `{name}` does not have"
    hint = f"it has `{near}`; is that meant?" if near else "it has " + ", ".join(keys)
    return resolver.fail("S402", message, node, scope, hint=hint)


def table(resolver: Resolver, name: str) -> tuple[tuple[str, ...], tuple[Term, ...]]:
    """Keys and values of a table; raises ReportedError once what is wrong with it has been reported."""
    if name not in resolver.tables:
        resolver.tables[name] = None
        with surviving():
            resolver.tables[name] = _resolved(resolver, name)
    found = resolver.tables[name]
    if found is None:
        raise ReportedError
    return found


def _resolved(resolver: Resolver, name: str) -> tuple[tuple[str, ...], tuple[Term, ...]]:
    written = resolver.symbols.scenario.tables[name]
    path: DataPath = ("tables", name)
    if isinstance(written, str):
        return _permuted(resolver, name, written, path)
    if not written:
        raise resolver.findings.fail("S106", "a table has at least one key", resolver.findings.at(path))
    for key in written:
        resolver.findings.must_be_one_line((*path, key, KEY), key)
    words = [_word(resolver, (*path, key), raw) for key, raw in written.items()]
    return tuple(written), _as_values(words)


def _word(resolver: Resolver, path: DataPath, raw: object) -> str:
    """What a value of a table is called: a word, a number, a text."""
    if isinstance(raw, str):
        text = raw.strip()
        if not resolver.findings.must_be_one_line(path, text):
            raise ReportedError
        if is_plain(text, "'-") or not text.strip(" '-"):
            return text
    term = resolver.written(raw, ANY_TEXT if isinstance(raw, str) else None, reset_scope(path))  # type: ignore[arg-type]
    if not isinstance(term, Const):
        raise resolver.findings.fail(
            "S204", "a value of a table is known beforehand", resolver.findings.at(path)
        )
    return spoken(term.type, term.value)


def _as_values(words: list[str]) -> tuple[Term, ...]:
    """The words as values of one type: numbers if all are, else texts."""
    if all(map(is_number, words)):
        numbers = [int(word) for word in words]
        type_ = Type("int", min(numbers), max(numbers))
        return tuple(Const(type_, value) for value in numbers)
    kinds = tuple(dict.fromkeys(words))
    type_ = Type("text", 0, len(kinds) - 1, kinds)
    return tuple(Const(type_, kinds.index(word)) for word in words)


def _permuted(
    resolver: Resolver, name: str, raw: str, path: DataPath
) -> tuple[tuple[str, ...], tuple[Term, ...]]:
    """`permuted(other)`: the keys of another table, its values in an order that is drawn at reset; `permuted(a | b)`:
    the numbers from 1 with one of the group each.
    """
    node = resolver.findings.expression(path, raw)
    if not (
        isinstance(node, ast.Call)
        and node.name == "permuted"
        and node.subject is None
        and len(node.args) == 1
    ):
        message = "a table is written out, or permuted(another table), or permuted(group)"
        raise resolver.findings.fail("S204", message, resolver.findings.at(path))
    (of,) = node.args
    known = resolver.symbols.scenario.tables
    if isinstance(of, ast.Name) and of.id in known and not isinstance(known[of.id], str):
        resolver.used.add(("tables", of.id))
        keys, values = table(resolver, of.id)
    elif groups.is_group(resolver, of, reset_scope(path)):
        members = groups.group(resolver, of, None, reset_scope(path))
        if members.bounds is not None:
            message = f"`{quoted(of)}` is no group that is known beforehand"
            raise resolver.findings.fail("S204", message, resolver.findings.node(path, of))
        keys, values = tuple(str(1 + k) for k in range(len(members.items))), members.items
    else:
        near = did_you_mean(quoted(of), [key for key, value in known.items() if not isinstance(value, str)])
        message = f"`{quoted(of)}` is not a table that is written out"
        span = resolver.findings.node(path, of)
        hint = (
            None if near else "`permuted(ann | bob | agent)` has one of them for each of the numbers from 1"
        )
        raise resolver.findings.no_such(quoted(of), message, span, suggestion=near, hint=hint)
    order = permutation(resolver, f"tables.{name}", len(keys), path)
    return keys, tuple(chosen(place, range(len(values)), values, values[0].type) for place in order)


def permutation(resolver: Resolver, register: str, count: int, path: DataPath) -> tuple[Read, ...]:
    """The numbers from 0 in an order that is drawn at reset, all orders alike: one register for each place."""
    type_ = Type("int", 0, count - 1)
    items = tuple(Const(type_, value) for value in range(count))
    order: list[Read] = []
    for k in range(count):
        each = Variable(type_, "each")
        free = all_of(Compare("!=", each, before) for before in order) if order else None
        site = f"{register}[{k}]"
        drawn = Quantification(type_, "pick", "each", items, free)
        if site in resolver.registers:
            order.append(Read(type_, site))
        else:
            order.append(resolver.registers.put(site, SitedTerm(drawn, site, resolver.findings.at(path))))
    return tuple(order)
