"""Verbs and functions: what the signature table promises, made into terms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.semantics import beliefs, hearing, resolve_groups, resolve_names, tables, texts
from socialai_dsl.semantics.build import all_of, any_of, arithmetic, draws, entity, number, one_of, walk
from socialai_dsl.semantics.findings import FailedError
from socialai_dsl.semantics.resolve_attributes import toggled_by, without_arguments
from socialai_dsl.semantics.resolver import ENTITY, INT, Resolver
from socialai_dsl.semantics.scope import Scope
from socialai_dsl.semantics.signatures import (
    ACTIVITIES,
    EFFECTS,
    PLACES,
    QUANTIFIERS,
    VALUE_SYNONYMS,
    VALUES,
    Signature,
)
from socialai_dsl.semantics.subjects import (
    check_moment,
    check_points,
    check_toggled,
    must_be_agent,
    subject_of,
)
from socialai_dsl.semantics.terms import (
    ACTION,
    DIRECTION,
    Compare,
    Const,
    FieldOf,
    Heard,
    HeardNoun,
    InState,
    Measure,
    Not,
    Operation,
    Sees,
    Sited,
    Speaker,
    Term,
    Test,
    Type,
    World,
)
from socialai_dsl.semantics.wording import quoted, usage, wrong_count
from socialai_dsl.vocabulary import FINISHED

_RELATIONS = (
    *("at", "next_to", "in_front_of", "faces", "faces_toward", "eye_contact", "in_line", "can_reach"),
    *("looks_at", "unobstructed"),
)
_OF_BODIES = ("in_front_of", "eye_contact")
"""Relations to something that can be turned to somewhere, which a cell is not."""


def call(resolver: Resolver, node: ast.Call, expected: Type | None, scope: Scope) -> Term:
    """`verb(...)`, `subject.verb(...)` or a definition with arguments."""
    defined = _definition(resolver, node, scope)
    if defined is not None:
        define, arguments = defined
        return resolve_names.expanded(resolver, define, arguments, node, expected, scope)
    if node.subject is None and node.name in resolver.symbols.scenario.tables:
        return tables.looked_up(resolver, node, scope)
    signature = VALUES.get(node.name)
    if signature is None:
        raise _unknown(resolver, node, scope)
    _check_count(resolver, signature, node, scope)
    if signature.subject == "none":
        return _function(resolver, node, expected, scope)
    if not signature.takes:
        return without_arguments(resolver, node.name, node.subject, node, scope)
    check_moment(resolver, signature, node, scope)
    argument = node.args[0]
    match node.name:
        case "said":
            return hearing.said(resolver, node, scope)
        case "heard":
            _listener(resolver, node, scope)
            return texts.heard(resolver, argument, scope)
        case "did":
            must_be_agent(resolver, node, scope)
            return _did(resolver, argument, scope)
        case "is":
            return _is_in_state(resolver, node, scope)
    subject = subject_of(resolver, node.subject, signature, node, scope)
    if node.name == "looks_at":
        assert subject is not None, "internal: a cell looks at nothing"
        _check_viewer(resolver, subject, node, scope)
    if node.name in _RELATIONS:
        return _relation(resolver, node.name, subject, argument, scope)
    if node.name in ("joint_attention", "points_at", "toggled_by"):
        assert subject is not None, "internal: a cell attends to nothing"
        return _attention(resolver, node.name, subject, node, scope)
    if node.name in ("sees", "would_see"):
        assert subject is not None, "internal: a cell sees nothing"
        return _sees(resolver, subject, node, scope)
    other = resolver.somewhere(argument, scope)
    assert subject is not None, "internal: only relations have the candidate cell as a subject"
    if node.name == "distance":
        (_, width), (_, height) = resolver.symbols.width, resolver.symbols.height
        return Measure(Type("int", 0, width + height), "distance", (subject, other))
    assert node.name == "dir_to", f"internal: no meaning for `{node.name}`"
    return Measure(DIRECTION, "dir_to", (subject, other))


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


def _unknown(resolver: Resolver, node: ast.Call, scope: Scope) -> FailedError:
    if node.name in ACTIVITIES or node.name in EFFECTS or node.name in PLACES:
        kind = (
            "an activity" if node.name in ACTIVITIES else "an effect" if node.name in EFFECTS else "a place"
        )
        return resolver.fail(
            "S204", f"`{node.name}` is {kind}; here a condition or value is expected", node, scope
        )
    synonym = VALUE_SYNONYMS.get(node.name)
    if synonym:
        return resolver.fail(
            "S205", f"unknown verb `{node.name}`; write `{usage(VALUES[synonym])}`", node, scope
        )
    if node.name == "permuted":
        message = "`permuted` makes a table of another table, or the colours of a group of those of another"
        hint = "`tables: {dar: permuted(words)}`, `color: permuted(doors.color)`"
        return resolver.fail("S204", message, node, scope, hint=hint)
    if node.name == "believes" and node.subject is not None:
        return resolver.fail("S211", beliefs.unnamed(quoted(node.subject)), node, scope)
    candidates = [*VALUES, *resolver.symbols.defines, *(scope.frame.defines if scope.frame else ())]
    candidates += resolver.symbols.scenario.tables if node.subject is None else ()
    near = did_you_mean(node.name, candidates)
    kind = "word" if node.subject is None else "verb"
    return resolver.fail("S205", f"unknown {kind} `{node.name}`", node, scope, suggestion=near)


def _check_count(resolver: Resolver, signature: Signature, node: ast.Call, scope: Scope) -> None:
    most = len(signature.takes)
    if most - signature.optional <= len(node.args) <= most:
        return
    raise resolver.fail("S211", wrong_count(signature, len(node.args)), node, scope)


# -- functions -------------------------------------------------------------------------------------------------


def _function(resolver: Resolver, node: ast.Call, expected: Type | None, scope: Scope) -> Term:
    if node.subject is not None:
        raise resolver.fail(
            "S211", f"`{node.name}` has nothing before it: write `{node.name}(...)`", node, scope
        )
    if node.name in QUANTIFIERS:
        if node.name not in ("pick", "first", "count"):
            usage = "d in doors to agent" if node.name == "nearest" else "d in doors where ..."
            raise resolver.fail("S211", f"write `{node.name}({usage})`", node, scope)
        return resolve_groups.pick(resolver, node, expected, scope)
    if node.name == "opposite":
        way = resolver.value(node.args[0], DIRECTION, scope)
        if isinstance(way, Const):
            return Const(DIRECTION, (way.value + 2) % 4)
        return Operation(DIRECTION, "turn", (way, number(2)))
    if node.name == "prev":
        return _before(resolver, node, expected, scope)
    args = tuple(resolver.value(argument, INT, scope) for argument in node.args)
    return resolver.computed(node.name, args, node, scope)


def _before(resolver: Resolver, node: ast.Call, expected: Type | None, scope: Scope) -> Term:
    """`prev(e)`: a register that takes the value of e when a step begins."""
    if scope.nested:
        message = "`prev` cannot stand inside any(...), pick(...) and the like; put them inside `prev`"
        raise resolver.fail("S211", message, node, scope)
    check_moment(resolver, VALUES["prev"], node, scope)
    term = resolver.value(node.args[0], expected, scope)
    if any(isinstance(part, Heard | HeardNoun | Speaker) for part in walk(term)):
        message = "what was heard is forgotten when a step ends; note it in a register of the frame"
        raise resolver.fail("S211", message, node, scope)
    if draws(term):
        message = "`prev` asks how things were, so nothing can be drawn in it"
        raise resolver.fail("S211", message, node, scope, hint="draw it in `let`, and use that")
    site = f"{scope.draws.site}.prev[{node.at}]"
    return resolver.registers.remember(Sited(term, site, resolver.findings.node(scope.path, node)))


def _listener(resolver: Resolver, node: ast.Call, scope: Scope) -> None:
    itself = node.subject is None or (
        isinstance(node.subject, ast.Name) and node.subject.id in ("self", scope.member)
    )
    if scope.frame is None or not itself:
        message = "`heard` is known to the NPC itself, in its frame; elsewhere write `agent.said(...)`"
        raise resolver.fail("S211", message, node, scope)


def _relation(resolver: Resolver, name: str, subject: Term | None, argument: ast.Expr, scope: Scope) -> Term:
    if resolve_groups.is_group(resolver, argument, scope):
        return resolve_groups.any_member(
            resolver, argument, scope, lambda other: Test(cast(Any, name), subject, other)
        )
    other = (
        resolver.value(argument, ENTITY, scope) if name in _OF_BODIES else resolver.somewhere(argument, scope)
    )
    return Test(cast(Any, name), subject, other)


def _attention(resolver: Resolver, name: str, subject: Term, node: ast.Call, scope: Scope) -> Term:
    """What two look at, what somebody points at, who toggled at something."""
    first, *rest = node.args
    if name == "toggled_by":
        check_toggled(resolver, name, subject, node, scope)
        return _toggled_by(resolver, subject, first, scope)
    if name == "points_at":
        check_points(resolver, name, subject, node, scope)
        return _each(resolver, first, scope, lambda other: _points_at(subject, other))
    other = resolver.value(first, ENTITY, scope)
    if max(subject.type.high, other.type.high) >= len(resolver.symbols.numbers):
        message = "only members of the cast attend to something together"
        at = node if subject.type.high > other.type.high else first
        hint = "`a.joint_attention(b, x)` is whether a and b both look at x"
        raise resolver.fail("S204", message, at, scope, hint=hint)

    def both_look(what: Term) -> Term:
        return all_of([Test("looks_at", subject, what), Test("looks_at", other, what)])

    if rest:
        return _each(resolver, rest[0], scope, both_look)
    numbers = range(len(resolver.symbols.numbers), resolver.symbols.entities)
    return any_of(both_look(entity(number)) for number in numbers)


def _toggled_by(resolver: Resolver, what: Term, node: ast.Expr, scope: Scope) -> Term:
    """Whether the member of the cast at `node`, whoever it is, toggled at something."""
    who = resolver.value(node, ENTITY, scope)
    if who.type.high >= len(resolver.symbols.numbers):
        raise resolver.fail("S211", "`toggled_by` takes a member of the cast", node, scope)
    if isinstance(who, Const):
        return toggled_by(who, what)
    cases = []
    for one in (Const(who.type, value) for value in range(who.type.low, who.type.high + 1)):
        cases.append(all_of([Compare("==", who, one), toggled_by(one, what)]))
    return any_of(cases)


def _points_at(subject: Term, other: Term) -> Term:
    ways = Type("int", 0, 4)
    way = arithmetic(
        "+", replace(Measure(DIRECTION, "dir_to", (subject, other)), type=Type("int", 0, 3)), number(1)
    )
    straight = (Test("in_line", subject, other), Not(Test("at", subject, other)))
    return all_of([Compare("==", FieldOf(ways, subject, "pointing"), way), *straight])


def _each(resolver: Resolver, node: ast.Expr, scope: Scope, relation: Callable[[Term], Term]) -> Term:
    """A relation to something, or to any of a group."""
    if resolve_groups.is_group(resolver, node, scope):
        return resolve_groups.any_member(resolver, node, scope, relation)
    return relation(resolver.somewhere(node, scope))


def _sees(resolver: Resolver, viewer: Term, node: ast.Call, scope: Scope) -> Term:
    """`a.sees(x)`, `a.would_see(x, direction)`; of a group, any of it."""
    _check_viewer(resolver, viewer, node, scope)
    target, *rest = node.args

    def seen(other: Term) -> Term:
        # After what is seen: picks are numbered in source order.
        return Sees(viewer, other, resolver.value(rest[0], DIRECTION, scope) if rest else None)

    return _each(resolver, target, scope, seen)


def _check_viewer(resolver: Resolver, viewer: Term, node: ast.Call, scope: Scope) -> None:
    if viewer.type.high >= len(resolver.symbols.numbers):
        message = f"only a member of the cast has a view: `agent.{node.name}(...)`"
        raise resolver.fail("S211", message, node, scope)


def _did(resolver: Resolver, argument: ast.Expr, scope: Scope) -> Term:
    action = World(ACTION, "action")
    if resolve_groups.is_group(resolver, argument, scope):
        return one_of(action, resolve_groups.group(resolver, argument, ACTION, scope).items)
    return Compare("==", action, resolver.value(argument, ACTION, scope))


def _is_in_state(resolver: Resolver, node: ast.Call, scope: Scope) -> Term:
    """`dancer.is(watching)`: the state is a bare word, looked up in the member's frame."""
    who = resolver.value(node.subject, ENTITY, scope) if node.subject is not None else None
    if who is not None and not isinstance(who, Const):
        return _is_each_in_state(resolver, who, node, scope)
    member = _member(resolver, who, node, scope)
    argument = node.args[0]
    own = scope.frame is not None and node.subject is None
    frame = scope.frame if own else resolver.frames.get(member)
    if frame is None and resolver.symbols.cast[member].frame is not None:
        raise FailedError  # an unknown frame is reported where it is named
    if frame is None:
        called = quoted(node.subject) if node.subject is not None else member
        raise resolver.fail("S310", f"`{called}` follows no frame, so it has no states", node, scope)
    states = list(frame.model.states or ())
    states += [step.state for step in frame.model.steps or () if step.state] + (
        [FINISHED] if frame.model.steps else []
    )
    if not isinstance(argument, ast.Name | ast.Truth):
        raise resolver.fail("S211", "`is` takes the name of a state", argument, scope)
    state = argument.id if isinstance(argument, ast.Name) else str(argument.value).lower()
    if state not in states:
        called = (resolver.symbols.group_of(member) or (member, 0))[0]
        message = f"`{called}` has no state `{state}` (it plays `{frame.name}`: {', '.join(states)})"
        raise resolver.fail("S310", message, argument, scope, suggestion=did_you_mean(state, states))
    return InState(member, frame.name, state)


def _is_each_in_state(resolver: Resolver, who: Term, node: ast.Call, scope: Scope) -> Term:
    """`any(p in peers where p.is(ready))`, `leader.is(ready)`: of whoever is meant."""
    members = [resolver.symbols.member_of(number) for number in range(who.type.low, who.type.high + 1)]
    named = [member for member in members if member is not None]
    if len(named) < len(members):
        raise resolver.fail("S211", "a member of the cast is needed before the dot", node, scope)
    cases = []
    for i, member in enumerate(named):
        asked = replace(node, subject=ast.Name(member, at=node.at))
        its = _is_in_state(resolver, asked, replace(scope, variables={}))
        cases.append(all_of([Compare("==", who, Const(who.type, who.type.low + i)), its]))
    return any_of(cases)


def _member(resolver: Resolver, who: Const | None, node: ast.Expr, scope: Scope) -> str:
    member = scope.member if who is None else resolver.symbols.member_of(who.value)
    if member is not None:
        return member
    raise resolver.fail("S211", "a member of the cast is needed before the dot", node, scope)
