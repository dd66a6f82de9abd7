"""Makes environments from names, paths and programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Never

from gymnasium.vector import AutoresetMode

from socialai_dsl.checking.loaded import Loaded, LoadedSuite
from socialai_dsl.compilation import compile_loaded, scenarios_of
from socialai_dsl.envs.options import UnknownOptionError, refuse_unknown
from socialai_dsl.envs.scenario_env import ScenarioEnv
from socialai_dsl.envs.seats import Seating
from socialai_dsl.envs.starts import check_starts
from socialai_dsl.envs.vector_env import ScenarioVectorEnv
from socialai_dsl.frontend import load
from socialai_dsl.program_suite import Playable, ProgramSuite

if TYPE_CHECKING:
    from socialai_dsl.envs.parallel_env import ScenarioParallelEnv

Scenario = str | Path | Playable


def playable_of(scenario: Scenario) -> Playable:
    """The program of a scenario, or the programs of a suite, given by name or path, or itself."""
    return load_playable(scenario)[0]


def load_playable(scenario: Scenario) -> tuple[Playable, Loaded | None]:
    """The program of a scenario, and what it was made of; None for what is a program already."""
    if isinstance(scenario, Playable):
        return scenario, None
    loaded = load(scenario)
    return compiled(loaded), loaded


def compiled(loaded: Loaded) -> Playable:
    """The program of a scenario, or the programs of a suite, whose layouts fit.

    Raises:
        ScenarioError: a layout of the suite does not.
    """
    playable = compile_loaded(loaded)
    if isinstance(loaded, LoadedSuite) and isinstance(playable, ProgramSuite):
        check_starts(loaded, playable)
    return playable


def make(
    scenario: Scenario,
    render_mode: str | None = None,
    seats: Mapping[str, Any] | None = None,
    **unknown: Never,
) -> ScenarioEnv:
    """One environment of a scenario or suite: `make("talkitout+unsocial")`, `make("my/scenario.yaml")`.

    Args:
        scenario: a shipped name or the path of a file, with variants (`+unsocial`) and parameters (`?n=2`); or what
            `compile` returned.
        render_mode: see `ScenarioEnv`.
        seats: who fills the seats of other members of the cast: `{"helper": "random"}`; see `ScenarioVectorEnv`.
        **unknown: there are no other options; one is refused by its name.

    Raises:
        ScenarioError: the scenario does not exist or has mistakes; `.diagnostics` lists them all.
        ValueError: an argument is not what was expected, or there is no such option.
    """
    _refuse_unknown("make", unknown, ("scenario", "render_mode", "seats"))
    _check_scenario(scenario)
    if isinstance(scenario, Playable):
        return ScenarioEnv(scenario, render_mode, seats=seats)
    return make_loaded(load(scenario), render_mode, seats)


def make_loaded(
    loaded: Loaded, render_mode: str | None = None, seats: Mapping[str, Any] | None = None
) -> ScenarioEnv:
    """`make` of a scenario or suite that is loaded already."""
    return ScenarioEnv(compiled(loaded), render_mode, scenarios_of(loaded), seats)


def make_parallel(
    scenario: Scenario, render_mode: str | None = None, **unknown: Never
) -> ScenarioParallelEnv:
    """One game with several seats as a parallel environment of PettingZoo: `make_parallel("together/help")`.

    Args:
        scenario: as for `make`, but no suite.
        render_mode: see `ScenarioEnv`.
        **unknown: there are no other options; one is refused by its name.

    Raises:
        ModuleNotFoundError: PettingZoo is not installed; the extra `pettingzoo` brings it.
        ScenarioError: the scenario does not exist or has mistakes.
        ValueError: an argument is not what was expected, or there is no such option.
    """
    _refuse_unknown("make_parallel", unknown, ("scenario", "render_mode"))
    _check_scenario(scenario)
    try:
        from socialai_dsl.envs.parallel_env import ScenarioParallelEnv
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{error}: make_parallel needs pip install 'socialai-dsl[pettingzoo]'"
        ) from error
    return ScenarioParallelEnv(playable_of(scenario), render_mode)  # type: ignore[arg-type]


def make_vec(
    scenario: Scenario | Sequence[Scenario],
    num_envs: int = 1,
    num_threads: int = 1,
    autoreset_mode: str | AutoresetMode = "NextStep",
    copy: bool = True,
    render_mode: str | None = None,
    seats: Seating = "agent",
    **unknown: Never,
) -> ScenarioVectorEnv:
    """A batch of environments: one scenario or suite, or several in turn.

    Args:
        scenario: as for `make`, or a sequence of such; environment i plays number i modulo their number.
        num_envs: E, at least 1.
        num_threads: 1; to use more cores run more processes.
        autoreset_mode: `NextStep`, `SameStep` or `Disabled`.
        copy: False returns the engine's own buffers, valid until the next call.
        render_mode: `rgb_array`, `ansi` or None.
        seats: `agent`; `all`, a row for each seat of each of the E games; or who fills other seats, such as
            `{"helper": "random"}`; see `ScenarioVectorEnv`.
        **unknown: there are no other options; one is refused by its name.

    Raises:
        ScenarioError: a scenario does not exist or has mistakes.
        ValueError: an argument is not what was expected, or there is no such option.
    """
    _refuse_unknown("make_vec", unknown, _OPTIONS_OF_BATCHES)
    is_one = isinstance(scenario, str | bytes | Path | Playable) or not isinstance(scenario, Sequence)
    names: list[Any] = [scenario] if is_one else list(scenario)  # type: ignore[arg-type]
    for name in names:
        _check_scenario(name)
    made = {name: playable_of(name) for name in dict.fromkeys(names)}
    return ScenarioVectorEnv(
        [made[name] for name in names], num_envs, num_threads, autoreset_mode, copy, render_mode, seats
    )


_OPTIONS_OF_BATCHES = (
    *("scenario", "num_envs", "num_threads", "autoreset_mode", "copy", "render_mode", "seats"),
)


def make_env(scenario: Scenario, render_mode: str | None = None, **unknown: Any) -> ScenarioEnv:
    """Gymnasium's entry point for a single environment."""
    try:
        return make(scenario, render_mode, **unknown)
    except UnknownOptionError as error:
        # Whoever tries options, as TorchRL does, looks for Python's own words.
        raise UnknownOptionError(f"{error} (unexpected keyword argument {next(iter(unknown))!r})") from None


def make_vector_env(scenario: Scenario, num_envs: int = 1, **options: Any) -> ScenarioVectorEnv:
    """Gymnasium's entry point for a vector environment."""
    if "max_episode_steps" in options:
        raise ValueError(
            f"max_episode_steps: got {options['max_episode_steps']!r}, but in a batch an episode lasts as long as its "
            "scenario says; expected no such option, or vectorization_mode='sync' beside it"
        )
    return make_vec(scenario, num_envs, **options)


def _check_scenario(scenario: Any) -> None:
    if not isinstance(scenario, str | Path | Playable):
        raise ValueError(f"scenario: got {scenario!r}; expected a name, a path, or what `compile` returns")


def _refuse_unknown(call: str, unknown: Mapping[str, Any], known: Sequence[str]) -> None:
    """What looks like an option may be meant as a parameter of the scenario."""
    first = next(iter(unknown.items()), ("", ""))
    named = f"; a parameter of a scenario is part of its name: 'NAME?{first[0]}={first[1]}'"
    refuse_unknown(call, unknown, known, named)
