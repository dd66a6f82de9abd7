"""The pictures of a data sheet: rooms of a scenario at the start of an episode, and what a dilemma pays."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from socialai_dsl.checking.loaded import Loaded
    from socialai_dsl.program import Program

_SEED: Final = 0
_GAP: Final = 16
_COLUMNS: Final = 3
_BACKGROUND: Final = 255


def picture(loaded: "Loaded") -> "NDArray[np.uint8]":
    """The largest room of a scenario, or one of each member of a suite, uint8 (H, W, 3); always the same."""
    import numpy as np

    from socialai_dsl.compilation import compile_loaded
    from socialai_dsl.program_suite import ProgramSuite

    playable = compile_loaded(loaded)
    if not isinstance(playable, ProgramSuite):
        return _room(playable)
    rooms = [_room(program) for program in playable.programs]
    side = max(max(room.shape[:2]) for room in rooms)
    padded = [_padded(room, side) for room in rooms]
    padded += [np.full_like(padded[0], _BACKGROUND)] * (-len(padded) % _COLUMNS)
    rows = [np.concatenate(padded[i : i + _COLUMNS], axis=1) for i in range(0, len(padded), _COLUMNS)]
    return np.concatenate(rows, axis=0)


def _room(program: "Program") -> "NDArray[np.uint8]":
    from socialai_dsl.envs import ScenarioEnv
    from socialai_dsl.program import Header

    env = ScenarioEnv(program, render_mode="rgb_array")
    h = program.header
    size = {"width": h(Header.CANVAS_WIDTH), "height": h(Header.MIN_HEIGHT) + h(Header.HEIGHTS) - 1}
    try:
        env.reset(seed=_SEED, options={"layout": {"room": size}})
        drawn: NDArray[np.uint8] = env.render()
    finally:
        env.close()
    return drawn


def _padded(room: "NDArray[np.uint8]", side: int) -> "NDArray[np.uint8]":
    import numpy as np

    whole = np.full((side + _GAP, side + _GAP, 3), _BACKGROUND, np.uint8)
    y, x = ((side + _GAP - length) // 2 for length in room.shape[:2])
    whole[y : y + room.shape[0], x : x + room.shape[1]] = room
    return whole


def diagram(name: str, figures: Mapping[str, Any]) -> "NDArray[np.uint8]":
    """The Schelling diagram of measured figures, uint8 (H, W, 3)."""
    import io

    import numpy as np
    from PIL import Image

    from socialai_dsl.reporting.dilemma import dilemma_figure
    from socialai_dsl.reporting.records import SchellingRecord
    from socialai_dsl.reporting.style import saved

    drawn = saved(dilemma_figure(name, SchellingRecord.model_validate(figures)), "png")
    with Image.open(io.BytesIO(drawn)) as image:
        return np.asarray(image.convert("RGB"))
