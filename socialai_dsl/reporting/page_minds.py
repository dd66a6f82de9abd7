"""The parts of a report where minds of every kind stand beside each other, and what studies asked their people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import zip_longest
from math import isnan
from statistics import mean, stdev
from typing import Any, Final

from socialai_dsl.reporting.analysis import Section, Summary
from socialai_dsl.reporting.minds import NOBODY, Mind, Rate
from socialai_dsl.reporting.records import PublishedRecord, QuestionRecord, ResultRecord, StudyRecord
from socialai_dsl.reporting.statistics import clustered_rate
from socialai_dsl.reporting.written import NONE, Rows, count_of, figure, interval

_MOST: Final = 10
"""Orders, and utterances, that a table shows; the files have all."""
_SHOWN_TRIALS: Final = 12
"""Trials whose times a table shows."""

Minds = list[tuple[str, Mind]]
"""Those of a scenario that list their episodes, by what they are called there."""


def players_rows(section: Section) -> Rows:
    """What kind of mind plays in each condition, and what it was granted; nothing where trained agents alone play."""
    rows, kinds = [], set[str]()
    for summary in section.summaries:
        for result in [run.result for run in summary.condition.done if run.result is not None][:1]:
            kind = "simulated person" if summary.condition.simulated else result.kind
            kinds.add(kind or "network")
            rows.append(
                {
                    "condition": summary.name,
                    "kind of mind": kind or NONE,
                    "told": "\n".join([result.tell, *_told(result)]),
                    "saw": _saw(result),
                    "remembers": "\n".join(_remembers(result)),
                    "told of outcomes": {"outcome": "yes", "none": "no"}.get(result.feedback, NONE),
                }
            )
    return rows if kinds - {"network"} else []


def _told(result: ResultRecord) -> list[str]:
    """The words that the player was told, by member of a suite."""
    if isinstance(result.told, str):
        return [result.told] if result.told else []
    return [f"{member}: {words}" for member, words in result.told.items()]


def _saw(result: ResultRecord) -> str:
    forms = {"both": ", in a picture and in words", "picture": ", in a picture", "words": ", in words"}
    return ("the room" if result.view == "room" else "its seat's view") + forms.get(result.form, "")


def _remembers(result: ResultRecord) -> Iterator[str]:
    """How many episodes a player remembers, and how much of them a request to a language model has."""
    yield "one episode" if result.trials == 1 else f"{result.trials} episodes"
    if result.kind == "model":
        had = "all of it" if result.history is None else f"the last {count_of(result.history, 'observation')}"
        yield f"a request has {had}"


def trials_rows(summary: Summary) -> Iterator[dict[str, str]]:
    """Success by trial, over all sessions, people or seeds."""
    mind = summary.mind
    if len(mind.episodes):
        rates = {trial: mind.rate(trial) for trial in mind.trials}
        for trial, rate in rates.items() if len(rates) > 1 else ():
            success = _with_interval(rate)
            yield _trial(summary, trial, rate.episodes, success)
        return
    found = [run.figures.trials for run in summary.condition.done if run.figures is not None]
    for number, trials in enumerate(zip_longest(*found), 1):
        played = [trial for trial in trials if trial is not None]
        episodes = sum(trial.episodes for trial in played)
        successes = sum(trial.success_rate * trial.episodes for trial in played)
        yield _trial(summary, number, episodes, f"{successes / episodes:.3f}")


def _trial(summary: Summary, trial: int, episodes: int, success: str) -> dict[str, str]:
    return {"condition": summary.name, "trial": str(trial), "episodes": f"{episodes:,}", "success": success}


def _with_interval(rate: Rate) -> str:
    """A rate, with its interval in smaller print."""
    if rate.interval is None:
        return f"{rate.success:.3f}"
    return interval(rate.interval).replace(" [", "\n[").replace(", ", ",\u00a0")


# -- scenario by scenario ----------------------------------------------------------------------------------------------


def minds_parts(
    anchor: str,
    section: Section,
    humans: Mapping[str, Sequence[PublishedRecord]],
    drawings: Mapping[str, bytes],
) -> list[dict[str, Any]]:
    """Of each scenario what its minds did; nothing where trained agents alone play."""
    if not players_rows(section):
        return []
    found = []
    for place, (row, members) in enumerate(section.by("row").items(), start=1):
        listed = [summary for summary in members if len(summary.mind.episodes)]
        minds = [(summary.column, summary.mind) for summary in listed]
        published = [
            one for summary in members[:1] for one in humans.get(summary.condition.entry.scenario, ())
        ]
        if not minds and not published:
            continue
        drawing = f"{anchor}-trials{place}"
        found.append(
            {
                "row": row,
                "drawing": drawing if drawing in drawings else "",
                "success": _success(minds),
                "endings": _endings(listed),
                "asked": _asked(minds),
                "orders": _orders(minds),
                "exchanges": _exchanges(minds),
                "times": _times(minds),
                "humans": [_human(one) for one in published],
            }
        )
    return found


def _success(minds: Minds) -> Rows:
    """Success with its interval, what it is of, and steps, a column for each mind."""
    if not minds:
        return []
    rates = {name: mind.rate() for name, mind in minds}
    of = {name: mind.of for name, mind in minds}
    lines: dict[str, Callable[[str], str]] = {
        "success": lambda name: _with_interval(rates[name]),
        "episodes": lambda name: f"{rates[name].episodes:,}",
        "of": lambda name: _clusters(rates[name], of[name]),
        "steps, mean": lambda name: NONE if isnan(rates[name].steps) else f"{rates[name].steps:.1f}",
    }
    return [{"": line, **{name: cell(name) for name, _ in minds}} for line, cell in lines.items()]


def _clusters(rate: Rate, of: str) -> str:
    """What the episodes come in, such as `12 people`."""
    if of == "episodes":
        return ""
    return f"{rate.clusters:,} {'person' if of == 'people' and rate.clusters == 1 else of}"


def _endings(summaries: Sequence[Summary]) -> Rows:
    """In which share of the episodes each outcome came, the most frequent first."""
    shares = {summary.column: summary.mind.endings for summary in summaries}
    texts = {name: one.text for summary in summaries for name, one in summary.endings.items()}
    names = _by_weight(shares.values())
    return [
        {
            "ended by": texts.get(name, name),
            **{column: _share(found.get(name, 0.0)) if found else NONE for column, found in shares.items()},
        }
        for name in names
    ]


def _asked(minds: Minds) -> Rows:
    """Whom they asked first and at all; nothing where nobody answered anybody."""
    known = [(name, mind) for name, mind in minds if mind.knows_answers]
    found = {name: {row["by"]: row for row in mind.asked()} for name, mind in known}
    if not any(found.values()):
        return []
    nobody = {name: float((mind.orders == NOBODY).mean()) for name, mind in known}
    rows = []
    for by in _by_weight(
        {by: row["first"] + row["share_of_episodes"] for by, row in one.items()} for one in found.values()
    ):
        cells = {}
        for name, answered in found.items():
            one = answered.get(by, {"first": 0.0, "share_of_episodes": 0.0})
            cells[name] = f"{_share(one['first'])}\n{_share(one['share_of_episodes'])} at all"
        rows.append({"asked first": by, **cells})
    return [*rows, {"asked first": "nobody", **{name: _share(share) for name, share in nobody.items()}}]


def _orders(minds: Minds) -> Rows:
    """The orders of distinct persons."""
    found = {
        name: {row["order"]: row["share"] for row in mind.sequences()}
        for name, mind in minds
        if mind.knows_answers
    }
    names = _by_weight(found.values())
    if names in ([], [NOBODY]):
        return []
    return [
        {"in which order": order, **{name: _share(shares.get(order, 0.0)) for name, shares in found.items()}}
        for order in names[:_MOST]
    ]


def _exchanges(minds: Minds) -> Rows:
    """Which utterance was answered by whom, how often an episode."""
    found: dict[str, Counter[tuple[str, str]]] = {}
    for name, mind in minds:
        if mind.knows_answers:
            found[name] = Counter()
            for row in mind.exchanges():
                found[name][row["said"], row["by"]] += row["per_episode"]
    return [
        {"said": said, "answered by": by, **{name: f"{times[said, by]:.2f}" for name, times in found.items()}}
        for said, by in _by_weight(found.values())[:_MOST]
    ]


def _times(minds: Minds) -> Rows:
    """How long people took for an act: median and quartiles, over all trials and by trial."""
    found = {name: {row["trial"]: row for row in mind.reaction_times()} for name, mind in minds}
    found = {name: rows for name, rows in found.items() if rows}
    trials = sorted({trial for rows in found.values() for trial in rows if trial is not None})[:_SHOWN_TRIALS]
    return [
        {
            "trial": "all" if trial is None else str(trial),
            **{name: _quartiles(rows.get(trial)) for name, rows in found.items()},
        }
        for trial in ([None, *trials] if found else [])
    ]


def _quartiles(row: Mapping[str, Any] | None) -> str:
    if row is None:
        return NONE
    return f"{row['median_ms']:,.0f} ms\n[{row['q1_ms']:,.0f}, {row['q3_ms']:,.0f}]"


def _by_weight(shares: Any) -> list[Any]:
    """The keys of several mappings, those with the greatest sum first."""
    sums: Counter[Any] = Counter()
    for one in shares:
        sums.update(one)
    return [
        name for name, weight in sorted(sums.items(), key=lambda one: (-one[1], str(one[0]))) if weight > 0
    ]


def _share(share: float) -> str:
    return f"{share:.2f}"


def _human(one: PublishedRecord) -> dict[str, str]:
    """A figure of people that a scenario's file names, with Wilson's interval of that many people."""
    did = round(one.share * one.n)
    rate = clustered_rate([1] * did + [0] * (one.n - did), [1] * one.n)
    shown = f"{one.share:.2f}" + (f"\n[{rate.low:.3f},\u00a0{rate.high:.3f}]" if rate is not None else "")
    return {"people": one.who, "did": one.did, "share": shown, "of": str(one.n), "source": one.source}


# -- studies -----------------------------------------------------------------------------------------------------------


def study_part(anchor: str, study: StudyRecord) -> dict[str, Any]:
    """Who took part in a study, and what they answered; texts stand in a file of their own."""
    left_out = ", ".join(f"{count} {reason}" for reason, count in study.excluded.items())
    who = "simulated participants" if study.simulated else "people"
    return {
        "anchor": anchor,
        "title": f"Study: {study.name}" + (" (simulated)" if study.simulated else ""),
        "simulated": study.simulated,
        "lead": f"{study.joined:,} {who} came, and {study.counted:,} of them count"
        + (f"; left out by the study's own rules: {left_out}." if left_out else "."),
        "questions": [row for question in study.questions for row in _question(question)],
        "texts": sum(len(one.answers) for one in study.questions if one.kind == "text"),
    }


def _question(question: QuestionRecord) -> Iterator[dict[str, str]]:
    """The answers to a question: of a scale mean and spread, of a choice the share of each option."""
    given = list(question.answers.values())
    asked = "\n".join(filter(None, (question.ask, question.block and f"behind {question.block}")))
    if question.kind == "scale":
        numbers = [float(one) for one in given]
        spread = stdev(numbers) if len(numbers) > 1 else None
        ends = f" ({question.ends[0]} to {question.ends[1]})" if question.ends else ""
        answer = f"{question.start} to {question.to}{ends}"
        said = figure(mean(numbers) if numbers else None, spread, 2)
        yield {"question": asked, "answer": answer, "share, or mean ± sd": said, "answers": f"{len(given):,}"}
    elif question.kind == "choice":
        counts = Counter(given)
        for option in question.options:
            share = f"{counts[option] / len(given):.2f}" if given else NONE
            yield {
                "question": asked,
                "answer": option,
                "share, or mean ± sd": share,
                "answers": f"{counts[option]:,} of {len(given):,}",
            }
