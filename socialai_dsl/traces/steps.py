"""A step in words: the action and the lines heard."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program_suite import Playable
from socialai_dsl.render.panel import DialogueLine
from socialai_dsl.vocabulary import YOU


@dataclass(frozen=True)
class Step:
    """One step of an episode, in words.

    Attributes:
        t: counted from 1.
        action: the primitive's name, "none" where who plays did not move.
        said: its utterance, None if it was silent.
        heard: lines `Name: text`, in the order spoken.
    """

    t: int
    action: str
    said: str | None
    heard: tuple[str, ...]

    @property
    def dialogue(self) -> list[DialogueLine]:
        """The lines of this step, the agent's first."""
        own = [DialogueLine(self.t, YOU, self.said)] if self.said is not None else []
        return own + [heard_line(self.t, line) for line in self.heard]


def describe_step(
    program: Playable, action: Sequence[int] | NDArray[np.int64], t: int, utterance: str
) -> Step:
    """Put an action and what was heard into words."""
    primitive, speaks, template, *spoken = (int(part) for part in action)
    words = [*program.actions, "none"]
    said = program.sentences.text(template, spoken) if speaks else None
    heard = () if utterance == "NA" else tuple(utterance.splitlines())
    return Step(t, words[primitive], said, heard)


def spoken(said: Mapping[str, Step]) -> list[DialogueLine]:
    """The lines of a step of several seats: what was said there, then what somebody there heard from others, each once.

    Args:
        said: the step of each seat, by the name by which others hear it.
    """
    lines = [DialogueLine(step.t, name, step.said) for name, step in said.items() if step.said is not None]
    heard = [heard_line(step.t, line) for step in said.values() for line in step.heard]
    return list(dict.fromkeys([*lines, *heard]))


def heard_line(t: int, line: str) -> DialogueLine:
    """A line that was heard, `Name: text`, by its parts."""
    name, separator, text = line.partition(": ")
    return DialogueLine(t, name, text) if separator else DialogueLine(t, "", line)
