"""Flow and conditions: states never entered, rules never reached, conditions that can never hold."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Container, Hashable, Iterable, Iterator, Sequence
from dataclasses import replace
from heapq import merge
from itertools import product
from typing import Final

from socialai_dsl import cures
from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar.ast import Not, every, unparse
from socialai_dsl.schema.annotations import keys_of
from socialai_dsl.schema.scenario import Frame, Scenario, State, Step, UtteranceGrammar
from socialai_dsl.semantics import plans, terms
from socialai_dsl.semantics.facts import Contradiction, SaidLater, TermFacts, contradiction
from socialai_dsl.semantics.plans import CheckedScenario, Effect, FramePlan, NestedSteps, RulePlan
from socialai_dsl.semantics.scope import Findings, frames_of, surviving
from socialai_dsl.semantics.terms import (
    Const,
    Logic,
    SitedTerm,
    Term,
    changed,
    draws,
    is_looked_for,
    is_own_noun,
    may_find_nothing,
    walk,
)
from socialai_dsl.source import DataPath, Span, TextEdit
from socialai_dsl.vocabulary import Sentences, first_alike, normal

ALIKE: Final = "case, blanks, a final mark and other forms of the same letters do not count"
"""Why different texts are one."""

_TOLD = 12
"""How many states of a circle are named."""

_SLOT: Final = re.compile("<[^<>]*>|[<>]")
"""What is filled in a template, or looks like it."""

MOST_PAIRS: Final = 64 * 256
"""The most numbers a grammar can have for what is said: templates times fillings."""


def check_grammar(grammar: UtteranceGrammar, findings: Findings) -> bool:
    """Templates with something else than slots to fill, and anything that is in the grammar twice; False if the grammar
    has nothing to fill templates with.
    """
    span = findings.places.key_span(("grammar",))
    if grammar.nouns and grammar.slots:
        hint = "`nouns` are what `<noun>` can be; `slots` have names of their own"
        findings.error("S107", "`grammar` has either `nouns` or `slots`", span, hint=hint)
        return False
    if not grammar.nouns and not grammar.slots and any("<noun>" in one for one in grammar.templates):
        findings.error("S105", "`grammar` needs a key `nouns`", span)
        return False
    names = _slots_of(grammar)
    for i, template in enumerate(grammar.templates):
        path: DataPath = ("grammar", "templates", i)
        other, twice = _unfilled(template, names)
        if other or twice:
            offset = other.start() if other else template.rindex(twice)
            width = len(other.group() if other else twice)
            message = f"a template has only one `{twice}`"
            if other:
                filled = " and ".join(f"`<{name}>`" for name in names) or "nothing"
                filled = "one `<noun>`" if grammar.nouns else filled
                message = f"a template has {filled} to fill, and no `{other.group()}`"
            near = did_you_mean(other.group()[1:-1], names) if other else None
            suggestion = f"<{near}>" if near else None
            findings.error("S104", message, findings.at(path, offset, width), suggestion=suggestion)
    for part, words in (("templates", grammar.templates), ("nouns", grammar.nouns)):
        check_alike(part, words, findings)
        for i, word in enumerate(words):
            path = ("grammar", part, i)
            findings.must_be_one_line(path, str(word))
            if part == "nouns" and (mark := re.search("[<>]", str(word))):
                message = "what stands in a slot has no slots itself"
                findings.error("S104", message, findings.at(path, mark.start()))
    return True


def _slots_of(grammar: UtteranceGrammar) -> list[str]:
    return [*grammar.slots] or ["noun"] * bool(grammar.nouns)


def _unfilled(template: str, names: Sequence[str]) -> tuple[re.Match[str] | None, str]:
    """What of a template nothing fills, and what it has twice; None and "" if it is right."""
    known = "|".join(map(re.escape, names))
    blanked = re.sub(f"<({known})>", lambda found: " " * len(found.group()), template)
    return _SLOT.search(blanked), next((f"<{name}>" for name in names if template.count(f"<{name}>") > 1), "")


def unclear_templates(grammar: UtteranceGrammar) -> Iterator[list[str | None]]:
    """Templates in which something was reported, or that are filled by what was: what is fixed of them, and None for
    all else.
    """
    names, nouns_unclear = _slots_of(grammar), any(_SLOT.search(str(noun)) for noun in grammar.nouns)
    for template in grammar.templates:
        if any(_unfilled(template, names)) or (nouns_unclear and "<noun>" in template):
            fixed = _SLOT.split(template)
            yield [fixed[0], *(part for text in fixed[1:] for part in (None, text))]


def check_alike(part: str, words: Iterable[object], findings: Findings) -> None:
    """Report templates or nouns that are heard as one."""
    seen: dict[str, str] = {}
    for i, word in enumerate(map(str, words)):
        first = first_alike(word, seen)
        if first is not None:
            span = findings.at(("grammar", part, i), 0, len(word))
            message = f"`{word}` is in the {part} already"
            hint = None
            if first != word:
                message = f"`{word}` is heard as `{first}`, which is in the {part} already"
                hint = ALIKE
            findings.error("S213", message, span, hint=hint)


def check_use_of_slots(sentences: Sentences, heard: Container[str], findings: Findings) -> None:
    """Slots that no template has and that nobody hears (`heard`)."""
    names = {slot.name for slot in sentences.slots}
    strange = any(set(re.findall("<([^<>]*)>", template)) - names for template in sentences.templates)
    for place, slot in enumerate(sentences.slots if not strange else ()):
        if slot.name not in heard and not any(used[place] for used in sentences.used):
            span = findings.places.key_span(("grammar", "slots", slot.name))
            hint = f"leave it out, unless a rule hears it from others: `hears: I offer {slot.place}`"
            findings.error("S104", f"no template has `{slot.place}`", span, hint=hint)


def check_sentences(sentences: Sentences, findings: Findings) -> bool:
    """Too many sentences, and sentences said in two ways; False if there are too many."""
    if (count := len(sentences.templates) * sentences.fillings) > MOST_PAIRS:
        sizes = " x ".join(map(str, sentences.radices))
        product_of = f"{len(sentences.templates)} x {sizes} = {count:,}"
        message = f"templates x slots are {product_of}; at most {MOST_PAIRS:,} are possible"
        hint = "each slot counts with its values and one more, for templates that lack it"
        findings.error("S106", message, findings.places.key_span(("grammar", "slots")), hint=hint)
        return False
    seen: dict[str, int] = {}
    for template, choices in sentences.each():
        text = normal(sentences.text(template, choices))
        if seen.setdefault(text, template) != template:
            message = (
                f'"{sentences.text(template, choices)}" can be said with this template and an earlier one'
            )
            hint = "so it would not be known which slots it has"
            findings.error("S213", message, findings.at(("grammar", "templates", template)), hint=hint)
            break
    return True


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
    targets = {
        state: [target for rule in body.rules for target in (rule.goto, rule.goto_now) if target is not None]
        for state, body in states.items()
    }
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
        message = f"the states go round within one step: {_told(circle)}"
        key = TextEdit(
            findings.places.key_span((*path, "states", circle[0], "then", index, "goto_now")), "goto"
        )
        findings.error(
            "S312", message, span, hint=cures.write("goto", key, "which takes effect in the next step")
        )


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
    names: dict[str, str] = {}
    for place, step in frame.entries():
        if step.state is not None and step.state in names:
            span = findings.at((*path, *place, "state"), 0, len(step.state))
            findings.error("S213", f"`{step.state}` is the name of step {names[step.state]} already", span)
        if step.state is not None:
            names.setdefault(step.state, ".".join(str(part) for part in place if part != "steps"))
    _check_order(frame.steps or (), (*path, "steps"), findings)


_OF_NESTED_STEPS: Final = frozenset({"repeat", "while"})
_OF_AN_ENTRY: Final = frozenset(keys_of(Step)) - _OF_NESTED_STEPS - {"steps", "when", "until"}


def _until(findings: Findings, path: DataPath) -> cures.Hint:
    """The proposal to say until when, where an entry says as long as what."""
    part = findings.places.at(path)
    if not isinstance(part.value, str) or part.span.key is None:
        return None
    with surviving():
        node = findings.expression(path, part.value)
        node = node.operand if isinstance(node, Not) else Not(node)
        text = unparse(node)
        written = cures.in_quotes(text) if cures.needs_quotes(text, part.span.flow) else text
        edit = part.source.edit(part.source.index(part.span.key), part.end, f"until: {written}")
        return cures.write(f"until: {text}", edit)
    return None


def _check_order(steps: Sequence[Step], path: DataPath, findings: Findings) -> None:
    """Keys that belong to an entry, or to nested steps; entries after one that lasts for ever."""
    for i, step in enumerate(steps):
        place = (*path, i)
        nested = step.steps is not None
        written = findings.part(place)
        keys = written if isinstance(written, dict) else {}
        for key in keys.keys() & (_OF_AN_ENTRY if nested else _OF_NESTED_STEPS):
            span = findings.places.key_span((*place, key))
            message, hint = f"`{key}` belongs to an entry, not to nested `steps`", None
            if not nested:
                message = f"`{key}` belongs to nested `steps`: `{{repeat: 3, steps: [...]}}`"
                hint = _until(findings, (*place, key)) if key == "while" else None
            findings.error("S107", message, span, hint=hint)
        if step.steps is not None:
            bounds = [key for key in ("while", "until") if key in keys]
            if step.repeat is None and bounds:
                message = f"`{bounds[0]}` needs `repeat`: how many rounds there are at most"
                findings.error("S105", message, findings.places.key_span((*place, bounds[0])))
            if not step.steps:
                findings.error(
                    "S105", "nested `steps` need an entry", findings.places.key_span((*place, "steps"))
                )
            _check_order(step.steps, (*place, "steps"), findings)
        elif step.for_ == "ever" and step.until is None and step.when is None and i + 1 < len(steps):
            span = findings.places.value_span((*path, i + 1))
            hint = "the step before it lasts for ever"
            findings.warning("W306", "this step is never reached", span, hint=hint)
            return


# -- rules that never fire -------------------------------------------------------------------------------------


_FEW = 64
"""Utterances, up to which a rule is found by them."""


def check_shadowed(plan: FramePlan, findings: Findings) -> None:
    """Warn of rules that never fire (W311)."""
    for state in plan.states:
        for part, rules in (("first", state.first), ("then", state.then)):
            path = ("frames", plan.frame, "states", state.name, part)
            _check_rules(rules, path, plan.entity == 0, findings)


def _check_rules(rules: Sequence[RulePlan], path: DataPath, is_agent: bool, findings: Findings) -> None:
    plain = [
        replace(rule, when=None) if _is_always((*path, i, "when"), rule, findings) else rule
        for i, rule in enumerate(rules)
    ]
    candidates = _Candidates(plain)
    for i, rule in enumerate(plain):
        above = next((plain[k] for k in candidates.above(rule) if _covers(plain[k], rule)), None)
        if not _may_fall_through(rule, is_agent):
            candidates.add(i)
        if above is not None:
            message = f"this rule never fires: line {above.span.line} holds whenever it does"
            findings.warning(
                "W311", message, rule.span, hint="the first rule that holds is the only one that fires"
            )


def _is_always(path: DataPath, rule: RulePlan, findings: Findings) -> bool:
    """Whether the condition of a rule is true as it is written, and not by a parameter, which may have other values."""
    written = findings.places.get(path)
    if written is None or written.substituted or "$" in str(written.value):
        return False
    return rule.when is not None and isinstance(rule.when.term, Const) and bool(rule.when.term.value)


def _may_fall_through(rule: RulePlan, is_agent: bool) -> bool:
    """Whether a rule whose conditions hold may not fire, since a value that it needs for `set`, `cause` or `say` finds
    nothing, or is no utterance of the agent's. An activity that finds nothing becomes `stay`.
    """
    if is_agent and rule.say is not None and not all(isinstance(part, str) for part in rule.say.parts):
        return True
    only_agent = not any(pattern.said_by_npcs for pattern in rule.hears)
    # What a rule hears has the noun and the slots that it asks for.
    return any(
        is_looked_for(part)
        and not (rule.hears and (isinstance(part, terms.HeardNoun) or (only_agent and is_own_noun(part))))
        for part in walk((rule.sets, rule.causes, rule.say))
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
    for pattern in below.hears:
        wider = [other for other in above.hears if other.addressed in (None, pattern.addressed)]
        pairs = frozenset().union(*(other.pairs for other in wider))
        texts = frozenset().union(*(other.said_by_npcs for other in wider))
        if not (pattern.pairs <= pairs and pattern.said_by_npcs <= texts):
            return False
    return True


def _asks_less(above: RulePlan, below: RulePlan) -> bool:
    if above.when is None:
        return True
    if below.when is None or draws(above.when.term):
        return False
    if isinstance(above.when.term, Const) and not above.when.term.value:
        return False  # a parameter has switched it off
    return set(_conjuncts(above.when.term)) <= set(_conjuncts(below.when.term))


def _conjuncts(term: Term) -> tuple[Term, ...]:
    return term.args if isinstance(term, Logic) and term.op == "and" else (term,)


# -- conditions that no value makes true ---------------------------------------------------------------------


def check_possible(checked: CheckedScenario, findings: Findings) -> None:
    """Report conditions that can never hold: of rules (W311), of steps, outcomes and probes (W314), and S316 where
    nothing is left to be played: no success, or no room.
    """
    possible = Possible(checked)
    probes = ((probe.when.span, probe.when) for probe in checked.probes if probe.when is not None)
    looked_at = (
        ("W311", "this rule never fires: its condition can never hold", _rules(checked)),
        ("W314", "these steps are always left out: this can never hold", _conditions_of_steps(checked)),
        ("W314", "this step can never end: `until` can never hold", _untils(checked)),
        ("W314", "there are never any of those: this can never hold", _those(checked)),
        ("W314", "this probe is never asked: `when` can never hold", probes),
    )
    for code, message, found in looked_at:
        for span, conditions in _by_place(found):
            if (why := possible.never(conditions)) is not None:
                findings.warning(code, message, span, hint=why)
    for span, conditions in _by_place(_those(checked)):
        if possible.never(conditions) is None and possible.always(conditions):
            hint = "the name of the group alone means all of them"
            findings.warning(
                "W319", "`those(...)` are the whole group: the condition is always true", span, hint=hint
            )
    for required in checked.require:
        if (why := possible.never([required])) is not None:
            message = "no room is played: what it has to be like can never hold"
            findings.error("S316", message, required.span, hint=why)
    never = {
        outcome: why
        for outcome in checked.outcomes
        if (why := possible.never([outcome.condition])) is not None
    }
    successes = [outcome for outcome in checked.outcomes if outcome.success]
    lost = bool(successes) and all(outcome in never for outcome in successes)
    for outcome, why in never.items():
        if lost and outcome.success:
            message = "no success is possible: this can never hold"
            findings.error("S316", message, outcome.condition.span, hint=why)
        else:
            findings.warning("W314", "this outcome can never hold", outcome.condition.span, hint=why)


def _by_place(found: Iterable[tuple[Span, SitedTerm]]) -> Iterator[tuple[Span, list[SitedTerm]]]:
    """Conditions by the place they are written at: several members may follow one frame."""
    places: dict[Span, list[SitedTerm]] = {}
    for span, condition in found:
        places.setdefault(span, []).append(condition)
    yield from places.items()


def _rules(checked: CheckedScenario) -> Iterator[tuple[Span, SitedTerm]]:
    for frame in checked.frames:
        for rule in frame.rules:
            when = _with_after(frame, rule, checked.horizon)
            if when is not None:
                yield when.span, _in_turn(checked, frame, when)
    yield from ((rule.when.span, rule.when) for rule in checked.rules if rule.when is not None)


def _with_after(frame: FramePlan, rule: RulePlan, horizon: int) -> SitedTerm | None:
    """The condition of a rule, with that of its `after`, which a plan keeps apart where it is a known number."""
    if not rule.after:
        return rule.when
    clock = terms.Read(terms.Type("int", 0, horizon), f"{frame.member}.clock")
    reached = terms.Compare("<=", terms.number(rule.after), clock)
    if rule.when is None:
        return SitedTerm(reached, f"{rule.site}.when", rule.span)
    return replace(rule.when, term=Logic("and", (reached, rule.when.term)))


def _conditions_of_steps(checked: CheckedScenario) -> Iterator[tuple[Span, SitedTerm]]:
    for frame in checked.frames:
        nested = every(NestedSteps, frame.nesting)
        asked = [step.when for step in frame.steps] + [
            c for block in nested for c in (block.when, block.going)
        ]
        yield from ((one.span, _in_turn(checked, frame, one)) for one in asked if one is not None)


def _untils(checked: CheckedScenario) -> Iterator[tuple[Span, SitedTerm]]:
    for frame in checked.frames:
        for step in frame.steps:
            if step.until is not None:
                yield step.until.span, _in_turn(checked, frame, step.until)


def _in_turn(checked: CheckedScenario, frame: FramePlan, condition: SitedTerm) -> SitedTerm:
    """A condition as it is asked in the turn of a member: those who come after it have said nothing in this step.

    What players say is known from the start of the step on.
    """

    def later(term: Term) -> Term | None:
        if (
            isinstance(term, terms.SaidBy)
            and term.entity > frame.entity
            and term.entity not in checked.seated
        ):
            return SaidLater(term.entity, term.pattern)
        return None

    return replace(condition, term=changed(condition.term, later))


def _those(checked: CheckedScenario) -> Iterator[tuple[Span, SitedTerm]]:
    """The conditions in `those(...)`, of each of the group."""
    for item in every(plans.Assignment, checked):
        if item.only is not None:
            yield item.only.span, item.only
    for effect in every(Effect, checked):
        yield from ((effect.span, SitedTerm(only, effect.site, effect.span)) for only in effect.only)


class Possible:
    """Which conditions of a scenario can hold, each by itself, and why others cannot."""

    def __init__(self, checked: CheckedScenario) -> None:
        self._checked = checked
        self._facts = TermFacts(checked)

    def never(self, conditions: Sequence[SitedTerm]) -> str | None:
        """Why none of these conditions can hold; None if one of them may.

        What is false as it is written, such as a parameter that switches a rule off, is meant to be.
        """
        why = None
        for condition in conditions:
            if self._facts.may_be(condition.term):
                return None
            why = why or self._why(condition.term)
        return why

    def always(self, conditions: Sequence[SitedTerm]) -> bool:
        """Whether none of these conditions can be false, and that not as they are written."""
        asked = [condition.term for condition in conditions]
        return not all(isinstance(term, Const) for term in asked) and not any(
            self._facts.may_be(term, wanted=False) or may_find_nothing(term) for term in asked
        )

    # -- words --

    def _why(self, term: Term) -> str | None:
        """What of a condition is never so, as a hint; None where nothing in it depends on what happens."""
        match term:
            case terms.Logic(op="and", args=args):
                if all(map(self._facts.may_be, args)) and (found := contradiction(args)) is not None:
                    return _why_not_together(found)
                return next(
                    (why for arg in args if not self._facts.may_be(arg) and (why := self._why(arg))), None
                )
            case terms.Logic(args=args):
                return next((why for arg in args if (why := self._why(arg))), None)
            case terms.Quantification(condition=condition, items=items) if condition is not None and items:
                return self._why(condition)
            case SaidLater(entity=entity):
                who = self._checked.entities[entity].key
                return (
                    f"`{who}` has its turn later in the step: what it said is heard by `hears:`, `heard(any)`"
                )
            case terms.Compare(left=left, right=right) if not isinstance(left, Const) or not isinstance(
                right, Const
            ):
                return self._why_not_equal(left, right) if term.op == "==" else _bounds(left, right)
        return None

    def _why_not_equal(self, left: Term, right: Term) -> str:
        if isinstance(left, terms.FieldOf) and left.name == "status" and isinstance(right, Const):
            words = left.type.words
            can = " or ".join(words[value - left.type.low] for value in self._facts.values(left))
            wanted = words[right.value - left.type.low]
            name = self._name(left.entity)
            return f"nothing makes {name} `{wanted}`: it is {can}"
        return _bounds(left, right)

    def _name(self, entity: Term) -> str:
        low, high = entity.type.low, entity.type.high
        keys = dict.fromkeys(self._checked.entities[number].key for number in range(low, high + 1))
        return " or ".join(f"`{key}`" for key in keys)


def _why_not_together(found: Contradiction) -> str:
    if found.term is None:
        return "it asks for something and for its opposite"
    return f"{_called(found.term)} would have to be at least {found.low} and at most {found.high}"


def _bounds(left: Term, right: Term) -> str:
    """The ranges of what is compared."""
    return (
        " and ".join(
            f"{_called(part)} is {_between(part)}" for part in (left, right) if not isinstance(part, Const)
        )
        or "it compares two different values"
    )


_WRITTEN: Final = {"clock": "turns_in_state", "dir": "facing", "width": "W", "height": "H"}
"""What terms and registers are called that authors know by another name."""


def _called(term: Term) -> str:
    match term:
        case terms.World(name=name) | terms.FieldOf(name=name) | terms.Measure(name=name):
            return f"`{_WRITTEN.get(name, name)}`"
        case terms.Read(path=path):
            register = path.rpartition(".")[2]
            return f"`{_WRITTEN.get(register, register)}`"
    return "what is compared"


def _between(term: Term) -> str:
    type_ = term.type
    if type_.words:
        named = type_.words[:6]
        return "one of " + ", ".join(named) + (", ..." if len(type_.words) > len(named) else "")
    if type_.kind == "entity":
        return "something else"
    return f"{type_.low}" if type_.size == 1 else f"from {type_.low} to {type_.high}"
