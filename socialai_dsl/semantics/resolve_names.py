"""The meaning of bare names, attributes and conditions without brackets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import chain, pairwise

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema.scenario import Sequence
from socialai_dsl.semantics import hands, object_facts, rows, slots, texts
from socialai_dsl.semantics.groups import check_moment, check_points, check_toggled, must_be_agent, subject_of
from socialai_dsl.semantics.resolver import VOCABULARIES, Resolver
from socialai_dsl.semantics.scope import (
    Define,
    Draws,
    FailedError,
    Macro,
    PlayedFrame,
    Scope,
    as_text,
    by_value,
    described,
    drawn,
    of_each,
    quoted,
    usage,
    with_article,
    words_of,
)
from socialai_dsl.semantics.signatures import (
    ACTIVITIES,
    EFFECTS,
    PLACES,
    QUANTIFIERS,
    VALUE_SYNONYMS,
    VALUES,
    WORDS,
    Signature,
)
from socialai_dsl.semantics.terms import (
    ACTION,
    BOOL,
    CELL,
    COLOR,
    DIRECTION,
    FALSE,
    TURN,
    CellOf,
    Compare,
    Const,
    FieldOf,
    Here,
    PokedNow,
    Read,
    Term,
    Type,
    Variable,
    World,
    all_of,
    any_of,
    arithmetic,
    as_number,
    entity,
    equals,
    number,
    numbers_of,
)
from socialai_dsl.source import DataPath
from socialai_dsl.vocabulary import normal

_POINTING = Type("int", 0, 4)


def toggled_by(who: Const, what: Term) -> Term:
    """Whether the agent toggled at something in this step, or an NPC did so in its last turn."""
    if who.value == 0:
        return PokedNow(what)
    return Compare("==", FieldOf(what.type, who, "toggled"), what)


def without_arguments(
    resolver: Resolver, name: str, subject: ast.Expr | None, node: ast.Expr, scope: Scope
) -> Term:
    """`subject.name` or `subject.name()`: an attribute, a condition, or a status."""
    signature = VALUES.get(name)
    if name in resolver.symbols.slots:
        signature = replace(VALUES["noun"], name=name)
    if signature is None or signature.takes:
        if name not in _statuses(resolver):
            raise _unknown_attribute(resolver, name, signature, node, scope)
        signature = Signature(name, "object", (), "condition", "")
    check_moment(resolver, signature, node, scope)
    if signature.subject == "agent":
        assert isinstance(node, ast.Call | ast.Attribute | ast.Name), "internal: an attribute has a name"
        if name == "spoke":
            return texts.spoke(resolver, node, scope)
        must_be_agent(resolver, node, scope)
        return _of_the_agent(resolver, name, node, scope)
    who = subject_of(resolver, subject, signature, node, scope)
    if who is None:
        return _cell_coordinate(resolver, name)
    if name == "unlocked_by":
        return object_facts.unlocker(resolver, who, node, scope)
    if signature.subject == "object" and name not in ("inside", "toggled"):
        return _status(resolver, name, who, node, scope)
    return _attribute(resolver, name, who, node, scope)


def _unknown_attribute(
    resolver: Resolver, name: str, signature: Signature | None, node: ast.Expr, scope: Scope
) -> FailedError:
    if signature is not None:
        return resolver.fail(
            "S211", f"`{name}` needs something in brackets: `{usage(signature)}`", node, scope
        )
    if name == "believes" and isinstance(node, ast.Attribute):
        return resolver.fail("S211", object_facts.unnamed(quoted(node.subject)), node, scope)
    synonym = VALUE_SYNONYMS.get(name)
    if synonym:
        return resolver.fail(
            "S205", f"nothing here has a `{name}`; write `{usage(VALUES[synonym])}`", node, scope
        )
    known = [s.name for s in VALUES.values() if not s.takes and s.subject != "none"]
    declared = [*resolver.symbols.scenario.looks, *_of_frame(resolver, node)]
    near = did_you_mean(name, [*known, *sorted(_statuses(resolver)), *declared])
    near = near or did_you_mean(name, [s.name for s in VALUES.values() if s.subject != "none"])
    return resolver.fail("S205", f"nothing here has a `{name}`", node, scope, suggestion=near)


def _of_frame(resolver: Resolver, node: ast.Expr) -> list[str]:
    """The registers and slots of the member of the cast that is named before the dot."""
    subject = node.subject if isinstance(node, ast.Attribute) else None
    played = resolver.frames.get(subject.id) if isinstance(subject, ast.Name) else None
    return [*played.model.slots, *played.model.let] if played is not None else []


def _of_the_agent(resolver: Resolver, name: str, node: ast.Expr, scope: Scope) -> Term:
    if name in resolver.symbols.slots:
        return _in_slot(resolver, name, heard=False)
    if name == "noun":
        texts.no_nouns(resolver, node, scope)
        return World(resolver.symbols.nouns, "noun")
    assert name == "action", f"internal: the agent has no `{name}`"
    return World(ACTION, "action")


def _cell_coordinate(resolver: Resolver, name: str) -> Term:
    high = (resolver.symbols.width if name == "x" else resolver.symbols.height)[1]
    return Here(Type("int", 0, high - 1), "x" if name == "x" else "y")


def _attribute(resolver: Resolver, name: str, who: Term, node: ast.Expr, scope: Scope) -> Term:
    match name:
        case "color":
            return FieldOf(COLOR, who, "color")
        case "facing":
            return FieldOf(DIRECTION, who, "dir")
        case "x" | "y":
            high = (resolver.symbols.width if name == "x" else resolver.symbols.height)[1]
            return FieldOf(Type("int", -1, high - 1), who, "x" if name == "x" else "y")
        case "gone":
            return FieldOf(BOOL, who, "gone")
        case "was_poked":
            if resolver.symbols.object_of(who.type.high) is not None:
                message = "only an NPC remembers that it was poked"
                raise resolver.fail(
                    "S204", message, node, scope, hint="`x.poked` is whether it was in this step"
                )
            return FieldOf(BOOL, who, "poked")
        case "poked":
            return PokedNow(who)
        case "index":
            return _index(resolver, who, node, scope)
        case "cell":
            return CellOf(CELL, who)
        case "pointing":
            check_points(resolver, name, who, node, scope)
            return Compare("!=", FieldOf(_POINTING, who, "pointing"), Const(_POINTING, 0))
        case "inside":
            return object_facts.container(resolver, who, node, scope)
        case "carried":
            return hands.carried(resolver, who, node, scope)
        case "empty_handed":
            return hands.empty_handed(resolver, who, node, scope)
        case "toggled":
            check_toggled(resolver, name, who, node, scope)
            everybody = range(len(resolver.symbols.numbers))
            return any_of(toggled_by(entity(number), who) for number in everybody)
        case "turns_in_state":
            return _turns_in_state(resolver, who, node, scope)
        case "kind":
            return _kind(resolver, who, node, scope)
    assert name == "name", f"internal: no meaning for the attribute `{name}`"
    return _name(resolver, who, node, scope)


def _name(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    members = resolver.symbols.members_of(numbers_of(who))
    names = [resolver.registers.read(f"{member}.name") for member in members if member is not None]
    if len(names) < len(members):
        raise resolver.fail("S204", "only a member of the cast has a name", node, scope)
    return of_each(who, names)


def _turns_in_state(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    """The clock of a member's frame, which `after` compares as well."""
    members = resolver.symbols.members_of(numbers_of(who))
    if not all(member in resolver.frames for member in members):
        hint = "members of the cast follow one with `frame:`"
        raise resolver.fail("S204", "only who follows a frame is in a state", node, scope, hint=hint)
    turns = Type("int", 0, resolver.symbols.scenario.horizon)
    return of_each(who, [Read(turns, f"{member}.clock") for member in members])


def _kind(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    kinds = {_kind_of(resolver, n) for n in who.type.values}
    if len(kinds) > 1:
        raise resolver.fail("S204", "`kind` is known of one thing, or of things of one kind", node, scope)
    return Const(Type("text", 0, 0, (kinds.pop(),)), 0)


def _kind_of(resolver: Resolver, entity: int) -> str:
    objects = resolver.symbols.object_of(entity)
    if objects is not None:
        return objects.type.name
    member = resolver.symbols.member_of(entity)
    assert member is not None, "internal: an entity is an object or in the cast"
    return resolver.symbols.cast[member].kind or "peer"


def _index(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> Term:
    members = resolver.symbols.members_of((who.type.low, who.type.high))
    groups = [resolver.symbols.group_of(member) for member in members if member is not None]
    if len(groups) == 2 and groups[0] is not None and groups[1] is not None and groups[0][0] == groups[1][0]:
        first = who.type.low - groups[0][1]
    else:
        objects = resolver.symbols.object_of(who.type.low)
        if objects is None or who.type.high not in objects.numbers:
            raise resolver.fail("S204", "only one of a group has an `index`, its place in it", node, scope)
        first = objects.numbers[0]
    if isinstance(who, Const):
        return number(who.value - first)
    return arithmetic("-", as_number(who), number(first))


def _status(resolver: Resolver, status: str, who: Term, node: ast.Expr, scope: Scope) -> Term:
    field = status_of(resolver, who, node, scope)
    if status not in field.type.words:
        what = resolver.symbols.object_of(who.type.low)
        assert what is not None, "internal: a status belongs to an object"
        message = f"{with_article(what.type.name)} is never `{status}`; it is {' or '.join(field.type.words)}"
        raise resolver.fail("S204", message, node, scope, suggestion=did_you_mean(status, field.type.words))
    return equals(field, field.type.words.index(status))


def status_of(resolver: Resolver, who: Term, node: ast.Expr, scope: Scope) -> FieldOf:
    """The status of one object, or of one of several objects of the same type."""
    found = [resolver.symbols.object_of(n) for n in who.type.values]
    types = {objects.type.name: objects.type for objects in found if objects is not None}
    if None in found or len(types) != 1:
        several = [*types, *(["member of the cast"] if None in found else [])]
        message = f"this may be a {' or a '.join(several)}, which have no status in common"
        hint: str | None = "name objects of one type, which stand next to each other in `objects`"
        if not types:
            message, hint = "only objects have a status", None
        raise resolver.fail("S204", message, node, scope, hint=hint)
    (type_,) = types.values()
    return FieldOf(Type("status", 0, len(type_.states) - 1, type_.states), who, "status")


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
        raise FailedError  # a slot that nobody fills, which is reported where it is left empty
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
    if frame.model.slots[node.id] != "bool":
        message = f"`{node.id}` is a text: it can be said or heard, not computed with"
        raise resolver.fail("S204", message, node, scope)
    return member_truth(resolver, frame, node.id, scope)


def member_truth(resolver: Resolver, frame: PlayedFrame, slot: str, scope: Scope) -> Term:
    """The condition that fills a slot of type bool, in the file that was drawn if there are several."""
    member, paths = frame.member, frame.texts[slot]
    if paths is None:
        raise FailedError  # nobody fills it, which is reported where it is left empty
    described = resolver.symbols.alternatives[member]
    truths = [
        slot_truth(resolver, slot, described[which].with_[slot], with_scope(path, member, slot, scope))
        for which, path in enumerate(paths)
    ]
    cases = []
    for truth, numbers in by_value(truths).items():
        if truth != FALSE:
            chosen = drawn(resolver.registers.drawn_file(member), numbers)
            cases.append(truth if chosen is None else all_of([chosen, truth]))
    return any_of(cases)


def slot_truth(resolver: Resolver, slot: str, raw: object, scope: Scope) -> Term:
    """A condition that fills a slot of type bool."""
    if isinstance(raw, str) and raw.casefold() in _YES_AND_NO:
        truth = "true" if raw.casefold() in ("yes", "on", "y", "always") else "false"
        span = resolver.findings.at(scope.path, 0, len(raw))
        raise resolver.findings.fail("S204", f"slot `{slot}` is a bool: write `{truth}`", span)
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
            raise FailedError  # its group means nothing, which has been reported
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
        raise FailedError  # a role that is given wrongly, which has been reported, may be this one
    # Said once, where the role is declared: it may be spoken of in many places.
    span = resolver.findings.places.key_span(("roles", role))
    hint = f"add `role: {role}` to a member of the cast"
    raise resolver.findings.no_such(role, f"nobody plays the role `{role}`", span, hint=hint)


def _not_a_value(resolver: Resolver, kind: str, node: ast.Name, scope: Scope) -> FailedError:
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
            hint = f"write `agent.{word}`: what the agent said there in this step"
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


def _unknown(resolver: Resolver, node: ast.Name, expected: Type | None, scope: Scope) -> FailedError:
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
    called = next(
        (key for key, member in resolver.symbols.scenario.cast.items() if member.name == word), None
    )
    if called is not None:
        message, cure = (
            f"`{word}` is what somebody is called",
            "in expressions a member of the cast goes by its key",
        )
        return resolver.no_such(word, message, node, scope, suggestion=called, hint=cure)
    near, place = suggestion(resolver, word, expected, scope)
    message = f"unknown name `{word}`"
    hint: str | None = None
    if expected is not None and expected.words and expected.kind not in ("bool", "noun"):
        message = f"unknown name `{word}`, where {described(expected)} is expected"
        hint = None if near else "one of " + words_of(expected)
    elif expected is not None and expected.kind == "bool" and word.casefold() in _YES_AND_NO:
        message = f"`{word}` means nothing here; a truth is written `true` or `false`"
    whole = resolver.findings.part(scope.path)
    nouns = [noun for noun in resolver.symbols.nouns.words if normal(noun) == normal(word)]
    if nouns and (expected is None or expected.kind == "noun"):
        near, place = as_text(nouns[0], nouns[0] if whole == word else None), None
        hint = "a noun is quoted, as every text"
    elif near is None and expected is not None and expected.kind == "int" and not expected.words:
        message = f"unknown name `{word}`, where a number is expected"
    elif near is None and expected is None:
        hint = f"if a text is meant, quote it: {as_text(word, whole)}"
    return resolver.no_such(word, message, node, scope, suggestion=near, suggestion_place=place, hint=hint)


def suggestion(
    resolver: Resolver, word: str, expected: Type | None, scope: Scope
) -> tuple[str | None, str | None]:
    """The name that was probably meant, and where it is declared."""
    declared = resolver.symbols.declared
    near = did_you_mean(word, chain(declared, *_nearby(expected, scope))) or did_you_mean(
        word, [*WORDS, *VALUES]
    )
    if near is None or near not in declared:
        return near, None
    kind = declared[near]
    section = {"object": "objects"}.get(kind, kind)
    span = resolver.findings.places.key_span((section, near))
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
            return _cell_coordinate(resolver, node.name)
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
