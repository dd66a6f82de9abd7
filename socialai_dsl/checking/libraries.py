"""Files that scenarios use: their shape is checked here, what they mean where they are used."""

from __future__ import annotations

from socialai_dsl.diagnostics import DiagnosticBag
from socialai_dsl.library import GrammarLibrary, ObjectLibrary
from socialai_dsl.loader import Resolved
from socialai_dsl.schema import Npc
from socialai_dsl.schema.shape import model_of


def check_npc(resolved: Resolved, bag: DiagnosticBag) -> None:
    """The shape of an npc file."""
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    model_of(Npc, resolved.data, resolved, bag, partial=resolved.data.get("abstract") is True)


def check_library(resolved: Resolved, bag: DiagnosticBag) -> None:
    """The shape of a library."""
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    kind = resolved.data["library"]
    if kind == "objects":
        model_of(ObjectLibrary, resolved.data, resolved, bag, parameters=False)
    elif kind == "grammars":
        model_of(GrammarLibrary, resolved.data, resolved, bag, parameters=False)
    else:
        message = f"there is no library of `{kind}`"
        bag.error("S103", message, resolved.value_span(("library",)), hint="one of objects, grammars")
