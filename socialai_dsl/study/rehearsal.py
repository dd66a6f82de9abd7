"""A rehearsal: simulated participants go through the real server, and a report says what a study would be like."""

from __future__ import annotations

import asyncio
import json
import random
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, Final

import uvicorn
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Origin

from socialai_dsl.checking.loaded import unscripted
from socialai_dsl.checking.studies import (
    LoadedStudy,
    asked_by,
    block_name,
    is_model,
    is_trained,
    models_of,
    persons_of,
    rival_of,
)
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.envs.seats import RANDOM, SCRIPT
from socialai_dsl.episodes.play import AGENT, Seat
from socialai_dsl.errors import UsageError
from socialai_dsl.frontend import closest_script, load, variant_of
from socialai_dsl.schema.study import PERSON
from socialai_dsl.study.arena import Action, Arena, Episode
from socialai_dsl.study.messages import Screen
from socialai_dsl.study.players import agent_of, require_models
from socialai_dsl.study.progress import Game, Played, Progress
from socialai_dsl.study.replay import StudyData, reset_of, study_data
from socialai_dsl.study.server import StudyServer
from socialai_dsl.study.serving import config_of

if TYPE_CHECKING:  # it needs httpx, which is only there if language models were asked for
    from socialai_dsl.study.models import Endpoints, ModelSeat

KINDS: Final = ("script", "random", "slow", "leaving", "reloading", "cheating")
"""What simulated participants are like, in turn."""

_BEAT: Final = 1.0
_CHEATS: Final = (
    "",
    "[]",
    "no JSON",
    '{"do":"act"}',
    '{"do":"go","on":"end","more":1}',
    '{"do":"go","on":"99.0"}',
    '{"do":"act","on":"g1.0.0","movement":"fly","said":null,"shown":0,"acted":0}',
    '{"do":"answers","on":"1.0","answers":{"nothing":"asked"}}',
    '{"do":"glance","seat":"agent"}',
    json.dumps({"do": "go", "on": "x" * 5000}),
)


_MOST_REASONS: Final = 3


@dataclass
class Course:
    """What a simulated participant met.

    Attributes:
        kind: what it is like. seconds: that it took, in the study's time. finished: whether it came to the end.
        acts: that it chose. waits: seconds from each act to the next picture, of the clock on the wall.
        screens: kinds of screens that it saw. left: whether it left by itself. refused: whether the study was full.
        by_chance: acts of an agent that it chose by chance, as the agent does not play there, or failed.
        failures: why a language model failed, and how often.
    """

    kind: str
    seconds: float = 0.0
    finished: bool = False
    acts: int = 0
    waits: list[float] = field(default_factory=list)
    screens: Counter[str] = field(default_factory=Counter)
    left: bool = False
    refused: bool = False
    by_chance: int = 0
    failures: Counter[str] = field(default_factory=Counter)


@dataclass(frozen=True)
class Rehearsal:
    """What a study would be like.

    Attributes:
        courses: of the participants. data: the tables, every episode of which was played again.
    """

    courses: list[Course]
    data: StudyData

    def lines(self, loaded: LoadedStudy) -> Iterable[str]:
        """The report, line by line."""
        done = [one for one in self.courses if one.finished]
        left, refused = (sum(getattr(one, how) for one in self.courses) for how in ("left", "refused"))
        full = f", {refused} came when the study was full" if refused else ""
        yield f"{len(self.courses)} simulated participants, {len(done)} finished, {left} left by themselves{full}"
        kinds = dict.fromkeys(one.kind for one in self.courses)
        for kind in kinds:
            own = [one for one in self.courses if one.kind == kind]
            took = [one.seconds / 60 for one in own if one.finished]
            said = f", {median(took):.1f} min (median), {max(took):.1f} at most" if took else ""
            chance, acts = sum(one.by_chance for one in own), sum(one.acts for one in own)
            said += f", {chance} of {acts} acts by chance" if chance else ""
            wide = max(map(len, (*KINDS, *kinds)))
            yield f"  {kind:<{wide}} {sum(one.finished for one in own)} of {len(own)} finished{said}"
            yield from _reasons(sum((one.failures for one in own), Counter()))
        people, steps = self.data.tables["participants"], self.data.tables["steps"]
        groups = Counter(row["group"] for row in people if row["group"] != "")
        yield "groups: " + ", ".join(f"{group}: {count}" for group, count in sorted(groups.items()))
        persons = {block_name(loaded, n): persons_of(block) for n, block in enumerate(loaded.study.blocks)}
        for block in dict.fromkeys(row["block"] for row in self.data.tables["episodes"]):
            rows = [row for row in self.data.tables["episodes"] if row["block"] == block]
            won = sum(row["success"] for row in rows)
            played = {(row["game"], row["trial"]) for row in rows}
            stood = len(played & self._with_stand_ins(persons.get(block, ())))
            more = f", {stood} with a stand-in" if stood else ""
            missed = Counter(r["missed"] for r in steps if r["missed"] and (r["game"], r["trial"]) in played)
            more += f", {missed.total()} steps that a language model missed" if missed else ""
            yield f"  {block}: {len(rows)} episodes, {won / len(rows):.0%} successful{more}"
            yield from _reasons(missed)
        excluded = Counter(row["excluded"] for row in people if row["excluded"])
        if excluded:
            yield "excluded: " + ", ".join(f"{count} {reason}" for reason, count in excluded.items())
        pay = loaded.study.pay
        if pay is not None:
            paid = [float(row["paid"]) for row in people if row["paid"] != ""]
            mean = sum(paid) / len(paid) if paid else 0.0
            yield f"pay: {sum(paid):.2f} {pay.currency} in all, {mean:.2f} for each who finished"
        waits = sorted(wait for one in self.courses for wait in one.waits)
        if waits:
            at = waits[min(len(waits) - 1, int(0.95 * len(waits)))]
            yield f"from an act to the next picture: {1000 * median(waits):.0f} ms (median), {1000 * at:.0f} ms (95 %)"
        yield f"{self.data.replayed} episodes were played again, and each came out as it did"

    def _with_stand_ins(self, persons: Sequence[str]) -> set[tuple[str, int]]:
        """Games and trials in which somebody else than a person chose a step on a seat that is a person's."""
        steps = self.data.tables["steps"]
        return {(r["game"], r["trial"]) for r in steps if r["seat"] in persons and r["by"] != PERSON}


def _reasons(missed: Counter[str]) -> Iterable[str]:
    """Why language models did not act, the most frequent reasons first."""
    return (f"    {count} times: {reason}" for reason, count in missed.most_common(_MOST_REASONS))


def rehearse(
    loaded: LoadedStudy,
    folder: Path,
    participants: int,
    pace: float = 2.0,
    speed: float | None = None,
    kinds: tuple[str, ...] = KINDS,
    seed: int = 0,
    say: Callable[[str], None] = lambda line: None,
) -> Rehearsal:
    """Let simulated participants take part in a study.

    Args:
        loaded: the study.
        folder: for all that is stored; it is there and empty.
        participants: how many.
        pace: seconds that they take for an act or a page, in the study's time.
        speed: how much faster than the clock on the wall the study's time goes; by default 50, or 1 where a language
            model plays, which takes the time that it takes.
        kinds: what they are like, in turn: some of `KINDS`, or agents: `rival:NAME`, `llm:MODEL`, `shipped:NAME`, the
            path of a checkpoint or a run's folder.
        seed: of what they choose by chance.
        say: takes lines about the progress.

    Raises:
        OSError: the folder cannot be written.
        UsageError: it is not empty; or an agent is unknown, or plays in no block.
    """
    minds = {kind: _mind(kind, loaded) for kind in dict.fromkeys(kinds)}
    if speed is None:
        models = *models_of(loaded.study), *filter(is_model, kinds)
        speed = 1.0 if models else 50.0
    courses = asyncio.run(_rehearsed(loaded, folder, participants, pace, speed, kinds, minds, seed, say))
    return Rehearsal(courses, study_data(loaded, folder))


async def _rehearsed(
    loaded: LoadedStudy,
    folder: Path,
    participants: int,
    pace: float,
    speed: float,
    kinds: tuple[str, ...],
    minds: Mapping[str, Mind],
    seed: int,
    say: Callable[[str], None],
) -> list[Course]:
    server = StudyServer(loaded, folder, "127.0.0.1", clock=lambda: time.monotonic() * speed, simulated=True)
    with socket.create_server(("127.0.0.1", 0), backlog=1024) as listening:
        serving = uvicorn.Server(config_of(server))
        task = asyncio.create_task(serving.serve(sockets=[listening]))
        while not serving.started:
            await asyncio.sleep(0.02)
        at = f"127.0.0.1:{listening.getsockname()[1]}"
        rng = random.Random(seed)
        people = []
        for number in range(participants):
            path = await server.invite()
            kind = kinds[number % len(kinds)]
            own = random.Random(rng.random())
            simulated = Simulated(server, at, path.removeprefix("/p/"), kind, pace, speed, own, minds[kind])
            people.append(asyncio.create_task(simulated.take_part()))
        for ended, ending in enumerate(asyncio.as_completed(people), start=1):
            await ending
            say(f"{ended} of {participants}")
        serving.should_exit = True
        await task
        for mind in minds.values():
            await mind.close()
    return [task.result() for task in people]


@dataclass(frozen=True)
class Mind:
    """What chooses for simulated participants of a kind, in rooms that are played beside those of the server.

    Attributes:
        who: `script`, or an agent. arenas: number of a block -> what it looks into there; elsewhere chance plays.
        endpoints: where a language model is asked.
    """

    who: str
    arenas: Mapping[int, Arena]
    endpoints: Endpoints | None = None

    def plays(self, block: int, seat: Seat) -> bool:
        """Whether it has a move of its own on a seat of a block: scripts and rivals are frames of the agent."""
        return block in self.arenas and (seat == AGENT or is_trained(self.who) or is_model(self.who))

    async def close(self) -> None:
        """Let connections go."""
        if self.endpoints is not None:
            await self.endpoints.close()


def _mind(kind: str, loaded: LoadedStudy) -> Mind:
    """What chooses for a kind of participants. Raises UsageError for an agent that is unknown or plays nowhere."""
    if kind in KINDS:
        return Mind(SCRIPT, {} if kind == RANDOM else _framed(loaded, None))
    if is_model(kind):
        require_models()
        from socialai_dsl.study.models import Endpoints

        arenas = {number: Arena(one) for number, one in loaded.played.items()}
        return Mind(kind, arenas, Endpoints([kind], asked_by(loaded.study, loaded.folder)))
    rival = rival_of(kind)
    if rival is not None:
        arenas, why = _framed(loaded, rival), "no scenario of the study has this rival"
    else:
        arenas, why = _fitting(kind, loaded)
    if not arenas:
        raise UsageError(f"{kind}: {why}")
    return Mind(kind, arenas)


def _framed(loaded: LoadedStudy, rival: str | None) -> dict[int, Arena]:
    """The scenarios of a study in which the agent follows its script, or a rival, where there is one."""
    found = {}
    for number, name, _ in loaded.named():
        with suppress(ScenarioError):
            one = (
                load(variant_of(name, rival)) if rival else closest_script(name, loaded.played[number]).loaded
            )
            if not unscripted(one):
                found[number] = Arena(one)
    return found


def _fitting(agent: str, loaded: LoadedStudy) -> tuple[dict[int, Arena], str]:
    """The scenarios of a study that a trained agent can play, and why it cannot play the others."""
    found, why = {}, ""
    for number, one in loaded.played.items():
        arena = Arena(one)
        try:
            agent_of(agent, Path(), arena.take())
        except UsageError:
            raise
        except ValueError as error:
            why = str(error)
        else:
            found[number] = arena
    return found, why


class Simulated:
    """A simulated participant."""

    def __init__(
        self,
        server: StudyServer,
        at: str,
        code: str,
        kind: str,
        pace: float,
        speed: float,
        rng: random.Random,
        mind: Mind,
    ) -> None:
        self._server, self._at, self._code, self._kind = server, at, code, kind
        self._pace, self._speed, self._rng, self._mind = pace, speed, rng, mind
        self._mirror: tuple[tuple[str, int], Episode] | None = None
        self._model: ModelSeat | None = None
        self._course = Course(kind)
        self._game: Screen = {}
        self._patience = rng.randint(5, 60) if kind == "leaving" else None
        self._asked: float | None = None

    async def take_part(self) -> Course:
        """Go from the first page to the last, or as far as this one goes."""
        began = time.monotonic()
        while not (self._course.finished or self._course.left or self._course.refused):
            with suppress(ConnectionClosed, OSError):
                uri = f"ws://{self._at}/seat/{self._code}"
                async with connect(uri, origin=Origin(f"http://{self._at}"), compression=None) as line:
                    beating = asyncio.create_task(self._beat(line))
                    try:
                        await self._talk(line)
                    finally:
                        beating.cancel()
        self._course.seconds = (time.monotonic() - began) * self._speed
        return self._course

    async def _beat(self, line: ClientConnection) -> None:
        with suppress(ConnectionClosed):
            while True:
                await asyncio.sleep(_BEAT / self._speed)
                await line.send('{"do":"beat"}')

    async def _talk(self, line: ClientConnection) -> None:
        answered = ""
        async for text in line:
            screen = json.loads(text)
            if self._asked is not None:
                self._course.waits.append(time.monotonic() - self._asked)
                self._asked = None
            self._course.screens[screen["do"]] += 1
            if screen.get("actions"):
                self._game = screen
            if screen["do"] == "end":
                self._course.finished = True
                return
            if screen.get("full"):  # like people, who do not wait for a place that may never be free
                self._course.refused = True
                return
            answer = await self._answer(screen) if screen["on"] != answered else None
            if answer is None:
                continue
            took = self._pace * (3 if self._kind == "slow" else 1) * self._rng.uniform(0.5, 1.5)
            await asyncio.sleep(took / self._speed)
            if answer["do"] == "act":
                answer["acted"] = answer["shown"] + 1000 * took
            if self._kind == "cheating" and self._rng.random() < 0.3:
                await line.send(self._rng.choice(_CHEATS))
                continue  # and be shown again where it is
            await line.send(json.dumps(answer))
            answered = screen["on"]
            if answer["do"] == "act":
                self._course.acts += 1
                self._asked = time.monotonic()
                if self._patience is not None and self._course.acts >= self._patience:
                    self._course.left = True
                    return
                if self._kind == "reloading" and self._rng.random() < 0.1:
                    return

    async def _answer(self, screen: Screen) -> dict[str, Any] | None:
        on = screen["on"]
        match screen["do"]:
            case "consent" | "page":
                return {"do": "go", "on": on}
            case "asked":
                return {
                    "do": "answers",
                    "on": on,
                    "answers": {q["id"]: self._said(q) for q in screen["questions"]},
                }
            case "play" if screen.get("waiting"):
                return None
            case "play" if screen.get("ended"):
                return {"do": "go", "on": on}
            case "play":
                movement, said = await self._act()
                now = time.monotonic() * 1000 * self._speed % 1e9
                return {
                    "do": "act",
                    "on": on,
                    "movement": movement,
                    "said": said,
                    "shown": now,
                    "acted": now,
                }
        return None

    def _said(self, question: dict[str, Any]) -> str | int:
        if question["kind"] == "scale":
            return self._rng.randint(question["from"], question["to"])
        return (
            str(self._rng.choice(question["options"])) if question["kind"] == "choice" else f"({self._kind})"
        )

    async def _act(self) -> tuple[str | None, str | None]:
        own = await self._own()
        if own is not None:
            return own
        self._course.by_chance += self._kind not in KINDS
        movement = self._rng.choice([*self._game["actions"], None])
        said = (
            self._rng.choice(self._game["phrases"])
            if self._game["phrases"] and self._rng.random() < 0.3
            else None
        )
        return movement, said

    async def _own(self) -> tuple[str | None, str | None] | None:
        """What its mind does now, from a room that is played alike; None where it has no move here."""
        progress = self._server.live.progress
        person = progress.people[self._server.person(self._code)]
        game = progress.games.get(person.game or "")
        if game is None or game.episode is None:
            return None
        seat = progress.seat_of(game, person.id)
        if not self._mind.plays(game.block, seat):
            return None
        episode = self._mirrored(progress, game, game.episode, seat)
        if episode.ending is not None:
            return None
        action = await self._chosen(episode, seat)
        return None if action is None else episode.arena.words(action)

    def _mirrored(self, progress: Progress, game: Game, now: Played, seat: Seat) -> Episode:
        """The episode of a game as far as it is played, with all its session, where its mind looks from the seat."""
        session = game.id, now.number - len(game.before)
        if self._mirror is None or self._mirror[0] != session:
            arena = self._mind.arenas[game.block]
            self._mirror = session, self._beginning(arena, seat, progress.session(game))
        episode = self._mirror[1]
        for number, played in enumerate((*game.before, now)):
            if number < episode.trial:
                continue
            if number > episode.trial:
                episode.begin(reset_of(game.block, played.room), f"{game.id} {played.number}")
            for step in played.steps[episode.t :]:
                if self._model is not None and step["by"][seat] != PERSON:
                    self._model.passed()
                episode.step(step["acts"])
        return episode

    def _beginning(self, arena: Arena, seat: Seat, session: int) -> Episode:
        """An episode that is to begin, with its mind on the seat."""
        env, who = arena.take(), self._mind.who
        agents = {seat: lambda: agent_of(who, Path(), env)} if is_trained(who) else {}
        if self._mind.endpoints is not None:
            from socialai_dsl.study.models import ModelSeat

            self._model = ModelSeat(arena, seat, who, self._mind.endpoints, session)
        watching = () if self._model is None else (self._model,)
        return Episode(arena, agents, env, watching)

    async def _chosen(self, episode: Episode, seat: Seat) -> Action | None:
        if self._model is None:
            return episode.chosen(seat, self._mind.who)
        from socialai_dsl.study.models import ModelFailed

        try:
            return (await self._model.act())[1]
        except ModelFailed as failed:
            self._course.failures[str(failed)] += 1
            return None
