"""A lower bound on success without others, by twins that look alike to an agent that perceives no NPC.

A scenario that is meant to need social skill is solved only by luck where the NPCs are neither seen nor heard. How
good that luck is can be bounded from below by a policy that is found by search:

1. A room is drawn. Its *twins* are rooms that are drawn again in everything that its looks leave open: the agent sees
   the same walls, objects and colours in all of them, and stands in the same place. What is visible is the whole room,
   not only what is in view, so the policy knows no less than any explorer.
2. For some of the twins a shortest success is searched, the way an agent would go that knew all about this twin. Each
   is a sequence of actions; the one that solves most of these twins is the policy for all rooms that look like this.
3. It is tried on other twins, which had no part in choosing it. So its success is an unbiased estimate of what this
   policy gets, and what the best policy gets is not less.

Which draws the looks leave open is found out by trying: each site of a draw (`draws.py`) is drawn again by itself. If
that ever changes the state of the room and not its looks, the draw is hidden. If it always shows, it is a part of the
looks and stays as it is. Draws during the episode are made anew in every twin, since nobody could know them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.redrawn import redrawn, redrawn_each, sites_of
from socialai_dsl.analysis.relevance import Relevance
from socialai_dsl.analysis.rooms import DrawnRooms, Plan
from socialai_dsl.analysis.search import Search, SearchVerdict
from socialai_dsl.envs.table import Start, Table
from socialai_dsl.program import FIRST_ENTITY, Field, Header, Program

LEARNT_FROM: Final = 32
"""The most twins of a room that choose its policy; at most a quarter of them do."""

TRIED_ON: Final = 96
"""The most further twins that the policy is tried on."""

_BLOCK: Final = 512
_BLOCKS: Final = 16
"""The most twins of a block; those that look otherwise are left out."""

_SEARCHES: Final = 8
"""The most twins of a room for which a success is searched."""

_FEWEST: Final = 8
"""With fewer twins nothing is known about a room, which then counts as never solved."""

_ROOMS_PER_SITE: Final = 32


@dataclass(frozen=True)
class Alone:
    """The success of a policy that neither sees nor hears an NPC.

    Attributes:
        success: mean over the rooms of the share of twins that the policy for their looks solves.
        error: standard error of that mean.
        rooms: how many rooms were tried.
        undecided: how many of them count as never solved because too few twins were found, or a search gave up.
    """

    success: float
    error: float
    rooms: int
    undecided: int


def success_alone(hidden: Program, effort: Effort) -> Alone:
    """Bound from below what is possible without the NPCs.

    Args:
        hidden: the program of the scenario with its NPCs neither seen nor heard.
        effort: which rooms are drawn, and how many states of each twin may be searched.
    """
    twins, search = _Twins(hidden, effort.seed), Search(hidden)

    def solved(room: int) -> float | None:
        count = twins.draw(room, LEARNT_FROM + TRIED_ON)
        plans = _plans(twins, search, count // 4, effort) if count >= _FEWEST else None
        return None if plans is None else _share(plans, count // 4)

    found = list(effort.each_room("without NPCs", solved, lambda share: share is not None))
    values = np.array([share or 0.0 for share in found] or [0.0])
    undecided = sum(share is None for share in found)
    return Alone(float(values.mean()), float(values.std() / np.sqrt(len(values))), len(found), undecided)


def _plans(twins: _Twins, search: Search, learnt: int, effort: Effort) -> list[NDArray[np.bool_]] | None:
    """Of plans that together solve the first twins, `learnt` of them, as far as they can be: whom each solves, (K,).

    None if a search gave up and nothing was found.
    """
    found: list[NDArray[np.bool_]] = []
    left, gave_up = list(range(learnt)), False
    for _ in range(_SEARCHES):
        if not left:
            break
        finding = search.solve(*twins.start_of(left[0]), effort.states, effort.clock)
        gave_up |= finding.verdict is SearchVerdict.UNDECIDED
        wins = np.zeros(len(twins), np.bool_) if finding.plan is None else twins.play(finding.plan)
        if wins.any():
            found.append(wins)
        left = [k for k in left[1:] if not wins[k]]
    return None if gave_up and not found else found


def _share(found: Sequence[NDArray[np.bool_]], learnt: int) -> float:
    """How many of the later twins that plan solves that solves most of the first ones, `learnt` of them."""
    if not found:
        return 0.0
    return float(max(found, key=lambda wins: int(wins[:learnt].sum()))[learnt:].mean())


class _Twins:
    """The twins of one room after the other. Each is played by a copy of the program with other draws."""

    def __init__(self, program: Program, seed: int) -> None:
        self._program, self._seed = program, seed
        canvas = program.header(Header.CANVAS_WIDTH) * program.header(Header.CANVAS_HEIGHT)
        self._cells = slice(0, canvas)
        showing = self._showing()
        self._hidden = {site for site, shows in zip(sites_of(program), showing, strict=True) if not shows}
        self._blocks: list[DrawnRooms] = []
        self._twins: list[tuple[int, int]] = []  # block, row

    def __len__(self) -> int:
        return len(self._twins)

    def draw(self, room: int, wanted: int) -> int:
        """Draw twins of a room until enough look like it, itself among them; the number found."""
        self._twins, looks = [], None
        for number in range(_BLOCKS):
            block = self._block(number)
            block.draw(self._seed, room)
            looks_here = self._looks(block.table)
            looks = looks_here[0] if looks is None else looks
            alike = np.flatnonzero((looks_here == looks).all(axis=1))
            self._twins += [(number, row) for row in alike.tolist()]
            if len(self._twins) >= wanted:
                break
        del self._twins[wanted:]
        return len(self._twins)

    def start_of(self, twin: int) -> Start:
        """How a twin begins."""
        block, row = self._twins[twin]
        return self._blocks[block].start(row)

    def play(self, plan: Plan) -> NDArray[np.bool_]:
        """Do the same in all twins; which of them succeed, (K,)."""
        solved = []
        for number in sorted({block for block, _ in self._twins}):
            rows, block = [row for own, row in self._twins if own == number], self._blocks[number]
            block.restart(rows)
            block.play(plan)
            solved.append(block.won[rows])
        return np.concatenate(solved)

    def _block(self, number: int) -> DrawnRooms:
        """The rooms of a block; the first row of the first block plays the program as it is."""
        if number == len(self._blocks):
            salts = range(number * _BLOCK, (number + 1) * _BLOCK)
            self._blocks.append(DrawnRooms([redrawn(self._program, self._hidden, salt) for salt in salts]))
        return self._blocks[number]

    def _looks(self, table: Table) -> NDArray[np.int64]:
        """What a room looks like to whoever sees no NPC, (rows, cells + 3): its cells, and where the agent stands."""
        registers = table.state.registers
        pose = registers[:, [FIRST_ENTITY + field for field in (Field.X, Field.Y, Field.DIR)]]
        return np.concatenate([table.state.boards[:, self._cells].astype(np.int64), pose], axis=1)

    def _showing(self) -> NDArray[np.bool_]:
        """Which sites show whenever they change anything, (sites,)."""
        sites = self._program.header(Header.SITES)
        drawn = DrawnRooms([self._program, *redrawn_each(self._program, sites_of(self._program), 1)])
        relevant = Relevance.of(self._program).registers
        shows, hides = np.zeros(sites, np.bool_), np.zeros(sites, np.bool_)
        for room in range(_ROOMS_PER_SITE):
            drawn.draw(self._seed, room)
            looks, registers = self._looks(drawn.table), drawn.table.state.registers[:, relevant]
            seen = (looks[1:] != looks[0]).any(axis=1)
            shows |= seen
            hides |= (registers[1:] != registers[0]).any(axis=1) & ~seen
        return shows & ~hides
