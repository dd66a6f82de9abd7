"""A person's game: the episode so far, its dialogue, and every step back to its start."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.briefing import Briefing, brief
from socialai_dsl.envs.factory import make_loaded
from socialai_dsl.envs.view import View
from socialai_dsl.episodes.partners import acts_of_others, by_seat
from socialai_dsl.episodes.play import Observer, Rooms, Step
from socialai_dsl.episodes.stage import Stage, remembering
from socialai_dsl.frontend import Loaded, load
from socialai_dsl.llm.view import LastStep, TextView
from socialai_dsl.play.journal import Journal, read_journal
from socialai_dsl.program_suite import Playable, outcome_name, seats_of
from socialai_dsl.render.panel import DialogueLine
from socialai_dsl.semantics.typed import Phrases
from socialai_dsl.traces import state as traced
from socialai_dsl.traces.endings import Ending, endings_of
from socialai_dsl.traces.state import cast_of, names_of, present
from socialai_dsl.traces.steps import describe_step
from socialai_dsl.vocabulary import spelt

Sight = Literal["seat", "room"]
"""What a person sees: what its seat sees, or the whole room."""
_UNTOLD: Final = ("clock", "at", "color", "facing", "last", "poked", "state")
"""What `describe` says of a member that is shown otherwise, or only counts."""


@dataclass(frozen=True)
class EpisodeEnd:
    """How an episode ended.

    Attributes:
        outcome: its name, as `Playable.outcomes` has it. success: whether it counts as success.
        text: what the scenario's file says there.
    """

    outcome: str
    success: bool
    text: str


@dataclass(frozen=True, eq=False)
class GameMoment:
    """A moment of an episode.

    Attributes:
        view: what is seen from the seat, uint8 (7, 7, C). seen: the same and what is heard, as text with escape codes.
        member: of a suite, which scenario is played.
        action: what led here, int64 (heads,); None before the first step. others: the same of those on other seats.
        lines: what was said and heard so far.
        reward: sum of the rewards so far.
        ended: how the episode ended; None while it has not.
    """

    view: NDArray[np.uint8]
    seen: str
    member: str | None
    action: NDArray[np.int64] | None = None
    others: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)
    lines: tuple[DialogueLine, ...] = ()
    reward: float = 0.0
    ended: EpisodeEnd | None = None


@dataclass(frozen=True, eq=False)
class FinishedEpisode:
    """An episode as it was played to its end.

    Attributes:
        title: which one it was.
        actions: int64 (heads,) each.
        reward: sum of the rewards.
        ended: how it ended.
        others: of each other seat on which somebody sat its actions, likewise.
    """

    title: str
    actions: list[NDArray[np.int64]]
    reward: float
    ended: EpisodeEnd
    others: Mapping[str, list[NDArray[np.int64]]] = field(default_factory=dict)

    def __str__(self) -> str:
        """One line: which, how, after how many steps."""
        verdict = "success" if self.ended.success else "no success"
        steps = len(self.actions)
        return f"{self.title}: {verdict} ({self.ended.text}) after {steps} steps, reward {self.reward:.3f}"


def finished_episodes(file: Path) -> list[FinishedEpisode]:
    """The episodes of a session that were played to their end, from its journal.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no journal.
    """
    played: list[FinishedEpisode] = []
    title, steps = "", list[dict[str, Any]]()
    for event in read_journal(file):
        match event["event"]:
            case "episode":
                title, steps = event["title"], []
            case "step":
                steps.append(event)
            case "undo":
                del steps[event["t"] :]
            case "end":
                ended = EpisodeEnd(event["outcome"], event["success"], event["text"])
                actions = [np.array(step["action"], np.int64) for step in steps]
                others = by_seat([step.get("others", {}) for step in steps])
                played.append(FinishedEpisode(title, actions, event["reward"], ended, others))
    return played


class Game(Observer):
    """An episode with a person on a seat, and everything that happened in it.

    Attributes:
        own: the seat, as the member of the cast is called in the file.
        title: which episode is played.
        phrases: what can be done and said.
        briefing: what the player is told of the task.
        journal: gets everything that is played, before it is shown; None keeps nothing.

    Args:
        scenario: a path or a name.
        briefing: None: what the scenario's file says.
        seats: who fills other seats, as `make` takes it; the person has the first that is left.
        loaded: what is played, if that is loaded already.

    Raises:
        ScenarioError: the scenario has mistakes.
        ValueError: there is no such seat, or none is left.
    """

    def __init__(
        self,
        scenario: str,
        briefing: Briefing | None = None,
        seats: Mapping[str, Any] | None = None,
        loaded: Loaded | None = None,
    ) -> None:
        loaded = load(scenario) if loaded is None else loaded
        company, partners = remembering(seats)
        env = make_loaded(loaded, seats=company)
        self._stage = Stage(env, [self], partners)
        self._env, self.own = env, self._stage.own
        self._program: Playable = self._env.program
        self._endings: dict[str, Ending] = {e.name: e for e in endings_of(loaded, self._program)}
        self._text_view = TextView(self._program, "grid", colour=True, seat=self.own)
        self.briefing = brief(loaded) if briefing is None else briefing
        self.phrases = Phrases(self._program.actions, self._program.sentences)
        self.title = ""
        self.journal: Journal | None = None
        self._moments: list[GameMoment] = []

    def begin(self, title: str, reset: dict[str, Any]) -> None:
        """Start an episode with these arguments of `env.reset`.

        Raises:
            RoomError: no room that was drawn is as the scenario asks; the game stays where it was.
        """
        self._stage.begin(reset)
        self.title = title
        self._note("episode", title=title, reset=reset, member=self.now.member)

    def act(self, movement: str | None, sentence: str | None) -> None:
        """Play a step.

        Raises:
            ValueError: it cannot be done or said; the message says what was probably meant.
        """
        action = self._env.encode_action((movement, sentence))
        step = self._stage.step({self.own: action[None]})
        reward, others = float(step.reward[0]), self.now.others
        told = {"others": {seat: one.tolist() for seat, one in others.items()}} if others else {}
        self._note(
            "step", t=self.steps, action=action.tolist(), did=movement, said=sentence, reward=reward, **told
        )
        if (ended := self.now.ended) is not None:
            self._note("end", **vars(ended), steps=self.steps, reward=self.now.reward)

    def undo(self) -> bool:
        """Take the last step back, random numbers included; return whether there was one."""
        if not self._stage.back():
            return False
        self._note("undo", t=self.steps)
        return True

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """See `Observer.began`."""
        image, info = rooms.observations[self.own]["image"][0], rooms.info
        self._moments = [GameMoment(image, self._seen(image, info), info.get("member"))]

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        before, info, action = self.now, step.info, step.actions[self.own][0]
        image = rooms.observations[self.own]["image"][0]
        words = describe_step(self._program, action, len(self._moments), info["utterance"])
        movement = (*self._program.actions, None)[action[0]]
        self._moments.append(
            GameMoment(
                image,
                self._seen(image, info, LastStep(movement, before.view)),
                info.get("member"),
                action,
                acts_of_others(self._env),
                (*before.lines, *words.dialogue),
                before.reward + float(step.reward[0]),
                self._ended(info) if step.ended[0] else None,
            )
        )

    def back(self, rooms: Rooms) -> None:
        """See `Observer.back`."""
        self._moments.pop()

    @property
    def now(self) -> GameMoment:
        """Where the game stands."""
        return self._moments[-1]

    @property
    def task(self) -> str:
        """What the player is told of the task, in the words that language models read."""
        return self._text_view.task(self.briefing.text(self.now.member))

    @property
    def explanation(self) -> str:
        """How to read what is seen from the seat."""
        return self._text_view.explanation(self.name)

    @property
    def steps(self) -> int:
        """How many steps were played."""
        return self._stage.steps

    def room(self) -> str:
        """The room as text with escape codes for colours."""
        return self._env.coloured_text()

    def view(self) -> View:
        """The view from the seat."""
        return self._env.view(self.now.view)

    def place(self) -> tuple[int, int] | None:
        """X and y of who has the seat; None if it has left."""
        member = traced.found(self._env.describe(), self.own) or {}
        at = member.get("at")
        return None if at is None else (at[0], at[1])

    def backstage(self) -> list[str]:
        """The hidden state: states of frames, draws, and registers of the cast."""
        state = self._env.describe()
        cast = cast_of(self._env.playing)
        lines = present(cast, state)
        for key in dict.fromkeys(name.partition("[")[0] for name in cast):
            found = state[key]
            for number, one in enumerate(found if isinstance(found, list) else [found]):
                name = f"{key}[{number}]" if isinstance(found, list) else key
                lines += [f"{name}.{k} = {_plain(v)}" for k, v in one.items() if k not in _UNTOLD]
        looks = _looks(state)
        for group in ("let", "state", "one_of"):
            lines += [
                f"{key} = {_plain(value)}{looks.get(value, '') if isinstance(value, str) else ''}"
                for key, value in state.get(group, {}).items()
            ]
        return lines

    @property
    def name(self) -> str | None:
        """The name by which others hear the person; None where there is one seat."""
        if len(seats_of(self._program)) == 1:
            return None
        return names_of(self._env.scenario, self._env.describe())[self.own]

    def played(self) -> FinishedEpisode | None:
        """The episode, if it has ended."""
        ended = self.now.ended
        if ended is None:
            return None
        steps = self._moments[1:]
        actions = [moment.action for moment in steps if moment.action is not None]
        others = by_seat([moment.others for moment in steps])
        return FinishedEpisode(self.title, actions, self.now.reward, ended, others)

    def close(self) -> None:
        """Close the environment."""
        self._env.close()

    def _seen(self, image: NDArray[np.uint8], info: Mapping[str, Any], last: LastStep | None = None) -> str:
        return self._text_view.observe({"image": image}, info, last)

    def _note(self, event: str, **more: Any) -> None:
        if self.journal is not None:
            self.journal.note(event, **more)

    def _ended(self, info: Mapping[str, Any]) -> EpisodeEnd:
        name = outcome_name(info)
        return EpisodeEnd(name, bool(info["success"]), self._endings[name].text)


def _looks(state: dict[str, Any]) -> dict[str, str]:
    """Of everything in the room, by name: colour and place, to be put behind the name."""
    looks = {}
    for key, found in state.items():
        for number, one in enumerate(found if isinstance(found, list) else [found]):
            if isinstance(one, dict) and one.get("at") is not None:
                name = f"{key}[{number}]" if isinstance(found, list) else key
                looks[name] = f" ({one['color']}, at {one['at'][0]},{one['at'][1]})"
    return looks


def _plain(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_plain(part)}" for key, part in value.items())
    return spelt(value)
