"""What belongs to nobody's frame: rules of the world, and what a drawn room has to be like."""

from __future__ import annotations

from collections.abc import Iterator

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.schema import WorldRule
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.activities import effect
from socialai_dsl.semantics.behaviour import assigned
from socialai_dsl.semantics.build import draws
from socialai_dsl.semantics.findings import FailedError, dotted, surviving
from socialai_dsl.semantics.plans import Effect, RulePlan
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import Scope, at_every_step, reset_scope
from socialai_dsl.semantics.terms import BOOL, Sited

_DOES = ("cause", "set", "reward")
"""Keys of a rule of the world that say what it does."""


def rules(resolver: Resolver) -> Iterator[RulePlan]:
    """The rules of the world, in the order written."""
    for i, rule in enumerate(resolver.symbols.scenario.rules):
        yield _rule(resolver, rule, ("rules", i))


def _rule(resolver: Resolver, rule: WorldRule, path: DataPath) -> RulePlan:
    name = f"rules[{rule.id}]" if rule.id else dotted(path)
    span = resolver.findings.places.value_span(path)
    # One of them that was written wrongly, which has been reported, still stands in the file.
    written = any(resolver.findings.places.value_span((*path, key)) != span for key in _DOES)
    if not (rule.cause or rule.set or rule.reward or written):
        resolver.findings.error(
            "S105", "a rule of the world needs `cause`, `set` or `reward`: what it does", span
        )
    when: Sited | None = None
    with surviving():
        if rule.when is not None:
            scope = _scope((*path, "when"), f"{name}.when")
            term = resolver.written((*path, "when"), rule.when, BOOL, scope)
            when = Sited(term, scope.draws.site, resolver.findings.at((*path, "when")))
    resolver.readings.entries[name] = rule
    return RulePlan(
        name=rule.id or name,
        site=name,
        span=span,
        when=when,
        chance=rule.chance,
        once=rule.once,
        sets=tuple(_sets(resolver, rule, (*path, "set"), name)),
        reward=rule.reward,
        causes=tuple(_effects(resolver, rule, (*path, "cause"), name)),
    )


def _sets(resolver: Resolver, rule: WorldRule, path: DataPath, name: str) -> Iterator[tuple[str, Sited]]:
    """The registers of the world that a rule sets."""
    known = resolver.symbols.scenario.state
    for word, raw in rule.set.items():
        place = (*path, word)
        with surviving():
            if word not in known:
                raise _not_of_the_world(resolver, word, place)
            register = f"state.{word}"
            yield register, assigned(resolver, register, raw, place, _scope(place, f"{name}.set.{word}"))


def _not_of_the_world(resolver: Resolver, word: str, path: DataPath) -> FailedError:
    """Rules of the world set registers of `state`, and nothing else."""
    scenario, span = resolver.symbols.scenario, resolver.findings.places.key_span(path)
    frame = next((name for name, frame in scenario.frames.items() if word in frame.let), None)
    cure = "a rule of the world sets what is declared in `state`"
    if word in scenario.let:
        message = f"`{word}` is drawn once per episode and cannot be set"
        return resolver.findings.fail("S305", message, span, hint=cure)
    if frame is not None:
        message = f"`{word}` is a register of the frame `{frame}`, which only the frame itself sets"
        return resolver.findings.fail("S305", message, span, hint=cure)
    near = did_you_mean(word, scenario.state)
    hint = None if near or word in resolver.symbols.declared else f"declare it: `state: {{{word}: 0}}`"
    message = f"`{word}` is not declared in `state`"
    return resolver.findings.fail("S305", message, span, suggestion=near, hint=hint)


def _scope(path: DataPath, site: str) -> Scope:
    return at_every_step(reset_scope(path, site))


def _effects(resolver: Resolver, rule: WorldRule, path: DataPath, name: str) -> Iterator[Effect]:
    single = not resolver.findings.is_list(path)
    for i, raw in enumerate(rule.cause):
        place = path if single else (*path, i)
        with surviving():
            yield effect(resolver, place, raw, _scope(place, f"{name}.cause[{i}]"))


def requirements(resolver: Resolver) -> Iterator[Sited]:
    """The conditions on a drawn room."""
    for i, raw in enumerate(resolver.symbols.scenario.require):
        path: DataPath = ("require", i)
        with surviving():
            scope = reset_scope(path)
            term = resolver.written(path, raw, BOOL, scope)
            if draws(term):
                message = "a condition on the room draws nothing itself"
                hint = "draw it in `let`, and use that"
                raise resolver.findings.fail("S204", message, resolver.findings.at(path), hint=hint)
            yield Sited(term, scope.draws.site, resolver.findings.at(path))
