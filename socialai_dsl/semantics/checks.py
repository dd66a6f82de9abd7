"""What can be wrong with a grammar, and with a frame as a whole: its flow of states and steps."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Hashable, Iterator, Sequence
from heapq import merge
from itertools import product

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.schema import Frame, Scenario, State
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.build import draws, walk
from socialai_dsl.semantics.findings import Findings
from socialai_dsl.semantics.plans import FramePlan, RulePlan
from socialai_dsl.semantics.scope import frames_of
from socialai_dsl.semantics.terms import Chance, Const, Logic, Term

_TOLD = 12
"""How many states of a circle are named."""

GRAMMAR_CODE = "S104"
"""The code of a template that cannot be filled."""


def check_grammar(scenario: Scenario, findings: Findings) -> None:
    """Templates with something else than <noun> to fill, and anything that is in the grammar twice."""
    grammar = scenario.grammar
    for i, template in enumerate(grammar.templates):
        path: DataPath = ("grammar", "templates", i)
        other = re.search(r"<(?!noun>)[^<>]*>|[<>]", template.replace("<noun>", " " * 6))
        if other or template.count("<noun>") > 1:
            offset = other.start() if other else template.rindex("<noun>")
            message = f"a template has one `<noun>` to fill, and no `{other.group()}`" if other else \
                "a template has only one `<noun>`"  # fmt: skip
            findings.error(GRAMMAR_CODE, message, findings.at(path, offset))
    for part, words in (("templates", grammar.templates), ("nouns", grammar.nouns)):
        seen: set[str] = set()
        for i, word in enumerate(words):
            if str(word) in seen:
                span = findings.at(("grammar", part, i), 0, len(str(word)))
                findings.error("S213", f"`{word}` is in the {part} already", span)
            seen.add(str(word))


def check_flow(scenario: Scenario, findings: Findings) -> None:
    """Frames that have no form, states that do not exist or are never entered, circles within a step."""
    for path, frame in frames_of(scenario):
        name = str(path[-1])
        if _has_form(name, frame, path, findings):
            if frame.states is not None:
                _check_states(name, frame, frame.states, path, findings)
            else:
                _check_steps(frame, path, findings)


def _has_form(name: str, frame: Frame, path: DataPath, findings: Findings) -> bool:
    if frame.states is not None and frame.steps is not None:
        span = findings.places.key_span((*path, "steps"))
        hint = "use `steps` for what happens in a row, `states` for what branches"
        findings.error("S308", "a frame has either `steps` or `states`", span, hint=hint)
    elif not frame.states and not frame.steps:
        findings.error("S105", f"frame `{name}` needs `steps` or `states`", findings.places.key_span(path))
    elif frame.steps is not None and frame.start is not None:
        span = findings.places.key_span((*path, "start"))
        findings.error("S107", "`start` belongs to `states`; `steps` begin with the first", span)
    else:
        return True
    return False


def _check_states(
    name: str, frame: Frame, states: dict[str, State], path: DataPath, findings: Findings
) -> None:
    if frame.start is not None and frame.start not in states:
        near = did_you_mean(frame.start, states)
        span = findings.at((*path, "start"), 0, len(frame.start))
        findings.error("S301", f"no state `{frame.start}` in frame `{name}`", span, suggestion=near)
        return
    targets = {state: _targets(body) for state, body in states.items()}
    if any(target not in states for found in targets.values() for target in found):
        return  # reported where it is written; which states are entered cannot be known
    entered = _reachable(frame.start or next(iter(states)), targets)
    for state in states:
        if state not in entered:
            span = findings.places.key_span((*path, "states", state))
            findings.warning(
                "W306", f"state `{state}` can never be entered", span, hint="no `goto` leads to it"
            )
    _check_circles(states, path, findings)


def _targets(state: State) -> list[str]:
    rules = (*state.first, *state.then)
    return [target for rule in rules for target in (rule.goto, rule.goto_now) if target is not None]


def _reachable(start: str, targets: dict[str, list[str]]) -> set[str]:
    entered, waiting = {start}, [start]
    while waiting:
        for target in targets[waiting.pop()]:
            if target not in entered:
                entered.add(target)
                waiting.append(target)
    return entered


def _check_circles(states: dict[str, State], path: DataPath, findings: Findings) -> None:
    """`goto_now` reads the next state's `then` in the same step; it must come to an end."""
    edges = {state: [rule.goto_now for rule in body.then if rule.goto_now] for state, body in states.items()}
    for circle in _circles(edges):
        index = next(i for i, rule in enumerate(states[circle[0]].then) if rule.goto_now == circle[1])
        span = findings.at((*path, "states", circle[0], "then", index, "goto_now"), 0, len(circle[1]))
        message = f"would go round within one step: {_told(circle)}"
        findings.error("S312", message, span, hint="write `goto` where the next step may come first")


def _circles(edges: dict[str, list[str]]) -> Iterator[list[str]]:
    """Circles that have no state in common, each from a state back to it; every edge is walked once."""
    done: set[str] = set()
    for state in edges:
        trail: dict[str, Iterator[str]] = {} if state in done else {state: iter(edges[state])}
        while trail:
            last = next(reversed(trail))
            target = next(trail[last], None)
            if target is None:
                del trail[last]
                done.add(last)
            elif target in trail:
                states = list(trail)
                yield [*states[states.index(target) :], target]
                done |= trail.keys()
                break
            elif target not in done:
                trail[target] = iter(edges[target])


def _told(circle: list[str]) -> str:
    if len(circle) > _TOLD:
        circle = [*circle[: _TOLD - 1], "...", circle[-1]]
    return " -> ".join(circle)


def _check_steps(frame: Frame, path: DataPath, findings: Findings) -> None:
    steps = frame.steps or ()
    names: dict[str, int] = {}
    for i, step in enumerate(steps):
        if step.state is not None and step.state in names:
            span = findings.at((*path, "steps", i, "state"), 0, len(step.state))
            findings.error("S213", f"`{step.state}` is the name of step {names[step.state]} already", span)
        if step.state is not None:
            names.setdefault(step.state, i)
        if step.for_ == "ever" and step.until is None and i + 1 < len(steps):
            span = findings.places.value_span((*path, "steps", i + 1))
            hint = "the step before it lasts for ever"
            findings.warning("W306", "this step is never reached", span, hint=hint)
            return


# -- rules that never fire -------------------------------------------------------------------------------------


_FEW = 64
"""Utterances, up to which a rule is found by them."""


def check_shadowed(plan: FramePlan, findings: Findings) -> None:
    """Warn of rules that never fire (W311)."""
    for state in plan.states:
        _check_rules(state.first, findings)
        _check_rules(state.then, findings)


def _check_rules(rules: Sequence[RulePlan], findings: Findings) -> None:
    candidates = _Candidates(rules)
    for i, rule in enumerate(rules):
        above = next((rules[k] for k in candidates.above(rule) if _covers(rules[k], rule)), None)
        candidates.add(i)
        if above is not None:
            message = f"this rule never fires: line {above.span.line} holds whenever it does"
            findings.warning(
                "W311", message, rule.span, hint="the first rule that holds is the only one that fires"
            )


class _Candidates:
    """The rules above that may cover one, without comparing all with all.

    Who hears all that a rule hears, hears its rarest utterance; and of the conditions of the one above, also the rarest
    is among those of the rule below.
    """

    def __init__(self, rules: Sequence[RulePlan]) -> None:
        self._rules = rules
        self._heard = Counter(said for rule in rules for said in _heard(rule))
        self._asked = Counter(part for rule in rules for part in _asked(rule))
        self._known: defaultdict[Hashable, list[int]] = defaultdict(list)

    def add(self, number: int) -> None:
        """Let rules further down be compared with this one."""
        rule = self._rules[number]
        rarest = min(_asked(rule), key=self._asked.__getitem__, default=None)
        for said in _heard(rule) or (None,):
            self._known[said, rarest].append(number)

    def above(self, rule: RulePlan) -> Iterator[int]:
        """Numbers of those that may cover a rule, in order."""
        rarest = min(_heard(rule), key=self._heard.__getitem__, default=None)
        keys = product({None, rarest}, {None, *_asked(rule)})
        return merge(*(self._known[key] for key in keys if key in self._known))


def _heard(rule: RulePlan) -> frozenset[Hashable]:
    """What a rule waits for; nothing if it does not listen, or waits for so much that it is compared with all."""
    sets = [said for pattern in rule.hears or () for said in (pattern.pairs, pattern.said_by_npcs)]
    return frozenset().union(*sets) if sum(map(len, sets)) <= _FEW else frozenset()


def _asked(rule: RulePlan) -> tuple[Term, ...]:
    return () if rule.when is None else _conjuncts(rule.when.term)


def _covers(above: RulePlan, below: RulePlan) -> bool:
    """Whether `above` certainly holds whenever `below` does."""
    if above.once or above.chance is not None or above.after > below.after:
        return False
    return _hears_all(above, below) and _asks_less(above, below)


def _hears_all(above: RulePlan, below: RulePlan) -> bool:
    if not above.hears:
        return True
    if not below.hears:
        return False
    pairs = frozenset().union(*(p.pairs for p in above.hears))
    texts = frozenset().union(*(p.said_by_npcs for p in above.hears))
    return all(p.pairs <= pairs and p.said_by_npcs <= texts for p in below.hears)


def _asks_less(above: RulePlan, below: RulePlan) -> bool:
    if above.when is None:
        return True
    if below.when is None or _draws(above.when.term):
        return False
    if isinstance(above.when.term, Const) and not above.when.term.value:
        return False  # a parameter has switched it off
    return set(_conjuncts(above.when.term)) <= set(_conjuncts(below.when.term))


def _conjuncts(term: Term) -> tuple[Term, ...]:
    return term.args if isinstance(term, Logic) and term.op == "and" else (term,)


def _draws(term: Term) -> bool:
    return draws(term) or any(isinstance(part, Chance) for part in walk(term))
