"""What is known of a word of the language without its meaning: how it is written, where it may stand, what it gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Argument = Literal[
    "entity",
    "entities",
    "int",
    "direction",
    "turn",
    "utterance",
    "state",
    "status",
    "action",
    "side",
    "group",
    "any",
    "actions",
    "sequence",
]
Subject = Literal["entity", "member", "agent", "object", "cell", "none"]


@dataclass(frozen=True, slots=True)
class Signature:
    """One word.

    Attributes:
        name: the word.
        subject: what stands before the dot; in a frame it may be left out and is then the NPC itself.
        takes: its arguments; `entities` is one or a group, of which any one suffices.
        gives: what a condition or value is, in words.
        doc: one line for the reference.
        momentary: it speaks of the current step, so it means nothing before the first.
        candidate: the candidate cell of a place, `here`, may be its subject as a place that is asked for.
        cell: a cell may be its subject.
        optional: how many of the last arguments may be left out.
        also: what authors write for it; messages name the word instead.
    """

    name: str
    subject: Subject = "none"
    takes: tuple[Argument, ...] = ()
    gives: str = ""
    doc: str = ""
    momentary: bool = False
    candidate: bool = False
    cell: bool = False
    optional: int = 0
    also: tuple[str, ...] = ()


@dataclass(frozen=True)
class Words:
    """The words of the language, as the parts of it know them that lie below their meanings.

    Attributes:
        values: by name. quantifiers: those that take a group, such as `any`.
        reserved: what nothing that an author declares may be called.
    """

    values: Mapping[str, Signature] = field(default_factory=dict)
    quantifiers: frozenset[str] = frozenset()
    reserved: frozenset[str] = frozenset()
