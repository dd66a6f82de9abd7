"""The entries of `tests`: what the agent does step by step, what is heard, and what is so then."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Final

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema.scenario import DialogueStep, DialogueTest, Expression
from socialai_dsl.semantics.plans import (
    ClaimPlan,
    DialoguePlan,
    DialogueStepPlan,
    Drawn,
    LinePlan,
    OutcomePlan,
    ProbePlan,
)
from socialai_dsl.semantics.probes import NotedValues
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import ReportedError, step_scope, surviving
from socialai_dsl.semantics.terms import BOOL, SitedTerm
from socialai_dsl.semantics.texts import ANYTHING
from socialai_dsl.semantics.typed import STANDING, Phrases, split_line
from socialai_dsl.source import DataPath
from socialai_dsl.vocabulary import PRIMITIVES, normal

OPEN: Final = "open"
"""What `ends` says of an episode that goes on."""
ENDS: Final = ("success", "failure", "deadly", "timeout", OPEN)
"""What `ends` may say in any scenario."""

MOST_VALUES: Final = 400
"""How many conditions, states and values in lines a test may have."""


def dialogues(resolver: Resolver, outcomes: Sequence[OutcomePlan]) -> tuple[DialoguePlan, ...]:
    """The entries in the order written; those with a mistake are left out once it has been reported."""
    tests = resolver.symbols.scenario.tests
    if not tests:
        return ()
    sentences, sayable = resolver.symbols.sentences, dict[str, tuple[int, ...]]()
    for template, choices in sentences.each():
        sayable.setdefault(normal(sentences.text(template, choices)), (template, *choices))
    found = []
    for name, test in tests.items():
        with resolver.registers.apart(), surviving():
            found.append(_Test(resolver, name, test, sayable).plan(outcomes))
    return tuple(found)


class _Test:
    """One entry, and where it stands."""

    def __init__(
        self, resolver: Resolver, name: str, test: DialogueTest, sayable: Mapping[str, tuple[int, ...]]
    ) -> None:
        self._resolver, self._findings = resolver, resolver.findings
        self._name, self._test, self._sayable = name, test, sayable
        self._path: DataPath = ("tests", name)
        self._probes: list[ProbePlan] = []
        self._fine = True

    def plan(self, outcomes: Sequence[OutcomePlan]) -> DialoguePlan:
        """The entry with everything resolved, after all mistakes in it have been reported."""
        places, test = self._findings.places, self._test
        with self._surviving():
            self._check_room()
        with self._surviving():
            self._check_length()
        with self._surviving():
            self._check_end(outcomes)
        steps = [self._step(i, step) for i, step in enumerate(test.play)]
        with self._surviving():
            self._check_number()
        if not self._fine:
            raise ReportedError
        return DialoguePlan(
            self._name,
            places.key_span(self._path),
            test.room,
            tuple(steps),
            None if test.ends is None else (test.ends, self._findings.at((*self._path, "ends"))),
            None if test.reward is None else (test.reward, self._findings.at((*self._path, "reward"))),
            tuple(self._probes),
        )

    @contextmanager
    def _surviving(self) -> Iterator[None]:
        """Go on after a value that failed, to find the other mistakes of the test."""
        try:
            yield
        except ReportedError:
            self._fine = False

    # -- the room, the end ---------------------------------------------------------------------------------------

    def _check_room(self) -> None:
        room = self._test.room
        if room.test_episode is None:
            return
        for key in ("seed", "index"):
            if getattr(room, key) is not None:
                place = self._findings.places.key_span((*self._path, "room", key))
                hint = "leave one of them out"
                message = f"a test episode has a room of its own, so it has no `{key}`"
                raise self._findings.fail("S107", message, place, hint=hint)

    def _check_length(self) -> None:
        """A step beyond the horizon can never be."""
        horizon, acts = self._resolver.symbols.scenario.horizon, 0
        for i, step in enumerate(self._test.play):
            for path, _ in self._findings.each((*self._path, "play", i, "do"), step.do):
                acts += 1
                if acts == horizon + 1:
                    message = f"the episode ends after {horizon} steps, before this one"
                    hint = "delete what comes from here on, or give the scenario a longer `horizon`"
                    raise self._findings.fail("S804", message, self._findings.at(path), hint=hint)

    def _check_number(self) -> None:
        if len(self._probes) > MOST_VALUES:
            message = f"a test has at most {MOST_VALUES} conditions, states and values in lines"
            place = self._findings.places.key_span(self._path)
            raise self._findings.fail(
                "S106", message, place, hint="let several tests look at some of them each"
            )

    def _check_end(self, outcomes: Sequence[OutcomePlan]) -> None:
        known = [*ENDS, *(outcome.name for outcome in outcomes if "@" not in outcome.name)]
        word = self._test.ends
        if word is None or word in known:
            return
        near = did_you_mean(word, known)
        span = self._findings.at((*self._path, "ends"), width=len(word))
        hint = None if near else f"it ends with one of {', '.join(known)}"
        raise self._findings.no_such(word, f"no outcome is called `{word}`", span, suggestion=near, hint=hint)

    # -- steps ---------------------------------------------------------------------------------------------------

    def _step(self, number: int, step: DialogueStep) -> DialogueStepPlan:
        path: DataPath = (*self._path, "play", number)
        noted = NotedValues(self._resolver, f"{self._name}.{number}", "a test draws nothing itself")
        acts = []
        for place, typed in self._findings.each((*path, "do"), step.do):
            with self._surviving():
                acts.append(self._act(place, typed))
        hears = None if step.hears == (ANYTHING,) else tuple(self._lines(path, step, noted))
        claims = [*self._states(path, step, noted)]
        for key, expected, written in (("true", True, step.true_), ("not", False, step.not_)):
            for i, (place, raw) in enumerate(self._findings.each((*path, key), written)):
                with self._surviving():
                    claims.append(self._claim(f"{key}{i}", place, raw, expected, noted))
        span = self._findings.places.value_span(path)
        return DialogueStepPlan(span, tuple(acts), step.do, hears, tuple(claims))

    def _act(self, path: DataPath, typed: str) -> tuple[int, ...]:
        """What is typed, as an action of the space."""
        if not self._findings.must_be_one_line(path, typed):
            raise ReportedError
        typed = typed.strip()
        actions = self._resolver.symbols.scenario.actions
        action, said = split_line(typed, PRIMITIVES)
        if action is not None and action not in actions:
            message = f"the agent of this scenario has no action `{action}`"
            place = self._findings.at(path, width=len(action))
            raise self._findings.fail("S320", message, place, hint=f"it has {', '.join(actions)}")
        if said is None or normal(said) in self._sayable:
            own = [word for word in PRIMITIVES if word in actions]
            silence = (0,) * (1 + len(self._resolver.symbols.sentences.slots))
            spoken = silence if said is None else self._sayable[normal(said)]
            return (len(own) if action is None else own.index(action), int(said is not None), *spoken)
        near = Phrases(actions, self._resolver.symbols.sentences).corrected(typed)
        hint: str | None = f"movements are {', '.join((*actions, *STANDING))}"
        span = self._findings.at(path, width=len(typed))
        if action is not None or typed[:1].isupper() or typed.split(" ")[0] in STANDING:
            message = f'the agent cannot say "{said}" with this grammar'
            hint = None if near else "what can be said is a template of `grammar` with one of its nouns"
            raise self._findings.fail("S401", message, span, suggestion=near, hint=hint)
        message = f"`{typed}` can be neither done nor said"
        raise self._findings.fail("S205", message, span, suggestion=near, hint=None if near else hint)

    def _lines(self, path: DataPath, step: DialogueStep, noted: NotedValues) -> Iterator[LinePlan]:
        for i, (place, raw) in enumerate(self._findings.each((*path, "hears"), step.hears)):
            with self._surviving():
                pieces = noted.text(f"hears{i}", place, raw)
                read = tuple(piece if isinstance(piece, str) else self._probe(piece) for piece in pieces)
                yield LinePlan(read, self._findings.at(place, width=len(raw)))

    def _states(self, path: DataPath, step: DialogueStep, noted: NotedValues) -> Iterator[ClaimPlan]:
        """That members are in states, as `wizard.is(acquainted)` says it."""
        for member, state in step.state.items():
            place = (*path, "state", member)
            with self._surviving():
                self._check_member(place, member)
                called = ast.Call("is", (ast.Name(state),), ast.Name(member))
                scope = step_scope(place)
                term = self._resolver.value(called, BOOL, scope)
                sited = SitedTerm(term, scope.draws.site, self._findings.at(place))
                probe = self._probe(noted.value(f"state.{member}", sited))
                yield ClaimPlan(f"{member}.is({state})", True, probe, sited.span, (member,), state)

    def _check_member(self, path: DataPath, member: str) -> None:
        known = [name for name in self._resolver.symbols.cast if name in self._resolver.frames]
        if member in self._resolver.symbols.cast:
            return
        near = did_you_mean(member, known)
        hint = None if near else f"members with states are {', '.join(known) or 'none'}"
        span = self._findings.places.key_span(path)
        raise self._findings.no_such(
            member, f"`{member}` is no member of the cast", span, suggestion=near, hint=hint
        )

    def _claim(
        self, part: str, path: DataPath, raw: Expression, expected: bool, noted: NotedValues
    ) -> ClaimPlan:
        condition = noted.condition(path, raw)
        symbols = self._resolver.symbols
        named = (
            part.id for part in self._findings.expression(path, raw).walk() if isinstance(part, ast.Name)
        )
        members = [m for name in named for m in symbols.groups.get(name, (name,)) if m in symbols.cast]
        probe = self._probe(noted.value(part, condition))
        words = " ".join(str(raw).split())
        span = self._findings.at(path, width=len(str(raw)))
        return ClaimPlan(words, expected, probe, span, tuple(dict.fromkeys(members)))

    def _probe(self, value: Drawn) -> ProbePlan:
        """What asks for a value when a step is done."""
        name = value.path.removeprefix("probes.")
        remembered = self._resolver.registers.remembered_in(value)
        self._probes.append(ProbePlan(name, value.value.span, None, (), value, (), remembered))
        return self._probes[-1]
