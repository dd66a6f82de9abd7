"""Test episodes played by a model behind an endpoint: many at once, each kept on disk reply by reply."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import secrets
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, fields, replace
from datetime import UTC, datetime
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Any, Final

import httpx
import numpy as np
from numpy.typing import NDArray

from socialai_dsl.atomic import write_json
from socialai_dsl.checking.briefing import NO_BRIEFING, Briefing
from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.envs import make_vec
from socialai_dsl.envs.asking import Question, probe_names
from socialai_dsl.envs.seats import SCRIPT
from socialai_dsl.episodes.partners import Company
from socialai_dsl.episodes.play import AGENT, EachRoom, Observer, Rooms, Seat, Step, at_once, play_async
from socialai_dsl.episodes.policies import EpisodeOver, Observation, Policy, PolicyDone
from socialai_dsl.episodes.results import Actions
from socialai_dsl.episodes.room_sets import TEST_ROOMS, RoomSet
from socialai_dsl.llm.actions import Action, ToolCall
from socialai_dsl.llm.endpoint import Answer, ContextFull, Endpoint, EndpointError, Usage
from socialai_dsl.llm.episode import (
    CONTEXT,
    CUT_SHORT,
    LEFT,
    Decision,
    EpisodeResult,
    TextSeat,
    Turn,
)
from socialai_dsl.llm.history import left_out
from socialai_dsl.llm.prompting import PromptOptions
from socialai_dsl.llm.questions import AnsweredQuestion, constraints, put
from socialai_dsl.llm.replies import readable
from socialai_dsl.llm.view import TextView
from socialai_dsl.program_suite import Playable

FORMAT: Final = "socialai-transcript/2"
_SETTINGS: Final = "settings.json"
_SESSION: Final = f"{datetime.now(UTC):%Y%m%dT%H%M%SZ}-{secrets.token_hex(3)}"
"""This process, in every reply that it writes down."""
_SHOWN: Final = 4000
"""The most characters of a reply that the model is shown again, the last ones without its thoughts."""

_NO_NAME: Final = re.compile(r"[^a-zA-Z0-9_-]")
_LONGEST_NAME: Final = 64
"""What names of tools are, as OpenAI's interface takes them."""


@dataclass(frozen=True)
class Budget:
    """The limits of tokens and cost; None is no limit.

    Attributes:
        tokens: of prompts and completions. cost: in US dollars.
    """

    tokens: int | None = None
    cost: float | None = None

    def is_spent(self, usage: Usage) -> bool:
        """Whether nothing is left."""
        return (self.tokens is not None and usage.tokens >= self.tokens) or (
            self.cost is not None and (usage.cost or 0.0) >= self.cost
        )


@dataclass(frozen=True)
class PlayedEpisode:
    """A test episode as a model played it to its end.

    Attributes:
        number: of the test episode.
        result: how it went. actions: int64 (heads,) each.
        replies: what the model answered before each action, and after the last one if that ended the episode; each
            with what was wrong with it.
        usage: what its replies took.
        stops: why the server ended replies before their end, `length` and the like, and how often.
        answered: the answers to probes.
    """

    number: int
    result: EpisodeResult
    actions: list[NDArray[np.int64]]
    replies: list[list[tuple[str, str]]]
    usage: Usage
    stops: Mapping[str, int] = field(default_factory=dict)
    answered: Sequence[AnsweredQuestion] = ()


@dataclass(frozen=True)
class PlayedGame:
    """A test episode that was played to its end, with a model on one seat or several.

    Attributes:
        number: of the test episode.
        result: how it went for the rooms' own seat.
        actions: int64 (heads,) each, of several seats (S, heads).
        rules: how often each of the scenario's rules fired.
        others: of each other seat whether the episode was its success, and its return.
        models: the episode of each model, by its seat.
    """

    number: int
    result: EpisodeResult
    actions: list[NDArray[np.int64]]
    rules: Mapping[str, int]
    others: Mapping[Seat, tuple[bool, float]]
    models: Mapping[Seat, PlayedEpisode]


class SettingsMismatchError(ValueError):
    """A folder holds episodes that were played otherwise than is asked for now."""


def transcripts(folder: Path, settings: Mapping[str, Any]) -> Callable[[int], Path]:
    """Where the transcript of each test episode goes; the folder is made. While it holds none, settings may change.

    Args:
        folder: of the episodes of one scenario.
        settings: all that decides what is played and how; the transcripts of a folder have it in common.

    Raises:
        OSError: the folder cannot be made, or read.
        SettingsMismatchError: it holds episodes with other settings.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / _SETTINGS
    content = {"format": FORMAT, "text": TextView.version, **settings}
    if path.exists() and has_transcripts(folder):
        try:
            found = json.loads(path.read_text(encoding="utf-8"))
        except ValueError:
            found = None
        found = found if isinstance(found, dict) else {}
        other = sorted(key for key in {*content, *found} if content.get(key) != found.get(key))
        if other:
            raise SettingsMismatchError(
                f"{folder} holds episodes that were played with another {', '.join(other)}"
            )
    else:
        write_json(path, content)
    return lambda number: _transcript(folder, number)


def has_transcripts(folder: Path) -> bool:
    """Whether a folder holds replies of a model, on any seat."""
    return any(folder.rglob("episode-*.jsonl"))


def _transcript(folder: Path, number: int) -> Path:
    return folder / f"episode-{number:03d}.jsonl"


def _actions_file(folder: Path, number: int) -> Path:
    return folder / f"actions-{number:03d}.json"


@dataclass(frozen=True)
class Kept:
    """Test episodes that a folder of transcripts holds.

    Attributes:
        games: those that are over. own: the seat whose results these are.
        players: who sat on all seats, in a word, where there are several.
    """

    games: list[PlayedGame]
    own: Seat
    players: Mapping[Seat, str]


def kept_games(program: Playable, folder: Path, room_set: RoomSet, most: int) -> Kept:
    """The first episodes that are over, from their transcripts; nobody is asked.

    Args:
        program: of the scenario that was played.
        folder: of the transcripts.
        room_set: the rooms that were played.
        most: how many episodes, at most.

    Raises:
        OSError: a transcript cannot be read.
        SettingsMismatchError: there are none, or they are of another program.
    """
    settings = _settings_of(folder)
    if settings.get("format") != FORMAT:
        raise SettingsMismatchError(f"{folder} holds episodes of another version of this program")
    if settings.get("program_sha256") != program.sha256:
        raise SettingsMismatchError(f"{folder} holds episodes of another version of the scenario")
    own, players = settings.get("seat", AGENT), settings.get("players", {})
    places = {seat: folder if seat == own else folder / seat for seat in players or (AGENT,)}
    models = {
        seat: _kept_model(program, seat, place, room_set)
        for seat, place in places.items()
        if _has_model(place)
    }
    envs = make_vec(
        program, copy=False, autoreset_mode="Disabled", seats="all" if len(players) > 1 else AGENT
    )
    # The agent's script acts like anybody else, those of others by themselves.
    scripts = [seat for seat, word in players.items() if seat != AGENT and word == SCRIPT]
    games = Games(models, own)
    rooms = Rooms(envs, [*models.values(), games], own, scripts)
    policies: dict[Seat, Policy] = {
        seat: models[seat] if seat in models else _KeptActions(folder, number, len(rooms.action_sizes))
        for number, seat in enumerate(rooms.names)
        if seat in rooms.seats
    }
    try:
        at_once(play_async(rooms, policies, EachRoom(most, settings["trials"], rooms=room_set)))
        return Kept(games.played()[:most], own, players)
    finally:
        envs.close()


def _settings_of(folder: Path) -> dict[str, Any]:
    """What holds for all episodes of a folder. Raises SettingsMismatchError where it holds none."""
    try:
        settings: dict[str, Any] = json.loads((folder / _SETTINGS).read_text(encoding="utf-8"))
        return {"trials": 1} | settings  # older ones know of no sessions
    except (FileNotFoundError, ValueError, TypeError):
        raise SettingsMismatchError(f"{folder} holds no transcripts of episodes") from None


def _has_model(folder: Path) -> bool:
    """Whether the transcripts of a model are here."""
    return (folder / _SETTINGS).is_file() and "model" in _settings_of(folder)


def _kept_model(program: Playable, seat: Seat, folder: Path, room_set: RoomSet) -> ModelPolicy:
    """A model that says what it said before. Raises SettingsMismatchError where it is not known how it played."""
    settings = _settings_of(folder)
    try:
        prompting = PromptOptions(**{one.name: settings[one.name] for one in fields(PromptOptions)})
    except (KeyError, TypeError):
        raise SettingsMismatchError(f"{folder} holds no transcripts of episodes") from None
    text = TextSeat(program, **prompting.of_episodes, seat=seat)
    return ModelPolicy(
        text, prompting, partial(_transcript, folder), _nobody, compares=False, room_set=room_set
    )


async def _nobody(conversation: Conversation) -> Answer:
    raise PolicyDone


class LanguageModelPlayer:
    """A model on a seat, in as many rooms at once as are played.

    Every reply is on disk before it is played, so an episode goes on where it was stopped, and nothing is paid for
    twice.

    Args:
        program: of a scenario or suite.
        endpoint: which model is asked, and where.
        prompting: how it plays.
        place: of the transcript of each episode, see `transcripts`.
        loaded: what the program was made of; without it no probes are asked, and nobody is told a name.
        briefing: what the model is told of the task.
        seat: which one.
        budget: when it is spent, no further request is made; what is on the way is waited for.
    """

    def __init__(
        self,
        program: Playable,
        endpoint: Endpoint,
        prompting: PromptOptions,
        place: Callable[[int], Path],
        loaded: Loaded | None = None,
        briefing: Briefing = NO_BRIEFING,
        seat: Seat = AGENT,
        budget: Budget | None = None,
    ) -> None:
        self.endpoint, self.seat = endpoint, seat
        self._program, self._loaded, self._briefing = program, loaded, briefing
        self._prompting = prompting
        self._place = place
        self._budget = budget or Budget()
        self._spent = Usage()
        self._answered = False

    def policy(
        self,
        client: httpx.AsyncClient,
        failures: Sequence[Exception],
        room_set: RoomSet = TEST_ROOMS,
        progress: Callable[[PlayedEpisode], None] | None = None,
    ) -> ModelPolicy:
        """The model in one room.

        Args:
            client: for its requests.
            failures: when there is one, in this room or another, no further request is made.
            room_set: the rooms that are played.
            progress: see `ModelPolicy`.
        """

        async def ask(conversation: Conversation) -> Answer:
            # After a failure the others play what they have asked for, which is paid for, and stop as well.
            if failures:
                raise PolicyDone
            if self._budget.is_spent(self._spent):
                raise EpisodeOver  # a later one may be in its transcript, which costs nothing
            return await self._ask(client, conversation)

        asked = self._loaded is not None and self._prompting.probes != "off" and probe_names(self._loaded)
        text = TextSeat(
            self._program,
            **self._prompting.of_episodes,
            briefing=self._briefing,
            probes=self._loaded if asked else None,
            seat=self.seat,
            loaded=self._loaded,
        )
        return ModelPolicy(text, self._prompting, self._place, ask, progress, room_set=room_set)

    async def _ask(self, client: httpx.AsyncClient, conversation: Conversation) -> Answer:
        """The model's answer; also that the conversation has outgrown its context, which ends the episode."""
        try:
            answer = await self.endpoint.ask(
                client, conversation.messages(), conversation.constraints(), self._answered
            )
        except ContextFull:
            if not (self._answered or conversation.begun):
                raise  # not even the first observation fits: that is a setting, and no episode
            return Answer("", stop="context")
        self._answered = True
        self._spent += answer.usage
        return answer


def play_games(
    models: Sequence[LanguageModelPlayer],
    company: Callable[[], AbstractContextManager[Company]],
    episodes: int,
    trials: int = 1,
    concurrency: int = 1,
    progress: Callable[[PlayedEpisode], None] | None = None,
    keep: Path | None = None,
    room_set: RoomSet = TEST_ROOMS,
) -> list[PlayedGame]:
    """Play test episodes 0 to `episodes - 1`; what models have answered already is read from their transcripts.

    Args:
        models: at least one; all play in each room.
        company: one room with who sits there beside the models.
        episodes: how many.
        trials: how many in a row are one session.
        concurrency: how many are played at once.
        progress: is told of each episode that is over, as the first of the models played it.
        keep: a folder that gets the actions of all seats, where there are several.
        room_set: the rooms; by default the test set.

    Raises:
        EndpointError: an endpoint does not answer. What was played is kept.
        SettingsMismatchError: a transcript is of an episode that goes another way now.
        OSError: a transcript cannot be read or written.
    """
    return asyncio.run(_play(models, company, episodes, trials, concurrency, progress, keep, room_set))


async def _play(
    models: Sequence[LanguageModelPlayer],
    company: Callable[[], AbstractContextManager[Company]],
    episodes: int,
    trials: int,
    concurrency: int,
    progress: Callable[[PlayedEpisode], None] | None,
    keep: Path | None,
    room_set: RoomSet,
) -> list[PlayedGame]:
    sessions = iter(range(0, episodes, trials))
    tables: list[Games] = []
    failures: list[Exception] = []

    async def work(clients: Sequence[httpx.AsyncClient]) -> None:
        policies = {
            model.seat: model.policy(client, failures, room_set, None if number else progress)
            for number, (model, client) in enumerate(zip(models, clients, strict=True))
        }
        with company() as beside:
            games = Games(policies, beside.own, keep)
            tables.append(games)
            rooms = Rooms(beside.envs, [*policies.values(), games], beside.own, beside.scripts)
            playing = {seat: policies.get(seat) or beside.policies[seat] for seat in rooms.seats}
            try:
                await play_async(rooms, playing, EachRoom(episodes, trials, sessions, room_set))
            except (EndpointError, OSError, SettingsMismatchError) as error:
                failures.append(error)

    async with contextlib.AsyncExitStack() as open_ones:
        clients = [await open_ones.enter_async_context(model.endpoint.client()) for model in models]
        async with asyncio.TaskGroup() as group:
            for _ in range(min(concurrency, -(-episodes // trials))):
                group.create_task(work(clients))
    if failures:
        raise failures[0]
    return sorted((game for games in tables for game in games.played()), key=lambda game: game.number)


class Games(Observer):
    """Notes the episodes of one room that are played to their end.

    Args:
        models: of each seat that a model has.
        own: the seat whose results these are.
        keep: a folder that gets the actions of all seats, where there are several.
    """

    def __init__(self, models: Mapping[Seat, ModelPolicy], own: Seat, keep: Path | None = None) -> None:
        self._models, self._own, self._keep = models, own, keep
        self._actions = Actions()
        self._before: Mapping[str, int] = {}
        self._totals: dict[Seat, float] = {}
        self._over: dict[int, PlayedGame] = {}
        for model in models.values():
            model.others = [one for one in models.values() if one is not model]

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """See `Observer.began`."""
        self._before = rooms.env.counters()["rules"]
        self._totals = dict.fromkeys(rooms.names, 0.0)
        self._actions.played[int(rooms.numbers[0])] = []

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        self._actions.stepped(rooms, step)
        for seat in self._totals:
            self._totals[seat] += float(step.of(seat)[0][0])
        if step.ended[0]:
            won = {seat: bool(step.of(seat)[1][0]) for seat in self._totals}
            self._note(rooms, rooms.env.program.outcomes[step.outcome[0]], won)

    def cut(self, rooms: Rooms) -> None:
        """See `Observer.cut`."""
        if any(model.cut_short for model in self._models.values()):
            self._note(rooms, LEFT, dict.fromkeys(self._totals, False))

    def _note(self, rooms: Rooms, ending: str, won: Mapping[Seat, bool]) -> None:
        """Note an episode that is over, as far as it is known without the models."""
        number, own = int(rooms.numbers[0]), self._own
        fired = {
            name: count - self._before.get(name, 0) for name, count in rooms.env.counters()["rules"].items()
        }
        actions = self._actions.played[number]
        result = EpisodeResult(won[own], ending, self._totals[own], len(actions))
        others = {seat: (won[seat], total) for seat, total in self._totals.items() if seat != own}
        self._over[number] = PlayedGame(number, result, actions, fired, others, {})
        if self._keep is not None and len(rooms.names) > 1:
            write_json(_actions_file(self._keep, number), [step.tolist() for step in actions])

    def played(self) -> list[PlayedGame]:
        """The episodes that are over for all models, the first one first."""
        told = {seat: {one.number: one for one in model.played} for seat, model in self._models.items()}
        games = []
        for number, game in sorted(self._over.items()):
            models = {seat: episodes[number] for seat, episodes in told.items() if number in episodes}
            if len(models) == len(told):
                result = models[self._own].result if self._own in models else game.result
                games.append(replace(game, result=result, models=models))
        return games


class _KeptActions:
    """The actions of a seat of one room in games that were kept; behind the last one nothing is done.

    Args:
        folder: of the games.
        number: of the seat.
        heads: of an action.
    """

    def __init__(self, folder: Path, number: int, heads: int) -> None:
        self._folder, self._number = folder, number
        self._nothing = np.zeros((1, heads), np.int64)
        self._left: Iterator[Any] | None = None

    def reset(self, mask: NDArray[np.bool_], episodes: NDArray[np.int64] | None = None) -> None:
        """See `Policy.reset`."""
        assert episodes is not None, "internal: test episodes have numbers"
        path = _actions_file(self._folder, int(episodes[0]))
        self._left = iter(json.loads(path.read_text(encoding="utf-8"))) if path.is_file() else None

    def act(self, observation: Observation) -> NDArray[np.int64]:
        """See `Policy.act`."""
        if self._left is None:
            raise PolicyDone
        actions = next(self._left, None)
        return self._nothing if actions is None else np.array(actions[self._number], np.int64)[None]


class ModelPolicy(Observer):
    """A language model on a seat of one room, which observes that room as well.

    Every reply is on disk before it is played. What a transcript holds already is played without asking.

    Args:
        seat: writes what is seen, and reads what is replied.
        prompting: how the model plays.
        place: of the transcript of each episode, see `transcripts`.
        ask: the model's answer to a conversation; raises EpisodeOver to leave that episode as it is, and PolicyDone to
            leave all that are left.
        progress: is told of each episode that is over.
        compares: whether what a transcript holds must be about what is seen now.
        room_set: the rooms that are played.

    Attributes:
        played: these episodes.
        others: the models on other seats.
    """

    def __init__(
        self,
        seat: TextSeat,
        prompting: PromptOptions,
        place: Callable[[int], Path],
        ask: Callable[[Conversation], Awaitable[Answer]],
        progress: Callable[[PlayedEpisode], None] | None = None,
        compares: bool = True,
        room_set: RoomSet = TEST_ROOMS,
    ) -> None:
        self._compares, self._room_set = compares, room_set
        self._seat, self._prompting, self._place, self._ask = seat, prompting, place, ask
        self._progress = progress
        self._rooms: Rooms
        self._conversation: Conversation
        self._decision = Decision(None)
        self.played: list[PlayedEpisode] = []
        self.others: Sequence[ModelPolicy] = ()

    def reset(self, mask: NDArray[np.bool_], episodes: NDArray[np.int64] | None = None) -> None:
        """See `Policy.reset`; `began` knows which trials begin a session."""

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """See `Observer.began`."""
        number = int(rooms.numbers[0])
        before = self._conversation if number % self._prompting.trials else None
        path = self._place(number)
        text = self._seat.begin(rooms, **self._room_set.reset(number))
        self._rooms = rooms
        self._conversation = Conversation(self._seat, self._prompting, number, path, text, before)

    async def act(self, observation: Observation) -> NDArray[np.int64]:
        """See `Policy.act`."""
        while not self._seat.result().ending:
            decision = await self._next()
            if decision is not None and decision.action is not None:
                self._decision = decision
                return self._rooms.encoded(decision.action)[None]
        raise EpisodeOver

    @property
    def cut_short(self) -> bool:
        """Whether the model has ended the episode without a step."""
        return self._seat.result().ending in CUT_SHORT

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        self._conversation.saw(self._seat.saw(rooms, self._decision, step))

    async def leave(self) -> None:
        """Answer what is asked after the last step, and note the episode; see `Leaving`."""
        with contextlib.suppress(EpisodeOver):
            if not self._seat.result().ending and any(other.cut_short for other in self.others):
                self._seat.end(LEFT)
            while self._seat.question is not None:
                await self._next()
            if self._seat.result().ending:
                self._note()

    async def _next(self) -> Decision | None:
        """Read the next record of the transcript, or the model's next answer."""
        record = self._conversation.stored()
        if record is None:
            record = self._conversation.write(await self._ask(self._conversation))
        elif self._compares and record["observation"] != self._conversation.text:
            raise SettingsMismatchError(
                f"{self._place(int(self._rooms.numbers[0]))} tells of an episode that goes another way now, as another "
                "player acts otherwise"
            )
        return self._conversation.take(record)

    def _note(self) -> None:
        self.played.append(self._conversation.played())
        if self._progress is not None:
            self._progress(self.played[-1])


class Conversation:
    """An episode's transcript, and the messages that a model is sent.

    Args:
        seat: where an episode has begun.
        prompting: how the model plays.
        number: of the test episode.
        path: of the transcript, a line of JSON for each reply; None: the caller keeps what `record` returns.
        text: what is seen at the start.
        before: that of the trial before in the same session, which this one goes on with.

    Raises:
        OSError: the transcript cannot be read.
    """

    def __init__(
        self,
        seat: TextSeat,
        prompting: PromptOptions,
        number: int,
        path: Path | None,
        text: str,
        before: Conversation | None = None,
    ) -> None:
        self._seat = seat
        self._prompting = prompting
        self._number = number
        self._path = path
        self._usage = Usage()
        self._stops: Counter[str] = Counter()
        closing = "" if before is None else f"{before.closing}\n\n"
        self._text = f"{closing}{prompting.heading(number % prompting.trials)}{text}"
        self._exchanges: list[list[Mapping[str, Any]]] = [] if before is None else [*before.exchanges]
        self._replies: list[list[tuple[str, str]]] = [[]]
        self._records = iter(()) if path is None else _records(path)
        self._last: tuple[str, str, list[ToolCall]] = "", "", []
        self._is_full = self._appends = False

    def stored(self) -> dict[str, Any] | None:
        """The next record that the transcript holds already; None if there is none."""
        return next(self._records, None)

    @property
    def text(self) -> str:
        """What the model is shown now."""
        return self._text

    @property
    def exchanges(self) -> Sequence[list[Mapping[str, Any]]]:
        """What was said, observation by observation, earlier trials included."""
        return self._exchanges

    @property
    def closing(self) -> str:
        """What the model is told at the end, to which no reply is asked for."""
        return f"{self._text}\nThe episode is over, without success." if self._is_full else self._text

    @property
    def begun(self) -> bool:
        """Whether a reply was played."""
        return bool(self._exchanges)

    def messages(self) -> list[Mapping[str, Any]]:
        """The instructions, the exchanges so far, and what is seen now, perhaps with the question of a probe."""
        question = self._seat.question
        text = self._text if question is None else f"{self._text}\n\n{self._put(question)}"
        earlier = [str(exchange[0]["content"]) for exchange in self._exchanges]
        count, told = left_out(earlier, self._prompting.history)
        shown = [
            *(message for exchange in self._exchanges[count:] for message in exchange),
            {"role": "user", "content": text},
        ]
        first = {**shown[0], "content": f"{told}{shown[0]['content']}"}
        instructions = self._prompting.told(self._seat.instructions)
        return [{"role": "system", "content": instructions}, first, *shown[1:]]

    def constraints(self) -> dict[str, Any]:
        """The constraints of a request on the form of the reply."""
        if self._seat.question is not None:
            return constraints(self._seat.question, self._prompting.mode, self._prompting.grammar)
        language = self._seat.language
        if self._prompting.mode == "tools":
            return {"tools": language.tools()}
        if self._prompting.mode == "json":
            schema = {"name": "action", "strict": True, "schema": language.json_schema()}
            return {"response_format": {"type": "json_schema", "json_schema": schema}}
        return {"grammar": language.gbnf()} if self._prompting.grammar else {}

    def record(self, answer: Answer) -> dict[str, Any]:
        """What a transcript has of an answer."""
        question = self._seat.question
        record: dict[str, Any] = {"observation": self._text, "reply": answer.text}
        if question is not None:
            record |= {"probe": question.probe, "question": self._put(question), "right": question.right}
        elif self._prompting.mode == "tools":
            record["calls"] = [[call.name, call.arguments] for call in answer.calls]
        notes = {"reasoning": answer.reasoning, "stop": answer.stop, "finish_reason": answer.reason}
        record |= {key: note for key, note in notes.items() if note}
        usage = answer.usage
        record |= {"prompt_tokens": usage.prompt, "completion_tokens": usage.completion, "cost": usage.cost}
        record |= {"reasoning_tokens": usage.reasoning} if usage.reasoning else {}
        record |= {"estimated": True} if usage.estimated else {}
        return record | {"session": _SESSION, "time": datetime.now(UTC).isoformat(timespec="milliseconds")}

    def write(self, answer: Answer) -> dict[str, Any]:
        """Write an answer down; the record that stands in the transcript."""
        assert self._path is not None, "internal: there is a transcript"
        record = self.record(answer)
        if not self._appends:  # before the first one, as reading changes nothing
            self._path.parent.mkdir(parents=True, exist_ok=True)
            _mend(self._path)
            self._appends = True
        with open(self._path, "a", encoding="utf-8") as file:
            file.write(json.dumps(record, ensure_ascii=False) + "\n")
            file.flush()
            os.fsync(file.fileno())
        return record

    def played(self) -> PlayedEpisode:
        """The episode, which is over."""
        return PlayedEpisode(
            self._number,
            self._seat.result(),
            list(self._seat.actions),
            [replies for replies in self._replies if replies],
            self._usage,
            dict(self._stops),
            tuple(self._seat.answered),
        )

    def take(self, record: Mapping[str, Any]) -> Decision | None:
        """What a record comes to; None of one that answers a probe, or says that no more fits the model's context."""
        self._usage += Usage(
            record["prompt_tokens"],
            record["completion_tokens"],
            record["cost"],
            record.get("estimated", False),
            record.get("reasoning_tokens", 0),
        )
        stop = record.get("stop", "")
        self._stops.update([stop] if stop else [])
        if "probe" in record and self._seat.question is None:
            return None  # nobody asks now: the episode is played again from its transcript
        if self._seat.question is not None:
            if self._prompting.probes == "kept":
                put = {"role": "user", "content": self._put(self._seat.question)}
                self._exchanges.append(
                    [put, {"role": "assistant", "content": _shown(record["reply"]) or "(nothing)"}]
                )
            self._seat.answer(record["reply"])
            return None
        if stop == "context":
            self._seat.end(CONTEXT)
            self._is_full = True
            self._replies[-1].append(("", CUT_SHORT[CONTEXT]))
            return None
        calls = [ToolCall(*call) for call in record.get("calls", ())]
        # Who answers in words where tools are asked for may name the action there.
        decision = self._seat.read(calls or record["reply"], stop)
        written = "\n".join([record["reply"], *(f"{call.name}({call.arguments})" for call in calls)])
        self._last = _shown(record["reply"]), written.strip(), calls
        if decision.turn is not None:
            self.saw(decision.turn)
        return decision

    def did(self, action: Action) -> None:
        """Take it that somebody else has chosen on the seat: the model is shown that as a reply of its own."""
        self._last = self._seat.language.write(action), "", []

    def saw(self, turn: Turn) -> None:
        """Remember what came of the reply that was read last."""
        shown, written, calls = self._last
        self._exchanges.append(_exchange(self._text, shown, calls, turn))
        self._text = turn.text
        self._replies[-1].append((written, turn.error))
        if turn.action is not None:
            self._replies.append([])

    def _put(self, question: Question) -> str:
        return put(question, self._prompting.mode)


def _shown(reply: str) -> str:
    """What a model is shown of its own reply."""
    return readable(reply, "Act").strip()[-_SHOWN:]


def _exchange(text: str, reply: str, calls: list[ToolCall], turn: Turn) -> list[Mapping[str, Any]]:
    """An observation and its reply as messages; a tool that was called has to be answered."""
    asked = {"role": "user", "content": text}
    if not calls:
        return [asked, {"role": "assistant", "content": reply or "(nothing)"}]
    named = [
        {"id": f"call{n}", "type": "function", "function": _repeated(call)} for n, call in enumerate(calls)
    ]
    told = "not understood" if turn.error else "done"
    answers = [{"role": "tool", "tool_call_id": call["id"], "content": told} for call in named]
    return [asked, {"role": "assistant", "content": reply or None, "tool_calls": named}, *answers]


def _repeated(call: ToolCall) -> dict[str, str]:
    """A call as a message has it: servers refuse a conversation with other names, or arguments that are no object."""
    try:
        fits = len(call.arguments) <= _SHOWN and isinstance(json.loads(call.arguments), dict)
    except (ValueError, RecursionError):
        fits = False
    name = _NO_NAME.sub("_", call.name)[:_LONGEST_NAME] or "_"
    return {"name": name, "arguments": call.arguments if fits else "{}"}


def _records(path: Path) -> Iterator[dict[str, Any]]:
    """The replies of a transcript, up to a line that was cut off."""
    return (json.loads(line) for line in _whole_lines(path))


def _whole_lines(path: Path) -> list[bytes]:
    """The lines of a transcript, up to one that was cut off."""
    try:
        lines = path.read_bytes().split(b"\n")[:-1]
    except FileNotFoundError:
        return []
    return list(takewhile(_is_json, lines))


def _is_json(line: bytes) -> bool:
    try:
        json.loads(line)
    except ValueError:
        return False
    return True


def _mend(path: Path) -> None:
    """Move what follows a line that was cut off to a file beside the transcript."""
    kept = sum(len(line) + 1 for line in _whole_lines(path))
    if path.exists() and path.stat().st_size > kept:
        with open(path, "r+b") as file, open(path.with_suffix(".cut"), "ab") as rest:
            file.seek(kept)
            rest.write(file.read() + b"\n")
            file.truncate(kept)
