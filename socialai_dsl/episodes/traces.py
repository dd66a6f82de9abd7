"""Traces of played episodes: every step with the rules that fired, and why the others did not."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain, repeat
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import about_of
from socialai_dsl.diagnostics import suggested
from socialai_dsl.envs.factory import compiled, make_loaded
from socialai_dsl.envs.options import origin, reset_arguments
from socialai_dsl.envs.seats import SCRIPT
from socialai_dsl.episodes.partners import (
    acts_of_others,
    by_seat,
    own_seat,
    partners_of,
    require_seat,
    seating,
    sitting,
)
from socialai_dsl.episodes.play import AGENT, Observer, OneEpisode, Rooms, Seat, Step, play
from socialai_dsl.episodes.players import Agent, Player, make_policy, player_of, require_trainer
from socialai_dsl.episodes.policies import Observation, Policy, ReplayedPolicy
from socialai_dsl.episodes.results import Actions
from socialai_dsl.episodes.scripts import script_of, with_frame_of
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.frontend import load
from socialai_dsl.program_suite import has_script, seats_of
from socialai_dsl.semantics.typed import Phrases
from socialai_dsl.traces.document import Outcome, Thought, Trace
from socialai_dsl.traces.endings import endings_of
from socialai_dsl.traces.state import cast_of
from socialai_dsl.traces.tracing import Action, Answers, Tracer

Think = Callable[[Mapping[str, NDArray[Any]]], Thought | None]
"""What an agent makes of an observation; asked in each moment before a step, in order."""


class Tracing(Observer):
    """Traces what happens in one room.

    Args:
        tracer: gets every moment.
        title: which episode it is, in words.
        think: what the agent makes of an observation.
        replies: what language models answered before each action.

    Attributes:
        thought: what the agent made of the moment before the next step, where `think` does not say.
    """

    def __init__(
        self, tracer: Tracer, title: str = "", think: Think | None = None, replies: Iterable[Answers] = ()
    ) -> None:
        self.tracer, self.title = tracer, title
        self.thought: Thought | None = None
        self.replies = chain(replies, repeat(()))
        self._think = think
        self._seen: dict[str, NDArray[Any]] = {}

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """See `Observer.began`."""
        self._seen = _alone(rooms.observations[rooms.own])
        self.tracer.begin(self.title, self._seen, rooms.info)

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        thought = self.thought if self._think is None else self._think(self._seen)
        self._seen = _alone(rooms.observations[rooms.own])
        self.tracer.step(
            step.actions[rooms.own][0],
            self._seen,
            float(step.reward[0]),
            bool(step.ended[0]),
            False,
            step.info,
            thought=thought,
            replies=next(self.replies),
        )
        self.thought = None

    def back(self, rooms: Rooms) -> None:
        """See `Observer.back`."""
        self.tracer.back()
        self._seen = _alone(rooms.observations[rooms.own])


def thought_of(policy: Policy) -> Thought | None:
    """What a policy made of its last observation; None of one that does not say."""
    thought = getattr(policy, "thought", None)
    if thought is None:
        return None
    probabilities, value = thought()
    return Thought(
        probabilities=[[round(share, 4) for share in head] for head in probabilities], value=round(value, 4)
    )


def trace_of(
    env: Any,
    actions: Iterable[Action],
    reset: Mapping[str, Any],
    *,
    scenario: str,
    agent: str,
    episode: str,
    endings: Mapping[str, str] | None = None,
    about: str = "",
    think: Think | None = None,
    replies: Sequence[Answers] = (),
    cut_short: Outcome | None = None,
    players: Mapping[Seat, str] = MappingProxyType({}),
) -> Trace:
    """Play an episode with given actions, and trace it.

    Episodes replay exactly, so a seed or a test episode and the actions are a complete record of one.

    Args:
        env: of the scenario, as `socialai_dsl.make` returns it; made with `seats` all of them are traced.
        actions: int64 (heads,) each; those after the end of the episode are ignored.
        reset: arguments of `env.reset`, such as `{"seed": 7}`.
        scenario: its name, for people.
        agent: the player, for people.
        episode: which episode it is, for people.
        endings: the text to show for each outcome; by default its name.
        about: a sentence about the scenario.
        think: returns the `Thought` of a trained agent about an observation; called in each moment before a step, in
            order.
        replies: of language models, for each action what they answered before it, and perhaps one more entry after the
            last action.
        cut_short: the outcome of an episode that no step ended.
        players: who has the other seats, for people.

    Raises:
        ValueError: there is no such episode, or an action is outside the space.
    """
    tracing = Tracing(Tracer(env, scenario, agent, endings or {}, about, players), episode, think, replies)
    rooms = Rooms(env, [tracing])
    play(rooms, {rooms.own: ReplayedPolicy(actions)}, OneEpisode(reset))
    if cut_short is not None and rooms.running.any():
        tracing.tracer.cut_short(next(tracing.replies), cut_short)
    return tracing.tracer.trace().portable()


def _alone(observation: Observation) -> dict[str, NDArray[Any]]:
    """The observation of the one room."""
    return {name: value[0] for name, value in observation.items()}


def trace(
    scenario: str,
    agent: Agent | None = None,
    do: Sequence[str] | None = None,
    seats: Mapping[Seat, str] = MappingProxyType({}),
    **episode: Any,
) -> Trace:
    """Play one episode, and say of every step which rules fired and why the others did not.

    Args:
        scenario: a path or a name, with `+variants` and `?parameters`.
        agent: oracle, random, shipped, a checkpoint or run folder, a `Player`, or a policy or function of your own, see
            `evaluate` (default: oracle where there is one, else random).
        do: what the agent does, step by step, as typed in `socialai play`; then no other agent plays.
        seats: who has other seats: `script`, `random`, `nobody` or a trained agent; the agent has the first that is
            left.
        episode: which one, as for `reset_of`: `seed`, `index`, `test_episode`, `layout`.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: the agent cannot play this, or there is no such episode.
    """
    reset = reset_of(**episode)
    played = TracedEpisode(scenario, agent, do, episode.get("seed") or 0, list(seats.items()))
    try:
        played.play(reset)
        return played.document()
    finally:
        played.close()


def reset_of(
    seed: int = 0,
    index: int | None = None,
    test_episode: int | None = None,
    layout: Path | Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The arguments of `env.reset` for an episode, see `reset_arguments`.

    Raises:
        UsageError: these cannot go together, or the file is no JSON.
    """
    try:
        return reset_arguments(seed, index, test_episode, layout)
    except ValueError as error:
        raise UsageError(str(error)) from None


class TracedEpisode:
    """An episode of a scenario that is played in order to be looked at.

    Args:
        scenario: a path or a name.
        agent: see `trace`.
        lines: what the agent does, step by step, as typed in `socialai play`; then there is no other agent.
        seed: of an agent that chooses by chance.
        seats: who has other seats, see `partners_of`.

    Attributes:
        scenario: as it is played, with the script if that plays. agent: who plays. players: who has the other seats.

    Raises:
        UsageError: the agent cannot play this.
    """

    def __init__(
        self,
        scenario: str,
        agent: Agent | None,
        lines: Sequence[str] | None,
        seed: int,
        seats: Sequence[tuple[Seat, str]] = (),
    ) -> None:
        if agent is not None and lines is not None:
            raise UsageError("agent: got one, but `do` says what is done; leave one of them out")
        self._asked, self._loaded = scenario, load(scenario)
        program = compiled(self._loaded)
        partners = partners_of(seats, scenario, program)
        own = own_seat(partners, program)
        if lines is not None:
            player = Player("typed")
        elif agent is not None:
            player = player_of(agent, scenario)
        elif own == AGENT:
            player = Player("random" if script_of(scenario) is None else "oracle")
        else:
            player = Player("oracle" if has_script(program, own) else "random")
        if (
            player.is_script and own != AGENT
        ):  # it plays by itself, beside the one who was named for the agent
            player, own = partners.pop(AGENT), AGENT
        require_seat(player, own)
        if player.follows_frame:
            scenario = with_frame_of(player, scenario).name
        loaded, filled = seating(partners, scenario, load(scenario))
        # Of several seats all are traced, also where scripts play by themselves.
        self._seats = filled or ({} if len(seats_of(program)) > 1 else None)
        self.players = sitting(program, partners, own)
        self.scenario, self.agent = scenario, player.agent
        self._env: Any = make_loaded(loaded, "ansi", self._seats)
        drawn = agent.seed if isinstance(agent, Player) else seed
        self._policy = self._typed(lines) if lines is not None else self._made(replace(player, seed=drawn))
        self._reset: dict[str, Any] = {}
        self._actions = Actions()
        self._others = _OfOthers()

    def play(
        self,
        reset: dict[str, Any],
        observers: Sequence[Observer] = (),
        stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Play an episode to its end, or as far as there is something typed, or until it is to `stop`.

        Raises:
            UsageError: there is no such episode, or the layout does not fit, or the agent's actions do not.
        """
        self._reset, self._actions, self._others = reset, Actions(), _OfOthers()
        rooms = Rooms(self._env, [self._actions, self._others, *observers])
        try:
            play(rooms, {rooms.own: self._policy}, OneEpisode(reset), stop)
        except ValueError as error:
            raise UsageError(str(error)) from error

    def require_names(self, asked: Iterable[str]) -> None:
        """See that these are members of the cast, or groups of it, `world` or `outcome`.

        Raises:
            OptionError: one of them is not.
        """
        program = self._env.program
        programs = getattr(program, "programs", (program,))
        cast = dict.fromkeys(name for one in programs for name in cast_of(one))
        known, groups = [*cast, "world", "outcome"], {name.partition("[")[0] for name in cast}
        for name in asked:
            if name not in known and name not in groups:
                hint = suggested(name, known, f"; expected one of {', '.join(known)}", repr)
                raise OptionError("why", f"got {name!r}{hint}")

    def origin(self) -> str:
        """Which episode it is, in words."""
        return origin(self._reset)

    def document(self) -> Trace:
        """What was played so far, as a trace: played again, without the script."""
        loaded, seats = self._loaded, self._seats
        if seats is not None:
            others = by_seat(self._others.played)
            seats = {seat: ReplayedPolicy(actions) for seat, actions in others.items()}
            # Whose script plays by itself does so again.
            seats |= {seat: SCRIPT for seat in self.players if seat not in others}
        env: Any = make_loaded(loaded, seats=seats)
        try:
            return trace_of(
                env,
                self._actions.played.get(0, ()),
                self._reset,
                scenario=self._asked,
                agent=self.agent,
                episode=self.origin(),
                endings={one.name: one.text for one in endings_of(loaded, env.unwrapped.program)},
                about=about_of(loaded),
                players=self.players,
            )
        finally:
            env.close()

    def close(self) -> None:
        """Close the environment."""
        self._env.close()

    def _typed(self, lines: Sequence[str]) -> Policy:
        phrases = Phrases(self._env.program.actions, self._env.program.sentences)
        actions = []
        for line in lines:
            try:
                actions.append(self._env.encode_action(phrases.act(line.strip())))
            except ValueError:
                raise UsageError(f"do: {phrases.problem(line.strip())}") from None
        return ReplayedPolicy(actions)

    def _made(self, player: Player) -> Policy:
        if player.is_trained:
            require_trainer()
        try:
            policy, told = make_policy(player, self._env)
        except ValueError as error:
            raise UsageError(f"{self.scenario}: {error}") from error
        for warning in told:
            warnings.warn(warning, stacklevel=2)
        return policy


class _OfOthers(Observer):
    """Keeps what those on other seats have done in each step."""

    def __init__(self) -> None:
        self.played: list[dict[Seat, NDArray[np.int64]]] = []

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        self.played.append(acts_of_others(rooms.env))
