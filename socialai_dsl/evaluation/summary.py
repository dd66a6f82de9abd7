"""What an evaluation found, as rows of text."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from socialai_dsl.runs.folder import RESULT

_NUMBERS_SHOWN: Final = 8
_RULES_SHOWN: Final = 12
_TEXT_WIDTH: Final = 64
_TEST: Final = "test"

Row = tuple[str, str]


def summary_rows(figures: Mapping[str, Any]) -> list[Row]:
    """Success with its interval, in all and in parts, such as seats and members of a suite; then length and return."""
    rooms = figures.get("rooms", _TEST)  # older results know of no others
    manner = f", {figures['actions']}" if figures["actions"] else ""
    rows = [
        ("success", f"{figures['success_rate']:.1%}, 95% interval {_interval(figures)} {_by(figures)}"),
        ("episodes", f"{figures['episodes']} {_of_rooms(rooms)}{manner}"),
        ("mean length", f"{figures['mean_length']:.1f} steps"),
        ("mean return", f"{figures['mean_return']:.3f}"),
    ]
    rows[1:1] = [
        (f"  trial {number}", f"{trial['success_rate']:.1%} of {trial['episodes']}")
        for number, trial in enumerate(figures.get("trials", ()), 1)
    ]
    rows[1:1] = [
        (f"  {draw} {value}", f"{found['success_rate']:.1%} of {found['episodes']}, {_interval(found)}")
        for draw, values in figures.get("results_by", {}).items()
        for value, found in values.items()
    ]
    rows[1:1] = [
        (f"  {member}", f"{played['success_rate']:.1%} of the {played['share']:.1%} that played it")
        for member, played in figures.get("members", {}).items()
        if played["share"] > 0
    ]
    rows[1:1] = [
        (f"  of {seat}", f"{found['success_rate']:.1%}, {_interval(found)}")
        for seat, found in figures.get("seats", {}).items()
    ]
    rows[1:1] = [
        (f"  with {partner}", f"{found['success_rate']:.1%}, {_interval(found)}")
        for partner, found in figures.get("with", {}).items()
    ]
    if "invalid_rate" in figures:
        rows += _model_rows(figures)
    for seat, found in figures.get("models", {}).items():
        rows += [(f"{name} of {seat}", value) for name, value in _model_rows(found)]
    if figures.get("unsolved"):
        rows.append(("unsolved", _numbers(figures["unsolved"], rooms)))
    return rows


def _by(figures: Mapping[str, Any]) -> str:
    """How the interval was found."""
    session = figures.get("session", 1)
    return "(Wilson)" if session == 1 else f"(Wilson, over sessions of {session} episodes)"


def _interval(figures: Mapping[str, Any]) -> str:
    low, high = figures["success_interval"]
    return f"{low:.1%} to {high:.1%}"


def _model_rows(figures: Mapping[str, Any]) -> list[Row]:
    """What counts for language models alone."""
    tokens = f"{figures['prompt_tokens']:,} read and {figures['completion_tokens']:,} written"
    rows = [
        ("invalid", f"{figures['invalid_rate']:.1%} of {figures['replies']:,} replies"),
        ("tokens", tokens + (", estimated" if figures["tokens_estimated"] else "")),
    ]
    if figures.get("stops"):
        told = ", ".join(f"{name} {count:,}" for name, count in figures["stops"].items())
        without = f"{figures['stopped_replies']:,} of them without an action, apart from the invalid ones"
        rows.insert(1, ("stopped", f"{told}; {without}"))
    return rows + ([("cost", f"${figures['cost']:.4f}")] if figures["cost"] is not None else [])


def probe_lines(figures: Mapping[str, Any]) -> list[str]:
    """How a language model answered the probes, beside what guessing gets right; nothing if none were asked."""
    rows = [(name, _answered(probe)) for name, probe in figures.get("probes", {}).items()]
    return ["probes, apart from success", *(f"  {line}" for line in aligned(rows))] if rows else []


def _answered(probe: Mapping[str, Any]) -> str:
    if not probe["asked"]:
        return "never asked"
    unread = f", {probe['unread']} without an answer" if probe["unread"] else ""
    return f"{probe['right'] / probe['asked']:.1%} of {probe['asked']} right, by chance {probe['chance']:.1%}{unread}"


def ending_rows(figures: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Share, text and place of the ways in which episodes ended, successes first; what never happened is left out."""
    endings = sorted(
        (ending for ending in figures["endings"] if ending["episodes"]),
        key=lambda ending: (not ending["success"], -ending["share"]),
    )
    return [
        (f"{e['share']:.1%}", e["text"], f"{e['file']}:{e['line']}" if e["file"] else "") for e in endings
    ]


def ending_lines(figures: Mapping[str, Any]) -> list[str]:
    """`ending_rows` as a table for the terminal."""
    rows = [(share, _shortened(text), place) for share, text, place in ending_rows(figures)]
    width = max((len(text) for _, text, _ in rows), default=0)
    lines = [f"  {share:>6}  {text:<{width}}  {place}".rstrip() for share, text, place in rows]
    return ["how the episodes ended", *lines]


def rule_lines(figures: Mapping[str, Any]) -> list[str]:
    """The rules that fired most often; nothing if none did."""
    fired = sorted(
        ((rate, name) for name, rate in figures["rules"].items() if rate > 0), key=lambda rule: -rule[0]
    )
    if not fired:
        return []
    lines = [f"  {rate:>6.2f}  {name}" for rate, name in fired[:_RULES_SHOWN]]
    more = len(fired) - _RULES_SHOWN
    lines += [f"          and {more} more"] if more > 0 else []
    return ["rules that fired, per episode", *lines]


def aligned(rows: Sequence[Row]) -> list[str]:
    """Two columns."""
    width = max(len(name) for name, _ in rows)
    return [f"{name:<{width}}  {value}" for name, value in rows]


def _shortened(text: str) -> str:
    return text if len(text) <= _TEXT_WIDTH else text[: _TEXT_WIDTH - 1] + "…"


def _of_rooms(rooms: str) -> str:
    return "of the test set" if rooms == _TEST else f"in rooms of {rooms.replace(':', ' ')}"


def _numbers(episodes: list[int], rooms: str) -> str:
    """The first of a list of episodes; `result.json` has them all."""
    shown = ", ".join(map(str, episodes[:_NUMBERS_SHOWN]))
    more = len(episodes) - _NUMBERS_SHOWN
    what = "test episodes" if rooms == _TEST else "rooms"
    return f"{what} {shown}" + (f" and {more} more (all in {RESULT})" if more > 0 else "")
