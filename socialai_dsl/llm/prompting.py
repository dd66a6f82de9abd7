"""How a model plays: what it is shown, how it answers, and what it is told of the episodes of a session."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from socialai_dsl.llm.actions import Mode
from socialai_dsl.llm.episode import OnInvalid
from socialai_dsl.llm.history import WHOLE
from socialai_dsl.llm.view import Style

Probing = Literal["apart", "kept", "off"]
"""Whether the scenario's probes are asked: apart from play, so that later requests hold nothing of it, kept like other
messages, or not at all."""


@dataclass(frozen=True)
class PromptOptions:
    """How a model plays.

    Attributes:
        style, mode, on_invalid: see `Episode`.
        history: how many observations a request holds, the present one included; None: the whole episode.
        grammar: whether replies are held to a grammar, which llama.cpp's server understands.
        probes: see `Probing`.
        trials: how many episodes in a row are one conversation, in which the model is told how each ended.
    """

    style: Style = "prose"
    mode: Mode = "text"
    on_invalid: OnInvalid = "noop"
    history: int | None = WHOLE
    grammar: bool = False
    probes: Probing = "apart"
    trials: int = 1

    @property
    def of_episodes(self) -> dict[str, Any]:
        """The arguments of `Episode` among them."""
        return {name: getattr(self, name) for name in ("style", "mode", "on_invalid")}

    def heading(self, trial: int) -> str:
        """What stands before the first observation of a trial, which are counted from 0."""
        if self.trials == 1:
            return ""
        return f"Episode {trial + 1} of {self.trials} begins, in a room of its own.\n"

    def told(self, instructions: str) -> str:
        """The instructions of an episode with what is told of the session."""
        if self.trials == 1:
            return instructions
        return (
            f"{instructions}\n\nYou play {self.trials} episodes in a row, each in a room of its own, and are told how "
            "each ended. What you find out in one may help you in the next."
        )
