"""Sight: images as a network sees them, related to what was seen before in the episode. Nothing in it is learnt."""

from __future__ import annotations

from itertools import combinations
from math import prod
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.trainer.errors import ObservationError
from socialai_dsl.vocabulary import DIRECTIONS, EMPTY, NPC, WALL

Int64 = NDArray[np.int64]


class Sight:
    """Sees images as they are.

    Attributes:
        shape: (H, W, channels) of an image as it is seen. high: the highest value of each channel.
        size: whole numbers kept of an episode; all 0 where it begins.
    """

    size = 0

    def __init__(self, shape: tuple[int, int, int], high: tuple[int, ...], words: int) -> None:
        """For images of a shape (H, W, C), whose channels have these highest values, and so many words."""
        self.shape, self.high = shape, high

    def look(
        self, images: NDArray[np.uint8], tokens: NDArray[np.int16], seen: Int64
    ) -> tuple[NDArray[np.uint8], Int64]:
        """See a step.

        Args:
            images: uint8 (E, H, W, C).
            tokens: int16 (E, L), 0-padded.
            seen: int64 (E, size), what was kept of each episode.

        Returns:
            The images as they are seen, uint8 (E, *shape), and what is kept now, int64 (E, size).
        """
        return images, seen


class MapSight(Sight):
    """Draws what it sees on a map, and tells for each thing in view how many others on the map are alike, and its gaze.

    The agent's motion in a step is taken to be the one under which the view fits the map best; walls stop it. Things
    out of view stay on the map as they were, people do not. Things are alike if they share the colour, or the type and
    colour, a look, or two of these. Each such relation is one more channel, with the number of others: 0, 1, or 2 for
    more. Equality of two things is a parity, which no single cell predicts; counted, it is a property of the cell.

    The last channel is who faces whom: for a person the type of what stands in the next cell ahead, for a thing 2 and
    the colour of the person who faces it, 1 where somebody did before, else 0. Where people look is told by their
    orientation, once somebody has walked: orientations are those of the room, which may be turned against the map.

    Attributes:
        relations: for each further channel, the channels that things have to share.
    """

    SIDE: Final = 21
    """Width of the map; the agent begins in its middle."""

    MOST: Final = 2
    """Others are counted up to this."""

    _RELATIONS = 8
    _MISFIT = 4  # a cell that changed against a move speaks louder than a cell that fits

    def __init__(self, shape: tuple[int, int, int], high: tuple[int, ...], words: int) -> None:
        """See `Sight`."""
        height, width, channels = shape
        looks = (1, *range(4, channels))  # status and orientation change with what happens
        alike = [(0, one) for one in looks] + [(0, *two) for two in combinations(looks, 2)]
        self.relations = [(1,), *alike][: self._RELATIONS]
        self.shape = (height, width, channels + len(self.relations) + 1)
        self.high = (*high, *(self.MOST,) * len(self.relations), max(high[0], _FACED_BY + high[1]))
        sizes = 3, len(DIRECTIONS), self.SIDE**2, self.SIDE**2
        *self._parts, self.size = np.cumsum(sizes).tolist()
        self._sizes = tuple(highest + 1 for highest in high)
        # A cell's code is one number: its channels are the digits.
        if prod(self._sizes) > np.iinfo(np.int64).max:
            raise ValueError(
                f"net: relations keeps a map, whose cells have at most 63 bits; got {channels} channels of "
                f"{', '.join(map(str, self._sizes))} values; use another network, or fewer looks and gestures"
            )
        self._digits = np.array([prod(self._sizes[channel + 1 :]) for channel in range(channels)])
        right, ahead = np.divmod(np.arange(height * width), width)
        at = np.stack((right - height // 2, width - 1 - ahead), 1)  # (cells, 2), as the agent sees them
        self._own = int(np.flatnonzero((at == 0).all(1))[0])
        axes = np.stack((np.roll(_STEPS, -1, 0), _STEPS), 1)  # (directions, 2, 2), to the right and ahead
        self._turned = np.moveaxis(at @ axes, 2, 0)  # (2, directions, cells), as the map has them

    def look(
        self, images: NDArray[np.uint8], tokens: NDArray[np.int16], seen: Int64
    ) -> tuple[NDArray[np.uint8], Int64]:
        """See `Sight.look`; where an episode begins, `seen` is an empty map.

        Raises:
            ObservationError: an image is outside its bounds.
        """
        require_bounds(images, self.high[: images.shape[-1]])
        cells = images.reshape(len(images), -1, images.shape[-1]).astype(np.int64)
        cells[:, self._own] = (1, *(0,) * (images.shape[-1] - 1))  # what the agent holds lies nowhere
        now: Int64 = cells @ self._digits  # (E, cells)
        pose, votes, maps, faced = np.split(seen, self._parts, 1)
        pose = self._moved(pose, maps, now)
        at, on_map = self._places(pose)
        # Who is out of view may be anywhere.
        drawn = np.where(maps // self._digits[0] == NPC, self._digits[0] * EMPTY, maps)
        envs, view = np.nonzero(on_map & (now > 0))
        drawn[envs, at[envs, view]] = now[envs, view]
        people = np.stack(np.nonzero(drawn // self._digits[0] == NPC))
        votes = self._voted(votes, maps, drawn, people)
        faces, faced = self._faced(votes, drawn, faced, people)
        gaze = np.where(on_map, np.take_along_axis(faces, at, 1), 0).astype(np.uint8)
        further = np.concatenate((self._related(now, drawn), gaze[..., None]), 2)
        kept = np.concatenate((pose, votes, drawn, faced), 1)
        return np.concatenate((images, further.reshape(*images.shape[:3], -1)), 3), kept

    def _voted(self, votes: Int64, before: Int64, now: Int64, people: Int64) -> Int64:
        """Votes (E, 4) for how orientations are turned against the map, with those of the people, int64 (2, N), that
        have come a step in the direction they look in.
        """
        envs, at = people
        who, looks = np.divmod(now[envs, at], self._digits[ORIENTATION - 1])
        looks //= self._digits[ORIENTATION]
        new = before[envs, at] // self._digits[ORIENTATION - 1] != who
        votes = votes.copy()
        for turn in range(len(DIRECTIONS)):
            source, inside = self._beside(at, -_STEPS[(looks - turn) % 4])
            came = inside & new & (before[envs, source] // self._digits[ORIENTATION - 1] == who)
            np.add.at(votes, (envs[came], turn), 1)
        return votes

    def _faced(self, votes: Int64, maps: Int64, faced: Int64, people: Int64) -> tuple[Int64, Int64]:
        """What each cell of the map faces or is faced by, and whether it was ever faced, int64 (E, cells) each."""
        envs, at = people[:, votes.max(1)[people[0]] > 0]
        code = maps[envs, at]
        looks = code % self._digits[ORIENTATION - 1] // self._digits[ORIENTATION]
        ahead, inside = self._beside(at, _STEPS[(looks - votes.argmax(1)[envs]) % 4])
        envs, at, ahead, code = envs[inside], at[inside], ahead[inside], code[inside]
        things = maps[envs, ahead] // self._digits[0]
        faced = faced.copy()
        faced[envs, ahead] |= things > WALL
        faces = faced.copy()
        faces[envs, ahead] = _FACED_BY + code % self._digits[0] // self._digits[1]
        faces[envs, at] = things
        return np.where(maps < (WALL + 1) * self._digits[0], 0, faces), faced

    def _moved(self, pose: Int64, maps: Int64, now: Int64) -> Int64:
        """The pose, int64 (E, 3) of x, y and direction, after the move under which view and map fit best."""
        x, y, direction = pose.T
        dx, dy = _STEPS[direction].T
        moves = [
            (x, y, direction),
            (x, y, (direction + 3) % 4),
            (x, y, (direction + 1) % 4),
            (x + dx, y + dy, direction),
        ]
        poses = np.stack([np.stack(move, 1) for move in moves])  # (moves, E, 3)
        at, on_map = self._places(poses.reshape(-1, 3))
        at = at.reshape(len(moves), *now.shape)
        before = np.where(on_map.reshape(at.shape), maps[np.arange(len(maps))[:, None], at], 0)
        both, fits = (before > 0) & (now > 0), before == now
        score = (both & fits).sum(2) - self._MISFIT * (both & ~fits).sum(2)  # (moves, E)
        score[3, before[3, :, self._own] // self._digits[0] == WALL] = _NEVER
        found: Int64 = poses[score.argmax(0), np.arange(len(now))]
        return found

    def _places(self, pose: Int64) -> tuple[Int64, NDArray[np.bool_]]:
        """Where on the map the cells of the view lie, int64 (E, cells), and whether they do."""
        x, y, direction = pose.T[:, :, None]
        middle = self.SIDE // 2
        right, ahead = self._turned[:, direction[:, 0]]  # (E, cells) each
        return self._on_map(x + middle + right, y + middle + ahead)

    def _beside(self, cells: Int64, steps: Int64) -> tuple[Int64, NDArray[np.bool_]]:
        """The cells that are a step, (N, 2), from cells of the map, int64 (N,), and whether they are on it."""
        column, row = np.divmod(cells, self.SIDE)
        return self._on_map(column + steps[:, 0], row + steps[:, 1])

    def _on_map(self, column: Int64, row: Int64) -> tuple[Int64, NDArray[np.bool_]]:
        """Places as cells of the map, and whether they are on it."""
        inside = (column >= 0) & (column < self.SIDE) & (row >= 0) & (row < self.SIDE)
        return np.where(inside, column * self.SIDE + row, 0), inside

    def _related(self, now: Int64, maps: Int64) -> NDArray[np.uint8]:
        """For each cell in view and relation the number of others, uint8 (E, cells, relations)."""
        first = (WALL + 1) * self._digits[0]  # the least code of a thing
        rows, where = np.nonzero(maps >= first)
        on_map = np.unravel_index(maps[rows, where], self._sizes)
        envs, cells = np.nonzero(now >= first)
        in_view = np.unravel_index(now[envs, cells], self._sizes)
        related = np.zeros((*now.shape, len(self.relations)), np.uint8)
        for number, channels in enumerate(self.relations):
            sizes = [len(maps), *(self._sizes[channel] for channel in channels)]
            of_map = np.sort(np.ravel_multi_index((rows, *(on_map[one] for one in channels)), sizes))
            of_view = np.ravel_multi_index((envs, *(in_view[one] for one in channels)), sizes)
            others = of_map.searchsorted(of_view, "right") - of_map.searchsorted(of_view) - 1
            related[envs, cells, number] = others.clip(0, self.MOST)
        return related


def require_bounds(images: NDArray[np.uint8], high: tuple[int, ...]) -> None:
    """Raise ObservationError unless all cells of images (..., C) are within the bounds of their channels."""
    if (images > np.array(high)).any():
        raise ObservationError(f"image: a cell exceeds the bounds {high} of its channels")


_NEVER: Final = -(1 << 20)

ORIENTATION: Final = 3
"""The channel of orientations."""

_FACED_BY: Final = 2
"""A thing that is faced shows this and the colour of who faces it; less means that nobody does."""

_STEPS: Final[Any] = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])
"""A step ahead for each direction, as it was at first: ahead, right, behind, left."""
