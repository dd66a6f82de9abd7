"""The words and tables of a report: from its figures to blocks, the same for HTML and Markdown."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from socialai_dsl.reporting import plots
from socialai_dsl.reporting.analysis import (
    RISING,
    THRESHOLDS,
    Analysis,
    Ceilings,
    Comparison,
    Level,
    Section,
    Summary,
    column_of,
)
from socialai_dsl.reporting.collect import Run
from socialai_dsl.reporting.document import (
    Block,
    Cell,
    Document,
    Figure,
    Folded,
    Heading,
    Items,
    Meter,
    Table,
    Text,
)
from socialai_dsl.reporting.records import Ending, Reference
from socialai_dsl.reporting.statistics import ALPHA, RESAMPLES, Estimate, Spread, mean_interval
from socialai_dsl.reporting.style import saved, styled

_NONE: Final = Cell("–", tone="muted")
_DIGEST: Final = 12
_RULES_SHOWN: Final = 12
_TITLES: Final[dict[str | None, str]] = {"table2": "Table 2", None: "Conditions"}


@dataclass
class _Images:
    """The figures that were drawn so far, by name."""

    made: dict[str, tuple[bytes, bytes]] = field(default_factory=dict)

    def figure(self, name: str, drawn: object, alt: str, caption: str) -> Iterator[Block]:
        if drawn is not None:
            self.made[name] = (saved(drawn, "svg"), saved(drawn, "png"))
            yield Figure(name, alt, caption)


def compose(analysis: Analysis, version: str) -> Document:
    """The whole report.

    Args:
        analysis: its figures.
        version: of the package that makes it.
    """
    images, experiment = _Images(), analysis.experiment
    subtitle = f"profile {experiment.profile}" if experiment.profile else ""
    blocks: list[Block] = [Text(_lead(analysis), "lead")]
    if experiment.about.strip():
        blocks.append(Text(experiment.about.strip()))
    blocks += _remarks(analysis)
    with styled():
        for number, section in enumerate(analysis.sections, start=1):
            blocks += _section(section, f"part{number}", analysis, images)
        blocks += _endings(analysis, images)
    blocks += _ceilings(analysis)
    blocks += _runs(analysis)
    blocks += _provenance(analysis, version)
    blocks += _methods(analysis)
    return Document(f"Report: {experiment.name}", subtitle, blocks, images.made)


# --- the summary at the top


def _lead(analysis: Analysis) -> str:
    """What there is and what it says, in a few sentences of figures."""
    runs, summaries = analysis.experiment.runs, analysis.summaries
    states = Counter(_state_word(run) for run in runs)
    finished = states.pop("done", 0)
    others = f" ({', '.join(f'{count} {state}' for state, count in states.items())})" if states else ""
    trained = [run.result for run in runs if run.result is not None]
    frames, seconds = sum(r.frames for r in trained), sum(r.train_seconds for r in trained)
    parts = [
        f"{finished} of {len(runs)} runs done{others}, in {_count(len(summaries), 'condition')}; "
        f"{frames:,} frames trained in {_duration(seconds)} of run time."
    ]
    referred = [s for s in summaries if s.reference is not None and s.success.n]
    if referred:
        close = sum(_agrees(s.success, s.reference) for s in referred if s.reference is not None)
        parts.append(
            f"Of {_count(len(referred), 'condition')} with a published figure, {close} have it within one published "
            "standard deviation of the mean, or within 0.05 where none was published."
        )
    tested = [c for section in analysis.sections for c in section.comparisons if c.adjusted is not None]
    if tested:
        found = sum(c.adjusted is not None and c.adjusted < ALPHA for c in tested)
        parts.append(
            f"Of {_count(len(tested), 'comparison')}, {found} differ at p < {ALPHA} after correction."
        )
    short = sum(bool(s.short) for s in summaries)
    if short:
        parts.append(f"{_count(short, 'condition')} {'is' if short == 1 else 'are'} too short to judge.")
    return " ".join(parts)


def _state_word(run: Run) -> str:
    return "without a result" if run.state == "done" and run.result is None else run.state


def _agrees(success: Spread, reference: Reference) -> bool:
    return abs(success.mean - reference.mean) <= (reference.std if reference.std is not None else 0.05)


def _remarks(analysis: Analysis) -> Iterator[Block]:
    """What is wrong with runs or conditions, if anything."""
    remarks = list(analysis.notes)
    for run in analysis.experiment.runs:
        if run.state == "failed" or run.problems:
            what = "; ".join([*([run.message or "failed"] if run.state == "failed" else []), *run.problems])
            remarks.append(f"run {run.id}: {what}")
    for summary in analysis.summaries:
        for what, values in (
            ("configuration", {run.digest for run in summary.condition.runs if run.digest}),
            ("program", {r.result.program_sha256 for r in summary.condition.done if r.result is not None}),
        ):
            if len(values) > 1:
                remarks.append(f"{summary.name}: its runs are of {len(values)} different {what}s")
    if remarks:
        yield Folded(f"{_count(len(remarks), 'remark')} on the runs", [Items(remarks)])


# --- a table, or a case study


def _section(section: Section, prefix: str, analysis: Analysis, images: _Images) -> Iterator[Block]:
    title = _TITLES[section.group] if section.is_table else f"Case study: {section.group}"
    yield Heading(2, title, prefix)
    yield _results(section)
    yield from images.figure(
        f"{prefix}-success",
        plots.success_figure(section, analysis.ceilings),
        f"Success on the test episodes of each condition of {title}, seeds and mean, with published figures.",
        "Success on the test episodes: a small mark for each seed, a large one for their mean, a bar of one standard "
        "deviation to either side. Diamonds: published figures. Grey lines: who does not learn (see below).",
    )
    yield from _comparisons(section)
    yield from _aggregates(section, prefix, images)
    yield from images.figure(
        f"{prefix}-curves",
        plots.curves_figure(section, analysis.ceilings),
        f"Learning curves of {title}: success of training episodes over frames.",
        "Success of the training episodes, whose actions are sampled, in bins of frames: thin for each seed, thick for "
        "the mean over seeds, shaded one standard deviation to either side. At the right end: success on the test "
        "episodes, and published figures as diamonds in the colour of their condition. Dash-dotted: the same agents "
        "on a further test that they were not trained for, mean over seeds.",
    )
    yield from _efficiency(section)


def _results(section: Section) -> Table:
    if section.is_table:
        columns = section.columns
        rows = []
        for row, members in section.rows.items():
            by_column = {column_of(summary): summary for summary in members}
            cells = [_result(by_column[c]) if c in by_column else Cell("N/A", tone="muted") for c in columns]
            rows.append([Cell(row, tone="strong"), *cells])
        return Table(["", *columns], rows, _RESULTS, grid=True)
    rows = [[Cell(s.name, (s.condition.entry.scenario,), "strong"), _result(s)] for s in section.summaries]
    return Table(["condition", "success"], rows, _RESULTS, grid=True)


_RESULTS: Final = (
    "Success rate on the test episodes: mean ± sample standard deviation over seeds. Published: mean ± standard "
    "deviation as published. Difference: mean minus published mean."
)


def _result(summary: Summary) -> Cell:
    """Our figure with the published one, and what is to be known about it."""
    lines, asked = [], len(summary.condition.runs)
    if summary.reference is not None:
        lines.append(_published(summary.success, summary.reference))
    for test, spread in summary.tests.items():
        lines += _test_lines(test, spread, summary.condition.entry.test_references.get(test))
    lines.append(f"{summary.success.n} of {_count(asked, 'seed')}")
    lines += [f"too short: {reason}" for reason in summary.short]
    if not summary.success.n:
        return Cell("no result", tuple(lines), "muted")
    reference = summary.reference.mean if summary.reference is not None else None
    meter = Meter(summary.success.mean, summary.success.std, reference)
    return Cell(_spread(summary.success), tuple(lines), "warning" if summary.short else "", meter=meter)


def _published(success: Spread, reference: Reference) -> str:
    std = f" ± {reference.std:.2f}" if reference.std is not None else ""
    difference = f", difference {success.mean - reference.mean:+.3f}" if success.n else ""
    about = "; ".join(part for part in (reference.source, reference.note) if part)
    return f"published {reference.mean:.2f}{std}{difference}" + (f" ({about})" if about else "")


def _test_lines(test: str, spread: Spread, reference: Reference | None) -> list[str]:
    measured = _spread(spread) if spread.n else "no result"
    lines = [f"on {test}: {measured}"]
    if reference is not None:
        lines.append(f"on {test}: {_published(spread, reference)}")
    return lines


def _spread(spread: Spread) -> str:
    return f"{spread.mean:.3f}" + (f" ± {spread.std:.3f}" if spread.std is not None else "")


def _comparisons(section: Section) -> Iterator[Block]:
    if not section.comparisons:
        return
    tests = sum(c.test.p is not None for c in section.comparisons)
    yield Heading(3, "Comparisons", f"compare-{section.group or 'conditions'}")
    yield Table(
        ["", "first", "second", ">difference", ">t", ">df", ">p", ">p corrected", ">Hedges' g", ""],
        [_comparison(c) for c in section.comparisons],
        f"Difference of the mean success, first minus second. t, df, p: Welch's two-sided t-test, which takes unequal "
        f"variances. p corrected: Bonferroni, p times the {_count(tests, 'test')} of this table. Hedges' g: the difference in "
        f"pooled standard deviations, corrected for few seeds. A dash: fewer than two seeds, or no spread at all.",
    )


def _comparison(comparison: Comparison) -> list[Cell]:
    test, found = comparison.test, comparison.adjusted is not None and comparison.adjusted < ALPHA
    verdict = "not testable" if comparison.adjusted is None else "differs" if found else "not shown to differ"
    return [
        Cell(comparison.row, tone="strong"),
        Cell(comparison.first),
        Cell(comparison.second),
        Cell(f"{test.difference:+.3f}"),
        _number(test.t, "+.2f"),
        _number(test.degrees, ".1f"),
        _p(test.p),
        _p(comparison.adjusted),
        _number(test.g, "+.2f"),
        Cell(verdict, tone="strong" if found else "muted"),
    ]


def _number(value: float | None, form: str) -> Cell:
    return _NONE if value is None or math.isnan(value) else Cell(format(value, form))


def _p(value: float | None) -> Cell:
    return _NONE if value is None else Cell("< 0.0001" if value < 1e-4 else f"{value:.4f}")


def _aggregates(section: Section, prefix: str, images: _Images) -> Iterator[Block]:
    if not section.aggregates:
        return
    yield Heading(3, "Over all rows", f"{prefix}-iqm")
    yield Table(
        [
            "column",
            ">rows",
            ">runs",
            ">interquartile mean",
            f">of the {_count(section.common_rows, 'row')} in common",
        ],
        [
            [
                Cell(a.column, tone="strong"),
                Cell(str(a.rows)),
                Cell(str(a.scores)),
                Cell(_estimate(a.estimate)),
                Cell(_estimate(a.common)) if a.common is not None else _NONE,
            ]
            for a in section.aggregates
        ],
        f"Mean of the middle half of all runs of a column, so that neither an easy row nor a lucky seed decides; in brackets "
        f"its 95 % interval from {RESAMPLES:,} stratified bootstrap resamples, which draw seeds within each row "
        "(Agarwal et al. 2021).",
    )
    yield from images.figure(
        f"{prefix}-iqm",
        plots.iqm_figure(section.aggregates, section.columns),
        "Interquartile mean of each column with its bootstrap interval.",
        "Interquartile mean (line) with its 95 % interval (bar).",
    )


def _estimate(estimate: Estimate) -> str:
    return f"{estimate.value:.3f} [{estimate.low:.3f}, {estimate.high:.3f}]"


def _efficiency(section: Section) -> Iterator[Block]:
    rows = []
    for summary in section.summaries:
        efficiency = summary.efficiency
        if efficiency is None:
            continue
        area = Spread(efficiency.areas)
        cells = [_reached(reached) for reached in efficiency.reached]
        rows.append([Cell(summary.name, tone="strong"), Cell(_spread(area)) if area.n else _NONE, *cells])
    if not rows:
        return
    yield Folded(
        "Sample efficiency",
        [
            Table(
                ["condition", ">area", *(f">{level:.0%}" for level in THRESHOLDS)],
                rows,
                "Area: mean success over all frames of training, which is the area under the curve divided by its frames; mean "
                "± standard deviation over seeds. Then the frames by whose end the success of training episodes in a bin of "
                "the curve had reached so much: median of the seeds that got there, and how many did.",
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


# --- how episodes ended


def _endings(analysis: Analysis, images: _Images) -> Iterator[Block]:
    blocks: list[Block] = []
    for number, section in enumerate(analysis.sections, start=1):
        for place, (row, members) in enumerate(section.rows.items(), start=1):
            inner: list[Block] = []
            labels = [section.label(summary) for summary in members]
            inner += images.figure(
                f"part{number}-endings{place}",
                plots.endings_figure(members, labels, row),
                f"How training episodes of {row} ended over frames.",
                "Training episodes by how they ended, mean over seeds: successes green, failures red, time-outs grey.",
            )
            for summary in members:
                inner += _ending_tables(summary)
            if inner:
                blocks.append(Folded(f"{row}", inner))
    if blocks:
        yield Heading(2, "How episodes ended, and which rules fired", "endings")
        yield Text(
            "Shares of the test episodes by the line of the scenario's file that ended them, and how often each rule fired "
            "in an episode; both as mean over the seeds that are done.",
            "note",
        )
        yield from blocks


def _ending_tables(summary: Summary) -> Iterator[Block]:
    figures = [run.result.eval for run in summary.condition.done if run.result is not None]
    if not figures:
        return
    endings = {e.outcome: e for one in figures for e in one.endings}
    shares = {
        name: Spread(tuple(one.outcomes.get(name, 0.0) for one in figures))
        for name in dict.fromkeys(name for one in figures for name in one.outcomes)
    }
    ended = sorted(
        ((name, share) for name, share in shares.items() if share.mean > 0),
        key=lambda pair: (pair[0] not in summary.successes, -pair[1].mean),
    )
    rules = {
        name: Spread(tuple(one.rules.get(name, 0.0) for one in figures))
        for name in dict.fromkeys(name for one in figures for name in one.rules)
    }
    fired = sorted(((n, r) for n, r in rules.items() if r.mean > 0), key=lambda pair: -pair[1].mean)
    yield Table(
        [f"{summary.name}: ended by", "where", ">of the episodes"],
        [
            [
                Cell(endings[name].text if name in endings else name),
                Cell(_place(endings.get(name)), code=True) if _place(endings.get(name)) else _NONE,
                Cell(_spread(share), meter=Meter(share.mean, share.std)),
            ]
            for name, share in ended
        ],
    )
    if fired:
        more = f" ({len(fired) - _RULES_SHOWN} more fired)" if len(fired) > _RULES_SHOWN else ""
        yield Table(
            [f"{summary.name}: rule{more}", ">firings per episode"],
            [[Cell(name, code=True), Cell(_spread(rate))] for name, rate in fired[:_RULES_SHOWN]],
        )


def _place(ending: Ending | None) -> str:
    return f"{ending.file}:{ending.line}" if ending is not None and ending.file is not None else ""


# --- who does not learn


def _ceilings(analysis: Analysis) -> Iterator[Block]:
    known = {name: one for name, one in analysis.ceilings.items() if one.oracle or one.random or one.alone}
    if not known:
        return
    yield Heading(2, "Who does not learn", "levels")
    yield Table(
        ["scenario", ">own script", ">random", ">without NPCs, at least"],
        [
            [Cell(name, tone="strong"), _level(one.oracle), _level(one.random), _level(one.alone)]
            for name, one in known.items()
        ],
        "Success ± standard error. Own script: the scenario's variant `oracle`, which knows what was drawn. Random: every part "
        "of the action drawn uniformly. Without NPCs: a policy found by search that knows the whole room but neither sees "
        "nor hears an NPC, so at least so much can be had by guessing (`socialai check --deep` explains it).",
    )


def _level(level: Level | None) -> Cell:
    if level is None:
        return _NONE
    return Cell(f"{level.value:.3f} ± {level.error:.3f}", (level.source,), meter=Meter(level.value))


# --- runs, and what they ran on


def _runs(analysis: Analysis) -> Iterator[Block]:
    rows = [
        [
            Cell(condition.entry.name),
            Cell(str(run.seed)),
            Cell(_state_word(run), tone="" if run.state == "done" else "warning"),
            Cell(f"{run.frames:,}"),
            Cell(f"{run.figures.success_rate:.3f}") if run.figures is not None else _NONE,
            Cell(f"{run.figures.mean_return:.3f}") if run.figures is not None else _NONE,
            Cell(f"{run.figures.mean_length:.1f}") if run.figures is not None else _NONE,
            Cell(_duration(run.result.train_seconds)) if run.result is not None else _NONE,
            Cell(f"{run.result.frames_per_second:,.0f}")
            if run.result is not None and run.result.frames_per_second
            else _NONE,
            Cell(run.id, code=True),
        ]
        for condition in analysis.experiment.conditions
        for run in condition.runs
    ]
    yield Heading(2, "Runs", "runs")
    yield Folded(
        f"All {_count(len(rows), 'run')}",
        [
            Table(
                [
                    "condition",
                    ">seed",
                    "state",
                    ">frames",
                    ">success",
                    ">return",
                    ">length",
                    ">time",
                    ">frames/s",
                    "folder",
                ],
                rows,
                "Success, return (sum of an episode's rewards) and length (steps): means over the test episodes. Time: of training "
                "alone. Frames: steps of all environments together.",
            )
        ],
    )


def _provenance(analysis: Analysis, version: str) -> Iterator[Block]:
    yield Heading(2, "What it ran on", "provenance")
    results = [run.result for run in analysis.experiment.runs if run.result is not None]
    packages: dict[str, Counter[str]] = {}
    for result in results:
        for package, number in result.versions.items():
            packages.setdefault(package, Counter())[number] += 1
    machines = Counter(_machine(run) for run in analysis.experiment.runs if run.starts)
    facts = [["report made by", f"socialai-dsl {version}"]]
    if analysis.experiment.source_sha256:
        facts.append(["experiment file, SHA-256", analysis.experiment.source_sha256])
    facts += [[name, _counted(counts)] for name, counts in packages.items()]
    facts += [["ran on", f"{machine} ({_count(count, 'run')})"] for machine, count in machines.most_common()]
    seconds = sum(result.train_seconds for result in results)
    facts.append(["training time", f"{_duration(seconds)}, all runs together, one after the other"])
    yield Table(["", ""], [[Cell(name), Cell(value, code="SHA" in name)] for name, value in facts])
    yield Folded(
        "Programs and configurations",
        [
            Table(
                ["condition", "scenario", "program", "configuration"],
                [
                    _identity(summary, analysis.ceilings.get(summary.condition.entry.scenario))
                    for summary in analysis.summaries
                ],
                f"First {_DIGEST} digits of SHA-256 digests: of the compiled scenario, and of `config.json` without the seed. Equal "
                "digests mean equal rules and equal settings.",
            )
        ],
    )


def _identity(summary: Summary, ceilings: Ceilings | None) -> list[Cell]:
    programs = dict.fromkeys(r.result.program_sha256 for r in summary.condition.done if r.result is not None)
    configurations = dict.fromkeys(run.digest for run in summary.condition.runs if run.digest)
    measured = ceilings.program_sha256 if ceilings is not None else ""
    changed = (
        ("the scenario has changed since",) if measured and programs and measured not in programs else ()
    )
    return [
        Cell(summary.name),
        Cell(summary.condition.entry.scenario, code=True),
        Cell(" ".join(p[:_DIGEST] for p in programs) or "–", changed, code=True),
        Cell(" ".join(c[:_DIGEST] for c in configurations) or "–", code=True),
    ]


def _machine(run: Run) -> str:
    start = run.starts[-1]
    threads = _count(start.threads, "thread") if start.threads else "threads not recorded"
    processes = f", {start.processes} processes" if start.processes > 1 else ""
    return f"{start.device}, {start.cpu} instructions, {threads}{processes}"


def _counted(counts: Counter[str]) -> str:
    if len(counts) == 1:
        return next(iter(counts))
    return ", ".join(f"{value} ({_count(count, 'run')})" for value, count in counts.most_common())


# --- how it was computed


def _methods(analysis: Analysis) -> Iterator[Block]:
    yield Heading(2, "How it was computed", "methods")
    yield Items(
        [
            "A run's success is the share of its test episodes that ended in success; the test episodes are the same rooms for "
            "every agent, and actions are sampled.",
            "Standard deviations over seeds divide by n - 1. An interval of a mean over few seeds is wide: "
            + _interval_example(analysis),
            "Welch's test (Welch 1947) compares two groups of seeds; it takes seeds to be independent and their means to be "
            "normal, which success rates near 0 or 1 are not.",
            f"Bonferroni's correction holds the chance of a single false finding in a table below {ALPHA}; it is strict, so that "
            "what is not shown to differ may differ all the same.",
            "Hedges' g (Hedges 1981) is the difference of the means over the pooled standard deviation "
            "√(((n₁-1)s₁² + (n₂-1)s₂²) / (n₁+n₂-2)), times Γ(m/2) / (√(m/2) Γ((m-1)/2)) with m = n₁+n₂-2.",
            "Interquartile means and their intervals follow Agarwal, Schwarzer, Castro, Courville and Bellemare (2021), Deep "
            "reinforcement learning at the edge of the statistical precipice.",
            f"Too short: seeds without a result, fewer frames than asked for, or mean success in the last fifth of training more "
            f"than {RISING} above that in the fifth before.",
        ]
    )


def _interval_example(analysis: Analysis) -> str:
    """The interval of the condition with the widest one, as a warning."""
    found = [(s, mean_interval(s.success.values)) for s in analysis.summaries]
    wide = [(s, i) for s, i in found if i is not None]
    if not wide:
        return "here no condition has two seeds, so nothing is known about spread."
    summary, (low, high) = max(wide, key=lambda pair: pair[1][1] - pair[1][0])
    return f"Student's 95 % interval is widest for {summary.name}, from {low:.2f} to {high:.2f} with {summary.success.n} seeds."


def _duration(seconds: float) -> str:
    if seconds < 60:
        return f"{seconds:.0f} s"
    if seconds < 3600:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}" + ("" if number == 1 else "s")
