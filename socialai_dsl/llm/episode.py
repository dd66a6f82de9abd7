"""Episodes in text: observations go out as text, replies come in and are played."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.briefing import NO_BRIEFING, Briefing, brief
from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.envs import ScenarioEnv, make
from socialai_dsl.envs.asking import Asker, Question
from socialai_dsl.envs.copying import Copied
from socialai_dsl.envs.factory import Scenario, load_playable
from socialai_dsl.episodes.partners import acts_of_all, name_of
from socialai_dsl.episodes.play import AGENT, Rooms, Seat, Step
from socialai_dsl.llm.actions import Action, ActionLanguage, Mode, ToolCall
from socialai_dsl.llm.questions import AnsweredQuestion, read_answer
from socialai_dsl.llm.view import LastStep, Style, TextView, over
from socialai_dsl.program_suite import Playable, seats_of

OnInvalid = Literal["noop", "retry", "fail"]
"""What a reply without an action does: pass the turn, ask again, or end the episode."""

Reply = str | Sequence[ToolCall]
"""What a model answers: text, or the tools that it calls."""

INVALID: Final = "invalid reply"
STOPPED: Final = "reply cut off"
CONTEXT: Final = "context full"
LEFT: Final = "left alone"
CUT_SHORT: Final = {
    INVALID: "a reply without an action",
    STOPPED: "a reply without an action: cut off or held back by the server, or a refusal",
    CONTEXT: "a conversation longer than the model's context",
    LEFT: "a language model on another seat that ended so",
}
"""How episodes end that no step ends, with what ended them."""
_STOPS: Final = {
    "length": "the server cut your reply off, since it was too long, before it held an action",
    "content_filter": "a filter of the server held your reply back",
    "unreadable": "the server sent no reply",
    "refusal": "you refused to reply",
}
"""What a model is told of replies that ended before an action, which are no mistakes in what it writes."""

_TRIES: Final = 3


@dataclass(frozen=True)
class Turn:
    """The result of a reply.

    Attributes:
        text: the next message to the model: what was wrong with the reply, if anything, then what is seen and heard.
        reward: of the step; 0 where no step was played.
        done: whether the episode has ended.
        action: the action that was played; None where no step was played.
        error: what was wrong with the reply; empty if nothing was.
    """

    text: str
    reward: float
    done: bool
    action: Action | None
    error: str = ""


@dataclass(frozen=True)
class EpisodeResult:
    """The figures of an episode so far.

    Attributes:
        success: whether it ended in success.
        ending: the outcome, a name of `program.outcomes` or of `CUT_SHORT`; empty while the episode goes on.
        total: undiscounted sum of the rewards.
        steps: number of steps played.
        replies: number of replies read.
        invalid: number of replies without an action that the model itself ended.
        stopped: number of replies without an action that the server cut off or held back, or that it marks as refusals.
    """

    success: bool = False
    ending: str = ""
    total: float = 0.0
    steps: int = 0
    replies: int = 0
    invalid: int = 0
    stopped: int = 0


@dataclass(frozen=True)
class Decision:
    """The result of a reply: an action, or an error.

    Attributes:
        action: the action to be played; None where no step is.
        error: what was wrong with the reply; the action is to do nothing then.
        turn: the result of the reply where no step is played.
    """

    action: Action | None
    error: str = ""
    turn: Turn | None = None


class TextSeat(Copied):
    """A seat of one room in text: writes what is seen, reads replies, and counts. Others play the steps.

    Args:
        program: of a scenario or suite.
        style: how observations are written: `prose`, `grid` or `json`.
        mode: how replies are given: `text`, `json` or `tools`.
        on_invalid: the effect of a reply without an action: `noop` passes the turn, `retry` asks again (the third such
            reply in a row passes the turn), `fail` ends the episode.
        briefing: what the instructions say of the task.
        probes: the scenario as `load` returns it, to ask its probes, which changes nothing else.
        seat: which one.
        loaded: the scenario as `load` returns it; of several players one is told its name then.

    Attributes:
        seat: see above.
        instructions: the text that a model reads before the first observation; of a suite, once an episode has begun.
        actions: the actions of this episode, int64 (heads,) each.
        answered: the answers to probes of this episode, in the order given.

    Raises:
        ValueError: an argument is not what was expected.
    """

    def __init__(
        self,
        program: Playable,
        style: Style = "prose",
        mode: Mode = "text",
        on_invalid: OnInvalid = "noop",
        briefing: Briefing = NO_BRIEFING,
        probes: Loaded | None = None,
        seat: Seat = AGENT,
        loaded: Loaded | None = None,
    ) -> None:
        if on_invalid not in get_args(OnInvalid):
            raise ValueError(
                f"on_invalid: got {on_invalid!r}, expected one of {', '.join(get_args(OnInvalid))}"
            )
        self.view = TextView(program, style, seat=seat)
        self.seat = seat
        self.language = ActionLanguage(program)
        self.briefing = briefing
        self._mode: Mode = mode
        self._member: str | None = None
        several = len(seats_of(program)) > 1
        self._loaded = loaded if several else None  # one who plays alone needs no name
        self.instructions = self.view.instructions(mode, self.briefing.text())
        self.actions: list[NDArray[np.int64]] = []
        self.answered: list[AnsweredQuestion] = []
        self._seats = seats_of(program)
        self._asker = None if probes is None else Asker(probes, self._seats.index(seat) if several else None)
        self._questions: list[Question] = []
        self._on_invalid = on_invalid
        self._refused = 0
        self._result = EpisodeResult()
        self._text = ""
        self._image = np.zeros(0, np.uint8)

    def begin(self, rooms: Rooms, seed: int | None = None, options: Mapping[str, Any] | None = None) -> str:
        """Note that an episode has begun in the room, by these arguments of `env.reset`; what is seen at its start."""
        seen = self._seen(rooms)
        self.actions, self._refused, self._result = [], 0, EpisodeResult()
        self.answered = []
        if self._asker is not None:
            self._questions = self._asker.reset(
                seed, None if options is None else dict(options), seen["image"]
            )
        heard = rooms.heard(self.seat)
        self._member = heard.get("member")
        name = None if self._loaded is None else name_of(rooms, self.seat, self._loaded)
        self.instructions = self.view.instructions(self._mode, self.briefing.text(self._member), name)
        self._image = seen["image"].copy()
        self._text = self.view.observe(seen, heard)
        return self._text

    def read(self, reply: Reply, stop: str = "") -> Decision:
        """The result of a reply: an action, or an error.

        Args:
            reply: text, or in the mode `tools` a sequence of `ToolCall`.
            stop: why the server ended the reply, such as `length` or `content_filter`; a reply without an action does
                not count as a mistake of the model then.

        Raises:
            ValueError: the episode has ended.
        """
        if self._result.ending:
            raise ValueError("step: got a reply after the end of the episode; expected reset() first")
        parsed = self.language.parse(reply) if isinstance(reply, str) else self.language.parse_calls(reply)
        if parsed.action is None:
            stopped = _STOPS.get(stop)
            return self._refuse(f"{stopped}." if stopped else parsed.error, stopped is not None)
        self._refused = 0
        return Decision(parsed.action)

    def saw(self, rooms: Rooms, decision: Decision, step: Step) -> Turn:
        """The result of a decision whose action was played in the room."""
        assert decision.action is not None, "internal: a step was played"
        seen, heard, encoded = self._seen(rooms), rooms.heard(self.seat), step.actions[self.seat][0]
        self.actions.append(encoded)
        rewards, successes = step.of(self.seat)
        done, reward = bool(step.ended[0]), float(rewards[0])
        if self._asker is not None:
            acts = acts_of_all(rooms, step)
            self._questions = self._asker.step([acts.get(seat) for seat in self._seats], seen["image"], done)
        self._note(reward, played=True)
        success = bool(successes[0]) if done else None
        if success is not None:
            ending = rooms.env.program.outcomes[step.outcome[0]]
            self._result = replace(self._result, ending=ending, success=success)
        last = LastStep(decision.action.movement, self._image, success)
        self._text = self.view.observe(seen, heard, last, self._news(heard))
        self._image = seen["image"].copy()
        error = decision.error
        told = f"Your reply was not understood, and you did nothing: {error}\n" if error else ""
        return Turn(told + self._text, reward, done, decision.action, error)

    def end(self, ending: str = CONTEXT) -> None:
        """End the episode without a step.

        Args:
            ending: one of `CUT_SHORT`.

        Raises:
            ValueError: it has ended already, or there is no such ending.
        """
        if ending not in CUT_SHORT or self._result.ending:
            raise ValueError(
                f"end: got {ending!r}, expected one of {', '.join(CUT_SHORT)}, before the end of the episode"
            )
        self._questions = []
        self._result = replace(self._result, ending=ending)

    @property
    def member(self) -> str | None:
        """The member of a suite that is played; None of a scenario that plays alone."""
        return self._member

    @property
    def question(self) -> Question | None:
        """The probe that waits for an answer, between two steps or after the last; None without one.

        The next step drops questions that were not answered.
        """
        return self._questions[0] if self._questions else None

    def answer(self, reply: str) -> AnsweredQuestion:
        """Read a reply to the question; no step passes.

        Raises:
            ValueError: there is no question.
        """
        if not self._questions:
            raise ValueError("answer: got a reply, but nothing is asked")
        question = self._questions.pop(0)
        self.answered.append(AnsweredQuestion(question, read_answer(reply, question.answers)))
        return self.answered[-1]

    def result(self) -> EpisodeResult:
        """The figures of the episode so far."""
        return self._result

    def _refuse(self, error: str, stopped: bool) -> Decision:
        """Deal with a reply that holds no action."""
        self._refused += 1
        self._result = replace(
            self._result, invalid=self._result.invalid + (not stopped), stopped=self._result.stopped + stopped
        )
        if self._on_invalid == "fail":
            self._note()
            self.end(STOPPED if stopped else INVALID)
            text = f"Your reply was not understood: {error}\n{over(False)}"
            return Decision(None, error, Turn(text, 0.0, True, None, error))
        if self._on_invalid == "retry" and self._refused < _TRIES:
            self._note()
            text = f"Your reply was not understood: {error} Reply again.\n{self._text}"
            return Decision(None, error, Turn(text, 0.0, False, None, error))
        self._refused = 0
        return Decision(Action(), error)

    def _seen(self, rooms: Rooms) -> dict[str, NDArray[Any]]:
        """The present observation of the seat in the one room."""
        return {name: value[0] for name, value in rooms.observations[self.seat].items()}

    def _news(self, info: Mapping[str, Any]) -> str:
        """What is told where an episode goes on with another member of a suite; mostly nothing."""
        before, self._member = self.briefing.text(self._member), info.get("member")
        now = self.briefing.text(self._member)
        return now if now != before else ""

    def _note(self, reward: float = 0.0, played: bool = False) -> None:
        """Count a reply, and the step that it played."""
        before = self._result
        self._result = replace(
            before, total=before.total + reward, steps=before.steps + played, replies=before.replies + 1
        )


class Episode(TextSeat):
    """One room that is played in text, episode after episode.

    Args:
        scenario: a path, a name or a program.
        style, mode, on_invalid, probes: see `TextSeat`.
        briefing: what the instructions say of the task, see `brief`; by default what the scenario's file says, and
            of a program nothing.
        seats: who fills other seats, as `make` takes it; whoever replies has the first that is left, by default the
            agent's.
        loaded: what a program was made of; of a path or a name it is known.

    Raises:
        ScenarioError: the scenario has mistakes.
        ValueError: an argument is not what was expected.
    """

    def __init__(
        self,
        scenario: Scenario,
        style: Style = "prose",
        mode: Mode = "text",
        on_invalid: OnInvalid = "noop",
        briefing: Briefing | None = None,
        probes: Loaded | None = None,
        seats: Mapping[Seat, Any] | None = None,
        loaded: Loaded | None = None,
    ) -> None:
        program, own = load_playable(scenario)
        loaded = own if loaded is None else loaded
        self._rooms = Rooms(make(program, seats=seats))
        self.env: ScenarioEnv = self._rooms.env
        told = brief(loaded) if briefing is None else briefing
        super().__init__(program, style, mode, on_invalid, told, probes, self._rooms.own, loaded)

    def reset(self, seed: int | None = None, test_episode: int | None = None) -> str:
        """Begin an episode and return what is seen at its start.

        Args:
            seed: starts episode 0 of the seed; without it the next one is played.
            test_episode: number of an episode of the fixed test set.

        Raises:
            ValueError: a number is out of range.
            RuntimeError: 64 drawn rooms in a row violate the scenario's `require`.
        """
        options = None if test_episode is None else {"test_episode": test_episode}
        self._rooms.begin({"seed": seed, "options": options})
        return self.begin(self._rooms, seed, options)

    def step(self, reply: Reply, stop: str = "") -> Turn:
        """Play the action of a reply, as `read` takes it.

        Raises:
            ValueError: the episode has ended.
        """
        decision = self.read(reply, stop)
        if decision.turn is not None:
            return decision.turn
        assert decision.action is not None, "internal: what plays no step has a turn"
        step = self._rooms.step({self.seat: self._rooms.encoded(decision.action)[None]})
        return self.saw(self._rooms, decision, step)

    def close(self) -> None:
        """Close the environment."""
        self.env.close()


def scripted_reply(episode: Episode) -> str:
    """The reply of the scenario's own script, in the mode `text`.

    Raises:
        ValueError: the agent follows no frame.
    """
    program: Any = episode.env.program
    movement, speaks, template, *spoken = episode.env.scripted_action().tolist()
    said = program.sentences.text(template, spoken) if speaks else None
    words = (*program.actions, None)
    return episode.language.write(Action(words[movement], said))
