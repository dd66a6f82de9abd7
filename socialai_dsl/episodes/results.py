"""The results of played episodes, and how sure they make one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.baselines import effective_trials, wilson
from socialai_dsl.episodes.play import Observer, Rooms, Step


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """The 95 % confidence interval of a success rate, see `baselines.wilson`.

    Raises:
        ValueError: there was no trial, or there were more successes than trials.
    """
    if not 0 <= successes <= trials or trials < 1:
        raise ValueError(
            f"got {successes} successes of {trials} trials, expected 0 to `trials` of at least one"
        )
    return wilson(successes / trials, trials)


def interval_over_rooms(won: NDArray[np.bool_], session: int = 1) -> tuple[float, float]:
    """The 95 % confidence interval of the mean success of several players, or pairs of them, in the same rooms.

    It puts the Wilson intervals of the players together by the correlations of their successes, since a hard room is
    hard for all (Zou and Donner 2008; Zou, Huang and Zhang 2009). Of one player it is that player's interval. Where a
    player has always or never succeeded, so that no correlation is known, it counts as 1, which makes the interval the
    widest.

    Args:
        won: whether each player succeeded in each room, bool (players, rooms).
        session: how many rooms in a row may be alike, see `EvalResult`; they count as one.

    Raises:
        ValueError: there is no room, or no player.
    """
    if won.size == 0:
        raise ValueError(f"won: got the shape {won.shape}, expected at least one player and one room")
    players, rooms = won.shape
    rates = won.mean(axis=1)
    firsts = np.arange(0, rooms, session)
    played = np.diff(firsts, append=rooms)
    successes = np.add.reduceat(won, firsts, axis=1, dtype=np.float64)  # (players, sessions)
    deviations = successes - rates[:, None] * played
    spread = np.sqrt((deviations**2).sum(axis=1))
    scale = np.outer(spread, spread)
    together = np.divide(deviations @ deviations.T, scale, out=np.ones_like(scale), where=scale > 0)
    np.fill_diagonal(together, 1.0)
    effective = [effective_trials(one.tolist(), played.tolist()) for one in successes]
    ends = np.array([wilson(float(rate), trials) for rate, trials in zip(rates, effective, strict=True)])
    down, up = (np.abs(ends[:, side] - rates) / players for side in (0, 1))
    mean = float(rates.mean())
    low, high = (math.sqrt(max(0.0, float(gap @ together @ gap))) for gap in (down, up))
    return max(0.0, mean - low), min(1.0, mean + high)


@dataclass(frozen=True, eq=False)
class EvalResult:
    """The result of a policy on test episodes 0 to N - 1.

    Attributes:
        success: bool (N,), whether each episode ended in success.
        outcome: int64 (N,), how each ended, as an index into `names`.
        lengths: int64 (N,), in steps.
        returns: float64 (N,), the undiscounted sum of rewards.
        names: the scenario's outcomes.
        rules: mean number of times that each rule of the scenario fired in an episode.
        others: of each seat but the first whether an episode was its success, bool (N,), and its return, float64 (N,).
        session: how many episodes in a row may be alike, since draws stay the same or the policy remembers them.
    """

    success: NDArray[np.bool_]
    outcome: NDArray[np.int64]
    lengths: NDArray[np.int64]
    returns: NDArray[np.float64]
    names: tuple[str, ...]
    rules: Mapping[str, float] = field(default_factory=dict)
    others: Mapping[str, tuple[NDArray[np.bool_], NDArray[np.float64]]] = field(default_factory=dict)
    session: int = 1

    @property
    def episodes(self) -> int:
        """N, the number of episodes, each played once."""
        return len(self.success)

    def by_trial(self, trials: int) -> list[tuple[int, int]]:
        """Successes and episodes of each trial that was played.

        Args:
            trials: how many a session has; episode n is trial n modulo `trials`.
        """
        order = np.arange(self.episodes) % trials
        return [
            (int(self.success[order == t].sum()), int((order == t).sum()))
            for t in range(min(trials, self.episodes))
        ]

    @property
    def success_rate(self) -> float:
        """Share of the episodes that ended in success."""
        return float(self.success.mean())

    @property
    def success_rate_se(self) -> float:
        """The standard error of `success_rate`: the binomial one, of sessions with the effective number of episodes."""
        return math.sqrt(self.success_rate * (1 - self.success_rate) / self._effective(self.success))

    @property
    def success_interval(self) -> tuple[float, float]:
        """The 95 % confidence interval of `success_rate`, see `interval`."""
        return self.interval(self.success)

    def interval(
        self, success: NDArray[np.bool_], numbers: NDArray[np.int64] | None = None
    ) -> tuple[float, float]:
        """The 95 % confidence interval of a rate: Wilson's, of sessions with the effective number of episodes.

        Args:
            success: bool (M,), at least one.
            numbers: int64 (M,), of which episodes; None: of the first M.
        """
        return wilson(float(success.mean()), self._effective(success, numbers))

    def _effective(self, success: NDArray[np.bool_], numbers: NDArray[np.int64] | None = None) -> float:
        """See `baselines.effective_trials`; the clusters are sessions."""
        sessions = (np.arange(len(success)) if numbers is None else numbers) // self.session
        played = np.bincount(sessions)
        won = np.bincount(sessions, success)
        return effective_trials(won[played > 0].tolist(), played[played > 0].tolist())

    @property
    def mean_length(self) -> float:
        """Mean length of an episode in steps."""
        return float(self.lengths.mean())

    @property
    def mean_return(self) -> float:
        """Mean undiscounted return of an episode."""
        return float(self.returns.mean())

    @property
    def outcomes(self) -> dict[str, float]:
        """Share of the episodes that ended in each of the scenario's outcomes."""
        return {name: float((self.outcome == index).mean()) for index, name in enumerate(self.names)}


class Results(Observer):
    """Counts how each of N episodes ended.

    Args:
        names: the scenario's outcomes.
        episodes: N; episodes are numbered 0 to N - 1.
    """

    def __init__(self, names: Sequence[str], episodes: int) -> None:
        self._names = tuple(names)
        self._success, self._outcome = np.zeros(episodes, np.bool_), np.full(episodes, -1)
        self._lengths, self._returns = np.zeros(episodes, np.int64), np.zeros(episodes)
        self._others: dict[str, tuple[NDArray[np.bool_], NDArray[np.float64]]] = {}

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        numbers = step.numbers[step.running]
        self._lengths[numbers] += 1
        self._returns[numbers] += step.reward[step.running]
        if step.ended.any():
            numbers = step.numbers[step.ended]
            self._success[numbers] = step.success[step.ended]
            self._outcome[numbers] = step.outcome[step.ended]
        for seat, (reward, success) in step.others.items():
            count = len(self._outcome)
            won, returns = self._others.setdefault(seat, (np.zeros(count, np.bool_), np.zeros(count)))
            returns[step.numbers[step.running]] += reward[step.running]
            won[step.numbers[step.ended]] = success[step.ended]

    def result(self, rules: Mapping[str, float] | None = None, session: int = 1) -> EvalResult:
        """The results of all N episodes, with the mean number of times that each rule fired.

        `session`: see `EvalResult`.

        Raises:
            ValueError: an episode has not ended, since its policy stopped playing.
        """
        left = int((self._outcome < 0).sum())
        if left:
            raise ValueError(
                f"policy: it stopped playing before the end of {left} of the {len(self._outcome)} episodes; expected "
                "an action in every step"
            )
        ended = self._success, self._outcome, self._lengths, self._returns
        return EvalResult(*ended, self._names, rules or {}, self._others, session)


class Actions(Observer):
    """Keeps the actions, so that an episode can be played again to be filmed or traced.

    Attributes:
        played: number of an episode -> its actions, int64 (heads,) each, of several seats (S, heads), where what stands
            for a seat that nobody plays counts for nothing.
    """

    def __init__(self) -> None:
        self.played: dict[int, list[NDArray[np.int64]]] = {}

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        numbers = step.numbers.tolist()
        nothing = np.zeros((rooms.count, len(rooms.action_sizes)), np.int64)
        actions = np.stack([step.actions.get(seat, nothing) for seat in rooms.names], axis=1)
        if len(rooms.names) == 1:
            actions = actions[:, 0]
        for room in np.flatnonzero(step.running).tolist():
            self.played.setdefault(numbers[room], []).append(actions[room])
