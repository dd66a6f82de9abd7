"""An episode in text: observations go out as text, replies come in and are played."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.envs import make
from socialai_dsl.envs.asking import Asker, Question
from socialai_dsl.envs.factory import Scenario
from socialai_dsl.llm.actions import Action, ActionLanguage, Mode, Parsed, ToolCall
from socialai_dsl.llm.questions import Answered, read_answer
from socialai_dsl.llm.view import Style, TextView
from socialai_dsl.program_suite import outcome_name

OnInvalid = Literal["noop", "retry", "fail"]
"""What a reply without an action does: pass the turn, ask again, or end the episode."""

Reply = str | Sequence[ToolCall]
"""What a model answers: text, or the tools that it calls."""

INVALID: Final = "invalid reply"
"""How an episode ends that an invalid reply ends."""

_TRIES: Final = 3


@dataclass(frozen=True)
class Turn:
    """What came of a reply.

    Attributes:
        text: what the model is told next: what was wrong with the reply, if anything, then what is seen and heard.
        reward: of the step; 0 where no step was played.
        done: whether the episode has ended.
        action: what was done; None where no step was played.
        error: what was wrong with the reply; empty if nothing was.
    """

    text: str
    reward: float
    done: bool
    action: Action | None
    error: str = ""


@dataclass(frozen=True)
class EpisodeResult:
    """How an episode went so far.

    Attributes:
        success: whether it ended in success. ending: the outcome as `program.outcomes` calls it, or `INVALID`; empty
            while the episode goes on.
        total: sum of the rewards. steps: that were played. replies: that were read. invalid: how many held no action.
    """

    success: bool = False
    ending: str = ""
    total: float = 0.0
    steps: int = 0
    replies: int = 0
    invalid: int = 0


class Episode:
    """One environment, played in text, episode after episode.

    Args:
        scenario: a path, a name or a program.
        style: how observations are written, see `TextView`.
        mode: how replies are given, see `ActionLanguage`.
        on_invalid: what a reply without an action does. Where the model is asked again, its third reply in
            succession that holds none passes the turn.
        goal: what the instructions say of the aim; nothing by default, as trained agents are told nothing.
        probes: the scenario as `load` returns it, if its probes are to be asked. Nothing else changes by that.

    Attributes:
        answered: the answers of this episode in the order given.

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
        goal: str = "",
        probes: Loaded | None = None,
    ) -> None:
        if on_invalid not in get_args(OnInvalid):
            raise ValueError(
                f"on_invalid: got {on_invalid!r}, expected one of {', '.join(get_args(OnInvalid))}"
            )
        self.env = make(scenario)
        self.view = TextView(self.env.program, style)
        self.language = ActionLanguage(self.env.program)
        self.instructions = self.view.instructions(mode, goal)
        self.actions: list[NDArray[np.int64]] = []
        self.answered: list[Answered] = []
        self._asker = None if probes is None else Asker(probes)
        self._questions: list[Question] = []
        self._on_invalid = on_invalid
        self._refused = 0
        self._result = EpisodeResult()
        self._text = ""

    def reset(self, seed: int | None = None, test_episode: int | None = None) -> str:
        """Begin an episode; what is seen at its start.

        Args:
            seed: starts episode 0 of the seed; without it the next one is played.
            test_episode: number of an episode of the fixed test set.

        Raises:
            ValueError: a number is out of range, or no room is as the scenario requires.
        """
        options = None if test_episode is None else {"test_episode": test_episode}
        observation, info = self.env.reset(seed=seed, options=options)
        self.actions, self._refused, self._result = [], 0, EpisodeResult()
        self.answered = []
        if self._asker is not None:
            self._questions = self._asker.reset(seed, options, observation["image"])
        self._text = self.view.observe(observation, info)
        return self._text

    def step(self, reply: Reply) -> Turn:
        """Play what a reply means.

        Raises:
            ValueError: the episode has ended.
        """
        if self._result.ending:
            raise ValueError("step: got a reply after the end of the episode; expected reset() first")
        parsed = self.language.parse(reply) if isinstance(reply, str) else self.language.parse_calls(reply)
        if parsed.action is None:
            return self._refuse(parsed)
        self._refused = 0
        return self._play(parsed.action)

    @property
    def question(self) -> Question | None:
        """What a probe asks at this moment, between two steps or after the last; None if nothing waits for an answer.

        The next step drops what was not answered.
        """
        return self._questions[0] if self._questions else None

    def answer(self, reply: str) -> Answered:
        """Read a reply to the question; no time passes.

        Raises:
            ValueError: nothing is asked.
        """
        if not self._questions:
            raise ValueError("answer: got a reply, but nothing is asked")
        question = self._questions.pop(0)
        self.answered.append(Answered(question, read_answer(reply, question.answers)))
        return self.answered[-1]

    def result(self) -> EpisodeResult:
        """How the episode went so far."""
        return self._result

    def close(self) -> None:
        """Let the environment go."""
        self.env.close()

    def _refuse(self, parsed: Parsed) -> Turn:
        """Deal with a reply that holds no action."""
        self._refused += 1
        if self._on_invalid == "fail":
            self._questions = []
            self._note(0.0, invalid=True, ending=INVALID)
            return Turn(f"Your reply was not understood: {parsed.error}", 0.0, True, None, parsed.error)
        if self._on_invalid == "retry" and self._refused < _TRIES:
            self._note(0.0, invalid=True)
            text = f"Your reply was not understood: {parsed.error} Reply again.\n{self._text}"
            return Turn(text, 0.0, False, None, parsed.error)
        self._refused = 0
        return self._play(Action(), parsed.error)

    def _play(self, action: Action, error: str = "") -> Turn:
        encoded = self.env.encode_action(action)
        observation, reward, terminated, truncated, info = self.env.step(encoded)
        self.actions.append(encoded)
        done = bool(terminated or truncated)
        if self._asker is not None:
            self._questions = self._asker.step(encoded, observation["image"], done)
        ending = outcome_name(info) if done else ""
        self._note(float(reward), bool(error), ending, bool(info.get("success", False)), played=True)
        self._text = self.view.observe(observation, info)
        told = f"Your reply was not understood, and you did nothing: {error}\n" if error else ""
        return Turn(told + self._text, float(reward), done, action, error)

    def _note(
        self, reward: float, invalid: bool, ending: str = "", success: bool = False, played: bool = False
    ) -> None:
        before = self._result
        self._result = EpisodeResult(
            success,
            ending,
            before.total + reward,
            before.steps + played,
            before.replies + 1,
            before.invalid + invalid,
        )


def scripted_reply(episode: Episode) -> str:
    """What the scenario's own script would reply now.

    Raises:
        ValueError: the agent follows no frame.
    """
    program: Any = episode.env.program
    movement, speaks, template, noun = episode.env.scripted_action().tolist()
    said = program.templates[template].replace("<noun>", program.nouns[noun]) if speaks else None
    words = (*program.actions, None)
    return episode.language.write(Action(words[movement], said))
