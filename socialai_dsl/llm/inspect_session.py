"""A sample of Inspect AI: the episodes of one conversation, turn by turn, with an event for each."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any, Final

from inspect_ai.log import transcript
from inspect_ai.model import (
    ChatMessage,
    ChatMessageAssistant,
    ChatMessageSystem,
    ChatMessageTool,
    ChatMessageUser,
    GenerateConfig,
    ModelOutput,
    ResponseSchema,
    get_model,
)
from inspect_ai.solver import TaskState
from inspect_ai.tool import ToolInfo
from inspect_ai.util import JSONSchema

from socialai_dsl.llm.actions import ToolCall
from socialai_dsl.llm.episode import CONTEXT, Episode, Reply
from socialai_dsl.llm.history import left_out
from socialai_dsl.llm.prompting import PromptOptions
from socialai_dsl.llm.questions import constraints, put

EPISODES: Final = "episodes"
"""What the store of a sample has of each of its episodes, as far as it went."""
PROBES: Final = "probes"
"""What the store has of each question of a probe."""
_STOPS: Final = {"max_tokens": "length", "content_filter": "content_filter"}
"""Inspect's words for how a server ended a reply, as `Episode.step` takes them."""
_SOURCE: Final = "socialai_dsl"


class Session:
    """The episodes of a sample, which are one conversation.

    Args:
        state: of the sample.
        episode: which the model plays.
        prompting: how.
    """

    def __init__(self, state: TaskState, episode: Episode, prompting: PromptOptions) -> None:
        self._state, self._episode, self._prompting = state, episode, prompting
        self._exchanges: list[list[ChatMessage]] = []
        self._text = ""
        self._trial = 0
        self._episodes: list[dict[str, Any]] = []
        self._probes: list[dict[str, Any]] = []
        for key, begun in ((EPISODES, self._episodes), (PROBES, self._probes)):
            state.store.set(key, begun)

    async def play(self, trial: int, room: dict[str, int]) -> None:
        """Play an episode to its end.

        Args:
            trial: its number in the sample, from 0 on.
            room: the arguments of `Episode.reset`.
        """
        text = self._episode.reset(**room)
        closing = f"{self._text}\n\n" if trial else ""
        self._text, self._trial = f"{closing}{self._prompting.heading(trial)}{text}", trial
        self._episodes.append({})
        self._note()
        with self._logged():
            while not self._episode.result().ending:
                await self._answer()
                await self._act()
            await self._answer()

    async def _act(self) -> None:
        """Let the model make a turn."""
        schema, tools = None, []
        if self._prompting.mode == "json":
            schema = _schema("action", self._episode.language.json_schema())
        if self._prompting.mode == "tools":
            tools = [ToolInfo(**tool["function"]) for tool in self._episode.language.tools()]
        output = await self._ask(self._text, schema, tools)
        message = output.message if output.choices else ChatMessageAssistant(content="")
        calls = message.tool_calls if self._prompting.mode == "tools" else None
        # Who answers in words where tools are asked for may name the action there.
        reply: Reply = [ToolCall(call.function, json.dumps(call.arguments)) for call in calls or ()]
        reply = reply or message.text
        if output.stop_reason == "model_length" and not self._holds_action(reply):
            self._episode.end(CONTEXT)
            self._note()
            return self._tell({"stop": "context"})
        stop = _STOPS.get(output.stop_reason, "") if output.choices else "unreadable"
        turn = self._episode.step(reply, stop)
        done = "not understood" if turn.error else "done"
        told = [
            ChatMessageTool(content=done, tool_call_id=call.id, function=call.function)
            for call in calls or ()
        ]
        self._exchanges.append([ChatMessageUser(content=self._text), message, *told])
        self._text = turn.text
        self._note()
        played = None if turn.action is None or turn.error else self._episode.language.write(turn.action)
        return self._tell({"action": played, "reward": turn.reward, "error": turn.error, "stop": stop})

    async def _answer(self) -> None:
        """Let the model answer the probes of this moment."""
        mode = self._prompting.mode
        while (question := self._episode.question) is not None:
            asked = put(question, mode)
            form = constraints(question, mode, grammar=False).get("response_format")
            schema = None if form is None else _schema("answer", form["json_schema"]["schema"])
            output = await self._ask(f"{self._text}\n\n{asked}", schema)
            reply = output.message if output.choices else ChatMessageAssistant(content="")
            answered = self._episode.answer(reply.text)
            if self._prompting.probes == "kept":
                self._exchanges.append([ChatMessageUser(content=asked), reply])
            self._probes.append(
                {
                    "probe": question.probe,
                    "right": answered.right,
                    "chance": question.chance,
                    "trial": self._trial,
                }
            )
            self._tell({**vars(question), "answers": list(question.answers), "given": answered.given})

    async def _ask(
        self, text: str, schema: ResponseSchema | None = None, tools: list[ToolInfo] | None = None
    ) -> ModelOutput:
        """The model's output for the conversation so far and a further message, which the state has meanwhile."""
        first = ChatMessageSystem(content=self._prompting.told(self._episode.instructions))
        messages = [message for exchange in self._exchanges for message in exchange]
        self._state.messages = [first, *messages, ChatMessageUser(content=text)]
        count, told = left_out([exchange[0].text for exchange in self._exchanges], self._prompting.history)
        shown = [*(message for exchange in self._exchanges[count:] for message in exchange)]
        begun, *others = [*shown, ChatMessageUser(content=text)]
        begun = begun if not told else ChatMessageUser(content=told + begun.text)
        config = GenerateConfig(response_schema=schema)
        self._state.output = await get_model().generate([first, begun, *others], tools or [], config=config)
        return self._state.output

    @contextmanager
    def _logged(self) -> Iterator[None]:
        """Let the state have all that was said, and how it ended."""
        yield
        first = self._state.messages[:1]
        messages = [message for exchange in self._exchanges for message in exchange]
        self._state.messages = [*first, *messages, ChatMessageUser(content=self._text)]

    def _holds_action(self, reply: Reply) -> bool:
        return bool(reply) and (
            not isinstance(reply, str) or self._episode.language.parse(reply).action is not None
        )

    def _note(self) -> None:
        """Keep the figures of the episode, also if a limit ends the sample."""
        self._episodes[-1] = asdict(self._episode.result()) | {"member": self._episode.member}
        self._state.store.set(EPISODES, self._episodes)
        self._state.store.set(PROBES, self._probes)

    def _tell(self, event: dict[str, Any]) -> None:
        """Write an event to the log."""
        result = self._episode.result()
        at = {"trial": self._trial + 1, "step": result.steps}
        transcript().info({**at, **event, "ending": result.ending}, source=_SOURCE)


def _schema(name: str, schema: dict[str, Any]) -> ResponseSchema:
    return ResponseSchema(name=name, json_schema=JSONSchema(**schema), strict=True)
