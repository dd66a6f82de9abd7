"""The games of a study that goes on: who has chosen, who is waited for, and the step that follows."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Container, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from socialai_dsl.checking.studies import (
    PRACTICE,
    LoadedStudy,
    is_model,
    persons_of,
    players_of,
    stand_ins_of,
)
from socialai_dsl.envs.seats import NOBODY, SCRIPT
from socialai_dsl.episodes.play import Seat
from socialai_dsl.schema.study import PERSON
from socialai_dsl.study.arena import Action, Arena, Episode
from socialai_dsl.study.journal import Journal
from socialai_dsl.study.messages import Act
from socialai_dsl.study.players import Players
from socialai_dsl.study.progress import Game, Participant, Played, Progress
from socialai_dsl.study.replay import reset_of

if TYPE_CHECKING:  # it needs httpx, which is only there if language models were asked for
    from socialai_dsl.study.models import Thinking


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


class Games:
    """All games as they are played now.

    Args:
        loaded: the study. arenas: what is played, by the number of the block. players: who plays besides people.
        journal: what happens.
        show: shows people where they are.
        pages: those who have a page open. is_there: whether one was heard in the last so many seconds.
        clock: seconds that never go back.
    """

    def __init__(
        self,
        loaded: LoadedStudy,
        arenas: Mapping[int, Arena],
        players: Players,
        journal: Journal,
        show: Callable[[Iterable[str]], Awaitable[None]],
        pages: Container[str],
        is_there: Callable[[str, float], bool],
        clock: Callable[[], float],
    ) -> None:
        self._study, self._arenas, self._players, self._journal = loaded.study, arenas, players, journal
        self._show, self._pages, self._is_there, self._clock = show, pages, is_there, clock
        self._running: dict[str, Running] = {}
        self._blocks_to_watch = {
            number
            for number, block in enumerate(self._study.blocks)
            if len(persons_of(block)) > 1 or any(map(is_model, players_of(block).values()))
        }

    @property
    def _progress(self) -> Progress:
        return self._journal.progress

    def resume(self) -> None:
        """Begin what was to begin when the server died, or the disk was full."""
        for game in self._progress.games.values():
            if game.episode is None:
                self._next_episode(game)

    def forget(self) -> None:
        """Let go what is played, to play it again as far as the journal says."""
        self.stop()
        self._running.clear()

    def stop(self) -> None:
        """Ask no language model any more."""
        for running in self._running.values():
            if running.thinking is not None:
                running.thinking.stop()

    def begin(self, block: int, people: list[str]) -> None:
        """Let people play a block together."""
        number = len(self._progress.games) + 1
        seats = self._progress.seating(block, people)
        self._journal.do("game", game=f"g{number}", block=block, seats=seats)
        game = self._progress.games[f"g{number}"]
        self._next_episode(game)

    def _next_episode(self, game: Game) -> None:
        number = len(game.results)
        self._journal.do("episode", game=game.id, number=number, room=self._progress.rooms(game)[number])
        running = self._running.get(game.id)
        if running is None or not game.before:
            self._drop(game)
            self.of(game)
            return
        assert game.episode is not None, "internal: it has just begun"
        self._running[game.id] = Running(running.episode, thinking=running.thinking)  # the same players go on
        self._play_again(game, running, game.episode)

    def of(self, game: Game) -> Running:
        """A game as it is played now; after a new start it is played again as far as it was."""
        found, now = self._running.get(game.id), game.episode
        assert now is not None, "internal: a game begins with an episode"
        if found is None:
            arena = self._arenas[game.block]
            env = arena.take()
            thinking = self._players.thinking(game.block)
            watching = () if thinking is None else tuple(thinking.seats.values())
            episode = Episode(arena, self._players.agents(game.block, env), env, watching)
            found = self._running[game.id] = Running(episode, thinking=thinking)
            for played in (*game.before, now):
                self._play_again(game, found, played)
            if episode.ending is not None and now.ended is None:  # the server died in between
                self._end(game, found)
        return found

    def _play_again(self, game: Game, running: Running, played: Played) -> None:
        """Begin an episode of a game, and play it as far as it was."""
        running.episode.begin(reset_of(game.block, played.room), f"{game.id} {played.number}")
        if running.thinking is not None:
            running.thinking.begin()
        for step in played.steps:
            if running.thinking is not None:
                running.thinking.again(step.get("replies", {}), step.get("missed", {}))
            running.episode.step(step["acts"])

    def _drop(self, game: Game) -> None:
        """Give back what a game was played in."""
        running = self._running.pop(game.id, None)
        if running is None:
            return
        self._arenas[game.block].give(running.episode.env)
        self._players.give(game.block, running.episode)
        if running.thinking is not None:
            running.thinking.stop()

    def act(self, person: Participant, connection: int, message: Act) -> Iterable[str]:
        """Take what a participant does in the next step; who sees something new."""
        game = self._progress.games[person.game or ""]
        running = self.of(game)
        seat = self._progress.seat_of(game, person.id)
        if running.episode.ending is not None or seat in running.chosen:
            return ()
        try:
            action = self._arenas[game.block].action(running.episode.rooms, message.movement, message.said)
        except ValueError:
            return ()
        running.chosen[seat] = Choice(
            action, connection, message.shown, message.acted, message.movement, message.said
        )
        return self._advance(game)

    def _advance(self, game: Game) -> Iterable[str]:
        """Play the step if nobody is waited for any more; who sees something new."""
        running, persons = self.of(game), self._persons(game)
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
        self._journal.do("step", **place, acts=acts, by=by, times=times, **more)
        if running.thinking is not None:
            running.thinking.step(replies)
        episode.step(acts)
        running.chosen, running.since, running.late = {}, None, False
        if episode.ending is not None:
            self._end(game, running)
        else:
            self._think_ahead(game, running)
        return persons.values()

    def _persons(self, game: Game) -> dict[Seat, str]:
        """The participants who have a seat and have not left it."""
        people = self._progress.people
        return {seat: who for seat, who in game.seats.items() if who in people and who not in game.gone}

    def _acting(self, game: Game, running: Running) -> dict[Seat, str]:
        """Who chooses the acts of the seats in the next step on which no person has chosen."""
        stand_ins = {} if game.block == PRACTICE else stand_ins_of(self._study.blocks[game.block])
        acting = {}
        for seat in running.episode.arena.seats:
            who = game.seats.get(seat, SCRIPT)
            if seat not in running.chosen:
                acting[seat] = stand_ins[seat] if who in self._progress.people else who
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
        self._journal.do(
            "ended",
            game=game.id,
            episode=len(game.results),
            t=running.episode.t,
            outcome=ending.outcome,
            success=ending.success,
            returns=ending.returns,
        )

    def ready(self, person: Participant) -> Iterable[str]:
        """Go on after the end of an episode, when all want to; who sees something new."""
        game = self._progress.games[person.game or ""]
        if game.episode is None or game.episode.ended is None:
            return ()
        if self._progress.is_over(game):
            self._journal.do(
                "finished", participant=person.id, game=game.id, passed=self._progress.passed(game)
            )
            if all(self._progress.people[who].game != game.id for who in self._persons(game).values()):
                self._drop(game)
            return ()
        running = self.of(game)
        running.ready.add(person.id)
        persons = self._persons(game)
        if set(persons.values()) <= running.ready:
            self._next_episode(game)
        return persons.values()

    def watch(self) -> list[str]:
        """Do what time asks for: let others play for those who have left or are late; who sees something new."""
        told: list[str] = []
        for game in tuple(self._progress.games.values()):
            if game.block in self._blocks_to_watch:
                told += self._watched(game)
        return told

    def _watched(self, game: Game) -> list[str]:
        """See who has left a game and who is back, and go on without who is late."""
        study, now = self._study.blocks[game.block], self._clock()
        if self._progress.is_over(game):
            return []
        told: list[str] = []
        for who in game.seats.values():
            if who not in self._progress.people or not stand_ins_of(study):
                continue  # who plays without others is waited for
            there = self._is_there(who, study.away)
            if not there and who not in game.gone:
                self._journal.do("gone", game=game.id, participant=who)
                told += self._advance(game)
            elif there and who in game.gone and who in self._pages:
                self._journal.do("back", game=game.id, participant=who)
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
