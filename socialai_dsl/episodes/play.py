"""The loop that plays episodes: rooms with observers, a policy on each seat, and an agenda of what is played."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Callable, Collection, Coroutine, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

import gymnasium
import numpy as np
from numpy.typing import NDArray

from socialai_dsl.envs.scenario_env import encode_action
from socialai_dsl.envs.seats import enter
from socialai_dsl.episodes.policies import EpisodeOver, Observation, Policy, PolicyDone
from socialai_dsl.episodes.room_sets import TEST_ROOMS, RoomSet
from socialai_dsl.program_suite import ProgramSuite, outcome_name

Bools = NDArray[np.bool_]
Int64 = NDArray[np.int64]
Seat = str

AGENT: Final[Seat] = "agent"
"""The seat that every scenario has, the first of several."""


@dataclass(frozen=True)
class Step:
    """A step of E rooms.

    Attributes:
        numbers: int64 (E,), the number of the episode in each room.
        running: bool (E,), the rooms in which an episode went on before this step; the others count for nothing.
        actions: of each seat that is played, int64 (E, heads).
        reward: float64 (E,), of the rooms' own seat.
        ended: bool (E,), the rooms whose episode ended in this step, by an outcome or by the horizon.
        success: bool (E,), of the own seat. outcome: int64 (E,), an index into the outcomes of what is played. Both
            count where `ended`.
        info: what the environment returned.
        others: of each other seat of the game its reward, float64 (E,), and success, bool (E,).
    """

    numbers: Int64
    running: Bools
    actions: Mapping[Seat, Int64]
    reward: NDArray[np.float64]
    ended: Bools
    success: Bools
    outcome: Int64
    info: Mapping[str, Any]
    others: Mapping[Seat, tuple[NDArray[np.float64], Bools]] = field(default_factory=dict)

    def of(self, seat: Seat) -> tuple[NDArray[np.float64], Bools]:
        """Reward, float64 (E,), and success, bool (E,), of a seat, the rooms' own one among them."""
        return self.others.get(seat, (self.reward, self.success))


class Observer:
    """Base of what watches rooms. Its methods do nothing; override those that you need."""

    def began(self, rooms: Rooms, begun: Bools) -> None:
        """Episodes have begun where `begun`, bool (E,); `rooms` has their numbers and first observations."""

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """A step has been played."""

    def back(self, rooms: Rooms) -> None:
        """The last step of the one room was taken back."""

    def cut(self, rooms: Rooms) -> None:
        """The episode of the one room was ended without a step."""


class Rooms:
    """E rooms of a scenario in which episodes are played. Nothing else may step their environment.

    Args:
        env: what `make` or `make_vec` returns; a vector environment with `autoreset_mode="Disabled"`.
        observers: are told of all that happens.
        own: the seat whose rewards and successes are those of a step; by default the first that is played.
        scripts: the seats of a vector environment with all seats that nobody plays; they follow their frames.

    Attributes:
        env: the environment itself, without wrappers.
        names: the seats of the game as far as the caller can see them.
        own: see above.
        seats: those that are played: of a vector environment with all seats, else the one that the caller plays.
        count: E; 1 of a single environment.
        observations: of each seat that is played, arrays of E. seen: of each seat of the game.
        info: what the environment returned last.
        numbers: int64 (E,), of the episodes; -1 where none has begun.
        running: bool (E,), where an episode goes on.

    Raises:
        ValueError: the environment resets itself, or has no such seat.
    """

    def __init__(
        self,
        env: Any,
        observers: Sequence[Observer] = (),
        own: Seat | None = None,
        scripts: Collection[Seat] = (),
    ) -> None:
        self.env = env.unwrapped
        self._many = isinstance(self.env, gymnasium.vector.VectorEnv)
        self.seen: dict[Seat, Observation] = {}
        self.observations: dict[Seat, Observation] = {}
        if self._many:
            mode = self.env.metadata.get("autoreset_mode")
            if mode is not gymnasium.vector.AutoresetMode.DISABLED:
                raise ValueError(f"envs: got the auto-reset mode {mode}, expected Disabled")
        self.names = tuple(self.env.seat_names)
        self.seats: tuple[Seat, ...] = tuple(name for name in self.names if name not in scripts)
        self.own = (self.seats or self.names)[0] if own is None else own
        if strange := {self.own, *scripts} - set(self.names):
            raise ValueError(f"seats: got {', '.join(sorted(strange))}, expected {', '.join(self.names)}")
        if scripts:
            self.leave_to_scripts(scripts)
        self.count = int(self.env.num_envs) // len(self.names) if self._many else 1
        self.observers = tuple(observers)
        self.info: Mapping[str, Any] = {}
        self.numbers, self.running = np.full(self.count, -1), np.zeros(self.count, np.bool_)

    @property
    def action_sizes(self) -> tuple[int, ...]:
        """The number of choices of each part of an action."""
        space = self.env.single_action_space if self._many else self.env.action_space
        return tuple(int(size) for size in space.nvec)

    def begin(
        self, reset: Mapping[str, Any], numbers: Int64 | None = None, begun: Bools | None = None
    ) -> None:
        """Begin episodes.

        Args:
            reset: arguments of `env.reset`; of a vector environment with a `reset_mask` unless all rooms begin.
            numbers: int64 (E,), of the episodes; 0 by default.
            begun: bool (E,), the rooms that begin; all by default.

        Raises:
            ValueError, RuntimeError: see `env.reset`; nothing has changed then.
        """
        mask = np.ones(self.count, np.bool_) if begun is None else begun
        observation, self.info = self.env.reset(**reset)
        self._see(observation)
        self.numbers = np.where(mask, 0 if numbers is None else numbers, self.numbers)
        self.running = self.running | mask
        for observer in self.observers:
            observer.began(self, mask)

    def leave_to_scripts(self, scripts: Collection[Seat]) -> None:
        """Say which seats nobody plays from the next step on; of a vector environment with all seats.

        Args:
            scripts: those that follow their frames then, or stay where they follow none; all others are played.

        Raises:
            ValueError: there is no such seat, or it is the agent's, which is always played.
        """
        if strange := set(scripts) - set(self.names[1:]):
            expected = ", ".join(self.names[1:]) or "none"
            raise ValueError(f"seats: got {', '.join(sorted(strange))}, expected {expected}")
        self.seats = tuple(name for name in self.names if name not in scripts)
        if len(self.names) > 1:
            played = [name in self.seats for name in self.names]
            self.env.set_taken(np.tile(played, int(self.env.num_envs) // len(self.names)))
        self.observations = {name: self.seen[name] for name in self.seats if name in self.seen}

    def step(self, actions: Mapping[Seat, Int64]) -> Step:
        """Play a step in all rooms.

        Args:
            actions: of each seat, int64 (E, heads).

        Raises:
            ValueError: an action is not one of the scenario's.
        """
        chosen = {seat: self._checked(seat, actions[seat]) for seat in self.seats}
        step = self._step_many(chosen) if self._many else self._step_one(chosen)
        self.running = self.running & ~step.ended
        for observer in self.observers:
            observer.stepped(self, step)
        return step

    def heard(self, seat: Seat) -> dict[str, Any]:
        """What is heard on a seat of the first room, as the infos of a single environment have it.

        Returns:
            `utterance`, the lines heard in the last step, and of a suite the `member` that is played.
        """
        if not self._many:
            return {name: self.info[name] for name in ("utterance", "member") if name in self.info}
        number = self.names.index(seat)
        member = self.env.members()[number]
        return {"utterance": self.env.utterances()[number]} | ({} if member is None else {"member": member})

    def encoded(self, action: Sequence[Any]) -> Int64:
        """The action that words mean in the first room, int64 (heads,), see `encode_action`."""
        if not self._many:
            found: Int64 = self.env.encode_action(action)
            return found
        program = self.env.program
        live = program.live(int(self.env.member_ids()[0])) if isinstance(program, ProgramSuite) else None
        return encode_action(action, program.actions, program.sentences, live)

    def described(self) -> dict[str, Any]:
        """The state of the first room in the scenario's own names."""
        found: dict[str, Any] = self.env.describe(0) if self._many else self.env.describe()
        return found

    def cut(self) -> None:
        """End the episode of the one room without a step.

        Raises:
            ValueError: there are several rooms.
        """
        if self.count != 1:
            raise ValueError(f"cut: got {self.count} rooms, expected one")
        self.running = np.zeros(1, np.bool_)
        for observer in self.observers:
            observer.cut(self)

    def _checked(self, seat: Seat, actions: Any) -> Int64:
        """Actions of the right shape. Raises ValueError for others; the environment looks at their range."""
        found = np.asarray(actions)
        shape = (self.count, len(self.action_sizes))
        if found.shape != shape or found.dtype.kind not in "iu":
            raise ValueError(
                f"{seat}: got actions of the shape {found.shape} and the type {found.dtype}, expected whole numbers "
                f"of the shape {shape}"
            )
        return found.astype(np.int64, copy=False)

    def _step_many(self, actions: Mapping[Seat, Int64]) -> Step:
        count = len(self.names)
        nothing = np.zeros(
            (self.count, len(self.action_sizes)), np.int64
        )  # counts for no seat that nobody plays
        together = np.stack([actions.get(name, nothing) for name in self.names], axis=1)
        observation, reward, terminated, truncated, infos = self.env.step(
            together.reshape(self.count * count, -1)
        )
        self.info = infos
        self._see(observation)
        ended = self.running & (terminated | truncated)[::count]
        none = np.zeros(self.count * count, np.int64)
        success, outcome = infos.get("success", none.astype(np.bool_)), infos.get("outcome", none)[::count]
        of_seats = {
            name: (reward[number::count], success[number::count]) for number, name in enumerate(self.names)
        }
        own_reward, own_success = of_seats.pop(self.own)
        own = own_reward, ended, own_success, outcome
        return Step(self.numbers, self.running, actions, *own, infos, of_seats)

    def _step_one(self, actions: Mapping[Seat, Int64]) -> Step:
        observation, reward, terminated, truncated, info = self.env.step(actions[self.own][0])
        self.info = info
        self._see(observation)
        ended = bool(terminated or truncated)
        outcome = self.env.program.outcomes.index(outcome_name(info)) if ended else 0
        return Step(
            self.numbers,
            self.running,
            actions,
            np.array([reward], np.float64),
            np.array([ended]),
            np.array([bool(info.get("success", False))]),
            np.array([outcome]),
            info,
        )

    def _see(self, observation: Observation) -> None:
        whole = observation if self._many else {name: value[None] for name, value in observation.items()}
        self.seen = {
            seat: {name: value[number :: len(self.names)] for name, value in whole.items()}
            for number, seat in enumerate(self.names)
        }
        self.observations = {seat: self.seen[seat] for seat in self.seats}


class Agenda(Protocol):
    """Which episodes are played.

    Attributes:
        trials: how many episodes in a row a player remembers: it forgets before those whose numbers are multiples.
    """

    trials: int

    def following(self, room: int) -> int | None:
        """The number of the next episode in a room; None if nothing is left for it."""

    def reset(self, begun: Bools, numbers: Int64) -> dict[str, Any]:
        """The arguments of `env.reset` that begin these episodes, int64 (E,), where `begun`, bool (E,)."""


class EachRoom:
    """One episode in each of the rooms 0 to N - 1 of a set: a free environment plays the next session.

    Args:
        episodes: N.
        trials: how many rooms in a row are a session; the last session may be shorter.
        sessions: the first rooms of the sessions that are left, where several agendas share them.
        rooms: the set; by default the test set.
    """

    def __init__(
        self,
        episodes: int,
        trials: int = 1,
        sessions: Iterator[int] | None = None,
        rooms: RoomSet = TEST_ROOMS,
    ) -> None:
        self.trials = trials
        self._rooms, self._episodes = rooms, episodes
        self._waiting = iter(range(0, episodes, trials)) if sessions is None else sessions
        self._next: dict[int, int] = {}

    def following(self, room: int) -> int | None:
        """See `Agenda.following`."""
        number = self._next.get(room, 0)
        if number % self.trials == 0 or number >= self._episodes:
            session = next(self._waiting, None)
            if session is None:
                return None
            number = session
        self._next[room] = number + 1
        return number

    def reset(self, begun: Bools, numbers: Int64) -> dict[str, Any]:
        """See `Agenda.reset`."""
        return self._rooms.reset_many(begun, numbers)


class EpisodesInARow:
    """The first K episodes of each room of a seed; those of room e are numbers e * K to e * K + K - 1.

    Counting the first episodes that end anywhere would favour short ones.
    """

    trials = 1

    def __init__(self, seed: int, each: int) -> None:
        self._seed, self._each = seed, each
        self._played: dict[int, int] = {}

    def following(self, room: int) -> int | None:
        """See `Agenda.following`."""
        played = self._played.get(room, 0)
        self._played[room] = played + 1
        return room * self._each + played if played < self._each else None

    def reset(self, begun: Bools, numbers: Int64) -> dict[str, Any]:
        """See `Agenda.reset`."""
        if not (numbers % self._each)[begun].any():
            return {"seed": self._seed}
        return {"options": {"reset_mask": begun}}


class OneEpisode:
    """One episode, as `env.reset` takes it.

    Args:
        reset: its arguments.
        number: of the episode, which policies and observers are told.
    """

    trials = 1

    def __init__(self, reset: Mapping[str, Any], number: int = 0) -> None:
        self._reset, self._number, self._played = dict(reset), number, False

    def following(self, room: int) -> int | None:
        """See `Agenda.following`."""
        played, self._played = self._played, True
        return None if played else self._number

    def reset(self, begun: Bools, numbers: Int64) -> dict[str, Any]:
        """See `Agenda.reset`."""
        return self._reset


def play(
    rooms: Rooms,
    players: Mapping[Seat, Policy],
    agenda: Agenda,
    stop: Callable[[], bool] = lambda: False,
    wait: float | None = None,
) -> None:
    """Play the episodes of an agenda. A room whose episode has ended plays the next one that is left.

    Args:
        rooms: where it is played; their observers see everything.
        players: a policy for each seat.
        agenda: which episodes.
        stop: asked before each step whether to stop there.
        wait: seconds that a policy which answers later may take for an answer; None: for ever.

    Raises:
        ValueError: a seat has no policy, or a policy's actions are not the scenario's, or it does not answer in time;
            or there are more rooms than episodes. What a policy raises says in a note where it was.
    """
    playing = play_async(rooms, players, agenda, stop, wait)
    if any(inspect.iscoroutinefunction(getattr(policy, "act", None)) for policy in players.values()):
        asyncio.run(playing)
    else:
        at_once(playing)


def at_once(playing: Coroutine[Any, Any, None]) -> None:
    """Run what waits for nothing, without an event loop.

    Raises:
        ValueError: it waits for something.
    """
    try:
        playing.send(None)
    except StopIteration:
        return
    playing.close()
    raise ValueError("players: got a policy that answers later; declare its method act by `async def`")


async def play_async(
    rooms: Rooms,
    players: Mapping[Seat, Policy],
    agenda: Agenda,
    stop: Callable[[], bool] = lambda: False,
    wait: float | None = None,
) -> None:
    """`play`, with policies that answer later."""
    if set(players) != set(rooms.seats):
        raise ValueError(f"players: got {sorted(players)}, expected one for each of {list(rooms.seats)}")
    ended, leaving = np.ones(rooms.count, np.bool_), False
    try:
        while True:
            if ended.any():
                if leaving:
                    await _leave(players)
                _begin(rooms, players, agenda, ended)
            if not rooms.running.any() or stop():
                return
            leaving = True
            try:
                ended = rooms.step(await _all_asked(rooms, players, wait)).ended
            except EpisodeOver:
                rooms.cut()
                ended = np.ones(1, np.bool_)
    except PolicyDone:
        return


async def _leave(players: Mapping[Seat, Policy]) -> None:
    """Tell the policies that want to know of it that an episode is over."""
    for policy in players.values():
        leave = getattr(policy, "leave", None)
        if leave is not None:
            await leave()


def _begin(rooms: Rooms, players: Mapping[Seat, Policy], agenda: Agenda, ended: Bools) -> None:
    """Begin what is next in the rooms whose episode has ended."""
    numbers, begun = rooms.numbers.copy(), np.zeros(rooms.count, np.bool_)
    for room in np.flatnonzero(ended).tolist():
        number = agenda.following(room)
        if number is not None:
            numbers[room], begun[room] = number, True
    if not begun.any():
        return
    if (numbers < 0).any():
        raise ValueError(
            f"envs: got {rooms.count} of them for {int(begun.sum())} episodes, expected at most as many"
        )
    rooms.begin(agenda.reset(begun, numbers), numbers, begun)
    forgetting = begun & (numbers % agenda.trials == 0)
    entering = begun & ~forgetting
    for policy in players.values():
        if forgetting.any():
            policy.reset(forgetting.copy(), numbers.copy())
        enter(policy, entering.copy())


async def _all_asked(rooms: Rooms, players: Mapping[Seat, Policy], wait: float | None) -> dict[Seat, Int64]:
    """The actions of all seats. Those who answer later are asked at once, and all of them are waited for."""
    later = [seat for seat, policy in players.items() if inspect.iscoroutinefunction(policy.act)]
    if len(later) < 2 or not _is_in_a_loop():
        return {seat: await _asked(rooms, seat, policy, wait) for seat, policy in players.items()}
    found = {
        seat: await _asked(rooms, seat, policy, wait) for seat, policy in players.items() if seat not in later
    }
    asked = [_asked(rooms, seat, players[seat], wait) for seat in later]
    raised: list[BaseException] = []
    for seat, answer in zip(later, await asyncio.gather(*asked, return_exceptions=True), strict=True):
        if isinstance(answer, BaseException):
            raised.append(answer)
        else:
            found[seat] = answer
    if raised:
        raise next((one for one in raised if not isinstance(one, PolicyDone | EpisodeOver)), raised[0])
    return found


def _is_in_a_loop() -> bool:
    """Whether an event loop runs here."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


async def _asked(rooms: Rooms, seat: Seat, policy: Policy, wait: float | None) -> Int64:
    """The actions that a policy chooses."""
    try:
        actions = policy.act(rooms.observations[seat])
        if inspect.isawaitable(actions):
            return await (actions if wait is None else asyncio.wait_for(actions, wait))
        return actions
    except (PolicyDone, EpisodeOver):
        raise
    except TimeoutError:
        raise ValueError(f"{seat}: {type(policy).__name__} did not answer within {wait} s") from None
    except Exception as error:
        going = rooms.numbers[rooms.running].tolist()
        shown = (
            f"episode {going[0]}"
            if len(going) == 1
            else f"{len(going)} episodes, number {going[0]} among them"
        )
        error.add_note(f"while {type(policy).__name__} played the seat {seat!r} of {shown}")
        raise
