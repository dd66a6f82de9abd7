"""Whole files as models, with the keys that the loader resolves first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Final

from pydantic import BaseModel, Field

from socialai_dsl.schema.curriculum import Curriculum
from socialai_dsl.schema.experiment import Experiment
from socialai_dsl.schema.holds import Holds
from socialai_dsl.schema.library import GrammarLibrary, ObjectLibrary
from socialai_dsl.schema.scenario import DialogueTest, Model, Npc, Prose, Scenario, Word
from socialai_dsl.schema.study import Study
from socialai_dsl.schema.suite import Patch, Suite

FileName = Annotated[str, Holds("file")]

_EXTENDS: Final[Any] = Field(
    None, description="a file of the same kind that this one builds on; keys given here replace or add to its"
)


class ScenarioFile(Scenario):
    """A scenario, perhaps built on another."""

    extends: FileName | None = _EXTENDS


class NpcFile(Npc):
    """An NPC in a file of its own, perhaps built on another."""

    extends: FileName | None = _EXTENDS


class SuiteFile(Suite):
    """A suite, perhaps built on another."""

    extends: FileName | None = _EXTENDS


class ExperimentFile(Experiment):
    """An experiment, perhaps built on another."""

    extends: FileName | None = _EXTENDS


class CurriculumFile(Curriculum):
    """A curriculum, perhaps built on another."""

    extends: FileName | None = _EXTENDS


class StudyFile(Study):
    """A study, perhaps built on another."""

    extends: FileName | None = _EXTENDS


class ObjectLibraryFile(ObjectLibrary):
    """Object types in a file, perhaps built on another."""

    extends: FileName | None = _EXTENDS


class GrammarLibraryFile(GrammarLibrary):
    """Utterance grammars in a file, perhaps built on another."""

    extends: FileName | None = _EXTENDS


class VariantFile(Model):
    """A patch: what is removed from a scenario or suite, then set, then added."""

    variant: Annotated[str, Holds("new name")] = Field(description="the name of the variant")
    of: FileName = Field(description="the file it is a variant of, or `any`", examples=["shop.yaml", "any"])
    about: Prose | None = Field(None, description="one sentence for people")
    notes: Prose | None = Field(None, description="more for people")
    skills: list[Prose] = Field(default_factory=list, description="the skills that it needs, for people")
    remove: list[Annotated[str, Holds("spelt")]] = Field(
        default_factory=list, description="paths of what is removed", examples=[["cast.liar"]]
    )
    set: Patch = Field(
        default_factory=dict, description="path: value in place of what is there", examples=[{"horizon": 50}]
    )
    add: Patch = Field(default_factory=dict, description="path: items or keys that are added")


class TestsFile(Model):
    """Tests of a scenario in a file of their own, `NAME.tests.yaml` beside it."""

    __test__: ClassVar[bool] = False  # pytest takes it for a test

    tests_of: FileName = Field(
        min_length=1,
        description="the scenario's file, with variants and parameters",
        examples=["gatekeeper.yaml"],
    )
    about: Prose | None = Field(None, description="one sentence for people")
    notes: Prose | None = Field(None, description="more for people")
    tests: dict[Word, DialogueTest] = Field(
        min_length=1, description="name: a dialogue that `socialai test` plays"
    )
    extends: FileName | None = _EXTENDS


FILES: Final[dict[str, tuple[type[BaseModel], ...]]] = {
    "scenario": (ScenarioFile,),
    "npc": (NpcFile,),
    "variant": (VariantFile,),
    "suite": (SuiteFile,),
    "library": (ObjectLibraryFile, GrammarLibraryFile),
    "experiment": (ExperimentFile,),
    "curriculum": (CurriculumFile,),
    "study": (StudyFile,),
    "tests_of": (TestsFile,),
}
"""The key that says the kind of a file -> the models of such files; exactly one of these keys is present."""


def model_of_file(root: Mapping[str, object]) -> type[BaseModel] | None:
    """The model of a file with these keys; None if nothing says which it is."""
    if root.get("library") == "grammars":
        return GrammarLibraryFile
    return next((models[0] for kind, models in FILES.items() if kind in root), None)
