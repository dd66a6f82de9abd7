"""Who said something: what a rule hears, which noun was in it, and what members of the cast have said."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.semantics import texts
from socialai_dsl.semantics.build import all_of, any_of, changed, walk
from socialai_dsl.semantics.findings import FailedError
from socialai_dsl.semantics.plans import RulePlan
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import Scope
from socialai_dsl.semantics.signatures import VALUES
from socialai_dsl.semantics.subjects import must_be_agent, subject_of
from socialai_dsl.semantics.terms import (
    Compare,
    Const,
    HeardNoun,
    Pattern,
    Said,
    SaidBy,
    Select,
    Speaker,
    Spoke,
    Term,
    Type,
    World,
)
from socialai_dsl.semantics.wording import quoted
from socialai_dsl.source import Span
from socialai_dsl.vocabulary import normal

Patterns = tuple[Pattern, ...]
Alternative = list[tuple[Pattern, Term | None]]
"""What one text of `hears:` stands for: patterns, each with a condition on values, of which at most one holds."""

_MOST_LISTED = 4
"""So many texts are listed in a message."""


def speaker(resolver: Resolver, node: ast.Name, scope: Scope) -> Term:
    """`speaker` in a rule; which patterns it is about is filled in once they are known (`bound`)."""
    if not scope.hearing:
        message = "`speaker` is who said what a rule `hears`; nothing is heard here"
        in_rule = scope.frame is not None and any(part in ("first", "then") for part in scope.path)
        hint = "add `hears:` to the rule; `hears: any` is anything"
        if not in_rule:
            hint = "elsewhere ask `agent.said(...)`, or the same of an NPC"
        raise resolver.fail("S211", message, node, scope, hint=hint)
    return Speaker(Type("entity", 0, len(resolver.symbols.numbers) - 1), ())


def noun(resolver: Resolver, scope: Scope) -> Term:
    """`noun`: of what the rule heard, else of what the agent said in this step."""
    nouns = resolver.symbols.nouns
    return HeardNoun(nouns, ()) if scope.hearing else World(nouns, "noun")


def spoke(resolver: Resolver, node: ast.Call | ast.Attribute | ast.Name, scope: Scope) -> Term:
    """`x.spoke`: whether a member of the cast said anything in this step."""
    said = []
    for member, condition in speakers(resolver, node, scope):
        number = resolver.symbols.numbers[member]
        said.append(all_of([*condition, SaidBy(number, None) if number else Spoke()]))
    return any_of(said)


def said(resolver: Resolver, node: ast.Call, scope: Scope) -> Term:
    """`x.said("...")`: whether a member of the cast said one of the texts in this step."""
    (argument,) = node.args
    members = dict(speakers(resolver, node, scope))
    if [*members] == ["agent"]:
        return texts.said(resolver, argument, scope)
    found: list[Term] = []
    for text, drawn, span in texts.texts(resolver, argument, scope):
        if text.plain is not None:
            _check_said(resolver, text, members, span)
        for pattern, given in texts.patterns(resolver, text, scope, span, True):
            conditions = [condition for condition in (drawn, given) if condition is not None]
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


def _never_said(resolver: Resolver, said: str, members: Iterable[str], span: Span) -> FailedError:
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
    who = subject_of(resolver, subject, VALUES[name], node, scope)
    assert who is not None, "internal: a cell says nothing"
    numbers = [who.value] if isinstance(who, Const) else range(who.type.low, who.type.high + 1)
    members = [resolver.symbols.member_of(number) for number in numbers]
    if None in members:
        raise resolver.fail("S211", "only a member of the cast says something", node, scope)
    if len(members) == 1:
        return [(str(members[0]), [])]
    return [
        (str(member), [Compare("==", who, Const(who.type, number))])
        for number, member in zip(numbers, members, strict=True)
    ]


def asks_for_noun(parts: object) -> bool:
    """Whether something in a rule is made of the noun that was heard."""
    return any(isinstance(term, HeardNoun) for term in walk(parts))


def with_nouns(resolver: Resolver, heard: Sequence[Alternative], span: Span) -> list[Alternative]:
    """Only what has a noun: a rule that asks for it does not hear anything else."""
    found = [
        [(kept, condition) for pattern, condition in alternative if (kept := _with_noun(resolver, pattern))]
        for alternative in heard
    ]
    if any(heard) and not any(found):  # what is not understood has been reported
        message = "nothing that this rule hears has a noun, and it asks for `noun`"
        hint = "write `<noun>` where it stands in the text"
        raise resolver.findings.fail("S211", message, span, hint=hint)
    return found


def _with_noun(resolver: Resolver, pattern: Pattern) -> Pattern | None:
    """The part of a pattern that has a noun: what is caught by `<noun>`, and what the grammar can say."""
    if pattern.nouns or "<noun>" in pattern.text:
        return pattern
    known = ((text, resolver.utterances.noun_in(text)) for text in sorted(pattern.said_by_npcs))
    nouns = tuple((text, noun) for text, noun in known if noun is not None)
    if not (pattern.pairs or nouns):
        return None
    return Pattern(pattern.pairs, pattern.text, frozenset(text for text, _ in nouns), nouns)


def bound(plan: RulePlan, heard: Sequence[Alternative]) -> RulePlan:
    """A rule whose `speaker` and `noun` know what it hears."""
    return changed(plan, binding(heard))  # type: ignore[no-any-return]


def binding(heard: Sequence[Alternative]) -> Callable[[Term], Term | None]:
    """What `speaker` and `noun` are where these are heard; what only the agent says needs no search."""
    only_agent = not any(pattern.said_by_npcs for alternative in heard for pattern, _ in alternative)

    def change(term: Term) -> Term | None:
        if isinstance(term, Speaker):
            who = Type("entity", 0, 0)
            return Const(who, 0) if only_agent else _of_what_is_meant(Speaker, term.type, heard, ())
        if isinstance(term, HeardNoun):
            noun = World(term.type, "noun")
            return noun if only_agent else _of_what_is_meant(HeardNoun, term.type, heard, ())
        return None

    return change


def _of_what_is_meant(
    kind: type[Speaker] | type[HeardNoun], type_: Type, heard: Sequence[Alternative], patterns: Patterns
) -> Term:
    """Something of the first utterance that fits; what fits may depend on values, of which each text has one."""
    if not heard:
        return kind(type_, patterns)
    alternative, *others = heard
    always = tuple(pattern for pattern, condition in alternative if condition is None)
    sometimes = [(pattern, condition) for pattern, condition in alternative if condition is not None]
    otherwise = _of_what_is_meant(kind, type_, others, (*patterns, *always))
    if not sometimes:
        return otherwise
    return Select(
        type_,
        tuple(condition for _, condition in sometimes),
        tuple(
            _of_what_is_meant(kind, type_, others, (*patterns, *always, pattern)) for pattern, _ in sometimes
        ),
        otherwise,
    )
