"""The sections of a report about several players: cross-play, dilemmas, words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from socialai_dsl.reporting.crossplay import matrix_size
from socialai_dsl.reporting.records import (
    CrossPlayRecord,
    DilemmaRecord,
    Rate,
    SeatWordsRecord,
    SituationRecord,
    WordsRecord,
)
from socialai_dsl.reporting.statistics import Estimate
from socialai_dsl.reporting.style import scenario_name
from socialai_dsl.reporting.written import NONE, Rows, interval

_MOST_TABLES: Final = 4
"""Situations whose tables stand open, of those that are told most of."""
_MOST_SAID: Final = 8
"""Messages that have a column of their own."""
_REM: Final = 6.3
"""Widths of the page for an inch of a figure."""


def crossplay_part(anchor: str, found: CrossPlayRecord) -> dict[str, Any]:
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


def dilemma_part(anchor: str, found: DilemmaRecord) -> dict[str, Any]:
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


def words_part(anchor: str, found: WordsRecord) -> dict[str, Any]:
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
        shares = {text: f"{count / total:.2f}" if total else NONE for text, count in counts.items()}
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
    return NONE if rate is None else interval(Estimate(rate.success, *rate.interval))
