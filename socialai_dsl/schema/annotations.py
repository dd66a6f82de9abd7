"""Questions about the models: the keys and kinds of values that belong at a place, in words for authors."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from typing import Annotated, Any, Final, Literal, get_args, get_origin

from pydantic import BaseModel

from socialai_dsl.schema import curriculum as c
from socialai_dsl.schema import experiment as e
from socialai_dsl.schema import scenario as s
from socialai_dsl.schema import study as y
from socialai_dsl.schema.files import TestsFile
from socialai_dsl.schema.holds import TEXTS, Hides, Holds, Kind, Means, branches, said_of
from socialai_dsl.schema.suite import Entry, Split, Suite, Value, Values
from socialai_dsl.source import DataPath

CALLED: Final[dict[type, str]] = {
    s.Scenario: "a scenario",
    s.Frame: "a frame",
    s.State: "a state",
    s.FirstRule: "a rule of `first`",
    s.ThenRule: "a rule of `then`",
    s.Step: "a step",
    s.CastMember: "a member of the cast",
    s.Npc: "an npc file",
    s.NpcDefaults: "`npc_defaults`",
    s.Role: "a role",
    s.WorldRule: "a rule of the world",
    s.Sequence: "a sequence",
    s.SungWith: "the utterance of a sequence",
    s.Memory: "a memory",
    s.Register: "a register",
    s.Look: "a look",
    s.Belief: "a belief",
    s.Source: "a source of a belief",
    s.Reward: "`reward`",
    s.ObjectGroup: "an object",
    s.Room: "the room",
    s.Observe: "`observe`",
    s.UtteranceGrammar: "a grammar",
    s.Outcome: "an outcome",
    s.Property: "a property of `check`",
    s.Published: "a published figure",
    s.OnlyThrough: "`only_through`",
    s.Session: "`session`",
    s.Dilemma: "`dilemma`",
    s.Probe: "a probe",
    s.DialogueTest: "an entry of `tests`",
    s.DialogueRoom: "the room of a test",
    s.DialogueStep: "a step of a test",
    TestsFile: "a file of tests",
    s.Parameter: "a parameter",
    Suite: "a suite",
    Split: "a split",
    Entry: "a member",
    Value: "a value of a tree",
    e.Experiment: "an experiment",
    e.Condition: "a condition",
    e.Grid: "a grid",
    e.Settings: "settings",
    e.Override: "an override",
    e.Profile: "a profile",
    e.Transfer: "a test",
    e.Reference: "a reference",
    e.Asked: "options of a model",
    c.Curriculum: "a curriculum",
    c.Phase: "a phase",
    c.Group: "a group of members",
    c.Ramp: "a weight that changes",
    c.Until: "the end of a phase",
    y.Study: "a study",
    y.Practice: "practice",
    y.Criterion: "the criterion of practice",
    y.Block: "a block",
    y.Question: "a question",
    y.Assign: "`assign`",
    y.Pay: "`pay`",
    y.Exclude: "`exclude`",
    y.Recruit: "`recruit`",
    y.End: "the end of a study",
}
"""How messages call what a model describes."""


@cache
def fields_of(model: type[BaseModel]) -> dict[str, Any]:
    """Each key of a mapping of this kind, as authors write it, and the annotation of its value."""
    return {
        field.alias or name: Annotated[field.annotation, *field.metadata]
        if field.metadata
        else field.annotation
        for name, field in model.model_fields.items()
    }


def keys_of(model: type) -> list[str]:
    """The keys a mapping of this kind can have, as authors write them."""
    assert issubclass(model, BaseModel), "internal: only models have keys"
    return [*fields_of(model)]


def home_of(key: str, owner: type | None) -> str | None:
    """Where a key that is misplaced in `owner` would belong, in a file of the same kind."""
    homes = [
        called
        for model, called in CALLED.items()
        if key in keys_of(model) and _family(model) == _family(owner)
    ]
    return " or ".join(dict.fromkeys(homes[:2])) if homes else None


def _family(model: type | None) -> str:
    """The kind of file that a model is a part of: an experiment, a curriculum, a study, or any about scenarios."""
    module = model.__module__ if model is not None else ""
    return module if module in (e.__name__, c.__name__, y.__name__) else ""


def model_at(model: type[BaseModel], path: DataPath) -> type[BaseModel] | None:
    """The model of the mapping at `path`; None if there is none."""
    return _model_of(annotation_at(model, path))


def _model_of(annotation: Any) -> type[BaseModel] | None:
    for part in branches(annotation):
        if isinstance(part, type) and issubclass(part, BaseModel):
            return part
    return None


def models_along(
    model: type[BaseModel], path: DataPath
) -> Iterator[tuple[str | int, type[BaseModel] | None]]:
    """Each step of a path, with the model of the mapping that has it as a key; None if that mapping has no model."""
    annotation: Any = model
    for step in path:
        yield step, _model_of(annotation)
        annotation = _step(annotation, step)


def annotation_at(model: type[BaseModel], path: DataPath) -> Any:
    """The annotation of the part of a model at `path`; Any if the model has no such part."""
    annotation: Any = model
    for step in path:
        annotation = _step(annotation, step)
    return annotation


def _step(annotation: Any, step: str | int) -> Any:
    for part in branches(annotation):
        origin, arguments = get_origin(part), get_args(part)
        if isinstance(part, type) and issubclass(part, BaseModel):
            if step in (fields := fields_of(part)):
                return fields[step]
            if part is Value and isinstance(step, str):
                return Values
        elif origin is dict and isinstance(step, str):
            return arguments[1]
        elif origin in (tuple, list) and isinstance(step, int):
            return (
                arguments[0]
                if arguments[-1:] == (...,) or origin is list
                else arguments[min(step, len(arguments) - 1)]
            )
    return Any


# -- what a key holds ----------------------------------------------------------------------------------------


def holds_of(annotation: Any) -> Holds | None:
    """What a place with this annotation holds; None if nothing says so."""
    said = said_of(annotation, Holds)
    if said is not None:
        return said
    for part in branches(annotation):
        if get_origin(part) in (tuple, list):
            return holds_of(get_args(part)[0])
        if get_origin(part) is Literal:
            return Holds("word")
        if get_origin(part) is dict or (isinstance(part, type) and issubclass(part, BaseModel)):
            return Holds("section")
        if part in (int, float, bool):
            return Holds("truth" if part is bool else "number")
    return None


def held_at(model: type[BaseModel], path: DataPath) -> Holds | None:
    """What the key at a path of a file holds, or that of the list that the path leads into; None if it is unknown.

    The path of a patch leads on into the scenario or suite that is patched.
    """
    annotation: Any = model
    held: Holds | None = Holds("section")
    for step in path:
        below = _step(annotation, step)
        if isinstance(step, int):
            # A list holds what its items do; where each of a group has one, the model has one.
            annotation = annotation if below is Any else below
        elif held is not None and held.kind == "patch":
            annotation = _patched(step)
            held = holds_of(annotation)
        else:
            annotation, held = below, holds_of(below)
    return held


def named_by_keys(model: type[BaseModel], path: DataPath) -> Holds | None:
    """What the keys of the mapping at a path are, if it is one of names."""
    for part in branches(annotation_at(model, path)):
        if get_origin(part) is dict:
            return holds_of(get_args(part)[0])
    return None


_STEP: Final = re.compile(r"\[[^\[\]]*\]|[^.\[\]]+")


def _patched(path: str) -> Any:
    """The annotation of what a patch changes, whose path is a text such as `outcome[0].success`."""
    steps = tuple(0 if step.startswith("[") else step for step in _STEP.findall(path))
    found = (annotation_at(model, steps) for model in (s.Scenario, Suite))
    return next((annotation for annotation in found if annotation is not Any), Any)


@cache
def conditions_of(model: type[BaseModel]) -> dict[str, Means]:
    """The keys of a kind of rule that say in the language what they ask for."""
    said = {key: said_of(annotation, Means) for key, annotation in fields_of(model).items()}
    return {key: means for key, means in said.items() if means is not None}


def has_unknown_key(model: type[BaseModel], path: DataPath) -> bool:
    """Whether a path goes through a key that the model there does not have."""
    along = models_along(model, path)
    return any(one is not None and isinstance(step, str) and step not in keys_of(one) for step, one in along)


def may_hide(model: type[BaseModel], path: DataPath) -> bool:
    """Whether a mistake at a path may make other parts of the file look wrong."""
    if model_at(model, path[:-1]) is None:
        return True  # an entry of a mapping of names, or of a list
    annotation = annotation_at(model, path)
    said, held = said_of(annotation, Hides), holds_of(annotation)
    return said.others if said is not None else held is None or not held.is_alone


def keys_that_hold(model: type[BaseModel], *kinds: Kind) -> list[str]:
    """The keys of a model that hold something of these kinds."""
    held = {key: holds_of(annotation) for key, annotation in fields_of(model).items()}
    return [key for key, holds in held.items() if holds is not None and holds.kind in kinds]


@cache
def texts_by_key() -> dict[str, Holds]:
    """What a key holds that is a text in every model that has it, for one that stands in a wrong place."""
    found: dict[str, Holds] = {}
    others: set[str] = set()
    for model in CALLED:
        for key, annotation in fields_of(model).items():
            held = holds_of(annotation)
            if held is not None and held.kind in TEXTS:
                found.setdefault(key, held)
            elif held is not None and held.kind != "section":
                others.add(key)
    return {key: held for key, held in found.items() if key not in others}


def sections_of(model: type[BaseModel]) -> tuple[list[str], list[str]]:
    """The sections that a file may leave out, empty by default: the mappings, then the lists."""
    mappings, lists = list[str](), list[str]()
    for key, field in zip(fields_of(model), model.model_fields.values(), strict=True):
        kinds = [get_origin(part) or part for part in branches(field.annotation)]
        if any(kind is dict or (isinstance(kind, type) and issubclass(kind, BaseModel)) for kind in kinds):
            mappings.append(key)
        elif {tuple, list} & {*kinds} and (
            field.is_required() or not field.get_default(call_default_factory=True)
        ):
            lists.append(key)
    return mappings, lists


def literals(annotation: Any) -> list[object]:
    """The words that a place is limited to."""
    return [word for part in branches(annotation) if get_origin(part) is Literal for word in get_args(part)]


_SCALARS: Final = {int: "a whole number", float: "a number", bool: "`true` or `false`", str: "a text"}


def expectation(annotation: Any) -> str:
    """The expected value, in words."""
    parts = [part for part in branches(annotation) if part is not type(None)]
    if all(kind in parts for kind in (int, bool, str)):
        return "an expression"
    for part in parts:
        if part in _SCALARS:
            return _SCALARS[part]
        if isinstance(part, type) and issubclass(part, BaseModel):
            return "a mapping with keys such as " + ", ".join(f"`{k}`" for k in keys_of(part)[:3])
        if get_origin(part) is dict:
            return "a mapping of names"
        if get_origin(part) in (tuple, list):
            return "a list"
    return "something else"
