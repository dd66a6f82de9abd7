"""Whether what a scenario claims about itself is so: each entry of `check`, tried in rooms that are drawn."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking import LoadedScenario
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.engine.calls import Task
from socialai_dsl.envs.guessing import Answer, Guess, Guessing
from socialai_dsl.envs.muting import muted
from socialai_dsl.envs.perceiving import perceived
from socialai_dsl.envs.search import Finding, Search
from socialai_dsl.envs.search import Verdict as Searched
from socialai_dsl.envs.table import Table
from socialai_dsl.envs.twins import Compared, Script, Twins, alike, layouts, random_actions
from socialai_dsl.program import Program, Register
from socialai_dsl.semantics.terms import OutcomePlan, PropertyPlan

_HOLDS: Final = "the property holds"
"""Name of the outcome that ends an episode of the copy in which a condition is looked for."""

_AS_TRIED: Final = " (chance during the episode was tried only in part)"
_SHOWN: Final = 5


class Verdict(Enum):
    """Whether a property holds."""

    HOLDS = "holds"
    FAILS = "fails"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Report:
    """What was found out about one property.

    Attributes:
        verdict: undecided where a search gave up, or where rooms can be told apart and more was not tried.
        rooms: how many were tried. held: in how many it is so. undecided: in how many nothing was decided.
        against: numbers of the first rooms that speak against it: `reset(seed=..., options={"index": number})`.
        said: what was found, in words.
    """

    verdict: Verdict
    rooms: int
    held: int
    undecided: int
    against: tuple[int, ...]
    said: str


@dataclass(frozen=True)
class Effort:
    """How much is tried: rooms 0, 1, ... of a seed, and so many states of each."""

    rooms: int = 200
    seed: int = 0
    states: int = 50_000


def check_property(
    loaded: LoadedScenario, plan: PropertyPlan, effort: Effort, scripted: LoadedScenario | None = None
) -> Report:
    """Try one property.

    Args:
        loaded: the scenario.
        plan: one of its `checked.properties`.
        effort: how much to try.
        scripted: the same scenario with a frame for the agent, if there is one.
    """
    match plan.kind:
        case "reachable" | "never":
            return _reaching(loaded, plan, effort)
        case "within":
            return _within(loaded, plan, effort)
        case "oracle":
            return _oracle(plan, effort, scripted)
        case "script":
            return _script(plan, effort, scripted)
        case "needs":
            return _needs(loaded, plan, effort)
        case "only_through":
            return _only_through(loaded, plan, effort, scripted)


# --- by search ---


def _reaching(loaded: LoadedScenario, plan: PropertyPlan, effort: Effort) -> Report:
    """Of `reachable` and `never`: in which rooms something can be made true."""
    program, goals = compile_loaded(loaded), plan.goals
    if plan.condition is not None:
        program, goals = _with_goal(loaded, plan), (_HOLDS,)
    findings = list(search_rooms_of(program, goals, effort))
    reached = [k for k, finding in enumerate(findings) if finding.verdict is Searched.SOLVABLE]
    undecided = sum(finding.verdict is Searched.UNDECIDED for finding in findings)
    exact = (
        ""
        if all(finding.exact or finding.verdict is Searched.UNDECIDED for finding in findings)
        else _AS_TRIED
    )
    said = f"it can come about in {len(reached)} of {effort.rooms} rooms"
    if undecided:
        said += f", {undecided} undecided"
    if plan.kind == "reachable":
        against = [k for k, finding in enumerate(findings) if finding.verdict is Searched.UNSOLVABLE]
        verdict = _by_share(len(reached), undecided, effort.rooms, plan.share)
        return Report(verdict, effort.rooms, len(reached), undecided, tuple(against[:_SHOWN]), said + exact)
    if reached:
        said += f"; in room {reached[0]} after {_steps(findings[reached[0]].steps)}"
        exact = ""
    verdict = Verdict.FAILS if reached else Verdict.UNDECIDED if undecided else Verdict.HOLDS
    held = effort.rooms - len(reached) - undecided
    return Report(verdict, effort.rooms, held, undecided, tuple(reached[:_SHOWN]), said + exact)


def _within(loaded: LoadedScenario, plan: PropertyPlan, effort: Effort) -> Report:
    findings = list(search_rooms_of(compile_loaded(loaded), None, effort))
    lengths = [finding.steps for finding in findings]
    held = sum(length is not None and length <= plan.steps for length in lengths)
    undecided = sum(finding.verdict is Searched.UNDECIDED for finding in findings)
    against = [
        k
        for k, finding in enumerate(findings)
        if finding.verdict is Searched.UNSOLVABLE or (finding.steps or 0) > plan.steps
    ]
    known = [length for length in lengths if length is not None]
    said = f"a shortest success takes at most {_steps(plan.steps)} in {held} of {effort.rooms} rooms"
    if known:
        said += f", {max(known)} in the longest that can be solved"
    share = 1.0 if plan.share is None else plan.share
    verdict = _by_share(held, undecided, effort.rooms, share)
    return Report(verdict, effort.rooms, held, undecided, tuple(against[:_SHOWN]), said)


def _with_goal(loaded: LoadedScenario, plan: PropertyPlan) -> Program:
    """The scenario as it ends as soon as a condition holds."""
    checked = loaded.checked
    assert plan.condition is not None, "internal: there is a condition to look for"
    goal = OutcomePlan(_HOLDS, False, 0, plan.condition)
    remembered = tuple({drawn.path: drawn for drawn in (*checked.remembered, *plan.remembered)}.values())
    copy = replace(checked, outcomes=(goal, *checked.outcomes), remembered=remembered)
    return compile_loaded(replace(loaded, checked=copy))


def search_rooms_of(program: Program, goals: Sequence[str] | None, effort: Effort) -> Iterator[Finding]:
    """Search each room of the effort for one of the goals, names of outcomes; None: for a success."""
    table = Table([program], effort.rooms, 1)
    table.reset(effort.seed, None)
    search, state = Search(program, goals), table.state
    for row in range(effort.rooms):
        yield search.solve(state.registers[row], state.boards[row], state.keys[row], effort.states)


def _steps(count: int | None) -> str:
    return f"{count} step" if count == 1 else f"{count} steps"


def _by_share(held: int, undecided: int, rooms: int, share: float | None) -> Verdict:
    """Whether enough rooms are as they should be; without a share one is enough."""
    needed = 1 if share is None else share * rooms - 1e-9
    if held >= needed:
        return Verdict.HOLDS
    return Verdict.UNDECIDED if held + undecided >= needed else Verdict.FAILS


# --- by playing ---

_NOBODY_PLAYS: Final = Report(
    Verdict.FAILS, 0, 0, 0, (), "nobody plays: the agent has no frame, and there is no variant `oracle`"
)


def _oracle(plan: PropertyPlan, effort: Effort, scripted: LoadedScenario | None) -> Report:
    assert plan.share is not None, "internal: an oracle has a share"
    if scripted is None:
        return _NOBODY_PLAYS
    won = solved_by_script(compile_loaded(scripted), effort)
    against = np.flatnonzero(~won).tolist()
    said = f"its own script solves {won.sum()} of {effort.rooms} rooms"
    verdict = Verdict.HOLDS if won.mean() >= plan.share - 1e-9 else Verdict.FAILS
    return Report(verdict, effort.rooms, int(won.sum()), 0, tuple(against[:_SHOWN]), said)


def _script(plan: PropertyPlan, effort: Effort, scripted: LoadedScenario | None) -> Report:
    """Whether the script acts on what it has perceived alone."""
    if scripted is None:
        return _NOBODY_PLAYS
    found = perceived(scripted, effort.rooms, effort.seed)
    against = list(dict.fromkeys(peek.index for peek in found.peeks))
    held = effort.rooms - len(against)
    if found.pairs == 0:
        said = "no two rooms look alike at first"
        return Report(Verdict.UNDECIDED, effort.rooms, 0, effort.rooms, (), said)
    said = f"in {held} of {effort.rooms} rooms the script acts on what it has perceived alone"
    said += f" ({found.pairs} pairs of rooms that look alike at first)"
    if found.peeks:
        said += f"; {found.peeks[0]}"
    share = 1.0 if plan.share is None else plan.share
    verdict = _by_share(held, 0, effort.rooms, share)
    return Report(verdict, effort.rooms, held, 0, tuple(against[:_SHOWN]), said)


def solved_by_script(program: Program, effort: Effort) -> NDArray[np.bool_]:
    """In which rooms of the effort the agent's own frame succeeds, (rooms,)."""
    table = Table([program], effort.rooms, 1)
    table.reset(effort.seed, None)
    registers = table.state.registers
    while not registers[:, Register.ENDED].all():
        table.batch.ports.actions[:] = table.scripted_actions()
        table.batch.step(Task.STEP_ONLY)
    wins = np.array([outcome.success for outcome in program.outcome_table])
    won: NDArray[np.bool_] = wins[registers[:, Register.OUTCOME]]
    return won


def _only_through(
    loaded: LoadedScenario, plan: PropertyPlan, effort: Effort, scripted: LoadedScenario | None
) -> Report:
    program = compile_loaded(loaded)
    ((path, weighted),) = plan.draws
    values = _pairs_of(sorted(set(weighted)), effort)
    compared = [
        _twins(program, loaded, plan, values, effort).play(random_actions(program, effort.rooms, effort.seed))
    ]
    if scripted is not None:
        script = Script(compile_loaded(scripted), path, values[:, 0].tolist(), effort.seed)
        compared.append(_twins(program, loaded, plan, values, effort).play(script))
    return _told(compared, effort)


def _twins(
    program: Program, loaded: LoadedScenario, plan: PropertyPlan, values: NDArray[np.int64], effort: Effort
) -> Twins:
    return Twins(program, loaded.checked, plan.draws[0][0], values, plan.members, effort.seed)


def _pairs_of(values: Sequence[int], effort: Effort) -> NDArray[np.int64]:
    """Two different values for each room."""
    generator = np.random.default_rng(effort.seed)
    return np.array([generator.choice(values, 2, replace=False) for _ in range(effort.rooms)], np.int64)


def _told(compared: Sequence[Compared], effort: Effort) -> Report:
    pairs = sum(one.pairs for one in compared)
    leaks = [leak for one in compared for leak in one.leaks]
    cued = sum(one.cued for one in compared)
    said = f"of {pairs} pairs of episodes {cued} differ first in a cue and {len(leaks)} in something else"
    against = tuple(dict.fromkeys(leak.index for leak in leaks))
    if leaks:
        leak = min(leaks, key=lambda one: one.step)
        said += f"; room {leak.index} differs after {_steps(leak.step)} between {leak.values[0]} and {leak.values[1]}"
    verdict = Verdict.FAILS if leaks else Verdict.HOLDS
    return Report(verdict, effort.rooms, effort.rooms - len(against), 0, against[:_SHOWN], said)


# --- without some of the cast ---

_KNOWN: Final = {
    Answer.GUESSES: "{} leave nothing but a guess",
    Answer.KNOWS: "in {} it can be known without",
    Answer.TELLS_APART: "in {} something else tells, and more may be made of it",
    Answer.UNDECIDED: "{} are undecided",
}


def _needs(loaded: LoadedScenario, plan: PropertyPlan, effort: Effort) -> Report:
    silent = compile_loaded(replace(loaded, checked=muted(loaded.checked, plan.members)))
    guesses = list(_guesses(silent, plan, effort))
    counted = Counter(guess.answer for guess in guesses)
    held = counted[Answer.GUESSES]
    open_ = counted[Answer.UNDECIDED] + counted[Answer.TELLS_APART]
    against = [k for k, guess in enumerate(guesses) if guess.answer is not Answer.GUESSES]
    said = ", ".join(
        words.format(f"{counted[answer]} rooms") for answer, words in _KNOWN.items() if counted[answer]
    )
    exact = "" if all(guess.exact for guess in guesses if guess.answer is Answer.GUESSES) else _AS_TRIED
    verdict = _by_share(held, open_, effort.rooms, 1.0 if plan.share is None else plan.share)
    return Report(verdict, effort.rooms, held, open_, tuple(against[:_SHOWN]), said + exact)


def _guesses(silent: Program, plan: PropertyPlan, effort: Effort) -> Iterator[Guess]:
    """For each room the best answer that any of the draws gives."""
    search = Search(silent)
    alone = Table([silent], effort.rooms, 1)
    alone.reset(effort.seed, None)
    tried = [_Draw(silent, path, weighted) for path, weighted in plan.draws]
    for room in range(effort.rooms):
        finding = search.solve(
            alone.state.registers[room], alone.state.boards[room], alone.state.keys[room], effort.states
        )
        if finding.verdict is Searched.UNSOLVABLE:
            yield Guess(Answer.GUESSES, finding.states, finding.exact)
            continue
        found = [draw.guess(room, effort) for draw in tried]
        # Without anything to be guessed a success is known by heart.
        yield min(found, key=lambda guess: _ORDER.index(guess.answer), default=Guess(Answer.KNOWS, 0, True))


_ORDER: Final = (Answer.GUESSES, Answer.UNDECIDED, Answer.TELLS_APART, Answer.KNOWS)


class _Draw:
    """A draw, with a room for each of its values."""

    def __init__(self, program: Program, path: str, weighted: Sequence[int]) -> None:
        weights = Counter(weighted)
        self._layouts = layouts(program, path, list(weights))
        self._table = Table([program], len(weights), 1)
        self._guessing = Guessing(program, np.array(list(weights.values()), np.int64))

    def guess(self, room: int, effort: Effort) -> Guess:
        """How well a room can be solved, whatever its draw."""
        self._table.reset(effort.seed, {"index": room, "layout": self._layouts})
        state = self._table.state
        if not alike(self._table, slice(None)):
            return Guess(Answer.TELLS_APART, 0, True)
        return self._guessing.solve(state.registers, state.boards, state.keys, effort.states)
