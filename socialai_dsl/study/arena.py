"""What is played in a block, and one episode of it: who has which seat, what a seat gets, and what was done."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.briefing import Tell, brief
from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.checking.studies import is_rival, is_trained
from socialai_dsl.envs import ScenarioVectorEnv
from socialai_dsl.envs.factory import compiled
from socialai_dsl.envs.seats import RANDOM, SCRIPT, enter
from socialai_dsl.envs.view import View
from socialai_dsl.episodes.play import AGENT, Observer, Rooms, Seat
from socialai_dsl.episodes.policies import Observation
from socialai_dsl.errors import OptionError
from socialai_dsl.llm.view import LastStep, TextView
from socialai_dsl.program import LOOKS, VIEW
from socialai_dsl.program_suite import ProgramSuite, channels_of, has_script, seats_of, words_of_looks
from socialai_dsl.semantics.typed import Phrases
from socialai_dsl.traces.tracing import sight_of

Action = list[int]
Acts = Mapping[Seat, Action | None]
"""Of each seat what was done; None where nobody sat and the member followed its frame."""

_UP: Final = 3
_REMEMBERED: Final = 4096


class Arena:
    """What is played in a block, with environments that are made before they are needed.

    Args:
        loaded: the scenario or suite.
        tell: what players are told of the task.
        language: of the instructions, where they are written in it.

    Attributes:
        loaded: see above. program: the same, compiled.
        seats: of the game. actions: the words for movements. briefing: what players are told of the task.
    """

    def __init__(self, loaded: Loaded, tell: Tell | None = None, language: str | None = None) -> None:
        self.loaded, self.program = loaded, compiled(loaded)
        self.seats = seats_of(self.program)
        self.actions = tuple(self.program.actions)
        try:
            self.briefing = brief(loaded, tell, language=language)
        except OptionError:  # the scenario's instructions are in other languages, or there are none
            self.briefing = brief(loaded, tell if tell == "nothing" else None)
        self._phrases = Phrases(self.actions, self.program.sentences)
        self._texts = {seat: TextView(self.program, seat=seat) for seat in self.seats}
        self._spoken: dict[tuple[int, str], Action] = {}
        self._free: list[Any] = []
        suite = self.program
        programs = suite.programs if isinstance(suite, ProgramSuite) else (suite,)
        self._channels, self._looks = channels_of(programs), words_of_looks(programs)
        self._sights = lru_cache(_REMEMBERED)(self._sight)

    def warm(self, count: int) -> None:
        """See that so many environments wait to be played in, and that a first step takes no longer than others."""
        made = [self.take() for _ in range(count - len(self._free))]
        for env in made[:1]:
            episode = Episode(self, {}, env)
            episode.begin({"seed": 0})
            episode.step(dict.fromkeys(self.seats, self.standing))
            episode.picture(AGENT)
        self._free += made

    def take(self) -> Any:
        """An environment of one game in which the caller has all seats."""
        if self._free:
            return self._free.pop()
        seats = "all" if len(self.seats) > 1 else AGENT
        return ScenarioVectorEnv([self.program], 1, 1, "Disabled", True, None, seats)

    def give(self, env: Any) -> None:
        """Take an environment back."""
        self._free.append(env)

    @cached_property
    def phrases(self) -> list[str]:
        """All that can be said, each once."""
        return self._phrases.sentences()

    @cached_property
    def _sayable(self) -> frozenset[str]:
        return frozenset(self.phrases)

    @property
    def standing(self) -> Action:
        """The action of who neither moves nor speaks."""
        return [len(self.actions), 0, 0, *(0 for _ in self.program.sentences.slots)]

    def scripted(self, seat: Seat) -> bool:
        """Whether a seat follows a frame when nobody sits there."""
        return has_script(self.program, seat)

    def told(self, seat: Seat, member: str | None) -> str:
        """What whoever plays a seat is told of the task and of the end of an episode."""
        return self._texts[seat].task(self.briefing.text(member))

    def action(self, rooms: Rooms, movement: str | None, said: str | None) -> Action:
        """The action that words mean in a room.

        Raises:
            ValueError: there is no such movement, or it cannot be said; the message says what was expected.
        """
        if movement is not None and movement not in self.actions:
            raise ValueError(f"movement: got {movement!r}, expected one of {', '.join(self.actions)}")
        first = len(self.actions) if movement is None else self.actions.index(movement)
        if not said:
            return [first, *self.standing[1:]]
        if said not in self._sayable:
            raise ValueError(self._phrases.problem(said))
        suite = isinstance(self.program, ProgramSuite)
        member = (
            int(rooms.env.member_ids()[0]) if suite else 0
        )  # words may be numbered otherwise in another member
        known = self._spoken.get((member, said))
        if known is None:
            known = self._spoken[member, said] = rooms.encoded((None, said)).tolist()
        return [first, *known[1:]]

    def words(self, action: Action) -> tuple[str | None, str | None]:
        """The movement and the sentence that an action means; None for standing still and for silence."""
        said = self.program.sentences.text(action[2], action[3:]) if action[1] else None
        return (*self.actions, None)[action[0]], said

    def seen(
        self,
        seat: Seat,
        observation: Mapping[str, NDArray[Any]],
        heard: Mapping[str, Any],
        last: LastStep | None,
    ) -> dict[str, Any]:
        """What the page of whoever has a seat gets: the picture and its words, made of the observation alone.

        Args:
            seat: whose.
            observation: `image` and `tokens`, of the seat.
            heard: the lines of the last step, as `utterance`; of a suite also the `member`, whose text may differ.
            last: the step that led here, as `TextView.observe` takes it.
        """
        image = observation["image"]
        if self.seats.index(seat):  # the number of the seat stands there
            image = image.copy()
            image[VIEW // 2, VIEW - 1, LOOKS.index("orientation")] = 0
        text = self._texts[seat]
        # Directions are drawn as they are observed: where they are a compass's, how the player is turned stays unsaid.
        sight = self._sights(image.tobytes(), not text.by_compass(heard))
        return {"view": sight, "seen": text.observe(observation, heard, last)}

    def _sight(self, data: bytes, egocentric: bool) -> dict[str, Any]:
        """The picture of an image, given as bytes because many are seen again."""
        image = np.frombuffer(data, np.uint8).reshape(VIEW, VIEW, len(self._channels))
        return sight_of(View(image, _UP, egocentric, self._channels, self._looks))


@dataclass(frozen=True)
class Ending:
    """How an episode ended: the name of its outcome, and of each seat its success and its return."""

    outcome: str
    success: dict[Seat, bool]
    returns: dict[Seat, float]


@dataclass
class Episode:
    """An episode that goes on; after it the next one of its session may begin, which the same players remember.

    Args:
        arena: where it is played.
        players: of each seat that a trained agent may have, or take over, what makes a policy, see `Policy`; it is
            asked for when the agent first acts, and then shown all that the seat has seen.
        env: what it is played in. observers: are told of all that happens.

    Attributes:
        trial: how many of the session have begun before this one; -1 before the first.
        t: steps so far. ending: None while it goes on. heard: of each seat, pairs of a step and a line.
        acting: the policies that were asked for, by seat.
    """

    arena: Arena
    players: Mapping[Seat, Callable[[], Any]]
    env: Any
    observers: Sequence[Observer] = ()
    trial: int = -1
    t: int = 0
    ending: Ending | None = None
    heard: dict[Seat, list[tuple[int, str]]] = field(default_factory=dict)
    acting: dict[Seat, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.rooms = Rooms(self.env, self.observers)
        self._about, self._first = "", ""
        self._unseen: dict[Seat, list[Observation | None]] = {seat: [] for seat in self.players}

    def begin(self, reset: Mapping[str, Any], about: str = "") -> None:
        """Begin the episode, or after its end the next one of its session.

        Args:
            reset: arguments of `env.reset`.
            about: what chance follows from besides the seat and the step.
        """
        self.trial += 1
        if self.trial == 0:
            self._first = about
        else:
            for unseen in self._unseen.values():
                unseen.append(None)  # another room
        self._about, self.t, self.ending = about, 0, None
        if len(self.rooms.names) > 1:
            self.rooms.leave_to_scripts(())
        self.rooms.begin(reset)
        self._returns = dict.fromkeys(self.rooms.names, 0.0)
        self._last: dict[Seat, LastStep] = {}
        self._own: dict[Seat, Action] = {}
        self.heard = {seat: [] for seat in self.arena.seats}
        self._look()

    def _look(self) -> None:
        """Keep what seats see now for the trained agents that have them, or may take them over."""
        self._own = {}
        for seat, unseen in self._unseen.items():
            unseen.append({name: value.copy() for name, value in self.rooms.seen[seat].items()})

    def _of_policy(self, seat: Seat) -> Action:
        """What a trained agent does in the next step, which remembers the whole session whoever acted before."""
        everywhere = np.ones(1, np.bool_)
        if seat not in self.acting:
            policy = self.acting[seat] = self.players[seat]()
            policy.reset(everywhere, np.array([_number(f"{self._first} {seat}")]))
        for seen in self._unseen[seat]:
            if seen is not None:
                self._own[seat] = np.asarray(self.acting[seat].act(seen))[0].tolist()
            else:
                enter(self.acting[seat], everywhere)
        self._unseen[seat].clear()
        return self._own[seat]

    def chosen(self, seat: Seat, who: str) -> Action | None:
        """What somebody on a seat who is no person does in the next step; None where the member follows its frame.

        Args:
            seat: whose.
            who: `script`, `random`, `nobody`, a rival, or anything else for the trained agent that may have it.
        """
        if who == SCRIPT and seat != AGENT:
            return None
        if (who == SCRIPT or is_rival(who)) and self.arena.scripted(AGENT):
            found: Action = self.env.scripted_actions(AGENT)[0].tolist()
            return found
        if who == RANDOM:
            drawn = hashlib.sha256(f"{self._about} {self.t} {seat}".encode()).digest()
            sizes = self.rooms.action_sizes
            return [int.from_bytes(drawn[4 * n : 4 * n + 4], "big") % size for n, size in enumerate(sizes)]
        return self._of_policy(seat) if is_trained(who) else self.arena.standing

    def step(self, acts: Acts) -> None:
        """Play a step.

        Raises:
            ValueError: an action is none of the scenario's.
        """
        before = {seat: seen["image"][0] for seat, seen in self.rooms.seen.items()}
        if len(self.rooms.names) > 1:
            self.rooms.leave_to_scripts([seat for seat, action in acts.items() if action is None])
        own = {seat: np.array([action], np.int64) for seat, action in acts.items() if action is not None}
        step = self.rooms.step(own)
        self.t += 1
        success: dict[Seat, bool] = {}
        for seat in self.rooms.names:
            reward, won = step.of(seat)
            self._returns[seat] += float(reward[0])
            success[seat] = bool(won[0])
            for line in self._lines(seat):
                self.heard[seat].append((self.t, line))
            action = acts[seat]
            movement = None if action is None else (*self.arena.actions, None)[action[0]]
            self._last[seat] = LastStep(movement, before[seat], success[seat] if step.ended[0] else None)
        if step.ended[0]:
            outcome = self.arena.program.outcomes[int(step.outcome[0])]
            self.ending = Ending(str(outcome), success, dict(self._returns))
        else:
            self._look()

    def _lines(self, seat: Seat) -> list[str]:
        utterance = self.rooms.heard(seat)["utterance"]
        return [] if utterance == "NA" else utterance.split("\n")

    def picture(self, seat: Seat) -> dict[str, Any]:
        """What the page of whoever has a seat gets now; see `Arena.seen`."""
        seen = {name: value[0] for name, value in self.rooms.seen[seat].items()}
        return self.arena.seen(seat, seen, self.rooms.heard(seat), self._last.get(seat))

    def told(self, seat: Seat) -> str:
        """What whoever has a seat is told of the task."""
        return self.arena.told(seat, self.rooms.heard(seat).get("member"))


def _number(about: str) -> int:
    """A number of 63 bits that follows from a text."""
    return int.from_bytes(hashlib.sha256(about.encode()).digest()[:8], "big") >> 1
