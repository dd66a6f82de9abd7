"""Reads the folder of an experiment: conditions and runs in whatever state they are.

A report has to be made of what is there. So nothing in a run's folder is an error: what is missing or cannot be read
is a problem of that run, which the report names.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, TypeVar

import pandas as pd
from pydantic import TypeAdapter, ValidationError

from socialai_dsl.errors import UnreadableError
from socialai_dsl.experiments.folder import RUNS
from socialai_dsl.experiments.folder import read_experiment as read_document
from socialai_dsl.experiments.record import ConditionEntry, ExperimentRecord, Record, RunEntry
from socialai_dsl.model_options import ModelOptions
from socialai_dsl.reporting.episodes import (
    NO_ANSWERS,
    NO_EPISODES,
    NO_REACTIONS,
    read_answers,
    read_episodes,
)
from socialai_dsl.reporting.records import (
    CrossPlayRecord,
    DilemmaRecord,
    DilemmasRecord,
    Figures,
    PublishedRecord,
    ResultRecord,
    StartRecord,
    StatusRecord,
    StudyRecord,
    UpdateRecord,
    WordsRecord,
    described,
)
from socialai_dsl.reporting.seeds import read_updates
from socialai_dsl.runs.folder import (
    CONFIG,
    CROSSPLAY,
    DILEMMAS,
    METRICS,
    RESULT,
    SCENARIO,
    STARTS,
    STATUS,
    TESTS,
    WORDS,
    Run,
)
from socialai_dsl.trainer.config import (
    HYPER,
    LEARNS,
    PARTNERS_FOLDER,
    WITHOUT_EFFECT,
    RunConfig,
    configure,
    scenario_in,
)

Content = TypeVar("Content")

_FIGURES: Final[Mapping[str, tuple[type[Record], str]]] = {
    CROSSPLAY: (CrossPlayRecord, "socialai crossplay --out"),
    WORDS: (WordsRecord, "socialai words --out"),
    DILEMMAS: (DilemmasRecord, "socialai check --pictures"),
}
"""Files of figures besides those of runs: what they hold, and which command writes them."""

_SIZES: Final = ("envs", "precision")
"""Options with a flag of their own that are numbers or words of the trainer."""

_RESULT: Final = TypeAdapter(ResultRecord)
_STATUS: Final = TypeAdapter(StatusRecord)
_TESTS: Final = TypeAdapter[Mapping[str, Figures]](dict[str, Figures])
_SETTINGS: Final = TypeAdapter(dict[str, Any])


@dataclass(frozen=True)
class RunRecord:
    """A run, as far as it came.

    Attributes:
        id, seed: which. folder: where it lies.
        state: `done`, `running`, `waiting`, `failed`, `cancelled`; `stopped` if it says that it runs and no process
            works on it; `missing` where there is no folder.
        message: what its status says.
        result: of a finished run. episodes: those of the test set, where the run lists them, answers: those that its
            player got in them, reactions: of a person; see `episodes`.
        tests: scenario -> figures of its further tests.
        frames: made so far. digest: of its configuration without the seed; empty if it has none.
        starts: in what surroundings it ran.
        problems: what could not be read, in words.
    """

    id: str
    seed: int
    folder: Path
    state: str
    message: str = ""
    result: ResultRecord | None = None
    episodes: pd.DataFrame = field(default_factory=lambda: NO_EPISODES)
    answers: pd.DataFrame = field(default_factory=lambda: NO_ANSWERS)
    reactions: pd.DataFrame = field(default_factory=lambda: NO_REACTIONS)
    tests: Mapping[str, Figures] = field(default_factory=dict)
    frames: int = 0
    digest: str = ""
    starts: tuple[StartRecord, ...] = ()
    problems: tuple[str, ...] = ()

    @property
    def figures(self) -> Figures | None:
        """Of its test episodes, if it is done."""
        return self.result.eval if self.result is not None else None

    @property
    def rooms(self) -> pd.Series:
        """Success by room of the test set, where the episodes are listed."""
        return self.episodes.groupby("room").success.mean().astype(float)

    def updates(self) -> list[UpdateRecord] | None:
        """Its learning curve; None where there is none that can be read."""
        try:
            return read_updates(self.folder / METRICS)
        except (OSError, ValueError):
            return None


@dataclass(frozen=True)
class Condition:
    """Runs that differ in nothing but their seed, or people who played the same in a study.

    Attributes:
        entry: what it is. runs: of a study, one for each person.
        study: the name of the study that people took part in; empty of runs.
        simulated: whether these are no people but simulated participants of a rehearsal.
    """

    entry: ConditionEntry
    runs: tuple[RunRecord, ...]
    study: str = ""
    simulated: bool = False

    @property
    def done(self) -> tuple[RunRecord, ...]:
        """The runs that have a result."""
        return tuple(run for run in self.runs if run.result is not None)

    @property
    def rooms(self) -> pd.Series:
        """Success in each room: the mean over finished runs, if all list it; of people, over those who played it."""
        listed = [run.rooms for run in self.done]
        join = "outer" if self.study else "inner"
        return pd.concat(listed, axis=1, join=join).mean(axis=1) if listed else pd.Series(dtype=float)


@dataclass(frozen=True)
class Experiment:
    """What a report is about.

    Attributes:
        name, profile, about: as the experiment says; name and about of a list of runs say that it is one.
        source_sha256: digest of the experiment's file, empty if there is none.
        conditions: in the order of the file.
        crossplays: of scenarios with several seats, who played how well with whom. words: what was said there.
        dilemmas: what those who cooperate and those who defect are paid there.
        studies: what else is known of those whose people are among the conditions.
        humans: scenario -> figures of people that its file names as published.
    """

    name: str
    profile: str
    about: str
    source_sha256: str
    conditions: tuple[Condition, ...]
    crossplays: tuple[CrossPlayRecord, ...] = ()
    words: tuple[WordsRecord, ...] = ()
    dilemmas: tuple[DilemmaRecord, ...] = ()
    studies: tuple[StudyRecord, ...] = ()
    humans: Mapping[str, Sequence[PublishedRecord]] = field(default_factory=dict)

    @property
    def scenarios(self) -> list[str]:
        """The scenarios of its conditions, each once."""
        return list(dict.fromkeys(condition.entry.scenario for condition in self.conditions))

    @property
    def runs(self) -> list[RunRecord]:
        """All runs, each once, also where several conditions have it; people are none."""
        conditions = [condition for condition in self.conditions if not condition.study]
        return list({run.id: run for condition in conditions for run in condition.runs}.values())


def read_experiment(folder: Path) -> Experiment:
    """Read an experiment's folder.

    Raises:
        OSError: `experiment.json` cannot be read.
        UnreadableError: there is none, or it is damaged or of another format.
    """
    record = ExperimentRecord.model_validate(read_document(folder))
    entries: dict[str, list[RunEntry]] = {entry.name: [] for entry in record.conditions}
    for run in record.runs:
        entries[run.condition].append(run)
    conditions = tuple(
        Condition(
            entry, tuple(_read_run(folder / RUNS / run.id, run.id, run.seed) for run in entries[entry.name])
        )
        for entry in record.conditions
    )
    return Experiment(record.name, record.profile, record.about, record.source_sha256, conditions)


def read_runs(folders: Sequence[Path]) -> Experiment:
    """Take runs that belong to no experiment: what differs in nothing but the seed is one condition.

    Raises:
        ValueError: a folder is not that of a run.
    """
    grouped: dict[tuple[str, str, str, int | None, str], list[tuple[dict[str, Any], RunRecord]]] = {}
    called = [folder.name for folder in folders]
    for folder in folders:
        settings = _settings(folder, [])
        if settings is None or not isinstance(settings.get("scenario"), str):
            raise ValueError(
                f"{folder}: expected the folder of a run, with its {CONFIG}, of a study, with its log, or of cross-play"
            )
        seed = settings.get("seed")
        name = folder.name if called.count(folder.name) == 1 else folder.as_posix()
        run = _read_run(folder, name, seed if isinstance(seed, int) else 0)
        column = ", ".join([_column(settings), *_granted(run.result)])
        digests = _files_digest(folder, SCENARIO, "*.y*ml"), _networks_digest(folder, settings, run.result)
        key = str(settings["scenario"]), digests[0], column, _frames_asked(settings), digests[1]
        grouped.setdefault(key, []).append((settings, run))
    conditions = []
    for (scenario, digest, column, frames, networks), members in grouped.items():
        settings, first = members[0]
        row = scenario.removeprefix(f"{SCENARIO}/")
        alike = [key for key in grouped if (key[0], key[2]) == (scenario, column)]
        if len({key[1] for key in alike}) > 1:
            row += f" ({digest[:6]})"  # another file of the same name
        if len({key[3] for key in alike}) > 1:
            column += f", {frames or 0:,} frames"
        if networks and len({key[4] for key in alike}) > 1:
            column += f" ({networks[:6]})"  # other networks of the same name
        entry = ConditionEntry(
            name=f"{row} / {column}",
            row=row,
            column=column,
            scenario=scenario_in(first.folder, scenario),
            agent=str(settings.get("agent", LEARNS)),
            frames=frames,
            tests=sorted({test for _, run in members for test in run.tests}),
        )
        conditions.append(
            Condition(entry, tuple(sorted((run for _, run in members), key=lambda r: (r.seed, r.id))))
        )
    if not folders:
        return Experiment("several players", "", "", "", ())
    names = f"{len(folders)} runs" if len(folders) > 1 else "one run"
    return Experiment(names, "", "Runs that were given one by one.", "", tuple(conditions))


def read_figures(path: Path) -> list[Record]:
    """What `crossplay`, `words` and `check --pictures` wrote into a folder or a file; nothing of other folders.

    Raises:
        OSError: it cannot be read.
        UnreadableError: it is damaged, or something else.
    """
    if path.is_dir():
        return [_figures(path / name, name) for name in _FIGURES if (path / name).exists()]
    return [_figures(path, path.name)] if path.exists() else []


def with_figures(experiment: Experiment, figures: Sequence[Record]) -> Experiment:
    """An experiment, beside which such figures are shown."""
    return replace(
        experiment,
        crossplays=tuple(one for one in figures if isinstance(one, CrossPlayRecord)),
        words=tuple(one for one in figures if isinstance(one, WordsRecord)),
        dilemmas=tuple(one for all_ in figures if isinstance(all_, DilemmasRecord) for one in all_.dilemmas),
    )


def _figures(file: Path, name: str) -> Record:
    """The record that a file of this name holds; those of a cross-play may have another one."""
    record, command = _FIGURES.get(name, _FIGURES[CROSSPLAY])
    try:
        return record.model_validate_json(file.read_bytes())
    except ValidationError as error:
        raise UnreadableError(f"{file}: expected what `{command}` writes; {described(error)}") from None


def _files_digest(folder: Path, below: str, names: str) -> str:
    """Of copies that the folder keeps, of scenarios or of networks, which tells those apart that have one name."""
    digest = hashlib.sha256()
    for file in sorted((folder / below).rglob(names)):
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def _networks_digest(folder: Path, settings: Mapping[str, Any], result: ResultRecord | None) -> str:
    """Of the networks that played and were there before; one that learnt is another one for each seed."""
    learnt = settings.get("agent", LEARNS) == LEARNS
    own = result.network_sha256 if result is not None and not learnt else ""
    others = _files_digest(folder, PARTNERS_FOLDER, "*") if (folder / PARTNERS_FOLDER).is_dir() else ""
    return hashlib.sha256(f"{own} {others}".encode()).hexdigest() if own or others else ""


def _frames_asked(settings: Mapping[str, Any]) -> int | None:
    """The frames that a run trains for; None where nobody is trained."""
    frames = settings.get("frames")
    return frames if isinstance(frames, int) and frames > 0 else None


def _column(settings: Mapping[str, Any]) -> str:
    """Who played, and what of it is not the default."""
    who = str(settings.get("agent", LEARNS))
    named = str(settings.get("algorithm", who)) if who == LEARNS else who
    return ", ".join([named, *unusual(settings), *_partners(settings.get("seats"))])


def _partners(seats: Any) -> Iterator[str]:
    """Who had other seats, each by member; several take turns."""
    if isinstance(seats, Mapping):
        for seat, names in seats.items():
            players = [_label(str(name)) for name in names] if isinstance(names, list) else []
            yield f"{seat} by {' or '.join(players)}"


def _label(player: str) -> str:
    """What somebody is called; a network's copy has its seat and place before its name."""
    is_copy = Path(player).parts[:1] == (PARTNERS_FOLDER,)
    return Path(player).stem.split("-", 2)[-1] if is_copy else player


def _granted(result: ResultRecord | None) -> Iterator[str]:
    """What makes another condition of a player: what it was told and saw, and how its actions came about.

    A person's session is as long as it is.
    """
    if result is not None:
        if result.tell == "goal":
            yield f'told "{result.told}"' if isinstance(result.told, str) and result.told else "told a goal"
        elif result.tell != "nothing":
            yield f"told {result.tell}" + (f" ({result.language})" if result.language else "")
        if result.eval.rooms != "test":
            yield f"rooms of {result.eval.rooms}"
        if result.view != "seat":
            yield f"sees the {result.view}"
        if result.greedy or (result.kind == "model" and result.eval.actions != ModelOptions().manner):
            yield result.eval.actions
        if result.trials > 1 and result.kind != "person":
            yield f"{result.trials} trials"


def unusual(settings: Mapping[str, Any]) -> list[str]:
    """Which of a run's options are not the default and make it another condition, each as it is shown."""
    try:
        config = RunConfig.model_validate_json(json.dumps(settings))
    except ValidationError:
        return []
    named = [f"net {config.net}"] if config.net != "fast" else []
    named += [f"recipe {config.recipe}"] if config.recipe != "plain" else []
    told, words = (
        configure(config.recipe, net=config.net).model_dump(),
        ("bonus", "curriculum", "guide", "aux"),
    )
    counts = [name for name in (*words, *_SIZES, *HYPER) if name not in WITHOUT_EFFECT]
    chosen = [name for name in counts if getattr(config, name) != told[name]]
    return named + [
        f"{name} {getattr(config, name)}" if name in words else f"{name}={getattr(config, name)}"
        for name in chosen
        if not (name == "bonus_c" and "bonus" in chosen)
    ]


def _read_run(folder: Path, name: str, seed: int) -> RunRecord:
    if not folder.is_dir():
        return RunRecord(name, seed, folder, "missing")
    problems: list[str] = []
    status = _read(folder / STATUS, _STATUS, problems)
    result = _read(folder / RESULT, _RESULT, problems)
    settings = _settings(folder, problems)
    frames = result.frames if result is not None else _frames_so_far(folder / METRICS, problems)
    trials, session = (1, 1) if result is None else (result.trials, result.session)
    return RunRecord(
        name,
        seed,
        folder,
        _state(folder, status, result, frames),
        message=(status.message or "") if status is not None else "",
        result=result,
        episodes=read_episodes(folder, trials, session, problems),
        answers=read_answers(folder, problems),
        tests=_read(folder / TESTS, _TESTS, problems) or {},
        frames=frames,
        digest=_digest(settings) if settings is not None else "",
        starts=_starts(folder / STARTS),
        problems=tuple(problems),
    )


def _state(folder: Path, status: StatusRecord | None, result: ResultRecord | None, frames: int) -> str:
    """What the status says, unless whoever wrote it is gone; without a status, what the files tell."""
    if status is not None:
        is_left = status.state == "running" and Run(folder).was_left
        return "stopped" if is_left else status.state
    if result is not None:
        return "done"
    return "running" if frames else "waiting"


def _read(path: Path, form: TypeAdapter[Content], problems: list[str]) -> Content | None:
    """A JSON file; None if there is none, or, with a problem, none that can be read."""
    try:
        return form.validate_json(path.read_bytes())
    except FileNotFoundError:
        return None
    except OSError as error:
        problems.append(f"{path.name} cannot be read ({error.strerror})")
    except ValidationError as error:
        problems.append(f"{path.name} is damaged ({described(error)})")
    return None


def _settings(folder: Path, problems: list[str]) -> dict[str, Any] | None:
    found: list[str] = []
    settings = _read(folder / CONFIG, _SETTINGS, found)
    if settings is None:
        problems.append(f"{CONFIG} is missing or damaged")
    return settings


def _frames_so_far(metrics: Path, problems: list[str]) -> int:
    """Frames of a run without a result."""
    try:
        return read_updates(metrics)[-1].frames
    except FileNotFoundError:
        return 0
    except OSError as error:
        problems.append(f"{metrics.name} cannot be read ({error.strerror})")
    except ValueError as error:
        problems.append(str(error).replace(f"{metrics}", metrics.name))
    return 0


def _starts(path: Path) -> tuple[StartRecord, ...]:
    """The lines that are whole; a killed process may have left others."""
    starts = []
    with contextlib.suppress(OSError):
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            with contextlib.suppress(ValidationError):
                starts.append(StartRecord.model_validate_json(line))
    return tuple(starts)


def _digest(settings: Mapping[str, Any]) -> str:
    """SHA-256 of a configuration without its seed."""
    content = json.dumps(_without_seed(settings), sort_keys=True, ensure_ascii=False, separators=(",", ":"))
    return hashlib.sha256(content.encode()).hexdigest()


def _without_seed(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_seed(part) for key, part in value.items() if key != "seed"}
    return value
