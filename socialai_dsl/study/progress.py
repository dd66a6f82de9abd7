"""Where everybody is in a study: a state that follows from the events of its log alone."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from socialai_dsl.checking.loaded import session_of
from socialai_dsl.checking.studies import PRACTICE, LoadedStudy, persons_of, seats_of, stand_ins_of
from socialai_dsl.schema.study import Question
from socialai_dsl.semantics.study import least_filled, shuffled
from socialai_dsl.study.log import Event

PRACTICE_SEED: Final = 1_000_000
"""The first room of practice, which no test set has."""

Stage = tuple[str, int]
"""What a participant does: `consent`, `page` with its number, `play` with that of a block or `PRACTICE`, `asked` with
that of a block or -1 for the questions at the end, `end`."""


@dataclass
class Played:
    """An episode of a game.

    Attributes:
        number: in the game, from 0. room: of the test set, or in practice a seed.
        steps: what was done, see the event `step`; until everybody has gone on from the game.
        ended: the event that says how it ended.
    """

    number: int
    room: int
    steps: list[Event] = field(default_factory=list)
    ended: Event | None = None


@dataclass
class Game:
    """Those who play a block together.

    Attributes:
        id: of the game. block: its number, or `PRACTICE`.
        seats: of each seat who has it: a participant's id, or a word that is no participant's.
        gone: participants who have left, whose seats somebody else plays.
        episode: the present one. before: those before it in its session, which agents and models remember as well.
        results: the successes of each seat in the episodes that have ended.
    """

    id: str
    block: int
    seats: dict[str, str]
    gone: set[str] = field(default_factory=set)
    episode: Played | None = None
    before: list[Played] = field(default_factory=list)
    results: list[Mapping[str, bool]] = field(default_factory=list)


@dataclass
class Participant:
    """Somebody who takes part.

    Attributes:
        id: in the data. number: of those who have joined, from 1.
        stage: index of what they do now. group: from 1; None before they agree.
        declined: whether they did not agree. game: that they play. rounds: of practice that have ended.
        practised: whether they reached the criterion. won: successes that count. answered: questions.
        connections: how often their page has been opened. since: time of their last event.
        played: episodes that have ended, with those of practice.
        agreed_at: the origin of the page that says that they have agreed; None for the study's own.
        simulated: whether that page says that nobody sits there.
    """

    id: str
    number: int
    stage: int = 0
    group: int | None = None
    declined: bool = False
    game: str | None = None
    rounds: int = 0
    practised: bool | None = None
    won: int = 0
    answered: int = 0
    connections: int = 0
    began: str | None = None
    ended: str | None = None
    since: str | None = None
    played: int = 0
    agreed_at: str | None = None
    simulated: bool = False


class Progress:
    """All participants and games of a study.

    Args:
        loaded: the study.

    Attributes:
        people: id -> participant. games: id -> game.
    """

    def __init__(self, loaded: LoadedStudy) -> None:
        self.loaded, self.study = loaded, loaded.study
        self.people: dict[str, Participant] = {}
        self.games: dict[str, Game] = {}

    # -- what follows from the file -------------------------------------------------------------------------------

    def stages(self, person: Participant) -> list[Stage]:
        """What a participant does, one after another; before they agree only what comes first."""
        study = self.study
        found: list[Stage] = [("consent", 0)]
        if person.group is None:
            return [*found, ("end", 0)]
        found += [("page", number) for number in range(len(study.instructions))]
        found += [("play", PRACTICE)] if study.practice is not None else []
        for number in self.loaded.design.orders[person.group - 1]:
            found.append(("play", number))
            found += [("asked", number)] if study.blocks[number].questions else []
        found += [("asked", PRACTICE)] if study.questions else []
        return [*found, ("end", 0)]

    def stage(self, person: Participant) -> Stage:
        """What a participant does now."""
        return self.stages(person)[person.stage]

    def questions(self, person: Participant) -> tuple[Question, ...]:
        """What a participant is asked at their stage, which is `asked`."""
        _, block = self.stage(person)
        return self.study.questions if block == PRACTICE else self.study.blocks[block].questions

    def gone_on_from(self, person: Participant) -> int:
        """How many episodes a participant has played and gone on from."""
        game = self.games.get(person.game or "")
        there = game is not None and game.episode is not None and game.episode.ended is not None
        return person.played - there

    def rooms(self, game: Game) -> tuple[int, ...]:
        """The rooms that a game plays, in this order; of practice those of the present round."""
        study = self.study
        person = next((self.people[who] for who in game.seats.values() if who in self.people), None)
        assert person is not None, "internal: a participant plays"
        if game.block == PRACTICE:
            assert study.practice is not None, "internal: there is practice"
            start = PRACTICE_SEED + person.rounds * study.practice.episodes
            return tuple(range(start, start + study.practice.episodes))
        rooms = self.loaded.design.rooms[game.block]
        return (
            shuffled(rooms, study.study, game.block, person.number)
            if study.blocks[game.block].shuffle
            else rooms
        )

    def episodes(self, game: Game) -> int:
        """How many episodes a game has."""
        if game.block != PRACTICE:
            return len(self.loaded.design.rooms[game.block])
        assert self.study.practice is not None, "internal: there is practice"
        return self.study.practice.episodes

    def session(self, game: Game) -> int:
        """How many episodes of a game in a row are a session."""
        return 1 if game.block == PRACTICE else session_of(self.loaded.played[game.block])

    def full(self, dropped: Container[str]) -> bool:
        """Whether as many take part as may, without those who dropped out."""
        most = self.study.participants
        return most is not None and sum(self._sizes(dropped)) >= most

    def next_group(self, dropped: Container[str]) -> int:
        """The group of whoever agrees next, from 1, where those who dropped out do not count."""
        return least_filled(self._sizes(dropped)) + 1

    def _sizes(self, dropped: Container[str]) -> list[int]:
        """How many have agreed and not dropped out, of each group."""
        sizes = [0] * len(self.loaded.design.orders)
        for person in self.people.values():
            if person.group is not None and person.id not in dropped:
                sizes[person.group - 1] += 1
        return sizes

    def seating(self, block: int, people: list[str]) -> dict[str, str]:
        """Who sits where in a new game: people on the seats for them, each pair the other way round than the last."""
        if block == PRACTICE:
            return {"agent": people[0]}
        seats, persons = seats_of(self.study.blocks[block]), persons_of(self.study.blocks[block])
        before = sum(game.block == block for game in self.games.values())
        turned = [*persons[before % len(persons) :], *persons[: before % len(persons)]]
        taken = dict(zip(turned, people, strict=False))
        others = seats | stand_ins_of(self.study.blocks[block])
        return {seat: taken.get(seat, others[seat]) for seat in seats}

    def is_over(self, game: Game) -> bool:
        """Whether all episodes of a game have ended."""
        return len(game.results) >= self.episodes(game)

    def seat_of(self, game: Game, person: str) -> str:
        """The seat that a participant has in a game."""
        return next(seat for seat, who in game.seats.items() if who == person)

    def position(self, person: Participant, game: Game) -> int:
        """The place of a game's block in a participant's order, from 1; 0 of practice."""
        order = self.loaded.design.orders[(person.group or 1) - 1]
        return 0 if game.block == PRACTICE else order.index(game.block) + 1

    def has_more(self, person: Participant, game: Game) -> bool:
        """Whether a participant plays another episode after the present one of a game."""
        assert game.episode is not None, "internal: a game begins with an episode"
        later = self.stages(person)[person.stage + 1 :]
        return game.episode.number + 1 < self.episodes(game) or any(stage == "play" for stage, _ in later)

    def passed(self, game: Game) -> bool:
        """Whether a round of practice reached the criterion, or there is none."""
        practice = self.study.practice
        if practice is None or practice.until is None:
            return True
        won = sum(result["agent"] for result in game.results)
        return won >= practice.until.success * practice.episodes

    def bonus(self, person: Participant) -> float:
        """What a participant is paid for success, besides the base."""
        return 0.0 if self.study.pay is None else person.won * self.study.pay.bonus

    # -- what follows from an event -------------------------------------------------------------------------------

    def apply(self, event: Event) -> None:
        """Go on by an event."""
        kind, person = event["event"], self.people.get(event.get("participant", ""))
        if person is not None:
            person.since = event["time"]
        match kind:
            case "joined":
                self.people[event["participant"]] = Participant(
                    event["participant"], event["number"], since=event["time"]
                )
            case "agreed" if person is not None:
                person.group, person.stage, person.began = event["group"], 1, event["time"]
                person.agreed_at, person.simulated = event.get("at"), event.get("simulated", False)
            case "declined" if person is not None:
                person.declined, person.stage = True, 1
            case "came" if person is not None:
                person.connections = event["connection"]
            case "answered" if person is not None:
                person.answered += len(event["answers"])
                self._next(person, event)
            case "read" if person is not None:
                self._next(person, event)
            case "finished" if person is not None:  # with a block or a round of practice
                self._finish(person, event)
            case _:
                self._play(event)

    def _next(self, person: Participant, event: Event) -> None:
        person.stage += 1
        if self.stage(person)[0] == "end":
            person.ended = event["time"]

    def _finish(self, person: Participant, event: Event) -> None:
        person.game = None
        game = self.games[event["game"]]
        if game.episode is not None and all(
            p.game != game.id for p in map(self.people.get, game.seats.values()) if p
        ):
            game.episode.steps, game.before = [], []
        if self.stage(person) == ("play", PRACTICE):
            person.rounds += 1
            person.practised = event["passed"]
            assert self.study.practice is not None, "internal: there is practice"
            if not event["passed"] and person.rounds < self.study.practice.rounds:
                return
        self._next(person, event)

    def _play(self, event: Event) -> None:
        match event["event"]:
            case "game":
                game = self.games[event["game"]] = Game(event["game"], event["block"], dict(event["seats"]))
                for who in game.seats.values():
                    if who in self.people:
                        self.people[who].game = game.id
            case "episode":
                game = self.games[event["game"]]
                begun = Played(event["number"], event["room"])
                if begun.number % self.session(game) == 0:
                    game.before = []
                elif game.episode is not None:
                    game.before.append(game.episode)
                game.episode = begun
            case "step":
                episode = self.games[event["game"]].episode
                assert episode is not None, "internal: a step is one of an episode"
                episode.steps.append(event)
            case "ended":
                game = self.games[event["game"]]
                assert game.episode is not None, "internal: what ends has begun"
                game.episode.ended = event
                game.results.append(event["success"])
                for seat, who in game.seats.items():
                    if who in self.people:
                        self.people[who].played += 1
                    if game.block != PRACTICE and who in self.people and who not in game.gone:
                        self.people[who].won += bool(event["success"].get(seat))
            case "gone":
                self.games[event["game"]].gone.add(event["participant"])
            case "back":
                self.games[event["game"]].gone.discard(event["participant"])


def done_on(seat: str, event: Event, actions: Sequence[str]) -> dict[str, Any]:
    """What was done on a seat in a step, in columns of the table `steps`.

    Args:
        seat: whose.
        event: the event `step`.
        actions: the words for movements.
    """
    time, action = event["times"].get(seat, {}), event["acts"][seat]
    movements = (*actions, "")
    did = time.get("movement") or ("" if time or action is None else movements[action[0]])
    return {
        "step": event["t"] + 1,
        "by": event["by"][seat],
        "movement": did,
        "said": time.get("said") or "",
        "shown_ms": time.get("shown", ""),
        "acted_ms": time.get("acted", ""),
        "reaction_ms": round(time["acted"] - time["shown"], 3) if time else "",
        "connection": time.get("connection", ""),
        "time": event["time"],
    }
