"""Whether the agent's script acts on its perceptions alone, by play in twins that look alike so far."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from socialai_dsl.analysis.advance import compiled
from socialai_dsl.analysis.alike import Division, divided, pairs_alike, without_unsaid
from socialai_dsl.analysis.rooms import DrawnRooms
from socialai_dsl.analysis.twins import draws_itself, pairs_of_rooms
from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.program import Program
from socialai_dsl.semantics.plans import CheckedScenario


@dataclass(frozen=True)
class Peek:
    """Two rooms in which the script acts otherwise although all that was perceived is alike.

    Attributes:
        index: of the first room. step: in which the script acts otherwise, from 1.
        draw: what was drawn otherwise, in words. values: in either room; empty for what is drawn during the episode.
    """

    index: int
    step: int
    draw: str
    values: tuple[Any, ...]

    def __str__(self) -> str:
        """In words: "in room 7 `let.exit`, doors[0] or doors[2], decides what it does in step 3, unperceived"."""
        values = f", {' or '.join(map(_shown, self.values))}," if self.values else ""
        draw = f"`{self.draw}`" if self.values else self.draw
        return f"in room {self.index} {draw}{values} decides what it does in step {self.step}, unperceived"


@dataclass(frozen=True)
class PerceptionResult:
    """The result of playing twins.

    Attributes:
        pairs: how many of them looked alike at first. peeks: those in which the script peeked.
        groups: how many groups of rooms that look alike were compared, whatever they differ in.
        divisions: those in which the script did not act alike.
    """

    pairs: int
    peeks: tuple[Peek, ...]
    groups: int = 0
    divisions: tuple[Division, ...] = ()


def perceived(scripted: LoadedScenario, rooms: int, seed: int) -> PerceptionResult:
    """Play the script in rooms 0 to rooms - 1 of a seed and in a twin for each draw of each room.

    In the twin that draw, and what follows from it, has another value. The script's actions for the first room are done
    in both until the two look or sound different or one of them ends. Then it plays many rooms, which may differ in any
    number of draws, and has to act alike in those that look and sound alike; not if it draws something itself.

    Args:
        scripted: a scenario with a frame for the agent.
        rooms: how many rooms.
        seed: of the rooms.
    """
    program = compiled(scripted)
    pairs, peeks = _in_twins(program, scripted.checked, rooms, seed)
    groups, divisions = (0, []) if draws_itself(scripted.checked) else divided(program, rooms, seed)
    divisions.sort(key=lambda one: (one.rooms, one.step))
    return PerceptionResult(pairs, tuple(peeks), groups, tuple(divisions))


def _in_twins(program: Program, checked: CheckedScenario, rooms: int, seed: int) -> tuple[int, list[Peek]]:
    """How many twins look alike at first, and where the script peeks in them."""
    pairs = list(pairs_of_rooms(program, checked, rooms, seed))
    if not pairs:
        return 0, []
    drawn = DrawnRooms([program], 2 * len(pairs))
    index = [number for pair in pairs for number in (pair.index, pair.twin_index)]
    given = [layout for pair in pairs for layout in (pair.layout, pair.twin)]
    drawn.draw(seed, index, given)
    running = pairs_alike(drawn.table)
    alike, peeks, step = int(running.sum()), list[Peek](), 0
    while running.any():
        step += 1
        actions = without_unsaid(drawn.table.scripted_actions())
        otherwise = running & (actions[0::2] != actions[1::2]).any(axis=1)
        for k in np.flatnonzero(otherwise).tolist():
            peeks.append(Peek(pairs[k].index, step, pairs[k].draw, pairs[k].values))
        running &= ~otherwise
        actions[1::2] = actions[0::2]
        drawn.do(actions)
        running &= ~drawn.ended.reshape(-1, 2).any(axis=1) & pairs_alike(drawn.table)
    return alike, sorted(peeks, key=lambda peek: (peek.index, peek.step))


def _shown(value: Any) -> str:
    """A value as one line of text."""
    if isinstance(value, dict):
        return " x ".join(map(_shown, value.values()))
    return f"[{', '.join(map(_shown, value))}]" if isinstance(value, list) else str(value)
