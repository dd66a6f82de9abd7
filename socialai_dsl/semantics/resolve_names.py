"""The meaning of bare names, attributes and conditions without brackets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import chain, pairwise
from typing import Final

from socialai_dsl import cures
from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema.scenario import Sequence
from socialai_dsl.semantics import object_facts, rows, slots, texts
from socialai_dsl.semantics.cast import grouped
from socialai_dsl.semantics.groups import check_moment, must_be_agent, subject_of
from socialai_dsl.semantics.resolver import VOCABULARIES, Resolver
from socialai_dsl.semantics.scope import (
    Define,
    Draws,
    Macro,
    PlayedFrame,
    ReportedError,
    Scope,
    as_text,
    described,
    of_each,
    quoted,
    usage,
    words_of,
)
from socialai_dsl.semantics.signatures import Signature
from socialai_dsl.semantics.terms import (
    BOOL,
    FALSE,
    TURN,
    Const,
    Term,
    Type,
    Variable,
    World,
    all_of,
    any_of,
    entity,
)
from socialai_dsl.semantics.words import (
    ACTIVITIES,
    EFFECTS,
    PLACES,
    QUANTIFIERS,
    RESERVED,
    VALUE_SYNONYMS,
    VALUES,
)
from socialai_dsl.semantics.words.attributes import coordinate
from socialai_dsl.semantics.words.statuses import has_status
from socialai_dsl.semantics.words.use import Use
from socialai_dsl.source import Data, DataPath
from socialai_dsl.vocabulary import normal


def without_arguments(
    resolver: Resolver, name: str, subject: ast.Expr | None, node: ast.Expr, scope: Scope
) -> Term:
    """`subject.name` or `subject.name()`: an attribute, a condition, or a status."""
    assert isinstance(node, ast.Call | ast.Attribute | ast.Name), "internal: an attribute has a name"
    if name in resolver.symbols.slots:
        check_moment(resolver, Signature(name, "agent", momentary=True), node, scope)
        must_be_agent(resolver, node, scope)
        return _in_slot(resolver, name, heard=False)
    word = VALUES.get(name)
    if word is not None and not word.takes:
        check_moment(resolver, word, node, scope)
        return word.meaning(Use(resolver, word, node, subject, (), None, scope))
    if name not in _statuses(resolver):
        raise _unknown_attribute(resolver, name, word, node, scope)
    status = Signature(name, "object")
    who = subject_of(resolver, subject, status, node, scope)
    assert who is not None, "internal: the candidate cell has no status"
    return has_status(resolver, name, who, node, scope)


def _unknown_attribute(
    resolver: Resolver, name: str, signature: Signature | None, node: ast.Expr, scope: Scope
) -> ReportedError:
    if signature is not None:
        return resolver.fail(
            "S211", f"`{name}` needs something in brackets: `{usage(signature)}`", node, scope
        )
    if name == "believes" and isinstance(node, ast.Attribute):
        return resolver.fail("S211", object_facts.unnamed(quoted(node.subject)), node, scope)
    if isinstance(node, ast.Attribute) and isinstance(node.subject, ast.Name):
        played = resolver.frames.get(node.subject.id)
        around = resolver.around(node)
        if played is not None and name in (played.model.states or {}):
            hint = resolver.instead(f"{node.subject.id}.is({name})", node, scope, "which is a state")
            return resolver.fail("S205", f"nothing here has a `{name}`", node, scope, hint=hint)
        if name in ("state", "in_state") and isinstance(around, ast.Compare):
            for side in (around.left, around.right):
                if isinstance(side, ast.Name) and (state := _as_state(resolver, side, scope)) is not None:
                    return resolver.fail("S205", f"nothing here has a `{name}`", node, scope, hint=state)
    if (meant := synonym_of(resolver, name, node, scope)) is not None:
        return resolver.fail("S205", f"nothing here has a `{name}`", node, scope, hint=meant)
    known = [s.name for s in VALUES.values() if not s.takes and s.subject != "none"]
    declared = [*resolver.symbols.scenario.looks, *_of_frame(resolver, node)]
    near = did_you_mean(name, [*known, *sorted(_statuses(resolver)), *declared])
    near = near or did_you_mean(name, [s.name for s in VALUES.values() if s.subject != "none"])
    return resolver.fail("S205", f"nothing here has a `{name}`", node, scope, suggestion=near)


_HOLDERS: Final = ("content", "contains")
"""What authors ask of a box, and the language of what lies in it."""


def synonym_of(resolver: Resolver, name: str, node: ast.Expr, scope: Scope) -> cures.Hint:
    """The proposal to write the language's own word; only its use where what is asked is asked otherwise."""
    synonym = VALUE_SYNONYMS.get(name)
    if synonym is None:
        return None
    args = node.args if isinstance(node, ast.Call) else ()
    signature = VALUES[synonym]
    if name in _HOLDERS and isinstance(node, ast.Call | ast.Attribute) and node.subject is not None:
        holder = quoted(node.subject)
        if len(args) == 1:
            return resolver.instead(f"{quoted(args[0])}.inside == {holder}", node, scope)
        return f"what lies in it says so: `x.inside == {holder}`"
    if signature.takes == ("group",) and len(args) > 1:
        return resolver.instead(f"{synonym}({' | '.join(map(quoted, args))})", node, scope)
    if len(signature.takes) != len(args):
        return f"write `{usage(signature)}`"
    written = f"{synonym}({', '.join(map(quoted, args))})" if args else synonym
    edit = resolver.findings.instead(scope.path, node, written, only_name=True)
    return cures.write(written, edit)


def _of_frame(resolver: Resolver, node: ast.Expr) -> list[str]:
    """The registers and slots of the member of the cast that is named before the dot."""
    subject = node.subject if isinstance(node, ast.Attribute) else None
    played = resolver.frames.get(subject.id) if isinstance(subject, ast.Name) else None
    return [*played.model.slots, *played.model.let] if played is not None else []


# -- names ---------------------------------------------------------------------------------------------------


_YES_AND_NO = ("yes", "no", "on", "off", "y", "n", "never", "always")
_NOBODY_HERE = {
    "self": "the member of the cast who follows a frame; here nobody does",
    "it": "the object that a value belongs to; here there is none",
}


def name(resolver: Resolver, node: ast.Name, expected: Type | None, scope: Scope) -> Term:
    """The meaning of a bare name: nearest declaration first, then the words of the language."""
    word = node.id
    if word in scope.variables:
        return _variable(resolver, scope.variables[word], expected, scope)
    found = _own(resolver, node, expected, scope) or _declared(resolver, node, expected, scope)
    if found is not None:
        return found
    known = _language(resolver, node, scope)
    if known is not None:
        return known
    term = _word(word, expected)
    if term is not None:
        return term
    if word in VALUES and not VALUES[word].takes and word not in QUANTIFIERS:
        return without_arguments(resolver, word, None, node, scope)
    if word in _statuses(resolver) and scope.member is not None:
        return without_arguments(resolver, word, None, node, scope)
    raise _unknown(resolver, node, expected, scope)


def _variable(resolver: Resolver, bound: Term | Macro, expected: Type | None, scope: Scope) -> Term:
    if not isinstance(bound, Macro):
        return bound
    # An argument is resolved where it is used, but means what it meant to the caller.
    inner = replace(bound.scope, draws=scope.draws, outer=scope.outer, nested=scope.nested)
    return resolver.value(bound.node, expected, inner)


def _own(resolver: Resolver, node: ast.Name, expected: Type | None, scope: Scope) -> Term | None:
    """A slot, register or definition of the frame; `self` and `it`."""
    word, frame = node.id, scope.frame
    if word == "it" and scope.it is not None:
        return scope.it
    if word == "it" and scope.member is not None and resolver.symbols.group_of(scope.member) is not None:
        return entity(resolver.symbols.numbers[scope.member])
    if word == "self" and scope.member is not None:
        return entity(resolver.symbols.numbers[scope.member])
    if frame is None:
        return None
    if word in frame.texts:
        return _substituted(resolver, node, scope)
    if frame.model.slots.get(word) == "sequence":
        raise _not_a_value(resolver, "sequence", node, scope)
    if word in frame.defines:
        return expanded(resolver, frame.defines[word], {}, node, expected, scope)
    if word not in frame.model.let and word not in frame.model.slots:
        return None
    if frame.register(word) not in resolver.registers:
        raise ReportedError  # a slot that nobody fills, which is reported where it is left empty
    return single(resolver, frame.register(word), expected, node, scope)


def single(resolver: Resolver, path: str, expected: Type | None, node: ast.Expr, scope: Scope) -> Term:
    """A register that is named without a key."""
    registers = resolver.registers
    if registers.keys(path):
        name = path.rpartition(".")[2]
        message = f"there is a `{name}` for each of a group: write `{name}({rows.example(resolver, path)})`"
        raise resolver.fail("S211", message, node, scope)
    return registers.read(path, expected, resolver.findings.node(scope.path, node))


def _substituted(resolver: Resolver, node: ast.Name, scope: Scope) -> Term:
    """A slot that is put in wherever it is used: bool ones as conditions, texts only where something is said."""
    frame = scope.frame
    assert frame is not None, "internal: a slot outside a frame"
    if frame.model.slots[node.id] == "bool":
        return member_truth(resolver, frame, node.id, scope)
    if frame.model.slots[node.id] == "text":
        return _member_text(resolver, node, scope)
    message = f"`{node.id}` is an utterance: it can be said or heard, not computed with"
    raise resolver.fail("S204", message, node, scope)


def _member_text(resolver: Resolver, node: ast.Name | ast.Attribute, scope: Scope) -> Term:
    """The text that fills a slot; with `<...>` it can only be said."""
    slot = texts.text_slot(resolver, node, scope)
    assert slot is not None, "internal: a slot of type text"
    if any(filling.text.plain is None for filling in slot):
        message = f"`{quoted(node)}` is filled with a text that has <...>: it can be said or heard, not computed with"
        raise resolver.fail("S204", message, node, scope)
    return texts.plain_text(slot)


def member_truth(resolver: Resolver, frame: PlayedFrame, slot: str, scope: Scope) -> Term:
    """The condition that fills a slot of type bool: in one of its cases it is true."""
    filled = frame.texts[slot]
    if filled is None:
        raise ReportedError  # nobody fills it, which is reported where it is left empty
    cases = grouped(filled)
    scopes = (with_scope(case.path, frame.member, slot, scope) for case in cases)
    truths = [slot_truth(resolver, slot, case.raw, own) for case, own in zip(cases, scopes, strict=True)]
    return any_of(
        truth if case.when is None else all_of([case.when, truth])
        for case, truth in zip(cases, truths, strict=True)
        if truth != FALSE
    )


def slot_truth(resolver: Resolver, slot: str, raw: object, scope: Scope) -> Term:
    """A condition that fills a slot of type bool."""
    if isinstance(raw, str) and raw.casefold() in _YES_AND_NO:
        truth = "true" if raw.casefold() in ("yes", "on", "y", "always") else "false"
        findings = resolver.findings
        hint = cures.write(truth, cures.over_value(findings.places, scope.path, truth))
        message = f"slot `{slot}` is a bool: `true`, `false` or a condition"
        raise findings.fail("S204", message, findings.at(scope.path, 0, len(raw)), hint=hint)
    return resolver.written(raw, BOOL, scope)  # type: ignore[arg-type]


def with_scope(path: DataPath, member: str, slot: str, user: Scope) -> Scope:
    """The scope of what fills, at `path`, a slot of a member's frame, where it is substituted."""
    draws = Draws(f"cast.{member}.with.{slot}")
    return Scope(path, draws, member=member, at_reset=user.at_reset, outer=user.draws, nested=user.nested)


def _declared(resolver: Resolver, node: ast.Name, expected: Type | None, scope: Scope) -> Term | None:
    """What the scenario declares under this name."""
    symbols, word = resolver.symbols, node.id
    if word in symbols.scenario.memory or isinstance(symbols.scenario.let.get(word), Sequence):
        raise _not_a_value(resolver, "memory" if word in symbols.scenario.memory else "sequence", node, scope)
    if word in symbols.scenario.state:
        if f"state.{word}" not in resolver.registers:
            raise ReportedError  # its group means nothing, which has been reported
        return single(resolver, f"state.{word}", expected, node, scope)
    if word in symbols.scenario.looks:
        return rows.look(resolver, word, node, scope)
    if word in symbols.scenario.let:
        resolver.used.add(("let", word))
        return resolver.registers.read(f"let.{word}", expected, resolver.findings.node(scope.path, node))
    if word in symbols.defines:
        return expanded(resolver, symbols.defines[word], {}, node, expected, scope)
    if word in symbols.scenario.roles:
        word = _player(resolver, word)
    if word in symbols.numbers:
        return entity(symbols.numbers[word])
    if word in symbols.objects or word in symbols.groups:
        objects = symbols.objects.get(word)
        if objects is not None and objects.single:
            return entity(objects.numbers[0])
        many = len(objects.numbers) if objects is not None else len(symbols.groups[word])
        raise resolver.fail(
            "S204", f"`{word}` is a group of {many}, here one of them is needed", node, scope,
            hint=f"`pick({word})` draws one, `any(d in {word} where ...)` asks for any",
        )  # fmt: skip
    return None


def _player(resolver: Resolver, role: str) -> str:
    """The member that plays a role."""
    symbols = resolver.symbols
    if role in symbols.roles:
        return symbols.roles[role]
    given = [member.role for member in symbols.scenario.cast.values() if member.role is not None]
    if not set(given) <= symbols.scenario.roles.keys() or len(set(given)) < len(given):
        raise ReportedError  # a role that is given wrongly, which has been reported, may be this one
    # Said once, where the role is declared: it may be spoken of in many places.
    span = resolver.findings.places.key_span(("roles", role))
    hint = f"add `role: {role}` to a member of the cast"
    raise resolver.findings.no_such(role, f"nobody plays the role `{role}`", span, hint=hint)


def _not_a_value(resolver: Resolver, kind: str, node: ast.Name, scope: Scope) -> ReportedError:
    use = "compared with a sequence" if kind == "memory" else "performed, or compared with a memory"
    message = f"`{node.id}` is a {kind}; it can only be {use}"
    return resolver.fail("S204", message, node, scope)


def _language(resolver: Resolver, node: ast.Name, scope: Scope) -> Term | None:
    """t, W, H, and the noun, or what stood in another slot, of what was heard."""
    symbols = resolver.symbols
    match node.id:
        case "t" if scope.at_reset:
            raise resolver.fail(
                "S204", "`t` counts steps, and this is computed before the first", node, scope
            )
        case "t":
            return World(Type("int", 0, symbols.scenario.horizon), "t")
        case "W":
            return _size("width", symbols.width)
        case "H":
            return _size("height", symbols.height)
        case "noun" if _is_in_turn(scope):
            return texts.noun(resolver, node, scope)
        case word if word in symbols.slots and _is_in_turn(scope):
            return _in_slot(resolver, word, scope.hearing)
        case word if word in symbols.slots and scope.frame is None:
            hint = resolver.instead(f"agent.{word}", node, scope, "what the agent said there in this step")
            message = f"`{word}` is what a frame hears; here nothing is heard"
            raise resolver.fail("S211", message, node, scope, hint=hint)
        case "speaker":
            return texts.speaker(resolver, node, scope)
    return None


def _in_slot(resolver: Resolver, name: str, heard: bool) -> Term:
    """What stood in a slot; of what the agent said it is noted by which word, as it may have said none."""
    slot, word = resolver.symbols.slots[name], texts.in_slot(resolver, name, heard)
    value = slots.meaning(slot, word)
    if value != word and not heard:
        resolver.slot_words[value] = slot, word
    return value


def _is_in_turn(scope: Scope) -> bool:
    """Whether an expression belongs to a turn of a member of the cast, who may have heard something."""
    return (scope.frame is not None or scope.hearing) and not scope.at_reset


def _size(which: str, sizes: tuple[int, int]) -> Term:
    low, high = sizes
    if low == high:
        return Const(Type("int", low, low), low)
    return World(Type("int", low, high), "width" if which == "width" else "height")


def _word(word: str, expected: Type | None) -> Term | None:
    """A word of the expected type; without expectation, of the first vocabulary that has it."""
    if expected is not None:
        if word in expected.words:
            return Const(expected, expected.low + expected.words.index(word))
        if expected.kind == "text":
            return Const(Type("text", 0, 0, (word,)), 0)
    for type_ in VOCABULARIES:
        if word in type_.words and not (word == "none" and type_ is TURN):
            return Const(type_, type_.low + type_.words.index(word))
    return None


def _unknown(resolver: Resolver, node: ast.Name, expected: Type | None, scope: Scope) -> ReportedError:
    word = node.id
    if word == "here":
        return resolver.fail(
            "S201", "`here` is the candidate cell; it means something only in a place", node, scope
        )
    if word in _NOBODY_HERE:
        raise resolver.no_such(word, f"`{word}` is {_NOBODY_HERE[word]}", node, scope)
    if word in ACTIVITIES or word in EFFECTS or word in PLACES:
        kind = "an activity" if word in ACTIVITIES else "an effect" if word in EFFECTS else "a place"
        return resolver.fail("S204", f"`{word}` is {kind}; here a value is expected", node, scope)
    if word in VALUES:
        return resolver.fail(
            "S211", f"`{word}` needs something in brackets: `{usage(VALUES[word])}`", node, scope
        )
    if word in resolver.symbols.scenario.tables:
        return resolver.fail("S211", f"`{word}` is a table: write `{word}(key)`", node, scope)
    cast = resolver.symbols.cast
    called = next((key for key in cast if any(case.raw == word for case in cast[key].cases("name"))), None)
    if called is not None:
        message, cure = (
            f"`{word}` is what somebody is called",
            "in expressions a member of the cast goes by its key",
        )
        return resolver.no_such(word, message, node, scope, suggestion=called, hint=cure)
    if (state := _as_state(resolver, node, scope)) is not None:
        return resolver.no_such(word, f"unknown name `{word}`", node, scope, hint=state)
    near, place = suggestion(resolver, word, expected, scope)
    message = f"unknown name `{word}`"
    hint: cures.Hint = None
    if expected is not None and expected.words and expected.kind not in ("bool", "noun"):
        message = f"unknown name `{word}`, where {described(expected)} is expected"
        hint = None if near else "one of " + words_of(expected)
    elif expected is not None and expected.kind == "bool" and word.casefold() in _YES_AND_NO:
        message = f"`{word}` means nothing here; a truth is written `true` or `false`"
    whole = resolver.findings.part(scope.path)
    nouns = [noun for noun in resolver.symbols.nouns.words if normal(noun) == normal(word)]
    if nouns and (expected is None or expected.kind == "noun"):
        near, place = as_text(nouns[0], nouns[0] if whole == word else None), None
        hint = _quoting_nouns(resolver, whole, scope)
    elif near is None and expected is not None and expected.kind == "int" and not expected.words:
        message = f"unknown name `{word}`, where a number is expected"
    elif near is None and isinstance(whole, str) and whole[node.at - 1 : node.end + 1] == f"<{word}>":
        edit = cures.over_part(resolver.findings.places, scope.path, node.at - 1, node.end + 1, word)
        hint = cures.propose(
            f"if it is no value but part of the text, write `{word}` without `<` and `>`", edit
        )
    elif near is None and expected is None and not resolver.is_subject(node):
        text = as_text(word, whole)
        edit = resolver.findings.instead(scope.path, node, f'"{word}"')
        if whole == word:
            edit = cures.over_value(resolver.findings.places, scope.path, text)
        hint = cures.propose(f"if a text is meant, quote it: {text}", edit)
    return resolver.no_such(word, message, node, scope, suggestion=near, suggestion_place=place, hint=hint)


def _as_state(resolver: Resolver, node: ast.Name, scope: Scope) -> cures.Hint:
    """The proposal to ask for the state of a member, where what is compared or asked for is called like one."""
    owners = [key for key, frame in resolver.frames.items() if node.id in (frame.model.states or {})]
    if not owners:
        return None
    around = resolver.around(node)
    asked: ast.Expr | None = None
    negation = ""
    match around:
        case ast.Call(subject=subject, args=(only,)) if only is node:
            asked = subject
        case ast.Compare(op="==" | "!=" as op, left=left, right=right):
            asked = right if left is node else left
            negation = "not " if op == "!=" else ""
    if isinstance(asked, ast.Attribute) and asked.name in ("state", "in_state"):
        asked = asked.subject
    if around is not None and isinstance(asked, ast.Name) and asked.id in owners:
        return resolver.instead(f"{negation}{asked.id}.is({node.id})", around, scope)
    return f"`{node.id}` is a state of `{owners[0]}`: `{owners[0]}.is({node.id})`"


def _quoting_nouns(resolver: Resolver, whole: Data, scope: Scope) -> cures.Cure | str:
    """The proposal to quote every noun of an expression that is written without quotes."""
    known = {normal(noun): noun for noun in resolver.symbols.nouns.words}
    edits = []
    if isinstance(whole, str):
        tree = resolver.findings.expression(scope.path, whole)
        for node in tree.walk():
            if isinstance(node, ast.Name) and node.id not in scope.variables and normal(node.id) in known:
                noun = known[normal(node.id)]
                text = as_text(noun, noun) if node is tree else f'"{noun}"'
                places = resolver.findings.places
                edits.append(
                    cures.over_value(places, scope.path, text)
                    if node is tree
                    else resolver.findings.instead(scope.path, node, text)
                )
    return cures.propose("a noun is quoted, as every text", *edits)


def suggestion(
    resolver: Resolver, word: str, expected: Type | None, scope: Scope
) -> tuple[str | None, str | None]:
    """The name that was probably meant, and where it is declared."""
    declared = resolver.symbols.declared
    near = did_you_mean(word, chain(declared, *_nearby(expected, scope))) or did_you_mean(
        word, [*RESERVED, *VALUES]
    )
    few = expected is not None and expected.kind in ("look", "status") and near not in expected.words
    if few and near in RESERVED:
        near = None  # one of a few words is wanted, which are listed
    if near is None or near not in declared:
        return near, None
    kind = declared[near]
    section = {"object": "objects"}.get(kind, kind)
    span = resolver.findings.places.key_span((*section.split("."), near))
    is_here = span.file == resolver.findings.at(scope.path).file
    return near, f"{kind}, line {span.line}" if is_here else f"{kind}, {span.file}:{span.line}"


def _nearby(expected: Type | None, scope: Scope) -> Iterator[Iterable[str]]:
    """What a name can mean at one place only."""
    yield scope.variables
    yield expected.words if expected else ()
    yield ["it"] * (scope.it is not None) + ["self"] * (scope.member is not None)
    if scope.frame is not None:
        yield from (scope.frame.model.slots, scope.frame.model.let, scope.frame.defines)


def attribute(resolver: Resolver, node: ast.Attribute, scope: Scope) -> Term:
    """`subject.name`."""
    if isinstance(node.subject, ast.Attribute) and node.subject.name == "believes":
        return object_facts.believed(resolver, node.subject, node, scope)
    if node.name in resolver.symbols.scenario.looks:
        return rows.look(resolver, node.name, node, scope)
    if isinstance(node.subject, ast.Attribute) and node.name not in VALUES:
        near = did_you_mean(node.subject.name, ["believes"])
        if near is not None and node.subject.name not in VALUES:
            message = f"nothing here has a `{node.subject.name}`"
            raise resolver.fail("S205", message, node.subject, scope, suggestion=near)
    if isinstance(node.subject, ast.Name):
        owner = node.subject.id
        if owner == "here" and node.name in ("x", "y") and scope.here:
            return coordinate(resolver, node.name, None)
        several = scope.variables.get(owner)
        if isinstance(several, Variable) and node.name not in VALUES:
            found = _of_each(resolver, several, node.name)
            if found is not None:
                return found
        if several is None and owner in resolver.symbols.scenario.let and node.name not in VALUES:
            found = _of_each(resolver, resolver.value(node.subject, None, scope), node.name)
            if found is not None:
                return found
        if owner not in scope.variables and node.name not in VALUES:
            owner = resolver.symbols.roles.get(owner, owner)
            register, played = f"{owner}.{node.name}", resolver.frames.get(owner)
            if register in resolver.registers:
                return single(resolver, register, None, node, scope)
            if played is not None and played.model.slots.get(node.name) == "bool":
                return member_truth(resolver, played, node.name, scope)
            if played is not None and played.model.slots.get(node.name) == "text":
                return _member_text(resolver, node, scope)
        # Nothing is known of the attributes of an unknown member.
        known = node.name in VALUES or node.name in _statuses(resolver)
        if not known and resolver.means_nothing(node.subject.id, scope):
            raise _unknown(resolver, node.subject, None, scope)
    return without_arguments(resolver, node.name, node.subject, node, scope)


def _of_each(resolver: Resolver, who: Term, name: str) -> Term | None:
    """A register that each of several members has in its frame: that of the one who is meant. None if some lack it."""
    if who.type.kind != "entity" or who.type.high >= len(resolver.symbols.numbers):
        return None
    members = resolver.symbols.members_of(who.type.values)
    if not all(f"{member}.{name}" in resolver.registers for member in members):
        return None
    if any(resolver.registers.keys(f"{member}.{name}") for member in members):
        return None
    values = [resolver.registers.read(f"{member}.{name}") for member in members]
    return of_each(who, values) if len({value.type.kind for value in values}) == 1 else None


def _statuses(resolver: Resolver) -> set[str]:
    return {state for type_ in resolver.symbols.types.values() for state in type_.states}


def expanded(
    resolver: Resolver,
    define: Define,
    arguments: Mapping[str, ast.Expr],
    node: ast.Expr,
    expected: Type | None,
    scope: Scope,
) -> Term:
    """The value of a definition where it is used; `arguments` are resolved in the user's scope."""
    resolver.used.add(define.path)
    if len(arguments) != len(define.parameters):
        wanted = ", ".join(define.parameters)
        raise resolver.fail("S211", f"`{define.name}` takes ({wanted})", node, scope)
    if define.name in scope.within:
        circle = [*scope.within[scope.within.index(define.name) :], define.name]
        needs = " and ".join(f"`{a}` needs `{b}`" for a, b in pairwise(circle))
        raise resolver.findings.fail("S208", needs, resolver.findings.places.key_span(define.path))
    inner = replace(
        scope,
        path=define.path,
        frame=scope.frame if "frames" in define.path else None,
        member=scope.member if "frames" in define.path else None,
        variables={parameter: Macro(argument, scope) for parameter, argument in arguments.items()},
        within=(*scope.within, define.name),
    )
    return resolver.written(define.raw, expected, inner)
