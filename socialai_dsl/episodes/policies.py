"""Policies: what chooses the actions of a seat, in one room or in many."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Mapping
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import NDArray

Int64 = NDArray[np.int64]
Observation = Mapping[str, NDArray[Any]]
"""`image`, uint8 (E, H, W, C), and `tokens`, int16 (E, L)."""

# Streams that no numbered episode begins lie in a domain of keys of their own.
_UNNUMBERED = 1 << 63


class Policy(Protocol):
    """The interface of a player of one seat in E rooms. No base class is needed: two methods are enough."""

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """Forget the past of environments in which a new episode begins.

        Args:
            mask: bool (E,), true for those environments.
            episodes: int64 (E,), the number of each environment's episode. The policy's random numbers in an episode
                then depend on that number alone.
        """

    def act(self, observation: Observation) -> Int64 | Awaitable[Int64]:
        """Choose actions, int64 (E, heads), given `image`, uint8 (E, H, W, C), and `tokens`, int16 (E, L).

        An asynchronous policy returns what the loop awaits.

        Raises:
            PolicyDone: play stops here, in the middle of the episode.
            EpisodeOver: the episode of the one room ends here, without a step; play goes on with the next.
        """


class PolicyDone(Exception):  # noqa: N818 - no error
    """A policy has no further action."""


class EpisodeOver(Exception):  # noqa: N818 - no error
    """A policy ends its episode without an action."""


class Entering(Protocol):
    """A policy that keeps something of the room it is in, besides what it remembers of several episodes."""

    def enter(self, mask: NDArray[np.bool_]) -> None:
        """Forget the rooms, but nothing else, of environments in which an episode begins within a session.

        Args:
            mask: bool (E,), true for those environments.
        """


class Leaving(Protocol):
    """A policy that acts once more when an episode has ended, for example to answer questions about it."""

    async def leave(self) -> None:
        """The episode of the one room is over, and another one may begin.

        Raises:
            PolicyDone: play stops here.
        """


class RandomPolicy:
    """A random player: each part of the action is drawn uniformly, so it speaks in half of the steps.

    Args:
        action_sizes: the number of choices of each part, `envs.single_action_space.nvec`.
        seed: of the draws, 0 to 2**63 - 1.
    """

    def __init__(self, action_sizes: tuple[int, ...], seed: int = 0) -> None:
        self._sizes = np.array(action_sizes)
        self._streams = Streams(seed)

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """See `Policy.reset`."""
        self._streams.begin(mask, episodes)

    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        drawn = self._streams.uniform(len(observation["tokens"]), len(self._sizes))
        chosen: Int64 = (drawn * self._sizes).astype(np.int64)
        return chosen


class StillPolicy:
    """Stays and is silent.

    Args:
        action_sizes: the number of choices of each part, `envs.single_action_space.nvec`.
    """

    def __init__(self, action_sizes: tuple[int, ...]) -> None:
        self._nothing = np.array([action_sizes[0] - 1, *(0 for _ in action_sizes[1:])], np.int64)

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """Nothing to forget."""

    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        return np.tile(self._nothing, (len(observation["tokens"]), 1))


class ScriptedPolicy:
    """The scenario's own script for the agent.

    Args:
        envs: the environment that is played, single or vector, of a scenario whose agent follows a frame.
    """

    def __init__(self, envs: Any) -> None:
        self._envs = envs.unwrapped
        self._many = isinstance(self._envs, gymnasium.vector.VectorEnv)

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """Nothing to forget; the script's state is the environments'."""

    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        found = self._envs.scripted_actions() if self._many else self._envs.scripted_action()[None]
        return np.array(found, np.int64)


class FunctionPolicy:
    """A function without memory, from the observations of E rooms to actions, int64 (E, heads)."""

    def __init__(self, function: Callable[[Any], Any]) -> None:
        self._function = function

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """Nothing to forget."""

    def act(self, observation: Observation) -> Any:
        """See `Policy.act`."""
        return self._function(observation)


class PredictingPolicy:
    """A model of Stable-Baselines3 or sb3-contrib, or any object with their method `predict`, recurrent or not.

    Args:
        model: the model; it samples, from PyTorch's own generator.
        greedy: whether it takes its most probable actions instead.
    """

    def __init__(self, model: Any, greedy: bool = False) -> None:
        self._model, self._greedy = model, greedy
        self._state: Any = None
        self._starts = np.ones(0, np.bool_)

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """See `Policy.reset`."""
        if len(self._starts) != len(mask):
            self._state, self._starts = None, np.ones(len(mask), np.bool_)
        self._starts = self._starts | mask

    def act(self, observation: Observation) -> Any:
        """See `Policy.act`."""
        actions, self._state = self._model.predict(
            dict(observation), state=self._state, episode_start=self._starts, deterministic=self._greedy
        )
        self._starts = np.zeros(len(self._starts), np.bool_)
        return actions


class ReplayedPolicy:
    """The actions of an episode that was played before, for one room.

    Args:
        actions: int64 (heads,) each.
    """

    def __init__(self, actions: Iterable[Int64]) -> None:
        self._actions = list(actions)
        self._next = 0

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """See `Policy.reset`."""
        self._next = 0

    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        if self._next == len(self._actions):
            raise PolicyDone
        self._next += 1
        return np.asarray(self._actions[self._next - 1], np.int64)[None]


class Streams:
    """One stream of random numbers for each of E environments.

    A stream depends on the seed and on the number of the episode, not on how many environments are played together.
    Where episodes have no numbers, it depends on the seed and the environment's index.

    Args:
        seed: 0 to 2**63 - 1.

    Raises:
        ValueError: the seed is out of range.
    """

    def __init__(self, seed: int) -> None:
        if not 0 <= seed < _UNNUMBERED:
            raise ValueError(f"seed: got {seed}, expected a whole number from 0 to 2**63 - 1")
        self._seed = seed
        self._streams: list[np.random.Generator] = []

    def begin(self, mask: NDArray[np.bool_], episodes: NDArray[np.int64] | None = None) -> None:
        """Note that episodes begin where `mask`, bool (E,), with these numbers, int64 (E,), if they have any."""
        self._require(len(mask))
        if episodes is None:
            return
        for place in np.flatnonzero(mask).tolist():
            self._streams[place] = _stream(self._seed, int(episodes[place]))

    def uniform(self, count: int, width: int) -> NDArray[np.float64]:
        """The next numbers of each stream, from 0 up to but not including 1, float64 (E, width)."""
        self._require(count)
        return np.stack([stream.random(width) for stream in self._streams])

    def gumbel(self, count: int, width: int) -> NDArray[np.float32]:
        """The next standard Gumbel numbers of each stream, float32 (E, width)."""
        self._require(count)
        return np.stack([stream.gumbel(size=width) for stream in self._streams]).astype(np.float32)

    def state(self) -> Int64:
        """The state of all streams, int64 (E, 13)."""
        return (
            np.array([_place_in(stream) for stream in self._streams], np.uint64)
            .reshape(-1, 13)
            .view(np.int64)
        )

    def load_state(self, state: Int64) -> None:
        """Continue from what `state()` returned, with the same number of environments."""
        self._streams = [_stream_at(place) for place in np.ascontiguousarray(state).view(np.uint64)]

    def _require(self, count: int) -> None:
        """Make the streams of `count` environments, if there are others or none."""
        if len(self._streams) != count:
            self._streams = [_stream(self._seed | _UNNUMBERED, place) for place in range(count)]


def _stream(seed: int, number: int) -> np.random.Generator:
    """Philox, whose streams of different keys are independent (Salmon et al. 2011)."""
    return np.random.Generator(np.random.Philox(key=np.array([seed, number], np.uint64)))


def _place_in(stream: np.random.Generator) -> list[int]:
    """Where a stream is: counter, key, and what is left of the last block, 13 words."""
    state: Any = stream.bit_generator.state
    words = [*state["state"]["counter"], *state["state"]["key"], *state["buffer"]]
    return [*map(int, words), *(int(state[name]) for name in ("buffer_pos", "has_uint32", "uinteger"))]


def _stream_at(words: NDArray[np.uint64]) -> np.random.Generator:
    """The stream that is where `_place_in` says. Raises ValueError for what is no such place."""
    position, has_half, half = map(int, words[10:])
    if position > 4 or has_half > 1 or half >> 32:  # NumPy does not look
        raise ValueError(f"streams: got the place {words.tolist()}, expected that of a stream")
    bits = np.random.Philox()
    bits.state = {
        "bit_generator": "Philox",
        "state": {"counter": words[:4].copy(), "key": words[4:6].copy()},
        "buffer": words[6:10].copy(),
        "buffer_pos": position,
        "has_uint32": has_half,
        "uinteger": half,
    }
    return np.random.Generator(bits)
