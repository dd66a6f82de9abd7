"""Rules that never fire, because one above them holds whenever they do."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Hashable, Iterator, Sequence
from heapq import merge
from itertools import product

from socialai_dsl.semantics.build import draws, walk
from socialai_dsl.semantics.findings import Findings
from socialai_dsl.semantics.terms import Chance, Const, FramePlan, Logic, RulePlan, Term

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
