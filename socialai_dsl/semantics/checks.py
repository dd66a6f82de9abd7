"""What can be wrong with a grammar, and with a frame as a whole: its flow of states and steps."""

from __future__ import annotations

import re
from collections.abc import Iterator

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.schema import Frame, Scenario, State
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.findings import Findings
from socialai_dsl.semantics.scope import frames_of

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
