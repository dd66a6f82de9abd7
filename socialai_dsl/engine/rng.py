"""Counter-based randomness in 64-bit words: the twin of `socialai_dsl.draws`, bit for bit."""

import numpy as np

from socialai_dsl import draws
from socialai_dsl.engine.jit import inline

GOLDEN = np.uint64(draws.GOLDEN)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)
_U1 = np.uint64(1)
_U16 = np.uint64(16)
_U27 = np.uint64(27)
_U30 = np.uint64(30)
_U31 = np.uint64(31)
_U32 = np.uint64(32)
_U48 = np.uint64(48)
_TOP = np.uint64(1 << 63)
_ACT = np.uint64(1 << 32)


@inline
def mix(value: np.uint64) -> np.uint64:
    """The finaliser of splitmix64."""
    value = (value ^ (value >> _U30)) * _FIRST
    value = (value ^ (value >> _U27)) * _SECOND
    return value ^ (value >> _U31)


@inline
def episode_key(seed: np.uint64, index: np.uint64, episode: np.uint64) -> np.uint64:
    """The key of an episode; see `draws.episode_key`."""
    key = mix(seed + GOLDEN)
    key = mix(key + (index + _U1) * GOLDEN)
    return mix(key + (episode + _U1) * GOLDEN)


@inline
def attempt_key(key: np.uint64, attempt: int) -> np.uint64:
    """The key of the draws of a reset; see `draws.attempt_key`."""
    if attempt == 0:
        return key
    return mix(key + (_TOP | np.uint64(attempt)) * GOLDEN)


@inline
def act_key(key: np.uint64, act: int) -> np.uint64:
    """The key of an act; see `draws.act_key`."""
    if act == 0:
        return key
    return mix(key + (_TOP | _ACT | np.uint64(act)) * GOLDEN)


@inline
def draw(key: np.uint64, place: int, step: int, number: int) -> np.uint64:
    """64 random bits; see `draws.draw`."""
    word = (np.uint64(place) << _U32) | (np.uint64(step) << _U16) | np.uint64(number)
    return mix(key + word * GOLDEN)


@inline
def below(bits: np.uint64, n: int) -> int:
    """A number from 0 to n - 1; 0 if n is not positive."""
    if n < 1:
        return 0
    return np.int64(((bits >> _U32) * np.uint64(n)) >> _U32)


@inline
def holds_with_chance(bits: np.uint64, share: int) -> bool:
    """Whether an event of probability share / 65536 happens."""
    return np.int64(bits >> _U48) < share


@inline
def fold(digest: np.uint64, number: int) -> np.uint64:
    """Digest of a history to which an entry was added."""
    return mix(digest ^ (np.uint64(number + 1) * GOLDEN))
