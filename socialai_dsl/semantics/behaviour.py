"""Frames as their members play them: every rule and step with its values resolved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.schema import FirstRule, Rule, State, Step, ThenRule
from socialai_dsl.schema.behaviour import Effects
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics import texts
from socialai_dsl.semantics.activities import activity, effect
from socialai_dsl.semantics.build import all_of, any_of
from socialai_dsl.semantics.findings import FailedError, dotted, surviving
from socialai_dsl.semantics.hearing import Alternative, asks_for_noun, binding, bound, with_nouns
from socialai_dsl.semantics.plans import Activity, Effect, FramePlan, RulePlan, StatePlan, StepPlan
from socialai_dsl.semantics.resolver import INT, Resolver
from socialai_dsl.semantics.scope import Draws, PlayedFrame, Scope
from socialai_dsl.semantics.signatures import ACTIVITIES
from socialai_dsl.semantics.terms import BOOL, Compare, Const, Heard, Line, Read, Sited, Term, Type

_FOR_EVER = -1

ANYTHING = "any"
"""`hears: any` is whatever anybody says."""


@dataclass(frozen=True)
class Spoken:
    """The `say:` of a frame, by the path of the rule or step."""

    lines: dict[DataPath, Line] = field(default_factory=dict)


def entries(played: PlayedFrame) -> Iterator[tuple[DataPath, str, Effects]]:
    """Every rule and step of a frame in reading order: its path, its address and itself."""
    base, address = played.path, dotted(played.address)
    for name, state in (played.model.states or {}).items():
        for part, rules in (("first", state.first), ("then", state.then)):
            for i, rule in enumerate(rules):
                yield (
                    (*base, "states", name, part, i),
                    f"{address}.states.{name}.{part}[{rule.id or i}]",
                    rule,
                )
    for i, step in enumerate(played.model.steps or ()):
        yield (*base, "steps", i), f"{address}.steps[{step.state or i}]", step


def lines_of(resolver: Resolver, played: PlayedFrame) -> Spoken:
    """What a member says in its frame; resolved first, so that others can hear it."""
    spoken = Spoken()
    for path, address, entry in entries(played):
        if entry.say is not None:
            with surviving():
                hearing = isinstance(entry, Rule) and bool(entry.hears)
                scope = replace(_scope(played, (*path, "say"), f"{address}.say"), hearing=hearing)
                spoken.lines[path] = texts.line(resolver, (*path, "say"), entry.say, scope)
    return spoken


def _scope(played: PlayedFrame, path: DataPath, address: str) -> Scope:
    return Scope(path, Draws(f"{played.member}/{address}"), member=played.member, frame=played)


def plan(resolver: Resolver, played: PlayedFrame, spoken: Spoken) -> FramePlan:
    """The whole frame of one member."""
    frame = played.model
    span = resolver.findings.places.key_span(played.path)
    addresses = {path: address for path, address, _ in entries(played)}
    planner = _Planner(resolver, played, spoken, addresses)
    states = tuple(planner.state(name, state) for name, state in (frame.states or {}).items())
    steps = tuple(planner.step(i, step) for i, step in enumerate(frame.steps or ()))
    start = (frame.start or next(iter(frame.states), "")) if frame.states else ""
    return FramePlan(played.member, played.name, played.number, span, start, states, steps)


def assigned(resolver: Resolver, register: str, raw: object, path: DataPath, scope: Scope) -> Sited:
    """The value that a register is set to; it makes room for it."""
    known = resolver.registers.read(register)
    expected = INT if known.type.kind == "int" and not known.type.words else known.type
    term = resolver.written(path, raw, expected, scope)  # type: ignore[arg-type]
    resolver.registers.widen(register, term.type)
    return Sited(term, scope.draws.site, resolver.findings.at(path))


@dataclass(frozen=True)
class _Planner:
    """Makes the plans of one frame as one member plays it."""

    resolver: Resolver
    played: PlayedFrame
    spoken: Spoken
    addresses: dict[DataPath, str]
    hearing: bool = False

    def _scope(self, path: DataPath, address: str) -> Scope:
        return replace(_scope(self.played, path, address), hearing=self.hearing)

    def state(self, name: str, state: State) -> StatePlan:
        path = (*self.played.path, "states", name)
        first = self._rules(state.first, (*path, "first"), name)
        address = dotted((*self.played.address, "states", name))
        doing = self._activity((*path, "do"), state.do, address) or self._staying(path)
        then = self._rules(state.then, (*path, "then"), name)
        return StatePlan(name, first, doing, then, self.resolver.findings.places.key_span(path))

    def _rules(self, rules: Sequence[ThenRule], path: DataPath, state: str) -> tuple[RulePlan, ...]:
        plans = []
        for i, rule in enumerate(rules):
            with surviving():
                planner = replace(self, hearing=bool(rule.hears))
                plans.append(planner._rule(rule, (*path, i), f"{state}.{path[-1]}[{i}]"))
        return tuple(plans)

    def _rule(self, rule: ThenRule, path: DataPath, place: str) -> RulePlan:
        address = self.addresses[path]
        heard = self._hears(rule, path, address)
        when = self._condition((*path, "when"), rule.when, address)
        do = rule.do if isinstance(rule, FirstRule) else None
        doing = self._activity((*path, "do"), do, address) if do is not None else None
        sets, causes = self._sets(rule, path, address), self._causes(rule, path, address)
        say = self.spoken.lines.get(path)
        if asks_for_noun((when, doing, sets, causes, say)):
            heard = with_nouns(self.resolver, heard, self.resolver.findings.at((*path, "hears")))
        patterns = tuple(pattern for alternative in heard for pattern, _ in alternative)
        compared = any(condition is not None for alternative in heard for _, condition in alternative)
        if compared:
            term = any_of(
                all_of([Heard((pattern,)), *([condition] if condition is not None else [])])
                for alternative in heard
                for pattern, condition in alternative
            )
            span = self.resolver.findings.at((*path, "hears"))
            both = term if when is None else all_of([term, when.term])
            when = Sited(both, f"{self.played.member}/{address}.when", when.span if when else span)
        after, when = self._after(rule, path, when, address)
        plan = RulePlan(
            name=rule.id or f"{self.played.member}.{self.played.name}.{place}",
            site=f"{self.played.member}/{address}",
            span=self.resolver.findings.places.value_span(path),
            hears=() if compared else patterns,
            when=when,
            after=after,
            chance=rule.chance,
            once=rule.once,
            do=doing,
            sets=sets,
            causes=causes,
            say=say,
            goto=self._target(rule.goto, (*path, "goto")),
            goto_now=self._target(rule.goto_now, (*path, "goto_now")),
        )
        if patterns:
            self.resolver.readings.change(f"{plan.site}.when", binding(heard))
        self.resolver.readings.entries[plan.site] = rule
        return bound(plan, heard)

    def _hears(self, rule: Rule, path: DataPath, address: str) -> list[Alternative]:
        """What `hears:` waits for: the patterns of each of its texts."""
        found: list[Alternative] = []
        resolver = self.resolver
        single = not self.resolver.findings.is_list((*path, "hears"))
        for i, raw in enumerate(rule.hears):
            place: DataPath = (*path, "hears") if single else (*path, "hears", i)
            if raw == ANYTHING:
                found.append([(resolver.utterances.anything(), None)])
                continue
            with surviving():
                text = resolver.findings.text(place, raw)
                scope = _scope(self.played, place, f"{address}.hears")
                found.append(texts.patterns(resolver, text, scope, resolver.findings.at(place), True))
        return found

    def _after(
        self, rule: Rule, path: DataPath, when: Sited | None, address: str
    ) -> tuple[int, Sited | None]:
        """From which turn on a rule holds; a number that is drawn becomes a condition on the clock."""
        place = (*path, "after")
        if rule.after is None:
            return 0, when
        resolver = self.resolver
        term: Term = Const(INT, 0)
        with surviving():
            term = resolver.written(place, rule.after, INT, self._scope(place, f"{address}.after"))
        if isinstance(term, Const):
            if term.value < 0:
                resolver.findings.error(
                    "S106", "`after` is a number of turns, at least 0", resolver.findings.at(place)
                )
            return max(0, term.value), when
        clock = Read(Type("int", 0, resolver.symbols.scenario.horizon), f"{self.played.member}.clock")
        late = Compare("<=", term, clock)
        if when is None:
            return 0, Sited(late, f"{self.played.member}/{address}.after", resolver.findings.at(place))
        return 0, Sited(all_of([late, when.term]), when.site, when.span)

    def _condition(self, path: DataPath, raw: object, address: str) -> Sited | None:
        if raw is None:
            return None
        scope = self._scope(path, f"{address}.{path[-1]}")
        with surviving():
            term = self.resolver.written(path, raw, BOOL, scope)  # type: ignore[arg-type]
            return Sited(term, scope.draws.site, self.resolver.findings.at(path))
        return None

    def _activity(self, path: DataPath, raw: str | None, address: str) -> Activity | None:
        """The activity; None if it means nothing, which has been reported."""
        with surviving():
            return activity(self.resolver, path, raw, self._scope(path, f"{address}.do"))
        return None

    def _staying(self, path: DataPath) -> Activity:
        return Activity("stay", (), "", self.resolver.findings.at(path))

    def _sets(self, entry: Effects, path: DataPath, address: str) -> tuple[tuple[str, Sited], ...]:
        made = []
        for name, raw in entry.set.items():
            place = (*path, "set", name)
            with surviving():
                register = self._register(name, place)
                scope = self._scope(place, f"{address}.set.{name}")
                made.append((register, assigned(self.resolver, register, raw, place, scope)))
        return tuple(made)

    def _register(self, name: str, path: DataPath) -> str:
        """The register of the frame, or of the world, that an effect sets."""
        if name in self.played.model.let:
            return self.played.register(name)
        if name in self.resolver.symbols.scenario.state:
            return f"state.{name}"
        raise self._no_register(name, path)

    def _no_register(self, name: str, path: DataPath) -> FailedError:
        findings, symbols = self.resolver.findings, self.resolver.symbols
        span = findings.places.key_span(path)
        if name in symbols.scenario.let or name in self.played.model.slots:
            what = "is a slot" if name in self.played.model.slots else "is drawn once per episode"
            cure = "only what the frame declares in its own `let`, or the scenario in `state`, can be set"
            return findings.fail("S305", f"`{name}` {what} and cannot be set", span, hint=cure)
        near = did_you_mean(name, [*self.played.model.let, *symbols.scenario.state])
        hint = None if near else f"declare it: `let: {{{name}: 0}}` in the frame"
        return findings.fail(
            "S305", f"`{name}` is not declared in this frame's `let`", span, suggestion=near, hint=hint
        )

    def _causes(self, entry: Effects, path: DataPath, address: str) -> tuple[Effect, ...]:
        made = []
        single = not self.resolver.findings.is_list((*path, "cause"))
        for i, raw in enumerate(entry.cause):
            place: DataPath = (*path, "cause") if single else (*path, "cause", i)
            with surviving():
                made.append(effect(self.resolver, place, raw, self._scope(place, f"{address}.cause[{i}]")))
        return tuple(made)

    def _target(self, target: str | None, path: DataPath) -> str | None:
        states = self.played.model.states or {}
        if target is not None and target not in states:
            findings = self.resolver.findings
            near = did_you_mean(target, states)
            message = f"no state `{target}` in frame `{self.played.name}`"
            hint = None if near else "its states are " + ", ".join(states)
            findings.error("S301", message, findings.at(path, 0, len(target)), suggestion=near, hint=hint)
        return target

    def step(self, index: int, step: Step) -> StepPlan:
        path = (*self.played.path, "steps", index)
        address = self.addresses[path]
        doing = self._activity((*path, "do"), step.do, address)
        name = f"{self.played.member}.{self.played.name}.steps[{index}]"
        self.resolver.readings.entries[name] = step
        duration, lasted = self._duration((*path, "for"), step.for_, f"{address}.for")
        head = (step.do or "").partition("(")[0].strip()
        endless = doing is not None and any(
            name in ACTIVITIES and ACTIVITIES[name].endless for name in (doing.name, head)
        )
        if step.do is not None and step.until is None and step.for_ is None and endless:
            findings = self.resolver.findings
            message = f"`{step.do}` never ends by itself: add `until:` or `for:`"
            findings.error("S304", message, findings.at((*path, "do"), 0, len(step.do)))
        return StepPlan(
            name=name,
            state=step.state,
            activity=doing or self._staying(path),
            span=self.resolver.findings.places.value_span(path),
            until=self._condition((*path, "until"), step.until, address),
            duration=duration,
            lasted=lasted,
            sets=self._sets(step, path, address),
            causes=self._causes(step, path, address),
            say=self.spoken.lines.get(path),
        )

    def _duration(self, path: DataPath, raw: object, site: str) -> tuple[int | None, Sited | None]:
        """For how many turns an entry lasts; a number that is not known becomes a condition on the clock."""
        if raw is None:
            return None, None
        if raw == "ever":
            return _FOR_EVER, None
        findings, horizon = self.resolver.findings, self.resolver.symbols.scenario.horizon
        try:
            term = self.resolver.written(path, raw, INT, self._scope(path, site))  # type: ignore[arg-type]
        except FailedError:
            return None, None
        if isinstance(term, Const):
            if 0 <= term.value <= horizon:
                return term.value, None
            message = f"`for` is a number of turns within the horizon, 0 to {horizon}, or `ever`"
            findings.error("S106", message, findings.at(path))
            return None, None
        if term.type.low < 1:
            message = (
                f"`for` can be {term.type.low} here; a number that is not known beforehand is at least 1"
            )
            findings.error("S106", message, findings.at(path), hint=f"write `max(1, {raw})`")
            return None, None
        clock = Read(Type("int", 0, horizon), f"{self.played.member}.clock")
        lasted = Compare("<=", term, clock)
        return None, Sited(lasted, f"{self.played.member}/{site}", findings.at(path))
