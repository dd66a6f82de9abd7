"""The agent's view as words and as pictures of letters."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.library import types_by_code
from socialai_dsl.program import GESTURES, NO_GESTURE, VIEW, unpack_held
from socialai_dsl.render import tiles
from socialai_dsl.render.gestures import Gesture, gesture_shown
from socialai_dsl.render.grid import draw_ansi, letters, own_hands, thing_words
from socialai_dsl.render.marks import LookWords, Marks, mark_words, marks_of
from socialai_dsl.render.tiles import Code
from socialai_dsl.vocabulary import COLORS

_UP: Final = 3
_OWN: Final = (VIEW // 2, VIEW - 1)
EMPTY_LOOK: Final = (tiles.EMPTY, 0, 0, 0)
_LOOKS: Final = 4
"""Channels that say what things look like; those behind them are gestures."""


@dataclass(frozen=True)
class View:
    """The view as a player sees it: the agent stands at the bottom and looks up.

    Args:
        image: uint8 (7, 7, C), as in the observation.
        facing: where the agent looks, 0 right, 1 down, 2 left, 3 up.
        egocentric: whether directions of NPCs are given as seen from the agent.
        channels: names of the channels.
        looks: words of those that are looks.
    """

    image: NDArray[np.uint8]
    facing: int
    egocentric: bool
    channels: tuple[str, ...]
    looks: LookWords

    @property
    def text(self) -> str:
        """The view as text with escape codes."""
        return draw_ansi(self.codes, (VIEW // 2, VIEW - 1, _UP), colour=True)

    @property
    def figures(self) -> list[str]:
        """One line for each NPC in view that points, has done or carries something, for each thing or NPC that has
        looks, and one for the agent's own hands.

        `Av 2 ahead, 1 left: did toggle`, `you carry a red ball, rb`.
        """
        gestures, held, marks, lines = self.gestures, self.held, self.marks, []
        own, own_marks = held.pop(_OWN, None), marks.pop(_OWN, ())
        for column, row in dict.fromkeys((*gestures, *held, *marks)):
            gesture = gestures.get((column, row))
            said = [gesture.words] if gesture is not None and gesture.words else []
            said += [mark_words(marks[column, row])] if (column, row) in marks else []
            said += [f"carries {thing_words(held[column, row])}"] if (column, row) in held else []
            if not said:
                continue
            aside, before = column - VIEW // 2, VIEW - 1 - row
            side = f", {abs(aside)} {'right' if aside > 0 else 'left'}" if aside else ""
            lines.append(f"{letters(self.codes, row, column)} {before} ahead{side}: {', '.join(said)}")
        return [*lines, own_hands(own, own_marks)] if own is not None else lines

    @property
    def codes(self) -> NDArray[np.uint8]:
        """The cells by row and column, with directions as they are on the screen."""
        codes = np.ascontiguousarray(self.image[..., :_LOOKS].transpose(1, 0, 2))
        npcs = codes[..., 0] == tiles.NPC
        rolling = np.isin(codes[..., 0], [code for code, type_ in types_by_code().items() if type_.rolls])
        codes[npcs, 3] = (codes[npcs, 3] + self._turn) % 4
        codes[rolling, 3] = (codes[rolling, 3] + _UP - self.facing) % 4
        codes[_OWN[1], _OWN[0]] = EMPTY_LOOK
        return codes

    @property
    def gestures(self) -> dict[tuple[int, int], Gesture]:
        """(column, row) -> what the NPC there shows, with directions as they are on the screen."""
        if "pointing" not in self.channels:
            return {}
        found = {}
        shown = [self.channels.index(name) for name in GESTURES if name in self.channels]
        for row, column in np.argwhere(self.image[..., 0].T == tiles.NPC).tolist():
            gesture = gesture_shown(*map(int, self.image[column, row, shown]))
            pointing = None if gesture.pointing is None else (gesture.pointing + self._turn) % 4
            found[column, row] = gesture._replace(pointing=pointing)
        return found

    @property
    def held(self) -> dict[tuple[int, int], Code]:
        """(column, row) -> what the agent or the NPC there carries; of NPCs only type and colour are seen."""
        found: dict[tuple[int, int], Code] = {}
        kind, colour, status, orientation = (int(value) for value in self.image[*_OWN, :_LOOKS])
        if kind != tiles.EMPTY:
            found[_OWN] = (kind, colour, status, orientation)
        if "carrying" in self.channels:
            carrying = self.image[..., self.channels.index("carrying")]
            for column, row in np.argwhere(carrying != NO_GESTURE).tolist():
                found[column, row] = (*unpack_held(int(carrying[column, row])), 0, 0)
        return found

    @property
    def marks(self) -> dict[tuple[int, int], Marks]:
        """(column, row) -> the looks of what is seen there; at the agent's own place, of what it carries."""
        if not self.looks:
            return {}
        shown = self.image[..., [self.channels.index(name) for name in self.looks]]
        places = np.argwhere((shown != NO_GESTURE).any(axis=2).T).tolist()
        return {(column, row): marks_of(self.looks, shown[column, row].tolist()) for row, column in places}

    @property
    def _turn(self) -> int:
        """What is added to the direction of an NPC to have it as on the screen."""
        return 1 if self.egocentric else _UP - self.facing


def ahead(view: NDArray[np.uint8]) -> str:
    """The thing or member in front of the agent, in a few words."""
    kind, colour, status = (int(value) for value in view[VIEW // 2, VIEW - 2, :3])
    if kind in (tiles.UNSEEN, tiles.EMPTY):
        return "nothing"
    if kind == tiles.NPC:
        return f"somebody, {COLORS[colour % len(COLORS)]}"
    found = types_by_code().get(kind)
    if found is None:
        return "something"
    if len(found.states) == 1:
        return found.name.replace("_", " ")
    state = found.states[min(status, len(found.states) - 1)]
    return f"{COLORS[colour % len(COLORS)]} {found.name.replace('_', ' ')}, {state}"
