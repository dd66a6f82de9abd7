"""Who sits on which seats of a scenario: players for the rooms of a test, and partners of the one who plays alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import Loaded, LoadedSuite
from socialai_dsl.diagnostics import suggested
from socialai_dsl.envs.factory import compiled, make, make_vec
from socialai_dsl.envs.scenario_env import ScenarioEnv
from socialai_dsl.envs.seats import CALLER, NOBODY, RANDOM, SCRIPT
from socialai_dsl.episodes.play import AGENT, Rooms, Seat, Step
from socialai_dsl.episodes.players import Player, make_policy, named_agent, require_trainer
from socialai_dsl.episodes.policies import Int64, Observation, Policy, ReplayedPolicy
from socialai_dsl.episodes.scripts import with_frame_of
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.frontend import load
from socialai_dsl.program_suite import Playable, has_script, seats_of
from socialai_dsl.source import Source
from socialai_dsl.traces.endings import short_name
from socialai_dsl.traces.state import names_of

Partners = Mapping[Seat, Player]
"""Who plays on seats that the one in question does not play."""

_SEAT = "seat"
_WORDS = {SCRIPT: "oracle", NOBODY: NOBODY}
"""What is said of a seat alone -> the player that it means."""


Named = Sequence[tuple[Seat, str | Player]]
"""Pairs of a seat and who has it: a `Player`, `script`, `random`, `nobody`, the path of a trained agent,
`shipped:NAME` or `llm:MODEL`; on the agent's seat also `rival:NAME`."""


def partners_of(named: Named, scenario: str, program: Playable) -> dict[Seat, Player]:
    """Who is meant by pairs of a seat and a player.

    Args:
        named: the pairs.
        scenario: as it was asked for.
        program: the same, compiled.

    Raises:
        UsageError: a seat does not exist or has two players, a player is unknown, or no seat is left.
    """
    found = pools_of(named, scenario, program)
    for seat, players in found.items():
        if len(players) > 1:
            raise OptionError(_SEAT, f"got {len(players)} players for {seat}, expected one")
    return {seat: players[0] for seat, players in found.items()}


def pools_of(named: Named, scenario: str, program: Playable) -> dict[Seat, list[Player]]:
    """`partners_of`, with several players that take turns on a seat; a path with `*` is all that it matches."""
    seats = seats_of(program)
    found: dict[Seat, list[Player]] = {}
    for seat, name in named:
        if seat not in seats:
            near = suggested(seat, seats, quoted=repr)
            raise OptionError(_SEAT, f"got {seat!r}, expected one of {', '.join(seats)}{near}")
        for one in [name] if isinstance(name, Player) else _matches(name):
            player = _meant(one, scenario)
            require_seat(player, seat)
            found.setdefault(seat, []).append(player)
    if len(found) == len(seats):
        raise OptionError(_SEAT, f"got a player for {', '.join(seats)}, expected one seat left for who plays")
    return found


def require_seat(player: Player, seat: Seat) -> None:
    """See that a player can have a seat.

    Raises:
        UsageError: it is a rival, and the seat is not the agent's.
    """
    if player.rival is not None and seat != AGENT:
        raise OptionError(
            _SEAT, f"got {player.agent!r} for {seat}, but a rival is a frame for the seat {AGENT!r} alone"
        )


def called(player: Player) -> str:
    """What is said of a seat alone to mean this player."""
    return SCRIPT if player.is_script else player.agent


def meant_by(word: str) -> Player:
    """The player that is called so on a seat, without looking for it."""
    return Player(_WORDS.get(word, word))


def _meant(name: str | Player, scenario: str) -> Player:
    if isinstance(name, Player):
        return name
    return meant_by(name) if name in _WORDS else Player(named_agent(name, scenario))


def _matches(name: str) -> list[str]:
    """The paths that a pattern stands for. Raises UsageError where there is none."""
    found = sorted(glob(name)) if "*" in name else [name]
    if not found:
        raise OptionError(_SEAT, f"got {name!r}, which matches no file or folder")
    return found


def seats_with(pools: Mapping[Seat, Sequence[Player]], program: Playable) -> dict[Seat, Any]:
    """What `make_vec` takes by `seats` where these players take turns on theirs, and the caller has the other seats.

    Raises:
        UsageError: a player has no script, does not fit, or is none that can be asked here.
    """
    filled = _filled(pools, program)
    return {seat: filled.get(seat, CALLER) for seat in seats_of(program)}


def own_seat(partners: Partners, program: Playable) -> Seat:
    """The seat of the one who has these partners: the first that is left."""
    return next(seat for seat in seats_of(program) if seat not in partners)


def seating(
    partners: Partners, scenario: str, loaded: Loaded, texts: Mapping[Path, Source] | None = None
) -> tuple[Loaded, dict[Seat, str | Policy] | None]:
    """What is made for one who plays alone, and who fills the other seats there, as `make` takes it by `seats`.

    Args:
        partners: of other seats; the rest follow their scripts.
        scenario: as it was asked for.
        loaded: the same.
        texts: those that it is loaded with, see `check`.

    Returns:
        The scenario, or that with a frame for the agent where a script or a rival plays it; None where nobody was
        named.

    Raises:
        UsageError: a partner has no script, does not fit, or is none that can be asked here.
    """
    if not partners:
        return loaded, None
    if AGENT in partners and partners[AGENT].follows_frame:
        loaded = with_frame_of(partners[AGENT], scenario, loaded, texts).loaded
    return loaded, _one_each(partners, compiled(loaded))


@dataclass(frozen=True, eq=False)
class Beside:
    """What one plays who plays alone beside partners, in any number of environments.

    Attributes:
        loaded: the scenario, or that with a frame for the agent where a script or a rival plays it.
        program: the same, compiled.
        partners: of other seats; the rest follow their scripts.
    """

    loaded: Loaded
    program: Playable
    partners: Partners

    def seats(self) -> dict[Seat, str | Policy] | None:
        """Who fills the other seats of one more environment, as `make` takes it; None where nobody was named.

        Raises:
            UsageError: see `seating`.
        """
        return _one_each(self.partners, self.program) if self.partners else None


def beside(named: Named, scenario: str) -> Beside:
    """What one plays beside these.

    Args:
        named: who has other seats.
        scenario: a path or a name.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: see `partners_of` and `seating`.
    """
    loaded = load(scenario)
    partners = partners_of(named, scenario, compiled(loaded))
    played, _ = seating(partners, scenario, loaded)
    return Beside(played, compiled(played), partners)


def _one_each(partners: Partners, program: Playable) -> dict[Seat, str | Policy]:
    """What fills the seats of partners in an environment of a program. Raises UsageError as `seating` does."""
    filled = _filled({seat: [player] for seat, player in partners.items()}, program)
    return {seat: one for seat, [one] in filled.items()}


def _filled(pools: Mapping[Seat, Sequence[Player]], program: Playable) -> dict[Seat, list[str | Policy]]:
    """What fills seats on which players take turns; what one draws must not tell another anything."""
    env = make(program)
    try:
        return {
            seat: [
                _filling(replace(player, seed=player.seed + (place << 32)), seat, program, env)
                for place, player in enumerate(players)
            ]
            for seat, players in pools.items()
        }
    except UsageError:
        raise
    except ValueError as error:
        raise UsageError(str(error)) from error
    finally:
        env.close()


def _filling(player: Player, seat: Seat, program: Playable, env: Any) -> str | Policy:
    if player.follows_frame:
        if not has_script(program, seat):
            raise OptionError(_SEAT, f"got 'script' for {seat}, which follows no frame, so it has no script")
        return SCRIPT
    if player.agent in (RANDOM, NOBODY) and player.policy is None:
        return player.agent
    if player.is_model or player.is_person:
        raise OptionError(
            _SEAT,
            f"got {player.agent!r} for {seat}, expected script, random, nobody or a trained agent",
        )
    if player.is_trained:
        require_trainer()
    return _seated(player, seats_of(program).index(seat), env)[0]


def _seated(player: Player, number: int, envs: Any) -> tuple[Policy, list[str]]:
    """What plays a seat; what one draws must not tell another anything, so each seat has a seed of its own."""
    return make_policy(replace(player, seed=(player.seed + (number << 40)) % (1 << 63)), envs)


@dataclass(frozen=True, eq=False)
class Company:
    """Rooms of a scenario, who plays in them, and on which seats.

    Attributes:
        envs: a vector environment with all seats.
        policies: of each seat that is played, but for those of language models.
        own: the seat of the one in question. scripts: the seats that nobody plays; they follow their scripts.
        told: what is to be known about the players.
    """

    envs: Any
    policies: Mapping[Seat, Policy]
    own: Seat
    scripts: tuple[Seat, ...] = ()
    told: list[str] = field(default_factory=list)


@contextmanager
def company(
    players: Mapping[Seat, Player], own: Seat, scenario: str, loaded: Loaded, program: Playable, games: int
) -> Iterator[Company]:
    """Rooms in which these players sit on all seats; for language models the caller has the policies.

    Args:
        players: of each seat.
        own: the seat of the one in question.
        scenario: as it was asked for.
        loaded: the same.
        program: the same, compiled.
        games: how many rooms.

    Raises:
        UsageError: a player does not fit the scenario, now or in the block.
    """
    for seat, player in players.items():
        require_seat(player, seat)
        if player.is_person:
            raise OptionError(_SEAT, f"got 'human' for {seat}, expected a player who needs no terminal")
        if player.is_trained:
            require_trainer()
    played = program
    if players[AGENT].follows_frame:
        played = compiled(with_frame_of(players[AGENT], scenario, loaded).loaded)
    seats = seats_of(program)
    scripts = tuple(seat for seat in seats if seat != AGENT and players[seat].is_script)
    envs = make_vec(
        played,
        num_envs=games,
        copy=False,
        autoreset_mode="Disabled",
        seats="all" if len(seats) > 1 else AGENT,
    )
    plain = envs if played is program else make(program)  # which the players are made for
    try:
        policies: dict[Seat, Policy] = {}
        told: list[str] = []
        for number, seat in enumerate(seats):
            if seat in scripts or players[seat].is_model:
                continue
            if players[seat].follows_frame:
                policies[seat] = FrameOfAgent(envs)
                continue
            policies[seat], warnings = _seated(players[seat], number, plain)
            told += [warning for warning in warnings if warning not in told]
        yield Company(envs, policies, own, scripts, told)
    except ValueError as error:
        raise UsageError(f"{scenario}: {error}") from error
    finally:
        envs.close()
        plain.close()


class FrameOfAgent:
    """The frame of the agent, its script or a rival, in rooms of which all seats are played."""

    def __init__(self, envs: Any) -> None:
        self._envs = envs

    def reset(self, mask: NDArray[np.bool_], episodes: Int64 | None = None) -> None:
        """Nothing to forget; its state is the environments'."""

    def act(self, observation: Observation) -> Int64:
        """What its frame would do now."""
        found: Int64 = self._envs.scripted_actions(AGENT)
        return found


def acts_of_others(env: Any) -> dict[Seat, Int64]:
    """What those have done in the last step who sit on other seats than the caller's, int64 (heads,) each.

    Args:
        env: what `make` returns.
    """
    done = {seat: env.seat_moment(seat).action for seat in env.seats if seat not in env.seat_names}
    return {seat: action for seat, action in done.items() if action is not None}


def acts_of_all(rooms: Rooms, step: Step) -> dict[Seat, Int64]:
    """What was done in a step of the first of these rooms on each seat where somebody sits, int64 (heads,) each."""
    done = {seat: actions[0] for seat, actions in step.actions.items()}
    return done | acts_of_others(rooms.env) if isinstance(rooms.env, ScenarioEnv) else done


def name_of(rooms: Rooms, seat: Seat, loaded: Loaded) -> str:
    """The name by which others hear who has a seat, in the first of these rooms of what was loaded."""
    described = rooms.described()
    if isinstance(loaded, LoadedSuite):
        loaded = loaded.members[loaded.member_names.index(described["member"])]
    return names_of(loaded.checked, described)[seat]


def by_seat(acts: Sequence[Mapping[Seat, Any]]) -> dict[Seat, list[Int64]]:
    """What was done on each seat in an episode, int64 (heads,) each, from what was done in each step."""
    return {seat: [np.array(step[seat], np.int64) for step in acts] for seat in (acts or [{}])[0]}


def sitting(program: Playable, partners: Partners, own: Seat) -> dict[Seat, str]:
    """Who has each seat but the own one, in a word: nobody where there is no player and no script."""

    def word(seat: Seat) -> str:
        if seat not in partners:
            return SCRIPT if has_script(program, seat) else NOBODY
        return short_name(called(partners[seat]))

    return {seat: word(seat) for seat in seats_of(program) if seat != own}


def replayed_seats(
    seats: Sequence[Seat], own: Seat, scripts: Sequence[Seat], actions: Sequence[Int64]
) -> tuple[dict[Seat, str | Policy] | None, list[Int64]]:
    """Who fills the other seats of a recorded episode, as `make` takes it, and the own actions, int64 (heads,) each.

    Args:
        seats: of the game.
        own: the one that is played again.
        scripts: those that followed their scripts.
        actions: int64 (heads,) each, then there are no other players (None); of several seats (S, heads).
    """
    kept = list(actions)
    if not kept or kept[0].ndim == 1:
        return None, kept
    others: dict[Seat, str | Policy] = {
        seat: SCRIPT if seat in scripts else ReplayedPolicy([step[number] for step in kept])
        for number, seat in enumerate(seats)
        if seat != own
    }
    return others, [step[seats.index(own)] for step in kept]
