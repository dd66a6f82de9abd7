"""Objects that lie in other objects: what contains what."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from socialai_dsl.grammar import ParseProblem, ast, parse_expression
from socialai_dsl.schema import Frame, Scenario
from socialai_dsl.schema.behaviour import Effects, Ranged
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.findings import surviving
from socialai_dsl.semantics.resolver import ENTITY, Resolver
from socialai_dsl.semantics.scope import Objects, Scope, frames_of, object_scope
from socialai_dsl.semantics.terms import FieldOf, Term, Type
from socialai_dsl.semantics.wording import quoted


def holders(resolver: Resolver) -> tuple[int, int] | None:
    """Least and greatest number of the objects that can hold others; None if there are none."""
    numbers = [
        number
        for objects in resolver.symbols.objects.values()
        if "opened" in objects.type.states
        for number in objects.numbers
    ]
    return (min(numbers), max(numbers)) if numbers else None


def inside_of(resolver: Resolver, objects: Objects, index: int, path: DataPath, raw: str) -> Term:
    """The object that another lies in at first."""
    scope = object_scope(objects, index, path, "inside", at_reset=True)
    node = resolver.findings.expression(path, raw)
    holder = resolver.value(node, ENTITY, scope)
    check_holder(resolver, holder, node, scope)
    return holder


def check_holder(resolver: Resolver, holder: Term, node: ast.Expr, scope: Scope) -> None:
    """Report what cannot hold anything."""
    for number in range(holder.type.low, holder.type.high + 1):
        objects = resolver.symbols.object_of(number)
        if objects is None or "opened" not in objects.type.states:
            able = [name for name, type_ in resolver.symbols.types.items() if "opened" in type_.states]
            message = f"nothing can lie in `{quoted(node)}`"
            raise resolver.fail(
                "S204", message, node, scope, hint="what can hold something: " + ", ".join(able)
            )


def container(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    """`x.inside`: what something lies in."""
    known = holders(resolver)
    for number in range(who.type.low, who.type.high + 1):
        objects = resolver.symbols.object_of(number)
        if objects is None or known is None or not can_lie_inside(resolver, objects):
            message = f"`{quoted(node)}`: it never lies inside anything"
            hint = "an object is put into another with `inside:`, or by the effect `x.move_into(box)`"
            raise resolver.fail("S204", message, node, scope, hint=hint)
    assert known is not None, "internal: looked at above"
    return FieldOf(Type("entity", *known), who, "inside")


def can_lie_inside(resolver: Resolver, objects: Objects) -> bool:
    """Whether objects of this name ever lie in others: at first, or because an effect moves them there."""
    scenario = resolver.symbols.scenario
    return scenario.objects[objects.name].inside is not None or objects.name in resolver.moved_inside


def moved_inside(scenario: Scenario) -> set[str]:
    """All names in what is moved into something, and in what these names stand for."""
    subjects = [
        node.subject
        for effect in _effects(scenario)
        for node in _nodes(effect)
        if isinstance(node, ast.Call) and node.name == "move_into" and node.subject is not None
    ]
    waiting = [node.id for subject in subjects for node in subject.walk() if isinstance(node, ast.Name)]
    sources, found = _sources(scenario), set[str]()
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            nodes = (node for source in sources.get(name, ()) for node in _nodes(source))
            waiting += [node.id for node in nodes if isinstance(node, ast.Name)]
    return found


def _nodes(source: object) -> list[ast.Node]:
    """The nodes of an expression; none of what is not one, which is reported elsewhere."""
    try:
        return list(parse_expression(str(source)).walk())
    except ParseProblem:
        return []


def _sources(scenario: Scenario) -> dict[str, list[object]]:
    """Name -> the expressions that it may stand for: lets, definitions, registers with what they are set to, slots."""
    found: dict[str, list[object]] = {}
    declared: list[Mapping[str, object]] = [scenario.let, scenario.define]
    declared += [member.with_ for name in scenario.cast for member in scenario.alternatives(name)]
    for _, frame in frames_of(scenario):
        declared += [frame.let, frame.define, *(entry.set for entry in _entries(frame))]
    for mapping in declared:
        for name, source in mapping.items():
            value = source.start if isinstance(source, Ranged) else source
            found.setdefault(name.partition("(")[0].strip(), []).append(value)
    return found


def _entries(frame: Frame) -> Iterator[Effects]:
    """Every rule and step of a frame."""
    yield from frame.steps or ()
    for state in (frame.states or {}).values():
        yield from (*state.first, *state.then)


def _effects(scenario: Scenario) -> Iterator[object]:
    """Every effect as it is written."""
    for rule in scenario.rules:
        yield from rule.cause
    for _, frame in frames_of(scenario):
        for entry in _entries(frame):
            yield from entry.cause


def contained(resolver: Resolver) -> dict[int, tuple[int, ...]]:
    """Object that can hold others -> what may ever lie in it."""
    contents = tuple(
        number
        for objects in resolver.symbols.objects.values()
        if can_lie_inside(resolver, objects)
        for number in objects.numbers
    )
    found: dict[int, tuple[int, ...]] = {}
    for objects in resolver.symbols.objects.values():
        if contents and "opened" in objects.type.states:
            with surviving():
                found |= {number: tuple(c for c in contents if c != number) for number in objects.numbers}
    return found
