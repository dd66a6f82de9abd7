"""A report as one HTML page: no script, nothing from elsewhere, everything from files escaped.

The template `page.html.jinja` has the words; this module makes the tables that stand between them.
"""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import jinja2
import pandas as pd

from socialai_dsl.reporting.analysis import (
    RISING,
    SOLVED,
    THRESHOLDS,
    Analysis,
    Section,
    Summary,
)
from socialai_dsl.reporting.page_minds import minds_parts, players_rows, study_part, trials_rows
from socialai_dsl.reporting.page_origin import (
    DIGEST,
    baselines_part,
    facts_part,
    identity_part,
    programs_of,
    runs_part,
    state_of,
)
from socialai_dsl.reporting.page_several import crossplay_part, dilemma_part, words_part
from socialai_dsl.reporting.published import MARGIN
from socialai_dsl.reporting.records import Figures, PartFigures, PublishedRecord
from socialai_dsl.reporting.statistics import ALPHA, RESAMPLES, mean_interval
from socialai_dsl.reporting.style import scenario_name
from socialai_dsl.reporting.written import (
    NONE,
    Rows,
    count_of,
    difference,
    duration,
    figure,
    interval,
    p_value,
    signed,
    spread,
)

_TITLES: Final[dict[str | None, str]] = {"table2": "Table 2", None: "Conditions"}
_RULES_SHOWN: Final = 12


def render_page(analysis: Analysis, drawings: Mapping[str, bytes], version: str, place: Path) -> str:
    """The page. Figures are SVG images in it, in which a browser runs and loads nothing.

    Args:
        analysis: its figures.
        drawings: name -> SVG.
        version: of the package that makes it.
        place: the folder where it will lie.
    """
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        loader=jinja2.PackageLoader("socialai_dsl.reporting", ""),
    )
    environment.filters |= {
        "spread": spread,
        "signed": signed,
        "count_of": count_of,
        "scenario_name": scenario_name,
    }
    template = environment.get_template("page.html.jinja")
    images = {
        name: f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}" for name, svg in drawings.items()
    }
    sections = [
        _section(f"part{number}", section, drawings, analysis.experiment.humans)
        for number, section in enumerate(analysis.sections, start=1)
    ]
    page = template.render(
        experiment=analysis.experiment,
        images=images,
        lead=_lead(analysis),
        remarks=list(_remarks(analysis)),
        sections=sections,
        studies=[
            study_part(f"study{number}", study)
            for number, study in enumerate(analysis.experiment.studies, start=1)
        ],
        simulated=any(study.simulated for study in analysis.experiment.studies),
        crossplays=[
            crossplay_part(f"crossplay{number}", found)
            for number, found in enumerate(analysis.experiment.crossplays, start=1)
        ],
        words=[
            words_part(f"words{number}", found)
            for number, found in enumerate(analysis.experiment.words, start=1)
        ],
        dilemmas=[
            dilemma_part(f"dilemma{number}", found)
            for number, found in enumerate(analysis.experiment.dilemmas, start=1)
        ],
        endings=[one for section in sections for one in section["endings"]],
        baselines=baselines_part(analysis.baselines),
        runs=runs_part(analysis, place),
        facts=facts_part(analysis, version),
        identities=[
            identity_part(summary, analysis.baselines.get(summary.condition.entry.scenario))
            for summary in analysis.summaries
        ],
        interval=_interval_example(analysis),
        alpha=ALPHA,
        margin=f"{MARGIN:.2f}",
        resamples=f"{RESAMPLES:,}",
        rising=RISING,
        solved=SOLVED,
        digest=DIGEST,
    )
    return page + "\n"


# -- what there is -----------------------------------------------------------------------------------------------------


def _lead(analysis: Analysis) -> str:
    """What there is and what it says, in a few sentences of figures."""
    runs, summaries = analysis.experiment.runs, analysis.summaries
    several = " ".join(filter(None, (_of_people(analysis), _of_several(analysis))))
    if several and not runs:
        return several
    states = Counter(state_of(run) for run in runs)
    finished = states.pop("done", 0)
    others = f" ({', '.join(f'{count} {state}' for state, count in states.items())})" if states else ""
    trained = [run.result for run in runs if run.result is not None]
    frames, seconds = sum(r.frames for r in trained), sum(r.train_seconds for r in trained)
    parts = [
        f"{finished} of {len(runs)} runs done{others}, in {count_of(len(summaries), 'condition')}; "
        f"{frames:,} frames trained in {duration(seconds)} of run time."
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


def _of_people(analysis: Analysis) -> str:
    """Who took part in studies, in a sentence each."""
    return " ".join(
        f"Study {one.name}: {count_of(one.counted, 'simulated participant' if one.simulated else 'participant')}."
        for one in analysis.experiment.studies
    )


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


def _remarks(analysis: Analysis) -> Iterator[str]:
    """What is wrong with runs or conditions, if anything."""
    yield from analysis.notes
    for run in analysis.experiment.runs:
        failed = [run.message or "failed"] if run.state == "failed" else []
        if failed or run.problems:
            yield f"run {run.id}: {'; '.join([*failed, *run.problems])}"
    for summary in analysis.summaries:
        configurations = {run.digest for run in summary.condition.runs if run.digest}
        for what, values in (("configuration", configurations), ("program", set(programs_of(summary)))):
            if len(values) > 1:
                yield f"{summary.name}: its runs are of {len(values)} different {what}s"


# -- a table of conditions, or a case study ----------------------------------------------------------------------------


def _section(
    anchor: str,
    section: Section,
    drawings: Mapping[str, bytes],
    humans: Mapping[str, Sequence[PublishedRecord]],
) -> dict[str, Any]:
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
        "carried": [row for summary in section.summaries for row in _carried(summary)],
        "rooms": [_pairing(one) for one in section.rooms],
        "players": players_rows(section),
        "minds": minds_parts(anchor, section, humans, drawings),
        "trials": [row for summary in section.summaries for row in trials_rows(summary)],
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


def _carried(summary: Summary) -> Iterator[dict[str, str]]:
    """What is left of an agent's success on tests that it was not trained for."""
    for test, there in summary.tests.items():
        if len(there):
            yield {
                "condition": summary.name,
                "test": scenario_name(test),
                "own test episodes": spread(summary.success),
                "there": spread(there),
                "carried over": spread(summary.carried(test)),
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
            "right": f"{sums.right / sums.asked:.3f}" if sums.asked else NONE,
            "by chance": f"{sums.chance / sums.asked:.3f}" if sums.asked else NONE,
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
        "cost": f"${table.cost.sum():.4f}" if table.cost.notna().all() else NONE,
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
            "interquartile mean": interval(one["iqm"]),
            common: interval(one["common"]),
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


def _interval_example(analysis: Analysis) -> str:
    """The interval of the condition with the widest one, as a warning."""
    learned = [summary for summary in analysis.summaries if not summary.condition.study]
    found = [(s, mean_interval(list(s.success))) for s in learned]
    wide = [(s, interval) for s, interval in found if interval is not None]
    if not wide:
        return "here no condition has two seeds, so nothing is known about spread."
    summary, (low, high) = max(wide, key=lambda pair: pair[1][1] - pair[1][0])
    seeds = count_of(len(summary.success), "seed")
    return f"Student's 95 % interval is widest for {summary.name}, {low:.2f} to {high:.2f} with {seeds}."
