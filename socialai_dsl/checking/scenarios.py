"""Checks a scenario's file: parameters put in, groups of the cast written out, then shape and meaning."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, ScenarioError, Severity, did_you_mean
from socialai_dsl.library import GrammarLibrary, ObjectLibrary, prelude, shared_grammars
from socialai_dsl.loader.reader import Data, read_plain
from socialai_dsl.loader.resolved import ResolvedFile
from socialai_dsl.schema.scenario import CastMember, Npc, Scenario
from socialai_dsl.schema.shape import PARAMETER, MovedPlaces, ShapedFile, model_of, written
from socialai_dsl.semantics.check import check_meaning
from socialai_dsl.semantics.plans import CheckedScenario
from socialai_dsl.source import DataPath, Positions
from socialai_dsl.vocabulary import PRIMITIVES

Value = int | bool | float | str

_WHOLE = re.compile(r"\$([A-Za-z_]\w*)")


@dataclass(frozen=True)
class Substitution:
    """A document with its parameters put in.

    Attributes:
        data: a copy in which every value that was `$name` is the parameter's value.
        values: parameter -> value, for those inside expressions.
        paths: where a whole value was a parameter.
    """

    data: Mapping[str, object]
    values: dict[str, Value] = field(default_factory=dict)
    paths: frozenset[DataPath] = frozenset()


def substitute(resolved: ResolvedFile, bag: DiagnosticBag) -> Substitution:
    """Put the parameters in: defaults, or what was given behind `?`. Reports S206."""
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    values, declared = _values(resolved, bag), _declared(resolved)
    paths: list[DataPath] = []

    def filled(part: Data, path: DataPath) -> Data:
        if isinstance(part, dict):
            return {key: filled(value, (*path, key)) for key, value in part.items()}
        if isinstance(part, list):
            return [filled(value, (*path, i)) for i, value in enumerate(part)]
        match = _WHOLE.fullmatch(part) if isinstance(part, str) else None
        if match is None:
            return part
        name = match.group(1)
        if name in values:
            paths.append(path)
            return values[name]
        if name not in declared:  # without a default, it is reported where it is declared
            near = did_you_mean(name, values)
            span = resolved.locate(path, 0, len(name) + 1)
            bag.error("S206", f"unknown parameter `{name}`", span, suggestion=near)
        return part

    data = {key: part if key == "params" else filled(part, (key,)) for key, part in resolved.data.items()}
    return Substitution(data, values, frozenset(paths))


def _values(resolved: ResolvedFile, bag: DiagnosticBag) -> dict[str, Value]:
    declared = _declared(resolved)
    values: dict[str, Value] = {}
    for name, declaration in declared.items():
        default = _entry(declaration, "default") if isinstance(declaration, dict) else declaration
        choices = _entry(declaration, "values") if isinstance(declaration, dict) else None
        if default is not None and choices is not None:
            default = _chosen(name, default, choices, resolved, bag)
        if name in resolved.params:
            default = _given(name, default, choices, resolved, bag)
        if isinstance(default, int | bool | float | str):
            values[name] = default
    for name in resolved.params:
        if name not in declared:
            near = did_you_mean(name, declared)
            hint = None if near else "it has " + ", ".join(declared) if declared else "it has none"
            message = f"`{resolved.name}` has no parameter `{name}`"
            bag.error("S206", message, resolved.param_span(name), suggestion=near, hint=hint)
    return values


def _declared(resolved: ResolvedFile) -> dict[str, Data]:
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    declared = _entry(resolved.data, "params")
    return declared if isinstance(declared, dict) else {}


def _entry(mapping: Mapping[str, Data], key: str) -> Data:
    """The value of a key, also of one that is misspelt: the models report that, and no parameter is unknown for it."""
    if key in mapping:
        return mapping[key]
    return next((value for word, value in mapping.items() if did_you_mean(word, [key])), None)


def _chosen(name: str, default: Data, choices: Data, resolved: ResolvedFile, bag: DiagnosticBag) -> Data:
    """The value that the default is, or, where values have labels, stands for."""
    if isinstance(choices, dict) and default in choices.values():
        return default
    labels = list(map(str, choices)) if isinstance(choices, dict | list) else [str(default)]
    if str(default) not in labels:
        near = did_you_mean(str(default), labels)
        span = resolved.value_span(("params", name, "default"))
        hint = None if near else "one of " + ", ".join(labels)
        message = f"the default of `{name}` is none of its values"
        bag.error("S206", message, span, suggestion=near, hint=hint)
    return choices.get(str(default), default) if isinstance(choices, dict) else default


def _given(name: str, default: Data, choices: Data, resolved: ResolvedFile, bag: DiagnosticBag) -> Data:
    """The value that was asked for, read as YAML would read it; the default if it cannot be had."""
    text, span = resolved.params[name], resolved.param_span(name)
    if isinstance(choices, dict):
        if text not in choices:
            near = did_you_mean(text, choices)
            hint = None if near else "one of " + ", ".join(choices)
            bag.error("S206", f"`{text}` is none of the values of `{name}`", span, suggestion=near, hint=hint)
        return choices.get(text, default)
    value = read_plain(text).value
    if isinstance(choices, list) and (value not in choices or isinstance(value, bool) != _any_bool(choices)):
        hint = "one of " + ", ".join(map(str, choices))
        bag.error("S206", f"`{text}` is none of the values of `{name}`", span, hint=hint)
        return default
    if choices is None and not _alike(value, default):
        message = f"`{text}` is not of the kind of the default of `{name}`, `{default}`"
        bag.error("S206", message, span)
        return default
    return value


def _any_bool(choices: list[Data]) -> bool:
    return any(isinstance(choice, bool) for choice in choices)


def _alike(value: Data, default: Data) -> bool:
    if isinstance(value, bool) or isinstance(default, bool):
        return isinstance(value, bool) and isinstance(default, bool)
    if isinstance(value, int | float) or isinstance(default, int | float):
        return isinstance(value, int | float) and isinstance(default, int | float)
    return isinstance(value, str)


MOST_MEMBERS: Final = 16
_AGENT: Final = "agent"
_KEYS: Final = frozenset(field.alias or name for name, field in CastMember.model_fields.items())
_ONE_EACH: Final = ("name", "color", "place", "facing", "at")
"""Keys of a group whose lists give one value each."""


@dataclass(frozen=True)
class SpreadCast:
    """A document whose groups of the cast are written out.

    Attributes:
        data: the document.
        places: where its parts stand; those of a member of a group, where the group is written.
        paths: the paths that were given, in the document as it is now.
    """

    data: Mapping[str, object]
    places: Positions
    paths: frozenset[DataPath]


def spread(
    data: Mapping[str, object], places: Positions, paths: frozenset[DataPath], bag: DiagnosticBag
) -> SpreadCast:
    """Write out the groups; reports counts that are none, and lists of another length.

    Args:
        data: a scenario as plain data.
        places: where its parts stand.
        paths: of values that were a parameter.
        bag: takes the findings.
    """
    cast = data.get("cast")
    if not isinstance(cast, dict):
        return SpreadCast(data, places, paths)
    members: dict[str, object] = {}
    origins: dict[DataPath, DataPath] = {}
    for name, member in cast.items():
        if "[" in str(name):
            message = f"`{name}` is not a name"
            hint = "a group is written once, with `count:`"
            bag.error("S104", message, places.key_span(("cast", name)), hint=hint)
        member = _with_one_frame(name, member, places, bag)
        if not isinstance(member, dict) or "count" not in member or name == _AGENT:
            members[name] = _alone(name, member, places, bag)
            continue
        count = _count(name, member["count"], places, bag)
        for i in range(count or 1):
            members[f"{name}[{i}]"] = _one(name, member, i, count, places, bag, origins)
            origins[("cast", f"{name}[{i}]")] = ("cast", name)
    if members == cast:
        return SpreadCast(data, places, paths)
    moved = {copy for copy in _paths(members, ("cast",)) if written(copy, origins) in paths}
    return SpreadCast({**data, "cast": members}, MovedPlaces(places, origins), paths | moved)


def _with_one_frame(name: str, member: object, places: Positions, bag: DiagnosticBag) -> object:
    """A member that is given several frames with the first of them only."""
    if not isinstance(member, dict):
        return member
    for key in ("frames", "frame"):
        given = member.get(key)
        if not isinstance(given, list):
            continue
        made = {other: value for other, value in member.items() if other != key}
        words = [str(word) for word in given]
        if len(words) > 1:
            message = f"`{words[0]}` and `{words[1]}` would both move `{name}`: a member follows one frame"
            hint = "join them in one frame, or let two members follow them"
            bag.error("S313", message, places.value_span(("cast", name, key, 1)), hint=hint)
        else:
            hint = f"write `frame: {words[0]}`" if words else "leave it out: without a frame it stays"
            message = "`frame` names one frame, here is a list"
            bag.error("S104", message, places.value_span(("cast", name, key)), hint=hint)
        return {**made, "frame": words[0]} if words else made
    return member


def _alone(name: str, member: object, places: Positions, bag: DiagnosticBag) -> object:
    """A member that is no group: it has no `count`, and no lists of one value for each."""
    if not isinstance(member, dict):
        return member
    if "count" in member:
        message = "there is one agent, so it has no `count`"
        bag.error("S101", message, places.key_span(("cast", name, "count")))
    made = {key: value for key, value in member.items() if key != "count"}
    for key in [key for key in made if did_you_mean(str(key), [*_KEYS, "count"]) == "count"]:
        message = f"unknown key `{key}` in a member of the cast"
        bag.error("S101", message, places.key_span(("cast", name, key)), suggestion="count")
        del made[key]
    for key in _ONE_EACH[:-1]:
        if isinstance(made.get(key), list):
            message = f"a list gives one `{key}` to each of a group; `{name}` is only one"
            hint = None if name == _AGENT else "a group has a `count`; alternatives are drawn by pick(a | b)"
            bag.error("S104", message, places.value_span(("cast", name, key)), hint=hint)
            del made[key]
    return made


def _count(name: str, count: object, places: Positions, bag: DiagnosticBag) -> int | None:
    """How many a group has; None if that is not known."""
    if isinstance(count, int) and not isinstance(count, bool) and 1 <= count <= MOST_MEMBERS:
        return count
    if isinstance(count, str) and PARAMETER.fullmatch(count):
        return None  # there is no such parameter, which has been said
    message = f"`count` is a number of members from 1 to {MOST_MEMBERS}"
    bag.error("S106", message, places.value_span(("cast", name, "count")))
    return None


def _one(
    name: str,
    member: Mapping[str, Any],
    index: int,
    count: int | None,
    places: Positions,
    bag: DiagnosticBag,
    origins: dict[DataPath, DataPath],
) -> dict[str, object]:
    """One member of a group."""
    made: dict[str, object] = {}
    for key, value in member.items():
        if key == "count":
            continue
        if key not in _ONE_EACH or not isinstance(value, list):
            made[key] = value
            continue
        one_cell = key == "at" and not any(isinstance(cell, list) for cell in value)
        given = [value] if one_cell else value
        if len(given) != count:
            if index == 0 and count is not None:
                message = f"{len(given)} given for {count}: a list has one for each member of the group"
                bag.error("S106", message, places.value_span(("cast", name, key)))
            continue
        made[key] = given[index]
        if not one_cell:
            origins[("cast", f"{name}[{index}]", key)] = ("cast", name, key, index)
    return made


def _paths(part: object, path: DataPath) -> Iterator[DataPath]:
    """The paths of a part and of all below it."""
    yield path
    items = part.items() if isinstance(part, dict) else enumerate(part) if isinstance(part, list) else ()
    for key, value in items:
        yield from _paths(value, (*path, key))


def check_npc(resolved: ResolvedFile, bag: DiagnosticBag) -> None:
    """The shape of an npc file."""
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    model_of(Npc, resolved.data, resolved, bag, partial=resolved.data.get("abstract") is True)


def check_library(resolved: ResolvedFile, bag: DiagnosticBag) -> None:
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


_OF_THE_GRAMMAR = frozenset({"S401", "S402"})
"""What may be wrong because a patch changed the grammar."""

_OF_ALL_VARIANTS = frozenset({"W314", "W317"})
"""What a variant may leave without a use in parts that are there for the others."""

_MAY_FOLLOW = frozenset(
    {
        "S105",
        "S201",
        "S204",
        "S205",
        "S206",
        "S213",
        "S301",
        "S302",
        "S303",
        "S304",
        "S305",
        "S310",
        "S315",
        "S401",
        "S402",
    }
)
"""What may be wrong only because a part of the file was left out, which has been reported."""

_OF_WHOLE_FILES = frozenset({"S316"})
"""What can only be said of a file without other errors: whatever has one may be what would make it possible."""


@dataclass(frozen=True)
class Draft:
    """A scenario of which only the meaning is still to be checked.

    Attributes:
        scenario: its models. name: with variants.
        shaped: the data the models were made of. filled: its parameters. patched: whether a variant changed it.
    """

    scenario: Scenario
    name: str
    shaped: ShapedFile[Scenario]
    filled: Substitution
    patched: bool = False

    def with_actions(self, actions: tuple[str, ...]) -> Draft:
        """The same with other body actions, as a suite gives them to all its members."""
        given = tuple(action for action in PRIMITIVES if action in actions)
        return replace(self, scenario=self.scenario.model_copy(update={"actions": given}))

    def with_horizon(self, horizon: int) -> Draft:
        """The same with another horizon, as the acts of one episode share one."""
        return replace(self, scenario=self.scenario.model_copy(update={"horizon": horizon}))


def check_scenario(
    resolved: ResolvedFile, bag: DiagnosticBag
) -> tuple[CheckedScenario | None, Scenario | None]:
    """The meaning of a scenario, and its models; each None if it has mistakes. `bag` takes the findings."""
    draft = draft_of(resolved, bag)
    if draft is None:
        return None, None
    right_shape = not bag.has_errors
    return meaning_of(draft, bag), draft.scenario if right_shape else None


def draft_of(resolved: ResolvedFile, bag: DiagnosticBag) -> Draft | None:
    """A scenario's models; None if it is abstract or has mistakes that keep its meaning from being looked at."""
    try:
        resolved = resolved.with_drawn_files()
    except ScenarioError as error:
        bag.extend(error.diagnostics)
        return None
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    filled = substitute(resolved, bag)
    data = _with_grammar(filled, resolved, bag)
    abstract = data.get("abstract") is True
    groups = spread(data, resolved, filled.paths, bag)
    filled = replace(filled, paths=groups.paths)
    failed = bag.has_errors
    shaped = model_of(Scenario, groups.data, groups.places, bag, partial=abstract)
    if shaped.model is None or abstract or failed:
        return None
    return Draft(shaped.model, resolved.name, shaped, filled, bool(resolved.edits))


def meaning_of(draft: Draft, bag: DiagnosticBag) -> CheckedScenario | None:
    """The meaning of a scenario; None if it has mistakes, which `bag` then holds.

    Args:
        draft: the scenario.
        bag: what was found in this scenario so far; takes the findings.
    """
    found = DiagnosticBag()
    shaped, filled = draft.shaped, draft.filled
    checked = check_meaning(
        draft.scenario, draft.name, shaped.places, found, prelude(), shaped.data, filled.values, filled.paths
    )
    if draft.patched:
        found = DiagnosticBag(d for d in found if d.code not in _OF_ALL_VARIANTS)
    if not bag.has_errors:
        bag.extend(found)
        return checked
    doubtful = _OF_WHOLE_FILES | (_MAY_FOLLOW if shaped.lost else frozenset())
    bag.extend(d for d in found if d.severity is Severity.ERROR and d.code not in doubtful)
    return None


def _with_grammar(filled: Substitution, resolved: ResolvedFile, bag: DiagnosticBag) -> dict[str, object]:
    """The data with the name of a shared grammar replaced by the grammar."""
    data = dict(filled.data)
    name = data.get("grammar")
    if not isinstance(name, str):
        return data
    shared = shared_grammars()
    if name in shared:
        return {**data, "grammar": shared[name]}
    span = resolved.value_span(("grammar",))
    near = did_you_mean(name, shared)
    hint = None if near else "shared are " + ", ".join(shared) + "; else write `templates` and `nouns`"
    bag.error("S201", f"there is no shared grammar `{name}`", span, suggestion=near, hint=hint)
    return {**data, "grammar": next(iter(shared.values()))}


def naming_the_patch(finding: Diagnostic, resolved: ResolvedFile) -> Diagnostic:
    """A mistake in a patched scenario says what it was patched by, since its file alone may be right."""
    if not resolved.edits or finding.severity is not Severity.ERROR:
        return finding
    edits = (
        [e for e in resolved.edits if e.path.startswith("grammar")] if finding.code in _OF_THE_GRAMMAR else []
    )
    patches = {f"{e.span.file}:{e.span.line}" for e in edits} or {e.span.file for e in resolved.edits}
    note = f"in `{resolved.name}`, patched by {', '.join(sorted(patches))}"
    return replace(finding, hint=f"{finding.hint}; {note}" if finding.hint else note)


MOST_CHOICES: Final = 64
"""How many values of a file are tried; each takes about as long as the scenario itself."""


def of_other_values(resolved: ResolvedFile) -> Iterator[Diagnostic]:
    """The errors that a scenario has with another value of one of its parameters, each alone.

    The scenario itself is right. What is found says which value it was.
    """
    said: set[Diagnostic] = set()
    for number, (name, text) in enumerate(_others(resolved)):
        if number == MOST_CHOICES:
            return
        bag = DiagnosticBag()
        asked = resolved.with_params({name: (text, resolved.value_span(("params", name, "values")))})
        check_scenario(asked, bag)
        for found in bag:
            if found.severity is Severity.ERROR and found not in said:
                said.add(found)
                note = f"with `{resolved.name}?{name}={text}`"
                yield replace(found, hint=f"{found.hint}; {note}" if found.hint else note)


def _others(resolved: ResolvedFile) -> Iterator[tuple[str, str]]:
    """Name and value of what can be asked for behind `?`, but for defaults and what is given already."""
    declared = resolved.data.get("params") if isinstance(resolved.data, dict) else None
    for name, declaration in declared.items() if isinstance(declared, dict) else ():
        if not isinstance(declaration, dict) or resolved.given(name) is not None:
            continue
        choices, default = declaration.get("values"), declaration.get("default")
        if isinstance(choices, dict):
            yield from ((name, label) for label, value in choices.items() if default not in (label, value))
        elif isinstance(choices, list):
            texts = ((_written(value), value) for value in choices if not _same(value, default))
            yield from ((name, text) for text, value in texts if _same(read_plain(text).value, value))


def _same(value: Data, other: Data) -> bool:
    """Whether two values are one: 1 is not true."""
    return value == other and isinstance(value, bool) is isinstance(other, bool)


def _written(value: Data) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
