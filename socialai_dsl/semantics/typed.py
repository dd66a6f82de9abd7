"""Reads a player's line: a movement, an utterance or both, completed and corrected."""

import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.vocabulary import PRIMITIVES, Sentences, normal

STANDING: Final = (".", "none")
"""What is typed for standing still."""


def split_line(line: str, actions: Sequence[str]) -> tuple[str | None, str | None]:
    """Split what was typed into movement and utterance; a movement may be shortened while it is clear."""
    first, _, rest = line.partition(" ")
    if first in STANDING:
        return None, rest.strip() or None
    meant = [action for action in actions if first and action.startswith(first.lower())]
    if first.lower() in actions:
        meant = [first.lower()]
    # A capital begins an utterance unless the whole word is a movement.
    if len(meant) == 1 and (first.islower() or first.lower() in actions):
        return meant[0], rest.strip() or None
    return None, line or None


def typed(action: str, said: str | None) -> str:
    """An act as it is typed, so that it is read as itself."""
    if said is None or action != STANDING[1]:
        return action if said is None else f"{action} {said}"
    return said if split_line(said, PRIMITIVES) == (None, said) else f"{STANDING[1]} {said}"


def trace_command(scenario: str, room: Sequence[str], acts: Iterable[str]) -> str:
    """The command that shows a room, given by options, and what is done there, as it is pasted into a terminal."""
    typed_acts = [word for act in acts for word in ("--do", act)]
    return shlex.join(["socialai", "trace", scenario, *room, *typed_acts])


@dataclass(frozen=True)
class Phrases:
    """Everything that can be said.

    Attributes:
        actions: words for movements.
        grammar: what can be said.
    """

    actions: Sequence[str]
    grammar: Sentences

    def act(self, line: str) -> tuple[str | None, str | None]:
        """The movement and the sentence that are typed, the sentence as the grammar writes what is heard alike."""
        movement, said = split_line(line, self.actions)
        alike = (
            sentence for sentence in self.sentences() if said is not None and normal(sentence) == normal(said)
        )
        return movement, next(alike, said)

    def sentences(self) -> list[str]:
        """Each sentence once, by template, then by what stands in its slots."""
        return list(dict.fromkeys(self.grammar.text(*spoken) for spoken in self.grammar.each()))

    def completed(self, line: str) -> str | None:
        """The line with its utterance written out, where what is typed begins one; None where nothing does."""
        before, begun = self._parts(line)
        if not begun:
            return None
        fitting = (said for said in self.sentences() if said.casefold().startswith(begun.casefold()))
        found = next(fitting, None)
        return None if found is None else before + found

    def corrected(self, line: str) -> str | None:
        """The line with the movement or the sentence that was probably meant; None where none is near."""
        before, begun = self._parts(line)
        near = did_you_mean(begun, self.sentences())
        if near is not None:
            return before + near
        first, _, rest = begun.partition(" ")
        movement = None if before.strip() else did_you_mean(first, (*self.actions, "none"))
        said = (
            rest.strip() if rest.strip() in self.sentences() else did_you_mean(rest.strip(), self.sentences())
        )
        if movement is None or (rest.strip() and said is None):
            return None
        return f"{movement} {said}" if said else movement

    def problem(self, line: str) -> str:
        """The problem of a line that is neither an action nor an utterance."""
        movement, said = split_line(line, self.actions)
        sentence = movement is not None or line[:1].isupper()
        what = f"{said!r} cannot be said" if sentence else f"{line!r} can be neither done nor said"
        near = self.corrected(line)
        if near is not None:
            return f"{what}; did you mean {near!r}?"
        return what if sentence else f"{what}; movements are {', '.join((*self.actions, *STANDING))}"

    def _parts(self, line: str) -> tuple[str, str]:
        """What stands before the utterance, and the utterance as far as it is typed."""
        _, said = split_line(line.lstrip(), self.actions)
        begun = said or ""
        return line[: len(line) - len(begun)] if line.endswith(begun) else "", begun
