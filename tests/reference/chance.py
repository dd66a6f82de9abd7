"""The contract of randomness, written a second time from its description: a draw is a function of where it is made."""

from __future__ import annotations

from hashlib import blake2b

ONES = 2**64 - 1
STRIDE = 0x9E3779B97F4A7C15
TEST_SET = 2**63


def scramble(word: int) -> int:
    """The finaliser of splitmix64."""
    word &= ONES
    word = ((word ^ word >> 30) * 0xBF58476D1CE4E5B9) & ONES
    word = ((word ^ word >> 27) * 0x94D049BB133111EB) & ONES
    return word ^ word >> 31


def episode(seed: int, index: int, number: int) -> int:
    """The key of an episode: seed, then environment, then episode are mixed in."""
    key = scramble(seed + STRIDE)
    for part in (index, number):
        key = scramble(key + (part + 1) * STRIDE)
    return key


def attempt(key: int, number: int) -> int:
    """The key of the draws of a room: that of the episode, until a room was refused."""
    return key if number == 0 else scramble(key + (TEST_SET | number) * STRIDE)


def bits(key: int, path: str, step: int, number: int) -> int:
    """64 random bits of the `number`-th draw at a place of the scenario in a step."""
    place = int.from_bytes(blake2b(path.encode(), digest_size=4).digest(), "big") >> 1
    return scramble(key + (place * 2**32 + step * 2**16 + number) * STRIDE)


def choose(key: int, path: str, step: int, number: int, size: int) -> int:
    """Which of `size` things is drawn."""
    return (bits(key, path, step, number) >> 32) * size >> 32


def happens(key: int, path: str, step: int, probability: float) -> bool:
    """Whether an event of this probability happens; the resolution is 1/65536."""
    return bits(key, path, step, 0) >> 48 < round(probability * 65536)
