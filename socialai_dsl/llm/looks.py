"""Cells of the picture in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Mapping, Sequence
from typing import Any, Final

from socialai_dsl.library import types_by_code
from socialai_dsl.program import GESTURES, NO_GESTURE, EntityColumn, Header, Program, unpack_held
from socialai_dsl.render.gestures import gesture_shown
from socialai_dsl.render.marks import LookWords, marks_of
from socialai_dsl.vocabulary import COLORS, NPC, OUT_OF_SIGHT, SURFACES, UNSEEN

LOOKS: Final = 4
"""Channels that say what things look like; those behind them are gestures, and what is carried."""

COMPASS: Final = ("east", "south", "west", "north")
RELATIVE: Final = ("past you", "to your left", "away from you", "to your right")
"""Directions of others in words, absolute and as seen from the agent, which they may also face: `directions_at`."""

_ACTS: Final = {
    "forward": "just stepped forward",
    "left": "just turned left",
    "right": "just turned right",
    "toggle": "just toggled what is in front of it",
    "point": "just began to point",
    "stop": "just stopped pointing",
    "none": "just did nothing",
}

Cell = tuple[int, ...]
"""The channels of a cell, as in the observation."""


def kinds_of(programs: Sequence[Program]) -> dict[int, str]:
    """Status code in the picture -> the kind of NPC that looks so, where either has only the other."""
    words: dict[int, set[str]] = {}
    for program in programs:
        codes = program.table(Header.ENTITY_AT)[:, EntityColumn.KIND].tolist()
        for entity, code in zip(program.entities, codes, strict=True):
            if entity.role == "npc":
                words.setdefault(code, set()).add(entity.type)
    # What an NPC with a drawn kind looks like is one of several codes, of which the program holds the greatest.
    alike = {code: kinds.pop() for code, kinds in words.items() if len(kinds) == 1}
    codes = Counter(alike.values())
    return {code: kind for code, kind in alike.items() if codes[kind] == 1 and " or " not in kind}


def directions_at(ahead: int, right: int, directions: tuple[str, ...]) -> tuple[str, ...]:
    """The words for directions of somebody at a place, where one of those seen from the agent leads `towards you`."""
    if directions != RELATIVE or (ahead and right):
        return directions
    towards = 0 if ahead else 1 if right > 0 else 3
    return tuple("towards you" if n == towards else word for n, word in enumerate(directions))


def is_surface(cell: Cell) -> bool:
    """Whether a cell shows what usually covers many cells, or nothing because it is out of sight."""
    found = types_by_code().get(cell[0])
    return cell[0] == UNSEEN or (found is not None and found.name in SURFACES)


def facts(
    cell: Cell,
    channels: Sequence[str],
    kinds: Mapping[int, str],
    directions: tuple[str, ...],
    looks: LookWords,
) -> dict[str, Any]:
    """The facts of a cell: `what` it is and, as far as it has them, `color`, `state`, direction, gestures, looks.

    Args:
        cell: not an empty one.
        channels: names of its numbers.
        kinds: see `kinds_of`.
        directions: of NPCs, in words: `COMPASS`, or see `directions_at`.
        looks: words of the channels that are looks.
    """
    numbers = dict(zip(channels, cell, strict=True))
    marks = marks_of(looks, [numbers[name] for name in looks])
    told = _facts(cell, numbers, kinds, directions)
    return told | {"looks": {mark.look: mark.word for mark in marks}} if marks else told


def _facts(
    cell: Cell, numbers: Mapping[str, int], kinds: Mapping[int, str], directions: tuple[str, ...]
) -> dict[str, Any]:
    kind, colour, status, orientation = cell[:LOOKS]
    if kind == UNSEEN:
        return {"what": OUT_OF_SIGHT}
    if kind == NPC:
        what = kinds.get(status, f"person of look {status}")
        look = {"what": what, "color": COLORS[colour], "facing": directions[orientation]}
        return look | _gestures(numbers, directions) | _carried(numbers)
    found = types_by_code().get(kind)
    if found is None:
        return {"what": f"thing {kind}.{status}.{orientation}", "color": COLORS[colour]}
    told = {"what": found.name.replace("_", " ")}
    if found.name not in SURFACES or colour != found.color:
        told["color"] = COLORS[colour]
    if len(found.states) > 1:
        shown = {found.shown.get(i, (i, 0))[0]: state for i, state in enumerate(found.states)}
        told["state"] = shown[status]
    if status in found.rolls:
        told["moving"] = COMPASS[orientation]
    return told


def phrase(told: Mapping[str, Any], shared: Container[str] = ()) -> str:
    """Facts in a few words: `a closed red door`, `a small striped ball`, `a blue guide, mood angry, facing east`.

    Args:
        told: see `facts`.
        shared: words of several looks, beside which a thing has the name of the look.
    """
    looks = {} if told["what"] == OUT_OF_SIGHT else told.get("looks", {})
    plain = [
        word
        for word in looks.values()
        if "facing" not in told and word not in shared and word != told.get("state")
    ]
    named = " ".join([*plain, *(told[key] for key in ("state", "color", "what") if key in told)])
    doing = [f"{look} {word}" for look, word in looks.items() if word not in plain]
    doing += [f"{key} {told[key]}" for key in ("facing", "moving", "pointing", "carrying") if key in told]
    doing += [told["last"]] if "last" in told else []
    if told["what"] == OUT_OF_SIGHT:
        return named
    return ", ".join([_with_article(named), *doing])


def _with_article(words: str) -> str:
    return f"{'an' if words[0] in 'aeiou' else 'a'} {words}"


def _carried(shown: Mapping[str, int]) -> dict[str, str]:
    """What an NPC carries, where the picture shows it."""
    held = shown.get("carrying", NO_GESTURE)
    if held == NO_GESTURE:
        return {}
    kind, colour = unpack_held(held)
    found = types_by_code().get(kind)
    return {
        "carrying": _with_article(f"{COLORS[colour]} {found.name.replace('_', ' ') if found else 'thing'}")
    }


def _gestures(shown: Mapping[str, int], directions: tuple[str, ...]) -> dict[str, str]:
    """Where an NPC points and what it did last, where the picture shows gestures."""
    pointing, act = shown.get("pointing", NO_GESTURE), shown.get("last_act", NO_GESTURE)
    if act == NO_GESTURE:
        return {}
    gesture = gesture_shown(pointing, act, *(shown.get(name, NO_GESTURE) for name in GESTURES[2:]))
    towards = {} if gesture.pointing is None else {"pointing": directions[gesture.pointing]}
    if gesture.cell is not None:
        towards = {"pointing": f"at the cell {_beside_it(*gesture.cell)}"}
    return towards | {"last": _ACTS[gesture.act]}


def _beside_it(right: int, nearer: int) -> str:
    """Where a cell lies, as the reader sees it: `2 steps beyond it and 1 step to the left of it`."""
    ways = (nearer, ("before it", "beyond it")), (right, ("to the right of it", "to the left of it"))
    parts = [f"{steps(abs(far))} {words[far < 0]}" for far, words in ways if far]
    return " and ".join(parts) or "that it is on"


def steps(count: int) -> str:
    """A number of steps in words."""
    return "1 step" if count == 1 else f"{count} steps"
