"""Several programs behind one action space and one vocabulary: what a suite compiles to."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from itertools import chain
from math import lcm
from typing import Any, Self

from socialai_dsl.program import CHANNELS, FrameColumn, Header, Outcome, Program
from socialai_dsl.vocabulary import NOUN, Sentences, Slot

Positions = tuple[int, ...]
"""For each word of the shared list a member's own index, -1 if it has no such word."""


@dataclass(frozen=True, eq=False)
class ProgramSuite:
    """The programs of a suite, of which each episode plays one.

    Attributes:
        name: canonical name with its variants.
        programs: in the order of the suite.
        members: the name of each program in layouts, infos and counters.
        actions: words of the shared body actions, by index.
        sentences: what can be said, with shared templates and slots.
        template_maps: for each program its own index of each shared template, -1 without one.
        slot_maps: for each program and shared slot its own index of each word, -1 without one.
        labels: parameters and values of members that are leaves of a tree or were swept over.
        weights: relative probability of each program in an episode; all equal if empty.
        starts: the layout that each member's episodes start from, None where they are drawn; empty if none has one.
        in_sequence: whether an episode plays all of them, one after another.
    """

    name: str
    programs: tuple[Program, ...]
    members: tuple[str, ...]
    actions: tuple[str, ...]
    sentences: Sentences
    template_maps: tuple[Positions, ...]
    slot_maps: tuple[tuple[Positions, ...], ...]
    labels: tuple[Mapping[str, str], ...] = ()
    weights: tuple[int, ...] = ()
    starts: tuple[Mapping[str, Any] | None, ...] = ()
    in_sequence: bool = False

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Itself: nothing changes it."""
        return self

    @property
    def templates(self) -> tuple[str, ...]:
        """The templates of what can be said."""
        return self.sentences.templates

    @property
    def nouns(self) -> tuple[str, ...]:
        """What `<noun>` can be; of a grammar with `slots` the words of each, one slot after the other."""
        return tuple(word for slot in self.sentences.slots for word in slot.words)

    @property
    def session(self) -> int:
        """The number of successive episodes that share draws: the least common multiple of the programs' numbers."""
        return lcm(*(program.session for program in self.programs))

    @cached_property
    def vocabulary(self) -> tuple[str, ...]:
        """The word of each token id, each once, in the order of the members; 0 pads, 1 is unknown."""
        return _union(program.vocabulary for program in self.programs)

    @cached_property
    def outcome_table(self) -> tuple[Outcome, ...]:
        """Every way that an episode can end, each with its member's name before it."""
        table: dict[str, Outcome] = {}
        for member, program in zip(self.members, self.programs, strict=True):
            for outcome in program.outcome_table:
                name = prefixed(member, outcome.name)
                table.setdefault(name, Outcome(name, outcome.success, outcome.span))
        return tuple(table.values())

    @cached_property
    def outcomes(self) -> list[str]:
        """Names of the ways an episode can end, by index."""
        return [outcome.name for outcome in self.outcome_table]

    @cached_property
    def sha256(self) -> str:
        """Digest of everything that decides what an environment does and shows."""
        digest = sha256()
        for program in self.programs:
            digest.update(program.sha256.encode())
        slots = self.sentences.slots
        for words in (self.members, self.actions, self.templates, *(slot.words for slot in slots)):
            digest.update("\x1f".join(words).encode())
            digest.update(b"\x1e")
        names = [slot.name for slot in slots]
        slot_maps = tuple(own for (own,) in self.slot_maps) if names == [NOUN] else (names, self.slot_maps)
        digest.update(repr((self.template_maps, slot_maps)).encode())
        if any(weight != 1 for weight in self.weights):
            digest.update(repr(self.weights).encode())
        if any(start is not None for start in self.starts):
            digest.update(json.dumps(self.starts, sort_keys=True).encode())
        if self.in_sequence:
            digest.update(b"in sequence")
        return digest.hexdigest()

    def live(self, number: int) -> tuple[frozenset[int], ...]:
        """Indices of the templates, then of the words of each slot, that mean something while one program is played."""
        own = self.template_maps[number], *self.slot_maps[number]
        return tuple(frozenset(i for i, at in enumerate(one) if at >= 0) for one in own)

    def listing(self) -> str:
        """The programs as text, one behind the other."""
        return "\n".join(
            f"=== {member} ===\n{program.listing()}"
            for member, program in zip(self.members, self.programs, strict=True)
        )


Playable = Program | ProgramSuite
"""What environments are made of."""


def seats_of(playable: Playable) -> tuple[str, ...]:
    """The members of the cast that players can play, the agent first; of a suite those that all its programs have."""
    programs = playable.programs if isinstance(playable, ProgramSuite) else (playable,)
    names = [tuple(map(str, program.seats)) for program in programs]
    return names[0] if len(set(names)) == 1 else names[0][:1]


def has_script(playable: Playable, seat: str) -> bool:
    """Whether a member of the cast follows a frame; of a suite, in all its programs."""
    programs = playable.programs if isinstance(playable, ProgramSuite) else (playable,)
    for program in programs:
        framed = program.table(Header.FRAME_AT)[:, FrameColumn.ENTITY].tolist()
        if seat not in [str(program.entities[number]) for number in framed]:
            return False
    return True


def channels_of(programs: Iterable[Program]) -> tuple[str, ...]:
    """The channels of pictures in which several programs are shown: those that one of them has, looks last."""
    programs = tuple(programs)
    shown = {name for program in programs for name in program.channels}
    return (*(name for name in CHANNELS if name in shown), *words_of_looks(programs))


def words_of_looks(programs: Iterable[Program]) -> dict[str, tuple[str, ...]]:
    """The words of each channel of looks in pictures in which several programs are shown, by name."""
    return {name: words for (_, words), name in look_channels(programs).items()}


def look_channels(programs: Iterable[Program]) -> dict[tuple[str, tuple[str, ...]], str]:
    """The channel of each look, by its name and words, in pictures in which several programs are shown.

    Looks of one name share a channel if they have the same words. A further one with other words has a channel of its
    own, whose name lists them: `size`, then `size: small medium large`.
    """
    found: dict[tuple[str, tuple[str, ...]], str] = {}
    for look in dict.fromkeys(look for program in programs for look in program.looks):
        name, words = look
        found[look] = f"{name}: {' '.join(words)}" if name in found.values() else name
    return found


def prefixed(member: str, name: str) -> str:
    """How a name of one member is called among those of several."""
    return f"{member}: {name}"


def outcome_name(info: Mapping[str, Any]) -> str:
    """How an episode ended, as `Playable.outcomes` calls it, from the info of its last step."""
    return prefixed(info["member"], info["outcome"]) if "member" in info else str(info["outcome"])


def mixture(playables: Sequence[Playable]) -> ProgramSuite:
    """Programs and suites as one suite: templates, slots and words are shared by text, each keeps its sentences."""
    templates = _union(playable.templates for playable in playables)
    names = _union([slot.name for slot in playable.sentences.slots] for playable in playables)
    slots = [
        Slot(
            name,
            _union(s.words for playable in playables for s in playable.sentences.slots if s.name == name),
        )
        for name in names
    ]
    parts = [part for playable in playables for part in _parts(playable)]
    actions = _union(playable.actions for playable in playables)
    template_maps = tuple(_positions(templates, part.templates) for part in parts)
    slot_maps = tuple(
        tuple(_positions(slot.words, part.slots.get(slot.name, {})) for slot in slots) for part in parts
    )
    own = [part.program.sentences for part in parts]
    return ProgramSuite(
        " | ".join(dict.fromkeys(playable.name for playable in playables)),
        tuple(part.program for part in parts),
        _distinct([part.name for part in parts]),
        actions,
        Sentences.shared(templates, slots, list(zip(own, template_maps, strict=True))),
        template_maps,
        slot_maps,
    )


def _distinct(names: Sequence[str]) -> tuple[str, ...]:
    """The names, numbered where one comes again."""
    return tuple(
        name if name not in names[:i] else f"{name} #{names[:i].count(name) + 1}"
        for i, name in enumerate(names)
    )


@dataclass(frozen=True, slots=True)
class _Part:
    """A program of a mixture: what it is called, and its own index of each template and each word of its slots."""

    name: str
    program: Program
    templates: Mapping[str, int]
    slots: Mapping[str, Mapping[str, int]]


def _parts(playable: Playable) -> list[_Part]:
    if isinstance(playable, Program):
        templates = {word: i for i, word in enumerate(playable.templates)}
        slots = {
            slot.name: {word: i for i, word in enumerate(slot.words)} for slot in playable.sentences.slots
        }
        return [_Part(playable.name, playable, templates, slots)]
    return [
        _Part(
            prefixed(playable.name, member),
            program,
            {word: i for word, i in zip(playable.templates, own_templates, strict=True) if i >= 0},
            {
                slot.name: {word: i for word, i in zip(slot.words, own, strict=True) if i >= 0}
                for slot, own in zip(playable.sentences.slots, own_slots, strict=True)
            },
        )
        for member, program, own_templates, own_slots in zip(
            playable.members, playable.programs, playable.template_maps, playable.slot_maps, strict=True
        )
    ]


def _positions(words: Sequence[str], own: Mapping[str, int]) -> Positions:
    return tuple(own.get(word, -1) for word in words)


def _union(lists: Iterable[Sequence[str]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(chain.from_iterable(lists)))
