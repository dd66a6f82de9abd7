"""Texts: the utterances that can be heard, the lines that are said, and their speakers."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, groupby, islice, pairwise, product
from math import prod
from typing import TypeGuard

from socialai_dsl import cures
from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.semantics import groups
from socialai_dsl.semantics.cast import AGENT, Case, grouped
from socialai_dsl.semantics.groups import must_be_agent, subject_of, values_of
from socialai_dsl.semantics.resolver import (
    INT,
    MAX_TEXTS,
    SAYABLE,
    Resolver,
    text_value,
    texts_of,
    words_of_values,
)
from socialai_dsl.semantics.scope import (
    Draws,
    ReportedError,
    Scope,
    described,
    is_nothing,
    quoted,
    select,
    spoken,
)
from socialai_dsl.semantics.terms import (
    TURN,
    Compare,
    Const,
    Digit,
    Heard,
    HeardNoun,
    Line,
    Pattern,
    Read,
    Said,
    SaidBy,
    Select,
    SitedTerm,
    Speaker,
    Spoke,
    Term,
    Type,
    World,
    all_of,
    any_of,
    entity,
    equals,
    numbers_of,
    walk,
)
from socialai_dsl.source import DataPath, Span
from socialai_dsl.vocabulary import NOUN, Sentences, is_number, normal, words

_JOINED = re.compile(r"\s*\|\s*|\s+or\s+")
"""What an author may put between alternatives."""

ANYTHING = "any"
"""`hears: any` is whatever anybody says."""


def said(resolver: Resolver, node: ast.Expr, scope: Scope) -> Term:
    """Whether the agent said one of the texts at `node` in this step."""
    return any_of(
        all_of([Said(pattern), *_given(drawn), *_given(given)])
        for text, drawn, span in texts(resolver, node, scope, resolver.utterances.all_texts())
        for pattern, given in patterns(resolver, text, scope, span, False)
    )


def heard(resolver: Resolver, node: ast.Expr, scope: Scope) -> Term:
    """Whether the NPC whose frame it is heard one of the texts at `node`, or `any`, since its last turn."""
    if isinstance(node, ast.Name) and node.id == ANYTHING:
        found = heard_at(resolver, ANYTHING, scope)
        return any_of(all_of([Heard((pattern,)), *_given(given)]) for pattern, given in found)
    can_be_heard = chain(resolver.utterances.npc_texts, resolver.utterances.all_texts())
    return any_of(
        all_of([Heard((pattern,)), *_given(drawn), *_given(given)])
        for text, drawn, span in texts(resolver, node, scope, can_be_heard)
        for pattern, given in for_ears(resolver, patterns(resolver, text, scope, span, True), scope)
    )


def texts(
    resolver: Resolver, node: ast.Expr, scope: Scope, sayable: Iterable[str]
) -> list[tuple[ast.Text, Term | None, Span]]:
    """The texts that an argument names, each with the condition that it is meant and where it is written.

    `sayable` is what can be said there, of which one may be meant by what is no text.
    """
    found: list[tuple[ast.Text, Term | None, Span]] = []
    for option in ast.options_of(node):
        slot = text_slot(resolver, option, scope)
        if slot is not None:
            places = resolver.findings.places
            found += [(one.text, one.case.when, places.whole_span(one.case.path)) for one in slot]
        elif isinstance(option, ast.Text):
            found.append((option, None, resolver.findings.node(scope.path, option)))
        else:
            raise _no_text(resolver, option, scope, sayable)
    return found


def _no_text(resolver: Resolver, option: ast.Expr, scope: Scope, sayable: Iterable[str]) -> ReportedError:
    message = f"`{quoted(option)}` is not a text; what is said is quoted"
    name = option.id if isinstance(option, ast.Name) else ""
    if name == ANYTHING:
        hint = "whether something was said is `agent.spoke`; what was heard, `heard(any)`"
        return resolver.fail("S211", message, option, scope, hint=hint)
    near = did_you_mean(name, scope.frame.texts if scope.frame is not None else ())
    if near is not None:
        return resolver.fail("S211", message, option, scope, suggestion=near)
    known = {normal(text): text for text in sayable}
    begun = (text for said, text in known.items() if name and said.startswith(f"{normal(name)} "))
    meant = known.get(normal(name)) or did_you_mean(name, known.values()) or next(begun, None)
    if meant is not None:
        cure = resolver.instead(f'"{meant}"', option, scope)
        return resolver.fail("S211", message, option, scope, hint=cure)
    example = next((f'such as "{text}"' for text in known.values()), None)
    return resolver.fail("S211", message, option, scope, hint=example)


def text_slot(resolver: Resolver, node: ast.Expr, scope: Scope) -> list[Filling] | None:
    """What fills the slot of type text or utterance that an expression names, `<formula>` of one's own frame or
    `<teacher.formula>` of a member's: each text that it can be. None if it names no such slot.
    """
    frame, name = scope.frame, ""
    match node:
        case ast.Name(id=name) if name not in scope.variables:
            pass
        case ast.Attribute(subject=ast.Name(id=owner), name=name) if owner not in scope.variables:
            frame = resolver.frames.get(resolver.symbols.roles.get(owner, owner))
        case _:
            return None
    if frame is None or frame.model.slots.get(name) not in ("text", "utterance"):
        return None
    cases = frame.texts.get(name)
    if cases is None:
        raise ReportedError  # nobody fills it, which is reported where it is left empty
    return [
        Filling(frame.member, name, case, resolver.findings.text(case.path, str(case.raw)))
        for case in grouped(cases)
    ]


def patterns(
    resolver: Resolver, text: ast.Text, scope: Scope, span: Span, from_npcs: bool
) -> list[tuple[Pattern, Term | None]]:
    """The utterances that a text means, each with the condition on the values in it; `<noun>` is any noun.

    Reports S401 if nobody can say it and S402 if some value in it cannot be said, where a text that fills a slot
    is written.
    """
    return [
        found
        for parts, drawn, filling in _spliced(resolver, text, scope)
        for found in _meant(resolver, parts, drawn, scope, span if filling is None else filling, from_npcs)
    ]


def _meant(
    resolver: Resolver,
    spliced: Sequence[str | ast.Expr],
    drawn: Sequence[Term],
    scope: Scope,
    span: Span,
    from_npcs: bool,
) -> list[tuple[Pattern, Term | None]]:
    """The patterns of a text without slots, on the condition that what `drawn` says was drawn."""
    parts = [_spoken_part(resolver, part, scope) for part in spliced]
    number = prod(1 if isinstance(part, str | Const) else part.type.size for part in parts)
    if number > MAX_TEXTS:
        message = f"this can be {number:,} different texts; at most {MAX_TEXTS:,} are possible"
        hint = "give the register a smaller range, or hear `<noun>` and compare: `when: noun == price`"
        raise resolver.findings.fail("S212", message, span, hint=hint)
    found: list[tuple[Pattern, Term | None]] = []
    unsayable: list[tuple[str, str]] = []
    for choice in product(*(_choices(part) for part in parts)):
        said = "".join(word for word, _ in choice)
        pairs = resolver.utterances.match(said)
        nouns = resolver.utterances.npcs_matching(said) if from_npcs else {}
        conditions = [*drawn, *(condition for _, condition in choice if condition is not None)]
        if pairs or nouns:
            pattern = Pattern(pairs, said, frozenset(nouns), _fillings(resolver, nouns))
            found.append((pattern, all_of(conditions) if conditions else None))
        elif _can_be(resolver, choice):
            unsayable.append((said, next((word for word, c in choice if c is not None), "")))
    if unsayable:
        values = [(node, part) for node, part in zip(spliced, parts, strict=True) if _varies(part)]
        _report_unsayable(resolver, unsayable, values, bool(found), span, from_npcs)
    return found


def _fillings(resolver: Resolver, found: Mapping[str, int | None]) -> tuple[tuple[str, int], ...]:
    """The filling of each text of NPCs: all of it where the grammar can say the text, else what its pattern catches."""
    if not resolver.symbols.slots:
        return tuple((text, noun) for text, noun in found.items() if noun is not None)
    known = ((text, resolver.utterances.filling_of(text), caught) for text, caught in found.items())
    whole = ((text, filling if filling is not None else caught) for text, filling, caught in known)
    return tuple((text, filling) for text, filling in whole if filling is not None)


def _spliced(
    resolver: Resolver, text: ast.Text, scope: Scope
) -> Iterator[tuple[list[str | ast.Expr], list[Term], Span | None]]:
    """The parts of a text, with texts that fill slots put in their place; all ways to do so,
    each with its conditions, and with the place of what fills a text that is one slot.
    """
    choices: list[list[tuple[tuple[str | ast.Expr, ...], Term | None, Span | None]]] = []
    findings = resolver.findings
    for part in text.parts:
        slot = None if isinstance(part, str) else text_slot(resolver, part, scope)
        if slot is None:
            choices.append([((part,), None, None)])
            continue
        alone = len(text.parts) == 1
        choices.append(
            [
                (f.text.parts, f.case.when, findings.places.whole_span(f.case.path) if alone else None)
                for f in slot
            ]
        )
    for choice in product(*choices):
        parts = [part for parts, _, _ in choice for part in parts]
        place = next((span for _, _, span in choice if span is not None), None)
        yield parts, [d for _, d, _ in choice if d is not None], place


def _spoken_part(resolver: Resolver, part: str | ast.Expr, scope: Scope) -> str | Term:
    """A piece of text, a slot of the grammar as templates write it, or a value."""
    if isinstance(part, str):
        return part
    if isinstance(part, ast.Name) and part.id not in scope.variables:
        if part.id in resolver.symbols.slots:
            resolver.used.add(("grammar", "slots", part.id))
            return f"<{part.id}>"
        if part.id == NOUN:
            no_nouns(resolver, part, scope)
            return "<noun>"
    if isinstance(part, ast.Name) and part.id == "nouns":
        message = "`nouns` are all of them; any one of them is `<noun>`"
        raise resolver.fail("S402", message, part, scope)
    if isinstance(part, ast.Name) and part.id == "any":
        message = "any noun is `<noun>`; anything at all is `hears: any`"
        raise resolver.fail("S402", message, part, scope)
    return sayable(resolver, part, scope)


def _can_be(resolver: Resolver, choice: Iterable[tuple[str, Term | None]]) -> bool:
    """Whether the values of a text can be those that it is made of."""
    return all(
        condition.right.value in values_of(resolver, condition.left)
        for _, condition in choice
        if isinstance(condition, Compare) and isinstance(condition.right, Const)
    )


def _choices(part: str | Term) -> list[tuple[str, Term | None]]:
    if isinstance(part, str):
        return [(part, None)]
    if isinstance(part, Const):
        return [(spoken(part.type, part.value), None)]
    return [(spoken(part.type, value), equals(part, value)) for value in part.type.values]


def _report_unsayable(
    resolver: Resolver,
    unsayable: list[tuple[str, str]],
    values: list[tuple[str | ast.Expr, Term]],
    some: bool,
    span: Span,
    from_npcs: bool,
) -> None:
    findings = resolver.findings
    said, word = unsayable[0]
    if resolver.utterances.may_be_said(said, None if from_npcs else {AGENT}):
        raise ReportedError
    if values and some:
        node, value = values[0]
        name = quoted(node) if not isinstance(node, str) else node
        message = f'`{name}` can be {word}, but "{said}" cannot be said with this grammar'
        drawn_once = isinstance(value, Read) and not resolver.registers.is_set(value.path)
        report = findings.error if drawn_once else findings.warning
        slots = resolver.symbols.sentences.slots
        otherwise = "or narrow what is drawn"
        if word in chain.from_iterable(s.words for s in slots):
            report("S402", message, span, hint=f"add what is missing to a slot of the grammar, {otherwise}")
        elif slots[0].name == NOUN:
            written = cures.in_quotes(word) if cures.needs_quotes(word, flow=True) else word
            edit = cures.added(findings.places, ("grammar", "nouns"), written)
            report("S402", message, span, hint=cures.add(word, edit, "`nouns`", otherwise))
        else:
            report("S402", message, span, hint=f"add `{word}` to a slot of the grammar, {otherwise}")
        return
    alternatives = [part for part in _JOINED.split(said) if part]
    if len(alternatives) > 1 and any(resolver.utterances.match(part) for part in alternatives):
        message = f'nobody can say "{said}" with this grammar'
        hint = f"alternatives are a list: [{', '.join(alternatives)}]"
        raise findings.fail("S401", message, span, hint=hint)
    near = did_you_mean(
        said, [*resolver.utterances.all_texts(), *(resolver.utterances.npc_texts if from_npcs else ())]
    )
    raise findings.fail(
        "S401",
        f'nobody can say "{said}" with this grammar',
        span,
        suggestion=f'"{near}"' if near else None,
        hint=None if near else "what can be said is a template of `grammar` with one of its nouns",
    )


def line(resolver: Resolver, path: DataPath, raw: str, scope: Scope) -> Line:
    """The line of a `say:`: pieces and values. The agent can say only utterances of its grammar."""
    findings = resolver.findings
    text: ast.Text | None = None
    try:
        text = findings.text(path, raw)
        return _line(resolver, path, text, scope)
    except ReportedError:
        if scope.member != "agent":
            resolver.utterances.add_unclear(scope.member, text.parts if text is not None else [None])
        raise


def _line(resolver: Resolver, path: DataPath, text: ast.Text, scope: Scope) -> Line:
    span = resolver.findings.places.whole_span(path)
    _check_is_meant(resolver, path, text, span)
    only = text.parts[0] if len(text.parts) == 1 else None
    slot = text_slot(resolver, only, scope) if only is not None and not isinstance(only, str) else None
    if slot is not None and len(slot) == 1:
        # All of it is the slot's value, so its picks are drawn at the slot's site.
        text, scope = slot[0].text, replace(slot[0].scope(scope), outer=None)
    line = Line(tuple(_merged(parts(resolver, text, scope))), scope.draws.site, span)
    if scope.member == "agent":
        return _agents(resolver, line)
    return line


_CALLED = re.compile(r"(\w+)\((.*)\)\s*")
"""A text that is all of it a word with brackets."""


def _check_is_meant(resolver: Resolver, path: DataPath, text: ast.Text, span: Span) -> None:
    """Warn of a text that would be said letter by letter and reads like a value: `pick(Hello | Hi)`."""
    called = _CALLED.fullmatch(text.plain or "")
    if called is None or called[1] not in resolver.words.quantifiers:
        return
    options = [option.strip().strip('"') for option in called[2].split("|")]
    written = f"<{called[1]}({' | '.join(f'{chr(34)}{option}{chr(34)}' for option in options)})>"
    edit = cures.over_part(resolver.findings.places, path, 0, None, written)
    hint = (
        cures.write(written, edit) if called[1] == "pick" and len(options) > 1 else "a value stands in `< >`"
    )
    message = f"`{text.plain}` is said letter by letter, as every text outside of `< >`"
    resolver.findings.warning("W407", message, span, hint=hint)


def parts(resolver: Resolver, text: ast.Text, scope: Scope) -> list[str | Term]:
    """The pieces and values of a text."""
    found: list[str | Term] = []
    for part in text.parts:
        if isinstance(part, str):
            found.append(part)
        elif (slot := text_slot(resolver, part, scope)) is not None:
            found += _filled(resolver, slot, scope)
        else:
            term = sayable(resolver, part, scope)
            found.append(spoken(term.type, term.value) if isinstance(term, Const) else term)
    return found


def _filled(resolver: Resolver, slot: list[Filling], scope: Scope) -> list[str | Term]:
    """What a slot contributes to a line; of several texts, one value that is one of them."""
    if len(slot) == 1:
        return parts(resolver, slot[0].text, slot[0].scope(scope))
    values = next((filling for filling in slot if filling.text.plain is None), None)
    if values is not None:
        message = f"files of `{values.member}` say different things here, so none may have values in it"
        raise resolver.findings.fail(
            "S315",
            message,
            resolver.findings.at(values.case.path),
            hint="put what differs into a slot of its own",
        )
    return [plain_text(slot)]


def plain_text(slot: list[Filling]) -> Term:
    """What fills a slot without values in it."""
    return select(tuple(one.case for one in slot), [text_value(str(one.case.raw)) for one in slot])


def _agents(resolver: Resolver, line: Line) -> Line:
    """The line in the grammar's own spelling."""
    findings = resolver.findings
    spelled: dict[str, str] = {normal(text): text for text in resolver.utterances.all_texts()}
    texts = list(islice(_texts_said(resolver, line), MAX_TEXTS))
    unsayable = [said for said in texts if normal(said) not in spelled]
    if unsayable:
        said, values = unsayable[0], [part for part in line.parts if not isinstance(part, str)]
        if resolver.utterances.may_be_said(said, {AGENT}):
            raise ReportedError
        message = f'the agent cannot say "{said}" with this grammar'
        if len(unsayable) < len(texts) and any(_may_change(resolver, value) for value in values):
            hint = "then it says nothing; give the register a range, or the grammar the noun"
            findings.warning("S402", message, line.span, hint=hint)
            return line
        near = did_you_mean(said, spelled.values())
        raise findings.fail("S401", message, line.span, suggestion=f'"{near}"' if near else None)
    if len(line.parts) == 1 and isinstance(line.parts[0], str):
        return Line((spelled[normal(line.parts[0])],), line.site, line.span)
    return line


def _texts_said(resolver: Resolver, line: Line) -> Iterator[str]:
    """The texts that a line can be, as far as it is known what its values can be."""
    for choice in product(*(_choices(part) for part in line.parts)):
        if _can_be(resolver, choice):
            yield "".join(word for word, _ in choice)


def _may_change(resolver: Resolver, value: Term) -> bool:
    """Whether a value is made of registers that rules set, whose range may be wider than what happens."""
    return any(isinstance(part, Read) and resolver.registers.is_set(part.path) for part in walk(value))


@dataclass(frozen=True)
class Filling:
    """A text that can fill a slot of a member's frame."""

    member: str
    slot: str
    case: Case
    text: ast.Text

    def scope(self, user: Scope) -> Scope:
        """The meaning of its names at its place."""
        draws = Draws(f"cast.{self.member}.with.{self.slot}")
        return Scope(self.case.path, draws, member=self.member, outer=user.draws)


def _varies(part: str | Term) -> TypeGuard[Term]:
    """Whether a part of a text is a value that is not known."""
    return isinstance(part, Term) and not isinstance(part, Const)


def _given(condition: Term | None) -> list[Term]:
    return [] if condition is None else [condition]


def sayable(resolver: Resolver, node: ast.Expr, scope: Scope, or_condition: bool = False) -> Term:
    """A value inside a text: something that words stand for; where it may be a condition, also whether that holds."""
    if isinstance(node, ast.Compare | ast.Logic | ast.Not | ast.Member) and not or_condition:
        message = f"`{quoted(node)}` is a condition; only a value can be said"
        raise resolver.fail("S402", message, node, scope)
    if groups.is_group(resolver, node, scope):
        message = f"`{quoted(node)}` is a group; `pick({quoted(node)})` says one of them"
        raise resolver.fail("S402", message, node, scope)
    term = word_in_slot(resolver, node, scope) or resolver.value(node, None, scope)
    if term.type.kind not in SAYABLE and not (or_condition and term.type.kind == "bool"):
        what = described(term.type)
        hint: cures.Hint = None
        if term.type.kind == "entity":
            also = "or whatever else of it can be said"
            hint = resolver.instead(f"{quoted(node)}.color", node, scope, also)
        raise resolver.fail(
            "S402", f"`{quoted(node)}` is {what}, which cannot be said", node, scope, hint=hint
        )
    return term


def _merged(parts: Iterable[str | Term]) -> Iterator[str | Term]:
    """The same with neighbouring pieces of text joined."""
    for is_text, run in groupby(parts, lambda part: isinstance(part, str)):
        if not is_text:
            yield from run
        elif text := "".join(map(str, run)):
            yield text


# -- hearing: what a rule hears, what stood in its slots, and what members of the cast have said ----------------


Patterns = tuple[Pattern, ...]
Alternative = list[tuple[Pattern, Term | None]]
"""What one text of `hears:` stands for: patterns, each with a condition on values, of which at most one holds."""

_MOST_LISTED = 4
"""The most texts that a message lists."""


def heard_at(resolver: Resolver, raw: str, scope: Scope) -> Alternative:
    """What a text of `hears:` stands for, which is written at the scope's path."""
    if raw == ANYTHING:
        return for_ears(resolver, [(resolver.utterances.anything(), None)], scope)
    text = resolver.findings.text(scope.path, raw)
    return for_ears(
        resolver,
        patterns(resolver, text, scope, resolver.findings.places.whole_span(scope.path), True),
        scope,
    )


def for_ears(resolver: Resolver, heard: Alternative, scope: Scope) -> Alternative:
    """The same as one member hears it, where it matters who is addressed."""
    if not resolver.addresses or scope.member is None:
        return heard
    own = resolver.symbols.numbers[scope.member]
    return [(replace(pattern, hearer=own), condition) for pattern, condition in heard]


def on_hearing(heard: Sequence[Alternative], when: SitedTerm | None, site: str, span: Span) -> SitedTerm:
    """The condition that one of these was heard, and then what else is asked."""
    term = any_of(
        all_of([Heard((pattern,)), *_given(condition)])
        for alternative in heard
        for pattern, condition in alternative
    )
    both = term if when is None else all_of([term, when.term])
    return SitedTerm(both, site, when.span if when is not None else span)


def speaker(resolver: Resolver, node: ast.Name, scope: Scope) -> Term:
    """`speaker` in a rule; which patterns it is about is filled in once they are known (`binding`)."""
    if not scope.hearing:
        message = "`speaker` is who said what a rule `hears`; nothing is heard here"
        in_rule = scope.frame is not None and any(part in ("first", "then") for part in scope.path)
        hint = "add `hears:` to the rule; `hears: any` is anything"
        if not in_rule:
            hint = "elsewhere ask `agent.said(...)`, or the same of an NPC"
        raise resolver.fail("S211", message, node, scope, hint=hint)
    return Speaker(Type("entity", 0, len(resolver.symbols.numbers) - 1), ())


def noun(resolver: Resolver, node: ast.Expr, scope: Scope) -> Term:
    """`noun`: of what the rule heard, else of what the agent said in this step."""
    no_nouns(resolver, node, scope)
    return in_slot(resolver, NOUN, scope.hearing)


def no_nouns(resolver: Resolver, node: ast.Expr, scope: Scope) -> None:
    """Report what asks for nouns where the grammar has slots."""
    if resolver.symbols.scenario.grammar.slots:
        places = ", ".join(f"`<{name}>`" for name in resolver.symbols.scenario.grammar.slots)
        raise resolver.fail("S201", f"this grammar has no nouns; its slots are {places}", node, scope)


def in_slot(resolver: Resolver, name: str, heard: bool) -> Term:
    """The word in a slot: of what the rule heard, else of what the agent said in this step."""
    symbols = resolver.symbols
    words = symbols.nouns if name == NOUN else symbols.slots[name].words
    fillings = zip(symbols.sentences.slots, symbols.sentences.strides, symbols.sentences.radices, strict=True)
    # Where every template has a noun, the filling is the noun.
    digit = next((Digit(s, r) for slot, s, r in fillings if slot.name == name and r > len(slot.words)), None)
    return HeardNoun(words, (), digit) if heard else World(words, "noun", digit)


def word_in_slot(resolver: Resolver, node: ast.Expr, scope: Scope) -> Term | None:
    """What is said for `<slot>` or `<agent.slot>`: the word itself, whatever it stands for; None for anything else."""
    slots = resolver.symbols.slots
    match node:
        case ast.Name(id=name) if (
            name in slots and name not in scope.variables and scope.frame and not scope.at_reset
        ):
            return in_slot(resolver, name, scope.hearing)
        case ast.Attribute(subject=ast.Name(id="agent"), name=name) if name in slots and not scope.at_reset:
            return in_slot(resolver, name, heard=False)
    return None


def spoke(resolver: Resolver, node: ast.Call | ast.Attribute | ast.Name, scope: Scope) -> Term:
    """`x.spoke`: whether a member of the cast said anything in this step."""
    said = []
    for member, condition in speakers(resolver, node, scope):
        number = resolver.symbols.numbers[member]
        said.append(all_of([*condition, SaidBy(number, None) if number else Spoke()]))
    return any_of(said)


def said_by(resolver: Resolver, node: ast.Call, scope: Scope) -> Term:
    """`x.said("...")`: whether a member of the cast said one of the texts in this step."""
    (argument,) = node.args
    members = dict(speakers(resolver, node, scope))
    if [*members] == ["agent"]:
        return said(resolver, argument, scope)
    found: list[Term] = []
    for text, chosen, span in texts(resolver, argument, scope, _sayable(resolver, members)):
        if text.plain is not None:
            _check_said(resolver, text, members, span)
        for pattern, given in patterns(resolver, text, scope, span, True):
            conditions = [condition for condition in (chosen, given) if condition is not None]
            for member, meant in members.items():
                found += [all_of([*meant, one, *conditions]) for one in _has_said(resolver, member, pattern)]
    if not found:
        raise _never_said(resolver, quoted(argument), members, resolver.findings.node(scope.path, argument))
    return any_of(found)


def _has_said(resolver: Resolver, member: str, pattern: Pattern) -> Iterator[Term]:
    """That a member said what a pattern matches; nothing if it never says that."""
    if member == "agent" and pattern.pairs:
        yield Said(pattern)
    elif pattern.said_by_npcs & resolver.utterances.said_by.get(member, {}).keys():
        yield SaidBy(resolver.symbols.numbers[member], pattern)


def _check_said(resolver: Resolver, text: ast.Text, members: Iterable[str], span: Span) -> None:
    """Report a text that none of some members ever says."""
    own = {normal(said) for said in _sayable(resolver, members)}
    if normal(text.plain or "") not in own:
        raise _never_said(resolver, quoted(text), members, span)


def _sayable(resolver: Resolver, members: Iterable[str]) -> list[str]:
    """Every text that one of some members can say."""
    texts: dict[str, None] = {}
    for member in members:
        own = (
            resolver.utterances.all_texts()
            if member == "agent"
            else resolver.utterances.said_by.get(member, {})
        )
        texts |= dict.fromkeys(own)
    return list(texts)


def _never_said(resolver: Resolver, said: str, members: Iterable[str], span: Span) -> ReportedError:
    members = list(members)
    if resolver.utterances.may_be_said(said.strip('"'), members):
        return ReportedError()
    texts, names = _sayable(resolver, members), [f"`{member}`" for member in members]
    near = did_you_mean(said.strip('"'), texts)
    hint = "what somebody can say stands in the `say` of its frame"
    if 0 < len(texts) <= _MOST_LISTED:
        hint = "what is said: " + ", ".join(f'"{text}"' for text in texts)
    message = f"{' and '.join(names)} never {'says' if len(names) == 1 else 'say'} {said}"
    return resolver.findings.fail(
        "S401", message, span, suggestion=f'"{near}"' if near else None, hint=None if near else hint
    )


def speakers(
    resolver: Resolver, node: ast.Call | ast.Attribute | ast.Name, scope: Scope
) -> list[tuple[str, list[Term]]]:
    """The members of the cast that can stand before the dot, each with the conditions on which it is the one."""
    subject = None if isinstance(node, ast.Name) else node.subject
    if subject is None:
        must_be_agent(resolver, node, scope)
        return [("agent", [])]
    name = "" if isinstance(node, ast.Name) else node.name
    who = subject_of(resolver, subject, resolver.words.values[name], node, scope)
    assert who is not None, "internal: a cell says nothing"
    numbers = numbers_of(who)
    members = resolver.symbols.members_of(numbers)
    if None in members:
        raise resolver.fail("S211", "only a member of the cast says something", node, scope)
    if len(members) == 1:
        return [(str(members[0]), [])]
    return [(str(member), [equals(who, number)]) for number, member in zip(numbers, members, strict=True)]


def asked_of_heard(parts: object) -> set[Digit | None]:
    """Which slots of what was heard something in a rule is made of; None is the noun."""
    return {term.digit for term in walk(parts) if isinstance(term, HeardNoun)}


def with_slots(
    resolver: Resolver, heard: Sequence[Alternative], asked: set[Digit | None], span: Span
) -> list[Alternative]:
    """Only what has these slots: a rule that asks for them does not hear anything else."""
    found = [
        [
            (kept, condition)
            for pattern, condition in alternative
            if (kept := _with_slots(resolver, pattern, asked))
        ]
        for alternative in heard
    ]
    if any(heard) and not any(found):  # what is not understood has been reported
        sentences = resolver.symbols.sentences
        names = [
            slot.name
            for slot, stride in zip(sentences.slots, sentences.strides, strict=True)
            if None in asked or stride in {digit.stride for digit in asked if digit is not None}
        ]
        name = names[0] if len(names) == 1 else " and ".join(names)
        what = "a noun" if name == NOUN else " and ".join(f"`<{one}>`" for one in names)
        message = f"nothing that this rule hears has {what}, and it asks for `{name}`"
        hint = f"write `<{names[0]}>` where it stands in the text"
        raise resolver.findings.fail("S211", message, span, hint=hint)
    return found


def _with_slots(resolver: Resolver, pattern: Pattern, asked: set[Digit | None]) -> Pattern | None:
    """The part of a pattern that has some slots: what is caught by `<slot>`, and what the grammar can say."""
    if None in asked and (pattern.nouns or "<noun>" in pattern.text):
        return pattern
    known: dict[str, int | None] = dict(pattern.nouns)
    for text in sorted(pattern.said_by_npcs):
        known.setdefault(text, resolver.utterances.filling_of(text))
    fillings = tuple((text, f) for text, f in known.items() if f is not None and _has(f, asked))
    pairs = frozenset(pair for pair in pattern.pairs if _has(pair[1], asked))
    if not (pairs or fillings):
        return None
    texts = frozenset(text for text, _ in fillings)
    return replace(pattern, pairs=pairs, said_by_npcs=texts, nouns=fillings)


def _has(filling: int, asked: set[Digit | None]) -> bool:
    """Whether a filling has all the slots that are asked for."""
    return all(d is None or filling // d.stride % d.radix < d.radix - 1 for d in asked)


def binding(heard: Sequence[Alternative]) -> Callable[[Term], Term | None]:
    """The meaning of `speaker`, `noun` and slots where these are heard; lines of the agent alone need no search."""
    only_agent = not any(pattern.said_by_npcs for alternative in heard for pattern, _ in alternative)

    def change(term: Term) -> Term | None:
        if isinstance(term, Speaker):
            return entity(0) if only_agent else _of_what_is_meant(term, heard, ())
        if isinstance(term, HeardNoun):
            said = World(term.type, "noun", term.digit)
            return said if only_agent else _of_what_is_meant(term, heard, ())
        return None

    return change


def _of_what_is_meant(asked: Speaker | HeardNoun, heard: Sequence[Alternative], patterns: Patterns) -> Term:
    """Something of the first utterance that fits; what fits may depend on values, of which each text has one."""
    if not heard:
        return replace(asked, patterns=patterns)
    alternative, *others = heard
    always = tuple(pattern for pattern, condition in alternative if condition is None)
    sometimes = [(pattern, condition) for pattern, condition in alternative if condition is not None]
    otherwise = _of_what_is_meant(asked, others, (*patterns, *always))
    if not sometimes:
        return otherwise
    return Select(
        asked.type,
        tuple(condition for _, condition in sometimes),
        tuple(_of_what_is_meant(asked, others, (*patterns, *always, pattern)) for pattern, _ in sometimes),
        otherwise,
    )


# -- what a register is set to, where only that says what it holds -----------------------------------------


def value_for(resolver: Resolver, register: str, raw: object, scope: Scope) -> SitedTerm:
    """The value that a register is set to; one that may hold nothing can be set to `none`."""
    registers = resolver.registers
    known = registers.holds(register)
    if registers.starts_with_nothing(register) and is_nothing(raw):
        base = registers.read(register)
        assert isinstance(base, Read), "internal: a register that is set is no constant"
        nothing = Const(base.type, base.nothing if base.nothing is not None else 0)
        return SitedTerm(nothing, scope.draws.site, resolver.findings.at(scope.path))
    if is_nothing(raw) and known is not None and known.kind != "action" and known.words != TURN.words:
        message = "only a register that starts with `none` can hold nothing"
        raise resolver.findings.fail("S204", message, resolver.findings.at(scope.path))
    expected = INT if known is not None and known.kind == "int" and not known.words else known
    if known is None and isinstance(raw, str) and _is_noun(resolver, raw.strip(), scope):
        expected = resolver.symbols.nouns
    value = resolver.sited(raw, expected, scope)  # type: ignore[arg-type]
    registers.widen(register, value.term)
    return value


def _is_noun(resolver: Resolver, raw: str, scope: Scope) -> bool:
    """Whether a value is a noun of the grammar, and nothing else, or a quoted one."""
    words = resolver.symbols.nouns.words
    quoted_noun = raw[:1] == raw[-1:] and raw[:1] in ("'", '"') and raw[1:-1] in words
    return quoted_noun or (raw in words and not is_number(raw) and resolver.means_nothing(raw, scope))


# -- words -----------------------------------------------------------------------------------------------------


def texts_in_order(
    sentences: Sentences,
    names: Iterable[Term],
    lines: Sequence[Line],
    tones: Iterable[Term | None],
) -> Iterator[str]:
    """The texts of the grammar, then the names, what each NPC can say in pieces, and tones.

    What the agent says has words of the grammar only, so a scenario has the same words with a script and without.

    Args:
        sentences: templates come first, then the words of their slots.
        names: the name of each member of the cast, in order.
        lines: of all NPCs, of each in the order of its frame.
        tones: the tone of each entity, None without one.
    """
    return chain(
        (re.sub("<[^<>]*>", " ", template) for template in sentences.templates),
        (word for slot in sentences.slots for word in slot.words),
        (word for name in names for word in words_of_values(name.type)),
        (text for line in lines for text in _pieces(line)),
        (word for tone in tones if tone is not None for word in tone.type.words),
        ("to" for line in lines if line.to is not None),
    )


def _pieces(line: Line) -> Iterator[str]:
    """The pieces of a line, each value with all its words; then whole texts, where pieces run into each other."""
    for part in line.parts:
        yield from [part] if isinstance(part, str) else words_of_values(part.type)
    if _runs_together(line):
        yield from texts_of(line)


def _runs_together(line: Line) -> bool:
    """Whether somewhere one piece ends and the next begins within a word."""
    edges = [(part[:1], part[-1:]) if isinstance(part, str) else ("x", "x") for part in line.parts]
    return any(words(before) and words(after) for (_, before), (after, _) in pairwise(edges))
