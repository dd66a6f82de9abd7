"""Players: random actions, a script, a rival, a person, a language model or a trained network."""

import re
import secrets
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, Literal

from socialai_dsl.checking.briefing import NO_BRIEFING, Briefing, Tell, brief
from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.diagnostics import suggested
from socialai_dsl.envs.seats import NOBODY
from socialai_dsl.episodes.play import Rooms
from socialai_dsl.episodes.policies import (
    FunctionPolicy,
    Policy,
    PredictingPolicy,
    RandomPolicy,
    ScriptedPolicy,
    StillPolicy,
)
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.frontend import load
from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.loader.resolved import taken_apart
from socialai_dsl.model_options import ModelOptions
from socialai_dsl.runs.folder import CONFIG, agent_of
from socialai_dsl.trainer.config import LEARNS, MODEL_PREFIX, RIVAL_PREFIX, UNTRAINED
from socialai_dsl.trainer.shipped import PREFIX, agent_name, located, shipped_agents

SHIPPED: Final = "shipped"
"""The agent that ships for the scenario that is played."""
HUMAN_FOLDER: Final = Path("runs", "human")
"""Where the sessions of people go unless the user says otherwise."""


@dataclass(frozen=True)
class Player:
    """Who plays, and how.

    Attributes:
        agent: `random`, `oracle`, `rival:NAME`, `nobody`, `human`, `llm:MODEL`, `shipped:NAME`, or the path of a run, a
            folder of checkpoints or one of them; of a policy of one's own what it is called.
        device: where a network runs.
        greedy: whether a network takes its most probable action instead of sampling.
        seed: of what a network or `random` draws; rooms do not depend on it.
        net: name of a network that does not ship, whose code is imported if a checkpoint asks for it.
        algorithm: name of an algorithm that does not ship, likewise.
        folder: where the files of these are looked for first.
        out: where what a person or a language model plays is kept, by default in `runs`.
        options: how a language model is asked.
        tell, goal, language: what a language model or a person is told of the task, see `brief`; others read nothing.
        view: whether a person sees what the agent sees, or the whole `room`; all others have the seat's view.
        policy: a policy of one's own, which plays.
        run: the folder that was named, if it said who plays.

    Raises:
        ValueError: the agent is neither a name nor a path.
    """

    agent: str
    device: str = "cpu"
    greedy: bool = False
    seed: int = 0
    net: str | None = None
    algorithm: str | None = None
    folder: Path = Path()
    out: Path | None = None
    options: ModelOptions | None = None
    policy: Policy | None = None
    run: Path | None = None
    tell: Tell | None = None
    goal: str = ""
    language: str | None = None
    view: Literal["seat", "room"] = "seat"

    def __post_init__(self) -> None:
        agent: object = self.agent  # whatever the caller gives
        if isinstance(agent, Path):
            object.__setattr__(self, "agent", str(agent))
        elif not isinstance(agent, str):
            raise ValueError(
                f"agent: got {self.agent!r}, expected a name or a path; a policy plays by `policy`"
            )
        if self.is_model and self.options is None:
            object.__setattr__(self, "options", ModelOptions())

    @property
    def is_model(self) -> bool:
        """Whether a language model plays."""
        return self.policy is None and self.agent.startswith(MODEL_PREFIX)

    @property
    def is_person(self) -> bool:
        """Whether a person plays."""
        return self.policy is None and self.agent == "human"

    @property
    def kind(self) -> str:
        """What kind of mind plays: chance, script, rival, nobody, person, model, network, or a policy in Python."""
        if self.policy is not None:
            return "policy"
        if self.is_model:
            return "model"
        if self.rival is not None:
            return "rival"
        return {"random": "chance", "oracle": "script", "human": "person", NOBODY: NOBODY}.get(
            self.agent, "network"
        )

    @property
    def is_script(self) -> bool:
        """Whether the scenario's own script plays."""
        return self.policy is None and self.agent == "oracle"

    @property
    def rival(self) -> str | None:
        """The rival of the scenario that plays, by its name there; None if somebody else does."""
        named = self.policy is None and self.agent.startswith(RIVAL_PREFIX)
        return self.agent.removeprefix(RIVAL_PREFIX) if named else None

    @property
    def follows_frame(self) -> bool:
        """Whether the one who plays the agent follows a frame of the scenario's file: its script, or a rival."""
        return self.is_script or self.rival is not None

    @property
    def is_trained(self) -> bool:
        """Whether a network plays whose checkpoint `agent` names."""
        return self.kind == "network"

    def briefing(self, loaded: Loaded) -> Briefing:
        """What is told of a scenario or suite before the first observation.

        Raises:
            OptionError: there is nothing of that kind to be told, or the player reads nothing.
        """
        if not (self.is_model or self.is_person):
            if self.tell is not None or self.goal or self.language is not None:
                raise OptionError("tell", f"the agent {self.agent!r} reads nothing")
            return NO_BRIEFING
        return brief(loaded, self.tell, self.goal, self.language)

    @property
    def kept_in(self) -> Path:
        """Where what a person or a language model plays is kept."""
        return self.out or (default_folder(self.agent) if self.is_model else session_folder(HUMAN_FOLDER))

    @property
    def manner(self) -> str:
        """How actions come about, in a phrase; empty where there is nothing to say."""
        if self.options is not None:
            return self.options.manner
        if self.kind in ("script", "rival", "person", "policy"):
            return ""
        return "most probable actions" if self.greedy else f"sampled actions, seed {self.seed}"


Agent = str | Path | Player | Policy | Callable[[Any], Any]
"""Whom `player_of` knows."""


def make_policy(player: Player, envs: Any) -> tuple[Policy, list[str]]:
    """What plays, and what is to be known about it, such as that it was trained on something else.

    Raises:
        UsageError: a person or a language model plays, who cannot be asked here.
        ValueError: the checkpoint does not fit the environments.
    """
    if player.policy is not None:
        return player.policy, []
    if player.agent == "human" or player.is_model:
        raise UsageError(
            f"the agent {player.agent!r} plays for `socialai evaluate` alone; expected random, oracle, shipped, a "
            "checkpoint or a run folder"
        )
    if player.agent == "random":
        return RandomPolicy(Rooms(envs).action_sizes, player.seed), []
    if player.agent == NOBODY:
        return StillPolicy(Rooms(envs).action_sizes), []
    if player.follows_frame:
        return ScriptedPolicy(envs), []
    from socialai_dsl.trainer.play import CheckpointPolicy

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        policy = CheckpointPolicy.load(
            player.agent,
            envs,
            player.greedy,
            player.seed,
            player.device,
            player.net,
            player.folder,
            player.algorithm,
        )
    return policy, [str(warning.message) for warning in caught]


def player_of(agent: Agent, scenario: str) -> Player:
    """Who is meant by an agent: a name, a path, a `Player`, a policy, a model of Stable-Baselines3, or a function.

    Args:
        agent: a policy has the methods `reset` and `act`, see `Policy`. A model has `predict`, as those of
            Stable-Baselines3 have, and samples its actions. A function is called with the observations of several
            rooms, and returns int64 (E, heads).
        scenario: for which `shipped` is looked up.

    Raises:
        ScenarioError, UsageError: see `named_agent`.
        ValueError: it is none of these.
    """
    if isinstance(agent, Player):
        return agent
    if isinstance(agent, str | Path):
        return Player(named_agent(str(agent), scenario))
    if isinstance(agent, type):
        raise ValueError(f"agent: got the class {agent.__name__}, expected an object of it")
    name = getattr(agent, "__name__", type(agent).__name__)
    if all(callable(getattr(agent, method, None)) for method in ("reset", "act")):
        return Player(name, policy=agent)  # type: ignore[arg-type]
    if callable(getattr(agent, "predict", None)):
        return Player(name, policy=PredictingPolicy(agent))
    if callable(agent):
        return Player(name, policy=FunctionPolicy(agent))
    raise ValueError(
        f"agent: got {agent!r}, expected a name, a path, a Player, an object with the methods reset and act, or with "
        "predict, or a function"
    )


def require_trainer(*more: str) -> None:
    """Say how to install the trainer if it is missing.

    Args:
        more: what is needed beside the libraries with which a trained agent plays.

    Raises:
        UsageError: a library is not installed.
    """
    for library in ("torch", "safetensors", *more):
        if find_spec(library) is None:
            raise UsageError(f"training and evaluating need {library}: pip install 'socialai-dsl[train]'")


def folder_of(agent: str) -> Path:
    """Where a trained agent is kept: for `shipped:NAME` the folder that comes with the product.

    Raises:
        UsageError: no agent of that name ships.
    """
    try:
        return located(agent)
    except ValueError as error:
        raise UsageError(str(error)) from None


def existing_folder(agent: str) -> Path:
    """Where a trained agent is kept, see `folder_of`, or its file.

    Raises:
        UsageError: there is none.
    """
    folder = folder_of(agent)
    if not folder.exists():
        known = f"{', '.join(UNTRAINED)}, shipped, shipped:NAME, rival:NAME or llm:MODEL"
        near = suggested(agent, UNTRAINED, f"; expected the path of a run or a checkpoint, {known}")
        raise UsageError(f"there is no agent {agent!r}{near}")
    return folder


def named_agent(agent: str, scenario: str) -> str:
    """What `--agent` stands for: the word `shipped` is the agent that ships for the scenario, as `shipped:NAME`.

    A variant is played by the agent of what it is a variant of, unless it has one of its own. A folder names the agent
    that played there, see `played_again`.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: none ships for it; or see `played_again`.
    """
    if agent != SHIPPED:
        return played_again(agent)
    path, shipped = load(scenario).resolved.path, shipped_folder().resolve()
    _, *variants = taken_apart(scenario)[1].partition("?")[0].split("+")
    known = shipped_agents()
    if path.is_relative_to(shipped):
        base = path.relative_to(shipped).with_suffix("").as_posix()
        for count in range(len(variants), -1, -1):
            name = agent_name(base, *variants[:count])
            if name in known:
                return PREFIX + name
    raise UsageError(f"{scenario}: no agent ships for it; these agents ship: {', '.join(known)}")


def is_name(agent: str) -> bool:
    """Whether an agent is no path: a script, chance, a person, a language model, the one that ships for a scenario."""
    return agent in (*UNTRAINED, SHIPPED) or agent.startswith((MODEL_PREFIX, RIVAL_PREFIX))


def played_again(agent: str) -> str:
    """The agent that a name or a path means; the folder of a run or an evaluation means the agent that played there.

    Raises:
        UsageError: there is no such agent; or a person or a language model played there, or an agent that is not here.
        OSError: what the folder says cannot be read.
    """
    if is_name(agent):
        return agent
    folder = existing_folder(agent)
    if not (folder / CONFIG).is_file() or (played := agent_of(folder)) == LEARNS:
        return agent
    if Player(played).is_person or Player(played).is_model:
        raise UsageError(
            f"{folder}: {played!r} played there, which `socialai replay` shows; expected an agent that plays again"
        )
    if Player(played).is_trained and not folder_of(played).exists():
        raise UsageError(
            f"{folder}: {played!r} played there, which is not found from here; name the agent itself"
        )
    return played


def session_folder(parent: Path, participant: str | None = None) -> Path:
    """A folder that no other session has, named after the person, if there is a name, and the time in UTC."""
    stamp = f"{datetime.now(UTC):%Y%m%dT%H%M%SZ}-{secrets.token_hex(3)}"
    return parent / (stamp if participant is None else f"{participant}-{stamp}")


def participant_of(session: Path) -> str:
    """Whose session a folder of `session_folder` is: the name of the person, if there is one, else the time."""
    return re.sub(r"(?<=.)-\d{8}T\d{6}Z-[0-9a-f]{6}$", "", session.name)


def default_folder(agent: str) -> Path:
    """Where the episodes of a model go unless the user says otherwise."""
    return Path(
        "runs", "llm", re.sub(r"[^\w.-]+", "_", agent.removeprefix(MODEL_PREFIX)).strip(".") or "model"
    )
