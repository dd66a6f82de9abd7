"""Who sits on the seats of environments: the caller on one or all, a script, chance, a policy or nobody on others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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

Seating = str | Mapping[str, Any]
"""`agent`, `all`, or the seats that others than the caller fill, by member of the cast."""


class Partner(Protocol):
    """What fills a seat of E games, as `socialai_dsl.episodes.policies.Policy` does."""

    def reset(self, mask: NDArray[np.bool_], episodes: NDArray[np.int64] | None = None) -> None:
        """Forget the past of games in which a new episode begins, bool (E,)."""

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
        own: the number of the caller's; None: all are.
        partners: who fills the others, by number: SCRIPT, RANDOM, NOBODY or a `Partner`.
    """

    names: tuple[str, ...]
    own: int | None
    partners: Mapping[int, Any]

    @property
    def rows(self) -> slice:
        """The caller's rows among those of all seats of all games."""
        return (
            slice(None)
            if self.own is None or len(self.names) == 1
            else slice(self.own, None, len(self.names))
        )

    @classmethod
    def of(cls, seating: Seating, programs: Sequence[Program]) -> Seats:
        """Who sits where.

        Raises:
            ValueError: a seat does not exist, is filled by what is no player, or none is left to the caller.
        """
        if isinstance(seating, str) and seating in ("agent", "all"):
            names = tuple(map(str, programs[0].seats)) if seating == "all" else ("agent",)
            return cls(names, None if seating == "all" else 0, {})
        if not isinstance(seating, Mapping):
            expected = "'agent', 'all', or a mapping from members of the cast to who fills their seats"
            raise ValueError(f"seats: got {seating!r}; expected {expected}")
        names = tuple(map(str, programs[0].seats))
        for name, partner in seating.items():
            require_seat(name, names)
            _check_partner(str(name), partner, programs)
        # Whoever is not named is the caller's, or if that is said of nobody in particular the agent is.
        free = [name for name in names if name not in seating]
        if not free:
            raise ValueError(
                f"seats: got {', '.join(names)} filled; expected one left for the actions of `step`"
            )
        own = 0 if names[0] in free else names.index(free[0])
        partners = {number: seating.get(name, SCRIPT) for number, name in enumerate(names) if number != own}
        return cls(names, own, partners)


def require_seat(name: Any, names: Sequence[str]) -> None:
    """See that a seat is one of these. Raises ValueError."""
    if name not in names:
        near = suggested(str(name), names, quoted=repr)
        raise ValueError(f"seats: got {name!r}; expected one of {', '.join(names)}{near}")


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
    if name == "agent" and partner == SCRIPT and lacking:
        raise ValueError(
            f"seats['agent']: got 'script', but the agent of {lacking[0]} follows no frame; expected 'random' or a "
            "policy, or the variant +oracle, if there is one"
        )


class Company:
    """The partners of the caller in the games of a table: they act whenever the caller does."""

    def __init__(self, seats: Seats, table: Table) -> None:
        self._seats, self._table = seats, table
        self._partners = dict(seats.partners)
        self._sizes = table.merged.action_space().nvec.astype(np.uint64)
        self._sites = [np.uint64(draws.site(f"seats.{name}")) for name in seats.names]
        self._sit()

    def seat(self, name: str, partner: Any) -> None:
        """Let somebody else than before fill a seat from the next step on. Raises ValueError as `Seats.of` does."""
        require_seat(name, self._seats.names)
        number = self._seats.names.index(name)
        if number == self._seats.own:
            raise ValueError(f"seats: got {name!r}, whose actions are those of `step`; expected another one")
        _check_partner(name, partner, self._table.programs)
        self._partners[number] = partner
        self._sit()

    def _sit(self) -> None:
        """Leave the seats on which scripts play by themselves; the agent's is always taken."""
        scripted = [number for number, partner in self._partners.items() if number and _is(partner, SCRIPT)]
        taken = np.ones((self._table.rows, len(self._seats.names)), np.bool_)
        taken[:, scripted] = False
        self._table.set_taken(taken.reshape(-1))

    def begin(self, games: NDArray[np.bool_]) -> None:
        """Episodes have begun in some games, bool (E,)."""
        for partner in self._partners.values():
            if not isinstance(partner, str):
                partner.reset(games)

    def act(self, own: NDArray[Any]) -> NDArray[np.int64]:
        """The actions of all seats, int64 (E S, heads), where the caller's are `own`, (E, heads)."""
        count, table = len(self._seats.names), self._table
        actions = np.zeros((table.rows, count, len(self._sizes)), np.int64)
        actions[:, self._seats.own] = own
        for number, partner in self._partners.items():
            if _is(partner, RANDOM):
                actions[:, number] = self._drawn(number)
            elif _is(partner, NOBODY):
                actions[:, number, 0] = self._sizes[0] - np.uint64(1)  # no movement
            elif not isinstance(partner, str):
                image, tokens = table.image[number::count].copy(), table.tokens[number::count].copy()
                actions[:, number] = partner.act({"image": image, "tokens": tokens})
        if _is(self._partners.get(0), SCRIPT):
            actions[:, 0] = table.scripted_actions()
        return actions.reshape(table.players, -1)

    def _drawn(self, number: int) -> NDArray[np.int64]:
        """Actions drawn uniformly, int64 (E, heads), by the key of the episode and the step."""
        keys = self._table.state.keys[:, Key.KEY, None]
        step = self._table.state.registers[:, Register.T, None].astype(np.uint64) + np.uint64(1)
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
