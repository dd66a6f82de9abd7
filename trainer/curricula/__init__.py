"""Curricula: the choice of a suite's members while training, by the episodes so far."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from socialai_dsl.frontend import load_curriculum
from socialai_dsl.trainer.curricula.base import Curriculum, Leaves, Tutor
from socialai_dsl.trainer.curricula.even import EvenFrames
from socialai_dsl.trainer.curricula.phases import Phases
from socialai_dsl.trainer.curricula.progress import LearningProgress
from socialai_dsl.trainer.extensions import load_class

__all__ = ["Curriculum", "Leaves", "Phases", "Tutor", "build_curriculum"]

_CLASSES: dict[str, Callable[[Leaves], Curriculum]] = {"even": EvenFrames, "progress": LearningProgress}

SHIPPED = ("even", "expert", "ladder", "progress", "reverse")


def build_curriculum(name: str, leaves: Leaves, folder: Path = Path()) -> Curriculum:
    """The curriculum of a name: one of `SHIPPED`, a YAML file of phases, or `mine:Curriculum`.

    Files are looked for in `folder` first. A class of the user's is built as `Curriculum(leaves)`.

    Raises:
        ValueError: there is no such curriculum, or it does not fit the suite.
        ScenarioError: the file has mistakes.
    """
    if name in _CLASSES:
        return _CLASSES[name](leaves)
    if name in SHIPPED:
        return Phases(load_curriculum(Path(__file__).with_name(f"{name}.yaml")), leaves)
    if name.endswith((".yaml", ".yml")):
        beside = folder / name
        return Phases(load_curriculum(str(beside) if beside.is_file() else name), leaves)
    made: Curriculum = load_class(name, "curriculum", (*SHIPPED, "a .yaml file"), Curriculum, folder)(leaves)
    return made
