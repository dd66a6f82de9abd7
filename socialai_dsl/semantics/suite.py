"""One action space for the members of a suite, with maps to each member's utterances."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from socialai_dsl.diagnostics import DiagnosticBag, did_you_mean
from socialai_dsl.grammar.ast import every
from socialai_dsl.schema.scenario import Scenario, UtteranceGrammar
from socialai_dsl.schema.suite import Suite
from socialai_dsl.semantics.plans import CheckedScenario
from socialai_dsl.semantics.possible import check_grammar, check_sentences, check_use_of_slots
from socialai_dsl.semantics.resolver import texts_of
from socialai_dsl.semantics.scope import Findings
from socialai_dsl.semantics.terms import Pattern
from socialai_dsl.source import Node
from socialai_dsl.vocabulary import NOUN, PRIMITIVES, Sentences, Slot, normal


@dataclass(frozen=True, slots=True)
class SharedSpace:
    """The action space of a suite.

    Attributes:
        actions: words of the action space. sentences: what can be said.
        template_maps: for each member, its own index of each template, -1 if it has no such.
        slot_maps: for each member and slot of the space, its own index of each word, likewise.
    """

    actions: tuple[str, ...]
    sentences: Sentences
    template_maps: tuple[tuple[int, ...], ...]
    slot_maps: tuple[tuple[tuple[int, ...], ...], ...]


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
    places: Node,
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
    own = [member.sentences for member in members]
    written = None if isinstance(suite.grammar, str) else suite.grammar
    if written is not None:
        check_grammar(written, Findings(bag, places))
    templates, template_maps = _shared(
        suite.grammar, written.templates if written else (), [one.templates for one in own]
    )
    slots, maps = [], []
    for name, fillers in _slots(written, own).items():
        words = [next((slot.words for slot in one.slots if slot.name == name), ()) for one in own]
        shared, mapped = _shared(suite.grammar, fillers, words)
        slots.append(Slot(name, shared))
        maps.append(mapped)
    slot_maps = tuple(tuple(mapped[number] for mapped in maps) for number in range(len(members)))
    sentences = Sentences.shared(templates, slots, list(zip(own, template_maps, strict=True)))
    space = SharedSpace(actions, sentences, template_maps, slot_maps)
    if written is not None and written.slots and not bag.has_errors:
        findings, said = Findings(bag, places), Sentences.of(templates, slots)
        if check_sentences(said, findings):
            check_use_of_slots(said, {name for one in own for name in _only_heard(one)}, findings)
    if written is not None and not bag.has_errors:
        for number, (name, member) in enumerate(zip(names, members, strict=True)):
            _check_sayable(space, number, name, member, places, bag)
    return space


def _only_heard(sentences: Sentences) -> Iterator[str]:
    """The slots of a member that only others fill."""
    for place, slot in enumerate(sentences.slots):
        if not any(used[place] for used in sentences.used):
            yield slot.name


def _slots(written: UtteranceGrammar | None, own: Sequence[Sentences]) -> dict[str, tuple[str, ...]]:
    """The slots of a suite by name, in the order in which members have them, with words that are written there."""
    if written is None:
        return {slot.name: () for one in own for slot in one.slots}
    fillers = dict(written.slots) or ({NOUN: written.nouns} if written.nouns else {})
    return {name: tuple(str(word) for word in words) for name, words in fillers.items()}


def _shared(
    how: str | UtteranceGrammar, written: tuple[str, ...], lists: Sequence[tuple[str, ...]]
) -> tuple[tuple[str, ...], tuple[tuple[int, ...], ...]]:
    """The templates, or the words of a slot, in the suite, and each member's own index of each."""
    if how == "concat":
        return _concatenated(lists)
    known = {normal(word): word for own in reversed(lists) for word in reversed(own)}
    words = tuple({known[normal(word)]: None for own in lists for word in own}) if how == "union" else written
    maps = ({normal(word): i for i, word in enumerate(own)} for own in lists)
    return words, tuple(tuple(own.get(normal(word), -1) for word in words) for own in maps)


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
    space: SharedSpace, number: int, name: str, member: CheckedScenario, places: Node, bag: DiagnosticBag
) -> None:
    sayable = dict(_live(space, number, member))
    live = set(sayable.values())
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


def _live(space: SharedSpace, number: int, member: CheckedScenario) -> Iterator[tuple[str, tuple[int, int]]]:
    """The sentences of a member that the suite can say, each with its template and filling in the member."""
    templates, slots = set(space.template_maps[number]), [set(own) for own in space.slot_maps[number]]
    places = {slot.name: place for place, slot in enumerate(space.sentences.slots)}
    own = [slots[places[slot.name]] if slot.name in places else set() for slot in member.sentences.slots]
    for (template, choices), pair in zip(member.sentences.each(), member.sentences.pairs(), strict=True):
        used = member.sentences.used[template]
        if template in templates and all(
            choice in words or not is_used for choice, words, is_used in zip(choices, own, used, strict=True)
        ):
            yield member.sentences.text(template, choices), pair


def _scripted(member: CheckedScenario) -> Iterator[str]:
    """What the agent's own frame says."""
    for frame in member.frames:
        if frame.entity == 0:
            said = (one.say for one in frame.causing)
            yield from (text for line in said if line is not None for text in texts_of(line))
