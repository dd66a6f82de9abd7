"""Cross-play: who plays how well with whom, on a scenario with several seats."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.envs.factory import compiled
from socialai_dsl.episodes.players import Player, participant_of
from socialai_dsl.episodes.results import EvalResult, interval_over_rooms
from socialai_dsl.episodes.scripts import with_frame_of
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.evaluation.test_set import play_test_set
from socialai_dsl.program_suite import seats_of
from socialai_dsl.trainer.config import MODEL_PREFIX, RIVAL_PREFIX
from socialai_dsl.trainer.shipped import PREFIX


@dataclass(frozen=True, eq=False)
class CrossPlay:
    """Test episodes of every player as the agent with every player on the other seats.

    Attributes:
        scenario: what was played. seats: its seats, the agent's first. names: of the players.
        episodes: of each pair that played here.
        results: by (who plays the agent, who plays the others), as indices into `names`; pairs that cannot play
            together are left out.
        recorded: those among them that people have played before, in rooms of their own number; no mean has them.
    """

    scenario: str
    seats: tuple[str, ...]
    names: tuple[str, ...]
    episodes: int
    results: Mapping[tuple[int, int], EvalResult]
    recorded: frozenset[tuple[int, int]] = frozenset()

    @property
    def agents(self) -> list[int]:
        """Who has played the agent, as indices into `names`."""
        return sorted({one for one, _ in self.results})

    @property
    def others(self) -> list[int]:
        """Who has played the others, as indices into `names`."""
        return sorted({other for _, other in self.results})

    def rate(self, pair: tuple[int, int], seat: str) -> Rate:
        """The share of a pair's episodes that were a success of a seat."""
        return self._rate([pair], seat)

    def with_themselves(self, seat: str) -> Rate | None:
        """Mean success of the players with themselves; None where nobody plays with itself."""
        return self._mean([pair for pair in self.results if pair[0] == pair[1]], seat)

    def with_others(self, seat: str) -> Rate | None:
        """Mean success of the players with each other; None where nobody plays with another."""
        return self._mean([pair for pair in self.results if pair[0] != pair[1]], seat)

    def _mean(self, pairs: Sequence[tuple[int, int]], seat: str) -> Rate | None:
        pairs = [pair for pair in pairs if pair not in self.recorded]
        return self._rate(pairs, seat) if pairs else None

    def _rate(self, pairs: Sequence[tuple[int, int]], seat: str) -> Rate:
        won, session = self._won(pairs, seat), max(self.results[pair].session for pair in pairs)
        return Rate(float(won.mean()), *interval_over_rooms(won, session))

    def _won(self, pairs: Sequence[tuple[int, int]], seat: str) -> NDArray[np.bool_]:
        """Whether each episode of these pairs was a success of a seat, bool (pairs, episodes)."""
        results = [self.results[pair] for pair in pairs]
        return np.stack([one.success if seat == self.seats[0] else one.others[seat][0] for one in results])

    def figures(self) -> dict[str, Any]:
        """The figures as a JSON-able object."""
        found: dict[str, Any] = {
            "scenario": self.scenario,
            "episodes": self.episodes,
            "players": list(self.names),
            "seats": {},
        }
        for seat in self.seats:
            alone, others = self.with_themselves(seat), self.with_others(seat)
            found["seats"][seat] = {
                "with_themselves": None if alone is None else alone.figures(),
                "with_others": None if others is None else others.figures(),
                "cells": [
                    {
                        "agent": self.names[one],
                        "others": self.names[other],
                        "episodes": self.results[one, other].episodes,
                        **self.rate((one, other), seat).figures(),
                    }
                    for one, other in sorted(self.results)
                ],
            }
        return found


class Recording(NamedTuple):
    """Test episodes that a person has played before, with one other player on all other seats.

    Attributes:
        partner: that player, as an index into the players of a cross-play.
        plays_agent: whether the person played the agent; else the partner did.
        result: what came of them, for all seats.
    """

    partner: int
    plays_agent: bool
    result: EvalResult


class Rate(NamedTuple):
    """A success rate with its 95 % interval over rooms, see `interval_over_rooms`."""

    success: float
    low: float
    high: float

    def figures(self) -> dict[str, Any]:
        """As a JSON-able object."""
        return {"success": self.success, "interval": [self.low, self.high]}

    def __str__(self) -> str:
        return f"{self.success:.2f} [{self.low:.2f}, {self.high:.2f}]"


def cross_play(
    players: Sequence[Player],
    scenario: str,
    loaded: Loaded,
    episodes: int = 100,
    out: Path | None = None,
    recordings: Mapping[int, Recording] = MappingProxyType({}),
) -> CrossPlay:
    """Let everybody play with everybody, and with themselves, on the same test episodes.

    Args:
        players: `random`, `oracle`, which is each seat's own script, trained agents, language models, rivals, which
            play the agent alone, or people, who have played before.
        scenario: as it was asked for.
        loaded: the same.
        episodes: of each pair.
        out: gets a folder for each pair with a language model, with its transcripts.
        recordings: of each person, as an index into the players, what they have played.

    Raises:
        UsageError: the scenario has one seat, or a player does not fit it or cannot be asked here, or a language model
            has no folder.
        RunFailed: a language model has spent its budget of one pair.
    """
    if out is None and any(player.is_model for player in players):
        raise OptionError("out", "got none, expected a folder for the transcripts of language models")
    program = compiled(loaded)
    seats = seats_of(program)
    if len(seats) == 1:
        raise UsageError(
            f"{scenario}: only the agent has a seat; `seat: open` gives one to another member of the cast"
        )
    playing = [number for number in range(len(players)) if number not in recordings]
    others = [number for number in playing if players[number].rival is None]
    if not others and not recordings:
        raise UsageError(
            f"{scenario}: got rivals alone, who play {seats[0]}; expected a player for {seats[1]}, too"
        )
    for player in players:
        if player.rival is not None:
            with_frame_of(player, scenario, loaded)  # so that a slip is told before anybody plays
    names, results = names_of(players), dict[tuple[int, int], EvalResult]()
    for one, other in product(playing, others):
        place = None if out is None else out / _folder_name(f"{names[one]} with {names[other]}")
        player, partner = (replace(players[number], out=place) for number in (one, other))
        partners = dict.fromkeys(seats[1:], partner)
        results[one, other] = play_test_set(
            player, scenario, loaded, program, episodes, partners=partners
        ).result
    recorded = {
        (number, one.partner) if one.plays_agent else (one.partner, number): one.result
        for number, one in recordings.items()
    }
    return CrossPlay(scenario, seats, tuple(names), episodes, results | recorded, frozenset(recorded))


def _folder_name(pair: str) -> str:
    return re.sub(r"[^\w.-]+", "_", pair).strip(".")


def names_of(players: Sequence[Player]) -> list[str]:
    """A short name for each player: the script is `script`, a file or folder has its last part and as many of those
    before it as tell it from others, a person is the participant, and whoever plays twice has a number.
    """
    parts = [_parts(one) for one in players]
    lengths = [1] * len(parts)
    names = [part[-1] for part in parts]
    for _ in range(max(map(len, parts))):
        lengths = [n + (names.count(name) > 1) for n, name in zip(lengths, names, strict=True)]
        names = ["/".join(part[-n:]) for part, n in zip(parts, lengths, strict=True)]
    totals, seen = Counter(names), Counter[str]()
    for place, name in enumerate(names):
        seen[name] += 1
        names[place] = f"{name} ({seen[name]})" if totals[name] > 1 else name
    return names


def _parts(player: Player) -> tuple[str, ...]:
    """What a player can be called by, the last part first of all."""
    if player.is_script:
        return ("script",)
    if player.is_person and player.run is not None:
        return (participant_of(player.run),)
    named = player.agent.startswith((PREFIX, MODEL_PREFIX, RIVAL_PREFIX))
    return (player.agent,) if named else Path(player.agent).parts or (player.agent,)
