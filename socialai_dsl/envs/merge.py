"""The programs of a batch behind one action space and one vocabulary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from gymnasium import spaces

from socialai_dsl.engine.batch import LinkedProgram
from socialai_dsl.program import (
    LOOKS,
    NO_GESTURE,
    VIEW,
    Body,
    EntityColumn,
    Header,
    Program,
    TypeColumn,
    room_words,
)
from socialai_dsl.program_suite import Playable, ProgramSuite, channels_of, look_channels, mixture, prefixed
from socialai_dsl.vocabulary import ACTIONS, Sentences
from socialai_dsl.widths import MOST_WORDS, TOKEN


@dataclass(frozen=True)
class CommonSpace:
    """The common action space and vocabulary of a batch's programs.

    Attributes:
        playable: the scenario or suite; of several their mixture.
        programs: the programs of all of them. members: what each is called among several.
        pools: for each scenario or suite given, the numbers of its programs.
        length: tokens in a history, L.
        parts: the programs as the engine takes them.
        channels: of the picture: those that one of the programs shows.
        highest: greatest value of each of them.
    """

    playable: Playable
    programs: tuple[Program, ...]
    members: tuple[str, ...]
    pools: tuple[tuple[int, ...], ...]
    length: int
    parts: tuple[LinkedProgram, ...]
    channels: tuple[str, ...]
    highest: tuple[int, ...]

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Itself: nothing changes it."""
        return self

    @classmethod
    def of(cls, playables: Sequence[Playable]) -> CommonSpace:
        """Scenarios and suites, each given once."""
        playable = playables[0] if len(playables) == 1 else mixture(playables)
        suite = playable if isinstance(playable, ProgramSuite) else mixture([playable])
        channels = channels_of(suite.programs)
        parts = _parts(suite, playable, channels)
        length = max(program.header(Header.TOKENS) for program in suite.programs)
        highest = np.max([_highest_codes(program) for program in suite.programs], axis=0).tolist()
        highest += [NO_GESTURE] * (len(channels) - len(highest))
        if len(playable.vocabulary) > MOST_WORDS:
            got = f"{len(playable.vocabulary):,} different words"
            raise ValueError(f"scenarios: got {got} together, expected at most {MOST_WORDS:,}")
        return cls(
            playable,
            suite.programs,
            suite.members,
            _pools(playables),
            length,
            parts,
            channels,
            tuple(highest),
        )

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """Word of each token id."""
        return self.playable.vocabulary

    def action_space(self) -> spaces.MultiDiscrete:
        """[P + 1, 2, T, N...]: body action (the last is no movement), speak or not, template, a word for each slot."""
        sentences = self.playable.sentences
        sizes = [len(slot.words) for slot in sentences.slots]
        return spaces.MultiDiscrete([len(self.playable.actions) + 1, 2, len(sentences.templates), *sizes])

    def observation_space(self) -> spaces.Dict:
        """Image uint8 (7, 7, channels) and tokens int16 (L,), both with true bounds."""
        high = np.broadcast_to(np.array(self.highest, np.uint8), (VIEW, VIEW, len(self.highest))).copy()
        return spaces.Dict(
            {
                "image": spaces.Box(np.zeros_like(high), high, dtype=np.uint8),
                "tokens": spaces.Box(0, len(self.vocabulary) - 1, (self.length,), np.dtype(TOKEN).type),
            }
        )


def _pools(playables: Sequence[Playable]) -> tuple[tuple[int, ...], ...]:
    """Numbers of programs, counted on from scenario to scenario."""
    sizes = [len(p.programs) if isinstance(p, ProgramSuite) else 1 for p in playables]
    ends = np.cumsum(sizes).tolist()
    return tuple(tuple(range(end - size, end)) for size, end in zip(sizes, ends, strict=True))


def _parts(suite: ProgramSuite, playable: Playable, channels: Sequence[str]) -> tuple[LinkedProgram, ...]:
    """Each program with its links into the batch."""
    token = {word: i for i, word in enumerate(playable.vocabulary)}
    ending = {name: i for i, name in enumerate(playable.outcomes)}
    own = look_channels(suite.programs)
    return tuple(
        LinkedProgram(
            program,
            outcomes=[ending[name] for name in _endings(member, program, playable)],
            actions=[*(_body(program, word) for word in suite.actions), int(Body.NONE)],
            templates=list(templates),
            slots=[list(one) for one in slots],
            strides=_strides(program.sentences, suite.sentences, templates),
            tokens=[token[word] for word in program.vocabulary],
            looks=[channels.index(own[look]) - len(LOOKS) for look in program.looks],
        )
        for member, program, templates, slots in zip(
            suite.members, suite.programs, suite.template_maps, suite.slot_maps, strict=True
        )
    )


def _strides(own: Sentences, shared: Sentences, templates: Sequence[int]) -> list[list[int]]:
    """For each template of the batch the filling of a program where it has no slot, and what each slot adds to that."""
    places = {slot.name: place for place, slot in enumerate(own.slots)}
    rows = []
    for template in templates:
        used = own.used[template] if template >= 0 else (False,) * len(own.slots)
        base = own.filling([0 if is_used else None for is_used in used])
        found = (places.get(slot.name) for slot in shared.slots)
        rows.append([base, *(own.strides[p] if p is not None and used[p] else 0 for p in found)])
    return rows


def _endings(member: str, program: Program, playable: Playable) -> list[str]:
    """What the ways to end of one program are called in the batch."""
    if isinstance(playable, Program):
        return program.outcomes
    return [prefixed(member, name) for name in program.outcomes]


def _body(program: Program, word: str) -> int:
    """A body action that a scenario lacks does nothing in it."""
    return ACTIONS.index(word) if word in program.actions else int(Body.NONE)


def _highest_codes(program: Program) -> tuple[int, int, int, int]:
    """The greatest value of each channel of the picture."""
    h, words = program.header, program.words
    types = program.table(Header.TYPE_AT)
    rooms = words[h(Header.ROOM_AT) : h(Header.FRAME_AT)].view(np.uint32) if h(Header.FRAME_AT) else words[:0]
    width, height = h(Header.CANVAS_WIDTH), h(Header.CANVAS_HEIGHT)
    cells = rooms.reshape(-1, room_words(width, height))[:, : width * height + 1]
    kinds = int(program.table(Header.ENTITY_AT)[:, EntityColumn.KIND].max(initial=0))
    return (
        max(int(types[:, TypeColumn.CODE].max()), int((cells & 255).max())),
        5,
        max(kinds, int(types[:, TypeColumn.STATUS].max()), int((cells >> 16 & 255).max())),
        max(
            3, len(program.seat_table), int(types[:, TypeColumn.ORIENTATION].max()), int((cells >> 24).max())
        ),
    )
