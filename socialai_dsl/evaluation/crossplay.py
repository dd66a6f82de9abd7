"""Cross-play: who plays how well with whom, on a scenario with several seats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.envs.factory import compiled
from socialai_dsl.episodes.players import Player
from socialai_dsl.episodes.results import EvalResult, wilson_interval
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.test_set import play_test_set
from socialai_dsl.program_suite import seats_of
from socialai_dsl.traces.endings import short_name

_TOGETHER: Final = 100


@dataclass(frozen=True, eq=False)
class CrossPlay:
    """Test episodes of every player as the agent with every player on the other seats.

    Attributes:
        scenario: what was played. seats: its seats, the agent's first. names: of the players.
        results: by (who plays the agent, who plays the others), as indices into `names`.
    """

    scenario: str
    seats: tuple[str, ...]
    names: tuple[str, ...]
    results: Mapping[tuple[int, int], EvalResult]

    def rates(self, seat: str) -> NDArray[np.float64]:
        """The share of episodes that were a success of a seat, float64 (players, players), row: who plays the agent."""
        count = len(self.names)
        found = [self._won(pair, seat).mean() for pair in np.ndindex(count, count)]
        return np.array(found).reshape(count, count)

    def _won(self, pair: tuple[int, ...], seat: str) -> NDArray[np.bool_]:
        result = self.results[pair[0], pair[1]]
        return result.success if seat == self.seats[0] else result.others[seat][0]

    def itself_and_others(self, seat: str) -> tuple[float, float | None]:
        """Mean success of the players with themselves, and with each other; None where there is one player."""
        rates = self.rates(seat)
        own = np.eye(len(rates), dtype=bool)
        return float(rates[own].mean()), float(rates[~own].mean()) if len(rates) > 1 else None

    def figures(self) -> dict[str, Any]:
        """The figures as a JSON-able object."""
        found: dict[str, Any] = {"scenario": self.scenario, "players": list(self.names), "seats": {}}
        for seat in self.seats:
            alone, others = self.itself_and_others(seat)
            cells = [
                {
                    "agent": self.names[one],
                    "others": self.names[other],
                    "success": float(self._won((one, other), seat).mean()),
                    "interval": list(_interval(self._won((one, other), seat))),
                }
                for one, other in np.ndindex(len(self.names), len(self.names))
            ]
            found["seats"][seat] = {"with_themselves": alone, "with_others": others, "cells": cells}
        return found


def _interval(won: NDArray[np.bool_]) -> tuple[float, float]:
    return wilson_interval(int(won.sum()), len(won))


def cross_play(players: Sequence[Player], scenario: str, loaded: Loaded, episodes: int = 100) -> CrossPlay:
    """Let everybody play with everybody, and with themselves, on the same test episodes.

    Args:
        players: `random`, `oracle`, which is each seat's own script, or trained agents.
        scenario: as it was asked for.
        loaded: the same.
        episodes: of each pair.

    Raises:
        UsageError: the scenario has one seat, or a player does not fit it or cannot be asked here.
    """
    program = compiled(loaded)
    seats = seats_of(program)
    if len(seats) == 1:
        raise UsageError(
            f"{scenario}: only the agent has a seat; `seat: open` gives one to another member of the cast"
        )
    results = {}
    for one, other in np.ndindex(len(players), len(players)):
        partners = dict.fromkeys(seats[1:], players[other])
        results[one, other] = play_test_set(
            players[one], scenario, loaded, program, episodes, partners=partners
        ).result
    return CrossPlay(scenario, seats, tuple(_called(players)), results)


def _called(players: Sequence[Player]) -> list[str]:
    """A short name for each player: the script is `script`."""
    return ["script" if player.is_script else short_name(player.agent) for player in players]


def matrix_lines(found: CrossPlay, seat: str) -> list[str]:
    """The success of a seat as lines: rows are who plays the agent, columns who plays the others."""
    rates, width = found.rates(seat), max(5, *map(len, found.names)) + 2
    head = " " * width + "".join(f"{name:>{width}}" for name in found.names)
    rows = [
        f"{name:<{width}}" + "".join(f"{rate:>{width}.2f}" for rate in row)
        for name, row in zip(found.names, rates, strict=True)
    ]
    alone, others = found.itself_and_others(seat)
    told = f"with themselves {alone:.2f}" + ("" if others is None else f", with others {others:.2f}")
    return [head, *rows, told]
