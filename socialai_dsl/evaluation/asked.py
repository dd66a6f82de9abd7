"""Whom a player asked in the test episodes that it played."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.envs.factory import make_vec
from socialai_dsl.episodes.asking import Answer, Asking
from socialai_dsl.episodes.play import EachRoom, Rooms, play
from socialai_dsl.episodes.policies import Observation
from socialai_dsl.evaluation.test_set import TOGETHER, Evaluation
from socialai_dsl.program_suite import seats_of

Int64 = NDArray[np.int64]


def asked_in(evaluation: Evaluation) -> tuple[list[list[Answer]], list[int]]:
    """Play the episodes of an evaluation again, and find whom the player asked.

    Returns:
        Of each episode the answers that the player's seat got, and how many utterances it made. What a script says that
        plays another seat than the agent's by itself is not among them.
    """
    program, seats, count = evaluation.program, seats_of(evaluation.program), evaluation.result.episodes
    asking = Asking(evaluation.loaded, program)
    envs = make_vec(
        program,
        num_envs=min(TOGETHER, count),
        copy=False,
        autoreset_mode="Disabled",
        seats="all" if len(seats) > 1 else seats[0],
    )
    try:
        rooms = Rooms(envs, [asking], evaluation.own, evaluation.scripts)
        still = np.zeros(len(rooms.action_sizes), np.int64)
        still[0] = len(program.actions)
        again = {seat: _Again(evaluation.actions, seats.index(seat), still) for seat in rooms.seats}
        play(rooms, again, EachRoom(count, rooms=evaluation.rooms))
    finally:
        envs.close()
    steps = {number: len(actions) for number, actions in evaluation.actions.items()}
    own = evaluation.seat
    answers = [
        [one for one in asking.answers[number][own] if one.step <= steps.get(number, 0)]
        for number in range(count)
    ]
    return answers, [asking.utterances[number][own] for number in range(count)]


class _Again:
    """What was done on a seat, in any number of rooms; who has nothing more to do stands still and is silent.

    Args:
        actions: number of an episode -> int64 (heads,) each, of several seats (S, heads). place: of the seat.
        still: the action of who stands still and is silent, int64 (heads,).
    """

    def __init__(self, actions: Mapping[int, Sequence[Int64]], place: int, still: Int64) -> None:
        self._actions, self._place, self._still = actions, place, still
        self._numbers, self._t = np.zeros(0, np.int64), np.zeros(0, np.int64)

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """See `Policy.reset`."""
        assert episodes is not None, "internal: test episodes have numbers"
        if len(self._t) != len(mask):
            self._numbers, self._t = np.zeros(len(mask), np.int64), np.zeros(len(mask), np.int64)
        self._numbers[mask], self._t[mask] = episodes[mask], 0

    def act(self, observation: Observation) -> Int64:
        """See `Policy.act`."""
        chosen = [
            self._chosen(*place) for place in zip(self._numbers.tolist(), self._t.tolist(), strict=True)
        ]
        self._t += 1
        return np.stack(chosen)

    def _chosen(self, number: int, t: int) -> Int64:
        done = self._actions.get(number, ())  # nothing of one that ended before its first step
        if t < len(done):
            return done[t] if done[t].ndim == 1 else done[t][self._place]
        return self._still
