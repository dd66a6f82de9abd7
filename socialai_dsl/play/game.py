"""A person's game: the episode so far, its dialogue, and every step back to its start."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.briefing import Briefing, brief
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.envs.factory import make
from socialai_dsl.envs.view import View
from socialai_dsl.episodes.play import AGENT, Observer, Rooms, Step
from socialai_dsl.episodes.stage import Stage
from socialai_dsl.frontend import load
from socialai_dsl.llm.view import LastStep, TextView
from socialai_dsl.play.journal import Journal, read_journal
from socialai_dsl.program_suite import Playable, outcome_name
from socialai_dsl.render.panel import DialogueLine
from socialai_dsl.semantics.typed import Phrases
from socialai_dsl.traces.endings import Ending, endings_of
from socialai_dsl.traces.state import cast_of, present
from socialai_dsl.traces.steps import describe_step
from socialai_dsl.vocabulary import spelt

Sight = Literal["seat", "room"]
"""What a person sees: what the agent sees, or the whole room."""
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
        view: what the agent sees, uint8 (7, 7, C). seen: the same and what it hears, as text with escape codes.
        member: of a suite, which scenario is played.
        action: what led here, int64 (heads,); None before the first step.
        lines: what was said and heard so far.
        reward: sum of the rewards so far.
        ended: how the episode ended; None while it has not.
    """

    view: NDArray[np.uint8]
    seen: str
    member: str | None
    action: NDArray[np.int64] | None = None
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
    """

    title: str
    actions: list[NDArray[np.int64]]
    reward: float
    ended: EpisodeEnd

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
    title, actions = "", list[NDArray[np.int64]]()
    for event in read_journal(file):
        match event["event"]:
            case "episode":
                title, actions = event["title"], []
            case "step":
                actions.append(np.array(event["action"], np.int64))
            case "undo":
                del actions[event["t"] :]
            case "end":
                ended = EpisodeEnd(event["outcome"], event["success"], event["text"])
                played.append(FinishedEpisode(title, list(actions), event["reward"], ended))
    return played


class Game(Observer):
    """An episode with a person on the agent's seat, and everything that happened in it.

    Attributes:
        title: which episode is played.
        phrases: what can be done and said.
        briefing: what the player is told of the task.
        journal: gets everything that is played, before it is shown; None keeps nothing.

    Args:
        scenario: a path or a name.
        briefing: None: what the scenario's file says.

    Raises:
        ScenarioError: the scenario has mistakes.
    """

    def __init__(self, scenario: str, briefing: Briefing | None = None) -> None:
        loaded = load(scenario)
        self._stage = Stage(make(scenario), [self])
        self._env: ScenarioEnv = self._stage.env
        self._program: Playable = self._env.program
        self._endings: dict[str, Ending] = {e.name: e for e in endings_of(loaded, self._program)}
        self._text_view = TextView(self._program, "grid", colour=True)
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
        step = self._stage.step({AGENT: action[None]})
        reward = float(step.reward[0])
        self._note("step", t=self.steps, action=action.tolist(), did=movement, said=sentence, reward=reward)
        if (ended := self.now.ended) is not None:
            self._note("end", **vars(ended), steps=self.steps, reward=self.now.reward)

    def undo(self) -> bool:
        """Take the last step back, chance included; whether there was one."""
        if not self._stage.back():
            return False
        self._note("undo", t=self.steps)
        return True

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """See `Observer.began`."""
        image, info = rooms.observations[AGENT]["image"][0], rooms.info
        self._moments = [GameMoment(image, self._seen(image, info), info.get("member"))]

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        before, info, action = self.now, step.info, step.actions[AGENT][0]
        image = rooms.observations[AGENT]["image"][0]
        words = describe_step(self._program, action, len(self._moments), info["utterance"])
        movement = (*self._program.actions, None)[action[0]]
        self._moments.append(
            GameMoment(
                image,
                self._seen(image, info, LastStep(movement, before.view)),
                info.get("member"),
                action,
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
        """How to read what is seen from the agent's seat."""
        return self._text_view.explanation()

    @property
    def steps(self) -> int:
        """How many steps were played."""
        return self._stage.steps

    def room(self) -> str:
        """The room as text with escape codes for colours."""
        return self._env.coloured_text()

    def view(self) -> View:
        """The agent's view."""
        return self._env.view(self.now.view)

    def place(self) -> tuple[int, int] | None:
        """X and y of the agent; None if it has left."""
        at = self._env.describe()["agent"]["at"]
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

    def played(self) -> FinishedEpisode | None:
        """The episode, if it has ended."""
        ended = self.now.ended
        if ended is None:
            return None
        actions = [moment.action for moment in self._moments if moment.action is not None]
        return FinishedEpisode(self.title, actions, self.now.reward, ended)

    def close(self) -> None:
        """Let the environment go."""
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
