"""Any scenario, or a list of them, as a task of Inspect AI, which brings models, logs, limits and a viewer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from math import nan
from typing import Any, Final, get_args

from inspect_ai import Task, task
from inspect_ai.dataset import MemoryDataset, Sample
from inspect_ai.scorer import (
    Metric,
    SampleScore,
    Score,
    Scorer,
    Target,
    grouped,
    mean,
    metric,
    scorer,
    stderr,
)
from inspect_ai.solver import Generate, Solver, TaskState, solver

from socialai_dsl.checking.briefing import Briefing, Tell, brief
from socialai_dsl.checking.loaded import LoadedSuite
from socialai_dsl.envs.asking import probe_names
from socialai_dsl.episodes.partners import Beside, beside
from socialai_dsl.episodes.room_sets import RoomSet
from socialai_dsl.frontend import load_experiment
from socialai_dsl.llm.actions import Mode
from socialai_dsl.llm.episode import CUT_SHORT, Episode, OnInvalid
from socialai_dsl.llm.history import WHOLE, left_out
from socialai_dsl.llm.inspect_session import EPISODES, PROBES, Session
from socialai_dsl.llm.prompting import Probing, PromptOptions
from socialai_dsl.llm.view import Style, TextView
from socialai_dsl.loader.reader import shipped_experiments
from socialai_dsl.schema.scenario import TEST_SET
from socialai_dsl.traces.endings import endings_of

PUBLISHED: Final = "minds"
"""The experiment whose scenarios `suite` has unless others are named."""


@task
def scenario(
    scenario: str = "talkitout",
    episodes: int = 50,
    style: Style = "prose",
    mode: Mode = "text",
    history: int | None = WHOLE,
    on_invalid: OnInvalid = "noop",
    probes: Probing = "apart",
    trials: int | None = None,
    seed: int | None = None,
    tell: Tell | None = None,
    goal: str = "",
    language: str | None = None,
    seats: Mapping[str, str] | None = None,
) -> Task:
    """Episodes of a scenario, a sample each.

    Args:
        scenario: a path or a name, with +variants and ?parameters.
        episodes: how many; the common test set has 500.
        style: how observations are written, see `TextView`.
        mode: how actions are given, see `ActionLanguage`; `json` also sends a response schema, `tools` the tools.
        history: how many observations the model is shown, the present one included; None: the whole episode.
        on_invalid: what a reply without an action does, see `Episode`.
        probes: whether the scenario's probes are asked: `apart` from play, `kept` in later requests, or `off`.
        trials: how many episodes are one sample and one conversation, in which the model is told how each ended; None:
            those of a session of the scenario.
        seed: of the first episode's room, further ones of those that follow; None: test episodes from 0 on.
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
    prompting = PromptOptions(style, mode, on_invalid, history, probes=probes)
    game = _game(scenario, prompting, seats or {}, tell, goal, language)
    return _task(scenario, [game], prompting, episodes, trials, seed, game.about())


@task
def suite(
    scenarios: str | Sequence[str] | None = None,
    episodes: int = 20,
    style: Style = "prose",
    mode: Mode = "text",
    history: int | None = WHOLE,
    on_invalid: OnInvalid = "noop",
    probes: Probing = "apart",
    trials: int | None = None,
    seed: int | None = None,
    tell: Tell | None = None,
) -> Task:
    """Episodes of each of several scenarios, a sample each; figures for each scenario as well.

    Args:
        scenarios: paths or names; None: those of the experiment `minds`, in which every kind of mind plays.
        episodes: how many of each.
        style: see `scenario`, as of all that follow.
        mode: how actions are given.
        history: how many observations the model is shown.
        on_invalid: what a reply without an action does.
        probes: whether they are asked.
        trials: how many episodes are one sample; None: those of a session of each scenario.
        seed: of the first episode's room; None: test episodes.
        tell: what the model is told of the task; None: the instructions of those scenarios that have some.

    Raises:
        ScenarioError: a scenario does not exist, or has mistakes.
        ValueError: an argument is not what was expected.
    """
    if scenarios is None:
        cells = load_experiment(shipped_experiments()[PUBLISHED]).cells[None]
        scenarios = [cell.scenario for cell in cells]
    names = [scenarios] if isinstance(scenarios, str) else list(dict.fromkeys(scenarios))
    if not names:
        raise ValueError("scenarios: got none, expected at least one")
    prompting = PromptOptions(style, mode, on_invalid, history, probes=probes)
    games = [_game(name, prompting, {}, tell) for name in names]
    about = {"text": TextView.version, "scenarios": {game.scenario: game.about() for game in games}}
    return _task("suite", games, prompting, episodes, trials, seed, about)


@dataclass(frozen=True, eq=False)
class _Game:
    """A scenario as the model plays it."""

    scenario: str
    played: Beside
    briefing: Briefing
    prompting: PromptOptions
    seats: Mapping[str, str]

    def episode(self) -> Episode:
        """An environment of its own."""
        loaded = self.played.loaded
        return Episode(
            self.played.program,
            **self.prompting.of_episodes,
            briefing=self.briefing,
            probes=loaded if self.probes() else None,
            seats=self.played.seats(),
            loaded=loaded,
        )

    def probes(self) -> tuple[str, ...]:
        """The probes that are asked."""
        return () if self.prompting.probes == "off" else probe_names(self.played.loaded)

    def endings(self) -> dict[str, str]:
        """How episodes end, in the words of the scenario's file."""
        found = endings_of(self.played.loaded, self.played.program)
        return CUT_SHORT | {ending.name: ending.text for ending in found}

    def about(self) -> dict[str, Any]:
        """What logs say of it."""
        found = {
            "scenario": self.scenario,
            "program_sha256": self.played.program.sha256,
            "text": TextView.version,
        }
        found |= self.briefing.record()
        return found | ({"seats": dict(self.seats)} if self.seats else {})

    def sample(
        self,
        episode: Episode,
        name: str | int,
        rooms: Sequence[Mapping[str, int]],
        endings: Mapping[str, str],
        probes: Sequence[str],
    ) -> Sample:
        """The sample of these rooms, with what is known of it before, and what the scorer has to know."""
        text = episode.reset(**rooms[0])
        loaded, member = self.played.loaded, episode.member
        of_suite: Sequence[str] = ()
        if isinstance(loaded, LoadedSuite):
            of_suite = loaded.suite.skills
            loaded = loaded.members[loaded.member_names.index(member or "")]
        return Sample(
            id=name,
            input=text,
            target="success",
            metadata={
                "scenario": self.scenario,
                **rooms[0],
                "rooms": list(rooms),
                "member": member,
                "horizon": loaded.checked.horizon,
                "skills": list(loaded.scenario.skills or of_suite),
                "cast": [entity.key for entity in loaded.checked.entities if entity.role != "object"],
                "seat": episode.seat,
                "endings": dict(endings),
                "probes": list(probes),
            },
        )


def _game(
    scenario: str,
    prompting: PromptOptions,
    seats: Mapping[str, str],
    tell: Tell | None = None,
    goal: str = "",
    language: str | None = None,
) -> _Game:
    played = beside(list(seats.items()), scenario)
    return _Game(scenario, played, brief(played.loaded, tell, goal, language), prompting, seats)


def _task(
    name: str,
    games: Sequence[_Game],
    prompting: PromptOptions,
    episodes: int,
    trials: int | None,
    seed: int | None,
    about: dict[str, Any],
) -> Task:
    """The task that plays these games."""
    for option, given, least in (("episodes", episodes, 1), ("trials", trials, 1), ("seed", seed, 0)):
        if given is not None and given < least:
            raise ValueError(f"{option}: got {given}, expected at least {least}")
    if seed is None and episodes > TEST_SET:
        raise ValueError(f"episodes: got {episodes}, expected at most the {TEST_SET} of the test set")
    if prompting.probes not in get_args(Probing):
        raise ValueError(f"probes: got {prompting.probes!r}, expected one of {', '.join(get_args(Probing))}")
    left_out((), prompting.history)  # a limit that is none is told before anything is played
    rooms = [{"test_episode": n} if seed is None else {"seed": seed + n} for n in range(episodes)]
    probes = list(dict.fromkeys(probe for game in games for probe in game.probes()))
    samples = []
    for game in games:
        endings, in_a_row = game.endings(), trials or game.played.program.session
        if episodes % in_a_row:
            raise ValueError(f"episodes: got {episodes}, expected a multiple of the {in_a_row} trials")
        if seed is not None:
            RoomSet.of_seed(seed).check(game.played.program)
        with closing(game.episode()) as episode:
            for number in range(0, episodes, in_a_row):
                called = number if len(games) == 1 else f"{game.scenario} {number}"
                of_sample = rooms[number : number + in_a_row]
                samples.append(game.sample(episode, called, of_sample, endings, probes))
    by_name = {game.scenario: game for game in games}
    return Task(
        dataset=MemoryDataset(samples, name=name),
        solver=player(lambda scenario: by_name[scenario].episode(), prompting),
        scorer=outcome(),
        version=TextView.version,
        metadata=about,
    )


@solver
def player(episode: Callable[[str], Episode], prompting: PromptOptions) -> Solver:
    """Lets the model play the episodes of a sample to their ends.

    Args:
        episode: gives an `Episode` of a scenario.
        prompting: how the model plays.
    """

    async def solve(state: TaskState, generate: Generate) -> TaskState:
        with closing(episode(state.metadata["scenario"])) as playing:
            rooms = state.metadata["rooms"]
            session = Session(state, playing, replace(prompting, trials=len(rooms)))
            for trial, room in enumerate(rooms):
                await session.play(trial, room)
        return state

    return solve


@metric
def by_skill() -> Metric:
    """The mean over the samples that need a skill, for each skill."""

    def compute(scores: list[SampleScore]) -> Any:
        needed: dict[str, list[SampleScore]] = {}
        for score in scores:
            for skill in (score.sample_metadata or {}).get("skills", ()):
                needed.setdefault(skill, []).append(score)
        return {skill: mean()(those) for skill, those in sorted(needed.items())}

    return compute


@scorer(
    metrics={
        "*": [mean(), stderr()],
        "success": [grouped(mean(), "scenario", all=False), by_skill()],
        "probe *": [grouped(mean(), "scenario", all=False)],
    }
)
def outcome() -> Scorer:
    """How the episodes of a sample went: success, return and steps, and the shares of replies without an action.

    Such replies count as `invalid_rate`, or as `stopped_rate` where the server ended them. `trial N` is the success of
    one of several episodes. `probe NAME` is the share of right answers, and `chance NAME` that of guessing. The answer
    is how the episodes ended, in the words of the scenario's file. All of it is in a log, which can be scored again.
    """

    async def score(state: TaskState, target: Target) -> Score:
        played: list[dict[str, Any]] = state.store.get(EPISODES) or []
        asked: list[dict[str, Any]] = state.store.get(PROBES) or []
        trials = len(state.metadata["rooms"])
        replies = max(sum(one["replies"] for one in played), 1)
        value: dict[str, float] = {
            "success": sum(one["success"] for one in played) / trials,
            "return": sum(one["total"] for one in played) / trials,
            "steps": sum(one["steps"] for one in played) / trials,
            "invalid_rate": sum(one["invalid"] for one in played) / replies,
            "stopped_rate": sum(one["stopped"] for one in played) / replies,
        }
        if trials > 1:
            successes = [*(float(one["success"]) for one in played), *[0.0] * trials][:trials]
            value |= {f"trial {number}": success for number, success in enumerate(successes, 1)}
        for probe in state.metadata["probes"]:
            about = [one for one in asked if one["probe"] == probe]
            for name, key in (("probe", "right"), ("chance", "chance")):
                # Inspect leaves out what is not a number: this sample says nothing of the probe.
                value[f"{name} {probe}"] = sum(one[key] for one in about) / len(about) if about else nan
        words = state.metadata["endings"]
        answer = "; ".join(words.get(one["ending"], "stopped") for one in played)
        return Score(value=value, answer=answer, metadata={"episodes": played, "probes": asked})

    return score
