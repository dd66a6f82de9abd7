"""Registers that there are for each of a group, `trust: {for: peers, start: 2}`: their keys, and that of one key."""

from __future__ import annotations

from socialai_dsl.grammar import ast
from socialai_dsl.schema.scenario import Expression
from socialai_dsl.semantics import groups
from socialai_dsl.semantics.resolver import ENTITY, Resolver
from socialai_dsl.semantics.scope import FailedError, Scope, of_each, quoted, reset_scope
from socialai_dsl.semantics.terms import Const, Read, ReadEach, Term, numbers_of
from socialai_dsl.source import DataPath

_KEYS = ("entity", "color", "noun", "int")
"""Kinds of values of which each may have a register."""


def keys(resolver: Resolver, path: DataPath, raw: Expression) -> tuple[Const, ...]:
    """The group at `path`, for each of which there is a register."""
    scope = reset_scope(path)
    node = resolver.findings.expression(path, raw)
    members = groups.group(resolver, node, None, scope)
    if members.type.kind in _KEYS and members.bounds is None:
        return tuple(dict.fromkeys(members.items))
    message = f"there can be no register for each of `{quoted(node)}`"
    hint = "a group of objects or of the cast, `cast`, `objects`, `colors`, `nouns`, or a range 1..3"
    raise resolver.fail("S204", message, node, scope, hint=hint)


def example(resolver: Resolver, path: str) -> str:
    """A key, as it could be written."""
    key = resolver.registers.keys(path)[0]
    return "noun" if key.type.kind == "noun" else resolver.symbols.word(key)


def kept_for(resolver: Resolver, node: ast.Call, scope: Scope) -> Term | None:
    """`trust(speaker)`, `ann.trust(bob)`: the register of a key; None if the name is not that of a register."""
    frame, symbols = scope.frame, resolver.symbols
    if node.subject is None:
        if frame is not None and node.name in frame.model.let:
            return of_key(resolver, frame.register(node.name), node, scope)
        if node.name in symbols.scenario.state:
            return of_key(resolver, f"state.{node.name}", node, scope)
        return None
    if not any(node.name in played.model.let for played in resolver.frames.values()):
        return None
    who = resolver.value(node.subject, ENTITY, scope)
    members = symbols.members_of(numbers_of(who))
    if not all(f"{member}.{node.name}" in resolver.registers for member in members):
        message = f"`{quoted(node.subject)}` has no register `{node.name}`"
        raise resolver.fail("S205", message, node, scope)
    return of_each(who, [of_key(resolver, f"{member}.{node.name}", node, scope) for member in members])


def of_keys(resolver: Resolver, path: str, node: ast.Call, scope: Scope) -> list[Term]:
    """The register of the key in brackets, or those of a group that is named there."""
    if len(node.args) != 1 or not groups.is_group(resolver, node.args[0], scope):
        return [of_key(resolver, path, node, scope)]
    known = resolver.registers.keys(path)
    members = groups.group(resolver, node.args[0], groups.opened(known[0].type) if known else None, scope)
    if not known or members.bounds is not None or not {*members.items} <= {*known}:
        return [of_key(resolver, path, node, scope)]  # which says what is wrong
    return [resolver.registers.of_key(path, key) for key in dict.fromkeys(members.items)]


def of_key(resolver: Resolver, path: str, node: ast.Call, scope: Scope) -> Read | ReadEach:
    """The register of the key in brackets; what has none for sure is a mistake."""
    registers, symbols = resolver.registers, resolver.symbols
    if path not in registers:
        raise FailedError  # its group means nothing, which has been reported
    known = registers.keys(path)
    if not known:
        message = f"there is one `{node.name}`, so it takes nothing in brackets"
        hint = f"one for each of a group is `{node.name}: {{for: group, start: ...}}`"
        raise resolver.fail("S211", message, node, scope, hint=hint)
    if len(node.args) != 1:
        message = f"`{node.name}` takes one key: `{node.name}({example(resolver, path)})`"
        raise resolver.fail("S211", message, node, scope)
    key = resolver.value(node.args[0], groups.opened(known[0].type), scope)
    possible = {key.value} if isinstance(key, Const) else set(key.type.values)
    if not possible & {each.value for each in known}:
        first, last = symbols.word(known[0]), symbols.word(known[-1])
        listed = first if first == last else f"{first} to {last}"
        message = f"there is no `{node.name}` for `{quoted(node.args[0])}`"
        raise resolver.fail("S204", message, node.args[0], scope, hint=f"there is one for each of {listed}")
    return registers.of_key(path, key)
