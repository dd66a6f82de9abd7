"""Sight: images as a network sees them, related to what was seen before in the episode. Nothing in it is learnt."""

from __future__ import annotations

from itertools import combinations
from math import prod
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from trainer.errors import ObservationError

Int64 = NDArray[np.int64]


class Sight:
    """Sees images as they are.

    Attributes:
        shape: (H, W, channels) of an image as it is seen. high: the highest value of each channel.
        size: whole numbers kept of an episode; all 0 where it begins.
    """

    size = 0

    def __init__(self, shape: tuple[int, int, int], high: tuple[int, ...]) -> None:
        """For images of a shape (H, W, C), whose channels have these highest values."""
        self.shape, self.high = shape, high

    def look(self, images: NDArray[np.uint8], seen: Int64) -> tuple[NDArray[np.uint8], Int64]:
        """Images, uint8 (E, H, W, C), and what was kept of each episode, int64 (E, size), to both of this step."""
        return images, seen


class MapSight(Sight):
    """Draws what it sees on a map, and tells for each thing in view how many others on the map are alike.

    The agent's motion in a step is taken to be the one under which the view fits the map best; walls stop it. What is
    out of view stays on the map as it was. Things are alike if they share the colour, or the type and colour, a look,
    or two of these. Each such relation is one more channel, with the number of others: 0, 1, or 2 for more. Equality of
    two things is a parity, which no single cell predicts; counted, it is a property of the cell.

    Attributes:
        relations: for each further channel, the channels that things have to share.
    """

    SIDE: Final = 21
    """Width of the map; the agent begins in its middle."""

    MOST: Final = 2
    """Others are counted up to this."""

    _RELATIONS = 8
    _WALL = 2
    _MISFIT = 4  # a cell that changed against a move speaks louder than a cell that fits

    def __init__(self, shape: tuple[int, int, int], high: tuple[int, ...]) -> None:
        """See `Sight`."""
        height, width, channels = shape
        looks = (1, *range(4, channels))  # status and orientation change with what happens
        alike = [(0, one) for one in looks] + [(0, *two) for two in combinations(looks, 2)]
        self.relations = [(1,), *alike][: self._RELATIONS]
        self.shape = (height, width, channels + len(self.relations))
        self.high = (*high, *(self.MOST,) * len(self.relations))
        self.size = 3 + self.SIDE**2
        self._sizes = tuple(highest + 1 for highest in high)
        # A cell's code is one number: its channels are the digits.
        self._digits = np.array([prod(self._sizes[channel + 1 :]) for channel in range(channels)])
        right, ahead = np.divmod(np.arange(height * width), width)
        at = np.stack((right - height // 2, width - 1 - ahead), 1)  # (cells, 2), as the agent sees them
        self._own = int(np.flatnonzero((at == 0).all(1))[0])
        axes = np.stack((np.roll(_STEPS, -1, 0), _STEPS), 1)  # (directions, 2, 2), to the right and ahead
        self._turned = np.moveaxis(at @ axes, 2, 0)  # (2, directions, cells), as the map has them

    def look(self, images: NDArray[np.uint8], seen: Int64) -> tuple[NDArray[np.uint8], Int64]:
        """See `Sight.look`; where an episode begins, `seen` is an empty map.

        Raises:
            ObservationError: an image is outside its bounds.
        """
        require_bounds(images, self.high[: images.shape[-1]])
        cells = images.reshape(len(images), -1, images.shape[-1]).astype(np.int64)
        cells[:, self._own] = (1, *(0,) * (images.shape[-1] - 1))  # what the agent holds lies nowhere
        now: Int64 = cells @ self._digits  # (E, cells)
        pose, maps = self._moved(seen[:, :3], seen[:, 3:], now), seen[:, 3:].copy()
        rows = np.arange(len(now))[:, None]
        at, on_map = self._places(pose)
        known = on_map & (now > 0)
        maps[np.broadcast_to(rows, at.shape)[known], at[known]] = now[known]
        related = self._related(now, maps).reshape(*images.shape[:3], -1)
        return np.concatenate((images, related), 3), np.concatenate((pose, maps), 1)

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
        score[3, before[3, :, self._own] // self._digits[0] == self._WALL] = _NEVER
        found: Int64 = poses[score.argmax(0), np.arange(len(now))]
        return found

    def _places(self, pose: Int64) -> tuple[Int64, NDArray[np.bool_]]:
        """Where on the map the cells of the view lie, int64 (E, cells), and whether they do."""
        x, y, direction = pose.T[:, :, None]
        middle = self.SIDE // 2
        right, ahead = self._turned[:, direction[:, 0]]  # (E, cells) each
        column, row = x + middle + right, y + middle + ahead
        inside = (column >= 0) & (column < self.SIDE) & (row >= 0) & (row < self.SIDE)
        return np.where(inside, column * self.SIDE + row, 0), inside

    def _related(self, now: Int64, maps: Int64) -> NDArray[np.uint8]:
        """For each cell in view and relation the number of others, uint8 (E, cells, relations)."""
        first = (self._WALL + 1) * self._digits[0]  # the least code of a thing
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

_STEPS: Final[Any] = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])
"""A step ahead for each direction, as it was at first: ahead, right, behind, left."""
