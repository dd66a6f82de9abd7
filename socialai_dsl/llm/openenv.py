"""Any scenario as an OpenEnv environment: a server for trainers of language models, and its client."""

from __future__ import annotations

import json
from secrets import randbelow
from typing import Any, ClassVar

from fastapi import FastAPI
from openenv.core.client_types import StepResult
from openenv.core.env_client import EnvClient
from openenv.core.env_server import Environment, create_fastapi_app
from openenv.core.env_server.types import Action, EnvironmentMetadata, Observation, State
from pydantic import Field, model_validator

from socialai_dsl.llm.episode import Episode
from socialai_dsl.llm.view import Style
from socialai_dsl.program_suite import Playable

_SEEDS = 1 << 31


class Reply(Action):
    """A model's reply."""

    message: str = Field(description="the reply, which ends with a line such as `Act: left`")

    @model_validator(mode="before")
    @classmethod
    def _as_text(cls, given: Any) -> Any:
        """Take JSON of any other form for the reply itself: trainers send a reply that is JSON as what it says."""
        reply = given.get("message", given) if isinstance(given, dict) else given
        return given if isinstance(reply, str) else {"message": json.dumps(reply, ensure_ascii=False)}


class Told(Observation):
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


class ScenarioEnvironment(Environment[Reply, Told, Progress]):
    """One session.

    Args:
        program: of a scenario or suite.
        style: how observations are written.
    """

    SUPPORTS_CONCURRENT_SESSIONS: ClassVar[bool] = True

    def __init__(self, program: Playable, style: Style) -> None:
        super().__init__()
        self._name = program.name
        self._episode = Episode(program, style)
        self._id: str | None = None
        self._seed: int | None = None
        self._test_episode: int | None = None

    def reset(
        self,
        seed: int | None = None,
        episode_id: str | None = None,
        test_episode: int | None = None,
        **_: Any,
    ) -> Told:
        """Begin an episode.

        Args:
            seed: episode 0 of this seed; without it and `test_episode`, of a seed by chance, which the state tells.
            episode_id: what the state calls it.
            test_episode: number of an episode of the test set.

        Raises:
            ValueError: a number is out of range.
        """
        if test_episode is None and seed is None:
            seed = randbelow(_SEEDS)
        text = self._episode.reset(seed, test_episode)
        self._id, self._seed, self._test_episode = episode_id, seed, test_episode
        return Told(text=text, instructions=self._episode.instructions, done=False, reward=0.0)

    def step(self, action: Reply, timeout_s: float | None = None, **_: Any) -> Told:
        """Play a reply. Raises ValueError outside of an episode."""
        turn = self._episode.step(action.message)
        result = self._episode.result()
        ended = {"success": result.success, "ending": result.ending} if turn.done else {}
        return Told(text=turn.text, reward=turn.reward, done=turn.done, **ended)

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
        """Name and description."""
        return EnvironmentMetadata(name=self._name, description=f"The scenario {self._name}, in text.")

    def close(self) -> None:
        """Let the environment go."""
        self._episode.close()


class ScenarioClient(EnvClient[Reply, Told, Progress]):
    """Plays on a server: `ScenarioClient(base_url="http://localhost:8000").sync()`."""

    def _step_payload(self, action: Reply) -> dict[str, Any]:
        return {"message": action.message}

    def _parse_result(self, payload: dict[str, Any]) -> StepResult[Told]:
        told = Told(**{**payload["observation"], "done": payload["done"], "reward": payload["reward"]})
        return StepResult(observation=told, reward=payload["reward"], done=payload["done"])

    def _parse_state(self, payload: dict[str, Any]) -> Progress:
        return Progress(**payload)


def application(program: Playable, style: Style = "prose", sessions: int = 100) -> FastAPI:
    """The server of a scenario or suite.

    Args:
        program: its program.
        style: how observations are written, see `TextView`.
        sessions: how many may play at once.
    """
    return create_fastapi_app(
        lambda: ScenarioEnvironment(program, style), Reply, Told, max_concurrent_envs=sessions
    )
