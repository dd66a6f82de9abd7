"""This module trains, loads and evaluates agents for the commands, by way of the trainer."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final, Literal

from socialai_dsl.cli.errors import RunFailed, UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from socialai_dsl.cli.episode import Episode
    from socialai_dsl.cli.settings import Settings
    from socialai_dsl.program_suite import Playable
    from trainer.config import TrainConfig
    from trainer.evaluate import EvalResult
    from trainer.nets import Precision
    from trainer.policies import Policy

# Test episodes played together. It is fixed, because a sampling policy draws for all of them at once.
_EVALUATED_TOGETHER: Final = 125
_DEFAULT_EXPLO_C: Final = {"lang": 7.0, "cell": 3.0}


def require_trainer() -> None:
    """Say how to install the trainer if it is missing.

    Raises:
        UsageError: it is.
    """
    try:
        import torch  # noqa: F401
    except ImportError:
        raise UsageError("training and evaluating need PyTorch: pip install 'socialai-dsl[train]'") from None


def resolve_device(device: str) -> str:
    """`auto` is a graphics card where there is one.

    Raises:
        UsageError: `cuda` was asked for and is not there.
    """
    import torch

    available = torch.cuda.is_available()
    if device == "cuda" and not available:
        raise UsageError("--device cuda: PyTorch finds no CUDA device on this machine")
    return "cuda" if device == "cuda" or (device == "auto" and available) else "cpu"


def resolve_precision(choice: str, net: str, device: str) -> "Precision":
    """`auto` is the type in which the device computes this network fastest.

    Raises:
        UsageError: there is no such network.
    """
    from trainer.config import configure
    from trainer.nets import best_precision

    if choice == "bfloat16":
        return "bfloat16"
    if choice == "float32":
        return "float32"
    try:
        return best_precision(configure(net).net, device)
    except ValueError as error:
        raise UsageError(str(error)) from None


def resolve_exploration(kind: str, scenario: str) -> tuple[Literal["none", "lang", "cell"], float]:
    """Kind and scale of the exploration bonus; `auto` looks the scenario up in the paper's table."""
    import yaml

    import trainer
    from socialai_dsl.cli.run_folder import base_name

    table_file = Path(trainer.__file__).with_name("exploration.yaml")
    table = yaml.safe_load(table_file.read_text(encoding="utf-8"))
    listed = table.get(base_name(scenario), {"kind": "none"})
    if kind == "auto":
        kind = listed["kind"]
    scale = listed["c"] if kind == listed["kind"] and kind != "none" else _DEFAULT_EXPLO_C.get(kind, 0.0)
    if kind == "lang":
        return "lang", float(scale)
    return ("cell" if kind == "cell" else "none"), float(scale)


def default_envs(net: str) -> int:
    """How many environments an agent trains on unless told otherwise."""
    from trainer.config import configure

    return configure(net).num_envs


def train_config(settings: "Settings") -> "TrainConfig":
    """The trainer's configuration of a run.

    Raises:
        UsageError: a value is out of range.
    """
    from pydantic import ValidationError

    from trainer.config import PRESETS, configure

    # A small batch of environments cannot be cut into as many parts as the default has; a preset's number is its own.
    parts = {} if settings.net in PRESETS else {"minibatches": min(4, settings.envs)}
    try:
        return configure(
            settings.net,
            frames=settings.frames,
            seed=settings.seed,
            num_envs=settings.envs,
            **parts,
            explo=settings.explo,
            explo_c=settings.explo_c,
            precision=settings.precision,
            curriculum=settings.curriculum,
            device=settings.device,
        )
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise UsageError(f"{place}: {first['msg']}, got {first['input']!r}") from None


def train_agent(settings: "Settings", folder: Path, resume: bool, stream: IO[str]) -> Path:
    """Train, show the progress on `stream`, and return the path of the final checkpoint.

    Raises:
        UsageError: the run cannot start, or its folder cannot be written.
        RunFailed: training broke down.
        KeyboardInterrupt: with a message that says how to go on.
    """
    import socialai_dsl
    from socialai_dsl.cli.progress import TrainingProgress
    from trainer.errors import TrainingStopped
    from trainer.train import Progress, train

    config = train_config(settings)
    envs = socialai_dsl.make_vec(
        settings.scenario, num_envs=settings.envs, copy=False, autoreset_mode="SameStep"
    )
    total = config.updates * config.frames_per_update
    try:
        with TrainingProgress(total, stream) as shown:

            def report(progress: Progress) -> None:
                shown.update(progress.frames, progress.success_rate, progress.frames_per_second)

            return train(config, envs, folder, progress=report, resume=resume)
    except TrainingStopped as error:
        if isinstance(error.__cause__, OSError):
            raise UsageError(str(error)) from error
        raise RunFailed(str(error)) from error
    except (
        ValueError
    ) as error:  # what the trainer says about a configuration or a checkpoint that does not fit
        raise UsageError(str(error)) from error
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; go on with: socialai-run --resume {folder}") from None
    finally:
        envs.close()


def evaluate_agent(
    agent: str, scenario: str, program: "Playable", episodes: int, device: str, label: str
) -> tuple[dict[str, Any], "Episode"]:
    """Play test episodes and record one of them: the first success, or the first if there is none.

    Args:
        agent: `random`, `oracle`, `human`, or the path of a checkpoint, of a folder of them or of a run.
        scenario: what to play.
        program: the scenario's.
        episodes: how many test episodes, from the first on.
        device: where a network runs.
        label: how the recording calls the agent.

    Returns:
        The figures as a JSON-able object, and the recorded episode.

    Raises:
        UsageError: the checkpoint or the script does not fit the scenario.
    """
    if agent == "human":
        return _evaluate_human(scenario, program, episodes)

    import socialai_dsl
    from trainer.evaluate import evaluate

    if agent == "oracle":
        scenario = _with_script(scenario, program)
    envs = socialai_dsl.make_vec(
        scenario, num_envs=_EVALUATED_TOGETHER, copy=False, autoreset_mode="SameStep"
    )
    try:
        policy = _Remembering(_make_policy(agent, envs, device))
        result = evaluate(policy, envs, episodes)
    except ValueError as error:
        raise UsageError(str(error)) from error
    finally:
        envs.close()
    number = int(result.success.argmax())
    actions = policy.actions_of(number, int(result.lengths[number]))
    figures = _figures(result)
    figures |= _by_member(program, result.outcomes)
    if agent == "oracle":
        # A room that the script does not solve is worth looking at: it can be played again by its number.
        figures["unsolved"] = (~result.success).nonzero()[0].tolist()
    return figures, _record(scenario, program, number, actions, label)


def _with_script(scenario: str, program: "Playable") -> str:
    """The scenario itself if it scripts the agent, else its variant `oracle`, in which everything else is the same.

    Raises:
        UsageError: there is no script.
    """
    import socialai_dsl
    from socialai_dsl.program_suite import is_scripted

    if is_scripted(program):
        return scenario
    name, mark, parameters = scenario.partition("?")
    scripted = f"{name}+oracle{mark}{parameters}"
    try:
        socialai_dsl.load(scripted)
    except socialai_dsl.ScenarioError as error:
        if all(diagnostic.code == "S503" for diagnostic in error.diagnostics):
            raise UsageError(
                f"{scenario}: the agent has no frame, and there is no variant `oracle`"
            ) from None
        raise
    return scripted


def _make_policy(agent: str, envs: Any, device: str) -> "Policy":
    from trainer.policies import CheckpointPolicy, RandomPolicy, ScriptedPolicy

    if agent == "random":
        return RandomPolicy(tuple(int(n) for n in envs.single_action_space.nvec))
    if agent == "oracle":
        return ScriptedPolicy(envs)
    path = Path(agent)
    checkpoints = path / "checkpoints"
    return CheckpointPolicy.load(checkpoints if checkpoints.is_dir() else path, envs, device=device)


def _evaluate_human(scenario: str, program: "Playable", episodes: int) -> tuple[dict[str, Any], "Episode"]:
    """Let a person play test episodes until they quit."""
    import socialai_dsl
    from socialai_dsl.cli.play import HELP, Played, Quit, play_episode

    env = socialai_dsl.make(scenario, render_mode="ansi")
    played: list[Played] = []
    print(HELP)
    try:
        for number in range(episodes):
            played.append(play_episode(env, program, {"options": {"test_episode": number}}))
    except Quit:
        if not played:
            raise UsageError("no episode was played to its end") from None
    finally:
        env.close()
    count, rate = len(played), sum(p.success for p in played) / len(played)
    figures: dict[str, Any] = {
        "episodes": count,
        "success_rate": rate,
        "success_rate_se": math.sqrt(rate * (1 - rate) / count),
        "mean_length": sum(len(p.actions) for p in played) / count,
        "mean_return": sum(p.reward for p in played) / count,
        "outcomes": {name: sum(p.outcome == name for p in played) / count for name in program.outcomes},
    }
    figures |= _by_member(program, figures["outcomes"])
    number = next((i for i, p in enumerate(played) if p.success), 0)
    return figures, _record(scenario, program, number, played[number].actions, "agent human")


class _Remembering:
    """A policy that keeps its actions, so that an episode can be played again for the recording."""

    def __init__(self, policy: "Policy") -> None:
        self._policy = policy
        self._waves: list[list[NDArray[np.int64]]] = []

    def reset(self, mask: "NDArray[np.bool_]") -> None:
        """See `Policy.reset`; where everything begins anew, a new wave of episodes does."""
        if mask.all():
            self._waves.append([])
        self._policy.reset(mask)

    def act(self, observation: Any) -> "NDArray[np.int64]":
        """See `Policy.act`."""
        actions = self._policy.act(observation)
        self._waves[-1].append(actions.copy())
        return actions

    def actions_of(self, episode: int, length: int) -> "list[NDArray[np.int64]]":
        """The actions of one test episode, int64 (4,) each."""
        wave, place = divmod(episode, _EVALUATED_TOGETHER)
        return [actions[place] for actions in self._waves[wave][:length]]


def _record(
    scenario: str, program: "Playable", number: int, actions: "list[NDArray[np.int64]]", label: str
) -> "Episode":
    import socialai_dsl
    from socialai_dsl.cli.episode import record

    env = socialai_dsl.make(scenario, render_mode="rgb_array")
    title = f"{scenario}, test episode {number}, {label}"
    try:
        return record(env, program, actions, title, {"options": {"test_episode": number}}, env.cast)
    finally:
        env.close()


def _figures(result: "EvalResult") -> dict[str, Any]:
    return {
        "episodes": result.episodes,
        "success_rate": result.success_rate,
        "success_rate_se": result.success_rate_se,
        "mean_length": result.mean_length,
        "mean_return": result.mean_return,
        "outcomes": result.outcomes,
    }


def _by_member(program: "Playable", shares: Mapping[str, float]) -> dict[str, Any]:
    """Of a suite: how often each member was played, and how often with success; nothing for a scenario."""
    from socialai_dsl.program_suite import ProgramSuite, prefixed

    if not isinstance(program, ProgramSuite):
        return {}
    successes = {outcome.name for outcome in program.outcome_table if outcome.success}
    members = {}
    for member, own in zip(program.members, program.programs, strict=True):
        names = {prefixed(member, name) for name in own.outcomes}
        share = sum(shares[name] for name in names)
        won = sum(shares[name] for name in names & successes)
        members[member] = {"share": share, "success_rate": won / share if share else None}
    return {"members": members}
