"""Several programs as one batch: one action space, one vocabulary, and how each program is read in their terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from gymnasium import spaces

from socialai_dsl.engine.batch import Part
from socialai_dsl.program import BODY_WORDS, VIEW, Body, EntityColumn, Header, Program, TypeColumn


@dataclass(frozen=True)
class Merged:
    """What the programs of a batch have in common.

    Attributes:
        actions, templates, nouns: words of the action space; each string once, in order of appearance.
        vocabulary: word of each token id.
        outcomes: every way an episode can end: its name and whether it is a success.
        length: tokens in a history, L.
        parts: the programs as the engine takes them.
        highest: greatest value of each channel of the picture.
    """

    actions: tuple[str, ...]
    templates: tuple[str, ...]
    nouns: tuple[str, ...]
    vocabulary: tuple[str, ...]
    outcomes: tuple[tuple[str, bool], ...]
    length: int
    parts: tuple[Part, ...]
    highest: tuple[int, int, int, int]

    @classmethod
    def of(cls, programs: Sequence[Program]) -> Merged:
        """The union of action spaces and vocabularies."""
        actions = _union([p.actions for p in programs])
        templates = _union([p.templates for p in programs])
        nouns = _union([p.nouns for p in programs])
        vocabulary = _union([p.vocabulary for p in programs])
        endings = [[(o.name, o.success) for o in p.outcome_table] for p in programs]
        outcomes = tuple(dict.fromkeys(ending for own in endings for ending in own))
        parts = tuple(
            Part(
                words=program.words,
                rules=len(program.rules),
                outcomes=[outcomes.index(ending) for ending in own],
                actions=[*(_body(program, word) for word in actions), int(Body.NONE)],
                templates=_positions(templates, program.templates),
                nouns=_positions(nouns, program.nouns),
                tokens=_positions(program.vocabulary, vocabulary),
            )
            for program, own in zip(programs, endings, strict=True)
        )
        length = max(program.header(Header.TOKENS) for program in programs)
        kinds, colors, statuses, orientations = np.max(
            [_highest_codes(program) for program in programs], axis=0
        ).tolist()
        highest = (kinds, colors, statuses, orientations)
        return cls(actions, templates, nouns, vocabulary, outcomes, length, parts, highest)

    def action_space(self) -> spaces.MultiDiscrete:
        """[P + 1, 2, T, N]: body action (the last is no movement), speak or not, template, noun."""
        return spaces.MultiDiscrete([len(self.actions) + 1, 2, len(self.templates), len(self.nouns)])

    def observation_space(self) -> spaces.Dict:
        """Image uint8 (7, 7, 4) and tokens int16 (L,), both with true bounds."""
        high = np.broadcast_to(np.array(self.highest, np.uint8), (VIEW, VIEW, 4)).copy()
        return spaces.Dict(
            {
                "image": spaces.Box(np.zeros_like(high), high, dtype=np.uint8),
                "tokens": spaces.Box(0, len(self.vocabulary) - 1, (self.length,), np.int16),
            }
        )


def _union(lists: Sequence[Sequence[str]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(word for words in lists for word in words))


def _positions(words: Sequence[str], among: Sequence[str]) -> list[int]:
    """For each word its index in `among`, -1 if it is not there."""
    index = {word: i for i, word in enumerate(among)}
    return [index.get(word, -1) for word in words]


def _body(program: Program, word: str) -> int:
    """A body action that a scenario lacks does nothing in it."""
    return BODY_WORDS.index(word) if word in program.actions else int(Body.NONE)


def _highest_codes(program: Program) -> tuple[int, int, int, int]:
    """The greatest value of each channel of the picture."""
    h, words = program.header, program.words
    types = words[h(Header.TYPE_AT) :][: h(Header.TYPE_ROWS) * TypeColumn.COLUMNS].reshape(
        -1, TypeColumn.COLUMNS
    )
    rooms = words[h(Header.ROOM_AT) : h(Header.FRAME_AT)].view(np.uint32) if h(Header.FRAME_AT) else words[:0]
    width, height = h(Header.CANVAS_WIDTH), h(Header.CANVAS_HEIGHT)
    cells = rooms.reshape(-1, width * height + 1 + 2 * height)[:, : width * height + 1]
    kinds = max((int(kind) for kind in _kinds(program)), default=0)
    return (
        max(int(types[:, TypeColumn.CODE].max()), int((cells & 255).max())),
        5,
        max(kinds, int(types[:, TypeColumn.STATUS].max()), int((cells >> 16 & 255).max())),
        max(3, int(types[:, TypeColumn.ORIENTATION].max()), int((cells >> 24).max())),
    )


def _kinds(program: Program) -> list[int]:
    h = program.header
    start, rows = h(Header.ENTITY_AT), h(Header.ENTITIES)
    table = program.words[start : start + rows * EntityColumn.COLUMNS].reshape(rows, EntityColumn.COLUMNS)
    return table[:, EntityColumn.KIND].tolist()  # type: ignore[no-any-return]
