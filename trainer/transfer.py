"""This module says what is different for an agent that plays another scenario than the one it was trained on."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

from trainer.checkpoint import CheckpointMeta

_WORDS_SHOWN = 6


class TransferWarning(UserWarning):
    """An agent plays something else than it was trained on."""


def warn_of_differences(meta: CheckpointMeta, program: Any) -> None:
    """Warn if a checkpoint is played on another program than it was made for, naming what differs.

    Words of the dialogue are left out: `checkpoint.restore_net` moves them, and warns by itself.
    """
    if meta.program_sha256 == program.sha256:
        return
    made_for = f"{meta.scenario} " if meta.scenario else ""
    message = (
        f"the agent was trained on {made_for}(program {meta.program_sha256[:8]}) "
        f"and plays {program.name} ({program.sha256[:8]})"
    )
    parts = [message, *_differences(meta, program)]
    warnings.warn("; ".join(parts), TransferWarning, stacklevel=3)


def _differences(meta: CheckpointMeta, program: Any) -> list[str]:
    """What each choice of the agent's action means, where that has changed."""
    if not meta.actions:  # made before checkpoints knew
        return []
    compared = (
        ("actions", meta.actions, program.actions),
        ("templates", meta.templates, program.templates),
        ("nouns", meta.nouns, program.nouns),
    )
    return [f"{what}: {_changes(old, new)}" for what, old, new in compared if list(old) != list(new)]


def _changes(old: Sequence[str], new: Sequence[str]) -> str:
    """`2: "Hello" is now "Good day", ...`, the first few."""
    changed = [
        f'{i}: "{before}" is now "{after}"'
        for i, (before, after) in enumerate(zip(old, new, strict=False))
        if before != after
    ]
    if len(old) != len(new):
        changed.append(f"{len(old)} are now {len(new)}")
    more = len(changed) - _WORDS_SHOWN
    return ", ".join(changed[:_WORDS_SHOWN]) + (f" and {more} more" if more > 0 else "")
