"""Any scenario as a task of Inspect AI, which brings models, logs, limits and a viewer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Final, Literal

from inspect_ai import Task, task
from inspect_ai.dataset import MemoryDataset, Sample
from inspect_ai.model import ChatMessage, ChatMessageAssistant, ChatMessageSystem, ChatMessageUser, get_model
from inspect_ai.scorer import Score, Scorer, Target, mean, scorer, stderr
from inspect_ai.solver import Generate, Solver, TaskState, solver

from socialai_dsl.checking.briefing import Tell, brief
from socialai_dsl.episodes.partners import beside
from socialai_dsl.llm.episode import CONTEXT, Episode, OnInvalid
from socialai_dsl.llm.history import WHOLE, left_out
from socialai_dsl.llm.view import Style, TextView

_RESULT: Final = "result"
_STOPS: Final = {"max_tokens": "length", "content_filter": "content_filter"}
"""Inspect's words for how a server ended a reply, as `Episode.step` takes them."""


@task
def scenario(
    scenario: str = "talkitout",
    episodes: int = 50,
    style: Style = "prose",
    mode: Literal["text", "json"] = "text",
    history: int | None = WHOLE,
    on_invalid: OnInvalid = "noop",
    tell: Tell | None = None,
    goal: str = "",
    language: str | None = None,
    seats: Mapping[str, str] | None = None,
) -> Task:
    """Test episodes 0 to `episodes - 1` of a scenario, a sample each.

    Args:
        scenario: a path or a name, with +variants and ?parameters.
        episodes: how many; the common test set has 500.
        style: how observations are written, see `TextView`.
        mode: how actions are given, see `ActionLanguage`.
        history: how many observations the model is shown, the present one included; None: the whole episode.
        on_invalid: what a reply without an action does, see `Episode`.
        tell: what the model is told of the task: `nothing`, the scenario's `instructions` or the `goal`; None: the goal
            if one is given, else the instructions if there are some.
        goal: a sentence about the aim.
        language: of the instructions, such as `de`; None: the one written first.
        seats: of several, who plays which: `{"jill": "script"}`, `random`, or the path of a trained agent; the model
            has the first that is left.

    Raises:
        ScenarioError: the scenario does not exist, or has mistakes.
        ValueError: an argument is not what was expected.
    """
    if episodes < 1:
        raise ValueError(f"episodes: got {episodes}, expected at least 1")
    left_out((), history)  # a limit that is none is told before anything is played
    played = beside(list((seats or {}).items()), scenario)
    options: dict[str, Any] = {"style": style, "mode": mode, "on_invalid": on_invalid}
    briefing = brief(played.loaded, tell, goal, language)

    def episode() -> Episode:
        seated = played.seats()
        return Episode(played.program, briefing=briefing, seats=seated, loaded=played.loaded, **options)

    beginning = episode()
    samples = [
        Sample(
            id=number,
            input=beginning.reset(test_episode=number),
            target="success",
            metadata={"episode": number},
        )
        for number in range(episodes)
    ]
    return Task(
        dataset=MemoryDataset(samples, name=scenario),
        solver=player(episode, history),
        scorer=outcome(),
        version=TextView.version,
        metadata={
            "scenario": scenario,
            "program_sha256": played.program.sha256,
            "text": TextView.version,
            **briefing.record(),
            **({"seat": beginning.seat, "seats": dict(seats)} if seats else {}),
        },
    )


@solver
def player(episode_maker: Any, history: int | None = WHOLE) -> Solver:
    """Lets the model play the sample's episode to its end.

    Args:
        episode_maker: gives an `Episode` of its own to each sample.
        history: how many observations a request holds; None: all.
    """

    async def solve(state: TaskState, generate: Generate) -> TaskState:
        episode: Episode = episode_maker()
        text = episode.reset(test_episode=state.metadata["episode"])
        state.messages = [ChatMessageSystem(content=episode.instructions), ChatMessageUser(content=text)]
        state.store.set(_RESULT, asdict(episode.result()))
        done = False
        while not done:
            output = await get_model().generate(_shown(state.messages, history))
            state.output = output
            message = output.message if output.choices else ChatMessageAssistant(content="")
            if output.stop_reason == "model_length" and episode.language.parse(message.text).action is None:
                episode.end(CONTEXT)
                state.store.set(_RESULT, asdict(episode.result()))
                break
            turn = episode.step(message.text, _STOPS.get(output.stop_reason, ""))
            done = turn.done
            state.messages += [message, ChatMessageUser(content=turn.text)]
            state.store.set(_RESULT, asdict(episode.result()))  # also if a limit ends the sample
        episode.close()
        return state

    return solve


def _shown(messages: list[ChatMessage], history: int | None) -> list[ChatMessage]:
    """The instructions, then observations and replies in turn, without those beyond the limit."""
    instructions, *turns = messages
    count, told = left_out([turn.text for turn in turns[:-1:2]], history)
    first, *others = turns[2 * count :]
    return [instructions, ChatMessageUser(content=told + first.text), *others]


@scorer(
    metrics={
        "success": [mean(), stderr()],
        "return": [mean(), stderr()],
        "steps": [mean()],
        "invalid_rate": [mean()],
    }
)
def outcome() -> Scorer:
    """How the episode went: success, return, steps, and the share of replies without an action."""

    async def score(state: TaskState, target: Target) -> Score:
        result = state.store.get(_RESULT)
        value = {
            "success": int(result["success"]),
            "return": result["total"],
            "steps": result["steps"],
            "invalid_rate": result["invalid"] / max(result["replies"], 1),
        }
        return Score(value=value, answer=result["ending"] or "stopped", metadata=result)

    return score
