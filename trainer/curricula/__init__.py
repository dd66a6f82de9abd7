"""This package chooses which members of a suite are played while training, by what the agent can do so far."""

from __future__ import annotations

import importlib
from pathlib import Path

from trainer.curricula.base import Curriculum, Leaves, Tutor
from trainer.curricula.phases import Phases, read_phases
from trainer.curricula.progress import LearningProgress

__all__ = ["Curriculum", "Leaves", "Phases", "Tutor", "build_curriculum"]

SHIPPED = ("expert", "progress", "reverse")


def build_curriculum(name: str, leaves: Leaves) -> Curriculum:
    """The curriculum of a name: `expert`, `progress`, a YAML file of phases, or `my.module:MyCurriculum`.

    A class of the user's is called with the leaves.

    Raises:
        ValueError: there is no such curriculum, or it does not fit the suite.
    """
    if name == "progress":
        return LearningProgress(leaves)
    if name in SHIPPED:
        return Phases(read_phases(Path(__file__).with_name(f"{name}.yaml")), leaves)
    if name.endswith((".yaml", ".yml")):
        return Phases(read_phases(Path(name)), leaves)
    module, colon, attribute = name.partition(":")
    if not (module and colon and attribute):
        known = ", ".join(SHIPPED)
        raise ValueError(
            f"curriculum: got {name!r}, expected {known}, a .yaml file, or my.module:MyCurriculum"
        )
    try:
        made = getattr(importlib.import_module(module), attribute)(leaves)
    except (ImportError, AttributeError) as error:
        raise ValueError(f"curriculum: cannot load {name!r}: {error}") from error
    if not isinstance(made, Curriculum):
        raise ValueError(f"curriculum: {name!r} has not all of observe, weights, state and load_state")
    return made
