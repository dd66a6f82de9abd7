"""A report as one HTML page: no script, nothing from elsewhere, everything from files escaped.

The template `page.html.jinja` has the words; this module makes the tables that stand between them.
"""

from __future__ import annotations

import base64
import math
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from itertools import zip_longest
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

import jinja2
import pandas as pd
from markupsafe import Markup

from socialai_dsl.baselines import Baselines, Level
from socialai_dsl.reporting.analysis import (
    RISING,
    SOLVED,
    THRESHOLDS,
    Analysis,
    Section,
    Summary,
)
from socialai_dsl.reporting.collect import RunRecord
from socialai_dsl.reporting.crossplay import matrix_size
from socialai_dsl.reporting.published import MARGIN
from socialai_dsl.reporting.records import (
    CrossPlayRecord,
    DilemmaRecord,
    Figures,
    PartFigures,
    Rate,
    ResultRecord,
    SeatWordsRecord,
    SituationRecord,
    WordsRecord,
)
from socialai_dsl.reporting.statistics import ALPHA, RESAMPLES, Estimate, mean_interval
from socialai_dsl.reporting.style import scenario_name
from socialai_dsl.runs.folder import REPLAY

_TITLES: Final[dict[str | None, str]] = {"table2": "Table 2", None: "Conditions"}
_MOST_TABLES: Final = 4
"""Situations whose tables stand open, of those that are told most of."""
_MOST_SAID: Final = 8
"""Messages that have a column of their own."""
_NONE: Final = "–"
_RULES_SHOWN: Final = 12
_DIGEST: Final = 12
_REM: Final = 6.3
"""Widths of the page for an inch of a figure."""

Rows = list[dict[str, Any]]
"""A table of the page: what stands under each heading, as text; lines after the first are smaller print."""


def render_page(analysis: Analysis, drawings: Mapping[str, bytes], version: str, place: Path) -> str:
    """The page. Figures are SVG images in it, in which a browser runs and loads nothing.

    Args:
        analysis: its figures.
        drawings: name -> SVG.
        version: of the package that makes it.
        place: the folder where it will lie.
    """
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    environment.filters |= {
        "spread": spread,
        "signed": signed,
        "count_of": count_of,
        "scenario_name": scenario_name,
    }
    template = environment.from_string(
        files("socialai_dsl.reporting").joinpath("page.html.jinja").read_text(encoding="utf-8")
    )
    images = {
        name: f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}" for name, svg in drawings.items()
    }
    sections = [
        _section(f"part{number}", section, drawings)
        for number, section in enumerate(analysis.sections, start=1)
    ]
    page = template.render(
        experiment=analysis.experiment,
        images=images,
        lead=_lead(analysis),
        remarks=list(_remarks(analysis)),
        sections=sections,
        crossplays=[
            _crossplay(f"crossplay{number}", found)
            for number, found in enumerate(analysis.experiment.crossplays, start=1)
        ],
        words=[
            _words(f"words{number}", found) for number, found in enumerate(analysis.experiment.words, start=1)
        ],
        dilemmas=[
            _dilemma(f"dilemma{number}", found)
            for number, found in enumerate(analysis.experiment.dilemmas, start=1)
        ],
        endings=[one for section in sections for one in section["endings"]],
        baselines=_baselines(analysis.baselines),
        runs=_runs(analysis, place),
        facts=_facts(analysis, version),
        identities=[
            _identity(summary, analysis.baselines.get(summary.condition.entry.scenario))
            for summary in analysis.summaries
        ],
        interval=_interval_example(analysis),
        alpha=ALPHA,
        margin=f"{MARGIN:.2f}",
        resamples=f"{RESAMPLES:,}",
        rising=RISING,
        solved=SOLVED,
        digest=_DIGEST,
    )
    return page + "\n"


# -- how figures are written -------------------------------------------------------------------------------------------


def spread(values: Sequence[float] | pd.Series) -> str:
    """Mean ± standard deviation; the mean alone of one seed; a dash without any."""
    known = pd.Series(values, dtype=float)
    return figure(known.mean(), known.std()) if len(known) else _NONE


def figure(mean: float | None, std: float | None, digits: int = 3) -> str:
    """Mean ± standard deviation; the mean alone where its deviation is unknown; a dash without any."""
    if mean is None:
        return _NONE
    known = std is not None and not math.isnan(std)
    return f"{mean:.{digits}f}" + (f" ± {std:.{digits}f}" if known else "")


def difference(one: Mapping[str, Any]) -> str:
    """A difference, with its interval where there is one."""
    if one["difference_low"] is None:
        return signed(one["difference"])
    return _interval(Estimate(*(one[f"difference{part}"] for part in ("", "_low", "_high"))), "+.3f")


def signed(value: float | None, form: str = "+.3f") -> str:
    """A number with a real minus sign, or a dash where there is none."""
    return _NONE if value is None or math.isnan(value) else format(value, form).replace("-", "\u2212")


def p_value(value: float | None) -> str:
    """A p, which is never 0; a dash without one."""
    return "< 0.0001" if value is not None and value < 1e-4 else signed(value, ".4f")


def count_of(number: int, noun: str) -> str:
    """`3 runs`, `1 run`."""
    return f"{number:,} {noun}" + ("" if number == 1 else "s")


def _interval(estimate: Estimate | None, form: str = ".3f") -> str:
    if estimate is None:
        return _NONE
    value, low, high = (signed(part, form) for part in estimate)
    return f"{value} [{low}, {high}]"


def _duration(seconds: float) -> str:
    if seconds < 60:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 3600 else f"{seconds / 3600:.1f} h"


# -- what there is -----------------------------------------------------------------------------------------------------


def _lead(analysis: Analysis) -> str:
    """What there is and what it says, in a few sentences of figures."""
    runs, summaries = analysis.experiment.runs, analysis.summaries
    several = _of_several(analysis)
    if several and not runs:
        return several
    states = Counter(_state_of(run) for run in runs)
    finished = states.pop("done", 0)
    others = f" ({', '.join(f'{count} {state}' for state, count in states.items())})" if states else ""
    trained = [run.result for run in runs if run.result is not None]
    frames, seconds = sum(r.frames for r in trained), sum(r.train_seconds for r in trained)
    parts = [
        f"{finished} of {len(runs)} runs done{others}, in {count_of(len(summaries), 'condition')}; "
        f"{frames:,} frames trained in {_duration(seconds)} of run time."
    ]
    verdicts = Counter(
        one["verdict"].partition(":")[0] for section in analysis.sections for one in section.published
    )
    if verdicts:
        listed = "; ".join(f"{verdict} ({count})" for verdict, count in verdicts.items())
        parts.append(f"Ours beside {count_of(verdicts.total(), 'published figure')}: {listed}.")
    tested = [c["p_bonferroni"] for s in analysis.sections for c in s.comparisons if c["p"] is not None]
    if tested:
        found = sum(p < ALPHA for p in tested)
        differs = "differs" if found == 1 else "differ"
        parts.append(
            f"Of {count_of(len(tested), 'comparison')}, {found} {differs} at p < {ALPHA} after correction."
        )
    short = sum(bool(s.short) for s in summaries)
    if short:
        parts.append(f"{count_of(short, 'condition')} {'is' if short == 1 else 'are'} too short to judge.")
    if several:
        parts.append(several)
    return " ".join(parts)


def _of_several(analysis: Analysis) -> str:
    """What there is of several players, in a sentence each."""
    kinds = (
        ("Cross-play", analysis.experiment.crossplays),
        ("Words", analysis.experiment.words),
        ("Dilemmas", analysis.experiment.dilemmas),
    )
    return " ".join(
        f"{kind} of {', '.join(scenario_name(one.scenario) for one in found)}."
        for kind, found in kinds
        if found
    )


def _state_of(run: RunRecord) -> str:
    if run.state == "done" and run.result is None:
        return "without a result"
    return "not begun" if run.state == "missing" else run.state


def _remarks(analysis: Analysis) -> Iterator[str]:
    """What is wrong with runs or conditions, if anything."""
    yield from analysis.notes
    for run in analysis.experiment.runs:
        failed = [run.message or "failed"] if run.state == "failed" else []
        if failed or run.problems:
            yield f"run {run.id}: {'; '.join([*failed, *run.problems])}"
    for summary in analysis.summaries:
        configurations = {run.digest for run in summary.condition.runs if run.digest}
        for what, values in (("configuration", configurations), ("program", set(_programs(summary)))):
            if len(values) > 1:
                yield f"{summary.name}: its runs are of {len(values)} different {what}s"


def _programs(summary: Summary) -> list[str]:
    digests = [run.result.program_sha256 for run in summary.condition.done if run.result is not None]
    return list(dict.fromkeys(digests))


# -- a table of conditions, or a case study ----------------------------------------------------------------------------


def _section(anchor: str, section: Section, drawings: Mapping[str, bytes]) -> dict[str, Any]:
    title = _TITLES[section.group] if section.is_table else f"Case study: {section.group}"
    columns = list(section.by("column"))
    grid = {
        row: [next((s for s in members if s.column == column), None) for column in columns]
        for row, members in section.by("row").items()
    }
    panels = list(section.panels.items())
    drawn = [(f"{anchor}-curves{place}", panel) for place, (panel, _) in enumerate(panels, start=1)]
    return {
        "anchor": anchor,
        "title": title,
        "columns": columns,
        "grid": grid,
        "published": [_published(one) for one in section.published],
        "published_tests": sum(one["p"] is not None for one in section.published),
        "probes": [row for summary in section.summaries for row in _probes(summary)],
        "tests": sum(one["p"] is not None for one in section.comparisons),
        "comparisons": [_comparison(one) for one in section.comparisons],
        "rooms": [_pairing(one) for one in section.rooms],
        "players": _players(section),
        "trials": [row for summary in section.summaries for row in _trials(summary)],
        "models": [row for summary in section.summaries for row in _replies(summary)],
        "iqm": _iqm(section),
        "curves": [(name, panel) for name, panel in drawn if name in drawings],
        "efficiency": [_efficiency(summary) for summary in section.summaries if summary.seeds is not None],
        "endings": [
            (
                panel if section.is_table else f"{title}: {panel}",
                [
                    _endings(f"{anchor}-endings{place}-{number}", s)
                    for number, s in enumerate(members, start=1)
                ],
            )
            for place, (panel, members) in enumerate(panels, start=1)
            if any(s.endings or s.seeds is not None for s in members)
        ],
    }


def _published(one: Mapping[str, Any]) -> dict[str, str]:
    test = f" on {scenario_name(one['test'])}" if one["test"] else ""
    of = f"\n{count_of(one['published_n'], 'seed')}" if one["published_n"] else ""
    return {
        "condition": "\n".join(filter(None, (one["condition"] + test, one["source"], one["note"]))),
        "verdict": one["verdict"].replace(": ", "\n"),
        "ours": figure(one["success_mean"], one["success_std"]) + f"\n{count_of(one['seeds'], 'seed')}",
        "published": figure(one["published_mean"], one["published_std"], 2) + of,
        "difference": difference(one).replace(" [", "\n[").replace(", ", ",\u00a0"),
        "p": p_value(one["p"]),
        "p corrected": p_value(one["p_bonferroni"]),
    }


def _probes(summary: Summary) -> Iterator[dict[str, Any]]:
    """What a language model knows when it is asked, beside what it does."""
    found: dict[str, Rows] = {}
    for run in summary.condition.done:
        for name, one in run.figures.probes.items() if run.figures is not None else ():
            chance = one.asked * (one.chance or 0.0)
            found.setdefault(name, []).append({"asked": one.asked, "right": one.right, "chance": chance})
    for name, rows in found.items():
        sums = pd.DataFrame(rows).sum()
        yield {
            "condition": summary.name,
            "probe": name,
            "asked": f"{sums.asked:.0f}",
            "right": f"{sums.right / sums.asked:.3f}" if sums.asked else _NONE,
            "by chance": f"{sums.chance / sums.asked:.3f}" if sums.asked else _NONE,
            "success": f"{summary.success.mean():.3f}",
        }


def _comparison(one: Mapping[str, Any]) -> dict[str, str]:
    adjusted = one["p_bonferroni"]
    found = "differs" if adjusted is not None and adjusted < ALPHA else "not shown to differ"
    return {
        "first": one["first"],
        "second": one["second"],
        "difference": signed(one["difference"]),
        "t": signed(one["welch_t"], "+.2f"),
        "df": signed(one["degrees_of_freedom"], ".1f"),
        "p": p_value(one["p"]),
        "p corrected": p_value(adjusted),
        "Hedges' g": signed(one["hedges_g"], "+.2f"),
        "verdict": "not testable" if adjusted is None else found,
    }


def _pairing(one: Mapping[str, Any]) -> dict[str, str]:
    counts = {name.replace("_", " "): f"{one[name]:,}" for name in ("rooms", "first_better", "second_better")}
    return {
        "first": one["first"],
        "second": one["second"],
        **counts,
        "difference": difference(one),
    }


def _players(section: Section) -> Rows:
    """What kind of mind plays in each condition, and what it was granted; nothing where trained agents alone play."""
    rows, kinds = [], set[str]()
    for summary in section.summaries:
        for result in [run.result for run in summary.condition.done if run.result is not None][:1]:
            kinds.add(result.kind or "network")
            rows.append(
                {
                    "condition": summary.name,
                    "kind of mind": result.kind or _NONE,
                    "told": "\n".join([result.tell, *_told(result)]),
                    "saw": "the room" if result.view == "room" else "its seat's view",
                    "remembers": "one episode" if result.trials == 1 else f"{result.trials} episodes",
                }
            )
    return rows if kinds - {"network"} else []


def _told(result: ResultRecord) -> list[str]:
    """The words that the player was told, by member of a suite."""
    if isinstance(result.told, str):
        return [result.told] if result.told else []
    return [f"{member}: {words}" for member, words in result.told.items()]


def _trials(summary: Summary) -> Iterator[dict[str, str]]:
    """Success by trial, over all sessions and seeds."""
    found = [run.figures.trials for run in summary.condition.done if run.figures is not None]
    for number, trials in enumerate(zip_longest(*found), 1):
        played = [trial for trial in trials if trial is not None]
        episodes = sum(trial.episodes for trial in played)
        successes = sum(trial.success_rate * trial.episodes for trial in played)
        yield {
            "condition": summary.name,
            "trial": str(number),
            "episodes": f"{episodes:,}",
            "success": f"{successes / episodes:.3f}",
        }


def _replies(summary: Summary) -> Iterator[dict[str, str]]:
    """What language models replied, and what it took."""
    found = [run.figures for run in summary.condition.done if run.figures and run.figures.replies]
    if not found:
        return
    table = pd.DataFrame([figures.model_dump() for figures in found])
    about = "about " if table.tokens_estimated.any() else ""
    yield {
        "condition": summary.name,
        "episodes": f"{table.episodes.sum():,}",
        "replies": f"{table.replies.sum():,}",
        "invalid": f"{table.invalid_replies.sum() / table.replies.sum():.1%}",
        "tokens read": f"{about}{table.prompt_tokens.sum():,}",
        "tokens written": f"{about}{table.completion_tokens.sum():,}",
        "cost": f"${table.cost.sum():.4f}" if table.cost.notna().all() else _NONE,
    }


def _iqm(section: Section) -> Rows:
    if all(one["rows"] < 2 for one in section.columns):
        return []
    common = f"of the {count_of(section.common_rows, 'row')} in common"
    return [
        {
            "column": one["column"],
            "rows": str(one["rows"]),
            "runs": str(one["runs"]),
            "interquartile mean": _interval(one["iqm"]),
            common: _interval(one["common"]),
        }
        for one in section.columns
    ]


def _efficiency(summary: Summary) -> dict[str, str]:
    reached = {f"{level:.0%}": _reached(summary.reached(level)) for level in THRESHOLDS}
    return {"condition": summary.name, "area": spread(summary.areas), **reached}


def _reached(frames: Sequence[float | None]) -> str:
    there = pd.Series(frames, dtype=float).dropna()
    if there.empty:
        return "never"
    median = there.median()
    said = f"{median / 1e6:.2f} M" if median >= 1e5 else f"{median:,.0f}"
    return f"{said}\n{len(there)} of {len(frames)}"


def _endings(drawing: str, summary: Summary) -> dict[str, Any]:
    """How episodes of a condition ended and which rules fired, by the line of the scenario's file."""
    done = [run.figures for run in summary.condition.done if run.figures is not None]
    outcomes = pd.DataFrame([figures.outcomes for figures in done]).fillna(0.0)
    rules = pd.DataFrame([figures.rules for figures in done]).fillna(0.0)
    ended = sorted(
        (name for name in outcomes if outcomes[name].mean() > 0),
        key=lambda name: (name not in summary.successes, -outcomes[name].mean()),
    )
    fired = sorted((name for name in rules if rules[name].mean() > 0), key=lambda name: -rules[name].mean())
    more = f" ({len(fired) - _RULES_SHOWN} more fired)" if len(fired) > _RULES_SHOWN else ""
    return {
        "name": summary.name,
        "drawing": drawing,
        "endings": [
            {"ended by": _ending(summary, name), "of the episodes": spread(outcomes[name])} for name in ended
        ],
        "results_by": _results_by(done),
        "rules": [
            {f"rule{more}": name, "firings per episode": spread(rules[name])} for name in fired[:_RULES_SHOWN]
        ],
    }


def _results_by(done: Sequence[Figures]) -> Rows:
    """Success with each value of the draws by which results are told apart."""
    found: dict[tuple[str, str], list[PartFigures]] = {}
    for figures in done:
        for draw, values in figures.results_by.items():
            for value, part in values.items():
                found.setdefault((draw, value), []).append(part)
    return [
        {
            "draw": draw,
            "value": value,
            "success": spread([part.success_rate for part in parts]),
            "test episodes": " or ".join(str(n) for n in sorted({part.episodes for part in parts})),
        }
        for (draw, value), parts in found.items()
    ]


def _ending(summary: Summary, name: str) -> str:
    ending = summary.endings.get(name)
    if ending is None:
        return name
    return f"{ending.text}\n{ending.file}:{ending.line}" if ending.file is not None else ending.text


# -- cross-play --------------------------------------------------------------------------------------------------------


def _crossplay(anchor: str, found: CrossPlayRecord) -> dict[str, Any]:
    """The matrices of a cross-play, the means in a table, and all pairs in another."""
    groups = list(enumerate(found.alike, start=1))
    recorded = any(cell.episodes != found.episodes for seat in found.seats.values() for cell in seat.cells)
    return {
        "recorded": recorded,
        "anchor": anchor,
        "title": f"Cross-play: {scenario_name(found.scenario)}",
        "episodes": found.episodes,
        "width": f"{matrix_size(found)[0] * _REM:.1f}rem",
        "drawings": [(f"{anchor}-{place}", _seats_text(seats)) for place, seats in groups],
        "means": [
            {
                "success of": _seats_text(seats),
                "with themselves": _rate(found.seats[seats[0]].with_themselves),
                "with others": _rate(found.seats[seats[0]].with_others),
            }
            for _, seats in groups
        ],
        "pairs": [
            {
                f"plays {next(iter(found.seats))}": cells[0].agent,
                "plays the others": cells[0].others,
                **({"test episodes": cells[0].episodes} if recorded else {}),
                **{
                    f"success of {_seats_text(seats)}": _rate(cell)
                    for (_, seats), cell in zip(groups, cells, strict=True)
                },
            }
            for cells in zip(*(found.seats[seats[0]].cells for _, seats in groups), strict=True)
        ],
    }


def _dilemma(anchor: str, found: DilemmaRecord) -> dict[str, Any]:
    """What those who cooperate and those who defect are paid, by how many others cooperate."""
    figures = found.schelling
    paid = zip(figures.cooperators, figures.defectors, strict=True)
    return {
        "anchor": anchor,
        "title": f"Dilemma: {scenario_name(found.scenario)}",
        "verdict": figures.verdict,
        "rows": [
            {
                "others who cooperate": str(others),
                f"those who cooperate ({figures.frames[0]})": f"{together:.3f}",
                f"those who defect ({figures.frames[1]})": f"{alone:.3f}",
            }
            for others, (together, alone) in enumerate(paid)
        ],
    }


def _words(anchor: str, found: WordsRecord) -> dict[str, Any]:
    """What each seat says: in a sentence, and in a table for each situation of which it tells."""
    return {
        "anchor": anchor,
        "title": f"Words: {scenario_name(found.scenario)}",
        "episodes": found.episodes,
        "seats": [_seat_words(seat, said) for seat, said in found.seats.items()],
        "left_out": ", ".join(found.left_out),
    }


def _seat_words(seat: str, found: SeatWordsRecord) -> dict[str, Any]:
    messages = list(found.messages)
    untold = [one.name for one in found.situations if one.told and not one.more_than_chance]
    told = [one for one in found.situations if one.more_than_chance]
    tables = [(_said_rows(one, messages), _told_of(one)) for one in told]
    alike = found.topographic
    return {
        "seat": seat,
        "lead": f"Played by {found.player}, success {found.success:.3f}. It speaks in {found.spoke:.0%} of the "
        f"episodes, {found.utterances:.1f} times in each on average."
        + (f" It says the same everywhere: {messages[0]}." if len(messages) == 1 else ""),
        "messages": [
            {"message": text, "share": f"{share:.3f}"}
            for text, share in list(found.messages.items())[:_MOST_SAID]
        ],
        "tables": tables[:_MOST_TABLES],
        "further": tables[_MOST_TABLES:],
        "untold": ", ".join(untold),
        "alike": None if alike is None else f"{alike.similarity:.2f} (p {alike.p:.3f})",
    }


def _said_rows(situation: SituationRecord, messages: Sequence[str]) -> Rows:
    """The share of each message where something has a value."""
    shown, rest = messages[:_MOST_SAID], messages[_MOST_SAID:]
    rows = []
    for value, said in situation.said.items():
        counts = {text: said.get(text, 0.0) for text in shown}
        if rest:
            counts["others"] = sum(said.get(text, 0.0) for text in rest)
        total = sum(said.values())
        shares = {text: f"{count / total:.2f}" if total else _NONE for text, count in counts.items()}
        rows.append({situation.name: value, **shares})
    return rows


def _told_of(situation: SituationRecord) -> str:
    told = situation.told
    assert told is not None, "internal: it is told of"
    names = " = ".join((situation.name, *situation.same))
    return (
        f"{names}: the messages tell {told.bits:.2f} of {told.possible:.2f} bits; those of other episodes up to "
        f"{told.chance:.2f} (95 %), p {told.p:.3f}."
    )


def _seats_text(seats: Sequence[str]) -> str:
    return " and ".join(seats)


def _rate(rate: Rate | None) -> str:
    return _NONE if rate is None else _interval(Estimate(rate.success, *rate.interval))


# -- where figures come from -------------------------------------------------------------------------------------------


def _baselines(baselines: Mapping[str, Baselines]) -> Rows:
    rows = [
        {
            "scenario": name,
            "own script": _level(one.script),
            "random": _level(one.chance),
            "without NPCs, at least": _level(one.without_npcs),
        }
        for name, one in baselines.items()
    ]
    return [row for row in rows if set(row.values()) != {row["scenario"], _NONE}]


def _level(level: Level | None) -> str:
    return _NONE if level is None else f"{level.value:.3f} ± {level.error:.3f}\n{level.sample}"


def _runs(analysis: Analysis, place: Path) -> Rows:
    return [
        {
            "condition": condition.entry.name,
            "seed": str(run.seed),
            "state": _state_of(run),
            "frames": f"{run.frames:,}",
            "success": "\n".join(_successes(run)),
            "return": signed(getattr(run.figures, "mean_return", None), ".3f"),
            "length": signed(getattr(run.figures, "mean_length", None), ".1f"),
            "time": _NONE if run.result is None else _duration(run.result.train_seconds),
            "frames/s": signed(getattr(run.result, "frames_per_second", None) or None, ",.0f"),
            "folder": run.id,
            "episodes": _replay(run, place),
        }
        for condition in analysis.experiment.conditions
        for run in condition.runs
    ]


def _successes(run: RunRecord) -> Iterator[str]:
    """The success of the agent, then that of each other seat."""
    yield signed(getattr(run.figures, "success_rate", None), ".3f")
    if run.figures is not None:
        yield from (f"{seat} {part.success_rate:.3f}" for seat, part in run.figures.seats.items())


def _replay(run: RunRecord, place: Path) -> str:
    """A link to the page on which episodes of a run can be watched."""
    page = run.folder / REPLAY
    if not page.is_file():
        return _NONE
    return Markup('<a href="{}">watch</a>').format(quote(Path(os.path.relpath(page, place)).as_posix()))


def _facts(analysis: Analysis, version: str) -> Rows:
    """Versions, machines, times and digests."""
    runs = analysis.experiment.runs
    results = [run.result for run in runs if run.result is not None]
    facts = [("report made by", f"socialai-dsl {version}")]
    if analysis.experiment.source_sha256:
        facts.append(("experiment file, SHA-256", analysis.experiment.source_sha256))
    for package in dict.fromkeys(package for result in results for package in result.versions):
        counts = Counter(result.versions[package] for result in results if package in result.versions)
        several = ", ".join(f"{value} ({count_of(count, 'run')})" for value, count in counts.most_common())
        facts.append((package, several if len(counts) > 1 else next(iter(counts))))
    for machine, count in Counter(_machine(run) for run in runs if run.starts).most_common():
        facts.append(("ran on", f"{machine} ({count_of(count, 'run')})"))
    seconds = sum(result.train_seconds for result in results)
    facts.append(("training time", f"{_duration(seconds)}, all runs together, one after the other"))
    return [{"what": name, "which": value} for name, value in facts]


def _machine(run: RunRecord) -> str:
    start = run.starts[-1]
    threads = count_of(start.threads, "thread") if start.threads else "threads not recorded"
    processes = f", {start.processes} processes" if start.processes > 1 else ""
    return f"{start.device}, {start.cpu} instructions, {threads}{processes}"


def _identity(summary: Summary, baselines: Baselines | None) -> dict[str, str]:
    programs = _programs(summary)
    configurations = dict.fromkeys(run.digest for run in summary.condition.runs if run.digest)
    measured = baselines.program_sha256 if baselines is not None else ""
    changed = "\nthe scenario has changed since" if measured and programs and measured not in programs else ""
    return {
        "condition": summary.name,
        "scenario": summary.condition.entry.scenario,
        "program": (" ".join(p[:_DIGEST] for p in programs) or _NONE) + changed,
        "configuration": " ".join(c[:_DIGEST] for c in configurations) or _NONE,
    }


def _interval_example(analysis: Analysis) -> str:
    """The interval of the condition with the widest one, as a warning."""
    found = [(s, mean_interval(list(s.success))) for s in analysis.summaries]
    wide = [(s, interval) for s, interval in found if interval is not None]
    if not wide:
        return "here no condition has two seeds, so nothing is known about spread."
    summary, (low, high) = max(wide, key=lambda pair: pair[1][1] - pair[1][0])
    seeds = count_of(len(summary.success), "seed")
    return f"Student's 95 % interval is widest for {summary.name}, {low:.2f} to {high:.2f} with {seeds}."
