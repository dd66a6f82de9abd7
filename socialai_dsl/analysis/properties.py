"""Tries the claims of a scenario, one function for each property of `check`, in drawn rooms.

A claim rests on the rooms in which it says anything. One that rests on none fails, and says what there was nothing of.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.advance import compiled
from socialai_dsl.analysis.alike import like_first
from socialai_dsl.analysis.dilemma import schelling
from socialai_dsl.analysis.effort import Effort, OutOfTimeError
from socialai_dsl.analysis.facts import RoomFacts
from socialai_dsl.analysis.guessing import Guess, Guessing, GuessingVerdict
from socialai_dsl.analysis.knowable import TOGETHER, Knowability, Knowing, RoomKnown, followed
from socialai_dsl.analysis.leaks import Script, Tellers, TwinComparison, Twins
from socialai_dsl.analysis.muting import muted
from socialai_dsl.analysis.perceiving import PerceptionResult, perceived
from socialai_dsl.analysis.reports import (
    SHOWN,
    Evidence,
    Report,
    Verdict,
    by_share,
    names_text,
    rooms_text,
    steps_text,
)
from socialai_dsl.analysis.rooms import DrawnRooms, Plan, name_of, random_actions, rooms_by_draw
from socialai_dsl.analysis.search import Finding, Search, SearchVerdict
from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.envs.told_apart import Value
from socialai_dsl.frontend import rival_of
from socialai_dsl.program import Program
from socialai_dsl.semantics.plans import OutcomePlan, PropertyPlan
from socialai_dsl.semantics.terms import Const, InState, SaidBy, walk
from socialai_dsl.semantics.typed import typed
from socialai_dsl.source import Span

_HOLDS: Final = "the property holds"
"""Name of the outcome that ends an episode of the copy in which a condition is looked for."""

_AS_TRIED: Final = " (chance during the episode, such as which way somebody turns, was tried only in part)"
RIVAL_ROOMS: Final = 500
"""In how many rooms a rival plays, at least."""
_PORTIONS: Final = 8
"""Of how many parts of the rooms one is looked at first, where all of them may take too long."""
_OF_ITSELF: Final = "a success happens while the agent does nothing"


class Trial:
    """A scenario whose claims are tried.

    Args:
        loaded: the scenario.
        effort: how much to try; each claim may have an effort of its own.
        scripted: the same scenario with a frame for the agent, if there is one.
    """

    def __init__(
        self, loaded: LoadedScenario, effort: Effort, scripted: LoadedScenario | None = None
    ) -> None:
        self.loaded, self.effort = loaded, effort
        self.program = compile_loaded(loaded)
        self.script = scripted
        self.scripted = None if scripted is None else compile_loaded(scripted)
        self._rivals: dict[str, NDArray[np.bool_]] = {}

    @cached_property
    def rooms(self) -> RoomFacts:
        """The rooms, with what is known of each."""
        return RoomFacts(self.loaded.checked, self.program, self.effort)

    @cached_property
    def solved(self) -> NDArray[np.bool_]:
        """In which rooms the script succeeds, (rooms,); in none if there is no script. Keeps to the time that limits
        it (`Clock.limiting`).
        """
        if self.scripted is None:
            return np.zeros(self.effort.rooms, np.bool_)
        return solved_by_script(self.scripted, self.effort)

    def solved_by(self, rival: str) -> NDArray[np.bool_]:
        """In which rooms a rival succeeds, (max(rooms, RIVAL_ROOMS),): to play costs next to nothing. Keeps to the time
        that limits it (`Clock.limiting`).
        """
        if rival not in self._rivals:
            more = replace(self.effort, rooms=max(self.effort.rooms, RIVAL_ROOMS))
            self._rivals[rival] = solved_by_script(compiled(rival_of(self.loaded, rival)), more)
        return self._rivals[rival]

    def successes(self, effort: Effort, what: str) -> Iterator[Finding]:
        """A shortest success of room after room."""
        return effort.each_room(what, lambda room: self.rooms.success(room, effort), _is_decided)

    def check(self, plan: PropertyPlan, effort: Effort) -> Report:
        """Try one property, with the same rooms, for as long as the clock of the effort says."""
        found = self._check(plan, effort)
        with suppress(OutOfTimeError):
            return found.told_apart(self._rooms_apart)
        return found

    @cached_property
    def _rooms_apart(self) -> Mapping[Value, NDArray[np.int64]]:
        """The numbers of the rooms, those of rivals among them, by the draws by whose values results are told apart."""
        return rooms_by_draw(self.loaded, max(self.effort.rooms, RIVAL_ROOMS), self.effort.seed)

    def _check(self, plan: PropertyPlan, effort: Effort) -> Report:
        if plan.unasked:
            return Report(Verdict.UNASKED, 0, 0, 0, (), plan.unasked, 0)
        match plan.kind:
            case "reachable" | "never":
                return _reaching(self, plan, effort)
            case "within":
                return _within(self, plan, effort)
            case "oracle":
                return _oracle(self, plan, effort)
            case "script":
                return _script(self, plan, effort)
            case "rival":
                return _rival(self, plan)
            case "needs":
                return _needs(self, plan, effort)
            case "only_through":
                return _only_through(self, plan, effort)
            case "knowable":
                return _knowable(self, plan, effort)
            case "dilemma":
                return _dilemma(self, plan)


def by_default(loaded: LoadedScenario, span: Span) -> tuple[PropertyPlan, ...]:
    """The properties that are tried of a scenario: what it claims, and that its success is knowable.

    An agent that is not to perceive the NPCs is a control, and a dilemma is about what is paid: of these nothing is
    tried that is not claimed.
    """
    plans = loaded.checked.properties
    if loaded.checked.npcs_hidden or any(plan.kind in ("knowable", "dilemma") for plan in plans):
        return plans
    return (*plans, PropertyPlan("knowable", "knowable: true", span))


def _reaching(trial: Trial, plan: PropertyPlan, effort: Effort) -> Report:
    """Of `reachable` and `never`: in which rooms something can be made true."""
    program, goals = trial.program, plan.goals
    if plan.condition is not None:
        program, goals = _with_goal(trial.loaded, plan), (_HOLDS,)
    findings = list(search_rooms_of(program, goals, effort, plan.text))
    tally = Evidence()
    named = {"agent", *_named(trial, plan)}
    for room, finding in enumerate(findings):
        missing = trial.rooms.missing(room, named)
        if missing and finding.verdict is not SearchVerdict.SOLVABLE:
            tally.void.setdefault(f"`{missing[0]}` is absent", []).append(room)
            continue
        if plan.kind == "never" and finding.verdict is SearchVerdict.UNSOLVABLE and finding.states == 1:
            tally.void.setdefault("every episode ends at once, or nothing in it changes", []).append(room)
            continue
        came = finding.verdict is SearchVerdict.SOLVABLE
        rooms = tally.held if came is (plan.kind == "reachable") else tally.against
        (tally.undecided if finding.verdict is SearchVerdict.UNDECIDED else rooms).append(room)
    reached = [k for k, finding in enumerate(findings) if finding.verdict is SearchVerdict.SOLVABLE]
    exact = all(finding.exact or finding.verdict is SearchVerdict.UNDECIDED for finding in findings)
    said = f"it can happen in {len(reached)} of {rooms_text(tally.rests)}"
    if tally.undecided:
        said += f", {len(tally.undecided)} undecided"
    if plan.kind == "reachable":
        return tally.report(said + ("" if exact else _AS_TRIED), plan.share)
    if reached:
        said += f"; in room {reached[0]} after {steps_text(findings[reached[0]].steps)}"
        acts = _acts(trial.program, effort, reached[0], findings[reached[0]].plan or ())
        found = tally.report(said, 1.0)
        return replace(found, verdict=Verdict.FAILS, against=tuple(reached[:SHOWN]), acts=acts)
    return tally.report(said + ("" if exact else _AS_TRIED), 1.0)


def _acts(program: Program, effort: Effort, room: int, plan: Plan) -> tuple[str, ...]:
    """What a plan does in a room, as it is typed; nothing once the time is over."""
    drawn = DrawnRooms([program])
    found: list[str] = []
    with suppress(OutOfTimeError):
        drawn.draw(effort.seed, room)
        for action in plan:
            drawn.do(action)
            last = drawn.table.describe(0)["last"]
            found.append(typed(last["action"], last["said"]))
    return tuple(found) if len(found) == len(plan) else ()


def _named(trial: Trial, plan: PropertyPlan) -> Iterator[str]:
    """The members of the cast and objects that a condition is about by name."""
    checked = trial.loaded.checked
    for part in walk(plan.condition) if plan.condition is not None else ():
        match part:
            case Const() if part.type.kind == "entity" and 0 <= part.value < len(checked.entities):
                yield name_of(checked, part.value)
            case InState(member=member):
                yield member
            case SaidBy(entity=number):
                yield name_of(checked, number)


def _within(trial: Trial, plan: PropertyPlan, effort: Effort) -> Report:
    idle = trial.rooms.solved_by_idling
    findings = list(trial.successes(effort, plan.text))
    tally = Evidence()
    for room, finding in enumerate(findings):
        if idle[room]:
            tally.void.setdefault(_OF_ITSELF, []).append(room)
        elif finding.verdict is SearchVerdict.UNDECIDED:
            tally.undecided.append(room)
        elif finding.steps is not None and finding.steps <= plan.steps:
            tally.held.append(room)
        else:
            tally.against.append(room)
    known = [finding.steps for finding in findings if finding.steps is not None]
    most = steps_text(plan.steps)
    said = f"a shortest success takes at most {most} in {len(tally.held)} of {rooms_text(tally.rests)}"
    if known:
        said += f", {max(known)} in the longest that can be solved"
    elif tally.rests and not tally.undecided:
        said = f"no success can be reached in any of {rooms_text(tally.rests)}"
    return tally.report(said, 1.0 if plan.share is None else plan.share)


def _is_decided(finding: Finding) -> bool:
    return finding.verdict is not SearchVerdict.UNDECIDED


def _with_goal(loaded: LoadedScenario, plan: PropertyPlan) -> Program:
    """The scenario as it ends as soon as a condition holds."""
    checked = loaded.checked
    assert plan.condition is not None, "internal: there is a condition to look for"
    goal = OutcomePlan(_HOLDS, False, 0, plan.condition)
    remembered = tuple({drawn.path: drawn for drawn in (*checked.remembered, *plan.remembered)}.values())
    copy = replace(checked, outcomes=(goal, *checked.outcomes), remembered=remembered)
    return compiled(replace(loaded, checked=copy))


def search_rooms_of(
    program: Program, goals: Sequence[str] | None, effort: Effort, what: str
) -> Iterator[Finding]:
    """Search each room of the effort for one of the goals, names of outcomes; None: for a success."""
    drawn = DrawnRooms.numbered(program, effort.rooms, effort.seed)
    search = Search(program, goals)

    def find(room: int) -> Finding:
        return search.solve(*drawn.start(room), effort.states, effort.clock)

    return effort.each_room(what, find, _is_decided)


# --- by playing ---

_NOBODY_PLAYS: Final = Report(
    Verdict.FAILS,
    0,
    0,
    0,
    (),
    "nobody plays: the agent has no frame, and there is no variant `oracle`",
    0,
)


def _oracle(trial: Trial, plan: PropertyPlan, effort: Effort) -> Report:
    assert plan.share is not None, "internal: an oracle has a share"
    if trial.scripted is None:
        return _NOBODY_PLAYS
    won, idle = trial.solved, trial.rooms.solved_by_idling
    said = f"its own script solves {won.sum()} of {rooms_text(effort.rooms)}"
    against = tuple(np.flatnonzero(~won).tolist()[:SHOWN])
    verdict = Verdict.HOLDS if won.mean() >= max(plan.share, 1 / len(won)) - 1e-9 else Verdict.FAILS
    rests = int((~idle).sum())
    if not rests:
        said = f"no room tests it: in all of {rooms_text(effort.rooms)} {_OF_ITSELF}"
        return Report(Verdict.FAILS, effort.rooms, int(won.sum()), 0, against, said, 0)
    if idle.any():
        said += f"; in {int(idle.sum())} of them {_OF_ITSELF}"
    solved = dict(enumerate(won.tolist()))
    return Report(verdict, effort.rooms, int(won.sum()), 0, against, said, rests, so=solved)


def _rival(trial: Trial, plan: PropertyPlan) -> Report:
    """Whether a strategy that lacks the skill fails often enough."""
    assert plan.share is not None, "internal: a rival has a share"
    won = trial.solved_by(plan.rival)
    said = f"it solves {won.mean():.0%} of {rooms_text(len(won))}"
    if trial.scripted is not None:
        said += f", the scenario's own script {trial.solved.mean():.0%} of {rooms_text(len(trial.solved))}"
    if trial.rooms.solved_by_idling.all():
        said = f"no room tests it: in all of {rooms_text(trial.effort.rooms)} {_OF_ITSELF}"
        return Report(Verdict.FAILS, len(won), 0, 0, (), said, 0)
    if trial.scripted is not None and trial.solved.mean() <= plan.share:
        said = f"no room tests it: the script does not solve more; {said}"
        return Report(Verdict.FAILS, len(won), 0, 0, (), said, 0)
    verdict = Verdict.HOLDS if won.mean() <= plan.share + 1e-9 else Verdict.FAILS
    against = tuple(np.flatnonzero(won).tolist()[:SHOWN])
    solved = dict(enumerate(won.tolist()))
    return Report(verdict, len(won), int((~won).sum()), 0, against, said, len(won), so=solved)


def _dilemma(trial: Trial, plan: PropertyPlan) -> Report:
    """Whether each gains by defecting, and all lose by it."""
    rooms = trial.effort.rooms
    found = schelling(trial.loaded, plan.frames, rooms, trial.effort.seed)
    verdict = Verdict.HOLDS if found.is_dilemma else Verdict.FAILS
    held = rooms if found.is_dilemma else 0
    return Report(verdict, rooms, held, 0, (), str(found), rooms, schelling=found)


def _script(trial: Trial, plan: PropertyPlan, effort: Effort) -> Report:
    """Whether the script acts on what it has perceived alone."""
    if trial.script is None:
        return _NOBODY_PLAYS
    rooms, found = _perceived_in(trial.script, effort)
    divided = [number for one in found.divisions for number in one.others]
    # Of the rooms that were drawn beside those that were asked for, the first will do.
    divided = [number for number in divided if number < rooms] or sorted(divided)[:1]
    against = sorted({*(peek.index for peek in found.peeks), *divided})
    held = rooms - len(against)
    if found.pairs == found.groups == 0:
        said = "no room tests it: no two rooms look alike at first"
        return Report(Verdict.FAILS, rooms, 0, 0, (), said, 0)
    said = f"in {held} of {rooms_text(rooms)} the script acts on what it has perceived alone"
    said += f" ({found.pairs} pairs of rooms that look alike and differ in one draw, "
    said += f"{found.groups} groups that differ in any)"
    for one in (*found.peeks, *found.divisions)[:1]:
        said += f"; {one}"
    share = 1.0 if plan.share is None else plan.share
    verdict = by_share(held, 0, rooms, share)
    return Report(verdict, rooms, held, 0, tuple(against[:SHOWN]), said, rooms, found.pairs)


def _perceived_in(script: LoadedScenario, effort: Effort) -> tuple[int, PerceptionResult]:
    """In how many rooms it is known what the script acts on: in a few of them, and in all if there is time.

    Raises:
        OutOfTimeError: there was no time for the few, or no two of them look alike.
    """
    if effort.clock.left is None:
        return effort.rooms, perceived(script, effort.rooms, effort.seed)
    rooms = max(1, effort.rooms // _PORTIONS)
    found = perceived(script, rooms, effort.seed)
    try:
        return effort.rooms, perceived(script, effort.rooms, effort.seed)
    except OutOfTimeError:
        if found.pairs == found.groups == 0:
            raise  # of so few it says nothing that no two look alike
    return rooms, found


def solved_by_script(program: Program, effort: Effort) -> NDArray[np.bool_]:
    """In which rooms of the effort the agent's own frame succeeds, (rooms,)."""
    drawn = DrawnRooms.numbered(program, effort.rooms, effort.seed)
    drawn.play_scripts()
    return drawn.won


def _only_through(trial: Trial, plan: PropertyPlan, effort: Effort) -> Report:
    program = trial.program
    ((path, weighted),) = plan.draws
    values = _pairs_of(sorted(set(weighted)), effort)

    def twins() -> Twins:
        return Twins(program, trial.loaded.checked, path, values, plan.members, effort.seed)

    compared = [twins().play(random_actions(program, effort.rooms, effort.seed))]
    if trial.scripted is not None:
        script = Script(trial.scripted, path, values[:, 0].tolist(), effort.seed)
        compared.append(twins().play(script))
    if not any(one.rooms for one in compared):
        compared += _searched_for(twins, trial, values, effort)
    return _told(compared, trial, plan, effort)


def _searched_for(
    twins: Callable[[], Twins], trial: Trial, values: NDArray[np.int64], effort: Effort
) -> Iterator[TwinComparison]:
    """Pairs of episodes in which a search finds a difference that neither chance nor a script came upon."""
    pair = Guessing(trial.program, np.ones(2, np.int64))

    def find(room: int) -> Plan | None:
        return pair.first_difference(*twins().start(room), replace(effort, states=_SEARCHED_STATES))

    few = replace(effort, rooms=min(effort.rooms, _SEARCHED_ROOMS))
    for plan in few.each_room("only_through", find, lambda plan: plan is not None):
        if plan is not None:
            yield twins().play(partial(_repeated, plan, len(values)))
            return


def _repeated(plan: Plan, pairs: int, step: int) -> NDArray[np.int64]:
    """What a plan does in a step, in all pairs; after its end it goes on with its last action."""
    return np.tile(plan[min(step, len(plan) - 1)], (pairs, 1))


_SEARCHED_ROOMS: Final = 8
_SEARCHED_STATES: Final = 5_000


def _pairs_of(values: Sequence[int], effort: Effort) -> NDArray[np.int64]:
    """Two different values for each room."""
    generator = np.random.default_rng(effort.seed)
    return np.array([generator.choice(values, 2, replace=False) for _ in range(effort.rooms)], np.int64)


def _told(compared: Sequence[TwinComparison], trial: Trial, plan: PropertyPlan, effort: Effort) -> Report:
    pairs = sum(one.pairs for one in compared)
    leaks = [leak for one in compared for leak in one.leaks]
    cued = sum(one.cued for one in compared)
    said = f"of {pairs} pairs of episodes {cued} differ first in a cue and {len(leaks)} in something else"
    against = tuple(dict.fromkeys(leak.index for leak in leaks))
    if leaks:
        leak = min(leaks, key=lambda one: one.step)
        said += f"; room {leak.index} differs after {steps_text(leak.step)} between {leak.values[0]} and "
        said += f"{leak.values[1]}, in {names_text(leak.by)}"
    elif not cued:
        absent = [
            k for k in range(effort.rooms) if len(trial.rooms.missing(k, plan.members)) == len(plan.members)
        ]
        said = f"no room tests it: none of {pairs} pairs of episodes differ in anything"
        said += f"; in {rooms_text(len(absent))} none of the members is there" if absent else ""
    verdict = Verdict.FAILS if leaks or not cued else Verdict.HOLDS
    held = effort.rooms - len(against) if verdict is Verdict.HOLDS or leaks else 0
    rests = len({index for one in compared for index in one.rooms})
    return Report(verdict, effort.rooms, held, 0, against[:SHOWN], said, rests, cued + len(leaks))


# --- without some of the cast ---

_KNOWN: Final = {
    GuessingVerdict.GUESSES: "in {} an agent can only guess",
    GuessingVerdict.KNOWS: "in {} an agent can do without them",
    GuessingVerdict.TELLS_APART: "in {} something else is a cue, so they may not be needed: name it, too, or hide it",
    GuessingVerdict.UNDECIDED: "in {} it is undecided",
}
_NO_SUCCESS: Final = "no success is possible"
_NEAR: Final = 8_000
"""The number of states in which a success without the members is looked for first."""

_ALWAYS_A_GUESS: Final = "an agent can only guess even with them"


def _needs(trial: Trial, plan: PropertyPlan, effort: Effort) -> Report:
    needing = _Needing(trial, plan, effort)
    tally, counted, exact = Evidence(), Counter[GuessingVerdict](), True
    found = effort.each_room(plan.text, needing.in_room, lambda one: one[0] is not GuessingVerdict.UNDECIDED)
    for room, (answer, is_exact) in enumerate(found):
        if isinstance(answer, str):
            tally.void.setdefault(answer, []).append(room)
            continue
        counted[answer] += 1
        exact = exact and (is_exact or answer is not GuessingVerdict.GUESSES)
        open_ = answer in (GuessingVerdict.UNDECIDED, GuessingVerdict.TELLS_APART)
        (
            tally.held if answer is GuessingVerdict.GUESSES else tally.undecided if open_ else tally.against
        ).append(room)
    said = ", ".join(
        words.format(rooms_text(counted[answer])) for answer, words in _KNOWN.items() if counted[answer]
    )
    said += "" if needing.told is None else f"; {needing.told}"
    return tally.report(said + ("" if exact else _AS_TRIED), 1.0 if plan.share is None else plan.share)


_LEFT: Final = {
    Knowability.ALL: GuessingVerdict.KNOWS,
    Knowability.NOTHING_TO_KNOW: GuessingVerdict.KNOWS,
    Knowability.UNDECIDED: GuessingVerdict.UNDECIDED,
}
"""What an agent is left with where nothing that success depends on stays hidden, or it is not found out."""


class _Needing:
    """What is left without some members, in room after room, and whether there is more with them."""

    def __init__(self, trial: Trial, plan: PropertyPlan, effort: Effort) -> None:
        self._trial, self._plan, self._effort = trial, plan, effort
        self._muted = muted(trial.loaded.checked, plan.members)
        self._silent = silent = compiled(replace(trial.loaded, checked=self._muted))
        self._search = Search(silent)
        self._alone = DrawnRooms.numbered(silent, effort.rooms, effort.seed)
        self._without = [_Draw(silent, path, weighted) for path, weighted in plan.draws]
        self._with: dict[int, _Draw] = {}
        self._scripted: dict[int, _Draw | None] = {}
        self._tellers = Tellers(silent, trial.loaded.checked)
        self.told: str | None = None
        """Who or what else tells, in the first room of which that is known."""

    def in_room(self, room: int) -> tuple[GuessingVerdict | str, bool]:
        """The best answer that any of the draws gives, and whether it is exact; in words why a room says nothing."""
        missing = self._trial.rooms.missing(room, ("agent", *self._plan.members))
        if missing:
            return f"`{missing[0]}` is absent", True
        finding = self._alone_in(room, min(_NEAR, self._effort.states))
        if finding.verdict is SearchVerdict.UNSOLVABLE:
            return self._with_them(room, finding)
        found = [draw.guess(room, self._effort) for draw in self._without]
        # Without anything to be guessed a success is known by heart.
        best = min(
            found, key=lambda guess: _ORDER.index(guess.answer), default=Guess(GuessingVerdict.KNOWS, 0, True)
        )
        if best.answer is GuessingVerdict.GUESSES:
            return self._better_than_a_guess(room, found.index(best)), best.exact
        if finding.verdict is SearchVerdict.UNDECIDED and (
            best.answer is GuessingVerdict.UNDECIDED or not found
        ):
            finding = self._alone_in(room, self._effort.states)
            if finding.verdict is SearchVerdict.UNSOLVABLE:
                return self._with_them(room, finding)
            if finding.verdict is SearchVerdict.UNDECIDED:
                return GuessingVerdict.UNDECIDED, False
        if best.answer is GuessingVerdict.TELLS_APART and self.told is None:
            told = self._without[found.index(best)].told(room, self._effort, self._tellers)
            self.told = None if told is None else f"in room {room} {told}"
        if best.answer is GuessingVerdict.KNOWS and self._plan.any_draw:
            return self._by_other_draws(room, finding)
        return best.answer, best.exact

    def _by_other_draws(self, room: int, alone: Finding) -> tuple[GuessingVerdict | str, bool]:
        """Whether a draw without a name, such as where things lie, stays hidden without them, and only without them."""
        known = self._knowing_alone.look_at(room).known
        if known is Knowability.NO_SUCCESS:
            return self._with_them(room, alone)
        if known is not Knowability.HIDDEN:
            return _LEFT[known], True
        with_them = self._knowing.look_at(room).known
        if with_them is Knowability.HIDDEN:
            return _ALWAYS_A_GUESS, True
        undecided = with_them is Knowability.UNDECIDED
        return GuessingVerdict.UNDECIDED if undecided else GuessingVerdict.GUESSES, True

    @cached_property
    def _knowing_alone(self) -> Knowing:
        return Knowing(RoomFacts(self._muted, self._silent, self._effort), self._effort)

    @cached_property
    def _knowing(self) -> Knowing:
        return Knowing(self._trial.rooms, self._effort, self._trial.scripted)

    def _alone_in(self, room: int, states: int) -> Finding:
        """Whether a success can be reached without them."""
        return self._search.solve(*self._alone.start(room), states, self._effort.clock)

    def _with_them(self, room: int, alone: Finding) -> tuple[GuessingVerdict | str, bool]:
        """Nobody succeeds without them; with them?"""
        if self._trial.solved[room]:
            return GuessingVerdict.GUESSES, alone.exact
        verdict = self._trial.rooms.success(room, self._effort).verdict
        if verdict is SearchVerdict.UNSOLVABLE:
            return _NO_SUCCESS, True
        return (
            GuessingVerdict.GUESSES if verdict is SearchVerdict.SOLVABLE else GuessingVerdict.UNDECIDED
        ), alone.exact

    def _better_than_a_guess(self, room: int, number: int) -> GuessingVerdict | str:
        """A guess without them says something only if there is more than that with them."""
        path, weighted = self._plan.draws[number]
        if number not in self._with:
            self._with[number] = _Draw(self._trial.program, path, weighted)
            scripted = self._trial.scripted
            self._scripted[number] = None if scripted is None else _Draw(scripted, path, weighted)
        script = self._scripted[number]
        if script is not None and script.is_told(room, self._effort):
            return GuessingVerdict.GUESSES
        guess = self._with[number].guess(room, self._effort)
        if guess.answer is GuessingVerdict.UNDECIDED:
            return GuessingVerdict.UNDECIDED
        if guess.answer is not GuessingVerdict.GUESSES:
            return GuessingVerdict.GUESSES
        solvable = self._trial.rooms.success(room, self._effort).verdict is not SearchVerdict.UNSOLVABLE
        return _ALWAYS_A_GUESS if solvable else _NO_SUCCESS


_ORDER: Final = (
    GuessingVerdict.GUESSES,
    GuessingVerdict.UNDECIDED,
    GuessingVerdict.TELLS_APART,
    GuessingVerdict.KNOWS,
)


_TURNS: Final = 4
"""The most values of a draw that are compared with the others."""


class _Draw:
    """A draw, with a room for each of its values."""

    def __init__(self, program: Program, path: str, weighted: Sequence[int]) -> None:
        weights = Counter(weighted)
        self._path, self._values, self._weights = path, list(weights), list(weights.values())
        self._drawn, self._program = DrawnRooms([program], len(weights)), program

    @cached_property
    def _guessing(self) -> Guessing:
        return Guessing(self._program, np.array(self._weights, np.int64))

    def is_told(self, room: int, effort: Effort) -> bool:
        """Whether the agent's own frame solves more than a guess, and does nothing that it could not know is right."""
        for first in range(min(len(self._values), _TURNS)):
            values = [*self._values[first:], *self._values[:first]]
            weights = [*self._weights[first:], *self._weights[:first]]
            self._drawn.draw_with(effort.seed, room, self._path, values)
            known = followed(self._drawn).known
            if any(weights[0] + weights[row] > max(weights) for row in known):
                return True
        return False

    def guess(self, room: int, effort: Effort) -> Guess:
        """How well a room can be solved, whatever its draw."""
        self._drawn.draw_with(effort.seed, room, self._path, self._values)
        if not like_first(self._drawn.table).all():
            return Guess(GuessingVerdict.TELLS_APART, 0, True)
        return self._guessing.solve(*self._drawn.starts(slice(None)), effort)

    def told(self, room: int, effort: Effort, tellers: Tellers) -> str | None:
        """The first difference between the rooms of this draw, in words; None if none is found."""
        drawn, table = self._drawn, self._drawn.table
        drawn.draw_with(effort.seed, room, self._path, self._values)
        plan: Plan | None = ()
        if like_first(table).all():
            few = replace(effort, states=_SEARCHED_STATES)
            plan = self._guessing.first_difference(*drawn.starts(slice(None)), few)
        if plan is None:
            return None
        before = table.state.registers.copy()
        for action in plan:
            before = table.state.registers.copy()
            drawn.do(action)
        same = like_first(table)[0]
        if same.all():
            return None
        names = names_text(tellers.between(table, (0, int(same.argmin())), before))
        return f"it is {names}, after {steps_text(len(plan))}"


# --- what can be known ---


def _knowable(trial: Trial, plan: PropertyPlan, effort: Effort) -> Report:
    # What takes time comes first: once the time is over, nothing is played any more, and what was found would be lost.
    idle = trial.rooms.solved_by_idling
    knowing = Knowing(trial.rooms, effort, trial.scripted)
    found = list(
        effort.each_room(plan.text, knowing.look_at, lambda one: one.known is not Knowability.UNDECIDED)
    )
    # Where a combination of draws stays hidden, rooms that were compared with no other by it say nothing.
    combined = any(TOGETHER in (one.hidden or ()) for one in found)
    found = [_undecided(one) if combined and not one.alike else one for one in found]
    tally = Evidence()
    for room, one in enumerate(found):
        why = _NO_SUCCESS if one.known is Knowability.NO_SUCCESS else None
        if trial.rooms.missing(room, ("agent",)):
            why = "the agent is absent"
        elif idle[room]:
            why = _OF_ITSELF
        if why is not None:
            tally.void.setdefault(why, []).append(room)
        elif one.known is Knowability.UNDECIDED:
            tally.undecided.append(room)
        else:
            is_so = (one.known is not Knowability.HIDDEN) is plan.expected
            (tally.held if is_so else tally.against).append(room)
    said = _said_of(found)
    if any(one.known is Knowability.ALL for one in found):
        said += _AMONG_OTHERS.format(sum(one.alike > 0 for one in found) or "none")
    return tally.report(said, 1.0 if plan.share is None else plan.share)


_AMONG_OTHERS: Final = "; {} of them look at first like rooms that differ in several draws"


def _undecided(known: RoomKnown) -> RoomKnown:
    """What is known of a room that was compared with too few others."""
    certain = known.known in (Knowability.HIDDEN, Knowability.NO_SUCCESS)
    return known if certain else replace(known, known=Knowability.UNDECIDED)


def _said_of(found: Collection[RoomKnown]) -> str:
    """What can be known, by when, and what stays hidden."""
    known = [one.step for one in found if one.known is Knowability.ALL]
    nothing = sum(one.known is Knowability.NOTHING_TO_KNOW for one in found)
    hidden: dict[str, list[int | None]] = {}
    for one in found:
        for name, step in (one.hidden or {}).items():
            hidden.setdefault(name, []).append(step)
    parts = [
        f"{name} stays hidden {_until(steps)} in {rooms_text(len(steps))}" for name, steps in hidden.items()
    ]
    if known:
        parts.append(f"in {rooms_text(len(known))} everything can be known, within {steps_text(max(known))}")
    if nothing:
        parts.append(f"in {rooms_text(nothing)} success depends on nothing hidden")
    undecided = sum(one.known is Knowability.UNDECIDED for one in found)
    if undecided:
        parts.append(f"in {rooms_text(undecided)} it is undecided")
    return ", ".join(parts)


def _until(steps: Sequence[int | None]) -> str:
    """When something shows that was to be known before."""
    late = [step for step in steps if step is not None]
    return (
        "to the end" if len(late) < len(steps) else f"until it is too late (step {min(late)} at the earliest)"
    )
