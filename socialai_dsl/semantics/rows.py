"""Registers that there are for each of a group, `trust: {for: peers, start: 2}`: their keys, and that of one key.

Looks are such registers as well, whose values are words and which the picture shows: `ann.mood`.
"""

from __future__ import annotations

from collections.abc import Iterator

from socialai_dsl.diagnostics import advice_on
from socialai_dsl.grammar import ast
from socialai_dsl.schema.scenario import CHANNELS, Expression, Look
from socialai_dsl.semantics import groups
from socialai_dsl.semantics.plans import LookPlan
from socialai_dsl.semantics.resolver import ENTITY, Declaration, Resolver
from socialai_dsl.semantics.scope import (
    ReportedError,
    Scope,
    of_each,
    quoted,
    reset_scope,
    surviving,
)
from socialai_dsl.semantics.terms import Const, Read, ReadEach, Term, Type, entity, numbers_of
from socialai_dsl.source import DataPath
from socialai_dsl.widths import LARGEST_NUMBER

_KEYS = ("entity", "color", "noun", "int")
"""Kinds of values of which each may have a register."""


def keys(resolver: Resolver, path: DataPath, raw: Expression) -> tuple[Const, ...]:
    """The group at `path`, for each of which there is a register."""
    scope = reset_scope(path)
    node = resolver.findings.expression(path, raw)
    groups.must_be_known(resolver, node, scope)
    members = groups.group(resolver, node, None, scope)
    if members.type.kind in _KEYS and members.bounds is None:
        far = max((item.value for item in members.items), key=abs, default=0)
        if members.type.kind == "int" and abs(far) > LARGEST_NUMBER:
            raise resolver.findings.too_large("a key", far, resolver.findings.node(path, node))
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
    members = groups.group(
        resolver, node.args[0], groups.of_any_range(known[0].type) if known else None, scope
    )
    if not known or members.bounds is not None or not {*members.items} <= {*known}:
        return [of_key(resolver, path, node, scope)]  # which says what is wrong
    return [resolver.registers.of_key(path, key) for key in dict.fromkeys(members.items)]


def of_key(resolver: Resolver, path: str, node: ast.Call, scope: Scope) -> Read | ReadEach:
    """The register of the key in brackets; what has none for sure is a mistake."""
    registers, symbols = resolver.registers, resolver.symbols
    if path not in registers:
        raise ReportedError  # its group means nothing, which has been reported
    known = registers.keys(path)
    if not known:
        message = f"there is one `{node.name}`, so it takes nothing in brackets"
        hint = f"one for each of a group is `{node.name}: {{for: group, start: ...}}`"
        raise resolver.fail("S211", message, node, scope, hint=hint)
    if len(node.args) != 1:
        message = f"`{node.name}` takes one key: `{node.name}({example(resolver, path)})`"
        raise resolver.fail("S211", message, node, scope)
    key = resolver.value(node.args[0], groups.of_any_range(known[0].type), scope)
    possible = numbers_of(key)  # of a wide range not one by one
    if not any(each.value in possible for each in known):
        first, last = symbols.word(known[0]), symbols.word(known[-1])
        listed = first if first == last else f"{first} to {last}"
        message = f"there is no `{node.name}` for `{quoted(node.args[0])}`"
        raise resolver.fail("S204", message, node.args[0], scope, hint=f"there is one for each of {listed}")
    return registers.of_key(path, key)


# -- looks ---------------------------------------------------------------------------------------------------


def declare_looks(resolver: Resolver) -> None:
    """Make the register of each that has a look known, and report words that mean something already."""
    for name, look in resolver.symbols.scenario.looks.items():
        with surviving():
            _check_words(resolver, name, look)
            has_it = keys(resolver, ("looks", name, "for"), look.for_)
            _check_has_looks(resolver, name, has_it)
            type_ = Type("look", 0, len(look.words) - 1, look.words)
            declared = Declaration(
                f"looks.{name}",
                name,
                ("looks", name, "start"),
                _start(look, 0),
                reset_scope(("looks", name, "start"), f"looks.{name}"),
                type_,
                for_each=has_it,
                each=_starts(resolver, name, look, len(has_it)),
            )
            resolver.registers.declare(declared)


def _check_words(resolver: Resolver, name: str, look: Look) -> None:
    """Report words that mean something already, or come twice."""
    findings = resolver.findings
    is_status = any(name in type_.states for type_ in resolver.symbols.types.values())
    if is_status or name in CHANNELS:
        message = (
            f"`{name}` is {'a status of objects' if is_status else 'a channel'}; call the look something else"
        )
        findings.error("S213", message, findings.places.key_span(("looks", name)))
    for i, word in enumerate(look.words):
        span = findings.at(("looks", name, "words", i), 0, len(word))
        if word in resolver.symbols.declared or word in resolver.words.reserved or word == "none":
            findings.error("S213", f"`{word}` means something else already; call the value otherwise", span)
        elif word in look.words[:i]:
            findings.error("S213", f"`{word}` is a value of `{name}` already", span)


def _check_has_looks(resolver: Resolver, name: str, has_it: tuple[Const, ...]) -> None:
    """Report a group that is neither of things nor of members of the cast."""
    if has_it[0].type.kind != "entity":
        path: DataPath = ("looks", name, "for")
        message = "only objects and members of the cast have looks"
        raise resolver.findings.fail("S204", message, resolver.findings.at(path))


def _start(look: Look, i: int) -> Expression:
    """What one of the group starts with."""
    raw = look.start[i]
    return f"pick({' | '.join(look.words)})" if raw == "random" else raw


def _starts(resolver: Resolver, name: str, look: Look, count: int) -> tuple[tuple[DataPath, Expression], ...]:
    """What each of the group starts with, where a list says it."""
    path: DataPath = ("looks", name, "start")
    if not resolver.findings.is_list(path):
        return ()
    if len(look.start) != count:
        message = f"{len(look.start)} given for {count}: a list has one for each of the group"
        raise resolver.findings.fail("S106", message, resolver.findings.at(path))
    return tuple(((*path, i), _start(look, i)) for i in range(count))


def look(resolver: Resolver, name: str, node: ast.Expr, scope: Scope) -> Term:
    """The look of what stands before the dot; in a frame without one that of the member itself."""
    (found,) = looks(resolver, name, node, scope, several=False)
    return found


def looks(resolver: Resolver, name: str, node: ast.Expr, scope: Scope, several: bool = True) -> list[Term]:
    """The looks that are meant, perhaps those of each of a group; what cannot have it is a mistake."""
    bearers = _bearers(resolver, name, node, scope, several)
    registers, path = resolver.registers, f"looks.{name}"
    if path not in registers:
        raise ReportedError  # its group means nothing, which has been reported
    known = {key.value for key in registers.keys(path)}
    found: list[Term] = []
    for who in bearers:
        if who.type.kind != "entity" or not known & {*numbers_of(who)}:
            called = quoted(node.subject) if isinstance(node, ast.Attribute) else str(scope.member)
            first, last = (resolver.symbols.called(registers.keys(path)[i].value) for i in (0, -1))
            listed = first if first == last else f"{first} to {last}"
            message = f"`{called}` has no `{name}`"
            raise resolver.fail("S204", message, node, scope, hint=f"what has one: {listed}")
        found.append(registers.of_key(path, who))
    return found


def _bearers(resolver: Resolver, name: str, node: ast.Expr, scope: Scope, several: bool) -> tuple[Term, ...]:
    """Whose look is meant."""
    if isinstance(node, ast.Attribute):
        if several and groups.is_group(resolver, node.subject, scope):
            return tuple(dict.fromkeys(groups.group(resolver, node.subject, None, scope).items))
        return (resolver.value(node.subject, ENTITY, scope),)
    if scope.member is None:
        message = f"`{name}` is a look: say whose, `x.{name}`"
        raise resolver.fail("S211", message, node, scope)
    return (entity(resolver.symbols.numbers[scope.member]),)


def look_plans(resolver: Resolver) -> Iterator[LookPlan]:
    """The looks of the scenario, and whether the picture shows them."""
    scenario, registers = resolver.symbols.scenario, resolver.registers
    channels = scenario.observe.channels
    for name, described in scenario.looks.items():
        path = f"looks.{name}"
        if path not in registers:
            continue
        with surviving():
            of = {key.value: registers.of_key(path, key) for key in registers.keys(path)}
            paths = tuple((number, read.path) for number, read in of.items() if isinstance(read, Read))
            yield LookPlan(name, described.words, paths, channels is None or name in channels)


def tone_of(resolver: Resolver, number: int) -> Term | None:
    """The look whose word is heard before what an NPC says; None where there is no such."""
    path, registers = f"looks.{resolver.symbols.scenario.observe.tone}", resolver.registers
    if path not in registers:
        return None
    return next((registers.of_key(path, key) for key in registers.keys(path) if key.value == number), None)


def check_tone(resolver: Resolver, name: str) -> None:
    """Report a tone that is no look, or that no NPC has."""
    looks, findings = resolver.symbols.scenario.looks, resolver.findings
    span = findings.at(("observe", "tone"), 0, len(name))
    if name not in looks:
        advice = advice_on(name, looks, "looks are declared under `looks:`")
        findings.error("S201", f"unknown look `{name}`", span, **advice)
    elif not any(tone_of(resolver, number) for number in range(1, len(resolver.symbols.numbers))):
        findings.error("S204", f"no NPC has a `{name}`, so nobody speaks in that tone", span)
