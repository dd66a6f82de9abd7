"""Plays the log of a study again: every episode has to come out as it did; what came of it are tables."""

from __future__ import annotations

import hashlib
import json
import os
import shlex
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

from socialai_dsl.checking.briefing import Tell
from socialai_dsl.checking.studies import PRACTICE, LoadedStudy, block_name, rival_of_agent, scripts_agent
from socialai_dsl.envs.factory import compiled
from socialai_dsl.episodes.asking import Asking
from socialai_dsl.errors import UsageError
from socialai_dsl.frontend import load
from socialai_dsl.loader.reader import display_name
from socialai_dsl.schema.study import PERSON, Question
from socialai_dsl.study.arena import Arena, Episode
from socialai_dsl.study.columns import COLUMNS
from socialai_dsl.study.log import FILE, FORMAT, Event, follow, read_log
from socialai_dsl.study.progress import Game, Participant, Progress, done_on
from socialai_dsl.traces.endings import Ending, endings_of

Row = dict[str, Any]


@dataclass
class _Of:
    """What the log says of a participant besides where they are."""

    times: list[float] = field(default_factory=list)
    episodes: int = 0
    left: int = 0


@dataclass(frozen=True)
class _Going:
    """An episode that is played again: when it began, what listens, how often each rule had fired before in what it is
    played in, and how many steps a person chose on each seat.
    """

    episode: Episode
    began: str
    asking: Asking
    fired: Mapping[str, int]
    chosen: Counter[str] = field(default_factory=Counter)


@dataclass(frozen=True)
class PlayedBlock:
    """What was played in a block.

    Attributes:
        name: of the block. scenario: a name that can be loaded from here. shown: what people call that.
        program: SHA-256 of what it is compiled to. briefing: what players were told, as results record it.
        view, feedback: as of the block. endings: the ways that an episode can end.
    """

    name: str
    scenario: str
    shown: str
    program: str
    briefing: Mapping[str, Any]
    view: str
    feedback: str
    endings: Sequence[Ending]


@dataclass(frozen=True)
class StudyData:
    """The tables of a study.

    Attributes:
        tables: name -> rows, in the columns of `COLUMNS`.
        replayed: how many episodes were played again. unended: how many more had not ended.
        simulated: whether simulated participants took part. blocks: in the order of the file.
        study: its name. begun: the time of the first event of its log, UTC.
        questions: in the order of the file, each with the name of its block; those at the end with none.
    """

    tables: Mapping[str, Sequence[Row]]
    replayed: int
    unended: int
    simulated: bool = False
    blocks: Sequence[PlayedBlock] = ()
    study: str = ""
    begun: str = ""
    questions: Sequence[tuple[str, Question]] = ()


def study_data(loaded: LoadedStudy, folder: Path) -> StudyData:
    """The data of a study, each episode of which was played again.

    Args:
        loaded: the study.
        folder: that holds its log.

    Raises:
        OSError: it cannot be read.
        UsageError: the log is of another study, or of an earlier version of its scenarios.
        UnreadableError: an episode does not come out as the log says.
    """
    return _Tables(loaded, folder / FILE).made()


class _Tables:
    """Reads one log."""

    def __init__(self, loaded: LoadedStudy, file: Path) -> None:
        self._loaded, self._file = loaded, file
        self._arenas = {
            number: Arena(one, tell_of(loaded, number), loaded.study.language)
            for number, one in loaded.played.items()
        }
        self._names = {number: name for number, name, _ in loaded.named()}
        self._progress = Progress(loaded)
        self._rows: dict[str, list[Row]] = {name: [] for name in COLUMNS}
        self._going: dict[str, _Going] = {}
        self._of: dict[str, _Of] = {}
        self._server, self._replayed, self._simulated, self._begun = 0, 0, False, ""

    def made(self) -> StudyData:
        follow(self._file, self._take)
        for person in self._progress.people.values():
            self._rows["participants"].append(self._participant(person))
        tables = {
            name: [self._whole(row, columns) for row in self._rows[name]] for name, columns in COLUMNS.items()
        }
        blocks = [self._block(number) for number in range(len(self._loaded.study.blocks))]
        study = self._loaded.study
        asked = [
            (block_name(self._loaded, n), q) for n, block in enumerate(study.blocks) for q in block.questions
        ]
        asked += [("", question) for question in study.questions]
        counts = self._replayed, len(self._going)
        return StudyData(tables, *counts, self._simulated, blocks, study.study, self._begun, asked)

    def _whole(self, row: Row, columns: Iterable[str]) -> Row:
        """A row in the order of the columns, with what every table has."""
        known = self._progress.people.get(row.get("participant", ""))
        simulated = self._simulated or (known is not None and known.simulated)
        return {column: simulated if column == "simulated" else row[column] for column in columns}

    def _block(self, number: int) -> PlayedBlock:
        block, name = self._loaded.study.blocks[number], self._names[number]
        # Where a script or a rival may play the agent, what is played has a frame for it, and is the same otherwise.
        framed = scripts_agent(block) or rival_of_agent(block) is not None
        meant = load(name) if framed else self._loaded.played[number]
        program = compiled(meant)
        return PlayedBlock(
            block_name(self._loaded, number),
            display_name(Path(name)) if os.path.isabs(name) else name,
            meant.name,
            program.sha256,
            self._arenas[number].briefing.record(),
            block.view,
            block.feedback,
            endings_of(meant, program),
        )

    def _take(self, event: Event) -> None:
        progress = self._progress
        match event["event"]:
            case "study":
                own = header_of(self._loaded, self._arenas)
                if event["study"] != own["study"] or event["programs"] != own["programs"]:
                    raise UsageError(
                        f"{self._file}: is of another study, or of other versions of its scenarios; expected "
                        f"{own['study']!r} with the scenarios as they are now"
                    )
                self._simulated, self._begun = bool(event.get("simulated")), event["time"]
            case "server":
                self._server += 1
            case "joined":
                self._of[event["participant"]] = _Of()
            case "answered":
                self._answers(event)
            case "gone":
                self._of[event["participant"]].left += 1
        progress.apply(event)
        match event["event"]:
            case "episode":
                game = progress.games[event["game"]]
                arena = self._arenas[game.block]
                if event["room"] != progress.rooms(game)[event["number"]]:
                    raise ValueError(
                        f"got the room {event['room']}, expected {progress.rooms(game)[event['number']]}"
                    )
                env, asking = arena.take(), Asking(self._loaded.played[game.block], arena.program)
                fired = dict(env.counters()["rules"])
                episode = Episode(arena, {}, env, [asking])
                episode.begin(reset_of(game.block, event["room"]))
                self._going[game.id] = _Going(episode, event["time"], asking, fired)
            case "step":
                self._step(progress.games[event["game"]], event)
            case "ended":
                self._ended(progress.games[event["game"]], event)

    def _step(self, game: Game, event: Event) -> None:
        going = self._going[game.id]
        episode = going.episode
        if event["t"] != episode.t or event["episode"] != len(game.results):
            raise ValueError(f"got step {event['t']} of episode {event['episode']}, expected {episode.t}")
        episode.step(event["acts"])
        going.chosen.update(seat for seat, by in event["by"].items() if by == PERSON)
        for seat in episode.arena.seats:
            who, time = game.seats.get(seat, "script"), event["times"].get(seat, {})
            person = who if who in self._progress.people else ""
            if time and person and game.block != PRACTICE:
                self._of[person].times.append(time["acted"] - time["shown"])
            action = event["acts"][seat]
            self._rows["steps"].append(
                {
                    "participant": person,
                    "game": game.id,
                    "trial": event["episode"] + 1,
                    "seat": seat,
                    "heard": "\n".join(line for t, line in episode.heard[seat] if t == episode.t),
                    "action": "" if action is None else " ".join(map(str, action)),
                    **done_on(seat, event, episode.arena.actions),
                    "reply": "\n".join(one["reply"] for one in event.get("replies", {}).get(seat, ())),
                    "missed": event.get("missed", {}).get(seat, ""),
                    "mono": event["mono"],
                    "server": self._server,
                }
            )

    def _ended(self, game: Game, event: Event) -> None:
        going = self._going.pop(game.id)
        episode = going.episode
        came = episode.ending
        if came is None or (came.outcome, came.success, came.returns) != (
            event["outcome"],
            event["success"],
            event["returns"],
        ):
            raise ValueError(f"the episode came out as {came}, and the log says {event['outcome']!r}")
        self._replayed += 1
        self._rules(game, event, going)
        people = {seat: who for seat, who in game.seats.items() if who in self._progress.people}
        for seat, who in people.items():
            of, gone = self._of[who], who in game.gone
            if game.block != PRACTICE:
                of.episodes += 1
            person = self._progress.people[who]
            others = [f"{other}={one}" for other, one in game.seats.items() if other != seat]
            self._rows["episodes"].append(
                {
                    "participant": who,
                    "game": game.id,
                    "block": block_name(self._loaded, game.block),
                    "scenario": self._loaded.played[game.block].name,
                    "program": self._arenas[game.block].program.sha256,
                    "position": self._progress.position(person, game),
                    "trial": event["episode"] + 1,
                    "room": game.episode.room if game.episode is not None else "",
                    "seat": seat,
                    "others": shlex.join(others),
                    "steps": episode.t,
                    "own_steps": going.chosen[seat],
                    "stood_in": sum(
                        episode.t - going.chosen[s] for s, other in people.items() if other != who
                    ),
                    "utterances": going.asking.utterances[0][seat],
                    "success": event["success"][seat],
                    "outcome": event["outcome"],
                    "return": event["returns"][seat],
                    "left": gone,
                    "began": going.began,
                    "ended": event["time"],
                }
            )
            place = {"participant": who, "game": game.id, "trial": event["episode"] + 1, "seat": seat}
            self._rows["asked"] += [{**place, **one._asdict()} for one in going.asking.answers[0][seat]]
        self._arenas[game.block].give(episode.env)

    def _rules(self, game: Game, event: Event, going: _Going) -> None:
        """How often each rule has fired in an episode, as far as it has."""
        counted = going.episode.env.counters()["rules"].items()
        times = {name: count - going.fired.get(name, 0) for name, count in counted}
        self._rows["rules"] += [
            {"game": game.id, "trial": event["episode"] + 1, "rule": name, "times": count}
            for name, count in times.items()
            if count
        ]

    def _answers(self, event: Event) -> None:
        _, block = self._progress.stage(self._progress.people[event["participant"]])
        study = self._loaded.study
        kinds = {
            q.id: q.kind for q in (study.questions if block == PRACTICE else study.blocks[block].questions)
        }
        self._rows["answers"] += [
            {
                "participant": event["participant"],
                "block": "" if block == PRACTICE else block_name(self._loaded, block),
                "question": name,
                "kind": kinds[name],
                "answer": answer,
                "time": event["time"],
            }
            for name, answer in event["answers"].items()
        ]

    def _participant(self, person: Participant) -> Row:
        of, pay = self._of[person.id], self._loaded.study.pay
        order = [] if person.group is None else self._loaded.design.orders[person.group - 1]
        paid = round(pay.base + self._progress.bonus(person), 2) if pay is not None and person.ended else ""
        return {
            "participant": person.id,
            "group": person.group or "",
            "agreed_at": person.agreed_at or "",
            "order": " ".join(str(number + 1) for number in order),
            "began": person.began or "",
            "ended": person.ended or "",
            "practice_rounds": person.rounds,
            "practised": "" if person.practised is None else person.practised,
            "episodes": of.episodes,
            "successes": person.won,
            "median_ms": round(median(of.times), 1) if of.times else "",
            "pages_opened": person.connections,
            "left": of.left,
            "paid": paid,
            "excluded": "; ".join(self._reasons(person, of)),
        }

    def _reasons(self, person: Participant, of: _Of) -> Iterable[str]:
        rules = self._loaded.study.exclude
        if person.simulated:
            yield "simulated"
        if rules.unfinished and not person.ended:
            yield "declined" if person.declined else "unfinished"
        if rules.practice and person.practised is False:
            yield "practice"
        if rules.success_below is not None and person.won < rules.success_below * of.episodes:
            yield f"success below {rules.success_below:g}"
        if rules.faster_than is not None and of.times and median(of.times) < rules.faster_than:
            yield f"faster than {rules.faster_than} ms"


def reset_of(block: int, room: int) -> dict[str, Any]:
    """The arguments of `env.reset` for a room of a block."""
    return {"seed": room} if block == PRACTICE else {"options": {"test_episode": [room]}}


def tell_of(loaded: LoadedStudy, number: int) -> Tell | None:
    """What those who play a block, or practice, are told of the task; None: the instructions, if there are some."""
    if number == PRACTICE:
        return None if loaded.study.practice is None else loaded.study.practice.tell
    return loaded.study.blocks[number].tell


def header_of(loaded: LoadedStudy, arenas: Mapping[int, Arena]) -> dict[str, Any]:
    """What the first event of a log says of the study, whoever takes part, and wherever it lies."""
    words = [loaded.study.model_dump(mode="json"), loaded.consent, loaded.instructions]
    digest = hashlib.sha256(json.dumps(words, sort_keys=True).encode()).hexdigest()
    programs = {block_name(loaded, number): arena.program.sha256 for number, arena in arenas.items()}
    return {"format": FORMAT, "study": loaded.study.study, "digest": digest, "programs": programs}


def study_file(loaded: LoadedStudy, folder: Path) -> str:
    """Where the file of a study lies, as seen from the folder of its log, so that both can be moved together."""
    try:
        return Path(os.path.relpath(loaded.resolved.path, folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return loaded.resolved.path.as_posix()


def study_of(folder: Path) -> Path:
    """The file of the study whose log lies in a folder.

    Raises:
        OSError: the log cannot be read.
        UsageError: the log does not say it, or the file is not there.
        UnreadableError: the log is damaged.
    """
    log = folder / FILE
    begun = next(read_log(log), None)
    if begun is None:
        raise UsageError(f"{log}: nobody has come yet")
    if not isinstance(begun.get("file"), str):
        raise UsageError(
            f"{log}: does not say which file it is of; expected a log with the name of its study's file"
        )
    file = Path(os.path.normpath(folder.resolve() / begun["file"]))
    if not file.is_file():
        raise UsageError(
            f"{log}: is of the study {display_name(file)}, which is not there; put it back, or move both together"
        )
    return file
