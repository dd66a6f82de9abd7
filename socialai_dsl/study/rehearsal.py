"""A rehearsal: simulated participants go through the real server, and a report says what a study would be like."""

from __future__ import annotations

import asyncio
import json
import random
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, Final

import uvicorn
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Origin

from socialai_dsl.checking.loaded import unscripted
from socialai_dsl.checking.studies import LoadedStudy, block_name, persons_of
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.frontend import closest_script
from socialai_dsl.schema.study import PERSON
from socialai_dsl.study.arena import Arena, Episode
from socialai_dsl.study.messages import Screen
from socialai_dsl.study.replay import StudyData, reset_of, study_data
from socialai_dsl.study.server import StudyServer
from socialai_dsl.study.serving import config_of

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


@dataclass
class Course:
    """What a simulated participant met.

    Attributes:
        kind: what it is like. seconds: that it took, in the study's time. finished: whether it came to the end.
        acts: that it chose. waits: seconds from each act to the next picture, of the clock on the wall.
        screens: kinds of screens that it saw. left: whether it left by itself.
    """

    kind: str
    seconds: float = 0.0
    finished: bool = False
    acts: int = 0
    waits: list[float] = field(default_factory=list)
    screens: Counter[str] = field(default_factory=Counter)
    left: bool = False


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
        left = sum(one.left for one in self.courses)
        yield f"{len(self.courses)} simulated participants, {len(done)} finished, {left} left by themselves"
        for kind in dict.fromkeys(one.kind for one in self.courses):
            own = [one for one in self.courses if one.kind == kind]
            took = [one.seconds / 60 for one in own if one.finished]
            said = f", {median(took):.1f} min (median), {max(took):.1f} at most" if took else ""
            yield f"  {kind:<10} {sum(one.finished for one in own)} of {len(own)} finished{said}"
        people = self.data.tables["participants"]
        groups = Counter(row["group"] for row in people if row["group"] != "")
        yield "groups: " + ", ".join(f"{group}: {count}" for group, count in sorted(groups.items()))
        persons = {block_name(loaded, n): persons_of(block) for n, block in enumerate(loaded.study.blocks)}
        for block in dict.fromkeys(row["block"] for row in self.data.tables["episodes"]):
            rows = [row for row in self.data.tables["episodes"] if row["block"] == block]
            won = sum(row["success"] for row in rows)
            played = {(row["game"], row["trial"]) for row in rows}
            stood = len(played & self._with_stand_ins(persons.get(block, ())))
            more = f", {stood} with a stand-in" if stood else ""
            yield f"  {block}: {len(rows)} episodes, {won / len(rows):.0%} successful{more}"
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


def rehearse(
    loaded: LoadedStudy,
    folder: Path,
    participants: int,
    pace: float = 2.0,
    speed: float = 50.0,
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
        speed: how much faster than the clock on the wall the study's time goes.
        kinds: what they are like, in turn.
        seed: of what they choose by chance.
        say: takes lines about the progress.

    Raises:
        OSError: the folder cannot be written.
        UsageError: it is not empty.
    """
    courses = asyncio.run(_rehearsed(loaded, folder, participants, pace, speed, kinds, seed, say))
    return Rehearsal(courses, study_data(loaded, folder))


async def _rehearsed(
    loaded: LoadedStudy,
    folder: Path,
    participants: int,
    pace: float,
    speed: float,
    kinds: tuple[str, ...],
    seed: int,
    say: Callable[[str], None],
) -> list[Course]:
    server = StudyServer(loaded, folder, "127.0.0.1", clock=lambda: time.monotonic() * speed, simulated=True)
    scripts = _scripts(loaded)
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
            simulated = Simulated(server, at, path.removeprefix("/p/"), kind, pace, speed, own, scripts)
            people.append(asyncio.create_task(simulated.take_part()))
        for ended, ending in enumerate(asyncio.as_completed(people), start=1):
            await ending
            say(f"{ended} of {participants}")
        serving.should_exit = True
        await task
    return [task.result() for task in people]


def _scripts(loaded: LoadedStudy) -> dict[int, Arena]:
    """What scripts look into: the played scenarios in which the agent follows a frame, where there are some."""
    found = {}
    for number, name, _ in loaded.named():
        with suppress(ScenarioError):
            closest = closest_script(name, loaded.played[number])
            if not unscripted(closest.loaded):
                found[number] = Arena(closest.loaded)
    return found


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
        scripts: dict[int, Arena],
    ) -> None:
        self._server, self._at, self._code, self._kind = server, at, code, kind
        self._pace, self._speed, self._rng, self._scripts = pace, speed, rng, scripts
        self._mirror: tuple[str, Episode] | None = None
        self._course = Course(kind)
        self._game: Screen = {}
        self._patience = rng.randint(5, 60) if kind == "leaving" else None
        self._asked: float | None = None

    async def take_part(self) -> Course:
        """Go from the first page to the last, or as far as this one goes."""
        began = time.monotonic()
        while not (self._course.finished or self._course.left):
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
            answer = self._answer(screen) if screen["on"] != answered else None
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

    def _answer(self, screen: Screen) -> dict[str, Any] | None:
        on = screen["on"]
        match screen["do"]:
            case "consent" | "page":
                return None if screen.get("full") else {"do": "go", "on": on}
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
                movement, said = self._act()
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

    def _act(self) -> tuple[str | None, str | None]:
        scripted = self._script() if self._kind != "random" else None
        if scripted is not None:
            return scripted
        movement = self._rng.choice([*self._game["actions"], None])
        said = (
            self._rng.choice(self._game["phrases"])
            if self._game["phrases"] and self._rng.random() < 0.3
            else None
        )
        return movement, said

    def _script(self) -> tuple[str | None, str | None] | None:
        """What the script does now, from a room that is played alike; None where there is none for this seat."""
        progress = self._server.live.progress
        person = progress.people[self._server.person(self._code)]
        game = progress.games.get(person.game or "")
        if game is None or game.episode is None or game.block not in self._scripts:
            return None
        if progress.seat_of(game, person.id) != "agent":
            return None
        arena, name = self._scripts[game.block], f"{game.id} {game.episode.number}"
        if self._mirror is None or self._mirror[0] != name:
            env = arena.take()
            self._mirror = name, Episode(arena, {}, reset_of(game.block, game.episode.room), env)
        episode = self._mirror[1]
        for step in game.episode.steps[episode.t :]:
            episode.step(step["acts"])
        action = episode.chosen("agent", "script")
        return None if action is None or episode.ending is not None else arena.words(action)
