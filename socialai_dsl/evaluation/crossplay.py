"""Cross-play: who plays how well with whom, on a scenario with several seats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.envs.factory import compiled, make_vec
from socialai_dsl.envs.vector_env import ScenarioVectorEnv
from socialai_dsl.episodes.play import AGENT, Rooms, TestEpisodes, play
from socialai_dsl.episodes.players import Player, make_policy
from socialai_dsl.episodes.policies import Policy
from socialai_dsl.episodes.results import EvalResult, Results, wilson_interval
from socialai_dsl.episodes.scripts import script_of
from socialai_dsl.errors import UsageError
from socialai_dsl.program_suite import Playable, seats_of
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
    scripted: Playable | None = None
    if any(player.is_script for player in players):
        found = script_of(scenario, loaded)
        if found is None:
            raise UsageError(f"{scenario}: the agent has no frame, and there is no variant `oracle`")
        scripted = compiled(found.loaded)
    results = {}
    for one, other in np.ndindex(len(players), len(players)):
        with_agent = scripted if scripted is not None and players[one].is_script else program
        results[one, other] = _played(players[one], players[other], with_agent, seats, episodes)
    return CrossPlay(scenario, seats, tuple(_called(players)), results)


def _called(players: Sequence[Player]) -> list[str]:
    """A short name for each player: the script is `script`."""
    return ["script" if player.is_script else short_name(player.agent) for player in players]


def _played(one: Player, other: Player, program: Playable, seats: Sequence[str], episodes: int) -> EvalResult:
    """The test episodes of one player as the agent with another one on all other seats."""
    envs = make_vec(
        program, num_envs=min(_TOGETHER, episodes), copy=False, autoreset_mode="Disabled", seats="all"
    )
    try:
        if other.is_script:
            envs.set_taken(envs.seat == 0)  # scripts play by themselves
        policies = {seat: _policy(other, envs, number) for number, seat in enumerate(seats) if number}
        policies[AGENT] = _AgentsScript(envs) if one.is_script else _policy(one, envs, 0)
        results = Results(envs.program.outcomes, episodes)
        play(Rooms(envs, [results]), policies, TestEpisodes(episodes))
        return results.result()
    except ValueError as error:
        raise UsageError(str(error)) from error
    finally:
        envs.close()


def _policy(player: Player, envs: ScenarioVectorEnv, seat: int) -> Policy:
    """What plays a seat; what one draws must not tell another anything, so each seat has a seed of its own."""
    if player.is_script:
        return _Nobody(len(Rooms(envs).action_sizes))
    return make_policy(replace(player, seed=player.seed + (seat << 40)), envs)[0]


class _Nobody:
    """Acts on a seat that is not taken, where no action counts."""

    def __init__(self, heads: int) -> None:
        self._heads = heads

    def reset(self, mask: NDArray[np.bool_], episodes: NDArray[np.int64] | None = None) -> None:
        """Nothing to forget."""

    def act(self, observation: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:
        """Whatever it is."""
        return np.zeros((len(observation["tokens"]), self._heads), np.int64)


class _AgentsScript:
    """The script of the agent in games of which all seats are played."""

    def __init__(self, envs: ScenarioVectorEnv) -> None:
        self._envs = envs

    def reset(self, mask: NDArray[np.bool_], episodes: NDArray[np.int64] | None = None) -> None:
        """Nothing to forget; its state is the environments'."""

    def act(self, observation: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:
        """What its frame would do now."""
        return self._envs.scripted_actions(AGENT)


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
