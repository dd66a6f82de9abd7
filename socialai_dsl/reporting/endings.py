"""Blocks about how episodes ended and which rules fired, by line of the scenario's file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from socialai_dsl.reporting import plots
from socialai_dsl.reporting.analysis import Analysis, Section, Summary
from socialai_dsl.reporting.document import Block, Cell, Folded, Heading, Meter, Table, Text
from socialai_dsl.reporting.images import Images
from socialai_dsl.reporting.records import Ending
from socialai_dsl.reporting.statistics import Spread
from socialai_dsl.reporting.wording import NONE, spread_text

_RULES_SHOWN: Final = 12


def ending_blocks(analysis: Analysis, images: Images) -> Iterator[Block]:
    """A part for each row: how training episodes ended, then the test episodes by line, and which rules fired."""
    parts = [
        Folded(row if section.is_table else f"Case study {section.group}: {row}", blocks)
        for number, section in enumerate(analysis.sections, start=1)
        for place, (row, members) in enumerate(section.panels.items(), start=1)
        if (blocks := _row(f"part{number}-endings{place}", row, section, members, images))
    ]
    if parts:
        yield Heading(2, "How episodes ended, and which rules fired", "endings")
        yield Text(
            "Shares of the test episodes by the line of the scenario's file that ended them, and how often each rule "
            "fired in an episode; both as mean ± standard deviation over the seeds that are done.",
            "note",
        )
        yield from parts


def _row(name: str, row: str, section: Section, members: Sequence[Summary], images: Images) -> list[Block]:
    labels = [section.label(summary) for summary in members]
    drawing = images.figure(
        name,
        lambda narrow: plots.endings_figure(members, labels, narrow),
        f"How training episodes of {row} ended over frames.",
        "Training episodes by how they ended, mean over seeds: successes blue, failures orange, time-outs "
        "grey.",
    )
    return [*drawing, *(block for summary in members for block in _ending_tables(summary))]


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
                Cell(_place(endings.get(name)), code=True) if _place(endings.get(name)) else NONE,
                Cell(spread_text(share), meter=Meter(share.mean, share.std)),
            ]
            for name, share in ended
        ],
    )
    if fired:
        more = f" ({len(fired) - _RULES_SHOWN} more fired)" if len(fired) > _RULES_SHOWN else ""
        yield Table(
            [f"{summary.name}: rule{more}", ">firings per episode"],
            [[Cell(name, code=True), Cell(spread_text(rate))] for name, rate in fired[:_RULES_SHOWN]],
        )


def _place(ending: Ending | None) -> str:
    return f"{ending.file}:{ending.line}" if ending is not None and ending.file is not None else ""
