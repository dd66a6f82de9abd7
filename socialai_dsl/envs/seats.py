"""Who sits on the seats of environments: the caller on one or all, a script, chance, a policy or nobody on others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from socialai_dsl import draws
from socialai_dsl.diagnostics import suggested
from socialai_dsl.engine.state import Key
from socialai_dsl.envs.table import Table
from socialai_dsl.program import Flag, Header, Program, Register

SCRIPT: Final = "script"
RANDOM: Final = "random"
NOBODY: Final = "nobody"
CALLER: Final = "caller"
"""Whose actions are those of `step`; said where the caller has several seats and somebody else others."""

Seating = str | Mapping[str, Any]
"""`agent`, `all`, or the seats that others than the caller fill, by member of the cast."""


class Partner(Protocol):
    """What fills a seat of E games, as `socialai_dsl.episodes.policies.Policy` does."""

    def reset(self, mask: NDArray[np.bool_], episodes: NDArray[np.int64] | None = None) -> None:
        """Forget the past of games in which a new episode begins, bool (E,); not those that go on with a session."""

    def act(self, observation: Mapping[str, NDArray[Any]]) -> Any:
        """Choose actions, int64 (E, heads), given `image` and `tokens` of E games."""


@dataclass(frozen=True, eq=False)
class SeatMoment:
    """What a seat got in the last step, and what was done there.

    Attributes:
        observation: `image` and `tokens`, as `ScenarioEnv` gives them.
        info: `utterance` and `history`, as it hears them.
        action: int64 (heads,), of the player there; None before the first step, and where nobody sat.
        did: the word for what its body did; None before the first step.
        reward: of the step; 0 before the first one.
        success: whether the episode was its success; None until it has ended.
    """

    observation: dict[str, NDArray[Any]]
    info: dict[str, str]
    action: NDArray[np.int64] | None
    did: str | None
    reward: float
    success: bool | None


@dataclass(frozen=True)
class Seats:
    """The seats of a game.

    Attributes:
        names: all of them, the agent's first; with `agent` alone that one.
        own: the numbers of the caller's.
        partners: who fills the others, by number: players that take turns from game to game, each SCRIPT, RANDOM,
            NOBODY or a `Partner`.
    """

    names: tuple[str, ...]
    own: tuple[int, ...]
    partners: Mapping[int, tuple[Any, ...]]

    @property
    def all_own(self) -> bool:
        """Whether the caller has all of them."""
        return len(self.own) == len(self.names)

    def rows(self, games: int) -> slice | NDArray[np.intp]:
        """The caller's rows among those of all seats of so many games."""
        if self.all_own:
            return slice(None)
        if len(self.own) == 1:
            return slice(self.own[0], None, len(self.names))
        number = np.arange(games, dtype=np.intp)[:, None] * len(self.names)
        return (number + np.array(self.own, np.intp)).reshape(-1)

    @classmethod
    def of(cls, seating: Seating, programs: Sequence[Program]) -> Seats:
        """Who sits where.

        Raises:
            ValueError: a seat does not exist, is filled by what is no player, or none is left to the caller.
        """
        if isinstance(seating, str) and seating in ("agent", "all"):
            names = tuple(map(str, programs[0].seats)) if seating == "all" else ("agent",)
            return cls(names, tuple(range(len(names))), {})
        if not isinstance(seating, Mapping):
            expected = "'agent', 'all', or a mapping from members of the cast to who fills their seats"
            raise ValueError(f"seats: got {seating!r}; expected {expected}")
        names = tuple(map(str, programs[0].seats))
        filled = {}
        for name, players in seating.items():
            require_seat(name, names)
            filled[name] = _taking_turns(str(name), players)
        own = _own_of(filled, names)
        partners = {n: filled.get(name, (SCRIPT,)) for n, name in enumerate(names) if n not in own}
        for number, players in partners.items():
            for player in players:
                _check_partner(names[number], player, programs)
        return cls(names, own, partners)


def _own_of(filled: Mapping[str, tuple[Any, ...]], names: Sequence[str]) -> tuple[int, ...]:
    """The caller's seats: those that are said to be, else the first that nobody fills. Raises ValueError for none."""
    said = tuple(
        n for n, name in enumerate(names) if [_is(p, CALLER) for p in filled.get(name, ())] == [True]
    )
    free = tuple(n for n, name in enumerate(names) if name not in filled)
    if not said and not free:
        raise ValueError(f"seats: got {', '.join(names)} filled; expected one left for the actions of `step`")
    return said or free[:1]


def require_seat(name: Any, names: Sequence[str]) -> None:
    """See that a seat is one of these. Raises ValueError."""
    if name not in names:
        near = suggested(str(name), names, quoted=repr)
        raise ValueError(f"seats: got {name!r}; expected one of {', '.join(names)}{near}")


def _taking_turns(name: str, players: Any) -> tuple[Any, ...]:
    """Those who fill a seat, as a tuple. Raises ValueError for a list of none."""
    if not isinstance(players, list | tuple):
        return (players,)
    if not players:
        raise ValueError(f"seats[{name!r}]: got an empty list; expected at least one player")
    return tuple(players)


def _check_partner(name: str, partner: Any, programs: Sequence[Program]) -> None:
    if isinstance(partner, str) and partner not in (SCRIPT, RANDOM, NOBODY):
        raise ValueError(
            f"seats[{name!r}]: got {partner!r}; expected 'script', 'random', 'nobody' or a policy"
        )
    if not isinstance(partner, str) and not (hasattr(partner, "act") and hasattr(partner, "reset")):
        raise ValueError(
            f"seats[{name!r}]: got {partner!r}; expected 'script', 'random', 'nobody' or a policy with "
            "`reset` and `act`"
        )
    lacking = [p.name for p in programs if not p.header(Header.FLAGS) & Flag.AGENT_FRAME]
    if name == "agent" and _is(partner, SCRIPT) and lacking:
        raise ValueError(
            f"seats['agent']: got 'script', but the agent of {lacking[0]} follows no frame; expected 'random' or a "
            "policy, or the variant +oracle, if there is one"
        )


def enter(player: Any, games: NDArray[np.bool_]) -> None:
    """Let a policy that keeps something of rooms forget them, and nothing else, in games that go on with a session."""
    forgets_rooms = getattr(player, "enter", None)
    if forgets_rooms is not None and games.any():
        forgets_rooms(games)


class Company:
    """The partners of the caller in the games of a table: they act whenever the caller does.

    Of K players that take turns on a seat, number g modulo K has it in game g.

    Raises:
        ValueError: more players take turns than there are games.
    """

    def __init__(self, seats: Seats, table: Table) -> None:
        self._seats, self._table = seats, table
        self._partners: dict[int, tuple[Any, ...]] = {}
        self._sizes = table.merged.action_space().nvec.astype(np.uint64)
        self._sites = [np.uint64(draws.site(f"seats.{name}")) for name in seats.names]
        self._sit(dict(seats.partners))

    @property
    def policies(self) -> dict[str, Partner]:
        """The partners that are policies, as `helper.0`: the seat, and their place among those that take turns."""
        return {
            f"{self._seats.names[number]}.{place}": player
            for number, players in self._partners.items()
            for place, player in enumerate(players)
            if not isinstance(player, str)
        }

    def seat(self, name: str, partner: Any) -> None:
        """Let somebody else than before fill a seat from the next step on. Raises ValueError as `Seats.of` does."""
        require_seat(name, self._seats.names)
        number = self._seats.names.index(name)
        if number in self._seats.own:
            raise ValueError(f"seats: got {name!r}, whose actions are those of `step`; expected another one")
        players = _taking_turns(name, partner)
        for player in players:
            _check_partner(name, player, self._table.programs)
        self._sit({**self._partners, number: players})

    def _filled(self) -> Iterator[tuple[int, slice, Any]]:
        """The number of each seat, the games of each player there, and the player."""
        for number, players in self._partners.items():
            for place, player in enumerate(players):
                yield number, slice(place, None, len(players)), player

    def _sit(self, partners: dict[int, tuple[Any, ...]]) -> None:
        """Let these fill the seats, and leave those whose scripts play by themselves; the agent's is always taken."""
        most = max(map(len, partners.values()), default=0)
        if most > self._table.rows:
            raise ValueError(
                f"seats: got {most} players that take turns; expected at most {self._table.rows} games"
            )
        self._partners = partners
        taken = np.ones((self._table.rows, len(self._seats.names)), np.bool_)
        for number, games, player in self._filled():
            taken[games, number] = not number or not _is(player, SCRIPT)
        self._table.set_taken(taken.reshape(-1))

    @property
    def playing(self) -> NDArray[np.uint64]:
        """Seed, index and episode of each game, uint64 (E, 3): a view of the state."""
        found: NDArray[np.uint64] = self._table.state.keys[:, : Key.KEY]
        return found

    def begin(self, begun: NDArray[np.bool_], before: NDArray[np.uint64]) -> None:
        """Episodes have begun in some games, bool (E,), after those that were `playing` before."""
        if not begun.any():
            return
        now = self.playing
        follows = (now - before == np.array([0, 0, 1], np.uint64)).all(1)
        enters = begun & follows & (now[:, Key.EPISODE] % self._table.sessions != 0)
        forgets = begun & ~enters
        for _, games, player in self._filled():
            if isinstance(player, str):
                continue
            if forgets[games].any():
                player.reset(forgets[games])
            enter(player, enters[games])

    def act(self, own: NDArray[Any]) -> NDArray[np.int64]:
        """The actions of all seats, int64 (E S, heads), where the caller's are `own`, game by game."""
        seats, table = self._seats, self._table
        count = len(seats.names)
        actions = np.zeros((table.rows, count, len(self._sizes)), np.int64)
        actions[:, list(seats.own)] = own.reshape(table.rows, len(seats.own), -1)
        for number, games, player in self._filled():
            if _is(player, RANDOM):
                actions[games, number] = self._drawn(number, games)
            elif _is(player, NOBODY):
                actions[games, number, 0] = self._sizes[0] - np.uint64(1)  # no movement
            elif _is(player, SCRIPT) and number == 0:
                actions[games, 0] = table.scripted_actions()[games]
            elif not isinstance(player, str):
                image, tokens = table.image[number::count][games], table.tokens[number::count][games]
                actions[games, number] = player.act({"image": image.copy(), "tokens": tokens.copy()})
        return actions.reshape(table.players, -1)

    def _drawn(self, number: int, games: slice) -> NDArray[np.int64]:
        """Actions of a seat in G games, drawn uniformly, int64 (G, heads), by the key of the episode and the step."""
        keys = self._table.state.keys[games, Key.KEY, None]
        step = self._table.state.registers[games, Register.T, None].astype(np.uint64) + np.uint64(1)
        head = np.arange(len(self._sizes), dtype=np.uint64)
        word = self._sites[number] << np.uint64(32) | step << np.uint64(16) | head
        bits = _mixed(keys + word * np.uint64(draws.GOLDEN))
        return ((bits >> np.uint64(32)) * self._sizes >> np.uint64(32)).astype(np.int64)


def _mixed(value: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """`draws.mix` of each."""
    value = (value ^ value >> np.uint64(30)) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ value >> np.uint64(27)) * np.uint64(0x94D049BB133111EB)
    return value ^ value >> np.uint64(31)


def _is(partner: Any, word: str) -> bool:
    return isinstance(partner, str) and partner == word
