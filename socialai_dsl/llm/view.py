"""The observation of a seat as text, no more and no less."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any, ClassVar, Final, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.briefing import UNTOLD
from socialai_dsl.diagnostics import printable
from socialai_dsl.episodes.play import AGENT
from socialai_dsl.library import types_by_code
from socialai_dsl.llm import laws
from socialai_dsl.llm.actions import ActionLanguage, Mode
from socialai_dsl.llm.looks import (
    COMPASS,
    LOOKS,
    RELATIVE,
    Cell,
    directions_at,
    facts,
    is_surface,
    kinds_of,
    phrase,
    steps,
)
from socialai_dsl.program import VIEW, Flag, Program
from socialai_dsl.program_suite import Playable, channels_of, seats_of, words_of_looks
from socialai_dsl.render.grid import draw_ansi, letters
from socialai_dsl.vocabulary import EMPTY, NPC, UNSEEN, WALL

Style = Literal["prose", "grid", "json"]
"""Sentences with places in steps, as in the SocialAI School; a picture of letters with a legend; JSON."""

Place = tuple[int, int]
"""Steps ahead of the player, and steps to its right; negative numbers lie to its left."""
Area = tuple[int, int, int, int]
"""Least and most steps ahead, least and most to the right."""

_OWN: Final = (VIEW // 2, VIEW - 1)
_HERE: Final = (0, 0)
_UP: Final = 3
_RESTLESS: Final = (NPC, UNSEEN, *(code for code, kind in types_by_code().items() if kind.rolls))
"""Codes of what may look otherwise after a step without having changed, or moves by itself."""
_READING: Final[Mapping[Style, str]] = {
    "prose": "All other cells are empty.",
    "grid": (
        "The picture has two characters for each cell; you are the arrow in the middle of the lowest row and look up. "
        "' .' is an empty cell and '  ' one out of your sight; below, the others are explained."
    ),
    "json": (
        'Places are counted in steps, "ahead" of you and to your "right", negative to your left. An area is [least '
        'ahead, most ahead, least right, most right]. All other cells are empty. "moved": false says that your step '
        "failed."
    ),
}
"""How to read what is seen."""
_PUSHES: Final[Mapping[Place, str]] = {
    (1, 0): "ahead",
    (-1, 0): "back",
    (0, -1): "to the left",
    (0, 1): "to the right",
}
"""Where a body can be pushed, as its player sees it."""
_REMEMBERED: Final = 4096


class LastStep(NamedTuple):
    """The step that led to an observation.

    Attributes:
        movement: the word for the body action; None for no movement.
        before: the image before it, as in the observation.
        success: whether the episode has ended in success; None while it goes on.
    """

    movement: str | None
    before: NDArray[np.uint8]
    success: bool | None = None


class TextView:
    """Observations as text.

    A language model perceives what a trained agent perceives: the text depends on the observation and the lines heard
    alone, and different observations have different texts. About the step before, the text says what follows from
    the two images: that a step ahead failed, or that the player was pushed; at the end of an episode also whether it
    is a success.

    Args:
        program: of a scenario or suite.
        style: `prose` (sentences with places in steps), `grid` (letters with a legend) or `json`.
        colour: whether the letters of a grid have escape codes for colours, for a terminal.
        seat: whose observations they are.

    Attributes:
        version: of the text; it grows with every change of what models read.

    Raises:
        ValueError: there is no such style, or no such seat.
    """

    version: ClassVar[int] = 4

    def __init__(
        self, program: Playable, style: Style = "prose", colour: bool = False, seat: str = AGENT
    ) -> None:
        if style not in get_args(Style):
            raise ValueError(f"style: got {style!r}, expected one of {', '.join(get_args(Style))}")
        if seat not in seats_of(program):
            raise ValueError(f"seat: got {seat!r}, expected one of {', '.join(seats_of(program))}")
        self._style, self._colour, self._seat = style, colour, seat
        self._members = _members(program)
        self._kinds = kinds_of(list(self._members.values()))
        self._channels = channels_of(self._members.values())
        self._looks = words_of_looks(self._members.values())
        self._is_pushed = any(laws.is_pushed(program, seat) for program in self._members.values())
        self._egocentric = {laws.has(program, Flag.EGOCENTRIC) for program in self._members.values()}
        words = Counter(word for look in self._looks.values() for word in look)
        self._shared = frozenset(word for word, looks in words.items() if looks > 1)
        self._language = ActionLanguage(program)
        self._described = lru_cache(_REMEMBERED)(self._describe)

    def __getstate__(self) -> dict[str, Any]:
        """All but what was described so far, which copies describe anew."""
        return {name: value for name, value in vars(self).items() if name != "_described"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._described = lru_cache(_REMEMBERED)(self._describe)

    def instructions(self, mode: Mode = "text", goal: str = "", name: str | None = None) -> str:
        """The possible sights, actions and utterances, and the form of a reply, without a word on the solution.

        Args:
            mode: how replies are given: `text`, `json` or `tools`.
            goal: a sentence about the aim; none by default.
            name: by which others hear the player; it is told where there are several.
        """
        return "\n\n".join(
            (
                "You are in a room of square cells, in which there may be others. Every turn you are told what you "
                "see and hear, and you reply with what you do and say.",
                self.explanation(name),
                self._language.instructions(mode),
                self.task(goal),
            )
        )

    def explanation(self, name: str | None = None) -> str:
        """Who plays, how to read what is seen, who hears whom, and the order of a turn.

        Args:
            name: see `instructions`.
        """
        programs = self._members.values()
        pushed = laws.pushing(programs, self._seat)
        read = ' "pushed" says which way.' if pushed and self._style == "json" else ""
        parts = (
            laws.players(programs, name),
            f"{laws.sight(programs)} {_READING[self._style]}",
            laws.hearing(programs, self._seat),
            laws.order(programs, self._seat),
            f"{pushed}{read}",
        )
        return "\n".join(part for part in parts if part)

    def task(self, goal: str = "") -> str:
        """What ends an episode, and what is told of the aim."""
        return f"{laws.ending(self._members.values())} {goal or UNTOLD}"

    def observe(
        self,
        observation: Mapping[str, NDArray[Any]],
        info: Mapping[str, Any],
        last: LastStep | None = None,
        told: str = "",
    ) -> str:
        """The observation of the present moment as text.

        Args:
            observation: of the seat, as `ScenarioEnv` gives it.
            info: of the same step.
            last: the step before it; None at the start of an episode.
            told: what is told of the task from here on, where that changes.
        """
        image = observation["image"]
        seen = self._described(image.tobytes(), self._directions(info))
        utterance = info["utterance"]
        heard = [] if utterance == "NA" else [printable(line) for line in utterance.split("\n")]
        stayed = last is not None and last.movement == "forward" and _stayed(last.before, image)
        pushed = _pushed(last, image) if last is not None and self._is_pushed else None
        success = None if last is None else last.success
        if self._style == "json":
            more = {
                "heard": heard,
                **({"moved": False} if stayed else {}),
                **({} if pushed is None else {"pushed": pushed}),
                **({"told": told} if told else {}),
            }
            more |= {} if success is None else {"over": True, "success": success}
            return f"{seen[:-1]}, {json.dumps(more, ensure_ascii=False)[1:]}"
        lines = [told, ""] if told else []
        lines += ["You did not move."] if stayed else []
        lines += [] if pushed is None else [f"You were pushed 1 step {pushed}."]
        lines += (
            [seen, "You hear:", *(f"- {line}" for line in heard)] if heard else [seen, "You hear nothing."]
        )
        return "\n".join(lines if success is None else [*lines, over(success)])

    def by_compass(self, info: Mapping[str, Any]) -> bool:
        """Whether directions of NPCs are those of a compass in what is played; if not, they are seen from the agent."""
        return self._directions(info) is COMPASS

    def _directions(self, info: Mapping[str, Any]) -> tuple[str, ...]:
        """The words for directions of NPCs; only the members of a mixed suite differ in them."""
        egocentric = self._egocentric
        if len(egocentric) > 1:
            egocentric = {laws.has(self._members[info["member"]], Flag.EGOCENTRIC)}
        return RELATIVE if True in egocentric else COMPASS

    def _describe(self, data: bytes, directions: tuple[str, ...]) -> str:
        """What is seen in an image, given as bytes because its text is remembered."""
        image = np.frombuffer(data, np.uint8).reshape(VIEW, VIEW, len(self._channels))
        seen: dict[Place, Cell] = {}
        for across, along in np.ndindex(VIEW, VIEW):
            cell = tuple(image[across, along].tolist())
            if cell[0] != EMPTY:
                seen[VIEW - 1 - along, across - VIEW // 2] = cell
        told = {
            place: facts(cell, self._channels, self._kinds, directions_at(*place, directions), self._looks)
            for place, cell in seen.items()
        }
        words = {place: phrase(one, self._shared) for place, one in told.items()}
        carried = told.get(_HERE)
        own_hands = [] if carried is None else [f"You carry {words[_HERE]}."]
        seen.pop(_HERE, None)
        if self._style == "grid":
            return "\n".join([_picture(image, seen, words, directions, self._colour), *own_hands])
        places = sorted((p for p, cell in seen.items() if not is_surface(cell)), key=_nearness)
        kinds = sorted({cell for cell in seen.values() if is_surface(cell)}, reverse=True)
        surfaces = [[place for place, cell in seen.items() if cell == kind] for kind in kinds]
        if self._style == "json":
            things = [told[place] | {"ahead": place[0], "right": place[1]} for place in places]
            covered = [told[cells[0]] | {"areas": _areas(cells)} for cells in surfaces]
            hands = {} if carried is None else {"carrying": carried}
            return json.dumps({"seen": things, "covered": covered} | hands, ensure_ascii=False)
        lines = [f"- {_where(place)}: {words[place]}" for place in places]
        lines += [f"- {words[cells[0]]}: {'; '.join(map(_extent, _areas(cells)))}" for cells in surfaces]
        told_of_cells = ["You see:", *lines] if lines else ["You see nothing but empty cells."]
        return "\n".join([*told_of_cells, *own_hands])


def _members(program: Playable) -> dict[str | None, Program]:
    """The programs of a suite by the member's name; None is one that plays alone."""
    if isinstance(program, Program):
        return {None: program}
    return dict(zip(program.members, program.programs, strict=True))


def over(success: bool) -> str:
    """How the last message of an episode ends."""
    return f"The episode is over, {'with' if success else 'without'} success."


def _stayed(before: NDArray[np.uint8], after: NDArray[np.uint8]) -> bool:
    """Whether two pictures show that the step ahead between them failed.

    What does not move by itself looks as before, and some of it would not if the agent stood a cell further.
    """
    known = np.logical_and(*(~np.isin(image[..., 0], _RESTLESS) for image in (before, after)))
    known[_OWN] = False
    if (before != after).any(axis=-1)[known].any():
        return False
    both = known[:, 1:] & known[:, :-1]
    return bool((after[:, 1:] != before[:, :-1]).any(axis=-1)[both].any())


def _pushed(last: LastStep, after: NDArray[np.uint8]) -> str | None:
    """Where two pictures show that the player was pushed in the step between them; None where they do not.

    They do where the walls are as for a body that has gone one way, and not as for one that has gone any other.
    """
    before, now = _walls(last.before), _walls(after)
    if last.movement == "left":
        before = {(-right, ahead): wall for (ahead, right), wall in before.items()}
    elif last.movement == "right":
        before = {(right, -ahead): wall for (ahead, right), wall in before.items()}
    alone = [_HERE, (1, 0)] if last.movement == "forward" else [_HERE]
    ways: dict[Place, str | None] = {
        (ahead + far, right + aside): word for ahead, right in alone for (far, aside), word in _PUSHES.items()
    }
    ways |= dict.fromkeys(alone)
    possible = [way for way in ways if _may_have_gone(way, before, now)]
    return ways[possible[0]] if len(possible) == 1 else None


def _walls(image: NDArray[np.uint8]) -> dict[Place, bool]:
    """Whether there is a wall in each cell that a picture shows; walls stay as they are."""
    return {
        (VIEW - 1 - along, across - VIEW // 2): bool(image[across, along, 0] == WALL)
        for across, along in np.ndindex(VIEW, VIEW)
        if image[across, along, 0] != UNSEEN
    }


def _may_have_gone(way: Place, before: Mapping[Place, bool], now: Mapping[Place, bool]) -> bool:
    """Whether all walls that both pictures show are where they are for one who has gone this way."""
    ahead, right = way
    return all(now.get((far - ahead, aside - right), wall) == wall for (far, aside), wall in before.items())


def _picture(
    image: NDArray[np.uint8],
    seen: Mapping[Place, Cell],
    words: Mapping[Place, str],
    directions: tuple[str, ...],
    colour: bool,
) -> str:
    """Letters, and below them what each stands for; of people also where they are, since their letters say less."""
    codes = np.ascontiguousarray(image[..., :LOOKS].transpose(1, 0, 2))
    if directions == RELATIVE:
        people = codes[..., 0] == NPC
        codes[people, 3] = (codes[people, 3] + 1) % 4  # arrows as they are on the page
    legend: dict[str, None] = {}
    for place in sorted(seen, key=_nearness):
        cell = seen[place]
        if cell[0] != UNSEEN:
            look = letters(codes, VIEW - 1 - place[0], place[1] + VIEW // 2)
            where = f", {_where(place)}" if cell[0] == NPC else ""
            legend[f"{look} {words[place]}{where}"] = None
    return "\n".join(["You see:", draw_ansi(codes, (*_OWN, _UP), colour), *legend])


def _nearness(place: Place) -> tuple[int, Place]:
    return place[0] + abs(place[1]), place


def _areas(places: Iterable[Place]) -> list[Area]:
    """Rectangles that cover the places, each place once: as long as can be, then as deep."""
    left, found = set(places), []
    for ahead, right in sorted(left):
        if (ahead, right) not in left:
            continue
        last = right
        while (ahead, last + 1) in left:
            last += 1
        row, deep = range(right, last + 1), ahead
        while all((deep + 1, column) in left for column in row):
            deep += 1
        left -= {(line, column) for line in range(ahead, deep + 1) for column in row}
        found.append((ahead, deep, right, last))
    return found


def _where(place: Place) -> str:
    ahead, right = place
    parts = [f"{steps(ahead)} ahead"] if ahead else []
    if right:
        parts.append(f"{steps(abs(right))} to the {'right' if right > 0 else 'left'}")
    return " and ".join(parts)


def _extent(area: Area) -> str:
    """`2 to 6 ahead, from 3 left to 1 right`."""
    near, far, left, right = area
    ahead = f"{near} ahead" if near == far else f"{near} to {far} ahead"
    return f"{ahead}, {_side(left)}" if left == right else f"{ahead}, from {_side(left)} to {_side(right)}"


def _side(right: int) -> str:
    return f"{abs(right)} {'right' if right > 0 else 'left'}" if right else "straight ahead"
