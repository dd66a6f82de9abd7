"""Whether and when an agent that perceives everything it can may know what its success depends on.

Of each room *alternatives* are drawn that differ from it in one draw (and in what follows from it), or in what chance
does during the episode; others differ in any number of draws and look like the room while it is solved (`alike`).
Where a success of the room is none in an alternative that looks the same, the agent has to know which of the two it is
in. It can if something that it does makes the two look or sound different while both can still be solved, or if one
sequence of actions solves both (`guessing`). All else is known to the agent then, so this is what the best informed
agent can do; what stays hidden to it stays hidden to all.

A script shows it at once: if it solves both, and acts otherwise only after they look different.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.alike import Lookalikes, like_first
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.facts import RoomFacts
from socialai_dsl.analysis.guessing import Guessing, GuessingVerdict
from socialai_dsl.analysis.redrawn import Site, names_of_sites, redrawn_each
from socialai_dsl.analysis.relevance import Relevance
from socialai_dsl.analysis.rooms import DrawnRooms, Plan
from socialai_dsl.analysis.search import Search, SearchVerdict, marks
from socialai_dsl.engine.state import Key
from socialai_dsl.envs.table import Start
from socialai_dsl.program import Program

CHANCE: Final = "chance during the episode"
TOGETHER: Final = "a combination of draws"

_COPIES: Final = 6
"""How many alternatives are drawn for each draw."""

_TRIED: Final = 2
"""How many of them are tried in which the success of the room is none."""


class Knowability(Enum):
    """What an agent can know in a room."""

    ALL = "all"
    NOTHING_TO_KNOW = "nothing to know"  # all alternatives are solved alike, or look different from the start
    HIDDEN = "hidden"
    NO_SUCCESS = "no success"
    UNDECIDED = "undecided"


_FROM_BEST: Final = (
    Knowability.NOTHING_TO_KNOW,
    Knowability.ALL,
    Knowability.UNDECIDED,
    Knowability.HIDDEN,
)


@dataclass(frozen=True)
class RoomKnown:
    """What an agent can know in one room.

    Attributes:
        known: whether it can know all that its success depends on.
        step: after which it can know all that is asked for, in a way that was found.
        hidden: what stays hidden, and after which step it shows when it is too late; None: never.
        alike: how many of the rooms drawn beside it, which may differ in any number of draws, look like it until it is
            solved in the way that was tried.
    """

    known: Knowability
    step: int = 0
    hidden: Mapping[str, int | None] | None = None
    alike: int = 0


@dataclass(frozen=True)
class _Other:
    """An alternative of a room: its number, what it differs in, and how it begins."""

    row: int
    name: str
    start: Start


class Knowing:
    """Looks at rooms one after the other.

    Args:
        rooms: the rooms, with what is known of them.
        effort: how much is tried.
        scripted: the program of the same scenario with a frame for the agent, if there is one.
    """

    def __init__(self, rooms: RoomFacts, effort: Effort, scripted: Program | None = None) -> None:
        self._rooms, self._effort = rooms, effort
        program = rooms.program
        named = [(site, name) for site, name in names_of_sites(rooms.checked, program).items() if name]
        self._drawn = [name for _, name in named for _ in range(_COPIES)]
        sites = [site for site, _ in named]
        self._redrawn = DrawnRooms([program, *redrawn_each(program, sites, _COPIES)])
        self._relevance = Relevance.of(program)
        self._chances = marks(1 + _COPIES)[1:] if self._relevance.chance else marks(1)[1:]
        self._script = None if scripted is None else _Script(scripted, sites, self._chances, effort)
        self._playing = DrawnRooms.numbered(program, max(1, len(self._drawn) + len(self._chances)), 0)
        self._search = Search(program)
        self._pair = Guessing(program, np.ones(2, np.int64))
        self._lookalikes = Lookalikes(program, effort.rooms, effort.seed)

    def look_at(self, room: int) -> RoomKnown:
        """What an agent can know in a room."""
        played = None if self._script is None else self._script.play(room)
        plan = None if played is None else played.plan
        if plan is None:
            found = self._rooms.success(room, self._effort)
            if found.verdict is SearchVerdict.UNSOLVABLE:
                return RoomKnown(Knowability.NO_SUCCESS)
            if found.verdict is SearchVerdict.UNDECIDED:
                return RoomKnown(Knowability.UNDECIDED)
            plan = found.plan
        others = self._others(room)
        if plan is None:
            return self._compared(room, others, [], {})
        solved = self._solved(others, plan)
        others = [other for other, alike in zip(others, solved, strict=True) if not alike]
        by_one = self._compared(room, others, [plan], {} if played is None else played.known)
        if by_one.known is Knowability.HIDDEN:
            return by_one
        solved_too, misled = self._lookalikes.followed(room, plan)
        others = [_Other(number, TOGETHER, self._lookalikes.start(number)) for number in misled[:_TRIED]]
        by_more = self._compared(room, others, [plan], {})
        worst = max(by_one, by_more, key=lambda one: _FROM_BEST.index(one.known))
        step = max(by_one.step, by_more.step)
        return replace(worst, step=step, alike=len(solved_too) + len(misled))

    def _compared(
        self, room: int, others: Sequence[_Other], plans: Sequence[Plan], followed: Mapping[int, int]
    ) -> RoomKnown:
        """What can be known of a room among alternatives, some of which a script may be followed in (`ScriptRun`)."""
        step, hidden, undecided = None, dict[str, int | None](), False
        for name, tried in _by_name(others):
            for other in tried[:_TRIED]:
                if (known := followed.get(other.row)) is not None:
                    step = max(step or 0, known) or None
                    continue
                guess = self._pair.solve(*self._both(room, other), self._effort, plans, surely=True)
                if guess.answer in (GuessingVerdict.KNOWS, GuessingVerdict.TELLS_APART) and guess.exact:
                    step = max(step or 0, guess.step or 0)
                    continue
                alone = self._alone(other)
                if alone is SearchVerdict.SOLVABLE and guess.answer is GuessingVerdict.GUESSES:
                    hidden[name] = guess.step
                elif alone is not SearchVerdict.UNSOLVABLE:
                    undecided = True
        if hidden:
            return RoomKnown(Knowability.HIDDEN, step or 0, hidden)
        if undecided:
            return RoomKnown(Knowability.UNDECIDED)
        return RoomKnown(Knowability.NOTHING_TO_KNOW if step is None else Knowability.ALL, step or 0)

    def _alone(self, other: _Other) -> SearchVerdict:
        """Whether a player that knows all of an alternative can solve it."""
        return self._search.solve(*other.start, self._effort.states, self._effort.clock).verdict

    def _others(self, room: int) -> list[_Other]:
        """The alternatives of a room that begin otherwise and look the same."""
        drawn, table = self._redrawn, self._redrawn.table
        drawn.draw(self._effort.seed, room)
        width = len(self._rooms.start(room).registers)
        relevant = self._relevance.of_rows(table.state.registers[:, :width])
        different = (relevant != relevant[0]).any(axis=1)
        others = [
            _Other(row, self._drawn[row - 1], drawn.start(row))
            for row in np.flatnonzero(like_first(table)[0] & different).tolist()
        ]
        registers, board, key = self._rooms.start(room)
        for row, mark in enumerate(self._chances.tolist(), table.rows):
            other = key.copy()
            other[Key.KEY] ^= np.uint64(mark)
            others.append(_Other(row, CHANCE, Start(registers, board, other)))
        return others

    def _solved(self, others: Sequence[_Other], plan: Plan) -> NDArray[np.bool_]:
        """In which alternatives a plan succeeds as well."""
        self._playing.put([other.start for other in others])
        self._playing.play(plan)
        return self._playing.won[: len(others)]

    def _both(self, room: int, other: _Other) -> Start:
        """The room and an alternative: registers (2, R), boards (2, C), keys (2, Key.WORDS)."""
        registers, board, key = self._rooms.start(room)
        its_registers, its_board, its_key = other.start
        return Start(
            np.stack([registers, its_registers[: len(registers)]]),
            np.stack([board, its_board[: len(board)]]),
            np.stack([key, its_key]),
        )


@dataclass(frozen=True)
class ScriptRun:
    """A script's actions in a room and its alternatives.

    Attributes:
        plan: its actions in the room; None if it does not succeed there.
        known: rows of alternatives in which it succeeds as well, and does what it does in the room until they look
            different; with the step after which they do, 0 where it does the same in both throughout.
    """

    plan: Plan | None
    known: Mapping[int, int]


def followed(drawn: DrawnRooms) -> ScriptRun:
    """Let the script play a room that was just drawn in row 0, and alternatives in the rows beside it."""
    table, step = drawn.table, 0
    looks, acts = np.full(table.rows, -1), np.full(table.rows, -1)
    plan: list[NDArray[np.int64]] = []
    while True:
        ended = drawn.ended
        differs = (ended != ended[0]) | ~like_first(table)[0]
        looks[differs & (looks < 0)] = step
        if ended.all():
            break
        actions = table.scripted_actions()
        acts[(actions != actions[0]).any(axis=1) & (acts < 0)] = step
        if not ended[0]:
            plan.append(actions[0].copy())
        drawn.do(actions)
        step += 1
    solved = drawn.won
    if not solved[0]:
        return ScriptRun(None, {})
    same = acts < 0
    fair = np.flatnonzero(solved & (same | ((looks >= 0) & (looks <= acts)))).tolist()
    return ScriptRun(plan, {row: 0 if same[row] else int(looks[row]) for row in fair if row})


class _Script:
    """The agent's own frame, which knows what is drawn, in rooms and their alternatives.

    Where it acts otherwise in an alternative only after that looks different, an agent that knows no more than it
    perceives can do the same.
    """

    def __init__(
        self, program: Program, sites: Sequence[Site], chances: NDArray[np.uint64], effort: Effort
    ) -> None:
        self._drawn = DrawnRooms([program, *redrawn_each(program, sites, _COPIES), *[program] * len(chances)])
        self._chances, self._seed = chances, effort.seed

    def play(self, room: int) -> ScriptRun:
        """Play the room and all alternatives to the end."""
        self._drawn.draw(self._seed, room)
        table = self._drawn.table
        table.state.keys[table.rows - len(self._chances) :, Key.KEY] ^= self._chances
        return followed(self._drawn)


def _by_name(others: Sequence[_Other]) -> Iterator[tuple[str, list[_Other]]]:
    """Alternatives by what they differ in."""
    names: dict[str, list[_Other]] = {}
    for other in others:
        names.setdefault(other.name, []).append(other)
    yield from names.items()
