"""One action space for the members of a suite, with maps to each member's utterances."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from socialai_dsl.diagnostics import DiagnosticBag, did_you_mean
from socialai_dsl.grammar.ast import every
from socialai_dsl.schema.scenario import Scenario
from socialai_dsl.schema.suite import Suite
from socialai_dsl.semantics.plans import CheckedScenario, FramePlan
from socialai_dsl.semantics.resolver import texts_of
from socialai_dsl.semantics.terms import Line, Pattern
from socialai_dsl.source import Positions
from socialai_dsl.vocabulary import PRIMITIVES, normal


@dataclass(frozen=True, slots=True)
class SharedSpace:
    """What can be done and said in a suite.

    Attributes:
        actions, templates, nouns: words of the action space.
        template_maps, noun_maps: for each member, its own index of each of them, -1 if it has no such.
    """

    actions: tuple[str, ...]
    templates: tuple[str, ...]
    nouns: tuple[str, ...]
    template_maps: tuple[tuple[int, ...], ...]
    noun_maps: tuple[tuple[int, ...], ...]


def shared_actions(suite: Suite, scenarios: Sequence[Scenario]) -> tuple[str, ...]:
    """The body actions that every member has in the suite, in the order of the paper."""
    written = (
        {action for scenario in scenarios for action in scenario.actions}
        if suite.actions == "union"
        else set(suite.actions)
    )
    return tuple(action for action in PRIMITIVES if action in written)


def shared_space(
    suite: Suite,
    names: Sequence[str],
    members: Sequence[CheckedScenario],
    actions: tuple[str, ...],
    places: Positions,
    bag: DiagnosticBag,
) -> SharedSpace:
    """The action space of a suite; reports S401 for what a member needs and a written grammar cannot say.

    Args:
        suite: its model.
        names: what the suite calls its members.
        members: the members, with the suite's actions.
        actions: the body actions.
        places: where the parts of the suite's file stand.
        bag: takes the findings.
    """
    templates, template_maps = _shared(suite, "templates", [member.templates for member in members])
    nouns, noun_maps = _shared(suite, "nouns", [member.nouns for member in members])
    space = SharedSpace(actions, templates, nouns, template_maps, noun_maps)
    if not isinstance(suite.grammar, str):
        for number, (name, member) in enumerate(zip(names, members, strict=True)):
            _check_sayable(space, number, name, member, places, bag)
    return space


def _shared(
    suite: Suite, part: str, lists: Sequence[tuple[str, ...]]
) -> tuple[tuple[str, ...], tuple[tuple[int, ...], ...]]:
    """The words of templates or nouns in the suite, and each member's own index of each."""
    if suite.grammar == "concat":
        return _concatenated(lists)
    if suite.grammar == "union":
        words = tuple(dict.fromkeys(word for own in lists for word in own))
    else:
        words = tuple(str(word) for word in getattr(suite.grammar, part))
    maps = ({word: i for i, word in enumerate(own)} for own in lists)
    return words, tuple(tuple(own.get(word, -1) for word in words) for own in maps)


def _concatenated(
    lists: Sequence[tuple[str, ...]],
) -> tuple[tuple[str, ...], tuple[tuple[int, ...], ...]]:
    """The lists one behind the other; a member has only what stands in its own segment."""
    words = tuple(word for own in lists for word in own)
    maps, start = [], 0
    for own in lists:
        end = start + len(own)
        maps.append((*[-1] * start, *range(len(own)), *[-1] * (len(words) - end)))
        start = end
    return words, tuple(maps)


def _check_sayable(
    space: SharedSpace, number: int, name: str, member: CheckedScenario, places: Positions, bag: DiagnosticBag
) -> None:
    live = set(product(space.template_maps[number], space.noun_maps[number]))
    sayable = {_text(member, pair): pair for pair in live if min(pair) >= 0}
    known = {normal(text) for text in sayable}
    needed = [p.text for p in every(Pattern, member) if p.pairs and not (p.pairs & live or p.said_by_npcs)]
    needed += [text for text in _scripted(member) if normal(text) not in known]
    for text in dict.fromkeys(needed):
        near = did_you_mean(text, sayable)
        hint = None if near else "add what is missing to the suite's grammar, or write `grammar: union`"
        bag.error(
            "S401",
            f'`{name}` needs "{text}", which the grammar of this suite cannot say',
            places.key_span(("grammar",)),
            suggestion=f'"{near}"' if near else None,
            hint=hint,
        )


def _text(member: CheckedScenario, pair: tuple[int, int]) -> str:
    return member.templates[pair[0]].replace("<noun>", member.nouns[pair[1]])


def _scripted(member: CheckedScenario) -> Iterator[str]:
    """What the agent's own frame says."""
    for frame in member.frames:
        if frame.entity == 0:
            yield from (text for line in _lines(frame) for text in texts_of(line))


def _lines(frame: FramePlan) -> Iterator[Line]:
    rules = (rule for state in frame.states for rule in (*state.first, *state.then))
    said = (*(rule.say for rule in rules), *(step.say for step in frame.steps))
    yield from (line for line in said if line is not None)
