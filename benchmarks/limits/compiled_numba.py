"""TalkItOut hard-wired for Numba; `talkitout.c` says what it leaves out."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.limits.workload import HISTORY, ROOM_FIELDS, WORDS, HardCoded, Rooms

SIDE: Final = 8
CELLS: Final = 64
PICTURE: Final = 49
OWN_PLACE: Final = 27
HORIZON: Final = 100
DOORS: Final = 4
NPCS: Final = 3
COLORS: Final = 6
WIZARD, HONEST, LIAR = 0, 1, 2
FORWARD, TOGGLE, DONE, NOUNS = 2, 5, 6, 16
WHERE_IS_THE_EXIT, OPEN_SESAME, HOW_ARE_YOU = 1, 1 * NOUNS, 3 * NOUNS + 3
GANDALF, JOHN, JACK, ME, AM, FINE, ASK, GO, TO, THE, DOOR, RED = range(1, 13)
assert WORDS[RED] == "red", "internal: words and their numbers differ"

# A cell is kind, color, status and direction, a byte each.
EMPTY: Final = np.uint32(1)
WALL: Final = np.uint32(2 | 5 << 8)
OPEN_DOOR: Final = 4
CLOSED_DOOR: Final = 4 | 1 << 16
NPC: Final = 11 | 1 << 24
FLOOR: Final = np.uint64(0x007E7E7E7E7E7E00)
BIT: Final = np.uint64(1)
STEP: Final = np.array([1, SIDE, -1, -SIDE])  # right, down, left, up

# Bytes of an environment: numbers of `small`, those of doors, their colors and NPCs one after another.
AGENT, FACING, T, ENDED, EXIT, COUNT, ACQUAINTED, JACK_IS_HONEST = range(8)
DOOR_AT, DOOR_COLOR, NPC_AT = 8, 12, 16
SMALL: Final = 24
SOLID, RANDOM = range(2)

_fast = njit(nogil=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
_apart = njit(nogil=True, error_model="numpy", forceinline=False)


def _views() -> NDArray[np.uint8]:
    """For each pose (y, x, direction) the cell seen at each place of the picture; outside is a wall, as cell 0 is."""
    y, x, d, i, j = np.ogrid[:SIDE, :SIDE, :4, :7, :7]
    ahead, right = 6 - j, i - 3
    ahead_x, ahead_y = (1 - d) * (1 - d % 2), (2 - d) * (d % 2)
    seen_x, seen_y = x + ahead * ahead_x - right * ahead_y, y + ahead * ahead_y + right * ahead_x
    inside = (seen_x >= 0) & (seen_x < SIDE) & (seen_y >= 0) & (seen_y < SIDE)
    return np.where(inside, seen_y * SIDE + seen_x, 0).reshape(-1, PICTURE).astype(np.uint8)


VIEWS: Final = _views()


@_fast
def _below(words: Any, n: int) -> int:
    words[RANDOM] += np.uint64(0x9E3779B97F4A7C15)
    z = words[RANDOM]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z ^= z >> np.uint64(31)
    return np.int64(((z >> np.uint64(32)) * np.uint64(n)) >> np.uint64(32))


@_fast
def _pick(words: Any, chosen: np.uint64) -> int:
    count = 0
    rest = chosen
    while rest != np.uint64(0):
        rest &= rest - BIT
        count += 1
    for _ in range(_below(words, count)):
        chosen &= chosen - BIT
    place = 0
    while (chosen >> np.uint64(place)) & BIT == np.uint64(0):
        place += 1
    return place


@_apart
def _draw_room(words: Any, room: Any) -> None:
    fronts, free, colors = np.uint64(0), FLOOR, np.uint64((1 << COLORS) - 1)
    for i in range(DOORS):  # top, bottom, left, right; two cells from the corners
        along, across, inside = 2 + _below(words, 4), i % 2 * (SIDE - 1), 1 + i % 2 * (SIDE - 3)
        room[2 + i] = across * SIDE + along if i < 2 else along * SIDE + across
        fronts |= BIT << np.uint64(inside * SIDE + along if i < 2 else along * SIDE + inside)
        color = _pick(words, colors)
        room[6 + i] = color
        colors &= ~(BIT << np.uint64(color))
    room[10] = _below(words, DOORS)
    for i in range(NPCS):
        cell = _pick(words, free & ~fronts)
        free &= ~(BIT << np.uint64(cell))
        others = np.uint64((1 << COLORS) - 1)
        if i == LIAR:
            others &= ~(BIT << np.uint64(room[14 + HONEST]))
        room[11 + i], room[14 + i] = cell, _pick(words, others)
    room[0], room[1] = _pick(words, free), _below(words, 4)
    room[17] = _below(words, 2)


@_apart
def _enter(room: Any, board: Any, words: Any, small: Any, tokens: Any) -> None:
    for cell in range(CELLS):
        board[cell] = EMPTY if (FLOOR >> np.uint64(cell)) & BIT else WALL
    solid = ~FLOOR
    for i in range(DOORS):
        small[DOOR_AT + i], small[DOOR_COLOR + i] = room[2 + i], room[6 + i]
        board[room[2 + i]] = CLOSED_DOOR | room[6 + i] << 8
    for i in range(NPCS):
        small[NPC_AT + i] = room[11 + i]
        solid |= BIT << np.uint64(room[11 + i])
        board[room[11 + i]] = NPC | room[14 + i] << 8 | np.int64(i != WIZARD) << 16
    words[SOLID] = solid
    small[AGENT], small[FACING], small[EXIT], small[JACK_IS_HONEST] = room[0], room[1], room[10], room[17]
    small[T] = small[ENDED] = small[COUNT] = small[ACQUAINTED] = 0
    tokens[:] = 0


@_fast
def _next_to(a: int, b: int) -> bool:
    dx, dy = (a & 7) - (b & 7), (a >> 3) - (b >> 3)
    return dx * dx + dy * dy == 1


@_apart
def _make_room(small: Any, tokens: Any, count: int) -> int:
    """Where the next word goes; the oldest words make room for `count` more."""
    known = np.int64(small[COUNT])
    gone = known + count - HISTORY
    if gone < 0:
        gone = 0
    for i in range(known - gone):
        tokens[i] = tokens[i + gone]
    small[COUNT] = known - gone + count
    return known - gone


@_apart
def _listen(words: Any, small: Any, tokens: Any, utterance: int) -> None:
    for i in range(NPCS):
        if not _next_to(np.int64(small[AGENT]), np.int64(small[NPC_AT + i])):
            continue
        honest = np.int64(small[JACK_IS_HONEST])
        name = GANDALF if i == WIZARD else JACK if honest != np.int64(i == LIAR) else JOHN
        met = (small[ACQUAINTED] >> i) & 1
        if utterance == HOW_ARE_YOU and met == 0:
            small[ACQUAINTED] |= 1 << i
            at = _make_room(small, tokens, 4)
            tokens[at], tokens[at + 1], tokens[at + 2], tokens[at + 3] = name, ME, AM, FINE
        elif utterance == WHERE_IS_THE_EXIT and met == 1 and i == WIZARD:
            at = _make_room(small, tokens, 3)
            tokens[at], tokens[at + 1], tokens[at + 2] = name, ASK, JACK if honest else JOHN
        elif utterance == WHERE_IS_THE_EXIT and met == 1:
            door = np.int64(small[EXIT])
            if i == LIAR:
                door = _pick(words, np.uint64(15) & ~(BIT << np.uint64(door)))
            at = _make_room(small, tokens, 6)
            tokens[at], tokens[at + 1], tokens[at + 2], tokens[at + 3] = name, GO, TO, THE
            tokens[at + 4], tokens[at + 5] = RED + small[DOOR_COLOR + door], DOOR


@_apart
def _open_door(board: Any, small: Any, cell: int) -> None:
    for i in range(DOORS):
        if small[DOOR_AT + i] == cell:
            board[cell] = OPEN_DOOR | small[DOOR_COLOR + i] << 8


@_fast
def _look(board: Any, small: Any, image: Any) -> None:
    pose = np.int64(small[AGENT]) * 4 + np.int64(small[FACING])
    for i in range(PICTURE):
        image[i] = board[VIEWS[pose, i]]
    image[OWN_PLACE] = EMPTY


@njit(nogil=True, error_model="numpy")
def _start(seed: np.uint64, boards: Any, words: Any, small: Any, image: Any, tokens: Any) -> None:
    room = np.zeros(ROOM_FIELDS, np.int32)
    for row in range(len(boards)):
        words[row, RANDOM] = seed + np.uint64(row) * np.uint64(0xD1342543DE82EF95)
        _draw_room(words[row], room)
        _enter(room, boards[row], words[row], small[row], tokens[row])
        _look(boards[row], small[row], image[row])


@njit(nogil=True, error_model="numpy")
def _enter_all(rooms: Any, boards: Any, words: Any, small: Any, image: Any, tokens: Any) -> None:
    for row in range(len(boards)):
        _enter(rooms[row], boards[row], words[row], small[row], tokens[row])
        _look(boards[row], small[row], image[row])


@njit(nogil=True, error_model="numpy")
def _step(
    actions: Any,
    scratch: Any,
    boards: Any,
    words: Any,
    smalls: Any,
    image: Any,
    tokens: Any,
    reward: Any,
    terminated: Any,
    truncated: Any,
) -> None:
    for row in range(len(boards)):
        small, earned, over, late = smalls[row], 0.0, False, False
        if small[ENDED]:
            _draw_room(words[row], scratch)
            _enter(scratch, boards[row], words[row], small, tokens[row])
        else:
            body = actions[row, 0]
            facing = (np.int64(small[FACING]) + np.int64(body == 1) - np.int64(body == 0)) & 3
            agent = np.int64(small[AGENT])
            target = agent + (STEP[facing] if body == FORWARD else 0)
            if (words[row, SOLID] >> np.uint64(target)) & BIT == np.uint64(0):
                agent = target
            small[FACING], small[AGENT] = facing, agent
            small[T] += 1
            utterance = actions[row, 2] * NOUNS + actions[row, 3] if actions[row, 1] else -1
            if utterance in (HOW_ARE_YOU, WHERE_IS_THE_EXIT):
                _listen(words[row], small, tokens[row], utterance)
            elif utterance == OPEN_SESAME:
                for door in range(DOORS):
                    if _next_to(agent, np.int64(small[DOOR_AT + door])):
                        over = True
                        if door == small[EXIT]:
                            earned = 1 - 0.9 * small[T] / HORIZON
            if body in (TOGGLE, DONE):
                over = True
                if body == TOGGLE:
                    _open_door(boards[row], small, agent + STEP[facing])
            late = not over and small[T] == HORIZON
            small[ENDED] = over | late
        _look(boards[row], small, image[row])
        reward[row], terminated[row], truncated[row] = earned, over, late


class CompiledNumba(HardCoded):
    """The Numba version."""

    state_bytes = 4 * CELLS + 2 * 8 + SMALL

    def __init__(self, num_envs: int) -> None:
        super().__init__(num_envs)
        state = (
            np.zeros((num_envs, CELLS), np.uint32),
            np.zeros((num_envs, 2), np.uint64),
            np.zeros((num_envs, SMALL), np.uint8),
        )
        self._arrays = (*state, self.image.reshape(num_envs, -1).view(np.uint32), self.tokens)
        self._scratch = np.zeros(ROOM_FIELDS, np.int32)

    def _start(self, seed: int) -> None:
        _start(np.uint64(seed), *self._arrays)

    def _enter(self, rooms: Rooms) -> None:
        _enter_all(rooms, *self._arrays)

    def _step(self, actions: NDArray[np.int64]) -> None:
        _step(actions, self._scratch, *self._arrays, self.reward, self.terminated, self.truncated)
