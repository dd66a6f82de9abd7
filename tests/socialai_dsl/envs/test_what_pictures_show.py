"""What an agent can tell apart, people can: in pictures, in films, in traces and in play, over all channels."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import socialai_dsl as sd
from socialai_dsl.cli.trace_text import present
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.envs.picture import frame
from socialai_dsl.episodes.film import film as film_of
from socialai_dsl.library import prelude
from socialai_dsl.loader.resolved import shipped_names
from socialai_dsl.play.game import Game
from socialai_dsl.program import GESTURES, LAST_ACTS, VIEW, Flag, Header
from socialai_dsl.render import tiles
from socialai_dsl.render.gestures import Gesture
from socialai_dsl.render.grid import draw_grid, figures
from socialai_dsl.render.tiles import draw_tile
from socialai_dsl.traces.state import cast_of
from tests.quick import one_in

SCENARIOS = Path(__file__).parents[3] / "scenarios"
PAPER = [name for name in shipped_names() if name != "social_env" and "+" not in name]
OTHERS = sorted(
    f"{path.parent.name}/{path.stem}"
    for path in SCENARIOS.glob("[ns]*/*.yaml")
    if path.read_text(encoding="utf-8").startswith("scenario:")
    and "abstract: true" not in path.read_text(encoding="utf-8")
)
CUES = [f"school/boxes+{cue}" for cue in ("color", "pointing", "feedback", "emulation", "scaffolding")]
NAMES = [name for name in (*PAPER, *OTHERS, *CUES) if not name.endswith(("_as_coded", "_oracle"))]
HANDS = Path(__file__).parents[2] / "data" / "hands"
AIMS = str(Path(__file__).parents[3] / "docs" / "cookbook" / "pointing_at_a_cell.yaml")
NAMES += [AIMS, f"{HANDS}.yaml", f"{HANDS}_and_gestures.yaml", f"{HANDS.parent / 'looks'}.yaml"]
STEPS, TILE, EDGE = 60, 32, 3
COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_ROOM = 348
"""So many columns of a film show the room."""
FORWARD = ((1, 0), (0, 1), (-1, 0), (0, -1))

Look = tuple[int, ...]
"""The channels of a cell, with directions as they are in the room."""


def acting(env: Any, seed: int) -> Iterator[NDArray[np.int64]]:
    """Actions by chance, most of them about things, so that much of what can be seen comes up."""
    random = np.random.default_rng(seed)
    sizes = env.action_space.nvec
    while True:
        action = random.integers(0, sizes, dtype=np.int64)
        if random.random() < 0.4:
            action[0] = list(env.unwrapped.program.actions).index("forward")
        yield action


def moments(env: Any) -> Iterator[dict[str, Any]]:
    """Observations of several episodes."""
    for seed in range(3):
        observation, _ = env.reset(seed=seed)
        yield observation
        for _, action in zip(range(STEPS), acting(env, seed), strict=False):
            observation, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                break
            yield observation


def in_the_room(look: Look, own: int, egocentric: bool) -> Look:
    """The channels of a cell with directions of NPCs as they are in the room."""
    if look[0] != tiles.NPC or not egocentric:
        return look
    kind, colour, status, orientation, *more = look
    turned = [(orientation - 2 + own) % 4]
    if len(more) > 1:
        pointing, act, *more = more
        turned.append(pointing if pointing == 255 else (pointing - 2 + own) % 4)
        turned.append(4 + (act - 4 - 2 + own) % 4 if 4 <= act < 8 else act)
    return (kind, colour, status, *turned, *more)


def looks(env: ScenarioEnv, image: NDArray[np.uint8]) -> Iterator[tuple[int, int, Look]]:
    """Column, row and channels of each cell that the agent sees; its own shows what it carries."""
    x, y, own = env.scene().agent
    width, height = env._table.room(0)
    # A cell that is pointed at is shown by a line across the room.
    own_channels = [k for k, name in enumerate(env.channels) if name not in GESTURES[2:]]
    egocentric = bool(env.program.header(Header.FLAGS) & Flag.EGOCENTRIC)  # type: ignore[union-attr]
    dx, dy = FORWARD[own]
    for across, along in product(range(VIEW), repeat=2):
        ahead, right = VIEW - 1 - along, across - VIEW // 2
        column, row = x + ahead * dx - right * dy, y + ahead * dy + right * dx
        look = tuple(image[across, along, own_channels].tolist())
        own_cell = not (ahead or right)
        if own_cell and look[0] == tiles.EMPTY:
            continue
        if look[0] != tiles.UNSEEN and 0 <= column < width and 0 <= row < height:
            seen = in_the_room(look, own, egocentric)
            yield column, row, (own, *seen) if own_cell else seen


@pytest.mark.parametrize("name", NAMES, ids=lambda name: Path(name).stem if name.endswith(".yaml") else name)
@pytest.mark.thorough("draws every step of many episodes")
def test_pictures_of_cells_that_differ_for_the_agent_differ(name: str) -> None:
    env: Any = sd.make(name, render_mode="rgb_array").unwrapped
    shown: dict[bytes, Look] = {}
    for observation in moments(env):
        picture = env.render()
        for column, row, look in looks(env, observation["image"]):
            cell = picture[row * TILE : (row + 1) * TILE, column * TILE : (column + 1) * TILE]
            inner = cell[EDGE:-EDGE, EDGE:-EDGE].tobytes()
            assert shown.setdefault(inner, look) == look, f"{look} is drawn like {shown[inner]}"
    assert len(shown) >= 3
    env.close()


@pytest.mark.parametrize("name", one_in(20, NAMES, "plays every scenario in four views"))
def test_texts_of_rooms_that_differ_for_the_agent_differ(name: str) -> None:
    """What `render` prints, what a trace shows, what a player has on the screen, and on that of the agent's view."""
    game = Game(name)
    env = game._env
    shown: list[dict[str, bytes]] = [{}, {}, {}, {}]
    for seed in range(3):
        game.begin("", {"seed": seed})
        for _, action in zip(range(STEPS), acting(env, seed), strict=False):
            image = game.now.view.tobytes()
            view = game.view()
            texts = [
                frame(env._table, 0, "ansi"),
                "\n".join([env.plain_text(), *present(cast_of(env.playing), env.describe())]),
                "\n".join([game.room(), view.text, *view.figures]),
                COLOURS.sub("", game.now.seen).partition("\nYou hear")[0],
            ]
            for known, text in zip(shown, texts, strict=True):
                assert known.setdefault(text, image) == image, f"not told apart:\n{text}"
            if game.now.ended is not None:
                break
            words = [*env.program.actions, None]
            game.act(words[int(action[0])], None)
    game.close()


@pytest.mark.parametrize(
    "name", ["talkitout", "school/boxes+pointing", "school/boxes+emulation", "school/marbles", AIMS]
)
@pytest.mark.thorough("draws every step of many episodes")
def test_films_show_what_pictures_show(name: str, tmp_path: Path) -> None:
    """A film has few colours; what the agent can tell apart has to be left."""
    env: Any = sd.make(name, render_mode="rgb_array").unwrapped
    observation, _ = env.reset(seed=0)
    images, actions = [observation["image"].tobytes()], []
    for action in acting(env, 0):
        observation, _, terminated, truncated, _ = env.step(action)
        actions.append(action)
        images.append(observation["image"].tobytes())
        if terminated or truncated:
            break
    episode = film_of(env, actions, {"seed": 0}, name)
    episode.save_film(tmp_path / "film.gif")
    shown: dict[bytes, bytes] = {}
    with Image.open(tmp_path / "film.gif") as film:
        # The caption says which step it is, so that no two frames are alike and made one.
        assert film.n_frames == len(images)  # type: ignore[attr-defined]
        for number, image in enumerate(images):
            film.seek(number)
            room = np.asarray(film.convert("RGB"))[:, :_ROOM].tobytes()
            assert shown.setdefault(room, image) == image, f"frame {number}"
    env.close()


def every_look() -> Iterator[tuple[tuple[int, int, int, int], Gesture | None]]:
    """Everything that a cell can look like: types in their statuses and colours, NPCs of the kinds that have a hat."""
    for type_ in prelude().types.values():
        for status, colour in product(range(len(type_.states)), range(6)):
            directions = range(4) if type_.name == "marble" and status else range(1)
            yield from (((type_.code, colour, status, direction), None) for direction in directions)
    gestures = [None, *(Gesture(p, act) for p, act in product([None, 0, 1, 2, 3], LAST_ACTS))]
    for kind, colour, direction, gesture in product(range(0, 24, 5), range(6), range(4), gestures):
        yield (tiles.NPC, colour, kind, direction), gesture


def test_whatever_a_cell_can_look_like_it_looks_like_nothing_else() -> None:
    drawn: dict[bytes, Any] = {}
    for code, gesture in every_look():
        look = (code, gesture or Gesture(None, "none"))
        pixels = draw_tile(code, None, False, TILE, None, gesture).tobytes()
        assert drawn.setdefault(pixels, look) == look


def test_gestures_can_be_told_apart_at_a_glance() -> None:
    """Not by a few pixels: at the size of films, too."""
    gestures = [Gesture(p, act) for p, act in product([None, 0, 1, 2, 3], LAST_ACTS)]
    for kind, direction in product((0, 2, 7), range(4)):
        pictures = [
            draw_tile((tiles.NPC, 4, kind, direction), None, False, TILE, None, gesture).astype(int)
            for gesture in gestures
        ]
        for i, one in enumerate(pictures):
            for other in pictures[:i]:
                assert (np.abs(one - other).max(axis=2) > 60).sum() >= 10


def test_every_cell_that_is_pointed_at_can_be_told_apart() -> None:
    """In pictures and in words, from the middle of a room and from its corner, with the agent in the way."""
    codes = np.zeros((7, 9, 4), np.uint8)
    codes[..., 0] = tiles.EMPTY
    for x, y in ((4, 3), (0, 6)):
        room = codes.copy()
        room[y, x] = tiles.NPC, 2, 0, 1
        drawn: set[bytes] = set()
        words: set[str] = set()
        for column, row in product(range(9), range(7)):
            gesture = Gesture(0, "none", (column - x, row - y))
            drawn.add(draw_grid(room, (5, 3, 0), None, TILE, gestures={(x, y): gesture}).tobytes())
            words.update(figures(room, {(x, y): gesture}))
        assert len(drawn) == len(words) == 9 * 7


def test_what_is_carried_can_be_told_apart() -> None:
    """In the hands of the agent, which sees statuses as well, and of NPCs."""
    things = [
        (type_.code, colour, status, 0)
        for type_ in prelude().types.values()
        for status, colour in product(range(len(type_.states)), range(6))
        if type_.look not in ("wall", "lava")  # which look alike in some colours
    ]
    for code, facing in (((tiles.EMPTY, 0, 0, 0), 1), ((tiles.NPC, 4, 2, 0), None)):
        drawn: dict[bytes, Any] = {}
        for held in [None, *things]:
            pixels = draw_tile(code, facing, False, TILE, None, None, held).tobytes()
            assert drawn.setdefault(pixels, held) == held
