"""The agent's observation as text, no more and no less."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.briefing import UNTOLD
from socialai_dsl.diagnostics import printable
from socialai_dsl.llm.actions import ActionLanguage, Mode
from socialai_dsl.llm.looks import (
    COMPASS,
    LOOKS,
    RELATIVE,
    Cell,
    facts,
    is_surface,
    kinds_of,
    phrase,
    steps,
)
from socialai_dsl.program import VIEW, Flag, Header, Program
from socialai_dsl.program_suite import Playable, channels_of, words_of_looks
from socialai_dsl.render.grid import draw_ansi, letters
from socialai_dsl.vocabulary import EMPTY, NPC, UNSEEN

Style = Literal["prose", "grid", "json"]
"""Sentences with places in steps, as in the SocialAI School; a picture of letters with a legend; JSON."""

_OWN: Final = (VIEW // 2, VIEW - 1)
_UP: Final = 3
_REMEMBERED: Final = 4096

Place = tuple[int, int]
"""Steps ahead of the agent, and steps to its right; negative numbers lie to its left."""
Area = tuple[int, int, int, int]
"""Least and most steps ahead, least and most to the right."""


class TextView:
    """Observations as text.

    A language model perceives what a trained agent perceives: the text depends on the observation and the lines heard
    alone, and different observations have different texts.

    Args:
        program: of a scenario or suite.
        style: `prose` (sentences with places in steps), `grid` (letters with a legend) or `json`.
        colour: whether the letters of a grid have escape codes for colours, for a terminal.

    Raises:
        ValueError: there is no such style.
    """

    def __init__(self, program: Playable, style: Style = "prose", colour: bool = False) -> None:
        if style not in get_args(Style):
            raise ValueError(f"style: got {style!r}, expected one of {', '.join(get_args(Style))}")
        self._style, self._colour = style, colour
        self._members = _members(program)
        self._kinds = kinds_of(list(self._members.values()))
        self._channels = channels_of(self._members.values())
        self._looks = words_of_looks(self._members.values())
        self._egocentric = {_is_egocentric(program) for program in self._members.values()}
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

    def instructions(self, mode: Mode = "text", goal: str = "") -> str:
        """The possible sights, actions and utterances, and the form of a reply, without a word on the solution.

        Args:
            mode: how replies are given: `text`, `json` or `tools`.
            goal: a sentence about the aim; none by default.
        """
        return "\n\n".join(
            (
                "You are in a room of square cells, in which there may be others. Every turn you are told what you "
                "see and hear, and you reply with what you do and say.",
                self.explanation(),
                self._language.instructions(mode),
                self.task(goal),
            )
        )

    def task(self, goal: str = "") -> str:
        """How long an episode lasts, and what is told of the aim."""
        turns = max(program.header(Header.HORIZON) for program in self._members.values())
        return f"An episode lasts {turns} turns at most. {goal or UNTOLD}"

    def observe(self, observation: Mapping[str, NDArray[Any]], info: Mapping[str, Any]) -> str:
        """The observation of the present moment as text.

        Args:
            observation: of `ScenarioEnv`.
            info: of the same step.
        """
        image = observation["image"]
        seen = self._described(image.tobytes(), self._directions(info))
        utterance = info["utterance"]
        heard = [] if utterance == "NA" else [printable(line) for line in utterance.split("\n")]
        if self._style == "json":
            return f'{seen[:-1]}, "heard": {json.dumps(heard, ensure_ascii=False)}}}'
        return "\n".join(
            [seen, "You hear:", *(f"- {line}" for line in heard)] if heard else [seen, "You hear nothing."]
        )

    def explanation(self) -> str:
        """How to read what is seen."""
        blocked = any(program.header(Header.FLAGS) & Flag.OCCLUSION for program in self._members.values())
        parts = [
            f"You see the cells up to {VIEW - 1} steps ahead of you and up to {VIEW // 2} steps to your left and "
            f"right{', as far as nothing blocks your sight' if blocked else ''}."
        ]
        if True in self._egocentric:
            parts.append("Directions of others are given as seen from you.")
        if False in self._egocentric:
            parts.append("Directions of others are those of a compass; your own is not given.")
        if self._style == "grid":
            parts.append(
                "The picture has two characters for each cell; you are the arrow in the middle of the lowest row and "
                "look up. ' .' is an empty cell and '  ' one out of your sight; below, the others are explained."
            )
        elif self._style == "json":
            parts.append(
                'Places are counted in steps, "ahead" of you and to your "right", negative to your left. An area is '
                "[least ahead, most ahead, least right, most right]. All other cells are empty."
            )
        else:
            parts.append("All other cells are empty.")
        return " ".join(parts)

    def by_compass(self, info: Mapping[str, Any]) -> bool:
        """Whether directions of NPCs are those of a compass in what is played; if not, they are seen from the agent."""
        return self._directions(info) is COMPASS

    def _directions(self, info: Mapping[str, Any]) -> tuple[str, ...]:
        """The words for directions of NPCs; only the members of a mixed suite differ in them."""
        egocentric = self._egocentric
        if len(egocentric) > 1:
            egocentric = {_is_egocentric(self._members[info["member"]])}
        return RELATIVE if True in egocentric else COMPASS

    def _describe(self, data: bytes, directions: tuple[str, ...]) -> str:
        """What is seen in an image, given as bytes because its text is remembered."""
        image = np.frombuffer(data, np.uint8).reshape(VIEW, VIEW, len(self._channels))
        seen: dict[Place, Cell] = {}
        for across, along in np.ndindex(VIEW, VIEW):
            cell = tuple(image[across, along].tolist())
            if (across, along) != _OWN and cell[0] != EMPTY:
                seen[VIEW - 1 - along, across - VIEW // 2] = cell
        own = tuple(image[_OWN].tolist())
        told = {
            cell: facts(cell, self._channels, self._kinds, directions, self._looks)
            for cell in (*seen.values(), own)
        }
        carried = None if own[0] == EMPTY else told[own]
        words = {cell: phrase(one, self._shared) for cell, one in told.items()}
        own_hands = [] if carried is None else [f"You carry {words[own]}."]
        if self._style == "grid":
            return "\n".join([_picture(image, seen, words, directions, self._colour), *own_hands])
        places = sorted((p for p, cell in seen.items() if not is_surface(cell)), key=_nearness)
        surfaces = sorted({cell for cell in seen.values() if is_surface(cell)}, reverse=True)
        areas = {cell: _areas(place for place, found in seen.items() if found == cell) for cell in surfaces}
        if self._style == "json":
            things = [told[seen[place]] | {"ahead": place[0], "right": place[1]} for place in places]
            covered = [told[cell] | {"areas": areas[cell]} for cell in surfaces]
            hands = {} if carried is None else {"carrying": carried}
            return json.dumps({"seen": things, "covered": covered} | hands, ensure_ascii=False)
        lines = [f"- {_where(place)}: {words[seen[place]]}" for place in places]
        lines += [f"- {words[cell]}: {'; '.join(map(_extent, areas[cell]))}" for cell in surfaces]
        told_of_cells = ["You see:", *lines] if lines else ["You see nothing but empty cells."]
        return "\n".join([*told_of_cells, *own_hands])


def _members(program: Playable) -> dict[str | None, Program]:
    """The programs of a suite by the member's name; None is one that plays alone."""
    if isinstance(program, Program):
        return {None: program}
    return dict(zip(program.members, program.programs, strict=True))


def _is_egocentric(program: Program) -> bool:
    return bool(program.header(Header.FLAGS) & Flag.EGOCENTRIC)


def _picture(
    image: NDArray[np.uint8],
    seen: Mapping[Place, Cell],
    words: Mapping[Cell, str],
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
            legend[f"{look} {words[cell]}{where}"] = None
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
