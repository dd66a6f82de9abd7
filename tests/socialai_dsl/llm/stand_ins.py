"""Small stand-ins of OpenEnv and Inspect AI, so that each run of the tests executes what is written for them.

They have what our modules use and no more; `make test-models` runs the same modules with the libraries themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import ModuleType, SimpleNamespace
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ConfigDict
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

Act, Told, At = TypeVar("Act"), TypeVar("Told"), TypeVar("At")


def modules(**contents: dict[str, Any]) -> dict[str, ModuleType]:
    """Modules by their names, in which `_` stands for a dot, with what they hold; packages of them as well."""
    made: dict[str, ModuleType] = {}
    for spelt, content in contents.items():
        name = spelt.replace("__", ".")
        for end in (at for at, sign in enumerate(f"{name}.") if sign == "."):
            made.setdefault(name[:end], ModuleType(name[:end]))
        vars(made[name]).update(content)
    return made


# -- OpenEnv ----------------------------------------------------------------------------------------------------------


class Action(BaseModel):
    model_config = ConfigDict(extra="forbid")
    metadata: dict[str, Any] = {}


class Observation(BaseModel):
    done: bool = False
    reward: float | None = None
    metadata: dict[str, Any] = {}


class State(BaseModel):
    episode_id: str | None = None
    step_count: int = 0


class EnvironmentMetadata(BaseModel):
    name: str
    description: str


class ConcurrencyConfig(BaseModel):
    max_concurrent_envs: int
    session_timeout: float


class Environment(Generic[Act, Told, At]):
    def __init__(self) -> None:
        """Hold nothing."""


class EnvClient(Generic[Act, Told, At]):
    """Is only derived from."""


class RequestValidationError(ValueError):
    """A body of another form."""


@dataclass
class StepResult(Generic[Told]):
    observation: Told
    reward: float | None
    done: bool


def create_fastapi_app(
    factory: Callable[[], Any], action: Any, observation: Any, concurrency_config: ConcurrencyConfig
) -> Starlette:
    """Speaks as OpenEnv's server does, as far as one session needs it."""

    def told(found: Any) -> dict[str, Any]:
        content = found.model_dump(exclude={"reward", "done"})
        return {"observation": content, "reward": found.reward, "done": found.done}

    async def reset(request: Request) -> Response:
        return JSONResponse(told(factory().reset(**await request.json())))

    async def step(request: Request) -> Response:
        return JSONResponse(told(factory().step(action(**(await request.json())["action"]))))

    async def session(socket: WebSocket) -> None:
        await socket.accept()
        env = factory()
        try:
            while True:
                message = await socket.receive_json()
                try:
                    if message["type"] == "state":
                        answer = {"type": "state", "data": env.state.model_dump()}
                    else:
                        data = message.get("data", {})
                        made = env.step(action(**data)) if message["type"] == "step" else env.reset(**data)
                        answer = {"type": "observation", "data": told(made)}
                except ValueError as error:
                    answer = {"type": "error", "data": {"message": str(error)}}
                await socket.send_json(answer)
        except WebSocketDisconnect:
            env.close()

    posts = [Route("/reset", reset, methods=["POST"]), Route("/step", step, methods=["POST"])]
    return Starlette(routes=[*posts, WebSocketRoute("/ws", session)])


OPENENV = modules(
    openenv__core__client_types={"StepResult": StepResult},
    openenv__core__env_client={"EnvClient": EnvClient},
    openenv__core__env_server={"Environment": Environment, "create_fastapi_app": create_fastapi_app},
    openenv__core__env_server__types={
        kind.__name__: kind for kind in (Action, ConcurrencyConfig, EnvironmentMetadata, Observation, State)
    },
    fastapi={"FastAPI": Starlette, "Request": Request},
    fastapi__exceptions={"RequestValidationError": RequestValidationError},
    fastapi__responses={"JSONResponse": JSONResponse},
)

# -- Inspect AI -------------------------------------------------------------------------------------------------------


@dataclass
class Message:
    content: str
    tool_calls: Any = None
    tool_call_id: str = ""
    function: str = ""

    @property
    def text(self) -> str:
        return self.content


class Kept(dict[str, Any]):
    """A store."""

    set = dict.__setitem__


@dataclass
class TaskState:
    metadata: dict[str, Any]
    messages: list[Message] = field(default_factory=list)
    store: Kept = field(default_factory=Kept)
    output: Any = None


class Model:
    """Says what it was given, one reply after the other, and `Act: done` from then on; each with how it ended.

    A reply that is no text is a list of pairs: tools that are called, each with its arguments.
    """

    def __init__(self, replies: Sequence[tuple[Any, str]]) -> None:
        self.replies = iter(replies)
        self.asked: list[list[Message]] = []
        self.events: list[dict[str, Any]] = []

    async def generate(self, messages: list[Message], tools: Any, config: Any) -> Any:
        self.asked.append(messages)
        said, reason = next(self.replies, ("Act: done", "stop"))
        calls = None
        if not isinstance(said, str):
            calls = [SimpleNamespace(id="1", function=name, arguments=given) for name, given in said]
        message = Message("" if calls else said, calls)
        choices = [] if reason == "unknown" else [message]
        return SimpleNamespace(message=message, stop_reason=reason, choices=choices)

    def info(self, data: dict[str, Any], source: str) -> None:
        """Note an event."""
        self.events.append(data)


def plain(*_: Any, **__: Any) -> Any:
    """A decorator that leaves a function as it is."""
    return lambda function: function


def itself(function: Any) -> Any:
    """A decorator without arguments that leaves a function as it is."""
    return function


def average(scores: Sequence[Any]) -> float:
    """A metric."""
    return sum(score.score.value for score in scores) / len(scores)


def inspect_ai(model: Model) -> dict[str, ModuleType]:
    """The library with a model."""
    record = SimpleNamespace
    kinds = ("ChatMessage", "ChatMessageAssistant", "ChatMessageSystem", "ChatMessageTool", "ChatMessageUser")
    return modules(
        inspect_ai={"Task": record, "task": itself},
        inspect_ai__dataset={"MemoryDataset": lambda samples, name: samples, "Sample": record},
        inspect_ai__log={"transcript": lambda: model},
        inspect_ai__model={
            **dict.fromkeys(kinds, Message),
            **{"GenerateConfig": record, "ModelOutput": Any, "ResponseSchema": record},
            "get_model": lambda: model,
        },
        inspect_ai__scorer={
            **{"Metric": Any, "SampleScore": Any, "Score": record, "Scorer": Any, "Target": Any},
            **{"scorer": plain, "metric": itself, "grouped": plain, "stderr": lambda: "stderr"},
            "mean": lambda: average,
        },
        inspect_ai__solver={"Generate": Any, "Solver": Any, "TaskState": TaskState, "solver": itself},
        inspect_ai__tool={"ToolInfo": record},
        inspect_ai__util={"JSONSchema": record},
    )
