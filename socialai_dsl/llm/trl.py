"""Any scenario as an environment of TRL's `GRPOTrainer`, which calls its methods as tools."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from inspect import Parameter, Signature
from typing import Any, ClassVar, Final, Literal

from socialai_dsl.checking.briefing import Briefing, Tell, brief
from socialai_dsl.envs.factory import Scenario
from socialai_dsl.episodes.partners import Beside, beside
from socialai_dsl.llm.actions import ActionLanguage, ToolCall
from socialai_dsl.llm.episode import Episode
from socialai_dsl.llm.view import Style
from socialai_dsl.program_suite import Playable
from socialai_dsl.schema.scenario import TEST_SET

_CLOSING: Final = "Reply without calling a tool."


class SocialEnv:
    """One rollout at a time. `social_env` makes a class of it for each scenario, with `move` and `say` as methods.

    TRL takes every other public method for a tool.
    """

    _program: ClassVar[Playable]
    _style: ClassVar[Style]
    _briefing: ClassVar[Briefing]
    _beside: ClassVar[Beside | None]

    def __init__(self) -> None:
        seats, loaded = (None, None) if self._beside is None else (self._beside.seats(), self._beside.loaded)
        self._episode = Episode(
            self._program, self._style, "tools", briefing=self._briefing, seats=seats, loaded=loaded
        )
        self._done = True

    def reset(self, seed: int | None = None, test_episode: int | None = None, **_: Any) -> str:
        """Begin an episode; the instructions and what is seen. The arguments are columns of the data set.

        Args:
            seed: starts episode 0 of the seed; without it and `test_episode`, the next one is played.
            test_episode: number of an episode of the fixed test set.

        Raises:
            ValueError: a number is out of range.
        """
        if test_episode is not None and not 0 <= test_episode < TEST_SET:
            raise ValueError(
                f"test_episode: got {test_episode!r}, expected a number from 0 to {TEST_SET - 1}"
            )
        self._done = False
        seen = self._episode.reset(seed, test_episode)
        return f"{self._episode.instructions}\n\n{seen}"

    def get_reward(self) -> float:
        """Sum of the episode's rewards so far."""
        return self._episode.result().total

    def _call(self, tool: str, arguments: Mapping[str, str]) -> str:
        """Play what a tool means; what the model is told of it."""
        if self._done:
            return f"The episode is over. {_CLOSING}"
        turn = self._episode.step([ToolCall(tool, json.dumps(arguments))])
        self._done = turn.done
        return f"{turn.text}\n{_CLOSING}" if turn.done else turn.text


def social_env(
    scenario: Scenario,
    style: Style = "prose",
    tell: Tell | None = None,
    goal: str = "",
    language: str | None = None,
    seats: Mapping[str, str] | None = None,
) -> type[SocialEnv]:
    """The environment class of a scenario for TRL: `GRPOTrainer(..., environment_factory=social_env("talkitout"))`.

    Args:
        scenario: a path, a name or a program.
        style: how observations are written: `prose`, `grid` or `json`.
        tell: what the model is told of the task: `nothing`, the scenario's `instructions` or the `goal`; None: the goal
            if one is given, else the instructions if there are some. A program has none.
        goal: a sentence about the aim.
        language: of the instructions, such as `de`; None: the one written first.
        seats: of several, who plays which: `{"jill": "script"}`, `random`, or the path of a trained agent; the model
            has the first that is left.

    Raises:
        ScenarioError: the scenario has mistakes.
        ValueError: there is nothing of that kind to be told, or somebody cannot sit there, beside a program nobody.
    """
    if isinstance(scenario, Playable):
        if seats:
            raise ValueError("seats: got some for a program, expected the path or name of its scenario")
        played, program, loaded = None, scenario, None
    else:
        played = beside(list((seats or {}).items()), str(scenario))
        program, loaded = played.program, played.loaded
    tools = [tool["function"] for tool in ActionLanguage(program).tools()]
    briefing = brief(loaded, tell, goal, language)
    content = {"_program": program, "_style": style, "_briefing": briefing, "_beside": played}
    # Rewards are logged under the name of the class.
    return type(program.name, (SocialEnv,), {**content, **{tool["name"]: _method(tool) for tool in tools}})


def _method(tool: Mapping[str, Any]) -> Callable[..., str]:
    """A tool as a method, from whose signature and docstring transformers makes the same tool again."""
    name = tool["name"]

    def method(self: SocialEnv, **arguments: str) -> str:
        return self._call(name, arguments)

    properties, required = tool["parameters"]["properties"], tool["parameters"]["required"]
    choices = {key: Literal[tuple(choice["enum"])] for key, choice in properties.items()}
    parameters = [
        Parameter(
            key,
            Parameter.KEYWORD_ONLY,
            default=Parameter.empty if key in required else None,
            annotation=choice,
        )
        for key, choice in choices.items()
    ]
    own = Parameter("self", Parameter.POSITIONAL_OR_KEYWORD)
    method.__name__ = method.__qualname__ = name
    method.__annotations__ = {**choices, "return": str}
    vars(method)["__signature__"] = Signature([own, *parameters], return_annotation=str)
    told = [f"    {key}: {choice['description']}" for key, choice in properties.items()]
    method.__doc__ = "\n".join([tool["description"], "", "Args:", *told])
    return method
