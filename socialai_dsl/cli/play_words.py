"""This module puts what the agent sees into words and pictures of letters."""

from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.envs import tiles
from socialai_dsl.envs.render import draw_ansi
from socialai_dsl.library import prelude
from socialai_dsl.program import COLORS, VIEW
from socialai_dsl.semantics.terms import ObjectType

_UP: Final = 3


def view_text(view: NDArray[np.uint8]) -> str:
    """The view, uint8 (7, 7, C), as text with escape codes; the agent stands at the bottom and looks up."""
    codes = np.ascontiguousarray(view[..., :4].transpose(1, 0, 2))
    return draw_ansi(codes, (VIEW // 2, VIEW - 1, _UP), colour=True)


def ahead(view: NDArray[np.uint8]) -> str:
    """What lies or stands in front of the agent, in a few words."""
    kind, colour, status = (int(value) for value in view[VIEW // 2, VIEW - 2, :3])
    if kind in (tiles.UNSEEN, tiles.EMPTY):
        return "nothing"
    if kind == tiles.NPC:
        return f"somebody, {COLORS[colour % len(COLORS)]}"
    found = _types().get(kind)
    if found is None:
        return "something"
    if len(found.states) == 1:
        return found.name.replace("_", " ")
    state = found.states[min(status, len(found.states) - 1)]
    return f"{COLORS[colour % len(COLORS)]} {found.name.replace('_', ' ')}, {state}"


@cache
def _types() -> dict[int, ObjectType]:
    return {found.code: found for found in prelude().types.values()}
