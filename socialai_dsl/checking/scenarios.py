"""Checks a scenario's file: parameters put in, groups of the cast written out, then shape and meaning."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

from socialai_dsl import cures
from socialai_dsl.checking.consequences import Consequences
from socialai_dsl.diagnostics import (
    Diagnostic,
    DiagnosticBag,
    ScenarioError,
    Severity,
    advice_on,
    did_you_mean,
)
from socialai_dsl.library import prelude, shared_grammars
from socialai_dsl.loader.patches import Edit, let_follow, let_play
from socialai_dsl.loader.reader import read_plain
from socialai_dsl.loader.resolved import ResolvedFile
from socialai_dsl.schema.library import GrammarLibrary, ObjectLibrary
from socialai_dsl.schema.scenario import CastGroup, CastMember, Npc, Scenario
from socialai_dsl.schema.shape import PARAMETER, ShapedFile, model_of
from socialai_dsl.semantics.cast import members
from socialai_dsl.semantics.check import check_meaning
from socialai_dsl.semantics.plans import CheckedScenario
from socialai_dsl.source import Data, Node, Span
from socialai_dsl.vocabulary import PRIMITIVES, spelt

Value = int | bool | float | str

_NAMED = re.compile(r"\$([A-Za-z_]\w*)")


def put_parameters(
    tree: Node, values: Mapping[str, Value], declared: Container[str], bag: DiagnosticBag
) -> None:
    """Put its value in wherever a parameter is the whole of a value; reports S206.

    Args:
        tree: a scenario; changed.
        values: parameter -> value.
        declared: all parameters, also those without a value.
        bag: takes the findings.
    """
    for path, node in tree.walk():
        match = _NAMED.fullmatch(node.value) if isinstance(node.value, str) else None
        if match is None or path[:1] == ("params",):
            continue
        name = match.group(1)
        if name in values:
            node.put(values[name])
            node.substituted = True
        elif name not in declared:  # without a default, it is reported where it is declared
            near = did_you_mean(name, values)
            span = node.locate(width=len(name) + 1)
            suggestion = f"${near}" if near else None
            bag.error("S206", f"unknown parameter `{name}`", span, suggestion=suggestion)


def parameter_values(resolved: ResolvedFile, bag: DiagnosticBag) -> dict[str, Value]:
    """Parameter -> value: its default, or what was given behind `?`; reports S206."""
    declared = _declared(resolved)
    _check_values(resolved, declared, bag)
    values: dict[str, Value] = {}
    for name, declaration in declared.items():
        default = _entry(declaration, "default") if isinstance(declaration, dict) else declaration
        choices = _entry(declaration, "values") if isinstance(declaration, dict) else None
        if default is not None and choices is not None:
            default = _chosen(name, default, choices, resolved, bag)
        if name in resolved.params and _names_one(resolved.params[name], declared) is None:
            default = _given(name, default, choices, resolved, bag)
        if isinstance(default, int | bool | float | str):
            values[name] = default
    for name in resolved.params:
        if name not in declared:
            advice = advice_on(name, declared, "it has " + ", ".join(declared) if declared else "it has none")
            message = f"`{resolved.name}` has no parameter `{name}`"
            bag.error("S206", message, resolved.param_name_span(name), **advice)
    return values


def as_asked(resolved: ResolvedFile) -> Data:
    """The data of a file without mistakes in which each parameter has what was asked for as its default."""
    declared, data = _declared(resolved), resolved.data
    assert isinstance(data, dict), "internal: a file is a mapping"
    given: dict[str, Data] = {}
    for name in declared.keys() & resolved.params.keys():
        declaration = declared[name]
        parts = declaration if isinstance(declaration, dict) else {"default": declaration}
        choices = parts.get("values")
        asked: Data = resolved.params[name]
        if not isinstance(choices, dict):  # else it is a label
            asked = _given(name, parts["default"], choices, resolved, DiagnosticBag())
        given[name] = {**declaration, "default": asked} if isinstance(declaration, dict) else asked
    return {**data, "params": {**declared, **given}} if given else data


def _check_values(resolved: ResolvedFile, declared: Container[str], bag: DiagnosticBag) -> None:
    """Report values of parameters, written in the file or behind `?`, that name parameters themselves."""
    params = resolved.tree.entry("params")
    written = (
        [(path[0], n.value, n.locate()) for path, n in params.walk() if path] if params is not None else []
    )
    given = [(name, text, resolved.param_span(name)) for name, text in resolved.params.items()]
    for name, value, span in (*written, *given):
        named = _names_one(value, declared)
        if named is not None:
            message = f"the value of `{name}` names the parameter `{named[1]}`, and a value names none"
            instead = f", or `{named[0]}` where `${name}` is used" if named[1] != name else ""
            place = span.shifted(named.start(), len(named[0]))
            bag.error("S206", message, place, hint=f"write the value itself{instead}")


def _names_one(value: Data, declared: Container[str]) -> re.Match[str] | None:
    """The parameter that a value is or has in it; a text may have a `$` before other words."""
    text = value if isinstance(value, str) else ""
    return _NAMED.fullmatch(text) or next((m for m in _NAMED.finditer(text) if m[1] in declared), None)


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
    labels = list(map(spelt, choices)) if isinstance(choices, dict | list) else [spelt(default)]
    if spelt(default) not in labels:
        advice = advice_on(spelt(default), labels, "one of " + ", ".join(labels))
        span = resolved.tree.value_span(("params", name, "default"))
        message = f"the default of `{name}` is none of its values"
        bag.error("S206", message, span, **advice)
    return choices.get(str(default), default) if isinstance(choices, dict) else default


def _given(name: str, default: Data, choices: Data, resolved: ResolvedFile, bag: DiagnosticBag) -> Data:
    """The value that was asked for: a text, or what YAML would read; the default if it cannot be had."""
    text, span = resolved.params[name], resolved.param_span(name)
    if isinstance(choices, dict):
        if text not in choices:
            advice = advice_on(text, choices, "one of " + ", ".join(choices))
            bag.error("S206", f"`{text}` is none of the values of `{name}`", span, **advice)
        return choices.get(text, default)
    if isinstance(choices, list):
        found = [choice for choice in choices if _means(text, choice)]
        if not found:
            hint = "one of " + ", ".join(map(spelt, choices))
            bag.error("S206", f"`{text}` is none of the values of `{name}`", span, hint=hint)
        return found[0] if found else default
    if isinstance(default, str) and text:
        return text
    value = read_plain(text).value
    if choices is None and not _alike(value, default):
        message = f"`{text}` is not of the kind of the default of `{name}`, `{spelt(default)}`"
        bag.error("S206", message, span)
        return default
    return value


def _means(text: str, choice: Data) -> bool:
    """Whether a value that was asked for is one of those that there are: that text, or that number or truth value."""
    if isinstance(choice, str):
        return text == choice
    value = read_plain(text).value
    return _alike(value, choice) and value == choice


def _alike(value: Data, default: Data) -> bool:
    if isinstance(value, bool) or isinstance(default, bool):
        return isinstance(value, bool) and isinstance(default, bool)
    if isinstance(value, int | float) or isinstance(default, int | float):
        return isinstance(value, int | float) and isinstance(default, int | float)
    return isinstance(value, str)


MOST_MEMBERS: Final = 16
_AGENT: Final = "agent"
_KEYS: Final = frozenset(field.alias or name for name, field in CastMember.model_fields.items())
_ONE_EACH: Final = tuple(key for key in CastGroup.__annotations__ if key != "count")
"""Keys of a group whose lists give one value each."""


def spread(tree: Node, bag: DiagnosticBag) -> None:
    """Write out the groups of the cast; reports counts that are none, and lists of another length.

    Args:
        tree: a scenario; changed.
        bag: takes the findings.
    """
    cast = tree.entry("cast")
    if cast is None or not isinstance(cast.children, dict):
        return
    members: dict[str, Node] = {}
    for name, member in cast.children.items():
        if "[" in name:
            hint = "a group is written once, with `count:`"
            bag.error("S104", f"`{name}` is not a name", member.key_span(), hint=hint)
        if isinstance(member.children, dict):
            _keep_one_frame(name, member, member.children, bag)
        written = member.entry("count")
        if written is None or name == _AGENT:
            if isinstance(member.children, dict):
                _keep_alone(name, member.children, bag)
            members[name] = member
            continue
        count = _count(written, bag)
        for i in range(count or 1):
            members[f"{name}[{i}]"] = _one(member, i, count, bag)
    cast.children = members


def _keep_one_frame(name: str, member: Node, keys: dict[str, Node], bag: DiagnosticBag) -> None:
    """Of several frames that a member is given keep the first."""
    for key in ("frames", "frame"):
        given = keys.get(key)
        if given is None or not isinstance(given.children, list):
            continue
        words = [str(item.data) for item in given.children]
        if len(words) > 1:
            message = f"`{words[0]}` and `{words[1]}` would both move `{name}`: a member follows one frame"
            hint = "join them in one frame, or let two members follow them"
            bag.error("S313", message, given.children[1].value_span(), hint=hint)
        else:
            cure = (
                cures.write(f"frame: {words[0]}", cures.over_value(given, (), words[0]))
                if words
                else cures.propose(
                    "leave it out", cures.deleted(member, (key,)), also="without a frame it stays"
                )
            )
            bag.error("S104", "`frame` must be one name, got a list", given.value_span(), hint=cure)
        del keys[key]
        if words:
            given.put(words[0])
            keys["frame"] = given
        return


def _keep_alone(name: str, keys: dict[str, Node], bag: DiagnosticBag) -> None:
    """Leave out what only groups have: `count`, and lists of one value for each."""
    if "count" in keys:
        bag.error("S101", "there is one agent, so it has no `count`", keys.pop("count").key_span())
    misspelt = [key for key in keys if key not in _KEYS and did_you_mean(key, [*_KEYS, "count"]) == "count"]
    for key in misspelt:
        message = f"unknown key `{key}` in a member of the cast"
        bag.error("S101", message, keys.pop(key).key_span(), suggestion="count")
    for key in _ONE_EACH[:-1]:
        if key in keys and isinstance(keys[key].children, list):
            if misspelt:  # a group's list is right
                del keys[key]
                continue
            message = f"a list gives one `{key}` to each of a group; `{name}` is only one"
            hint = None if name == _AGENT else "a group has a `count`; alternatives are drawn by pick(a | b)"
            data = keys[key].data
            if key == "place" and isinstance(data, list) and len(data) == 2:
                hint = f"a cell is `at: [{data[0]}, {data[1]}]`"
            bag.error("S104", message, keys.pop(key).value_span(), hint=hint)


def _count(written: Node, bag: DiagnosticBag) -> int | None:
    """How many a group has; None if that is not known."""
    count = written.value
    if isinstance(count, int) and not isinstance(count, bool) and 1 <= count <= MOST_MEMBERS:
        return count
    if isinstance(count, str) and PARAMETER.fullmatch(count):
        return None  # there is no such parameter, which has been said
    message = f"`count` is a number of members from 1 to {MOST_MEMBERS}"
    bag.error("S106", message, written.value_span())
    return None


def _one(group: Node, index: int, count: int | None, bag: DiagnosticBag) -> Node:
    """One member of a group."""
    made: dict[str, Node] = {}
    for key, value in group.items():
        items = value.children
        if key == "count":
            continue
        if key not in _ONE_EACH or not isinstance(items, list):
            made[str(key)] = value
            continue
        given = (
            [value] if key == "at" and not any(isinstance(cell.children, list) for cell in items) else items
        )
        if len(given) == count:
            made[str(key)] = given[index]
        elif index == 0 and count is not None:
            message = f"{len(given)} given for {count}: a list has one for each member of the group"
            bag.error("S106", message, value.value_span())
    return Node(group.span, children=made)


def _is_abstract(resolved: ResolvedFile) -> bool:
    abstract = resolved.tree.entry("abstract")
    return abstract is not None and abstract.value is True


def check_npc(resolved: ResolvedFile, bag: DiagnosticBag) -> None:
    """The shape of an npc file."""
    model_of(Npc, resolved.tree, bag, partial=_is_abstract(resolved))


def check_library(resolved: ResolvedFile, bag: DiagnosticBag) -> None:
    """The shape of a library."""
    kind = resolved.tree.at(("library",))
    if kind.data == "objects":
        model_of(ObjectLibrary, resolved.tree, bag, parameters=False)
    elif kind.data == "grammars":
        model_of(GrammarLibrary, resolved.tree, bag, parameters=False)
    else:
        message = f"there is no library of `{kind.data}`"
        bag.error("S103", message, kind.value_span(), hint="one of objects, grammars")


_OF_THE_GRAMMAR = frozenset({"S401", "S402"})
"""What may be wrong because a patch changed the grammar."""

_OF_ALL_VARIANTS = frozenset({"W314", "W317"})
"""What a variant or rival may leave without a use in parts that are there for the others."""


@dataclass(frozen=True)
class Draft:
    """A scenario of which only the meaning is still to be checked.

    Attributes:
        scenario: its models. name: with variants.
        shaped: the data the models were made of. values: its parameters. patched: whether a variant changed it.
        patches: the names of the files that patch it; None: nothing changes it, neither a patch nor a given parameter
            nor a rival that plays.
    """

    scenario: Scenario
    name: str
    shaped: ShapedFile[Scenario]
    values: Mapping[str, Value]
    patched: bool = False
    patches: frozenset[str] | None = None

    def with_actions(self, actions: tuple[str, ...]) -> Draft:
        """The same with other body actions, as a suite gives them to all its members."""
        given = tuple(action for action in PRIMITIVES if action in actions)
        return replace(self, scenario=self.scenario.model_copy(update={"actions": given}))

    def with_horizon(self, horizon: int) -> Draft:
        """The same with another horizon, as the acts of one episode share one."""
        return replace(self, scenario=self.scenario.model_copy(update={"horizon": horizon}))


def check_scenario(
    resolved: ResolvedFile, bag: DiagnosticBag, tests: Node | None = None
) -> tuple[CheckedScenario | None, Scenario | None]:
    """The meaning of a scenario, and its models; each None if it has mistakes. `bag` takes the findings.

    `tests` are those to read with it, as `draft_of` takes them.
    """
    draft = draft_of(resolved, bag, tests)
    if draft is None:
        return None, None
    right_shape = not bag.has_errors
    return meaning_of(draft, bag), draft.scenario if right_shape else None


def draft_of(resolved: ResolvedFile, bag: DiagnosticBag, tests: Node | None = None) -> Draft | None:
    """A scenario's models; None if it is abstract or has mistakes that keep its meaning from being looked at.

    Args:
        resolved: the scenario; its own tests are left out, so that whoever plays it does not mind them.
        bag: takes the findings.
        tests: the tests to read with it, wherever they are written.
    """
    try:
        resolved = resolved.with_drawn_files()
    except ScenarioError as error:
        bag.extend(error.diagnostics)
        return None
    _report_idle_variants(resolved, bag)
    values, declared = parameter_values(resolved, bag), _declared(resolved)
    whole = resolved.changed(
        lambda tree: _put_tests(tree, tests),
        lambda tree: put_parameters(tree, values, declared, bag),
        lambda tree: put_grammar(tree, bag),
        lambda tree: spread(tree, bag),
    )
    abstract, failed = _is_abstract(whole), bag.has_errors
    shaped = model_of(Scenario, whole.tree, bag, partial=abstract)
    if shaped.model is None or abstract or failed:
        return None
    patched = bool(resolved.edits)
    return Draft(shaped.model, resolved.name, shaped, values, patched, _patches(resolved, shaped.model))


def _patches(resolved: ResolvedFile, scenario: Scenario) -> frozenset[str] | None:
    """The files that patch a scenario, if a patch, a given parameter or a rival changes it; None: it is as written."""
    rival_plays = _frame_of_agent(scenario) in scenario.rivals
    if not (resolved.edits or resolved.params or rival_plays):
        return None
    return frozenset(edit.span.file for edit in resolved.edits)


def _frame_of_agent(scenario: Scenario) -> str | None:
    """The name of the frame that the agent follows; None if it follows none, or there is no agent."""
    agent = members(scenario).get(_AGENT)
    frame: str | None = agent.value("frame") if agent is not None else None
    return frame


def with_rival(resolved: ResolvedFile, rival: str) -> ResolvedFile:
    """A scenario whose agent follows one of its rivals."""

    def change(tree: Node) -> None:
        let_play(tree, rival)

    return resolved.changed(change)


def with_frames(resolved: ResolvedFile, frames: Mapping[str, str]) -> ResolvedFile:
    """A scenario in which members of the cast follow other frames, by member."""

    def change(tree: Node) -> None:
        let_follow(tree, frames)

    return resolved.changed(change)


def with_findings_on_rivals(
    found: DiagnosticBag, resolved: ResolvedFile, scenario: Scenario
) -> DiagnosticBag:
    """What was found in a scenario without errors, and what is wrong with its rivals, each checked where it plays.

    What a rival has a use for is not reported as idle. The agent's own frame, which nobody follows while a rival plays,
    is judged without it, and a rival by itself. Where one plays already, no frame is idle: it may be the agent's own.
    """
    bag, idle = DiagnosticBag(), {d for d in found if d.code in _OF_ALL_VARIANTS}
    own_frame = _frame_of_agent(scenario)
    if own_frame in scenario.rivals:
        frames = {resolved.tree.key_span(("frames", name)) for name in scenario.frames}
        idle = {d for d in idle if d.span not in frames}
    judged = {d for d in idle if own_frame and _is_in(resolved.tree.get(("frames", own_frame)), d.span)}
    for name, rival in scenario.rivals.items():
        own = DiagnosticBag()
        if scenario.frames.get(name) == rival:  # it plays already
            own = found
        elif name in scenario.frames:
            span = resolved.tree.key_span(("rivals", name))
            own.error("S213", f"there is a frame `{name}`; call the rival something else", span)
        else:
            check_scenario(with_rival(resolved, name), own)
        written = resolved.tree.get(("rivals", name))
        bag.extend(d for d in own if d.code not in _OF_ALL_VARIANTS or _is_in(written, d.span))
        idle &= {*own, *judged}
    return DiagnosticBag([*(d for d in found if d.code not in _OF_ALL_VARIANTS), *idle, *bag])


def _is_in(part: Node | None, span: Span) -> bool:
    """Whether a place is in a part of a document."""
    if part is None or span.file != part.file:
        return False
    return part.span.start <= part.source.index(span) < part.end


def _report_idle_variants(resolved: ResolvedFile, bag: DiagnosticBag) -> None:
    """Report W509 for each file of a variant whose edits all put a value where there is an equal one."""
    by_file: dict[str, list[Edit]] = {}
    for edit in resolved.edits:
        by_file.setdefault(edit.span.file, []).append(edit)
    for edits in by_file.values():
        if not any(edit.changes for edit in edits):
            paths = ", ".join(f"`{edit.path}`" for edit in edits)
            message = f"this variant changes nothing: {paths} {'is' if len(edits) == 1 else 'are'} so already"
            bag.warning(
                "W509", message, edits[0].span, hint="set what is different in it, or delete the file"
            )


def _put_tests(tree: Node, tests: Node | None) -> None:
    """Put tests in place of the scenario's own."""
    assert isinstance(tree.children, dict), "internal: a file is a mapping"
    tree.children.pop("tests", None)
    if tests is not None:
        tree.children["tests"] = tests.copy()


def meaning_of(draft: Draft, bag: DiagnosticBag) -> CheckedScenario | None:
    """The meaning of a scenario; None if it has mistakes, which `bag` then holds.

    Args:
        draft: the scenario.
        bag: what was found in this scenario so far; takes the findings.
    """
    found = DiagnosticBag()
    shaped = draft.shaped
    checked = check_meaning(
        draft.scenario, draft.name, shaped.tree, found, prelude(), draft.values, draft.patches
    )
    if draft.patched:
        found = DiagnosticBag(d for d in found if d.code not in _OF_ALL_VARIANTS)
    if not bag.has_errors:
        bag.extend(found)
        return checked
    following = Consequences(shaped.tree, shaped.lost)
    bag.extend(d for d in found if d.severity is Severity.ERROR and not following.may_be(d))
    return None


def put_grammar(tree: Node, bag: DiagnosticBag) -> None:
    """Put a shared grammar in place of its name."""
    named = tree.entry("grammar")
    if named is None or not isinstance(named.value, str):
        return
    shared = shared_grammars()
    if named.value not in shared:
        hint = "shared are " + ", ".join(shared) + "; else write `templates` and `nouns`"
        message = f"there is no shared grammar `{named.value}`"
        bag.error("S201", message, named.value_span(), **advice_on(named.value, shared, hint))
    named.put(shared.get(named.value, next(iter(shared.values()))))


def naming_the_patch(finding: Diagnostic, resolved: ResolvedFile) -> Diagnostic:
    """A mistake in a patched scenario says what it was patched by, since its file alone may be right."""
    if not resolved.edits or finding.severity is not Severity.ERROR:
        return finding
    edits = (
        [e for e in resolved.edits if e.path.startswith("grammar")] if finding.code in _OF_THE_GRAMMAR else []
    )
    patches = {f"{e.span.file}:{e.span.line}" for e in edits} or {e.span.file for e in resolved.edits}
    note = f"in `{resolved.name}`, patched by {', '.join(sorted(patches))}"
    return replace(finding, hint=cures.noted(finding.hint, note))


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
        asked = resolved.with_params({name: (text, resolved.tree.value_span(("params", name, "values")))})
        check_scenario(asked, bag)
        for found in bag:
            if found.severity is Severity.ERROR and found not in said:
                said.add(found)
                note = f"with `{resolved.name}?{name}={text}`"
                yield replace(found, hint=cures.noted(found.hint, note))


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
            texts = ((spelt(value), value) for value in choices if not _same(value, default))
            yield from ((name, text) for text, value in texts if _same(read_plain(text).value, value))


def _same(value: Data, other: Data) -> bool:
    """Whether two values are one: 1 is not true."""
    return value == other and isinstance(value, bool) is isinstance(other, bool)
