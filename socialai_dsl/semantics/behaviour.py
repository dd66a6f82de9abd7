"""Frames as their members follow them, and rules of the world: every rule, activity and effect resolved."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

from socialai_dsl import cures
from socialai_dsl.diagnostics import advice_on, did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import parse_expression
from socialai_dsl.schema.annotations import conditions_of, keys_of
from socialai_dsl.schema.holds import Means
from socialai_dsl.schema.scenario import DOES, Effects, FirstRule, Rule, State, Step, ThenRule, WorldRule
from socialai_dsl.semantics import abilities, addressing, groups, rows, seats, texts, those
from socialai_dsl.semantics.cast import AGENT
from socialai_dsl.semantics.nesting import NestedPlanner
from socialai_dsl.semantics.plans import (
    FOR_EVER,
    Activity,
    Assignment,
    Effect,
    FramePlan,
    RulePlan,
    StatePlan,
    StepPlan,
)
from socialai_dsl.semantics.resolve_names import single
from socialai_dsl.semantics.resolver import ENTITY, INT, Resolver
from socialai_dsl.semantics.scope import (
    KEY,
    Draws,
    PlayedFrame,
    ReportedError,
    Scalar,
    Scope,
    described,
    dotted,
    quoted,
    reset_scope,
    step_scope,
    surviving,
    usage,
    wrong_count,
)
from socialai_dsl.semantics.terms import (
    BOOL,
    CELL,
    Compare,
    Const,
    Line,
    Read,
    ReadEach,
    SitedTerm,
    Term,
    Type,
    all_of,
    changed,
    entity,
)
from socialai_dsl.semantics.texts import Alternative, asked_of_heard, binding, on_hearing, with_slots
from socialai_dsl.semantics.words import ACTIVITIES, EFFECTS, SYNONYMS
from socialai_dsl.semantics.words.activities import Doing
from socialai_dsl.semantics.words.effects import Caused
from socialai_dsl.source import DataPath
from socialai_dsl.widths import LARGEST_NUMBER


def activity(resolver: Resolver, path: DataPath, raw: str | None, scope: Scope) -> Activity:
    """The body action of a state, step or rule; without one it stays."""
    span = resolver.findings.at(path)
    site = scope.draws.site
    if raw is None:
        return Activity("stay", (), site, span)
    node = resolver.findings.expression(path, raw)
    name, args = _head(resolver, node, scope)
    word = ACTIVITIES.get(name)
    if word is None:
        raise _unknown(resolver, name, args, node, scope)
    if len(args) != len(word.takes):
        hint = None
        # What does with something what this body action does with what is ahead.
        meant = next(
            (other for other in ACTIVITIES.values() if other.act == name and len(other.takes) == 1), None
        )
        if meant is not None and len(args) == 1:
            hint = resolver.instead(f"{meant.name}({quoted(args[0])})", node, scope, "which goes there, too")
        raise resolver.fail("S211", wrong_count(word, len(args)), node, scope, hint=hint)
    own = scope.member == AGENT and not (scope.frame is not None and scope.frame.looked_at)
    if word.arm is not None and own:
        raise resolver.fail("S204", "the agent cannot point; only NPCs do", node, scope)
    found = word.meaning(Doing(resolver, word, node, args, path, scope))
    if own:
        abilities.check_actions(resolver, found, word, node, scope)
    return found


def _head(resolver: Resolver, node: ast.Expr, scope: Scope) -> tuple[str, tuple[ast.Expr, ...]]:
    match node:
        case ast.Name(id=name):
            return name, ()
        case ast.Call(name=name, args=args, subject=None):
            return name, args
    hint = "activities are " + ", ".join(ACTIVITIES)
    if isinstance(node, ast.Conditional):
        when = quoted(node.condition)
        hint = (
            f"what it is about can depend, `go_to(a if c else b)`; else `first: [{{when: {when}, do: ...}}]`"
        )
    raise resolver.fail("S205", f"`{quoted(node)}` is not an activity", node, scope, hint=hint)


def _unknown(
    resolver: Resolver, name: str, args: tuple[ast.Expr, ...], node: ast.Expr, scope: Scope
) -> ReportedError:
    given = f"({', '.join(map(quoted, args))})" if args else ""
    synonym = SYNONYMS.get(name)
    if synonym:
        takes = ACTIVITIES[synonym].takes
        purpose = {"use": "which toggles it", "enter": "which goes through it"}.get(synonym, "")
        if len(takes) != len(args):
            hint: cures.Hint = f"write `{usage(ACTIVITIES[synonym])}`"
        else:
            hint = resolver.instead(synonym + given, node, scope, purpose)
        return resolver.fail("S205", f"unknown activity `{name}`", node, scope, hint=hint)
    advice = advice_on(name, ACTIVITIES, "activities are " + ", ".join(ACTIVITIES))
    return resolver.fail("S205", f"unknown activity `{name}`", node, scope, **advice)


def effects(resolver: Resolver, path: DataPath, raw: object, scope: Scope) -> Iterator[Effect]:
    """One entry of `cause:`; of `those(...)` perhaps an effect for each."""
    node = resolver.findings.expression(path, cast(Any, raw))
    match node:
        case ast.Attribute(subject=subject, name=name):
            args: tuple[ast.Expr, ...] = ()
        case ast.Call(subject=subject, name=name, args=args) if subject is not None:
            pass
        case ast.Name(id=name) | ast.Call(name=name) if name in EFFECTS:
            example = f"self.{name}" if EFFECTS[name].subject == "entity" else f"door.{name}"
            raise resolver.fail("S211", f"`{name}` needs what it is about: `{example}`", node, scope)
        case _:
            message = f"`{quoted(node)}` is not an effect"
            raise resolver.fail(
                "S205", message, node, scope, hint="effects are x.open, x.close, x.vanish, ..."
            )
    word = EFFECTS.get(name)
    if word is None:
        advice = advice_on(name, EFFECTS, "effects are " + ", ".join(EFFECTS))
        raise resolver.fail("S205", f"unknown effect `{name}`", node, scope, **advice)
    if len(args) != len(word.takes):
        raise resolver.fail("S211", wrong_count(word, len(args)), node, scope)

    def effect(entities: tuple[Term, ...], scope: Scope) -> Effect:
        value = word.meaning(Caused(resolver, word, node, subject, entities, args, scope))
        return Effect(cast(Any, name), entities, resolver.findings.at(path), value, scope.draws.site)

    if (which := those.found(subject)) is None:
        yield effect(_entities(resolver, subject, scope), scope)
        return
    for chosen, inner, each in those.affected(resolver, which, args, scope):
        entities = _things([one.item for one in chosen], which.group, resolver, scope)
        only = tuple(one.condition for one in chosen)
        yield replace(effect(entities, inner), only=only, each=each)


def _entities(resolver: Resolver, node: ast.Expr, scope: Scope) -> tuple[Term, ...]:
    """What an effect is about: one thing, a group, or all `objects`."""
    if isinstance(node, ast.Name) and node.id == "objects":
        first, last = len(resolver.symbols.numbers), resolver.symbols.entities
        return tuple(map(entity, range(first, last)))
    if not groups.is_group(resolver, node, scope):
        return (resolver.value(node, ENTITY, scope),)
    members = groups.group(resolver, node, None, scope)
    return _things(members.items, node, resolver, scope, members.type)


def _things(
    items: Sequence[Const], node: ast.Expr, resolver: Resolver, scope: Scope, type_: Type | None = None
) -> tuple[Term, ...]:
    """The members of a group at `node`, which are things."""
    type_ = type_ or (items[0].type if items else CELL)
    if type_.kind != "entity":
        message = f"`{quoted(node)}` is {described(type_)}, but {described(ENTITY)} is expected here"
        raise resolver.fail("S204", message, node, scope)
    return tuple(items)


# -- frames --------------------------------------------------------------------------------------------------


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
    for path, step in played.model.entries():
        yield (*base, *path), f"{address}.{dotted(path[:-1])}[{step.state or path[-1]}]", step


def lines_of(resolver: Resolver, played: PlayedFrame) -> dict[DataPath, Line]:
    """The lines of a member in its frame, by rule or step; resolved first, so that others can hear them."""
    lines: dict[DataPath, Line] = {}
    for path, address, entry in entries(played):
        if entry.say is not None:
            with surviving():
                hearing = isinstance(entry, Rule) and bool(entry.hears)
                scope = replace(_scope(played, (*path, "say"), f"{address}.say"), hearing=hearing)
                line = texts.line(resolver, (*path, "say"), entry.say, scope)
                if entry.to is not None:
                    own = scope.at((*path, "to"), f"{scope.draws.site.removesuffix('.say')}.to")
                    line = addressing.addressed(resolver, line, entry.to, own)
                lines[path] = line
        elif entry.to is not None:
            span = resolver.findings.places.key_span((*path, "to"))
            resolver.findings.error("S105", "`to` needs `say`: what is said to them", span)
    return lines


def _scope(played: PlayedFrame, path: DataPath, address: str) -> Scope:
    return Scope(path, Draws(f"{played.member}/{address}"), member=played.member, frame=played)


def plan(resolver: Resolver, played: PlayedFrame, lines: Mapping[DataPath, Line]) -> FramePlan:
    """The whole frame of one member; `lines` are those of `lines_of`."""
    frame = played.model
    span = resolver.findings.places.key_span(played.path)
    addresses = {path: address for path, address, _ in entries(played)}
    planner = _Planner(resolver, played, lines, addresses)
    states = tuple(planner.state(name, state) for name, state in (frame.states or {}).items())
    steps = tuple(planner.step(path, step) for path, step in frame.entries())
    start = (frame.start or next(iter(frame.states), "")) if frame.states else ""
    has_nested = any(step.steps is not None for step in frame.steps or ())
    nested = NestedPlanner(resolver, played, planner.condition, steps).plan() if has_nested else None
    return FramePlan(played.member, played.name, played.number, span, start, states, steps, nesting=nested)


@dataclass(frozen=True)
class _Deeds:
    """What a rule or step sets and causes.

    Attributes:
        scope: the scope of the value at a path, by its address below that of the rule.
        register: the path of the register that a name stands for, by where the name is written.
    """

    resolver: Resolver
    scope: Callable[[DataPath, str], Scope]
    register: Callable[[DataPath, str], str]

    def sets(self, entry: Effects | WorldRule, path: DataPath) -> tuple[Assignment, ...]:
        """What registers are set to."""
        made: list[Assignment] = []
        for key, raw in entry.set.items():
            with surviving():
                made += self._assigned(key, raw, self.scope((*path, "set", key), f"set.{key}"))
        return tuple(made)

    def _assigned(self, key: str, raw: Scalar, scope: Scope) -> Iterator[Assignment]:
        """What a register is set to, for which it makes room.

        It is written as a name, or with whose register is meant, `trust(speaker)`, or those of a group, `trust(peers)`;
        a look as `ann.mood`, or in a frame `mood`.
        """
        resolver = self.resolver
        own = scope.at((*scope.path, KEY), f"{scope.draws.site}.key")
        node = resolver.findings.expression(own.path, key)
        look = _look_named(resolver, node, own)
        register = (
            self.register(scope.path, key.partition("(")[0].strip()) if look is None else f"looks.{look}"
        )
        if register not in resolver.registers:
            raise ReportedError  # its group means nothing, which has been reported
        if isinstance(node, ast.Call) and len(node.args) == 1 and those.found(node.args[0]):
            yield from those.assigned(resolver, register, node, raw, scope, own)
            return
        value = texts.value_for(resolver, register, raw, scope)
        targets: list[Term] = []
        if look is not None:
            targets += rows.looks(resolver, look, node, own)
        elif isinstance(node, ast.Call):
            targets += rows.of_keys(resolver, register, node, own)
        else:
            targets.append(single(resolver, register, None, node, own))
        for target in targets:
            if isinstance(target, ReadEach):
                yield Assignment(register, value, target, own.draws.site)
            elif isinstance(target, Read):
                yield Assignment(target.path, value)

    def causes(self, entry: Effects | WorldRule, path: DataPath) -> tuple[Effect, ...]:
        """The effects, in order."""
        made: list[Effect] = []
        for i, (place, raw) in enumerate(self.resolver.findings.each((*path, "cause"), entry.cause)):
            with surviving():
                made += effects(self.resolver, place, raw, self.scope(place, f"cause[{i}]"))
        return tuple(made)


def _look_named(resolver: Resolver, node: ast.Expr, scope: Scope) -> str | None:
    """The look that is set: `ann.mood`, or in a frame `mood`; None if the name is not that of a look."""
    looks = resolver.symbols.scenario.looks
    if isinstance(node, ast.Attribute) and node.name not in looks:
        advice = advice_on(node.name, looks, "what is set before a dot is a look, declared under `looks:`")
        raise resolver.fail("S205", f"nothing here has a `{node.name}`", node, scope, **advice)
    name = node.name if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""
    return name if name in looks else None


@dataclass(frozen=True)
class _Planner:
    """Makes the plans of one frame as one member plays it."""

    resolver: Resolver
    played: PlayedFrame
    lines: Mapping[DataPath, Line]
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
        when = self.condition((*path, "when"), rule.when, address)
        do = rule.do if isinstance(rule, FirstRule) else None
        doing = self._activity((*path, "do"), do, address) if do is not None else None
        deeds = self._deeds(address)
        sets, causes = deeds.sets(rule, path), deeds.causes(rule, path)
        say = self.lines.get(path)
        if asked := asked_of_heard((when, doing, sets, causes, say)):
            heard = with_slots(self.resolver, heard, asked, self.resolver.findings.at((*path, "hears")))
        patterns = tuple(pattern for alternative in heard for pattern, _ in alternative)
        compared = any(condition is not None for alternative in heard for _, condition in alternative)
        if compared:
            span = self.resolver.findings.at((*path, "hears"))
            when = on_hearing(heard, when, f"{self.played.member}/{address}.when", span)
        after = self._after(rule, path, address)
        for key, means in conditions_of(type(rule)).items():
            if getattr(rule, key) is not None and (key != "after" or after is None):
                with surviving():
                    when = self._also(means, (*path, key), getattr(rule, key), when, address)
        plan = RulePlan(
            name=rule.id or f"{self.played.member}.{self.played.name}.{place}",
            site=f"{self.played.member}/{address}",
            span=self.resolver.findings.places.value_span(path),
            hears=() if compared else patterns,
            when=when,
            after=after or 0,
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
        bound: RulePlan = changed(plan, binding(heard))
        return bound

    def _hears(self, rule: Rule, path: DataPath, address: str) -> list[Alternative]:
        """What `hears:` waits for: the patterns of each of its texts."""
        found: list[Alternative] = []
        for place, raw in self.resolver.findings.each((*path, "hears"), rule.hears):
            with surviving():
                scope = _scope(self.played, place, f"{address}.hears")
                found.append(texts.heard_at(self.resolver, raw, scope))
        if rule.addressed is not None:
            return addressing.only(self.resolver, found, rule, path)
        return found

    def _after(self, rule: Rule, path: DataPath, address: str) -> int | None:
        """From which turn on a rule holds, if that is known; it is then asked before anything else."""
        place = (*path, "after")
        if rule.after is None:
            return None
        resolver = self.resolver
        term: Term = Const(INT, 0)
        with surviving():
            term = resolver.written(rule.after, INT, self._scope(place, f"{address}.after"))
        if not isinstance(term, Const):
            return None
        if term.value < 0:
            resolver.findings.error(
                "S106", "`after` is a number of turns, at least 0", resolver.findings.at(place)
            )
        elif term.value > LARGEST_NUMBER:
            resolver.findings.too_large("`after`", term.value, resolver.findings.at(place))
        return max(0, term.value)

    def _also(
        self, means: Means, path: DataPath, raw: Scalar, when: SitedTerm | None, address: str
    ) -> SitedTerm:
        """What a key at a path asks for, and `when`."""
        resolver, key = self.resolver, str(path[-1])
        # What is wrong with the value is reported at its own place.
        resolver.written(raw, INT, self._scope(path, f"{address}.{key}"))
        value = resolver.findings.expression(path, raw)

        def filled(node: ast.Expr) -> ast.Expr:
            is_key = isinstance(node, ast.Name) and node.id == key
            return value if is_key else ast.rebuilt(node, filled)

        scope = self._scope(path, f"{address}.{key}")
        term = resolver.value(filled(parse_expression(means.condition)), BOOL, scope)
        if when is None:
            return SitedTerm(term, scope.draws.site, resolver.findings.at(path))
        resolver.readings.join(when.site, scope.draws.site)
        return SitedTerm(all_of([term, when.term]), when.site, when.span)

    def condition(self, path: DataPath, raw: object, address: str) -> SitedTerm | None:
        """The condition at a path, of an entry with this address; None if none is written."""
        if raw is None:
            return None
        with surviving():
            return self.resolver.sited(raw, BOOL, self._scope(path, f"{address}.{path[-1]}"))  # type: ignore[arg-type]
        return None

    def _activity(self, path: DataPath, raw: str | None, address: str) -> Activity | None:
        """The activity; None if it means nothing, which has been reported."""
        with surviving():
            return activity(self.resolver, path, raw, self._scope(path, f"{address}.do"))
        return None

    def _staying(self, path: DataPath) -> Activity:
        return Activity("stay", (), "", self.resolver.findings.at(path))

    def _deeds(self, address: str) -> _Deeds:
        return _Deeds(
            self.resolver, lambda path, part: self._scope(path, f"{address}.{part}"), self._register
        )

    def _register(self, path: DataPath, name: str) -> str:
        """The register of the frame, or of the world, that an effect sets."""
        if name in self.played.model.let:
            return self.played.register(name)
        if name in self.resolver.symbols.scenario.state:
            return f"state.{name}"
        findings, symbols = self.resolver.findings, self.resolver.symbols
        span = findings.places.key_span(path)
        if name in symbols.scenario.let or name in self.played.model.slots:
            what = "is a slot" if name in self.played.model.slots else "is drawn once per episode"
            cure = "only what the frame declares in its own `let`, or the scenario in `state`, can be set"
            raise findings.fail("S305", f"`{name}` {what} and cannot be set", span, hint=cure)
        hint = f"declare it: `let: {{{name}: 0}}` in the frame"
        known = [*self.played.model.let, *symbols.scenario.state, *symbols.scenario.looks]
        advice = advice_on(name, known, hint)
        raise findings.fail("S305", f"`{name}` is not declared in this frame's `let`", span, **advice)

    def _target(self, target: str | None, path: DataPath) -> str | None:
        states = self.played.model.states or {}
        if target is not None and target not in states:
            findings = self.resolver.findings
            advice = advice_on(target, states, "its states are " + ", ".join(states))
            message = f"no state `{target}` in frame `{self.played.name}`"
            findings.error("S301", message, findings.at(path, 0, len(target)), **advice)
        return target

    def step(self, written: DataPath, step: Step) -> StepPlan:
        path = (*self.played.path, *written)
        address = self.addresses[path]
        doing = self._activity((*path, "do"), step.do, address)
        name = f"{self.played.member}.{self.played.name}.{dotted(written)}"
        self.resolver.readings.entries[name] = step
        duration, lasted = self._duration((*path, "for"), step.for_, f"{address}.for")
        head = (step.do or "").partition("(")[0].strip()
        # What only stays, and says or changes something, lasts one turn, as it does without `do`.
        passing = doing is not None and doing.name == "stay" and bool(step.say or step.set or step.cause)
        endless = doing is not None and head in ACTIVITIES and ACTIVITIES[head].endless and not passing
        unbounded = step.until is None and step.for_ is None and step.while_ is None  # the last is reported
        if step.do is not None and unbounded and endless:
            findings = self.resolver.findings
            message = f"`{step.do}` never ends by itself"
            hint: cures.Hint = "add `until:` or `for:`"
            if doing is not None and doing.name == "stay":
                hint = cures.add("for: 1", cures.added(findings.places, path, "for: 1"), also="or `until:`")
            findings.error("S304", message, findings.at((*path, "do"), 0, len(step.do)), hint=hint)
        return StepPlan(
            name=name,
            state=step.state,
            activity=doing or self._staying(path),
            span=self.resolver.findings.places.value_span(path),
            place=".".join(str(part) for part in written if part != "steps"),
            when=self.condition((*path, "when"), step.when, address),
            until=self.condition((*path, "until"), step.until, address),
            duration=duration,
            lasted=lasted,
            sets=self._deeds(address).sets(step, path),
            causes=self._deeds(address).causes(step, path),
            say=self.lines.get(path),
        )

    def _duration(self, path: DataPath, raw: object, site: str) -> tuple[int | None, SitedTerm | None]:
        """For how many turns an entry lasts; a number that is not known becomes a condition on the clock."""
        if raw is None:
            return None, None
        if raw == "ever":
            return FOR_EVER, None
        findings, horizon = self.resolver.findings, self.resolver.symbols.scenario.horizon
        try:
            term = self.resolver.written(raw, INT, self._scope(path, site))  # type: ignore[arg-type]
        except ReportedError:
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
            text = f"max(1, {raw})"
            findings.error(
                "S106",
                message,
                findings.at(path),
                hint=cures.write(text, cures.over_part(findings.places, path, 0, None, text)),
            )
            return None, None
        clock = Read(Type("int", 0, horizon), f"{self.played.member}.clock")
        lasted = Compare("<=", term, clock)
        return None, SitedTerm(lasted, f"{self.played.member}/{site}", findings.at(path))


# -- what belongs to nobody's frame: rules of the world ------------------------------------------------------


def rules(resolver: Resolver) -> Iterator[RulePlan]:
    """The rules of the world, in the order written."""
    for i, rule in enumerate(resolver.symbols.scenario.rules):
        yield _rule(resolver, rule, ("rules", i))


def _rule(resolver: Resolver, rule: WorldRule, path: DataPath) -> RulePlan:
    name = f"rules[{rule.id}]" if rule.id else dotted(path)
    span = resolver.findings.places.value_span(path)
    # One of them that was written wrongly, which has been reported, still stands in the file.
    written = any(
        resolver.findings.places.value_span((*path, key)) != span for key in keys_of(WorldRule) if key in DOES
    )
    if not (rule.cause or rule.set or rule.reward or written):
        resolver.findings.error(
            "S105", "a rule of the world needs `cause`, `set` or `reward`: what it does", span
        )
    when: SitedTerm | None = None
    with surviving():
        if rule.when is not None:
            when = resolver.sited(rule.when, BOOL, step_scope((*path, "when"), f"{name}.when"))
    resolver.readings.entries[name] = rule
    deeds = _Deeds(
        resolver,
        lambda path, part: step_scope(path, f"{name}.{part}"),
        lambda path, word: _register_of_the_world(resolver, path, word),
    )
    own, *others = seats.rewards(resolver.symbols, resolver.findings, rule.reward, (*path, "reward"))
    return RulePlan(
        name=rule.id or name,
        site=name,
        span=span,
        when=when,
        chance=rule.chance,
        once=rule.once,
        sets=deeds.sets(rule, path),
        reward=own,
        rewards=tuple(others) if any(others) else (),
        causes=deeds.causes(rule, path),
    )


def _register_of_the_world(resolver: Resolver, path: DataPath, word: str) -> str:
    """The register of `state` that a rule of the world sets; it sets no other."""
    if word in resolver.symbols.scenario.state:
        return f"state.{word}"
    scenario, span = resolver.symbols.scenario, resolver.findings.places.key_span(path)
    frame = next((name for name, frame in scenario.frames.items() if word in frame.let), None)
    cure = "a rule of the world sets what is declared in `state`"
    if word in scenario.let:
        message = f"`{word}` is drawn once per episode and cannot be set"
        raise resolver.findings.fail("S305", message, span, hint=cure)
    if frame is not None:
        message = f"`{word}` is a register of the frame `{frame}`, which only the frame itself sets"
        raise resolver.findings.fail("S305", message, span, hint=cure)
    near = did_you_mean(word, scenario.state)
    declaration, places = f"{word}: 0", resolver.findings.places
    if places.get(("state",)) is not None:
        edit = cures.added(places, ("state",), declaration)
    else:
        edit = cures.added(places, (), f"state: {{{declaration}}}")
    hint = cures.propose(f"declare it: `state: {{{declaration}}}`", edit)
    if near or word in resolver.symbols.declared:
        hint = ""
    message = f"`{word}` is not declared in `state`"
    raise resolver.findings.fail("S305", message, span, suggestion=near, hint=hint or None)


def requirements(resolver: Resolver) -> Iterator[SitedTerm]:
    """The conditions on a drawn room."""
    for i, raw in enumerate(resolver.symbols.scenario.require):
        with surviving():
            condition = resolver.sited(raw, BOOL, reset_scope(("require", i)))
            yield resolver.undrawn(condition, "a condition on the room draws nothing itself")
