"""Blocks about a table of conditions or a case study: results, comparisons, means over all rows, curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from socialai_dsl.reporting import plots
from socialai_dsl.reporting.analysis import THRESHOLDS, Ceilings, Comparison, Section, Summary, column_of
from socialai_dsl.reporting.document import Block, Cell, Folded, Heading, Meter, Table
from socialai_dsl.reporting.images import Images
from socialai_dsl.reporting.records import ProbeFigures, Reference
from socialai_dsl.reporting.statistics import ALPHA, RESAMPLES, Spread
from socialai_dsl.reporting.wording import (
    NONE,
    count_of,
    estimate_text,
    number_cell,
    signed,
    signed_estimate_text,
    spread_text,
)

_TITLES: Final[dict[str | None, str]] = {"table2": "Table 2", None: "Conditions"}


def section_blocks(
    section: Section, prefix: str, ceilings: Mapping[str, Ceilings], images: Images
) -> Iterator[Block]:
    """All about one section; names of its figures and links begin with `prefix`."""
    title = _TITLES[section.group] if section.is_table else f"Case study: {section.group}"
    yield Heading(2, title, prefix)
    yield _results(section)
    yield from _sources(section)
    yield from _probes(section, prefix)
    yield from images.figure(
        f"{prefix}-success",
        lambda narrow: plots.success_figure(section, ceilings, narrow),
        f"Success on the test episodes of each condition of {title}, seeds and mean, with published figures.",
        "Success on the test episodes: a small mark for each seed, a large one for their mean, a bar of one standard "
        "deviation to either side. Diamonds: published figures. Grey lines: who does not learn (see below).",
    )
    yield from _comparisons(section)
    yield from _pairings(section, prefix)
    yield from _language_models(section, prefix)
    yield from _aggregates(section, prefix, images)
    yield from images.figure(
        f"{prefix}-curves",
        lambda narrow: plots.curves_figure(section, ceilings, narrow),
        f"Learning curves of {title}: success of training episodes over frames.",
        "Success of the training episodes, whose actions are sampled, in bins of frames: thin for each seed, thick for "
        "the mean over seeds, dashed where a seed has ended, shaded one standard deviation to either side. At the "
        "right end: success on the test episodes, and published figures as diamonds in the colour of their condition. "
        "Dash-dotted: the same agents on a further test that they were not trained for, mean over seeds.",
    )
    yield from _efficiency(section)


def _results(section: Section) -> Table:
    columns = section.columns
    rows = []
    for row, members in section.rows.items():
        by_column = {column_of(summary): summary for summary in members}
        cells = [_result(by_column[c]) if c in by_column else Cell("N/A", tone="muted") for c in columns]
        rows.append([Cell(row, tone="strong"), *cells])
    return Table(["", *columns], rows, _RESULTS, grid=True)


_RESULTS: Final = (
    "Success rate on the test episodes: mean ± sample standard deviation over seeds. Published: mean ± standard "
    "deviation as published. Difference: mean minus published mean."
)


def _result(summary: Summary) -> Cell:
    """Our figure with the published one, and what is to be known about it."""
    lines, asked = [], len(summary.condition.runs)
    if summary.reference is not None:
        lines += _published(summary.success, summary.reference)
    for test, spread in summary.tests.items():
        lines.append(f"on {test}: {spread_text(spread) if spread.n else 'no result'}")
        if (published := summary.condition.entry.test_references.get(test)) is not None:
            lines += _published(spread, published)
    lines.append(f"{summary.success.n} of {count_of(asked, 'seed')}")
    lines += [f"too short: {reason}" for reason in summary.short]
    if not summary.success.n:
        return Cell("no result", tuple(lines), "muted")
    reference = summary.reference.mean if summary.reference is not None else None
    meter = Meter(summary.success.mean, summary.success.std, reference)
    return Cell(spread_text(summary.success), tuple(lines), "warning" if summary.short else "", meter=meter)


def _published(success: Spread, reference: Reference) -> list[str]:
    std = f" ± {reference.std:.2f}" if reference.std is not None else ""
    lines = [f"published {reference.mean:.2f}{std}"]
    return [*lines, f"difference {signed(success.mean - reference.mean, '+.3f')}"] if success.n else lines


def _sources(section: Section) -> Iterator[Block]:
    """Every published figure, with where it comes from and what is to be known about it."""
    rows = [
        [
            Cell(f"{summary.name} on {test}" if test else summary.name),
            Cell(f"{reference.mean:.3f}"),
            number_cell(reference.std, ".3f"),
            Cell(reference.source),
            Cell(reference.note),
        ]
        for summary in section.summaries
        for test, reference in [("", summary.reference), *summary.condition.entry.test_references.items()]
        if reference is not None
    ]
    if rows:
        table = Table(["condition", ">mean", ">standard deviation", "source", "note"], rows, _AS_PUBLISHED)
        yield Folded("Published figures", [table])


_AS_PUBLISHED: Final = "Success rates as published; a dash where no standard deviation was given."


def _probes(section: Section, prefix: str) -> Iterator[Block]:
    """What language models know when they are asked, beside what they do."""
    rows = []
    for summary in section.summaries:
        found: dict[str, list[ProbeFigures]] = {}
        for run in summary.condition.done:
            for name, figures in run.figures.probes.items() if run.figures is not None else ():
                found.setdefault(name, []).append(figures)
        rows += [_probe(summary, name, figures) for name, figures in found.items()]
    if rows:
        yield Heading(3, "Probes", f"{prefix}-probes")
        yield Table(["condition", "probe", ">asked", ">right", ">by chance", ">success"], rows, _PROBES)


def _probe(summary: Summary, name: str, figures: Sequence[ProbeFigures]) -> list[Cell]:
    asked = sum(one.asked for one in figures)
    guessed = sum(one.asked * (one.chance or 0.0) for one in figures)
    right = sum(one.right for one in figures)
    return [
        Cell(summary.name, tone="strong"),
        Cell(name, code=True),
        Cell(str(asked)),
        Cell(f"{right / asked:.3f}") if asked else NONE,
        Cell(f"{guessed / asked:.3f}") if asked else NONE,
        Cell(f"{summary.success.mean:.3f}"),
    ]


_PROBES: Final = (
    "Questions to language models, apart from play. Asked: how often the moment of the probe came. Right: share of "
    "right answers. By chance: share that guessing gets right. Success: share of episodes, of what the same models did."
)


def _comparisons(section: Section) -> Iterator[Block]:
    if not section.comparisons:
        return
    tests = sum(c.test.p is not None for c in section.comparisons)
    yield Heading(3, "Comparisons", f"compare-{section.group or 'conditions'}")
    yield Table(
        ["first", "second", ">difference", ">t", ">df", ">p", ">p corrected", ">Hedges' g", "verdict"],
        [_comparison(one) for one in section.comparisons],
        "Difference of the mean success, first minus second. t, df, p: Welch's two-sided t-test, which takes unequal "
        f"variances. p corrected: Bonferroni, p times the {count_of(tests, 'test')} of this table. Hedges' g: the "
        "difference in pooled standard deviations, corrected for few seeds. A dash: fewer than two seeds, or no "
        "spread at all.",
    )


def _comparison(comparison: Comparison) -> list[Cell]:
    test, found = comparison.test, comparison.adjusted is not None and comparison.adjusted < ALPHA
    verdict = "not testable" if comparison.adjusted is None else "differs" if found else "not shown to differ"
    return [
        Cell(comparison.first),
        Cell(comparison.second),
        number_cell(test.difference, "+.3f"),
        number_cell(test.t, "+.2f"),
        number_cell(test.degrees, ".1f"),
        _p(test.p),
        _p(comparison.adjusted),
        number_cell(test.g, "+.2f"),
        Cell(verdict, tone="strong" if found else "muted"),
    ]


def _p(value: float | None) -> Cell:
    return NONE if value is None else Cell("< 0.0001" if value < 1e-4 else f"{value:.4f}")


def _pairings(section: Section, prefix: str) -> Iterator[Block]:
    if not section.pairings:
        return
    yield Heading(3, "In the same rooms", f"{prefix}-rooms")
    yield Table(
        ["first", "second", ">rooms", ">first better", ">second better", ">difference"],
        [
            [
                Cell(pairing.first),
                Cell(pairing.second),
                *(Cell(f"{count:,}") for count in (pairing.rooms, pairing.ahead, pairing.behind)),
                Cell(signed_estimate_text(pairing.difference)),
            ]
            for pairing in section.pairings
        ],
        "Conditions that played the same test episodes: in how many one did better than the other, and the difference "
        "of their success, first minus second, in brackets with its 95 % interval for paired proportions (Bonett and "
        "Price 2012). It is about these players in further rooms; of trained agents it takes the seeds as they are.",
    )


def _language_models(section: Section, prefix: str) -> Iterator[Block]:
    """What language models replied, and what it took."""
    rows = []
    for summary in section.summaries:
        figures = [run.figures for run in summary.condition.done if run.figures and run.figures.replies]
        if not figures:
            continue
        replies, invalid = sum(f.replies for f in figures), sum(f.invalid_replies for f in figures)
        costs = [f.cost for f in figures if f.cost is not None]
        about = "about " if any(f.tokens_estimated for f in figures) else ""
        rows.append(
            [
                Cell(summary.name, tone="strong"),
                Cell(f"{sum(f.episodes for f in figures):,}"),
                Cell(f"{replies:,}"),
                Cell(f"{invalid / replies:.1%}"),
                Cell(f"{about}{sum(f.prompt_tokens for f in figures):,}"),
                Cell(f"{about}{sum(f.completion_tokens for f in figures):,}"),
                Cell(f"${sum(costs):.4f}") if len(costs) == len(figures) else NONE,
            ]
        )
    if rows:
        yield Heading(3, "Language models", f"{prefix}-models")
        yield Table(
            ["condition", ">episodes", ">replies", ">invalid", ">tokens read", ">tokens written", ">cost"],
            rows,
            "Invalid: share of the replies that held no action. Cost: in US dollars, a dash where prices are unknown.",
        )


def _aggregates(section: Section, prefix: str, images: Images) -> Iterator[Block]:
    if all(aggregate.rows < 2 for aggregate in section.aggregates):
        return
    yield Heading(3, "Over all rows", f"{prefix}-iqm")
    yield Table(
        [
            "column",
            ">rows",
            ">runs",
            ">interquartile mean",
            f">of the {count_of(section.common_rows, 'row')} in common",
        ],
        [
            [
                Cell(a.column, tone="strong"),
                Cell(str(a.rows)),
                Cell(str(a.scores)),
                Cell(estimate_text(a.estimate)),
                Cell(estimate_text(a.common)) if a.common is not None else NONE,
            ]
            for a in section.aggregates
        ],
        "Mean of the middle half of all runs of a column, so that neither an easy row nor a lucky seed decides; in "
        f"brackets its 95 % interval from {RESAMPLES:,} stratified bootstrap resamples, which draw seeds within each "
        "row (Agarwal et al. 2021).",
    )
    yield from images.figure(
        f"{prefix}-iqm",
        lambda narrow: plots.iqm_figure(section.aggregates, section.columns, narrow),
        "Interquartile mean of each column with its bootstrap interval.",
        "Interquartile mean (line) with its 95 % interval (bar).",
    )


def _efficiency(section: Section) -> Iterator[Block]:
    rows = []
    for summary in section.summaries:
        efficiency = summary.efficiency
        if efficiency is None:
            continue
        area = Spread(efficiency.areas)
        cells = [_reached(reached) for reached in efficiency.reached]
        rows.append([Cell(summary.name, tone="strong"), Cell(spread_text(area)) if area.n else NONE, *cells])
    if not rows:
        return
    yield Folded(
        "Sample efficiency",
        [
            Table(
                ["condition", ">area", *(f">{level:.0%}" for level in THRESHOLDS)],
                rows,
                "Area: mean success over all frames of training, which is the area under the curve divided by its "
                "frames; mean ± standard deviation over seeds. Then the frames after which the success of training "
                "episodes in a bin of the curve had reached so much: median of the seeds that got there, and how many "
                "did.",
            )
        ],
    )


def _reached(reached: Sequence[float | None]) -> Cell:
    there = [frames for frames in reached if frames is not None]
    if not there:
        return Cell("never", tone="muted")
    return Cell(_millions(float(np.median(there))), (f"{len(there)} of {len(reached)}",))


def _millions(frames: float) -> str:
    return f"{frames / 1e6:.2f} M" if frames >= 1e5 else f"{frames:,.0f}"
