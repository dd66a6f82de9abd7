"""Lets a language model play test episodes, and says what came of it."""

import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from importlib.util import find_spec
from itertools import zip_longest
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.envs.asking import Asker, probe_names
from socialai_dsl.episodes.partners import company, sitting
from socialai_dsl.episodes.play import AGENT, Seat
from socialai_dsl.episodes.players import Player
from socialai_dsl.episodes.results import EvalResult
from socialai_dsl.episodes.room_sets import TEST_ROOMS, RoomSet
from socialai_dsl.errors import RunFailed, UsageError
from socialai_dsl.llm.episode import CUT_SHORT
from socialai_dsl.llm.prompting import PromptOptions
from socialai_dsl.llm.questions import score
from socialai_dsl.program_suite import Playable
from socialai_dsl.runs.folder import scenario_folder_name
from socialai_dsl.traces.endings import Ending
from socialai_dsl.traces.tracing import Answers

if TYPE_CHECKING:  # these need httpx, which is only there if it was asked for
    from socialai_dsl.llm.players import LanguageModelPlayer, PlayedEpisode, PlayedGame

TRANSCRIPTS: Final = "transcripts"
_SECONDS_BETWEEN_LINES: Final = 5.0


@dataclass(frozen=True)
class ModelEpisodes:
    """The results of test episodes that models have played.

    Attributes:
        result: as for all agents.
        actions: of each episode, int64 (heads,) each, of several seats (S, heads).
        replies: what the models answered before each of them.
        endings: further ways in which episodes ended. figures: further ones.
        own: the seat whose results these are. players: who sat on all seats, if there are several.
    """

    result: EvalResult
    actions: dict[int, list[NDArray[np.int64]]]
    replies: dict[int, list[Answers]]
    endings: list[Ending]
    figures: dict[str, Any]
    own: Seat = AGENT
    players: Mapping[Seat, str] = field(default_factory=dict)


def let_models_play(
    players: Mapping[Seat, Player],
    own: Seat,
    scenario: str,
    loaded: Loaded,
    program: Playable,
    episodes: int,
    out: Path,
    trials: int = 1,
    room_set: RoomSet = TEST_ROOMS,
) -> ModelEpisodes:
    """Let players, models among them, play test episodes 0 to `episodes - 1`; answers in transcripts are not asked for.

    Args:
        players: of each seat.
        own: the seat whose results these are.
        scenario: as it was asked for.
        loaded: what its file means.
        program: its program.
        episodes: how many.
        out: gets `SCENARIO/transcripts`.
        trials: how many episodes in a row are one conversation.
        room_set: the rooms that are played; the test set by default.

    Raises:
        UsageError: an endpoint does not answer, or an option is not what was expected.
        RunFailed: a budget is spent before the end.
    """
    if find_spec("httpx") is None:
        raise UsageError("language models need httpx: pip install 'socialai-dsl[llm]'")
    from socialai_dsl.llm.endpoint import EndpointError
    from socialai_dsl.llm.players import SettingsMismatchError, has_transcripts, play_games, transcripts
    from socialai_dsl.llm.view import TextView

    folder = out / scenario_folder_name(scenario) / TRANSCRIPTS
    seated = {seat: player for seat, player in players.items() if player.is_model}
    first = own if own in seated else next(iter(seated))
    options = seated[first].options
    assert options is not None, "internal: a language model has options"
    words = _words(players, program) if len(players) > 1 else {}
    about: dict[str, Any] = {"scenario": scenario, "program_sha256": program.sha256, "trials": trials}
    about |= {"seat": own, "players": words} if words else {}
    about |= {} if room_set.is_test_set else {"rooms": room_set.name}
    progress = _Progress(episodes)
    try:
        if own not in seated:
            transcripts(folder, about | {"seed": players[own].seed, "greedy": players[own].greedy})
        models = [
            _model(seated[seat], seat, folder if seat == own else folder / seat, loaded, program, about)
            for seat in sorted(seated, key=lambda seat: seat != first)
        ]
        played = play_games(
            models,
            lambda: company(players, own, scenario, loaded, program, 1),
            episodes,
            trials,
            options.concurrency,
            progress.note,
            folder,
            room_set,
        )
    except SettingsMismatchError as error:
        raise UsageError(f"--out: {error}; choose another folder") from None
    except EndpointError as error:
        kept = f". Replies so far are kept in {folder} and not asked for again"
        raise UsageError(f"{error}{kept if has_transcripts(folder) else ''}") from None
    if len(played) < episodes:
        raise RunFailed(
            f"the budget is spent: {len(played)} of {episodes} episodes are over; the same command goes on with "
            f"another {options.budget}"
        )
    probed = {"text": TextView.version}
    if own in seated and options.probes != "off":
        probed |= _probes([game.models[own] for game in played], probe_names(loaded))
    return replace(_outcome(played, program, own, probed), players=words)


def _words(players: Mapping[Seat, Player], program: Playable) -> dict[Seat, str]:
    """Who has each seat, in a word."""
    beside = sitting(program, players, "")
    return {seat: player.agent if player.is_model else beside[seat] for seat, player in players.items()}


def _model(
    player: Player, seat: Seat, folder: Path, loaded: Loaded, program: Playable, about: Mapping[str, Any]
) -> "LanguageModelPlayer":
    """A model on a seat, whose transcripts are in a folder of their own.

    Raises:
        UsageError, SettingsMismatchError: see `let_models_play`.
    """
    from socialai_dsl.llm.asked import budget_of, endpoint_of
    from socialai_dsl.llm.players import LanguageModelPlayer, transcripts

    options = player.options
    assert options is not None, "internal: a language model has options"
    endpoint, briefing = endpoint_of(player.agent, options), player.briefing(loaded)
    asked: dict[str, Any] = {
        field.name: getattr(options, field.name, about["trials"]) for field in fields(PromptOptions)
    }
    prompting = PromptOptions(**asked)
    probed = prompting.probes != "off" and probe_names(loaded)
    settings = {
        **about,
        "model": endpoint.model,
        "address": endpoint.address,
        **briefing.record(),
        **vars(prompting),
        **endpoint.options,
        "probes": f"{prompting.probes} {Asker(loaded).sha256}" if probed else None,
    }
    place = transcripts(folder, settings)
    budget = budget_of(options.budget, endpoint.prices)
    return LanguageModelPlayer(program, endpoint, prompting, place, loaded, briefing, seat, budget)


def episodes_of_models(run: Path, program: Playable, room_set: RoomSet, most: int) -> ModelEpisodes:
    """The results of the first episodes with models, from their transcripts in the folder `run`.

    Raises:
        UsageError: there are none of this program.
    """
    from socialai_dsl.llm.players import SettingsMismatchError, kept_games

    try:
        kept = kept_games(program, run / TRANSCRIPTS, room_set, most)
    except SettingsMismatchError as error:
        raise UsageError(str(error)) from None
    if not kept.games:
        raise UsageError(f"{run}: no episode is over")
    return replace(_outcome(kept.games, program, kept.own), players=kept.players)


def _outcome(
    played: "Sequence[PlayedGame]",
    program: Playable,
    own: Seat,
    more: Mapping[str, Any] = MappingProxyType({}),
) -> ModelEpisodes:
    results = [game.result for game in played]
    cut_short = [name for name in CUT_SHORT if any(result.ending == name for result in results)]
    names = [*program.outcomes, *cut_short]
    rules = {name: sum(game.rules.get(name, 0) for game in played) / len(played) for name in played[0].rules}
    others = {
        seat: (
            np.array([game.others[seat][0] for game in played]),
            np.array([game.others[seat][1] for game in played]),
        )
        for seat in played[0].others
    }
    result = EvalResult(
        np.array([result.success for result in results]),
        np.array([names.index(result.ending) for result in results]),
        np.array([result.steps for result in results]),
        np.array([result.total for result in results]),
        tuple(names),
        rules,
        others,
    )
    endings = [Ending(name, False, CUT_SHORT[name]) for name in cut_short]
    figures = {seat: _figures([game.models[seat] for game in played]) for seat in played[0].models}
    beside = {seat: one for seat, one in figures.items() if seat != own}
    return ModelEpisodes(
        result,
        {game.number: game.actions for game in played},
        {game.number: _answers(game, own) for game in played},
        endings,
        figures.get(own, {}) | ({"models": beside} if beside else {}) | dict(more),
        own,
    )


def _answers(game: "PlayedGame", own: Seat) -> list[Answers]:
    """What the models answered before each action; on which seat, unless the player in question alone is one."""
    alone = set(game.models) == {own}
    of_seats = [
        [[(text, error, None if alone else seat) for text, error in told] for told in episode.replies]
        for seat, episode in game.models.items()
    ]
    return [[one for told in step for one in told] for step in zip_longest(*of_seats, fillvalue=[])]


def _figures(played: "Sequence[PlayedEpisode]") -> dict[str, Any]:
    """What counts for language models alone."""
    from socialai_dsl.llm.endpoint import Usage

    usage = sum((episode.usage for episode in played), Usage())
    replies = sum(episode.result.replies for episode in played)
    invalid = sum(episode.result.invalid for episode in played)
    stops = sum((Counter(episode.stops) for episode in played), Counter[str]())
    return {
        "replies": replies,
        "invalid_replies": invalid,
        "invalid_rate": invalid / max(replies, 1),
        "stopped_replies": sum(episode.result.stopped for episode in played),
        "stops": dict(sorted(stops.items())),
        "prompt_tokens": usage.prompt,
        "completion_tokens": usage.completion,
        "reasoning_tokens": usage.reasoning,
        "tokens_estimated": usage.estimated,
        "cost": usage.cost,
    }


def _probes(played: "Sequence[PlayedEpisode]", names: Sequence[str]) -> dict[str, Any]:
    """How each probe was answered; nothing if the scenario has none, or they were not asked."""
    answered = [one for episode in played for one in episode.answered]
    scores = {name: score(one for one in answered if one.question.probe == name) for name in names}
    return {"probes": {name: vars(found) for name, found in scores.items()}} if names else {}


class _Progress:
    """Says on standard error now and then how far it is, and what it has cost."""

    def __init__(self, episodes: int) -> None:
        self._episodes = episodes
        self._played: list[PlayedEpisode] = []
        self._last = self._begun = time.monotonic()

    def note(self, episode: "PlayedEpisode") -> None:
        """Note an episode that is over."""
        self._played.append(episode)
        now, done = time.monotonic(), len(self._played)
        if now - self._last < _SECONDS_BETWEEN_LINES:
            return
        self._last = now
        figures = _figures(self._played)
        cost = f", ${figures['cost']:.4f}" if figures["cost"] is not None else ""
        tokens = figures["prompt_tokens"] + figures["completion_tokens"]
        left = (now - self._begun) / done * (self._episodes - done)
        print(
            f"{done} of {self._episodes} episodes, {sum(one.result.success for one in self._played)} successes, "
            f"{figures['invalid_rate']:.1%} invalid replies, {tokens:,} tokens{cost}, {left:.0f} s left",
            file=sys.stderr,
            flush=True,
        )
