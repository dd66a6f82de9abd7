"""Plays one episode and asks after each step why things went as they did."""

import json
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import socialai_dsl
from socialai_dsl import replay
from socialai_dsl.checking.loaded import about_of
from socialai_dsl.envs.typed import Phrases, split_line
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.episodes import Policy
from socialai_dsl.evaluation.players import Player, make_policy, player_of, require_trainer
from socialai_dsl.evaluation.scripts import with_script
from socialai_dsl.program_suite import outcome_name
from socialai_dsl.replay.endings import endings_of
from socialai_dsl.replay.state import cast_of, changes

Agent = str | Path | Player | Policy | Callable[[Any], Any]
"""What `players.player_of` takes."""


@dataclass
class TraceStep:
    """One step.

    Attributes:
        t: counted from 1. action: the agent's body action. said: its utterance, None if it was silent. heard: lines.
        picture: the room after the step. state: `describe()` after it; where an act has ended, of the next one.
        cast: who is in it. changed: key -> values before and after.
        fired, others: as `explain()` gives them. reward: of this step.
    """

    t: int
    action: str
    said: str | None
    heard: tuple[str, ...]
    picture: str
    state: dict[str, Any]
    cast: tuple[str, ...]
    changed: dict[str, tuple[Any, Any]]
    fired: list[dict[str, Any]]
    others: list[dict[str, Any]]
    reward: float


@dataclass
class Trace:
    """An episode.

    Attributes:
        scenario, agent: who plays what. origin: which episode it is. member: of a suite, which one is played.
        cast: the agent and the NPCs. names: of the cast of everything that may be played.
        picture, state: before the first step.
        length, reward: so far. outcome: how it ended, None while it has not. success: whether that is one.
        steps: of `trace` alone, all of them.
    """

    scenario: str
    agent: str
    origin: str
    member: str | None
    cast: tuple[str, ...]
    names: tuple[str, ...]
    picture: str
    state: dict[str, Any]
    length: int = 0
    reward: float = 0.0
    outcome: str | None = None
    success: bool = False
    steps: list[TraceStep] = field(default_factory=list)


def trace(
    scenario: str,
    agent: Agent | None = None,
    do: Sequence[str] | None = None,
    **episode: Any,
) -> Trace:
    """Play one episode, and say of every step which rules fired and why the others did not.

    Args:
        scenario: a path or a name, with `+variants` and `?parameters`.
        agent: oracle, random, shipped, a checkpoint or run folder, a `Player`, or a policy or function of your own, see
            `evaluate_agent` (default: oracle where there is one, else random).
        do: what the agent does, step by step, as typed in `socialai play`; then no other agent plays.
        episode: which one, as for `reset_of`: `seed`, `index`, `test_episode`, `layout`.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: the agent cannot play this, or there is no such episode.
    """
    reset = reset_of(**episode)
    traced = EpisodeTracer(scenario, agent, do, episode.get("seed") or 0)
    try:
        found = traced.begin(reset)
        found.steps = list(traced.steps(found))
    finally:
        traced.close()
    return found


def reset_of(
    seed: int = 0,
    index: int | None = None,
    test_episode: int | None = None,
    layout: Path | Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The arguments of `env.reset` for an episode.

    Args:
        seed: of the rooms.
        index: which room of the seed, from 0, as `check` and `validate` number them.
        test_episode: a number of the fixed test set, instead of seed and index.
        layout: a room to start from, or a JSON file with one (docs/layouts.md).

    Raises:
        UsageError: these cannot go together, or the file is no JSON.
    """
    options: dict[str, Any] = {}
    if test_episode is not None:
        if index is not None:
            raise UsageError(
                "index: the test set has rooms of its own; leave out the index or the test episode"
            )
        options["test_episode"] = test_episode
    if index is not None:
        options["index"] = index
    if isinstance(layout, Path):
        try:
            options["layout"] = json.loads(layout.read_text(encoding="utf-8"))
        except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
            raise UsageError(f"layout: {layout} is no JSON: {error}") from None
    elif layout is not None:
        options["layout"] = layout
    return {"options": options or None} | ({} if test_episode is not None else {"seed": seed})


class EpisodeTracer:
    """Plays an episode of a scenario.

    Args:
        scenario: a path or a name.
        agent: oracle, random, shipped, or a checkpoint; None: oracle where there is one, else random.
        lines: what the agent does, step by step, as typed in `socialai play`; then there is no other agent.
        seed: of an agent that chooses by chance.

    Raises:
        UsageError: the agent cannot play this.
    """

    def __init__(self, scenario: str, agent: Agent | None, lines: Sequence[str] | None, seed: int) -> None:
        if agent is not None and lines is not None:
            raise UsageError("agent: got one, but `do` says what is done; leave one of them out")
        self._player = None if agent is None else player_of(agent, scenario)
        self.agent = "typed" if self._player is None else self._player.agent
        self._asked, self._lines = scenario, lines
        self._seed = agent.seed if isinstance(agent, Player) else seed
        own = self._player is not None and self._player.policy is not None
        if lines is None and not own and self.agent in ("typed", "oracle"):
            try:
                scenario = with_script(scenario).name
                self.agent = "oracle"
            except UsageError:
                if agent is not None:
                    raise
                self.agent = "random"
        self.scenario = scenario
        self._reset: dict[str, Any] = {}
        self._actions: list[NDArray[np.int64]] = []
        self._env: Any = socialai_dsl.make(scenario, render_mode="ansi")
        self._act = self._actor()

    def begin(self, reset: dict[str, Any]) -> Trace:
        """Start the episode.

        Raises:
            UsageError: there is no such episode, or the layout does not fit.
        """
        env = self._env.unwrapped
        self._reset, self._actions = reset, []
        try:
            self._observation, info = env.reset(**reset)
        except ValueError as error:
            raise UsageError(str(error)) from None
        member, cast = info.get("member"), cast_of(env.playing)
        return Trace(
            *(self.scenario, self.agent, _origin(reset), member, cast, self._names()),
            picture=env.plain_text(),
            state=env.describe(),
        )

    def steps(self, trace: Trace) -> Iterator[TraceStep]:
        """Play on to the end, or as far as there is something typed."""
        env, before = self._env.unwrapped, trace.state
        while trace.outcome is None:
            action = self._act(self._observation)
            if action is None:
                return
            self._actions.append(action)
            self._observation, reward, terminated, truncated, info = env.step(action)
            after, explained = env.describe(), env.explain()
            trace.length += 1
            trace.reward += float(reward)
            if terminated or truncated:
                trace.outcome, trace.success = outcome_name(info), bool(info["success"])
            done = after.get("last", {"action": "none", "said": None})
            yield TraceStep(
                trace.length,
                done["action"],
                None if done["said"] is None else str(done["said"]),
                () if info["utterance"] == "NA" else tuple(info["utterance"].splitlines()),
                env.plain_text(),
                after,
                cast_of(env.playing),
                changes(before, after),
                explained["fired"],
                explained["others"],
                float(reward),
            )
            before = after

    def document(self) -> replay.Trace:
        """What was played so far, in the format of replays: played again, without the script."""
        loaded = socialai_dsl.load(self._asked)
        env: Any = socialai_dsl.make(self._asked)
        try:
            return replay.trace_of(
                env,
                self._actions,
                self._reset,
                scenario=self._asked,
                agent=self.agent,
                episode=_origin(self._reset),
                endings={one.name: one.text for one in endings_of(loaded, env.unwrapped.program)},
                about=about_of(loaded),
            )
        finally:
            env.close()

    def close(self) -> None:
        """Let the environment go."""
        self._env.close()

    def _names(self) -> tuple[str, ...]:
        """The same of everything that may be played."""
        program = self._env.unwrapped.program
        programs = getattr(program, "programs", (program,))
        return tuple(dict.fromkeys(name for one in programs for name in cast_of(one)))

    def _actor(self) -> Callable[[Any], NDArray[np.int64] | None]:
        """What chooses an action for an observation; None at the end of what was typed."""
        env = self._env.unwrapped
        if self._lines is not None:
            typed = iter([self._typed(line) for line in self._lines])
            return lambda observation: next(typed, None)
        own = self._player is not None and self._player.policy is not None
        if self.agent == "oracle" and not own:
            return lambda observation: env.scripted_action()
        if self.agent == "random" and not own:
            generator, sizes = np.random.default_rng(self._seed), env.action_space.nvec
            return lambda observation: generator.integers(0, sizes, dtype=np.int64)
        policy = self._policy()
        policy.reset(np.ones(1, np.bool_))

        def act(observation: Any) -> NDArray[np.int64]:
            actions = np.asarray(policy.act({name: value[None] for name, value in observation.items()}))
            shape = (1, len(env.action_space.nvec))
            if actions.shape != shape:
                raise UsageError(f"agent: got actions of the shape {actions.shape}, expected {shape}")
            chosen: NDArray[np.int64] = actions[0]
            return chosen

        return act

    def _typed(self, line: str) -> NDArray[np.int64]:
        env = self._env.unwrapped
        phrases = Phrases(env.program.actions, env.program.sentences)
        try:
            action: NDArray[np.int64] = env.encode_action(split_line(line.strip(), phrases.actions))
        except ValueError:
            raise UsageError(f"do: {phrases.problem(line.strip())}") from None
        return action

    def _policy(self) -> Any:
        assert self._player is not None, "internal: what nobody named is random or the script"
        if self._player.is_trained:
            require_trainer()
        try:
            policy, told = make_policy(replace(self._player, seed=self._seed), self._env)
        except ValueError as error:
            raise UsageError(f"{self.scenario}: {error}") from error
        for warning in told:
            warnings.warn(warning, stacklevel=2)
        return policy


def _origin(reset: dict[str, Any]) -> str:
    """Which episode it is, in words."""
    options = reset["options"] or {}
    if "test_episode" in options:
        return f"test episode {options['test_episode']}"
    room = f", room {options['index']}" if "index" in options else ""
    return f"seed {reset['seed']}{room}"


def is_among(who: str, names: Sequence[str]) -> bool:
    """Whether a member is named, or its group is."""
    return who in names or who.partition("[")[0] in names
