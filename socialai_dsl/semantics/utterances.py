"""What the agent can say, and which of it a text in the file means."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, product
from typing import TYPE_CHECKING, TypeGuard

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema import UtteranceGrammar
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics import resolve_groups
from socialai_dsl.semantics.alternatives import by_value, drawn, select
from socialai_dsl.semantics.build import all_of, any_of, walk
from socialai_dsl.semantics.findings import FailedError
from socialai_dsl.semantics.possible_values import values_of
from socialai_dsl.semantics.scope import Draws, Scope
from socialai_dsl.semantics.terms import (
    Compare,
    Const,
    Heard,
    Line,
    Pattern,
    Read,
    Said,
    Term,
    Type,
)
from socialai_dsl.semantics.wording import described, quoted, spoken
from socialai_dsl.source import Span
from socialai_dsl.vocabulary import normal

if TYPE_CHECKING:
    from socialai_dsl.semantics.resolve import Resolver

MAX_TEXTS = 4096
"""How many different texts one line may have."""

_JOINED = re.compile(r"\s*\|\s*|\s+or\s+")
"""What an author may put between alternatives."""

_SAYABLE = ("text", "noun", "color", "int", "status", "direction", "action")


class Utterances:
    """Everything the agent can say: each template with each noun."""

    def __init__(self, resolver: Resolver, grammar: UtteranceGrammar) -> None:
        self._resolver = resolver
        self._grammar = grammar
        self._pairs: dict[str, set[tuple[int, int]]] = {}
        self._written: dict[int, tuple[ast.Text, Span]] = {}
        self._by_normal: dict[str, list[tuple[int, str]]] = {}
        self._known_texts = 0
        for t, n in product(range(len(grammar.templates)), range(len(grammar.nouns))):
            self._pairs.setdefault(normal(grammar.utterance(t, n)), set()).add((t, n))

    # -- patterns --------------------------------------------------------------------------------------------

    def said(self, node: ast.Expr, scope: Scope) -> Term:
        """Whether the agent said one of the texts at `node` in this step."""
        span = self._resolver.findings.node(scope.path, node)
        return any_of(
            all_of([Said(pattern), *_given(drawn), *_given(given)])
            for text, drawn in self.texts(node, scope)
            for pattern, given in self.patterns(text, scope, span, False)
        )

    def heard(self, node: ast.Expr, scope: Scope) -> Term:
        """Whether the NPC whose frame it is heard one of the texts at `node` since its last turn."""
        span = self._resolver.findings.node(scope.path, node)
        return any_of(
            all_of([Heard((pattern,)), *_given(drawn), *_given(given)])
            for text, drawn in self.texts(node, scope)
            for pattern, given in self.patterns(text, scope, span, True)
        )

    def texts(self, node: ast.Expr, scope: Scope) -> list[tuple[ast.Text, Term | None]]:
        """The texts that an argument names, each with the condition on what `one_of` drew."""
        resolver = self._resolver
        options = node.options if isinstance(node, ast.Alternatives) else (node,)
        texts: list[tuple[ast.Text, Term | None]] = []
        for option in options:
            slot = self._slot(option, scope)
            if slot is not None:
                texts += [(filling.text, filling.drawn) for filling in slot]
            elif isinstance(option, ast.Text):
                texts.append((option, None))
            else:
                message = f'`{quoted(option)}` is not a text; what is said is quoted: "Open sesame"'
                slots = scope.frame.texts if scope.frame is not None else ()
                near = did_you_mean(option.id, slots) if isinstance(option, ast.Name) else None
                raise resolver.fail("S211", message, option, scope, suggestion=near)
        return texts

    def _slot(self, node: ast.Expr, scope: Scope) -> list[_Filling] | None:
        """What fills the slot of type text or utterance that an expression names, `<formula>` of one's own frame or
        `<teacher.formula>` of a member's: one text, or several where the files of a `one_of` differ. None if it names
        no such slot.
        """
        frame, name = scope.frame, ""
        match node:
            case ast.Name(id=name) if name not in scope.variables:
                pass
            case ast.Attribute(subject=ast.Name(id=owner), name=name) if owner not in scope.variables:
                frame = self._resolver.frames.get(self._resolver.symbols.roles.get(owner, owner))
            case _:
                return None
        if frame is None or frame.model.slots.get(name) not in ("text", "utterance"):
            return None
        paths = frame.texts.get(name)
        if paths is None:
            raise FailedError  # nobody fills it, which is reported where it is left empty
        described = self._resolver.symbols.alternatives[frame.member]
        fillings = [
            _Filling(
                frame.member,
                name,
                paths[numbers[0]],
                self._resolver.findings.text(paths[numbers[0]], raw),
                drawn(self._resolver, frame.member, numbers),
            )
            for raw, numbers in by_value([str(one.with_[name]) for one in described]).items()
        ]
        for filling in fillings:
            span = self._resolver.findings.at(filling.path)
            self._written[id(filling.text)] = (filling.text, span)
        return fillings

    def _place(self, text: ast.Text, span: Span) -> Span:
        """Where a text is written: one that fills a slot elsewhere than where it is used."""
        known = self._written.get(id(text))
        return known[1] if known is not None else span

    def patterns(
        self, text: ast.Text, scope: Scope, span: Span, from_npcs: bool
    ) -> list[tuple[Pattern, Term | None]]:
        """The utterances that a text means, each with the condition on the values in it; `<noun>` is any noun.

        Reports S401 if nobody can say it and S402 if some value in it cannot be said, where a text that fills a slot
        is written.
        """
        span = self._place(text, span)
        return [
            found
            for parts, drawn, filling in self._spliced(text, scope)
            for found in self._meant(parts, drawn, scope, span if filling is None else filling, from_npcs)
        ]

    def _meant(
        self,
        spliced: Sequence[str | ast.Expr],
        drawn: Sequence[Term],
        scope: Scope,
        span: Span,
        from_npcs: bool,
    ) -> list[tuple[Pattern, Term | None]]:
        """The patterns of a text without slots, on the condition that what `drawn` says was drawn."""
        parts = [self._spoken_part(part, scope) for part in spliced]
        found: list[tuple[Pattern, Term | None]] = []
        unsayable: list[tuple[str, str]] = []
        for choice in product(*(self._choices(part) for part in parts)):
            said = "".join(word for word, _ in choice)
            pairs = self._match(said)
            nouns = self._said_by_npcs(said) if from_npcs else {}
            conditions = [*drawn, *(condition for _, condition in choice if condition is not None)]
            if pairs or nouns:
                found_nouns = tuple((t, noun) for t, noun in nouns.items() if noun is not None)
                pattern = Pattern(pairs, said, frozenset(nouns), found_nouns)
                found.append((pattern, all_of(conditions) if conditions else None))
            elif self._can_be(choice):
                unsayable.append((said, next((word for word, c in choice if c is not None), "")))
        if unsayable:
            values = [(node, part) for node, part in zip(spliced, parts, strict=True) if _varies(part)]
            self._report_unsayable(unsayable, values, bool(found), span, from_npcs)
        return found

    def _spliced(
        self, text: ast.Text, scope: Scope
    ) -> Iterator[tuple[list[str | ast.Expr], list[Term], Span | None]]:
        """The parts of a text, with texts that fill slots put in their place; all ways to do so, where files that
        `one_of` draws differ, each with its conditions, and with the place of what fills a text that is one slot.
        """
        choices: list[list[tuple[tuple[str | ast.Expr, ...], Term | None, Span | None]]] = []
        findings = self._resolver.findings
        for part in text.parts:
            slot = None if isinstance(part, str) else self._slot(part, scope)
            if slot is None:
                choices.append([((part,), None, None)])
                continue
            alone = len(text.parts) == 1
            choices.append([(f.text.parts, f.drawn, findings.at(f.path) if alone else None) for f in slot])
        for choice in product(*choices):
            parts = [part for parts, _, _ in choice for part in parts]
            place = next((span for _, _, span in choice if span is not None), None)
            yield parts, [d for _, d, _ in choice if d is not None], place

    def _spoken_part(self, part: str | ast.Expr, scope: Scope) -> str | Term | None:
        """A piece of text, a value in it, or None for any noun."""
        if isinstance(part, str):
            return part
        if isinstance(part, ast.Name) and part.id == "noun" and "noun" not in scope.variables:
            return None
        if isinstance(part, ast.Name) and part.id == "nouns":
            message = "`nouns` are all of them; any one of them is `<noun>`"
            raise self._resolver.fail("S402", message, part, scope)
        if isinstance(part, ast.Name) and part.id == "any":
            message = "any noun is `<noun>`; anything at all is `hears: any`"
            raise self._resolver.fail("S402", message, part, scope)
        return sayable(self._resolver, part, scope)

    def _can_be(self, choice: Iterable[tuple[str, Term | None]]) -> bool:
        """Whether the values of a text can be those that it is made of."""
        return all(
            condition.right.value in values_of(self._resolver, condition.left)
            for _, condition in choice
            if isinstance(condition, Compare) and isinstance(condition.right, Const)
        )

    def _choices(self, part: str | Term | None) -> list[tuple[str, Term | None]]:
        if isinstance(part, str):
            return [(part, None)]
        if part is None:
            return [("<noun>", None)]
        if isinstance(part, Const):
            return [(spoken(part.type, part.value), None)]
        values = range(part.type.low, part.type.high + 1)
        return [(spoken(part.type, v), Compare("==", part, Const(part.type, v))) for v in values]

    def _match(self, said: str) -> frozenset[tuple[int, int]]:
        if "<noun>" not in said:
            return frozenset(self._pairs.get(normal(said), ()))
        nouns = [str(noun) for noun in self._grammar.nouns]
        return frozenset(
            pair for n in nouns for pair in self._pairs.get(normal(said.replace("<noun>", n)), ())
        )

    def _said_by_npcs(self, said: str) -> dict[str, int | None]:
        """The texts of NPCs that fit, each with the noun that stands for `<noun>`."""
        known = self._npc_texts()
        if "<noun>" not in said:
            return {text: None for _, text in known.get(normal(said), ())}
        wanted = {normal(said.replace("<noun>", str(noun))): i for i, noun in enumerate(self._grammar.nouns)}
        found = sorted((place, text, i) for like, i in wanted.items() for place, text in known.get(like, ()))
        return {text: i for _, text, i in found}

    def _npc_texts(self) -> dict[str, list[tuple[int, str]]]:
        """What NPCs say, by what counts of it, with its place among all texts, to which others only are added."""
        texts = self._resolver.npc_texts
        for place, text in enumerate(islice(texts, self._known_texts, None), self._known_texts):
            self._by_normal.setdefault(normal(text), []).append((place, text))
        self._known_texts = len(texts)
        return self._by_normal

    def noun_in(self, said: str) -> int | None:
        """The noun of what the grammar can say; None where it cannot, or the template has no place for a noun."""
        found = [
            noun
            for template, noun in self._pairs.get(normal(said), ())
            if "<noun>" in self._grammar.templates[template]
        ]
        return min(found, default=None)

    def anything(self) -> Pattern:
        """Whatever anybody can say."""
        pairs = frozenset(pair for found in self._pairs.values() for pair in found)
        return Pattern(pairs, "any", frozenset(self._resolver.npc_texts))

    def _report_unsayable(
        self,
        unsayable: list[tuple[str, str]],
        values: list[tuple[str | ast.Expr, Term]],
        some: bool,
        span: Span,
        from_npcs: bool,
    ) -> None:
        findings = self._resolver.findings
        said, word = unsayable[0]
        if values and some:
            node, value = values[0]
            name = quoted(node) if not isinstance(node, str) else node
            message = f'`{name}` can be {word}, but "{said}" cannot be said with this grammar'
            drawn_once = isinstance(value, Read) and not self._resolver.registers.is_set(value.path)
            report = findings.error if drawn_once else findings.warning
            nouns = [str(noun) for noun in self._grammar.nouns]
            missing = f"`{word}`" if word not in nouns else "what is missing"
            report("S402", message, span, hint=f"add {missing} to the nouns, or narrow what is drawn")
            return
        alternatives = [part for part in _JOINED.split(said) if part]
        if len(alternatives) > 1 and any(self._match(part) for part in alternatives):
            message = f'nobody can say "{said}" with this grammar'
            hint = f"alternatives are a list: [{', '.join(alternatives)}]"
            raise findings.fail("S401", message, span, hint=hint)
        near = did_you_mean(said, [*self.all_texts(), *(self._resolver.npc_texts if from_npcs else ())])
        raise findings.fail(
            "S401",
            f'nobody can say "{said}" with this grammar',
            span,
            suggestion=f'"{near}"' if near else None,
            hint=None if near else "what can be said is a template of `grammar` with one of its nouns",
        )

    def all_texts(self) -> Iterator[str]:
        """Every utterance as text."""
        for t, n in product(range(len(self._grammar.templates)), range(len(self._grammar.nouns))):
            yield self._grammar.utterance(t, n)

    # -- lines -----------------------------------------------------------------------------------------------

    def line(self, path: DataPath, raw: str, scope: Scope) -> Line:
        """What a `say:` says: pieces and values. The agent can only say what its grammar has."""
        findings = self._resolver.findings
        text = findings.text(path, raw)
        span = findings.at(path)
        only = text.parts[0] if len(text.parts) == 1 else None
        slot = self._slot(only, scope) if only is not None and not isinstance(only, str) else None
        if slot is not None and len(slot) == 1:
            # All of it is the slot's value, so its picks are drawn at the slot's site.
            text, scope = slot[0].text, replace(slot[0].scope(scope), outer=None)
        line = Line(tuple(_merged(self.parts(text, scope))), scope.draws.site, span)
        if scope.member == "agent":
            return self._agents(line)
        return line

    def parts(self, text: ast.Text, scope: Scope) -> list[str | Term]:
        """The pieces and values of a text."""
        return list(self._each_part(text, scope))

    def _each_part(self, text: ast.Text, scope: Scope) -> Iterator[str | Term]:
        for part in text.parts:
            if isinstance(part, str):
                yield part
                continue
            slot = self._slot(part, scope)
            if slot is not None:
                yield from self._filled(slot, scope)
                continue
            term = sayable(self._resolver, part, scope)
            yield spoken(term.type, term.value) if isinstance(term, Const) else term

    def _filled(self, slot: list[_Filling], scope: Scope) -> list[str | Term]:
        """What a slot contributes to a line; where files that `one_of` draws differ, one value with their texts."""
        if len(slot) == 1:
            return self.parts(slot[0].text, slot[0].scope(scope))
        resolver = self._resolver
        values = next((filling for filling in slot if filling.text.plain is None), None)
        if values is not None:
            message = f"files of `{values.member}` say different things here, so none may have values in it"
            raise resolver.findings.fail(
                "S315",
                message,
                resolver.findings.at(values.path),
                hint="put what differs into a slot of its own",
            )
        plain = [
            Const(Type("text", 0, 0, (str(one.with_[slot[0].slot]),)), 0)
            for one in resolver.symbols.alternatives[slot[0].member]
        ]
        return [select(resolver, slot[0].member, plain)]

    def _agents(self, line: Line) -> Line:
        """The line in the grammar's own spelling."""
        findings = self._resolver.findings
        spelled: dict[str, str] = {normal(text): text for text in self.all_texts()}
        texts = list(islice(self._texts_said(line), MAX_TEXTS))
        unsayable = [said for said in texts if normal(said) not in spelled]
        if unsayable:
            said, values = unsayable[0], [part for part in line.parts if not isinstance(part, str)]
            message = f'the agent cannot say "{said}" with this grammar'
            if len(unsayable) < len(texts) and any(self._may_change(value) for value in values):
                hint = "then it says nothing; give the register a range, or the grammar the noun"
                findings.warning("S402", message, line.span, hint=hint)
                return line
            near = did_you_mean(said, spelled.values())
            raise findings.fail("S401", message, line.span, suggestion=f'"{near}"' if near else None)
        if len(line.parts) == 1 and isinstance(line.parts[0], str):
            return Line((spelled[normal(line.parts[0])],), line.site, line.span)
        return line

    def _texts_said(self, line: Line) -> Iterator[str]:
        """The texts that a line can be, as far as it is known what its values can be."""
        for choice in product(*(self._choices(part) for part in line.parts)):
            if self._can_be(choice):
                yield "".join(word for word, _ in choice)

    def _may_change(self, value: Term) -> bool:
        """Whether a value is made of registers that rules set, whose range may be wider than what happens."""
        return any(
            isinstance(part, Read) and self._resolver.registers.is_set(part.path) for part in walk(value)
        )


@dataclass(frozen=True)
class _Filling:
    """A text that fills a slot of a member's frame; `drawn` is the condition that it is this one of several."""

    member: str
    slot: str
    path: DataPath
    text: ast.Text
    drawn: Term | None

    def scope(self, user: Scope) -> Scope:
        """What its names mean where it is put in."""
        draws = Draws(f"cast.{self.member}.with.{self.slot}")
        return Scope(self.path, draws, member=self.member, outer=user.draws)


def _varies(part: str | Term | None) -> TypeGuard[Term]:
    """Whether a part of a text is a value that is not known."""
    return isinstance(part, Term) and not isinstance(part, Const)


def _given(condition: Term | None) -> list[Term]:
    return [] if condition is None else [condition]


def sayable(resolver: Resolver, node: ast.Expr, scope: Scope) -> Term:
    """A value inside a text: something that words stand for."""
    if isinstance(node, ast.Compare | ast.Logic | ast.Not | ast.Member):
        message = f"`{quoted(node)}` is a condition; only a value can be said"
        raise resolver.fail("S402", message, node, scope)
    if resolve_groups.is_group(resolver, node, scope):
        message = f"`{quoted(node)}` is a group; `pick({quoted(node)})` says one of them"
        raise resolver.fail("S402", message, node, scope)
    term = resolver.value(node, None, scope)
    if term.type.kind not in _SAYABLE:
        what = described(term.type)
        hint = f"say its colour or name: <{quoted(node)}.color>" if term.type.kind == "entity" else None
        raise resolver.fail(
            "S402", f"`{quoted(node)}` is {what}, which cannot be said", node, scope, hint=hint
        )
    return term


def texts_of(line: Line) -> list[str]:
    """Every text that a line can be, in the order of its values; at most MAX_TEXTS."""
    choices = [[part] if isinstance(part, str) else _words(part.type) for part in line.parts]
    texts: list[str] = []
    for words in product(*choices):
        if len(texts) == MAX_TEXTS:
            break
        texts.append("".join(words))
    return texts


def number_of_texts(line: Line) -> int:
    """How many texts a line can be."""
    count = 1
    for part in line.parts:
        count *= 1 if isinstance(part, str) else part.type.size
    return count


def _words(type_: Type) -> list[str]:
    return [spoken(type_, value) for value in range(type_.low, type_.high + 1)]


def _merged(parts: Iterable[str | Term]) -> Iterator[str | Term]:
    """The same with neighbouring pieces of text joined."""
    text = ""
    for part in parts:
        if isinstance(part, str):
            text += part
            continue
        if text:
            yield text
        text = ""
        yield part
    if text:
        yield text
