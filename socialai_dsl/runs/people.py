"""People who took part in studies, as conditions of a report: one for each block and seat, beside those of runs."""

from __future__ import annotations

import shlex
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.errors import UsageError
from socialai_dsl.frontend import load_study
from socialai_dsl.study.exported import is_exported, read_exported
from socialai_dsl.study.log import FILE
from socialai_dsl.study.replay import PlayedBlock, Row, StudyData, study_data, study_of

if TYPE_CHECKING:  # these load pandas, which is only there if reports were asked for
    from socialai_dsl.experiments.record import ConditionEntry
    from socialai_dsl.reporting.collect import Condition, Experiment, RunRecord
    from socialai_dsl.reporting.records import Figures, QuestionRecord, StudyRecord

_A_PERSON: Final = "a person"
_IN_PART: Final = "in part by stand-ins"


def is_study(folder: Path) -> bool:
    """Whether a folder holds the log of a study, or tables that were made from one."""
    return (folder / FILE).is_file() or is_exported(folder)


@dataclass(frozen=True)
class _Study:
    """A study whose log was played again, now or when its tables were written.

    Attributes:
        name: by which the report tells it from others. folder: of its log or its tables. data: its tables.
    """

    name: str
    folder: Path
    data: StudyData

    def counted(self) -> dict[str, Row]:
        """The participants whom the study's rules do not leave out, by id."""
        rows = self.data.tables["participants"]
        return {row["participant"]: row for row in rows if not row["excluded"]}


def with_people(experiment: Experiment, folders: Sequence[Path]) -> tuple[Experiment, list[str]]:
    """An experiment with the people of studies among its conditions, and remarks.

    A study that cannot be believed is left out, with a remark. Every episode is played again first.

    Args:
        experiment: runs; those of the same compiled scenario share a row with people.
        folders: of the studies, each with its log.
    """
    studies, remarks = _read(folders)
    found: list[Condition] = []
    for study in studies:
        made, said = _conditions(study, experiment, several=len(studies) > 1)
        found += made
        remarks += said
    named = tuple(_record(study) for study in studies)
    return replace(experiment, conditions=(*experiment.conditions, *found), studies=named), remarks


def _read(folders: Sequence[Path]) -> tuple[list[_Study], list[str]]:
    """The studies that can be believed, and why others cannot."""
    found: list[_Study] = []
    remarks = []
    for folder in dict.fromkeys(path.resolve() for path in folders):
        try:
            data = (
                study_data(load_study(study_of(folder)), folder)
                if (folder / FILE).is_file()
                else read_exported(folder)
            )
            same = next(
                (one for one in found if (one.name, one.data.begun) == (data.study, data.begun)), None
            )
            if same is not None:
                remarks.append(f"study in {folder.name} left out: {same.folder.name} has the same people")
                continue
            found.append(_Study(data.study, folder, data))
        except ScenarioError as error:
            first = error.diagnostics[0]
            remarks.append(
                f"study in {folder.name} left out: {first.span.file}:{first.span.line}: {first.message}"
            )
        except (UsageError, OSError) as error:
            remarks.append(f"study in {folder.name} left out: {error}")
    called = Counter(study.name for study in found)
    for name in (name for name, count in called.items() if count > 1):
        remarks.append(f"{called[name]} studies are called {name!r}; they are told apart by their folders")
    return [
        replace(one, name=f"{one.name} in {one.folder.name}") if called[one.name] > 1 else one
        for one in found
    ], remarks


# -- conditions --------------------------------------------------------------------------------------------------------

_Place = tuple[str, str, str]
"""A block, a seat, and who had the others, as `_Beside.others` says it."""


def _conditions(study: _Study, experiment: Experiment, several: bool) -> tuple[list[Condition], list[str]]:
    from socialai_dsl.reporting.collect import Condition

    people, found, remarks = study.counted(), [], []
    places: defaultdict[_Place, defaultdict[str, list[Row]]] = defaultdict(lambda: defaultdict(list))
    beside = _Beside(study)
    for row in study.data.tables["episodes"]:
        if row["participant"] in people and not row["left"]:
            place = row["block"], row["seat"], beside.others(row)
            places[place][row["participant"]].append(row)
    for block in study.data.blocks:
        own = {place: some for place, some in places.items() if place[0] == block.name}
        if not own:
            remarks.append(
                f"study {study.name}: nobody who counts has played {block.name} to the end of an episode"
            )
            continue
        same = [one for one in experiment.conditions if block.program in _programs(one)]
        if not same and experiment.conditions:
            remarks.append(_unpaired(study, block, experiment))
        alike = sum(one.program == block.program for one in study.data.blocks)
        for place, played in own.items():
            column = _column(study, place, several, alike > 1)
            entry = _entry(block, column, same[0].entry if same else None)
            runs = tuple(
                _person(study, block, person, rows, beside) for person, rows in sorted(played.items())
            )
            found.append(Condition(entry, runs, study.name, study.data.simulated))
    if study.data.unended:
        have = (
            "episode has not ended, and does"
            if study.data.unended == 1
            else "episodes have not ended, and do"
        )
        remarks.append(f"study {study.name}: {study.data.unended} {have} not count")
    return found, list(dict.fromkeys(remarks))


def _programs(condition: Condition) -> set[str]:
    return {run.result.program_sha256 for run in condition.done if run.result is not None}


def _unpaired(study: _Study, block: PlayedBlock, experiment: Experiment) -> str:
    """Why people of a block share no row with runs."""
    from socialai_dsl.reporting.style import scenario_name

    name = scenario_name(block.shown)
    if name in map(scenario_name, experiment.scenarios):
        return f"study {study.name}: the runs played another version of {name}, so rooms are not paired"
    return f"study {study.name}: no run has the scenario {name}"


def _column(study: _Study, place: _Place, several: bool, by_block: bool) -> str:
    """What these people are called beside other minds."""
    block, seat, others = place
    named = [study.name] if several else []
    named += [block] if by_block else []
    named += [f"as {seat}"] if others and seat != "agent" else []
    named += [others] if others else []
    who = "simulated people" if study.data.simulated else "people"
    return f"{who} ({', '.join(named)})" if named else who


def _entry(block: PlayedBlock, column: str, same: ConditionEntry | None) -> ConditionEntry:
    from socialai_dsl.experiments.record import ConditionEntry
    from socialai_dsl.reporting.style import scenario_name

    row = scenario_name(block.shown) if same is None else same.row or same.name
    return ConditionEntry(
        name=f"{row} / {column}",
        row=row,
        column=column,
        group=None if same is None else same.group,
        scenario=block.scenario if same is None else same.scenario,
        agent="person",
    )


class _Beside:
    """What the tables say of each episode besides its end."""

    def __init__(self, study: _Study) -> None:
        self._ids = {row["participant"] for row in study.data.tables["participants"]}
        self.asked: defaultdict[tuple[str, str, int], list[Row]] = defaultdict(list)
        self.reactions: defaultdict[tuple[str, str, int], list[float]] = defaultdict(list)
        self.rules: defaultdict[tuple[str, int], dict[str, int]] = defaultdict(dict)
        for row in study.data.tables["asked"]:
            self.asked[row["participant"], row["game"], row["trial"]].append(row)
        for row in study.data.tables["steps"]:
            if row["reaction_ms"] != "":
                self.reactions[row["participant"], row["game"], row["trial"]].append(row["reaction_ms"])
        for row in study.data.tables["rules"]:
            self.rules[row["game"], row["trial"]][row["rule"]] = row["times"]

    def others(self, row: Row) -> str:
        """Who had the other seats of an episode, in words, and whether somebody stood in for a person in it."""
        pairs = (one.partition("=") for one in shlex.split(row["others"]))
        words = [f"{seat} by {_A_PERSON if who in self._ids else who}" for seat, _, who in pairs]
        stood_in = row["stood_in"] or row["own_steps"] < row["steps"]
        return ", ".join([*words, *([_IN_PART] if stood_in else [])])


def _person(
    study: _Study, block: PlayedBlock, person: str, rows: Sequence[Row], beside: _Beside
) -> RunRecord:
    """A person's episodes of a block, as a report takes a run."""
    from socialai_dsl.reporting.collect import RunRecord
    from socialai_dsl.reporting.episodes import ANSWER_COLUMNS, EPISODE_COLUMNS, REACTION_COLUMNS, table_of
    from socialai_dsl.reporting.records import ResultRecord

    ordered = sorted(rows, key=lambda row: row["trial"])
    episodes = [
        (
            number,
            row["room"],
            row["trial"],
            row["game"] if _A_PERSON in beside.others(row) else person,
            int(row["success"]),
            row["outcome"],
            row["steps"],
            row["utterances"],
        )
        for number, row in enumerate(ordered)
    ]
    asked, reactions = [], []
    for number, row in enumerate(ordered):
        key = person, row["game"], row["trial"]
        asked += [(number, one["step"], one["said"], one["by"], one["answer"]) for one in beside.asked[key]]
        reactions += [(row["trial"], ms) for ms in beside.reactions[key]]
    told = {key: value for key, value in block.briefing.items() if key in ("tell", "told", "language")}
    return RunRecord(
        person,
        int(person.lstrip("p")),
        study.folder,
        "done",
        result=ResultRecord(
            kind="person",
            **told,
            form=block.view,
            feedback=block.feedback,
            trials=max(row["trial"] for row in ordered),
            seat=ordered[0]["seat"],
            eval=_figures(block, ordered, beside),
            program_sha256=block.program,
        ),
        episodes=table_of(EPISODE_COLUMNS, episodes),
        answers=table_of(ANSWER_COLUMNS, asked),
        reactions=table_of(REACTION_COLUMNS, reactions),
    )


def _figures(block: PlayedBlock, rows: Sequence[Row], beside: _Beside) -> Figures:
    from socialai_dsl.reporting.records import EndingRecord, Figures, PartFigures

    count, ended = len(rows), Counter(row["outcome"] for row in rows)
    fired: Counter[str] = Counter()
    for row in rows:
        fired.update(beside.rules[row["game"], row["trial"]])
    trials: defaultdict[int, list[bool]] = defaultdict(list)
    for row in rows:
        trials[row["trial"]].append(row["success"])
    return Figures(
        episodes=count,
        success_rate=fmean(row["success"] for row in rows),
        mean_length=fmean(row["steps"] for row in rows),
        mean_return=fmean(row["return"] for row in rows),
        outcomes={one.name: ended[one.name] / count for one in block.endings},
        endings=[
            EndingRecord(
                outcome=one.name,
                success=one.success,
                text=one.text,
                file=one.file,
                line=one.line,
                share=ended[one.name] / count,
            )
            for one in block.endings
        ],
        rules={name: times / count for name, times in fired.items()},
        trials=[PartFigures(episodes=len(won), success_rate=fmean(won)) for _, won in sorted(trials.items())],
    )


# -- studies -----------------------------------------------------------------------------------------------------------


def _record(study: _Study) -> StudyRecord:
    from socialai_dsl.reporting.records import StudyRecord

    rows = study.data.tables["participants"]
    counted = study.counted()
    return StudyRecord(
        name=study.name,
        simulated=study.data.simulated,
        joined=len(rows),
        counted=len(counted),
        excluded=Counter(row["excluded"] for row in rows if row["excluded"]),
        unended=study.data.unended,
        questions=_questions(study, counted),
    )


def _questions(study: _Study, counted: Mapping[str, Any]) -> list[QuestionRecord]:
    """The questions of a study in the order of its file, with the answers of those who count."""
    from socialai_dsl.reporting.records import QuestionRecord

    given: defaultdict[str, dict[str, str | int]] = defaultdict(dict)
    for row in study.data.tables["answers"]:
        if row["participant"] in counted:
            given[row["question"]][row["participant"]] = row["answer"]
    return [
        QuestionRecord(
            block=block,
            name=question.id,
            ask=question.ask,
            kind=question.kind,
            options=tuple(question.options or ()),
            start=question.start,
            to=question.to,
            ends=tuple(question.ends or ()),
            answers=given[question.id],
        )
        for block, question in study.data.questions
    ]
