"""The whole report, from its figures to blocks, the same for HTML and Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from socialai_dsl.reporting.analysis import Analysis
from socialai_dsl.reporting.document import Block, Document, Folded, Items, Text
from socialai_dsl.reporting.endings import ending_blocks
from socialai_dsl.reporting.images import Images
from socialai_dsl.reporting.origins import (
    ceiling_blocks,
    method_blocks,
    provenance_blocks,
    run_blocks,
    state_of,
)
from socialai_dsl.reporting.records import Reference
from socialai_dsl.reporting.results import section_blocks
from socialai_dsl.reporting.statistics import ALPHA, Spread
from socialai_dsl.reporting.style import styled
from socialai_dsl.reporting.wording import count_of, duration


def compose(analysis: Analysis, version: str, place: Path) -> Document:
    """The whole report.

    Args:
        analysis: its figures.
        version: of the package that makes it.
        place: the folder where the report will lie.
    """
    images, experiment = Images(), analysis.experiment
    subtitle = f"profile {experiment.profile}" if experiment.profile else ""
    blocks: list[Block] = [Text(_lead(analysis), "lead")]
    if experiment.about.strip():
        blocks.append(Text(experiment.about.strip()))
    blocks += _remarks(analysis)
    with styled():
        for number, section in enumerate(analysis.sections, start=1):
            blocks += section_blocks(section, f"part{number}", analysis.ceilings, images)
        blocks += ending_blocks(analysis, images)
    blocks += ceiling_blocks(analysis)
    blocks += run_blocks(analysis, place)
    blocks += provenance_blocks(analysis, version)
    blocks += method_blocks(analysis)
    return Document(f"Report: {experiment.name}", subtitle, blocks, images.made)


def _lead(analysis: Analysis) -> str:
    """What there is and what it says, in a few sentences of figures."""
    runs, summaries = analysis.experiment.runs, analysis.summaries
    states = Counter(state_of(run) for run in runs)
    finished = states.pop("done", 0)
    others = f" ({', '.join(f'{count} {state}' for state, count in states.items())})" if states else ""
    trained = [run.result for run in runs if run.result is not None]
    frames, seconds = sum(r.frames for r in trained), sum(r.train_seconds for r in trained)
    parts = [
        f"{finished} of {len(runs)} runs done{others}, in {count_of(len(summaries), 'condition')}; "
        f"{frames:,} frames trained in {duration(seconds)} of run time."
    ]
    referred = [s for s in summaries if s.reference is not None and s.success.n]
    if referred:
        close = sum(_agrees(s.success, s.reference) for s in referred if s.reference is not None)
        parts.append(
            f"Of {count_of(len(referred), 'condition')} with a published figure, {close} have it within one published "
            "standard deviation of the mean, or within 0.05 where none was published."
        )
    tested = [c for section in analysis.sections for c in section.comparisons if c.adjusted is not None]
    if tested:
        found = sum(c.adjusted is not None and c.adjusted < ALPHA for c in tested)
        differs = "differs" if found == 1 else "differ"
        parts.append(
            f"Of {count_of(len(tested), 'comparison')}, {found} {differs} at p < {ALPHA} after correction."
        )
    short = sum(bool(s.short) for s in summaries)
    if short:
        parts.append(f"{count_of(short, 'condition')} {'is' if short == 1 else 'are'} too short to judge.")
    return " ".join(parts)


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
        yield Folded(f"{count_of(len(remarks), 'remark')} on the runs", [Items(remarks)])
