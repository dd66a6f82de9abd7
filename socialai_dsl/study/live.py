"""A study that goes on: what pages ask for becomes events, which are stored, and then what is shown."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from markdown_it import MarkdownIt

from socialai_dsl.checking.studies import (
    PRACTICE,
    LoadedStudy,
    block_name,
    is_model,
    persons_of,
    players_of,
    stand_ins_of,
)
from socialai_dsl.envs.seats import NOBODY, SCRIPT
from socialai_dsl.episodes.play import Seat
from socialai_dsl.errors import UsageError
from socialai_dsl.schema.study import PERSON, Question
from socialai_dsl.study.arena import Action, Arena, Episode
from socialai_dsl.study.log import FILE, Event, Log, read_log
from socialai_dsl.study.messages import Act, Answers, Beat, Decline, Go, Screen, parsed
from socialai_dsl.study.players import Players
from socialai_dsl.study.progress import Game, Participant, Progress, done_on
from socialai_dsl.study.replay import Row, header_of, reset_of, study_file, tell_of

if TYPE_CHECKING:  # it needs httpx, which is only there if language models were asked for
    from socialai_dsl.study.models import Thinking

MOST_LINES: Final = 200
"""How many of the last lines that were heard a page shows."""
_BURST: Final = 60
_PER_SECOND: Final = 20
"""Messages that a page may send: at once, and in each second."""
_DROPPED: Final = 3600
"""Seconds without a sign of somebody who has not come to the end, after which another one may take part instead."""


@dataclass(eq=False)
class _Due:
    """A screen, and whether all that led to it is stored."""

    screen: Screen
    stored: bool = False


@dataclass(eq=False)
class Page:
    """An open page of a participant.

    Attributes:
        person: whose. send: takes what is to be shown. leave: closes the connection with a code and words.
        connection: which of the participant's it is, from 1. sign: when it was last heard.
        knows: the game of which it has been told what can be done and said.
        elsewhere: whether it is a page of somebody else, which keeps data of its own.
    """

    person: str
    send: Callable[[Screen], None]
    leave: Callable[[int, str], None]
    connection: int
    sign: float
    knows: str | None = None
    elsewhere: bool = False
    _tokens: float = _BURST
    _due: deque[_Due] = field(default_factory=deque)

    def may_speak(self, now: float) -> bool:
        """Whether it has not sent too much; counts one more message."""
        self._tokens = min(_BURST, self._tokens + (now - self.sign) * _PER_SECOND)
        self.sign = now
        self._tokens -= 1
        return self._tokens >= 0

    def will_show(self, screen: Screen) -> _Due:
        """A screen that is shown behind those before it, once `show` is told that it may be."""
        self._due.append(_Due(screen))
        return self._due[-1]

    def show(self, due: _Due) -> None:
        """Show a screen, as soon as those before it are."""
        due.stored = True
        while self._due and self._due[0].stored:
            self.send(self._due.popleft().screen)

    def show_at_once(self, screen: Screen) -> None:
        """Show a screen in place of those that have not been shown, of which nothing is true any more."""
        self._due.clear()
        self.send(screen)


@dataclass(frozen=True)
class Choice:
    """What a participant does in the next step, and when they were shown the picture and acted."""

    action: Action
    connection: int
    shown: float
    acted: float
    movement: str | None
    said: str | None


@dataclass
class Running:
    """A game as it is played now.

    Attributes:
        episode: the present one. chosen: of each seat of a person who has chosen. since: when the first one did.
        late: whether the others are not waited for any more in this step. thinking: the language models, if some play.
        ready: participants who want to go on after the end of an episode. ended: when it ended.
    """

    episode: Episode
    chosen: dict[Seat, Choice] = field(default_factory=dict)
    since: float | None = None
    late: bool = False
    thinking: Thinking | None = None
    ready: set[str] = field(default_factory=set)
    ended: float | None = None


TAKEN: Final = 4409
FAST: Final = 4429


class Live:
    """A study with all its participants.

    Args:
        loaded: the study. folder: holds its log and everything else that is stored; it is there.
        clock: seconds that never go back.
        simulated: whether those who take part are simulated, which the log says.

    Attributes:
        progress: where everybody is.
        pages: id of a participant -> the page that is open.

    Raises:
        OSError: the folder cannot be written.
        UsageError: it holds another study, or this one as it was before a scenario or the file was changed.
    """

    def __init__(
        self,
        loaded: LoadedStudy,
        folder: Path,
        clock: Callable[[], float] = time.monotonic,
        simulated: bool = False,
    ) -> None:
        self._simulated = simulated
        self._loaded, self._study, self._clock = loaded, loaded.study, clock
        self._file = folder / FILE
        self.arenas = {
            number: Arena(one, tell_of(loaded, number), loaded.study.language)
            for number, one in loaded.played.items()
        }
        self.pages: dict[str, Page] = {}
        self._running: dict[str, Running] = {}
        self._waiting: dict[int, dict[str, float]] = {}
        self._markdown = MarkdownIt("commonmark", {"html": False, "breaks": False})
        self.progress = Progress(loaded)
        self._players = Players(loaded, self.arenas)
        self._watched = {
            number
            for number, block in enumerate(self._study.blocks)
            if len(persons_of(block)) > 1 or any(map(is_model, players_of(block).values()))
        }
        self._began = clock()
        self._left: dict[str, float] = {}  # when a page was closed that this server had
        known = self._read() if self._file.exists() and self._file.stat().st_size else 0
        self._log = Log(self._file)
        if not known:
            place = study_file(loaded, folder)
            self._do("study", **self._header(), file=place, **({"simulated": True} if simulated else {}))
        self._do("server")
        self._mend()

    def _read(self) -> int:
        """Be where the log says; how many events it has."""
        self.progress, count = Progress(self._loaded), 0
        for event in read_log(self._file):
            if event["event"] == "study":
                self._check(event)
            if "spent" in event:
                self._players.spent_before(event["spent"])
            self.progress.apply(event)
            count += 1
        return count

    def _mend(self) -> None:
        """Begin what was to begin when the server died."""
        for game in self.progress.games.values():
            if game.episode is None:
                self._next_episode(game)

    def _header(self) -> dict[str, Any]:
        return header_of(self._loaded, self.arenas)

    def _check(self, event: Event) -> None:
        """See that the log is of this study as it is now. Raises UsageError."""
        own = self._header()
        if event["study"] != own["study"]:
            raise UsageError(f"{self._file}: holds the study {event['study']!r}, expected {own['study']!r}")
        if bool(event.get("simulated")) != self._simulated:
            was = "a rehearsal" if event.get("simulated") else "what people have done"
            raise UsageError(f"{self._file}: holds {was}, and simulated participants stay apart from people")
        names = {block_name(self._loaded, number): one.name for number, one in self._loaded.played.items()}
        was = event["programs"]
        changed = {names[block] for block, sha in own["programs"].items() if was.get(block) != sha}
        if changed:
            raise UsageError(
                f"{self._file}: was begun with another version of {', '.join(sorted(changed))}; what people have "
                "played and what they would play must not differ. Take the change back, or begin a new study with --out"
            )
        if event["digest"] != own["digest"]:
            raise UsageError(
                f"{self._file}: was begun with another text of {self._loaded.resolved.path.name} or of its pages. Take "
                "the change back, or begin a new study with --out"
            )

    # -- events -----------------------------------------------------------------------------------------------

    def _do(self, kind: str, **more: Any) -> Event:
        """Let something happen: it is applied at once, and shown once it is stored."""
        event = self._log.add(kind, **more)
        self.progress.apply(event)
        return event

    async def _show(self, people: Iterable[str]) -> None:
        """Show people where they are once everything that led there is stored."""
        pages = [self.pages[person] for person in dict.fromkeys(people) if person in self.pages]
        screens = [(page, page.will_show(self.screen(page))) for page in pages]
        try:
            await self._log.flushed()
        except OSError:
            self._forget()
            for page in tuple(self.pages.values()):
                page.show_at_once({**self.screen(page), "notice": "disk"})
            return
        for page, due in screens:
            page.show(due)

    def _forget(self) -> None:
        """Be where the disk says, after something could not be stored."""
        for running in self._running.values():
            if running.thinking is not None:
                running.thinking.stop()
        self._running.clear()
        self._waiting.clear()
        self._read()
        for page in self.pages.values():
            page.knows = None
        self._mend()
        for person in self.progress.people.values():
            self._enter(person)

    async def close(self) -> None:
        """Store what is left, and let the log go."""
        for running in self._running.values():
            if running.thinking is not None:
                running.thinking.stop()
        await self._players.close()
        with suppress(OSError):
            await self._log.flushed()
        self._log.close()

    # -- who comes and goes -----------------------------------------------------------------------------------

    async def join(self) -> str:
        """A new participant, by id.

        Raises:
            OSError: that cannot be stored.
        """
        number = len(self.progress.people) + 1
        person = f"p{number:04d}"
        self._do("joined", participant=person, number=number)
        try:
            await self._log.flushed()
        except OSError:
            self._forget()
            raise
        return person

    def agree(self, person: str, at: str, simulated: bool) -> bool:
        """Take it that a participant has agreed on a page of somebody else; whether they take part.

        Args:
            person: who it is; whoever was asked before is not asked again.
            at: the origin of that page.
            simulated: whether it says that nobody sits there.
        """
        one = self.progress.people[person]
        if self.progress.stage(one)[0] == "consent":
            if self.full():
                return False
            group = self.progress.next_group(self._dropped())
            self._do("agreed", participant=person, group=group, at=at, simulated=simulated)
        return True

    async def come(
        self,
        person: str,
        send: Callable[[Screen], None],
        leave: Callable[[int, str], None],
        elsewhere: bool = False,
    ) -> Page:
        """Let a participant's page take part; one that was open before is closed."""
        former = self.pages.get(person)
        if former is not None:
            former.leave(TAKEN, "")
        connection = self.progress.people[person].connections + 1
        page = self.pages[person] = Page(person, send, leave, connection, self._clock(), elsewhere=elsewhere)
        self._do("came", participant=person, connection=connection)
        self._enter(self.progress.people[person])
        await self._show([person])
        return page

    def go(self, page: Page) -> None:
        """Let a page go, which was closed."""
        if self.pages.get(page.person) is page:
            del self.pages[page.person]
            self._left[page.person] = self._clock()
            self._do("left", participant=page.person, connection=page.connection)

    def full(self) -> bool:
        """Whether nobody else can take part, unless somebody drops out."""
        return self.progress.full(self._dropped())

    def _dropped(self) -> set[str]:
        """Those who have not come to the end, and whose page has not been heard for an hour."""
        return {
            person.id
            for person in self.progress.people.values()
            if person.ended is None and not self._heard_lately(person.id)
        }

    def _heard_lately(self, person: str) -> bool:
        page = self.pages.get(person)
        heard = page.sign if page is not None else self._left.get(person, self._began)
        return self._clock() - heard < _DROPPED

    def is_there(self, person: str, away: float) -> bool:
        """Whether a participant has an open page that was heard in the last so many seconds."""
        page = self.pages.get(person)
        if page is None:
            return self._clock() - self._began < away  # after a new start pages come back by themselves
        return self._clock() - page.sign < away

    # -- what pages ask for -----------------------------------------------------------------------------------

    async def hear(self, page: Page, content: str | bytes) -> None:
        """Take a message of a page."""
        if self.pages.get(page.person) is not page:
            return
        if not page.may_speak(self._clock()):
            page.leave(FAST, "")
            return
        message = parsed(content)
        if isinstance(message, Beat):
            return
        person = self.progress.people[page.person]
        others: Iterable[str] = ()
        if message is not None and message.on == self._on(person):
            others = self._taken(person, page, message)
        await self._show([person.id, *others])

    def _taken(self, person: Participant, page: Page, message: Go | Decline | Act | Answers) -> Iterable[str]:
        """Do what a message asks for if the screen has it; who else sees something new."""
        stage, _ = self.progress.stage(person)
        match message, stage:
            case Go(), "consent" if not self.full():
                self._do("agreed", participant=person.id, group=self.progress.next_group(self._dropped()))
                self._enter(person)
            case Decline(), "consent":
                self._do("declined", participant=person.id)
            case Go(), "page":
                self._do("read", participant=person.id)
                self._enter(person)
            case Answers(), "asked":
                answers = self._answered(person, message)
                if answers is not None:
                    self._do("answered", participant=person.id, answers=answers)
                    self._enter(person)
            case Act(), "play" if person.game is not None:
                return self._act(person, page, message)
            case Go(), "play" if person.game is not None:
                return self._ready(person)
        return ()

    def _answered(self, person: Participant, message: Answers) -> dict[str, str | int] | None:
        """Answers that fit the questions; None if some do not."""
        asked = {question.id: question for question in self._questions(person)}
        if set(message.answers) - set(asked):
            return None
        for name, question in asked.items():
            answer = message.answers.get(name)
            if answer is None or answer == "":
                if not question.optional:
                    return None
            elif not _fits(question, answer):
                return None
        return {name: answer for name, answer in message.answers.items() if answer != ""}

    def _questions(self, person: Participant) -> tuple[Question, ...]:
        _, block = self.progress.stage(person)
        return self._study.questions if block == PRACTICE else self._study.blocks[block].questions

    # -- games ------------------------------------------------------------------------------------------------

    def _enter(self, person: Participant) -> None:
        """Let a participant begin what comes now: a game for one begins at once, for several they wait."""
        stage, block = self.progress.stage(person)
        if stage != "play" or person.game is not None:
            return
        if block == PRACTICE or len(persons_of(self._study.blocks[block])) == 1:
            self._begin(block, [person.id])
        elif person.id in self.pages:
            self._waiting.setdefault(block, {}).setdefault(person.id, self._clock())

    def _begin(self, block: int, people: list[str]) -> Game:
        number = len(self.progress.games) + 1
        seats = self.progress.seating(block, people)
        self._do("game", game=f"g{number}", block=block, seats=seats)
        game = self.progress.games[f"g{number}"]
        self._next_episode(game)
        return game

    def _next_episode(self, game: Game) -> None:
        number = len(game.results)
        self._drop(game)
        self._do("episode", game=game.id, number=number, room=self.progress.rooms(game)[number])
        self._running_of(game)

    def _drop(self, game: Game) -> None:
        """Give back what a game was played in."""
        running = self._running.pop(game.id, None)
        if running is None:
            return
        self.arenas[game.block].give(running.episode.env)
        self._players.give(game.block, running.episode)
        if running.thinking is not None:
            running.thinking.stop()

    def _running_of(self, game: Game) -> Running:
        """A game as it is played now; after a new start it is played again as far as it was."""
        found = self._running.get(game.id)
        if found is None:
            arena, played = self.arenas[game.block], game.episode
            assert played is not None, "internal: a game begins with an episode"
            env = arena.take()
            thinking = self._players.thinking(game.block)
            watching = () if thinking is None else tuple(thinking.seats.values())
            episode = Episode(
                arena,
                self._players.agents(game.block, env),
                reset_of(game.block, played.room),
                env,
                watching,
                f"{game.id} {played.number}",
            )
            for step in played.steps:
                if thinking is not None:
                    thinking.again(step.get("replies", {}), step.get("missed", {}))
                episode.step(step["acts"])
            found = self._running[game.id] = Running(episode, thinking=thinking)
            if episode.ending is not None and played.ended is None:  # the server died in between
                self._end(game, found)
        return found

    def _act(self, person: Participant, page: Page, message: Act) -> Iterable[str]:
        game = self.progress.games[person.game or ""]
        running = self._running_of(game)
        seat = self.progress.seat_of(game, person.id)
        if running.episode.ending is not None or seat in running.chosen:
            return ()
        try:
            action = self.arenas[game.block].action(running.episode.rooms, message.movement, message.said)
        except ValueError:
            return ()
        running.chosen[seat] = Choice(
            action, page.connection, message.shown, message.acted, message.movement, message.said
        )
        return self._advance(game)

    def _persons(self, game: Game) -> dict[Seat, str]:
        """The participants who have a seat and have not left it."""
        people = self.progress.people
        return {seat: who for seat, who in game.seats.items() if who in people and who not in game.gone}

    def _acting(self, game: Game, running: Running) -> dict[Seat, str]:
        """Who chooses the acts of the seats in the next step on which no person has chosen."""
        stand_ins = {} if game.block == PRACTICE else stand_ins_of(self._study.blocks[game.block])
        acting = {}
        for seat in running.episode.arena.seats:
            who = game.seats.get(seat, SCRIPT)
            if seat not in running.chosen:
                acting[seat] = stand_ins[seat] if who in self.progress.people else who
        return acting

    def _missed(self, running: Running, acting: dict[Seat, str]) -> dict[Seat, str]:
        """Why language models do not act that should; `acting` gets who does instead."""
        missed = {} if running.thinking is None else running.thinking.out
        found = {seat: missed[seat] for seat, who in acting.items() if is_model(who) and seat in missed}
        acting |= {seat: SCRIPT if running.episode.arena.scripted(seat) else NOBODY for seat in found}
        return found

    def _ask(self, game: Game, running: Running, seats: Iterable[Seat]) -> None:
        """Ask language models what they do in the next step."""

        async def then() -> None:
            if self._running.get(game.id) is running:
                await self._show(self._advance(game))

        assert running.thinking is not None, "internal: language models play"
        for seat in seats:
            running.thinking.ask(seat, self._clock(), then)

    def _advance(self, game: Game) -> Iterable[str]:
        """Play the step if nobody is waited for any more; who sees something new."""
        running, persons = self._running_of(game), self._persons(game)
        if running.episode.ending is not None or not running.chosen:
            return ()
        if running.since is None:
            running.since = self._clock()
        if not running.late and any(seat not in running.chosen for seat in persons):
            return ()
        acting = self._acting(game, running)
        missed = self._missed(running, acting)
        models = [seat for seat, who in acting.items() if is_model(who)]
        replies: dict[Seat, tuple[list[dict[str, Any]], Action]] = {}
        if models and running.thinking is not None:
            replies = {
                seat: running.thinking.ready[seat] for seat in models if seat in running.thinking.ready
            }
            if len(replies) < len(models):
                self._ask(game, running, models)
                return ()
        episode = running.episode
        acts: dict[Seat, Action | None] = {}
        by: dict[Seat, str] = {}
        times: dict[Seat, dict[str, Any]] = {}
        for seat in episode.arena.seats:
            choice = running.chosen.get(seat)
            if choice is not None:
                acts[seat], by[seat] = choice.action, PERSON
                times[seat] = {
                    "connection": choice.connection,
                    "shown": choice.shown,
                    "acted": choice.acted,
                    "movement": choice.movement,
                    "said": choice.said,
                }
                continue
            by[seat] = acting[seat]
            acts[seat] = replies[seat][1] if seat in replies else episode.chosen(seat, by[seat])
        kept = {
            "replies": {seat: said for seat, (said, _) in replies.items()},
            "missed": missed,
            "spent": self._players.spent if models or missed else None,
        }
        more: dict[str, Any] = {key: value for key, value in kept.items() if value}
        place = {"game": game.id, "episode": len(game.results), "t": episode.t}
        self._do("step", **place, acts=acts, by=by, times=times, **more)
        if running.thinking is not None:
            running.thinking.step(replies)
        episode.step(acts)
        running.chosen, running.since, running.late = {}, None, False
        if episode.ending is not None:
            self._end(game, running)
        else:
            self._think_ahead(game, running)
        return persons.values()

    def _think_ahead(self, game: Game, running: Running) -> None:
        """Ask the language models that have their seats to themselves while people look at the picture."""
        if running.thinking is not None and running.episode.ending is None and self._persons(game):
            out = running.thinking.out
            own = [seat for seat, who in game.seats.items() if is_model(who) and seat not in out]
            self._ask(game, running, own)

    def _end(self, game: Game, running: Running) -> None:
        ending = running.episode.ending
        assert ending is not None, "internal: the episode has ended"
        running.ended = self._clock()
        self._do(
            "ended",
            game=game.id,
            episode=len(game.results),
            t=running.episode.t,
            outcome=ending.outcome,
            success=ending.success,
            returns=ending.returns,
        )

    def _ready(self, person: Participant) -> Iterable[str]:
        """Go on after the end of an episode, when all want to."""
        game = self.progress.games[person.game or ""]
        if game.episode is None or game.episode.ended is None:
            return ()
        if self.progress.is_over(game):
            self._do("finished", participant=person.id, game=game.id, passed=self.progress.passed(game))
            if all(self.progress.people[who].game != game.id for who in self._persons(game).values()):
                self._drop(game)
            self._enter(person)
            return ()
        running = self._running_of(game)
        running.ready.add(person.id)
        persons = self._persons(game)
        if set(persons.values()) <= running.ready:
            self._next_episode(game)
        return persons.values()

    async def tick(self) -> None:
        """Do what time asks for: match those who wait, let others stand in for those who have left or are late."""
        told: list[str] = []
        for block, waiting in self._waiting.items():
            told += self._match(block, waiting)
        for game in tuple(self.progress.games.values()):
            if game.block in self._watched:
                told += self._watch(game)
        if told:
            await self._show(told)

    def _match(self, block: int, waiting: dict[str, float]) -> list[str]:
        study, now = self._study.blocks[block], self._clock()
        for person in [one for one in waiting if not (one in self.pages and self.is_there(one, study.away))]:
            del waiting[person]  # nobody plays with who is not there
        told: list[str] = []
        count = len(persons_of(study))
        while waiting:
            people = list(waiting)[:count]
            if len(people) < count and now - waiting[people[0]] < study.wait:
                break
            for person in people:
                del waiting[person]
            self._begin(block, people)
            told += people
        return told

    def _watch(self, game: Game) -> list[str]:
        """See who has left a game and who is back, and go on without who is late."""
        study, now = self._study.blocks[game.block], self._clock()
        if self.progress.is_over(game):
            return []
        told: list[str] = []
        for who in game.seats.values():
            if who not in self.progress.people or not stand_ins_of(study):
                continue  # who plays without others is waited for
            there = self.is_there(who, study.away)
            if not there and who not in game.gone:
                self._do("gone", game=game.id, participant=who)
                told += self._advance(game)
            elif there and who in game.gone and who in self.pages:
                self._do("back", game=game.id, participant=who)
                told.append(who)
        persons = self._persons(game)
        running = self._running.get(game.id)
        if not persons or running is None:
            return told
        self._think_ahead(game, running)
        if running.since is not None:
            waited_for = running.thinking is not None and running.thinking.give_up(now, running.since)
            if now - running.since >= study.act_within and not running.late:
                running.late = waited_for = True
            told += self._advance(game) if waited_for else ()
        waited = running.ended is not None and now - running.ended >= study.act_within
        if running.ready and (waited or set(persons.values()) <= running.ready):
            self._next_episode(game)
            told += persons.values()
        return told

    # -- screens ----------------------------------------------------------------------------------------------

    def _on(self, person: Participant) -> str:
        """The name of the screen that a participant is at."""
        game = self.progress.games.get(person.game or "")
        if game is None or game.episode is None:
            return f"{person.stage}.{person.rounds}"
        if game.episode.ended is not None:
            return f"{game.id}.{game.episode.number}.end"
        return f"{game.id}.{game.episode.number}.{len(game.episode.steps)}"

    def screen(self, page: Page) -> Screen:
        """What a participant's page shows now: of a room what the seat observes, and nothing else."""
        person = self.progress.people[page.person]
        stage, number = self.progress.stage(person)
        if person.game is not None:
            self._running_of(self.progress.games[person.game])  # which may find that an episode has ended
        on = {"on": self._on(person)}
        match stage:
            case "consent":
                return {
                    "do": "consent",
                    **on,
                    "html": self._html(self._loaded.consent),
                    "full": self.full(),
                }
            case "page":
                pages = self._loaded.instructions
                return {
                    "do": "page",
                    **on,
                    "html": self._html(pages[number]),
                    "number": number + 1,
                    "of": len(pages),
                }
            case "asked":
                asked = [question.model_dump(by_alias=True) for question in self._questions(person)]
                return {"do": "asked", **on, "questions": asked}
            case "play" if person.game is not None:
                return self._play_screen(person, page) | on
            case "play":
                study = self._study.blocks[number]
                waited = self._clock() - self._waiting.get(number, {}).get(person.id, self._clock())
                return {"do": "room", **on, "seconds": max(0, round(study.wait - waited))}
        return {"do": "end", **on, **self._end_screen(person)}

    def _end_screen(self, person: Participant) -> Screen:
        if person.declined:
            return {"declined": True}
        end, pay = self._study.end, self._study.pay
        paid = None
        if pay is not None:
            paid = {"sum": f"{pay.base + self.progress.bonus(person):.2f}", "currency": pay.currency}
        say = "" if end.say is None else self._html(end.say)
        return {"declined": False, "code": end.code, "html": say, "link": end.link, "paid": paid}

    def _play_screen(self, person: Participant, page: Page) -> Screen:
        game = self.progress.games[person.game or ""]
        running = self._running_of(game)
        episode, played = running.episode, game.episode
        assert played is not None, "internal: a game begins with an episode"
        seat = self.progress.seat_of(game, person.id)
        practice = game.block == PRACTICE
        block = None if practice else self._study.blocks[game.block]
        ended = episode.ending is not None
        seen = episode.picture(seat)
        if block is not None and block.view == "picture":
            del seen["seen"]
        elif block is not None and block.view == "words":
            del seen["view"]
        if ended and block is not None and block.feedback == "none":
            seen.pop("seen", None)  # whose last line says how it ended
        found: Screen = {
            "do": "play",
            "practice": practice,
            "episode": played.number + 1,
            "episodes": self.progress.episodes(game),
            "t": episode.t,
            "told": episode.told(seat),
            "heard": episode.heard[seat][-MOST_LINES:],
            "waiting": seat in running.chosen or person.id in running.ready,
            **seen,
        }
        if ended:
            assert episode.ending is not None, "internal: the episode has ended"
            told = practice or (block is not None and block.feedback == "outcome")
            found |= {"ended": True, "success": episode.ending.success[seat] if told else None}
            if page.elsewhere:
                found["record"] = self._record(person, game, running, told)
        if page.knows != game.id:
            page.knows = game.id
            arena = self.arenas[game.block]
            found |= {"actions": list(arena.actions), "phrases": arena.phrases}
        return found

    def _record(self, person: Participant, game: Game, running: Running, told: bool) -> Row:
        """What the tables have of an episode that has ended, as far as whoever played it may know it.

        Args:
            person: who played it.
            game: that it belongs to.
            running: the episode.
            told: whether it is told how it ended.
        """
        played, episode, seat = game.episode, running.episode, self.progress.seat_of(game, person.id)
        assert played is not None, "internal: a game begins with an episode"
        assert episode.ending is not None, "internal: the episode has ended"
        acts = []
        for step in played.steps:
            lines = [line for t, line in episode.heard[seat] if t == step["t"] + 1]
            acts.append({**done_on(seat, step, episode.arena.actions), "heard": "\n".join(lines)})
        return {
            "participant": person.id,
            "game": game.id,
            "position": self.progress.position(person, game),
            "trial": played.number + 1,
            "trials": self.progress.episodes(game),
            "episode": person.played,
            "more": self.progress.has_more(person, game),
            "steps": episode.t,
            "own_steps": sum(act["by"] == PERSON for act in acts),
            "success": episode.ending.success[seat] if told else None,
            "outcome": episode.ending.outcome if told else None,
            "return": episode.ending.returns[seat] if told else None,
            "acts": acts,
        }

    def gone_on_from(self, person: str) -> int:
        """How many episodes a participant has played and gone on from."""
        one = self.progress.people[person]
        game = self.progress.games.get(one.game or "")
        there = game is not None and game.episode is not None and game.episode.ended is not None
        return one.played - there

    def _html(self, text: str) -> str:
        """Markdown as HTML, in which tags are shown as they are written."""
        made: str = self._markdown.render(text)
        for number, name in enumerate(self._loaded.pictures):
            made = made.replace(f'src="{name}"', f'src="/picture/{number}"')
        return made


def _fits(question: Question, answer: str | int) -> bool:
    match question.kind:
        case "text":
            return isinstance(answer, str)
        case "choice":
            return answer in (question.options or ())
    assert question.start is not None, "internal: scales have been checked"
    assert question.to is not None, "internal: scales have been checked"
    return isinstance(answer, int) and question.start <= answer <= question.to
