"""The data of a study: every episode is played again and has to come out as it did; then tables with a codebook."""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, Final

from socialai_dsl.atomic import write_json, write_text
from socialai_dsl.checking.studies import PRACTICE, LoadedStudy
from socialai_dsl.errors import UnreadableError, UsageError
from socialai_dsl.schema.study import PERSON
from socialai_dsl.study.arena import Arena, Episode
from socialai_dsl.study.live import header_of, reset_of
from socialai_dsl.study.log import FILE, Event, read_log
from socialai_dsl.study.progress import Game, Participant, Progress, done_on

Row = dict[str, Any]

COLUMNS: Final[dict[str, dict[str, str]]] = {
    "participants": {
        "participant": "id; names nobody",
        "group": "of the design, from 1; empty for who did not agree",
        "agreed_at": "origin of the page that says that they agreed; empty for the study's own page",
        "order": "numbers of the blocks in the order in which the group plays them, from 1",
        "began": "when they agreed, UTC",
        "ended": "when they came to the end, UTC; empty for who did not",
        "practice_rounds": "rounds of practice",
        "practised": "whether practice reached its criterion",
        "episodes": "episodes that count and ended",
        "successes": "those that were a success of their seat",
        "median_ms": "median time from a picture to the act, milliseconds of the page's clock",
        "pages_opened": "how often the page was opened",
        "left": "how often they left a game with somebody else",
        "paid": "base and bonus in the study's currency; empty for who did not finish",
        "excluded": "why the study's rules mark them as excluded; empty for who is not",
    },
    "episodes": {
        "participant": "id",
        "game": "those who play together have the same",
        "block": "name of the block, or practice",
        "scenario": "what is played, with variants and parameters",
        "program": "SHA-256 of what was compiled from it",
        "position": "place of the block in the participant's order, from 1; 0 of practice",
        "trial": "episode in the block or round, from 1",
        "room": "number in the test set, or in practice the seed",
        "seat": "that the participant has",
        "others": "who has the other seats, as seat=who",
        "steps": "steps of the episode",
        "own_steps": "steps that the participant chose",
        "success": "whether it was a success of the seat",
        "outcome": "the scenario's own name of the ending",
        "return": "sum of the seat's rewards",
        "left": "whether the participant had left at the end of the episode",
        "began": "UTC",
        "ended": "UTC",
    },
    "steps": {
        "participant": "id; empty where no participant has the seat",
        "game": "see episodes",
        "trial": "see episodes",
        "step": "from 1",
        "seat": "whose act it is",
        "by": "person, or who played the seat instead: script, random, nobody or an agent",
        "movement": "what was done; empty for standing still; unknown of scripts that play by themselves",
        "said": "what was said",
        "heard": "lines that the seat heard in the step, one behind another",
        "action": "numbers of the action; empty where the script played by itself",
        "shown_ms": "when the picture was shown, milliseconds of the page's clock, which begins with each page",
        "acted_ms": "when the act was chosen, by the same clock",
        "reaction_ms": "acted_ms - shown_ms",
        "connection": "which of the participant's pages it was, from 1",
        "time": "when the server took the step, UTC",
        "mono": "the same in seconds since the server was started, which never go back",
        "server": "number of that start, from 1",
    },
    "answers": {
        "participant": "id",
        "block": "name of the block behind which it was asked; empty at the end",
        "question": "name of the question",
        "kind": "text, choice or scale",
        "answer": "as it was given",
        "time": "UTC",
    },
}
"""Table -> column -> what it holds."""


@dataclass
class _Of:
    """What the log says of a participant besides where they are."""

    times: list[float] = field(default_factory=list)
    episodes: int = 0
    left: int = 0


@dataclass(frozen=True)
class _Going:
    """An episode that is played again: when it began, and how many steps a person chose on each seat."""

    episode: Episode
    began: str
    chosen: Counter[str] = field(default_factory=Counter)


@dataclass(frozen=True)
class StudyData:
    """The tables of a study.

    Attributes:
        tables: name -> rows, in the columns of `COLUMNS`.
        replayed: how many episodes were played again, and how many of them had not ended.
    """

    tables: Mapping[str, Sequence[Row]]
    replayed: int
    unended: int


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
            number: Arena(one, None, loaded.study.language) for number, one in loaded.played.items()
        }
        self._progress = Progress(loaded)
        self._rows: dict[str, list[Row]] = {name: [] for name in COLUMNS}
        self._going: dict[str, _Going] = {}
        self._of: dict[str, _Of] = {}
        self._server, self._replayed = 0, 0

    def made(self) -> StudyData:
        for number, event in enumerate(read_log(self._file), start=1):
            try:
                self._take(event)
            except (KeyError, ValueError, AssertionError) as error:
                if isinstance(error, UsageError):
                    raise
                raise UnreadableError(
                    f"{self._file}:{number}: the event {event.get('event')!r} cannot have come here: {error}"
                ) from None
        for person in self._progress.people.values():
            self._rows["participants"].append(self._participant(person))
        return StudyData(self._rows, self._replayed, len(self._going))

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
                env = arena.take()
                episode = Episode(arena, {}, reset_of(game.block, event["room"]), env)
                self._going[game.id] = _Going(episode, event["time"])
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
            done = done_on(seat, event, episode.arena.actions)
            row = {
                "participant": person,
                "game": game.id,
                "trial": event["episode"] + 1,
                "seat": seat,
                "heard": "\n".join(line for t, line in episode.heard[seat] if t == episode.t),
                "action": "" if action is None else " ".join(map(str, action)),
                **done,
                "mono": event["mono"],
                "server": self._server,
            }
            self._rows["steps"].append({column: row[column] for column in COLUMNS["steps"]})

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
        for seat, who in game.seats.items():
            if who not in self._progress.people:
                continue
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
                    "others": " ".join(others),
                    "steps": episode.t,
                    "own_steps": going.chosen[seat],
                    "success": event["success"][seat],
                    "outcome": event["outcome"],
                    "return": event["returns"][seat],
                    "left": gone,
                    "began": going.began,
                    "ended": event["time"],
                }
            )
        self._arenas[game.block].give(episode.env)

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


def block_name(loaded: LoadedStudy, number: int) -> str:
    """What a block, or practice, is called in the tables."""
    if number == PRACTICE:
        return "practice"
    return loaded.study.blocks[number].name or f"{loaded.played[number].name}_{number + 1}"


def write_data(data: StudyData, loaded: LoadedStudy, out: Path, parquet: bool = False) -> list[Path]:
    """Write the tables, in the layout of Psych-DS, with a codebook.

    Args:
        data: the tables.
        loaded: the study.
        out: the folder.
        parquet: whether Parquet files are written as well; this needs pyarrow.

    Returns:
        The files.

    Raises:
        OSError: they cannot be written.
        UsageError: pyarrow is not installed.
    """
    folder, name = out / "data", loaded.study.study.replace("_", "")
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for table, rows in data.tables.items():
        file = folder / f"study-{name}_table-{table}_data.csv"
        with open(file, "w", encoding="utf-8", newline="") as stream:
            writer = csv.DictWriter(stream, list(COLUMNS[table]))
            writer.writeheader()
            writer.writerows(rows)
        written.append(file)
    written += _parquet(data, folder, name) if parquet else []
    described = out / "dataset_description.json"
    write_json(described, _description(loaded))
    codebook = out / "codebook.md"
    write_text(codebook, _codebook(loaded))
    return [*written, described, codebook]


def _parquet(data: StudyData, folder: Path, name: str) -> list[Path]:
    try:
        import pyarrow as pa
        from pyarrow import parquet as pq
    except ImportError:
        raise UsageError("Parquet needs pyarrow: pip install 'socialai-dsl[parquet]'") from None
    written = []
    for table, rows in data.tables.items():
        columns = {}
        for column in COLUMNS[table]:
            values = [None if row[column] == "" else row[column] for row in rows]
            kinds = {type(value) for value in values if value is not None}
            columns[column] = pa.array(
                values if len(kinds) <= 1 else [None if v is None else str(v) for v in values]
            )
        file = folder / f"study-{name}_table-{table}_data.parquet"
        pq.write_table(pa.table(columns), file)
        written.append(file)
    return written


def _description(loaded: LoadedStudy) -> dict[str, Any]:
    """`dataset_description.json`, as Psych-DS has it."""
    measured = [
        {"@type": "PropertyValue", "name": column, "description": meaning}
        for columns in COLUMNS.values()
        for column, meaning in columns.items()
    ]
    unique = list({one["name"]: one for one in measured}.values())
    return {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": loaded.study.study,
        "description": loaded.study.about or f"Data of the study {loaded.study.study}.",
        "variableMeasured": unique,
    }


def _codebook(loaded: LoadedStudy) -> str:
    lines = [f"# {loaded.study.study}", "", loaded.study.about or "", ""]
    for table, columns in COLUMNS.items():
        lines += [f"## {table}", "", "| column | meaning |", "|---|---|"]
        lines += [f"| `{column}` | {meaning} |" for column, meaning in columns.items()] + [""]
    lines += ["## Questions", "", "| question | kind | asked |", "|---|---|---|"]
    asked = [*loaded.study.questions, *(q for block in loaded.study.blocks for q in block.questions)]
    for question in asked:
        words = json.dumps(question.ask, ensure_ascii=False)[1:-1].replace("|", "\\|")
        lines.append(f"| `{question.id}` | {question.kind} | {words} |")
    return "\n".join(lines) + "\n"
