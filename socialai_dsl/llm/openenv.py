"""Any scenario as an OpenEnv environment: a server for trainers of language models, and its client."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from secrets import randbelow
from typing import Any, ClassVar

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from openenv.core.client_types import StepResult
from openenv.core.env_client import EnvClient
from openenv.core.env_server import Environment, create_fastapi_app
from openenv.core.env_server.types import (
    Action,
    ConcurrencyConfig,
    EnvironmentMetadata,
    Observation,
    State,
)
from pydantic import Field, model_validator

from socialai_dsl.checking.briefing import NO_BRIEFING, Briefing
from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.episodes.partners import Beside
from socialai_dsl.llm.episode import Episode
from socialai_dsl.llm.gate import IDLE, Gate
from socialai_dsl.llm.view import Style, TextView
from socialai_dsl.program_suite import Playable

_SEEDS = 1 << 31


class Reply(Action):
    """A model's reply."""

    message: str = Field(description="the reply, which ends with a line such as `Act: left`")

    @model_validator(mode="before")
    @classmethod
    def _as_text(cls, given: Any) -> Any:
        """Take JSON of any other form for the reply itself: trainers send a reply that is JSON as what it says."""
        named = isinstance(given, dict) and "message" in given and given.keys() <= {"message", "metadata"}
        reply = given["message"] if named else given
        try:
            return {"message": reply if isinstance(reply, str) else json.dumps(reply, ensure_ascii=False)}
        except RecursionError:
            return {"message": ""}  # nested deeper than can be written, so it says nothing


class TextObservation(Observation):
    """An observation in text."""

    text: str = Field(description="what is seen and heard, after what was wrong with the reply, if anything")
    instructions: str = Field("", description="of the scenario; at the start of an episode only")
    success: bool | None = Field(None, description="once the episode has ended: whether in success")
    ending: str = Field("", description="once the episode has ended: how")


class Progress(State):
    """How far an episode is.

    `seed` starts it anew: `reset(seed=...)`.
    """

    seed: int | None = None
    test_episode: int | None = None
    invalid_replies: int = 0


class ScenarioEnvironment(Environment[Reply, TextObservation, Progress]):
    """One session.

    Args:
        program: of a scenario or suite.
        style: how observations are written.
        briefing: what the instructions say of the task.
        seats: who fills other seats, as `make` takes it.
        loaded: what the program was made of; of several players one is told its name then.
    """

    SUPPORTS_CONCURRENT_SESSIONS: ClassVar[bool] = True

    def __init__(
        self,
        program: Playable,
        style: Style,
        briefing: Briefing = NO_BRIEFING,
        seats: Mapping[str, Any] | None = None,
        loaded: Loaded | None = None,
    ) -> None:
        super().__init__()
        self._name = program.name
        self._episode = Episode(program, style, briefing=briefing, seats=seats, loaded=loaded)
        self._id: str | None = None
        self._seed: int | None = None
        self._test_episode: int | None = None
        self._begun = self._ended = False

    def reset(
        self,
        seed: int | None = None,
        episode_id: str | None = None,
        test_episode: int | None = None,
        **_: Any,
    ) -> TextObservation:
        """Begin an episode.

        Args:
            seed: episode 0 of this seed; without it and `test_episode`, of a seed by chance, which the state tells.
            episode_id: what the state calls it.
            test_episode: number of an episode of the test set.

        Raises:
            ValueError: a number is out of range, or the session has ended.
        """
        if self._ended:
            raise ValueError(
                "reset: nothing was played in this session for too long; expected a new connection"
            )
        if test_episode is None and seed is None:
            seed = randbelow(_SEEDS)
        text = self._episode.reset(seed, test_episode)
        self._begun = True
        self._id, self._seed, self._test_episode = episode_id, seed, test_episode
        return TextObservation(text=text, instructions=self._episode.instructions, done=False, reward=0.0)

    def step(self, action: Reply, timeout_s: float | None = None, **_: Any) -> TextObservation:
        """Play a reply. Raises ValueError outside of an episode."""
        if not self._begun:
            raise ValueError(
                "step: this session has no episode; expected a reset first, over the same websocket"
            )
        turn = self._episode.step(action.message)
        result = self._episode.result()
        ended = {"success": result.success, "ending": result.ending} if turn.done else {}
        return TextObservation(text=turn.text, reward=turn.reward, done=turn.done, **ended)

    @property
    def state(self) -> Progress:
        """How far the episode is."""
        result = self._episode.result()
        return Progress(
            episode_id=self._id,
            step_count=result.steps,
            seed=self._seed,
            test_episode=self._test_episode,
            invalid_replies=result.invalid,
        )

    def get_metadata(self) -> EnvironmentMetadata:
        """Name, description, and the version of the text."""
        return EnvironmentMetadata(
            name=self._name,
            description=f"The scenario {self._name}, in text.",
            version=str(TextView.version),
        )

    def close(self) -> None:
        """Close the environment."""
        self._begun, self._ended = False, True
        self._episode.close()


class ScenarioClient(EnvClient[Reply, TextObservation, Progress]):
    """Plays on a server: `ScenarioClient(base_url="http://localhost:8000").sync()`."""

    def _step_payload(self, action: Reply) -> dict[str, Any]:
        return {"message": action.message}

    def _parse_result(self, payload: dict[str, Any]) -> StepResult[TextObservation]:
        told = TextObservation(
            **{**payload["observation"], "done": payload["done"], "reward": payload["reward"]}
        )
        return StepResult(observation=told, reward=payload["reward"], done=payload["done"])

    def _parse_state(self, payload: dict[str, Any]) -> Progress:
        return Progress(**payload)


def application(
    played: Beside,
    style: Style = "prose",
    briefing: Briefing = NO_BRIEFING,
    sessions: int = 100,
    hosts: Iterable[str] = (),
    idle: float = IDLE,
) -> FastAPI:
    """The server of a scenario or suite.

    Args:
        played: the scenario, and who has other seats of it, as `beside` gives it.
        style: how observations are written, see `TextView`.
        briefing: what the instructions say of the task, see `brief`; by default nothing.
        sessions: how many may play at once.
        hosts: names under which it may be asked, beside those of the loopback interface.
        idle: seconds after which a session ends that sends nothing.
    """
    limits = ConcurrencyConfig(max_concurrent_envs=sessions, session_timeout=idle)
    app = create_fastapi_app(
        lambda: ScenarioEnvironment(played.program, style, briefing, played.seats(), played.loaded),
        Reply,
        TextObservation,
        concurrency_config=limits,
    )
    app.add_middleware(Gate, hosts=tuple(hosts), idle=idle)
    app.add_exception_handler(ValueError, _refuse)
    app.add_exception_handler(RequestValidationError, _refuse)
    return app


def _refuse(_: Request, error: Exception) -> JSONResponse:
    """Answer what cannot be done with a sentence; what was given is not repeated, since JSON may not hold it."""
    said = "the request is not of the form that /schema shows" if hasattr(error, "errors") else str(error)
    return JSONResponse({"detail": said}, 422)
