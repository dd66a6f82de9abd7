"""The tables of a report for other programs: a data frame for each CSV file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pandas as pd

from socialai_dsl.reporting.analysis import THRESHOLDS, Analysis, Summary
from socialai_dsl.reporting.collect import Condition, RunRecord
from socialai_dsl.reporting.records import CrossPlayRecord, QuestionRecord, StudyRecord, WordsRecord
from socialai_dsl.reporting.statistics import mean_interval


def tables(analysis: Analysis) -> dict[str, pd.DataFrame]:
    """Name of a table -> the table; docs/reports.md lists them."""
    conditions, sections = analysis.experiment.conditions, analysis.sections
    minds = [summary for summary in analysis.summaries if len(summary.mind.episodes)]
    known = [summary for summary in minds if summary.mind.knows_answers]
    studies = analysis.experiment.studies
    rows = {
        "runs": [
            _run(condition, run) for condition in conditions if not condition.study for run in condition.runs
        ],
        "conditions": [_condition(summary) for summary in analysis.summaries],
        "published": [one for section in sections for one in section.published],
        "comparisons": [one for section in sections for one in section.comparisons],
        "carried": [_carried(summary, test) for summary in analysis.summaries for test in summary.tests],
        "rooms": [one for section in sections for one in section.rooms],
        "outcomes": [row for condition in conditions for row in _outcomes(condition)],
        "results_by": [row for condition in conditions for row in _results_by(condition)],
        "seats": [row for condition in conditions for row in _seats(condition)],
        "minds": [_mind(summary) for summary in minds],
        "trials": [_trial(summary, trial) for summary in minds for trial in summary.mind.trials],
        "people": [
            _person(summary, run)
            for summary in minds
            for run in summary.condition.runs
            if summary.condition.study
        ],
        "asked": [{**_who(summary), **row} for summary in known for row in summary.mind.asked()],
        "orders": [{**_who(summary), **row} for summary in known for row in summary.mind.sequences()],
        "exchanges": [{**_who(summary), **row} for summary in known for row in summary.mind.exchanges()],
        "times": [{**_who(summary), **row} for summary in minds for row in summary.mind.reaction_times()],
        "answers": [row for study in studies for row in _answers(study)],
        "free_text": [row for study in studies for row in _free_text(study)],
        "humans": [
            {"scenario": scenario, **one.model_dump()}
            for scenario, published in analysis.experiment.humans.items()
            for one in published
        ],
        "crossplay": [row for one in analysis.experiment.crossplays for row in _pairs(one)],
        "words": [row for one in analysis.experiment.words for row in _said(one)],
    }
    return {name: pd.DataFrame(some, dtype=object) for name, some in rows.items()}


def _place(condition: Condition) -> dict[str, Any]:
    entry = condition.entry
    named = {name: getattr(entry, name) for name in ("group", "row", "column", "scenario", "agent")}
    return {"condition": entry.name, **named}


def _carried(summary: Summary, test: str) -> dict[str, Any]:
    there, carried = summary.tests[test], summary.carried(test)
    return {
        **_place(summary.condition),
        "test": test,
        "seeds_done": len(there),
        "success_mean": summary.success.mean() if len(summary.success) else None,
        "test_mean": there.mean() if len(there) else None,
        "test_std": there.std() if len(there) > 1 else None,
        "carried_mean": carried.mean() if len(carried) else None,
        "carried_std": carried.std() if len(carried) > 1 else None,
    }


def _run(condition: Condition, run: RunRecord) -> dict[str, Any]:
    figures, result = run.figures, run.result
    told = figures.model_dump() if figures else {}
    return {
        **_place(condition),
        "id": run.id,
        "seed": run.seed,
        "state": run.state,
        "frames": run.frames,
        **{name: told.get(name) for name in ("success_rate", "mean_return", "mean_length")},
        "test_episodes": told.get("episodes"),
        **{name: told.get(name) for name in ("replies", "invalid_replies")},
        "tokens": figures.prompt_tokens + figures.completion_tokens if figures else None,
        "cost": told.get("cost"),
        "train_seconds": result.train_seconds if result else None,
        "frames_per_second": result.frames_per_second if result else None,
        "tests": "; ".join(f"{name}={one.success_rate:.6g}" for name, one in run.tests.items()),
        "program_sha256": result.program_sha256 if result else None,
        "config_sha256": run.digest or None,
        "problems": "; ".join(run.problems),
    }


def _condition(summary: Summary) -> dict[str, Any]:
    success, reference = summary.success, summary.condition.entry.reference
    low, high = mean_interval(list(success)) or (None, None)
    return {
        **_place(summary.condition),
        "row": summary.row,
        "column": summary.column,
        "study": summary.condition.study or None,
        "simulated": summary.condition.simulated,
        "seeds": len(summary.condition.runs),
        "seeds_done": len(success),
        "success_mean": success.mean() if len(success) else None,
        "success_std": success.std() if len(success) > 1 else None,
        "success_low": low,
        "success_high": high,
        "published_mean": reference.mean if reference else None,
        "published_std": reference.std if reference else None,
        "published_n": reference.n if reference else None,
        "published_source": reference.source if reference else None,
        "area_mean": summary.areas.mean() if len(summary.areas) else None,
        **{
            f"seeds_reaching_{level:.2f}": sum(frames is not None for frames in summary.reached(level))
            for level in THRESHOLDS
        },
        "tests": "; ".join(
            f"{name}={rates.mean():.6g}" for name, rates in summary.tests.items() if len(rates)
        ),
        "too_short": "; ".join(summary.short),
    }


def _results_by(condition: Condition) -> list[dict[str, Any]]:
    """Success in the test episodes with each value of a draw by which results are told apart, by run."""
    return [
        {
            "condition": condition.entry.name,
            "id": run.id,
            "seed": run.seed,
            "draw": draw,
            "value": value,
            "test_episodes": part.episodes,
            "success_rate": part.success_rate,
        }
        for run in condition.done
        for draw, values in (run.figures.results_by if run.figures is not None else {}).items()
        for value, part in values.items()
    ]


def _seats(condition: Condition) -> list[dict[str, Any]]:
    """Success of each seat of a scenario with several, by run."""
    return [
        {
            "condition": condition.entry.name,
            "id": run.id,
            "seed": run.seed,
            "seat": seat,
            "test_episodes": part.episodes,
            "success_rate": part.success_rate,
        }
        for run in condition.done
        if run.result is not None
        for seat, part in run.result.by_seat.items()
    ]


def _pairs(crossplay: CrossPlayRecord) -> list[dict[str, Any]]:
    """Success of each seat with each pair of players."""
    return [
        {
            "scenario": crossplay.scenario,
            "seat": seat,
            "agent": cell.agent,
            "others": cell.others,
            "test_episodes": cell.episodes,
            "success_rate": cell.success,
            "success_low": cell.interval[0],
            "success_high": cell.interval[1],
        }
        for seat, found in crossplay.seats.items()
        for cell in found.cells
    ]


def _said(words: WordsRecord) -> list[dict[str, Any]]:
    """How often each seat says what where something has a value, and how much its messages tell of that."""
    return [
        {
            "scenario": words.scenario,
            "seat": seat,
            "player": found.player,
            "test_episodes": words.episodes,
            "situation": one.name,
            "value": value,
            "message": message,
            "episodes": count,
            **(
                dict.fromkeys(("bits", "possible", "chance", "p"))
                if one.told is None
                else one.told.model_dump()
            ),
        }
        for seat, found in words.seats.items()
        for one in found.situations
        for value, said in one.said.items()
        for message, count in said.items()
    ]


def _outcomes(condition: Condition) -> list[dict[str, Any]]:
    """How often each outcome ended an episode and each rule fired in one, by run."""
    rows = []
    for run in condition.done:
        assert run.figures is not None, "internal: a run that is done has figures"
        endings = {ending.outcome: ending for ending in run.figures.endings}
        who = {
            "condition": condition.entry.name,
            "id": run.id,
            "seed": run.seed,
            "simulated": condition.simulated,
        }
        for kind, rates in (("outcome", run.figures.outcomes), ("rule", run.figures.rules)):
            for name, rate in rates.items():
                ending = endings.get(name) if kind == "outcome" else None
                place = {"file": getattr(ending, "file", None), "line": getattr(ending, "line", None)}
                rows.append({**who, "kind": kind, "name": name, "per_episode": rate, **place})
    return rows


# -- minds, and studies ------------------------------------------------------------------------------------------------


def _who(summary: Summary) -> dict[str, Any]:
    """Whose figures a row has."""
    condition = summary.condition
    return {
        "condition": summary.name,
        "scenario": condition.entry.scenario,
        "kind": summary.mind.kind or None,
        "study": condition.study or None,
        "simulated": condition.simulated,
    }


def _mind(summary: Summary) -> dict[str, Any]:
    result = next(run.result for run in summary.condition.done if run.result is not None)
    return {
        **_who(summary),
        "tell": result.tell,
        "view": result.view,
        "form": result.form or None,
        "remembers": result.trials,
        "history": result.history,
        "feedback": result.feedback or None,
        "clusters_are": summary.mind.of,
        **summary.mind.rate().row(),
        "program_sha256": result.program_sha256,
    }


def _trial(summary: Summary, trial: int) -> dict[str, Any]:
    return {
        **_who(summary),
        "trial": trial,
        "clusters_are": summary.mind.of,
        **summary.mind.rate(trial).row(),
    }


def _person(summary: Summary, run: RunRecord) -> dict[str, Any]:
    """A person's episodes of a condition, in figures."""
    times, episodes = run.reactions.ms.astype(float), run.episodes
    return {
        **_who(summary),
        "participant": run.id,
        "episodes": len(episodes),
        "success": float(episodes.success.mean()),
        "mean_steps": float(episodes.steps.mean()),
        "utterances_per_episode": float(episodes.utterances.mean()),
        "median_ms": float(times.median()) if len(times) else None,
    }


def _answers(study: StudyRecord) -> Iterator[dict[str, Any]]:
    """How often each answer was given to a question, and of scales mean and sample standard deviation."""
    for question in study.questions:
        if question.kind == "text":
            continue
        given = list(question.answers.values())
        scale = question.kind == "scale"
        numbers = pd.Series(given if scale else [], dtype=float)
        options = range(question.start or 0, (question.to or 0) + 1) if scale else question.options
        for option in options:
            count = given.count(option)
            yield {
                **_asked_by(study, question),
                "answer": str(option),
                "times": count,
                "share": count / len(given) if given else None,
                "mean": numbers.mean() if len(numbers) else None,
                "std": numbers.std() if len(numbers) > 1 else None,
            }


def _free_text(study: StudyRecord) -> list[dict[str, Any]]:
    """What people answered in their own words."""
    return [
        {**_asked_by(study, question), "participant": person, "answer": answer}
        for question in study.questions
        if question.kind == "text"
        for person, answer in question.answers.items()
    ]


def _asked_by(study: StudyRecord, question: QuestionRecord) -> dict[str, Any]:
    return {
        "study": study.name,
        "simulated": study.simulated,
        "block": question.block or None,
        "question": question.name,
        "kind": question.kind,
    }
