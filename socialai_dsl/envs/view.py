"""The agent's view as words and as pictures of letters."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.library import types_by_code
from socialai_dsl.program import VIEW
from socialai_dsl.render import tiles
from socialai_dsl.render.gestures import Gesture, gesture_shown
from socialai_dsl.render.grid import draw_ansi, letters
from socialai_dsl.vocabulary import COLORS

_UP: Final = 3
_LOOKS: Final = 4
"""Channels that say what things look like; those behind them are gestures."""


@dataclass(frozen=True)
class View:
    """The view as a player sees it: the agent stands at the bottom and looks up.

    Args:
        image: uint8 (7, 7, C), as in the observation.
        facing: where the agent looks, 0 right, 1 down, 2 left, 3 up.
        egocentric: whether directions of NPCs are given as seen from the agent.
    """

    image: NDArray[np.uint8]
    facing: int
    egocentric: bool

    @property
    def text(self) -> str:
        """The view as text with escape codes."""
        return draw_ansi(self.codes, (VIEW // 2, VIEW - 1, _UP), colour=True)

    @property
    def figures(self) -> list[str]:
        """One line for each NPC in view that points or has done something, as `Av 2 ahead, 1 left: did toggle`."""
        lines = []
        for (column, row), gesture in self.gestures.items():
            if not gesture.words:
                continue
            aside, before = column - VIEW // 2, VIEW - 1 - row
            side = f", {abs(aside)} {'right' if aside > 0 else 'left'}" if aside else ""
            lines.append(f"{letters(self.codes, row, column)} {before} ahead{side}: {gesture.words}")
        return lines

    @property
    def codes(self) -> NDArray[np.uint8]:
        """The cells by row and column, with directions as they are on the screen."""
        codes = np.ascontiguousarray(self.image[..., :_LOOKS].transpose(1, 0, 2))
        npcs = codes[..., 0] == tiles.NPC
        rolling = np.isin(codes[..., 0], [code for code, type_ in types_by_code().items() if type_.rolls])
        codes[npcs, 3] = (codes[npcs, 3] + self._turn) % 4
        codes[rolling, 3] = (codes[rolling, 3] + _UP - self.facing) % 4
        return codes

    @property
    def gestures(self) -> dict[tuple[int, int], Gesture]:
        """(column, row) -> what the NPC there shows, with directions as they are on the screen."""
        if self.image.shape[-1] <= _LOOKS:
            return {}
        found = {}
        for row, column in np.argwhere(self.image[..., 0].T == tiles.NPC).tolist():
            gesture = gesture_shown(*map(int, self.image[column, row, _LOOKS:]))
            pointing = None if gesture.pointing is None else (gesture.pointing + self._turn) % 4
            found[column, row] = gesture._replace(pointing=pointing)
        return found

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
