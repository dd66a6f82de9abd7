"""Checks a curriculum's file by itself; whether its groups are in a suite is known when the suite is trained on."""

from __future__ import annotations

from socialai_dsl.diagnostics import DiagnosticBag
from socialai_dsl.loader.resolved import ResolvedFile
from socialai_dsl.schema.curriculum import Curriculum
from socialai_dsl.schema.shape import model_of


def check_curriculum(resolved: ResolvedFile, bag: DiagnosticBag) -> Curriculum | None:
    """The curriculum of a file, None if there is none; `bag` takes the findings."""
    shaped = model_of(Curriculum, resolved.tree, bag, parameters=False)
    curriculum = shaped.model
    for number, phase in enumerate(curriculum.phases[:-1] if curriculum is not None else ()):
        if phase.until is None:
            message = f"phase {number + 1} never ends, so those after it are never played"
            span = shaped.tree.value_span(("phases", number))
            bag.error("S105", message, span, hint="give it `until`, or make it the last one")
    return curriculum
